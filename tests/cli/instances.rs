//! A mesh in thousands of places.

use serde_json::json;

use crate::support::{Desk, SMALL_ARGUMENTS, confined};

/// Rows and columns of the mesh's squares, of which each is two triangles.
const SIDE: u16 = 50;

/// A sheet of 5000 triangles in 2000 places, as glTF with a file of its bytes.
fn forest() -> (Vec<u8>, Vec<u8>) {
    let wave = |x: u16, z: u16| [f32::from(x), f32::from(x * z % 7) * 0.3, f32::from(z)].map(|v| v * 0.02);
    let positions = (0..=SIDE).flat_map(|z| (0..=SIDE).map(move |x| wave(x, z)));
    let squares = (0..SIDE).flat_map(|z| (0..SIDE).map(move |x| z * (SIDE + 1) + x));
    let indices = squares.flat_map(|at| {
        let [a, b, c, d] = [at, at + 1, at + SIDE + 1, at + SIDE + 2];
        [a, c, b, b, c, d]
    });
    let places = (0..2000u16).map(|i| [f32::from(i % 50) * 1.3 - 32.0, -1.0, f32::from(i / 50) * -1.3]);
    let floats = |rows: &mut dyn Iterator<Item = [f32; 3]>| {
        rows.flatten().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
    };
    let parts = [
        floats(&mut positions.clone()),
        floats(&mut places.clone()),
        indices.clone().flat_map(u16::to_le_bytes).collect(),
    ];
    let mut start = 0;
    let views = parts.each_ref().map(|part| {
        let view = json!({"buffer": 0, "byteOffset": start, "byteLength": part.len()});
        start += part.len();
        view
    });
    let json = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "buffers": [{"byteLength": start, "uri": "forest.bin"}],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "count": positions.count(), "componentType": 5126, "type": "VEC3",
             "min": [0.0, 0.0, 0.0], "max": [1.0, 0.036, 1.0]},
            {"bufferView": 1, "count": places.count(), "componentType": 5126, "type": "VEC3"},
            {"bufferView": 2, "count": indices.count(), "componentType": 5123, "type": "SCALAR"},
        ],
        "materials": [{}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "material": 0}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 1.33, "znear": 0.01}}],
        "nodes": [
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}},
            {"camera": 0, "translation": [0.0, 1.0, 4.0]},
        ],
        "scenes": [{"nodes": [0, 1]}],
    });
    (json.to_string().into_bytes(), parts.concat())
}

/// Ten million triangles, whose copies would take 1.4 GB, in less than a third of one.
#[test]
fn a_forest_takes_no_memory_for_each_of_its_trees() {
    let desk = Desk::new("");
    let (json, bytes) = forest();
    std::fs::write(desk.path("forest.gltf"), json).expect("written");
    std::fs::write(desk.path("forest.bin"), bytes).expect("written");
    let arguments = ["render", "forest.gltf", "-o", "forest.exr"];
    confined(&desk, 0, &[&arguments[..], &SMALL_ARGUMENTS].concat())
        .ends_with(0)
        .tells("2000 instances of a mesh take 2 MB instead of 1450 MB");
}
