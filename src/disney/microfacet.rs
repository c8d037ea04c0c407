//! Microfacet terms: the distributions GTR1 and GTR2, Smith masking, and sampling of their normals.
//!
//! Distributions take the half vector as it comes from `wo + wi`, not normalised, and are written in its components: the textbook's
//! 1 + (a² - 1) cos² θh cancels in `f32`, by 8% at a = 0.001.

use glam::Vec4;

use super::pair::Pair;
use crate::math::{Number, Real, V3};

/// The smallest alpha of the specular lobe, per axis.
pub const ALPHA_MIN: f64 = 0.001;

/// The roughness of an anisotropic GGX distribution along the tangent and the bitangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alpha<F> {
    /// Along the tangent.
    pub x: F,
    /// Along the bitangent.
    pub y: F,
}

/// (ax, ay) of a roughness and an anisotropy, both in [0, 1]: alpha is roughness², the aspect sqrt(1 - 0.9·anisotropic), and the floor
/// of [`ALPHA_MIN`] holds per axis after the aspect. Burley 2012, section 5.4.
pub fn alpha_from_roughness<F: Real>(roughness: F, anisotropic: F) -> Alpha<F> {
    let aspect = (F::ONE - F::of(0.9) * anisotropic).sqrt();
    let min = F::of(ALPHA_MIN);
    Alpha { x: min.max(roughness.sqr() / aspect), y: min.max(roughness.sqr() * aspect) }
}

/// GTR2, that is GGX, anisotropic (Burley 2012, eq. 13), with what doesn't depend on directions precomputed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gtr2<F> {
    alpha: Alpha<F>,
    inv_ax2: F,
    inv_ay2: F,
    /// 1/(π ax ay), the value at the normal.
    peak: F,
}

impl<F: Real> Gtr2<F> {
    pub(super) fn new(alpha: Alpha<F>) -> Self {
        Self {
            alpha,
            inv_ax2: F::ONE / alpha.x.sqr(),
            inv_ay2: F::ONE / alpha.y.sqr(),
            peak: F::FRAC_1_PI / (alpha.x * alpha.y),
        }
    }
}

impl Alpha<f32> {
    /// Four side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Alpha<Vec4> {
        Alpha { x: Vec4::from_array(four.map(|a| a.x)), y: Vec4::from_array(four.map(|a| a.y)) }
    }
}

impl Gtr2<f32> {
    /// Four side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Gtr2<Vec4> {
        let each = |field: fn(&Self) -> f32| Vec4::from_array(four.map(field));
        Gtr2 {
            alpha: Alpha::beside(four.map(|d| &d.alpha)),
            inv_ax2: each(|d| d.inv_ax2),
            inv_ay2: each(|d| d.inv_ay2),
            peak: each(|d| d.peak),
        }
    }
}

impl<F: Number> Gtr2<F> {
    /// Normals per unit solid angle around the half vector: 1/(π ax ay (hx²/ax² + hy²/ay² + hz²)²).
    #[inline]
    pub(super) fn density(&self, pair: &Pair<F>) -> F {
        self.density_at(pair.sum, pair.sum2)
    }

    /// The same around a vector `h` of any length, `h2` being its square.
    #[inline]
    pub(super) fn density_at(&self, h: V3<F>, h2: F) -> F {
        let stretched = h.x.sqr() * self.inv_ax2 + h.y.sqr() * self.inv_ay2 + h.z.sqr();
        self.peak * (h2 / stretched).sqr()
    }
}

impl<F: Real> Gtr2<F> {
    /// A normal visible from `wo` (wo.z > 0), not normalised, by spherical caps (Dupuy and Benyoub 2023, listing 3). The density is
    /// 2·smith(wo)·(wo·h)·D(h) per unit solid angle of h.
    #[inline]
    pub(super) fn sample_visible(&self, wo: V3<F>, u: [F; 2]) -> V3<F> {
        let Alpha { x: ax, y: ay } = self.alpha;
        let w = V3::new(wo.x * ax, wo.y * ay, wo.z).normalize();
        // A point c of the cap of the unit sphere with c.z > -w.z. The sums 1 ± c.z are formed without cancellation.
        let below_top = u[1] * (F::ONE + w.z);
        let sin = (below_top * (F::of(2.0) - below_top)).safe_sqrt();
        let (sin_phi, cos_phi) = u[0].sin_cos_turn();
        let h_z = (F::ONE - u[1]) * (F::ONE + w.z);
        V3::new(ax * (sin * cos_phi + w.x), ay * (sin * sin_phi + w.y), h_z)
    }
}

