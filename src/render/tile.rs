//! The tiles that threads work on: what their pixels' samples add up to, and whether that is enough.

use glam::{DVec3, Vec3};
use smallvec::SmallVec;

use super::Prepared;
use super::adaptive::{self, Aim, Plan};
use super::light_image::LightImage;
use super::path::PathSample;
use super::reuse;
use crate::color::Rgb;
use crate::math::stats::relative_square;
use crate::record::BadSample;
use crate::settings::RenderSettings;

/// The side of a tile in pixels: small enough to share the work out, large enough that rays stay together and that an error can be told
/// from its pixels.
const SIDE: u32 = 16;
/// The side of a patch in pixels: no less than that of a block of four.
const PATCH: u32 = 2;
/// Patches in a row of a tile, and in a column.
const PATCHES: u32 = SIDE / PATCH;
/// How many bad samples are told by name.
pub(super) const NAMED_BAD_SAMPLES: usize = 16;
/// The fewest samples a pixel by which an error is judged.
const FEWEST_JUDGED: u32 = 16;

/// The places of pixels that are sampled together.
pub(super) type Block = SmallVec<[(u32, u32); reuse::MOST]>;

/// One pixel's result: means over all its samples, where a sample that hits nothing has albedo and normal 0; the depth is the mean
/// over those that hit something.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pixel {
    pub(super) beauty: Rgb,
    /// Of the pixel's mean.
    pub(super) variance: Rgb,
    pub(super) albedo: Rgb,
    pub(super) normal: Vec3,
    pub(super) depth: f32,
    pub(super) samples: u32,
}

/// What a pixel's samples add up to. Sums are f64: thousands of samples must not lose what one of them adds.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    albedo: Rgb<f64>,
    normal: DVec3,
    depth: f64,
    hits: u32,
}

/// What a part of a pixel's samples adds up to.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    radiance: Rgb<f64>,
    count: u32,
}

/// Pixels of a tile that have equal numbers of samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Patch {
    /// Of each pixel, so far.
    pub(super) samples: u32,
    /// How many there are to be for now.
    pub(super) goal: u32,
    /// Where the second half of these begins, if they are halved.
    second_half: Option<u32>,
    rays: u64,
}

/// What the samples of a patch tell of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// The expected error of a pixel, as `bench` measures it.
    pub(super) noise: f64,
    /// Rays of a sample.
    pub(super) rays: f64,
}

/// A rectangle of pixels under way.
#[derive(Clone, Debug, Default)]
pub(super) struct Tile {
    x0: u32,
    y0: u32,
    width: u32,
    height: u32,
    /// Those of the last level that it reached.
    pub(super) samples: u32,
    /// The settings ask for no more.
    pub(super) is_finished: bool,
    /// Row by row.
    pub(super) patches: Vec<Patch>,
    /// Rays that were traced for other variants too.
    pub(super) shared_rays: u64,
    pub(super) bad_count: u64,
    /// The first of them.
    pub(super) bad: Vec<BadSample>,
    /// By pixel, row by row; empty before the first sample, and again after the last.
    sums: Vec<Sums>,
    /// By pixel, all of one pixel's together: of each replicate, or of a single one's first half and then of all its samples.
    parts: Vec<Part>,
    /// The parts are halves of a single replicate.
    is_halved: bool,
    /// What the sums came to, by pixel; empty before the last sample.
    pixels: Vec<Pixel>,
}

/// Where a render may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Level {
    /// Of each pixel, where no others are planned.
    pub(super) samples: u32,
    /// How many each pixel is to have is planned for this level.
    pub(super) aim: Option<Aim>,
    /// Plans are made by what is seen now.
    pub(super) is_looked_at: bool,
    /// Tiles may end here, if their error is small enough.
    pub(super) is_judged: bool,
    pub(super) is_last: bool,
}

/// The levels of a render: several, each of about twice the samples of the last, where it may end early, by the time or an error.
pub(super) fn levels(scene: &Prepared, has_time_limit: bool) -> Vec<Level> {
    let (spp, parts) = (scene.settings.spp, scene.settings.parts());
    let first = scene.adaptive.is_ok().then(|| adaptive::first_samples(spp, has_time_limit));
    let unplanned = doubled(parts, first.unwrap_or(spp));
    let mut numbers: Vec<u32> = match first {
        Some(first) => unplanned.chain(adaptive::planned_means(spp, first)).collect(),
        None => unplanned.collect(),
    };
    if !has_time_limit && scene.settings.error.is_none() {
        numbers.retain(|&samples| samples == spp || Some(samples) == first);
    }
    let level = |samples| Level {
        samples,
        aim: first.filter(|&first| samples > first).map(|first| Aim { spp, first, mean: samples }),
        is_looked_at: Some(samples) == first,
        is_judged: samples >= FEWEST_JUDGED,
        is_last: samples == spp,
    };
    numbers.into_iter().map(level).collect()
}

