//! What stands in the scene: a node for each instance, camera and light, in that order.

use glam::{Affine3A, Mat3A, Vec3};
use serde_json::{Value, json};

use super::buffer::Buffer;
use super::geometry::Meshes;
use super::json::{number, numbers};
use super::material::power_of_two_above;
use crate::convert::{Note, Quality};
use crate::export::ExportError;
use crate::scene::camera::{FovAxis, Projection};
use crate::scene::light::LightKind;
use crate::scene::{Camera, Light, Material, Named, Scene};

/// The nodes of a file and what they name.
pub(super) struct Nodes {
    pub(super) nodes: Vec<Value>,
    pub(super) cameras: Vec<Value>,
    pub(super) lights: Vec<Value>,
}

/// Everything that stands in `scene`; meshes go into `meshes` and `buffer`, and what can't be said into `notes`.
///
/// # Errors
/// If the buffer is full.
pub(super) fn place(
    scene: &Scene<Material>,
    meshes: &mut Meshes<'_>,
    buffer: &mut Buffer,
    notes: &mut Vec<Note>,
) -> Result<Nodes, ExportError> {
    let mut out = Nodes { nodes: Vec::new(), cameras: Vec::new(), lights: Vec::new() };
    let mut note = |field: String, quality: Quality, reason: &str| {
        notes.push(Note { material: String::new(), field, quality, reason: reason.to_owned() });
    };
    let mut sheared = 0;
    for instance in &scene.instances {
        let node = if is_trs(&instance.world_from_object) {
            let mesh = meshes.of(instance, buffer)?;
            node(&instance.name, &instance.world_from_object, "mesh", mesh)
        } else {
            sheared += 1;
            let mesh = meshes.placed(instance, buffer)?;
            node(&instance.name, &Affine3A::IDENTITY, "mesh", mesh)
        };
        out.nodes.push(node);
    }
    if sheared > 0 {
        let reason = format!(
            "{sheared} of {} are sheared, which no node of glTF is: their vertices are written in the world",
            scene.instances.len()
        );
        note("instances".into(), Quality::Exact, &reason);
    }
    for Named { name, item } in &scene.cameras {
        let mut tell =
            |field: &str, quality, reason: &str| note(format!("camera {name}: {field}"), quality, reason);
        out.nodes.push(node(name, &standing(item, &mut tell), "camera", out.cameras.len()));
        out.cameras.push(camera(name, item, scene, &mut tell));
    }
    for Named { name, item } in &scene.lights {
        let mut standing = node(name, &at_light(item), "", 0);
        standing["extensions"] = json!({"KHR_lights_punctual": {"light": out.lights.len()}});
        out.nodes.push(standing);
        out.lights.push(light(name, item));
    }
    if scene.environment.is_some() {
        let reason = "core glTF has no light from infinitely far away";
        note("environment".into(), Quality::Dropped, reason);
    }
    Ok(out)
}

/// A node that shows `kind[index]`, or nothing yet if `kind` is empty.
fn node(name: &str, world: &Affine3A, kind: &str, index: usize) -> Value {
    let mut node = json!({"name": name});
    if !kind.is_empty() {
        node[kind] = index.into();
    }
    let [x, y, z, t] = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis, world.translation];
    if world.matrix3 != Mat3A::IDENTITY {
        let columns = [x.extend(0.0), y.extend(0.0), z.extend(0.0), t.extend(1.0)];
        node["matrix"] = numbers(&columns.map(|c| c.to_array()).concat());
    } else if t != glam::Vec3A::ZERO {
        node["translation"] = numbers(&t.to_array());
    }
    node
}

/// Whether a transform is a scale, a rotation and a translation one after the other, as a node's matrix must be: whether its axes are
/// orthogonal, up to what rounding does to lengths as they are.
fn is_trs(m: &Affine3A) -> bool {
    let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis].map(|v| Vec3::from(v).as_dvec3());
    let longest = x.length().max(y.length()).max(z.length());
    // The Khronos validator puts the matrix together again and allows an element to be off by this.
    let allowed = (2.5e-5 / longest).min(1e-5);
    [(x, y), (y, z), (z, x)].iter().all(|(a, b)| a.dot(*b).abs() <= allowed * a.length() * b.length())
}