/// Smith's masking of GGX divided by 2 cos θ: 1/(cos θ + sqrt(ax² x² + ay² y² + cos² θ)).
///
/// Two of them multiplied hold the 1/(4 cos θi cos θo) of the microfacet formula.
#[inline]
pub(super) fn smith<F: Number>(w: V3<F>, alpha: Alpha<F>) -> F {
    F::ONE / (w.z + ((w.x * alpha.x).sqr() + (w.y * alpha.y).sqr() + w.z.sqr()).sqrt())
}

/// The same, isotropic: 1/(cos θ + sqrt(a² + (1 - a²) cos² θ)).
#[inline]
pub(super) fn smith_isotropic<F: Number>(cos_theta: F, alpha: F) -> F {
    let a2 = alpha.sqr();
    F::ONE / (cos_theta + (a2 + (F::ONE - a2) * cos_theta.sqr()).sqrt())
}

/// GTR1 (Burley 2012, eq. 4 and appendix B.2.1), for alphas below 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gtr1<F> {
    a2: F,
    /// ln a².
    ln_a2: F,
    /// (a² - 1)/(π ln a²).
    scale: F,
}

impl<F: Real> Gtr1<F> {
    pub(super) fn new(alpha: F) -> Self {
        let a2 = alpha.sqr();
        let ln_a2 = a2.ln();
        Self { a2, ln_a2, scale: (a2 - F::ONE) * F::FRAC_1_PI / ln_a2 }
    }
}

impl Gtr1<f32> {
    /// Four side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Gtr1<Vec4> {
        let each = |field: fn(&Self) -> f32| Vec4::from_array(four.map(field));
        Gtr1 { a2: each(|d| d.a2), ln_a2: each(|d| d.ln_a2), scale: each(|d| d.scale) }
    }
}

impl<F: Number> Gtr1<F> {
    /// Normals per unit solid angle around the half vector: (a² - 1)/(π ln a²)/(hx² + hy² + a² hz²).
    #[inline]
    pub(super) fn density(&self, pair: &Pair<F>) -> F {
        let h = pair.sum;
        self.scale * pair.sum2 / (h.x.sqr() + h.y.sqr() + self.a2 * h.z.sqr())
    }
}

impl<F: Real> Gtr1<F> {
    /// A normal with density D(h)·hz per unit solid angle (Burley 2012, eq. 5), unit length.
    ///
    /// The report's cos² θ = (1 - a^(2(1-u)))/(1 - a²) loses θ near the pole; the same as sin² θ = a²(a^(-2u) - 1)/(1 - a²) doesn't.
    #[inline]
    pub(super) fn sample(&self, u: [F; 2]) -> V3<F> {
        let growth = exp_m1(-u[1] * self.ln_a2);
        let sin2 = (self.a2 * growth / (F::ONE - self.a2)).clamp(F::ZERO, F::ONE);
        let (sin, cos) = (sin2.sqrt(), (F::ONE - sin2).sqrt());
        let (sin_phi, cos_phi) = u[0].sin_cos_turn();
        V3::new(sin * cos_phi, sin * sin_phi, cos)
    }
}

/// e^x - 1 for x ≥ 0, to a few roundings.
#[inline]
fn exp_m1<F: Real>(x: F) -> F {
    if x > F::of(0.25) {
        return x.exp() - F::ONE;
    }
    // Horner's form of the series; the first term left out is below 10⁻¹⁶ relative.
    let mut series = F::ONE;
    for n in (2..=13).rev() {
        series = F::ONE + series * x / F::of(f64::from(n));
    }
    x * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_has_its_floor_per_axis_after_the_aspect() {
        let a = alpha_from_roughness(0.5f64, 1.0);
        assert!((a.x - 0.25 / 0.1f64.sqrt()).abs() < 1e-12 && (a.y - 0.25 * 0.1f64.sqrt()).abs() < 1e-12);
        assert_eq!(alpha_from_roughness(0.0f32, 1.0), Alpha { x: 0.001, y: 0.001 });
        let a = alpha_from_roughness(0.04f64, 1.0);
        assert!(a.x > 0.001 && a.y == 0.001);
    }

    #[test]
    fn exp_m1_is_accurate_on_both_sides_of_the_switch() {
        for x in [0.0, 1e-12, 1e-3, 0.1, 0.2499, 0.2501, 1.0, 13.8] {
            let expected = libm::expm1(x);
            assert!((exp_m1(x) - expected).abs() <= 1e-14 * expected, "{x}");
        }
    }
}
