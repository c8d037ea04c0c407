//! From axes to jobs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::edit::{EnvironmentField, Target, set_render};
use super::error::{Diagnostic, ManifestError, ManifestErrors};
use super::model::{Axis, Manifest, Setting};
use super::names::{axis_keys, job_name, plain_name, stem};
use crate::record::{Coordinate, Job, Override, Value};

/// The largest number of overrides of all jobs together: a few gigabytes.
const MAX_OVERRIDES: u64 = 10_000_000;

/// One job a combination of scene and axes' values, the last axis fastest, without those that `exclude` drops.
///
/// `scenes` are the files that the caller found for [`Manifest::scene_patterns`], in order; they are used as they are. An axis
/// over `scene` has its own, relative to the manifest's folder. Overrides come in the order in which they are applied; those
/// of `render` and `camera.name` are in the settings already, and images' files are relative to the working folder.
///
/// # Errors
/// If no scene was found, if there are more jobs than `max_jobs`, if two would have the same name (in letters of any case), or
/// if `exclude` drops nothing or everything.
pub fn expand(manifest: &Manifest, scenes: &[PathBuf]) -> Result<Vec<Job>, ManifestErrors> {
    let fail = |diagnostics| ManifestErrors::new(manifest.source.clone(), diagnostics);
    let own_scenes = manifest.axes.iter().flat_map(Axis::paths).any(|p| p.value == "scene");
    if scenes.is_empty() && !own_scenes {
        return Err(manifest.no_scene(0));
    }
    let jobs = manifest.count(scenes.len().max(1) as u64);
    if jobs > manifest.max_jobs {
        let span = manifest.axes.last().map_or(0..0, |a| a.span.clone());
        let error = ManifestError::TooManyJobs { jobs, limit: manifest.max_jobs };
        return Err(fail(vec![Diagnostic::new(error, span)]));
    }
    let overrides = (manifest.fixed().count() + manifest.axes.iter().flat_map(Axis::paths).count()) as u64;
    if jobs.saturating_mul(overrides) > MAX_OVERRIDES {
        let error = ManifestError::TooManyOverrides { jobs, overrides, limit: MAX_OVERRIDES };
        return Err(fail(vec![Diagnostic::new(error, 0..0)]));
    }

    let keys = axis_keys(&manifest.axes);
    let ids: Vec<String> = manifest.axes.iter().map(Axis::id).collect();
    let none = [PathBuf::new()];
    let scenes = if own_scenes { &none[..] } else { scenes };
    let with_scene = !own_scenes && (manifest.scene_is_axis || scenes.len() > 1);
    let mut jobs = Vec::with_capacity(jobs as usize);
    let mut dropped = vec![false; manifest.exclude.len()];
    for (scene_index, scene) in scenes.iter().enumerate() {
        let scene_label = with_scene.then(|| stem(scene));
        let mut chosen = vec![0; manifest.axes.len()];
        loop {
            let excluded = manifest.exclude.iter().zip(&mut dropped).fold(false, |any, (rule, hit)| {
                let matches = rule.value.iter().all(|s| holds(manifest, s, &chosen, scene_label.as_deref()));
                *hit |= matches;
                any || matches
            });
            if !excluded {
                let place = Place { scene, scene_label: scene_label.as_deref().map(|l| (scene_index, l)) };
                jobs.push(job(manifest, &keys, &ids, &place, &chosen).map_err(|d| fail(vec![*d]))?);
            }
            if !advance(&mut chosen, &manifest.axes) {
                break;
            }
        }
    }

    let useless = manifest.exclude.iter().zip(&dropped).filter(|(_, hit)| !**hit);
    let mut errors: Vec<Diagnostic> =
        useless.map(|(rule, _)| Diagnostic::new(ManifestError::ExcludesNothing, rule.span.clone())).collect();
    if jobs.is_empty()
        && let Some(rule) = manifest.exclude.first()
    {
        errors.push(Diagnostic::new(ManifestError::ExcludesAll, rule.span.clone()));
    }
    errors.extend(same_names(manifest, &jobs));
    if errors.is_empty() { Ok(jobs) } else { Err(fail(errors)) }
}

impl Manifest {
    /// The number of jobs before `exclude` for so many scenes; the largest number if it is larger.
    pub(super) fn count(&self, scenes: u64) -> u64 {
        self.axes.iter().fold(scenes, |count, axis| count.saturating_mul(axis.points.len() as u64))
    }

    /// What coordinates call the axis of that name or path; none if there is none.
    pub fn axis_id(&self, name_or_path: &str) -> Option<String> {
        if self.scene_is_axis && name_or_path == "scene" {
            return Some("scene".to_owned());
        }
        self.axes.iter().find(|a| is_called(a, name_or_path)).map(Axis::id)
    }

    /// The error that entry `index` of `scene` found no file.
    pub fn no_scene(&self, index: usize) -> ManifestErrors {
        let entry = self.scenes.get(index);
        let error = ManifestError::NoScene {
            pattern: entry.map_or("", |s| s.value.as_str()).into(),
            folder: self.folder().to_owned(),
        };
        let span = entry.map_or(0..0, |s| s.span.clone());
        ManifestErrors::new(self.source.clone(), vec![Diagnostic::new(error, span)])
    }
}

fn is_called(axis: &Axis, name_or_path: &str) -> bool {
    axis.id() == name_or_path || axis.paths().iter().any(|p| p.value == name_or_path)
}

/// A job's scene, with its index and label where the scene is an axis.
struct Place<'a> {
    scene: &'a Path,
    scene_label: Option<(usize, &'a str)>,
}

