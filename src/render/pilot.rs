//! Whether light paths, those of neighbouring pixels and branches pay for themselves in a scene, told by a few paths before the render.
//!
//! What neighbours and branches save is seen in a few pixels. What light paths save is the noise of light that the camera's paths find too
//! rarely to be measured by a few of these. But light paths meet it, and know how rarely the others do: where a light path's contribution c
//! to a pixel has the weight 1/(1 + o²) against camera paths that are o times as dense, camera paths alone have the second moment
//! c²(1 + o²)²/o there; beside light paths, which have c², they have c²o³.
//! The difference, c²(1/o + 2o), is saved where a camera path would find many times what is seen there. Elsewhere evenly spread points leave
//! hardly any noise of what moments tell: in the open under a sky light paths pay for nothing. Errors are relative to what is seen, as
//! everywhere ([`crate::math::stats::relative_square`]); costs are counted in rays, so that the answer depends on the scene and the
//! settings alone.

use glam::Vec2;
use rayon::prelude::*;
use smallvec::SmallVec;

use super::Prepared;
use super::light_path::{self, Seen};
use super::path::{Walk, first_surface};
use super::reuse::{BlockSize, MOST, block_around, gather};
use crate::accel::Ray;
use crate::color::Rgb;
use crate::math::hash::mix64;
use crate::math::sobol::{Purpose, Sampler};
use crate::math::stats::relative_square;
use crate::settings::Use;

/// One camera path for so many pixels, within limits, however many samples there are: a longer render does the same as a short one.
const PIXELS: u64 = 4;
const LIMITS: std::ops::RangeInclusive<u64> = 1024..=16_384;
/// Camera paths for each pixel that is looked at.
const PER_PIXEL: u32 = 4;
/// So many times as many light paths as a render has for as many camera paths: of what they save, most is told by few.
const FLIGHTS: f64 = 8.0;
/// What is seen is averaged over so many parts of the picture's width and height.
const CELLS: u32 = 12;
/// What a ray of a light path costs in rays of the camera's paths: these take more of them to a vertex, and are themselves slowed down a
/// little by weighing. Measured on the shipped scenes, where it is 1.3 to 1.9.
const COST: f64 = 1.6;
/// Light that camera paths find more rarely than this, relative to light paths, counts as if it were found so often.
const RAREST: f64 = 1e-6;
/// Light that a camera path finds as so many times what is seen there, it finds rarely. In scenes where light paths pay it is mostly 32 times
/// and more, where they don't it is less; among reflections of satin metal it is 16 to 32.
const RARE: f64 = 32.0;
/// The part of light paths' noise that evenly spread points leave where camera paths find the light well too, and where they find it rarely.
/// The first was measured: 0 in closed rooms to 0.3 and 0.5 in the open; the other is told by the errors of whole renders: 0.2 to 0.6.
const SPREAD_OF_LIGHTS: f64 = 0.15;
const SPREAD_OF_RARE_LIGHTS: f64 = 0.4;

/// One block of pixels for so many that are looked at, to see what neighbours' paths bring.
const LOOKS_PER_MEETING: u32 = 16;
/// What a path costs that neighbours may join, and each that does, in rays as well: the shadow ray, and what the surfaces reflect. Measured:
/// 3 to 4 for three neighbours, 3.7 to 5.8 for seven, 5.8 to 10 for fifteen.
const JOINABLE_COST: f64 = 2.4;
const JOINING_COST: f64 = 0.3;
/// Light paths, and blocks of more than eight, have to leave no more than this of the work, or they are not used: the ones take memory,
/// the others make noise blotchier, and jobs of a sweep that do the same share more. Blocks of more than four have to save more where noisy
/// parts of the picture could have more samples without them. Elsewhere there are none of four: eight take 0.7 to 1.0 of their work.
const LEAST_GAIN: f64 = 0.92;
const LEAST_GAIN_OF_LARGEST: f64 = 0.85;
const LEAST_GAIN_OF_EVEN: f64 = 0.6;
/// The noise that evenly spread points leave of what independent ones make, in the part of a path's light that its neighbours have no use for:
/// emission and light sampled at the first surface. In the rest they are little better. Measured: from 0.15 in the sun to 0.26 on the statue.
const SPREAD: f64 = 0.2;

