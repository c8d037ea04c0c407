//! A stress suite for the BSDF: random and extreme (material, wo, u), checked one by one.
//!
//! `cargo bench --bench bsdf_stress` runs ten million, a test some hundred thousand. Parameters lie at both ends of their ranges half
//! the time, or next to them, or are denormal; cosines go down to 10⁻⁷ from both sides; random numbers include 0 and the largest float
//! below 1. Nothing is clamped to pass:
//!
//! - no value is NaN, infinite or negative; the density is above 0 whenever a direction was sampled, and wherever the BSDF is;
//! - a sample carries the very values of `eval` and `pdf`;
//! - its weight, the largest channel of f·|cos θi|/pdf, stays below [`Bsdf::weight_bound`], a function of the angle for each lobe;
//! - `f32` agrees with the `f64` instantiation of the same source to ten times what rounding the inputs explains: the largest change
//!   of the `f64` value where each parameter (but 0 and 1) and each component of the directions is moved by half a unit in the last
//!   place of `f32`, up or down in 32 random ways, and two epsilons. Values below 10⁻²⁵ count as 0: a lobe of strength 10⁻⁴⁰ has
//!   no 24 bits. Nor are weights and densities compared where a lobe is that dim.

mod random;
mod rounding;

use std::fmt;

use rayon::prelude::*;

pub(in crate::disney) use random::Random;
pub use rounding::Rounding;
use rounding::{Value, explained, is_negligible};

use super::{Bsdf, DiffuseModel, Lobe, Masking, Model, Params};
use crate::color::Rgb;
use crate::math::{Real, V3, hash};

/// All lobes, in their order.
pub(super) const LOBES: [Lobe; 10] = [
    Lobe::Diffuse,
    Lobe::Sheen,
    Lobe::Specular,
    Lobe::Clearcoat,
    Lobe::Transmission,
    Lobe::DiffuseTransmission,
    Lobe::Mirror,
    Lobe::DielectricReflection,
    Lobe::DielectricTransmission,
    Lobe::StraightTransmission,
];
/// Triples that one thread does in a row.
const CHUNK: u64 = 4096;
/// What rounding may add to a weight's bound.
const BOUND_TOLERANCE: f64 = 1e-4;
/// The largest ratio of an error to what explains it.
pub const LARGEST_RATIO: f64 = 10.0;

/// What a BSDF is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material<F = f32> {
    /// Which BSDF.
    pub model: Model,
    /// Its parameters.
    pub params: Params<F>,
    /// The specular lobe's masking.
    pub masking: Masking,
    /// The diffuse term.
    pub diffuse: DiffuseModel,
}

impl<F: Real> Material<F> {
    /// The BSDF.
    pub fn bsdf(&self) -> Bsdf<F> {
        match self.model {
            Model::Disney => Bsdf::disney(&self.params, self.masking, self.diffuse),
            Model::Diffuse => Bsdf::diffuse(self.params.base_color),
            Model::Mirror => Bsdf::mirror(),
            Model::Dielectric => Bsdf::dielectric(self.params.ior),
        }
    }

    /// The same material in another float type.
    pub fn cast<G: Real>(&self) -> Material<G> {
        let Self { model, masking, diffuse, .. } = *self;
        Material { model, params: self.params.cast(), masking, diffuse }
    }
}

/// A material with what it was asked.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// The material.
    pub material: Material,
    /// To the viewer.
    pub wo: V3<f32>,
    /// What chose the lobe, then the direction.
    pub u: [f32; 3],
    /// To the light: as sampled, or as chosen for a comparison.
    pub wi: V3<f32>,
    /// The sampled lobe.
    pub lobe: Option<Lobe>,
}

/// As Rust code.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { material: Material { model, params, masking, diffuse }, wo, u, wi, .. } = self;
        write!(
            f,
            "let material = Material {{ model: Model::{model:?}, params: {params:?}, masking: Masking::{masking:?}, diffuse: \
             DiffuseModel::{diffuse:?} }}; let (wo, wi, u) = ({wo:?}, {wi:?}, {u:?});"
        )
    }
}

/// The largest of some values, and the first case that has it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Worst {
    /// The value, 0 for none.
    pub value: f64,
    /// Where.
    pub at: Option<Case>,
}

impl Worst {
    fn raise(&mut self, value: f64, at: &Case) {
        if value > self.value {
            *self = Self { value, at: Some(*at) };
        }
    }

    fn merge(&mut self, other: &Self) {
        if other.value > self.value {
            *self = *other;
        }
    }
}

/// What happened to the samples and values of a lobe.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Samples of the lobe.
    pub samples: u64,
    /// Values with a NaN.
    pub nan: u64,
    /// Values with an infinity.
    pub infinite: u64,
    /// Values with a negative number.
    pub negative: u64,
    /// Samples without a density, or whose values aren't those of `eval` and `pdf`.
    pub inconsistent: u64,
    /// Weights above their bound.
    pub above_bound: u64,
    /// The largest weight.
    pub weight: Worst,
    /// The largest weight over its bound.
    pub of_bound: Worst,
    /// The last case that was wrong.
    pub wrong: Option<Case>,
}

