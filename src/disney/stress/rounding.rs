//! `f32` against `f64`: how far apart they are, and how much of that the rounding of the inputs explains.

use super::{Case, LARGEST_RATIO, Worst, random::Random};
use crate::color::Rgb;
use crate::disney::{Bsdf, Lobe};
use crate::math::V3;

/// Values below this in both types are equal: what a lobe of denormal strength, below 10⁻³⁸, may reach at a peak of 10¹².
const NEGLIGIBLE: f64 = 1e-25;
/// Random ways to round the inputs.
const TRIALS: u64 = 32;
/// What is explained even if no input matters, in epsilons of `f32`.
const LEAST_EXPLAINED: f64 = 2.0 * f32::EPSILON as f64;

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Value {
    Lobe(Lobe),
    Pdf,
}

/// The errors of one value.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rounding {
    /// How many pairs of directions were compared.
    pub compared: u64,
    /// The largest difference, relative to the larger value.
    pub error: Worst,
    /// The largest ratio of a difference to what explains it.
    pub ratio: Worst,
}

impl Rounding {
    pub(super) fn merge(&mut self, other: &Self) {
        self.compared += other.compared;
        self.error.merge(&other.error);
        self.ratio.merge(&other.ratio);
    }

    /// Compares one value, known in both types, of a case.
    pub(super) fn compare(&mut self, case: &Case, value: Value, single: Rgb<f64>, double: Rgb<f64>) {
        self.compared += 1;
        let error = difference(single, double);
        self.error.raise(error, case);
        // The rest is expensive, and rarely decides.
        if error > self.ratio.value * LEAST_EXPLAINED {
            self.ratio.raise(error / explained(case, value, error), case);
        }
    }
}

/// The largest difference of two channels, relative to the larger one, so at most 1.
fn difference(a: Rgb<f64>, b: Rgb<f64>) -> f64 {
    let channels = a.to_array().into_iter().zip(b.to_array());
    channels.fold(0.0, |worst: f64, (a, b)| {
        let size = a.abs().max(b.abs());
        if size < NEGLIGIBLE { worst } else { worst.max((a - b).abs() / size) }
    })
}

/// What explains a difference: how far the `f64` value moves with its inputs, and [`LEAST_EXPLAINED`].
///
/// Where that isn't enough there may be a step nearby, such as where facets turn to the other side: `f32` may be on its other side if
/// inputs moved ten times as far are, which counts a tenth.
pub(super) fn explained(case: &Case, value: Value, error: f64) -> f64 {
    let near = LEAST_EXPLAINED + moved(case, value, 1.0);
    if error <= LARGEST_RATIO * near {
        near
    } else {
        near.max(LEAST_EXPLAINED + moved(case, value, 10.0) / 10.0)
    }
}

/// How far the `f64` value moves where each input is moved by `halves` times half a unit in the last place of `f32`, up or down at
/// random: the largest of [`TRIALS`].
fn moved(case: &Case, value: Value, halves: f64) -> f64 {
    let (material, wo, wi) = (case.material.cast::<f64>(), case.wo.cast(), case.wi.cast());
    let exact = value.of(&material.bsdf(), wo, wi);
    let differences = (0..TRIALS).map(|trial| {
        let mut random = Random::new(trial);
        let bsdf = material.nudged(&mut random, halves).bsdf();
        let (wo, wi) = (random.nudged_direction(wo, halves), random.nudged_direction(wi, halves));
        difference(value.of(&bsdf, wo, wi), exact)
    });
    differences.fold(0.0, f64::max)
}

impl Value {
    fn of(self, bsdf: &Bsdf<f64>, wo: V3<f64>, wi: V3<f64>) -> Rgb<f64> {
        match self {
            Self::Lobe(lobe) => bsdf.eval_lobe(lobe, wo, wi),
            Self::Pdf => Rgb::grey(bsdf.pdf(wo, wi)),
        }
    }
}

pub(super) fn is_negligible(f: Rgb<f64>) -> bool {
    f.max_channel() < NEGLIGIBLE
}
