//! The specular lobe: GTR2 with Schlick's Fresnel, blended with a dielectric's where the base is an interface.

use glam::Vec4;

use super::bound::hue;
use super::fresnel::{DielectricSplit, Edge};
use super::microfacet::{Alpha, Gtr2, alpha_from_roughness, smith};
use super::pair::Pair;
use super::parameter::{Masking, Params};
use crate::color::Rgb;
use crate::math::{Number, Real, V3};

/// Reflection by the base layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Specular<F> {
    f0: Rgb<F>,
    f90: F,
    /// The weight of the dielectric's Fresnel term, spec_trans·(1 - metallic); F0 and F90 hold the rest.
    pub(super) interface: F,
    /// The interface is smooth: the lobe is a mirror's.
    pub(super) is_delta: bool,
    pub(super) distribution: Gtr2<F>,
    /// Of D, and so of the normals that the sampler takes for visible.
    pub(super) alpha: Alpha<F>,
    /// Of G.
    pub(super) masking_alpha: Alpha<F>,
    pub(super) masking: Masking,
    roughness: F,
    // Coefficients of `albedo`: of the part that F0 reflects, and of the part that Schlick's weight adds.
    base: F,
    base_rise: F,
    edge_share: F,
    edge: F,
    edge_spread: F,
}

/// Reflectance head-on and at grazing angles, for Schlick's approximation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schlick<F> {
    /// lerp(0.08·specular·lerp(1, tint, specular_tint), base_color, metallic); may exceed 1.
    pub(super) f0: Rgb<F>,
    /// lerp(f90, 1, metallic).
    pub(super) f90: F,
}

impl<F: Real> Schlick<F> {
    /// Less the share that the interface has of the dielectric part.
    fn weighted(params: &Params<F>, tint: Rgb<F>) -> Self {
        let Params { metallic, f90, base_color, .. } = *params;
        let dielectric = params.diffuse_part();
        Self {
            f0: dielectric_f0(params, tint) * dielectric + base_color * metallic,
            f90: f90 * dielectric + metallic,
        }
    }

    /// 1 - F0, which may be negative, and 1 - F90 of the base without an interface: no cancellation where either nears 1.
    pub(super) fn complement(params: &Params<F>, tint: Rgb<F>) -> Self {
        let Params { metallic, f90, base_color, specular_tint, .. } = *params;
        let grey = F::of(0.08) * params.specular;
        let dielectric = Rgb::grey(F::ONE - grey) + (Rgb::WHITE - tint) * (grey * specular_tint);
        Self {
            f0: dielectric * (F::ONE - metallic) + (Rgb::WHITE - base_color) * metallic,
            f90: (F::ONE - f90) * (F::ONE - metallic),
        }
    }
}

/// 0.08·specular·lerp(1, tint, specular_tint).
fn dielectric_f0<F: Real>(params: &Params<F>, tint: Rgb<F>) -> Rgb<F> {
    Rgb::WHITE.lerp(tint, params.specular_tint) * (F::of(0.08) * params.specular)
}

impl<F: Real> Specular<F> {
    pub(super) fn new(params: &Params<F>, tint: Rgb<F>, masking: Masking) -> Self {
        let interface = params.interface_part();
        let Schlick { f0, f90 } = Schlick::weighted(params, tint);
        let is_delta = interface > F::ZERO && params.roughness == F::ZERO;
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
            f90,
            interface,
            is_delta,
            distribution: Gtr2::new(alpha),
            alpha,
            masking_alpha,
            masking,
            roughness: params.roughness,
            base: mean_f0 * (F::ONE - F::of(0.69) * a),
            base_rise: mean_f0 * F::of(0.3) * a,
            edge_share: (f90 - mean_f0).max(F::of(0.01)),
            edge: F::ONE / (F::ONE + F::of(6.5) * a).sqr(),
            edge_spread: (F::of(4.0) * a).min(F::ONE),
        }
    }
}

impl Schlick<f32> {
    /// Four side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Schlick<Vec4> {
        Schlick { f0: Rgb::beside(four.map(|s| s.f0)), f90: Vec4::from_array(four.map(|s| s.f90)) }
    }
}

