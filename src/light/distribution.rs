//! Discrete distributions, sampled by inversion: neighbouring random numbers stay neighbours, so that low-discrepancy points keep
//! their spread.

/// A choice among n things with given weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Cumulative probabilities, `cumulative[i]` before thing i, the last one 1. Empty if no weight is positive.
    cumulative: Vec<f32>,
}

/// Random numbers in [0, 1) are multiples of one part in this.
const GRID: f64 = (1u32 << 24) as f64;

impl Distribution {
    /// A distribution in proportion to `weights`, which must not be negative; NaN counts as 0.
    ///
    /// Probabilities are multiples of 2⁻²⁴, as the random numbers are: then a thing comes exactly as often as
    /// [`Self::probability`] says, however rare.
    pub fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().copied().filter(|w| *w > 0.0).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Self { cumulative: Vec::new() };
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
        Self { cumulative }
    }

    /// The thing that `u` in [0, 1) falls on, and its probability. None if there is nothing to choose.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(usize, f32)> {
        let (index, _) = self.sample_with_rest(u)?;
        Some((index, self.probability(index)))
    }

    /// The thing that `u` falls on, and where between its ends, in [0, 1).
    #[inline]
    pub fn sample_with_rest(&self, u: f32) -> Option<(usize, f32)> {
        if self.cumulative.is_empty() {
            return None;
        }
        // The last entry at or below u begins the interval; impossible things have empty ones.
        let index = self.cumulative.partition_point(|&c| c <= u) - 1;
        let index = index.min(self.cumulative.len() - 2);
        let (low, high) = (self.cumulative[index], self.cumulative[index + 1]);
        let rest = if high > low { ((u - low) / (high - low)).min(1.0 - f32::EPSILON / 2.0) } else { 0.0 };
        Some((index, rest))
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
    fn no_weight_means_nothing_to_choose() {
        assert_eq!(Distribution::new(&[]).sample(0.3), None);
        assert_eq!(Distribution::new(&[0.0, f64::NAN]).sample(0.3), None);
    }
}
