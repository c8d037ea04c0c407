//! A tiny scene for tests: five spheres on a floor, each with another feature of glTF materials.

use glam::{DVec2, DVec3};
use serde_json::json;

use super::glb::{Glb, Wrap};
use super::mesh::{Boundary, Mesh, rectangle};
use super::revolve::Profile;
use super::studio::Softbox;
use super::{Made, MakeError};

const RADIUS: f64 = 0.4;

/// `spheres.glb`.
pub(crate) fn make() -> Result<Vec<Made>, MakeError> {
    let mut glb = Glb::default();
    let floor = glb.plain("floor", [0.5, 0.5, 0.5], 1.0);
    glb.mesh("floor", &rectangle(DVec3::new(-4.0, 0.0, 3.0), DVec3::X * 8.0, -DVec3::Z * 6.0), floor);

    // A red and yellow chessboard, and a disk that is cut out of white.
    let chess = |x: u32, y: u32| if (x + y).is_multiple_of(2) { [200, 30, 30] } else { [230, 200, 60] };
    let dots = |x: u32, y: u32| {
        let (dx, dy) = (2 * (x % 4) as i32 - 3, 2 * (y % 4) as i32 - 3);
        [240, 240, 240, if dx * dx + dy * dy <= 2 { 0 } else { 255 }]
    };
    let chess = glb.texture("chess", [8, 8], chess, Wrap::Repeat)?;
    let dots = glb.texture("dots", [8, 8], dots, Wrap::Repeat)?;
    let textured = glb.material(json!({
        "name": "textured",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": chess }, "metallicFactor": 0.0, "roughnessFactor": 0.6 },
    }));
    let masked = glb.material(json!({
        "name": "masked",
        "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorTexture": { "index": dots }, "metallicFactor": 0.0, "roughnessFactor": 0.8 },
    }));
    let vertex_colored = glb.plain("vertex_colored", [1.0, 1.0, 1.0], 0.5);
    let metallic = glb.material(json!({
        "name": "metallic",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.955, 0.637, 0.538, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.25,
        },
    }));
    let emissive = glb.emissive("emissive", [0.3, 0.6, 1.0], 2.0);
    let spheres = [
        ("textured", textured),
        ("masked", masked),
        ("vertex_colored", vertex_colored),
        ("metallic", metallic),
        ("emissive", emissive),
    ];
    for (i, (name, material)) in spheres.into_iter().enumerate() {
        let mut mesh = sphere().checked(name, Boundary::Closed)?.moved(DVec3::X * (i as f64 - 2.0));
        if name == "vertex_colored" {
            mesh.colors = mesh.normals.iter().map(|n| ((*n + DVec3::ONE) / 2.0).to_array()).collect();
        }
        glb.mesh(name, &mesh, material);
    }

    let area = Softbox {
        name: "area_light",
        position: DVec3::new(-1.0, 3.5, 2.0),
        target: DVec3::new(0.0, 0.3, 0.0),
        size: [1.5, 1.0],
        color: [1.0, 1.0, 1.0],
        radiance: 10.0,
    };
    area.add(&mut glb);
    glb.point_light("point_light", DVec3::new(2.5, 2.0, 1.5), [1.0, 0.8, 0.6], 3.0);
    glb.camera(DVec3::new(0.0, 1.6, 7.0), DVec3::new(0.0, 0.4, 0.0), 30.0, 4.0 / 3.0);
    let about = format!("{} triangles", glb.triangles());
    Ok(vec![Made { path: "spheres.glb", bytes: glb.finish("spheres")?, about }])
}

/// A low-resolution sphere that stands on the floor.
fn sphere() -> Mesh {
    let mut profile = Profile::default();
    profile.turn(DVec2::new(0.0, RADIUS), RADIUS, 0.0, std::f64::consts::PI, 6);
    profile.revolve(12)
}
