//! Changing a GLB so that its chunks stay chunks and its JSON stays JSON: what is behind the parser is reached.

use libfuzzer_sys::fuzzer_mutate;
use serde_json::{Map, Value, json};

use crate::glb::pack;

/// Numbers at which things change.
const NUMBERS: [f64; 20] = [
    0.0,
    -1.0,
    1.0,
    2.0,
    3.0,
    4.0,
    16.0,
    255.0,
    256.0,
    65535.0,
    65536.0,
    1e6,
    1e9,
    2147483647.0,
    4294967295.0,
    1.8446744073709552e19,
    0.5,
    1e-30,
    1e30,
    -1e300,
];

/// Words that mean something in a value.
const WORDS: [&str; 16] = [
    "SCALAR",
    "VEC2",
    "VEC3",
    "VEC4",
    "MAT4",
    "MASK",
    "BLEND",
    "STEP",
    "CUBICSPLINE",
    "weights",
    "rotation",
    "spot",
    "t.png",
    "../t.png",
    "data:image/png;base64,AAAA",
    "",
];

/// Keys of which a copy elsewhere means something.
const KEYS: [&str; 24] = [
    "extensions",
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "KHR_texture_transform",
    "KHR_materials_pbrSpecularGlossiness",
    "sparse",
    "skin",
    "mesh",
    "children",
    "targets",
    "weights",
    "TANGENT",
    "TEXCOORD_0",
    "JOINTS_0",
    "WEIGHTS_0",
    "normalTexture",
    "bufferView",
    "byteStride",
    "byteOffset",
    "normalized",
    "matrix",
];

/// Changes the `size` bytes of a GLB at the beginning of `data`, of which `max_size` may be used; the new size.
pub fn glb(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let mut random = Random(u64::from(seed) << 1 | 1);
    let Some((mut json, mut bin)) = split(&data[..size]).filter(|_| random.below(16) > 0) else {
        return fuzzer_mutate(data, size, max_size);
    };
    if random.below(3) == 0 && !bin.is_empty() {
        let room = max_size.saturating_sub(size);
        let used = bin.len();
        bin.resize(used + room, 0);
        let used = fuzzer_mutate(&mut bin, used, used + room);
        bin.truncate(used);
    } else {
        for _ in 0..=random.below(3) {
            edit(&mut json, &mut random);
        }
    }
    let packed = pack(&json, &bin);
    if packed.len() > max_size {
        return fuzzer_mutate(data, size, max_size);
    }
    data[..packed.len()].copy_from_slice(&packed);
    packed.len()
}

/// The chunks of a GLB, or JSON alone.
fn split(bytes: &[u8]) -> Option<(Value, Vec<u8>)> {
    if !bytes.starts_with(b"glTF") {
        return Some((serde_json::from_slice(bytes).ok()?, Vec::new()));
    }
    let length = u32::from_le_bytes(bytes.get(12..16)?.try_into().ok()?) as usize;
    let json = serde_json::from_slice(bytes.get(20..20usize.checked_add(length)?)?).ok()?;
    Some((json, bytes.get(28 + length..).unwrap_or_default().to_vec()))
}

/// Changes one value somewhere in `json`.
fn edit(json: &mut Value, random: &mut Random) {
    let count = count(json);
    let other = nth(json, &mut random.below(count)).cloned().unwrap_or_default();
    let Some(value) = nth(json, &mut random.below(count)) else { return };
    // A small part of another place, so that files don't explode.
    let other = if other.to_string().len() < 500 { other } else { json!({}) };
    if random.below(8) == 0 {
        *value = other;
        return;
    }
    match value {
        Value::Number(n) => {
            let now = n.as_f64().unwrap_or_default();
            let new = match random.below(4) {
                0 => now + 1.0,
                1 => now - 1.0,
                2 => random.below(16) as f64,
                _ => NUMBERS[random.below(NUMBERS.len())],
            };
            *value = if new.fract() == 0.0 && (0.0..1.8e19).contains(&new) {
                json!(new as u64)
            } else {
                json!(new)
            };
        }
        Value::String(s) => WORDS[random.below(WORDS.len())].clone_into(s),
        Value::Bool(b) => *b = !*b,
        Value::Null => *value = json!(random.below(4)),
        Value::Array(items) => {
            let at = random.below(items.len() + 1);
            match random.below(4) {
                0 if at < items.len() => drop(items.remove(at)),
                1 if at < items.len() => {
                    let copies = vec![items[at].clone(); 1 << random.below(7)];
                    items.splice(at..at, copies);
                }
                2 if at < items.len() => {
                    let with = random.below(items.len());
                    items.swap(at, with);
                }
                _ => items.insert(at, other),
            }
        }
        Value::Object(fields) => edit_fields(fields, other, random),
    }
}

fn edit_fields(fields: &mut Map<String, Value>, other: Value, random: &mut Random) {
    let key = fields.keys().nth(random.below(fields.len().max(1))).cloned();
    match (key, random.below(3)) {
        (Some(key), 0) => drop(fields.remove(&key)),
        (Some(key), 1) => drop(fields.insert(key, other)),
        _ => {
            let index = json!(random.below(8));
            let value = if random.below(2) == 0 { other } else { index };
            fields.insert(KEYS[random.below(KEYS.len())].to_owned(), value);
        }
    }
}

/// How many values there are in `json`.
fn count(json: &Value) -> usize {
    1 + match json {
        Value::Array(items) => items.iter().map(count).sum(),
        Value::Object(fields) => fields.values().map(count).sum(),
        _ => 0,
    }
}

/// The value that comes after `left` others.
fn nth<'a>(json: &'a mut Value, left: &mut usize) -> Option<&'a mut Value> {
    if *left == 0 {
        return Some(json);
    }
    *left -= 1;
    match json {
        Value::Array(items) => items.iter_mut().find_map(|item| nth(item, left)),
        Value::Object(fields) => fields.values_mut().find_map(|item| nth(item, left)),
        _ => None,
    }
}

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % bound.max(1) as u64) as usize
    }
}
