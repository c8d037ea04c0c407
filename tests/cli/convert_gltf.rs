//! `pipeline convert --to gltf`: GLBs that the Khronos validator finds nothing wrong with, and that come back to the same picture.

use std::path::PathBuf;

use pipeline::imagefile::{Interleaved, encode_texture};
use pipeline::raster::Raster;
use serde_json::{Value, json};

use crate::outside::outside;
use crate::support::{Desk, Run, SMALL_ARGUMENTS, repository, same_pixels};

/// Converts `scene` into `folder/scene.glb`.
fn convert(desk: &Desk, scene: &str, folder: &str) -> Run {
    desk.run(["convert", scene, "--to", "gltf", "-o", folder]).ends_with(0).says("scene.glb: ")
}

fn render(desk: &Desk, scene: &str, output: &str, arguments: &[&str]) -> Raster {
    desk.run(["render", scene, "-o", output].iter().chain(arguments)).ends_with(0);
    desk.raster(output)
}

/// `scene` before and after it went through a GLB.
fn there_and_back(desk: &Desk, scene: &str, arguments: &[&str]) -> [Raster; 2] {
    convert(desk, scene, "out");
    [render(desk, scene, "before.exr", arguments), render(desk, "out/scene.glb", "after.exr", arguments)]
}

/// The root mean square difference of two pictures over the mean of the first.
fn difference([before, after]: &[Raster; 2]) -> f64 {
    let values = |raster: &Raster| -> Vec<f64> {
        let [r, g, b] = raster.picture().rgb().expect("a picture");
        r.iter().chain(g).chain(b).map(|&v| f64::from(v)).collect()
    };
    let (a, b) = (values(before), values(after));
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    let mean = a.iter().sum::<f64>() / a.len() as f64;
    (squares / a.len() as f64).sqrt() / mean
}

fn mean(picture: &Raster) -> f64 {
    let [r, g, b] = picture.picture().rgb().expect("a picture");
    r.iter().chain(g).chain(b).map(|&v| f64::from(v)).sum::<f64>() / (3 * r.len()) as f64
}

/// Whether depths are the same up to a fraction of the largest.
fn same_depth(pictures: &[Raster; 2], fraction: f32) -> bool {
    let [a, b] = pictures.each_ref().map(|p| &p.layers[1].channel("Z").expect("depth").values);
    let most = a.iter().fold(0.0, |most: f32, &z| most.max(z));
    most > 0.0 && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= fraction * most)
}

/// What the Khronos validator finds in GLBs, none if it isn't at hand.
fn validate(files: &[PathBuf]) -> Option<String> {
    let validator = outside("PIPELINE_GLTF_VALIDATOR")?;
    let output = std::process::Command::new("node")
        .arg(repository("tests/check_gltf.mjs"))
        .args(files)
        .env("PIPELINE_GLTF_VALIDATOR", validator)
        .output()
        .expect("node starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).expect("UTF-8"))
}

#[track_caller]
fn assert_valid(files: &[PathBuf]) {
    let Some(found) = validate(files) else { return };
    let clean = found.lines().filter(|line| line.starts_with("0 errors, 0 warnings: ")).count();
    assert!(clean == files.len() && found.lines().count() == clean, "{found}");
}

fn shipped(name: &str) -> String {
    repository("scenes").join(name).to_str().expect("UTF-8").to_owned()
}

#[test]
fn the_shipped_gltf_scenes_come_back_to_the_same_bits() {
    let desk = Desk::new("");
    let mut files = Vec::new();
    for (i, name) in ["spheres.glb", "shaderball.glb", "statue.glb.gz"].into_iter().enumerate() {
        let [before, after] = there_and_back(&desk, &shipped(name), &SMALL_ARGUMENTS);
        assert!(same_pixels(&before, &after), "{name}");
        let file = desk.path(&format!("{i}.glb"));
        std::fs::copy(desk.path("out/scene.glb"), &file).unwrap();
        files.push(file);
    }
    assert_valid(&files);
}

/// A cube around the origin as vertices of position, normal, texture coordinates and colour, and corners.
fn cube() -> (Vec<[f32; 12]>, Vec<u16>) {
    let (mut vertices, mut corners) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-0.5f32, 0.5] {
            let first = vertices.len() as u16;
            for (u, v) in [(0.0f32, 0.0f32), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                let (mut position, mut normal) = ([0.0; 3], [0.0; 3]);
                position[axis] = side;
                position[(axis + 1) % 3] = u - 0.5;
                position[(axis + 2) % 3] = v - 0.5;
                normal[axis] = side * 2.0;
                let ([x, y, z], [i, j, k]) = (position, normal);
                vertices.push([x, y, z, i, j, k, u, v, 1.0, u, v, 0.5 + 0.5 * v]);
            }
            let corners_of_side = if side > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            corners.extend(corners_of_side.map(|c| first + c));
        }
    }
    (vertices, corners)
}