/// Where a camera stands, without what no camera of glTF has.
fn standing(camera: &Camera, tell: &mut impl FnMut(&str, Quality, &str)) -> Affine3A {
    let m = camera.world_from_camera;
    let product = m.matrix3.transpose() * m.matrix3;
    if m.matrix3.determinant() < 0.0 {
        let reason = "the node mirrors, and so does the picture; readers that take its rotation alone show it the other way round";
        tell("mirrored", Quality::Carried, reason);
    }
    if product.abs_diff_eq(Mat3A::IDENTITY, 1e-5) {
        return m;
    }
    tell("c2w", Quality::Approximated, "glTF's cameras neither scale nor shear");
    let back = m.matrix3.z_axis.normalize_or(glam::Vec3A::Z);
    let up = (m.matrix3.y_axis - back * back.dot(m.matrix3.y_axis))
        .try_normalize()
        .unwrap_or_else(|| Vec3::from(back).any_orthonormal_vector().into());
    let right = up.cross(back) * if m.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
    Affine3A { matrix3: Mat3A::from_cols(right, up, back), translation: m.translation }
}

fn camera(
    name: &str,
    camera: &Camera,
    scene: &Scene<Material>,
    tell: &mut impl FnMut(&str, Quality, &str),
) -> Value {
    if camera.lens.is_some() {
        tell("lens", Quality::Dropped, "glTF's cameras are pinholes");
    }
    if camera.pixel_offset != glam::Vec2::ZERO {
        let reason = format!("glTF has no offset: the picture moves by {} pixels", camera.pixel_offset);
        tell("pixel_offset", Quality::Approximated, &reason);
    }
    let sized = camera.size.map(|(width, height)| width as f32 / height as f32);
    if sized.is_some() {
        tell("size", Quality::Carried, "its aspect; glTF counts no pixels");
    }
    let aspect = sized.or(camera.aspect);
    let reach = reach(camera, scene);
    match camera.projection {
        Projection::Perspective { fov, axis } => {
            let vertical = match axis {
                FovAxis::Y => fov,
                FovAxis::X => {
                    let half = 0.5 * f64::from(fov);
                    let tan = libm::tan(half) / f64::from(aspect.unwrap_or(4.0 / 3.0));
                    tell("fov", Quality::Exact, "measured across the height");
                    (2.0 * libm::atan(tan)) as f32
                }
            };
            let mut perspective = json!({"yfov": number(vertical), "znear": number(reach * 1e-4)});
            if let Some(aspect) = aspect {
                perspective["aspectRatio"] = number(aspect);
            }
            json!({"name": name, "type": "perspective", "perspective": perspective})
        }
        Projection::Orthographic { half_height } => {
            let half_width = half_height * aspect.unwrap_or(4.0 / 3.0);
            let orthographic = json!({
                "xmag": number(half_width), "ymag": number(half_height), "znear": 0.0, "zfar": number(reach * 2.0),
            });
            json!({"name": name, "type": "orthographic", "orthographic": orthographic})
        }
    }
}

/// The distance to the farthest corner of the scene's box, for those who clip: a normal number.
fn reach(camera: &Camera, scene: &Scene<Material>) -> f32 {
    let from = Vec3::from(camera.world_from_camera.translation);
    let (low, high) = scene.bounds().unwrap_or((from, from));
    let farthest = (low - from).abs().max((high - from).abs()).length();
    if farthest.is_finite() { farthest.clamp(1e-20, 1e30) } else { 1e30 }
}

