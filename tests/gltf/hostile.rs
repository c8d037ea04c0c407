//! Damaged and malicious files: a clear error, never a panic, never memory without end.

use pipeline::import::{FileError, GltfError, ImportError, InvalidScene, UriProblem};
use serde_json::{Value, json};

use crate::sample::{error_of, minimal, read, sample};

#[test]
fn every_truncation_is_an_error() {
    let whole = sample();
    for length in 0..whole.len() {
        // Once as it is, once with a header that agrees, so that the chunks' lengths are what fails.
        let mut part = whole[..length].to_vec();
        assert!(read("part.glb", &part).is_err(), "{length}");
        if length >= 12 {
            part[8..12].copy_from_slice(&(length as u32).to_le_bytes());
            assert!(read("part.glb", &part).is_err(), "{length} with its own length");
        }
    }
}

#[test]
fn no_damaged_byte_causes_a_panic() {
    let whole = sample();
    let mut failed = 0;
    for at in 0..whole.len() {
        for with in [b'9', b'-', 0xff] {
            let mut bytes = whole.clone();
            bytes[at] = with;
            let result = read("a.glb", &bytes);
            failed += usize::from(result.is_err_and(|e| !e.to_string().is_empty()));
        }
    }
    assert!(failed > 1000, "{failed}");
}

