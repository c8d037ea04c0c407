//! Running many jobs: a manifest is opened into jobs, jobs of one scene share it, finished ones are reused, failed ones are
//! recorded and do not stop the rest, and the results are put on a sheet and a page.

mod open;
mod present;
mod run;
mod scenes;
mod work;

use std::path::PathBuf;

use crate::record::JobRecord;

pub use open::{Sweep, open};
pub use present::Presentation;
pub use run::{Observer, Options, Shard, Silent, check, run};
pub use scenes::{Reading, Scenes};

/// What a sweep came to.
#[derive(Debug)]
pub struct SweepResult {
    /// One a job of this run, in the manifest's order.
    pub records: Vec<JobRecord>,
    /// How many of them were taken from an earlier run.
    pub reused: usize,
    /// The sheet and the page, unless they could not be made.
    pub presentation: Result<Presentation, SweepError>,
}

/// Why a sweep can't be run, or its sheet not be made.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A path that says how a scene is read doesn't take its value.
    #[error(transparent)]
    Path(#[from] crate::manifest::edit::EditError),
    /// The manifest can't be read, or is wrong, by itself or for its scene.
    #[error(transparent)]
    Manifest(#[from] crate::manifest::ManifestErrors),
    /// A pattern for scenes is malformed.
    #[error("scene = {pattern:?}: {cause}")]
    Pattern {
        /// The pattern.
        pattern: String,
        /// What is wrong with it.
        cause: glob::PatternError,
    },
    /// The folder of results can't be used.
    #[error("cannot use the folder {}: {cause}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// A job's record could not be written, so that its work would be lost.
    #[error(transparent)]
    Job(#[from] crate::job::JobError),
    /// An image could not be read or written.
    #[error(transparent)]
    ImageFile(#[from] crate::imagefile::ImageFileError),
    /// The sheet could not be drawn.
    #[error(transparent)]
    Sheet(#[from] crate::report::SheetError),
    /// The page could not be made.
    #[error(transparent)]
    Page(#[from] crate::report::PageError),
    /// `idiff` was asked for and is not there.
    #[error(transparent)]
    Compare(#[from] crate::compare::CompareError),
}
