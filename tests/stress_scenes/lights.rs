//! Lights where they should not be: in the plane of a wall, at its edge, inside glass, and a sun of one pixel.

use std::sync::Arc;

use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::disney::Model;
use pipeline::light::{EnvironmentLight, EnvironmentTables, Partner};
use pipeline::scene::environment::{Environment, EnvironmentMap, Equirectangular};
use pipeline::scene::material::Sides;
use pipeline::scene::texture::Pixels;
use pipeline::scene::{Camera, Image, ImageId, Material, Mesh};

use crate::common::{emitting, lambert, largest_error, mean, render_scene, scene, small, sphere, square};

/// A wall of 2 × 1 m that stands on the floor, facing +z.
fn wall() -> Mesh {
    let v = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    Mesh {
        name: "wall".into(),
        positions: vec![v(-1.0, 0.0), v(1.0, 0.0), v(1.0, 1.0), v(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The configuration factor of a point on the floor, `c` before the middle of a wall of half width `b` and height `a`.
fn form_factor(a: f64, b: f64, c: f64) -> f64 {
    let d = (a * a + c * c).sqrt();
    (libm::atan(b / c) - c / d * libm::atan(b / d)) / std::f64::consts::PI
}

fn looking_at_floor(z: f32) -> Camera {
    Camera::look_at(Vec3::new(0.0, 0.5, z + 0.3), Vec3::new(0.0, 0.0, z), Vec3::Y, 1e-4)
}

#[test]
fn a_light_that_stands_on_the_floor_lights_it_up_to_the_edge() {
    let mut lamp = emitting(lambert(0.0), 3.0);
    lamp.emission.sides = Sides::Front;
    for z in [0.5, 0.05, 0.005] {
        let world =
            scene(vec![(square(1.0, 0.0), lambert(0.5)), (wall(), lamp.clone())], looking_at_floor(z));
        let rendered = render_scene(&world, &small(8, 8, 256, 1));
        let exact = 0.5 * 3.0 * form_factor(1.0, 1.0, f64::from(z));
        assert!((mean(&rendered) / exact - 1.0).abs() < 0.01, "z {z}: {} {exact}", mean(&rendered));
        assert_eq!(rendered.counts.bad_samples, 0);
    }
    // The edge itself, seen from near by.
    let edge = Camera::look_at(Vec3::new(0.0, 0.01, 0.01), Vec3::ZERO, Vec3::Y, 1.0);
    let rendered = render_scene(
        &scene(vec![(square(1.0, 0.0), lambert(0.5)), (wall(), lamp)], edge),
        &small(32, 32, 16, 4),
    );
    assert_eq!(rendered.counts.bad_samples, 0);
}

/// In the plane of the floor, beside it with a common edge: no light arrives, and nothing is divided by that 0.
#[test]
fn a_light_in_the_plane_of_a_surface_gives_it_nothing() {
    let mut beside = square(1.0, 0.0);
    beside.positions.iter_mut().for_each(|p| p.x += 2.0);
    let parts = vec![(square(1.0, 0.0), lambert(0.5)), (beside, emitting(lambert(0.0), 3.0))];
    let camera = Camera::look_at(Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.5, 0.0, 0.0), Vec3::Z, 0.4);
    let rendered = render_scene(&scene(parts, camera), &small(16, 16, 64, 4));
    assert_eq!(mean(&rendered), 0.0);
    assert_eq!(rendered.counts.bad_samples, 0);
}

/// A small white tile in the plane of a floor a thousand times its size: neither shades the other, whichever is hit.
#[test]
fn surfaces_in_one_plane_do_not_shade_each_other() {
    let turned = |mut mesh: Mesh, turn: glam::Quat| {
        mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
        mesh
    };
    for turn in [glam::Quat::IDENTITY, glam::Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 0.7)] {
        let parts = vec![
            (turned(square(1000.0, 0.0), turn), lambert(0.5)),
            (turned(square(0.5, 0.0), turn), lambert(0.5)),
        ];
        let camera = Camera::look_at(turn * Vec3::new(0.1, 1.0, 0.1), Vec3::ZERO, Vec3::Z, 0.5);
        let mut world = scene(parts, camera);
        world.environment = Some(Environment::constant(Rgb::WHITE));
        let rendered = render_scene(&world, &small(16, 16, 256, 4));
        let error = largest_error(&rendered, 0.5);
        assert!(error < 0.02, "{turn}: {error}");
    }
}

/// In equilibrium radiance is n² times as high in glass as outside: a black body in it that emits so much can't be told from an
/// even environment.
#[test]
fn a_light_inside_glass_in_equilibrium_with_the_environment_disappears() {
    let glass = Material { model: Model::Dielectric, ..Material::default() };
    let camera = || Camera::look_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 0.8);
    // Floating in it, and touching it in its poles and along its lines.
    for radius in [0.3, 0.9, 1.0] {
        let parts = vec![
            (sphere(1.0, Vec3::ZERO, 24), glass.clone()),
            (sphere(radius, Vec3::ZERO, 12), emitting(lambert(0.0), 1.5 * 1.5)),
        ];
        let mut world = scene(parts, camera());
        world.environment = Some(Environment::constant(Rgb::WHITE));
        let rendered = render_scene(&world, &small(24, 24, 256, 400));
        assert!((mean(&rendered) - 1.0).abs() < 0.003, "radius {radius}: {}", mean(&rendered));
        assert_eq!(rendered.counts.bad_samples, 0);
    }
}

/// A sky of 1 with one pixel of a million: the light that falls on a plane is its integral.
#[test]
fn a_sun_of_one_pixel_is_neither_lost_nor_doubled() {
    let (width, height) = (64u32, 32u32);
    let mut values = vec![1.0f32; (width * height) as usize];
    values[(6 * width + 21) as usize] = 1e6;
    let image = Image { name: "sky".into(), width, height, channels: 1, pixels: Pixels::F32(values) };
    let map = EnvironmentMap::Image { image: ImageId(0), mapping: Equirectangular::YUp };
    let sky = Environment { map, color: Rgb::WHITE, intensity: 1.0, rotation: 0.3 };
    let light = EnvironmentLight::new(
        &sky,
        Some(&Arc::new(image.clone())),
        Partner::None,
        &EnvironmentTables::default(),
    );
    let irradiance = integral(&light);

    let floor = square(5.0, 0.0);
    let camera = Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.5);
    for material in [lambert(0.5), Material::default()] {
        let is_lambert = material.model == Model::Diffuse;
        let mut world = scene(vec![(floor.clone(), material)], camera.clone());
        world.images.push(Arc::new(image.clone()));
        world.environment = Some(sky.clone());
        let rendered = render_scene(&world, &small(16, 16, 256, 2));
        assert_eq!(rendered.counts.bad_samples, 0);
        if is_lambert {
            let data = rendered.raster.layer("data").expect("data");
            let variance = &data.channel("variance.R").expect("variance").values;
            let n = variance.len() as f64;
            let sigma = variance.iter().map(|&v| f64::from(v)).sum::<f64>().sqrt() / n;
            let exact = 0.5 / std::f64::consts::PI * irradiance;
            let error = mean(&rendered) - exact;
            assert!(error.abs() < 4.0 * sigma, "{} {exact} ± {sigma}", mean(&rendered));
            assert!(sigma < 0.01 * exact, "{sigma}");
        }
    }
}

/// ∫ L cos over the upper hemisphere, by the midpoint rule.
fn integral(sky: &EnvironmentLight) -> f64 {
    let (columns, rows) = (4096, 1024);
    let mut sum = 0.0;
    for row in 0..rows {
        let theta = std::f64::consts::FRAC_PI_2 * (f64::from(row) + 0.5) / f64::from(rows);
        let (sin, cos) = (libm::sin(theta), libm::cos(theta));
        for column in 0..columns {
            let phi = std::f64::consts::TAU * (f64::from(column) + 0.5) / f64::from(columns);
            let wi = glam::DVec3::new(sin * libm::cos(phi), cos, sin * libm::sin(phi)).as_vec3();
            sum += f64::from(sky.radiance(wi).r) * sin * cos;
        }
    }
    sum * std::f64::consts::FRAC_PI_2 * std::f64::consts::TAU / f64::from(rows * columns)
}
