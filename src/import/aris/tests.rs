//! Scenes written for each test into a folder of their own.

use std::path::PathBuf;

use super::*;
use crate::color::Rgb;
use crate::import::Reach;
use crate::scene::Scene;
use crate::scene::camera::{Aperture, FovAxis, Projection};
use crate::scene::environment::{EnvironmentMap, Equirectangular};
use crate::scene::source::{ArisBrdf, ArisMaterial, SourceMaterial};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";

const CAMERA: &str = "camera:\n  name: perspective\n  config:\n    fov: 90\n    c2w:\n      - [-1, 0, 0, 1]\n      - [0, 1, 0, 2.5]\n      - [0, 0, 1, 3]\nwidth: 80\nheight: 60\n";
const GEOMETRY: &str = "geometry:\n  name: mesh\n  config:\n    paths: [data/a.obj]\n";
const BRDF: &str = "brdf:\n  - name: diffuse\n    config:\n      color: [0, 0.5, 1]\n";

fn import(path: &Path) -> Result<Imported, ArisError> {
    super::import(path, Reach::Folder)
}

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [("data/a.obj", TRIANGLE.as_bytes())].iter().chain(files) {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    folder
}

/// The scene `config/scene/s.yaml` with other files.
fn import_scene(text: &str, others: &[(&str, &[u8])]) -> Result<Imported, ArisError> {
    let mut files = vec![("config/scene/s.yaml", text.as_bytes())];
    files.extend_from_slice(others);
    let folder = folder(&files);
    import(&folder.path().join("config/scene/s.yaml"))
}

fn error(text: &str, others: &[(&str, &[u8])]) -> String {
    import_scene(text, others).unwrap_err().to_string()
}

fn aris<'a>(scene: &'a Scene<SourceMaterial>, name: &str) -> &'a ArisMaterial {
    let named =
        scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("{:?}", scene.materials));
    let SourceMaterial::Aris(material) = &named.item else { panic!("{named:?}") };
    material
}

#[test]
fn a_scene_keeps_its_camera_to_the_letter() {
    let Imported { scene, warnings, files, .. } =
        import_scene(&format!("{GEOMETRY}{BRDF}{CAMERA}"), &[]).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let camera = &scene.cameras[0].item;
    assert_eq!(camera.size, Some((80, 60)));
    assert_eq!(camera.pixel_offset, glam::Vec2::splat(-0.5));
    assert_eq!(
        camera.projection,
        Projection::Perspective { fov: std::f32::consts::FRAC_PI_2, axis: FovAxis::X }
    );
    assert_eq!(camera.world_from_camera.translation, glam::Vec3A::new(1.0, 2.5, 3.0));
    assert_eq!(camera.world_from_camera.matrix3.determinant(), -1.0, "it mirrors");
    assert_eq!(aris(&scene, "a").brdf, ArisBrdf::Diffuse { color: Rgb::new(0.0, 0.5, 1.0) });
    assert_eq!(
        files.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(),
        ["config/scene/s.yaml", "data/a.obj"]
    );
    assert!(scene.environment.is_none() && scene.lights.is_empty());
}

#[test]
fn a_scene_outside_any_config_folder_is_its_own_root() {
    let folder = folder(&[("s.yaml", format!("{GEOMETRY}{BRDF}{CAMERA}").as_bytes())]);
    assert!(import(&folder.path().join("s.yaml")).is_ok());
}

#[test]
fn defaults_are_merged_in_order_with_the_file_where_it_says_self() {
    let base = format!("{GEOMETRY}{CAMERA}emitters: []\n");
    let others: [(&str, &[u8]); 3] = [
        ("config/scene/base.yaml", base.as_bytes()),
        ("config/scene/brdf/red.yaml", b"- name: diffuse\n  config:\n    color: [1, 0, 0]\n"),
        ("config/scene/environment/ones.yaml", b"name: constant\nconfig:\n  color: [1, 2, 3]\n"),
    ];
    let text = "defaults:\n  - base\n  - environment: ones\n  - brdf: red\n  - _self_\nwidth: 400\ncamera:\n  config:\n    fov: 60\n";
    let Imported { scene, .. } = import_scene(text, &others).unwrap();
    assert_eq!(aris(&scene, "a").brdf, ArisBrdf::Diffuse { color: Rgb::new(1.0, 0.0, 0.0) });
    assert_eq!(scene.environment.as_ref().unwrap().color, Rgb::new(1.0, 2.0, 3.0));
    assert_eq!(scene.cameras[0].item.size, Some((400, 60)));
    let fov = |scene: &Scene<SourceMaterial>| match scene.cameras[0].item.projection {
        Projection::Perspective { fov, .. } => fov.to_degrees().round(),
        Projection::Orthographic { .. } => panic!(),
    };
    assert_eq!(fov(&scene), 60.0);
    let first = text
        .replace("  - base\n", "  - _self_\n  - base\n")
        .replace("brdf: red\n  - _self_\n", "brdf: red\n");
    assert_eq!(fov(&import_scene(&first, &others).unwrap().scene), 90.0, "base comes after _self_ and wins");
}

