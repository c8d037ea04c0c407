//! Glass, sheets, leaves and mapped normals: renders whose answer is algebra, through the whole integrator.

mod common;

use std::sync::Arc;

use common::{cube, emitting, lambert, largest_error, mean, render_scene, scene, small, sphere, square};
use glam::{Vec2, Vec3};
use pipeline::color::Rgb;
use pipeline::disney::{Bsdf, DiffuseModel, Model, Parameter, fresnel_dielectric};
use pipeline::math::V3;
use pipeline::scene::environment::Environment;
use pipeline::scene::light::{Light, LightKind};
use pipeline::scene::material::{Material, NormalMap, Param, Sides, TextureChannel, TextureMap};
use pipeline::scene::texture::{Encoding, Image, Pixels, TexelFilter, Texture, Wrap};
use pipeline::scene::{Camera, ImageId, Named, Scene, TextureId};
use pipeline::settings::{RenderSettings, Use};

fn glass(scalars: &[(Parameter, f32)]) -> Material {
    let mut material = Material { base_color: Param::Constant(Rgb::WHITE), ..Material::default() };
    *material.scalar_mut(Parameter::SpecTrans) = Param::Constant(1.0);
    *material.scalar_mut(Parameter::Roughness) = Param::Constant(0.0);
    for &(parameter, value) in scalars {
        *material.scalar_mut(parameter) = Param::Constant(value);
    }
    material
}

fn sheet(scalars: &[(Parameter, f32)]) -> Material {
    Material { thin_walled: true, ..glass(scalars) }
}

fn in_even_light(mut world: Scene, radiance: f32) -> Scene {
    world.environment = Some(Environment::constant(Rgb::grey(radiance)));
    world
}

fn add_sun(world: &mut Scene, direction: Vec3) {
    let kind = LightKind::Directional { direction };
    world.lights.push(Named::new("sun", Light { kind, color: Rgb::WHITE, intensity: 1.0 }));
}

fn outside(fov: f32) -> Camera {
    Camera::look_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, fov)
}

fn from_above(height: f32) -> Camera {
    Camera::look_at(Vec3::new(0.0, height, 0.0), Vec3::ZERO, Vec3::Z, 0.02)
}

#[test]
fn lossless_glass_of_the_disney_model_disappears_in_an_even_environment() {
    let world = in_even_light(scene(vec![(sphere(1.0, Vec3::ZERO, 24), glass(&[]))], outside(0.8)), 1.0);
    let rendered = render_scene(&world, &small(24, 24, 256, 400));
    // Roulette's noise: one standard deviation is 0.003.
    assert!((mean(&rendered) - 1.0).abs() < 0.01, "{}", mean(&rendered));
}

/// In equilibrium radiance over n² is the same everywhere (Veach 1997, section 5.2).
#[test]
fn inside_glass_radiance_is_the_square_of_its_index() {
    let camera = Camera::look_at(Vec3::new(0.2, 0.1, 0.1), Vec3::X * 2.0, Vec3::Y, 1.2);
    for ior in [1.5f32, 2.0] {
        let body = glass(&[(Parameter::Ior, ior)]);
        let world = in_even_light(scene(vec![(sphere(1.0, Vec3::ZERO, 24), body)], camera.clone()), 1.0);
        let rendered = render_scene(&world, &small(16, 16, 1024, 4000));
        let exact = f64::from(ior * ior);
        assert!((mean(&rendered) / exact - 1.0).abs() < 0.01, "{ior}: {}", mean(&rendered));
    }
}

#[test]
fn rough_glass_loses_no_more_than_single_scattering_does_and_gains_nothing() {
    // With smooth sides what is lost is what facets shade; the albedo of both interfaces bounds it.
    for roughness in [0.2, 0.4] {
        let body = glass(&[(Parameter::Roughness, roughness)]);
        let world = in_even_light(scene(vec![(sphere(1.0, Vec3::ZERO, 24), body)], outside(0.4)), 1.0);
        let rendered = render_scene(&world, &small(16, 16, 256, 200));
        assert!((0.85..1.002).contains(&mean(&rendered)), "{roughness}: {}", mean(&rendered));
    }
}

