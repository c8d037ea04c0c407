//! What the lobes need to know of a pair of directions, computed once.

use super::fresnel::Edge;
use crate::math::{Number, Real, V3};

/// Two directions above the surface with the terms all lobes share.
///
/// All terms but Schlick's weight are symmetric in the two directions to the last bit. The weight is as far as both have unit length: in
/// `f32` reciprocity holds to 10⁻⁶/|wo + wi|².
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<F> {
    /// To the viewer.
    pub(super) wo: V3<F>,
    /// To the light.
    pub(super) wi: V3<F>,
    /// wo + wi: the half vector times 2 cos θd, not normalised.
    pub(super) sum: V3<F>,
    /// |wo + wi|² = 4 cos² θd.
    pub(super) sum2: F,
    /// cos θd, θd being the angle between either direction and the half vector.
    pub(super) cos_d: F,
    /// cos² θd.
    pub(super) cos2_d: F,
    /// Schlick's weight at θd.
    pub(super) edge: Edge<F>,
}

impl<F: Real> Pair<F> {
    /// `None` unless both directions are above the horizon and finite. Also where their cosines sum to less than 10⁻¹⁵: opposite
    /// directions have no half vector then, and 1/cos θ would not be finite for long.
    #[inline]
    pub(super) fn new(wo: V3<F>, wi: V3<F>) -> Option<Self> {
        let sum = wo + wi;
        let sum2 = sum.length_squared();
        Self::is_there(wo, wi, sum, sum2).then(|| Self::of(wo, wi, sum, sum2))
    }
}

impl<F: Number> Pair<F> {
    /// The same for every lane, with those where it is there; the others hold no numbers of use.
    #[inline(always)]
    pub(super) fn masked(wo: V3<F>, wi: V3<F>) -> (Self, F::Mask) {
        let sum = wo + wi;
        let sum2 = sum.length_squared();
        (Self::of(wo, wi, sum, sum2), Self::is_there(wo, wi, sum, sum2))
    }

    #[inline(always)]
    fn is_there(wo: V3<F>, wi: V3<F>, sum: V3<F>, sum2: F) -> F::Mask {
        let are_above = wo.z.above(F::ZERO) & wi.z.above(F::ZERO);
        are_above & sum.z.above(F::of(1e-15)) & F::of(f64::INFINITY).above(sum2)
    }

    #[inline(always)]
    fn of(wo: V3<F>, wi: V3<F>, sum: V3<F>, sum2: F) -> Self {
        // The mean of the two directions' cosines with the half vector. They differ where rounding left the lengths unequal, and one of
        // them is negative then if the directions are nearly opposite.
        let cos_d = F::of(0.5) * sum2.sqrt();
        // Schlick's weight is that of the light's own cosine, as in disney.brdf: dot(L, H).
        let cos_i = (wi.dot(sum) / sum2.sqrt()).max(F::ZERO);
        // = sin² θd/(1 + cos θd) with sin θd = |wo - wi|/2: no cancellation near θd = 0.
        let near_0 = F::of(0.25) * (wo - wi).length_squared() / (F::ONE + cos_i);
        let one_minus_cos_i = F::select(cos_i.above(F::of(0.5)), near_0, F::ONE - cos_i);
        Self { wo, wi, sum, sum2, cos_d, cos2_d: cos_d.sqr(), edge: Edge::given_both(cos_i, one_minus_cos_i) }
    }
}
