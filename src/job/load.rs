//! A scene file into what all its jobs share.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::JobError;
use crate::convert::{ConvertOptions, Note, to_disney};
use crate::import::{
    ArisConfig, ArisRun, DecodedImages, EnvironmentError, FileDigest, ImportOptions, Imported, import,
    import_configured, read_environment,
};
use crate::library::Library;
use crate::light::EnvironmentTables;
use crate::record::Warning;
use crate::render::Geometry;
use crate::scene::{Image, Named, Scene, framing, studio};
use crate::settings::RenderSettings;

/// A scene, converted and completed, with its triangles in a tree.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// Disney materials; at least one camera, and light.
    pub scene: Arc<Scene>,
    /// The tree.
    pub geometry: Arc<Geometry>,
    /// What is known of its jobs' environments.
    pub environments: Arc<EnvironmentTables>,
    /// The latest that one of them named.
    environment_file: Arc<Mutex<Option<(PathBuf, EnvironmentFile)>>>,
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

/// An environment image that was read from a file.
#[derive(Clone, Debug)]
pub(super) struct EnvironmentFile {
    pub(super) image: Arc<Image>,
    pub(super) digest: FileDigest,
    pub(super) warning: Option<Warning>,
}

impl LoadedScene {
    /// The environment image of a path: of jobs in a row that name the same it is read once.
    pub(super) fn environment_file(&self, path: &Path) -> Result<EnvironmentFile, EnvironmentError> {
        // A thread that panicked elsewhere has left a whole entry.
        let mut latest = self.environment_file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, file)) = &*latest
            && known == path
        {
            return Ok(file.clone());
        }
        *latest = None;
        let (image, digest, warning) = read_environment(path, self.import_options.reach)?;
        let file = EnvironmentFile { image: Arc::new(image), digest, warning };
        *latest = Some((path.to_owned(), file.clone()));
        Ok(file)
    }
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
    let import_options = &ImportOptions { images: DecodedImages::OfInstances, ..import_options.clone() };
    let imported = import(path, import_options)?;
    let place = path.display().to_string();
    let options = (import_options, convert_options);
    loaded(imported, options, materials, |scene, warnings| complete(scene, &place, warnings))
}

/// What a config root's run renders.
#[derive(Clone, Debug)]
pub struct LoadedRun {
    /// The scene, converted.
    pub loaded: LoadedScene,
    /// How it is rendered.
    pub settings: RenderSettings,
    /// Whether the configuration asks for an EXR beside the PNG.
    pub save_exr: bool,
}

/// Imports and converts the scene of an Aris configuration. Nothing is added to it: without light it is black, and a warning says
/// so.
///
/// # Errors
/// If the scene can't be read, or has nothing to render.
pub fn load_configured(
    config: &ArisConfig,
    convert_options: &ConvertOptions,
    materials: Option<&Path>,
) -> Result<LoadedRun, JobError> {
    let ArisRun { imported, settings, save_exr } = import_configured(config)?;
    let import_options = ImportOptions { reach: config.reach(), ..ImportOptions::default() };
    let options = (&import_options, convert_options);
    let loaded = loaded(imported, options, materials, |scene, warnings| {
        if settings.integrator.needs_light() && !studio::is_lit(scene) {
            let what =
                "no light: the picture will be black; scene/environment=… or scene.emitters may give some";
            warnings.push(Warning::new(config.name(), what));
        }
    })?;
    Ok(LoadedRun { loaded, settings, save_exr })
}

/// Adds a camera and light where there are none.
fn complete(scene: &mut Scene, place: &str, warnings: &mut Vec<Warning>) {
    if scene.cameras.is_empty() {
        let camera = framing::frame(scene);
        scene.cameras.push(Named::new("default", camera));
        warnings.push(Warning::new(
            place,
            "no camera: the whole scene is framed from three quarters, unless camera.* is set",
        ));
    }
    if !studio::is_lit(scene) {
        studio::add_studio_lighting(scene);
        warnings.push(Warning::new(
            place,
            "no light: a studio environment is added (glowing textures do not count), unless environment.* is set",
        ));
    }
}

/// Converts an imported scene, has it completed, and builds its tree.
fn loaded(
    imported: Imported,
    (import_options, convert_options): (&ImportOptions, &ConvertOptions),
    materials: Option<&Path>,
    complete: impl FnOnce(&mut Scene, &mut Vec<Warning>),
) -> Result<LoadedScene, JobError> {
    let converted = to_disney(imported.scene, convert_options);
    let mut scene = converted.scene;
    let mut warnings = imported.warnings;
    warnings.extend(converted.warnings);
    let mut files = imported.files;
    if let Some(path) = materials {
        let library = Library::read(path, import_options.reach)?
            .ok_or_else(|| JobError::NoLibrary { path: path.into() })?;
        let (read, noticed) = library.lay_over(&mut scene)?;
        files.extend(read);
        warnings.extend(noticed);
    }
    complete(&mut scene, &mut warnings);
    let geometry = Arc::new(Geometry::build(&scene)?);
    Ok(LoadedScene {
        scene: Arc::new(scene),
        geometry,
        environments: Arc::default(),
        environment_file: Arc::default(),
        import_options: import_options.clone(),
        convert_options: convert_options.clone(),
        files,
        notes: converted.notes,
        warnings,
    })
}