#[test]
fn beers_law_holds_inside_closed_glass() {
    // Indices match, so that nothing is reflected or bent: radiance falls by exp(-σ·thickness) alone.
    let absorption = Rgb::new(0.7, 0.2, 0.0);
    let body = Material {
        absorption,
        ..glass(&[(Parameter::Ior, 1.0), (Parameter::Specular, 0.0), (Parameter::F90, 0.0)])
    };
    let world = in_even_light(scene(vec![(cube(0.5), body)], outside(0.01)), 2.0);
    let rendered = render_scene(&world, &small(4, 4, 4, 8));
    let exact = 2.0 * libm::exp(-0.7);
    assert!(largest_error(&rendered, exact) < 1e-4, "{} {exact}", mean(&rendered));
}

#[test]
fn light_inside_an_absorbing_medium_is_dimmed_on_its_way_and_on_the_way_to_the_camera() {
    // All in one cube of index 1: a floor, a point light 0.2 above it and the camera 0.4 above it.
    let absorption = Rgb::grey(1.5);
    let body = Material { absorption, ..glass(&[(Parameter::Ior, 1.0)]) };
    let camera = Camera::look_at(Vec3::new(0.0, 0.4, 0.0), Vec3::ZERO, Vec3::Z, 0.01);
    let mut world = scene(vec![(cube(0.5), body), (square(0.3, 0.0), lambert(0.5))], camera);
    let kind = LightKind::Point { position: Vec3::Y * 0.2, range: None };
    world.lights.push(Named::new("lamp", Light { kind, color: Rgb::WHITE, intensity: 1.0 }));
    let rendered = render_scene(&world, &small(4, 4, 4, 1));
    let exact = 0.5 / std::f64::consts::PI / 0.04 * libm::exp(-1.5 * 0.6);
    assert!((mean(&rendered) / exact - 1.0).abs() < 1e-3, "{} {exact}", mean(&rendered));
}

/// The transmittance of a sheet as the model has it: all that one interface doesn't reflect.
fn passing(cos: f32) -> f64 {
    1.0 - f64::from(fresnel_dielectric(cos, 1.5f32))
}

#[test]
fn a_clear_sheet_lets_the_sun_pass_without_noise() {
    let tint = Rgb::new(0.5, 1.0, 1.0);
    let pane = Material { transmission_color: Some(Param::Constant(tint)), ..sheet(&[]) };
    let mut world = scene(vec![(square(5.0, 0.0), lambert(0.8)), (square(50.0, 1.0), pane)], from_above(0.5));
    add_sun(&mut world, Vec3::new(0.0, -0.8, 0.6));
    // A single bounce, and a single sample.
    let rendered = render_scene(&world, &small(4, 4, 1, 1));
    let exact = 0.8 / std::f64::consts::PI * 0.8 * 0.5 * passing(0.8);
    assert!(largest_error(&rendered, exact) < 1e-4, "{} {exact}", mean(&rendered));
    // Seen from above the pane its own mirror image of the sun is a delta: what passes twice is left.
    world.cameras[0].item = from_above(2.0);
    let rendered = render_scene(&world, &small(16, 16, 256, 1));
    let twice = exact * 0.5 * passing(1.0);
    assert!((mean(&rendered) / twice - 1.0).abs() < 0.01, "{} {twice}", mean(&rendered));
}

#[test]
fn light_that_sampling_finds_through_a_sheet_is_what_paths_find() {
    // A floor in an even environment under two panes: NEE and BSDF sampling must share what arrives, at whatever depth ends the path.
    let bare = in_even_light(scene(vec![(square(500.0, 0.0), lambert(0.8))], from_above(0.5)), 1.0);
    let mut covered = bare.clone();
    let panes = [0.6f32, 0.7].map(|height| (square(500.0, height), sheet(&[])));
    let under =
        scene(vec![(square(500.0, 0.0), lambert(0.8))].into_iter().chain(panes).collect(), from_above(0.5));
    covered.meshes = under.meshes;
    covered.instances = under.instances;
    covered.materials = under.materials;
    // ∫ cos/π·T(cos)² dω of one bounce.
    let n = 20_000;
    let exact: f64 = (0..n)
        .map(|i| {
            let cos = ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
            passing(cos as f32) * passing(cos as f32) * 0.8 / f64::from(n)
        })
        .sum();
    let rendered = render_scene(&covered, &small(16, 16, 1024, 1));
    assert!((mean(&rendered) / exact - 1.0).abs() < 0.004, "{} {exact}", mean(&rendered));
}

