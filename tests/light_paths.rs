//! Paths from lights: with them pictures have the same mean as without, whatever they go through; and they are there where they pay.

mod common;

use std::sync::Arc;

use common::lit::{
    assert_same_means, assert_same_on_any_threads, camera, clear, dull, leaning, mapped, shiny, submerged,
    sunny, walls,
};
use common::technique::{LIGHT_PATHS, assert_not_used, plain, why_not};
use common::{lambert, scene, small, square};
use pipeline::scene::studio::add_studio_lighting;
use pipeline::settings::{Filter, RenderSettings, Use};

#[test]
fn with_and_without_light_paths_every_part_of_a_picture_has_the_same_mean() {
    for (what, world, filter) in [
        ("shiny", shiny(), Filter::Box),
        ("clear", clear(), Filter::Tent),
        ("mapped", mapped(), Filter::BlackmanHarris),
        ("sunny", sunny(), Filter::Box),
        ("leaning", leaning(), Filter::Box),
        ("submerged", submerged(), Filter::Box),
    ] {
        let without = RenderSettings { filter, ..plain(256) };
        let with = RenderSettings { light_paths: Use::Always, spp: 96, ..without.clone() };
        assert_same_means(what, &Arc::new(world), &with, &without);
    }
}

#[test]
fn light_paths_have_the_same_bits_on_any_number_of_threads() {
    let world = Arc::new(clear());
    for error in [None, Some(0.02)] {
        let (light_paths, path_reuse) = (Use::Always, Use::Never);
        let settings = RenderSettings { light_paths, path_reuse, error, ..small(40, 30, 33, 6) };
        assert_same_on_any_threads(&world, &settings);
    }
}

/// Whatever the seed, and whatever the number of samples.
#[test]
fn light_paths_are_used_where_they_pay() {
    let dull = dull();
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(80, 60, 1 << (seed % 4), 6) };
        assert_eq!(why_not(LIGHT_PATHS, &clear(), &settings), None);
        // Nothing shines.
        assert_not_used(LIGHT_PATHS, &dull, &settings, "they would leave");
    }
}

/// What both find well under an even sky, light paths find with more noise.
#[test]
fn light_paths_are_left_out_in_the_open() {
    let mut open = scene(vec![(square(2.0, 0.0), lambert(0.8))], camera());
    add_studio_lighting(&mut open);
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(80, 60, 16, 6) };
        assert_not_used(LIGHT_PATHS, &open, &settings, "they would leave");
    }
}

#[test]
fn what_keeps_light_paths_away_is_told() {
    let usual = RenderSettings { light_paths: Use::Always, ..small(8, 8, 1, 6) };
    let mut parallel = clear();
    parallel.cameras[0].item.projection =
        pipeline::scene::camera::Projection::Orthographic { half_height: 1.0 };
    let unlit = scene(walls(), camera());
    let cases = [
        (clear(), RenderSettings { light_paths: Use::Never, ..usual.clone() }, "the settings ask for none"),
        (clear(), RenderSettings { mis: false, ..usual.clone() }, "weighed against both"),
        (clear(), RenderSettings { max_depth: 0, ..usual.clone() }, "no light is scattered"),
        (clear(), RenderSettings { filter: Filter::Point, ..usual.clone() }, "the filter is a point"),
        (parallel, usual.clone(), "the camera's rays are parallel"),
        (unlit, usual.clone(), "no surface emits light"),
    ];
    for (world, settings, expected) in cases {
        assert_not_used(LIGHT_PATHS, &world, &settings, expected);
    }
    assert_eq!(why_not(LIGHT_PATHS, &clear(), &usual), None);
}
