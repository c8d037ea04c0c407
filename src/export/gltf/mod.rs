//! A GLB of a whole scene: meshes, materials, textures, cameras and lights.
//!
//! Vertices, indices and transforms are written bit for bit. `material` and `lobes` turn Disney materials into glTF's terms, `json` writes
//! those, `texture` fits textures into glTF's slots, `geometry` and `nodes` have the rest, `buffer` the bytes.

mod buffer;
mod geometry;
mod json;
mod lobes;
mod material;
mod nodes;
#[cfg(test)]
mod tests;
mod texture;

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use self::buffer::{Buffer, MAX_GLB};
use self::geometry::{Meshes, Needs};
use self::json::MaterialWriter;
use self::texture::Textures;
use super::ExportError;
use crate::convert::Note;
use crate::scene::{Material, MaterialId, Scene};

/// What the file is called.
pub(super) const FILE_NAME: &str = "scene.glb";

/// A GLB with what the format has no place for.
#[derive(Debug)]
pub(super) struct Glb {
    pub(super) bytes: Vec<u8>,
    pub(super) images: usize,
    pub(super) notes: Vec<Note>,
}

/// All of `scene` as a GLB.
///
/// # Errors
/// If it would be longer than 4 GiB, or an image can't be encoded.
pub(super) fn glb(scene: &Scene<Material>) -> Result<Glb, ExportError> {
    let mut notes = Vec::new();
    let mut textures = Textures::new(scene);
    let mut extensions = BTreeSet::new();
    let (mut materials, mut needs) = (Vec::new(), Vec::new());
    for (i, named) in scene.materials.iter().enumerate() {
        let thickness = thickness(scene, MaterialId(i as u32));
        let material = material::convert(scene, named, thickness, &mut textures, &mut notes);
        needs.push(Needs::of(&named.item, &material));
        let mut writer = MaterialWriter { textures: &mut textures, extensions: &mut extensions };
        materials.push(writer.write(&named.name, &material));
    }
    let mut buffer = Buffer::new(MAX_GLB);
    let mut meshes = Meshes::new(scene, needs);
    let placed = nodes::place(scene, &mut meshes, &mut buffer, &mut notes)?;
    let [textures, samplers, images] = textures.write(&mut buffer)?;
    let count = images.len();

    let mut root = Map::new();
    let mut put = |key: &str, list: Vec<Value>| {
        if !list.is_empty() {
            root.insert(key.to_owned(), list.into());
        }
    };
    put("scenes", vec![json!({"nodes": (0..placed.nodes.len()).collect::<Vec<_>>()})]);
    put("nodes", placed.nodes);
    put("meshes", meshes.json);
    put("materials", materials);
    put("textures", textures);
    put("samplers", samplers);
    put("images", images);
    put("cameras", placed.cameras);
    put("accessors", std::mem::take(&mut buffer.accessors));
    put("bufferViews", std::mem::take(&mut buffer.views));
    put("buffers", vec![json!({"byteLength": buffer.bytes.len()})]);
    if !placed.lights.is_empty() {
        extensions.insert("KHR_lights_punctual");
        root.insert("extensions".into(), json!({"KHR_lights_punctual": {"lights": placed.lights}}));
    }
    if !extensions.is_empty() {
        root.insert("extensionsUsed".into(), extensions.into_iter().collect());
    }
    root.insert("scene".into(), 0.into());
    let generator = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
    root.insert("asset".into(), json!({"version": "2.0", "generator": generator}));
    Ok(Glb { bytes: buffer::glb(&root.into(), &buffer.bytes)?, images: count, notes })
}

/// The smallest side of the box around the first mesh that `material` is on, in that mesh's own space; 1 if it is on none or that is flat.
fn thickness(scene: &Scene<Material>, material: MaterialId) -> f32 {
    let mesh = scene.instances.iter().find(|i| i.material == material).map(|i| scene.mesh_of(i));
    let positions = mesh.map_or(&[][..], |mesh| &mesh.positions);
    let Some(&first) = positions.first() else { return 1.0 };
    let (low, high) = positions.iter().fold((first, first), |(l, h), &p| (l.min(p), h.max(p)));
    let side = (high - low).min_element();
    if side.is_normal() { side } else { 1.0 }
}
