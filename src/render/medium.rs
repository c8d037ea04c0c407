//! What lies between surfaces: nothing, or the absorbing inside of an interface.
//!
//! A path is in the medium of the side on which it left the last interface; meeting an interface from behind tells as well, for paths
//! that begin inside. Overlapping insides are not tracked.

use crate::color::Rgb;
use crate::math::Real;

/// Absorption coefficients per metre; none for clear space.
pub(super) type Medium = Option<Rgb>;

/// Beer's law: exp(-σ·distance) of each channel, for a distance in metres that may be infinite.
#[inline]
pub(super) fn transmittance(medium: Medium, distance: f32) -> Rgb {
    match medium {
        None => Rgb::WHITE,
        // 0·∞ is not a number.
        Some(sigma) => sigma.map(|s| if s == 0.0 { 1.0 } else { Real::exp(-s * distance) }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beers_law_at_all_distances() {
        let sigma = Some(Rgb::new(0.0, 0.5, 1e30));
        let near = transmittance(sigma, 2.0);
        assert!((near.g - libm::expf(-1.0)).abs() < 1e-7 && near.r == 1.0 && near.b == 0.0);
        assert_eq!(transmittance(sigma, f32::INFINITY), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(transmittance(None, f32::INFINITY), Rgb::WHITE);
    }
}
