//! Scenes into what people edit and other programs read: material libraries and MaterialX documents with
//! their textures, Aris config roots, scenes of Mitsuba, and glTF.

mod aris;
mod bake;
mod batch;
mod gltf;
mod mitsuba;
mod mtlx;
mod names;
mod principled;
mod report;
mod rounding;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub use batch::{Input, inputs};
pub use report::{html, json, table};

use crate::convert::{ConvertOptions, Note, to_disney};
use crate::disney::Parameter;
use crate::imagefile::{ImageFileError, write_whole};
use crate::import::{ImportError, ImportOptions, import};
use crate::library::{self, TextureFiles};
use crate::record::Warning;
use crate::scene::material::{Curve, TextureChannel, TextureMap};
use crate::scene::{Material, Scene};

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
    /// A GLB can't be as long as this.
    #[error(
        "the GLB would take {needed} bytes, but its length is a number of 32 bits: at most {limit}; convert parts of the scene instead"
    )]
    GlbSize {
        /// What it would take, at least.
        needed: u64,
        /// The most it can.
        limit: u64,
    },
    /// The result would take the place of what it is made of.
    #[error("{} is the scene itself or belongs to it, and would be overwritten; choose another folder", path.display())]
    Itself {
        /// The file.
        path: PathBuf,
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
    /// glTF 2.0, all of the scene in one GLB.
    Gltf,
}

named_variants! { Target { Library "library", Mtlx "mtlx", Aris "aris", Mitsuba "mitsuba", Gltf "gltf", } }

/// A scene's file that was converted.
#[derive(Debug)]
pub struct Exported {
    /// The scene.
    pub source: PathBuf,
    /// The file that was written.
    pub file: PathBuf,
    /// How many materials it has.
    pub materials: usize,
    /// How many textures were written beside it, or in it.
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
    let materials = converted.scene.materials.len();
    let mut notes = converted.notes;
    let scene = &as_read_by(target, converted.scene, &mut notes);
    let name = source.file_name().unwrap_or_default().to_string_lossy();
    let mut textures = TextureFiles::new(scene);
    // Images that the target writes itself.
    let mut images = 0;
    let text = |(file, text): (String, String)| (file, text.into_bytes());
    let (files, main) = match target {
        Target::Library => {
            let written = library::write(scene, &name);
            textures = written.textures;
            (vec![text((library::FILE_NAME.to_owned(), written.text))], library::FILE_NAME)
        }
        Target::Mtlx => {
            let document = mtlx::document(scene, &mut textures).map_err(ExportError::Xml)?;
            notes.extend(document.notes);
            (vec![text((mtlx::FILE_NAME.to_owned(), document.text))], mtlx::FILE_NAME)
        }
        Target::Aris => {
            let stem = name.split('.').next().unwrap_or_default();
            let root = aris::root(scene, stem)?;
            notes.extend(root.notes);
            (root.files.into_iter().map(text).collect(), aris::MAIN)
        }
        Target::Mitsuba => {
            let description = mitsuba::description(scene.clone())?;
            notes.extend(description.notes);
            images = description.textures;
            (description.files, mitsuba::MAIN)
        }
        Target::Gltf => {
            let glb = gltf::glb(scene)?;
            notes.extend(glb.notes);
            images = glb.images;
            (vec![(gltf::FILE_NAME.to_owned(), glb.bytes)], gltf::FILE_NAME)
        }
    };
    let written = textures.names().chain(files.iter().map(|(file, _)| file.as_str()));
    let read = imported.files.iter().map(|file| imported.folder.join(&file.name));
    if let Some(path) = first_overwritten(written.map(|file| folder.join(file)), read) {
        return Err(ExportError::Itself { path });
    }
    // What names others comes last: where it stands, they do.
    textures.save(folder)?;
    for (file, content) in &files {
        write_in_folder(&folder.join(file), content)?;
    }
    let mut warnings = imported.warnings;
    warnings.extend(converted.warnings);
    let textures = textures.count() + images;
    let file = folder.join(main);
    Ok(Exported { source: source.to_owned(), file, materials, textures, notes, warnings })
}

/// The scene with textures that the target can read. A library says all that a material has, a config root has no textures.
fn as_read_by(target: Target, scene: Scene<Material>, notes: &mut Vec<Note>) -> Scene<Material> {
    let keeps_anisotropy = !matches!(target, Target::Mtlx | Target::Mitsuba);
    let wants = |parameter: Parameter, map: &TextureMap| {
        let is_curved = map.curve != Curve::Linear;
        match target {
            Target::Library | Target::Aris => false,
            Target::Mtlx => is_curved || map.channel == TextureChannel::Y,
            Target::Mitsuba => is_curved,
            Target::Gltf => is_curved && parameter != Parameter::ClearcoatGloss,
        }
    };
    bake::bake(scene, keeps_anisotropy, wants, notes)
}

/// Writes a file, making the folders it lies in.
fn write_in_folder(path: &Path, content: &[u8]) -> Result<(), ExportError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(|cause| ExportError::File { path: folder.into(), cause })?;
    Ok(write_whole(path, content)?)
}

/// The first of the files to be `written` that is one of those that were `read`, whatever both are called.
fn first_overwritten(
    mut written: impl Iterator<Item = PathBuf>,
    read: impl Iterator<Item = PathBuf>,
) -> Option<PathBuf> {
    let read: BTreeSet<PathBuf> = read.filter_map(|path| path.canonicalize().ok()).collect();
    written.find(|path| path.canonicalize().is_ok_and(|path| read.contains(&path)))
}
