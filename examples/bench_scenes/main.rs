//! Writes scenes that are hard to light, or that stand for a lot, into a folder, for `pipeline bench`; they are too large to keep, or of
//! no use but that.
//!
//! ```text
//! cargo run --release --example bench_scenes -- FOLDER
//! pipeline bench FOLDER/*.glb FOLDER/*.toml
//! ```

#[path = "../make_scenes/glb.rs"]
#[allow(dead_code, reason = "the other example uses the rest")]
mod glb;
#[path = "../make_scenes/mesh.rs"]
#[allow(dead_code, reason = "the other example uses the rest")]
mod mesh;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use glam::{DQuat, DVec3};
use glb::{Glb, GlbError};
use mesh::{Mesh, geodesic_sphere, rectangle};
use pipeline::imagefile::{ImageFileError, write_exr, write_whole};
use pipeline::math::hash::{combine, unit_f32};
use pipeline::raster::{Layer, Raster, Window};
use serde_json::json;

/// Why the scenes could not be written.
#[derive(Debug, thiserror::Error)]
enum MakeError {
    #[error("expected one argument: the folder to write into")]
    Argument,
    #[error("{path}: {source}")]
    Folder { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Glb(#[from] GlbError),
    #[error(transparent)]
    File(#[from] ImageFileError),
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Adds a scene's light to the stage, and what else it needs.
type Light = fn(&mut Glb);

fn run() -> Result<(), MakeError> {
    let mut arguments = std::env::args().skip(1);
    let (Some(folder), None) = (arguments.next(), arguments.next()) else { return Err(MakeError::Argument) };
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|source| MakeError::Folder { path: folder.into(), source })?;
    let scenes: [(&str, Light); 6] = [
        ("lamps", lamps),
        ("emitters", emitters),
        ("small_light", small_light),
        ("interreflection", interreflection),
        ("through_glass", through_glass),
        ("sun", |_| ()),
    ];
    for (name, light) in scenes {
        let mut glb = stage();
        light(&mut glb);
        write(folder, name, glb)?;
    }
    write(folder, "street", street())?;
    for (name, trees) in [("grove", 100), ("forest", 1000)] {
        write(folder, name, forest(trees))?;
    }
    write_exr(&folder.join("sun.exr"), &sky())?;
    write_whole(&folder.join("sun.toml"), SUN.as_bytes())?;
    let _ = writeln!(io::stderr(), "written   sun.exr, sun.toml");
    Ok(())
}

fn write(folder: &Path, name: &str, glb: Glb) -> Result<(), MakeError> {
    let about = format!("{} triangles", glb.triangles());
    write_whole(&folder.join(format!("{name}.glb")), &glb.finish(name)?)?;
    let _ = writeln!(io::stderr(), "written   {name}.glb   {about}");
    Ok(())
}

/// A number in [0, 1).
fn random(i: u64, dimension: u64) -> f64 {
    f64::from(unit_f32((combine(i, dimension) >> 32) as u32))
}

fn anywhere(i: u64, dimension: u64) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|d| 2.0 * random(i, dimension + d) - 1.0))
}

/// A floor with three balls, matt, plastic and metal, and the camera.
fn stage() -> Glb {
    let mut glb = Glb::default();
    let floor = glb.plain("floor", [0.5, 0.5, 0.5], 1.0);
    glb.mesh("floor", &rectangle(DVec3::new(-6.0, 0.0, 6.0), DVec3::X * 12.0, -DVec3::Z * 12.0), floor);
    let materials = [
        glb.plain("matt", [0.7, 0.7, 0.7], 1.0),
        glb.plain("plastic", [0.2, 0.4, 0.7], 0.3),
        glb.material(json!({
            "name": "metal",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.95, 0.64, 0.54, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.3,
            },
        })),
    ];
    for (i, material) in materials.into_iter().enumerate() {
        let center = DVec3::new(1.6 * (i as f64 - 1.0), 0.7, 0.0);
        glb.mesh(["matt", "plastic", "metal"][i], &geodesic_sphere(center, 0.7, 12), material);
    }
    glb.camera(DVec3::new(0.0, 2.2, 6.5), DVec3::new(0.0, 0.6, 0.0), 34.0, 4.0 / 3.0);
    glb
}

/// Where the lamp `i` hangs.
fn place(i: u64) -> DVec3 {
    anywhere(i, 0) * DVec3::new(6.0, 1.1, 6.0) + DVec3::new(0.0, 1.8, -1.0)
}

