//! A writer of binary glTF 2.0: one buffer, embedded images, named materials.

use std::collections::BTreeSet;
use std::io::Cursor;

use glam::{DQuat, DVec3};
use image::{ExtendedColorType, ImageEncoder, codecs::png};
use serde_json::{Value, json};

use super::mesh::Mesh;

const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;

/// Why a GLB could not be written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum GlbError {
    #[error("image \"{image}\": {source}")]
    Image { image: &'static str, source: image::ImageError },
    #[error("JSON chunk: {0}")]
    Json(#[from] serde_json::Error),
    #[error("{0} bytes do not fit into a GLB file")]
    TooLarge(usize),
    #[error("gzip: {0}")]
    Gzip(#[from] std::io::Error),
}

/// What textures do outside of [0, 1].
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrap {
    Repeat,
    Clamp,
}

/// A file in the making.
#[derive(Default)]
pub(crate) struct Glb {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    extensions: BTreeSet<String>,
    triangles: usize,
}

impl Glb {
    /// Triangles so far.
    pub(crate) fn triangles(&self) -> usize {
        self.triangles
    }

    /// Adds a material as the specification writes it; its number.
    pub(crate) fn material(&mut self, material: Value) -> usize {
        let extensions = material["extensions"].as_object();
        self.extensions.extend(extensions.into_iter().flat_map(|named| named.keys().cloned()));
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// A dielectric with a constant colour; its number.
    pub(crate) fn plain(&mut self, name: &str, color: [f64; 3], roughness: f64) -> usize {
        let [r, g, b] = color;
        self.material(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness,
            },
        }))
    }

    /// A black material that emits `color` · `strength`; its number.
    pub(crate) fn emissive(&mut self, name: &str, color: [f64; 3], strength: f64) -> usize {
        self.material(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
            },
            "emissiveFactor": color,
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strength } },
        }))
    }

    /// Embeds an 8-bit image of `N` channels as PNG; the texture's number.
    pub(crate) fn texture<const N: usize>(
        &mut self,
        name: &'static str,
        [width, height]: [u32; 2],
        texel: impl Fn(u32, u32) -> [u8; N],
        wrap: Wrap,
    ) -> Result<usize, GlbError> {
        let pixels: Vec<u8> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .flat_map(|(x, y)| texel(x, y))
            .collect();
        let color = if N == 4 { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
        let mut bytes = Cursor::new(vec![]);
        png::PngEncoder::new_with_quality(&mut bytes, png::CompressionType::Best, png::FilterType::Adaptive)
            .write_image(&pixels, width, height, color)
            .map_err(|source| GlbError::Image { image: name, source })?;
        let view = self.view(bytes.get_ref(), None);
        self.images.push(json!({ "name": name, "bufferView": view, "mimeType": "image/png" }));
        let wrap = if wrap == Wrap::Repeat { 10_497 } else { 33_071 };
        self.samplers.push(json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": wrap, "wrapT": wrap }));
        self.textures.push(
            json!({ "name": name, "source": self.images.len() - 1, "sampler": self.samplers.len() - 1 }),
        );
        Ok(self.textures.len() - 1)
    }

    /// Adds a mesh with its node, both called `name`.
    pub(crate) fn mesh(&mut self, name: &str, mesh: &Mesh, material: usize) {
        self.triangles += mesh.triangles.len();
        let primitives: Vec<Value> = mesh.parts().iter().map(|part| self.primitive(part, material)).collect();
        self.meshes.push(json!({ "name": name, "primitives": primitives }));
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len() - 1 }));
    }

    /// Adds a mesh that stands in several places: moved, turned and scaled, all under one node called `name`.
    #[allow(dead_code, reason = "scenes for benchmarks alone have instances")]
    pub(crate) fn mesh_in_places(
        &mut self,
        name: &str,
        mesh: &Mesh,
        material: usize,
        places: &[(DVec3, DQuat, f64)],
    ) {
        let triangles = self.triangles;
        self.mesh(name, mesh, material);
        self.triangles = triangles + mesh.triangles.len() * places.len();
        let extension = "EXT_mesh_gpu_instancing";
        self.extensions.insert(extension.to_owned());
        let attributes = json!({
            "TRANSLATION": self.floats(places.iter().map(|(at, _, _)| at.to_array()), Bounds::Omitted),
            "ROTATION": self.floats(places.iter().map(|(_, turn, _)| turn.to_array()), Bounds::Omitted),
            "SCALE": self.floats(places.iter().map(|(_, _, scale)| [*scale; 3]), Bounds::Omitted),
        });
        if let Some(node) = self.nodes.last_mut() {
            node["extensions"] = json!({ extension: { "attributes": attributes } });
        }
    }

    fn primitive(&mut self, mesh: &Mesh, material: usize) -> Value {
        let mut attributes = json!({
            "POSITION": self.floats(mesh.positions.iter().map(|p| p.to_array()), Bounds::Stated),
            "NORMAL": self.floats(mesh.normals.iter().map(|n| n.to_array()), Bounds::Omitted),
        });
        if !mesh.uvs.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.floats(mesh.uvs.iter().copied(), Bounds::Omitted));
        }
        if !mesh.colors.is_empty() {
            attributes["COLOR_0"] = json!(self.floats(mesh.colors.iter().copied(), Bounds::Omitted));
        }
        let indices: Vec<u8> =
            mesh.triangles.iter().flatten().flat_map(|&i| (i as u16).to_le_bytes()).collect();
        let view = self.view(&indices, Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_SHORT, "count": 3 * mesh.triangles.len(), "type": "SCALAR",
        }));
        json!({ "attributes": attributes, "indices": self.accessors.len() - 1, "material": material })
    }

    fn floats<const N: usize>(&mut self, rows: impl Iterator<Item = [f64; N]>, bounds: Bounds) -> usize {
        let rows: Vec<[f32; N]> = rows.map(|row| row.map(|x| x as f32)).collect();
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let kind = format!("VEC{N}");
        let mut accessor =
            json!({ "bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": kind });
        if bounds == Bounds::Stated {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f64> {
                (0..N).map(|k| f64::from(rows.iter().fold(start, |m, row| pick(m, row[k])))).collect()
            };
            accessor["min"] = json!(fold(f32::INFINITY, f32::min));
            accessor["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bin.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// A perspective camera called `main` at `position`, looking at `target`; the vertical angle of view in degrees.
    pub(crate) fn camera(&mut self, position: DVec3, target: DVec3, fov_y: f64, aspect: f64) {
        self.cameras.push(json!({
            "name": "main", "type": "perspective",
            "perspective": { "yfov": fov_y.to_radians(), "aspectRatio": aspect, "znear": 0.01 },
        }));
        let back = (position - target).normalize();
        let right = DVec3::Y.cross(back).normalize();
        let up = back.cross(right);
        let matrix: Vec<f64> = [right.extend(0.0), up.extend(0.0), back.extend(0.0), position.extend(1.0)]
            .iter()
            .flat_map(|column| column.to_array())
            .collect();
        self.nodes.push(json!({ "name": "main", "camera": self.cameras.len() - 1, "matrix": matrix }));
    }

    /// A point light of `intensity` candela at `position`, with its node.
    pub(crate) fn point_light(&mut self, name: &str, position: DVec3, color: [f64; 3], intensity: f64) {
        self.extensions.insert("KHR_lights_punctual".to_owned());
        self.lights.push(json!({ "name": name, "type": "point", "color": color, "intensity": intensity }));
        let light = self.lights.len() - 1;
        self.nodes.push(json!({
            "name": name, "translation": position.to_array(),
            "extensions": { "KHR_lights_punctual": { "light": light } },
        }));
    }

    /// The file's bytes.
    pub(crate) fn finish(mut self, scene: &str) -> Result<Vec<u8>, GlbError> {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let mut root = json!({
            "asset": {
                "version": "2.0", "generator": "disney-pipeline make_scenes",
                "copyright": "CC0 1.0 (public domain dedication)",
            },
            "scene": 0,
            "scenes": [{ "name": scene, "nodes": nodes }],
            "buffers": [{ "byteLength": self.bin.len() }],
        });
        let lists = [
            ("bufferViews", self.views),
            ("accessors", self.accessors),
            ("images", self.images),
            ("textures", self.textures),
            ("samplers", self.samplers),
            ("materials", self.materials),
            ("meshes", self.meshes),
            ("nodes", self.nodes),
            ("cameras", self.cameras),
        ];
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root[name] = Value::Array(list);
        }
        if !self.lights.is_empty() {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        if !self.extensions.is_empty() {
            root["extensionsUsed"] = json!(self.extensions);
        }
        let mut text = serde_json::to_vec(&root)?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.bin.len();
        let word = |n: usize| u32::try_from(n).map(u32::to_le_bytes).map_err(|_| GlbError::TooLarge(n));
        let mut file = vec![];
        file.extend(b"glTF");
        file.extend(2u32.to_le_bytes());
        file.extend(word(length)?);
        file.extend(word(text.len())?);
        file.extend(b"JSON");
        file.extend(text);
        file.extend(word(self.bin.len())?);
        file.extend(b"BIN\0");
        file.extend(self.bin);
        Ok(file)
    }
}

/// Whether an accessor states its smallest and largest values.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Bounds {
    Stated,
    Omitted,
}
