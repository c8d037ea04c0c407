//! The outside of a glTF file: GLB chunks, JSON, version and required extensions.

use gltf::json::{Root, Value};

use super::animation::NO_NODE;
use super::error::GltfError;

/// The extensions that are read, or dropped with a note. A file that requires another one is refused.
pub(super) const EXTENSIONS: &[&str] = &[
    "EXT_lights_image_based",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// The most JSON that is parsed, in bytes; it takes many times its size in memory.
const MAX_JSON: usize = 256 << 20;
/// The most objects in it, however small it is, and the bytes for each further one. Parsed, an object takes some 700 bytes, even if it is `{"a":0}`;
/// those of glTF are seldom shorter than 30.
const FREE_OBJECTS: usize = 1 << 16;
const BYTES_PER_OBJECT: usize = 20;
const MAGIC: &[u8; 4] = b"glTF";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BIN_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// A parsed glTF file.
pub(super) struct Document<'a> {
    /// The JSON.
    pub(super) root: Root,
    /// The GLB's binary chunk.
    pub(super) blob: Option<&'a [u8]>,
}

/// The glTF file in `bytes`, GLB or plain JSON, whose version and required extensions are read. No index in it has been checked.
pub(super) fn open(bytes: &[u8]) -> Result<Document<'_>, GltfError> {
    let (json, blob) = if bytes.starts_with(MAGIC) { split_glb(bytes)? } else { (bytes, None) };
    if json.len() > MAX_JSON {
        return Err(GltfError::JsonSize { size: json.len(), limit: MAX_JSON });
    }
    // Braces in texts count too: they are rare.
    let objects = json.iter().filter(|&&b| b == b'{').count();
    let limit = FREE_OBJECTS + json.len() / BYTES_PER_OBJECT;
    if objects > limit {
        return Err(GltfError::TooMany { what: "objects in its JSON", limit: limit as u64 });
    }
    let mut value: Value = gltf::json::deserialize::from_slice(json)?;
    check_extensions(&value)?;
    prepare(&mut value);
    let root: Root = gltf::json::deserialize::from_value(value)?;
    for version in [Some(&root.asset.version), root.asset.min_version.as_ref()].into_iter().flatten() {
        if !version.starts_with("2.") {
            return Err(GltfError::Version { found: version.clone() });
        }
    }
    Ok(Document { root, blob })
}

/// A GLB's JSON and binary chunks. Later chunks are skipped, as the specification asks.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GltfError> {
    let word =
        |at: usize| {
            bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes).ok_or(
                GltfError::Truncated { part: "header", needed: at as u64 + 4, found: bytes.len() as u64 },
            )
        };
    let version = word(4)?;
    if version != 2 {
        return Err(GltfError::Container { part: "version", expected: 2, found: version });
    }
    let length = word(8)?;
    if u64::from(length) > bytes.len() as u64 {
        let (needed, found) = (u64::from(length), bytes.len() as u64);
        return Err(GltfError::Truncated { part: "length", needed, found });
    }
    let chunk = |at: usize, part: &'static str| {
        let (size, kind) = (word(at)?, word(at + 4)?);
        let data = &bytes[at + 8..];
        let found = data.len() as u64;
        let data = data.get(..size as usize);
        let data = data.ok_or(GltfError::Truncated { part, needed: u64::from(size), found })?;
        Ok::<_, GltfError>((kind, data))
    };
    let (kind, json) = chunk(12, "JSON chunk")?;
    if kind != JSON_CHUNK {
        return Err(GltfError::Container { part: "first chunk's type", expected: JSON_CHUNK, found: kind });
    }
    let second = 20 + json.len();
    if second >= length as usize {
        return Ok((json, None));
    }
    let (kind, data) = chunk(second, "BIN chunk")?;
    Ok((json, (kind == BIN_CHUNK).then_some(data)))
}

