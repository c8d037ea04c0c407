//! The diffuse lobe: Burley's, Lambert's or glTF's, with the subsurface blend.

use super::fresnel::schlick_weight;
use super::pair::Pair;
use super::parameter::{DiffuseModel, Params};
use super::specular::Schlick;
use crate::color::Rgb;
use crate::math::{Real, V3};

/// The base colour's diffuse reflection: what metal, interface and diffuse transmission leave of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffuse<F> {
    /// base_color·(1 - metallic)(1 - spec_trans)(1 - diff_trans/2)/π.
    color: Rgb<F>,
    /// F0 and F90 of the base's highlight, for [`DiffuseModel::LambertFresnel`].
    f0: Rgb<F>,
    f90: F,
    roughness: F,
    subsurface: F,
    model: DiffuseModel,
    // Coefficients of `albedos`, for the plain shape and for the subsurface's.
    plain: F,
    plain_rise: F,
    flat: F,
    flat_rise: F,
}

impl<F: Real> Diffuse<F> {
    /// `None` where the lobe reflects nothing. `highlight` is the base's.
    pub(super) fn new(params: &Params<F>, highlight: Schlick<F>, model: DiffuseModel) -> Option<Self> {
        let Schlick { f0, f90 } = highlight;
        let kept = params.diffuse_part() * (F::ONE - F::of(0.5) * params.diff_trans);
        let reflectance = params.base_color * kept;
        let diffuse_part = match model {
            DiffuseModel::Burley | DiffuseModel::Lambert => reflectance,
            DiffuseModel::LambertFresnel => reflectance * f0.map(|f0| (F::ONE - f0).max(F::ZERO)),
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
            f0,
            f90,
            roughness: params.roughness,
            subsurface: params.subsurface,
            model,
            plain,
            plain_rise: plain * retro,
            flat,
            flat_rise: flat * (F::of(0.9) * params.roughness - F::of(0.7)),
        })
    }

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
        if self.model == DiffuseModel::Burley || self.subsurface > F::ZERO {
            let fresnel = [schlick_weight(pair.wi.z), schlick_weight(pair.wo.z)];
            let retro = pair.cos2_d * self.roughness;
            if self.model == DiffuseModel::Burley {
                shape = both_ways(F::of(0.5) + F::of(2.0) * retro, fresnel);
            }
            if self.subsurface > F::ZERO {
                let flat = both_ways(retro, fresnel) * (F::ONE / (pair.wi.z + pair.wo.z) - F::of(0.5));
                shape = shape.lerp(F::of(1.25) * (flat + F::of(0.5)), self.subsurface);
            }
        }
        let color = self.color * shape;
        match self.model {
            DiffuseModel::Burley | DiffuseModel::Lambert => color,
            DiffuseModel::LambertFresnel => {
                // 1 - lerp(F0, F90, weight).
                let at_edge = (F::ONE - self.f90) * pair.schlick;
                let left = self.f0.map(|f0| (F::ONE - f0) * (F::ONE - pair.schlick) + at_edge);
                color * left.map(|f| f.max(F::ZERO))
            }
        }
    }
}

/// lerp(1, f90, FL)·lerp(1, f90, FV).
#[inline]
fn both_ways<F: Real>(f90: F, [fl, fv]: [F; 2]) -> F {
    let rise = f90 - F::ONE;
    (F::ONE + rise * fl) * (F::ONE + rise * fv)
}
