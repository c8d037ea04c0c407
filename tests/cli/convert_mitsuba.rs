//! `pipeline convert --to mitsuba`: Mitsuba itself renders what we write, and the two pictures agree.

use std::path::{Path, PathBuf};

use pipeline::imagefile::{Interleaved, encode_texture, write_exr};
use pipeline::raster::{Layer, Raster, Window};
use serde_json::{Value, json};

use crate::outside::outside;
use crate::support::{Desk, read, repository};

/// Columns and rows of the pictures.
const SIZE: [usize; 2] = [48, 36];
/// Columns and rows of a tile.
const TILE: usize = 12;

/// Renders `scene` here and there, and asserts that the means of all tiles agree to 4.5 standard errors and the fraction
/// `allowed`, which is for what the two models differ in. The standard error of the whole picture must be below 1%, or agreeing
/// would mean nothing.
#[track_caller]
fn agree(desk: &Desk, scene: &Path, spp: usize, allowed: f64) {
    agree_but_for(desk, scene, spp, allowed, &[]);
}

/// The same where our render is told `more` than the scene says.
#[track_caller]
fn agree_but_for(desk: &Desk, scene: &Path, spp: usize, allowed: f64, more: &[&str]) {
    let Some(python) = outside("PIPELINE_MITSUBA_PYTHON") else { return };
    let source = scene.to_str().expect("a UTF-8 path");
    desk.run(["convert", source, "--to", "mitsuba", "-o", "mitsuba"]).ends_with(0).says("scene.xml: ");
    let [width, height, spp] = [SIZE[0], SIZE[1], spp].map(|n| n.to_string());
    let size = ["--width", &width, "--height", &height, "--spp", &spp];
    desk.run(["render", source, "-o", "ours.exr"].iter().chain(&size).chain(more)).ends_with(0);
    let output = std::process::Command::new(python)
        .arg(repository("tests/render_mitsuba.py"))
        .args([&width, &height, &spp])
        .arg(desk.path("mitsuba/scene.xml"))
        .output()
        .expect("Python starts");
    assert!(output.status.success(), "{source}: {}", String::from_utf8_lossy(&output.stderr));
    let ours = desk.raster("ours.exr");
    let variance = ours.layers.iter().find(|l| l.name == "data").expect("a data part");
    let ours = [planes(&ours.layers[0], ""), planes(variance, "variance.")];
    let theirs = ["mean", "variance"]
        .map(|name| planes(&read(&desk.path(&format!("mitsuba/{name}.exr"))).layers[0], ""));
    for (channel, name) in ["red", "green", "blue"].into_iter().enumerate() {
        let of = |[mean, variance]: &[[Vec<f64>; 3]; 2]| [mean[channel].clone(), variance[channel].clone()];
        compare(&of(&ours), &of(&theirs), allowed, &format!("{source}, {name}"));
    }
}

fn planes(layer: &Layer, prefix: &str) -> [Vec<f64>; 3] {
    ["R", "G", "B"].map(|c| {
        let channel = layer.channel(&format!("{prefix}{c}")).expect("a channel");
        channel.values.iter().map(|&v| f64::from(v)).collect()
    })
}

/// Compares a channel's mean and variance of its mean, pixel by pixel.
#[track_caller]
fn compare(ours: &[Vec<f64>; 2], theirs: &[Vec<f64>; 2], allowed: f64, what: &str) {
    let all: Vec<usize> = (0..SIZE[0] * SIZE[1]).collect();
    let mean =
        |plane: &[f64], pixels: &[usize]| pixels.iter().map(|&p| plane[p]).sum::<f64>() / pixels.len() as f64;
    let error = |pixels: &[usize]| {
        let both = mean(&ours[1], pixels) + mean(&theirs[1], pixels);
        (both / pixels.len() as f64).sqrt()
    };
    let whole = mean(&ours[0], &all);
    assert!(whole > 0.01, "{what}: the picture is black");
    assert!(error(&all) < 0.01 * whole, "{what}: {} of {whole} is too much noise", error(&all));
    for (left, top) in
        (0..SIZE[0]).step_by(TILE).flat_map(|x| (0..SIZE[1]).step_by(TILE).map(move |y| (x, y)))
    {
        let inside = |p: &usize| {
            (left..left + TILE).contains(&(p % SIZE[0])) && (top..top + TILE).contains(&(p / SIZE[0]))
        };
        let tile: Vec<usize> = all.iter().copied().filter(inside).collect();
        let [a, b] = [ours, theirs].map(|planes| mean(&planes[0], &tile));
        // Dark tiles are held to a hundredth of the picture's brightness.
        let limit = 4.5 * error(&tile) + allowed * a.max(0.01 * whole);
        assert!(
            (a - b).abs() <= limit,
            "{what}, tile at {left}, {top}: {a} here, {b} there, {limit} allowed"
        );
    }
}

