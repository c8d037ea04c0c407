//! Scenes that differ in materials alone are rendered together: to the bits that each has alone, and only where that is so.

mod common;

use std::sync::{Arc, LazyLock};
use std::time::Duration;

use common::{disney, emitting, glass, lambert, metal, scene, set_sky, sphere, square};
use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::disney::{Model, Parameter};
use pipeline::record::Counts;
use pipeline::render::{Control, Geometry, Prepared, Rendered, Variants, render, render_together};
use pipeline::scene::material::{Opacity, Param};
use pipeline::scene::{Camera, Material, Mesh, Scene};
use pipeline::settings::{Integrator, RenderSettings, Use};

/// The material that varies.
const BALL: usize = 1;
/// That of the veil.
const VEIL: usize = 3;

fn ball(center: Vec3, radius: f32) -> Mesh {
    let mut mesh = sphere(radius, center, 6);
    mesh.normals = mesh.positions.iter().map(|p| (*p - center).normalize()).collect();
    mesh
}

/// A ball beside one of glass on a floor, a veil before them that is half there, a lamp and a sky: one scene, so that its images are the
/// same.
fn world() -> Scene {
    static WORLD: LazyLock<Scene> = LazyLock::new(build_world);
    WORLD.clone()
}

fn build_world() -> Scene {
    let mut veil = square(0.5, 0.0);
    veil.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x + 0.8, p.z + 0.6, 1.2));
    let mut half = lambert(0.4);
    half.opacity = Opacity { alpha: Param::Constant(0.5), ..Opacity::default() };
    let mut tinted = glass(0.1);
    tinted.absorption = Rgb::new(0.4, 1.0, 2.0);
    let mut world = scene(
        vec![
            (square(2.0, 0.0), lambert(0.6)),
            (ball(Vec3::new(-0.6, 0.5, 0.0), 0.5), metal(0.3)),
            (ball(Vec3::new(0.6, 0.4, 0.0), 0.4), tinted),
            (veil, half),
            (square(0.3, 2.0), emitting(lambert(0.0), 8.0)),
        ],
        Camera::look_at(Vec3::new(0.0, 1.2, 4.5), Vec3::Y * 0.5, Vec3::Y, 0.6),
    );
    set_sky(&mut world, [4, 2], vec![0.1, 0.2, 0.9, 0.2, 0.05, 0.1, 0.1, 0.1]);
    world
}

fn settings(light_paths: Use) -> RenderSettings {
    RenderSettings { light_paths, path_reuse: Use::Never, ..common::small(40, 30, 8, 16) }
}

/// Scenes of one geometry.
fn prepared(worlds: &[Scene], settings: &[RenderSettings]) -> Vec<Prepared> {
    let geometry = Arc::new(Geometry::build(&worlds[0]).expect("geometry"));
    let prepare = |(world, settings): (&Scene, &RenderSettings)| {
        Prepared::new(Arc::new(world.clone()), Arc::clone(&geometry), settings).expect("prepared")
    };
    worlds.iter().zip(settings.iter().cycle()).map(prepare).collect()
}

fn with_ball(material: Material) -> Scene {
    let mut world = world();
    world.materials[BALL].item = material;
    world
}

/// A look of every kind that shadows what is behind it.
fn looks() -> Vec<Scene> {
    let mut tinted = glass(0.0);
    tinted.absorption = Rgb::new(2.0, 0.4, 1.0);
    let leaf = Material { thin_walled: true, ..disney(&[(Parameter::DiffTrans, 1.0)]) };
    let looks = [
        metal(0.05),
        metal(0.6),
        lambert(0.7),
        disney(&[(Parameter::Clearcoat, 1.0), (Parameter::Roughness, 0.5)]),
        Material { model: Model::Mirror, ..Material::default() },
        glass(0.3),
        tinted,
        leaf,
    ];
    looks.into_iter().map(with_ball).collect()
}

fn together(scenes: &[Prepared]) -> Vec<Rendered> {
    together_within(None, scenes)
}

fn together_within(time_limit: Option<Duration>, scenes: &[Prepared]) -> Vec<Rendered> {
    let variants = Variants::leading(scenes).expect("a scene");
    assert_eq!(variants.scenes().len(), scenes.len());
    let mut found = Vec::new();
    let control = Control { time_limit, ..Control::default() };
    render_together(&variants, &control, |index, rendered| {
        assert_eq!(index, found.len());
        found.push(rendered);
    });
    found
}

