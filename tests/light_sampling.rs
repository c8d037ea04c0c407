//! Light sampling as a whole: short renders have the mean of long ones, and every way of finding light the same one.

mod common;

use std::sync::Arc;

use common::{emitting, lambert, metal, render_scene, scene, set_sky, small, sphere, square};
use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::math::hash::{combine, unit_f32};
use pipeline::render::{Control, Geometry, Prepared, RenderError, Rendered, Techniques, render};
use pipeline::scene::light::{Light, LightKind};
use pipeline::scene::material::{Param, Sides};
use pipeline::scene::{Camera, Material, Mesh, Named, Scene};
use pipeline::settings::{RenderSettings, Use};

fn random(i: u32, salt: u64) -> f32 {
    unit_f32(combine(u64::from(i), salt) as u32)
}

fn anywhere(i: u32, salt: u64) -> Vec3 {
    Vec3::new(random(i, salt), random(i, salt + 1), random(i, salt + 2)) * 2.0 - 1.0
}

/// A floor with a ball of plastic and a sheet that light comes through, seen from above.
fn stage() -> Scene {
    let mut leaf = lambert(0.6);
    leaf.model = pipeline::disney::Model::Disney;
    leaf.thin_walled = true;
    *leaf.scalar_mut(pipeline::disney::Parameter::DiffTrans) = Param::Constant(1.0);
    let mut sheet = square(0.5, 0.6);
    sheet.positions.iter_mut().for_each(|p| p.x += 1.2);
    let parts = vec![
        (square(3.0, 0.0), lambert(0.5)),
        (sphere(0.5, Vec3::new(-0.8, 0.5, 0.0), 12), Material::default()),
        (sheet, leaf),
    ];
    scene(parts, Camera::look_at(Vec3::new(0.0, 3.0, 4.0), Vec3::ZERO, Vec3::Y, 0.7))
}

fn add(world: &mut Scene, mesh: Mesh, material: Material) {
    let part = scene(vec![(mesh, material)], Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::X, 1.0));
    let mut instance = part.instances[0].clone();
    instance.mesh.0 = world.meshes.len() as u32;
    instance.material.0 = world.materials.len() as u32;
    world.instances.push(instance);
    world.meshes.extend(part.meshes);
    world.materials.extend(part.materials);
}

/// Lamps of two triangles, of a sphere's, and one that is all but dark, above and around the stage; out of the camera's sight, for its
/// pixels at their edges would be noise of their own.
fn many_lights() -> Scene {
    let mut world = stage();
    for i in 0..60 {
        let place = anywhere(i, 1) * Vec3::new(6.0, 1.2, 6.0) + Vec3::Y * 2.0;
        if place.z > 2.0 || place.z < -3.0 || place.x.abs() > 3.5 {
            let mut lamp = emitting(lambert(0.0), 20.0 * random(i, 4));
            lamp.emission.sides = if i % 3 == 0 { Sides::Both } else { Sides::Front };
            if i % 4 == 0 {
                add(&mut world, sphere(0.1, place, 4), lamp);
            } else {
                let mut quad = square(0.15, 0.0);
                let turn = glam::Quat::from_rotation_arc(Vec3::Y, anywhere(i, 5).normalize());
                quad.positions.iter_mut().for_each(|p| *p = turn * *p + place);
                add(&mut world, quad, lamp);
            }
        }
    }
    add(&mut world, sphere(0.1, Vec3::new(0.0, 9.0, 0.0), 4), emitting(lambert(0.0), 1e-20));
    world
}

/// The same above rough metal, which mirrors them.
fn mirrored_lights(roughness: f32) -> Scene {
    let mut world = many_lights();
    world.materials[0].item = metal(roughness);
    world
}