/// Numbers of samples, each twice the last, up to the most.
fn doubled(least: u32, most: u32) -> impl Iterator<Item = u32> {
    let doubled = std::iter::successors(Some(least), |n| n.checked_mul(2));
    doubled.take_while(move |n| *n < most).chain(std::iter::once(most))
}

/// Memory for a pixel until its picture is finished: that of the result, and of the sums as well while all tiles may go on.
pub(super) fn bytes_a_pixel(scene: &Prepared) -> u64 {
    let settings = &scene.settings;
    let sums = size_of::<Sums>() + settings.parts() as usize * size_of::<Part>();
    let may_all_go_on = settings.error.is_some() || scene.adaptive.is_ok();
    (size_of::<Pixel>() + if may_all_go_on { sums } else { 0 }) as u64
}

impl Tile {
    /// The tiles of a picture, row by row.
    pub(super) fn all(scene: &Prepared) -> Vec<Self> {
        let (width, height) = scene.size();
        let starts = |length: u32| (0..length).step_by(SIDE as usize);
        let tile = |x0: u32, y0: u32| Self {
            x0,
            y0,
            width: SIDE.min(width - x0),
            height: SIDE.min(height - y0),
            ..Self::default()
        };
        starts(height).flat_map(|y0| starts(width).map(move |x0| (x0, y0))).map(|(x, y)| tile(x, y)).collect()
    }

    /// How many columns and rows of patches a picture of such size has.
    pub(super) fn patches_of((width, height): (u32, u32)) -> (u32, u32) {
        (width.div_ceil(PATCH), height.div_ceil(PATCH))
    }

