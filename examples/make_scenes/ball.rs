//! The shader ball: a shell with a port, a sphere on a stem inside, a turned base, a calibrated floor and three softboxes.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DMat3, DQuat, DVec2, DVec3};
use pipeline::math::Real;
use serde_json::json;

use super::glb::{Glb, Wrap};
use super::mesh::{Boundary, Mesh};
use super::revolve::Profile;
use super::shell;
use super::studio::{Softbox, Sweep};
use super::{Made, MakeError};

/// Where the port looks.
const PORT_AXIS: DVec3 = DVec3::new(-0.36, 0.42, 0.83);
/// Radius of the inner sphere.
const INNER: f64 = 0.6;

/// `shaderball.glb`.
pub(crate) fn make() -> Result<Vec<Made>, MakeError> {
    let base = base_profile();
    // The ball sits on the base's rim with a hair's breadth of air.
    let center = base.greatest(|p| if p.x < 1.0 { p.y + (1.0 - p.x * p.x).sqrt() } else { 0.0 }) + 0.002;
    let up = DVec3::Y * center;

    let mut glb = Glb::default();
    let ball = glb.plain("ball", [0.7, 0.7, 0.7], 0.35);
    let inner = glb.plain("inner", [0.35, 0.35, 0.35], 0.3);
    let base_material = glb.plain("base", [0.18, 0.18, 0.18], 0.45);
    let texture = glb.texture("calibrated_floor", [FLOOR_TEXELS, FLOOR_TEXELS], floor_texel, Wrap::Clamp)?;
    let floor = glb.material(json!({
        "name": "floor",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": texture }, "metallicFactor": 0.0, "roughnessFactor": 0.9 },
    }));

    let axis = PORT_AXIS.normalize();
    let right = DVec3::Y.cross(axis).normalize();
    let orientation = DQuat::from_mat3(&DMat3::from_cols(right, axis.cross(right), axis));
    let shell = shell::mesh(orientation).checked("ball", Boundary::Closed)?.moved(up);
    glb.mesh("ball", &shell, ball);
    glb.mesh("inner", &inner_sphere().checked("inner", Boundary::Closed)?.moved(up), inner);
    glb.mesh("base", &base.revolve(128).checked("base", Boundary::Closed)?, base_material);
    let sweep = Sweep { half_width: 9.0, front: 9.0, back: -3.5, radius: 2.5, height: 7.0, tile: FLOOR_SIDE };
    glb.mesh("floor", &sweep.mesh().checked("floor", Boundary::Open)?, floor);

    let target = DVec3::new(0.0, 1.0, 0.0);
    let lights = [
        Softbox {
            name: "key_light",
            position: DVec3::new(-3.6, 5.2, 3.4),
            target,
            size: [2.4, 2.4],
            color: [1.0, 0.97, 0.92],
            radiance: 22.0,
        },
        Softbox {
            name: "fill_light",
            position: DVec3::new(5.2, 3.0, 3.2),
            target,
            size: [2.0, 3.2],
            color: [0.9, 0.95, 1.0],
            radiance: 6.0,
        },
        Softbox {
            name: "rim_light",
            position: DVec3::new(2.6, 5.4, -3.0),
            target,
            size: [3.0, 1.2],
            color: [1.0, 1.0, 1.0],
            radiance: 20.0,
        },
    ];
    for light in &lights {
        light.add(&mut glb);
    }
    glb.camera(DVec3::new(1.05, 2.3, 5.25), DVec3::new(0.0, 1.03, 0.0), 30.0, 4.0 / 3.0);
    let about = format!("{} triangles, {} of them the ball's", glb.triangles(), shell.triangles.len());
    Ok(vec![Made { path: "shaderball.glb", bytes: glb.finish("shaderball")?, about }])
}

/// The inner sphere with a stem that flows out of it and stands in the shell.
fn inner_sphere() -> Mesh {
    let (stem, flow) = (0.11, 0.12);
    // The flow's arc touches the sphere and the stem from outside.
    let middle =
        DVec2::new(stem + flow, -((INNER + flow) * (INNER + flow) - (stem + flow) * (stem + flow)).sqrt());
    let touch = Real::atan2(middle.y, middle.x);
    let foot = -(shell::INSIDE * shell::INSIDE - 0.24 * 0.24f64).sqrt() + 0.004;
    let mut profile = Profile::corners(
        &[
            [0.0, foot, 0.0],
            [0.235, foot, 0.012],
            [0.235, foot + 0.035, 0.012],
            [stem, foot + 0.035, 0.03],
            [stem, middle.y, 0.0],
        ],
        0.05,
    );
    // Upwards along the stem, right around the flow, then left around the sphere to the top.
    profile.turn(middle, flow, FRAC_PI_2, touch, 10);
    profile.turn(DVec2::ZERO, INNER, touch + FRAC_PI_2, FRAC_PI_2 - touch, 48);
    profile.revolve(96)
}

