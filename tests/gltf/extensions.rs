//! Extensions of meshes and nodes: material variants, instancing and visibility.

use std::path::Path;

use glam::Vec3;
use pipeline::import::{GltfError, ImportError, ImportOptions, Imported, import_bytes};
use pipeline::scene::environment::{EnvironmentMap, Equirectangular};
use pipeline::scene::source::SourceMaterial;
use pipeline::scene::texture::{Encoding, Pixels};
use serde_json::{Value, json};

use crate::sample::{Bin, error_of, minimal, read};

fn with_variant(bytes: &[u8], variant: &str) -> Result<Imported, ImportError> {
    let options = ImportOptions { variant: Some(variant.into()), ..ImportOptions::default() };
    import_bytes(Path::new("v.glb"), bytes, &options)
}

/// A square of the material "own", that "night" shows in "black".
fn variants(edit: impl FnOnce(&mut Value)) -> Vec<u8> {
    minimal(|json, _| {
        json["extensionsRequired"] = json!(["KHR_materials_variants"]);
        json["extensions"] =
            json!({"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}});
        json["materials"] = json!([{"name": "own"}, {"name": "black"}]);
        let primitive = &mut json["meshes"][0]["primitives"][0];
        primitive["material"] = json!(0);
        primitive["extensions"] =
            json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}});
        edit(json);
    })
}

#[test]
fn a_variant_changes_materials_and_must_exist() {
    let bytes = variants(|_| ());
    let material = |imported: Imported| {
        imported.scene.materials[imported.scene.instances[0].material.0 as usize].name.clone()
    };
    assert_eq!(material(read("v.glb", &bytes).unwrap()), "own");
    assert_eq!(material(with_variant(&bytes, "day").unwrap()), "own", "it has no mapping");
    assert_eq!(material(with_variant(&bytes, "night").unwrap()), "black");
    let error = with_variant(&bytes, "noon").unwrap_err().to_string();
    assert!(error.contains("\"noon\"") && error.contains("day, night"), "{error}");
    let error = with_variant(&minimal(|_, _| ()), "noon").unwrap_err().to_string();
    assert!(error.contains("the file has none"), "{error}");
}

