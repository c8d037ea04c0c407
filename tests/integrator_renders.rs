//! Integrators beside the path tracer, and its strategies: renders whose answer is known.

mod common;

use common::{emitting, lambert, largest_error, mean, render_scene, scene, small, sphere, square};
use glam::{Vec2, Vec3};
use pipeline::color::Rgb;
use pipeline::disney::Model;
use pipeline::render::Rendered;
use pipeline::scene::environment::Environment;
use pipeline::scene::light::{Light, LightKind};
use pipeline::scene::material::{Material, Param, Sides};
use pipeline::scene::{Camera, Mesh, Named, Scene};
use pipeline::settings::{Filter, Integrator, RenderSettings};

fn from_above(height: f32, fov: f32) -> Camera {
    Camera::look_at(Vec3::new(0.0, height, 0.0), Vec3::ZERO, Vec3::Z, fov)
}

fn with(integrator: Integrator, settings: RenderSettings) -> RenderSettings {
    RenderSettings { integrator, ..settings }
}

fn plane(material: Material, camera: Camera) -> Scene {
    scene(vec![(square(50.0, 0.0), material)], camera)
}

/// The red, green and blue of the first pixel.
fn first_pixel(rendered: &Rendered) -> [f32; 3] {
    rendered.raster.picture().rgb().expect("a colour picture").map(|c| c[0])
}

/// A one-sided square light at `height` that faces down.
fn lamp(half: f32, height: f32, radiance: f32) -> (Mesh, Material) {
    let mut mesh = square(half, height);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let mut material = emitting(lambert(0.0), radiance);
    material.emission.sides = Sides::Front;
    (mesh, material)
}

#[test]
fn depths_are_one_over_the_depth_along_the_axis_and_0_on_a_miss() {
    let depths = with(Integrator::Depths, small(8, 8, 4, 16));
    let rendered = render_scene(&plane(lambert(0.5), from_above(3.0, 1.2)), &depths);
    assert!(largest_error(&rendered, 1.0 / 3.0) < 1e-5);
    let small_square = scene(vec![(square(0.5, 0.0), lambert(0.5))], from_above(3.0, 1.2));
    assert_eq!(first_pixel(&render_scene(&small_square, &depths)), [0.0; 3]);
    // The depth is counted in the camera's own units.
    let mut scaled = from_above(3.0, 1.2);
    scaled.world_from_camera.matrix3 *= 2.0;
    let rendered = render_scene(&plane(lambert(0.5), scaled), &depths);
    assert!(largest_error(&rendered, 2.0 / 3.0) < 1e-5);
}

#[test]
fn normals_are_absolute_whatever_side_is_seen() {
    let below = Camera::look_at(Vec3::new(0.0, -3.0, 0.0), Vec3::ZERO, Vec3::Z, 0.5);
    for (camera, sides) in
        [(from_above(3.0, 0.5), Sides::Both), (below.clone(), Sides::Both), (below, Sides::Front)]
    {
        let world = plane(Material { sides, ..lambert(0.5) }, camera);
        let rendered = render_scene(&world, &with(Integrator::Normals, small(4, 4, 4, 16)));
        assert_eq!(first_pixel(&rendered), [0.0, 1.0, 0.0]);
    }
}

#[test]
fn albedo_is_the_base_colour_and_diffuse_albedo_that_of_diffuse_alone() {
    let color = Rgb::new(0.1, 0.2, 0.3);
    for (model, all, diffuse) in [
        (Model::Diffuse, color, color),
        (Model::Disney, color, Rgb::BLACK),
        (Model::Mirror, Rgb::WHITE, Rgb::BLACK),
    ] {
        let material = Material { model, base_color: Param::Constant(color), ..Material::default() };
        let world = plane(material, from_above(3.0, 0.5));
        for (integrator, expected) in [(Integrator::Albedo, all), (Integrator::DiffuseAlbedo, diffuse)] {
            let found = first_pixel(&render_scene(&world, &with(integrator, small(2, 2, 1, 16))));
            assert_eq!(found, expected.to_array(), "{model:?} {integrator:?}");
        }
    }
}

