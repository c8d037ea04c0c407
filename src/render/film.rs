//! From samples to pictures: how long to go on, and the layers of the result.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use glam::Vec2;
use rayon::prelude::*;
use smallvec::SmallVec;

use super::Prepared;
use super::adaptive::{Plan, Sight};
use super::integrators::integrate;
use super::light_image::LightImage;
use super::pace::Pace;
use super::path::PathSample;
use super::replay::ReplayVertex;
use super::tile::{Block, Level, NAMED_BAD_SAMPLES, Pixel, Tile, levels};
use super::variants::Variants;
use crate::accel::Ray;
use crate::math::sobol::{Purpose, Sampler};
use crate::raster::{Layer, Raster, Window};
use crate::record::Counts;

/// What others may see of a running render, and how long it may take.
#[derive(Debug, Default)]
pub struct Control {
    /// Paths finished so far, of the camera and from lights.
    pub paths: AtomicU64,
    /// Paths there will be; 0 until the render begins.
    pub total_paths: AtomicU64,
    /// Stop sampling after so long, if the settings do not end the render before.
    pub time_limit: Option<Duration>,
}

/// A finished render.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// `beauty` with R, G, B, and `data` with albedo, normal, Z, variance and samples.
    pub raster: Raster,
    /// What was counted.
    pub counts: Counts,
    /// How many of the rays were traced for other variants too.
    pub shared_rays: u64,
}

/// Renders every pixel on the current rayon pool.
///
/// With the settings' number of samples or error, the bits of the result depend on nothing but the scene and the settings; with a limit
/// of time in `control`, on the machine as well.
pub fn render(scene: &Prepared, control: &Control) -> Rendered {
    let (stacks, lit) = sampled(&Variants::alone(scene), control);
    developed(scene, stacks.into_iter().flatten(), &lit[0])
}

/// Renders all variants at once, and gives each one's index and picture to `done`: the same bits as [`render`] makes of each, but what
/// their paths have in common is traced once.
pub fn render_together(variants: &Variants<'_>, control: &Control, mut done: impl FnMut(usize, Rendered)) {
    let (mut stacks, lit) = sampled(variants, control);
    for (variant, (scene, lit)) in variants.scenes().iter().zip(&lit).enumerate() {
        let tiles = stacks.iter_mut().map(|stack| std::mem::take(&mut stack[variant]));
        done(variant, developed(scene, tiles, lit));
    }
}

/// Takes all samples: at each place of the picture a tile for each variant, and what each one's light paths bring.
fn sampled(variants: &Variants<'_>, control: &Control) -> (Vec<Vec<Tile>>, Vec<LightImage>) {
    let scenes = variants.scenes();
    let first = scenes[0];
    let total: u64 = scenes.iter().map(|scene| most_paths(scene)).sum();
    control.total_paths.store(total, Ordering::Relaxed);
    let mut stacks: Vec<Vec<Tile>> =
        Tile::all(first).into_iter().map(|tile| vec![tile; scenes.len()]).collect();
    let mut lit: Vec<LightImage> = scenes.iter().map(|scene| LightImage::new(scene)).collect();
    let (mut sights, mut plans): (Vec<Sight>, Vec<Plan>) = (Vec::new(), Vec::new());
    let mut pace = Pace::new(control.time_limit);
    let mut levels = levels(first, control.time_limit.is_some()).into_iter().peekable();
    let mut reached = 0;
    while let Some(&next) = levels.peek() {
        let start = Instant::now();
        let going = stacks.iter().flatten().filter(|tile| !tile.is_finished).count();
        let Some(level) = pace.reachable(next, reached, going) else { break };
        if let Some(aim) = level.aim {
            plans = sights.iter().map(|sight| Plan::new(sight, aim)).collect();
        }
        if level.is_last && !plans.is_empty() {
            control
                .total_paths
                .store(paths_in_all(&plans, scenes, &stacks, &lit, control), Ordering::Relaxed);
        }
        for (variant, (lit, scene)) in lit.iter_mut().zip(scenes).enumerate() {
            if stacks.iter().any(|stack| !stack[variant].is_finished) {
                lit.sample_up_to(scene, level.samples, control);
            }
        }
        // One by one: rayon would leave a run of tiles to one thread while the others are done.
        stacks.par_iter_mut().with_max_len(1).for_each(|stack| {
            // Every tile gets its first samples, also after the deadline: a picture has no holes.
            let ends = pace.is_over() && stack.iter().all(|tile| tile.samples > 0);
            if !ends {
                sample_up_to(variants, stack, level, &plans, &lit, control);
            }
        });
        if level.is_looked_at {
            let size = Tile::patches_of(first.size());
            let seen = |variant: usize, lit| stacks.iter().flat_map(move |stack| stack[variant].seen(lit));
            sights = (0..).zip(&lit).map(|(variant, lit)| Sight::new(size, seen(variant, lit))).collect();
        }
        pace.took(level.samples - reached, going, start);
        reached = level.samples;
        levels.next_if_eq(&level);
    }
    (stacks, lit)
}

/// Camera and light paths that the settings allow.
fn most_paths(scene: &Prepared) -> u64 {
    let (width, height) = scene.size();
    u64::from(width) * u64::from(height) * u64::from(scene.settings.spp) + light_paths(scene)
}

