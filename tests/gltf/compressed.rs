//! Compressed data: meshopt, Draco and WebP.

use std::io::Cursor;
use std::path::Path;

use draco_core::{DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType};
use draco_core::{Mesh, MeshEncoder, PointAttribute, PointIndex};
use glam::Vec3;
use pipeline::import::{GltfError, ImportOptions, import};
use pipeline::scene::texture::Pixels;
use serde_json::{Value, json};

use crate::outside::outside;
use crate::sample::{Bin, error_of, minimal, read};

/// A square whose indices are compressed in mode INDICES.
fn meshopt(edit: impl FnOnce(&mut Value)) -> Vec<u8> {
    minimal(|json, bin| {
        let packed = bin.view(&[0xd1, 0, 4, 4, 6, 8, 4, 0, 0, 0, 0]);
        let at = bin.views[packed]["byteOffset"].clone();
        let mut view = json!({"buffer": 0, "byteLength": 12, "extensions": {"EXT_meshopt_compression":
            {"buffer": 0, "byteOffset": at, "byteLength": 11, "byteStride": 2, "count": 6, "mode": "INDICES"}}});
        edit(&mut view);
        bin.views.push(view);
        bin.accessors
            .push(json!({"bufferView": packed + 1, "count": 6, "componentType": 5123, "type": "SCALAR"}));
        json["meshes"][0]["primitives"][0]["indices"] = json!(bin.accessors.len() - 1);
        json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    })
}

#[test]
fn meshopt_views_are_decompressed() {
    let mesh = &read("m.glb", &meshopt(|_| ())).unwrap().scene.meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let Some(corpus) = outside("PIPELINE_CORPUS") else { return };
    let file = Path::new(&corpus).join("gltf/BoxMeshopt.glb");
    let scene = import(&file, &ImportOptions::default()).unwrap().scene;
    let (mesh, size) = (&scene.meshes[0], scene.bounds().map(|(low, high)| high - low).unwrap());
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 12));
    assert!((size - Vec3::ONE).length() < 1e-3, "{size}");
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let face = (b - a).cross(c - a).normalize();
        assert!(t.iter().all(|&i| face.dot(mesh.normals[i as usize]) > 0.99), "{face}");
    }
}

#[test]
fn damaged_meshopt_views_are_errors() {
    for (key, value) in [
        ("buffer", json!(7)),
        ("byteOffset", json!(1_000_000)),
        ("byteOffset", json!(u64::MAX)),
        ("byteLength", json!(10)),
        ("byteStride", json!(3)),
        ("byteStride", json!(0)),
        ("count", json!(5)),
        ("count", json!(u64::MAX)),
        ("mode", json!("TRIANGLES")),
        ("mode", json!("ATTRIBUTES")),
        ("mode", json!("NONSENSE")),
        ("filter", json!("QUATERNION")),
    ] {
        let bytes = meshopt(|view| view["extensions"]["EXT_meshopt_compression"][key] = value.clone());
        let error = error_of(&bytes);
        let told = matches!(
            error,
            GltfError::Invalid { .. }
                | GltfError::Bytes { .. }
                | GltfError::Reference { .. }
                | GltfError::Json(_)
        );
        assert!(told, "{key} {value}: {error}");
    }
    // A placeholder holds nothing, whatever a view without the extension wants of it.
    let bytes = meshopt(|view| *view = json!({"buffer": 1, "byteLength": 12}));
    assert!(matches!(error_of(&bytes), GltfError::Reference { .. }));
    // So small a view can't hold so much, nor so small a file.
    let claiming = |length: u64| {
        let bytes = meshopt(|view| {
            view["byteLength"] = json!(length);
            view["extensions"]["EXT_meshopt_compression"]["count"] = json!(length / 2);
        });
        error_of(&bytes)
    };
    assert!(matches!(claiming(1 << 20), GltfError::Invalid { .. }));
    assert!(matches!(claiming(1 << 32), GltfError::TooMany { .. }));
}

/// A quad, two metres wide, as Draco data.
fn draco_data() -> Vec<u8> {
    let attribute = |kind, components: u8, values: &[f32]| {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, components, DataType::Float32, false, values.len() / usize::from(components));
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        attribute.buffer_mut().write(0, &bytes);
        attribute
    };
    let mut mesh = Mesh::new();
    mesh.add_attribute(attribute(
        GeometryAttributeType::Position,
        3,
        &[0., 0., 0., 2., 0., 0., 2., 1., 0., 0., 1., 0.],
    ));
    mesh.set_num_faces(2);
    mesh.set_face(FaceIndex(0), [0, 1, 2].map(PointIndex));
    mesh.set_face(FaceIndex(1), [0, 2, 3].map(PointIndex));
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut out = EncoderBuffer::new();
    encoder.encode(&EncoderOptions::new(), &mut out).unwrap();
    out.data().to_vec()
}

