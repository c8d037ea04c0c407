//! What is done with an input: as far as users go, from bytes to a picture of a few pixels.
//!
//! Whatever comes of it, an error is shown and nothing panics. The package's own tests run these over the seeds and over everything that was
//! found.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use pipeline::color::Rgb;
use pipeline::convert::{ConvertOptions, to_disney};
use pipeline::imagefile;
use pipeline::import::{ArisConfig, ImportError, ImportOptions, Imported, Reach, import, import_configured};
use pipeline::job::{self, Build, JobError, LoadedScene};
use pipeline::library::Library;
use pipeline::manifest::{self, Manifest};
use pipeline::render::{Control, Geometry, Prepared, render};
use pipeline::scene::environment::Environment;
use pipeline::scene::{Named, framing, studio};
use pipeline::settings::RenderSettings;

/// What a target does with an input.
pub type Body = fn(&[u8]);

/// The body of each target, by name.
pub const ALL: [(&str, Body); 5] =
    [("gltf", gltf), ("obj", obj), ("aris", aris), ("manifest", manifest), ("image", image)];

/// A line that begins with this begins another file, whose name follows.
const SEPARATOR: &str = "=== ";

/// The most jobs of a manifest that are planned.
const MAX_PLANNED: usize = 16;

/// A glTF file, GLB or JSON.
pub fn gltf(input: &[u8]) {
    show(rendered("gltf", input));
}

/// An OBJ and the files behind separators, such as its library.
pub fn obj(input: &[u8]) {
    show(rendered("obj", input));
}

/// An Aris scene or, with a `config/render.yaml` behind a separator, the overrides of a config root; `materials.yaml` is laid over
/// the scene.
pub fn aris(input: &[u8]) {
    show(rendered("aris", input));
}

/// Reads, converts and renders the input of one of the three.
///
/// # Errors
/// If it can't be read.
pub fn rendered(target: &str, input: &[u8]) -> Result<(), JobError> {
    let folder = Folder::new();
    let options = ImportOptions::default();
    match target {
        "gltf" => {
            let path = folder.write("scene.glb", input);
            picture(import(&path, &ImportOptions { time: Some(0.5), ..options })?, None)
        }
        "obj" => picture(import(&folder.unpack("scene.obj", input), &options)?, None),
        _ => {
            let path = folder.unpack("scene.yaml", input);
            let materials = Some(folder.0.path().join("materials.yaml")).filter(|file| file.exists());
            let root = folder.0.path().join("config");
            if !ArisConfig::is_root(&root) {
                return picture(import(&path, &options)?, materials.as_deref());
            }
            let overrides = String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned();
            let overrides: Vec<String> = overrides.lines().map(str::to_owned).collect();
            let config = ArisConfig::compose(&root, &overrides, Reach::Folder);
            let config = config.map_err(|error| ImportError::from(Box::new(error)))?;
            assert!(!config.to_yaml().is_empty() && !config.provenance().is_empty());
            picture(import_configured(&config)?.imported, materials.as_deref())
        }
    }
}

/// A manifest of a scene of two materials: expanded, checked, and its first jobs planned.
pub fn manifest(input: &[u8]) {
    static SCENE: OnceLock<LoadedScene> = OnceLock::new();
    let loaded = SCENE.get_or_init(|| {
        let folder = Folder::new();
        let path = folder.unpack("scene.obj", include_bytes!("../seeds/obj/two_materials.obj"));
        let loaded = job::load(&path, &ImportOptions::default(), &ConvertOptions::default(), None);
        loaded.unwrap_or_else(|error| panic!("{error}"))
    });
    let Ok(text) = std::str::from_utf8(input) else { return };
    let path = Path::new("sweep.toml");
    let errors = match Manifest::parse(text, path) {
        Err(errors) => errors,
        Ok(manifest) => {
            let scene = PathBuf::from("scene.obj");
            let wrong = manifest::check(&manifest, &loaded.scene, &scene).err();
            let scenes: Vec<PathBuf> = manifest.scene_patterns().iter().map(|_| scene.clone()).collect();
            match (manifest::expand(&manifest, &scenes), wrong) {
                (Err(errors), _) | (_, Some(errors)) => errors,
                (Ok(jobs), None) => {
                    for job in jobs.iter().take(MAX_PLANNED) {
                        show(job::plan(job, loaded, build()).map(drop));
                    }
                    return;
                }
            }
        }
    };
    assert!(!errors.render(manifest::Color::Never).is_empty());
}

