//! GLB files made in memory, and a sample that has a bit of everything.

use std::f32::consts::FRAC_1_SQRT_2;
use std::io::Cursor;
use std::path::Path;

use pipeline::import::{GltfError, ImportError, ImportOptions, Imported, import_bytes};
use serde_json::{Value, json};

use crate::glb::pack;

/// A binary chunk with its views and accessors.
#[derive(Default)]
pub(crate) struct Bin {
    pub(crate) bytes: Vec<u8>,
    pub(crate) views: Vec<Value>,
    pub(crate) accessors: Vec<Value>,
}

impl Bin {
    /// A view of `bytes`, aligned to 4.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    /// An accessor of `count` elements in a view of its own.
    pub(crate) fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "count": count, "type": kind,
            "normalized": component == 5121 && kind != "SCALAR"}));
        self.accessors.len() - 1
    }

    /// An accessor of floats.
    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let components = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(kind, 5126, values.len() / components, &bytes)
    }
}

/// A GLB of `json` and `bin`, whose views, accessors and buffer are added to the JSON.
pub(crate) fn glb(mut json: Value, bin: &Bin) -> Vec<u8> {
    json["asset"] = json!({"version": "2.0"});
    json["buffers"] = json!([{"byteLength": bin.bytes.len()}]);
    json["bufferViews"] = json!(bin.views);
    json["accessors"] = json!(bin.accessors);
    pack(&json, &bin.bytes)
}

/// A unit square in the plane z = 0 with every attribute.
pub(crate) fn square(bin: &mut Bin) -> Value {
    let position = bin.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    let normal = bin.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    let tangent = bin.floats("VEC4", &[1., 0., 0., 1.].repeat(4));
    let uv = bin.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    let uv1 = bin.accessor("VEC2", 5121, 4, &[0, 0, 255, 0, 255, 255, 0, 255]);
    let color = bin.accessor("VEC4", 5121, 4, &[255, 0, 51, 102].repeat(4));
    let indices = bin.accessor("SCALAR", 5123, 6, &[0, 0, 1, 0, 2, 0, 0, 0, 2, 0, 3, 0]);
    json!({"attributes": {"POSITION": position, "NORMAL": normal, "TANGENT": tangent, "TEXCOORD_0": uv,
        "TEXCOORD_1": uv1, "COLOR_0": color}, "indices": indices})
}

/// A file with only a square: one mesh, one node, one scene.
pub(crate) fn minimal(edit: impl FnOnce(&mut Value, &mut Bin)) -> Vec<u8> {
    let mut bin = Bin::default();
    let mut json = json!({"meshes": [{"primitives": [square(&mut bin)]}], "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}]});
    edit(&mut json, &mut bin);
    glb(json, &bin)
}

/// A file with a bit of everything.
pub(crate) fn sample() -> Vec<u8> {
    let mut bin = Bin::default();
    let mut cut_out = square(&mut bin);
    cut_out["material"] = json!(0);
    let mut coated = square(&mut bin);
    coated["material"] = json!(1);
    coated["mode"] = json!(5);
    coated["indices"] = json!(bin.accessor("SCALAR", 5121, 4, &[0, 1, 3, 2]));
    let plain = json!({"attributes": {"POSITION": cut_out["attributes"]["POSITION"]}, "mode": 6});
    let mut png = Vec::new();
    let pixels =
        image::RgbaImage::from_fn(2, 2, |x, y| image::Rgba([x as u8 * 255, y as u8 * 255, 128, 255]));
    pixels.write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let png = bin.view(&png);
    let json = json!({
        "extensionsUsed": ["KHR_lights_punctual", "KHR_texture_transform", "VENDOR_nonsense"],
        "scene": 0,
        "scenes": [{"nodes": [0, 4, 5]}],
        "nodes": [
            {"name": "root", "translation": [0, 1, 0], "scale": [2, 2, 2], "children": [1, 2, 3]},
            {"name": "left", "mesh": 0, "rotation": [0, FRAC_1_SQRT_2, 0, FRAC_1_SQRT_2]},
            {"name": "right", "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]},
            {"name": "eye", "camera": 0, "translation": [0, 0, 5]},
            {"mesh": 1},
            {"name": "sun", "rotation": [(-FRAC_1_SQRT_2), 0, 0, FRAC_1_SQRT_2], "children": [6, 7],
             "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}},
            {"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 2}}}
        ],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 1.5, "znear": 0.1}},
            {"name": "plan", "type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1, "zfar": 9, "znear": 0}}
        ],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "directional", "intensity": 3, "color": [1, 0.5, 0.25]},
            {"name": "bulb", "type": "point", "range": 10},
            {"name": "beam", "type": "spot", "intensity": 7, "spot": {"outerConeAngle": 0.5}}
        ]}},
        "meshes": [{"name": "pair", "primitives": [cut_out, coated]}, {"name": "plain", "primitives": [plain]}],
        "materials": [
            {"name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
             "emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0, "texCoord": 1},
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}},
             "normalTexture": {"index": 1, "scale": 0.5, "extensions": {"KHR_texture_transform": {"scale": [4, 2]}}},
             "occlusionTexture": {"index": 1},
             "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.6, 0.7, 0.8], "baseColorTexture": {"index": 0,
                "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "texCoord": 1}}},
                "metallicFactor": 0.25, "roughnessFactor": 0.75, "metallicRoughnessTexture": {"index": 0}}},
            {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5, "baseColorFactor": [0.8, 0.2, 0.2, 1]},
             "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1},
                "KHR_materials_ior": {"ior": 1.8}, "KHR_materials_iridescence": {"iridescenceFactor": 1},
                "KHR_materials_sheen": {"sheenColorFactor": [0.4, 0.1, 0.1]},
                "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": 1.5}}}
        ],
        "textures": [{"source": 0, "sampler": 0}, {"source": 0}],
        "samplers": [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"bufferView": png, "mimeType": "image/png", "name": "tiny"}]
    });
    glb(json, &bin)
}

/// Imports `bytes` as a file called `name`; it must not name others.
pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Imported, ImportError> {
    import_bytes(Path::new(name), bytes, &ImportOptions::default())
}

/// The error that importing a GLB gives.
pub(crate) fn error_of(bytes: &[u8]) -> GltfError {
    match read("bad.glb", bytes) {
        Err(ImportError::Gltf { cause, .. }) => *cause,
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("no error"),
    }
}
