//! How large the weight of a sample can get.
//!
//! The weight f·|cos θi|/pdf of a mixture is at most that of the worst of its lobes: a fraction of two sums lies below the largest
//! fraction of the terms. With lobe l chosen by A_l(wo)/ΣA(wo), A being [`Mixture::estimates`],
//!
//! W(wo) ≤ ΣA(wo) · max over l of w_l(wo)/A_l(wo),
//!
//! where w_l is the largest f_l·|cos θi|/p_l over all θi. Lobes that share a sampler are added up. With m(x) the largest channel, hue(x) =
//! max/mean ≤ 3, G1 ≤ 1 Smith's masking, μ = cos θo, and s(μ) the largest Schlick weight that any light gives at μ (light at the
//! horizon, opposite: cos θd = μ/√(2(1 + sin θo))):
//!
//! | lobe | p | w(μ) |
//! |---|---|---|
//! | diffuse, plain shape | cos θi/π | m(ρ)·k(1)·k((1-μ)⁵), k(x) = 1 + max(0, 2·roughness - ½)·x for Burley's retro-reflection (at most 6.25 in all), else 1; ρ times max(1 - F0, 1 - F90) for glTF's model |
//! | diffuse, subsurface | cosine and uniform | 1.25·m(ρ)/(√(A_c·μ) + √(A_u/2))², as a quotient by A: f has 1/(cos θi + μ), which grows as 1/cos |
//! | sheen | cos θi/π | π·m(sheen)·s |
//! | specular | visible normals | m(F)·G1'(μ)/G1(μ), the last quotient 1 for matched masking |
//! | rough interface, reflected | visible normals, share R/(R + T) | hue(F0)·(mean F + spec_trans(1 - metallic))·G1'/G1 |
//! | rough interface, refracted | visible normals, share T/(R + T) | hue(tint)·(the same sum with s = 1)·G1'/G1/η² |
//! | rough sheet | visible normals | m(tint) |
//! | clearcoat | GTR1's normals | 0.32·¼·clearcoat·σ(μ)/(√μ + ½)², σ = 1/(μ + √(a² + (1 - a²)μ²)), a = ¼: at most 1.28·clearcoat |
//! | diffuse transmission | cos θi/π | m(colour·weight) |
//! | delta reflection, transmission | 1 | hue·A, hue·A/η² |
//!
//! The subsurface shape: with x = cos θi, f·x/pdf ≤ 1.25ρ·x/(x + μ)/(A_c·x + A_u/2), and (x + μ)(A_c·x + A_u/2)/x is least at
//! x² = μ·A_u/(2A_c). The coat likewise: f·x/p = strength·F·4cos²θd·2σ(μ)·[σ(x)·x/(x + μ)], σ(x) ≤ 1/(x + a), and F·cos²θd ≤ 0.04, its value
//! at θd = 0.

use super::bsdf::Lobe;
use super::fresnel::{fresnel_dielectric, schlick_weight};
use super::microfacet::smith;
use super::mixture::Mixture;
use super::parameter::DiffuseModel;
use super::probabilities::Probabilities;
use super::transmission::{Passage, Transmission};
use crate::color::Rgb;
use crate::math::{Real, V3};

/// Of a sample's weight by its lobe, for a mixture seen from `wo`.
impl<F: Real> Mixture<F> {
    /// The largest channel that a sample's f·|cos θi|/pdf may have, rounding aside, if `lobe` was sampled; infinite where the sampler
    /// of a lobe that is there is never chosen.
    pub(super) fn weight_bound(&self, wo: V3<F>, lobe: Lobe) -> F {
        let estimate = self.estimates(wo);
        let quotient = match lobe {
            Lobe::Diffuse | Lobe::Sheen | Lobe::Specular | Lobe::Clearcoat if wo.z > F::ZERO => self
                .diffuse_quotient(&estimate, wo.z)
                .max(self.coat_quotient(&estimate, wo.z))
                .max(quotient(self.reflected_by_facets(wo), estimate.specular)),
            Lobe::Diffuse | Lobe::Sheen | Lobe::Specular | Lobe::Clearcoat => {
                quotient(self.reflected_inside_bound(wo), estimate.specular)
            }
            Lobe::Transmission | Lobe::DiffuseTransmission => {
                self.refracted_quotient(&estimate, wo).max(self.diffuse_transmission.map_or(F::ZERO, |d| {
                    quotient(d.value.max_channel() * F::PI, estimate.diffuse_transmission)
                }))
            }
            Lobe::DielectricReflection => self.specular.f0_hue(),
            Lobe::DielectricTransmission | Lobe::StraightTransmission => self
                .transmission
                .map_or(F::ZERO, |through| hue(through.tint) / self.squared_eta(&through, wo)),
            Lobe::Mirror => F::ONE,
        };
        estimate.sum() * quotient
    }

