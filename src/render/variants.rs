//! One geometry, many materials: jobs of a sweep whose paths are the same up to the first surface whose material differs.
//!
//! A sample's random numbers belong to its vertices, lights are chosen without regard to materials, and what casts shadows casts them in
//! all variants alike: so a path that has met none of the differing materials yet is the same in all of them, to the last bit. It is
//! traced once to there, and then once more for each variant.

use std::sync::Arc;

use smallvec::SmallVec;

use super::Prepared;
use super::film::{camera_sample, sample_pixel};
use super::light_image;
use super::path::{PathSample, Walk, background, first_surface};
use super::reuse::{BlockSize, gather};
use super::splitting::{BRANCHES, Joint, of_branch};
use super::tile;
use crate::accel::{Hit, Ray};
use crate::math::sobol::Sampler;
use crate::settings::Integrator;

/// Most variants at once: of what the first of them share, little is left to save.
const MOST: usize = 16;
/// Memory for the pixels of all, in bytes.
const MOST_MEMORY: u64 = 1 << 31;

/// Scenes that differ in materials alone.
#[derive(Clone, Debug)]
pub struct Variants<'a> {
    scenes: Vec<&'a Prepared>,
    /// The materials, by index, that are not the same in all scenes.
    differing: Vec<bool>,
}

impl<'a> Variants<'a> {
    /// A scene without another.
    pub fn alone(scene: &'a Prepared) -> Self {
        Self { scenes: vec![scene], differing: vec![false; scene.materials.len()] }
    }

    /// Takes in as many of `scenes` as follow the first one and are variants of it.
    ///
    /// None of the materials that differ may emit light or let shadow rays pass, and everything else must be the same: geometry,
    /// textures, lights, camera and settings; light paths start in all or none, pixels share paths in blocks of the same size, and samples
    /// branch in all or none. There are at most 16, and at most as many as two gigabytes hold the pixels of.
    pub fn leading(scenes: impl IntoIterator<Item = &'a Prepared>) -> Option<Self> {
        let mut scenes = scenes.into_iter();
        let mut variants = Self::alone(scenes.next()?);
        for scene in scenes {
            if !variants.admit(scene) {
                break;
            }
        }
        Some(variants)
    }

    /// The scenes.
    pub fn scenes(&self) -> &[&'a Prepared] {
        &self.scenes
    }

    /// Takes a scene in if it is a variant of those that are here.
    fn admit(&mut self, scene: &'a Prepared) -> bool {
        let first = self.scenes[0];
        if self.scenes.len() >= self.room() || !differ_in_materials_alone(first, scene) {
            return false;
        }
        let materials = first.scene.materials.iter().zip(&scene.scene.materials);
        let differing: Vec<bool> =
            materials.zip(&self.differing).map(|((a, b), &differs)| differs || a.item != b.item).collect();
        let is_plain = |scene: &Prepared| {
            let differing = scene.materials.iter().zip(&differing).filter(|(_, differs)| **differs);
            differing
                .into_iter()
                .all(|(m, _)| m.blocks_shadow_rays() && m.mean_emission(&scene.scene).is_none())
        };
        let fits = self.scenes.iter().copied().chain([scene]).all(is_plain);
        if fits {
            self.differing = differing;
            self.scenes.push(scene);
        }
        fits
    }

    /// How many there may be.
    fn room(&self) -> usize {
        let first = self.scenes[0];
        let (width, height) = first.size();
        let bytes = u64::from(width)
            * u64::from(height)
            * (tile::bytes_a_pixel(first) + light_image::bytes_a_pixel(first));
        usize::try_from(MOST_MEMORY / bytes.max(1)).unwrap_or(MOST).clamp(1, MOST)
    }

    /// The columns and rows of the blocks whose pixels are sampled together.
    pub(super) fn block_sides(&self) -> (u32, u32) {
        self.scenes[0].path_reuse.as_ref().map_or((1, 1), |block| block.sides())
    }

    /// Takes a sample of each pixel of a block of the variants that are `going` on, at least one, and gives each one's to `found`, with the
    /// pixel's place in the block and the number of rays that others share.
    #[inline]
    pub(super) fn sample(
        &self,
        going: &[usize],
        block: &[(u32, u32)],
        sample: u32,
        mut found: impl FnMut(usize, usize, &PathSample, u64),
    ) {
        let first = self.scenes[going[0]];
        match first.path_reuse {
            Ok(BlockSize::Four) => return self.sample_block::<4>(going, block, sample, found),
            Ok(BlockSize::Eight) => return self.sample_block::<8>(going, block, sample, found),
            Ok(BlockSize::Sixteen) => return self.sample_block::<16>(going, block, sample, found),
            Err(_) if first.splitting.is_ok() => {
                return self.sample_block::<1>(going, block, sample, found);
            }
            Err(_) => (),
        }
        for (pixel, &place) in block.iter().enumerate() {
            self.sample_pixel(going, place, sample, |variant, path, shared| {
                found(variant, pixel, path, shared)
            });
        }
    }

    #[inline]
    fn sample_pixel(
        &self,
        going: &[usize],
        (x, y): (u32, u32),
        sample: u32,
        mut found: impl FnMut(usize, &PathSample, u64),
    ) {
        let first = self.scenes[going[0]];
        if going.len() == 1 {
            return found(going[0], &sample_pixel(first, x, y, sample, |_| ()), 0);
        }
        let (sampler, ray) = camera_sample(first, x, y, sample);
        let mut walk = Walk::new(first, ray);
        let Some(met) = walk.go_on(first, &sampler, None, |hit| self.differs(hit), |_| ()) else {
            let path = walk.path();
            return going.iter().for_each(|&variant| found(variant, &path, path.rays));
        };
        for &variant in going {
            let path = walk.finished(self.scenes[variant], &sampler, Some(met)).path();
            found(variant, &path, walk.path().rays);
        }
    }

