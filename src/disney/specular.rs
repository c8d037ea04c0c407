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
    distribution: Gtr2<F>,
    /// Of D, and so of the normals that the sampler takes for visible.
    alpha: Alpha<F>,
    /// Of G.
    masking_alpha: Alpha<F>,
    masking: Masking,
    roughness: F,
    // Coefficients of `albedo`: of the part that F0 reflects, and of the part that Schlick's weight adds.
    base: F,
    base_rise: F,
    edge_share: F,
    edge: F,
    edge_spread: F,
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
        let a = params.roughness.sqr();
        let mean_f0 = f0.mean();
        Self {
            f0,
            distribution: Gtr2::new(alpha),
            alpha,
            masking_alpha,
            masking,
            roughness: params.roughness,
            base: mean_f0 * (F::ONE - F::of(0.69) * a),
            base_rise: mean_f0 * F::of(0.3) * a,
            edge_share: (F::ONE - mean_f0).max(F::of(0.01)),
            edge: F::ONE / (F::ONE + F::of(6.5) * a).sqr(),
            edge_spread: (F::of(4.0) * a).min(F::ONE),
        }
    }

    /// An estimate of the reflected part of light, a fit to the integral, rough where the lobe is dim. Never 0: light is reflected
    /// even where F0 is 0.
    #[inline]
    pub(super) fn albedo(&self, wo: V3<F>) -> F {
        let slant = (F::ONE - wo.z).max(F::ZERO);
        let smooth_edge = slant.pow5();
        let rough_edge = slant.sqr() * slant;
        let edge = self.edge * smooth_edge.lerp(rough_edge, self.edge_spread) + F::of(0.002);
        let albedo = self.base + self.base_rise * smooth_edge + self.edge_share * edge;
        match self.masking {
            Masking::Matched => albedo,
            Masking::Remapped => {
                // Both directions are masked more than D's own alpha says; the light's less so the wider the lobe.
                let masked = smith(wo, self.masking_alpha) / smith(wo, self.alpha);
                albedo * masked * masked.lerp(F::ONE, self.roughness)
            }
        }
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
