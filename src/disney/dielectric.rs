//! Delta lobes: the perfect mirror and the smooth interface between two clear media.

use super::bsdf::{BsdfSample, Lobe};
use super::fresnel::dielectric_split;
use crate::color::Rgb;
use crate::math::{Real, V3};

/// `wo` mirrored about the normal, with all light.
#[inline]
pub(super) fn sample_mirror<F: Real>(wo: V3<F>) -> Option<BsdfSample<F>> {
    let wi = V3::new(-wo.x, -wo.y, wo.z);
    if wo.z > F::ZERO { delta(wi, Rgb::WHITE, F::ONE, Lobe::Mirror, F::ONE) } else { None }
}

/// A smooth dielectric.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dielectric<F> {
    /// The refractive index inside (z < 0) over outside.
    pub(super) ior: F,
}

impl<F: Real> Dielectric<F> {
    /// The index on the far side over that of the side that `wo` is on.
    #[inline]
    pub(super) fn eta(&self, wo: V3<F>) -> F {
        if wo.z > F::ZERO { self.ior } else { F::ONE / self.ior }
    }

    /// Reflection with probability F, else refraction by Snell's law.
    ///
    /// Transmitted *radiance* changes by 1/eta², since light is squeezed into (or out of) a cone: L/η² is what stays (Veach 1997,
    /// section 5.2).
    #[inline]
    pub(super) fn sample(&self, wo: V3<F>, u_lobe: F) -> Option<BsdfSample<F>> {
        let eta = self.eta(wo);
        let split = dielectric_split(wo.z.abs(), eta);
        if u_lobe < split.reflectance {
            let wi = V3::new(-wo.x, -wo.y, wo.z);
            delta(wi, Rgb::grey(split.reflectance), split.reflectance, Lobe::DielectricReflection, F::ONE)
        } else {
            let factor = Rgb::grey(split.transmittance / eta.sqr());
            let wi = refracted(wo, split.cos_t, eta);
            delta(wi, factor, split.transmittance, Lobe::DielectricTransmission, eta)
        }
    }
}

/// `wo` refracted by the plane z = 0 at an angle of the cosine `cos_t`, into a medium of `eta` times the refractive index.
#[inline]
pub(super) fn refracted<F: Real>(wo: V3<F>, cos_t: F, eta: F) -> V3<F> {
    let wi = V3::new(-wo.x / eta, -wo.y / eta, (-cos_t).copysign(-wo.z));
    // A thinner medium magnifies what `wo` lacks in length.
    if eta < F::ONE { wi.normalize() } else { wi }
}

/// The sample of a delta lobe that passes on `factor` with probability `pdf`: f is `factor`/|cos θi|. `None` where cos θi is so small that
/// f is not finite, or where the lobe has probability 0.
#[inline]
pub(super) fn delta<F: Real>(wi: V3<F>, factor: Rgb<F>, pdf: F, lobe: Lobe, eta: F) -> Option<BsdfSample<F>> {
    let f = factor / wi.z.abs();
    (pdf > F::ZERO && f.is_finite()).then_some(BsdfSample { f, wi, pdf, lobe, eta })
}
