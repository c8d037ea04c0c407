//! Samples branch at their first surface: with that pictures have the same mean as without, and less noise where it pays.

mod common;

use std::sync::Arc;

use common::lit::{
    assert_same_means, assert_same_on_any_threads, ball, bottled, camera, covered, dull, error_and_rays,
    lamp, leaning, open, prepared, rendered, shiny, sunny,
};
use common::technique::{SPLITTING, assert_not_used, assert_replayed, plain, why_not};
use common::{emitting, lambert, scene, set_sky, small};
use glam::Vec3;
use pipeline::settings::{Filter, Integrator, RenderSettings, Use};

#[test]
fn with_and_without_branches_every_part_of_a_picture_has_the_same_mean() {
    for (what, world, filter) in [
        ("open", open(0.5), Filter::Box),
        ("dull", dull(), Filter::Box),
        ("shiny", shiny(), Filter::Tent),
        ("bottled", bottled(), Filter::Box),
        ("covered", covered(), Filter::BlackmanHarris),
        ("sunny", sunny(), Filter::Box),
    ] {
        let world = Arc::new(world);
        for other in [Use::Never, Use::Always] {
            // Camera paths alone find the sun's reflection too rarely to tell a mean.
            if what == "sunny" && other == Use::Never {
                continue;
            }
            let without = RenderSettings { filter, light_paths: other, path_reuse: other, ..plain(128) };
            let with = RenderSettings { splitting: Use::Always, spp: 96, ..without.clone() };
            assert_same_means(&format!("{what}, others {other:?}"), &world, &with, &without);
        }
    }
}

#[test]
fn branches_have_the_same_bits_on_any_number_of_threads() {
    let world = Arc::new(shiny());
    for (path_reuse, error) in [(Use::Never, None), (Use::Always, None), (Use::Always, Some(0.02))] {
        let settings = RenderSettings { path_reuse, error, ..plain(33) };
        let settings = RenderSettings { splitting: Use::Always, ..settings };
        assert_same_on_any_threads(&world, &settings);
    }
}

/// What a replay tells of a pixel's samples is what the picture has there, and it tells both branches: they begin at the same place.
#[test]
fn replayed_samples_have_the_mean_that_the_picture_has() {
    for (world, path_reuse) in
        [(shiny(), Use::Never), (shiny(), Use::Always), (leaning(), Use::Never), (open(0.5), Use::Never)]
    {
        let settings = RenderSettings { path_reuse, splitting: Use::Always, ..plain(16) };
        let picture = rendered(&Arc::new(world.clone()), &settings);
        let scene = prepared(&world, &settings);
        let mut unlike = 0;
        for place in [(5, 7), (16, 12), (17, 13), (31, 10), (20, 20)] {
            for sample in assert_replayed(&scene, &picture, place, 16) {
                let [a, b] = &sample.branches[..] else { panic!("{} branches", sample.branches.len()) };
                assert_eq!(a.first(), b.first());
                unlike += u32::from(a != b);
            }
        }
        assert!(unlike > 0 || path_reuse == Use::Never);
    }
}

/// Half the noise for few more rays: those that see the sky are traced once.
#[test]
fn in_the_open_branches_halve_the_noise_for_few_rays() {
    let world = Arc::new(open(0.5));
    let without = plain(16);
    let with = RenderSettings { splitting: Use::Always, ..without.clone() };
    let long = RenderSettings { seed: 99, ..plain(2048) };
    let (with, without) = (error_and_rays(&world, &with, &long), error_and_rays(&world, &without, &long));
    assert!(with.0 < 0.6 * without.0 && with.0 > 0.2 * without.0, "{with:?} {without:?}");
    assert!(with.1 > without.1 && with.1 < 1.3 * without.1, "{with:?} {without:?}");
}

/// Whatever the seed, and whatever the number of samples.
#[test]
fn samples_branch_where_it_pays() {
    // What glows is seen, and makes noise at its edges.
    let places = (0..15).map(|i| Vec3::new((i % 5) as f32 * 0.4 - 0.8, (i / 5) as f32 * 0.4 + 0.6, 0.0));
    let balls = places.map(|place| (ball(0.1, place), emitting(lambert(0.5), 5.0)));
    let mut glowing = scene(balls.collect(), camera());
    set_sky(&mut glowing, [1, 1], vec![0.2]);
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(240, 180, 1 << (seed % 4), 6) };
        assert_eq!(why_not(SPLITTING, &open(0.5), &settings), None, "{seed}");
        for (world, expected) in [
            (dull(), "finding first surfaces is little of the work"),
            (open(1.4), "finding first surfaces is little of the work"),
            (glowing.clone(), "of the noise is of what is seen"),
        ] {
            assert_not_used(SPLITTING, &world, &settings, expected);
        }
    }
}

#[test]
fn what_keeps_samples_from_branching_is_told() {
    let usual = RenderSettings { splitting: Use::Always, ..plain(1) };
    let cases = [
        (RenderSettings { splitting: Use::Never, ..usual.clone() }, "the settings ask for none"),
        (RenderSettings { integrator: Integrator::Normals, ..usual.clone() }, "no paths go on"),
        (RenderSettings { max_depth: 0, ..usual.clone() }, "no light is scattered"),
    ];
    let world = scene(vec![(ball(0.5, Vec3::Y), lambert(0.6)), lamp()], camera());
    for (settings, expected) in cases {
        assert_not_used(SPLITTING, &world, &settings, expected);
    }
    assert_eq!(why_not(SPLITTING, &world, &usual), None);
}
