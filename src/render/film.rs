//! From samples to pixels: replicate sums, layers, and the tiles that threads work on.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::integrators::integrate;
use super::path::{PathSample, ReplayVertex};
use super::{Prepared, RenderError};
use crate::color::Rgb;
use crate::math::sobol::{Purpose, Sampler};
use crate::raster::{Layer, Raster, Window};
use crate::record::{BadSample, Counts};

/// The side of a tile in pixels: small enough to share the work out, large enough that rays stay together.
const TILE: u32 = 16;
/// How many bad samples are told by name.
const NAMED_BAD_SAMPLES: usize = 16;
/// The most replicates that settings allow.
const MAX_REPLICATES: usize = 64;

/// What others may see of a running render, and how they stop it.
#[derive(Debug, Default)]
pub struct Control {
    /// Camera paths finished so far.
    pub paths: AtomicU64,
    /// Camera paths there will be; 0 until the render begins.
    pub total_paths: AtomicU64,
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

/// One pixel's result: means over all its samples, where a sample that hits nothing has albedo and normal 0; the depth is the mean
/// over those that hit something.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    beauty: Rgb,
    /// Of the pixel's mean.
    variance: Rgb,
    albedo: Rgb,
    normal: Vec3,
    depth: f32,
    samples: u32,
}

#[derive(Debug, Default)]
struct Tile {
    pixels: Vec<Pixel>,
    rays: u64,
    bad_count: u64,
    /// The first of them.
    bad: Vec<BadSample>,
}

/// Renders every pixel on the current rayon pool. The bits of the result depend on nothing but the scene and the settings.
///
/// # Errors
/// [`RenderError::Cancelled`] if `control.stop` was set before the end.
pub fn render(scene: &Prepared, control: &Control) -> Result<Rendered, RenderError> {
    let (width, height) = scene.size();
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let total_paths = u64::from(width) * u64::from(height) * u64::from(scene.settings.spp);
    control.total_paths.store(total_paths, Ordering::Relaxed);
    let tiles: Vec<Tile> = (0..columns * rows)
        .into_par_iter()
        .map(|i| render_tile(scene, i % columns * TILE, i / columns * TILE, control))
        .collect::<Result<_, _>>()?;

    let mut pixels = vec![Pixel::default(); width as usize * height as usize];
    let mut counts = Counts { triangles: scene.geometry.triangle_count() as u64, ..Counts::default() };
    for (i, tile) in tiles.into_iter().enumerate() {
        let (x0, y0) = (i as u32 % columns * TILE, i as u32 / columns * TILE);
        let tile_width = TILE.min(width - x0) as usize;
        for (row, line) in tile.pixels.chunks(tile_width).enumerate() {
            let start = (y0 as usize + row) * width as usize + x0 as usize;
            pixels[start..start + tile_width].copy_from_slice(line);
        }
        counts.rays += tile.rays;
        counts.bad_samples += tile.bad_count;
        counts.first_bad_samples.extend(tile.bad);
    }
    counts.paths = total_paths;
    counts.first_bad_samples.sort_unstable_by_key(|b| (b.y, b.x, b.sample));
    counts.first_bad_samples.truncate(NAMED_BAD_SAMPLES);
    Ok(Rendered { raster: layers(scene, &pixels), counts })
}

fn render_tile(scene: &Prepared, x0: u32, y0: u32, control: &Control) -> Result<Tile, RenderError> {
    let mut tile = Tile::default();
    for y in y0..(y0 + TILE).min(scene.height) {
        for x in x0..(x0 + TILE).min(scene.width) {
            if control.stop.load(Ordering::Relaxed) {
                return Err(RenderError::Cancelled);
            }
            let pixel = render_pixel(scene, x, y, &mut tile);
            tile.pixels.push(pixel);
            control.paths.fetch_add(u64::from(scene.settings.spp), Ordering::Relaxed);
        }
    }
    Ok(tile)
}

