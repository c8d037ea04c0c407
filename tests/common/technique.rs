//! What is asked of every technique that pictures are made with: whether it is used, why not, and whether its samples can be told again.

use pipeline::render::{Prepared, Rendered, Replay, replay};
use pipeline::scene::Scene;
use pipeline::settings::{RenderSettings, Use};

use super::lit::prepared;
use super::small;

pub(crate) const LIGHT_PATHS: &str = "light paths";
pub(crate) const PATH_REUSE: &str = "reuse of paths";
pub(crate) const SPLITTING: &str = "branches of samples";
pub(crate) const ADAPTIVE: &str = "more samples where it is noisy";

/// A small picture without any of them.
pub(crate) fn plain(spp: u32) -> RenderSettings {
    let never = Use::Never;
    RenderSettings {
        light_paths: never,
        path_reuse: never,
        splitting: never,
        adaptive: never,
        ..small(32, 24, spp, 5)
    }
}

/// What is told of a technique that isn't used.
#[track_caller]
pub(crate) fn why_not(technique: &str, world: &Scene, settings: &RenderSettings) -> Option<String> {
    let prepared = prepared(world, settings);
    let told = prepared.skipped().into_iter().find(|line| line.starts_with(technique));
    let is_used = match technique {
        LIGHT_PATHS => prepared.has_light_paths(),
        PATH_REUSE => prepared.has_path_reuse(),
        SPLITTING => prepared.has_splitting(),
        ADAPTIVE => prepared.is_adaptive(),
        _ => panic!("{technique}?"),
    };
    assert_eq!(told.is_none(), is_used, "{technique}: {told:?}");
    told
}

/// The technique isn't used, and what is told of it contains what is expected.
#[track_caller]
pub(crate) fn assert_not_used(technique: &str, world: &Scene, settings: &RenderSettings, expected: &str) {
    let why = why_not(technique, world, settings).unwrap_or_else(|| panic!("used, not {expected}"));
    assert!(why.contains(expected), "{why}, not {expected}; {settings:?}");
}

/// A pixel's samples, told again, have the mean that the picture has there.
#[track_caller]
pub(crate) fn assert_replayed(
    scene: &Prepared,
    picture: &Rendered,
    (x, y): (u32, u32),
    count: u32,
) -> Vec<Replay> {
    let samples: Vec<Replay> = (0..count).map(|sample| replay(scene, x, y, sample)).collect();
    let mean = samples.iter().map(|sample| f64::from(sample.radiance.g)).sum::<f64>() / f64::from(count);
    let green = picture.raster.picture().rgb().expect("colour")[1];
    let found = f64::from(green[(y * scene.size().0 + x) as usize]);
    assert!((mean - found).abs() < 1e-6 * (1.0 + found), "{x}, {y}: {mean} {found}");
    samples
}
