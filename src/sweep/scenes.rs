//! The scenes of a sweep's jobs, each loaded once.

use std::path::PathBuf;

use super::Sweep;
use crate::convert::ConvertOptions;
use crate::import::ImportOptions;
use crate::job::{self, LoadedScene};
use crate::manifest::edit;
use crate::record::{Job, Override};
use crate::settings::RenderSettings;

/// A scene's file and how it is read: what jobs share that need the same scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The file.
    pub path: PathBuf,
    import: ImportOptions,
    convert: ConvertOptions,
}

/// What jobs that differ in materials alone have in common.
#[derive(PartialEq)]
struct View<'j> {
    settings: &'j RenderSettings,
    overrides: Vec<&'j Override>,
}

impl<'j> View<'j> {
    fn of(job: &'j Job) -> Self {
        let overrides = job.overrides.iter().filter(|o| !o.path.starts_with("material.")).collect();
        Self { settings: &job.settings, overrides }
    }
}

/// Loaded scenes: only the last one is kept, since jobs come scene by scene, but every failure.
#[derive(Debug)]
pub struct Scenes {
    /// The library that is laid over each.
    materials: Option<PathBuf>,
    import: ImportOptions,
    last: Option<(Reading, LoadedScene)>,
    failed: Vec<(Reading, String)>,
}

impl Scenes {
    /// None loaded yet, of a manifest's sweep.
    pub fn of(sweep: &Sweep) -> Self {
        let materials = sweep.manifest.materials.as_ref().map(|file| sweep.manifest.folder().join(file));
        let import = ImportOptions { reach: sweep.reach, ..ImportOptions::default() };
        Self { materials, import, last: None, failed: Vec::new() }
    }

    /// What a job needs.
    ///
    /// # Errors
    /// If an override doesn't suit its path.
    pub fn reading(&self, job: &Job) -> Result<Reading, edit::EditError> {
        let (path, import) = (job.scene.clone(), self.import.clone());
        let mut reading = Reading { path, import, convert: ConvertOptions::default() };
        edit::choose(&mut reading.import, &mut reading.convert, &job.overrides)?;
        Ok(reading)
    }

    /// What the jobs need, each once, in order.
    ///
    /// # Errors
    /// As [`Self::reading`].
    pub fn readings(&self, jobs: &[Job]) -> Result<Vec<Reading>, edit::EditError> {
        let mut readings: Vec<Reading> = Vec::new();
        for job in jobs {
            let reading = self.reading(job)?;
            if !readings.contains(&reading) {
                readings.push(reading);
            }
        }
        Ok(readings)
    }

    /// The jobs with their places and what they need: those of one scene together, so that each scene is loaded once, and among them those
    /// that differ in materials alone, so that they can be rendered together.
    ///
    /// # Errors
    /// As [`Self::reading`].
    pub fn in_order<'j>(&self, jobs: &'j [Job]) -> Result<Vec<(usize, &'j Job, Reading)>, edit::EditError> {
        let readings = self.readings(jobs)?;
        let mut views: Vec<View<'_>> = Vec::new();
        let mut ordered = Vec::with_capacity(jobs.len());
        for (index, job) in jobs.iter().enumerate() {
            let reading = self.reading(job)?;
            let of_reading = readings.iter().position(|known| *known == reading);
            let view = View::of(job);
            let of_view = views.iter().position(|known| *known == view).unwrap_or_else(|| {
                views.push(view);
                views.len() - 1
            });
            ordered.push(((of_reading, of_view), (index, job, reading)));
        }
        ordered.sort_by_key(|(place, _)| *place);
        Ok(ordered.into_iter().map(|(_, job)| job).collect())
    }

    /// The scene.
    ///
    /// # Errors
    /// Why it can't be loaded: again and again the same words.
    pub fn get(&mut self, wanted: &Reading) -> Result<&LoadedScene, String> {
        if let Some((_, error)) = self.failed.iter().find(|(reading, _)| reading == wanted) {
            return Err(error.clone());
        }
        let loaded = match self.last.take() {
            Some((last, loaded)) if last == *wanted => loaded,
            other => {
                // One at a time is in memory.
                drop(other);
                let Reading { path, import, convert } = wanted;
                job::load(path, import, convert, self.materials.as_deref()).map_err(|error| {
                    let message = error.told();
                    self.failed.push((wanted.clone(), message.clone()));
                    message
                })?
            }
        };
        Ok(&self.last.insert((wanted.clone(), loaded)).1)
    }
}