/// A thousand meshes that emit, of ten colours and strengths, all over the room.
fn lamps(glb: &mut Glb) {
    let colors: Vec<usize> = (0..10)
        .map(|c| {
            glb.emissive(
                &format!("lamp_{c}"),
                [0, 1, 2].map(|d| 0.4 + 0.6 * random(c, 10 + d)),
                1.0 + 4.0 * c as f64,
            )
        })
        .collect();
    for i in 0..1000 {
        let lamp = geodesic_sphere(place(i), 0.03, 1);
        glb.mesh(&format!("lamp_{i}"), &lamp, colors[i as usize % colors.len()]);
    }
}

/// One mesh of 100,000 triangles that emit: quads that face anywhere.
fn emitters(glb: &mut Glb) {
    let mut all = Mesh::default();
    for i in 0..50_000 {
        let turn = DQuat::from_rotation_arc(DVec3::Z, anywhere(i, 3).normalize_or(DVec3::Z));
        all.append(&rectangle(place(i), turn * (DVec3::X * 0.01), turn * (DVec3::Y * 0.01)));
    }
    let material = glb.emissive("emitters", [1.0, 0.8, 0.6], 8.0);
    glb.mesh("emitters", &all, material);
}

/// A bright light of 4 cm.
fn small_light(glb: &mut Glb) {
    let material = glb.emissive("light", [1.0, 1.0, 1.0], 4000.0);
    glb.mesh("light", &rectangle(DVec3::new(-2.0, 3.0, 1.0), DVec3::X * 0.04, DVec3::Z * 0.04), material);
}

/// Two mirrors that are not quite ones, face to face with a strip of light between them.
fn interreflection(glb: &mut Glb) {
    let metal = glb.material(json!({
        "name": "walls",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.9, 0.9, 0.9, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.15,
        },
    }));
    let (up, forward) = (DVec3::Y * 3.0, DVec3::Z * 6.0);
    glb.mesh("left", &rectangle(DVec3::new(-2.6, 0.0, -4.0), up, forward), metal);
    glb.mesh("right", &rectangle(DVec3::new(2.6, 0.0, -4.0), forward, up), metal);
    let light = glb.emissive("light", [1.0, 0.9, 0.8], 15.0);
    glb.mesh("light", &rectangle(DVec3::new(-2.5, 2.9, -0.5), DVec3::X * 5.0, DVec3::Z * 0.3), light);
}

/// A light in a ball of glass, and a pane before the balls.
fn through_glass(glb: &mut Glb) {
    let glass = |name: &str, roughness: f64| {
        json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness,
            },
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 1.0 },
                "KHR_materials_ior": { "ior": 1.5 },
                "KHR_materials_volume": { "thicknessFactor": 1.0 },
            },
        })
    };
    let (shade, pane) = (glb.material(glass("shade", 0.4)), glb.material(glass("pane", 0.0)));
    let center = DVec3::new(0.0, 2.4, 0.8);
    glb.mesh("shade", &geodesic_sphere(center, 0.45, 12), shade);
    let light = glb.emissive("light", [1.0, 0.9, 0.7], 120.0);
    glb.mesh("light", &geodesic_sphere(center, 0.15, 4), light);
    let (right, up, back) = (DVec3::X * 1.4, DVec3::Y * 1.6, -DVec3::Z * 0.05);
    let corner = DVec3::new(0.9, 0.01, 1.2);
    let mut slab = rectangle(corner, right, up);
    slab.append(&rectangle(corner + back, up, right));
    slab.append(&rectangle(corner, up, back));
    slab.append(&rectangle(corner + right, back, up));
    slab.append(&rectangle(corner, back, right));
    slab.append(&rectangle(corner + up, right, back));
    glb.mesh("pane", &slab, pane);
}

