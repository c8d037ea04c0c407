//! What formulas compute with: one number, or four side by side.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use glam::{BVec4A, Vec4};

/// A float, or four of them in the lanes of a [`Vec4`], which finds in each lane the bits that `f32` finds.
///
/// So a formula that asks [`Self::select`] instead of branching is written once for both.
pub trait Number:
    Copy
    + Debug
    + Default
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// An answer for each lane.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// 1/π.
    const FRAC_1_PI: Self;

    /// The nearest number of this type, the same in all lanes.
    fn of(value: f64) -> Self;
    /// √self, correctly rounded.
    fn sqrt(self) -> Self;
    /// |self|.
    fn abs(self) -> Self;
    /// The larger of two. Where self is NaN, the other one.
    fn max(self, other: Self) -> Self;
    /// The smaller of two. Where self is NaN, the other one.
    fn min(self, other: Self) -> Self;
    /// Where self is more than `other`; nowhere near NaN.
    fn above(self, other: Self) -> Self::Mask;
    /// `yes` where the mask says so, and `no` elsewhere: both are worked out, and nothing is guessed.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether the mask says so anywhere.
    fn any(mask: Self::Mask) -> bool;

    /// self².
    #[inline(always)]
    fn sqr(self) -> Self {
        self * self
    }
    /// self⁵.
    #[inline(always)]
    fn pow5(self) -> Self {
        self.sqr().sqr() * self
    }
    /// self limited to [low, high].
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// √max(self, 0): for differences that are non-negative in exact arithmetic.
    #[inline(always)]
    fn safe_sqrt(self) -> Self {
        self.max(Self::ZERO).sqrt()
    }
    /// self·(1 - t) + other·t.
    #[inline(always)]
    fn lerp(self, other: Self, t: Self) -> Self {
        self * (Self::ONE - t) + other * t
    }
}

macro_rules! number {
    ($float:ident) => {
        impl Number for $float {
            type Mask = bool;

            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const FRAC_1_PI: Self = std::$float::consts::FRAC_1_PI;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $float
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $float::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $float::abs(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                $float::max(self, other)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                $float::min(self, other)
            }
            #[inline(always)]
            fn above(self, other: Self) -> bool {
                self > other
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                std::hint::select_unpredictable(mask, yes, no)
            }
            #[inline(always)]
            fn any(mask: bool) -> bool {
                mask
            }
        }
    };
}

number!(f32);
number!(f64);

impl Number for Vec4 {
    type Mask = BVec4A;

    const ZERO: Self = Vec4::ZERO;
    const ONE: Self = Vec4::ONE;
    const FRAC_1_PI: Self = Vec4::splat(std::f32::consts::FRAC_1_PI);

    #[inline(always)]
    fn of(value: f64) -> Self {
        Vec4::splat(value as f32)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Vec4::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Vec4::abs(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Vec4::max(self, other)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Vec4::min(self, other)
    }
    #[inline(always)]
    fn above(self, other: Self) -> BVec4A {
        self.cmpgt(other)
    }
    #[inline(always)]
    fn select(mask: BVec4A, yes: Self, no: Self) -> Self {
        Vec4::select(mask, yes, no)
    }
    #[inline(always)]
    fn any(mask: BVec4A) -> bool {
        mask.any()
    }
}
