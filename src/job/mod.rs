//! One expanded job, from import to record.
//!
//! [`LoadedScene`] is what jobs of one scene share; [`PlannedJob`] is a job with its overrides applied and its identity known;
//! rendering, writing and comparing it gives a [`crate::record::JobRecord`]. A job that fails is a record too.

mod identity;
mod load;
mod run;
mod together;

use std::path::PathBuf;

pub use identity::Build;
pub use load::{LoadedRun, LoadedScene, load, load_configured};
pub use run::{
    Destination, PlannedJob, References, failed_record, finished, image_path, plan, recheck, record_path,
    recorded, reference_of, write_record,
};
pub use together::{Ready, prepare, run, run_together};

/// Why a job can't be done.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The scene could not be read.
    #[error(transparent)]
    Import(#[from] crate::import::ImportError),
    /// The scene could not be prepared or rendered.
    #[error(transparent)]
    Render(#[from] crate::render::RenderError),
    /// An override does not fit the scene.
    #[error(transparent)]
    Edit(#[from] crate::manifest::edit::EditError),
    /// A material library does not fit the scene.
    #[error(transparent)]
    Library(#[from] crate::library::LibraryError),
    /// A file that should be a material library is a scene.
    #[error("{}: this is a scene, not a material library", path.display())]
    NoLibrary {
        /// The file.
        path: PathBuf,
    },
    /// An image could not be read or written.
    #[error(transparent)]
    ImageFile(#[from] crate::imagefile::ImageFileError),
    /// A comparison could not be made.
    #[error(transparent)]
    Compare(#[from] crate::compare::CompareError),
    /// A file or folder could not be used.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// A record is not one.
    #[error("{}: this is not a job's record: {cause}", path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        cause: serde_json::Error,
    },
}

impl JobError {
    /// What may help, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Edit(error) => error.hint(),
            Self::Library(error) => error.hint(),
            _ => None,
        }
    }

    /// The message with its hint, in one line.
    pub fn told(&self) -> String {
        self.hint().map_or_else(|| self.to_string(), |hint| format!("{self}; hint: {hint}"))
    }
}
