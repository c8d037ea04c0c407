//! Eight floats at a time: what the kernels are written in.
//!
//! A kernel is generic over [`Lanes`], so that every machine does the same operations in the same order and finds the same bits; no
//! multiplication is ever fused with an addition.

use std::ops::{Add, Div, Mul, Sub};

/// A way to compute with eight floats.
pub(super) trait Lanes: Copy {
    /// The eight floats.
    type Floats: Floats;

    /// The same value in every lane.
    fn splat(self, value: f32) -> Self::Floats;

    /// A value for each lane.
    fn load(self, values: &[f32; 8]) -> Self::Floats;
}

/// Eight floats. Comparisons give a bit for each lane, the first lane's the lowest; they are false for NaN.
pub(super) trait Floats:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The smaller; `other` where either is NaN or both are 0.
    fn min(self, other: Self) -> Self;

    /// The larger; `other` where either is NaN or both are 0.
    fn max(self, other: Self) -> Self;

    /// Without the sign.
    fn abs(self) -> Self;

    /// Where this is less than `other`.
    fn less(self, other: Self) -> u32;

    /// Where this is less than `other` or equal to it.
    fn at_most(self, other: Self) -> u32;

    /// The lanes' values.
    fn to_array(self) -> [f32; 8];
}

/// Lanes of plain Rust, for machines that [`super::avx2`] does not know.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

/// Eight floats of [`Portable`].
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Array([f32; 8]);

impl Lanes for Portable {
    type Floats = Array;

    #[inline(always)]
    fn splat(self, value: f32) -> Array {
        Array([value; 8])
    }

    #[inline(always)]
    fn load(self, values: &[f32; 8]) -> Array {
        Array(*values)
    }
}

impl Array {
    #[inline(always)]
    fn each(self, other: Self, of: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| of(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn bits(self, other: Self, of: impl Fn(&f32, &f32) -> bool) -> u32 {
        (0..8).map(|i| u32::from(of(&self.0[i], &other.0[i])) << i).sum()
    }
}

impl Add for Array {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.each(other, f32::add)
    }
}

impl Sub for Array {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.each(other, f32::sub)
    }
}

impl Mul for Array {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.each(other, f32::mul)
    }
}

impl Div for Array {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.each(other, f32::div)
    }
}

impl Floats for Array {
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.each(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.each(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        self.bits(other, f32::lt)
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.bits(other, f32::le)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self.0
    }
}