#[test]
fn damaged_variants_are_errors() {
    let mappings = |value: Value| {
        variants(|json| {
            json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = value;
        })
    };
    for (mappings, part) in [
        (mappings(json!([{"material": 9, "variants": [1]}])), "materials[9]"),
        (mappings(json!([{"material": -1, "variants": [1]}])), "JSON"),
        (mappings(json!(3)), "JSON"),
    ] {
        assert!(read("v.glb", &mappings).is_ok(), "nothing is asked of it");
        let error = with_variant(&mappings, "night").unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let without = variants(|json| json["extensions"] = json!({"KHR_materials_variants": {"variants": [{}]}}));
    assert!(with_variant(&without, "night").is_err());
}

/// A square whose node is instanced with what `attributes` makes.
fn instanced(attributes: impl FnOnce(&mut Bin) -> Value) -> Vec<u8> {
    minimal(|json, bin| {
        json["nodes"][0]["scale"] = json!([2, 2, 2]);
        let attributes = attributes(bin);
        json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    })
}

#[test]
fn instances_stand_in_the_space_of_their_node() {
    let bytes = instanced(|bin| {
        let translation = bin.floats("VEC3", &[0., 0., 0., 1., 2., 3., 0., 0., 0.]);
        // A half turn about z as normalised bytes; the third instance has no extent.
        let rotation = bin.accessor("VEC4", 5120, 3, &[0, 0, 0, 127, 0, 0, 127, 0, 0, 0, 0, 127]);
        bin.accessors[rotation]["normalized"] = json!(true);
        let scale = bin.floats("VEC3", &[1., 1., 1., 3., 1., 1., 0., 0., 0.]);
        json!({"TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale, "_ID": 99})
    });
    let imported = read("i.glb", &bytes).unwrap();
    let at: Vec<Vec3> = imported
        .scene
        .instances
        .iter()
        .map(|i| i.world_from_object.transform_point3(Vec3::new(1.0, 0.0, 0.0)))
        .collect();
    assert_eq!((at.len(), imported.scene.meshes.len()), (2, 1));
    assert_eq!(at[0], Vec3::new(2.0, 0.0, 0.0));
    assert!((at[1] - Vec3::new(-4.0, 4.0, 6.0)).length() < 1e-5, "{}", at[1]);
    assert!(imported.warnings.iter().any(|w| w.to_string().contains("no inverse")));
}

#[test]
fn damaged_instances_are_errors() {
    let uneven = instanced(
        |bin| json!({"TRANSLATION": bin.floats("VEC3", &[0.; 6]), "SCALE": bin.floats("VEC3", &[1.; 3])}),
    );
    let not_finite = instanced(|bin| json!({"TRANSLATION": bin.floats("VEC3", &[0., f32::NAN, 0.])}));
    let no_rotation = instanced(|bin| json!({"ROTATION": bin.floats("VEC4", &[0.; 4])}));
    for bytes in [uneven, not_finite, no_rotation] {
        let error = error_of(&bytes);
        assert!(matches!(error, GltfError::Invalid { property: "attributes", .. }), "{error}");
    }
    assert!(matches!(error_of(&instanced(|_| json!({"SCALE": 99}))), GltfError::Reference { .. }));
    assert!(matches!(error_of(&instanced(|_| json!(7))), GltfError::Json(_)));
    // A small file must not ask for much memory.
    let many = instanced(|bin| {
        bin.accessors.push(json!({"count": 1 << 24, "componentType": 5126, "type": "VEC3"}));
        json!({"TRANSLATION": bin.accessors.len() - 1})
    });
    let what = "elements in an accessor without a bufferView";
    assert!(matches!(error_of(&many), GltfError::TooMany { what: w, .. } if w == what));
    let again = instanced(|bin| {
        bin.accessors.push(json!({"count": 1 << 16, "componentType": 5126, "type": "VEC3"}));
        let accessor = bin.accessors.len() - 1;
        json!({"TRANSLATION": accessor, "SCALE": accessor})
    });
    // As many may be asked for, but no more than there is to see: a scale of 0 shows nothing.
    assert!(matches!(read("again.glb", &again), Err(ImportError::Invalid { .. })));
}

#[test]
fn hidden_nodes_hide_what_is_below_them_but_cameras() {
    let bytes = minimal(|json, _| {
        let hidden = json!({"KHR_node_visibility": {"visible": false}});
        let shown = json!({"KHR_node_visibility": {"visible": true}});
        json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]);
        json["nodes"] = json!([
            {"mesh": 0, "name": "seen"},
            {"mesh": 0, "name": "hidden", "extensions": hidden, "children": [2]},
            {"mesh": 0, "name": "below", "camera": 0, "extensions": shown}
        ]);
        json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    let scene = read("h.glb", &bytes).unwrap().scene;
    let names: Vec<&str> = scene.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!((names, scene.cameras.len()), (vec!["seen"], 1));
}

/// A square of one material with KHR_materials_pbrSpecularGlossiness, and the image 2 × 1 of a black and a white half.
fn specular_glossiness(extension: Value) -> Vec<u8> {
    minimal(|json, bin| {
        let mut png = Vec::new();
        let image = image::RgbaImage::from_raw(2, 1, vec![0, 0, 0, 255, 255, 255, 255, 51]).unwrap();
        image.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
        let png = bin.view(&png);
        json["images"] = json!([{"bufferView": png, "mimeType": "image/png"}]);
        json["textures"] = json!([{"source": 0}]);
        json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
        json["materials"] = json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness": extension}}]);
        json["meshes"][0]["primitives"][0]["material"] = json!(0);
    })
}

#[test]
fn specular_and_glossiness_become_metallic_and_roughness() {
    let gltf = |extension| {
        let scene = read("s.glb", &specular_glossiness(extension)).unwrap().scene;
        let SourceMaterial::Gltf(material) = scene.materials[0].item.clone() else { panic!() };
        (material, scene)
    };
    let (metal, _) = gltf(json!({"diffuseFactor": [0, 0, 0, 0.5], "glossinessFactor": 0.75}));
    assert_eq!((metal.metallic_factor, metal.roughness_factor, metal.alpha_factor), (1.0, 0.25, 0.5));
    assert!(metal.specular_glossiness && metal.base_color_texture.is_none());

    let (textured, scene) =
        gltf(json!({"diffuseFactor": [0, 0, 0, 1], "specularGlossinessTexture": {"index": 0}}));
    let map = textured.metallic_roughness_texture.unwrap();
    let pixels = &scene.images[scene.textures[map.texture.0 as usize].image.0 as usize].pixels;
    // Black is a smooth dielectric; white a metal of glossiness 0.2.
    assert_eq!(*pixels, Pixels::U8(vec![0, 0, 0, 0, 204, 255]));
    assert!(textured.base_color_texture.is_some());

    let turned = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}});
    let (apart, _) = gltf(json!({"diffuseTexture": turned, "specularGlossinessTexture": {"index": 0}}));
    assert_ne!(
        apart.base_color_texture.unwrap().texture_from_uv,
        apart.metallic_roughness_texture.unwrap().texture_from_uv
    );
    let error = error_of(&specular_glossiness(json!({"glossinessFactor": 2})));
    assert!(matches!(error, GltfError::Factor { field: "glossinessFactor", .. }), "{error}");
    let error = error_of(&specular_glossiness(json!({"diffuseTexture": {"index": 7}})));
    assert!(matches!(error, GltfError::Reference { .. }), "{error}");
}

