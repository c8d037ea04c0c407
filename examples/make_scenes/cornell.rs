//! The Cornell box of the Disney experiments in Aris, as an Aris tree and as OBJ with MTL: the same triangles, written from
//! the same strings.
//!
//! The proportions are those that Nori's box made common: open in front, 2 wide, 1.6 high, 2 deep, two spheres on the floor,
//! a light just below the ceiling, here with a rim.

use std::fmt::Write;

use glam::DVec3;

use super::mesh::{Mesh, MeshError, geodesic_sphere, rectangle};
use super::{Made, MakeError};

const HALF_WIDTH: f64 = 1.0;
const HEIGHT: f64 = 1.6;
const HALF_DEPTH: f64 = 1.0;
const RADIUS: f64 = 0.33;

const WHITE: [f64; 3] = [0.725, 0.71, 0.68];
const BLUE: [f64; 3] = [0.161, 0.133, 0.427];
const RED: [f64; 3] = [0.63, 0.065, 0.05];
const LIGHT: [f64; 3] = [0.8, 0.8, 0.8];
const RADIANCE: f64 = 40.0;

/// A mesh of the box: one file of the Aris tree and one material of its own.
struct Part {
    file: &'static str,
    material: &'static str,
    mesh: Mesh,
    /// Spheres carry normals; flat parts are shaded flat.
    smooth: bool,
}

/// All files of both forms.
pub(crate) fn make() -> Result<Vec<Made>, MakeError> {
    let parts = parts()?;
    let triangles: usize = parts.iter().map(|p| p.mesh.triangles.len()).sum();
    let about = format!("{triangles} triangles");
    let file =
        |path, text: String, about: &str| Made { path, bytes: text.into_bytes(), about: about.to_owned() };
    let mut made = vec![
        file("cornell.obj", obj(&parts), &about),
        file("cornell.mtl", mtl(), "Lambert, the light emits 40"),
        file("aris/config/scene/cbox_base.yaml", base(&parts), "geometry, light, camera"),
    ];
    for (scene, group, [left, right], about) in variants() {
        let brdf = GROUPS.iter().find(|(name, _)| *name == group).map_or("", |(_, path)| *path);
        made.push(file(scene, scene_yaml(group), about));
        made.push(file(brdf, brdf_yaml(&left, &right), about));
    }
    for part in &parts {
        let mut text =
            "# The Cornell box of disney-pipeline, made by its example make_scenes. CC0 1.0.\n".to_owned();
        Numbers::default().write(&mut text, part);
        let about = format!("{} triangles", part.mesh.triangles.len());
        made.push(Made { path: part.file, bytes: text.into_bytes(), about });
    }
    Ok(made)
}

/// The parts in the order of the Aris scene's list of BRDFs.
fn parts() -> Result<Vec<Part>, MeshError> {
    let (w, h, d) = (HALF_WIDTH, HEIGHT, HALF_DEPTH);
    let (x, y, z) = (DVec3::X * 2.0 * w, DVec3::Y * h, DVec3::Z * 2.0 * d);
    let low = DVec3::new(-w, 0.0, -d);
    let mut walls = rectangle(low + y, x, z);
    walls.append(&rectangle(low, z, x));
    walls.append(&rectangle(low, x, y));
    let right = rectangle(low + x, z, y);
    let left = rectangle(low, y, z);
    let (corner, across, along) = (DVec3::new(-0.24, h - 0.01, -0.22), DVec3::X * 0.48, DVec3::Z * 0.4);
    let light = rectangle(corner, across, along);
    // MTL cannot say that a light shines to one side, as Aris' do: a rim up to the ceiling keeps what leaves its back.
    let up = DVec3::Y * 0.01;
    walls.append(&rectangle(corner, up, across));
    walls.append(&rectangle(corner + along, across, up));
    walls.append(&rectangle(corner, along, up));
    walls.append(&rectangle(corner + across, up, along));
    let ball = |x: f64, z: f64| geodesic_sphere(DVec3::new(x, RADIUS + 0.005, z), RADIUS, 11);
    use super::mesh::Boundary::{Closed, Open};
    let part = |file, material, mesh: Mesh, boundary, smooth| {
        Ok(Part { file, material, mesh: mesh.checked(material, boundary)?, smooth })
    };
    Ok(vec![
        part("aris/data/meshes/cbox/walls.obj", "white", walls, Open, false)?,
        part("aris/data/meshes/cbox/rightwall.obj", "blue", right, Open, false)?,
        part("aris/data/meshes/cbox/leftwall.obj", "red", left, Open, false)?,
        part("aris/data/meshes/cbox/sphere1.obj", "ball_left", ball(-0.43, -0.28), Closed, true)?,
        part("aris/data/meshes/cbox/sphere2.obj", "ball_right", ball(0.44, 0.36), Closed, true)?,
        part("aris/data/meshes/cbox/light.obj", "light", light, Open, false)?,
    ])
}