impl Specular<f32> {
    /// Four of the same [`Self::masking`], none of them a mirror, side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Specular<Vec4> {
        let each = |field: fn(&Self) -> f32| Vec4::from_array(four.map(field));
        Specular {
            f0: Rgb::beside(four.map(|s| s.f0)),
            f90: each(|s| s.f90),
            interface: each(|s| s.interface),
            is_delta: false,
            distribution: Gtr2::beside(four.map(|s| &s.distribution)),
            alpha: Alpha::beside(four.map(|s| &s.alpha)),
            masking_alpha: Alpha::beside(four.map(|s| &s.masking_alpha)),
            masking: four[0].masking,
            roughness: each(|s| s.roughness),
            base: each(|s| s.base),
            base_rise: each(|s| s.base_rise),
            edge_share: each(|s| s.edge_share),
            edge: each(|s| s.edge),
            edge_spread: each(|s| s.edge_spread),
        }
    }
}

impl<F: Number> Specular<F> {
    /// An estimate of the reflected part of light: exact for a mirror, else a fit to the integral, rough where the lobe is dim. Never 0
    /// in front: light is reflected even where F0 is 0.
    #[inline]
    pub(super) fn albedo(&self, wo: V3<F>, split: &DielectricSplit<F>) -> F {
        if self.is_delta {
            return self.mirrored(wo, split).mean();
        }
        let slant = (F::ONE - wo.z).max(F::ZERO);
        let smooth_edge = slant.pow5();
        let rough_edge = slant.sqr() * slant;
        let edge = self.edge * smooth_edge.lerp(rough_edge, self.edge_spread) + F::of(0.002);
        let albedo = self.base + self.base_rise * smooth_edge + self.edge_share * edge;
        let albedo = albedo + self.interface * split.reflectance;
        match self.masking {
            Masking::Matched => albedo,
            Masking::Remapped => {
                // Both directions are masked more than D's own alpha says; the light's less so the wider the lobe.
                let masked = smith(wo, self.masking_alpha) / smith(wo, self.alpha);
                albedo * masked * masked.lerp(F::ONE, self.roughness.max(F::of(0.05)))
            }
        }
    }

    /// The Fresnel term outside, lerp(Schlick, dielectric, spec_trans)·(1 - metallic) and the metal's part.
    #[inline]
    pub(super) fn fresnel(&self, edge: Edge<F>, split: &DielectricSplit<F>) -> Rgb<F> {
        self.f0 * edge.rest + Rgb::grey(self.f90 * edge.weight + self.interface * split.reflectance)
    }

    /// What a smooth surface reflects of the light from the mirror direction.
    #[inline]
    pub(super) fn mirrored(&self, wo: V3<F>, split: &DielectricSplit<F>) -> Rgb<F> {
        self.fresnel(Edge::at(wo.z), split) * self.unmasked(wo).sqr()
    }

    /// The part of a smooth surface that G lets be seen along `w` above it: all, but `remapped` never has alpha 0.
    #[inline]
    pub(super) fn unmasked(&self, w: V3<F>) -> F {
        match self.masking {
            Masking::Matched => F::ONE,
            Masking::Remapped => F::of(2.0) * w.z * smith(w, self.masking_alpha),
        }
    }

    /// G·D without a Fresnel term, and the density per unit solid angle of the directions that [`Self::sample`] makes: with visible
    /// normals D·smith(wo)/2. G holds the 1/(4 cos θi cos θo).
    #[inline]
    pub(super) fn shape_with_pdf(&self, pair: &Pair<F>) -> (F, F) {
        let d = self.distribution.density(pair);
        let masking_o = smith(pair.wo, self.masking_alpha);
        let masking_i = smith(pair.wi, self.masking_alpha);
        (masking_o * masking_i * d, F::of(0.5) * d * self.visible(pair.wo, masking_o))
    }

    /// `smith` of the distribution's own alpha at `wo`, where that of the masking is known.
    #[inline]
    pub(super) fn visible(&self, wo: V3<F>, masking_o: F) -> F {
        match self.masking {
            Masking::Matched => masking_o,
            Masking::Remapped => smith(wo, self.alpha),
        }
    }
}

impl<F: Real> Specular<F> {
    /// The largest channel and the mean that Schlick's part of the Fresnel term reaches for cosines from `least` to 1; see `bound`.
    pub(super) fn fresnel_bounds(&self, least: F) -> (F, F) {
        let at = |cos_d| self.fresnel(Edge::at(cos_d), &DielectricSplit::OPAQUE);
        let (level, edge) = (at(F::ONE), at(least));
        (level.max_channel().max(edge.max_channel()), level.mean().max(edge.mean()))
    }

    /// The largest channel of F0 over its mean: adding grey makes it less.
    pub(super) fn f0_hue(&self) -> F {
        hue(self.f0)
    }

    /// A visible normal, unit length.
    #[inline]
    pub(super) fn sample_normal(&self, wo: V3<F>, u: [F; 2]) -> V3<F> {
        self.distribution.sample_visible(wo, u).normalize()
    }
}