/// Samples branch where at most so many rays follow each of the camera's, and at least so much of the variance comes from there. Measured, at
/// equal time: 0.6 to 0.95 of the error where both hold, 1 and more where either does not.
const MOST_RAYS_BEYOND: f64 = 0.4;
const LEAST_BEYOND: f64 = 0.5;
/// What branches leave of the work where path reuse is told from doing without it.
const GAIN_OF_BRANCHES: f64 = 0.75;
/// The part of the work without path reuse that a pilot sees where light is found so seldom that light paths pay: its few paths miss noise
/// that neighbours would share. Measured: path reuse left 0.4 to 0.95 of the work there where 0.7 to 1.1 was told.
const SEEN_BESIDE_LIGHT_PATHS: f64 = 0.85;

/// Noisy parts of a picture get more samples where at least this part of the camera's paths meets nothing. Elsewhere what equal numbers waste is
/// about what pixels save that complete each other, as they only do with equal numbers. Measured: 0.3 to 0.9 of the error, against 0.85 to 1.06.
const LEAST_UNMET: f64 = 0.25;

/// A pixel's camera paths.
struct Look {
    cell: usize,
    mean: [f64; 3],
    /// Of one sample.
    variance: [f64; 3],
    /// Of one sample's part that no neighbour can use.
    own_variance: [f64; 3],
    rays: u64,
    /// Paths that neighbours can use.
    shared: u64,
    /// Paths that met nothing.
    unmet: u32,
}

/// A block of sixteen pixels that use each other's paths: the variances of one sample's part that neighbours can use, if none joins, and if
/// those of each size of block do, summed up over the pixels.
struct Meeting {
    cell: usize,
    alone: [f64; 3],
    joined: [[f64; 3]; BlockSize::ALL.len()],
}

/// Two samples of a pixel with two branches each: the variances of what a sample finds, and of what it finds from its first surface on.
struct Fork {
    cell: usize,
    all: [f64; 3],
    beyond: [f64; 3],
}

/// What pays in a scene, or what it would be worth.
pub(super) struct Choice {
    pub(super) light_paths: Result<(), String>,
    pub(super) path_reuse: Result<BlockSize, String>,
    pub(super) splitting: Result<(), String>,
    pub(super) adaptive: Result<(), String>,
}

/// What each technique is worth, per sample of a pixel.
struct Worth {
    /// The error of what camera paths of independent points find: of what no neighbour can use, and of the rest.
    own: f64,
    shared: f64,
    /// What joining leaves of the rest, in blocks of each size.
    left: [f64; BlockSize::ALL.len()],
    /// That of light paths.
    of_lights: f64,
    /// More error of camera paths without light paths, before neighbours share it.
    saved: f64,
    /// Rays of light paths, for each ray of camera paths.
    light_cost: f64,
    /// Paths that neighbours may join, for each ray of camera paths.
    joinable: f64,
    /// Rays of camera paths.
    rays: f64,
    /// The part of the variance of camera paths that comes from beyond the first surface; 0 where it is not asked for.
    beyond: f64,
    /// The part of camera paths that meet nothing.
    unmet: f64,
}

/// What is used.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Used {
    light_paths: bool,
    path_reuse: Option<BlockSize>,
}