#[test]
fn what_defaults_cannot_find_or_follow_is_told_with_its_place() {
    let told = error("defaults:\n  - brdf: gone\n", &[]);
    assert!(
        told.starts_with("config/scene/s.yaml:2:11: defaults: cannot read") && told.contains("gone.yaml"),
        "{told}"
    );
    let told = error("defaults:\n  - s\n", &[]);
    assert!(told.contains("does a file name itself?"), "{told}");
    for list in ["- brdf@x: y", "- override brdf: y", "- /abs", "- _self_\n  - _self_", "- [a]", "- brdf: 3"]
    {
        let told = error(&format!("defaults:\n  {list}\n"), &[]);
        assert!(told.starts_with("config/scene/s.yaml:"), "{list}: {told}");
    }
}

#[test]
fn every_brdf_is_read() {
    let mesh = "data/a.obj, ".repeat(5);
    let text = format!(
        "geometry:\n  name: mesh\n  config:\n    paths: [{mesh}]\n{CAMERA}brdf:\n\
         - {{name: diffuse, config: {{color: [1, 1, 1]}}}}\n- {{name: mirror}}\n\
         - {{name: dielectric, config: {{ext_ior: 1, int_ior: 1.5}}}}\n\
         - {{name: microfacet, config: {{color: [0, 0, 0], roughness: 0.1, ext_ior: 1, int_ior: 1.5}}}}\n\
         - {{name: disney, config: {{color: [1, 0.4, 0.7], roughness: 0.2, metallic: 1, subsurface: 0, specular: 0.7, \
         specularTint: 0.1, anisotropic: 0.8, sheen: 0.6, sheenTint: 0.9, clearcoat: 1, clearcoatGloss: 0.5}}}}\n"
    );
    let Imported { scene, warnings, files, .. } = import_scene(&text, &[]).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(scene.meshes.len(), 1, "the same mesh five times");
    assert_eq!(files.len(), 2, "and read once");
    assert_eq!(aris(&scene, "a_1").brdf, ArisBrdf::Mirror);
    assert_eq!(aris(&scene, "a_2").brdf, ArisBrdf::Dielectric { ext_ior: 1.0, int_ior: 1.5 });
    let ArisBrdf::Disney(disney) = &aris(&scene, "a_4").brdf else { panic!() };
    assert_eq!(disney.scalars, [0.0, 1.0, 0.7, 0.1, 0.2, 0.8, 0.6, 0.9, 1.0, 0.5].map(Some));
    let Imported { warnings, .. } = import_scene(&text.replace("sheen: 0.6,", ""), &[]).unwrap();
    assert!(
        warnings.len() == 1 && warnings[0].message.contains("brdf[4].sheen is not given"),
        "{warnings:?}"
    );
}

#[test]
fn many_transformed_copies_of_a_large_mesh_are_told() {
    let faces = "f 1 2 3\nf 3 2 1\n".repeat(10_000);
    let mesh = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}");
    let copies = |count: usize| {
        let (paths, brdf) = (vec!["data/b.obj"; count].join(", "), vec!["{name: mirror}"; count].join(", "));
        let steps = vec!["[{type: scale, params: [2, 2, 2]}]"; count].join(", ");
        let geometry = format!("name: mesh, config: {{paths: [{paths}], transforms: [{steps}]}}");
        let scene = format!("geometry: {{{geometry}}}\n{CAMERA}brdf: [{brdf}]\n");
        import_scene(&scene, &[("data/b.obj", mesh.as_bytes())])
    };
    assert!(copies(20).is_ok());
    let told = copies(400).unwrap_err().to_string();
    assert!(told.contains("a transformed copy of a mesh, as all would take more than"), "{told}");
}

