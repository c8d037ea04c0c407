//! Renders whose answer is algebra, through the whole integrator.

mod common;

use common::{emitting, lambert, largest_error, mean, render_scene, scene, small, sphere, square};
use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::disney::Model;
use pipeline::scene::environment::Environment;
use pipeline::scene::light::{Light, LightKind};
use pipeline::scene::material::{Material, Opacity, Param, Sides};
use pipeline::scene::{Camera, Named};

fn inside_out() -> Camera {
    Camera::look_at(Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 0.5, -0.3), Vec3::Y, 1.5)
}

fn from_above(height: f32) -> Camera {
    Camera::look_at(Vec3::new(0.0, height, 0.0), Vec3::ZERO, Vec3::Z, 0.02)
}

/// Inside a closed surface of albedo ρ and emission Le, radiance after n bounces is Le(1 - ρ^(n+1))/(1 - ρ).
#[test]
fn closed_sphere_has_the_geometric_series() {
    for (albedo, depth) in [(0.5, 0u32), (0.5, 1), (0.8, 3), (0.5, 16)] {
        let room = scene(vec![(sphere(1.0, Vec3::ZERO, 24), emitting(lambert(albedo), 1.0))], inside_out());
        let rendered = render_scene(&room, &small(24, 24, 256, depth));
        let rho = f64::from(albedo);
        let exact = (1.0 - libm::pow(rho, f64::from(depth + 1))) / (1.0 - rho);
        assert!(
            (mean(&rendered) / exact - 1.0).abs() < 0.004,
            "ρ {albedo}, depth {depth}: {} {exact}",
            mean(&rendered)
        );
        assert_eq!(rendered.counts.bad_samples, 0);
    }
}

#[test]
fn a_mirror_in_an_even_environment_disappears() {
    let mirror = Material { model: Model::Mirror, ..Material::default() };
    let mut world = scene(
        vec![(sphere(1.0, Vec3::ZERO, 24), mirror)],
        Camera::look_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 0.8),
    );
    world.environment = Some(Environment::constant(Rgb::grey(0.7)));
    let rendered = render_scene(&world, &small(32, 32, 16, 8));
    assert!(largest_error(&rendered, 0.7) < 1e-5, "{}", largest_error(&rendered, 0.7));
}

/// Radiance shrinks and grows by eta² at the two interfaces, and Fresnel's parts sum to one: lossless glass is invisible in a
/// furnace, however often light is reflected inside.
#[test]
fn lossless_glass_in_an_even_environment_disappears() {
    let glass = Material { model: Model::Dielectric, ..Material::default() };
    let mut world = scene(
        vec![(sphere(1.0, Vec3::ZERO, 24), glass)],
        Camera::look_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 0.8),
    );
    world.environment = Some(Environment::constant(Rgb::WHITE));
    let rendered = render_scene(&world, &small(24, 24, 256, 400));
    assert!((mean(&rendered) - 1.0).abs() < 0.003, "{}", mean(&rendered));
}

#[test]
fn a_plane_under_an_even_sky_reflects_its_albedo() {
    for diffuse in [Model::Diffuse, Model::Disney] {
        let mut material = lambert(0.6);
        material.model = diffuse;
        if diffuse == Model::Disney {
            // Of Burley's lobes only the base remains: roughness ½ keeps its factor near 1.
            material.diffuse = pipeline::disney::DiffuseModel::Lambert;
            *material.scalar_mut(pipeline::disney::Parameter::Specular) = Param::Constant(0.0);
        }
        let mut world = scene(vec![(square(5.0, 0.0), material)], from_above(3.0));
        world.environment = Some(Environment::constant(Rgb::grey(2.0)));
        let rendered = render_scene(&world, &small(8, 8, 256, 4));
        let tolerance = if diffuse == Model::Diffuse { 0.002 } else { 0.08 };
        assert!((mean(&rendered) / 1.2 - 1.0).abs() < tolerance, "{diffuse:?} {}", mean(&rendered));
    }
}