impl Worth {
    /// Error and cost, relative to nothing in particular.
    fn of(&self, used: Used) -> (f64, f64) {
        let with = |left: f64| self.own * SPREAD + self.shared * left;
        let of_camera = with(used.path_reuse.map_or(1.0, |block| self.left[block as usize]));
        // What light paths save is often light by mirrors and glass, where neighbours cannot join: measured, from left² to its root.
        let left = if of_camera > 0.0 { of_camera / with(1.0) } else { 1.0 };
        let of_light = if used.light_paths { self.of_lights } else { self.saved * left.sqrt() };
        let light_cost = if used.light_paths { self.light_cost } else { 0.0 };
        let of_path = |block: BlockSize| JOINABLE_COST + JOINING_COST * f64::from(block.pixels() - 1);
        let joining_cost = self.joinable * used.path_reuse.map_or(0.0, of_path);
        (of_camera + of_light, 1.0 + light_cost + joining_cost)
    }

    /// Error times cost, and more for what has to save some.
    fn work(&self, used: Used) -> f64 {
        let (error, cost) = self.of(used);
        let of_lights = if used.light_paths { LEAST_GAIN } else { 1.0 };
        let of_size = match used.path_reuse {
            Some(size) if size.is_large() && self.can_be_uneven(used) => LEAST_GAIN_OF_EVEN,
            Some(BlockSize::Sixteen) => LEAST_GAIN_OF_LARGEST,
            _ => 1.0,
        };
        let of_branches = if self.splitting(used).is_ok() { GAIN_OF_BRANCHES } else { 1.0 };
        let is_missed = used.light_paths && used.path_reuse.is_none();
        let of_seen = if is_missed { SEEN_BESIDE_LIGHT_PATHS } else { 1.0 };
        error * cost * of_branches / (of_lights * of_size * of_seen)
    }

    /// Noisy parts of the picture may get more samples, as far as the size of blocks lets them.
    fn can_be_uneven(&self, used: Used) -> bool {
        self.unmet >= LEAST_UNMET && !used.light_paths
    }

    /// Rays from the first surface on, for each of the camera's.
    fn rays_beyond(&self, used: Used) -> f64 {
        let (_, cost) = self.of(Used { light_paths: false, ..used });
        self.rays * cost - 1.0
    }

    /// Whether samples should branch, or why not.
    fn splitting(&self, used: Used) -> Result<(), String> {
        let rays = self.rays_beyond(used);
        if used.light_paths {
            Err("paths from the lights make less noise".to_owned())
        } else if rays > MOST_RAYS_BEYOND {
            Err(format!(
                "finding first surfaces is little of the work: {rays:.1} rays follow each of the camera's"
            ))
        } else if self.beyond < LEAST_BEYOND {
            Err(format!("{:.0}% of the noise is of what is seen", 100.0 * (1.0 - self.beyond).min(1.0)))
        } else {
            Ok(())
        }
    }

    /// Whether noisy parts of the picture should get more samples, or why not.
    fn adaptive(&self, used: Used) -> Result<(), String> {
        // Where these pay, light is found seldom, and what the first samples of a patch see tells little of its noise: error 2.2 through glass.
        if used.light_paths {
            Err("paths from the lights make less noise".to_owned())
        } else if used.path_reuse.is_some_and(BlockSize::is_large) {
            Err("pixels of large blocks, which have equal numbers, use each other's paths".to_owned())
        } else if self.unmet < LEAST_UNMET {
            let full = 100.0 * (1.0 - self.unmet);
            Err(format!(
                "surfaces fill {full:.0}% of the picture, and pixels with equal numbers complete each other"
            ))
        } else {
            Ok(())
        }
    }

    /// What a technique that `with` has and `without` has not would bring.
    fn told(&self, with: Used, without: Used) -> String {
        let ((error, cost), (error_before, cost_before)) = (self.of(with), self.of(without));
        // Where nothing is noisy, nothing can be saved.
        let error = if error_before > 0.0 { error / error_before } else { 1.0 };
        format!("would leave {error:.2} of the error for {:.2} of the cost", cost / cost_before)
    }
}