fn bits(rendered: &Rendered) -> (Vec<u32>, &Counts) {
    let channels = rendered.raster.layers.iter().flat_map(|layer| &layer.channels);
    (channels.flat_map(|channel| channel.values.iter().map(|v| v.to_bits())).collect(), &rendered.counts)
}

#[track_caller]
fn assert_the_same(scenes: &[Prepared]) {
    for (index, (together, scene)) in together(scenes).iter().zip(scenes).enumerate() {
        let alone = render(scene, &Control::default());
        assert!(bits(together) == bits(&alone), "look {index}");
        let shared = together.shared_rays as f64 / together.counts.rays as f64;
        assert!((0.3..0.95).contains(&shared), "look {index}: {shared}");
        assert_eq!(alone.shared_rays, 0);
    }
}

#[test]
fn variants_have_the_bits_that_each_has_alone() {
    for light_paths in [Use::Never, Use::Always] {
        let scenes = prepared(&looks(), &[settings(light_paths)]);
        assert!(scenes.iter().all(|scene| scene.has_light_paths() == (light_paths == Use::Always)));
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool(1).install(|| assert_the_same(&scenes));
        pool(3).install(|| assert_the_same(&scenes));
    }
}

/// Blocks in which no path meets what differs are shared whole, of others the paths up to there.
#[test]
fn variants_that_reuse_paths_have_the_bits_that_each_has_alone() {
    let mut looks = looks();
    looks.iter_mut().for_each(|world| world.materials[VEIL].item.opacity = Opacity::default());
    for light_paths in [Use::Never, Use::Always] {
        for error in [None, Some(0.02)] {
            let settings = RenderSettings { path_reuse: Use::Always, error, ..settings(light_paths) };
            let scenes = prepared(&looks, &[settings]);
            assert!(scenes.iter().all(Prepared::has_path_reuse));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
            pool.install(|| assert_the_same(&scenes));
        }
    }
}

/// With neighbours' paths, which the veil forbids, and without; and with all pixels that see the sky alone.
#[test]
fn branches_are_shared_to_the_same_bits() {
    for (is_veiled, path_reuse) in [(true, Use::Never), (false, Use::Always)] {
        let mut looks = looks();
        if !is_veiled {
            looks.iter_mut().for_each(|world| world.materials[VEIL].item.opacity = Opacity::default());
        }
        for (light_paths, error) in [(Use::Never, None), (Use::Always, None), (Use::Never, Some(0.02))] {
            let settings =
                RenderSettings { splitting: Use::Always, path_reuse, error, ..settings(light_paths) };
            let scenes = prepared(&looks, &[settings]);
            assert!(scenes.iter().all(|scene| scene.has_splitting()));
            assert_eq!(scenes.iter().all(Prepared::has_path_reuse), !is_veiled);
            assert_the_same(&scenes);
        }
    }
}

/// Each has its own plan, and they go on together as far as both go.
#[test]
fn variants_that_plan_their_samples_have_the_bits_that_each_has_alone() {
    for (path_reuse, light_paths) in [(Use::Never, Use::Always), (Use::Always, Use::Never)] {
        let mut looks = looks();
        if path_reuse == Use::Always {
            looks.iter_mut().for_each(|world| world.materials[VEIL].item.opacity = Opacity::default());
        }
        let settings = RenderSettings { adaptive: Use::Always, path_reuse, spp: 16, ..settings(light_paths) };
        let scenes = prepared(&looks, &[settings]);
        assert!(scenes.iter().all(Prepared::is_adaptive));
        assert_the_same(&scenes);
        let paths: Vec<u64> = together(&scenes).iter().map(|rendered| rendered.counts.paths).collect();
        assert!(paths.iter().any(|&count| count != paths[0]), "they have different plans: {paths:?}");
    }
}

/// Before a limit of time plans follow each other, between which variants stand at different numbers of samples.
#[test]
fn variants_that_plan_several_times_have_the_bits_that_each_has_alone() {
    let settings = RenderSettings { adaptive: Use::Always, spp: 128, ..settings(Use::Never) };
    let scenes = prepared(&looks()[..3], &[settings]);
    let hour = Duration::from_secs(3600);
    let found = together_within(Some(hour), &scenes);
    for (scene, together) in scenes.iter().zip(&found) {
        let alone = render(scene, &Control { time_limit: Some(hour), ..Control::default() });
        assert!(bits(together) == bits(&alone));
    }
    let paths: Vec<u64> = found.iter().map(|rendered| rendered.counts.paths).collect();
    assert!(paths.iter().any(|&count| count != paths[0]), "they have different plans: {paths:?}");
}