/// How many vertices and normals a file has so far: OBJ counts them through the whole file, from 1.
#[derive(Default)]
struct Numbers {
    vertices: u32,
    normals: u32,
}

impl Numbers {
    fn write(&mut self, text: &mut String, part: &Part) {
        let name = part.material;
        let _ = writeln!(text, "o {name}");
        for p in &part.mesh.positions {
            let _ = writeln!(text, "v {} {} {}", Decimal(p.x, 5), Decimal(p.y, 5), Decimal(p.z, 5));
        }
        if part.smooth {
            for n in &part.mesh.normals {
                let _ = writeln!(text, "vn {} {} {}", Decimal(n.x, 4), Decimal(n.y, 4), Decimal(n.z, 4));
            }
        }
        let _ = writeln!(text, "usemtl {name}");
        for t in &part.mesh.triangles {
            let [a, b, c] = t.map(|i| i + 1 + self.vertices);
            if part.smooth {
                let [na, nb, nc] = t.map(|i| i + 1 + self.normals);
                let _ = writeln!(text, "f {a}//{na} {b}//{nb} {c}//{nc}");
            } else {
                let _ = writeln!(text, "f {a} {b} {c}");
            }
        }
        self.vertices += part.mesh.positions.len() as u32;
        self.normals += if part.smooth { part.mesh.normals.len() as u32 } else { 0 };
    }
}

/// A number with at most so many decimals, without trailing zeros or a negative zero.
struct Decimal(f64, usize);

impl std::fmt::Display for Decimal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.*}", self.1, self.0);
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

fn obj(parts: &[Part]) -> String {
    let mut text = "# The Cornell box of disney-pipeline, made by its example make_scenes. CC0 1.0.\nmtllib cornell.mtl\n".to_owned();
    let mut numbers = Numbers::default();
    for part in parts {
        numbers.write(&mut text, part);
    }
    text
}

fn mtl() -> String {
    let mut text = "# Lambert throughout (illum 1, no Ks): what Aris calls diffuse. CC0 1.0.\n".to_owned();
    let colors = [
        ("white", WHITE),
        ("blue", BLUE),
        ("red", RED),
        ("ball_left", YELLOW),
        ("ball_right", CYAN),
        ("light", LIGHT),
    ];
    for (name, [r, g, b]) in colors {
        let _ = write!(text, "\nnewmtl {name}\nKd {r} {g} {b}\n");
        if name == "light" {
            let _ = writeln!(text, "Ke {RADIANCE} {RADIANCE} {RADIANCE}");
        }
        text.push_str("illum 1\n");
    }
    text
}

/// The part of the scene that all variants share. The camera's matrix mirrors x, as Aris' cameras do.
fn base(parts: &[Part]) -> String {
    let mut text = "geometry:\n  name: mesh\n  config:\n    paths:\n".to_owned();
    for part in parts {
        let _ = writeln!(text, "      - {}", part.file.trim_start_matches("aris/"));
    }
    let light = parts.len() - 1;
    let _ = write!(
        text,
        "emitters:
  - name: area
    config:
      radiance: [40, 40, 40]
      i_primitive: {light}
      geometry:
      i_emitter:
camera:
  name: perspective
  config:
    fov: 28
    c2w:
      - [-1.0, 0.0, 0.0, 0.0]
      - [0.0, 0.9996573249755573, 0.02617694830787315, 0.92]
      - [0.0, -0.02617694830787315, 0.9996573249755573, 5.4]

width: 800
height: 600
"
    );
    text
}

fn scene_yaml(group: &str) -> String {
    format!("defaults:\n  - cbox_base\n  - environment: none\n  - brdf: {group}\n  - _self_\n")
}

const YELLOW: [f64; 3] = [0.8, 0.8, 0.4];
const CYAN: [f64; 3] = [0.4, 0.8, 0.8];