/// A sky that is brighter above, with a sun of four pixels.
fn sunny() -> Scene {
    let (width, height) = (64u32, 32u32);
    let mut values: Vec<f32> =
        (0..width * height).map(|i| 0.2 + 0.8 * (1.0 - (i / width) as f32 / 32.0)).collect();
    for (x, y) in [(20, 8), (21, 8), (20, 9), (21, 9)] {
        values[(y * width + x) as usize] = 300.0;
    }
    let mut world = stage();
    set_sky(&mut world, [width, height], values);
    world
}

/// The green mean and the variance of that mean, by the replicates.
fn mean_and_variance(rendered: &Rendered) -> (f64, f64) {
    assert_eq!(rendered.counts.bad_samples, 0);
    let [_, green, _] = rendered.raster.picture().rgb().expect("colour");
    let variance =
        &rendered.raster.layer("data").and_then(|d| d.channel("variance.G")).expect("variance").values;
    let n = green.len() as f64;
    let sum = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>();
    (sum(green) / n, sum(variance) / (n * n))
}

/// Several seeds' mean, and the variance of it.
fn pooled(world: &Scene, settings: &RenderSettings, seeds: u64) -> (f64, f64) {
    let runs = (0..seeds)
        .map(|seed| mean_and_variance(&render_scene(world, &RenderSettings { seed, ..settings.clone() })));
    let (mean, variance) = runs.fold((0.0, 0.0), |(m, v), (mean, variance)| (m + mean, v + variance));
    let n = seeds as f64;
    (mean / n, variance / (n * n))
}

fn assert_same(what: &str, (a, variance_a): (f64, f64), (b, variance_b): (f64, f64)) {
    let sigma = (variance_a + variance_b).sqrt();
    assert!((a - b).abs() < 4.0 * sigma, "{what}: {a} {b} ± {sigma}");
    // Or the test could not fail.
    assert!(sigma < 0.02 * b, "{what}: {b} ± {sigma}");
}

fn over_a_floor(lights: Vec<Light>) -> Scene {
    let camera = Camera::look_at(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, Vec3::Z, 0.8);
    let mut world = scene(vec![(square(3.0, 0.0), lambert(0.5))], camera);
    world.lights = lights.into_iter().map(|light| Named::new("lamp", light)).collect();
    world
}

/// Among several lights the tree bounds where each shines: what a cone of nothing but full light bounds is found too.
#[test]
fn a_spot_with_a_hard_edge_is_chosen_among_others() {
    let spot = |inner: f32| {
        let (position, direction) = (Vec3::Y * 2.0, -Vec3::Y);
        let kind = LightKind::Spot { position, direction, inner, outer: 0.3, range: None };
        Light { kind, color: Rgb::WHITE, intensity: 10.0 }
    };
    let kind = LightKind::Point { position: Vec3::new(2.0, 1.0, 0.0), range: None };
    let dim = Light { kind, color: Rgb::WHITE, intensity: 1e-6 };
    for inner in [0.3, 0.299_99, 0.2999, 0.2] {
        let found = |lights: Vec<Light>| {
            mean_and_variance(&render_scene(&over_a_floor(lights), &small(32, 32, 64, 2))).0
        };
        let (alone, among_others) = (found(vec![spot(inner)]), found(vec![spot(inner), dim]));
        assert!(alone > 0.01 && (among_others / alone - 1.0).abs() < 0.01, "{inner}: {alone} {among_others}");
    }
}

#[test]
fn a_light_beyond_what_a_float_holds_is_an_error() {
    let kind = LightKind::Directional { direction: -Vec3::Y };
    let world = over_a_floor(vec![Light { kind, color: Rgb::grey(1e20), intensity: 1e20 }]);
    let geometry = Arc::new(Geometry::build(&world).expect("geometry"));
    let error = Prepared::new(Arc::new(world), geometry, &small(4, 4, 1, 1)).expect_err("too much");
    assert!(matches!(&error, RenderError::LightEmission { light } if light == "lamp"), "{error}");
}

