//! Files into scenes: glTF, OBJ and Aris, each in a room of its own.
//!
//! An importer reads files through [`Files`], which keeps it inside the scene's folder and counts what it read, and returns an
//! [`Imported`]: the scene with its dialect's own materials, and what was noticed on the way.

mod aris;
mod decode;
mod files;
mod obj;

pub use aris::ArisError;
pub use decode::ImageError;
pub use files::{FileDigest, FileError, Files};
pub use obj::ObjError;

use crate::record::Warning;
use crate::scene::Scene;
use crate::scene::source::SourceMaterial;

/// A scene as its file describes it.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The scene with its dialect's materials.
    pub scene: Scene<SourceMaterial>,
    /// What was not as it should be.
    pub warnings: Vec<Warning>,
    /// Every file that was read, in order: the scene's identity.
    pub files: Vec<FileDigest>,
}
