//! Rendering planned jobs: those that differ in materials alone together, so that what their paths have in common is traced once.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use super::run::{blank_record, compare_with_reference, write_record};
use super::{Build, Destination, JobError, LoadedScene, PlannedJob, image_path};
use crate::imagefile;
use crate::output::stamp;
use crate::record::{JobRecord, Outcome, Warning};
use crate::render::{Control, Prepared, Rendered, Variants, render_together};

/// A job that is ready to be rendered.
#[derive(Debug)]
pub struct Ready {
    planned: PlannedJob,
    prepared: Prepared,
    /// What is known of it so far.
    record: JobRecord,
}

/// Prepares a job. What fails is told in the record, which is not written yet.
///
/// # Errors
/// The record of a job that can't be rendered.
pub fn prepare(
    planned: PlannedJob,
    loaded: &LoadedScene,
    build: &Build,
    destination: &Destination,
) -> Result<Ready, Box<JobRecord>> {
    let mut record = blank_record(&planned.job, build, &destination.folder);
    record.identity.clone_from(&planned.identity);
    record.key.clone_from(&planned.key);
    record.warnings = loaded.warnings.iter().chain(&planned.warnings).cloned().collect();
    let start = Instant::now();
    let geometry = Arc::clone(&loaded.geometry);
    let prepare =
        || Prepared::sharing(Arc::clone(&planned.scene), geometry, &loaded.environments, &planned.settings);
    let prepared = match catch_unwind(AssertUnwindSafe(prepare)) {
        Ok(Ok(prepared)) => prepared,
        Ok(Err(error)) => return Err(Box::new(JobRecord { outcome: failure(&error.into()), ..record })),
        Err(_) => return Err(Box::new(JobRecord { outcome: bug(), ..record })),
    };
    record.size = [prepared.size().0, prepared.size().1];
    record.skipped = prepared.skipped();
    record.timings.prepare = start.elapsed().as_secs_f64();
    Ok(Ready { planned, prepared, record })
}

impl Ready {
    /// Whether it can be rendered together with `others`, which can be rendered together.
    pub fn joins(&self, others: &[&Self]) -> bool {
        let all = others.iter().copied().chain([self]).map(|ready| &ready.prepared);
        Variants::leading(all).is_some_and(|variants| variants.scenes().len() == others.len() + 1)
    }

    /// The camera paths it takes at most.
    pub fn paths(&self) -> u64 {
        let (width, height) = self.prepared.size();
        u64::from(width) * u64::from(height) * u64::from(self.planned.settings.spp)
    }

    /// The job.
    pub fn job(&self) -> &crate::record::Job {
        &self.planned.job
    }
}

/// Renders a job, writes its image, compares it, and writes its record last. What fails is told in the record.
///
/// # Errors
/// If not even the record can be written.
pub fn run(
    planned: &PlannedJob,
    loaded: &LoadedScene,
    build: &Build,
    destination: &Destination,
    control: &Control,
) -> Result<JobRecord, JobError> {
    match prepare(planned.clone(), loaded, build, destination) {
        Ok(ready) => Ok(run_together(&[&ready], build, destination, control)?.swap_remove(0)),
        Err(record) => {
            write_record(&record, &destination.folder)?;
            Ok(*record)
        }
    }
}

/// Does as [`run`] for jobs that join each other ([`Ready::joins`]): the images have the bits that they have alone. The records come in the
/// order of the jobs.
///
/// # Errors
/// If not even the records can be written.
pub fn run_together(
    jobs: &[&Ready],
    build: &Build,
    destination: &Destination,
    control: &Control,
) -> Result<Vec<JobRecord>, JobError> {
    let variants = Variants::leading(jobs.iter().map(|ready| &ready.prepared));
    let Some(variants) = variants.filter(|variants| variants.scenes().len() == jobs.len()) else {
        // Strangers are rendered one by one.
        let alone = |ready: &&Ready| run_together(&[*ready], build, destination, control);
        return Ok(jobs.iter().map(alone).collect::<Result<Vec<_>, _>>()?.concat());
    };
    let mut records: Vec<Option<JobRecord>> = vec![None; jobs.len()];
    let mut written = Ok(());
    let start = Instant::now();
    let mut share = None;
    let mut finish = |index: usize, rendered: Rendered| {
        let Ready { planned, record, .. } = jobs[index];
        let mut record = record.clone();
        record.timings.render =
            *share.get_or_insert_with(|| start.elapsed().as_secs_f64() / jobs.len() as f64);
        if let Err(error) = keep(rendered, planned, build, destination, &mut record) {
            record.outcome = failure(&error);
        }
        written = std::mem::replace(&mut written, Ok(())).and(write_record(&record, &destination.folder));
        records[index] = Some(record);
    };
    // A panic is a bug, but no reason to take other jobs down; those that it leaves unfinished have no record yet.
    let _ = catch_unwind(AssertUnwindSafe(|| render_together(&variants, control, &mut finish)));
    written?;
    let mut finished = Vec::with_capacity(jobs.len());
    for (record, ready) in records.into_iter().zip(jobs) {
        finished.push(match record {
            Some(record) => record,
            None if jobs.len() == 1 => {
                let record = JobRecord { outcome: bug(), ..ready.record.clone() };
                write_record(&record, &destination.folder)?;
                record
            }
            // It may be another one's fault.
            None => run_together(&[*ready], build, destination, control)?.swap_remove(0),
        });
    }
    Ok(finished)
}