/// Every extension that the file requires is read.
fn check_extensions(json: &Value) -> Result<(), GltfError> {
    let required = json.get("extensionsRequired").and_then(Value::as_array).into_iter().flatten();
    for extension in required.filter_map(Value::as_str) {
        if !EXTENSIONS.contains(&extension) {
            return Err(GltfError::Required { extension: extension.to_owned(), known: EXTENSIONS });
        }
    }
    Ok(())
}

/// Makes up for what the `gltf` crate's JSON types get wrong: a scene without nodes is legal, so is a channel without one, and an index beyond 2³² - 1 must not
/// wrap around to a small one.
fn prepare(json: &mut Value) {
    for scene in json.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    // A channel whose target an extension names has no node.
    for animation in json.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten() {
        for channel in animation.get_mut("channels").and_then(Value::as_array_mut).into_iter().flatten() {
            if let Some(target) = channel.get_mut("target").and_then(Value::as_object_mut) {
                target.entry("node").or_insert(Value::from(NO_NODE));
            }
        }
    }
    saturate_indices(json, None);
}

/// The properties that the crate truncates to 32 bits.
const TRUNCATED: [&str; 28] = [
    "NORMAL",
    "POSITION",
    "TANGENT",
    "attributes",
    "buffer",
    "bufferView",
    "camera",
    "children",
    "componentType",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "joints",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "node",
    "nodes",
    "output",
    "sampler",
    "scene",
    "skin",
    "source",
    "wrapS",
];

/// Replaces indices beyond 32 bits by the largest one, which is never in range. The parser bounds the depth.
fn saturate_indices(json: &mut Value, inside: Option<&str>) {
    match json {
        Value::Object(fields) => {
            for (key, value) in fields.iter_mut().filter(|(key, _)| *key != "extras") {
                // An attribute's name is free; its value is an index like the others.
                let key = if inside == Some("attributes") { "attributes" } else { key.as_str() };
                saturate_indices(value, Some(key));
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| saturate_indices(item, inside)),
        Value::Number(n) => {
            let index = inside.is_some_and(|key| TRUNCATED.contains(&key) || key == "wrapT");
            if index && n.as_u64().is_some_and(|n| n > u64::from(u32::MAX)) {
                *json = Value::from(u32::MAX);
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root(json: &str) -> Result<Root, GltfError> {
        open(json.as_bytes()).map(|document| document.root)
    }

    #[test]
    fn required_extensions_come_before_anything_else() {
        // The rest of the file is nonsense.
        let error = root(r#"{"extensionsRequired": ["VENDOR_compression"], "meshes": 3}"#).unwrap_err();
        assert!(error.to_string().contains("requires the extension VENDOR_compression"), "{error}");
    }

    #[test]
    fn versions_other_than_2_are_refused() {
        assert!(matches!(root(r#"{"asset": {"version": "1.0"}}"#), Err(GltfError::Version { .. })));
        assert!(root(r#"{"asset": {"version": "2.0"}}"#).is_ok());
        assert!(matches!(root(r#"{}"#), Err(GltfError::Json(_))));
    }

    #[test]
    fn an_index_beyond_32_bits_does_not_wrap_around() {
        let root = root(r#"{"asset": {"version": "2.0"}, "scene": 4294967296, "scenes": [{}]}"#).unwrap();
        assert_eq!(root.scene.unwrap().value(), u32::MAX as usize);
        assert!(root.scenes[0].nodes.is_empty(), "a scene may have no nodes");
    }

    #[test]
    fn glb_headers_are_checked() {
        for (bytes, expected) in [
            (&b"glTF"[..], "header needs 8"),
            (b"glTF\x02\0\0\0\xff\0\0\0", "length needs 255"),
            (b"glTF\x01\0\0\0\x0c\0\0\0", "version"),
            (b"glTF\x02\0\0\0\x0c\0\0\0", "header needs 16"),
            (b"glTF\x02\0\0\0\x14\0\0\0\xff\xff\xff\xffJSON", "JSON chunk needs 4294967295"),
            (b"glTF\x02\0\0\0\x14\0\0\0\0\0\0\0BIN\0", "first chunk"),
        ] {
            let error = open(bytes).err().expect(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