#[test]
fn short_renders_have_the_mean_of_long_ones() {
    for (what, world) in
        [("many lights", many_lights()), ("mirrored lights", mirrored_lights(0.4)), ("sunny", sunny())]
    {
        let long = pooled(&world, &small(32, 24, 1024, 3), 1);
        let short = pooled(&world, &small(32, 24, 16, 3), 16);
        assert_same(what, short, long);
    }
}

/// At the first surface the choice of a light knows what is mirrored to the camera; paths from the lights, and those of neighbours, have to
/// weigh it alike.
#[test]
fn lights_chosen_by_what_is_mirrored_are_the_same_with_less_noise() {
    let world = mirrored_lights(0.4);
    let geometry = Arc::new(Geometry::build(&world).expect("geometry"));
    let rendered = |settings: &RenderSettings, lights_by_gloss| {
        let prepared =
            Prepared::new(Arc::new(world.clone()), Arc::clone(&geometry), settings).expect("prepared");
        let prepared = prepared.with(Techniques { lights_by_gloss, ..Techniques::default() });
        mean_and_variance(&render(&prepared, &Control::default()))
    };
    let settings = RenderSettings {
        light_paths: Use::Never,
        path_reuse: Use::Never,
        adaptive: Use::Never,
        ..small(48, 36, 256, 3)
    };
    let [by_gloss, by_arrival] = [true, false].map(|by_gloss| rendered(&settings, by_gloss));
    assert_same("by arrival", by_arrival, by_gloss);
    assert!(by_gloss.1 < 0.7 * by_arrival.1, "{by_gloss:?} {by_arrival:?}");
    for (light_paths, path_reuse) in
        [(Use::Always, Use::Never), (Use::Never, Use::Always), (Use::Always, Use::Always)]
    {
        let settings = RenderSettings { light_paths, path_reuse, ..settings.clone() };
        assert_same(&format!("{light_paths:?} {path_reuse:?}"), rendered(&settings, true), by_arrival);
    }
}

/// With the same numbers for the camera's paths what differs is what light paths bring and take: were the choice by what is mirrored unknown to
/// their weights, 0.13% would be missing.
#[test]
fn light_paths_weigh_lights_that_are_mirrored_as_the_camera_does() {
    let world = mirrored_lights(0.3);
    let settings = RenderSettings {
        light_paths: Use::Never,
        path_reuse: Use::Never,
        adaptive: Use::Never,
        ..small(48, 36, 256, 1)
    };
    let with = RenderSettings { light_paths: Use::Always, ..settings.clone() };
    let changes: Vec<f64> = (0..8)
        .map(|seed| {
            let [with, without] = [&with, &settings]
                .map(|s| mean_and_variance(&render_scene(&world, &RenderSettings { seed, ..s.clone() })).0);
            with / without - 1.0
        })
        .collect();
    let n = changes.len() as f64;
    let mean = changes.iter().sum::<f64>() / n;
    let variance = changes.iter().map(|c| (c - mean) * (c - mean)).sum::<f64>() / (n * (n - 1.0));
    let sigma = variance.sqrt();
    assert!(mean.abs() < 4.5 * sigma, "{mean} ± {sigma}");
    // Or the test could not fail.
    assert!(sigma < 2e-4, "± {sigma}");
}

/// The environment's table is another one where both ways of finding light are weighed against each other, and lights are chosen
/// by the tree: neither changes the mean.
#[test]
fn all_ways_of_finding_light_find_the_same() {
    for (what, world) in
        [("many lights", many_lights()), ("mirrored lights", mirrored_lights(0.4)), ("sunny", sunny())]
    {
        let both = small(32, 24, 256, 2);
        let all = pooled(&world, &both, 2);
        let lights_alone = RenderSettings { mis: false, ..both.clone() };
        assert_same(&format!("{what}, lights alone"), pooled(&world, &lights_alone, 4), all);
        let bsdf_alone = RenderSettings { nee: false, spp: 1024, ..both };
        assert_same(&format!("{what}, BSDF alone"), pooled(&world, &bsdf_alone, 2), all);
    }
}
