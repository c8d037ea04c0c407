//! From samples to pictures: how long to go on, and the layers of the result.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use glam::Vec2;
use rayon::prelude::*;

use super::integrators::integrate;
use super::light_image::LightImage;
use super::path::{PathSample, ReplayVertex};
use super::tile::{NAMED_BAD_SAMPLES, Pixel, Tile, levels};
use super::{Prepared, RenderError};
use crate::math::sobol::{Purpose, Sampler};
use crate::raster::{Layer, Raster, Window};
use crate::record::Counts;

/// What others may see of a running render, and how they stop it.
#[derive(Debug, Default)]
pub struct Control {
    /// Camera paths finished so far.
    pub paths: AtomicU64,
    /// Camera paths there will be; 0 until the render begins.
    pub total_paths: AtomicU64,
    /// Stop sampling after so long, if the settings do not end the render before.
    pub time_limit: Option<Duration>,
    /// Set to stop: the render ends with [`RenderError::Cancelled`].
    pub stop: AtomicBool,
}

/// A finished render.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// `beauty` with R, G, B, and `data` with albedo, normal, Z, variance and samples.
    pub raster: Raster,
    /// What was counted.
    pub counts: Counts,
}

/// Renders every pixel on the current rayon pool.
///
/// With the settings' number of samples or error, the bits of the result depend on nothing but the scene and the settings; with a limit
/// of time in `control`, on the machine as well.
///
/// # Errors
/// [`RenderError::Cancelled`] if `control.stop` was set before the end.
pub fn render(scene: &Prepared, control: &Control) -> Result<Rendered, RenderError> {
    let (width, height) = scene.size();
    let most_paths = u64::from(width) * u64::from(height) * u64::from(scene.settings.spp);
    let from_lights = scene.light_paths.as_ref().map_or(0, |plan| plan.paths(scene.settings.spp));
    control.total_paths.store(most_paths + from_lights, Ordering::Relaxed);
    let mut tiles = Tile::all(scene);
    let mut lit = LightImage::new(scene);
    let deadline = control.time_limit.map(|limit| Instant::now() + limit);
    let may_end_early = deadline.is_some() || scene.settings.error.is_some();
    for samples in levels(&scene.settings).filter(|&n| may_end_early || n == scene.settings.spp) {
        // Every tile gets its first samples, also after the deadline: a picture has no holes.
        let is_late = || deadline.is_some_and(|deadline| Instant::now() >= deadline);
        let is_enough = tiles.iter().all(|tile| tile.is_finished);
        if is_enough || (tiles.iter().all(|tile| tile.samples > 0) && is_late()) {
            break;
        }
        lit.sample_up_to(scene, samples, control)?;
        tiles.par_iter_mut().try_for_each(|tile| {
            let ends = tile.samples > 0 && is_late();
            if ends { Ok(()) } else { tile.sample_up_to(scene, samples, &lit, control) }
        })?;
    }

    let mut pixels = vec![Pixel::default(); width as usize * height as usize];
    let rays = lit.rays;
    let mut counts = Counts {
        rays,
        bad_samples: lit.bad_count,
        triangles: scene.geometry.triangle_count() as u64,
        ..Counts::default()
    };
    for mut tile in tiles {
        counts.rays += tile.rays;
        counts.paths += u64::from(tile.samples) * tile.area();
        counts.bad_samples += tile.bad_count;
        counts.first_bad_samples.append(&mut tile.bad);
        for ((x, y), pixel) in tile.pixels(&lit) {
            pixels[y as usize * width as usize + x as usize] = pixel;
        }
    }
    counts.first_bad_samples.sort_unstable_by_key(|b| (b.y, b.x, b.sample));
    counts.first_bad_samples.truncate(NAMED_BAD_SAMPLES);
    Ok(Rendered { raster: layers(scene, &pixels), counts })
}

/// One sample of a pixel: a pure function of scene, settings and the three numbers.
#[inline]
pub(super) fn sample_pixel(
    scene: &Prepared,
    x: u32,
    y: u32,
    sample: u32,
    inspect: impl FnMut(ReplayVertex),
) -> PathSample {
    let settings = &scene.settings;
    // Samples that are sets of their own are independent.
    let sets = if scene.techniques.sobol { settings.effective_replicates() } else { settings.spp };
    let sampler = Sampler::new(settings.seed, x, y, sample, sets);
    let [u0, u1, u2, u3] = sampler.set(0, Purpose::Camera);
    let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    let film = center + Vec2::new(scene.filter.offset(u0), scene.filter.offset(u1));
    integrate(scene, &sampler, scene.camera.ray(film, [u2, u3]), inspect)
}

/// The two parts of the result: `beauty` alone in the first, so that tools that compare first parts compare the picture.
fn layers(scene: &Prepared, pixels: &[Pixel]) -> Raster {
    let window = Window::sized(scene.width, scene.height);
    let plane = |f: &dyn Fn(&Pixel) -> f32| pixels.iter().map(f).collect::<Vec<f32>>();
    let beauty = Layer::new("beauty", window)
        .with("R", plane(&|p| p.beauty.r))
        .with("G", plane(&|p| p.beauty.g))
        .with("B", plane(&|p| p.beauty.b));
    let mut data = Layer::new("data", window)
        .with("Z", plane(&|p| p.depth))
        .with("albedo.R", plane(&|p| p.albedo.r))
        .with("albedo.G", plane(&|p| p.albedo.g))
        .with("albedo.B", plane(&|p| p.albedo.b))
        .with("normal.X", plane(&|p| p.normal.x))
        .with("normal.Y", plane(&|p| p.normal.y))
        .with("normal.Z", plane(&|p| p.normal.z))
        .with("samples", plane(&|p| p.samples as f32));
    // A single replicate has no spread to tell a variance from.
    if scene.settings.effective_replicates() > 1 {
        data = data
            .with("variance.R", plane(&|p| p.variance.r))
            .with("variance.G", plane(&|p| p.variance.g))
            .with("variance.B", plane(&|p| p.variance.b));
    }
    Raster { display: window, layers: vec![beauty, data] }
}
