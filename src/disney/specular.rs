//! The specular lobe: GTR2 with Schlick's Fresnel.

use super::microfacet::{Alpha, Gtr2, alpha_from_roughness, smith};
use super::pair::Pair;
use super::parameter::{Masking, Params};
use crate::color::Rgb;
use crate::math::{Real, V3};

/// Reflection by the base layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Specular<F> {
    f0: Rgb<F>,
    mean_f0: F,
    distribution: Gtr2<F>,
    /// Of D, and so of the normals that the sampler takes for visible.
    alpha: Alpha<F>,
    /// Of G.
    masking_alpha: Alpha<F>,
    masking: Masking,
    roughness: F,
}

/// lerp(0.08·specular·lerp(1, tint, specular_tint), base_color, metallic); may exceed 1.
pub(super) fn specular_f0<F: Real>(params: &Params<F>, tint: Rgb<F>) -> Rgb<F> {
    let dielectric = Rgb::WHITE.lerp(tint, params.specular_tint) * (F::of(0.08) * params.specular);
    dielectric.lerp(params.base_color, params.metallic)
}

impl<F: Real> Specular<F> {
    pub(super) fn new(params: &Params<F>, f0: Rgb<F>, masking: Masking) -> Self {
        let alpha = alpha_from_roughness(params.roughness, params.anisotropic);
        let masking_alpha = match masking {
            Masking::Matched => alpha,
            Masking::Remapped => {
                let half = F::of(0.5);
                alpha_from_roughness(half + half * params.roughness, params.anisotropic)
            }
        };
        Self {
            f0,
            mean_f0: f0.mean(),
            distribution: Gtr2::new(alpha),
            alpha,
            masking_alpha,
            masking,
            roughness: params.roughness,
        }
    }

    /// An estimate of the reflected part of light, from Schlick's weight at `wo`. Never 0: even where F0 is, light is reflected.
    #[inline]
    pub(super) fn albedo(&self, _wo: V3<F>, schlick_o: F) -> F {
        let rough = self.roughness.sqr();
        let edge = schlick_o * (F::ONE - F::of(0.7) * rough) + F::of(0.005) + F::of(0.02) * rough;
        self.mean_f0 + (F::ONE - self.mean_f0).max(F::ZERO) * edge
    }

    /// The BRDF G·F·D (Burley 2012, section 5.4; G holds the 1/(4 cos θi cos θo)), and the density of [`Self::sample`] per unit solid
    /// angle: with visible normals D·smith(wo)/2.
    #[inline]
    pub(super) fn eval_with_pdf(&self, pair: &Pair<F>) -> (Rgb<F>, F) {
        let d = self.distribution.density(pair);
        let masking_o = smith(pair.wo, self.masking_alpha);
        let masking_i = smith(pair.wi, self.masking_alpha);
        let visible_o = match self.masking {
            Masking::Matched => masking_o,
            Masking::Remapped => smith(pair.wo, self.alpha),
        };
        let fresnel = self.f0 + (Rgb::WHITE - self.f0) * pair.schlick;
        (fresnel * (masking_o * masking_i * d), F::of(0.5) * d * visible_o)
    }

    /// `wo` mirrored at a visible normal; may lie below the horizon.
    #[inline]
    pub(super) fn sample(&self, wo: V3<F>, u: [F; 2]) -> V3<F> {
        V3::reflect(wo, self.distribution.sample_visible(wo, u).normalize())
    }
}
