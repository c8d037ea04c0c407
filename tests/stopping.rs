//! When a render ends: at a number of samples, at an error, or after a time.

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::{lambert, render_scene, scene, small, sphere, square};
use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::render::{Control, Geometry, Prepared, Rendered, render};
use pipeline::scene::environment::Environment;
use pipeline::scene::material::{Material, Param};
use pipeline::scene::{Camera, Scene};
use pipeline::settings::RenderSettings;

/// A ball and its penumbra beside plain sky: some tiles are noisy, others are not.
fn half_noisy() -> Scene {
    let camera = Camera::look_at(Vec3::new(1.0, 1.5, 4.0), Vec3::Y * 0.5, Vec3::Y, 0.8);
    let mut light = lambert(0.0);
    light.emission.color = Param::Constant(Rgb::new(8.0, 6.0, 4.0));
    let mut lamp = square(0.5, 2.5);
    lamp.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let ball = (sphere(0.6, Vec3::Y * 0.6, 16), Material::default());
    let mut world = scene(vec![(square(3.0, 0.0), lambert(0.6)), ball, (lamp, light)], camera);
    world.environment = Some(Environment::constant(Rgb::grey(0.2)));
    world
}

const GOAL: f32 = 0.0004;

fn to_error(seed: u64) -> RenderSettings {
    RenderSettings { error: Some(GOAL), seed, ..small(64, 48, 4096, 6) }
}

fn colours(rendered: &Rendered) -> Vec<f64> {
    let channels = rendered.raster.picture().rgb().expect("colour");
    channels.into_iter().flatten().map(|&v| f64::from(v)).collect()
}

fn samples(rendered: &Rendered) -> Vec<f32> {
    rendered.raster.layer("data").and_then(|d| d.channel("samples")).expect("samples").values.clone()
}

/// The measured error is that asked for, or less, since samples are doubled; and the bias of stopping where samples happen to agree
/// is small.
#[test]
fn a_render_to_an_error_reaches_it_with_little_bias() {
    let world = half_noisy();
    let reference =
        colours(&render_scene(&world, &RenderSettings { seed: 1 << 40, ..small(64, 48, 8192, 6) }));
    let seeds = 24;
    let (mut error, mut sum) = (0.0, 0.0);
    for seed in 0..seeds {
        let found = colours(&render_scene(&world, &to_error(seed)));
        error += found.iter().zip(&reference).map(|(x, r)| (x - r) * (x - r) / (r * r + 0.01)).sum::<f64>();
        sum += found.iter().sum::<f64>();
    }
    let of_goal = error / (seeds as f64 * reference.len() as f64) / f64::from(GOAL);
    assert!((0.3..1.05).contains(&of_goal), "{of_goal} of the goal");
    let bias = sum / seeds as f64 / reference.iter().sum::<f64>() - 1.0;
    assert!(bias.abs() < 0.002, "bias {bias}");
}

#[test]
fn tiles_stop_by_themselves_and_not_before_sixteen_samples() {
    let found = render_scene(&half_noisy(), &to_error(3));
    let mut samples = samples(&found);
    samples.sort_unstable_by(f32::total_cmp);
    samples.dedup();
    assert!(samples.len() > 2 && samples[0] == 16.0 && samples[samples.len() - 1] <= 4096.0, "{samples:?}");
}

#[test]
fn the_error_decides_the_same_with_any_number_of_threads() {
    let world = half_noisy();
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
        pool.install(|| render_scene(&world, &to_error(5)).raster)
    };
    assert_eq!(with_threads(1), with_threads(3));
}

fn within(limit: Duration, settings: &RenderSettings) -> Rendered {
    let world = half_noisy();
    let geometry = Arc::new(Geometry::build(&world).expect("geometry"));
    let prepared = Prepared::new(Arc::new(world), geometry, settings).expect("prepared");
    render(&prepared, &Control { time_limit: Some(limit), ..Control::default() })
}

#[test]
fn time_that_is_over_at_once_leaves_no_hole() {
    let settings = small(64, 48, 1 << 20, 6);
    let samples = samples(&within(Duration::from_nanos(1), &settings));
    assert!(samples.iter().all(|n| *n == settings.parts() as f32));
}

#[test]
fn with_time_to_spare_a_limit_changes_no_bit() {
    let settings = small(64, 48, 24, 6);
    let limited = within(Duration::from_secs(3600), &settings);
    let unlimited = render_scene(&half_noisy(), &settings);
    assert_eq!(limited.raster, unlimited.raster);
    assert_eq!(limited.counts.paths, unlimited.counts.paths);
}
