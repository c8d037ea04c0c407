//! Looking into materials: what their lobes reflect where, how well they are sampled, and how they look.
//!
//! - [`eval`]: rows of parameters and directions to BRDF values, as golden files have them
//! - [`Target`], [`Edit`], [`gather`]: files, names and `-p NAME=VALUE` to [`Subject`]s, materials that are the same at every point
//! - [`measure`]: slices of the lobes, the albedo, and sampling against quadrature
//! - [`look`], [`write_report`]: a lit sphere, charts as PNG, and a page that needs no other file; [`numbers`] for programs

mod chart;
mod edit;
mod energy;
pub mod eval;
mod gather;
mod maps;
pub mod measure;
mod numbers;
mod page;
mod quadrature;
mod report;
mod sphere;
mod subject;

use std::path::PathBuf;

pub use edit::Edit;
pub use gather::{Gathered, MOST, Target, gather};
pub use numbers::numbers;
pub use quadrature::Integrals;
pub use report::{Inspected, Options, look, write_report};
pub use subject::{ParameterRow, Subject};

use crate::import::ImportError;
use crate::library::LibraryError;
use crate::manifest::edit::EditError;
pub use crate::report::ChartError;
pub use crate::report::chart::Picture;

/// Why materials can't be looked into.
#[derive(Debug, thiserror::Error)]
pub enum InspectError {
    /// Not `NAME=VALUE`.
    #[error("{text:?} is not NAME=VALUE, such as roughness=0.3 or roughness=0.1,0.3,0.6")]
    MalformedEdit {
        /// What was given.
        text: String,
    },
    /// A field that doesn't exist or doesn't take the value.
    #[error("{0}")]
    Edit(EditError),
    /// A library that can't be used.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// A scene that can't be imported.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// No material of that name.
    #[error("{} has no material `{name}`", file.display())]
    UnknownMaterial {
        /// The file.
        file: PathBuf,
        /// The name.
        name: String,
        /// What was probably meant.
        nearest: Option<String>,
        /// The names there are.
        known: Vec<String>,
    },
    /// A scene without materials.
    #[error("{} has no materials", file.display())]
    NoMaterials {
        /// The file.
        file: PathBuf,
    },
    /// A material that is not the same everywhere.
    #[error("material `{material}` varies over the surface in a way that has no mean")]
    Varies {
        /// The material.
        material: String,
    },
    /// The sphere can't be rendered.
    #[error(transparent)]
    Render(#[from] crate::render::RenderError),
    /// A chart can't be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A picture can't be encoded or a file written.
    #[error(transparent)]
    ImageFile(#[from] crate::imagefile::ImageFileError),
    /// The page's template can't be filled in.
    #[error("the page could not be made: {0}")]
    Page(#[from] minijinja::Error),
    /// A file or folder can't be used.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
}

impl InspectError {
    /// What may help, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Edit(cause) => cause.hint(),
            Self::Library(cause) => cause.hint(),
            Self::UnknownMaterial { nearest, known, .. } => {
                let meant = nearest.as_ref().map_or_else(String::new, |n| format!("did you mean `{n}`? "));
                Some(format!("{meant}it has {}", crate::manifest::nearest::listed(known)))
            }
            _ => None,
        }
    }
}