    /// Diffuse and sheen, w/A.
    fn diffuse_quotient(&self, estimate: &Probabilities<F>, mu: F) -> F {
        let mut bound = F::ZERO;
        if let Some(diffuse) = &self.diffuse {
            let rise = match diffuse.model {
                DiffuseModel::Burley => (F::of(2.0) * diffuse.roughness - F::of(0.5)).max(F::ZERO),
                DiffuseModel::Lambert | DiffuseModel::LambertFresnel => F::ZERO,
            };
            let retro = (F::ONE + rise) * (F::ONE + rise * schlick_weight(mu));
            let reflectance = diffuse.largest_color().max_channel() * F::PI;
            let plain = reflectance * (F::ONE - diffuse.subsurface) * retro;
            bound += quotient(plain, estimate.cosine);
            let flat = F::of(1.25) * reflectance * diffuse.subsurface;
            let root = (estimate.cosine * mu).sqrt() + (F::of(0.5) * estimate.uniform).sqrt();
            bound += quotient(flat, root.sqr());
        }
        if let Some(sheen) = &self.sheen {
            bound += quotient(F::PI * sheen.color.max_channel() * largest_schlick(mu), estimate.cosine);
        }
        bound
    }

    /// The coat, w/A.
    fn coat_quotient(&self, estimate: &Probabilities<F>, mu: F) -> F {
        self.clearcoat.as_ref().map_or(F::ZERO, |coat| quotient(coat.weight_bound(mu), estimate.clearcoat))
    }

    /// Specular from outside, with a rough interface or without.
    fn reflected_by_facets(&self, wo: V3<F>) -> F {
        let specular = &self.specular;
        if specular.is_delta {
            return F::ZERO;
        }
        let (at_once, mean) = specular.fresnel_bounds(least_half_cosine(wo.z));
        let reflected = match &self.transmission {
            Some(through) if matches!(through.passage, Passage::Rough) => {
                specular.f0_hue() * (mean + specular.interface)
            }
            Some(through) => at_once + specular.interface * largest_reflectance(wo.z, through.ior),
            None => at_once,
        };
        reflected * self.masked(wo)
    }

    /// Specular from inside.
    fn reflected_inside_bound(&self, wo: V3<F>) -> F {
        let Some(through) = self.transmission.as_ref().filter(|_| !self.specular.is_delta) else {
            return F::ZERO;
        };
        let reflected = match through.passage {
            Passage::Rough => F::ONE,
            _ => largest_reflectance(-wo.z, through.eta(wo)),
        };
        self.specular.interface * reflected * self.masked(wo.mirrored_z())
    }

    /// What facets refract or a sheet lets pass, w/A.
    fn refracted_quotient(&self, estimate: &Probabilities<F>, wo: V3<F>) -> F {
        let Some(through) = &self.transmission else { return F::ZERO };
        match through.passage {
            Passage::Rough => {
                let outside = wo.z > F::ZERO;
                let upright = if outside { wo } else { wo.mirrored_z() };
                // Facets may be seen at any angle, as what they reflect goes below the horizon.
                let (_, mean) = self.specular.fresnel_bounds(F::ZERO);
                let split = if outside { mean } else { F::ZERO } + self.specular.interface;
                let all = hue(through.tint) * split * self.masked(upright);
                quotient(all / self.squared_eta(through, wo), estimate.specular)
            }
            Passage::ThinRough(..) => quotient(through.tint.max_channel(), estimate.transmission),
            Passage::Smooth | Passage::ThinSmooth => F::ZERO,
        }
    }

    /// G's masking over that of D's own alpha.
    fn masked(&self, wo: V3<F>) -> F {
        smith(wo, self.specular.masking_alpha) / smith(wo, self.specular.alpha)
    }

    fn squared_eta(&self, through: &Transmission<F>, wo: V3<F>) -> F {
        if self.thin_walled { F::ONE } else { through.eta(wo).sqr() }
    }
}

/// w/A, 0 where there is no such lobe.
fn quotient<F: Real>(weight: F, estimate: F) -> F {
    if weight > F::ZERO { weight / estimate } else { F::ZERO }
}

/// The largest channel over the mean, 1 for black.
pub(super) fn hue<F: Real>(color: Rgb<F>) -> F {
    if color.is_black() { F::ONE } else { color.max_channel() / color.mean() }
}

/// The least cos θd of light above the horizon for a view of cosine `mu`.
fn least_half_cosine<F: Real>(mu: F) -> F {
    mu / (F::of(2.0) * (F::ONE + (F::ONE - mu.sqr()).safe_sqrt())).sqrt()
}

fn largest_schlick<F: Real>(mu: F) -> F {
    schlick_weight(least_half_cosine(mu))
}

/// Reflectance rises towards the horizon, or dips and rises.
fn largest_reflectance<F: Real>(mu: F, eta: F) -> F {
    fresnel_dielectric(F::ONE, eta).max(fresnel_dielectric(least_half_cosine(mu), eta))
}
