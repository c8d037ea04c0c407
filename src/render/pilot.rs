//! Whether light paths pay for themselves in a scene, told by a few paths before the render.
//!
//! What they save is the noise of light that the camera's paths find too rarely to be measured by a few of these. But light paths meet it, and
//! know how rarely the others do: where a light path's contribution c to a pixel has the weight 1/(1 + o²) against camera paths that
//! are o times as dense, these alone have the second moment c²(1 + o²)²/o there, and both together c²(1 + o³). The difference is counted
//! where light paths are the denser ones: elsewhere it is mostly light that is found well, and evenly spread points make less noise of
//! it than of independent ones, which is what moments tell. Errors are relative to what is seen, as everywhere
//! ([`crate::math::stats::relative_square`]); costs are counted in rays, so that the answer depends on the scene and the settings
//! alone.

use glam::Vec2;
use rayon::prelude::*;

use super::Prepared;
use super::light_path::{self, LightPaths, Seen};
use super::path;
use crate::color::Rgb;
use crate::math::hash::mix64;
use crate::math::sobol::{Purpose, Sampler};
use crate::math::stats::relative_square;

/// One camera path for so many pixels, within limits, however many samples there are: a longer render does the same as a short one.
const PIXELS: u64 = 4;
const LIMITS: std::ops::RangeInclusive<u64> = 1024..=16_384;
/// Camera paths for each pixel that is looked at.
const PER_PIXEL: u32 = 4;
/// What is seen is averaged over so many parts of the picture's width and height.
const CELLS: u32 = 12;
/// What a ray of a light path costs in rays of the camera's paths: these take more of them to a vertex, and are themselves slowed down a
/// little by weighing. Measured on the shipped scenes, where it is 1.3 to 1.9.
const COST: f64 = 1.6;
/// Light that camera paths find more rarely than this, relative to light paths, counts as if it were found so often.
const RAREST: f64 = 1e-6;

/// A pixel's camera paths.
struct Look {
    cell: usize,
    mean: [f64; 3],
    /// Of one sample.
    variance: [f64; 3],
    rays: u64,
}

/// What light paths are worth in a scene.
pub(super) struct Worth {
    /// The error with them over that without.
    error: f64,
    /// The cost with them over that without.
    cost: f64,
}

impl Worth {
    /// Light paths save more than they cost.
    pub(super) fn pays(&self) -> bool {
        self.error * self.cost < 1.0
    }
}

impl std::fmt::Display for Worth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} of the error for {:.2} of the cost", self.error, self.cost)
    }
}

/// Tries light paths in `scene`, which has them.
pub(super) fn light_paths(scene: &Prepared, plan: &LightPaths) -> Worth {
    let (width, height) = scene.size();
    let pixels = u64::from(width) * u64::from(height);
    let looks = (pixels / PIXELS).clamp(*LIMITS.start(), *LIMITS.end()) / u64::from(PER_PIXEL);
    let looks: Vec<Look> = (0..looks as u32).into_par_iter().map(|i| look(scene, i)).collect();
    let per_look = f64::from(plan.per_sample) / pixels as f64 * f64::from(PER_PIXEL);
    let paths = ((looks.len() as f64 * per_look) as u32).max(1);
    let flights: Vec<(Vec<Seen>, u64)> = (0..paths).into_par_iter().map(|i| fly(scene, i)).collect();

    // What is seen in each part of the picture.
    let mut means = vec![[0.0; 3]; (CELLS * CELLS) as usize];
    let mut counts = vec![0.0; means.len()];
    for look in &looks {
        counts[look.cell] += 1.0;
        add(&mut means[look.cell], look.mean);
    }
    for (mean, count) in means.iter_mut().zip(counts) {
        *mean = mean.map(|sum| sum / f64::max(count, 1.0));
    }
    let per_cell = (pixels as f64 / means.len() as f64) * f64::from(paths);
    for seen in flights.iter().flat_map(|(seen, _)| seen) {
        add(&mut means[cell(scene, seen.film)], channels(seen.radiance).map(|c| c / per_cell));
    }

    // Per sample of a pixel.
    let of_camera: f64 = looks.iter().map(|look| error(look.variance, means[look.cell])).sum();
    let of_camera = of_camera / looks.len() as f64;
    let (mut of_lights, mut saved) = (0.0, 0.0);
    for seen in flights.iter().flat_map(|(seen, _)| seen) {
        let squares = channels(seen.radiance).map(|c| c * c);
        let moment = error(squares, means[cell(scene, seen.film)]);
        let others = f64::from(seen.others);
        of_lights += moment;
        if others < 1.0 {
            saved += moment * (1.0 / others.max(RAREST) + 2.0 * others - 1.0);
        }
    }
    let scale = 1.0 / (f64::from(paths) * f64::from(plan.per_sample) * pixels as f64);
    let (of_lights, saved) = (of_lights * scale, saved * scale);
    let all = of_camera + of_lights;
    // Where nothing is noisy, nothing can be saved.
    let error = if all + saved > 0.0 { all / (all + saved) } else { 1.0 };
    let of_camera: u64 = looks.iter().map(|look| look.rays).sum();
    let of_lights: u64 = flights.iter().map(|(_, rays)| rays).sum();
    Worth { error, cost: 1.0 + COST * of_lights as f64 / of_camera as f64 }
}

