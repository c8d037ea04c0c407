//! Two paths that go on from the first surface of each camera sample.
//!
//! What a camera's ray meets is found once, and from there the sample branches ("splitting": Arvo and Kirk 1990, "Particle Transport and Image
//! Synthesis"): light and BSDF are sampled anew for each branch, and the sample is their mean. Noise of what surfaces reflect falls as it does
//! with twice the samples, for less than twice the time: rays that meet the sky need no second look. Noise of what is seen, at edges and in
//! textures, stays. So this is for pictures that are mostly sky.

use super::Prepared;
use super::path::PathSample;
use crate::math::sobol::Sampler;

/// The branches of a sample.
pub(super) const BRANCHES: std::ops::Range<u32> = 0..2;

/// The numbers of a branch.
#[inline]
pub(super) fn of_branch(scene: &Prepared, sampler: Sampler, branch: u32) -> Sampler {
    match scene.techniques.sobol {
        true => sampler.branch(branch),
        false => sampler.independent_branch(branch),
    }
}

/// What the branches of a sample find together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Joint {
    pub(super) path: PathSample,
    pub(super) shared_rays: u64,
}

impl Joint {
    /// Takes in what a branch found, with so many rays that others share.
    #[inline]
    pub(super) fn add(&mut self, branch: &PathSample, shared_rays: u64) {
        // They have the camera's ray in common.
        let is_first = self.path.rays == 0;
        let again = |rays: u64| if is_first { rays } else { rays.saturating_sub(1) };
        self.path = PathSample {
            radiance: self.path.radiance + branch.radiance * 0.5,
            first: branch.first,
            rays: self.path.rays + again(branch.rays),
        };
        self.shared_rays += again(shared_rays);
    }
}
