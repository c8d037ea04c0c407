//! Planning a job, doing it, and recording how it went.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::identity::identify;
use super::load::EnvironmentFile;
use super::{Build, JobError, LoadedScene};
use crate::compare::{self, Options, StrictLimits, Thresholds, strict};
use crate::imagefile;
use crate::import::FileDigest;
use crate::manifest::edit;
use crate::output::Provenance;
use crate::raster::{Attribute, Layer, Raster};
use crate::record::{Counts, CrossCheck, Job, JobRecord, Outcome, Timings, Verdict, Warning};
use crate::render::image_size;
use crate::scene::Scene;
use crate::settings::RenderSettings;

/// A job whose overrides are applied.
#[derive(Clone, Debug)]
pub struct PlannedJob {
    /// The job.
    pub job: Job,
    /// The scene with the overrides.
    pub scene: Arc<Scene>,
    /// The settings with the overrides.
    pub settings: RenderSettings,
    /// Hash of everything that can change a bit (hex).
    pub identity: String,
    /// The same without the executable (hex).
    pub key: String,
    /// What was noticed about the images that overrides name.
    pub warnings: Vec<Warning>,
}

impl PlannedJob {
    /// What its image tells about its origin; with a limit of time, which the render was told.
    pub fn provenance<'a>(&'a self, build: &'a Build, time_limit: Option<Duration>) -> Provenance<'a> {
        Provenance {
            identity: &self.identity,
            key: &self.key,
            job: &self.job,
            settings: &self.settings,
            build: build.version,
            feature_level: build.feature_level,
            time_limit,
        }
    }
}

/// Where results go and what they are compared with.
#[derive(Clone, Debug)]
pub struct Destination {
    /// The folder of images and records.
    pub folder: PathBuf,
    /// The references, if any.
    pub references: Option<References>,
}

/// Reference images and how far results may be off.
#[derive(Clone, Debug)]
pub struct References {
    /// The folder.
    pub folder: PathBuf,
    /// The built-in comparison's limits.
    pub limits: StrictLimits,
    /// The same for `idiff`.
    pub thresholds: Thresholds,
    /// The real `idiff`, if it is installed.
    pub idiff: Option<PathBuf>,
}

/// The image of a job.
pub fn image_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.exr"))
}

/// The record of a job.
pub fn record_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.json"))
}

/// Applies a job's overrides to its scene and works out its identity.
///
/// # Errors
/// If an override does not fit the scene or names an image that can't be read.
pub fn plan(job: &Job, loaded: &LoadedScene, build: &Build) -> Result<PlannedJob, JobError> {
    let mut scene = (*loaded.scene).clone();
    let mut settings = job.settings.clone();
    let mut images: Vec<FileDigest> = Vec::new();
    let mut warnings: Vec<Warning> = Vec::new();
    check_environment(job, &scene)?;
    edit::apply_all(&mut scene, &mut settings, &job.overrides, &mut |path| {
        let EnvironmentFile { image, digest, warning } = loaded.environment_file(path)?;
        images.push(digest);
        warnings.extend(warning);
        Ok(image)
    })?;
    for image in &mut scene.images[loaded.scene.images.len()..] {
        *image = loaded.environments.known(image);
    }
    // However the size is given, it is the same image.
    let (width, height) = image_size(&scene, &settings)?;
    (settings.width, settings.height) = (Some(width), Some(height));
    let files: Vec<&FileDigest> = loaded.files.iter().chain(&images).collect();
    let (identity, key) =
        identify(job, &files, (&loaded.import_options, &loaded.convert_options), &settings, build);
    Ok(PlannedJob { job: job.clone(), scene: Arc::new(scene), settings, identity, key, warnings })
}

/// Whether overrides turn or dim an environment that there is: to make a white one for them would light the scene unasked.
fn check_environment(job: &Job, scene: &Scene) -> Result<(), edit::EditError> {
    let sets = |fields: &[&str]| {
        job.overrides
            .iter()
            .find(|o| o.path.strip_prefix("environment.").is_some_and(|f| fields.contains(&f)))
    };
    match sets(&["intensity", "rotation"]) {
        Some(o) if scene.environment.is_none() && sets(&["image", "color", "kind"]).is_none() => {
            let why = "the scene has no environment; environment.image or environment.color makes one";
            Err(edit::EditError::NotApplicable { path: o.path.clone(), why })
        }
        _ => Ok(()),
    }
}

/// The record of an earlier run of the same identity whose image is still what it was; nothing otherwise.
pub fn finished(planned: &PlannedJob, folder: &Path) -> Option<JobRecord> {
    let record = read_record(&record_path(folder, &planned.job.name)).ok()?;
    let same = record.identity == planned.identity && record.outcome == Outcome::Done;
    (same && is_intact(&record, folder)).then_some(record)
}

/// Every output of a record is what it was when the record was written.
fn is_intact(record: &JobRecord, folder: &Path) -> bool {
    let intact = |(name, digest): (&String, &String)| {
        fs::read(folder.join(name)).is_ok_and(|bytes| blake3::hash(&bytes).to_hex().as_str() == digest)
    };
    !record.outputs.is_empty() && record.outputs.iter().all(intact)
}

/// The record of finished work on this very job, whatever the state of its scene and of the program: its image is intact.
pub fn recorded(job: &Job, folder: &Path) -> Option<JobRecord> {
    let record = read_record(&record_path(folder, &job.name)).ok()?;
    let same = record.job.overrides == job.overrides && record.job.settings == job.settings;
    (same && record.outcome == Outcome::Done && is_intact(&record, folder)).then_some(record)
}

