//! A job that is measured, and the long render it is held against.

use std::sync::Arc;

use super::{BenchError, Plan, timed};
use crate::imagefile::{self, write_exr};
use crate::job::{self, Build, JobError, LoadedScene, PlannedJob};
use crate::raster::Raster;
use crate::record::Job;
use crate::render::{Control, Geometry, Prepared, RenderError, image_size};

/// Added to a job's seed for its reference.
const REFERENCE_SEED: u64 = 1 << 40;

/// Is told of each render before it begins.
pub type Watch<'a> = dyn FnMut(&str, &Arc<Control>) + 'a;

/// What is measured.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The job, whose numbers of samples are the plan's.
    pub job: &'a Job,
    /// Its scene.
    pub loaded: &'a LoadedScene,
    /// The program.
    pub build: &'a Build,
}

impl Subject<'_> {
    /// The seeds of a plan's renders.
    pub(super) fn seeds(&self, plan: &Plan) -> impl Iterator<Item = u64> + use<> {
        let first = self.job.settings.seed;
        (0..u64::from(plan.seeds)).map(move |i| first + i)
    }

    /// The job with so many samples.
    pub(super) fn planned(&self, samples: u32, seed: u64) -> Result<PlannedJob, JobError> {
        let mut job = self.job.clone();
        job.settings.spp = samples;
        job.settings.seed = seed;
        // Sets of samples that would stay empty are none.
        job.settings.replicates = job.settings.replicates.min(samples);
        job::plan(&job, self.loaded, self.build)
    }

    /// The job ready to be rendered, its triangles traced in `geometry`.
    pub(super) fn prepared(
        &self,
        planned: PlannedJob,
        geometry: &Arc<Geometry>,
    ) -> Result<Prepared, RenderError> {
        let environments = &self.loaded.environments;
        Prepared::sharing(planned.scene, Arc::clone(geometry), environments, &planned.settings)
    }

    /// The long render, from an earlier measurement of the same job where there is one.
    pub(super) fn reference(&self, plan: &Plan, watch: &mut Watch<'_>) -> Result<Raster, BenchError> {
        let planned = self.planned(plan.reference, self.job.settings.seed + REFERENCE_SEED)?;
        let path = plan.folder.join(format!("reference-{}.exr", &planned.key[..16]));
        let (width, height) = image_size(&planned.scene, &planned.settings)?;
        if path.is_file() {
            let kept = imagefile::read(&path)?;
            let window = kept.picture().window;
            if (window.width, window.height) == (width, height) && kept.picture().rgb().is_some() {
                return Ok(kept);
            }
            return Err(BenchError::Reference { path, size: format!("{width} × {height}") });
        }
        let prepared = self.prepared(planned, &self.loaded.geometry)?;
        let what = format!("{}: reference of {} samples", self.job.name, plan.reference);
        let (rendered, _) = timed(&prepared, &what, watch);
        let in_folder = |cause| BenchError::Folder { path: plan.folder.clone(), cause };
        std::fs::create_dir_all(&plan.folder).map_err(in_folder)?;
        write_exr(&path, &rendered.raster)?;
        // As it is read the next time: the file may hold fewer digits.
        Ok(imagefile::read(&path)?)
    }
}