/// Tries light paths in `scene`, if it has them, and path reuse if `can_reuse`, and chooses what the settings leave open: the size of blocks
/// in any case.
pub(super) fn choose(scene: &Prepared, can_reuse: bool, can_split: bool) -> Choice {
    let can_light = scene.light_paths.is_ok();
    let mut choice =
        Choice { light_paths: Ok(()), path_reuse: Ok(BlockSize::Four), splitting: Ok(()), adaptive: Ok(()) };
    let light_is_open = can_light && scene.settings.light_paths == Use::Auto;
    let reuse_is_open = can_reuse && scene.settings.path_reuse == Use::Auto;
    let adaptive_is_open = scene.adaptive.is_ok() && scene.settings.adaptive == Use::Auto;
    let splitting_is_open = can_split && scene.settings.splitting == Use::Auto;
    if !(light_is_open || can_reuse || splitting_is_open || adaptive_is_open) {
        return choice;
    }
    let worth = measure(scene, can_reuse, splitting_is_open);
    let may_be = |is_open: bool, is_possible: bool, with: bool| {
        if with { is_possible } else { is_open || !is_possible }
    };
    let with_light = [false, true].into_iter().filter(|&with| may_be(light_is_open, can_light, with));
    let sizes = std::iter::once(None).chain(BlockSize::ALL.map(Some));
    // Pixels of a block have equal numbers of samples, and those of large ones would have too many.
    let is_adaptive = scene.adaptive.is_ok() && !adaptive_is_open;
    let sizes = sizes.filter(|size| !(is_adaptive && size.is_some_and(BlockSize::is_large)));
    let with_reuse = sizes.filter(|size| may_be(reuse_is_open, can_reuse, size.is_some()));
    let ways = with_light
        .flat_map(|light_paths| with_reuse.clone().map(move |path_reuse| Used { light_paths, path_reuse }));
    let is_needed = |used: &Used| is_adaptive || worth.can_be_uneven(*used);
    let ways = ways.filter(|used| used.path_reuse != Some(BlockSize::Four) || is_needed(used));
    let best = ways.min_by(|&a, &b| worth.work(a).total_cmp(&worth.work(b)));
    let Some(best) = best else { return choice };
    if light_is_open && !best.light_paths {
        choice.light_paths = Err(format!("they {}", worth.told(Used { light_paths: true, ..best }, best)));
    }
    choice.path_reuse = best.path_reuse.ok_or_else(|| {
        let size = if is_needed(&best) { BlockSize::Four } else { BlockSize::Eight };
        let with = Used { path_reuse: Some(size), ..best };
        format!("it {}", worth.told(with, best))
    });
    if adaptive_is_open {
        choice.adaptive = worth.adaptive(best);
    }
    if splitting_is_open {
        choice.splitting = worth.splitting(best);
    }
    choice
}