/// Nothing is allowed but what rounding does: rays that start a little elsewhere.
const SAME: f64 = 0.004;

#[test]
fn lambert_boxes_with_an_area_light_look_the_same() {
    agree(&Desk::new(""), &repository("scenes/cornell.obj"), 256, SAME);
}

/// Also a camera that mirrors, whose pixels lie half a pixel off, and surfaces that are black from behind.
#[test]
fn mirrors_and_glass_look_the_same() {
    let desk = Desk::new("");
    agree(&desk, &small_aris_scene(&desk, "cbox", &[]), 256, SAME);
}

/// The disk for a square lens has its area but not its corners. With it there is no offset of half a pixel.
#[test]
fn a_lens_blurs_nearly_the_same() {
    let desk = Desk::new("");
    let lens = [
        ("name: perspective", "name: thin"),
        ("fov: 28", "fov: 28\n    aperture: 0.15\n    focal_distance: 4.2"),
    ];
    let scene = small_aris_scene(&desk, "cbox_diffuse", &lens);
    agree_but_for(&desk, &scene, 256, 0.02, &["--set", "camera.pixel_offset=[0, 0]"]);
}

/// A copy of a scene of the project's config root with a picture as small as ours, which an offset of half a pixel depends on, and
/// with `edits` of what its camera is.
fn small_aris_scene(desk: &Desk, name: &str, edits: &[(&str, &str)]) -> PathBuf {
    let source = repository("scenes/aris");
    for entry in walkdir::WalkDir::new(&source).into_iter().map(|e| e.expect("an entry")) {
        let copy = desk.path("aris").join(entry.path().strip_prefix(&source).expect("inside"));
        if entry.file_type().is_dir() {
            std::fs::create_dir_all(copy).unwrap();
        } else {
            std::fs::copy(entry.path(), copy).unwrap();
        }
    }
    let base = desk.path("aris/config/scene/cbox_base.yaml");
    let mut text = std::fs::read_to_string(&base).unwrap();
    for (from, to) in [("width: 800\nheight: 600", "width: 48\nheight: 36")].iter().chain(edits) {
        assert!(text.contains(from), "no {from:?} in {text}");
        text = text.replace(from, to);
    }
    std::fs::write(&base, text).unwrap();
    desk.path(&format!("aris/config/scene/{name}.yaml"))
}

/// A little of everything: highlights by Fresnel's equations are up to 0.02 brighter than Schlick's, the mask is cut at texels.
#[test]
fn disney_materials_look_nearly_the_same() {
    agree(&Desk::new(""), &repository("scenes/spheres.glb"), 256, 0.04);
}

/// A texture that is moved and scaled, on a wall in the studio's light; a second wall has vertex colours.
#[test]
fn textures_and_vertex_colors_in_an_environment_look_the_same() {
    let desk = Desk::new("");
    let texels = [255, 0, 0, 20, 255, 0, 0, 0, 255, 200, 200, 40, 0, 90, 90, 255, 255, 255];
    std::fs::write(desk.path("map.png"), png(3, 2, 3, &texels)).unwrap();
    let mtl = "newmtl map\nillum 1\nKd 0.9 0.6 0.8\nmap_Kd -s 2 1.5 1 -o 0.3 0.2 0 map.png\nnewmtl plain\nillum 1\nKd 0.8 0.5 0.7\n";
    std::fs::write(desk.path("walls.mtl"), mtl).unwrap();
    let obj = "mtllib walls.mtl\nv -2 -1 0 1 0 0\nv 0 -1 0 0 1 0\nv 0 1 0 0 0 1\nv -2 1 0 1 1 1\nv 2 -1 0.5 0.2 1 0\nv 2 1 0.5 1 0.1 0.3\n\
               vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl map\nf 1/1 2/2 3/3 4/4\nusemtl plain\nf 2 5 6 3\n";
    std::fs::write(desk.path("walls.obj"), obj).unwrap();
    agree(&desk, &desk.path("walls.obj"), 256, SAME);
}

