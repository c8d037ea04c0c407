//! The float type that shading code is generic over.

use super::{Number, arctangent};

/// A float: `f32` in renders, `f64` as the twin that tests measure `f32` against.
///
/// Square roots are the hardware's (IEEE 754 rounds them correctly everywhere); other functions are `libm`'s or our own, whose
/// bits do not depend on the C library or the processor.
pub trait Real: Number<Mask = bool> + PartialOrd {
    /// π.
    const PI: Self;
    /// The distance from 1 to the next larger number.
    const EPSILON: Self;
    /// Terms of the series of sine and cosine, after the first, that a quarter of a turn needs.
    const QUARTER_TERMS: u32;

    /// The value as `f64`, exact.
    fn to_f64(self) -> f64;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// The sine of an angle in radians.
    fn sin(self) -> Self;
    /// The cosine of an angle in radians.
    fn cos(self) -> Self;
    /// Sine and cosine of 2π·self for a self in [0, 1]: the angle of a point on a circle.
    ///
    /// Several times faster than [`Self::sin`] and [`Self::cos`], since the range is known.
    fn sin_cos_turn(self) -> (Self, Self);
    /// The natural logarithm.
    fn ln(self) -> Self;
    /// e^self.
    fn exp(self) -> Self;
    /// self^exponent.
    fn powf(self, exponent: Self) -> Self;
    /// The angle of the vector (x, self), in (-π, π].
    fn atan2(self, x: Self) -> Self;
    /// The angle in [0, π] whose cosine is self.
    fn acos(self) -> Self;
    /// self with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// The value as `f32`, rounded to nearest.
    fn to_f32(self) -> f32 {
        self.to_f64() as f32
    }
    /// Sine and cosine of π/2·self for a self in [-1, 1], by their series, to an absolute error of an epsilon or two.
    #[inline]
    fn sin_cos_quarter(self) -> (Self, Self) {
        let x = self * Self::of(std::f64::consts::FRAC_PI_2);
        let x2 = x.sqr();
        // Horner's form of x - x³/3! + x⁵/5! - … and of 1 - x²/2! + x⁴/4! - …
        let (mut sin, mut cos) = (Self::ONE, Self::ONE);
        for n in (1..=Self::QUARTER_TERMS).rev() {
            let n = 2.0 * f64::from(n);
            cos = Self::ONE - x2 * cos * Self::of(1.0 / ((n - 1.0) * n));
            sin = Self::ONE - x2 * sin * Self::of(1.0 / (n * (n + 1.0)));
        }
        (sin * x, cos)
    }
}

macro_rules! real {
    ($float:ident, $quarter_terms:literal, $sin:path, $cos:path, $ln:path, $exp:path, $pow:path, $atan2:path, $acos:path) => {
        impl Real for $float {
            const PI: Self = std::$float::consts::PI;
            const EPSILON: Self = $float::EPSILON;
            const QUARTER_TERMS: u32 = $quarter_terms;

            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                $float::is_finite(self)
            }
            #[inline]
            fn sin(self) -> Self {
                $sin(self)
            }
            #[inline]
            fn cos(self) -> Self {
                $cos(self)
            }
            #[inline]
            fn sin_cos_turn(self) -> (Self, Self) {
                // The nearest half turn, which turns both signs, and what is left in units of a quarter. No branch: the angles are
                // random. The conversion saturates, so any input is safe.
                let half = (2.0 * self + 0.5) as i32;
                let sign = (1 - 2 * (half & 1)) as $float;
                let (sin, cos) = (4.0 * self - 2.0 * half as $float).sin_cos_quarter();
                (sign * sin, sign * cos)
            }
            #[inline]
            fn ln(self) -> Self {
                $ln(self)
            }
            #[inline]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn powf(self, exponent: Self) -> Self {
                $pow(self, exponent)
            }
            #[inline]
            fn atan2(self, x: Self) -> Self {
                $atan2(self, x)
            }
            #[inline]
            fn acos(self) -> Self {
                $acos(self)
            }
            #[inline]
            fn copysign(self, sign: Self) -> Self {
                $float::copysign(self, sign)
            }
        }
    };
}

real!(f32, 6, libm::sinf, libm::cosf, libm::logf, libm::expf, libm::powf, arctangent::atan2, libm::acosf);
real!(f64, 11, libm::sin, libm::cos, libm::log, libm::exp, libm::pow, libm::atan2, libm::acos);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_cos_turn_agrees_with_libm_all_around() {
        for i in 0..=100_000 {
            let u = f64::from(i) / 100_000.0;
            let angle = 2.0 * std::f64::consts::PI * u;
            let (sin, cos) = u.sin_cos_turn();
            assert!((sin - Real::sin(angle)).abs() < 1e-15 && (cos - Real::cos(angle)).abs() < 1e-15, "{u}");
            let single = u as f32;
            let angle = 2.0 * std::f64::consts::PI * f64::from(single);
            let (sin, cos) = single.sin_cos_turn();
            assert!((f64::from(sin) - Real::sin(angle)).abs() < 2.4e-7, "{u}");
            assert!((f64::from(cos) - Real::cos(angle)).abs() < 2.4e-7, "{u}");
        }
    }

    #[test]
    fn sin_cos_turn_survives_any_input() {
        for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0] {
            let _ = u.sin_cos_turn();
        }
    }
}