/// The base: a foot with bevels, a waist, a rim, and a dish that follows the ball.
fn base_profile() -> Profile {
    let (rim, height, dish) = (0.66, 0.34, 1.035);
    let bottom = height + 0.8 - dish;
    let lip_y = |x: f64| height + 0.8 - (dish * dish - x * x).sqrt();
    let inner_lip = 0.565;
    let outside = Profile::corners(
        &[
            [0.0, 0.002, 0.0],
            [0.96, 0.002, 0.015],
            [0.96, 0.085, 0.028],
            [0.875, 0.085, 0.012],
            [0.875, 0.12, 0.02],
            [rim + 0.06, 0.16, 0.06],
            [rim + 0.02, height, 0.03],
            [inner_lip + 0.01, height, 0.02],
            [inner_lip, lip_y(inner_lip), 0.02],
            [inner_lip - 0.05, lip_y(inner_lip - 0.05), 0.0],
        ],
        0.06,
    );
    let x = inner_lip - 0.05;
    let begin = Real::atan2(x, (dish * dish - x * x).sqrt());
    let mut bowl = Profile::default();
    // Walked from the lip down to the axis: the normal points up, so the arc turns right.
    bowl.turn(DVec2::new(0.0, bottom + dish), dish, PI + begin, -begin, 14);
    outside.then(bowl)
}

/// Side of the floor's texture in metres and in texels.
const FLOOR_SIDE: f64 = 12.0;
const FLOOR_TEXELS: u32 = 1152;
/// Side of a field of the chessboard in texels: half a metre.
const FIELD: u32 = FLOOR_TEXELS / 24;
/// sRGB codes of the fields: linear 0.2016 and 0.5029; the paper beyond has 124 + 188 over 2 in linear: 0.3515.
const DARK: u8 = 124;
const BRIGHT: u8 = 188;
const PAPER: u8 = 160;
/// sRGB codes of the patches beside the ball: six greys of linear 0.0203, 0.0497, 0.1022, 0.2016, 0.4020, 0.7991 and six colours.
const PATCHES: [[u8; 3]; 12] = [
    [39, 39, 39],
    [63, 63, 63],
    [90, 90, 90],
    [124, 124, 124],
    [170, 170, 170],
    [231, 231, 231],
    [175, 54, 60],
    [70, 148, 73],
    [56, 61, 150],
    [231, 199, 31],
    [187, 86, 149],
    [8, 133, 161],
];

/// The floor seen from above, the camera's side down: a chessboard that fades into plain paper, and twelve patches.
fn floor_texel(x: u32, y: u32) -> [u8; 3] {
    let half = FLOOR_TEXELS / 2;
    // Greys on the left and colours on the right, each in the middle of a field.
    let (column, row) = ((x / FIELD) as i32 - 12, (y / FIELD) as i32 - 12);
    let inside = |t: u32| (FIELD / 4..FIELD * 3 / 4).contains(&(t % FIELD));
    if inside(x) && inside(y) && (-1..2).contains(&row) {
        let row = row + 1;
        match column {
            -4 | -3 => return PATCHES[(row * 2 + column + 4) as usize],
            2 | 3 => return PATCHES[(6 + row * 2 + column - 2) as usize],
            _ => {}
        }
    }
    let field = if (x / FIELD + y / FIELD).is_multiple_of(2) { DARK } else { BRIGHT };
    let from_middle = |t: u32| (f64::from(t) + 0.5) / f64::from(half) - 1.0;
    let distance = DVec2::new(from_middle(x), from_middle(y)).length() * FLOOR_SIDE / 2.0;
    let fade = ((distance - 3.0) / 2.6).clamp(0.0, 1.0);
    let fade = fade * fade * (3.0 - 2.0 * fade);
    let code = f64::from(field) + (f64::from(PAPER) - f64::from(field)) * fade;
    [code.round() as u8; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_grey_is_the_mean_of_the_fields() {
        let linear = |code: u8| {
            let c = f64::from(code) / 255.0;
            Real::powf((c + 0.055) / 1.055, 2.4)
        };
        assert!((linear(DARK) - 0.2016).abs() < 5e-5);
        assert!((linear(BRIGHT) - 0.5029).abs() < 5e-5);
        assert!((linear(PAPER) - (linear(DARK) + linear(BRIGHT)) / 2.0).abs() < 0.005);
    }

    #[test]
    fn the_base_leaves_room_for_the_ball() {
        let base = base_profile();
        let center = base.greatest(|p| if p.x < 1.0 { p.y + (1.0 - p.x * p.x).sqrt() } else { 0.0 });
        assert!((1.0..1.3).contains(&center), "{center}");
    }
}
