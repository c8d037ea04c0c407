//! What each technique is worth: the renderer without it against the whole one, in the same run.
//!
//! Variants take turns at every level and seed, beginning with another one each time. A variant's time is divided by that of the whole
//! renderer in the same round, so that what disturbs the machine for longer than a round disturbs both.

mod chart;
mod table;
mod variant;

use std::sync::Arc;

pub use chart::ablation_chart;
pub use table::{ablation_csv, ablation_table};
use variant::Variant;

use super::summary::{mean, median};
use super::{BenchError, Plan, Subject, Watch, error, timed};
use crate::accel::Kernel;
use crate::raster::Raster;
use crate::render::Geometry;

/// What a scene's variants came to.
#[derive(Clone, Debug)]
pub struct Ablation {
    /// The job's name.
    pub name: String,
    /// A row for each variant.
    pub rows: Vec<Row>,
}

/// A variant against the whole renderer. Ratios are geometric means over the levels.
#[derive(Clone, Debug)]
pub struct Row {
    /// What is left out, or changed.
    pub name: String,
    /// What happens instead.
    pub what: &'static str,
    /// Its mean error over the whole renderer's.
    pub error: f64,
    /// The median of its wall-clock times over the whole renderer's.
    pub time: f64,
    /// Whether all its pictures had the same bits.
    pub same_bits: bool,
    /// Whether they should: what is left out saves work alone.
    pub must_be_same: bool,
}

impl Row {
    /// Its work over the whole renderer's, work being error times seconds: above 1 the technique is worth having.
    pub fn work(&self) -> f64 {
        self.error * self.time
    }

    /// The technique should not change a bit, and does.
    pub fn is_wrong(&self) -> bool {
        self.must_be_same && !self.same_bits
    }
}

/// How many renders [`ablate`] makes, the reference counted.
pub fn renders(subject: &Subject<'_>, plan: &Plan) -> usize {
    Variant::all(&subject.job.settings).len() * plan.levels.len() * plan.seeds as usize + 1
}

/// Measures what each technique is worth for a job. `watch` is told of each render before it begins.
///
/// # Errors
/// If the job can't be rendered, or the reference not kept.
pub fn ablate(subject: &Subject<'_>, plan: &Plan, watch: &mut Watch<'_>) -> Result<Ablation, BenchError> {
    let reference = subject.reference(plan, watch)?;
    let portable = (*subject.loaded.geometry).clone().with_kernel(Kernel::PORTABLE);
    let contest = Contest { subject, reference, portable: Arc::new(portable) };
    let variants = Variant::all(&subject.job.settings);
    let mut rounds = Vec::new();
    for seed in subject.seeds(plan) {
        for &samples in &plan.levels {
            rounds.push(contest.round(&variants, samples, seed, rounds.len(), watch)?);
        }
    }
    let variants = variants.iter().enumerate().skip(1);
    let rows = variants.map(|(place, variant)| row(variant, place, &rounds, &plan.levels)).collect();
    Ok(Ablation { name: subject.job.name.clone(), rows })
}

/// What all renders have in common.
struct Contest<'a> {
    subject: &'a Subject<'a>,
    reference: Raster,
    /// The scene's geometry, traced without the processor's own instructions.
    portable: Arc<Geometry>,
}

/// One render of each variant, in their order: the first is the whole renderer.
struct Round {
    samples: u32,
    turns: Vec<Turn>,
}

struct Turn {
    seconds: f64,
    error: f64,
    bits: blake3::Hash,
    /// Samples of all pixels.
    paths: u64,
}

impl Contest<'_> {
    fn round(
        &self,
        variants: &[Variant],
        samples: u32,
        seed: u64,
        shift: usize,
        watch: &mut Watch<'_>,
    ) -> Result<Round, BenchError> {
        let first = shift % variants.len();
        let order = variants[first..].iter().chain(&variants[..first]);
        let mut turns =
            order.map(|variant| self.turn(variant, samples, seed, watch)).collect::<Result<Vec<_>, _>>()?;
        turns.rotate_right(first);
        Ok(Round { samples, turns })
    }

    fn turn(
        &self,
        variant: &Variant,
        samples: u32,
        seed: u64,
        watch: &mut Watch<'_>,
    ) -> Result<Turn, BenchError> {
        let mut planned = self.subject.planned(samples, seed)?;
        variant.change(&mut planned.settings);
        let own = &self.subject.loaded.geometry;
        let geometry = if variant.is_portable() { &self.portable } else { own };
        let scene = self.subject.prepared(planned, geometry)?.with(variant.techniques());
        let what = format!("{}: {}, {samples} samples", self.subject.job.name, variant.name());
        let (rendered, seconds) = timed(&scene, &what, watch);
        let error = error::deviation(rendered.raster.picture(), self.reference.picture()).error;
        Ok(Turn { seconds, error, bits: bits(&rendered.raster), paths: rendered.counts.paths })
    }
}