#[test]
fn ambient_occlusion_is_1_in_the_open_and_known_at_a_wall() {
    let ao = with(Integrator::Ao, small(8, 8, 1024, 16));
    let rendered = render_scene(&plane(lambert(0.5), from_above(3.0, 0.5)), &ao);
    assert!(largest_error(&rendered, 1.0) < 1e-6);
    // A wall of height h hides ½(1 - d/√(d² + h²)) of the sky at distance d: an infinite strip's form factor.
    let v = |y: f32, z: f32| Vec3::new(0.0, y, z);
    let wall = Mesh {
        name: "wall".into(),
        positions: vec![v(0.0, -1000.0), v(0.0, 1000.0), v(1.0, 1000.0), v(1.0, -1000.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let camera = Camera::look_at(Vec3::new(2.0, 3.0, 0.0), Vec3::X, Vec3::Y, 0.002);
    let corner = scene(vec![(square(2000.0, 0.0), lambert(0.5)), (wall, lambert(0.5))], camera);
    let exact = 1.0 - 0.5 * (1.0 - std::f64::consts::FRAC_1_SQRT_2);
    let found = mean(&render_scene(&corner, &ao));
    assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
}

#[test]
fn a_point_light_gives_its_formula_and_shadows() {
    let point = |y: f32| {
        let integrator = Integrator::Point { position: [0.0, y, 0.0], energy: [100.0, 50.0, 0.0] };
        with(integrator, small(2, 2, 4, 16))
    };
    let world = plane(Material { model: Model::Mirror, ..Material::default() }, from_above(5.0, 0.002));
    let expected = 100.0 / (4.0 * std::f32::consts::PI * std::f32::consts::PI) / 4.0;
    let [r, g, b] = first_pixel(&render_scene(&world, &point(2.0)));
    assert!((r / expected - 1.0).abs() < 1e-4 && (g * 2.0 / r - 1.0).abs() < 1e-5 && b == 0.0, "{r} {g}");
    let one_sided = plane(Material { sides: Sides::Front, ..lambert(0.5) }, from_above(5.0, 0.002));
    assert_eq!(mean(&render_scene(&one_sided, &point(-2.0))), 0.0, "behind the surface");
    // Something between the point and the light, seen from beside.
    let camera = Camera::look_at(Vec3::new(3.0, 1.0, 0.0), Vec3::ZERO, Vec3::Y, 0.002);
    let parts = vec![(square(50.0, 0.0), lambert(0.5)), (square(0.2, 1.0), lambert(0.5))];
    assert_eq!(mean(&render_scene(&scene(parts, camera), &point(2.0))), 0.0);
}

/// So far away that the geometry counts from an origin of its own.
#[test]
fn depths_and_point_lights_are_the_same_far_from_the_origin() {
    let far = Vec3::new(4096.0, -8192.0, 2048.0);
    let moved = |by: Vec3| {
        let mut sheet = square(1.0, 0.0);
        sheet.positions.iter_mut().for_each(|p| *p += by);
        let camera = Camera::look_at(by + Vec3::Y * 2.0, by, Vec3::Z, 0.4);
        scene(vec![(sheet, lambert(0.5))], camera)
    };
    let point = |by: Vec3| Integrator::Point { position: (by + Vec3::Y).to_array(), energy: [10.0; 3] };
    for (near, distant) in [(Integrator::Depths, Integrator::Depths), (point(Vec3::ZERO), point(far))] {
        let [near, distant] = [(Vec3::ZERO, near), (far, distant)]
            .map(|(by, integrator)| mean(&render_scene(&moved(by), &with(integrator, small(8, 8, 4, 4)))));
        assert!(near > 0.1 && (distant / near - 1.0).abs() < 1e-3, "{near} {distant}");
    }
}

#[test]
fn whitted_is_direct_light_seen_directly_or_in_mirrors() {
    let whitted = |spp| with(Integrator::Whitted, small(8, 8, spp, 1023));
    // Inside a glowing sphere: emission and its first reflection, nothing more.
    let inside = Camera::look_at(Vec3::new(0.1, 0.2, 0.3), Vec3::X, Vec3::Y, 1.0);
    let room = scene(vec![(sphere(1.0, Vec3::ZERO, 24), emitting(lambert(0.5), 1.0))], inside);
    let found = mean(&render_scene(&room, &whitted(256)));
    assert!((found / 1.5 - 1.0).abs() < 0.004, "{found}");
    // A mirror shows the lamp, and glass in an even environment disappears.
    let mirror = Material { model: Model::Mirror, ..Material::default() };
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO, Vec3::Z, 0.2);
    let parts = vec![(square(5.0, 0.0), mirror), lamp(1.0, 2.0, 3.0)];
    assert!(largest_error(&render_scene(&scene(parts, camera), &whitted(4)), 3.0) < 1e-5);
    let glass = Material { model: Model::Dielectric, ..Material::default() };
    let camera = Camera::look_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 0.8);
    let mut world = scene(vec![(sphere(1.0, Vec3::ZERO, 24), glass)], camera);
    world.environment = Some(Environment::constant(Rgb::WHITE));
    let found = mean(&render_scene(&world, &whitted(1024)));
    assert!((found - 1.0).abs() < 0.004, "{found}");
}

#[test]
fn the_emitter_check_leaves_cosines_out() {
    let (half, height, radiance, albedo) = (0.7f64, 1.3f64, 5.0, 0.6);
    let camera = Camera::look_at(Vec3::new(3.0, 1.0, 0.0), Vec3::ZERO, Vec3::Y, 0.002);
    let parts = vec![(square(50.0, 0.0), lambert(0.6)), lamp(0.7, 1.3, 5.0)];
    let rendered = render_scene(&scene(parts, camera), &with(Integrator::EmitterCheck, small(8, 8, 256, 16)));
    // ∫ dA/d² over the lamp by midpoints.
    let n = 400;
    let cell = 2.0 * half / f64::from(n);
    let at = |i: i32| (f64::from(i) + 0.5) * cell - half;
    let integral: f64 = (0..n * n)
        .map(|k| cell * cell / (height * height + at(k % n) * at(k % n) + at(k / n) * at(k / n)))
        .sum();
    let exact = radiance * albedo / std::f64::consts::PI * integral;
    let found = mean(&rendered);
    assert!((found / exact - 1.0).abs() < 2e-3, "{found} {exact}");
}

/// Light sampling, BSDF sampling and both together estimate the same; a point light is found by all of them.
#[test]
fn strategies_agree() {
    let camera = Camera::look_at(Vec3::new(3.0, 2.0, 0.5), Vec3::ZERO, Vec3::Y, 0.4);
    let mut glossy = Material { base_color: Param::Constant(Rgb::grey(0.5)), ..Material::default() };
    *glossy.scalar_mut(pipeline::disney::Parameter::Roughness) = Param::Constant(0.4);
    let parts = vec![(square(3.0, 0.0), glossy), lamp(1.5, 2.5, 2.0)];
    let mut world = scene(parts, camera);
    world.environment = Some(Environment::constant(Rgb::grey(0.2)));
    let kind = LightKind::Point { position: Vec3::new(1.0, 1.5, 0.0), range: None };
    world.lights.push(Named::new("point", Light { kind, color: Rgb::WHITE, intensity: 1.0 }));
    let found =
        |nee, mis| mean(&render_scene(&world, &RenderSettings { nee, mis, ..small(16, 16, 1024, 3) }));
    let reference = found(true, true);
    for (nee, mis) in [(true, false), (false, true), (false, false)] {
        let other = found(nee, mis);
        assert!((other / reference - 1.0).abs() < 0.01, "nee {nee}, mis {mis}: {other} {reference}");
    }
}

/// Aris' pixel (i, j) lies around the integer coordinate: with one sample the ray goes through (i - W/2, j - H/2) exactly.
#[test]
fn a_pixel_offset_moves_the_film_by_half_a_pixel() {
    let v = |x: f32, y: f32| Vec3::new(x, y, -1.0);
    let half_plane = |edge: f32| Mesh {
        name: "half".into(),
        positions: vec![v(edge, -9.0), v(9.0, -9.0), v(9.0, 9.0), v(edge, 9.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut camera = Camera::look_at(Vec3::ZERO, -Vec3::Z, Vec3::Y, std::f32::consts::FRAC_PI_2);
    let settings = RenderSettings { filter: Filter::Point, ..with(Integrator::Depths, small(4, 4, 1, 16)) };
    let row = |camera: &Camera| -> Vec<f32> {
        let world = scene(vec![(half_plane(0.1), lambert(0.5))], camera.clone());
        render_scene(&world, &settings).raster.picture().rgb().unwrap()[0][..4].to_vec()
    };
    assert_eq!(row(&camera), [0.0, 0.0, 1.0, 1.0], "x is -¾, -¼, ¼, ¾");
    camera.pixel_offset = Vec2::splat(-0.5);
    assert_eq!(row(&camera), [0.0, 0.0, 0.0, 1.0], "x is -1, -½, 0, ½");
}
