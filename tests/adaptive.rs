//! Noisy parts of a picture get more samples than others: pictures have the same mean, and less noise for as many rays.

mod common;

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use common::lit::{
    assert_same_means, assert_same_on_any_threads, bottled, covered, dull, error_and_rays, lamp, leaning,
    open, prepared, rendered, rendered_within, shiny,
};
use common::technique::{ADAPTIVE, assert_not_used, assert_replayed, plain, why_not};
use common::{lambert, metal, scene, small};
use glam::Vec3;
use pipeline::render::Rendered;
use pipeline::settings::{Filter, Integrator, RenderSettings, Use};

fn planned(settings: RenderSettings) -> RenderSettings {
    RenderSettings { adaptive: Use::Always, ..settings }
}

fn samples(rendered: &Rendered) -> Vec<u32> {
    let data = rendered.raster.layer("data").expect("data");
    data.channel("samples").expect("samples").values.iter().map(|&n| n as u32).collect()
}

/// The fewest samples make the noisiest plans: were they planned by what they find themselves, the mean would be off.
#[test]
fn with_and_without_plans_every_part_of_a_picture_has_the_same_mean() {
    for (what, world, filter) in [
        ("open", open(0.5), Filter::Box),
        ("dull", dull(), Filter::Box),
        ("shiny", shiny(), Filter::Tent),
        ("bottled", bottled(), Filter::Box),
        ("covered", covered(), Filter::BlackmanHarris),
    ] {
        let world = Arc::new(world);
        for other in [Use::Never, Use::Always] {
            let others =
                RenderSettings { light_paths: other, path_reuse: other, splitting: other, ..plain(128) };
            let without = RenderSettings { filter, ..others };
            let with = planned(RenderSettings { spp: 96, ..without.clone() });
            assert_same_means(&format!("{what}, others {other:?}"), &world, &with, &without);
        }
    }
}

/// Thousands of short renders of what few paths find: the mean of each is known to a part in a hundred. A patch that went on as long as its own
/// samples disagree would have some percent less.
#[test]
fn rare_light_is_not_lost_by_plans() {
    let mut parts = vec![(common::square(2.0, 0.0), lambert(0.6)), lamp()];
    parts.push((common::lit::ball(0.5, Vec3::new(-0.5, 0.5, 0.0)), metal(0.15)));
    let world = Arc::new(scene(parts, common::lit::camera()));
    let total = |settings: &RenderSettings, limit, seeds: std::ops::Range<u64>| {
        let of_seed = |seed| {
            common::mean(&rendered_within(limit, &world, &RenderSettings { seed, ..settings.clone() }))
        };
        let totals: Vec<f64> = seeds.map(of_seed).collect();
        let n = totals.len() as f64;
        let mean = totals.iter().sum::<f64>() / n;
        let variance = totals.iter().map(|t| (t - mean) * (t - mean)).sum::<f64>() / (n * (n - 1.0));
        (mean, variance)
    };
    let tiny = |spp| RenderSettings { width: Some(16), height: Some(12), ..plain(spp) };
    let (b, vb) = total(&tiny(512), None, 10_000..10_100);
    // With a limit of time one plan follows the other: for 32 samples, for 64 and for 128.
    for (spp, limit, seeds) in [(16, None, 2000), (128, Some(Duration::from_secs(3600)), 400)] {
        let (a, va) = total(&planned(tiny(spp)), limit, 0..seeds);
        let sigma = (va + vb).sqrt();
        assert!(sigma < 0.004 * b, "or the test could not fail: {b} ± {sigma}");
        assert!((a - b).abs() < 3.5 * sigma, "{spp}: {a} {b} ± {sigma}");
    }
}

#[test]
fn plans_have_the_same_bits_on_any_number_of_threads() {
    let world = Arc::new(shiny());
    for other in [Use::Never, Use::Always] {
        let settings =
            RenderSettings { light_paths: other, path_reuse: other, splitting: other, ..plain(33) };
        assert_same_on_any_threads(&world, &planned(settings));
    }
}

/// A pixel's samples can be told again, however many there are.
#[test]
fn replayed_samples_have_the_mean_that_the_picture_has() {
    for (world, path_reuse) in [(shiny(), Use::Never), (shiny(), Use::Always), (leaning(), Use::Never)] {
        let settings = planned(RenderSettings { path_reuse, ..plain(16) });
        let picture = rendered(&Arc::new(world.clone()), &settings);
        let counts = samples(&picture);
        let scene = prepared(&world, &settings);
        let mut numbers = BTreeSet::new();
        for pixel in (0..32 * 24).step_by(23) {
            let count = counts[pixel as usize];
            assert_replayed(&scene, &picture, (pixel % 32, pixel / 32), count);
            numbers.insert(count);
        }
        assert!(numbers.len() > 2, "{numbers:?}");
    }
}