fn look(scene: &Prepared, index: u32) -> Look {
    let (width, height) = scene.size();
    let [u, v, ..] = sampler(scene, 0, index, 1).set(0, Purpose::Camera);
    let corner = Vec2::new((u * width as f32).floor(), (v * height as f32).floor());
    let mut rays = 0;
    let samples: [[f64; 3]; PER_PIXEL as usize] = std::array::from_fn(|sample| {
        let sampler = sampler(scene, 1 + index, sample as u32, PER_PIXEL);
        let [u0, u1, u2, u3] = sampler.set(0, Purpose::Camera);
        let ray = scene.camera.ray(corner + Vec2::new(u0, u1), [u2, u3]);
        let path = path::trace(scene, &sampler, ray, |_| ());
        rays += path.rays;
        if path.radiance.is_finite() { channels(path.radiance) } else { [0.0; 3] }
    });
    let count = f64::from(PER_PIXEL);
    let sum = |f: &dyn Fn(usize, &[f64; 3]) -> f64| -> [f64; 3] {
        std::array::from_fn(|c| samples.iter().map(|sample| f(c, sample)).sum())
    };
    let mean = sum(&|c, sample| sample[c] / count);
    let variance = sum(&|c, sample| (sample[c] - mean[c]) * (sample[c] - mean[c]) / (count - 1.0));
    Look { cell: cell(scene, corner + 0.5), mean, variance, rays }
}

fn fly(scene: &Prepared, index: u32) -> (Vec<Seen>, u64) {
    let mut found = Vec::new();
    let rays = light_path::trace(scene, &sampler(scene, u32::MAX, index, 1), |seen| {
        if seen.radiance.is_finite() {
            found.push(seen);
        }
    });
    (found, rays)
}

/// Numbers that the render doesn't use: an answer that knew them would bias it.
fn sampler(scene: &Prepared, set: u32, index: u32, replicates: u32) -> Sampler {
    Sampler::new(mix64(!scene.settings.seed), set, u32::MAX, index, replicates)
}

fn cell(scene: &Prepared, film: Vec2) -> usize {
    let (width, height) = scene.size();
    let part = |x: f32, length: u32| ((x / length as f32 * CELLS as f32).max(0.0) as u32).min(CELLS - 1);
    (part(film.y, height) * CELLS + part(film.x, width)) as usize
}

fn channels(radiance: Rgb) -> [f64; 3] {
    radiance.to_array().map(f64::from)
}

fn add(sum: &mut [f64; 3], value: [f64; 3]) {
    sum.iter_mut().zip(value).for_each(|(s, v)| *s += v);
}

/// The mean over the channels of squares relative to what is seen.
fn error(squares: [f64; 3], seen: [f64; 3]) -> f64 {
    squares.into_iter().zip(seen).map(|(s, m)| relative_square(s, m)).sum::<f64>() / 3.0
}
