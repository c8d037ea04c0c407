//! What the film says about itself: determinism, and a variance that is the variance.

mod common;

use common::{lambert, render_scene, scene, small, sphere, square};
use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::scene::environment::Environment;
use pipeline::scene::{Camera, Scene};
use pipeline::settings::RenderSettings;

fn test_scene() -> Scene {
    let camera = Camera::look_at(Vec3::new(1.0, 1.5, 4.0), Vec3::Y * 0.5, Vec3::Y, 0.6);
    let mut light = lambert(0.0);
    light.emission.color = pipeline::scene::material::Param::Constant(Rgb::new(8.0, 6.0, 4.0));
    let mut world = scene(
        vec![
            (square(3.0, 0.0), lambert(0.6)),
            (sphere(0.6, Vec3::Y * 0.6, 16), pipeline::scene::Material::default()),
            (square(0.5, 2.5), light.clone()),
        ],
        camera,
    );
    // The light faces down.
    let mut lamp = (*world.meshes[2]).clone();
    lamp.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    world.meshes[2] = std::sync::Arc::new(lamp);
    world.environment = Some(Environment::constant(Rgb::grey(0.2)));
    world
}

#[test]
fn one_and_many_threads_give_the_same_bits() {
    let world = test_scene();
    let settings = small(50, 37, 7, 8);
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
        pool.install(|| render_scene(&world, &settings))
    };
    let one = with_threads(1);
    for n in [2, 5] {
        let many = with_threads(n);
        assert_eq!(one.raster, many.raster);
        assert_eq!(one.counts, many.counts);
    }
}

/// Samples are numbered within powers of two, so that the pixels of a square complete each other.
#[test]
fn a_longer_render_begins_with_the_shorter_one_s_samples_up_to_the_next_power_of_two() {
    use pipeline::render::{Geometry, Prepared, replay};
    use pipeline::settings::Use;
    use std::sync::Arc;
    let world = Arc::new(test_scene());
    let geometry = Arc::new(Geometry::build(&world).expect("geometry"));
    let prepared = |spp| {
        let settings = RenderSettings { adaptive: Use::Never, ..small(20, 20, spp, 8) };
        Prepared::new(world.clone(), geometry.clone(), &settings).expect("prepared")
    };
    let (short, long, longer) = (prepared(33), prepared(64), prepared(65));
    for sample in 0..33 {
        assert_eq!(replay(&short, 11, 9, sample), replay(&long, 11, 9, sample));
        assert!(replay(&short, 11, 9, sample) != replay(&longer, 11, 9, sample));
    }
}

/// The variance layer's mean and the spread of the pixels over 256 seeds, both pooled over the image, whose neighbours are not independent.
fn claimed_and_spread(replicates: u32) -> (f64, f64) {
    let world = test_scene();
    let mut settings = RenderSettings { replicates, ..small(24, 18, 16, 6) };
    let seeds = 256;
    let n = 24 * 18;
    let (mut sum, mut square_sum, mut claimed) = (vec![0.0f64; n], vec![0.0f64; n], 0.0);
    for seed in 0..seeds {
        settings.seed = seed;
        let rendered = render_scene(&world, &settings);
        let [_, g, _] = rendered.raster.picture().rgb().expect("colour");
        let variance =
            &rendered.raster.layer("data").and_then(|d| d.channel("variance.G")).expect("variance").values;
        for i in 0..n {
            sum[i] += f64::from(g[i]);
            square_sum[i] += f64::from(g[i]) * f64::from(g[i]);
            claimed += f64::from(variance[i]) / seeds as f64;
        }
    }
    let spread = (0..n).map(|i| (square_sum[i] - sum[i] * sum[i] / seeds as f64) / (seeds - 1) as f64).sum();
    (claimed, spread)
}

#[test]
fn variance_of_replicates_is_the_spread_over_seeds() {
    let (claimed, spread) = claimed_and_spread(2);
    let ratio = claimed / spread;
    assert!((ratio - 1.0).abs() < 0.06, "claimed {claimed:e}, spread {spread:e}, ratio {ratio}");
}

/// The halves of one set complete each other: their spread is more than that of the whole, which is less than with two sets.
#[test]
fn a_single_replicate_makes_less_noise_and_tells_more() {
    let (_, of_two) = claimed_and_spread(2);
    let (claimed, spread) = claimed_and_spread(1);
    assert!(spread < 0.95 * of_two, "one set {spread:e}, two {of_two:e}");
    let ratio = claimed / spread;
    assert!((1.0..1.6).contains(&ratio), "claimed {claimed:e}, spread {spread:e}, ratio {ratio}");
}

#[test]
fn a_single_sample_tells_no_variance() {
    let rendered = render_scene(&test_scene(), &small(8, 6, 1, 6));
    let data = rendered.raster.layer("data").expect("data");
    assert!(data.channel("variance.G").is_none() && data.channel("samples").is_some());
}