/// An image with a bright spot and no two columns alike, as Aris reads it.
#[test]
fn environment_images_of_aris_look_the_same() {
    let desk = Desk::new("");
    let (width, height) = (33, 16);
    let plane = |channel: usize| {
        let value = |i: usize| {
            let (x, y) = (i % width, i / width);
            0.2 + (x * (channel + 1) % 7) as f32 * 0.1 + if (4..8).contains(&x) && y < 6 { 6.0 } else { 0.0 }
        };
        (0..width * height).map(value).collect()
    };
    let layer = Layer::new("", Window::sized(width as u32, height as u32));
    let layer = layer.with("R", plane(0)).with("G", plane(1)).with("B", plane(2));
    write_exr(&desk.path("sky.exr"), &Raster::single(layer)).unwrap();
    std::fs::create_dir_all(desk.path("config/scene")).unwrap();
    std::fs::write(desk.path("box.obj"), BOX).unwrap();
    let yaml = "geometry:\n  name: mesh\n  config:\n    paths:\n      - box.obj\n\
        brdf:\n  - name: diffuse\n    config:\n      color: [0.8, 0.6, 0.4]\n\
        environment:\n  name: envmap\n  config:\n    path: sky.exr\n\
        camera:\n  name: perspective\n  config:\n    fov: 70\n    c2w:\n      - [0.8, -0.36, 0.48, 2]\n      - [0.6, 0.48, -0.64, -2.5]\n      - [0, 0.8, 0.6, 2.5]\n\
        width: 48\nheight: 36\n";
    std::fs::write(desk.path("config/scene/box.yaml"), yaml).unwrap();
    // The seam is a column wide at most.
    agree(&desk, &desk.path("config/scene/box.yaml"), 256, 0.02);
}

/// A cube around the origin, facing outwards.
const BOX: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Emission seen straight on: turned and mirrored coordinates, a mesh turned inside out by its transform, and one that shines to
/// the back.
#[test]
fn emission_looks_the_same_through_texture_transforms_from_both_sides() {
    let desk = Desk::new("");
    let transform = json!({"offset": [0.2, -0.3], "rotation": 0.5, "scale": [2.0, 3.0]});
    let texture =
        |sampler: usize| json!({"index": sampler, "extensions": {"KHR_texture_transform": transform}});
    let unlit = |sampler: usize| {
        json!({"pbrMetallicRoughness": {"baseColorTexture": texture(sampler), "baseColorFactor": [0.9, 0.5, 1.0, 1.0]},
            "extensions": {"KHR_materials_unlit": {}}, "doubleSided": true})
    };
    let texels = [255, 0, 0, 20, 255, 0, 0, 0, 255, 200, 200, 40, 0, 90, 90, 255, 255, 255];
    let scene = Gltf {
        materials: vec![unlit(0), unlit(1), unlit(2)],
        images: vec![png(3, 2, 3, &texels)],
        samplers: vec![
            json!({"wrapS": 10497, "wrapT": 10497}),
            json!({"wrapS": 33648, "wrapT": 33648}),
            json!({"wrapS": 33071, "wrapT": 33071, "magFilter": 9728}),
        ],
        nodes: vec![
            json!({"mesh": quad(0), "translation": [-1.1, 0, 0]}),
            json!({"mesh": quad(1), "translation": [1.1, 0, 0], "scale": [-1, 1, 1]}),
            json!({"mesh": quad(2), "translation": [0, 1.7, -1], "rotation": [0, 1, 0, 0]}),
        ],
        ..Gltf::default()
    };
    agree(&desk, &scene.write(&desk), 64, SAME);
}

/// Burley's diffuse term alone, which Mitsuba has too.
fn diffuse(color: [f32; 4]) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorFactor": color, "metallicFactor": 0, "roughnessFactor": 0.7},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}}})
}

const FLOOR: [f32; 4] = [-0.5, 0.0, 0.0, 0.866_025_4];

/// A point light and a sun on a floor, seen from the side, and from infinitely far.
#[test]
fn lights_without_extent_look_the_same() {
    let desk = Desk::new("");
    let perspective = lit_floor();
    agree(&desk, &perspective.write(&desk), 64, SAME);
    let orthographic = Gltf { half_height: Some(1.1), ..lit_floor() };
    agree(&desk, &orthographic.write(&desk), 64, SAME);
}

