//! A library's text into entries.

use std::path::Path;

use super::LibraryError;
use crate::disney::Model;
use crate::import::yaml::{self, Node, Place, Value};
use crate::import::{FileDigest, Files, Reach};
use crate::record::Warning;
use crate::scene::{Material, Named, Scene};

/// Top-level keys that make a file an Aris scene.
const SCENE_KEYS: [&str; 5] = ["defaults", "geometry", "brdf", "emitters", "camera"];

/// A material library as its file has it.
#[derive(Debug)]
pub struct Library {
    pub(super) entries: Vec<Entry>,
    pub(super) files: Files,
}

/// What a library says of one material.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) place: Place,
    /// Fields with their values, in the order of the file.
    pub(super) fields: Vec<(String, Place, Node)>,
}

impl Library {
    /// The library in the file `path`, or `None` if it is an Aris scene. Its textures lie in its folder, or elsewhere as far as
    /// `reach` says.
    ///
    /// # Errors
    /// If it can't be read, isn't YAML, or hasn't a library's form.
    pub fn read(path: &Path, reach: Reach) -> Result<Option<Self>, LibraryError> {
        let mut files = Files::new(path.parent().unwrap_or(Path::new("")), reach)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let bytes = files.read(&name)?;
        let entries = entries(&path.display().to_string(), &bytes)?;
        Ok(entries.map(|entries| Self { entries, files }))
    }

    /// The materials alone, each on the default one, in a scene that has their textures.
    ///
    /// # Errors
    /// As [`Self::lay_over`].
    pub fn into_scene(self) -> Result<Scene<Material>, LibraryError> {
        let mut scene = Scene::empty();
        scene.materials = self.entries.iter().map(|e| Named::new(&e.name, Material::default())).collect();
        self.lay_over(&mut scene)?;
        Ok(scene)
    }

    /// Gives the materials of `scene` what the library says of them; returns the files that were read, for the job's identity, and
    /// what was noticed.
    ///
    /// # Errors
    /// If the scene lacks a material, a field doesn't exist or take its value, or a texture can't be read.
    pub fn lay_over(
        self,
        scene: &mut Scene<Material>,
    ) -> Result<(Vec<FileDigest>, Vec<Warning>), LibraryError> {
        super::overlay::lay_over(self, scene)
    }
}

/// The entries of the file called `name`, or `None` if it is a scene.
pub(super) fn entries(name: &str, bytes: &[u8]) -> Result<Option<Vec<Entry>>, LibraryError> {
    let root = yaml::parse(name, bytes).map_err(Box::new)?;
    let place = root.place.clone();
    let Value::Map(top) = root.value else {
        return Err(form(&place, "a map from names to materials is expected"));
    };
    if top.is_empty() {
        return Err(form(&place, "the library has no materials"));
    }
    // Materials may be called as anything else is.
    if !top.iter().all(|(.., node)| says_its_model(node)) {
        if top.iter().any(|(key, ..)| SCENE_KEYS.contains(&key.as_str())) {
            return Ok(None);
        }
        let is_field = |node: &Node| match &node.value {
            Value::Map(fields) => fields.iter().any(|(key, ..)| key == super::keys::FILE),
            _ => true,
        };
        if top.iter().all(|(key, _, node)| key == CONFIG || is_field(node)) {
            let stem = Path::new(name).file_stem().map_or(name.into(), |s| s.to_string_lossy());
            return Ok(Some(vec![entry(stem.into_owned(), place, top)?]));
        }
    }
    top.into_iter()
        .map(|(key, place, node)| match node.value {
            Value::Map(fields) => entry(key, place, fields),
            _ => Err(form(&node.place, "a map of fields is expected, such as {roughness: 0.3}")),
        })
        .collect::<Result<_, _>>()
        .map(Some)
}

/// The key of an entry's fields in Aris' shape, beside `name`, which is the model's.
const CONFIG: &str = "config";
const NAME: &str = "name";

/// Whether this is an entry in Aris' shape, as libraries are written: no part of a scene has the name of a model.
fn says_its_model(node: &Node) -> bool {
    let is_model = |value: &Value| matches!(value, Value::Text(name) if Model::from_name(name).is_some());
    match &node.value {
        Value::Map(fields) => fields.iter().any(|(key, _, node)| key == NAME && is_model(&node.value)),
        _ => false,
    }
}

/// An entry of `fields`, those under `config` taken for its own.
fn entry(name: String, place: Place, fields: Vec<(String, Place, Node)>) -> Result<Entry, LibraryError> {
    let mut flat = Vec::with_capacity(fields.len());
    for (key, at, node) in fields {
        match (key.as_str(), node.value) {
            (CONFIG, Value::Map(inner)) => flat.extend(inner),
            (CONFIG, _) => return Err(form(&node.place, "config is a map of fields")),
            (NAME, value) => flat.push(("model".to_owned(), at, Node { place: node.place, value })),
            (_, value) => flat.push((key, at, Node { place: node.place, value })),
        }
    }
    Ok(Entry { name, place, fields: flat })
}

pub(super) fn form(place: &Place, why: &str) -> LibraryError {
    LibraryError::Form { place: place.to_string(), why: why.to_owned() }
}