/// A hash of every value's bits.
fn bits(raster: &Raster) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for channel in raster.layers.iter().flat_map(|layer| &layer.channels) {
        hasher.update(channel.name.as_bytes());
        for value in &channel.values {
            hasher.update(&value.to_bits().to_le_bytes());
        }
    }
    hasher.finalize()
}

fn row(variant: &Variant, place: usize, rounds: &[Round], levels: &[u32]) -> Row {
    let pairs = || rounds.iter().map(|round| (round.samples, &round.turns[0], &round.turns[place]));
    let at = |level: u32| pairs().filter(move |(samples, ..)| *samples == level);
    let error_at = |level: u32| {
        let (whole, own) = (mean(at(level).map(|(_, w, _)| w.error)), mean(at(level).map(|(.., t)| t.error)));
        own.max(f64::MIN_POSITIVE) / whole.max(f64::MIN_POSITIVE)
    };
    let time_at = |level: u32| {
        let ratio = |(_, whole, own): (u32, &Turn, &Turn)| own.seconds.max(1e-9) / whole.seconds.max(1e-9);
        median(at(level).map(ratio).collect())
    };
    let over_levels =
        |ratio: &dyn Fn(u32) -> f64| libm::exp(mean(levels.iter().map(|&level| libm::log(ratio(level)))));
    Row {
        error: over_levels(&error_at),
        time: over_levels(&time_at),
        same_bits: pairs().all(|(_, whole, own)| whole.bits == own.bits),
        must_be_same: variant.must_be_same(pairs().all(|(_, whole, own)| whole.paths == own.paths)),
        name: variant.name().to_owned(),
        what: variant.what(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::RenderSettings;

    fn turn(seconds: f64, error: f64, bits: &[u8]) -> Turn {
        Turn { seconds, error, bits: blake3::hash(bits), paths: 1 }
    }

    /// Two levels, three rounds each: a variant of twice the error at both, half the time at one and a quarter at the other.
    fn rounds(bits: &[u8]) -> Vec<Round> {
        let round = |samples, pace: f64, time: f64, error: f64| Round {
            samples,
            turns: vec![turn(pace, error, b"a"), turn(pace * time, 2.0 * error, bits)],
        };
        vec![
            round(4, 1.0, 0.5, 0.4),
            round(16, 4.0, 0.25, 0.1),
            round(4, 3.0, 0.5, 0.3),
            round(16, 12.0, 0.25, 0.2),
            // Something disturbed the variant.
            round(4, 1.0, 9.0, 0.5),
            round(16, 4.0, 0.25, 0.1),
        ]
    }

    #[test]
    fn ratios_are_of_one_round_and_means_over_the_levels() {
        let variants = Variant::all(&RenderSettings::default());
        let found = row(&variants[1], 1, &rounds(b"a"), &[4, 16]);
        assert!((found.error - 2.0).abs() < 1e-12, "{}", found.error);
        assert!((found.time - 0.125f64.sqrt()).abs() < 1e-12, "{}", found.time);
        assert_eq!(found.work(), found.error * found.time);
    }

    #[test]
    fn savings_that_change_a_bit_are_wrong_and_other_techniques_are_not() {
        let variants = Variant::all(&RenderSettings::default());
        for variant in &variants {
            assert!(!row(variant, 1, &rounds(b"a"), &[4, 16]).is_wrong(), "{}", variant.name());
        }
        let wrong = variants.iter().filter(|variant| row(variant, 1, &rounds(b"b"), &[4, 16]).is_wrong());
        let names: Vec<&str> = wrong.map(Variant::name).filter(|&name| name != "no avx2").collect();
        assert_eq!(names, ["whole", "whole, again", "no constants", "no coverage", "useless light"]);
        // But where other rays made another plan of samples.
        let mut otherwise = rounds(b"b");
        otherwise.iter_mut().for_each(|round| round.turns[1].paths += 1);
        let wrong = variants.iter().filter(|variant| row(variant, 1, &otherwise, &[4, 16]).is_wrong());
        assert!(wrong.map(Variant::name).all(|name| name != "useless light"));
    }
}