fn lit_floor() -> Gltf {
    Gltf {
        materials: vec![diffuse([0.8, 0.6, 0.4, 1.0])],
        nodes: vec![
            json!({"mesh": quad(0), "rotation": FLOOR, "scale": [3, 3, 3], "translation": [0, -0.5, -1]}),
            json!({"translation": [0.7, 1, 0.5], "extensions": {"KHR_lights_punctual": {"light": 0}}}),
            json!({"rotation": [-0.6, 0.2, 0.1, 0.768], "extensions": {"KHR_lights_punctual": {"light": 1}}}),
        ],
        lights: vec![
            json!({"type": "point", "color": [1, 0.5, 0.2], "intensity": 8}),
            json!({"type": "directional", "color": [0.2, 0.6, 1], "intensity": 2}),
        ],
        ..Gltf::default()
    }
}

/// Tilted normals under a low sun: with x or y the wrong way round it would be dark where it is bright.
#[test]
fn normal_maps_look_the_same() {
    let desk = Desk::new("");
    let mut bumpy = diffuse([0.8, 0.8, 0.8, 1.0]);
    bumpy["normalTexture"] = json!({"index": 0, "scale": 0.6});
    let texels = [200, 128, 210, 60, 128, 210, 128, 200, 210, 128, 60, 210];
    let scene = Gltf {
        materials: vec![bumpy],
        images: vec![png(2, 2, 3, &texels)],
        samplers: vec![json!({"magFilter": 9728})],
        nodes: vec![
            json!({"mesh": quad(0), "scale": [1.6, 1.6, 1]}),
            json!({"rotation": [0.35, 0.3, 0, 0.887], "extensions": {"KHR_lights_punctual": {"light": 0}}}),
        ],
        lights: vec![json!({"type": "directional", "intensity": 3})],
        ..Gltf::default()
    };
    agree(&desk, &scene.write(&desk), 64, SAME);
}

/// A pane whose alpha varies before another, and a leaf that is cut out.
#[test]
fn opacity_looks_the_same() {
    let desk = Desk::new("");
    let mut pane = diffuse([0.9, 0.3, 0.2, 0.8]);
    pane["alphaMode"] = json!("BLEND");
    pane["doubleSided"] = json!(true);
    pane["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    let texels = [255, 255, 255, 40, 255, 200, 255, 255, 90, 255, 255, 120, 255, 255, 255, 200];
    let scene = Gltf {
        materials: vec![pane, diffuse([0.2, 0.4, 0.9, 1.0])],
        images: vec![png(2, 2, 4, &texels)],
        samplers: vec![json!({})],
        nodes: vec![
            json!({"mesh": quad(0), "translation": [0.3, 0.2, 0.5]}),
            json!({"mesh": quad(0), "translation": [-0.4, -0.2, 0.2]}),
            json!({"mesh": quad(1), "translation": [0, 0, -1], "scale": [3, 3, 1]}),
            json!({"rotation": [-0.3, 0.2, 0, 0.93], "extensions": {"KHR_lights_punctual": {"light": 0}}}),
        ],
        lights: vec![json!({"type": "directional", "intensity": 3})],
        ..Gltf::default()
    };
    agree(&desk, &scene.write(&desk), 256, SAME);
}

/// Panes that shine to both sides as far as they are there: one evenly, over a floor, and one by the texture that it shines with.
#[test]
fn emission_of_what_is_partly_there_looks_the_same() {
    let desk = Desk::new("");
    let pane = |alpha: f32| {
        json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, alpha], "metallicFactor": 0},
            "emissiveFactor": [0.9, 0.5, 0.2], "doubleSided": true, "alphaMode": "BLEND",
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}}})
    };
    let over_floor = Gltf {
        materials: vec![pane(0.4), diffuse([0.8, 0.8, 0.8, 1.0])],
        nodes: vec![
            json!({"mesh": quad(0), "translation": [0.2, -0.2, 0.4]}),
            json!({"mesh": quad(1), "rotation": FLOOR, "scale": [3, 3, 3], "translation": [0, -1.2, -1]}),
        ],
        ..Gltf::default()
    };
    agree(&desk, &over_floor.write(&desk), 256, SAME);
    let mut textured = pane(0.9);
    textured["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    textured["emissiveTexture"] = json!({"index": 0});
    let texels = [255, 255, 255, 40, 255, 200, 255, 255, 90, 255, 255, 120, 255, 255, 255, 200];
    let alone = Gltf {
        materials: vec![textured],
        images: vec![png(2, 2, 4, &texels)],
        samplers: vec![json!({"magFilter": 9728})],
        nodes: vec![json!({"mesh": quad(0), "translation": [-0.3, 0.3, 0.2]})],
        ..Gltf::default()
    };
    agree(&desk, &alone.write(&desk), 256, SAME);
}

