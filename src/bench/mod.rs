//! Measuring: error against time, and, in [`rays`], how fast rays are traced.
//!
//! How much work a scene is, is measured against a long render of its own. Each scene is rendered at several numbers of samples (levels) with several seeds, and once with many more samples as the reference.
//! The reference has a seed of its own: the mean of the few seeds under test would hide what they all miss.

mod error;
mod plot;
pub mod rays;
mod summary;
mod table;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

pub use error::Deviation;
pub use plot::{Curve, plot};
pub use summary::{Interval, Summary, summarize};
pub use table::{csv, table};

use crate::imagefile::{self, ImageFileError, write_exr};
use crate::job::{self, Build, JobError, LoadedScene, PlannedJob};
use crate::raster::Raster;
use crate::record::Job;
use crate::render::{Control, Prepared, RenderError, Rendered, render};
use crate::report::ChartError;

/// Why a scene can't be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The job can't be planned.
    #[error(transparent)]
    Job(#[from] JobError),
    /// It can't be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The reference can't be kept or read.
    #[error(transparent)]
    ImageFile(#[from] ImageFileError),
    /// A folder can't be made.
    #[error("{}: {cause}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The cached reference isn't what it should be.
    #[error("{} is not a picture of {size}; hint: delete it, and it is rendered again", path.display())]
    Reference {
        /// The file.
        path: PathBuf,
        /// The size it should have.
        size: String,
    },
    /// There are no rays to measure with.
    #[error("no ray of the camera meets a surface; hint: --camera and --target choose another view")]
    NothingSeen,
    /// The table can't be written.
    #[error("the table could not be made: {0}")]
    Csv(#[from] csv::Error),
    /// The chart can't be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
}

/// What is rendered of each scene.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Numbers of samples a pixel.
    pub levels: Vec<u32>,
    /// How often each is rendered.
    pub seeds: u32,
    /// Samples a pixel of the reference.
    pub reference: u32,
    /// Where references are kept.
    pub folder: PathBuf,
}

/// One render, held against the reference.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// Samples a pixel.
    pub samples: u32,
    /// The seed.
    pub seed: u64,
    /// Wall-clock seconds of the render alone.
    pub seconds: f64,
    /// Rays traced.
    pub rays: u64,
    /// How far it is off.
    #[serde(flatten)]
    pub deviation: Deviation,
}

/// A scene's runs.
#[derive(Clone, Debug, Serialize)]
pub struct Bench {
    /// The job's name.
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Samples a pixel of the reference.
    pub reference: u32,
    /// All runs, level by level.
    pub runs: Vec<Run>,
}

/// Added to a job's seed for its reference.
const REFERENCE_SEED: u64 = 1 << 40;

/// Measures a job. `watch` is told of each render before it begins.
///
/// # Errors
/// If the job can't be rendered, or the reference not kept.
pub fn measure(
    job: &Job,
    loaded: &LoadedScene,
    build: &Build,
    plan: &Plan,
    watch: &mut dyn FnMut(&str, &Arc<Control>),
) -> Result<Bench, BenchError> {
    let with = |samples: u32, seed: u64| -> Result<PlannedJob, JobError> {
        let mut job = job.clone();
        job.settings.spp = samples;
        job.settings.seed = seed;
        // Sets of samples that would stay empty are none.
        job.settings.replicates = job.settings.replicates.min(samples);
        job::plan(&job, loaded, build)
    };
    let planned = with(plan.reference, job.settings.seed + REFERENCE_SEED)?;
    let reference = reference(&planned, loaded, &plan.folder, &mut |control| {
        watch(&format!("{}: reference of {} samples", job.name, plan.reference), control);
    })?;
    let mut runs = Vec::new();
    // All levels of a seed, then the next seed: what disturbs the machine for a while disturbs all levels.
    for seed in (0..u64::from(plan.seeds)).map(|i| job.settings.seed + i) {
        for &samples in &plan.levels {
            let prepared = prepare(&with(samples, seed)?, loaded)?;
            let control = Arc::new(Control::default());
            watch(&format!("{}: {samples} samples, seed {seed}", job.name), &control);
            let start = Instant::now();
            let Rendered { raster, counts } = render(&prepared, &control)?;
            let seconds = start.elapsed().as_secs_f64();
            let deviation = error::deviation(raster.picture(), reference.picture());
            runs.push(Run { samples, seed, seconds, rays: counts.rays, deviation });
        }
    }
    runs.sort_by_key(|run| (run.samples, run.seed));
    let (width, height) = (reference.picture().window.width, reference.picture().window.height);
    Ok(Bench { name: job.name.clone(), size: [width, height], reference: plan.reference, runs })
}

fn prepare(planned: &PlannedJob, loaded: &LoadedScene) -> Result<Prepared, RenderError> {
    Prepared::new(Arc::clone(&planned.scene), Arc::clone(&loaded.geometry), &planned.settings)
}

/// The long render, from an earlier measurement of the same job where there is one.
fn reference(
    planned: &PlannedJob,
    loaded: &LoadedScene,
    folder: &Path,
    watch: &mut dyn FnMut(&Arc<Control>),
) -> Result<Raster, BenchError> {
    let path = folder.join(format!("reference-{}.exr", &planned.key[..16]));
    let prepared = prepare(planned, loaded)?;
    let (width, height) = prepared.size();
    if path.is_file() {
        let kept = imagefile::read(&path)?;
        let window = kept.picture().window;
        if (window.width, window.height) == (width, height) && kept.picture().rgb().is_some() {
            return Ok(kept);
        }
        return Err(BenchError::Reference { path, size: format!("{width} × {height}") });
    }
    let control = Arc::new(Control::default());
    watch(&control);
    let rendered = render(&prepared, &control)?.raster;
    std::fs::create_dir_all(folder).map_err(|cause| BenchError::Folder { path: folder.into(), cause })?;
    write_exr(&path, &rendered)?;
    // As it is read the next time: the file may hold fewer digits.
    Ok(imagefile::read(&path)?)
}
