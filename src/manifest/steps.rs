//! The numbers of axes that are computed: ranges, random values, Sobol' points.

use std::collections::HashSet;

use super::model::{Distribution, Interval, Random, Sequence};
use crate::math::Real;
use crate::math::hash::{combine, mix64};

/// Digits of a range's values: enough for any step, few enough that 0.1 + 0.2 is 0.3.
const RANGE_DIGITS: usize = 12;
/// Digits of values that no one types.
const DRAWN_DIGITS: usize = 6;

/// Why steps make no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Senseless(pub &'static str);

/// `steps` values with equal differences; the ends are exact.
pub(super) fn range(interval: Interval) -> Result<Vec<f64>, Senseless> {
    let Interval { from, to, .. } = interval;
    // A value next to nothing beside the ends is what rounding left of 0.
    let nothing = 1e-14 * from.abs().max(to.abs());
    spaced(interval, |t| {
        let value = from * (1.0 - t) + to * t;
        if value.abs() <= nothing { 0.0 } else { round_to(value, RANGE_DIGITS) }
    })
}

/// `steps` values with equal ratios; the ends are exact.
pub(super) fn log_range(interval: Interval) -> Result<Vec<f64>, Senseless> {
    let Interval { from, to, .. } = interval;
    if !(from > 0.0 && to > 0.0) {
        return Err(Senseless("both ends of a `log_range` must be above 0"));
    }
    let (low, high) = (Real::ln(from), Real::ln(to));
    spaced(interval, |t| round_to(Real::exp(low * (1.0 - t) + high * t), DRAWN_DIGITS))
}

fn spaced(interval: Interval, value: impl Fn(f64) -> f64) -> Result<Vec<f64>, Senseless> {
    let Interval { from, to, steps } = interval;
    match steps {
        0 => return Err(Senseless("`steps` must be at least 1")),
        1 if from != to => {
            return Err(Senseless("one step cannot reach from `from` to `to`: they must be the same"));
        }
        1 => return Ok(vec![from]),
        _ if from == to => {
            return Err(Senseless("several steps from a number to itself would be the same job"));
        }
        _ => {}
    }
    let last = steps - 1;
    let values = (0..steps).map(|i| match i {
        0 => from,
        i if i == last => to,
        i => value(i as f64 / last as f64),
    });
    finite(values.collect())
}

/// `count` points of van der Corput's sequence in base 2, the first dimension of Sobol's.
pub(super) fn sobol(sequence: Sequence) -> Result<Vec<f64>, Senseless> {
    let Sequence { count, from, to } = sequence;
    check_ends(from, to)?;
    let point = |i: u64| i.reverse_bits() as f64 * (0.5 / (1u64 << 63) as f64);
    finite((0..count).map(|i| round_to(from * (1.0 - point(i)) + to * point(i), DRAWN_DIGITS)).collect())
}

/// `count` random values. Each is a function of the seed and its index alone.
pub(super) fn random(random: Random) -> Result<Vec<f64>, Senseless> {
    let draw: Box<dyn Fn(u64) -> Result<f64, Senseless>> = match random.distribution {
        Distribution::Uniform | Distribution::LogUniform => {
            if random.mean.is_some() || random.sd.is_some() {
                return Err(Senseless("`mean` and `sd` belong to `distribution = \"normal\"`"));
            }
            let (Some(from), Some(to)) = (random.from, random.to) else {
                return Err(Senseless("this distribution needs `from` and `to`"));
            };
            check_ends(from, to)?;
            if random.distribution == Distribution::Uniform {
                Box::new(move |i| {
                    let t = unit(random.seed, i, 0);
                    Ok(from * (1.0 - t) + to * t)
                })
            } else {
                if !(from > 0.0 && to > 0.0) {
                    return Err(Senseless("both ends of a log-uniform distribution must be above 0"));
                }
                let (low, high) = (Real::ln(from), Real::ln(to));
                Box::new(move |i| {
                    let t = unit(random.seed, i, 0);
                    Ok(Real::exp(low * (1.0 - t) + high * t))
                })
            }
        }
        Distribution::Normal => {
            let (Some(mean), Some(sd)) = (random.mean, random.sd) else {
                return Err(Senseless("a normal distribution needs `mean` and `sd`"));
            };
            if sd.is_nan() || sd <= 0.0 {
                return Err(Senseless("`sd` must be above 0"));
            }
            let low = random.from.unwrap_or(f64::NEG_INFINITY);
            let high = random.to.unwrap_or(f64::INFINITY);
            if low >= high {
                return Err(Senseless("`from` must be below `to`"));
            }
            Box::new(move |i| normal_within(random.seed, i, mean, sd, low..=high))
        }
    };
    let values: Vec<f64> = (0..random.count).map(draw).collect::<Result<_, _>>()?;
    finite(told_apart(&values))
}

/// The values, rounded; of those that are the same then, the later ones less.
fn told_apart(values: &[f64]) -> Vec<f64> {
    const MOST_DIGITS: usize = 17;
    let mut seen = HashSet::new();
    let rounded = |value: &f64| {
        let mut finer = (DRAWN_DIGITS..=MOST_DIGITS).map(|digits| round_to(*value, digits));
        finer.find(|v| seen.insert(v.to_bits())).unwrap_or(*value)
    };
    values.iter().map(rounded).collect()
}

