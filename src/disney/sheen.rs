//! Sheen: a grazing component for cloth.

use glam::Vec4;

use super::pair::Pair;
use super::parameter::Params;
use crate::color::Rgb;
use crate::math::{Number, Real, V3};

/// The sheen term. It is broad, and sampled by the cosine together with the diffuse lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheen<F> {
    pub(super) color: Rgb<F>,
    mean: F,
}

impl<F: Real> Sheen<F> {
    /// `None` where the term is zero. `tint` is the base colour's hue.
    pub(super) fn new(params: &Params<F>, tint: Rgb<F>) -> Option<Self> {
        let strength = params.sheen * params.diffuse_part();
        let color = Rgb::WHITE.lerp(tint, params.sheen_tint) * strength;
        (!color.is_black()).then(|| Self { color, mean: color.mean() })
    }
}

impl Sheen<f32> {
    /// The term that adds nothing.
    pub(super) fn none(&self) -> Self {
        Self { color: Rgb::BLACK, mean: 0.0 }
    }

    /// Four side by side.
    #[inline(always)]
    pub(super) fn beside(four: [&Self; 4]) -> Sheen<Vec4> {
        Sheen { color: Rgb::beside(four.map(|s| s.color)), mean: Vec4::from_array(four.map(|s| s.mean)) }
    }
}

impl<F: Number> Sheen<F> {
    /// An estimate of the reflected part of light: a fit to the integral.
    #[inline]
    pub(super) fn albedo(&self, wo: V3<F>) -> F {
        let slant = (F::ONE - wo.z).max(F::ZERO);
        self.mean * (F::of(0.002) + F::of(0.088) * slant.sqr() * slant)
    }

    /// sheen·lerp(1, tint, sheen_tint)·(1 - metallic)·(1 - spec_trans)·(1 - cos θd)⁵, without a 1/π (Burley 2012, section 5.5, and disney.brdf).
    #[inline]
    pub(super) fn eval(&self, pair: &Pair<F>) -> Rgb<F> {
        self.color * pair.edge.weight
    }
}