#[test]
fn every_reference_out_of_range_names_both_ends() {
    type Edit = fn(&mut Value);
    let edits: [(Edit, &str); 14] = [
        (|j| j["scene"] = json!(7), "scene refers to scenes[7]"),
        (|j| j["scenes"][0]["nodes"] = json!([7]), "scenes[0] refers to nodes[7]"),
        (|j| j["nodes"][0]["children"] = json!([7]), "nodes[0] refers to nodes[7]"),
        (|j| j["nodes"][0]["mesh"] = json!(7), "nodes[0] refers to meshes[7]"),
        (|j| j["nodes"][0]["mesh"] = json!(4294967296u64), "nodes[0] refers to meshes[4294967295]"),
        (|j| j["nodes"][0]["camera"] = json!(7), "nodes[0] refers to cameras[7]"),
        (
            |j| j["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 7}}),
            "nodes[0] refers to lights[7]",
        ),
        (|j| prim(j)["material"] = json!(7), "meshes[0].primitives[0] refers to materials[7]"),
        (|j| prim(j)["indices"] = json!(99), "meshes[0].primitives[0] refers to accessors[99]"),
        (|j| prim(j)["attributes"]["COLOR_0"] = json!(99), "meshes[0].primitives[0] refers to accessors[99]"),
        (
            |j| j["materials"] = json!([{"normalTexture": {"index": 7}}]),
            "materials[0].normalTexture refers to textures[7]",
        ),
        (
            |j| {
                j["materials"] = json!([{"emissiveTexture": {"index": 0}}]);
                j["textures"] = json!([{"source": 7}]);
            },
            "textures[0] refers to images[7]",
        ),
        (
            |j| {
                j["materials"] = json!([{"emissiveTexture": {"index": 0}}]);
                j["textures"] = json!([{"source": 0, "sampler": 7}]);
            },
            "textures[0] refers to samplers[7]",
        ),
        (
            |j| {
                j["materials"] = json!([{"emissiveTexture": {"index": 0}}]);
                j["textures"] = json!([{"source": 0}]);
                j["images"] = json!([{"bufferView": 99, "mimeType": "image/png"}]);
            },
            "images[0] refers to bufferViews[99]",
        ),
    ];
    for (edit, expected) in edits {
        let error = error_of(&minimal(|json, _| edit(json)));
        assert!(matches!(error, GltfError::Reference { .. }), "{error}");
        assert!(error.to_string().starts_with(expected), "{error}");
    }
}

fn prim(json: &mut Value) -> &mut Value {
    &mut json["meshes"][0]["primitives"][0]
}

#[test]
fn accessors_beyond_their_buffers_are_errors() {
    let with = |field: &str, value: Value| error_of(&minimal(|_, bin| bin.accessors[0][field] = value));
    assert!(matches!(with("count", json!(1_000_000_000)), GltfError::Bytes { .. }));
    assert!(matches!(with("count", json!(u64::MAX)), GltfError::TooMany { .. }));
    assert!(matches!(with("count", json!(5)), GltfError::Bytes { .. }));
    assert!(matches!(with("count", json!(3)), GltfError::VertexIndex { index: 3, count: 3, .. }));
    assert!(matches!(with("byteOffset", json!(u64::MAX)), GltfError::Bytes { .. }));
    assert!(matches!(with("type", json!("VEC9")), GltfError::Invalid { property: "type", .. }));
    assert!(matches!(with("componentType", json!(3)), GltfError::Invalid { .. }));
    assert!(matches!(with("bufferView", json!(99)), GltfError::Reference { .. }));
    let normals = error_of(&minimal(|_, bin| bin.accessors[1]["count"] = json!(2)));
    assert!(matches!(normals, GltfError::AttributeCount { found: 2, vertices: 4, .. }), "{normals}");
    for (field, value) in
        [("byteLength", json!(u64::MAX)), ("byteOffset", json!(u64::MAX)), ("byteStride", json!(1))]
    {
        let error = error_of(&minimal(|_, bin| bin.views[0][field] = value));
        assert!(matches!(error, GltfError::Bytes { .. } | GltfError::Invalid { .. }), "{error}");
    }
}

#[test]
fn nodes_must_be_a_tree() {
    for nodes in [
        json!([{"mesh": 0, "children": [0]}]),
        json!([{"mesh": 0, "children": [1]}, {"children": [0]}]),
        json!([{"children": [1, 1]}, {"mesh": 0}]),
    ] {
        let error = error_of(&minimal(|json, _| json["nodes"] = nodes));
        assert!(matches!(error, GltfError::Tree { .. }), "{error}");
    }
    // A very deep one is no harm.
    let deep = minimal(|json, _| {
        let mut nodes: Vec<Value> = (1..100_000).map(|i| json!({"children": [i]})).collect();
        nodes.push(json!({"mesh": 0}));
        json["nodes"] = json!(nodes);
    });
    assert_eq!(read("deep.glb", &deep).unwrap().scene.instances.len(), 1);
}

#[test]
fn uris_stay_in_the_folder() {
    let with = |uri: &str| {
        error_of(&minimal(|json, _| {
            json["images"] = json!([{"uri": uri}]);
            json["textures"] = json!([{"source": 0}]);
            json["materials"] = json!([{"emissiveTexture": {"index": 0}}]);
        }))
    };
    for uri in ["../secret.png", "%2e%2e/secret.png", "/etc/passwd", "a/../../b.png", ""] {
        let error = with(uri);
        assert!(matches!(error, GltfError::File { cause: FileError::Outside { .. }, .. }), "{uri}: {error}");
    }
    for (uri, problem) in [
        ("http://host/a.png", UriProblem::Scheme),
        ("file:///etc/passwd", UriProblem::Scheme),
        ("a%2.png", UriProblem::Percent),
        ("data:image/png;base64,!!!!", UriProblem::Base64),
    ] {
        assert!(matches!(with(uri), GltfError::Uri { problem: p, .. } if p == problem), "{uri}");
    }
    assert!(matches!(with("none.png"), GltfError::File { cause: FileError::Read { .. }, .. }));
    assert!(matches!(with("data:image/png;base64,AAAA"), GltfError::Image(_)));
}

#[test]
fn factors_out_of_range_name_material_and_field() {
    for (material, field) in [
        (json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1.5, 0, 1]}}), "baseColorFactor is 1.5"),
        (
            json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0, -1]}}),
            "baseColorFactor's alpha is -1",
        ),
        (json!({"pbrMetallicRoughness": {"roughnessFactor": -0.1}}), "roughnessFactor is -0.1"),
        (json!({"pbrMetallicRoughness": {"metallicFactor": 1e300}}), "metallicFactor is inf"),
        (json!({"emissiveFactor": [0, 2, 0]}), "emissiveFactor is 2"),
        (json!({"alphaMode": "MASK", "alphaCutoff": -1}), "alphaCutoff is -1"),
        (json!({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}), "ior is 0.5"),
        (
            json!({"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -1}}}),
            "emissiveStrength is -1",
        ),
    ] {
        let error = error_of(&minimal(|json, _| {
            json["materials"] = json!([material]);
            json["materials"][0]["name"] = json!("ball");
        }));
        let text = error.to_string();
        assert!(text.starts_with(&format!("material \"ball\": {field}")), "{text}");
    }
}

