//! Lanes of an x86-64 processor's AVX2: the house's only unsafe code.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, ControlFlow, Div, Mul, Sub};

use super::lanes::{Floats, Lanes};
use super::{Bvh, Hit, Ray, traverse};

/// Proof that the running processor has AVX2: only [`Self::detect`] makes one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

/// Eight floats in a register. Only the holder of an [`Avx2`] makes the first, so that whoever holds one may compute with it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Register(__m256);

impl Avx2 {
    /// The proof, where the processor has what the kernels are compiled for.
    pub(super) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }

    /// [`traverse::closest`], compiled for AVX2.
    #[inline(always)]
    pub(super) fn closest<const INSTANCES: bool>(
        self,
        bvh: &Bvh,
        ray: &Ray,
        counts: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        #[target_feature(enable = "avx2,bmi1,popcnt")]
        fn compiled<const INSTANCES: bool>(
            lanes: Avx2,
            bvh: &Bvh,
            ray: &Ray,
            counts: impl FnMut(&Hit) -> bool,
        ) -> Option<Hit> {
            traverse::closest::<_, INSTANCES>(lanes, bvh, ray, counts)
        }
        // SAFETY: `self` proves that the processor has these features.
        unsafe { compiled::<INSTANCES>(self, bvh, ray, counts) }
    }

    /// [`traverse::visit`], compiled for AVX2.
    #[inline(always)]
    pub(super) fn visit<const INSTANCES: bool>(
        self,
        bvh: &Bvh,
        ray: &Ray,
        visitor: impl FnMut(Hit) -> ControlFlow<()>,
    ) -> bool {
        #[target_feature(enable = "avx2,bmi1,popcnt")]
        fn compiled<const INSTANCES: bool>(
            lanes: Avx2,
            bvh: &Bvh,
            ray: &Ray,
            visitor: impl FnMut(Hit) -> ControlFlow<()>,
        ) -> bool {
            traverse::visit::<_, INSTANCES>(lanes, bvh, ray, visitor)
        }
        // SAFETY: `self` proves that the processor has these features.
        unsafe { compiled::<INSTANCES>(self, bvh, ray, visitor) }
    }
}

impl Lanes for Avx2 {
    type Floats = Register;

    #[inline(always)]
    fn splat(self, value: f32) -> Register {
        // SAFETY: `self` proves that the processor has AVX.
        Register(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    fn load(self, values: &[f32; 8]) -> Register {
        // SAFETY: `self` proves that the processor has AVX; the reference is to eight floats, and the load needs no alignment.
        Register(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
}

macro_rules! operator {
    ($operator:ident $method:ident $intrinsic:ident) => {
        impl $operator for Register {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: who has a register has an `Avx2`, which proves that the processor has AVX.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

operator!(Add add _mm256_add_ps);
operator!(Sub sub _mm256_sub_ps);
operator!(Mul mul _mm256_mul_ps);
operator!(Div div _mm256_div_ps);

impl Register {
    /// The lanes where a comparison holds, by the number of its predicate.
    #[inline(always)]
    fn compare<const PREDICATE: i32>(self, other: Self) -> u32 {
        // SAFETY: who has a register has an `Avx2`, which proves that the processor has AVX.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<PREDICATE>(self.0, other.0)).cast_unsigned() }
    }
}

impl Floats for Register {
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: who has a register has an `Avx2`, which proves that the processor has AVX.
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as for `min`.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as for `min`.
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        self.compare::<_CMP_LT_OQ>(other)
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.compare::<_CMP_LE_OQ>(other)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut values = [0.0; 8];
        // SAFETY: as for `min`; the array has room for eight floats, and the store needs no alignment.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
}
