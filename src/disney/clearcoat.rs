//! The clearcoat: a second, achromatic specular lobe with GTR1's long tail.

use glam::Vec4;

use super::fresnel::schlick_weight;
use super::microfacet::{Gtr1, smith_isotropic};
use super::pair::Pair;
use super::parameter::Params;
use crate::math::{Number, Real, V3};

/// Alpha of the coat's masking term, whatever the gloss.
const MASKING_ALPHA: f64 = 0.25;
/// The coat's reflectance at normal incidence: index 1.5.
const F0: f64 = 0.04;

/// Reflection by the coat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearcoat<F> {
    /// 0.25·clearcoat.
    strength: F,
    distribution: Gtr1<F>,
}

impl<F: Real> Clearcoat<F> {
    /// `None` where there is no coat.
    pub(super) fn new(params: &Params<F>) -> Option<Self> {
        if params.clearcoat == F::ZERO {
            return None;
        }
        let alpha = F::of(0.1).lerp(F::of(0.001), params.clearcoat_gloss);
        Some(Self { strength: F::of(0.25) * params.clearcoat, distribution: Gtr1::new(alpha) })
    }
}

impl Clearcoat<f32> {
    /// The coat that adds nothing.
    pub(super) fn none(&self) -> Self {
        Self { strength: 0.0, ..*self }
    }

    /// Four side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Clearcoat<Vec4> {
        Clearcoat {
            strength: Vec4::from_array(four.map(|coat| coat.strength)),
            distribution: Gtr1::beside(four.map(|coat| &coat.distribution)),
        }
    }
}

impl<F: Number> Clearcoat<F> {
    /// An estimate of the reflected part of light: a fit to the integral, within a third of it at any gloss.
    #[inline]
    pub(super) fn albedo(&self, wo: V3<F>) -> F {
        let grazing = (F::of(3.0) * schlick_weight(wo.z)).min(F::ONE);
        self.strength * (F::of(0.035) + F::of(0.125) * grazing)
    }

    /// 0.25·clearcoat·G·F·D (Burley 2012, section 5.4, and disney.brdf), the same in all channels, and the density of
    /// [`Self::sample`] per unit solid angle, D·hz/(4 cos θd).
    #[inline]
    pub(super) fn eval_with_pdf(&self, pair: &Pair<F>) -> (F, F) {
        let d = self.distribution.density(pair);
        let alpha = F::of(MASKING_ALPHA);
        let masking = smith_isotropic(pair.wo.z, alpha) * smith_isotropic(pair.wi.z, alpha);
        let fresnel = F::of(F0) + F::of(1.0 - F0) * pair.edge.weight;
        // hz/(4 cos θd) = sum.z/|sum| / (2|sum|).
        (self.strength * masking * fresnel * d, F::of(0.5) * d * pair.sum.z / pair.sum2)
    }
}

impl<F: Real> Clearcoat<F> {
    /// The largest weight of a sample; see `bound`.
    pub(super) fn weight_bound(&self, mu: F) -> F {
        let alpha = F::of(MASKING_ALPHA);
        let root = mu.sqrt() + alpha.sqrt();
        self.strength * F::of(8.0 * F0) * smith_isotropic(mu, alpha) / root.sqr()
    }

    /// `wo` mirrored at a normal of GTR1; may lie below the horizon.
    #[inline]
    pub(super) fn sample(&self, wo: V3<F>, u: [F; 2]) -> V3<F> {
        V3::reflect(wo, self.distribution.sample(u))
    }
}