/// Cubes of smooth and rough glass that take light, and a thin sheet, before the studio.
#[test]
fn what_lets_light_through_looks_the_same() {
    let desk = Desk::new("");
    let glass = |roughness: f32| {
        json!({"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.8, 1.0, 1.0], "metallicFactor": 0, "roughnessFactor": roughness},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_volume": {"thicknessFactor": 1, "attenuationColor": [0.3, 0.7, 0.9], "attenuationDistance": 1.5}}})
    };
    let sheet = json!({"pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.9, 0.6, 1.0], "metallicFactor": 0, "roughnessFactor": 0.3},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.6}}, "doubleSided": true});
    let scene = Gltf {
        materials: vec![glass(0.0), glass(0.4), sheet],
        nodes: vec![
            json!({"mesh": cube(0), "translation": [-1, 0, -1], "rotation": [0.1, 0.3, 0.05, 0.947], "scale": [0.6, 0.6, 0.6]}),
            json!({"mesh": cube(1), "translation": [0.8, 0, -1], "rotation": [0.2, -0.3, 0.05, 0.931], "scale": [0.6, 0.6, 0.6]}),
            json!({"mesh": quad(2), "translation": [0.1, 1.1, 0], "scale": [0.5, 0.5, 1]}),
        ],
        ..Gltf::default()
    };
    // The sheet's highlights by Fresnel's equations, not Schlick's.
    agree(&desk, &scene.write(&desk), 1024, 0.02);
}

/// Without Mitsuba: what is lost is told, and the files are the same every time.
#[test]
fn what_mitsuba_has_no_place_for_is_told() {
    let desk = Desk::new("");
    let material = json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0, "roughnessFactor": 0},
        "emissiveFactor": [1, 1, 1], "alphaMode": "MASK", "doubleSided": true,
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5},
            "KHR_materials_clearcoat": {"clearcoatFactor": 1}}
    });
    let spot = json!({"type": "spot", "range": 5, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.4}});
    let scene = Gltf {
        materials: vec![material],
        images: vec![png(1, 1, 4, &[200, 100, 50, 255])],
        samplers: vec![json!({"wrapS": 33071, "wrapT": 10497})],
        nodes: vec![json!({"mesh": quad(0)}), json!({"extensions": {"KHR_lights_punctual": {"light": 0}}})],
        lights: vec![spot],
        ..Gltf::default()
    };
    let source = scene.write(&desk);
    let convert = |folder: &str| {
        desk.run(["convert", source.to_str().unwrap(), "--to", "mitsuba", "-o", folder]).ends_with(0)
    };
    let run = convert("first");
    for told in [
        "a quarter: Mitsuba's is 4·(n·l)(n·v) times Burley's",
        "outside the image both axes go on as the first does",
        "alpha is at least 0.001",
        "cut at the edges of texels",
        "Mitsuba's light does not end at a range",
        "half-way it is about 1.3 times as bright",
    ] {
        assert!(run.stdout.contains(told), "no {told:?} in {}", run.stdout);
    }
    convert("again");
    assert_eq!(desk.names("first"), ["meshes", "scene.xml", "textures"]);
    for folder in ["", "meshes", "textures"] {
        for file in desk.names(&format!("first/{folder}")).iter().filter(|f| f.contains('.')) {
            let [a, b] = ["first", "again"].map(|run| desk.bytes(&format!("{run}/{folder}/{file}")));
            assert!(a == b, "{folder}/{file}");
        }
    }
}

fn png(width: u32, height: u32, channels: u8, values: &[u8]) -> Vec<u8> {
    encode_texture(width, height, channels, Interleaved::U8(values)).expect("a picture")
}

/// A glTF scene of squares and cubes, one of each a material, before a camera that is a little off the axis.
#[derive(Default)]
struct Gltf {
    materials: Vec<Value>,
    images: Vec<Vec<u8>>,
    /// Textures of the first image.
    samplers: Vec<Value>,
    nodes: Vec<Value>,
    lights: Vec<Value>,
    /// Half the height of an orthographic camera's view.
    half_height: Option<f64>,
}

