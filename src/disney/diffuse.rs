//! The diffuse lobe: Burley's, Lambert's or glTF's, with the subsurface blend.

use glam::Vec4;

use super::fresnel::{Edge, schlick_weight};
use super::pair::Pair;
use super::parameter::{DiffuseModel, Params};
use super::specular::Schlick;
use crate::color::Rgb;
use crate::math::{Number, Real, V3};

/// The base colour's diffuse reflection: what metal, interface and diffuse transmission leave of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffuse<F> {
    /// base_color·(1 - metallic)(1 - spec_trans)(1 - diff_trans/2)/π.
    color: Rgb<F>,
    /// 1 - F0 and 1 - F90 of the base's highlight, for [`DiffuseModel::LambertFresnel`].
    left: Schlick<F>,
    pub(super) roughness: F,
    pub(super) subsurface: F,
    pub(super) has_subsurface: bool,
    pub(super) model: DiffuseModel,
    // Coefficients of `albedos`, for the plain shape and for the subsurface's.
    plain: F,
    plain_rise: F,
    flat: F,
    flat_rise: F,
}

impl<F: Real> Diffuse<F> {
    /// `None` where the lobe reflects nothing. `left` is what the base's highlight leaves, 1 - F0 and 1 - F90.
    pub(super) fn new(params: &Params<F>, left: Schlick<F>, model: DiffuseModel) -> Option<Self> {
        let kept = params.diffuse_part() * (F::ONE - F::of(0.5) * params.diff_trans);
        let reflectance = params.base_color * kept;
        let diffuse_part = match model {
            DiffuseModel::Burley | DiffuseModel::Lambert => reflectance,
            DiffuseModel::LambertFresnel => {
                // Schlick's weight has a mean of about 1/20; with F0 ≥ 1 > F90 all that is left is at grazing angles.
                let at_edge = left.f90 * F::of(0.05);
                reflectance * left.f0.map(|left| left.max(F::ZERO) + at_edge)
            }
        };
        let mean = diffuse_part.mean();
        if mean == F::ZERO {
            return None;
        }
        let retro = match model {
            DiffuseModel::Burley => F::of(1.05) * params.roughness - F::of(0.5),
            DiffuseModel::Lambert | DiffuseModel::LambertFresnel => F::ZERO,
        };
        let plain = mean * (F::ONE - params.subsurface);
        let flat = mean * params.subsurface;
        Some(Self {
            color: reflectance * F::FRAC_1_PI,
            left,
            roughness: params.roughness,
            subsurface: params.subsurface,
            has_subsurface: params.subsurface > F::ZERO,
            model,
            plain,
            plain_rise: plain * retro,
            flat,
            flat_rise: flat * (F::of(0.9) * params.roughness - F::of(0.7)),
        })
    }
}

impl Diffuse<f32> {
    /// The lobe of the same shape that reflects nothing.
    pub(super) fn none(&self) -> Self {
        Self { color: Rgb::BLACK, plain: 0.0, plain_rise: 0.0, flat: 0.0, flat_rise: 0.0, ..*self }
    }

    /// Four of one model side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Diffuse<Vec4> {
        let each = |field: fn(&Self) -> f32| Vec4::from_array(four.map(field));
        Diffuse {
            color: Rgb::beside(four.map(|d| d.color)),
            left: Schlick::beside(four.map(|d| &d.left)),
            roughness: each(|d| d.roughness),
            subsurface: each(|d| d.subsurface),
            has_subsurface: four.iter().any(|d| d.has_subsurface),
            model: four[0].model,
            plain: each(|d| d.plain),
            plain_rise: each(|d| d.plain_rise),
            flat: each(|d| d.flat),
            flat_rise: each(|d| d.flat_rise),
        }
    }
}

impl<F: Number> Diffuse<F> {
    /// An estimate of the reflected part of light, a fit to the integral: for the cosine sampler and for the uniform one.
    ///
    /// The subsurface shape holds 1/(cos θi + cos θo), which cosine sampling would turn into unbounded weights at grazing angles; a
    /// uniform direction has f·cos/pdf ∝ cos θi/(cos θi + cos θo) ≤ 1. So the flatter the view, the more of that shape's part is sampled
    /// uniformly.
    #[inline]
    pub(super) fn albedos(&self, wo: V3<F>) -> (F, F) {
        let slant = (F::ONE - wo.z).max(F::ZERO);
        let schlick_o = schlick_weight(wo.z);
        let plain = self.plain + self.plain_rise * schlick_o;
        let flat = self.flat * (F::of(0.75) + F::of(0.6) * slant) + self.flat_rise * schlick_o;
        let uniform = F::of(0.75) * slant * flat;
        (plain + flat - uniform, uniform)
    }

    /// What the shape is multiplied with, where the highlight leaves most.
    pub(super) fn largest_color(&self) -> Rgb<F> {
        match self.model {
            DiffuseModel::Burley | DiffuseModel::Lambert => self.color,
            DiffuseModel::LambertFresnel => self.color * self.left.f0.map(|left| left.max(self.left.f90)),
        }
    }

    /// The BRDF.
    ///
    /// Burley 2012, section 5.3, and the subsurface shape of section 5.3's end, inspired by Hanrahan and Krueger. The blend towards it
    /// holds for all three models: where a Lambert material has a subsurface it is the user's wish.
    ///
    /// glTF's model multiplies base_color/π by 1 - F per channel, with the specular lobe's F at this half vector (glTF 2.0, appendix
    /// B.3.5); where F0 > 1 no diffuse light is left.
    #[inline]
    pub(super) fn eval(&self, pair: &Pair<F>) -> Rgb<F> {
        let mut shape = F::ONE;
        if self.model == DiffuseModel::Burley || self.has_subsurface {
            let fresnel = [Edge::at(pair.wi.z), Edge::at(pair.wo.z)];
            let retro = pair.cos2_d * self.roughness;
            if self.model == DiffuseModel::Burley {
                shape = both_ways(F::of(0.5) + F::of(2.0) * retro, fresnel);
            }
            if self.has_subsurface {
                let flat = both_ways(retro, fresnel) * (F::ONE / (pair.wi.z + pair.wo.z) - F::of(0.5));
                shape = shape.lerp(F::of(1.25) * (flat + F::of(0.5)), self.subsurface);
            }
        }
        let color = self.color * shape;
        match self.model {
            DiffuseModel::Burley | DiffuseModel::Lambert => color,
            DiffuseModel::LambertFresnel => {
                // 1 - lerp(F0, F90, weight).
                let left = self.left.f0 * pair.edge.rest + Rgb::grey(self.left.f90 * pair.edge.weight);
                color * left.map(|f| f.max(F::ZERO))
            }
        }
    }
}

/// lerp(1, f90, FL)·lerp(1, f90, FV).
#[inline]
fn both_ways<F: Number>(f90: F, [l, v]: [Edge<F>; 2]) -> F {
    (l.rest + f90 * l.weight) * (v.rest + f90 * v.weight)
}