impl Tally {
    /// How many values were wrong.
    pub fn violations(&self) -> u64 {
        self.nan + self.infinite + self.negative + self.inconsistent + self.above_bound
    }

    fn merge(&mut self, other: &Self) {
        self.samples += other.samples;
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.inconsistent += other.inconsistent;
        self.above_bound += other.above_bound;
        self.weight.merge(&other.weight);
        self.of_bound.merge(&other.of_bound);
        self.wrong = self.wrong.or(other.wrong);
    }

    /// Counts what is wrong with a BSDF's value and a density.
    fn check(&mut self, f: Rgb, pdf: f32, case: &Case) {
        let [r, g, b] = f.to_array();
        let any = |is: fn(f32) -> bool| u64::from([r, g, b, pdf].into_iter().any(is));
        let before = self.violations();
        self.nan += any(f32::is_nan);
        self.infinite += any(f32::is_infinite);
        self.negative += any(|v| v < 0.0);
        if self.violations() > before {
            self.wrong = Some(*case);
        }
    }

    /// Counts an event that mustn't be.
    fn expect(&mut self, holds: bool, count: fn(&mut Self) -> &mut u64, case: &Case) {
        if !holds {
            *count(self) += 1;
            self.wrong = Some(*case);
        }
    }
}

/// What a run found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Triples tried.
    pub triples: u64,
    /// Triples of which no sample came: light below the horizon, or a view from where nothing is scattered.
    pub none: u64,
    /// Triples not compared with `f64`, where a lobe is there that isn't in `f32`: the product of its parameters is 0.
    pub unlike: u64,
    /// Samples and values by lobe, in the order of [`Lobe`].
    pub tallies: [Tally; LOBES.len()],
    /// `f32` against `f64` by lobe, in the same order.
    pub lobes: [Rounding; LOBES.len()],
    /// `f32` against `f64`, for the density of all lobes.
    pub pdf: Rounding,
}

impl Report {
    fn merge(mut self, other: &Self) -> Self {
        self.triples += other.triples;
        self.none += other.none;
        self.unlike += other.unlike;
        self.tallies.iter_mut().zip(&other.tallies).for_each(|(a, b)| a.merge(b));
        self.lobes.iter_mut().zip(&other.lobes).for_each(|(a, b)| a.merge(b));
        self.pdf.merge(&other.pdf);
        self
    }

    /// What is wrong, a line each.
    pub fn violations(&self) -> Vec<String> {
        let tallies = LOBES.iter().zip(&self.tallies).filter(|(_, tally)| tally.violations() > 0);
        let wrong = tallies.filter_map(|(lobe, tally)| {
            Some(format!("{}: {} wrong, such as {}", lobe.name(), tally.violations(), tally.wrong?))
        });
        let inexact = self.roundings().filter(|(_, r)| r.ratio.value > LARGEST_RATIO);
        let inexact = inexact.filter_map(|(name, r)| {
            Some(format!("{name}: {:.1} times what is explained at {}", r.ratio.value, r.ratio.at?))
        });
        wrong.chain(inexact).collect()
    }

    fn roundings(&self) -> impl Iterator<Item = (&'static str, &Rounding)> {
        LOBES.iter().map(|lobe| lobe.name()).zip(&self.lobes).chain([("pdf", &self.pdf)])
    }
}

/// Two tables, and where the worst values are.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{} triples, {} without a sample, {} with lobes that vanish in f32\n",
            self.triples, self.none, self.unlike
        )?;
        writeln!(
            f,
            "{:22}{:>10}{:>6}{:>6}{:>9}{:>13}{:>12}{:>14}{:>10}",
            "sampled",
            "samples",
            "NaN",
            "Inf",
            "negative",
            "inconsistent",
            "above bound",
            "weight up to",
            "of bound"
        )?;
        for (lobe, t) in LOBES.iter().zip(&self.tallies) {
            writeln!(
                f,
                "{:22}{:>10}{:>6}{:>6}{:>9}{:>13}{:>12}{:>14.4}{:>10.4}",
                lobe.name(),
                t.samples,
                t.nan,
                t.infinite,
                t.negative,
                t.inconsistent,
                t.above_bound,
                t.weight.value,
                t.of_bound.value
            )?;
        }
        writeln!(
            f,
            "\n{:22}{:>10}{:>14}{:>12}{:>20}",
            "f32 against f64", "compared", "error up to", "explained", "error/explained ≤"
        )?;
        for (i, (name, r)) in self.roundings().enumerate() {
            let value = LOBES.get(i).map_or(Value::Pdf, |&lobe| Value::Lobe(lobe));
            let there = r.error.at.map_or(0.0, |case| explained(&case, value, r.error.value));
            writeln!(
                f,
                "{name:22}{:>10}{:>14.2e}{there:>12.2e}{:>20.2}",
                r.compared, r.error.value, r.ratio.value
            )?;
        }
        writeln!(f)?;
        for (lobe, t) in LOBES.iter().zip(&self.tallies) {
            for (what, worst) in [("largest weight", &t.weight), ("nearest to its bound", &t.of_bound)] {
                if let Some(case) = &worst.at {
                    writeln!(f, "{}, {what} {:.4}: {case}", lobe.name(), worst.value)?;
                }
            }
        }
        for (name, r) in self.roundings() {
            for (what, worst) in [("largest error", &r.error), ("least explained error", &r.ratio)] {
                if let Some(case) = &worst.at {
                    writeln!(f, "{name}, {what} {:.3e}: {case}", worst.value)?;
                }
            }
        }
        Ok(())
    }
}

