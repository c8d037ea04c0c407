//! A scene file into what all its jobs share.

use std::path::Path;
use std::sync::Arc;

use super::JobError;
use crate::convert::{ConvertOptions, Note, to_disney};
use crate::import::{FileDigest, ImportOptions, import};
use crate::library::Library;
use crate::record::Warning;
use crate::render::Geometry;
use crate::scene::{Named, Scene, framing, studio};

/// A scene, converted and completed, with its triangles in a tree.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// Disney materials; at least one camera, and light.
    pub scene: Arc<Scene>,
    /// The tree.
    pub geometry: Arc<Geometry>,
    /// How it was imported and converted.
    pub import_options: ImportOptions,
    /// As above.
    pub convert_options: ConvertOptions,
    /// Every file that was read.
    pub files: Vec<FileDigest>,
    /// What conversion has to say on each material.
    pub notes: Vec<Note>,
    /// What was noticed.
    pub warnings: Vec<Warning>,
}

/// Imports and converts a scene and lays the library `materials` over its materials. One without a camera is framed, one without light is lit by a studio, and a warning says so.
///
/// # Errors
/// If the scene or the library can't be read, the library doesn't fit, or there is nothing to render.
pub fn load(
    path: &Path,
    import_options: &ImportOptions,
    convert_options: &ConvertOptions,
    materials: Option<&Path>,
) -> Result<LoadedScene, JobError> {
    let imported = import(path, import_options)?;
    let converted = to_disney(imported.scene, convert_options);
    let mut scene = converted.scene;
    let mut warnings = imported.warnings;
    warnings.extend(converted.warnings);
    let mut files = imported.files;
    if let Some(path) = materials {
        let library = Library::read(path)?.ok_or_else(|| JobError::NoLibrary { path: path.into() })?;
        let (read, noticed) = library.lay_over(&mut scene)?;
        files.extend(read);
        warnings.extend(noticed);
    }
    let place = path.display().to_string();
    if scene.cameras.is_empty() {
        let camera = framing::frame(&scene);
        scene.cameras.push(Named::new("default", camera));
        warnings.push(Warning::new(
            &place,
            "no camera: the whole scene is framed from three quarters, unless camera.* is set",
        ));
    }
    if !studio::is_lit(&scene) {
        studio::add_studio_lighting(&mut scene);
        warnings.push(Warning::new(
            &place,
            "no light: a studio environment is added (glowing textures do not count), unless environment.* is set",
        ));
    }
    let geometry = Arc::new(Geometry::build(&scene)?);
    Ok(LoadedScene {
        scene: Arc::new(scene),
        geometry,
        import_options: import_options.clone(),
        convert_options: convert_options.clone(),
        files,
        notes: converted.notes,
        warnings,
    })
}