fn measure(scene: &Prepared, can_reuse: bool, can_split: bool) -> Worth {
    let (width, height) = scene.size();
    let pixels = u64::from(width) * u64::from(height);
    let looks = (pixels / PIXELS).clamp(*LIMITS.start(), *LIMITS.end()) / u64::from(PER_PIXEL);
    let looks: Vec<Look> = (0..looks as u32).into_par_iter().map(|i| look(scene, i, can_reuse)).collect();
    let per_sample = scene.light_paths.as_ref().map_or(0, |plan| plan.per_sample);
    let per_look = f64::from(per_sample) / pixels as f64 * f64::from(PER_PIXEL) * FLIGHTS;
    let meetings = if can_reuse { looks.len() as u32 / LOOKS_PER_MEETING } else { 0 };
    let meetings: Vec<Meeting> = (0..meetings).into_par_iter().filter_map(|i| meet(scene, i)).collect();
    let paths = ((looks.len() as f64 * per_look) as u32).max(per_sample.min(1));
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
    let sum = |variance: fn(&Look) -> [f64; 3]| -> f64 {
        looks.iter().map(|look| error(variance(look), means[look.cell])).sum::<f64>() / looks.len() as f64
    };
    let of_camera = sum(|look| look.variance);
    let own = sum(|look| look.own_variance).min(of_camera);
    let sum = |variance: &dyn Fn(&Meeting) -> [f64; 3]| -> f64 {
        meetings.iter().map(|meeting| error(variance(meeting), means[meeting.cell])).sum()
    };
    let alone = sum(&|meeting| meeting.alone);
    let left = BlockSize::ALL.map(|size| {
        let joined = sum(&|meeting| meeting.joined[size as usize]);
        if alone > 0.0 { joined / alone } else { 1.0 }
    });
    let (mut of_lights, mut saved) = (0.0, 0.0);
    for seen in flights.iter().flat_map(|(seen, _)| seen) {
        let cell = cell(scene, seen.film);
        let mean = means[cell];
        let moment = error(channels(seen.radiance).map(|c| c * c), mean);
        let others = f64::from(seen.others).max(RAREST);
        let both_ways = (1.0 + others * others) / others;
        let found_by_camera = sum_of(channels(seen.radiance)) * both_ways / f64::from(per_sample);
        if found_by_camera < RARE * brightest_near(&means, cell) {
            of_lights += moment * SPREAD_OF_LIGHTS;
        } else {
            of_lights += moment * SPREAD_OF_RARE_LIGHTS;
            saved += moment * (1.0 / others + 2.0 * others);
        }
    }
    let scale = 1.0 / (f64::from(paths.max(1)) * f64::from(per_sample.max(1)) * pixels as f64);
    let camera_rays = looks.iter().map(|look| look.rays).sum::<u64>() as f64;
    let light_rays = flights.iter().map(|(_, rays)| rays).sum::<u64>() as f64;
    let shared_paths = looks.iter().map(|look| look.shared).sum::<u64>() as f64;
    let rays = camera_rays / (looks.len() as f64 * f64::from(PER_PIXEL));
    let may_split = can_split && rays - 1.0 <= MOST_RAYS_BEYOND;
    Worth {
        own,
        shared: of_camera - own,
        left,
        of_lights: of_lights * scale,
        saved: saved * scale,
        light_cost: COST * light_rays / FLIGHTS / camera_rays,
        joinable: shared_paths / camera_rays,
        rays,
        unmet: looks.iter().map(|look| f64::from(look.unmet)).sum::<f64>()
            / (looks.len() as f64 * f64::from(PER_PIXEL)),
        beyond: if may_split { part_beyond(scene, looks.len() as u32, &means) } else { 0.0 },
    }
}

/// The part of the variance of camera paths that comes from beyond the first surface, in so many pixels of a picture that has such means.
fn part_beyond(scene: &Prepared, pixels: u32, means: &[[f64; 3]]) -> f64 {
    let forks: Vec<Fork> = (0..pixels).into_par_iter().filter_map(|i| fork(scene, i)).collect();
    let sum = |variance: fn(&Fork) -> [f64; 3]| -> f64 {
        forks.iter().map(|fork| error(variance(fork), means[fork.cell])).sum()
    };
    let (all, beyond) = (sum(|fork| fork.all), sum(|fork| fork.beyond));
    if all > 0.0 { beyond / all } else { 0.0 }
}

/// The corner of a pixel anywhere in the picture.
fn corner(scene: &Prepared, index: u32) -> Vec2 {
    let (width, height) = scene.size();
    let [u, v, ..] = sampler(scene, 0, index, 1).set(0, Purpose::Camera);
    Vec2::new((u * width as f32).floor(), (v * height as f32).floor())
}

/// A ray through a pixel.
fn camera_ray(scene: &Prepared, sampler: &Sampler, corner: Vec2) -> Ray {
    let [u0, u1, u2, u3] = sampler.set(0, Purpose::Camera);
    scene.camera.ray(corner + Vec2::new(u0, u1), [u2, u3])
}

