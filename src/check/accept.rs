//! Accepting results as references: an explicit act that tells how far each one moves.

use std::path::{Path, PathBuf};

use crate::imagefile::{self, ImageFileError};
use crate::job::{image_path, recorded, reference_of};
use crate::raster::{Layer, Raster};
use crate::record::Job;
use crate::sweep::Sweep;

/// A result that is now a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Accepted {
    /// The job.
    pub name: String,
    /// The reference's file.
    pub path: PathBuf,
    /// Mean of the new picture minus mean of the old one, relative to the old one; none where there was no reference of its
    /// size.
    pub bias: Option<f64>,
}

/// Why results can't be accepted.
#[derive(Debug, thiserror::Error)]
pub enum AcceptError {
    /// The manifest has no place for references.
    #[error("the manifest names no references: add [compare] with references = \"FOLDER\"")]
    NoReferences,
    /// There is no such job.
    #[error("the sweep has no job {name:?}; `pipeline sweep … --list` shows the names")]
    UnknownJob {
        /// The name.
        name: String,
    },
    /// The job has no result yet, or what lies there is the result of other parameters, or its last run failed.
    #[error("{name}: {} is not a finished result of this job as the manifest has it now; run the sweep first", path.display())]
    NoResult {
        /// The job.
        name: String,
        /// Where it should be.
        path: PathBuf,
    },
    /// The result has values that no reference may have.
    #[error("{name}: the result has values that are not finite, which no reference may have")]
    NotFinite {
        /// The job.
        name: String,
    },
    /// An image could not be read or written.
    #[error(transparent)]
    ImageFile(#[from] ImageFileError),
    /// The folder could not be made.
    #[error("cannot use the folder {}: {cause}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
}

/// Makes the results of `names` (all jobs if empty) the references of a sweep.
///
/// # Errors
/// Before anything is written: if the manifest has no references, a name is unknown, or a result is missing or not finite.
pub fn accept(sweep: &Sweep, names: &[String]) -> Result<Vec<Accepted>, AcceptError> {
    let spec = sweep.manifest.compare.as_ref().ok_or(AcceptError::NoReferences)?;
    let folder = sweep.manifest.folder().join(&spec.references);
    if let Some(name) = names.iter().find(|n| !sweep.jobs.iter().any(|j| j.name == **n)) {
        return Err(AcceptError::UnknownJob { name: name.clone() });
    }
    let jobs: Vec<&Job> = sweep.jobs.iter().filter(|j| names.is_empty() || names.contains(&j.name)).collect();
    for job in &jobs {
        reference(job, &sweep.folder)?;
    }
    jobs.into_iter().map(|job| write(&folder, job.name.clone(), &reference(job, &sweep.folder)?)).collect()
}

/// The reference that a job's result would be.
fn reference(job: &Job, results: &Path) -> Result<Raster, AcceptError> {
    let path = image_path(results, &job.name);
    if recorded(job, results).is_none() {
        return Err(AcceptError::NoResult { name: job.name.clone(), path });
    }
    let reference = reference_of(&imagefile::read(&path)?);
    let mut values = reference.layers.iter().flat_map(|l| &l.channels).flat_map(|c| &c.values);
    if values.all(|v| v.is_finite()) {
        Ok(reference)
    } else {
        Err(AcceptError::NotFinite { name: job.name.clone() })
    }
}

fn write(folder: &Path, name: String, reference: &Raster) -> Result<Accepted, AcceptError> {
    let path = image_path(folder, &name);
    let parent = path.parent().unwrap_or(folder).to_owned();
    std::fs::create_dir_all(&parent).map_err(|cause| AcceptError::Folder { path: parent, cause })?;
    // A damaged reference is replaced like a missing one.
    let old = imagefile::read(&path).ok();
    imagefile::write_exr(&path, reference)?;
    let bias = old.and_then(|old| bias(old.picture(), reference.picture()));
    Ok(Accepted { name, path, bias })
}

/// (mean of `new` - mean of `old`)/mean of `old` over the colour channels.
fn bias(old: &Layer, new: &Layer) -> Option<f64> {
    let mean = |layer: &Layer| {
        let planes = layer.rgb()?;
        let values = planes.iter().flat_map(|p| p.iter());
        Some(values.map(|&v| f64::from(v)).sum::<f64>() / (3 * layer.window.pixels()) as f64)
    };
    let (before, after) = (mean(old)?, mean(new)?);
    (old.window == new.window && before != 0.0).then(|| (after - before) / before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Window;

    #[test]
    fn bias_is_signed_and_relative() {
        let layer = |v: f32| {
            let plane = || vec![v; 4];
            Layer::new("beauty", Window::sized(2, 2)).with("R", plane()).with("G", plane()).with("B", plane())
        };
        assert!((bias(&layer(0.5), &layer(0.4)).unwrap() + 0.2).abs() < 1e-6);
        assert_eq!(bias(&layer(0.0), &layer(0.4)), None);
    }
}
