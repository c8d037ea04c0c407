//! Neighbouring pixels use each other's paths: with that pictures have the same mean as without, and less noise where it pays.

mod common;

use std::sync::Arc;

use common::lit::{
    assert_same_means, assert_same_on_any_threads, ball, bottled, camera, clear, covered, dull,
    error_and_rays, facing, lamp, leaning, prepared, rendered, shiny, sunny, walls,
};
use common::technique::{PATH_REUSE, assert_not_used, assert_replayed, plain, why_not};
use common::{lambert, metal, scene, small};
use glam::Vec3;
use pipeline::scene::{Camera, Scene};
use pipeline::settings::{Filter, RenderSettings, Use};

const SMALL: (u32, u32) = (2, 2);
const LARGE: (u32, u32) = (4, 2);
const LARGEST: (u32, u32) = (4, 4);

/// In blocks of each size.
#[test]
fn with_and_without_path_reuse_every_part_of_a_picture_has_the_same_mean() {
    let mut blocks = std::collections::BTreeSet::new();
    for (what, world, filter) in [
        ("dull", dull(), Filter::Box),
        ("uneven", dull(), Filter::Box),
        ("shiny", shiny(), Filter::Tent),
        ("bottled", bottled(), Filter::Box),
        ("covered", covered(), Filter::BlackmanHarris),
        ("sunny", sunny(), Filter::Box),
        ("leaning", leaning(), Filter::Box),
    ] {
        let world = Arc::new(world);
        for light_paths in [Use::Never, Use::Always] {
            // Camera paths alone find the sun's reflection too rarely to tell a mean.
            if what == "sunny" && light_paths == Use::Never {
                continue;
            }
            // In a small picture the pilot looks at so few blocks that their size is a matter of chance.
            let size = if what == "dull" { small(128, 96, 16, 5) } else { small(32, 24, 256, 5) };
            let RenderSettings { width, height, spp, .. } = size;
            let without = RenderSettings { filter, light_paths, width, height, ..plain(spp) };
            // Pixels of small blocks may have numbers of samples of their own.
            let adaptive = if what == "uneven" { Use::Always } else { Use::Never };
            let with =
                RenderSettings { path_reuse: Use::Always, adaptive, spp: spp * 3 / 8, ..without.clone() };
            assert_same_means(&format!("{what}, light paths {light_paths:?}"), &world, &with, &without);
            blocks.extend(prepared(&world, &with).reuse_block());
        }
    }
    assert_eq!(Vec::from_iter(blocks), [SMALL, LARGE, LARGEST]);
}

/// Blocks at the edges are smaller.
#[test]
fn path_reuse_has_the_same_bits_on_any_number_of_threads() {
    let world = Arc::new(shiny());
    for (light_paths, error) in [(Use::Never, None), (Use::Always, None), (Use::Always, Some(0.02))] {
        let settings = RenderSettings { light_paths, path_reuse: Use::Always, error, ..small(41, 31, 33, 6) };
        assert_same_on_any_threads(&world, &settings);
    }
}

/// What a replay tells of a pixel's samples is what the picture has there, also in a block that the edge cuts off.
#[test]
fn replayed_samples_have_the_mean_that_the_picture_has() {
    let usual = RenderSettings { path_reuse: Use::Always, ..plain(16) };
    let mut blocks = std::collections::BTreeSet::new();
    for (world, width) in [(dull(), 65), (shiny(), 33), (bottled(), 33), (leaning(), 33)] {
        let settings = RenderSettings { width: Some(width), ..usual.clone() };
        let picture = rendered(&Arc::new(world.clone()), &settings);
        let scene = prepared(&world, &settings);
        blocks.extend(scene.reuse_block());
        for place in [(5, 7), (16, 12), (17, 13), (32, 10), (20, 20)] {
            assert_replayed(&scene, &picture, place, 16);
        }
    }
    assert_eq!(Vec::from_iter(blocks), [LARGE, LARGEST]);
}