#[test]
fn a_room_behind_a_window_in_the_sun_is_neither_black_nor_speckled() {
    // A closed box of albedo ½ whose ceiling is half open, with and without a pane in the opening.
    let room = |pane: Option<Material>| {
        let mut meshes = common::room_with_skylight(lambert(0.5));
        if let Some(pane) = pane {
            meshes.push((common::skylight(), pane));
        }
        let camera = Camera::look_at(Vec3::new(0.0, -0.2, 0.45), Vec3::new(0.0, -0.4, -0.5), Vec3::Y, 1.0);
        let mut world = scene(meshes, camera);
        add_sun(&mut world, Vec3::new(0.0, -1.0, 0.0));
        // The pane would keep paths from being reused, which the opening does not.
        let path_reuse = Use::Never;
        render_scene(&world, &RenderSettings { path_reuse, ..small(32, 32, 64, 6) })
    };
    let (open, glazed) = (room(None), room(Some(sheet(&[]))));
    let ratio = mean(&glazed) / mean(&open);
    // Light that is reflected back to the pane and returned adds a little.
    assert!((ratio / passing(1.0) - 1.0).abs() < 0.02, "{ratio}");
    let noise = |rendered: &pipeline::render::Rendered| {
        let [variance, _, _] = common::layer(rendered, "variance");
        variance.iter().map(|&v| f64::from(v)).sum::<f64>()
    };
    assert!(noise(&glazed) < 1.2 * noise(&open), "{} {}", noise(&glazed), noise(&open));
}

#[test]
fn a_leaf_reflects_and_transmits_its_colour() {
    for thin_walled in [true, false] {
        let mut leaf = Material { thin_walled, ..lambert(0.6) };
        leaf.model = Model::Disney;
        leaf.diffuse = DiffuseModel::Lambert;
        for (parameter, value) in
            [(Parameter::DiffTrans, 1.0), (Parameter::Specular, 0.0), (Parameter::F90, 0.0)]
        {
            *leaf.scalar_mut(parameter) = Param::Constant(value);
        }
        let world = in_even_light(scene(vec![(square(5.0, 0.0), leaf.clone())], from_above(3.0)), 2.0);
        let rendered = render_scene(&world, &small(8, 8, 256, 4));
        assert!((mean(&rendered) / 1.2 - 1.0).abs() < 0.003, "{thin_walled}: {}", mean(&rendered));
        // Lit from behind alone, it shows the transmitted half.
        let mut world = scene(vec![(square(5.0, 0.0), leaf)], from_above(3.0));
        add_sun(&mut world, Vec3::Y);
        let rendered = render_scene(&world, &small(4, 4, 4, 1));
        let exact = 0.3 / std::f64::consts::PI;
        assert!((mean(&rendered) / exact - 1.0).abs() < 1e-4, "{thin_walled}: {}", mean(&rendered));
    }
}

#[test]
fn a_plane_of_any_diffuse_model_reflects_its_directional_albedo() {
    for diffuse in [DiffuseModel::Burley, DiffuseModel::Lambert, DiffuseModel::LambertFresnel] {
        let mut material =
            Material { diffuse, base_color: Param::Constant(Rgb::grey(0.6)), ..Material::default() };
        *material.scalar_mut(Parameter::Roughness) = Param::Constant(0.7);
        let world = in_even_light(scene(vec![(square(5.0, 0.0), material)], from_above(3.0)), 1.0);
        let rendered = render_scene(&world, &small(16, 16, 1024, 1));
        // ∫ f·cos dω by a midpoint rule over cos² and φ; the view is along the normal, so that φ doesn't matter.
        let params =
            pipeline::disney::Params { base_color: Rgb::grey(0.6f64), roughness: 0.7, ..Default::default() };
        let bsdf = Bsdf::disney(&params, Default::default(), diffuse);
        let n = 4000;
        let albedo: f64 = (0..n)
            .map(|i| {
                let cos = ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
                let wi = V3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                bsdf.eval(V3::new(0.0, 0.0, 1.0), wi).r * std::f64::consts::PI / f64::from(n)
            })
            .sum();
        assert!((mean(&rendered) / albedo - 1.0).abs() < 0.003, "{diffuse:?}: {} {albedo}", mean(&rendered));
    }
}

