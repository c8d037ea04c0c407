//! All of Burley 2012: the lobes together, and how often each is sampled.

use super::bsdf::{BsdfSample, Lobe, reflection};
use super::clearcoat::Clearcoat;
use super::diffuse::Diffuse;
use super::pair::Pair;
use super::parameter::{DiffuseModel, Masking, Params};
use super::sheen::Sheen;
use super::specular::{Specular, specular_f0};
use crate::color::Rgb;
use crate::math::warp::{cosine_hemisphere, uniform_hemisphere, uniform_hemisphere_pdf};
use crate::math::{Real, V3};

/// A Disney material at one point: its lobes with all that doesn't depend on directions precomputed; absent lobes are `None`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture<F> {
    pub(super) base_color: Rgb<F>,
    diffuse: Option<Diffuse<F>>,
    sheen: Option<Sheen<F>>,
    specular: Specular<F>,
    clearcoat: Option<Clearcoat<F>>,
}

/// How often each sampler is chosen; they sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Probabilities<F> {
    /// Diffuse and sheen, by the cosine.
    pub(super) cosine: F,
    /// Diffuse, uniform over the hemisphere.
    pub(super) uniform: F,
    /// Specular.
    pub(super) specular: F,
    /// Clearcoat.
    pub(super) clearcoat: F,
}

impl<F: Real> Mixture<F> {
    pub(super) fn new(params: &Params<F>, masking: Masking, diffuse: DiffuseModel) -> Self {
        let tint = tint(params.base_color);
        let f0 = specular_f0(params, tint);
        Self {
            base_color: params.base_color,
            diffuse: Diffuse::new(params, f0, diffuse),
            sheen: Sheen::new(params, tint),
            specular: Specular::new(params, f0, masking),
            clearcoat: Clearcoat::new(params),
        }
    }

    /// Proportional to an estimate of what each lobe reflects towards `wo`: the mean over channels of its albedo. The only source of
    /// lobe probabilities. A lobe that is there never has probability 0.
    #[inline]
    pub(super) fn probabilities(&self, wo: V3<F>) -> Probabilities<F> {
        let (mut cosine, uniform) = self.diffuse.as_ref().map_or((F::ZERO, F::ZERO), |d| d.albedos(wo));
        if let Some(sheen) = &self.sheen {
            cosine += sheen.albedo(wo);
        }
        let specular = self.specular.albedo(wo);
        let clearcoat = self.clearcoat.as_ref().map_or(F::ZERO, |coat| coat.albedo(wo));
        let scale = F::ONE / (cosine + uniform + specular + clearcoat);
        Probabilities {
            cosine: cosine * scale,
            uniform: uniform * scale,
            specular: specular * scale,
            clearcoat: clearcoat * scale,
        }
    }

    /// The BRDF, and the density of [`Self::sample`] per unit solid angle.
    #[inline]
    pub(super) fn eval_with_pdf(&self, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        self.eval_with_pdf_given(&self.probabilities(wo), wo, wi)
    }

    #[inline]
    fn eval_with_pdf_given(&self, chance: &Probabilities<F>, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        let Some(pair) = Pair::new(wo, wi) else { return (Rgb::BLACK, F::ZERO) };
        let (mut f, pdf_specular) = self.specular.eval_with_pdf(&pair);
        let mut pdf = chance.specular * pdf_specular;
        if let Some(diffuse) = &self.diffuse {
            f += diffuse.eval(&pair);
            pdf += chance.uniform * uniform_hemisphere_pdf::<F>();
        }
        if let Some(sheen) = &self.sheen {
            f += sheen.eval(&pair);
        }
        pdf += chance.cosine * wi.z * F::FRAC_1_PI;
        if let Some(coat) = &self.clearcoat {
            let (f_coat, pdf_coat) = coat.eval_with_pdf(&pair);
            f += Rgb::grey(f_coat);
            pdf += chance.clearcoat * pdf_coat;
        }
        (f, pdf)
    }

    /// The lobes that are there.
    pub(super) fn lobes(&self) -> Vec<Lobe> {
        let there = [
            (Lobe::Diffuse, self.diffuse.is_some()),
            (Lobe::Sheen, self.sheen.is_some()),
            (Lobe::Specular, true),
            (Lobe::Clearcoat, self.clearcoat.is_some()),
        ];
        there.into_iter().filter_map(|(lobe, there)| there.then_some(lobe)).collect()
    }

    /// One lobe's part of the BRDF.
    pub(super) fn eval_lobe(&self, lobe: Lobe, wo: V3<F>, wi: V3<F>) -> Rgb<F> {
        let Some(pair) = Pair::new(wo, wi) else { return Rgb::BLACK };
        let part = match lobe {
            Lobe::Diffuse => self.diffuse.as_ref().map(|diffuse| diffuse.eval(&pair)),
            Lobe::Sheen => self.sheen.as_ref().map(|sheen| sheen.eval(&pair)),
            Lobe::Specular => Some(self.specular.eval_with_pdf(&pair).0),
            Lobe::Clearcoat => self.clearcoat.as_ref().map(|coat| Rgb::grey(coat.eval_with_pdf(&pair).0)),
            Lobe::Mirror | Lobe::DielectricReflection | Lobe::DielectricTransmission => None,
        };
        part.unwrap_or(Rgb::BLACK)
    }

    /// A direction by one of the samplers, chosen by `u_lobe`. `None` if it comes out below the horizon.
    #[inline]
    pub(super) fn sample(&self, wo: V3<F>, u_lobe: F, u: [F; 2]) -> Option<BsdfSample<F>> {
        let chance = self.probabilities(wo);
        let (wi, lobe) = self.sample_direction(&chance, wo, u_lobe, u);
        let (f, pdf) = self.eval_with_pdf_given(&chance, wo, wi);
        reflection(f, wi, pdf, lobe)
    }

    #[inline]
    fn sample_direction(&self, chance: &Probabilities<F>, wo: V3<F>, u_lobe: F, u: [F; 2]) -> (V3<F>, Lobe) {
        let mut rest = u_lobe - chance.cosine;
        if rest < F::ZERO {
            return (cosine_hemisphere(u), Lobe::Diffuse);
        }
        rest -= chance.uniform;
        if rest < F::ZERO {
            return (uniform_hemisphere(u), Lobe::Diffuse);
        }
        rest -= chance.clearcoat;
        match &self.clearcoat {
            Some(coat) if rest < F::ZERO => (coat.sample(wo, u), Lobe::Clearcoat),
            _ => (self.specular.sample(wo, u), Lobe::Specular),
        }
    }
}

/// The base colour's hue: the colour over its approximate luminance 0.3 R + 0.6 G + 0.1 B, white for black (disney.brdf).
fn tint<F: Real>(color: Rgb<F>) -> Rgb<F> {
    let luminance = F::of(0.3) * color.r + F::of(0.6) * color.g + F::of(0.1) * color.b;
    if luminance > F::ZERO { color / luminance } else { Rgb::WHITE }
}
