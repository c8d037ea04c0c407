//! Inside a closed mesh of albedo ρ that emits Le everywhere, radiance after n scatterings is Le(1 - ρⁿ⁺¹)/(1 - ρ).

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use pipeline::render::{Geometry, Prepared, Techniques, replay};
use pipeline::scene::{Camera, Mesh, Scene};

use crate::common::closed::{Placement, meshes};
use crate::common::{emitting, lambert, largest_error, mean, render_scene, scene, small, sphere};

const ALBEDO: f32 = 0.5;
const DEPTH: u32 = 4;

fn exact() -> f64 {
    let rho = f64::from(ALBEDO);
    (1.0 - libm::pow(rho, f64::from(DEPTH + 1))) / (1.0 - rho)
}

fn room(mesh: Mesh, eye: Vec3, to: Vec3) -> Scene {
    let camera = Camera::look_at(eye, eye + to, Vec3::Y, 1.5);
    scene(vec![(mesh, emitting(lambert(ALBEDO), 1.0))], camera)
}

/// The largest |estimate/exact - 1| of single paths that look for light by BSDF sampling alone: every vertex adds the throughput
/// with which it was reached, so that any path that leaves or is cut short is seen. Without roulette a path that stays inside has nothing
/// random in its throughput.
fn worst_path(room: Scene) -> f64 {
    let geometry = Arc::new(Geometry::build(&room).expect("a tree"));
    let prepared =
        Prepared::new(Arc::new(room), geometry, &small(16, 16, 16, DEPTH)).expect("a scene to render");
    let prepared = prepared.with(Techniques { roulette: false, ..Techniques::default() });
    let mut worst = 0.0f64;
    for (x, y) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
        for sample in 0..16 {
            for vertices in replay(&prepared, x, y, sample).branches {
                let found: f64 = vertices.iter().map(|v| f64::from(v.beta.r)).sum();
                worst = worst.max((found / exact() - 1.0).abs());
            }
        }
    }
    worst
}

/// Needles, zero areas, doubled faces and all: 2⁻²⁰ is a few roundings of a float.
#[test]
fn every_path_in_every_closed_mesh_finds_all_its_light_at_every_scale() {
    let placements = [(1e-5, 0.0), (1e-3, 0.0), (1.0, 0.0), (1e3, 0.0), (1e6, 0.0), (10.0, 1e6), (1e3, 1e6)];
    for closed in meshes() {
        for (scale, offset) in placements {
            if !closed.is_sound && offset > 0.0 {
                continue;
            }
            let at = Placement { scale, offset };
            let worst = worst_path(room(closed.placed(at), closed.inside(at), Vec3::new(0.3, 0.2, 1.0)));
            assert!(worst < 1e-6, "{}, scale {scale}, offset {offset}: {worst:e}", closed.name);
        }
    }
}

/// In a sphere BSDF sampling is perfect. So would be the choice of lights by their area alone; what noise is left in a pixel of 256
/// samples comes from the choice by distance and cosines.
const FINE: u32 = 128;
/// The largest |pixel/exact - 1|: 0.01 was measured.
const BOUND: f64 = 0.015;
/// The largest |mean of all pixels/exact - 1|: 0.0006 was measured.
const MEAN_BOUND: f64 = 0.001;

#[test]
fn every_pixel_of_a_furnace_is_right_at_every_scale() {
    for scale in [1e-5, 1e-3, 1.0, 1e3, 1e6] {
        let room = room(sphere(scale, Vec3::ZERO, FINE), Vec3::new(0.1, 0.2, 0.3) * scale, Vec3::X);
        let rendered = render_scene(&room, &small(12, 12, 256, DEPTH));
        let error = largest_error(&rendered, exact());
        assert!(error < BOUND, "scale {scale}: {error:e}");
        let error = (mean(&rendered) / exact() - 1.0).abs();
        assert!(error < MEAN_BOUND, "scale {scale}, the mean: {error:e}");
        assert_eq!(rendered.counts.bad_samples, 0);
    }
}

/// Every face twice, in the same place: one of them is seen, so one of them shines.
#[test]
fn coincident_faces_do_not_shine_twice() {
    let mut mesh = sphere(1.0, Vec3::ZERO, 24);
    mesh.triangles.extend_from_within(..);
    let rendered = render_scene(&room(mesh, Vec3::new(0.1, 0.2, 0.3), Vec3::X), &small(12, 12, 256, DEPTH));
    let error = largest_error(&rendered, exact());
    assert!(error < 0.02, "{error:e}");
    assert_eq!(rendered.counts.bad_samples, 0);
}

/// A mesh that is moved there by its instance keeps its shape whatever its size, since all is rendered around the scene's centre.
#[test]
fn every_pixel_of_a_furnace_is_right_a_thousand_kilometres_from_the_origin() {
    for scale in [1e-5, 1e-3, 1.0, 1e3, 1e6] {
        let center = Vec3::new(1e6, -1e6, 1e6);
        let mut room = room(sphere(scale, Vec3::ZERO, FINE), center, Vec3::X);
        room.instances[0].world_from_object = Affine3A::from_translation(center);
        let rendered = render_scene(&room, &small(12, 12, 256, DEPTH));
        let error = largest_error(&rendered, exact());
        assert!(error < BOUND, "scale {scale}: {error:e}");
        let error = (mean(&rendered) / exact() - 1.0).abs();
        assert!(error < MEAN_BOUND, "scale {scale}, the mean: {error:e}");
        assert_eq!(rendered.counts.bad_samples, 0);
    }
}

/// A mesh that is modelled there has corners on a grid of 1/16 m: facets are uneven, which light sampling pays for with noise. Below
/// a radius of some grid steps there is no sphere any more.
#[test]
fn every_pixel_of_a_furnace_modelled_far_away_is_right_as_far_as_floats_can_hold_it() {
    for (radius, bound) in [(1e1, 0.02), (1e2, BOUND), (1e3, BOUND), (1e6, BOUND)] {
        let center = Vec3::new(1e6, -1e6, 1e6);
        let room = room(sphere(radius, center, FINE), center, Vec3::X);
        let rendered = render_scene(&room, &small(12, 12, 256, DEPTH));
        let error = largest_error(&rendered, exact());
        assert!(error < bound, "radius {radius}: {error:e}");
        let error = (mean(&rendered) / exact() - 1.0).abs();
        assert!(error < MEAN_BOUND, "radius {radius}, the mean: {error:e}");
        assert_eq!(rendered.counts.bad_samples, 0);
    }
}

/// The camera stands exactly on the wall, at an edge's middle and in a corner of the room.
#[test]
fn a_camera_on_a_surface_sees_the_room_before_it() {
    let corners = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mesh = Mesh {
        name: "cube".into(),
        positions: (0..8).map(corners).collect(),
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    };
    for eye in [Vec3::new(-1.0, 0.1, 0.3), Vec3::new(-1.0, 0.0, 0.0), Vec3::new(-1.0, -1.0, 0.2), -Vec3::ONE]
    {
        // The whole view lies on the inner side of all faces.
        let to = Vec3::new(1.0, if eye.y < -0.5 { 1.0 } else { 0.1 }, if eye.z < -0.5 { 1.0 } else { 0.1 });
        let mut room = room(mesh.clone(), eye, to);
        room.cameras[0].item = Camera::look_at(eye, eye + to, Vec3::Y, 0.5);
        let worst = worst_path(room);
        assert!(worst < 1e-6, "{eye}: {worst:e}");
    }
}