#[test]
fn punctual_lights_give_their_irradiance() {
    let light = |kind| Named::new("light", Light { kind, color: Rgb::WHITE, intensity: 3.0 });
    let cases = [
        (LightKind::Point { position: Vec3::Y * 2.0, range: None }, 3.0 / 4.0),
        (LightKind::Directional { direction: Vec3::new(0.0, -0.8, 0.6) }, 3.0 * 0.8),
        (
            LightKind::Spot {
                position: Vec3::Y * 2.0,
                direction: -Vec3::Y,
                inner: 0.4,
                outer: 0.5,
                range: None,
            },
            3.0 / 4.0,
        ),
    ];
    for (kind, irradiance) in cases {
        let mut world = scene(vec![(square(50.0, 0.0), lambert(0.5))], from_above(1.0));
        world.lights.push(light(kind));
        let exact = 0.5 / std::f64::consts::PI * irradiance;
        let rendered = render_scene(&world, &small(4, 4, 4, 2));
        assert!((mean(&rendered) / exact - 1.0).abs() < 1e-3, "{kind:?}: {} {exact}", mean(&rendered));
    }
}

/// E/L of a square of half side a at height h above a point: the sum of its corners' configuration factors.
#[test]
fn a_square_light_gives_its_form_factor() {
    let (a, h) = (0.7f64, 1.3f64);
    let k = a / h / (1.0 + (a / h) * (a / h)).sqrt();
    let form_factor = 4.0 / std::f64::consts::PI * k * libm::atan(k);
    let mut light = square(0.7, 1.3);
    // Facing down, and emitting to its front alone.
    for t in &mut light.triangles {
        t.swap(1, 2);
    }
    let mut lamp = emitting(lambert(0.0), 5.0);
    lamp.emission.sides = Sides::Front;
    let camera = Camera::look_at(Vec3::new(0.0, 0.5, 0.0), Vec3::ZERO, Vec3::Z, 0.002);
    let world = scene(vec![(square(5.0, 0.0), lambert(0.5)), (light, lamp)], camera);
    let rendered = render_scene(&world, &small(8, 8, 256, 1));
    let exact = 0.5 * 5.0 * form_factor;
    assert!((mean(&rendered) / exact - 1.0).abs() < 0.002, "{} {exact}", mean(&rendered));
}

#[test]
fn coverage_lets_its_share_of_light_and_sight_through() {
    let mut veil = lambert(0.0);
    veil.opacity = Opacity { alpha: Param::Constant(0.25), cutoff: None };
    let mut world = scene(vec![(square(5.0, 0.0), lambert(0.8)), (square(50.0, 1.0), veil)], from_above(0.5));
    world.lights.push(Named::new(
        "sun",
        Light { kind: LightKind::Directional { direction: -Vec3::Y }, color: Rgb::WHITE, intensity: 1.0 },
    ));
    let under = 0.8 / std::f64::consts::PI * 0.75;
    let rendered = render_scene(&world, &small(4, 4, 4, 2));
    assert!((mean(&rendered) / under - 1.0).abs() < 1e-3, "the shadow: {} {under}", mean(&rendered));
    world.cameras[0].item = from_above(2.0);
    let rendered = render_scene(&world, &small(16, 16, 256, 2));
    assert!((mean(&rendered) / (under * 0.75) - 1.0).abs() < 0.01, "the sight: {}", mean(&rendered));
}

#[test]
fn a_furnace_stays_exact_at_every_scale_and_far_from_the_origin() {
    for (radius, center) in [(1e-5, Vec3::ZERO), (1e6, Vec3::ZERO), (100.0, Vec3::new(1e6, -1e6, 1e6))] {
        let camera = Camera::look_at(center, center + Vec3::new(0.3, 0.2, 1.0) * radius, Vec3::Y, 1.2);
        let room = scene(vec![(sphere(radius, center, 16), emitting(lambert(0.5), 1.0))], camera);
        let rendered = render_scene(&room, &small(16, 16, 128, 16));
        let exact = (1.0 - libm::pow(0.5, 17.0)) / 0.5;
        assert!((mean(&rendered) / exact - 1.0).abs() < 0.01, "{radius} at {center}: {}", mean(&rendered));
        assert_eq!(rendered.counts.bad_samples, 0);
    }
}