/// A street at night: lit windows and signs on both sides, 160 of any colour and brightness, a wet road and shiny balls on it.
fn street() -> Glb {
    let mut glb = Glb::default();
    let wet = glb.plain("road", [0.1, 0.1, 0.1], 0.15);
    let (along, up, across) = (DVec3::Z * 24.0, DVec3::Y * 6.0, DVec3::X * 5.0);
    let corner = DVec3::new(-2.5, 0.0, -12.0);
    glb.mesh("road", &rectangle(corner, along, across), wet);
    let walls = glb.plain("walls", [0.4, 0.35, 0.3], 0.8);
    glb.mesh("left", &rectangle(corner, up, along), walls);
    glb.mesh("right", &rectangle(corner + across, along, up), walls);
    for i in 0..160 {
        let color = [0, 1, 2].map(|d| 0.2 + 0.8 * random(i, d));
        let brightness = 2.0 + 40.0 * random(i, 3) * random(i, 3) * random(i, 4) * random(i, 4);
        let light = glb.emissive(&format!("light_{i}"), color, brightness);
        let (width, height) = (0.08 + 0.3 * random(i, 5), 0.08 + 0.3 * random(i, 6));
        let (right, top) = (DVec3::Z * width, DVec3::Y * height);
        let y = 0.5 + 5.0 * random(i, 7);
        let z = -11.5 + 22.0 * random(i, 8);
        let sign = if i % 2 == 0 {
            rectangle(DVec3::new(-2.49, y, z), top, right)
        } else {
            rectangle(DVec3::new(2.49, y, z), right, top)
        };
        glb.mesh(&format!("light_{i}"), &sign, light);
    }
    for i in 0..8 {
        let metallic = f64::from(u8::from(i % 2 == 1));
        let [r, g, b] = [0, 1, 2].map(|d| 0.8 * random(i, 20 + d));
        let material = glb.material(json!({
            "name": format!("ball_{i}"),
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": metallic, "roughnessFactor": 0.1 + 0.4 * random(i, 23),
            },
        }));
        let center = DVec3::new(4.0 * random(i, 24) - 2.0, 0.4, 16.0 * random(i, 25) - 8.0);
        glb.mesh(&format!("ball_{i}"), &geodesic_sphere(center, 0.4, 12), material);
    }
    glb.camera(DVec3::new(0.0, 1.7, 11.0), DVec3::new(0.0, 1.2, 0.0), 50.0, 4.0 / 3.0);
    glb
}

/// A meadow of `count` trees, one mesh of 100,000 triangles, turned about their trunks and of any size from a half to one and a half.
fn forest(count: u64) -> Glb {
    let mut glb = Glb::default();
    let side = 4.0 * (count as f64).sqrt();
    let ground = glb.plain("ground", [0.3, 0.25, 0.15], 1.0);
    let corner = DVec3::new(-0.5 * side, 0.0, 0.5 * side);
    glb.mesh("ground", &rectangle(corner, DVec3::X * side, -DVec3::Z * side), ground);
    let mut tree = Mesh::default();
    for i in 0..50_000 {
        let turn = DQuat::from_rotation_arc(DVec3::Z, anywhere(i, 3).normalize_or(DVec3::Z));
        let at = anywhere(i, 0).normalize_or(DVec3::Y) * libm::cbrt(random(i, 6)) * DVec3::new(1.2, 1.7, 1.2);
        let leaf = turn * DVec3::new(0.05, 0.0, 0.0);
        tree.append(&rectangle(at + DVec3::Y * 2.2, leaf, turn * DVec3::new(0.0, 0.08, 0.0)));
    }
    let places: Vec<_> = (0..count)
        .map(|i| {
            let at = anywhere(i, 20) * DVec3::new(0.5 * side, 0.0, 0.5 * side);
            (at, DQuat::from_rotation_y(std::f64::consts::TAU * random(i, 30)), 0.5 + random(i, 31))
        })
        .collect();
    let leaves = glb.plain("leaves", [0.1, 0.3, 0.05], 0.6);
    glb.mesh_in_places("tree", &tree, leaves, &places);
    glb.camera(DVec3::new(0.0, 5.0, 0.5 * side + 6.0), DVec3::new(0.0, 1.0, 0.0), 40.0, 4.0 / 3.0);
    glb
}

/// GLBs have no environment: a manifest lights `sun.glb` with it.
const SUN: &str = r#"# The balls of sun.glb under a sky with a sun.
name  = "sun"
scene = "sun.glb"

[environment]
image = "sun.exr"

[render]
width  = 400
height = 300
"#;

/// Clouds over a dark ground, and a sun of half a degree.
fn sky() -> Raster {
    let (width, height) = (2048u32, 1024u32);
    let sun = [600.0f32, 220.0];
    let value = |x: u32, y: u32, tint: f32| {
        if y >= height / 2 {
            return 0.1;
        }
        let cloud = unit_f32((combine(u64::from(x / 64), u64::from(y / 32)) >> 32) as u32);
        let distance_squared =
            (x as f32 - sun[0]) * (x as f32 - sun[0]) + (y as f32 - sun[1]) * (y as f32 - sun[1]);
        if distance_squared < 2.3 { 60_000.0 } else { tint + 0.6 * cloud }
    };
    let channel = |tint: f32| {
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| value(x, y, tint)).collect()
    };
    let layer = Layer::new("beauty", Window::sized(width, height));
    Raster::single(layer.with("R", channel(0.2)).with("G", channel(0.3)).with("B", channel(0.5)))
}
