//! Scenes into what people edit and other programs read: material libraries and MaterialX documents with
//! their textures, Aris config roots, and scenes of Mitsuba.

mod aris;
mod batch;
mod mitsuba;
mod mtlx;
mod names;
mod report;

use std::path::{Path, PathBuf};

pub use batch::{Input, inputs};
pub use report::{html, json, table};

use crate::convert::{ConvertOptions, Note, to_disney};
use crate::imagefile::{ImageFileError, write_whole};
use crate::import::{ImportError, ImportOptions, import};
use crate::library::{self, TextureFiles};
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
    #[error("{}: there is no scene in this folder; known are .gltf, .glb, .obj, .yaml and .yml, those but the last two also with .gz or .zst", path.display())]
    NoScene {
        /// The folder.
        path: PathBuf,
    },
    /// The target has no such camera.
    #[error("the scene's camera can't be written: {why}")]
    Camera {
        /// Why not.
        why: &'static str,
    },
    /// XML can't be written.
    #[error("the document could not be made: {0}")]
    Xml(std::io::Error),
    /// The page's template can't be filled in.
    #[error("the page could not be made: {0}")]
    Page(#[from] minijinja::Error),
}

/// What a scene is converted into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// A material library, to edit and to lay over the scene.
    #[default]
    Library,
    /// A MaterialX document.
    Mtlx,
    /// An Aris config root with its meshes.
    Aris,
    /// A scene of Mitsuba 3 with its meshes and textures.
    Mitsuba,
}

named_variants! { Target { Library "library", Mtlx "mtlx", Aris "aris", Mitsuba "mitsuba", } }

/// A scene's file that was converted.
#[derive(Debug)]
pub struct Exported {
    /// The scene.
    pub source: PathBuf,
    /// The file that was written.
    pub file: PathBuf,
    /// How many materials it has.
    pub materials: usize,
    /// How many textures were written beside it.
    pub textures: usize,
    /// What became of each field of each material: first on the way to Disney's terms, then on that to the target's.
    pub notes: Vec<Note>,
    /// What was not as it should be.
    pub warnings: Vec<Warning>,
}

/// Writes the scene in `source`, or its materials, into `folder`, with what it names beside it.
///
/// # Errors
/// If the scene can't be read or a file not written.
pub fn export(
    source: &Path,
    folder: &Path,
    target: Target,
    import_options: &ImportOptions,
    convert_options: &ConvertOptions,
) -> Result<Exported, ExportError> {
    let imported = import(source, import_options)?;
    let converted = to_disney(imported.scene, convert_options);
    let scene = &converted.scene;
    let materials = scene.materials.len();
    let mut notes = converted.notes;
    let name = source.file_name().unwrap_or_default().to_string_lossy();
    let mut textures = TextureFiles::new(scene);
    let mut baked = 0;
    let (files, main) = match target {
        Target::Library => {
            let written = library::write(scene, &name);
            textures = written.textures;
            (vec![(library::FILE_NAME.to_owned(), written.text.into_bytes())], library::FILE_NAME)
        }
        Target::Mtlx => {
            let document = mtlx::document(scene, &mut textures).map_err(ExportError::Xml)?;
            notes.extend(document.notes);
            (vec![(mtlx::FILE_NAME.to_owned(), document.text.into_bytes())], mtlx::FILE_NAME)
        }
        Target::Aris => {
            let stem = name.split('.').next().unwrap_or_default();
            let root = aris::root(scene, stem)?;
            notes.extend(root.notes);
            let files = root.files.into_iter().map(|(file, text)| (file, text.into_bytes()));
            (files.collect(), aris::MAIN)
        }
        Target::Mitsuba => {
            let description = mitsuba::description(scene.clone())?;
            notes.extend(description.notes);
            baked = description.textures;
            (description.files, mitsuba::MAIN)
        }
    };
    // What names others comes last: where it stands, they do.
    textures.save(folder)?;
    for (file, bytes) in &files {
        write_in_folder(&folder.join(file), bytes)?;
    }
    let mut warnings = imported.warnings;
    warnings.extend(converted.warnings);
    let textures = textures.count() + baked;
    let file = folder.join(main);
    Ok(Exported { source: source.to_owned(), file, materials, textures, notes, warnings })
}

/// Writes a file, making the folders it lies in.
fn write_in_folder(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(|cause| ExportError::File { path: folder.into(), cause })?;
    Ok(write_whole(path, bytes)?)
}