/// The BRDF groups' files.
const GROUPS: [(&str, &str); 4] = [
    ("cbox", "aris/config/scene/brdf/cbox.yaml"),
    ("cbox_diffuse", "aris/config/scene/brdf/cbox_diffuse.yaml"),
    ("cbox_balls", "aris/config/scene/brdf/cbox_balls.yaml"),
    ("cbox_copper", "aris/config/scene/brdf/cbox_copper.yaml"),
];

/// The scenes: file, BRDF group, the two spheres' entries, and what it is.
fn variants() -> [(&'static str, &'static str, [String; 2], &'static str); 4] {
    let mirror = "- name: mirror\n  config: {}\n".to_owned();
    let glass = "- name: dielectric\n  config:\n    ext_ior: 1.000277\n    int_ior: 1.5046\n".to_owned();
    let pink =
        Disney { color: [1.0, 0.4, 0.7], roughness: 0.2, metallic: 0.6, clearcoat: 1.0, ..Disney::default() };
    let green = Disney { color: [0.2, 1.0, 0.1], roughness: 1.0, subsurface: 1.0, ..Disney::default() };
    let copper = |roughness| Disney {
        color: [0.955, 0.637, 0.538],
        roughness,
        metallic: 1.0,
        clearcoat: 0.1,
        ..Disney::default()
    };
    [
        ("aris/config/scene/cbox.yaml", "cbox", [mirror, glass], "mirror and glass"),
        (
            "aris/config/scene/cbox_diffuse.yaml",
            "cbox_diffuse",
            [diffuse(YELLOW), diffuse(CYAN)],
            "Lambert: the same picture as cornell.obj",
        ),
        (
            "aris/config/scene/cbox_balls.yaml",
            "cbox_balls",
            [pink.yaml(), green.yaml()],
            "Pink and Green Balls",
        ),
        (
            "aris/config/scene/cbox_copper.yaml",
            "cbox_copper",
            [copper(0.2).yaml(), copper(0.25).yaml()],
            "Two Copper Spheres",
        ),
    ]
}

/// Walls, spheres, light: one entry a mesh.
fn brdf_yaml(left: &str, right: &str) -> String {
    [&diffuse(WHITE), &diffuse(BLUE), &diffuse(RED), left, right, &*diffuse(LIGHT)].concat()
}

fn diffuse([r, g, b]: [f64; 3]) -> String {
    format!("- name: diffuse\n  config:\n    color: [{r}, {g}, {b}]\n")
}

/// The parameters of Aris' `disney` that the experiments vary; the others are 0, `specular` and `clearcoatGloss` 0.5.
#[derive(Default)]
struct Disney {
    color: [f64; 3],
    roughness: f64,
    metallic: f64,
    subsurface: f64,
    clearcoat: f64,
}

impl Disney {
    fn yaml(&self) -> String {
        let Self { color: [r, g, b], roughness, metallic, subsurface, clearcoat } = self;
        format!(
            "- name: disney
  config:
    color: [{r:?}, {g:?}, {b:?}]
    roughness: {roughness}
    metallic: {metallic}
    subsurface: {subsurface}
    specular: 0.5
    specularTint: 0
    anisotropic: 0
    sheen: 0
    sheenTint: 0
    clearcoat: {clearcoat}
    clearcoatGloss: 0.5
"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_short() {
        assert_eq!(Decimal(-0.000_001, 5).to_string(), "0");
        assert_eq!(Decimal(1.5, 5).to_string(), "1.5");
        assert_eq!(Decimal(-10.0, 0).to_string(), "-10");
        assert_eq!(Decimal(0.123_456_7, 5).to_string(), "0.12346");
    }

    #[test]
    fn both_forms_have_the_same_vertices_and_normals_in_the_same_order() {
        let made = make().unwrap();
        let lines = |wanted: &dyn Fn(&str) -> bool| -> Vec<String> {
            let files = made.iter().filter(|m| wanted(m.path) && m.path.ends_with(".obj"));
            let text: String = files.map(|m| String::from_utf8(m.bytes.clone()).unwrap()).collect();
            text.lines().filter(|l| l.starts_with('v')).map(str::to_owned).collect()
        };
        let whole = lines(&|path| path == "cornell.obj");
        assert!(whole.len() > 4000);
        assert_eq!(whole, lines(&|path| path.starts_with("aris/")));
    }

    #[test]
    fn every_brdf_group_has_an_entry_for_every_mesh() {
        for (_, _, [left, right], _) in variants() {
            assert_eq!(brdf_yaml(&left, &right).matches("- name:").count(), parts().unwrap().len());
        }
    }
}