#[test]
fn an_index_of_glass_that_no_material_may_have_is_told() {
    let glass = |ext: f32, int: f32| {
        let brdf = format!("{{name: dielectric, config: {{ext_ior: {ext}, int_ior: {int}}}}}");
        format!("geometry:\n  name: mesh\n  config:\n    paths: [data/a.obj]\n{CAMERA}brdf: [{brdf}]\n")
    };
    assert!(import_scene(&glass(1.5, 1.0), &[]).is_ok());
    let told = error(&glass(0.01, 1.5), &[]);
    assert!(told.contains("brdf[0].int_ior over brdf[0].ext_ior is 150, but must be in [0.1, 10]"), "{told}");
}

#[test]
fn transforms_move_positions_and_leave_normals() {
    let text = format!(
        "geometry:\n  name: mesh\n  config:\n    paths: [data/a.obj, data/a.obj]\n    transforms:\n      - - {{type: scale, params: [2, 3, -4]}}\n\
         \x20       - {{type: translate, params: [0, 0, 5]}}\n      - []\n{CAMERA}brdf: [{{name: mirror}}, {{name: mirror}}]\n"
    );
    let Imported { scene, .. } = import_scene(&text, &[]).unwrap();
    let moved = scene.mesh_of(&scene.instances[0]);
    assert_eq!(moved.positions, [[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [0.0, 3.0, 5.0]].map(glam::Vec3::from));
    assert_eq!(moved.normals, [glam::Vec3::Z; 3]);
    assert_eq!(scene.mesh_of(&scene.instances[1]).positions[1], glam::Vec3::X);
    let huge = text.replace("[2, 3, -4]", "[1e38, 3, 1]").replace("[0, 0, 5]", "[3e38, 0, 0]");
    assert!(error(&huge, &[]).contains("finite after its transform"));
}

#[test]
fn area_lights_shine_from_their_mesh() {
    let light = "emitters:\n  - name: area\n    config:\n      radiance: [40, 40, 40]\n      i_primitive: 0\n      geometry:\n      i_emitter:\n";
    let text = format!("{GEOMETRY}{BRDF}{CAMERA}{light}");
    assert_eq!(aris(&import_scene(&text, &[]).unwrap().scene, "a").radiance, Some(Rgb::grey(40.0)));
    for (from, to, expected) in [
        ("i_primitive: 0", "i_primitive: 1", "mesh 1, but there are 1 meshes"),
        ("i_primitive: 0", "i_primitive: 0.5", "a whole number"),
        ("[40, 40, 40]", "[40, -1, 40]", "emitters[0].radiance is -1, but must be at least 0"),
        ("name: area", "name: point", "emitters[0] \"point\" is not read"),
        ("i_emitter:\n", "i_emitter: 3\n", "leave it empty"),
    ] {
        let told = error(&text.replace(from, to), &[]);
        assert!(told.contains(expected), "{told}");
    }
}

#[test]
fn mistakes_are_told_with_place_key_and_what_was_meant() {
    let text = format!("{GEOMETRY}{BRDF}{CAMERA}");
    for (from, to, expected) in [
        (
            "width: 80",
            "widht: 80",
            "config/scene/s.yaml:17:1: the scene has no key \"widht\"; did you mean \"width\"?",
        ),
        ("width: 80\n", "", "needs the key \"width\""),
        (
            "color:",
            "colour:",
            "s.yaml:8:7: brdf[0] \"diffuse\" has no key \"colour\"; did you mean \"color\"?",
        ),
        ("color:", "extent:", "s.yaml:8:7: brdf[0] \"diffuse\" needs the key \"color\""),
        ("[0, 0.5, 1]", "[0, 0.5, 1.5]", "s.yaml:8:14: brdf[0].color is 1.5, but must be in [0, 1]"),
        ("[0, 0.5, 1]", "[0, 0.5]", "brdf[0].color must be a list of 3 numbers"),
        ("[0, 0.5, 1]", "[0, 0.5, .nan]", "config/scene/s.yaml:8:23: non-finite"),
        ("name: diffuse", "name: difuse", "did you mean \"diffuse\"?"),
        ("name: diffuse", "name: nerad", "learned while Aris trains"),
        ("data/a.obj", "data/gone.obj", "s.yaml:4:13: geometry.config.paths[0]: cannot read"),
        ("data/a.obj", "../a.obj", "leads out of the scene's folder"),
        ("data/a.obj", "data/a.obj, data/a.obj", "brdf: 1 entries, but there are 2 meshes"),
        ("paths: [data/a.obj]", "paths: []", "at least one mesh"),
        ("fov: 90", "fov: 180", "camera.fov is 180"),
        ("[0, 1, 0, 2.5]", "[0, 0, 0, 2.5]", "determinant of camera.c2w is"),
        ("[0, 1, 0, 2.5]", "[0, 1, 0]", "camera.c2w[1] must be a list of 4 numbers"),
        ("name: perspective", "name: thin", "needs the key \"aperture\""),
        ("width: 80", "width: 0", "width is 0, but must be a whole number in [1, 65536]"),
    ] {
        assert!(text.contains(from), "{from}");
        let told = error(&text.replace(from, to), &[]);
        assert!(told.contains(expected), "{to}: {told}");
    }
}

#[test]
fn a_mesh_that_cannot_be_read_is_told_with_the_key_that_names_it() {
    let told = error(&format!("{GEOMETRY}{BRDF}{CAMERA}"), &[("data/a.obj", b"v 0 0 0\nf 1 1 7\n")]);
    assert!(
        told.contains("s.yaml:4:13: geometry.config.paths[0]: data/a.obj:2: \"7\" names a vertex"),
        "{told}"
    );
}

#[test]
fn a_thin_lens_is_square() {
    let text = format!("{GEOMETRY}{BRDF}{CAMERA}")
        .replace("perspective", "thin")
        .replace("fov: 90", "fov: 90\n    aperture: 0.3\n    focal_distance: 5");
    let lens = import_scene(&text, &[]).unwrap().scene.cameras[0].item.lens.unwrap();
    assert_eq!((lens.radius, lens.focal_distance, lens.shape), (0.3, 5.0, Aperture::Square));
}

#[test]
fn environment_maps_are_floats_without_negative_values() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let channels = exr::prelude::SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| {
        (at.0 as f32 - 1.0, 0.5_f32, 2.0_f32)
    });
    exr::prelude::WritableImage::write(&exr::prelude::Image::from_channels((4, 2), channels))
        .to_buffered(&mut bytes)
        .unwrap();
    let text =
        format!("{GEOMETRY}{BRDF}{CAMERA}environment:\n  name: envmap\n  config:\n    path: data/e.exr\n");
    let Imported { scene, warnings, .. } =
        import_scene(&text, &[("data/e.exr", &bytes.into_inner())]).unwrap();
    let environment = scene.environment.unwrap();
    let EnvironmentMap::Image { image, mapping } = environment.map else { panic!() };
    assert_eq!(mapping, Equirectangular::Aris);
    assert_eq!(
        scene.images[image.0 as usize].texel(0, 0, crate::scene::texture::Encoding::Linear).color.r,
        0.0
    );
    assert!(warnings[0].message.contains("2 values were negative"), "{warnings:?}");
    assert!(error(&text, &[]).contains("environment.config.path: cannot read"));
    assert!(
        error(&text, &[("data/e.exr", b"nonsense")])
            .contains("environment.config.path: data/e.exr is not an image")
    );
}

