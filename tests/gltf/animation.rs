//! Morph targets, skins and animations.

use std::f32::consts::FRAC_1_SQRT_2;
use std::path::Path;

use glam::Vec3;
use pipeline::import::{GltfError, ImportError, ImportOptions, Imported, import, import_bytes};
use pipeline::scene::Scene;
use pipeline::scene::source::SourceMaterial;
use serde_json::{Value, json};

use crate::outside::outside;
use crate::sample::{Bin, error_of, minimal, read};

fn at(bytes: &[u8], time: f32, animation: Option<&str>) -> Result<Imported, ImportError> {
    let animation = animation.map(str::to_owned);
    let options = ImportOptions { time: Some(time), animation, ..ImportOptions::default() };
    import_bytes(Path::new("a.glb"), bytes, &options)
}

/// The world position of the square's second corner, (1, 0, 0) at rest.
fn corner(scene: &Scene<SourceMaterial>) -> Vec3 {
    let instance = &scene.instances[0];
    instance.world_from_object.transform_point3(scene.mesh_of(instance).positions[1])
}

fn near(found: Vec3, expected: [f32; 3]) -> bool {
    (found - Vec3::from(expected)).length() < 1e-5
}

/// A sampler from `times` to `values`.
fn sampler(bin: &mut Bin, kind: &str, times: &[f32], values: &[f32], interpolation: &str) -> Value {
    json!({"input": bin.floats("SCALAR", times), "output": bin.floats(kind, values), "interpolation": interpolation})
}

