//! Material libraries: YAML files that map names to Disney materials, to edit by hand and lay over a scene.
//!
//! ```yaml
//! gold:
//!   name: disney
//!   config: {color: [1.0, 0.77, 0.34], metallic: 1, roughness: 0.3}
//! wood:
//!   name: disney
//!   config:
//!     color: {file: textures/oak.png, factor: [1, 1, 1], encoding: srgb}
//!     roughness: {file: textures/oak_orm.png, channel: g, factor: 0.8, encoding: linear}
//! window: {model: disney, spec_trans: 1, thin_walled: true, roughness: 0}
//! ```
//!
//! An entry has Aris' shape, `name` and `config`, or is a map of fields. Fields are called as in paths or as Aris calls them
//! (`specularTint`, `color`). What an entry doesn't say stays as the scene has it. [`write()`] makes a library of a scene's materials,
//! [`Library::read`] reads one, and what was written comes back to the same bits.

mod field;
mod keys;
mod overlay;
mod read;
mod taken;
#[cfg(test)]
mod tests;
mod textures;
mod write;

pub use field::field;
pub use keys::of as aris_key;
pub use read::Library;
pub use taken::TakenNames;
pub use textures::TextureFiles;
pub use write::{FILE_NAME, Written, write};

use crate::import::{ArisError, EnvironmentError, FileError};
use crate::manifest::edit::EditError;

/// Why a library can't be used.
#[derive(Debug, thiserror::Error)]
pub enum LibraryError {
    /// It can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It isn't YAML.
    #[error(transparent)]
    Yaml(#[from] Box<ArisError>),
    /// A field that doesn't exist or doesn't take the value.
    #[error("{place}: {cause}")]
    Field {
        /// `file:line:column`.
        place: String,
        /// Why.
        cause: EditError,
    },
    /// Something that isn't what a library has there.
    #[error("{place}: {why}")]
    Form {
        /// `file:line:column`.
        place: String,
        /// What is expected.
        why: String,
    },
    /// The scene has no such material.
    #[error("{place}: the scene has no material `{name}`")]
    UnknownMaterial {
        /// `file:line:column`.
        place: String,
        /// The name.
        name: String,
        /// What was probably meant.
        nearest: Option<String>,
        /// The names there are.
        known: Vec<String>,
    },
    /// A texture can't be read.
    #[error("{place}: {cause}")]
    Image {
        /// `file:line:column`.
        place: String,
        /// Why.
        cause: EnvironmentError,
    },
}

impl LibraryError {
    /// What may help, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Field { cause, .. } => cause.hint(),
            Self::UnknownMaterial { nearest, known, .. } => {
                let meant = nearest.as_ref().map_or_else(String::new, |n| format!("did you mean `{n}`? "));
                Some(format!("{meant}it has {}", crate::manifest::nearest::listed(known)))
            }
            _ => None,
        }
    }
}