#[test]
fn damaged_scenes_never_panic() {
    let text = format!("defaults:\n  - environment: ones\n  - _self_\n{GEOMETRY}{BRDF}{CAMERA}");
    let ones: &[u8] = b"name: constant\nconfig: {color: [1, 1, 1]}\n";
    let folder = folder(&[("config/scene/environment/ones.yaml", ones)]);
    let path = folder.path().join("config/scene/s.yaml");
    let mut state = 12345_u32;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as usize % below
    };
    let mut read = 0;
    for _ in 0..500 {
        let mut damaged = text.as_bytes().to_vec();
        for _ in 0..=random(2) {
            let at = random(damaged.len());
            match random(12) {
                0 => damaged.truncate(at + 1),
                1..4 => damaged[at] = random(256) as u8,
                4..8 => damaged[at] = b"0123456789"[random(10)],
                _ => damaged[at] = b"0123456789-[]{}:&*.\n "[random(21)],
            }
        }
        std::fs::write(&path, &damaged).unwrap();
        match import(&path) {
            Ok(Imported { scene, .. }) => {
                read += 1;
                assert!(scene.cameras[0].item.world_from_camera.is_finite());
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    assert!(read > 20, "{read} of 500 could be read");
}

/// Random overrides of a small root: composed or refused, and what is composed is read or refused.
#[test]
fn odd_overrides_never_panic() {
    let scene = format!("defaults:\n  - environment: ones\n  - _self_\n{GEOMETRY}{BRDF}{CAMERA}");
    let root = "defaults:\n  - scene: s\n  - _self_\nspp: 1\nscale: -1\nintegrator: {name: ao}\n";
    let folder = folder(&[
        ("config/render.yaml", root.as_bytes()),
        ("config/scene/s.yaml", scene.as_bytes()),
        ("config/scene/environment/ones.yaml", b"name: constant\nconfig: {color: [1, 1, 1]}\n"),
    ]);
    let pieces = [
        "+",
        "++",
        "~",
        "scene",
        "scene/environment",
        ".brdf",
        ".0",
        ".config",
        ".color",
        "spp",
        "scale",
        "=",
        "=",
        "=",
        "1",
        "-2",
        "[",
        "]",
        "{",
        "}",
        ",",
        "a",
        ":",
        "'",
        "\"",
        "\\",
        "${spp}",
        "${.x}",
        "${scene",
        "null",
        "ones",
        "s",
        " ",
        "é",
        "integrator.name",
        "path",
    ];
    let mut state = 1_u32;
    let mut random = move |below: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % below
    };
    let mut composed = 0;
    for _ in 0..3000 {
        let length = 1 + random(6);
        let begin = ["", "spp=", "+x.y=", "scene.brdf.0.config.color=", "++scene.", "scene.camera.config="]
            [random(6)];
        let line = begin.to_owned() + &(0..length).map(|_| pieces[random(pieces.len())]).collect::<String>();
        let Ok(config) = ArisConfig::compose(&folder.path().join("config"), &[line], Reach::Folder) else {
            continue;
        };
        composed += 1;
        let _ = (config.import(), config.to_yaml(), config.provenance(), config.output_folder());
    }
    assert!(composed > 20, "{composed} of 3000 could be composed");
}

#[test]
fn the_names_of_output_folders_are_short_and_their_own() {
    let folder = folder(&[("config/render.yaml", b"spp: 1\nx: {y: 1}\n")]);
    let name = |overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        let config = ArisConfig::compose(&folder.path().join("config"), &overrides, Reach::Folder).unwrap();
        config.output_folder().to_str().unwrap().to_owned()
    };
    assert_eq!(name(&[]), "outputs/default");
    assert_eq!(name(&["spp=2", "+x.z=0.5"]), "outputs/spp=2,+x.z=0.5");
    assert_eq!(name(&["hydra.run.dir=a/b", "spp=2"]), "a/b");
    let long = |n: usize| name(&[&format!("spp=[{}]", vec!["1.25"; n].join(","))]);
    assert!(long(100).len() < 140 && long(100) != long(101));
    assert!(!name(&["spp='../../x'"]).contains("/../"));
}