/// The mesh of a square of a material: from -1 to 1 in x and y, facing z.
fn quad(material: usize) -> usize {
    2 * material
}

/// The mesh of a cube of a material.
fn cube(material: usize) -> usize {
    2 * material + 1
}

impl Gltf {
    fn write(self, desk: &Desk) -> PathBuf {
        let corner = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0f32 } else { -1.0 };
        let corners: Vec<f32> = (0..8).flat_map(|i| [0, 1, 2].map(|bit| corner(i, bit))).collect();
        let square: [f32; 32] = [
            -1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0,
            0.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0,
        ];
        let faces: [u16; 42] = [
            0, 1, 2, 0, 2, 3, 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4,
            2, 2, 4, 6, 1, 3, 5, 3, 7, 5,
        ];
        let mut bytes: Vec<u8> = square.iter().chain(&corners).flat_map(|v| v.to_le_bytes()).collect();
        bytes.extend(faces.iter().flat_map(|v| v.to_le_bytes()));
        let vertices = |kind: &str, at: usize| {
            json!({"bufferView": 0, "byteOffset": at, "componentType": 5126, "count": 4, "type": kind,
                "min": [-1, -1, 0], "max": [1, 1, 0]})
        };
        let mut accessors = vec![vertices("VEC3", 0), vertices("VEC3", 12), vertices("VEC2", 24)];
        for accessor in &mut accessors[1..] {
            accessor.as_object_mut().unwrap().retain(|key, _| key != "min" && key != "max");
        }
        accessors.extend([
            json!({"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-1, -1, -1], "max": [1, 1, 1]}),
            json!({"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}),
            json!({"bufferView": 2, "byteOffset": 12, "componentType": 5123, "count": 36, "type": "SCALAR"}),
        ]);
        let meshes: Vec<Value> = (0..self.materials.len())
            .flat_map(|material| {
                let square = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2});
                let [square, cube] = [(square, 4), (json!({"POSITION": 3}), 5)].map(|(attributes, indices)| {
                    json!({"primitives": [{"attributes": attributes, "indices": indices, "material": material}]})
                });
                [square, cube]
            })
            .collect();
        let camera =
            json!({"camera": 0, "translation": [0.4, 0.5, 4], "rotation": [-0.05, 0.04, 0.02, 0.998]});
        let mut nodes = self.nodes;
        nodes.push(camera);
        let camera = match self.half_height {
            None => {
                json!({"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 4.0 / 3.0, "znear": 0.1}})
            }
            Some(half) => json!({"type": "orthographic",
                "orthographic": {"xmag": half * 4.0 / 3.0, "ymag": half, "znear": 0.1, "zfar": 100}}),
        };
        let uri = |kind: &str, bytes: &[u8]| format!("data:{kind};base64,{}", base64(bytes));
        let textures: Vec<Value> =
            (0..self.samplers.len()).map(|s| json!({"source": 0, "sampler": s})).collect();
        let images: Vec<Value> =
            self.images.iter().map(|png| json!({"uri": uri("image/png", png)})).collect();
        let mut document = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
            "nodes": nodes, "meshes": meshes, "materials": self.materials, "accessors": accessors,
            "cameras": [camera],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 128, "byteStride": 32},
                {"buffer": 0, "byteOffset": 128, "byteLength": 96},
                {"buffer": 0, "byteOffset": 224, "byteLength": 84},
            ],
            "buffers": [{"byteLength": bytes.len(), "uri": uri("application/octet-stream", &bytes)}],
            "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_clearcoat", "KHR_materials_specular", "KHR_materials_transmission",
                "KHR_materials_unlit", "KHR_materials_volume", "KHR_texture_transform"],
            "extensions": {"KHR_lights_punctual": {"lights": self.lights}},
        });
        for (key, value) in [("textures", textures), ("images", images), ("samplers", self.samplers)] {
            if !value.is_empty() {
                document[key] = value.into();
            }
        }
        let path = desk.path("scene.gltf");
        std::fs::write(&path, document.to_string()).expect("the scene is written");
        path
    }
}

fn base64(bytes: &[u8]) -> String {
    use ::base64::Engine;
    ::base64::engine::general_purpose::STANDARD.encode(bytes)
}