#[test]
fn depth_normal_and_albedo_layers_tell_the_first_surface() {
    let mut world = scene(
        vec![(square(5.0, 0.0), lambert(0.3))],
        Camera::look_at(Vec3::Y * 2.0, Vec3::ZERO, Vec3::Z, 1.0),
    );
    world.environment = Some(Environment::constant(Rgb::WHITE));
    let rendered = render_scene(&world, &small(8, 8, 4, 1));
    let data = rendered.raster.layer("data").expect("data");
    for (name, value) in
        [("Z", 2.0), ("albedo.G", 0.3), ("normal.X", 0.0), ("normal.Y", 1.0), ("samples", 4.0)]
    {
        for &v in &data.channel(name).expect(name).values {
            assert!((v - value).abs() < 1e-5, "{name}: {v}");
        }
    }
}

/// A decal in the plane of what it lies on: a fully transparent one changes nothing, a half transparent one hides half.
#[test]
fn a_transparent_sheet_in_the_plane_of_a_surface_does_not_hide_it() {
    for (alpha, expected) in [(0.0, 1.0), (0.5, 0.5)] {
        let mut sheet = lambert(0.0);
        sheet.opacity = Opacity { alpha: Param::Constant(alpha), cutoff: None };
        let tilted = |mut mesh: pipeline::scene::Mesh| {
            let turn = glam::Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 0.7);
            mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
            mesh
        };
        let parts =
            vec![(tilted(square(5.0, 0.0)), sheet), (tilted(square(5.0, 0.0)), emitting(lambert(0.0), 1.0))];
        let rendered = render_scene(&scene(parts, from_above(2.0)), &small(16, 16, 256, 2));
        // Where rays meet both at the same distance, the order is rounding's choice; each decides for itself all the same.
        let seen = mean(&rendered);
        let in_order = seen - expected;
        assert!(in_order > -0.01 && (alpha > 0.0 || in_order < 0.01), "alpha {alpha}: {seen}");
    }
}

/// A mirrored instance of a light is the light of the mirrored mesh, shadows and textures included.
#[test]
fn a_mirrored_light_shines_like_the_same_light_modelled_so() {
    let mut lamp = emitting(lambert(0.0), 6.0);
    lamp.emission.sides = Sides::Both;
    let triangle = |side: f32| pipeline::scene::Mesh {
        name: "light".into(),
        positions: vec![
            Vec3::new(side * 0.1, 1.0, -0.6),
            Vec3::new(side * 1.4, 1.2, -0.2),
            Vec3::new(side * 0.4, 1.1, 0.9),
        ],
        triangles: vec![[0, 1, 2]],
        ..pipeline::scene::Mesh::default()
    };
    let occluder = || {
        let mut mesh = square(0.3, 0.6);
        mesh.positions.iter_mut().for_each(|p| p.x += 0.5);
        mesh
    };
    let camera = || Camera::look_at(Vec3::new(0.0, 0.9, 0.01), Vec3::ZERO, Vec3::Z, 1.2);
    let world = |light| {
        scene(
            vec![(square(3.0, 0.0), lambert(0.7)), (occluder(), lambert(0.2)), (light, lamp.clone())],
            camera(),
        )
    };
    let plain = render_scene(&world(triangle(1.0)), &small(24, 24, 512, 3));
    let mut mirrored = world(triangle(-1.0));
    mirrored.instances[2].world_from_object = glam::Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let mirrored = render_scene(&mirrored, &small(24, 24, 512, 3));
    let [a, ..] = plain.raster.picture().rgb().expect("colour");
    let [b, ..] = mirrored.raster.picture().rgb().expect("colour");
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= 1e-4 * (a + b), "pixel {i}: {a} {b}");
    }
}

#[test]
fn a_vertex_at_the_end_of_space_does_not_put_the_lights_out() {
    let far = pipeline::scene::Mesh {
        name: "far".into(),
        positions: vec![Vec3::splat(1e20), Vec3::new(1.1e20, 1e20, 1e20), Vec3::new(1e20, 1.1e20, 1e20)],
        triangles: vec![[0, 1, 2]],
        ..pipeline::scene::Mesh::default()
    };
    let mut world = scene(vec![(square(5.0, 0.0), lambert(0.5)), (far, lambert(0.5))], from_above(1.0));
    let kind = LightKind::Directional { direction: -Vec3::Y };
    world.lights.push(Named::new("sun", Light { kind, color: Rgb::WHITE, intensity: 1.0 }));
    let rendered = render_scene(&world, &small(4, 4, 4, 2));
    let exact = 0.5 / std::f64::consts::PI;
    assert!((mean(&rendered) / exact - 1.0).abs() < 1e-3, "{}", mean(&rendered));
}