/// A primitive whose positions and indices are Draco's.
fn draco(data: &[u8], edit: impl FnOnce(&mut Value, &mut Bin)) -> Vec<u8> {
    minimal(|json, bin| {
        let view = bin.view(data);
        bin.accessors = vec![
            json!({"count": 4, "componentType": 5126, "type": "VEC3"}),
            json!({"count": 6, "componentType": 5123, "type": "SCALAR"}),
        ];
        json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "indices": 1, "extensions":
            {"KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0}}}});
        edit(json, bin);
    })
}

#[test]
fn draco_primitives_are_decompressed() {
    let scene = read("d.glb", &draco(&draco_data(), |_, _| ())).unwrap().scene;
    let (low, high) = scene.bounds().unwrap();
    assert!(low.length() < 1e-3 && (high - Vec3::new(2.0, 1.0, 0.0)).length() < 1e-3, "{low} {high}");
    let mesh = &scene.meshes[0];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        assert!((b - a).cross(c - a).z > 0.9);
    }
    assert_eq!(mesh.triangles.len(), 2);
}

#[test]
fn damaged_draco_primitives_are_errors() {
    let data = draco_data();
    for length in 0..data.len() {
        assert!(read("d.glb", &draco(&data[..length], |_, _| ())).is_err(), "{length}");
    }
    for at in 0..data.len() {
        let mut data = data.clone();
        data[at] ^= 0xff;
        let _ = read("d.glb", &draco(&data, |_, _| ()));
    }
    let extension = |json: &mut Value, key: &str, value: Value| {
        json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"][key] = value;
    };
    let bytes = draco(&data, |json, _| extension(json, "attributes", json!({"POSITION": 9})));
    assert!(matches!(error_of(&bytes), GltfError::Invalid { .. }));
    let bytes = draco(&data, |json, _| extension(json, "bufferView", json!(99)));
    assert!(matches!(error_of(&bytes), GltfError::Reference { .. }));
    let bytes = draco(&data, |_, bin| bin.accessors[0]["count"] = json!(5));
    assert!(matches!(error_of(&bytes), GltfError::Invalid { property: "type or count", .. }));
    let bytes = draco(&data, |json, _| json["meshes"][0]["primitives"][0]["indices"] = json!(77));
    assert!(matches!(error_of(&bytes), GltfError::Reference { .. }));
}

#[test]
fn webp_images_are_read() {
    let textured = |extension: Value| {
        minimal(|json, bin| {
            let mut webp = Vec::new();
            let image = image::RgbaImage::from_raw(1, 1, vec![10, 20, 30, 40]).unwrap();
            image.write_to(&mut Cursor::new(&mut webp), image::ImageFormat::WebP).unwrap();
            let view = bin.view(&webp);
            json["images"] = json!([{"bufferView": view, "mimeType": "image/webp"}]);
            json["textures"] = json!([{"extensions": {"EXT_texture_webp": extension}}]);
            json["extensionsRequired"] = json!(["EXT_texture_webp"]);
            json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
            json["meshes"][0]["primitives"][0]["material"] = json!(0);
        })
    };
    let scene = read("w.glb", &textured(json!({"source": 0}))).unwrap().scene;
    assert_eq!(scene.images[0].pixels, Pixels::U8(vec![10, 20, 30, 40]));
    assert!(matches!(error_of(&textured(json!({"source": 3}))), GltfError::Reference { .. }));
    assert!(matches!(error_of(&textured(json!({}))), GltfError::Json(_)));
}

#[test]
fn ktx2_images_are_read() {
    let Some(corpus) = outside("PIPELINE_CORPUS") else { return };
    let folder = Path::new(&corpus).join("gltf/AnisotropyBarnLamp");
    let file = std::fs::read(folder.join("AnisotropyBarnLamp_normalbump.ktx2")).unwrap();
    let textured = |ktx2: &[u8]| {
        minimal(|json, bin| {
            let view = bin.view(ktx2);
            json["images"] = json!([{"bufferView": view, "mimeType": "image/ktx2"}]);
            json["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
            json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
            json["materials"] = json!([{"normalTexture": {"index": 0}}]);
            json["meshes"][0]["primitives"][0]["material"] = json!(0);
        })
    };
    let scene = read("k.glb", &textured(&file)).unwrap().scene;
    let image = &scene.images[0];
    let Pixels::U8(values) = &image.pixels else { panic!() };
    let channels = usize::from(image.channels);
    assert_eq!(values.len(), image.width as usize * image.height as usize * channels);
    // A normal map points outwards on the whole.
    let mean = |c: usize| {
        let sum: f64 = values.iter().skip(c).step_by(channels).map(|&v| f64::from(v)).sum();
        sum * channels as f64 / values.len() as f64
    };
    assert!((mean(0) - 128.0).abs() < 8.0 && (mean(1) - 128.0).abs() < 8.0 && mean(2) > 200.0);
    for length in (0..600).step_by(60) {
        assert!(read("k.glb", &textured(&file[..length])).is_err(), "{length}");
    }
    for at in (0..300).chain((300..file.len()).step_by(file.len() / 100)) {
        let mut file = file.clone();
        file[at] ^= 0xff;
        let _ = read("k.glb", &textured(&file));
    }
}