    /// The pixels join each other's paths ([`super::reuse`]), or samples branch ([`super::splitting`]), or both.
    fn sample_block<const PIXELS: usize>(
        &self,
        going: &[usize],
        block: &[(u32, u32)],
        sample: u32,
        mut found: impl FnMut(usize, usize, &PathSample, u64),
    ) {
        let first = self.scenes[going[0]];
        let are_several = going.len() > 1;
        let starts: SmallVec<[(Sampler, Ray); PIXELS]> =
            block.iter().map(|&(x, y)| camera_sample(first, x, y, sample)).collect();
        let seen: SmallVec<[Option<Hit>; PIXELS]> =
            starts.iter().map(|(sampler, ray)| first_surface(first, sampler, ray)).collect();
        if seen.iter().all(Option::is_none) {
            // No paths to be joined, nor to be made for that.
            for (pixel, (_, ray)) in starts.iter().enumerate() {
                let path = background(first, ray);
                for &variant in going {
                    found(variant, pixel, &path, if are_several { path.rays } else { 0 });
                }
            }
            return;
        }
        if first.splitting.is_err() {
            return self.go_on_from::<PIXELS>(going, &starts, &seen, found);
        }
        let mut joint: SmallVec<[[Joint; PIXELS]; 1]> =
            going.iter().map(|_| [Joint::default(); PIXELS]).collect();
        for branch in BRANCHES {
            let starts: SmallVec<[(Sampler, Ray); PIXELS]> =
                starts.iter().map(|&(sampler, ray)| (of_branch(first, sampler, branch), ray)).collect();
            self.go_on_from::<PIXELS>(going, &starts, &seen, |variant, pixel, path, shared_rays| {
                if let Some(place) = going.iter().position(|&going| going == variant) {
                    joint[place][pixel].add(path, shared_rays);
                }
            });
        }
        for (&variant, joint) in going.iter().zip(&joint) {
            for (pixel, sample) in joint.iter().enumerate().take(block.len()) {
                found(variant, pixel, &sample.path, sample.shared_rays);
            }
        }
    }

    /// Goes on with a block of paths whose first rays met what was `seen`.
    fn go_on_from<const PIXELS: usize>(
        &self,
        going: &[usize],
        starts: &[(Sampler, Ray)],
        seen: &[Option<Hit>],
        mut found: impl FnMut(usize, usize, &PathSample, u64),
    ) {
        let first = self.scenes[going[0]];
        let are_several = going.len() > 1;
        // Collected, not pushed: so they are made where they stay.
        let mut walks: SmallVec<[Walk; PIXELS]> = starts
            .iter()
            .map(|&(_, ray)| if PIXELS > 1 { Walk::shared(first, ray) } else { Walk::new(first, ray) })
            .collect();
        let stops = |hit: &Hit| are_several && self.differs(hit);
        let stopped: SmallVec<[Option<Hit>; PIXELS]> = walks
            .iter_mut()
            .zip(starts)
            .zip(seen)
            .map(|((walk, (sampler, _)), &seen)| walk.go_on_from_first(first, sampler, seen, stops, |_| ()))
            .collect();
        if stopped.iter().all(Option::is_none) {
            return gather(first, &walks, |(pixel, path)| {
                for &variant in going {
                    found(variant, pixel, path, if are_several { path.rays } else { 0 });
                }
            });
        }
        for &variant in going {
            let scene = self.scenes[variant];
            let finished: SmallVec<[Walk; PIXELS]> = walks
                .iter()
                .zip(starts)
                .zip(&stopped)
                .map(|((walk, (sampler, _)), met)| walk.finished(scene, sampler, *met))
                .collect();
            gather(scene, &finished, |(pixel, path)| found(variant, pixel, path, walks[pixel].path().rays));
        }
    }

    fn differs(&self, hit: &Hit) -> bool {
        self.differing[self.scenes[0].material_index(hit.triangle)]
    }
}

/// Whether the scenes' paths are the same up to where their materials differ, provided that these do not emit, cover and shade
/// differently.
fn differ_in_materials_alone(a: &Prepared, b: &Prepared) -> bool {
    let (from, to) = (&a.scene, &b.scene);
    let has_same_images = from.images.len() == to.images.len()
        && from.images.iter().zip(&to.images).all(|(a, b)| Arc::ptr_eq(a, b));
    Arc::ptr_eq(&a.geometry, &b.geometry)
        && a.settings == b.settings
        && a.settings.integrator == Integrator::Path
        && a.techniques == b.techniques
        && a.light_paths.is_ok() == b.light_paths.is_ok()
        && a.path_reuse.as_ref().ok() == b.path_reuse.as_ref().ok()
        && a.splitting.is_ok() == b.splitting.is_ok()
        && a.adaptive.is_ok() == b.adaptive.is_ok()
        && a.camera_medium == b.camera_medium
        && from.materials.len() == to.materials.len()
        && from.instances == to.instances
        && from.textures == to.textures
        && has_same_images
        && from.cameras == to.cameras
        && from.lights == to.lights
        && from.environment == to.environment
}