/// Tries at least `triples` random triples; the result depends on the arguments alone, not on the threads.
pub fn run(triples: u64, seed: u64) -> Report {
    let chunks: Vec<Report> = (0..triples.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| run_chunk(hash::combine(seed, chunk)))
        .collect();
    chunks.iter().fold(Report::default(), Report::merge)
}

fn run_chunk(seed: u64) -> Report {
    let mut random = Random::new(seed);
    let mut report = Report::default();
    for _ in 0..CHUNK {
        report.triples += 1;
        let material = random.material();
        let (single, double) = (material.bsdf(), material.cast::<f64>().bsdf());
        let u = [random.sampler_unit(), random.sampler_unit(), random.sampler_unit()];
        let mut case = Case { material, wo: random.view(), u, wi: V3::default(), lobe: None };
        report.sample(&mut case, &single, &double);
        case.wi = random.light(&case);
        report.evaluate(&case, &single, &double);
    }
    report
}

impl Report {
    /// Samples once and checks the sample.
    fn sample(&mut self, case: &mut Case, single: &Bsdf, double: &Bsdf<f64>) {
        let [u_lobe, u0, u1] = case.u;
        let Some(s) = single.sample(case.wo, u_lobe, [u0, u1]) else {
            self.none += 1;
            return;
        };
        (case.wi, case.lobe) = (s.wi, Some(s.lobe));
        let tally = &mut self.tallies[s.lobe as usize];
        tally.samples += 1;
        tally.check(s.f, s.pdf, case);
        let is_unit = (s.wi.cast::<f64>().length() - 1.0).abs() < 2e-6;
        let same = s.lobe.is_delta() || single.eval_with_pdf(case.wo, s.wi) == (s.f, s.pdf);
        tally.expect(s.pdf > 0.0 && is_unit && same, |t| &mut t.inconsistent, case);

        let weight = f64::from(s.f.max_channel()) * f64::from(s.wi.z.abs()) / f64::from(s.pdf);
        let (bound, twin) =
            (single.weight_bound(case.wo, s.lobe), double.weight_bound(case.wo.cast(), s.lobe));
        // An estimate of 10⁻⁴⁰ has no reciprocal in `f32`.
        let bound = if bound.is_finite() { f64::from(bound) } else { twin };
        tally.weight.raise(weight, case);
        if !is_negligible(s.f.cast()) {
            let within = bound.is_finite() && weight <= bound * (1.0 + BOUND_TOLERANCE);
            tally.expect(within, |t| &mut t.above_bound, case);
            tally.of_bound.raise(weight / bound, case);
        }
    }

    /// Evaluates for one pair of directions in both types and compares.
    fn evaluate(&mut self, case: &Case, single: &Bsdf, double: &Bsdf<f64>) {
        let (wo, wi) = (case.wo, case.wi);
        let (f, pdf) = single.eval_with_pdf(wo, wi);
        let (f_twin, pdf_twin) = double.eval_with_pdf(wo.cast(), wi.cast());
        let mut any_negligible = false;
        let same_lobes = single.lobes() == double.lobes();
        self.unlike += u64::from(!same_lobes);
        for lobe in single.lobes().into_iter().filter(|lobe| !lobe.is_delta()) {
            let value = single.eval_lobe(lobe, wo, wi);
            let tally = &mut self.tallies[lobe as usize];
            tally.check(value, pdf, case);
            tally.expect(is_negligible(value.cast()) || pdf > 0.0, |t| &mut t.inconsistent, case);
            let twin = double.eval_lobe(lobe, wo.cast(), wi.cast());
            any_negligible |= !twin.is_black() && is_negligible(twin);
            if same_lobes && !(value.is_black() && twin.is_black()) {
                self.lobes[lobe as usize].compare(case, Value::Lobe(lobe), value.cast(), twin);
            }
        }
        if same_lobes && !any_negligible && !(f.is_black() && f_twin.is_black()) {
            self.pdf.compare(case, Value::Pdf, Rgb::grey(pdf.into()), Rgb::grey(pdf_twin));
        }
    }
}