#[test]
fn each_variant_ends_where_its_own_error_is_reached() {
    let settings = RenderSettings { error: Some(0.004), spp: 256, ..settings(Use::Never) };
    let scenes = prepared(&looks(), &[settings]);
    assert_the_same(&scenes);
    let paths: Vec<u64> = together(&scenes).iter().map(|rendered| rendered.counts.paths).collect();
    assert!(paths.iter().any(|&count| count != paths[0]), "they end at different times: {paths:?}");
}

/// How many of a scene and others are rendered together.
fn leading(others: &[Scene], settings: &[RenderSettings]) -> usize {
    let worlds: Vec<Scene> = [world()].into_iter().chain(others.iter().cloned()).collect();
    let scenes = prepared(&worlds, settings);
    Variants::leading(&scenes).expect("a scene").scenes().len()
}

#[test]
fn what_changes_the_way_to_the_differing_surface_is_not_shared() {
    let never = settings(Use::Never);
    let is_alone = |other: Scene| leading(&[other], std::slice::from_ref(&never)) == 1;
    assert!(!is_alone(with_ball(metal(0.9))), "the comparison sees what can be shared");
    assert!(is_alone(with_ball(emitting(lambert(0.5), 1.0))), "a lamp");
    let mut veiled = lambert(0.5);
    veiled.opacity = Opacity { alpha: Param::Constant(0.5), ..Opacity::default() };
    assert!(is_alone(with_ball(veiled)), "a surface that is half there");
    assert!(is_alone(with_ball(Material { thin_walled: true, ..glass(0.0) })), "a clear sheet");

    let changed = |change: &dyn Fn(&mut Scene)| {
        let mut other = world();
        change(&mut other);
        other
    };
    assert!(!is_alone(changed(&|_| ())));
    assert!(is_alone(changed(&|w| w.cameras[0].item.world_from_camera.translation.x += 0.1)), "the camera");
    assert!(is_alone(changed(&|w| w.environment.as_mut().expect("a sky").rotation += 0.1)), "the sky");
    assert!(is_alone(changed(&|w| set_sky(w, [1, 1], vec![0.5]))), "the sky's image");
    assert!(is_alone(changed(&|w| w.instances[0].material.0 = 2)), "an instance's material");

    // The camera in absorbing glass.
    let inside = |absorption: f32| {
        changed(&|w| {
            w.materials[BALL].item = glass(0.0);
            w.materials[BALL].item.absorption = Rgb::grey(absorption);
            w.cameras[0].item = Camera::look_at(Vec3::new(-0.6, 0.5, 0.0), Vec3::ZERO, Vec3::Y, 0.6);
        })
    };
    let scenes = prepared(&[inside(1.0), inside(2.0)], std::slice::from_ref(&never));
    assert_eq!(Variants::leading(&scenes).expect("a scene").scenes().len(), 1, "what the camera is in");
    let scenes = prepared(&[inside(1.0), inside(1.0)], std::slice::from_ref(&never));
    assert_eq!(Variants::leading(&scenes).expect("a scene").scenes().len(), 2);
}

#[test]
fn other_settings_are_not_shared() {
    let never = settings(Use::Never);
    for other in [
        RenderSettings { seed: 7, ..never.clone() },
        RenderSettings { spp: 9, ..never.clone() },
        RenderSettings { max_depth: 3, ..never.clone() },
        settings(Use::Always),
    ] {
        assert_eq!(leading(&[with_ball(metal(0.9))], &[never.clone(), other.clone()]), 1, "{other:?}");
        assert_eq!(leading(&[with_ball(metal(0.9))], &[other.clone(), other]), 2);
    }
    let albedo = RenderSettings { integrator: Integrator::Albedo, ..never };
    assert_eq!(leading(&[with_ball(metal(0.9))], &[albedo]), 1, "only paths are shared");
}

#[test]
fn no_more_scenes_are_taken_than_memory_holds() {
    let many: Vec<Scene> = (0..20).map(|i| with_ball(metal(0.05 * i as f32))).collect();
    assert_eq!(leading(&many, &[settings(Use::Never)]), 16);
    let large = RenderSettings { width: Some(4096), height: Some(2048), ..settings(Use::Never) };
    assert!((2..10).contains(&leading(&many, &[large])));
}