    /// The number of pixels.
    pub(super) fn area(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Its pixels in blocks of so many columns and rows.
    pub(super) fn blocks(&self, sides: (u32, u32)) -> impl Iterator<Item = Block> {
        let end = (self.x0 + self.width, self.y0 + self.height);
        let corners = self.places().filter(move |(x, y)| x % sides.0 == 0 && y % sides.1 == 0);
        corners.map(move |corner| reuse::block_around(corner, sides, end).collect())
    }

    /// The index of the patch that a pixel is in.
    #[inline]
    pub(super) fn patch(&self, (x, y): (u32, u32)) -> usize {
        ((y - self.y0) / PATCH * PATCHES + (x - self.x0) / PATCH) as usize
    }

    /// Makes ready for `samples` of each pixel, or for those that are planned.
    pub(super) fn begin(&mut self, settings: &RenderSettings, samples: u32, plan: Option<&Plan>) {
        let area = self.area() as usize;
        self.sums.resize(area, Sums::default());
        self.parts.resize(area * settings.parts() as usize, Part::default());
        self.patches.resize((PATCHES * PATCHES) as usize, Patch::default());
        self.is_halved = settings.is_halved();
        let is_halved = self.is_halved;
        for index in 0..self.patches.len() {
            let planned = plan.and_then(|plan| plan.samples(self.in_picture(index as u32)));
            let patch = &mut self.patches[index];
            patch.goal = planned.map_or(samples, |planned| planned.max(patch.samples));
            patch.second_half = is_halved.then(|| second_half(patch.goal));
        }
    }

    /// Adds sample `sample` of the pixel (x, y).
    #[inline]
    pub(super) fn add(&mut self, (x, y): (u32, u32), sample: u32, path: &PathSample) {
        let patch = self.patch((x, y));
        let pixel = ((y - self.y0) * self.width + x - self.x0) as usize;
        let count = self.parts.len() / self.sums.len();
        let parts = &mut self.parts[pixel * count..][..count];
        let patch = &mut self.patches[patch];
        patch.rays += path.rays;
        if patch.second_half == Some(sample) {
            parts[0] = parts[1];
        }
        let part =
            if patch.second_half.is_some() { &mut parts[1] } else { &mut parts[sample as usize % count] };
        let r = path.radiance;
        if !r.is_finite() || r.r < 0.0 || r.g < 0.0 || r.b < 0.0 {
            self.bad_count += 1;
            if self.bad.len() < NAMED_BAD_SAMPLES {
                self.bad.push(BadSample { x, y, sample });
            }
            return;
        }
        part.radiance += r.cast();
        part.count += 1;
        if let Some(first) = path.first {
            let sums = &mut self.sums[pixel];
            sums.albedo += first.albedo.cast();
            sums.normal += first.normal.as_dvec3();
            sums.depth += f64::from(first.depth);
            sums.hits += 1;
        }
    }

    /// Each pixel has got the samples of a level: judges whether that is enough. The result is how many more the settings would have allowed
    /// all pixels together.
    pub(super) fn end(&mut self, settings: &RenderSettings, level: Level, lit: &LightImage) -> u64 {
        let samples = level.samples;
        self.samples = samples;
        for patch in &mut self.patches {
            patch.samples = patch.goal;
        }
        let is_good = |goal: f32| level.is_judged && self.error(lit) <= f64::from(goal);
        self.is_finished = level.is_last || settings.error.is_some_and(is_good);
        if !self.is_finished {
            return 0;
        }
        self.settle(lit);
        u64::from(settings.spp.saturating_sub(samples)) * self.area()
    }

    /// Columns and rows of its pixels.
    pub(super) fn places(&self) -> impl Iterator<Item = (u32, u32)> {
        (0..self.area() as usize).map(|pixel| self.place(pixel))
    }

    pub(super) fn place(&self, pixel: usize) -> (u32, u32) {
        let pixel = pixel as u32;
        (self.x0 + pixel % self.width, self.y0 + pixel / self.width)
    }

    /// Nothing more is to be added: keeps what the sums come to, which is several times smaller.
    fn settle(&mut self, lit: &LightImage) {
        if self.pixels.is_empty() {
            self.pixels = self.so_far(lit).collect();
            (self.sums, self.parts) = (Vec::new(), Vec::new());
        }
    }

    fn so_far(&self, lit: &LightImage) -> impl Iterator<Item = Pixel> {
        let count = (self.parts.len() / self.sums.len().max(1)).max(1);
        let is_halved = self.is_halved;
        let of_camera = self.sums.iter().zip(self.parts.chunks(count));
        self.places().zip(of_camera).map(move |((x, y), (sums, parts))| {
            let apart = (0..count).map(|i| if is_halved && i == 1 { parts[1] - parts[0] } else { parts[i] });
            let of_lights = lit.pixel(x, y).chain(std::iter::repeat(Rgb::BLACK));
            sums.pixel(apart.zip(of_lights).map(|(part, light)| Part {
                radiance: part.radiance + light * f64::from(part.count),
                count: part.count,
            }))
        })
    }

    /// The finished pixels with their columns and rows in the picture.
    pub(super) fn pixels(&mut self, lit: &LightImage) -> impl Iterator<Item = ((u32, u32), Pixel)> {
        self.settle(lit);
        self.places().zip(self.pixels.iter().copied())
    }

    /// The error that is expected of the tile, as `bench` measures it: the mean over pixels and channels of the variance over the
    /// square plus 0.01. The few parts of a single pixel tell little, those of all pixels together enough.
    fn error(&self, lit: &LightImage) -> f64 {
        self.so_far(lit).map(Pixel::error).sum::<f64>() / self.area() as f64
    }

    /// What its patches' samples tell, with each one's column and row in the picture.
    pub(super) fn seen(&self, lit: &LightImage) -> impl Iterator<Item = ((u32, u32), Seen)> {
        let mut sums = [(0u32, 0.0); (PATCHES * PATCHES) as usize];
        for (place, pixel) in self.places().zip(self.so_far(lit)) {
            let (pixels, error) = &mut sums[self.patch(place)];
            *pixels += 1;
            *error += pixel.error();
        }
        let with_pixels = (0..).zip(sums).zip(&self.patches).filter(|((_, (pixels, _)), _)| *pixels > 0);
        with_pixels.map(|((index, (pixels, error)), patch)| {
            let (pixels, samples) = (f64::from(pixels), f64::from(patch.samples));
            (
                self.in_picture(index),
                Seen { noise: error / pixels, rays: patch.rays as f64 / (pixels * samples) },
            )
        })
    }

    /// The column and row of one of its patches in the picture.
    fn in_picture(&self, patch: u32) -> (u32, u32) {
        (self.x0 / PATCH + patch % PATCHES, self.y0 / PATCH + patch / PATCHES)
    }

    /// Rays of all its samples.
    pub(super) fn rays(&self) -> u64 {
        self.patches.iter().map(|patch| patch.rays).sum()
    }

    /// All its samples.
    pub(super) fn paths(&self) -> u64 {
        self.places().map(|place| u64::from(self.patches[self.patch(place)].samples)).sum()
    }

    /// All samples that its pixels lack of those that are planned.
    pub(super) fn paths_to(&self, plan: &Plan) -> u64 {
        let left = |place: (u32, u32)| {
            let patch = self.patch(place);
            let planned = plan.samples(self.in_picture(patch as u32));
            planned.unwrap_or(0).saturating_sub(self.patches[patch].samples)
        };
        self.places().map(|place| u64::from(left(place))).sum()
    }
}

impl Pixel {
    /// The error that is expected of it.
    fn error(self) -> f64 {
        let (mean, variance) = (self.beauty.to_array(), self.variance.to_array());
        let of_channel = |(m, v): (f32, f32)| relative_square(f64::from(v), f64::from(m));
        mean.into_iter().zip(variance).map(of_channel).sum::<f64>() / 3.0
    }
}

impl std::ops::Sub for Part {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { radiance: self.radiance - other.radiance, count: self.count - other.count }
    }
}

