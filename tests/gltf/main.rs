//! glTF files through import and conversion: a sample with a bit of everything against its golden dump, damaged files, and the
//! corpus where it is.

mod animation;
mod compressed;
mod corpus;
mod extensions;
#[path = "../common/glb.rs"]
mod glb;
mod hostile;
#[path = "../common/outside.rs"]
mod outside;
mod sample;
mod undecoded;

use std::path::Path;

use glam::{Vec3, Vec4};
use pipeline::convert::{ConvertOptions, Quality, to_disney};
use pipeline::import::{ImportOptions, LightUnits, import, import_bytes};
use pipeline::scene::Scene;
use pipeline::scene::light::LightKind;
use pipeline::scene::material::{Param, Sides};
use pipeline::scene::source::SourceMaterial;
use sample::{minimal, read, sample};
use serde_json::json;

#[test]
fn the_sample_converts_as_its_golden_dump_says() {
    let imported = read("sample.glb", &sample()).unwrap();
    let converted = to_disney(imported.scene, &ConvertOptions::default());
    let mut text = converted.scene.dump();
    for note in &converted.notes {
        let line = format!("{} {}: {:?}. {}", note.material, note.field, note.quality, note.reason);
        text.push_str(line.trim_end());
        text.push('\n');
    }
    for warning in imported.warnings.iter().chain(&converted.warnings) {
        text.push_str(&format!("{warning}\n"));
    }
    insta::assert_snapshot!("sample", text);
}

#[test]
fn separate_and_embedded_buffers_give_the_same_scene() {
    let glb = sample();
    let expected = read("sample.glb", &glb).unwrap().scene.dump();
    let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut json: serde_json::Value = serde_json::from_slice(&glb[20..20 + json_length]).unwrap();
    let bin = &glb[28 + json_length..];

    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("the data.bin"), bin).unwrap();
    json["buffers"][0]["uri"] = json!("the%20data.bin");
    let options = ImportOptions::default();
    let read = |name, bytes: &[u8]| import_bytes(&folder.path().join(name), bytes, &options).unwrap();
    let path = folder.path().join("sample.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    let separate = import(&path, &options).unwrap();
    assert_eq!(separate.scene.dump(), expected);
    let names: Vec<&str> = separate.files.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["sample.gltf", "the data.bin"]);

    let data: String = bin.iter().map(|b| format!("%{b:02X}")).collect();
    json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream,{data}"));
    assert_eq!(read("embedded.gltf", json.to_string().as_bytes()).scene.dump(), expected);

    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packer, &glb).unwrap();
    assert_eq!(read("sample.glb.gz", &packer.finish().unwrap()).scene.dump(), expected);
}

#[test]
fn nodes_share_meshes_and_mirroring_is_kept() {
    let scene = read("sample.glb", &sample()).unwrap().scene;
    let pairs: Vec<(&str, u32)> = scene.instances.iter().map(|i| (i.name.as_str(), i.mesh.0)).collect();
    assert_eq!(pairs, [("left", 0), ("left", 1), ("right", 0), ("right", 1), ("node_4", 2)]);
    let right = scene.instances[2].world_from_object;
    assert_eq!(right.matrix3.determinant(), -8.0);
    assert_eq!(right.transform_point3(Vec3::X), Vec3::new(4.0, 1.0, 0.0));
    let left = scene.instances[0].world_from_object.transform_point3(Vec3::X);
    assert!((left - Vec3::new(0.0, 1.0, -2.0)).length() < 1e-6, "a quarter turn about y: {left}");
}

#[test]
fn lights_shine_along_minus_z_of_their_nodes() {
    let intensity = |light_units| {
        let options = ImportOptions { light_units, ..ImportOptions::default() };
        let scene = import_bytes(Path::new("s.glb"), &sample(), &options).unwrap().scene;
        let LightKind::Directional { direction } = scene.lights[0].item.kind else { panic!() };
        assert!((direction - Vec3::NEG_Y).length() < 1e-6, "{direction}");
        scene.lights[0].item.intensity
    };
    assert_eq!(intensity(LightUnits::Photometric), 3.0);
    assert_eq!(intensity(LightUnits::Blender), 3.0 / 683.0);
}

#[test]
fn vertex_alpha_counts_only_where_the_alpha_mode_says_so() {
    let color = |mode: &str| {
        let bytes = minimal(|json, _| {
            json["materials"] = json!([{"alphaMode": mode}]);
            json["meshes"][0]["primitives"][0]["material"] = json!(0);
        });
        read("a.glb", &bytes).unwrap().scene.meshes[0].colors[0]
    };
    assert_eq!(color("OPAQUE"), Vec4::new(1.0, 0.0, 0.2, 1.0));
    assert_eq!(color("BLEND"), Vec4::new(1.0, 0.0, 0.2, 0.4));
}

#[test]
fn a_primitive_without_material_has_the_specifications_default() {
    let imported = read("a.glb", &minimal(|_, _| ())).unwrap();
    assert!(imported.warnings.is_empty());
    assert_eq!(imported.scene.materials.len(), 1);
    let SourceMaterial::Gltf(material) = &imported.scene.materials[0].item else { panic!() };
    assert_eq!(
        (material.metallic_factor, material.roughness_factor, material.vertex_color),
        (1.0, 1.0, true)
    );
    let converted = to_disney(imported.scene, &ConvertOptions::default());
    let material = &converted.scene.materials[0].item;
    assert_eq!(material.sides, Sides::Both);
    assert!(matches!(material.base_color, Param::Constant(c) if c.to_array() == [1.0; 3]));
    assert!(converted.notes.iter().all(|n| n.quality == Quality::Carried));
}

#[test]
fn vertices_that_other_primitives_use_are_not_copied() {
    let bytes = minimal(|json, bin| {
        let indices = bin.accessor("SCALAR", 5121, 3, &[0, 2, 3]);
        json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    });
    let mesh = &read("a.glb", &bytes).unwrap().scene.meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!((mesh.triangles.as_slice(), mesh.uvs.len(), mesh.uvs[1].len()), (&[[0, 1, 2]][..], 2, 3));
}

#[test]
fn what_is_not_shown_is_told() {
    let bytes = minimal(|json, bin| {
        let lines = json!({"attributes": {"POSITION": bin.floats("VEC3", &[0.0; 6])}, "mode": 1});
        json["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
        json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "scale": [1, 0, 1]}]);
        json["scenes"][0]["nodes"] = json!([0, 1]);
        json["extensionsUsed"] = json!(["EXT_unheard_of"]);
    });
    let imported = read("a.glb", &bytes).unwrap();
    let all: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    for part in ["Lines", "no inverse", "EXT_unheard_of"] {
        assert_eq!(all.iter().filter(|w| w.contains(part)).count(), 1, "{part}: {all:#?}");
    }
    let scene: &Scene<SourceMaterial> = &imported.scene;
    assert_eq!(scene.triangle_count(), 2);
}