#[test]
fn the_corpus_is_read_as_far_as_its_meshes_are_there() {
    let Some(corpus) = std::env::var_os("PIPELINE_CORPUS") else {
        std::io::Write::write_all(&mut std::io::stderr(), b"skipped: PIPELINE_CORPUS is not set\n")
            .expect("stderr");
        return;
    };
    let scenes = PathBuf::from(corpus).join("aris/config/scene");
    for (name, meshes) in [("cbox", 6), ("cbox_diffuse", 6), ("bunny", 1)] {
        let Imported { scene, warnings, .. } = import(&scenes.join(format!("{name}.yaml"))).unwrap();
        assert_eq!((scene.instances.len(), scene.materials.len()), (meshes, meshes), "{name}");
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
    let Imported { scene: cbox, .. } = import(&scenes.join("cbox.yaml")).unwrap();
    assert_eq!(aris(&cbox, "sphere1").brdf, ArisBrdf::Mirror);
    assert_eq!(aris(&cbox, "light").radiance, Some(Rgb::grey(40.0)));
    for name in ["ajax", "ajax_simple", "veach", "lego"] {
        let told = import(&scenes.join(format!("{name}.yaml"))).unwrap_err().to_string();
        assert!(told.contains("geometry.config.paths[0]: cannot read"), "{name}: {told}");
    }
}