/// The sample with which the second half of `samples` begins: the largest power of two before their end, with which the points of the first
/// half are spread evenly, and where a render that doubles its samples has stood.
pub(super) fn second_half(samples: u32) -> u32 {
    samples.next_power_of_two() / 2
}

impl Sums {
    fn pixel(&self, sets: impl Iterator<Item = Part> + Clone) -> Pixel {
        let samples: u32 = sets.clone().map(|set| set.count).sum();
        let n = f64::from(samples.max(1));
        let beauty = sets.clone().fold(Rgb::BLACK, |sum, set| sum + set.radiance) / n;
        Pixel {
            beauty: beauty.cast(),
            variance: variance_of_mean(sets, beauty).cast().map(shortened),
            albedo: (self.albedo / n).cast(),
            normal: (self.normal / n).as_vec3(),
            depth: if self.hits > 0 { (self.depth / f64::from(self.hits)) as f32 } else { 0.0 },
            samples,
        }
    }
}

/// The variance of the pixel's mean from the spread of its parts' means, each weighed by its share of the samples: with equal
/// shares, their sample variance divided by their number, and of independent samples right with any. 0 with a single part, which has
/// no spread. Halves of one set complete each other: their spread is larger than that of independent ones would be.
fn variance_of_mean(sets: impl Iterator<Item = Part> + Clone, mean: Rgb<f64>) -> Rgb<f64> {
    let filled = || sets.clone().filter(|set| set.count > 0);
    let count = filled().count();
    if count < 2 {
        return Rgb::BLACK;
    }
    let total: f64 = filled().map(|set| f64::from(set.count)).sum();
    let mut spread = Rgb::BLACK;
    for set in filled() {
        let share = f64::from(set.count) / total;
        let deviation = set.radiance / f64::from(set.count) - mean;
        spread += deviation * deviation * share;
    }
    spread / (count - 1) as f64
}

/// A variance rounded to eight bits of mantissa, one part in 512: far finer than a handful of replicates can tell, and half the
/// size in a file.
fn shortened(variance: f32) -> f32 {
    const DROPPED: u32 = f32::MANTISSA_DIGITS - 1 - 8;
    let half = 1 << (DROPPED - 1);
    f32::from_bits((variance.to_bits().saturating_add(half)) >> DROPPED << DROPPED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{mix64, unit_f32};

    #[test]
    fn variance_of_equal_parts_is_their_spread_over_their_number() {
        let means = [1.0, 2.0, 4.0, 5.0];
        let sets = means.map(|m| Part { radiance: Rgb::grey(m * 8.0), count: 8 });
        let v = variance_of_mean(sets.into_iter(), Rgb::grey(3.0));
        // Sample variance (4 + 1 + 1 + 4)/3, divided by 4.
        assert!((v.r - 10.0 / 12.0).abs() < 1e-12);
        assert_eq!(variance_of_mean(sets.into_iter().take(1), Rgb::grey(1.0)), Rgb::BLACK);
    }

    /// Of independent samples the variance of their mean is told right however they are parted.
    #[test]
    fn variance_of_unequal_parts_is_that_of_equal_ones() {
        let samples: Vec<f64> = (0..24_000).map(|i| f64::from(unit_f32(mix64(i) as u32))).collect();
        let told = |first: usize| {
            let variances = samples.chunks(24).map(|set| {
                let part = |values: &[f64]| Part {
                    radiance: Rgb::grey(values.iter().sum()),
                    count: values.len() as u32,
                };
                let parts = [part(&set[..first]), part(&set[first..])];
                variance_of_mean(parts.into_iter(), Rgb::grey(set.iter().sum::<f64>() / 24.0)).r
            });
            variances.sum::<f64>() / 1000.0 * 24.0
        };
        for first in [12, 16, 23] {
            assert!((told(first) * 12.0 - 1.0).abs() < 0.15, "{first}: {}", told(first) * 12.0);
        }
    }

    #[test]
    fn a_render_may_end_at_doubled_numbers_of_samples() {
        let levels = |parts, spp| doubled(parts, spp).collect::<Vec<_>>();
        assert_eq!(levels(4, 50), [4, 8, 16, 32, 50]);
        assert_eq!(levels(4, 64), [4, 8, 16, 32, 64]);
        assert_eq!(levels(2, 50), [2, 4, 8, 16, 32, 50]);
        assert_eq!(levels(1, 1), [1]);
        // Where a single replicate is halved, a render that doubles has stood.
        for (samples, second) in [(2, 1), (3, 2), (4, 2), (50, 32), (64, 32), (65, 64)] {
            assert_eq!(second_half(samples), second);
        }
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