/// A normal variate inside `within`, by rejection (Box and Muller 1958).
fn normal_within(
    seed: u64,
    index: u64,
    mean: f64,
    sd: f64,
    within: std::ops::RangeInclusive<f64>,
) -> Result<f64, Senseless> {
    const TRIES: u64 = 1000;
    (0..TRIES)
        .map(|attempt| {
            // 1 - u is in (0, 1]: its logarithm is finite.
            let radius = (-2.0 * Real::ln(1.0 - unit(seed, index, 2 * attempt))).sqrt();
            let angle = 2.0 * std::f64::consts::PI * unit(seed, index, 2 * attempt + 1);
            mean + sd * radius * Real::cos(angle)
        })
        .find(|v| within.contains(v))
        .ok_or(Senseless("`from` and `to` leave next to nothing of this normal distribution"))
}

/// A number in [0, 1) from seed, index and dimension.
fn unit(seed: u64, index: u64, dimension: u64) -> f64 {
    let bits = mix64(combine(combine(seed, index), dimension));
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

fn check_ends(from: f64, to: f64) -> Result<(), Senseless> {
    if from < to { Ok(()) } else { Err(Senseless("`from` must be below `to`")) }
}

fn finite(values: Vec<f64>) -> Result<Vec<f64>, Senseless> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(values)
    } else {
        Err(Senseless("the ends are too large: a value between them is not finite"))
    }
}

/// The number nearest to `value` with so many significant decimal digits.
fn round_to(value: f64, digits: usize) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eleven_steps_from_0_to_1_print_as_tenths() {
        let values = range(Interval { from: 0.0, to: 1.0, steps: 11 }).unwrap();
        let printed: Vec<String> = values.iter().map(f64::to_string).collect();
        assert_eq!(printed, ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1"]);
        let down = range(Interval { from: 1.0, to: -0.1, steps: 12 }).unwrap();
        assert_eq!((down[0], down[10], down[11]), (1.0, 0.0, -0.1));
    }

    #[test]
    fn ends_are_exact_and_ratios_equal() {
        assert_eq!(log_range(Interval { from: 0.001, to: 1.0, steps: 4 }).unwrap(), [0.001, 0.01, 0.1, 1.0]);
        let third = 1.0 / 3.0;
        assert_eq!(range(Interval { from: third, to: third, steps: 1 }).unwrap(), [third]);
        assert!(log_range(Interval { from: 0.0, to: 1.0, steps: 4 }).is_err());
    }

    #[test]
    fn senseless_steps_are_refused() {
        for (from, to, steps) in [(0.0, 1.0, 0), (0.0, 1.0, 1), (0.5, 0.5, 2), (f64::NAN, 1.0, 3)] {
            assert!(range(Interval { from, to, steps }).is_err(), "{from} {to} {steps}");
        }
        assert!(range(Interval { from: -1.7e308, to: 1.7e308, steps: 3 }).is_ok());
    }

    #[test]
    fn sobol_points_halve_the_gaps() {
        let points = sobol(Sequence { count: 8, from: 0.0, to: 1.0 }).unwrap();
        assert_eq!(points, [0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875]);
        assert!(sobol(Sequence { count: 8, from: 1.0, to: 0.0 }).is_err());
    }

    fn drawn(distribution: Distribution, count: u64) -> Vec<f64> {
        let normal = distribution == Distribution::Normal;
        random(Random {
            seed: 7,
            count,
            distribution,
            from: Some(0.1),
            to: Some(0.9),
            mean: normal.then_some(0.4),
            sd: normal.then_some(0.2),
        })
        .unwrap()
    }

    #[test]
    fn random_values_stay_inside_and_repeat() {
        for distribution in [Distribution::Uniform, Distribution::LogUniform, Distribution::Normal] {
            let many = drawn(distribution, 1000);
            assert!(many.iter().all(|v| (0.1..=0.9).contains(v)));
            let more = drawn(distribution, 5000);
            assert_eq!(many, more[..1000], "a larger count keeps the first values");
            let bits: HashSet<u64> = more.iter().map(|v| v.to_bits()).collect();
            assert_eq!(bits.len(), 5000, "or two jobs would have one name");
        }
    }

    #[test]
    fn random_means_are_those_of_the_distributions() {
        let mean = |d| drawn(d, 4000).iter().sum::<f64>() / 4000.0;
        assert!((mean(Distribution::Uniform) - 0.5).abs() < 0.02);
        // (0.9 - 0.1)/ln 9
        assert!((mean(Distribution::LogUniform) - 0.364_1).abs() < 0.02);
        // Cut at -1.5 and 2.5 deviations: 0.4 + 0.2·(φ(-1.5) - φ(2.5))/(Φ(2.5) - Φ(-1.5)).
        assert!((mean(Distribution::Normal) - 0.424_2).abs() < 0.02);
    }

    #[test]
    fn an_impossible_cut_of_a_normal_distribution_ends() {
        let far = Random {
            seed: 1,
            count: 5,
            distribution: Distribution::Normal,
            from: Some(100.0),
            to: Some(101.0),
            mean: Some(0.0),
            sd: Some(1.0),
        };
        assert!(random(far).is_err());
        assert!(random(Random { sd: None, ..far }).is_err());
        assert!(random(Random { distribution: Distribution::Uniform, ..far }).is_err(), "mean is for normal");
    }
}