#[test]
fn cameras_lights_and_transforms_are_checked() {
    let camera = |camera: Value| {
        error_of(&minimal(|json, _| {
            json["cameras"] = json!([camera]);
            json["nodes"][0]["camera"] = json!(0);
        }))
    };
    for yfov in [0.0, -1.0, 3.2, 1e300] {
        let error = camera(json!({"type": "perspective", "perspective": {"yfov": yfov, "znear": 1}}));
        assert!(matches!(error, GltfError::Range { property: "yfov", .. }), "{error}");
    }
    let error = camera(json!({"type": "perspective"}));
    assert!(matches!(error, GltfError::Missing { property: "perspective", .. }), "{error}");
    let light = |light: Value| {
        error_of(&minimal(|json, _| {
            json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
            json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
        }))
    };
    let spot = json!({"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.4}});
    assert!(matches!(light(spot), GltfError::Range { property: "innerConeAngle", .. }));
    assert!(matches!(light(json!({"type": "spot"})), GltfError::Missing { property: "spot", .. }));
    assert!(matches!(light(json!({"type": "point", "intensity": -1})), GltfError::Range { .. }));
    for node in [
        json!({"mesh": 0, "rotation": [0, 0, 0, 0]}),
        json!({"mesh": 0, "matrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}),
        json!({"mesh": 0, "translation": [1e300, 0, 0]}),
    ] {
        let error = error_of(&minimal(|json, _| json["nodes"][0] = node));
        assert!(matches!(error, GltfError::Invalid { property: "transform", .. }), "{error}");
    }
}

#[test]
fn nan_positions_and_empty_scenes_are_told() {
    let bytes = minimal(|json, bin| {
        let mut values = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
        values[3] = f32::NAN;
        json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(bin.floats("VEC3", &values));
    });
    let imported = read("nan.glb", &bytes).unwrap();
    assert_eq!(imported.scene.triangle_count(), 1);
    assert!(imported.warnings[0].message.contains("1 triangles with NaN"), "{:?}", imported.warnings);
    let empty = minimal(|json, _| json["nodes"][0] = json!({"name": "nothing"}));
    let error = read("empty.glb", &empty).unwrap_err();
    assert!(matches!(error, ImportError::Invalid { cause: InvalidScene::Empty, .. }), "{error}");
    assert!(error.to_string().contains("empty.glb"));
}

#[test]
fn what_only_an_unread_extension_holds_is_named() {
    let required = minimal(|json, _| json["extensionsRequired"] = json!(["VENDOR_materials_nonsense"]));
    assert!(error_of(&required).to_string().contains("requires the extension VENDOR_materials_nonsense"));
    let draco = minimal(|json, bin| {
        bin.accessors[0].as_object_mut().unwrap().remove("bufferView");
        prim(json)["extensions"] = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}});
    });
    let error = error_of(&draco);
    let property = "KHR_draco_mesh_compression";
    assert!(matches!(&error, GltfError::Invalid { property: p, .. } if *p == property), "{error}");
    let dds = minimal(|json, _| {
        json["textures"] = json!([{"extensions": {"MSFT_texture_dds": {"source": 0}}}]);
        json["materials"] = json!([{"emissiveTexture": {"index": 0}}]);
    });
    let error = error_of(&dds);
    assert!(matches!(&error, GltfError::Extension { extension: "MSFT_texture_dds", .. }), "{error}");
}

#[test]
fn attributes_that_are_no_numbers_are_mended_and_counted() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let cases: [(&str, &str, &[f32], &str); 4] = [
        (
            "NORMAL",
            "VEC3",
            &[0., 0., 1., nan, 0., 1., 0., inf, 0., 0., 0., 0.],
            "3 normals without a direction",
        ),
        ("TEXCOORD_0", "VEC2", &[0., 1., nan, 1., 1., inf, 0., 0.], "2 texture coordinates"),
        ("COLOR_0", "VEC3", &[nan, 0., 0., inf, 1., 1., -inf, 0., 0., 1., 1., 1.], "3 vertex colours"),
        (
            "TANGENT",
            "VEC4",
            &[nan, 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., inf, 1., 0., 0., 1.],
            "2 tangents",
        ),
    ];
    for (attribute, kind, values, told) in cases {
        let bytes = minimal(|json, bin| {
            json["meshes"][0]["primitives"][0]["attributes"][attribute] = json!(bin.floats(kind, values));
        });
        let imported = read("nan.glb", &bytes).unwrap();
        let mesh = &imported.scene.meshes[0];
        assert!(mesh.normals.iter().all(|n| n.is_finite()), "{attribute}");
        assert!(mesh.tangents.iter().chain(&mesh.colors).all(|v| v.is_finite()), "{attribute}");
        assert!(mesh.uvs.iter().flatten().all(|uv| uv.is_finite()), "{attribute}");
        let warnings: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
        assert!(warnings.iter().any(|w| w.contains(told)), "{attribute}: {warnings:?}");
    }
}