/// Those that there will have been when each pixel has what is planned.
fn paths_in_all(
    plans: &[Plan],
    scenes: &[&Prepared],
    stacks: &[Vec<Tile>],
    lit: &[LightImage],
    control: &Control,
) -> u64 {
    let planned = plans.iter().enumerate().map(|(variant, plan)| {
        let of_lights = light_paths(scenes[variant]).saturating_sub(lit[variant].paths);
        of_lights + stacks.iter().map(|stack| stack[variant].paths_to(plan)).sum::<u64>()
    });
    control.paths.load(Ordering::Relaxed) + planned.sum::<u64>()
}

fn light_paths(scene: &Prepared) -> u64 {
    scene.light_paths.as_ref().map_or(0, |plan| plan.paths(scene.settings.spp))
}

/// Goes on with the tiles at one place until the pixels of those that are not finished have the `level`'s samples, or their planned ones.
fn sample_up_to(
    variants: &Variants<'_>,
    tiles: &mut [Tile],
    level: Level,
    plans: &[Plan],
    lit: &[LightImage],
    control: &Control,
) {
    let settings = &variants.scenes()[0].settings;
    let going: Vec<usize> = (0..tiles.len()).filter(|&variant| !tiles[variant].is_finished).collect();
    let Some(&any) = going.first() else { return };
    for &variant in &going {
        tiles[variant].begin(settings, level.samples, plans.get(variant));
    }
    let blocks: Vec<Block> = tiles[any].blocks(variants.block_sides()).collect();
    for block in &blocks {
        let patch = tiles[any].patch(block[0]);
        // Each goes on from where it stands to its own goal, with those that want the same samples.
        let wanted: SmallVec<[_; 16]> = going
            .iter()
            .map(|&variant| (variant, tiles[variant].patches[patch]))
            .map(|(variant, patch)| (variant, patch.samples..patch.goal))
            .collect();
        let mut ends: SmallVec<[u32; 32]> =
            wanted.iter().flat_map(|(_, samples)| [samples.start, samples.end]).collect();
        ends.sort_unstable();
        ends.dedup();
        for &[start, end] in ends.array_windows() {
            let takers: SmallVec<[usize; 16]> = wanted
                .iter()
                .filter(|(_, samples)| samples.contains(&start))
                .map(|(variant, _)| *variant)
                .collect();
            if !takers.is_empty() {
                sample_block(variants, tiles, &takers, block, start..end);
                let paths = u64::from(end - start) * (takers.len() * block.len()) as u64;
                control.paths.fetch_add(paths, Ordering::Relaxed);
            }
        }
    }
    for variant in going {
        let spared = tiles[variant].end(settings, level, &lit[variant]);
        control.paths.fetch_add(spared, Ordering::Relaxed);
    }
}

/// Takes samples of a block for the tiles of the variants that are `going` on.
fn sample_block(
    variants: &Variants<'_>,
    tiles: &mut [Tile],
    going: &[usize],
    block: &Block,
    samples: std::ops::Range<u32>,
) {
    for sample in samples {
        variants.sample(going, block, sample, |variant, place, path, shared_rays| {
            tiles[variant].add(block[place], sample, path);
            tiles[variant].shared_rays += shared_rays;
        });
    }
}

/// The picture that the tiles make.
fn developed(scene: &Prepared, tiles: impl Iterator<Item = Tile>, lit: &LightImage) -> Rendered {
    let (width, height) = scene.size();
    let mut pixels = vec![Pixel::default(); width as usize * height as usize];
    let mut counts = Counts {
        rays: lit.rays,
        bad_samples: lit.bad_count,
        triangles: scene.geometry.triangle_count() as u64,
        ..Counts::default()
    };
    let mut shared_rays = 0;
    for mut tile in tiles {
        shared_rays += tile.shared_rays;
        counts.rays += tile.rays();
        counts.paths += tile.paths();
        counts.bad_samples += tile.bad_count;
        counts.first_bad_samples.append(&mut tile.bad);
        for ((x, y), pixel) in tile.pixels(lit) {
            pixels[y as usize * width as usize + x as usize] = pixel;
        }
    }
    counts.first_bad_samples.sort_unstable_by_key(|b| (b.y, b.x, b.sample));
    counts.first_bad_samples.truncate(NAMED_BAD_SAMPLES);
    Rendered { raster: layers(scene, &pixels), counts, shared_rays }
}

/// The random numbers of a sample of a pixel, and the ray that its path begins with.
#[inline]
pub(super) fn camera_sample(scene: &Prepared, x: u32, y: u32, sample: u32) -> (Sampler, Ray) {
    let settings = &scene.settings;
    let sampler = match scene.techniques.sobol {
        // To complete each other, pixels have to have equally many.
        true if scene.adaptive.is_ok() => {
            Sampler::new(settings.seed, x, y, sample, settings.effective_replicates())
        }
        true => {
            Sampler::in_square(settings.seed, (x, y), sample, settings.spp, settings.effective_replicates())
        }
        // Samples that are sets of their own are independent.
        false => Sampler::new(settings.seed, x, y, sample, settings.spp),
    };
    let [u0, u1, u2, u3] = sampler.set(0, Purpose::Camera);
    let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    let film = center + Vec2::new(scene.filter.offset(u0), scene.filter.offset(u1));
    (sampler, scene.camera.ray(film, [u2, u3]))
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
    let (sampler, ray) = camera_sample(scene, x, y, sample);
    integrate(scene, &sampler, ray, inspect)
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
    // A single sample has no spread to tell a variance from.
    if scene.settings.parts() > 1 {
        data = data
            .with("variance.R", plane(&|p| p.variance.r))
            .with("variance.G", plane(&|p| p.variance.g))
            .with("variance.B", plane(&|p| p.variance.b));
    }
    Raster { display: window, layers: vec![beauty, data] }
}