#[test]
fn indirect_light_has_less_than_half_the_error() {
    let world = Arc::new(dull());
    let without = plain(16);
    let with = RenderSettings { path_reuse: Use::Always, ..without.clone() };
    let long = RenderSettings { seed: 99, ..plain(2048) };
    let error = |settings: &RenderSettings| error_and_rays(&world, settings, &long).0;
    let (with, without) = (error(&with), error(&without));
    assert!(with < 0.6 * without && with > 0.1 * without, "{with} {without}");
}

/// Whatever the seed, and whatever the number of samples.
#[test]
fn paths_are_reused_where_it_pays() {
    // Nothing but direct light.
    let open = scene(vec![(common::square(2.0, 0.0), lambert(0.3)), lamp()], camera());
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(80, 60, 1 << (seed % 4), 6) };
        assert_eq!(why_not(PATH_REUSE, &dull(), &settings), None);
        assert_not_used(PATH_REUSE, &open, &settings, "it would leave");
    }
}

/// Balls that are all but mirrors, in a room of them.
fn mirrors() -> Scene {
    let walls = walls().into_iter().map(|(mesh, _)| (mesh, metal(0.05)));
    let ball = |radius, center| (ball(radius, center), metal(0.05));
    let balls = [ball(0.55, Vec3::new(-0.7, 0.6, 0.0)), ball(0.4, Vec3::new(0.6, 0.4, 0.5))];
    scene(walls.chain(balls).chain([lamp()]).collect(), camera())
}

/// Where all reflect light evenly; but in a mirror what one pixel sees is no use to another.
#[test]
fn blocks_are_as_large_as_neighbours_see_alike() {
    for seed in 0..8 {
        let settings = RenderSettings { seed, ..small(240, 180, 1 << (seed % 4), 6) };
        assert_eq!(prepared(&dull(), &settings).reuse_block(), Some(LARGEST), "{seed}");
        assert_eq!(prepared(&mirrors(), &settings).reuse_block(), None, "{seed}");
    }
}

#[test]
fn what_keeps_paths_from_being_reused_is_told() {
    let usual = RenderSettings { path_reuse: Use::Always, ..plain(1) };
    let cases = [
        (dull(), RenderSettings { path_reuse: Use::Never, ..usual.clone() }, "the settings ask for none"),
        (dull(), RenderSettings { nee: false, ..usual.clone() }, "both ways to find light"),
        (dull(), RenderSettings { max_depth: 1, ..usual.clone() }, "no light is scattered twice"),
        (clear(), usual.clone(), "some surface lets light go straight through"),
    ];
    for (world, settings, expected) in cases {
        assert_not_used(PATH_REUSE, &world, &settings, expected);
    }
    assert_eq!(why_not(PATH_REUSE, &dull(), &usual), None);
}

/// A wall stands in the middle of a block, between a lit and a dark half: what is seen from one side of it must not be lit from the other.
#[test]
fn a_neighbour_behind_a_wall_gets_no_light_through_it() {
    let towards = |x: f32| facing(1.0, Vec3::new(x, 1.0, 0.0), -Vec3::X * x.signum());
    let lamp = facing(0.3, Vec3::new(0.5, 2.0, 0.0), -Vec3::Y);
    let parts = vec![
        (common::square(1.0, 0.0), lambert(0.5)),
        (towards(-1.0), lambert(0.8)),
        (towards(1.0), lambert(0.8)),
        (towards(0.0), lambert(0.5)),
        (lamp, common::emitting(lambert(0.0), 10.0)),
    ];
    let above = Camera::look_at(Vec3::Y * 5.0, Vec3::ZERO, Vec3::Z, 0.3);
    // The middle of the picture is that of its ninth block.
    let settings =
        RenderSettings { path_reuse: Use::Always, ..RenderSettings { width: Some(34), ..plain(64) } };
    let picture = rendered(&Arc::new(scene(parts, above)), &settings).raster;
    let green = &picture.picture().rgb().expect("colour")[1];
    let column = |x: usize| (0..24).map(|y| f64::from(green[y * 34 + x])).sum::<f64>();
    let (dark, lit) = (column(16).min(column(17)), column(16).max(column(17)));
    assert!(lit > 1.0 && dark < 1e-6 * lit, "{dark} {lit}");
}