fn look(scene: &Prepared, index: u32, can_reuse: bool) -> Look {
    let corner = corner(scene, index);
    let (mut rays, mut shared, mut unmet) = (0, 0, 0);
    // All of a sample, its own part, and of that what is seen glowing.
    let samples: [[[f64; 3]; 3]; PER_PIXEL as usize] = std::array::from_fn(|sample| {
        let sampler = sampler(scene, 1 + index, sample as u32, PER_PIXEL);
        let ray = camera_ray(scene, &sampler, corner);
        let mut walk = if can_reuse { Walk::shared(scene, ray) } else { Walk::new(scene, ray) };
        let mut visible = None;
        walk.go_on(scene, &sampler, None, |_| false, |vertex| _ = visible.get_or_insert(vertex.radiance));
        shared += u64::from(walk.is_lit_beyond());
        unmet += u32::from(visible.is_none());
        let own = walk.path();
        let mut all = own;
        gather(scene, std::slice::from_ref(&walk), |(_, sample)| all = *sample);
        rays += all.rays;
        if !all.radiance.is_finite() {
            return [[0.0; 3]; 3];
        }
        let visible = visible.unwrap_or(all.radiance);
        [all.radiance, own.radiance, visible].map(channels)
    });
    let count = f64::from(PER_PIXEL);
    let mean = |of: &dyn Fn(&[[f64; 3]; 3]) -> [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| samples.iter().map(|sample| of(sample)[c] / count).sum())
    };
    // What glows hides or shows at its edges alone, which evenly spread points hardly miss.
    let variance = |part: usize| -> [f64; 3] {
        let of = |sample: &[[f64; 3]; 3]| std::array::from_fn(|c| sample[part][c] - sample[2][c]);
        let mean = mean(&of);
        let squares = |c: usize| samples.iter().map(move |sample| of(sample)[c] - mean[c]).map(|v| v * v);
        std::array::from_fn(|c| squares(c).sum::<f64>() / (count - 1.0))
    };
    let (variance, own_variance) = (variance(0), variance(1));
    Look {
        cell: cell(scene, corner + 0.5),
        mean: mean(&|sample| sample[0]),
        variance,
        own_variance,
        rays,
        shared,
        unmet,
    }
}

/// Takes two samples of a block of sixteen pixels; none if the picture is too small for one.
fn meet(scene: &Prepared, index: u32) -> Option<Meeting> {
    let ((width, height), (columns, rows)) = (scene.size(), BlockSize::Sixteen.sides());
    let [u, v, ..] = sampler(scene, MEETING_PLACES, index, 1).set(0, Purpose::Camera);
    let start = |u: f32, length: u32, side: u32| {
        let blocks = length / side;
        (blocks > 0).then(|| ((u * blocks as f32) as u32).min(blocks - 1) * side)
    };
    let corner = (start(u, width, columns)?, start(v, height, rows)?);
    // The four blocks of four one after the other, and so those of eight.
    let sides = BlockSize::Four.sides();
    let quarters = [(0, 0), (sides.0, 0), (0, sides.1), sides].map(|(x, y)| (corner.0 + x, corner.1 + y));
    let places = quarters.into_iter().flat_map(|quarter| block_around(quarter, sides, scene.size()));
    let places: SmallVec<[_; MOST]> = places.collect();
    // Each pixel's part that others can use, in blocks of so many.
    let sample = |sample: u32| -> [[[f64; 3]; MOST]; 1 + BlockSize::ALL.len()] {
        let walk = |(pixel, &(x, y)): (usize, &(u32, u32))| {
            let set = MEETING_PLACES + 1 + index * MOST as u32 + pixel as u32;
            let sampler = sampler(scene, set, sample, 2);
            let ray = camera_ray(scene, &sampler, Vec2::new(x as f32, y as f32));
            let mut walk = Walk::shared(scene, ray);
            walk.go_on(scene, &sampler, None, |_| false, |_| ());
            walk
        };
        let walks: SmallVec<[Walk; MOST]> = places.iter().enumerate().map(walk).collect();
        std::array::from_fn(|way| {
            let size = if way == 0 { 1 } else { BlockSize::ALL[way - 1].pixels() as usize };
            let mut parts = [[0.0; 3]; MOST];
            for (block, parts) in walks.chunks(size).zip(parts.chunks_mut(size)) {
                gather(scene, block, |(pixel, found)| {
                    let (all, own) = (channels(found.radiance), channels(block[pixel].path().radiance));
                    parts[pixel] = std::array::from_fn(|c| all[c] - own[c]);
                });
            }
            parts
        })
    };
    let (a, b) = (sample(0), sample(1));
    let variance = |way: usize| -> [f64; 3] {
        let halves =
            |c: usize| a[way].iter().zip(&b[way]).map(move |(a, b)| (a[c] - b[c]) * (a[c] - b[c]) / 2.0);
        std::array::from_fn(|c| halves(c).sum())
    };
    let (alone, joined) = (variance(0), std::array::from_fn(|size| variance(1 + size)));
    let is_usable = joined.iter().chain([&alone]).flatten().all(|v| v.is_finite());
    let cell = cell(scene, Vec2::new(corner.0 as f32, corner.1 as f32) + 0.5);
    is_usable.then_some(Meeting { cell, alone, joined })
}