fn data_uri(kind: &str, bytes: &[u8]) -> String {
    let hex: String = bytes.iter().map(|b| format!("%{b:02X}")).collect();
    format!("data:{kind},{hex}")
}

/// A glTF file with a cube of each of `materials` in a row above a floor, lamps of all kinds, a camera and `more` nodes of cube 0.
fn cubes(materials: &[Value], more: &[Value]) -> Value {
    let (vertices, corners) = cube();
    let mut bytes: Vec<u8> = vertices.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let size = bytes.len();
    bytes.extend(corners.iter().flat_map(|c| c.to_le_bytes()));
    let of = |offset: usize, kind: &str| json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": 24, "type": kind});
    let mut positions = of(0, "VEC3");
    (positions["min"], positions["max"]) = (json!([-0.5, -0.5, -0.5]), json!([0.5, 0.5, 0.5]));
    let attributes = |colored: bool| {
        let mut all = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 2});
        if colored {
            all["COLOR_0"] = 3.into();
        }
        all
    };
    let pixels: Vec<u8> = (0..64u32).map(|i| (40 + i * 151 % 200) as u8).collect();
    let png = encode_texture(4, 4, 4, Interleaved::U8(&pixels)).unwrap();
    let primitive =
        |i: usize, colored| json!({"attributes": attributes(colored), "indices": 4, "material": i});
    let mesh = |(i, m): (usize, &Value)| json!({"primitives": [primitive(i, m["name"] == "coloured")]});
    let mut meshes: Vec<Value> = materials.iter().enumerate().map(mesh).collect();
    let across = materials.len() as f32 * 1.5;
    let place = |i: usize| json!({"name": format!("cube {i}"), "mesh": i, "translation": [1.5 * i as f32 - 0.5 * across, 0.0, 0.0], "rotation": [0.0, 0.3826834, 0.0, 0.9238795]});
    let mut nodes: Vec<Value> = (0..materials.len()).map(place).collect();
    nodes.push(
        json!({"name": "floor", "mesh": materials.len(), "translation": [0, -1.2, 0], "scale": [40, 1, -40]}),
    );
    meshes.push(json!({"primitives": [{"attributes": attributes(false), "indices": 4}]}));
    nodes.push(json!({"name": "camera", "camera": 0, "translation": [0, 1, 14], "rotation": [-0.0348995, 0, 0, 0.9993908]}));
    for (i, rotation) in
        [[0.0, 0.0, 0.0, 1.0], [-0.6, 0.0, 0.0, 0.8], [-0.5, 0.5, -0.5, 0.5]].into_iter().enumerate()
    {
        let extension = json!({"KHR_lights_punctual": {"light": i}});
        nodes.push(json!({"name": format!("lamp {i}"), "translation": [0, 5, 4], "rotation": rotation, "extensions": extension}));
    }
    let shown: Vec<usize> = (0..nodes.len() + more.iter().filter(|n| n["name"] != "inner").count()).collect();
    nodes.extend_from_slice(more);
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": shown}], "nodes": nodes, "meshes": meshes, "materials": materials,
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.35, "znear": 0.1, "aspectRatio": 2.0}}],
        "extensionsUsed": ["KHR_lights_punctual", "KHR_texture_transform"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 300, "color": [1, 0.9, 0.8], "range": 40},
            {"type": "spot", "intensity": 500, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 1.0}},
            {"type": "directional", "intensity": 2, "color": [0.2, 0.3, 1]},
        ]}},
        "textures": [{"source": 0}, {"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"uri": data_uri("image/png", &png)}],
        "buffers": [{"uri": data_uri("application/octet-stream", &bytes), "byteLength": bytes.len()}],
        "bufferViews": [
            {"buffer": 0, "byteLength": size, "byteStride": 48, "target": 34962},
            {"buffer": 0, "byteOffset": size, "byteLength": bytes.len() - size, "target": 34963},
        ],
        "accessors": [positions, of(12, "VEC3"), of(24, "VEC2"), of(32, "VEC4"), {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
    })
}

/// A plastic with `extensions`.
fn plastic(extensions: Value) -> Value {
    let core =
        json!({"baseColorFactor": [0.8, 0.4, 0.2, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.35});
    json!({"pbrMetallicRoughness": core, "extensions": extensions})
}

#[test]
fn extensions_that_can_be_inverted_come_back_to_the_same_bits() {
    let transform =
        json!({"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.4, "scale": [2, 3]}});
    let materials = [
        json!({
            "name": "textured", "doubleSided": true, "normalTexture": {"index": 0, "scale": 0.5, "texCoord": 1},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 1, "extensions": transform}, "metallicRoughnessTexture": {"index": 0}},
        }),
        json!({"name": "coloured", "alphaMode": "BLEND", "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorFactor": [1, 1, 1, 0.8]}}),
        json!({
            "name": "holes", "alphaMode": "MASK", "alphaCutoff": 0.4, "emissiveFactor": [1, 0.5, 0.2], "emissiveTexture": {"index": 0},
            "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorTexture": {"index": 1}},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3.7}},
        }),
        plastic(
            json!({"KHR_materials_ior": {"ior": 1.8}, "KHR_materials_clearcoat": {"clearcoatFactor": 0.7, "clearcoatTexture": {"index": 0}, "clearcoatRoughnessFactor": 0.1}}),
        ),
        plastic(json!({"KHR_materials_specular": {"specularFactor": 0.4, "specularTexture": {"index": 0}}})),
        plastic(
            json!({"KHR_materials_specular": {"specularColorFactor": [1.5, 1.5, 1.5], "specularColorTexture": {"index": 0}}, "KHR_materials_sheen": {"sheenColorFactor": [0.4, 0.4, 0.4]}}),
        ),
        plastic(json!({
            "KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.4},
            "KHR_materials_volume": {"thicknessFactor": 1.0, "attenuationColor": [0.9, 0.5, 0.3], "attenuationDistance": 0.5},
        })),
        plastic(
            json!({"KHR_materials_transmission": {"transmissionFactor": 0.8, "transmissionTexture": {"index": 0}}}),
        ),
        plastic(
            json!({"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.6, "diffuseTransmissionColorFactor": [0.1, 1.0, 0.2]}}),
        ),
        plastic(json!({
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.8, "anisotropyRotation": 0.3, "anisotropyTexture": {"index": 0}},
            "KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.3, "clearcoatRoughnessTexture": {"index": 0}},
        })),
        json!({"name": "coloured", "extensions": {"KHR_materials_unlit": {}}}),
        json!({"name": "unlit", "extensions": {"KHR_materials_unlit": {}}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
    ];
    let desk = Desk::new("");
    std::fs::write(desk.path("cubes.gltf"), cubes(&materials, &[]).to_string()).unwrap();
    let size = ["--width", "96", "--height", "48", "--spp", "4"];
    let [before, after] = there_and_back(&desk, "cubes.gltf", &size);
    assert!(same_pixels(&before, &after), "{}", difference(&[before, after]));
    assert_valid(&[desk.path("out/scene.glb")]);
}

/// Tints, anisotropy and normals of sheared meshes go through formulas that floats don't invert: a few bits at the end differ.
#[test]
fn what_rounding_moves_comes_back_within_rounding() {
    let materials = [
        plastic(json!({"KHR_materials_specular": {"specularColorFactor": [1.2, 0.8, 0.6]}})),
        plastic(
            json!({"KHR_materials_sheen": {"sheenColorFactor": [0.8, 0.4, 0.2], "sheenRoughnessFactor": 0.5}}),
        ),
        plastic(json!({"KHR_materials_anisotropy": {"anisotropyStrength": 0.7, "anisotropyRotation": 0.3}})),
    ];
    let sheared = [
        json!({"name": "stretched", "scale": [1, 2, 1], "translation": [0, 2, -2], "children": [9]}),
        json!({"name": "inner", "mesh": 0, "rotation": [0.0, 0.0, 0.3826834, 0.9238795], "scale": [-1, 0.5, 1]}),
    ];
    let desk = Desk::new("");
    let file = cubes(&materials, &sheared);
    assert_eq!(
        (&file["nodes"][8]["name"], &file["nodes"][9]["name"]),
        (&json!("stretched"), &json!("inner"))
    );
    std::fs::write(desk.path("cubes.gltf"), file.to_string()).unwrap();
    convert(&desk, "cubes.gltf", "out").says("are sheared, which no node of glTF is");
    let pictures = there_and_back(&desk, "cubes.gltf", &SMALL_ARGUMENTS);
    let found = difference(&pictures);
    assert!(found < 1e-5, "{found}");
    assert_valid(&[desk.path("out/scene.glb")]);
}

#[test]
fn a_scene_is_never_written_over_itself() {
    let desk = Desk::new("");
    std::fs::copy(shipped("spheres.glb"), desk.path("scene.glb")).unwrap();
    let before = desk.bytes("scene.glb");
    desk.run(["convert", "scene.glb", "--to", "gltf", "-o", "."]).ends_with(2).tells("would be overwritten");
    assert!(desk.bytes("scene.glb") == before);
    desk.run(["convert", "scene.glb", "--to", "gltf", "-o", "a"]).ends_with(0);
    desk.run(["convert", "a/scene.glb", "--to", "gltf", "-o", "b"]).ends_with(0);
    assert!(desk.bytes("a/scene.glb") == desk.bytes("b/scene.glb"), "what was written is written again");
}

/// Enough samples for means, as many in all pixels of either picture: what is alike has the same noise then.
const STEADY: [&str; 8] =
    ["--width", "48", "--height", "36", "--spp", "64", "--set", "render.adaptive=never"];

/// Lambert's surfaces become Disney's without a highlight, which are sampled otherwise: noise is all that differs under glTF's own diffuse
/// term (0.5% at these samples, 0.25% at four times as many), and little under Burley's.
#[test]
fn the_cornell_box_comes_back_to_the_same_expectation() {
    let desk = Desk::new("");
    let scene = shipped("cornell.obj");
    let exact = [&STEADY[..], &["--diffuse", "lambert_fresnel"]].concat();
    for (arguments, bound) in [(&exact[..], 0.01), (&STEADY[..], 0.04)] {
        let pictures = there_and_back(&desk, &scene, arguments);
        let found = difference(&pictures);
        assert!(found < bound, "{arguments:?}: {found}");
        assert!(same_depth(&pictures, 0.0), "the same triangles from the same place");
    }
    assert_valid(&[desk.path("out/scene.glb")]);
}

/// What glTF can't say of Aris' scenes is told: their camera's offset, which --set puts back, surfaces with one side, and the masking term of
/// `disney`, which makes the copper spheres' picture 3% brighter. Angle of view and axes of the camera are rounded once more.
#[test]
fn aris_scenes_come_back_but_for_what_is_told() {
    let desk = Desk::new("");
    let mut files = Vec::new();
    let offset =
        [&STEADY[..], &["--set", "camera.pixel_offset=[-0.5, -0.5]", "--diffuse", "lambert"]].concat();
    for (name, bound) in
        [("cbox", 0.05), ("cbox_balls", 0.02), ("cbox_copper", 0.05), ("cbox_diffuse", 0.002)]
    {
        let source = shipped(&format!("aris/config/scene/{name}.yaml"));
        convert(&desk, &source, name).says("pixel_offset").says("mirrored").says("single-sided");
        let file = format!("{name}/scene.glb");
        let pictures = [render(&desk, &source, "a.exr", &STEADY), render(&desk, &file, "b.exr", &offset)];
        let ratio = mean(&pictures[1]) / mean(&pictures[0]);
        assert!((ratio - 1.0).abs() < bound, "{name}: {ratio}");
        assert!(same_depth(&pictures, 1e-6), "{name}");
        files.push(desk.path(&file));
    }
    assert_valid(&files);
}

/// Every scene of others becomes a valid GLB, but for those that can't be read.
#[test]
fn scenes_of_others_become_valid_files() {
    let Some(corpus) = outside("PIPELINE_CORPUS") else { return };
    let desk = Desk::new("");
    let folder = corpus.join("gltf");
    let run = desk.run([
        "convert",
        folder.to_str().expect("UTF-8"),
        "--to",
        "gltf",
        "-o",
        "out",
        "--report",
        "json",
    ]);
    let report: Value = serde_json::from_str(&run.stdout).expect("JSON");
    let files: Vec<PathBuf> =
        report.as_array().unwrap().iter().map(|s| desk.path(s["file"].as_str().unwrap())).collect();
    assert!(files.len() > 30, "{}", run.stderr);
    assert_valid(&files);
}