/// `world` with its first material's normal turned everywhere by `tilt` radians towards +u.
fn with_tilted_normals(mut world: Scene, tilt: f64) -> Scene {
    let encoded = |v: f64| (0.5 + 0.5 * v) as f32;
    world.images.push(Arc::new(Image {
        name: "tilt".into(),
        width: 1,
        height: 1,
        channels: 3,
        pixels: Pixels::F32(vec![encoded(libm::sin(tilt)), 0.5, encoded(libm::cos(tilt))]),
    }));
    world.textures.push(Texture {
        image: ImageId(world.images.len() as u32 - 1),
        encoding: Encoding::Linear,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Nearest,
    });
    let map = TextureMap::new(TextureId(world.textures.len() as u32 - 1), TextureChannel::R);
    world.materials[0].item.normal_map = Some(NormalMap { map, scale: 1.0 });
    world
}

/// Gives a mesh texture coordinates that run along x and z.
fn with_coordinates(mut mesh: pipeline::scene::Mesh) -> pipeline::scene::Mesh {
    mesh.uvs = vec![mesh.positions.iter().map(|p| Vec2::new(p.x + 0.37 * p.y, p.z)).collect()];
    mesh
}

#[test]
fn a_mirror_with_mapped_normals_still_disappears_in_an_even_environment() {
    for tilt in [0.3, 0.8, 1.3] {
        let mirror = Material { model: Model::Mirror, ..Material::default() };
        let ball = with_coordinates(sphere(1.0, Vec3::ZERO, 24));
        let world = in_even_light(scene(vec![(ball, mirror)], outside(0.8)), 0.7);
        let rendered = render_scene(&with_tilted_normals(world, tilt), &small(32, 32, 16, 8));
        assert!(largest_error(&rendered, 0.7) < 1e-5, "{tilt}: {}", largest_error(&rendered, 0.7));
    }
}

/// A Lambert surface tilted by θ sees (1 + cos θ)/2 of its hemisphere above the real surface.
#[test]
fn mapped_normals_reflect_what_lies_above_the_surface() {
    let tilt = 0.6f64;
    let floor = with_coordinates(square(5.0, 0.0));
    let mut material = lambert(0.5);
    material.sides = Sides::Both;
    let world = in_even_light(scene(vec![(floor, material)], from_above(3.0)), 1.0);
    let rendered = render_scene(&with_tilted_normals(world, tilt), &small(16, 16, 1024, 1));
    let exact = 0.5 * (1.0 + libm::cos(tilt)) / 2.0;
    assert!((mean(&rendered) / exact - 1.0).abs() < 0.004, "{} {exact}", mean(&rendered));
}

/// Inside a closed emitting sphere each bounce adds the albedo's share, whatever the lobes: mirrors keep all.
#[test]
fn closed_spheres_of_other_materials_have_the_geometric_series() {
    let camera = Camera::look_at(Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 0.5, -0.3), Vec3::Y, 1.5);
    let mirror = Material { model: Model::Mirror, ..Material::default() };
    let room = scene(vec![(sphere(1.0, Vec3::ZERO, 24), emitting(mirror, 1.0))], camera.clone());
    let rendered = render_scene(&room, &small(16, 16, 16, 3));
    assert!(largest_error(&rendered, 4.0) < 1e-5, "{}", mean(&rendered));
    // A sheet lets pass into the dark what it doesn't reflect.
    let pane = sheet(&[(Parameter::Roughness, 0.0), (Parameter::Ior, 10.0)]);
    let dark = scene(vec![(sphere(1.0, Vec3::ZERO, 24), emitting(pane, 1.0))], camera);
    let rendered = render_scene(&dark, &small(8, 8, 256, 1));
    assert!(mean(&rendered) > 1.3 && mean(&rendered) < 2.0, "{}", mean(&rendered));
}