/// Writes and compares a job's picture.
fn keep(
    rendered: Rendered,
    planned: &PlannedJob,
    build: &Build,
    destination: &Destination,
    record: &mut JobRecord,
) -> Result<(), JobError> {
    let start = Instant::now();
    let Rendered { mut raster, counts, shared_rays } = rendered;
    if counts.bad_samples > 0 {
        let message = format!("{} samples were not finite or negative and were dropped", counts.bad_samples);
        record.warnings.push(Warning::new(&planned.job.name, message));
    }
    if shared_rays > 0 {
        let percent = 100.0 * shared_rays as f64 / counts.rays as f64;
        record
            .skipped
            .push(format!("{percent:.0}% of the rays, which are the same in jobs rendered with it"));
    }
    record.counts = counts;
    stamp(&mut raster, &planned.provenance(build, None));
    let encoded = imagefile::encode_exr(&raster)?;
    let path = image_path(&destination.folder, &planned.job.name);
    imagefile::write_whole(&path, &encoded.bytes)?;
    let digest = blake3::hash(&encoded.bytes).to_hex().to_string();
    record.outputs.insert(format!("{}.exr", planned.job.name), digest);
    record.outcome = Outcome::Done;
    if let Some(references) = &destination.references {
        (record.verdict, record.cross_check) =
            compare_with_reference(&path, &raster, &planned.job.name, references);
    }
    record.timings.output = start.elapsed().as_secs_f64();
    Ok(())
}

fn failure(error: &JobError) -> Outcome {
    Outcome::Failed { error: error.told() }
}

fn bug() -> Outcome {
    Outcome::Failed { error: "a bug in this program: the job panicked; the message is on stderr".to_owned() }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::color::Rgb;
    use crate::convert::ConvertOptions;
    use crate::import::ImportOptions;
    use crate::job::{finished, load, plan};
    use crate::record::{Job, Override, Value};
    use crate::scene::material::{Param, TextureChannel, TextureMap};
    use crate::scene::texture::{Encoding, Pixels, TexelFilter, Wrap};
    use crate::scene::{Image, ImageId, Texture, TextureId};
    use crate::settings::{RenderSettings, Use};

    /// A job in which nothing is traced before it is rendered.
    fn job(scene: &Path, roughness: f64) -> Job {
        let settings = RenderSettings {
            width: Some(24),
            height: Some(18),
            spp: 4,
            light_paths: Use::Never,
            path_reuse: Use::Never,
            splitting: Use::Never,
            adaptive: Use::Never,
            ..RenderSettings::default()
        };
        Job {
            name: format!("roughness={roughness}"),
            scene: scene.to_owned(),
            overrides: vec![Override {
                path: "material.paint.roughness".into(),
                value: Value::Number(roughness),
            }],
            settings,
            coordinates: Vec::new(),
        }
    }

    /// No file that is read becomes an image without pixels: the mistake is planted behind all checks, where only a panic can tell it.
    #[test]
    fn a_job_that_panics_leaves_the_others_of_its_group_as_they_are_alone() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("square.obj");
        std::fs::write(folder.path().join("square.mtl"), "newmtl paint\nKd 0.5 0.4 0.3\n").unwrap();
        let square = "mtllib square.mtl\nusemtl paint\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 1 4 3 2\n";
        std::fs::write(&scene, square).unwrap();
        let loaded = load(&scene, &ImportOptions::default(), &ConvertOptions::default(), None).unwrap();
        let build = Build::current().unwrap();
        let pixels = Pixels::U8(Vec::new());
        let hollow = Arc::new(Image { name: "hollow".into(), width: 2, height: 2, channels: 3, pixels });
        let into = |name: &str| Destination { folder: folder.path().join(name), references: None };
        let ready = |roughness: f64, is_broken: bool, destination: &Destination| {
            std::fs::create_dir_all(&destination.folder).unwrap();
            let mut planned = plan(&job(&scene, roughness), &loaded, &build).unwrap();
            let world = Arc::make_mut(&mut planned.scene);
            let texture = TextureId(world.textures.len() as u32);
            let (image, encoding) = (ImageId(world.images.len() as u32), Encoding::Linear);
            let (wrap, filter) = ([Wrap::Repeat; 2], TexelFilter::Bilinear);
            world.textures.push(Texture { image, encoding, wrap, filter });
            world.images.push(Arc::clone(&hollow));
            if is_broken {
                let map = TextureMap::new(texture, TextureChannel::R);
                world.materials[0].item.base_color = Param::Texture { map, factor: Rgb::WHITE };
            }
            prepare(planned, &loaded, &build, destination).unwrap()
        };
        let control = Control::default();
        let (together, alone) = (into("together"), into("alone"));
        let jobs = [(0.2, false), (0.4, true), (0.6, false)];
        let group = jobs.map(|(roughness, is_broken)| ready(roughness, is_broken, &together));
        assert!(group[2].joins(&[&group[0], &group[1]]), "or they would be rendered one by one");
        let records = run_together(&group.each_ref(), &build, &together, &control).unwrap();
        for ((roughness, is_broken), record) in jobs.into_iter().zip(&records) {
            let name = &record.job.name;
            if is_broken {
                assert_eq!(record.outcome, bug());
                assert!(!image_path(&together.folder, name).exists());
                continue;
            }
            assert_eq!(record.outcome, Outcome::Done, "{name}");
            run_together(&[&ready(roughness, false, &alone)], &build, &alone, &control).unwrap();
            let bytes = |at: &Destination| std::fs::read(image_path(&at.folder, name)).unwrap();
            assert!(bytes(&together) == bytes(&alone), "{name}");
        }
        assert!(group.iter().zip(&records).all(|(ready, record)| {
            finished(&ready.planned, &together.folder).is_some() == (record.outcome == Outcome::Done)
        }));
    }
}
