//! Pixel filters, sampled by importance: every sample weighs the same and belongs to one pixel.

use crate::math::Real;
use crate::settings::Filter;

/// A separable filter as the inverse of its cumulative distribution along one axis.
#[derive(Clone, Debug)]
pub(super) enum FilterSampler {
    Box {
        radius: f32,
    },
    Tent {
        radius: f32,
    },
    /// Offsets at equal steps of the cumulative distribution.
    Tabulated(Vec<f32>),
    Point,
}

/// Steps of a tabulated filter: its variance is kept to one part in a thousand, tails included.
const STEPS: usize = 4096;

impl FilterSampler {
    /// `radius` is in pixels; each filter has its own default.
    pub(super) fn new(filter: Filter, radius: Option<f32>) -> Self {
        match filter {
            Filter::Box => Self::Box { radius: radius.unwrap_or(0.5) },
            Filter::Tent => Self::Tent { radius: radius.unwrap_or(1.0) },
            Filter::Point => Self::Point,
            Filter::BlackmanHarris => {
                let radius = f64::from(radius.unwrap_or(0.75));
                Self::Tabulated(invert(&blackman_harris).iter().map(|x| (x * radius) as f32).collect())
            }
        }
    }

    /// The offset from the pixel's centre, in pixels.
    #[inline]
    pub(super) fn offset(&self, u: f32) -> f32 {
        match self {
            Self::Box { radius } => (2.0 * u - 1.0) * radius,
            Self::Point => 0.0,
            Self::Tent { radius } => {
                let x = if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() };
                x * radius
            }
            Self::Tabulated(table) => {
                let position = u * STEPS as f32;
                let i = (position as usize).min(STEPS - 1);
                let t = position - i as f32;
                table[i] * (1.0 - t) + table[i + 1] * t
            }
        }
    }
}

impl FilterSampler {
    /// How far from the pixel's centre offsets reach, in pixels.
    pub(super) fn radius(&self) -> f32 {
        match self {
            Self::Box { radius } | Self::Tent { radius } => *radius,
            Self::Tabulated(table) => table[STEPS],
            Self::Point => 0.0,
        }
    }

    /// The density of [`Self::offset`] per pixel; 0 for [`Self::Point`], which has none.
    pub(super) fn density(&self, offset: f32) -> f32 {
        match self {
            // Half open, so that a position between two pixels belongs to one.
            Self::Box { radius } if -radius <= offset && offset < *radius => 0.5 / radius,
            Self::Tent { radius } => ((radius - offset.abs()) / (radius * radius)).max(0.0),
            Self::Tabulated(table) => {
                let after = table.partition_point(|&x| x <= offset);
                if after == 0 || after > STEPS {
                    return 0.0;
                }
                1.0 / (STEPS as f32 * (table[after] - table[after - 1]))
            }
            Self::Box { .. } | Self::Point => 0.0,
        }
    }
}

/// The four-term Blackman-Harris window over [-1, 1] (Harris 1978).
fn blackman_harris(x: f64) -> f64 {
    let phase = std::f64::consts::PI * (x + 1.0);
    0.35875 - 0.48829 * Real::cos(phase) + 0.14128 * Real::cos(2.0 * phase) - 0.01168 * Real::cos(3.0 * phase)
}

/// Where the integral of `density` over [-1, 1] reaches 0, 1/STEPS, …, 1 of its total.
fn invert(density: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let fine = 16 * STEPS;
    let width = 2.0 / fine as f64;
    let mut cumulative = vec![0.0; fine + 1];
    for i in 0..fine {
        cumulative[i + 1] = cumulative[i] + density(-1.0 + (i as f64 + 0.5) * width).max(0.0) * width;
    }
    let total = cumulative[fine];
    (0..=STEPS)
        .map(|step| {
            let wanted = total * step as f64 / STEPS as f64;
            let i = cumulative.partition_point(|&c| c < wanted).clamp(1, fine) - 1;
            let inside = cumulative[i + 1] - cumulative[i];
            let t = if inside > 0.0 { (wanted - cumulative[i]) / inside } else { 0.0 };
            -1.0 + (i as f64 + t) * width
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_is_the_slope_of_the_cumulative_distribution() {
        for filter in [Filter::Box, Filter::Tent, Filter::BlackmanHarris] {
            let sampler = FilterSampler::new(filter, None);
            for u in [0.05f32, 0.2, 0.5, 0.83] {
                let step = 1e-3;
                let expected = 2.0 * step / (sampler.offset(u + step) - sampler.offset(u - step));
                let density = sampler.density(sampler.offset(u));
                assert!((density / expected - 1.0).abs() < 0.02, "{filter:?} {u}: {density} {expected}");
            }
            assert_eq!(sampler.density(sampler.radius() * 1.01), 0.0);
            assert_eq!(sampler.density(-sampler.radius() * 1.01), 0.0);
        }
    }

    /// Mean and variance of the offsets against the filter's own moments by quadrature.
    #[test]
    fn offsets_have_the_filter_s_moments() {
        let tent = |x: f64| 1.0 - x.abs();
        assert_eq!(FilterSampler::new(Filter::Point, None).offset(0.9), 0.0);
        for (filter, radius) in [(Filter::Box, 0.5), (Filter::Tent, 1.0), (Filter::BlackmanHarris, 0.75)] {
            let kernel: &dyn Fn(f64) -> f64 = match filter {
                Filter::Box | Filter::Point => &|_| 1.0,
                Filter::Tent => &tent,
                Filter::BlackmanHarris => &blackman_harris,
            };
            let n = 20_000;
            let (mut mass, mut second) = (0.0, 0.0);
            for i in 0..n {
                let x = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n);
                mass += kernel(x);
                second += kernel(x) * (x * radius) * (x * radius);
            }
            let sampler = FilterSampler::new(filter, None);
            let (mut mean, mut variance) = (0.0, 0.0);
            for i in 0..n {
                let x = f64::from(sampler.offset((i as f32 + 0.5) / n as f32));
                mean += x / f64::from(n);
                variance += x * x / f64::from(n);
            }
            assert!(mean.abs() < 1e-4, "{filter:?}");
            assert!((variance - second / mass).abs() < 1e-3 * variance, "{filter:?}: {variance}");
        }
    }
}
