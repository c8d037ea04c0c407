//! How often each lobe of the mixture is sampled.

use super::fresnel::{DielectricSplit, dielectric_split};
use super::mixture::Mixture;
use super::transmission::Passage;
use crate::math::{Number, Real, V3};

/// How often each sampler is chosen: they sum to 1, or are all 0 where nothing is scattered; before that, the estimates they are
/// proportional to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Probabilities<F> {
    /// Diffuse and sheen, by the cosine.
    pub(super) cosine: F,
    /// Diffuse, uniform over the hemisphere.
    pub(super) uniform: F,
    pub(super) clearcoat: F,
    /// Specular; with a rough interface, both what its facets reflect and what they refract.
    pub(super) specular: F,
    /// Transmission that has a sampler of its own.
    pub(super) transmission: F,
    pub(super) diffuse_transmission: F,
}

/// The sampler that makes a direction.
#[derive(Clone, Copy, Debug)]
pub(super) enum Choice {
    Cosine,
    Uniform,
    Clearcoat,
    Transmission,
    DiffuseTransmission,
    Specular,
}

impl<F: Number> Probabilities<F> {
    /// The sum of all.
    #[inline]
    pub(super) fn sum(&self) -> F {
        let all = self.cosine + self.uniform + self.specular + self.clearcoat;
        all + (self.transmission + self.diffuse_transmission)
    }

    #[inline]
    pub(super) fn normalized(self) -> Self {
        let sum = self.sum();
        // The reciprocal of a denormal sum isn't finite.
        let lift = F::select(F::of(1e-30).above(sum), F::of(1e30), F::ONE);
        let scale = F::select(sum.above(F::ZERO), F::ONE / (sum * lift), F::ZERO);
        self.map(|estimate| estimate * lift * scale)
    }

    #[inline]
    fn map(self, f: impl Fn(F) -> F) -> Self {
        Self {
            cosine: f(self.cosine),
            uniform: f(self.uniform),
            clearcoat: f(self.clearcoat),
            specular: f(self.specular),
            transmission: f(self.transmission),
            diffuse_transmission: f(self.diffuse_transmission),
        }
    }
}

impl<F: Real> Probabilities<F> {
    /// The sampler that `u` in [0, 1) stands for, and what is left of `u` as a number in [0, 1) for a choice within it.
    #[inline]
    pub(super) fn choose(&self, u: F) -> (Choice, F) {
        let mut rest = u;
        for (choice, chance) in [
            (Choice::Cosine, self.cosine),
            (Choice::Uniform, self.uniform),
            (Choice::Clearcoat, self.clearcoat),
            (Choice::Transmission, self.transmission),
            (Choice::DiffuseTransmission, self.diffuse_transmission),
        ] {
            let beyond = rest - chance;
            if beyond < F::ZERO {
                return (choice, rest / chance);
            }
            rest = beyond;
        }
        (Choice::Specular, rest / self.specular)
    }
}

/// The same for every lobe that is there.
fn equal_chance<F: Real>(estimate: F) -> F {
    if estimate > F::ZERO { F::ONE } else { F::ZERO }
}

impl<F: Number> Mixture<F> {
    /// [`Self::estimates`] of what is reflected in front.
    #[inline]
    pub(super) fn estimates_of_reflection(&self, wo: V3<F>, split: &DielectricSplit<F>) -> Probabilities<F> {
        let (mut cosine, uniform) = self.diffuse.as_ref().map_or((F::ZERO, F::ZERO), |d| d.albedos(wo));
        if let Some(sheen) = &self.sheen {
            cosine += sheen.albedo(wo);
        }
        let clearcoat = self.clearcoat.as_ref().map_or(F::ZERO, |coat| coat.albedo(wo));
        let specular = self.specular.albedo(wo, split);
        let (transmission, diffuse_transmission) = (F::ZERO, F::ZERO);
        Probabilities { cosine, uniform, clearcoat, specular, transmission, diffuse_transmission }
    }
}

impl<F: Real> Mixture<F> {
    /// Proportional to [`Self::estimates`], or equal where they are above 0.
    #[inline]
    pub(super) fn probabilities(&self, wo: V3<F>) -> Probabilities<F> {
        let estimates = self.estimates(wo);
        let chances = if self.equal_lobes { estimates.map(equal_chance) } else { estimates };
        chances.normalized()
    }

    /// What each lobe scatters towards `wo`, about: the mean over channels of its albedo. The only source of lobe probabilities. In
    /// front, a lobe that is there never has 0.
    #[inline]
    pub(super) fn estimates(&self, wo: V3<F>) -> Probabilities<F> {
        if wo.z < F::ZERO {
            return self.estimates_inside(wo);
        }
        let mut transmission = F::ZERO;
        let mut split = DielectricSplit::OPAQUE;
        let mut refracted = F::ZERO;
        if let Some(through) = &self.transmission {
            split = dielectric_split(wo.z, through.ior);
            match through.passage {
                Passage::Rough => refracted = through.mean * split.transmittance,
                Passage::Smooth => {
                    transmission = through.mean * split.transmittance * self.unmasked_passage(wo, &split);
                }
                Passage::ThinSmooth => transmission = through.mean * split.transmittance,
                Passage::ThinRough(..) => {
                    let typical = dielectric_split(through.typical_cosine(wo), through.ior);
                    // Some facets lean to the viewer and transmit even where all of the sheet would reflect.
                    transmission = through.mean * typical.transmittance.max(F::of(0.02));
                }
            }
        }
        let reflected = self.estimates_of_reflection(wo, &split);
        let diffuse_transmission = self.diffuse_transmission.as_ref().map_or(F::ZERO, |d| d.albedo);
        Probabilities {
            specular: reflected.specular + refracted,
            transmission,
            diffuse_transmission,
            ..reflected
        }
    }

    /// [`super::Bsdf::highlight`].
    #[inline]
    pub(super) fn highlight(&self, wo: V3<F>) -> Option<(F, F)> {
        if self.transmission.is_some() || self.specular.is_delta || wo.z < F::ZERO {
            return None;
        }
        let estimates = self.estimates(wo);
        let part = estimates.specular / estimates.sum();
        (part > F::ZERO).then(|| (self.specular.alpha.x * self.specular.alpha.y, part))
    }

    /// From inside there is nothing but the dielectric and diffuse transmission.
    fn estimates_inside(&self, wo: V3<F>) -> Probabilities<F> {
        let mut estimate = Probabilities::default();
        if let Some(through) = &self.transmission {
            let split = dielectric_split(wo.z.abs(), through.eta(wo));
            let reflected = self.specular.interface * split.reflectance;
            match through.passage {
                Passage::Rough => estimate.specular = reflected + through.mean * split.transmittance,
                Passage::Smooth => {
                    // Beside a smooth passage the reflection may still be rough, where the indices match: never 0 then.
                    let unmasked = self.specular.unmasked(wo.mirrored_z()).sqr();
                    estimate.specular = if self.specular.is_delta {
                        reflected * unmasked
                    } else {
                        reflected + self.specular.interface * F::of(1e-6)
                    };
                    estimate.transmission =
                        through.mean * split.transmittance * self.unmasked_passage(wo, &split);
                }
                Passage::ThinRough(..) | Passage::ThinSmooth => {}
            }
        }
        if let Some(diffuse) = self.diffuse_transmission.as_ref().filter(|_| !self.thin_walled) {
            estimate.diffuse_transmission = diffuse.albedo;
        }
        estimate
    }
}