/// The record of a job that could not even be planned, written to its place; but the record of finished work stays: the scene may
/// come back.
///
/// # Errors
/// If the record can't be written.
pub fn failed_record(job: &Job, build: &Build, folder: &Path, error: &str) -> Result<JobRecord, JobError> {
    let mut record = blank_record(job, build, folder);
    record.outcome = Outcome::Failed { error: error.to_owned() };
    if recorded(job, folder).is_none() {
        write_record(&record, folder)?;
    }
    Ok(record)
}

/// Compares the finished image of an earlier run again, since references may have changed, and keeps the new verdict.
///
/// # Errors
/// If the record can't be written.
pub fn recheck(record: &mut JobRecord, destination: &Destination) -> Result<(), JobError> {
    let path = image_path(&destination.folder, &record.job.name);
    let (verdict, cross_check) = match &destination.references {
        None => (Verdict::NotCompared, CrossCheck::NotRun),
        Some(references) => match imagefile::read(&path) {
            Ok(raster) => compare_with_reference(&path, &raster, &record.job.name, references),
            Err(error) => (Verdict::Error { why: error.to_string() }, CrossCheck::NotRun),
        },
    };
    if (&verdict, &cross_check) != (&record.verdict, &record.cross_check) {
        (record.verdict, record.cross_check) = (verdict, cross_check);
        write_record(record, &destination.folder)?;
    }
    Ok(())
}

/// Compares a result with its reference by the built-in comparator, and lets the real `idiff` confirm it. The reference decides
/// which of the result's channels are compared.
pub(super) fn compare_with_reference(
    path: &Path,
    result: &Raster,
    name: &str,
    references: &References,
) -> (Verdict, CrossCheck) {
    let reference_path = image_path(&references.folder, name);
    if !reference_path.exists() {
        let path = reference_path.display().to_string();
        return (Verdict::MissingReference { path }, CrossCheck::NotRun);
    }
    let outcome = || -> Result<(Verdict, CrossCheck), JobError> {
        let reference = imagefile::read(&reference_path)?;
        let comparable = restricted_to(result, &reference);
        let mut verdict = strict::compare(&comparable, &reference, &references.limits)?.verdict();
        if let Verdict::Differs { why, .. } | Verdict::Shape { why } = &mut verdict
            && key_of(result) != key_of(&reference)
        {
            why.push_str(
                "; the reference is of another job: scene, parameters or settings have changed since",
            );
        }
        let program = references.idiff.as_deref();
        let check =
            compare::cross_check(program, path, &reference_path, &references.thresholds, Options::default())?;
        Ok((verdict, check))
    };
    outcome().unwrap_or_else(|error| (Verdict::Error { why: error.to_string() }, CrossCheck::NotRun))
}

/// The key in an image's header.
fn key_of(image: &Raster) -> Option<&Attribute> {
    image.picture().attribute("pipeline:key")
}

/// The channels of a result that its reference has too; what the result lacks is left out and shows as a difference of shape.
fn restricted_to(result: &Raster, reference: &Raster) -> Raster {
    let layers = reference
        .layers
        .iter()
        .filter_map(|wanted| {
            let layer = result.layer(&wanted.name)?;
            let channels =
                layer.channels.iter().filter(|c| wanted.channel(&c.name).is_some()).cloned().collect();
            Some(Layer { channels, ..layer.clone() })
        })
        .collect();
    Raster { display: result.display, layers }
}

/// What a reference keeps of a result: the picture, its variance and its sample counts. All that a comparison needs, at less than
/// half the size.
pub fn reference_of(result: &Raster) -> Raster {
    let keeps = |layer: &Layer, channel: &str| {
        layer.name == "beauty" || channel == "samples" || channel.starts_with("variance.")
    };
    let layers = result
        .layers
        .iter()
        .map(|layer| {
            let channels = layer.channels.iter().filter(|c| keeps(layer, &c.name)).cloned().collect();
            Layer { channels, ..layer.clone() }
        })
        .filter(|layer: &Layer| !layer.channels.is_empty())
        .collect();
    Raster { display: result.display, layers }
}

pub(super) fn blank_record(job: &Job, build: &Build, folder: &Path) -> JobRecord {
    let earlier = read_record(&record_path(folder, &job.name)).map_or(0, |r| r.attempt);
    JobRecord {
        job: job.clone(),
        identity: String::new(),
        key: String::new(),
        outcome: Outcome::Done,
        verdict: Verdict::NotCompared,
        cross_check: CrossCheck::NotRun,
        size: [0, 0],
        counts: Counts::default(),
        skipped: Vec::new(),
        warnings: Vec::new(),
        timings: Timings::default(),
        host: format!("{} {} ({})", std::env::consts::OS, std::env::consts::ARCH, build.feature_level),
        attempt: earlier.saturating_add(1),
        outputs: BTreeMap::new(),
    }
}

fn read_record(path: &Path) -> Result<JobRecord, JobError> {
    let bytes = fs::read(path).map_err(|cause| JobError::File { path: path.to_owned(), cause })?;
    serde_json::from_slice(&bytes).map_err(|cause| JobError::Record { path: path.to_owned(), cause })
}

/// Writes a record to its place.
///
/// # Errors
/// If it can't be written.
pub fn write_record(record: &JobRecord, folder: &Path) -> Result<(), JobError> {
    let path = record_path(folder, &record.job.name);
    let mut text = serde_json::to_vec_pretty(record).expect("plain data has a JSON form");
    text.push(b'\n');
    Ok(imagefile::write_whole(&path, &text)?)
}
