//! A view for scenes without a camera.

use glam::{DVec3, Vec3};

use super::{Camera, Scene};

/// The vertical angle of view, in radians: 35°, like a short telephoto lens.
const FOV_Y: f32 = 35.0 * (std::f32::consts::PI / 180.0);
/// From the scene to the camera: from the front, somewhat from the right and above.
const TO_CAMERA: Vec3 = Vec3::new(0.5, 0.35, 1.0);
/// Room around the scene.
const MARGIN: f64 = 1.08;
/// The distance to a scene without extent, in metres.
const DISTANCE_TO_A_POINT: f64 = 1.0;

/// A three-quarter view in which all vertices just fit, in pictures that are at least as wide as high. A scene
/// without vertices, or with some at infinity, is looked at as if it were a point at the origin.
pub fn frame<M>(scene: &Scene<M>) -> Camera {
    let bounds = scene.bounds().filter(|(low, high)| low.is_finite() && high.is_finite());
    let (low, high) = bounds.unwrap_or((Vec3::ZERO, Vec3::ZERO));
    // In f64, so that the box of a scene as large as f32 allows does not overflow.
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let centre = (low + high) / 2.0;
    let mut camera = Camera::look_at(TO_CAMERA, Vec3::ZERO, Vec3::Y, FOV_Y);
    let axes = camera.world_from_camera.matrix3;
    let [right, up, back] = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| Vec3::from(axis).as_dvec3());
    let tan_half = libm::tan(f64::from(FOV_Y) / 2.0);
    // A vertex at (x, y, z) in camera axes is seen from distance d if max(|x|, |y|) ≤ (d - z)·tan(fov/2).
    let vertices = scene.instances.iter().filter(|_| bounds.is_some()).flat_map(|instance| {
        let positions = &scene.mesh_of(instance).positions;
        positions.iter().map(|&p| instance.world_from_object.transform_point3(p).as_dvec3())
    });
    let needed = vertices.map(|vertex| {
        let offset = vertex - centre;
        offset.dot(back) + offset.dot(right).abs().max(offset.dot(up).abs()) / tan_half
    });
    let fitting = MARGIN * needed.fold(0.0, f64::max);
    // Nearer than that, and f32 could not tell the camera from what it looks at.
    let least = centre.length() * 1e-3;
    let distance = if fitting > 0.0 { fitting.max(least) } else { DISTANCE_TO_A_POINT.max(least) };
    let limit = f64::from(f32::MAX) / 4.0;
    let position = (centre + back * distance).clamp(DVec3::splat(-limit), DVec3::splat(limit));
    camera.world_from_camera.translation = position.as_vec3().into();
    camera
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Affine3A;

    use super::*;
    use crate::scene::{Instance, MaterialId, Mesh, MeshId};

    fn scene(positions: Vec<Vec3>) -> Scene<()> {
        let mut scene = Scene::empty();
        scene.meshes.push(Arc::new(Mesh { positions, ..Mesh::default() }));
        scene.instances.push(Instance {
            name: String::new(),
            mesh: MeshId(0),
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        });
        scene
    }

    /// The largest |x/z| or |y/z| of a corner over tan(fov/2): up to 1 it is inside a square picture.
    fn largest_extent(low: Vec3, high: Vec3) -> f32 {
        let corner = |corner: u32| {
            let pick = |bit: u32, a: f32, b: f32| if corner >> bit & 1 == 1 { a } else { b };
            Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
        };
        let camera = frame(&scene((0..8).map(corner).collect()));
        assert!(camera.world_from_camera.is_finite());
        let camera_from_world = camera.world_from_camera.inverse();
        let extent = |i: u32| {
            let p = corner(i);
            let p = camera_from_world.transform_point3(p);
            assert!(p.z < 0.0, "behind the camera: {p}");
            p.x.abs().max(p.y.abs()) / -p.z / libm::tanf(FOV_Y / 2.0)
        };
        (0..8).map(extent).fold(0.0, f32::max)
    }

    #[test]
    fn every_corner_is_inside_and_the_scene_fills_the_view() {
        for (low, high) in [
            (Vec3::splat(-1.0), Vec3::splat(1.0)),
            (Vec3::new(4.0, 0.0, -9.0), Vec3::new(5.0, 1.8, -8.0)),
            (Vec3::new(-1e-6, 0.0, -1e-6), Vec3::splat(1e-6)),
            (Vec3::splat(-1e9), Vec3::splat(1e9)),
            (Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 0.0, 5.0)),
            (Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 20.0, 1.0)),
            (Vec3::new(-30.0, 0.0, 0.0), Vec3::new(30.0, 0.1, 0.0)),
        ] {
            let extent = largest_extent(low, high);
            assert!((0.7..1.0).contains(&extent), "{low} {high}: {extent}");
        }
    }

    #[test]
    fn scenes_without_extent_or_place_have_a_camera() {
        let point = frame(&scene(vec![Vec3::new(3.0, 4.0, 5.0)]));
        let eye = Vec3::from(point.world_from_camera.translation);
        assert!((eye.distance(Vec3::new(3.0, 4.0, 5.0)) - 1.0).abs() < 1e-5);
        let nothing = frame(&Scene::<()>::empty());
        assert!(nothing.world_from_camera.is_finite());
        let huge = frame(&scene(vec![Vec3::splat(f32::MIN), Vec3::splat(f32::MAX)]));
        assert!(huge.world_from_camera.is_finite());
    }

    #[test]
    fn floors_are_seen_from_above() {
        let camera = frame(&scene(vec![Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, 1.0)]));
        assert!(camera.world_from_camera.translation.y > 0.5);
        assert!(camera.world_from_camera.matrix3.determinant() > 0.99);
    }
}