/// A square moved by one channel.
fn animated(path: &str, make: impl FnOnce(&mut Bin) -> Value) -> Vec<u8> {
    minimal(|json, bin| {
        let sampler = make(bin);
        json["animations"] = json!([{"name": "idle", "channels": [], "samplers": []},
            {"name": "move", "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}], "samplers": [sampler]}]);
    })
}

#[test]
fn samplers_step_interpolate_and_hold_their_ends() {
    let translation = |interpolation: &str| {
        animated("translation", |bin| {
            sampler(bin, "VEC3", &[1.0, 2.0, 4.0], &[0., 0., 0., 1., 0., 0., 1., 4., 0.], interpolation)
        })
    };
    let x_y = |bytes: &[u8], time| {
        let p = corner(&at(bytes, time, Some("move")).unwrap().scene);
        (p.x - 1.0, p.y)
    };
    let linear = translation("LINEAR");
    for (time, expected) in
        [(-1.0, (0., 0.)), (1.5, (0.5, 0.)), (2.0, (1., 0.)), (3.0, (1., 2.)), (9.0, (1., 4.))]
    {
        assert_eq!(x_y(&linear, time), expected, "{time}");
    }
    let step = translation("STEP");
    for (time, expected) in [(1.9, (0., 0.)), (2.0, (1., 0.)), (3.9, (1., 0.)), (4.0, (1., 4.))] {
        assert_eq!(x_y(&step, time), expected, "{time}");
    }
    // At rest, and in the first animation, nothing moves.
    assert_eq!(corner(&read("a.glb", &linear).unwrap().scene), Vec3::X);
    assert_eq!(corner(&at(&linear, 3.0, None).unwrap().scene), Vec3::X);
    let spline = animated("translation", |bin| {
        let values = [0., 0., 0., 0., 0., 0., 2., 0., 0., 0., 0., 0., 2., 0., 0., 0., 0., 0.];
        sampler(bin, "VEC3", &[0.0, 2.0], &values, "CUBICSPLINE")
    });
    // ½·0 + 2·⅛·2 + ½·2 - 2·⅛·0.
    assert_eq!(x_y(&spline, 1.0).0, 1.5);
}

#[test]
fn rotations_are_interpolated_on_the_sphere() {
    let bytes = animated("rotation", |bin| {
        let values = [0., 0., 0., 1., 0., 0., -FRAC_1_SQRT_2, -FRAC_1_SQRT_2];
        sampler(bin, "VEC4", &[0.0, 3.0], &values, "LINEAR")
    });
    let third = corner(&at(&bytes, 1.0, Some("move")).unwrap().scene);
    assert!(near(third, [0.866_025_4, 0.5, 0.0]), "30 degrees of 90: {third}");
}

#[test]
fn damaged_animations_are_errors() {
    let with = |times: &[f32], values: &[f32], interpolation: &str| {
        animated("translation", |bin| sampler(bin, "VEC3", times, values, interpolation))
    };
    for (bytes, part) in [
        (with(&[1.0, 0.5], &[0.0; 6], "LINEAR"), "times that increase"),
        (with(&[0.0, f32::NAN], &[0.0; 6], "LINEAR"), "times that increase"),
        (with(&[0.0, f32::INFINITY], &[0.0; 6], "LINEAR"), "times that increase"),
        (with(&[], &[], "LINEAR"), "at least one time"),
        (with(&[0.0, 1.0], &[0.0; 3], "STEP"), "invalid output"),
        (with(&[0.0, 1.0], &[0.0; 6], "CUBICSPLINE"), "invalid output"),
        (with(&[0.0], &[0.0; 3], "BEZIER"), "interpolation"),
        (with(&[0.0], &[f32::NAN; 3], "LINEAR"), "finite scale and translation"),
        (animated("rotation", |bin| sampler(bin, "VEC4", &[0.0], &[0.0; 4], "LINEAR")), "unit quaternion"),
        (animated("rotation", |bin| sampler(bin, "VEC3", &[0.0], &[0.0; 3], "LINEAR")), "accessors["),
        (animated("translation", |_| json!({"input": 99, "output": 0})), "accessors[99]"),
        (animated("weights", |bin| sampler(bin, "SCALAR", &[0.0], &[1.0], "LINEAR")), "invalid output"),
    ] {
        let error = at(&bytes, 0.5, Some("move")).unwrap_err().to_string();
        assert!(error.contains(part), "{part}: {error}");
        assert!(read("a.glb", &bytes).is_ok(), "{part}: at rest nothing is read of it");
    }
    let error = at(&with(&[0.0], &[0.0; 3], "LINEAR"), 0.0, Some("fly")).unwrap_err().to_string();
    assert!(error.contains("there are: idle, move"), "{error}");
    assert!(at(&minimal(|_, _| ()), f32::NAN, None).is_err());
    let still = at(&minimal(|_, _| ()), 1.0, None).unwrap();
    assert!(still.warnings.iter().any(|w| w.to_string().contains("no animation")));
    // Channels of extensions, and those that a matrix forbids, are told.
    let other = animated("pointer", |bin| sampler(bin, "VEC3", &[0.0], &[0.0; 3], "LINEAR"));
    assert_eq!(at(&other, 0.0, Some("move")).unwrap().warnings.len(), 1);
    let nowhere = minimal(|json, _| {
        json["animations"] =
            json!([{"channels": [{"sampler": 5, "target": {"path": "scale"}}], "samplers": []}]);
    });
    assert!(at(&nowhere, 0.0, None).unwrap().warnings.is_empty());
}

/// A square with two morph targets: along x, and along z with a normal.
fn morphed(edit: impl FnOnce(&mut Value, &mut Bin)) -> Vec<u8> {
    minimal(|json, bin| {
        let along_x = bin.floats("VEC3", &[1., 0., 0.].repeat(4));
        let along_z = bin.floats("VEC3", &[0., 0., 2.].repeat(4));
        let normal = bin.floats("VEC3", &[1., 0., -1.].repeat(4));
        json["meshes"][0]["primitives"][0]["targets"] =
            json!([{"POSITION": along_x}, {"POSITION": along_z, "NORMAL": normal}]);
        edit(json, bin);
    })
}

#[test]
fn morph_targets_are_added_by_weights_of_mesh_node_or_animation() {
    let scene = read("m.glb", &morphed(|_, _| ())).unwrap().scene;
    assert_eq!(corner(&scene), Vec3::X, "weights are 0");
    let scene =
        read("m.glb", &morphed(|json, _| json["meshes"][0]["weights"] = json!([0.5, 1]))).unwrap().scene;
    assert_eq!((corner(&scene), scene.meshes[0].normals[1]), (Vec3::new(1.5, 0.0, 2.0), Vec3::X));

    let bytes = morphed(|json, bin| {
        json["meshes"][0]["weights"] = json!([0.5, 1]);
        json["nodes"] = json!([{"mesh": 0, "weights": [3, 0]}, {"mesh": 0}, {"mesh": 0}]);
        json["scenes"][0]["nodes"] = json!([0, 1, 2]);
        let sampler = sampler(bin, "SCALAR", &[0.0, 1.0], &[0., 0., 2., 4.], "LINEAR");
        json["animations"] = json!([{"channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}], "samplers": [sampler]}]);
    });
    let scene = read("m.glb", &bytes).unwrap().scene;
    assert_eq!(corner(&scene), Vec3::new(4.0, 0.0, 0.0));
    assert_eq!(scene.meshes.len(), 2, "two nodes share the mesh's own weights");
    let scene = at(&bytes, 0.5, None).unwrap().scene;
    assert_eq!(corner(&scene), Vec3::new(2.0, 0.0, 4.0));
}

#[test]
fn damaged_morph_targets_are_errors() {
    let uneven = morphed(|json, bin| {
        json["meshes"][0]["weights"] = json!([1]);
        json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(bin.floats("VEC3", &[0.0; 9]));
    });
    assert!(matches!(error_of(&uneven), GltfError::AttributeCount { found: 3, vertices: 4, .. }));
    let missing = morphed(|json, _| {
        json["meshes"][0]["weights"] = json!([0, 1, 5, 6]);
        json["meshes"][0]["primitives"][0]["targets"][1]["NORMAL"] = json!(4_294_967_296_u64);
    });
    assert!(matches!(error_of(&missing), GltfError::Reference { .. }));
}

/// A square that hangs on two joints, one at (0, 0, 5), where it was bound, and one a metre from there, turned by a quarter about z.
fn skinned(edit: impl FnOnce(&mut Value, &mut Bin)) -> Vec<u8> {
    minimal(|json, bin| {
        let joints = bin.accessor("VEC4", 5121, 4, &[0, 1, 9, 9].repeat(4));
        bin.accessors[joints]["normalized"] = json!(false);
        let weights = bin.floats("VEC4", &[1., 0., 0., 0., 0., 2., 0., 0., 1., 1., 0., 0., 1., 0., 0., 0.]);
        let bind = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., -5., 1.];
        let bind = bin.floats("MAT4", &[bind, bind].concat());
        let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
        (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
        json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": bind}]);
        json["nodes"] = json!([{"mesh": 0, "skin": 0, "translation": [7, 7, 7]}, {"translation": [0, 0, 5]},
            {"rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2], "translation": [0, 0, 6]}]);
        json["scenes"][0]["nodes"] = json!([0, 1, 2]);
        edit(json, bin);
    })
}

#[test]
fn skins_blend_their_joints_and_ignore_the_node() {
    let scene = read("s.glb", &skinned(|_, _| ())).unwrap().scene;
    let mesh = &scene.meshes[0];
    let expected = [[0., 0., 0.], [0., 1., 1.], [0., 1., 0.5], [0., 1., 0.]];
    for (found, expected) in mesh.positions.iter().zip(expected) {
        assert!(near(*found, expected), "{found} {expected:?}");
    }
    let (normal, tangent) = (mesh.normals[1], mesh.tangents[1].truncate());
    assert!(near(normal, [0., 0., 1.]) && near(tangent, [0., 1., 0.]), "{normal} {tangent}");
    assert_eq!(scene.instances[0].world_from_object, glam::Affine3A::IDENTITY);
}

#[test]
fn mirrored_joints_turn_triangles_with_them() {
    let bytes = skinned(|json, _| {
        json["nodes"][1]["scale"] = json!([-1, 1, 1]);
        json["nodes"][2] = json!({"scale": [-1, 1, 1], "translation": [0, 0, 5]});
    });
    let scene = read("s.glb", &bytes).unwrap().scene;
    let mesh = &scene.meshes[0];
    assert!(near(mesh.positions[1], [-1., 0., 0.]));
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).z > 0.0 && near(mesh.normals[0], [0., 0., 1.]));
    assert_eq!(mesh.tangents[0].w, -1.0);
}

#[test]
fn damaged_skins_are_errors_or_told() {
    let edit = |edit: fn(&mut Value, &mut Bin)| skinned(edit);
    for (bytes, part) in [
        (edit(|json, _| json["skins"] = json!([])), "skins[0]"),
        (edit(|json, _| json["skins"][0]["joints"] = json!([])), "invalid joints"),
        (edit(|json, _| json["skins"][0]["joints"] = json!([1, 2, 0])), "invalid joints"),
        (edit(|json, _| json["skins"][0]["joints"] = json!([1, 77])), "nodes[77]"),
        (edit(|json, _| json["skins"][0]["joints"] = json!([1])), "index 1"),
        (edit(|json, _| json["scenes"][0]["nodes"] = json!([0, 1])), "nodes of the scene"),
        (edit(|json, _| json["nodes"][1]["children"] = json!([1])), "two parents"),
        (
            edit(|json, bin| {
                json["skins"][0]["inverseBindMatrices"] = json!(bin.floats("MAT4", &[f32::NAN; 32]));
            }),
            "finite numbers",
        ),
        (
            edit(|json, bin| {
                let weights = bin.floats("VEC4", &[1.0; 4]);
                json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
            }),
            "WEIGHTS_0 has 1 values",
        ),
    ] {
        let error = error_of(&bytes).to_string();
        assert!(error.contains(part), "{part}: {error}");
    }
    let unbound = skinned(|json, bin| {
        let weights = [f32::NAN, 0., 0., 0., 0., -1., 0., 0., f32::INFINITY, 0., 0., 0., 0., 0., 0., 0.];
        json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(bin.floats("VEC4", &weights));
    });
    let imported = read("s.glb", &unbound).unwrap();
    assert!(imported.warnings.iter().any(|w| w.to_string().contains("4 vertices have no positive weight")));
    let nothing = skinned(|json, _| {
        json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
    });
    assert!(read("s.glb", &nothing).unwrap().warnings.iter().any(|w| w.to_string().contains("no JOINTS_0")));
}

#[test]
fn the_corpus_moves() {
    let Some(corpus) = outside("PIPELINE_CORPUS") else { return };
    for (file, animation) in [
        ("01_morphed_cube/01_morphed_cube.gltf", None),
        ("03_skinned_cylinder/03_skinned_cylinder.gltf", None),
        ("Fox.glb", Some("Run")),
    ] {
        let bounds = |time: Option<f32>| {
            let animation = time.and(animation.map(str::to_owned));
            let options = ImportOptions { time, animation, ..ImportOptions::default() };
            let imported = import(&Path::new(&corpus).join("gltf").join(file), &options).unwrap();
            assert!(imported.warnings.is_empty(), "{file}: {:?}", imported.warnings);
            imported.scene.bounds().unwrap()
        };
        let (rest, moved) = (bounds(None), bounds(Some(0.3)));
        assert!(rest != moved, "{file}: {rest:?}");
        let size = |(low, high): (Vec3, Vec3)| (high - low).length();
        assert!(
            size(moved) < 2.0 * size(rest) && size(moved) > 0.5 * size(rest),
            "{file}: {rest:?} {moved:?}"
        );
    }
}
