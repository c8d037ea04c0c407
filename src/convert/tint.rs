//! Coloured highlights and sheens as Disney's strength and tint towards the base colour's hue.

use crate::color::Rgb;

/// F0 of Disney's `specular` 1: F0 = 0.08·specular.
pub(crate) const F0_OF_SPECULAR: f64 = 0.08;

/// The luminance that Disney's tint divides by: 0.3 R + 0.6 G + 0.1 B (disney.brdf).
pub(crate) fn disney_luminance(c: Rgb<f64>) -> f64 {
    0.3 * c.r + 0.6 * c.g + 0.1 * c.b
}

/// A tint towards the base colour's hue that comes as near as it can to a colour.
pub(super) struct Tint {
    /// specular_tint or sheen_tint, in [0, 1].
    pub(super) amount: f32,
    /// The largest difference of a channel that stays, as a fraction of the luminance.
    pub(super) error: f64,
    /// Whether the base colour has no hue to tint with.
    pub(super) grey_base: bool,
}

impl Tint {
    /// How well the hue is kept, for a note.
    pub(super) fn describe(&self) -> String {
        match (self.error < 5e-4, self.grey_base) {
            (true, _) => "exact".into(),
            (false, true) => {
                format!("lost, since the base colour has none (off by {:.0}%)", 100.0 * self.error)
            }
            (false, false) => format!("tinted by the base colour, off by {:.0}%", 100.0 * self.error),
        }
    }
}

/// The t in [0, 1] for which lerp(1, base/lum(base), t) is nearest to color/lum(color), by least squares.
pub(super) fn fit_tint(color: Rgb<f64>, base: Rgb) -> Tint {
    let chroma = |c: Rgb<f64>| {
        let l = disney_luminance(c);
        if l > 0.0 { c * (1.0 / l) - Rgb::WHITE } else { Rgb::BLACK }
    };
    let dot = |a: Rgb<f64>, b: Rgb<f64>| a.r * b.r + a.g * b.g + a.b * b.b;
    let (wanted, hue) = (chroma(color), chroma(base.cast()));
    let length = dot(hue, hue);
    let grey_base = length < 1e-8;
    let amount = if grey_base { 0.0 } else { (dot(wanted, hue) / length).clamp(0.0, 1.0) };
    let error = (wanted - hue * amount).map(f64::abs).max_channel();
    Tint { amount: amount as f32, error, grey_base }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_between_white_and_the_base_are_exact() {
        let base = Rgb::new(0.8f32, 0.4, 0.2);
        let hue = base.cast::<f64>() * (1.0 / disney_luminance(base.cast()));
        for t in [0.0, 0.25, 1.0] {
            let tint = fit_tint(Rgb::WHITE.lerp(hue, t) * 0.3, base);
            assert!((f64::from(tint.amount) - t).abs() < 1e-6 && tint.error < 1e-6, "{t}: {}", tint.amount);
            assert_eq!(tint.describe(), "exact");
        }
    }

    #[test]
    fn hues_that_the_base_does_not_have_are_told() {
        let red = Rgb::new(1.0, 0.0, 0.0);
        for base in [Rgb::BLACK, Rgb::grey(0.5)] {
            let tint = fit_tint(red, base);
            assert_eq!(tint.amount, 0.0);
            assert!(tint.describe().contains("has none"), "{}", tint.describe());
        }
        let tint = fit_tint(red, Rgb::new(0.0, 0.0, 1.0));
        assert!(tint.amount == 0.0 && tint.describe().contains("off by"), "{}", tint.describe());
        assert_eq!(fit_tint(Rgb::BLACK, Rgb::new(1.0, 0.5, 0.5)).amount, 0.0);
    }
}
