//! Images that nothing samples.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use pipeline::convert::ConvertOptions;
use pipeline::import::{DecodedImages, ImportError, ImportOptions, Imported, import_bytes};
use pipeline::job::load;
use pipeline::raster::Raster;
use pipeline::render::{Control, Prepared, render};
use pipeline::scene::{Image, MaterialId, Scene};
use pipeline::settings::RenderSettings;
use serde_json::{Value, json};

use super::sample::{Bin, minimal, read};

fn png(size: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels = image::RgbImage::from_pixel(size, size, image::Rgb([200, 100, 50]));
    pixels.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

/// A square of the material "worn", beside a material "spare", each of a texture of its own.
fn two_materials(images: [Value; 2], edit: impl FnOnce(&mut Value, &mut Bin)) -> Vec<u8> {
    minimal(|json, bin| {
        let textured =
            |name, i| json!({"name": name, "pbrMetallicRoughness": {"baseColorTexture": {"index": i}}});
        json["materials"] = json!([textured("spare", 1), textured("worn", 0)]);
        json["textures"] = json!([{"source": 0}, {"source": 1}]);
        json["images"] = json!(images);
        json["meshes"][0]["primitives"][0]["material"] = json!(1);
        edit(json, bin);
    })
}

/// The same with images in the file: `worn` and `spare`.
fn embedded(worn: &[u8], spare: &[u8], edit: impl FnOnce(&mut Value)) -> Vec<u8> {
    two_materials([Value::Null, Value::Null], |json, bin| {
        let views = [worn, spare].map(|bytes| bin.view(bytes));
        json["images"] = json!(views.map(|view| json!({"bufferView": view, "mimeType": "image/png"})));
        edit(json);
    })
}

fn sampled_alone(bytes: &[u8], variant: Option<&str>) -> Result<Imported, ImportError> {
    let images = DecodedImages::OfInstances;
    let options = ImportOptions { images, variant: variant.map(str::to_owned), ..ImportOptions::default() };
    import_bytes(Path::new("s.glb"), bytes, &options)
}

/// The image of a material's base colour.
fn image_of<M>(scene: &Scene<M>, material: usize) -> &Arc<Image> {
    // Textures are made in the order in which materials are read: the worn first.
    &scene.images[scene.textures[1 - material].image.0 as usize]
}

#[test]
fn what_no_instance_wears_is_not_decoded() {
    let scene = sampled_alone(&embedded(&png(3), &png(2), |_| ()), None).unwrap().scene;
    assert_eq!(scene.instances[0].material, MaterialId(1));
    assert_eq!(scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["spare", "worn"]);
    assert_eq!(scene.images.iter().filter(|image| image.is_decoded()).count(), 1);
    assert_eq!(image_of(&scene, 1).width, 3);
    let spare = image_of(&scene, 0);
    assert!(!spare.is_decoded() && spare.bytes() == 0, "{spare:?}");
}

#[test]
fn a_broken_image_fails_where_it_is_sampled_and_nowhere_else() {
    let broken = b"\x89PNG\r\n\x1a\nnothing of the kind";
    let spare_is_broken = embedded(&png(1), broken, |_| ());
    let worn_is_broken = embedded(broken, &png(1), |_| ());
    sampled_alone(&spare_is_broken, None).unwrap();
    assert!(sampled_alone(&worn_is_broken, None).is_err());
    // Who wants the materials for themselves needs all of them.
    assert!(read("s.glb", &spare_is_broken).is_err());
}

#[test]
fn a_reference_that_leads_nowhere_is_an_error_all_the_same() {
    let bytes = embedded(&png(1), &png(1), |json| json["textures"][1]["source"] = json!(7));
    let error = sampled_alone(&bytes, None).unwrap_err().to_string();
    assert!(error.contains("images[7]"), "{error}");
}

#[test]
fn an_image_that_both_have_is_decoded() {
    for shared in ["textures", "views"] {
        let bytes = embedded(&png(3), &png(2), |json| match shared {
            "textures" => json["textures"][1]["source"] = json!(0),
            _ => json["images"][1]["bufferView"] = json["images"][0]["bufferView"].clone(),
        });
        let scene = sampled_alone(&bytes, None).unwrap().scene;
        assert_eq!(scene.images.len(), 1, "{shared}");
        assert_eq!(image_of(&scene, 0).width, 3, "{shared}");
    }
}

#[test]
fn a_variant_decides_what_is_decoded() {
    let bytes = embedded(&png(3), &png(2), |json| {
        json["extensionsUsed"] = json!(["KHR_materials_variants"]);
        json["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "other"}]}});
        json["meshes"][0]["primitives"][0]["extensions"] =
            json!({"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}});
    });
    let decoded = |variant| {
        let scene = sampled_alone(&bytes, variant).unwrap().scene;
        scene.images.iter().filter(|image| image.is_decoded()).map(|image| image.width).collect::<Vec<_>>()
    };
    assert_eq!(decoded(None), [3]);
    assert_eq!(decoded(Some("other")), [2]);
}

#[test]
fn what_a_hidden_node_wears_is_not_decoded() {
    let bytes = embedded(&png(3), &png(2), |json| {
        let mut spare = json["meshes"][0].clone();
        spare["primitives"][0]["material"] = json!(0);
        json["meshes"].as_array_mut().unwrap().push(spare);
        json["nodes"] =
            json!([{"mesh": 0}, {"mesh": 1, "extensions": {"KHR_node_visibility": {"visible": false}}}]);
        json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    assert!(!image_of(&sampled_alone(&bytes, None).unwrap().scene, 0).is_decoded());
}

#[test]
fn files_that_nothing_samples_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("worn.png"), png(1)).unwrap();
    let images = [json!({"uri": "worn.png"}), json!({"uri": "is not there.png"})];
    let scene = folder.path().join("s.glb");
    std::fs::write(&scene, two_materials(images, |_, _| ())).unwrap();
    let loaded = load(&scene, &ImportOptions::default(), &ConvertOptions::default(), None).unwrap();
    let names: Vec<&str> = loaded.files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["s.glb", "worn.png"]);
}

/// The bits of a small picture, and the bytes of decoded images, the sky's included.
fn picture(bytes: &[u8]) -> (Raster, u64) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.glb");
    std::fs::write(&path, bytes).unwrap();
    let loaded = load(&path, &ImportOptions::default(), &ConvertOptions::default(), None).unwrap();
    let settings = RenderSettings { width: Some(16), height: Some(16), spp: 4, ..RenderSettings::default() };
    let prepared = Prepared::new(Arc::clone(&loaded.scene), Arc::clone(&loaded.geometry), &settings).unwrap();
    let images = loaded.scene.images.iter().map(|image| image.bytes()).sum();
    (render(&prepared, &Control::default()).raster, images)
}

#[test]
fn a_picture_has_the_same_bits_without_the_spare_texture() {
    let (with, bytes_with) = picture(&embedded(&png(2), &png(2048), |_| ()));
    let without = embedded(&png(2), &png(1), |json| json["materials"][0] = json!({"name": "spare"}));
    let (without, bytes_without) = picture(&without);
    assert_eq!(with, without);
    assert_eq!(bytes_with, bytes_without);
}

/// Each field of glTF that has a texture and a factor, with a factor of 0.
fn factors_of_nothing() -> Vec<(&'static str, Value)> {
    let texture = json!({"index": 1});
    let extension = |name: &'static str, value: Value| (name, json!({"extensions": {name: value}}));
    vec![
        ("emissiveTexture", json!({"emissiveTexture": texture})),
        ("normalTexture", json!({"normalTexture": {"index": 1, "scale": 0.0}})),
        (
            "metallicRoughnessTexture",
            json!({"pbrMetallicRoughness": {
                "metallicFactor": 0.0, "roughnessFactor": 0.0, "metallicRoughnessTexture": texture
            }}),
        ),
        extension(
            "KHR_materials_specular",
            json!({"specularFactor": 0.0, "specularTexture": texture,
                "specularColorFactor": [0, 0, 0], "specularColorTexture": texture}),
        ),
        extension(
            "KHR_materials_clearcoat",
            json!({"clearcoatTexture": texture, "clearcoatRoughnessTexture": texture}),
        ),
        extension("KHR_materials_sheen", json!({"sheenColorTexture": texture})),
        extension("KHR_materials_anisotropy", json!({"anisotropyTexture": texture})),
        extension("KHR_materials_transmission", json!({"transmissionTexture": texture})),
        extension(
            "KHR_materials_diffuse_transmission",
            json!({"diffuseTransmissionTexture": texture, "diffuseTransmissionColorFactor": [0, 0, 0],
                "diffuseTransmissionColorTexture": texture}),
        ),
    ]
}

/// The material without its textures.
fn without_textures(material: &Value) -> Value {
    match material {
        Value::Object(fields) => {
            let kept = fields.iter().filter(|(name, _)| !name.ends_with("Texture"));
            kept.map(|(name, value)| (name.clone(), without_textures(value))).collect()
        }
        other => other.clone(),
    }
}

#[test]
fn what_a_factor_makes_nothing_of_is_not_decoded() {
    for (field, material) in factors_of_nothing() {
        let file =
            |material: Value| embedded(&png(2), &png(64), |json| json["materials"] = json!([{}, material]));
        let bytes = file(material.clone());
        let (with, decoded) = picture(&bytes);
        assert_eq!((with, decoded), picture(&file(without_textures(&material))), "{field}");
        // Who wants the materials for themselves gets it.
        assert_eq!(read("s.glb", &bytes).unwrap().scene.images.len(), 1, "{field}");
    }
}

/// A factor that is not 0 is enough; and the image of one texture may be needed by another.
#[test]
fn what_a_factor_leaves_is_decoded() {
    let (_, sky) = picture(&embedded(&png(2), &png(64), |json| json["materials"] = json!([{}, {}])));
    for (field, material) in factors_of_nothing() {
        let beside = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}});
        let bytes = embedded(&png(2), &png(64), |json| {
            json["materials"] = json!([material, beside]);
            let mut other = json["meshes"][0]["primitives"][0].clone();
            other["material"] = json!(0);
            json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
        });
        assert_eq!(picture(&bytes).1 - sky, 64 * 64 * 3, "{field}");
    }
    let rough = json!({"pbrMetallicRoughness": {
        "metallicFactor": 0.0, "roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": 1}
    }});
    let bytes = embedded(&png(2), &png(64), |json| json["materials"] = json!([{}, rough]));
    assert_eq!(picture(&bytes).1 - sky, 64 * 64 * 3);
}
