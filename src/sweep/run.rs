//! Doing the jobs of a sweep.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::scenes::Scenes;
use super::work::Work;
use super::{Sweep, SweepError, SweepResult, present};
use crate::compare::{Limits, StrictLimits, Thresholds, find_idiff};
use crate::imagefile;
use crate::job::{self, Build, Destination, References};
use crate::manifest::{self, CompareSpec};
use crate::record::{Job, JobRecord};
use crate::render::Control;

/// How a sweep is run.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The folder of results, instead of the manifest's.
    pub folder: Option<PathBuf>,
    /// Render again what is already there.
    pub force: bool,
    /// Stop after the first job that fails.
    pub fail_fast: bool,
    /// Only a part of the jobs.
    pub shard: Option<Shard>,
    /// The most jobs that are rendered together; few enough that a killed run loses little where absent.
    pub together: Option<NonZeroUsize>,
    /// The real `idiff`; looked for where absent.
    pub idiff: Option<PathBuf>,
}

/// The `index`-th of `count` parts of the jobs, split by name: every machine comes to the same split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub index: u32,
    /// At least 1.
    pub count: u32,
}

impl Shard {
    /// The names of its jobs: every `count`-th in the order of the names' hashes, so that neighbours on an axis, which take alike
    /// long, are spread over the shards.
    pub fn names(self, jobs: &[Job]) -> BTreeSet<&str> {
        let mut names: Vec<&str> = jobs.iter().map(|job| job.name.as_str()).collect();
        names.sort_by_key(|name| *blake3::hash(name.as_bytes()).as_bytes());
        names.into_iter().skip(self.index as usize - 1).step_by(self.count as usize).collect()
    }
}

/// Somebody who watches a sweep.
pub trait Observer {
    /// Some jobs, at least one, are about to be rendered together; `control` tells how far they are.
    fn started(&mut self, jobs: &[&Job], control: &Arc<Control>);
    /// A job is done, failed, or was found finished.
    fn finished(&mut self, record: &JobRecord, reused: bool);
    /// A job belongs to another shard.
    fn left_out(&mut self, job: &Job);
}

/// Nobody watches.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {
    fn started(&mut self, _: &[&Job], _: &Arc<Control>) {}
    fn finished(&mut self, _: &JobRecord, _: bool) {}
    fn left_out(&mut self, _: &Job) {}
}

/// Runs a sweep: every path of the manifest is checked against every scene first; then jobs are rendered, together where they can be, or reused,
/// and at last the sheet and the page are made of what is there.
///
/// # Errors
/// If the manifest does not fit a scene, or results can't be kept. A job that fails is no error but a record.
pub fn run(sweep: &Sweep, options: &Options, observer: &mut dyn Observer) -> Result<SweepResult, SweepError> {
    let folder = options.folder.clone().unwrap_or_else(|| sweep.folder.clone());
    create_folders(sweep, &folder)?;
    let build = Build::current()?;
    let references = match &sweep.manifest.compare {
        Some(spec) => Some(references(sweep, spec, options.idiff.as_deref())?),
        None => None,
    };
    let destination = Destination { folder, references };

    let mut scenes = Scenes::of(sweep);
    check_with(sweep, &mut scenes)?;

    let wanted = options.shard.map(|shard| shard.names(&sweep.jobs));
    let mut work = Work::new(&build, &destination, options, observer);
    let mut last = None;
    for (index, job, reading) in scenes.in_order(&sweep.jobs)? {
        if wanted.as_ref().is_some_and(|names| !names.contains(job.name.as_str())) {
            work.observer.left_out(job);
            continue;
        }
        // Two scenes need not be in memory at once.
        if last.as_ref() != Some(&reading) {
            work.render_waiting()?;
        }
        work.take(index, job, scenes.get(&reading))?;
        if work.is_over() {
            break;
        }
        last = Some(reading);
    }
    let (records, reused) = work.end()?;
    let presentation = present::present(sweep, &records, reused, &destination.folder);
    Ok(SweepResult { records, reused, presentation })
}

