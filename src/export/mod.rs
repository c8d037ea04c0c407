//! Scenes into what people edit and other programs read: for now material libraries with their textures.

mod batch;
mod report;

use std::path::{Path, PathBuf};

pub use batch::{Input, inputs};
pub use report::{html, json, table};

use crate::convert::{ConvertOptions, Note, to_disney};
use crate::imagefile::ImageFileError;
use crate::import::{ImportError, ImportOptions, import};
use crate::library;
use crate::record::Warning;

/// Why a scene can't be converted.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// It can't be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// A texture can't be encoded or a file not written.
    #[error(transparent)]
    ImageFile(#[from] ImageFileError),
    /// A file or folder can't be used.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// A folder without a scene.
    #[error("{}: there is no scene in this folder; known are .gltf, .glb, .obj, .yaml and .yml, each also with .gz", path.display())]
    NoScene {
        /// The folder.
        path: PathBuf,
    },
    /// The page's template can't be filled in.
    #[error("the page could not be made: {0}")]
    Page(#[from] minijinja::Error),
}

/// A scene's file that was converted.
#[derive(Debug)]
pub struct Exported {
    /// The scene.
    pub source: PathBuf,
    /// The library that was written.
    pub library: PathBuf,
    /// How many materials it has.
    pub materials: usize,
    /// How many textures were written beside it.
    pub textures: usize,
    /// What became of each field of each material.
    pub notes: Vec<Note>,
    /// What was not as it should be.
    pub warnings: Vec<Warning>,
}

/// Writes the materials of the scene in `source` as a library into `folder`, with the textures beside it.
///
/// # Errors
/// If the scene can't be read or a file not written.
pub fn export_library(
    source: &Path,
    folder: &Path,
    import_options: &ImportOptions,
    convert_options: &ConvertOptions,
) -> Result<Exported, ExportError> {
    let imported = import(source, import_options)?;
    let converted = to_disney(imported.scene, convert_options);
    let name = source.file_name().unwrap_or_default().to_string_lossy();
    let written = library::write(&converted.scene, &name);
    let textures = folder.join("textures");
    let needed = if written.textures.is_empty() { folder } else { &textures };
    std::fs::create_dir_all(needed).map_err(|cause| ExportError::File { path: needed.into(), cause })?;
    let library = written.save(folder)?;
    let mut warnings = imported.warnings;
    warnings.extend(converted.warnings);
    Ok(Exported {
        source: source.to_owned(),
        library,
        materials: converted.scene.materials.len(),
        textures: written.textures.len(),
        notes: converted.notes,
        warnings,
    })
}