/// Where a light stands and where it points: along -z.
fn at_light(light: &Light) -> Affine3A {
    let (position, direction) = match light.kind {
        LightKind::Point { position, .. } => (position, None),
        LightKind::Spot { position, direction, .. } => (position, Some(direction)),
        LightKind::Directional { direction } => (Vec3::ZERO, Some(direction)),
    };
    let back = direction.filter(|&d| d != Vec3::NEG_Z).map(|d| -d);
    let matrix3 = back.map_or(Mat3A::IDENTITY, |back| {
        let right = back.any_orthonormal_vector();
        Mat3A::from_cols(right.into(), back.cross(right).into(), back.into())
    });
    Affine3A { matrix3, translation: position.into() }
}

/// KHR_lights_punctual, whose colours end at 1: a power of two goes into the intensity, which rounds nothing.
fn light(name: &str, light: &Light) -> Value {
    let scale = power_of_two_above(light.color.max_channel());
    let color = light.color * scale.recip();
    let (kind, range) = match light.kind {
        LightKind::Point { range, .. } => ("point", range),
        LightKind::Spot { range, .. } => ("spot", range),
        LightKind::Directional { .. } => ("directional", None),
    };
    let mut json = json!({
        "name": name, "type": kind, "color": numbers(&color.to_array()), "intensity": number(light.intensity * scale),
    });
    if let Some(range) = range {
        json["range"] = number(range);
    }
    if let LightKind::Spot { inner, outer, .. } = light.kind {
        // The float next to π/2 is above it.
        let outer_json = number(outer).as_f64().map(|angle| angle.min(std::f64::consts::FRAC_PI_2));
        let inner = inner.clamp(0.0, outer.next_down().max(0.0));
        json["spot"] = json!({"innerConeAngle": number(inner), "outerConeAngle": outer_json});
    }
    json
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn sheared_axes_are_no_trs() {
        let turn = Affine3A::from_quat(Quat::from_rotation_x(0.7));
        let scale = |s: Vec3| Affine3A::from_scale(s);
        assert!(is_trs(&(turn * scale(Vec3::new(1.0, -3.0, 0.01)))));
        assert!(is_trs(&(turn * scale(Vec3::splat(1000.0)))) && is_trs(&(turn * scale(Vec3::splat(1e-12)))));
        assert!(!is_trs(&(scale(Vec3::new(1.0, 2.0, 1.0)) * turn)));
    }

    #[test]
    fn colours_of_lights_end_at_one_and_nothing_is_rounded() {
        let kind = LightKind::Spot {
            position: Vec3::ZERO,
            direction: Vec3::X,
            inner: 0.5,
            outer: std::f32::consts::FRAC_PI_2,
            range: Some(3.0),
        };
        let spot = Light { kind, color: crate::color::Rgb::new(5.0, 2.0, 0.3), intensity: 7.0 };
        let json = light("lamp", &spot);
        assert_eq!(json["color"].to_string(), "[0.625,0.25,0.0375]");
        assert_eq!((json["intensity"].as_f64(), json["range"].as_f64()), (Some(56.0), Some(3.0)));
        assert!(json["spot"]["outerConeAngle"].as_f64().unwrap() <= std::f64::consts::FRAC_PI_2);
        let at = at_light(&spot);
        assert_eq!(-at.matrix3.z_axis, glam::Vec3A::X);
        assert_eq!(at.matrix3.determinant(), 1.0);
    }

    #[test]
    fn cameras_lose_scale_and_keep_mirroring() {
        let mut camera = Camera::look_at(Vec3::ONE, Vec3::ZERO, Vec3::Y, 0.5);
        camera.world_from_camera.matrix3 *= Mat3A::from_diagonal(Vec3::new(-2.0, 2.0, 2.0));
        let mut told = Vec::new();
        let m = standing(&camera, &mut |field, quality, _| told.push((field.to_owned(), quality)));
        assert!((m.matrix3.determinant() + 1.0).abs() < 1e-6);
        assert_eq!(
            told,
            [("mirrored".to_owned(), Quality::Carried), ("c2w".to_owned(), Quality::Approximated)]
        );
    }
}