#[test]
fn a_cube_map_surrounds_the_scene() {
    let lit = |edit: &dyn Fn(&mut Value)| {
        minimal(|json, bin| {
            // Six faces of one colour each, brighter with the index.
            let images = (0..6u8).map(|i| {
                let mut png = std::io::Cursor::new(Vec::new());
                let face = image::RgbImage::from_pixel(4, 4, image::Rgb([40 * i + 40, 0, 0]));
                image::DynamicImage::ImageRgb8(face).write_to(&mut png, image::ImageFormat::Png).unwrap();
                json!({"bufferView": bin.view(png.get_ref()), "mimeType": "image/png"})
            });
            json["images"] = images.collect();
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let mut light = json!({"intensity": 2.0, "rotation": [0.0, half, 0.0, half],
                "irradianceCoefficients": [], "specularImageSize": 4, "specularImages": [[0, 1, 2, 3, 4, 5]]});
            edit(&mut light);
            json["extensions"]["EXT_lights_image_based"] = json!({"lights": [light]});
            json["scenes"][0]["extensions"]["EXT_lights_image_based"] = json!({"light": 0});
            json["extensionsUsed"] = json!(["EXT_lights_image_based"]);
        })
    };
    let scene = read("a.glb", &lit(&|_| ())).unwrap().scene;
    let environment = scene.environment.as_ref().expect("surroundings");
    assert_eq!(environment.intensity, 2.0);
    let EnvironmentMap::Image { image, mapping: Equirectangular::YUp } = environment.map else { panic!() };
    let image = &scene.images[image.0 as usize];
    assert_eq!((image.width, image.height), (16, 8));
    let brightness = |x: u32, y: u32| {
        let linear = image.texel(x, y, Encoding::Linear).color.r;
        (pipeline::color::srgb_from_linear(linear) * 255.0).round() as u32
    };
    // A quarter turn about y carries +z (face 4) to +x, the middle column; +x (face 0) to -z, three eighths of a turn before it.
    assert_eq!(brightness(8, 4), 200);
    assert_eq!(brightness(4, 4), 40, "-z");
    assert_eq!(brightness(0, 0), 120, "+y");
    let error = |edit: &dyn Fn(&mut Value)| read("a.glb", &lit(edit)).unwrap_err().to_string();
    let text = error(&|light| light["specularImages"] = json!([[0, 1]]));
    assert!(text.contains("EXT_lights_image_based.lights[0]") && text.contains("six images"), "{text}");
    assert!(error(&|light| light["rotation"] = json!([0, 0, 0, 5])).contains("unit quaternion"));
    assert!(error(&|light| light["specularImages"] = json!([[0, 1, 2, 3, 4, 77]])).contains("images"));
}