/// The job at one point of every axis.
fn job(
    manifest: &Manifest,
    keys: &[String],
    ids: &[String],
    place: &Place<'_>,
    chosen: &[usize],
) -> Result<Job, Box<Diagnostic>> {
    let mut job = Job {
        name: String::new(),
        scene: place.scene.to_owned(),
        overrides: Vec::new(),
        settings: manifest.render.clone(),
        coordinates: Vec::with_capacity(chosen.len() + 1),
    };
    for Setting { path, value } in manifest.fixed() {
        set(&mut job, manifest.folder(), &path.value, &value.value)
            .map_err(|e| Box::new(Diagnostic::new(e, path.span.clone())))?;
    }
    if let Some((index, label)) = place.scene_label {
        job.coordinates.push(Coordinate { axis: "scene".into(), index, label: label.into() });
    }
    for ((axis, id), &index) in manifest.axes.iter().zip(ids).zip(chosen) {
        let point = &axis.points[index];
        for (path, value) in axis.paths().iter().zip(&point.values) {
            set(&mut job, manifest.folder(), &path.value, value)
                .map_err(|e| Box::new(Diagnostic::new(e, point.span.clone())))?;
        }
        job.coordinates.push(Coordinate { axis: id.clone(), index, label: point.label.clone() });
    }
    let scene_key = place.scene_label.map(|_| "scene");
    let all_keys = scene_key.into_iter().chain(keys.iter().map(String::as_str));
    job.name = if job.coordinates.is_empty() {
        plain_name(&manifest.name)
    } else {
        job_name(all_keys.zip(job.coordinates.iter().map(|c| c.label.as_str())))
    };
    Ok(job)
}

/// One path of a job: in its settings, its scene, or an override.
fn set(job: &mut Job, folder: &Path, path: &str, value: &Value) -> Result<(), super::edit::EditError> {
    match (Target::parse(path)?, value) {
        (Target::Render(_), _) => set_render(&mut job.settings, path, value)?,
        (Target::Camera(super::edit::CameraField::Name), _) => {
            set_render(&mut job.settings, "render.camera", value)?;
        }
        (Target::Scene, Value::Text(file)) => job.scene = folder.join(file),
        (Target::Environment(EnvironmentField::Image), Value::Text(file)) => {
            let file = folder.join(file).to_string_lossy().into_owned();
            job.overrides.push(Override { path: path.to_owned(), value: Value::Text(file) });
        }
        _ => job.overrides.push(Override { path: path.to_owned(), value: value.clone() }),
    }
    Ok(())
}

/// The next combination, the last axis fastest; false after the last one.
fn advance(chosen: &mut [usize], axes: &[Axis]) -> bool {
    for (index, axis) in chosen.iter_mut().zip(axes).rev() {
        *index += 1;
        if *index < axis.points.len() {
            return true;
        }
        *index = 0;
    }
    false
}

/// Whether the combination has this value of an `exclude`, or the value with this label.
fn holds(manifest: &Manifest, wanted: &Setting, chosen: &[usize], scene: Option<&str>) -> bool {
    let label = match &wanted.value.value {
        Value::Text(text) => Some(text.as_str()),
        _ => None,
    };
    if manifest.scene_is_axis && wanted.path.value == "scene" {
        return label.is_some() && scene == label;
    }
    manifest.axes.iter().zip(chosen).filter(|(axis, _)| is_called(axis, &wanted.path.value)).any(
        |(axis, &index)| {
            let point = &axis.points[index];
            let mut of_path =
                axis.paths().iter().zip(&point.values).filter(|(p, _)| p.value == wanted.path.value);
            let whole = axis.id() == wanted.path.value && point.values == [wanted.value.value.clone()];
            whole || label == Some(&point.label) || of_path.any(|(_, value)| *value == wanted.value.value)
        },
    )
}

/// An error for every name that two jobs would share on a file system that ignores case.
fn same_names(manifest: &Manifest, jobs: &[Job]) -> Vec<Diagnostic> {
    const MOST: usize = 20;
    let mut seen: BTreeMap<String, &Job> = BTreeMap::new();
    let mut errors = Vec::new();
    for job in jobs {
        if let Some(first) = seen.insert(job.name.to_lowercase(), job) {
            let differs =
                job.coordinates.iter().zip(&first.coordinates).position(|(a, b)| a.index != b.index);
            let scene_axis = usize::from(job.coordinates.len() > manifest.axes.len());
            let axis = differs.and_then(|i| i.checked_sub(scene_axis)).and_then(|i| manifest.axes.get(i));
            let span = match (axis, differs) {
                (Some(axis), Some(i)) => axis.points[job.coordinates[i].index].span.clone(),
                _ => manifest.scenes.first().map_or(0..0, |s| s.span.clone()),
            };
            let error = ManifestError::SameName {
                name: job.name.as_str().into(),
                first: described(manifest, first).into(),
                second: described(manifest, job).into(),
            };
            errors.push(Diagnostic::new(error, span));
            if errors.len() == MOST {
                break;
            }
        }
    }
    errors
}

/// What a job is made of, in full: its scene and the axes' values.
fn described(manifest: &Manifest, job: &Job) -> String {
    let skip = job.coordinates.len().saturating_sub(manifest.axes.len());
    let mut parts = Vec::new();
    if skip > 0 {
        parts.push(job.scene.display().to_string());
    }
    for (axis, coordinate) in manifest.axes.iter().zip(&job.coordinates[skip..]) {
        let point = &axis.points[coordinate.index];
        let values: Vec<String> = point.values.iter().map(Value::to_string).collect();
        parts.push(format!("{} = {} (value {})", axis.id(), values.join(", "), coordinate.index + 1));
    }
    parts.join(", ")
}
