//! Measuring: error against time, in [`ablation`] what each technique has to do with it, and in [`rays`] how fast rays are traced.
//!
//! How much work a scene is, is measured against a long render of its own. Each scene is rendered at several numbers of samples (levels)
//! with several seeds, and once with many more samples as the reference. That has a seed of its own: the mean of the few seeds under test
//! would hide what they all miss.

pub mod ablation;
mod error;
mod plot;
pub mod rays;
mod subject;
mod summary;
mod table;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

pub use error::Deviation;
pub use plot::{Curve, plot};
pub use subject::{Subject, Watch};
pub use summary::{Interval, Summary, summarize};
pub use table::{csv, table};

use crate::imagefile::ImageFileError;
use crate::job::JobError;
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

/// Measures a job. `watch` is told of each render before it begins.
///
/// # Errors
/// If the job can't be rendered, or the reference not kept.
pub fn measure(subject: &Subject<'_>, plan: &Plan, watch: &mut Watch<'_>) -> Result<Bench, BenchError> {
    let name = &subject.job.name;
    let reference = subject.reference(plan, watch)?;
    let mut runs = Vec::new();
    // All levels of a seed, then the next seed: what disturbs the machine for a while disturbs all levels.
    for seed in subject.seeds(plan) {
        for &samples in &plan.levels {
            let prepared = subject.prepared(subject.planned(samples, seed)?, &subject.loaded.geometry)?;
            let what = format!("{name}: {samples} samples, seed {seed}");
            let (Rendered { raster, counts, .. }, seconds) = timed(&prepared, &what, watch);
            let deviation = error::deviation(raster.picture(), reference.picture());
            runs.push(Run { samples, seed, seconds, rays: counts.rays, deviation });
        }
    }
    runs.sort_by_key(|run| (run.samples, run.seed));
    let (width, height) = (reference.picture().window.width, reference.picture().window.height);
    Ok(Bench { name: name.clone(), size: [width, height], reference: plan.reference, runs })
}

/// A render, and the wall-clock seconds it took.
fn timed(scene: &Prepared, what: &str, watch: &mut Watch<'_>) -> (Rendered, f64) {
    let control = Arc::new(Control::default());
    watch(what, &control);
    let start = Instant::now();
    let rendered = render(scene, &control);
    (rendered, start.elapsed().as_secs_f64())
}
