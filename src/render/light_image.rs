//! What paths from the lights add to each pixel.
//!
//! They reach any pixel, so that tiles can't hold them. Threads trace batches of paths and list what these add; the lists are then added
//! up in the order of the paths, each thread for a band of the picture: the sums have the same bits on any number of threads.

use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::Prepared;
use super::film::Control;
use super::light_path;
use super::tile::second_half;
use crate::color::Rgb;
use crate::math::hash::mix64;
use crate::math::sobol::Sampler;

/// Paths that one thread traces at once.
const BATCH: u64 = 4096;
/// Batches for each thread until the lists are added up: these take some megabytes.
const BATCHES: usize = 4;

/// What a path adds to a pixel.
#[derive(Clone, Copy, Debug)]
struct Splat {
    /// Of the sums.
    place: u32,
    radiance: Rgb,
}

/// The sums over light paths.
#[derive(Debug)]
pub(super) struct LightImage {
    width: u32,
    replicates: u32,
    /// Paths so far.
    pub(super) paths: u64,
    pub(super) rays: u64,
    pub(super) bad_count: u64,
    /// By pixel, row by row, all replicates of a pixel together; empty without light paths.
    sums: Vec<Rgb<f64>>,
    /// The first half of a single replicate: its paths and the sums that there were then.
    first_half: Option<(u64, Vec<Rgb<f64>>)>,
}

/// The paths of a batch.
#[derive(Debug, Default)]
struct Batch {
    splats: Vec<Splat>,
    rays: u64,
    bad_count: u64,
}

/// Memory for the sums of a pixel.
pub(super) fn bytes_a_pixel(scene: &Prepared) -> u64 {
    let parts = if scene.light_paths.is_ok() { scene.settings.parts() } else { 0 };
    u64::from(parts) * size_of::<Rgb<f64>>() as u64
}

impl LightImage {
    pub(super) fn new(scene: &Prepared) -> Self {
        let (width, height) = scene.size();
        let replicates = scene.settings.effective_replicates();
        let places = if scene.light_paths.is_ok() { width as usize * height as usize } else { 0 };
        let sums = vec![Rgb::BLACK; places * replicates as usize];
        Self { width, replicates, paths: 0, rays: 0, bad_count: 0, sums, first_half: None }
    }

    /// Goes on until there are as many light paths as belong to `samples` of each pixel.
    pub(super) fn sample_up_to(&mut self, scene: &Prepared, samples: u32, control: &Control) {
        let Ok(plan) = &scene.light_paths else { return };
        let paths = plan.paths(samples);
        let round = BATCH * (BATCHES * rayon::current_num_threads()) as u64;
        let half = scene.settings.is_halved().then(|| plan.paths(second_half(samples)));
        while self.paths < paths {
            if half == Some(self.paths) {
                self.first_half = Some((self.paths, self.sums.clone()));
            }
            let stop = half.filter(|&half| self.paths < half).unwrap_or(paths);
            let end = stop.min(self.paths + round);
            let starts: Vec<u64> = (self.paths..end).step_by(BATCH as usize).collect();
            let batches: Vec<Batch> = starts
                .into_par_iter()
                .with_max_len(1)
                .map(|start| {
                    let batch = start..end.min(start + BATCH);
                    control.paths.fetch_add(batch.end - batch.start, Ordering::Relaxed);
                    self.trace(scene, batch)
                })
                .collect();
            self.add(&batches);
            self.paths = end;
        }
    }

    /// The paths of a range of indices.
    fn trace(&self, scene: &Prepared, paths: std::ops::Range<u64>) -> Batch {
        let mut batch = Batch::default();
        for path in paths {
            let sampler = sampler(scene, path);
            let replicate = (path % u64::from(self.replicates)) as u32;
            batch.rays += light_path::trace(scene, &sampler, |seen| {
                if !seen.radiance.is_finite() {
                    batch.bad_count += 1;
                    return;
                }
                scene.pixels_at(seen.film, |x, y, density| {
                    let place = (y * self.width + x) * self.replicates + replicate;
                    batch.splats.push(Splat { place, radiance: seen.radiance * density });
                });
            });
        }
        batch
    }

    fn add(&mut self, batches: &[Batch]) {
        let band = self.sums.len().div_ceil(rayon::current_num_threads()).max(1);
        self.sums.par_chunks_mut(band).enumerate().for_each(|(i, sums)| {
            let first = i * band;
            for splat in batches.iter().flat_map(|batch| &batch.splats) {
                if let Some(sum) = (splat.place as usize).checked_sub(first).and_then(|k| sums.get_mut(k)) {
                    *sum += splat.radiance.cast();
                }
            }
        });
        self.rays += batches.iter().map(|batch| batch.rays).sum::<u64>();
        self.bad_count += batches.iter().map(|batch| batch.bad_count).sum::<u64>();
    }

    /// The mean of each part of the samples at a pixel; none without light paths.
    pub(super) fn pixel(&self, x: u32, y: u32) -> impl Iterator<Item = Rgb<f64>> + Clone {
        let replicates = self.replicates as usize;
        let first = (y as usize * self.width as usize + x as usize) * replicates;
        let sums = self.sums.get(first..first + replicates).unwrap_or_default();
        let half = self.first_half.as_ref().map(|(paths, sums)| (*paths, sums[first]));
        let replicates = u64::from(self.replicates);
        let of_replicate = move |(&sum, replicate): (&Rgb<f64>, u64)| match half {
            None => (sum, (self.paths + replicates - 1 - replicate) / replicates),
            Some((paths, of_half)) => (sum - of_half, self.paths - paths),
        };
        let of_half = half.map(|(paths, sum)| (sum, paths));
        let parts = of_half.into_iter().chain(sums.iter().zip(0..).map(of_replicate));
        parts.map(|(sum, paths)| sum / paths.max(1) as f64)
    }
}

/// The random numbers of a light path: one set of points for so many of them.
fn sampler(scene: &Prepared, path: u64) -> Sampler {
    const SET: u32 = 24;
    let index = (path & ((1 << SET) - 1)) as u32;
    let settings = &scene.settings;
    // No pixel is in this row.
    let (set, row) = ((path >> SET) as u32, u32::MAX);
    Sampler::new(mix64(settings.seed), set, row, index, settings.effective_replicates())
}