/// Takes two samples of a pixel that branch; none if they are no numbers.
fn fork(scene: &Prepared, index: u32) -> Option<Fork> {
    let corner = corner(scene, index);
    let sample = |sample: u32| {
        let sampler = sampler(scene, 1 + index, sample, PER_PIXEL);
        let ray = camera_ray(scene, &sampler, corner);
        let first = first_surface(scene, &sampler, &ray);
        [0, 1].map(|branch| {
            let mut walk = Walk::new(scene, ray);
            walk.go_on_from_first(scene, &sampler.independent_branch(branch), first, |_| false, |_| ());
            channels(walk.path().radiance)
        })
    };
    let (a, b) = (sample(0), sample(1));
    let variance = |x: [f64; 3], y: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (x[c] - y[c]) * (x[c] - y[c]) / 2.0)
    };
    let (mut all, mut beyond) = ([0.0; 3], [0.0; 3]);
    for (x, y) in [(a[0], b[0]), (a[1], b[1])] {
        add(&mut all, variance(x, y));
    }
    for [x, y] in [a, b] {
        add(&mut beyond, variance(x, y));
    }
    let is_usable = all.iter().chain(&beyond).all(|v| v.is_finite());
    is_usable.then(|| Fork { cell: cell(scene, corner + 0.5), all, beyond })
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

/// The set of numbers for the places where blocks are looked at; their pixels have those above it, single pixels those below.
const MEETING_PLACES: u32 = 1 << 30;

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

/// The brightest of a part of the picture and those around it: a part that is mostly dark says little of what lies at its edge.
fn brightest_near(means: &[[f64; 3]], cell: usize) -> f64 {
    let (column, row) = (cell % CELLS as usize, cell / CELLS as usize);
    let around = |at: usize| at.saturating_sub(1)..=(at + 1).min(CELLS as usize - 1);
    let near = around(row).flat_map(|row| around(column).map(move |column| row * CELLS as usize + column));
    near.map(|cell| sum_of(means[cell])).fold(0.0, f64::max)
}

fn sum_of(radiance: [f64; 3]) -> f64 {
    radiance.into_iter().sum()
}

/// The mean over the channels of squares relative to what is seen.
fn error(squares: [f64; 3], seen: [f64; 3]) -> f64 {
    squares.into_iter().zip(seen).map(|(s, m)| relative_square(s, m)).sum::<f64>() / 3.0
}