/// Checks every path and value of the manifest against every scene, and tells which scenes can't be loaded.
///
/// # Errors
/// If the manifest does not fit a scene that can be loaded.
pub fn check(sweep: &Sweep) -> Result<Vec<String>, SweepError> {
    check_with(sweep, &mut Scenes::of(sweep))
}

fn check_with(sweep: &Sweep, scenes: &mut Scenes) -> Result<Vec<String>, SweepError> {
    let mut unreadable = Vec::new();
    for reading in scenes.readings(&sweep.jobs)? {
        match scenes.get(&reading) {
            Ok(loaded) => manifest::check(&sweep.manifest, &loaded.scene, &reading.path)?,
            Err(error) => unreadable.push(error),
        }
    }
    Ok(unreadable)
}

/// The folder of results and those that job names lead into, without what a killed run left half written.
fn create_folders(sweep: &Sweep, folder: &Path) -> Result<(), SweepError> {
    let images = sweep.jobs.iter().map(|job| job::image_path(folder, &job.name));
    let parents: std::collections::BTreeSet<PathBuf> =
        images.filter_map(|path| path.parent().map(Path::to_owned)).collect();
    for path in parents.into_iter().chain([folder.to_owned()]) {
        std::fs::create_dir_all(&path)
            .and_then(|()| imagefile::remove_leftovers(&path))
            .map_err(|cause| SweepError::Folder { path, cause })?;
    }
    Ok(())
}

fn references(sweep: &Sweep, spec: &CompareSpec, idiff: Option<&Path>) -> Result<References, SweepError> {
    let number = |value: Option<f64>, default: f32| value.map_or(default, |v| v as f32);
    let count = |value: Option<u64>| u32::try_from(value.unwrap_or(0)).unwrap_or(u32::MAX);
    let (limits, thresholds) = (Limits::default(), Thresholds::default());
    Ok(References {
        folder: sweep.manifest.folder().join(&spec.references),
        limits: StrictLimits {
            picture: Limits {
                fail: number(spec.fail, limits.fail),
                fail_relative: number(spec.failrelative, limits.fail_relative),
                fail_percent: number(spec.failpercent, limits.fail_percent),
                allow_failures: count(spec.allowfailures),
                hard_fail: number(spec.hardfail, limits.hard_fail),
                mean: number(spec.mean, limits.mean),
                rms: number(spec.rms, limits.rms),
            },
            layers: BTreeMap::new(),
        },
        thresholds: Thresholds {
            fail: number(spec.fail, thresholds.fail),
            failpercent: number(spec.failpercent, thresholds.failpercent),
            failrelative: number(spec.failrelative, thresholds.failrelative),
            hardfail: number(spec.hardfail, thresholds.hardfail),
            allowfailures: count(spec.allowfailures),
            warn: number(spec.warn, thresholds.warn),
            warnpercent: number(spec.warnpercent, thresholds.warnpercent),
            warnrelative: number(spec.warnrelative, thresholds.warnrelative),
            hardwarn: number(spec.hardwarn, thresholds.hardwarn),
        },
        idiff: find_idiff(idiff)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_belongs_to_one_shard_and_shards_are_even() {
        let job = |i: u32| Job {
            name: format!("roughness={i}"),
            scene: PathBuf::new(),
            overrides: Vec::new(),
            settings: crate::settings::RenderSettings::default(),
            coordinates: Vec::new(),
        };
        let jobs: Vec<Job> = (0..11).map(job).collect();
        let shards: Vec<_> = (1..=4).map(|index| Shard { index, count: 4 }.names(&jobs)).collect();
        let sizes: Vec<usize> = shards.iter().map(BTreeSet::len).collect();
        assert_eq!(sizes, [3, 3, 3, 2]);
        assert_eq!(shards.iter().flatten().collect::<BTreeSet<_>>().len(), 11);
    }
}
