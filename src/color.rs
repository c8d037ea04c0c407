//! Linear and sRGB colours.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

use glam::{BVec4A, Vec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::{Number, Real};

/// A linear colour with Rec. 709 primaries: a reflectance in [0, 1], or a radiance in any unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    from = "[F; 3]",
    into = "[F; 3]",
    bound(serialize = "F: Real + Serialize", deserialize = "F: Real + Deserialize<'de>")
)]
#[schemars(with = "[f32; 3]")]
pub struct Rgb<F = f32> {
    /// Red.
    pub r: F,
    /// Green.
    pub g: F,
    /// Blue.
    pub b: F,
}

impl<F: Number> Rgb<F> {
    /// No light.
    pub const BLACK: Self = Self { r: F::ZERO, g: F::ZERO, b: F::ZERO };
    /// Reflectance 1 or radiance 1.
    pub const WHITE: Self = Self { r: F::ONE, g: F::ONE, b: F::ONE };

    /// The colour (r, g, b).
    #[inline]
    pub const fn new(r: F, g: F, b: F) -> Self {
        Self { r, g, b }
    }

    /// The same value in every channel.
    #[inline]
    pub const fn grey(value: F) -> Self {
        Self::new(value, value, value)
    }

    /// The three channels.
    #[inline]
    pub const fn to_array(self) -> [F; 3] {
        [self.r, self.g, self.b]
    }

    /// `f` of each channel.
    #[inline]
    pub fn map(self, f: impl Fn(F) -> F) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// The luminance Y of Rec. 709 primaries and white point.
    #[inline]
    pub fn luminance(self) -> F {
        F::of(0.212_639) * self.r + F::of(0.715_169) * self.g + F::of(0.072_192) * self.b
    }

    /// (r + g + b)/3.
    #[inline]
    pub fn mean(self) -> F {
        (self.r + self.g + self.b) * F::of(1.0 / 3.0)
    }

    /// The largest channel.
    #[inline]
    pub fn max_channel(self) -> F {
        self.r.max(self.g).max(self.b)
    }

    /// self·(1 - t) + other·t.
    #[inline]
    pub fn lerp(self, other: Self, t: F) -> Self {
        self * (F::ONE - t) + other * t
    }
}

impl<F: Real> Rgb<F> {
    /// Every channel is 0.
    #[inline]
    pub fn is_black(self) -> bool {
        self.r == F::ZERO && self.g == F::ZERO && self.b == F::ZERO
    }

    /// No channel is infinite or NaN.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// The same colour in another float type.
    #[inline]
    pub fn cast<G: Real>(self) -> Rgb<G> {
        Rgb::new(G::of(self.r.to_f64()), G::of(self.g.to_f64()), G::of(self.b.to_f64()))
    }
}

impl Rgb<Vec4> {
    /// Four colours side by side.
    #[inline(always)]
    pub fn beside(four: [Rgb; 4]) -> Self {
        let channel = |of: fn(&Rgb) -> f32| Vec4::from_array(four.each_ref().map(of));
        Self::new(channel(|c| c.r), channel(|c| c.g), channel(|c| c.b))
    }

    /// The same colour in all lanes.
    #[inline(always)]
    pub fn splat(color: Rgb) -> Self {
        Self::new(Vec4::splat(color.r), Vec4::splat(color.g), Vec4::splat(color.b))
    }

    /// The colour in a lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> Rgb {
        Rgb::new(self.r[lane], self.g[lane], self.b[lane])
    }

    /// `yes` where the mask says so, and `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: BVec4A, yes: Self, no: Self) -> Self {
        let choose = |yes: Vec4, no: Vec4| Vec4::select(mask, yes, no);
        Self::new(choose(yes.r, no.r), choose(yes.g, no.g), choose(yes.b, no.b))
    }
}

/// The linear value in [0, 1] of an sRGB-encoded one (IEC 61966-2-1).
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { Real::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// The sRGB encoding of a linear value (IEC 61966-2-1).
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * Real::powf(linear, 1.0 / 2.4) - 0.055 }
}

impl<F> From<[F; 3]> for Rgb<F> {
    fn from([r, g, b]: [F; 3]) -> Self {
        Self { r, g, b }
    }
}

impl<F> From<Rgb<F>> for [F; 3] {
    fn from(c: Rgb<F>) -> Self {
        [c.r, c.g, c.b]
    }
}

impl<F: Number> Add for Rgb<F> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl<F: Number> Sub for Rgb<F> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self::new(self.r - o.r, self.g - o.g, self.b - o.b)
    }
}

impl<F: Number> Mul for Rgb<F> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl<F: Number> Mul<F> for Rgb<F> {
    type Output = Self;
    #[inline]
    fn mul(self, s: F) -> Self {
        Self::new(self.r * s, self.g * s, self.b * s)
    }
}

impl<F: Number> Div<F> for Rgb<F> {
    type Output = Self;
    #[inline]
    fn div(self, s: F) -> Self {
        Self::new(self.r / s, self.g / s, self.b / s)
    }
}

impl<F: Number> AddAssign for Rgb<F> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<F: Number> MulAssign for Rgb<F> {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trip_and_known_values() {
        assert!((linear_from_srgb(0.5) - 0.214_041_14).abs() < 1e-6);
        assert!((srgb_from_linear(0.18) - 0.461_356_13).abs() < 1e-6);
        for i in 0..=255 {
            let encoded = i as f32 / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(encoded)) - encoded).abs() < 1e-6);
        }
    }

    #[test]
    fn luminance_of_white_is_one() {
        assert!((Rgb::<f64>::WHITE.luminance() - 1.0).abs() < 1e-6);
    }
}
