//! Fresnel reflectance: Schlick's approximation and the exact one of a dielectric.

use crate::math::{Number, Real};

/// Schlick's weight (1 - cos θ)⁵: reflectance is lerp(F0, 1, weight). Schlick 1994, eq. 15.
#[inline]
pub fn schlick_weight<F: Number>(cos_theta: F) -> F {
    (F::ONE - cos_theta).clamp(F::ZERO, F::ONE).pow5()
}

/// Schlick's weight and what is left of 1, each to full precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<F> {
    /// (1 - cos θ)⁵.
    pub(super) weight: F,
    /// 1 - (1 - cos θ)⁵.
    pub(super) rest: F,
}

impl<F: Number> Edge<F> {
    /// At an angle of this cosine.
    #[inline]
    pub(super) fn at(cos_theta: F) -> Self {
        Self::given_both(cos_theta, (F::ONE - cos_theta).clamp(F::ZERO, F::ONE))
    }

    /// The same where `q` = 1 - cos θ in [0, 1] is known more precisely.
    #[inline]
    pub(super) fn given_both(cos_theta: F, q: F) -> Self {
        // 1 - q⁵ = (1 - q)(1 + q + q² + q³ + q⁴).
        let rest = cos_theta * (F::ONE + q * (F::ONE + q * (F::ONE + q * (F::ONE + q))));
        Self { weight: q.pow5(), rest }
    }
}

/// How a smooth dielectric splits light that meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DielectricSplit<F> {
    /// The reflected part in [0, 1], for unpolarised light.
    pub(super) reflectance: F,
    /// 1 - reflectance, without cancellation where nearly all light is reflected.
    pub(super) transmittance: F,
    /// The cosine of the refracted angle, 0 where all light is reflected.
    pub(super) cos_t: F,
}

impl<F: Number> DielectricSplit<F> {
    /// Where there is no interface: nothing reflected by it and nothing passed on.
    pub(super) const OPAQUE: Self = Self { reflectance: F::ZERO, transmittance: F::ZERO, cos_t: F::ZERO };
}

/// The split at an interface whose far side has `eta` > 0 times the near side's refractive index, by Fresnel's equations.
#[inline]
pub(super) fn dielectric_split<F: Real>(cos_i: F, eta: F) -> DielectricSplit<F> {
    // eta² cos² θt = eta² - sin² θi, whichever of two forms cancels only where all light comes to be reflected: not near eta = 1 and at
    // grazing angles, nor near eta = 0 head-on.
    let scaled_cos2_t = if cos_i.sqr() > F::of(0.5) {
        eta.sqr() - (F::ONE - cos_i) * (F::ONE + cos_i)
    } else {
        (eta - F::ONE) * (eta + F::ONE) + cos_i.sqr()
    };
    if scaled_cos2_t <= F::ZERO {
        return DielectricSplit { reflectance: F::ONE, transmittance: F::ZERO, cos_t: F::ZERO };
    }
    split_given_both_cosines(cos_i, scaled_cos2_t.sqrt() / eta, eta)
}

/// The same where the refracted angle's cosine is known as well.
#[inline]
pub(super) fn split_given_both_cosines<F: Real>(cos_i: F, cos_t: F, eta: F) -> DielectricSplit<F> {
    let (parallel, perpendicular) = (eta * cos_i + cos_t, cos_i + eta * cos_t);
    // With s = eta·cos θt, s² = eta² - 1 + cos² θi, the numerators cos θi - s and eta²·cos θi - s have the factor eta² - 1: no
    // cancellation near eta = 1.
    let eta2_minus_1 = (eta - F::ONE) * (eta + F::ONE);
    let r_perpendicular = eta2_minus_1 / perpendicular.sqr();
    let r_parallel = eta2_minus_1 * (cos_i * perpendicular - F::ONE) / (perpendicular * eta * parallel);
    let reflectance = F::of(0.5) * (r_parallel.sqr() + r_perpendicular.sqr());
    // 1 - ((a - b)/(a + b))² = 4ab/(a + b)².
    let product = F::of(2.0) * eta * cos_i * cos_t;
    let transmittance = product / parallel.sqr() + product / perpendicular.sqr();
    DielectricSplit { reflectance: reflectance.min(F::ONE), transmittance: transmittance.min(F::ONE), cos_t }
}

/// The reflectance of a smooth dielectric for unpolarised light, 1 under total internal reflection.
///
/// `cos_i` in (0, 1] is the cosine of the incident angle; `eta` > 0 the far side's refractive index over the near side's.
#[inline]
pub fn fresnel_dielectric<F: Real>(cos_i: F, eta: F) -> F {
    dielectric_split(cos_i, eta).reflectance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_four_percent_head_on_and_everything_at_grazing() {
        assert!((fresnel_dielectric(1.0f64, 1.5) - 0.04).abs() < 1e-15);
        assert!(fresnel_dielectric(1e-9f64, 1.5) > 0.999_999);
    }

    #[test]
    fn light_from_inside_is_totally_reflected_beyond_the_critical_angle() {
        // sin θc = 1/1.5, cos θc = 0.745356.
        assert_eq!(fresnel_dielectric(0.745f64, 1.0 / 1.5), 1.0);
        assert!(fresnel_dielectric(0.746f64, 1.0 / 1.5) < 1.0);
    }

    #[test]
    fn p_polarised_light_is_not_reflected_at_brewsters_angle() {
        let eta = 1.5f64;
        let cos_i = 1.0 / (1.0 + eta * eta).sqrt();
        // Only the s-polarised half remains: ½((1 - η²)/(1 + η²))².
        let expected = 0.5 * ((1.0 - eta * eta) / (1.0 + eta * eta)).sqr();
        assert!((fresnel_dielectric(cos_i, eta) - expected).abs() < 1e-15);
    }

    #[test]
    fn the_two_parts_sum_to_one_and_each_is_accurate() {
        for cos_i in [1.0f32, 0.3, 1e-3, 1e-6] {
            for eta in [0.2f32, 1.0 / 1.5, 1.0003, 1.5, 8.0] {
                let single = dielectric_split(cos_i, eta);
                let double = dielectric_split(f64::from(cos_i), f64::from(eta));
                assert!((single.reflectance + single.transmittance - 1.0).abs() < 1e-6);
                let error = (f64::from(single.transmittance) - double.transmittance).abs();
                assert!(error <= 3e-6 * double.transmittance, "{cos_i} {eta}: {single:?} {double:?}");
            }
        }
    }

    #[test]
    fn equal_media_reflect_nothing() {
        for cos_i in [1.0f32, 0.5, 1e-3] {
            assert!(fresnel_dielectric(cos_i, 1.0) < 1e-6);
        }
    }
}
