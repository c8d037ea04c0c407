//! How far a picture is from its reference.

use serde::Serialize;

use crate::math::stats::relative_square;
use crate::raster::Layer;

/// The part of the values that counts as the tail.
const TAIL: f64 = 0.001;

/// A picture against its reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// The mean over pixels and channels of (x - ref)²/(ref² + 0.01).
    pub error: f64,
    /// The same without the largest 0.1% of the values: what is left if fireflies are taken away.
    pub without_tail: f64,
    /// The mean of all values over the reference's, less 1.
    pub bias: f64,
}

/// The deviation of `picture` from `reference`, two colour pictures of one size; values that are not there count as 0.
pub(super) fn deviation(picture: &Layer, reference: &Layer) -> Deviation {
    let none = [&[][..]; 3];
    let (picture, reference) = (picture.rgb().unwrap_or(none), reference.rgb().unwrap_or(none));
    let pairs = || picture.iter().zip(reference).flat_map(|(a, b)| a.iter().zip(b));
    let mut errors: Vec<f64> = pairs()
        .map(|(&x, &r)| {
            let (x, r) = (f64::from(x), f64::from(r));
            relative_square((x - r) * (x - r), r)
        })
        .collect();
    let count = errors.len().max(1) as f64;
    let error = errors.iter().sum::<f64>() / count;
    errors.sort_unstable_by(f64::total_cmp);
    let kept = errors.len() - (errors.len() as f64 * TAIL).ceil() as usize;
    let without_tail = errors[..kept].iter().sum::<f64>() / (kept.max(1) as f64);
    let sum = |f: fn((&f32, &f32)) -> f64| pairs().map(f).sum::<f64>();
    let (of_picture, of_reference) = (sum(|(x, _)| f64::from(*x)), sum(|(_, r)| f64::from(*r)));
    let bias = if of_reference == 0.0 { 0.0 } else { of_picture / of_reference - 1.0 };
    Deviation { error, without_tail, bias }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Window;

    fn picture(values: Vec<f32>) -> Layer {
        let window = Window::sized(values.len() as u32, 1);
        ["R", "G", "B"].into_iter().fold(Layer::new("beauty", window), |l, name| l.with(name, values.clone()))
    }

    #[test]
    fn the_error_is_relative_for_bright_pixels_and_absolute_for_dark_ones() {
        let found = deviation(&picture(vec![1.1, 0.1]), &picture(vec![1.0, 0.0]));
        let expected = (0.01 / 1.01 + 0.01 / 0.01) / 2.0;
        assert!((found.error - expected).abs() < 1e-6, "{}", found.error);
        assert!((found.bias - 0.2).abs() < 1e-6, "{}", found.bias);
    }

    #[test]
    fn a_firefly_is_all_of_the_tail() {
        let mut values = vec![1.0; 2000];
        values[7] = 1000.0;
        let found = deviation(&picture(values), &picture(vec![1.0; 2000]));
        assert!(found.error > 100.0);
        assert_eq!(found.without_tail, 0.0);
    }
}
