//! Discrete distributions, sampled by inversion: neighbouring random numbers stay neighbours, so that low-discrepancy points keep
//! their spread.

/// A choice among n things with given weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Cumulative probabilities, `cumulative[i]` before thing i, the last one 1. Empty if no weight is positive.
    cumulative: Vec<f32>,
    /// For each of equal parts of [0, 1), a power of two of them, how many of `cumulative` are at or below its beginning; and their
    /// number. So a search has but a few things to look through.
    guide: Vec<u32>,
}

/// Things for each part of the guide, on average; as many at least have none.
const PER_PART: usize = 4;

/// Random numbers in [0, 1) are multiples of one part in this.
const GRID: f64 = (1u32 << 24) as f64;

impl Distribution {
    /// The difference of neighbouring random numbers.
    pub const STEP: f32 = (1.0 / GRID) as f32;

    /// There is nothing to choose.
    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// A distribution in proportion to `weights`, which must not be negative; NaN counts as 0.
    ///
    /// Probabilities are multiples of 2⁻²⁴, as the random numbers are: then a thing comes exactly as often as
    /// [`Self::probability`] says, however rare.
    pub fn new(weights: &[f64]) -> Self {
        let cumulative = cumulative(weights).unwrap_or_default();
        let guide = if cumulative.is_empty() { Vec::new() } else { guide(&cumulative) };
        Self { cumulative, guide }
    }

    /// The thing that `u` in [0, 1) falls on, and its probability. None if there is nothing to choose.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(usize, f32)> {
        let (index, probability, _) = self.sample_with_rest(u)?;
        Some((index, probability))
    }

    /// The thing that `u` falls on, its probability, and where between its ends `u` lies, in [0, 1).
    #[inline]
    pub fn sample_with_rest(&self, u: f32) -> Option<(usize, f32, f32)> {
        if self.cumulative.is_empty() {
            return None;
        }
        // The last entry at or below u begins the interval; impossible things have empty ones.
        let parts = self.guide.len().saturating_sub(1);
        let (from, to) = match self.guide.get((u * parts as f32) as usize..) {
            Some(&[from, to, ..]) => (from as usize, to as usize),
            _ => (0, self.cumulative.len()),
        };
        let index = from + self.cumulative[from..to].partition_point(|&c| c <= u) - 1;
        let index = index.min(self.cumulative.len() - 2);
        let (probability, rest) = between(self.cumulative[index], self.cumulative[index + 1], u);
        Some((index, probability, rest))
    }

    /// The probability of a thing; it is exactly that of [`Self::sample`].
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        match self.cumulative.get(index + 1) {
            Some(high) => high - self.cumulative[index],
            None => 0.0,
        }
    }
}

/// Cumulative probabilities in proportion to `weights`, one more than these; none if no weight is positive.
pub(super) fn cumulative(weights: &[f64]) -> Option<Vec<f32>> {
    let total: f64 = weights.iter().copied().filter(|w| *w > 0.0).sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut sum = 0.0;
    let mut cumulative = Vec::with_capacity(weights.len() + 1);
    cumulative.push(0.0);
    for w in weights {
        sum += w.max(0.0);
        cumulative.push(((sum / total * GRID).round() / GRID) as f32);
    }
    // Rounding must not leave a gap below 1: things after the last positive weight stay impossible.
    let last = cumulative[weights.len()];
    for c in cumulative.iter_mut().rev().take_while(|c| **c == last) {
        *c = 1.0;
    }
    Some(cumulative)
}

/// The probability of what begins and ends at such cumulative ones, and where between them `u` lies, in [0, 1).
#[inline]
pub(super) fn between(low: f32, high: f32, u: f32) -> (f32, f32) {
    let rest = if high > low { ((u - low) / (high - low)).min(1.0 - f32::EPSILON / 2.0) } else { 0.0 };
    (high - low, rest)
}

fn guide(cumulative: &[f32]) -> Vec<u32> {
    let parts = (cumulative.len() / PER_PART).next_power_of_two();
    if parts < PER_PART {
        return Vec::new();
    }
    let mut below = 0;
    (0..=parts)
        .map(|part| {
            let begin = part as f32 / parts as f32;
            below += cumulative[below..].iter().take_while(|&&c| c <= begin).count();
            below as u32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_come_as_often_as_they_weigh() {
        let d = Distribution::new(&[1.0, 0.0, 2.0, 5.0, 0.0]);
        let mut counts = [0; 5];
        for i in 0..800 {
            counts[d.sample((i as f32 + 0.5) / 800.0).unwrap().0] += 1;
        }
        assert_eq!(counts, [100, 0, 200, 500, 0]);
        assert_eq!(d.sample(0.999_999_94).unwrap().0, 3);
        assert_eq!(d.sample(0.0).unwrap().0, 0);
    }

    #[test]
    fn probabilities_sum_to_one() {
        let weights: Vec<f64> = (0..1000).map(|i| f64::from(i % 7)).collect();
        let d = Distribution::new(&weights);
        let sum: f64 = (0..1000).map(|i| f64::from(d.probability(i))).sum();
        assert!((sum - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_guide_leads_to_what_a_search_of_all_finds() {
        for n in [1, 15, 16, 17, 100, 1000, 1024] {
            let weights: Vec<f64> = (0..n).map(|i| f64::from(i * i % 23 % 5) * 0.7).collect();
            let d = Distribution::new(&[&weights[..], &[1.0]].concat());
            for i in 0..10_000 {
                let u = i as f32 / 10_000.0;
                let expected = d.cumulative.iter().position(|&c| c > u).expect("the end") - 1;
                assert_eq!(d.sample(u).map(|(index, _)| index), Some(expected), "{n} {u}");
            }
        }
    }

    #[test]
    fn no_weight_means_nothing_to_choose() {
        assert_eq!(Distribution::new(&[]).sample(0.3), None);
        assert_eq!(Distribution::new(&[0.0, f64::NAN]).sample(0.3), None);
    }
}