/// An image of any kind, as a texture and as a picture to be compared.
pub fn image(input: &[u8]) {
    if let Err(error) = imagefile::decode_texture(input, "image") {
        assert!(!error.to_string().is_empty());
    }
    if let Err(error) = imagefile::decode(input, "image") {
        assert!(!error.to_string().is_empty());
    }
}

/// Shows why there is nothing to see, if so.
fn show(result: Result<(), JobError>) {
    if let Err(error) = result {
        assert!(!error.to_string().is_empty());
    }
}

fn picture(imported: Imported, materials: Option<&Path>) -> Result<(), JobError> {
    let mut scene = to_disney(imported.scene, &ConvertOptions::default()).scene;
    if let Some(library) = materials.map(|path| Library::read(path, Reach::Folder)).transpose()?.flatten() {
        library.lay_over(&mut scene)?;
    }
    if scene.cameras.is_empty() {
        let camera = framing::frame(&scene);
        scene.cameras.push(Named::new("default", camera));
    }
    if !studio::is_lit(&scene) {
        scene.environment = Some(Environment::constant(Rgb::WHITE));
    }
    let settings = RenderSettings {
        width: Some(4),
        height: Some(3),
        spp: 1,
        replicates: 1,
        max_depth: 4,
        ..RenderSettings::default()
    };
    let geometry = Arc::new(Geometry::build(&scene)?);
    let prepared = Prepared::new(Arc::new(scene), geometry, &settings)?;
    render(&prepared, &Control::default());
    Ok(())
}

fn build() -> &'static Build {
    static BUILD: OnceLock<Build> = OnceLock::new();
    BUILD.get_or_init(|| Build::current().unwrap_or_else(|error| panic!("{error}")))
}

/// A folder with an image, `t.png`, and the input.
struct Folder(tempfile::TempDir);

impl Folder {
    /// In memory where that can be.
    fn new() -> Self {
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        let folder = Self(folder.unwrap_or_else(|error| panic!("a temporary folder: {error}")));
        folder.write("t.png", include_bytes!("../seeds/image/t.png"));
        folder
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        let written = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        // A name may be that of a folder, or too long; then there is no such file.
        let _ = written.and_then(|()| std::fs::write(&path, bytes));
        path
    }

    /// Writes the files in `input`, the first of which is `first`, whose path it gives.
    fn unpack(&self, first: &str, input: &[u8]) -> PathBuf {
        let (mut name, mut content) = (first.to_owned(), Vec::new());
        for line in input.split_inclusive(|&b| b == b'\n') {
            let next =
                line.strip_prefix(SEPARATOR.as_bytes()).and_then(|next| std::str::from_utf8(next).ok());
            match next.map(str::trim).filter(|next| is_plain(next)) {
                None => content.extend_from_slice(line),
                Some(next) => {
                    self.write(&name, &content);
                    content.clear();
                    next.clone_into(&mut name);
                }
            }
        }
        self.write(&name, &content);
        self.0.path().join(first)
    }
}

/// Whether a file of that name lies in the folder.
fn is_plain(name: &str) -> bool {
    let mut parts = name.split('/');
    let plain = |c: u8| c.is_ascii_alphanumeric() || b"_-.".contains(&c);
    name.len() < 100
        && parts.all(|part| !part.is_empty() && part != ".." && part != "." && part.bytes().all(plain))
}
