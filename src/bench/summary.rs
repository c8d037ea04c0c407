//! What a scene's runs come to.

use serde::Serialize;

use super::{Bench, Run};

/// The error that times are given to.
const GOAL: f64 = 0.01;

/// A value with its interval of 95% confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// Half the interval's width; infinite for a single seed.
    pub half_width: f64,
}

/// A scene in a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The exponent of error against time: -1 where noise falls as the square root of the samples. None for a single level.
    pub slope: Option<f64>,
    /// Error times seconds, the geometric mean over the levels: what a picture of error 1 would take, if the slope were -1.
    pub work: f64,
    /// The picture's mean over the reference's, less 1, at the highest level.
    pub bias: Interval,
    /// Seconds to an error of 0.01, by the line through the levels; by the work where there is one level.
    pub seconds_to_goal: f64,
    /// The part of the error at the highest level that is the brightest 0.1%'s.
    pub tail: f64,
}

/// A level: its mean error and its median time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    pub(super) samples: u32,
    pub(super) error: f64,
    pub(super) seconds: f64,
}

/// The levels of a scene, fewest samples first.
pub(super) fn levels(bench: &Bench) -> Vec<Level> {
    let of = |runs: &[Run]| {
        let errors = runs.iter().map(|run| run.deviation.error);
        let seconds = median(runs.iter().map(|run| run.seconds).collect());
        Level { samples: runs[0].samples, error: mean(errors), seconds }
    };
    bench.runs.chunk_by(|a, b| a.samples == b.samples).map(of).collect()
}

/// The summary of a scene's runs, of which there is at least one.
pub fn summarize(bench: &Bench) -> Summary {
    let levels = levels(bench);
    let work =
        libm::exp(mean(levels.iter().map(|l| libm::log((l.error * l.seconds).max(f64::MIN_POSITIVE)))));
    let line = line(&levels);
    let highest = levels.last().map_or(0, |level| level.samples);
    let runs: Vec<&Run> = bench.runs.iter().filter(|run| run.samples == highest).collect();
    let without_tail = mean(runs.iter().map(|run| run.deviation.without_tail));
    let error = mean(runs.iter().map(|run| run.deviation.error));
    Summary {
        slope: line.map(|(slope, _)| slope),
        work,
        bias: bias(&runs, bench.reference),
        seconds_to_goal: match line {
            Some((slope, at_one)) if slope < 0.0 => libm::exp((libm::log(GOAL) - at_one) / slope),
            _ => work / GOAL,
        },
        tail: if error > 0.0 { (1.0 - without_tail / error).max(0.0) } else { 0.0 },
    }
}

/// The least squares line of the error's logarithm over the time's: its slope, and its value at one second.
fn line(levels: &[Level]) -> Option<(f64, f64)> {
    let points: Vec<(f64, f64)> =
        levels.iter().filter(|l| l.error > 0.0).map(|l| (libm::log(l.seconds), libm::log(l.error))).collect();
    let (x, y) = (mean(points.iter().map(|p| p.0)), mean(points.iter().map(|p| p.1)));
    let spread: f64 = points.iter().map(|p| (p.0 - x) * (p.0 - x)).sum();
    let together: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (points.len() > 1 && spread > 0.0).then(|| (together / spread, y - together / spread * x))
}

/// The mean bias of the seeds. The reference is a random number as well: with the seeds' variance s² of n samples, its own is
/// s²·n/reference.
fn bias(runs: &[&Run], reference: u32) -> Interval {
    let values = || runs.iter().map(|run| run.deviation.bias);
    let (value, n) = (mean(values()), runs.len() as f64);
    if runs.len() < 2 {
        return Interval { value, half_width: f64::INFINITY };
    }
    let variance = values().map(|v| (v - value) * (v - value)).sum::<f64>() / (n - 1.0);
    let of_reference = variance * f64::from(runs[0].samples) / f64::from(reference);
    let half_width = student_95(runs.len() - 1) * (variance / n + of_reference).sqrt();
    Interval { value, half_width }
}

/// The two-sided 95% quantile of Student's distribution.
fn student_95(degrees: usize) -> f64 {
    const FIRST: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    // Cornish and Fisher's expansion about the normal quantile z: z + (z³ + z)/4n + (5z⁵ + 16z³ + 3z)/96n², within 0.2% from 11 on.
    const Z: f64 = 1.959_964;
    const FIRST_ORDER: f64 = (Z * Z * Z + Z) / 4.0;
    const SECOND_ORDER: f64 = (5.0 * Z * Z * Z * Z * Z + 16.0 * Z * Z * Z + 3.0 * Z) / 96.0;
    let n = degrees as f64;
    FIRST.get(degrees - 1).copied().unwrap_or_else(|| Z + FIRST_ORDER / n + SECOND_ORDER / (n * n))
}

pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The middle of values, of which there is at least one.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Deviation;

    fn bench(runs: &[(u32, f64, f64, f64)]) -> Bench {
        let run = |(i, &(samples, seconds, error, bias)): (usize, &(u32, f64, f64, f64))| Run {
            samples,
            seed: i as u64,
            seconds,
            rays: 1,
            deviation: Deviation { error, without_tail: 0.5 * error, bias },
        };
        let runs = runs.iter().enumerate().map(run).collect();
        Bench { name: "x".into(), size: [1, 1], reference: 6400, runs }
    }

    #[test]
    fn noise_that_falls_as_the_square_root_has_slope_minus_one_and_constant_work() {
        let summary =
            summarize(&bench(&[(4, 0.1, 0.5, 0.0), (16, 0.4, 0.125, 0.0), (64, 1.6, 0.03125, 0.0)]));
        assert!((summary.slope.unwrap() + 1.0).abs() < 1e-9);
        assert!((summary.work - 0.05).abs() < 1e-9);
        assert!((summary.seconds_to_goal - 5.0).abs() < 1e-9);
        assert_eq!(summary.tail, 0.5);
    }

    #[test]
    fn the_biass_interval_holds_the_references_noise_too() {
        let summary = summarize(&bench(&[(64, 1.0, 0.1, 0.01), (64, 3.0, 0.1, 0.03), (64, 2.0, 0.1, 0.02)]));
        assert!((summary.bias.value - 0.02).abs() < 1e-12);
        let variance = 1e-4;
        let expected = 4.303 * (variance / 3.0 + variance * 0.01_f64).sqrt();
        assert!((summary.bias.half_width - expected).abs() < 1e-9);
        assert!(summary.slope.is_none());
        assert!((summary.seconds_to_goal - 20.0).abs() < 1e-9, "the median time is 2");
        assert!(summarize(&bench(&[(4, 1.0, 0.1, 0.0)])).bias.half_width.is_infinite());
    }

    #[test]
    fn quantiles_meet_the_tables() {
        for (degrees, tabulated) in [(1, 12.706), (10, 2.228), (11, 2.201), (30, 2.042), (1000, 1.962)] {
            assert!((student_95(degrees) / tabulated - 1.0).abs() < 2e-3, "{degrees}");
        }
    }
}