/// All samples of a pixel. Sums are f64: thousands of samples must not lose what one of them adds.
fn render_pixel(scene: &Prepared, x: u32, y: u32, tile: &mut Tile) -> Pixel {
    let replicates = scene.settings.effective_replicates() as usize;
    let mut sums = [Rgb::<f64>::BLACK; MAX_REPLICATES];
    let mut counts = [0u32; MAX_REPLICATES];
    let mut albedo = Rgb::<f64>::BLACK;
    let mut normal = glam::DVec3::ZERO;
    let (mut depth, mut hits) = (0.0f64, 0u32);
    for sample in 0..scene.settings.spp {
        let path = sample_pixel(scene, x, y, sample, |_| ());
        tile.rays += path.rays;
        let r = path.radiance;
        if !r.is_finite() || r.r < 0.0 || r.g < 0.0 || r.b < 0.0 {
            tile.bad_count += 1;
            if tile.bad.len() < NAMED_BAD_SAMPLES {
                tile.bad.push(BadSample { x, y, sample });
            }
            continue;
        }
        let replicate = sample as usize % replicates;
        sums[replicate] += r.cast();
        counts[replicate] += 1;
        if let Some(first) = path.first {
            albedo += first.albedo.cast();
            normal += first.normal.as_dvec3();
            depth += f64::from(first.depth);
            hits += 1;
        }
    }
    let samples: u32 = counts[..replicates].iter().sum();
    let n = f64::from(samples.max(1));
    let beauty = sums[..replicates].iter().fold(Rgb::BLACK, |a, &b| a + b) / n;
    Pixel {
        beauty: beauty.cast(),
        variance: variance_of_mean(&sums[..replicates], &counts[..replicates], beauty).cast().map(shortened),
        albedo: (albedo / n).cast(),
        normal: (normal / n).as_vec3(),
        depth: if hits > 0 { (depth / f64::from(hits)) as f32 } else { 0.0 },
        samples,
    }
}

/// The variance of the pixel's mean from the spread of its replicates' means, each weighed by its share of the samples: with equal
/// shares, their sample variance divided by their number. 0 with a single replicate, which has no spread.
fn variance_of_mean(sums: &[Rgb<f64>], counts: &[u32], mean: Rgb<f64>) -> Rgb<f64> {
    let filled = counts.iter().filter(|&&c| c > 0).count();
    if filled < 2 {
        return Rgb::BLACK;
    }
    let total: f64 = counts.iter().map(|&c| f64::from(c)).sum();
    let mut spread = Rgb::BLACK;
    for (&sum, &count) in sums.iter().zip(counts).filter(|(_, c)| **c > 0) {
        let share = f64::from(count) / total;
        let deviation = sum / f64::from(count) - mean;
        spread += deviation * deviation * (share * share);
    }
    spread * (filled as f64 / (filled - 1) as f64)
}

/// A variance rounded to eight bits of mantissa, one part in 512: far finer than a handful of replicates can tell, and half the
/// size in a file.
fn shortened(variance: f32) -> f32 {
    const DROPPED: u32 = f32::MANTISSA_DIGITS - 1 - 8;
    let half = 1 << (DROPPED - 1);
    f32::from_bits((variance.to_bits().saturating_add(half)) >> DROPPED << DROPPED)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variance_of_equal_replicates_is_their_spread_over_their_number() {
        let means = [1.0, 2.0, 4.0, 5.0];
        let sums = means.map(|m| Rgb::grey(m * 8.0));
        let v = variance_of_mean(&sums, &[8; 4], Rgb::grey(3.0));
        // Sample variance (4 + 1 + 1 + 4)/3, divided by 4.
        assert!((v.r - 10.0 / 12.0).abs() < 1e-12);
        assert_eq!(variance_of_mean(&sums[..1], &[8], Rgb::grey(1.0)), Rgb::BLACK);
    }

    #[test]
    fn shortening_keeps_eight_bits_and_does_not_lean() {
        let values: Vec<f32> = (0..4096).map(|i| 1e-7 * (1.0 + i as f32 / 4096.0)).collect();
        let ratio = |v: f32| f64::from(shortened(v)) / f64::from(v);
        assert!(values.iter().all(|&v| (ratio(v) - 1.0).abs() <= 1.0 / 512.0));
        let mean = values.iter().map(|&v| ratio(v)).sum::<f64>() / 4096.0;
        assert!((mean - 1.0).abs() < 1e-5, "{mean}");
        assert_eq!(shortened(0.0), 0.0);
    }
}