/// Within a quarter and eight times the settings' samples, by twos, for about as many rays.
#[test]
fn in_the_open_plans_take_noise_away_for_as_many_rays() {
    let world = Arc::new(open(0.5));
    let even = RenderSettings { width: Some(64), height: Some(48), ..plain(32) };
    let long = RenderSettings { seed: 99, spp: 2048, ..even.clone() };
    let with = planned(even.clone());
    let of = |settings: &RenderSettings| error_and_rays(&world, settings, &long);
    let ((error, rays), (before, rays_before)) = (of(&with), of(&even));
    assert!(error < 0.6 * before && error > 0.05 * before, "{error} {before}");
    assert!(rays < 1.05 * rays_before && rays > 0.8 * rays_before, "{rays} {rays_before}");
    let picture = rendered(&world, &with);
    let numbers = samples(&picture);
    assert!(numbers.iter().all(|n| [8, 16, 32, 64, 128, 256].contains(n)));
    assert_eq!(numbers.iter().map(|&n| u64::from(n)).sum::<u64>(), picture.counts.paths);
    let (sky, ball) = (numbers[0], numbers[24 * 64 + 32]);
    assert!(sky == 8 && ball > 32, "{sky} {ball}");
}

/// Though nobody knows how many there will be.
#[test]
fn in_the_open_a_limit_of_time_leaves_samples_to_what_is_noisy() {
    let world = Arc::new(open(0.5));
    let settings = planned(RenderSettings { width: Some(64), height: Some(48), ..plain(1 << 16) });
    let numbers = samples(&rendered_within(Some(Duration::from_secs(2)), &world, &settings));
    let (sky, ball) = (numbers[0], numbers[24 * 64 + 32]);
    // Plans go by doublings, between which the sky may go first, and time may be up before it comes to the ball.
    assert!(sky >= 16 && ball >= 2 * sky, "{sky} {ball}");
}

#[test]
fn with_time_to_spare_a_limit_changes_no_bit_of_a_plan_that_begins_alike() {
    let world = Arc::new(open(0.5));
    for spp in [24, 64] {
        let settings = planned(RenderSettings { width: Some(64), height: Some(48), ..plain(spp) });
        let limited = rendered_within(Some(Duration::from_secs(3600)), &world, &settings);
        let unlimited = rendered(&world, &settings);
        assert_eq!(limited.raster, unlimited.raster, "{spp}");
        assert_eq!(limited.counts.paths, unlimited.counts.paths);
    }
}

#[test]
fn where_nothing_is_noisy_all_pixels_have_as_many_samples() {
    let mut world = scene(vec![(common::cube(0.5), lambert(0.0))], common::lit::camera());
    world.lights.clear();
    world.environment = None;
    let picture = rendered(&Arc::new(world), &planned(plain(16)));
    assert!(samples(&picture).iter().all(|&n| n == 16));
}

/// Whatever the seed, and whatever the number of samples.
#[test]
fn samples_are_planned_where_much_of_the_picture_is_sky() {
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(240, 180, 16 << (seed % 4), 6) };
        assert_eq!(why_not(ADAPTIVE, &open(0.5), &settings), None, "{seed}");
        assert_eq!(prepared(&open(0.5), &settings).most_samples(), 8 * settings.spp);
        let alone = RenderSettings { path_reuse: Use::Never, ..settings.clone() };
        assert_not_used(ADAPTIVE, &dull(), &alone, "of the picture");
        // Where neighbours see alike, large blocks are better, unless plans are asked for.
        assert_not_used(ADAPTIVE, &dull(), &settings, "pixels of large blocks");
        assert_eq!(prepared(&dull(), &settings).most_samples(), settings.spp);
        let asked = prepared(&dull(), &planned(settings));
        assert_eq!((asked.is_adaptive(), asked.reuse_block()), (true, Some((2, 2))), "{seed}");
    }
}

/// A lamp in a glass ball, of whose light the first samples find too little to tell where it makes noise.
#[test]
fn where_light_is_seldom_found_samples_are_not_planned() {
    let place = Vec3::Y * 1.2;
    let lamp = (common::lit::ball(0.1, place), common::emitting(lambert(0.0), 50.0));
    let parts = vec![
        lamp,
        (common::lit::ball(0.4, place), common::glass(0.0)),
        (common::square(1.0, 0.0), lambert(0.7)),
    ];
    let lantern = scene(parts, common::lit::camera());
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(120, 90, 64, 6) };
        assert_not_used(ADAPTIVE, &lantern, &settings, "paths from the lights");
        // It is not for want of sky.
        let alone = RenderSettings { light_paths: Use::Never, path_reuse: Use::Never, ..settings };
        assert_eq!(why_not(ADAPTIVE, &lantern, &alone), None, "{seed}");
    }
}

#[test]
fn what_keeps_samples_from_being_planned_is_told() {
    let usual = planned(plain(16));
    let cases = [
        (RenderSettings { adaptive: Use::Never, ..usual.clone() }, "the settings ask for none"),
        (RenderSettings { integrator: Integrator::Normals, ..usual.clone() }, "no paths are traced"),
        (RenderSettings { error: Some(0.01), ..usual.clone() }, "until the error is small enough"),
        (RenderSettings { spp: 15, ..usual.clone() }, "so few samples"),
    ];
    for (settings, expected) in cases {
        assert_not_used(ADAPTIVE, &dull(), &settings, expected);
    }
    assert_eq!(why_not(ADAPTIVE, &dull(), &usual), None);
}
