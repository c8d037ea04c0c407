//! The angle of a vector in single precision.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::Number;

/// (arctan z - z)/z³ as a polynomial in z² for |z| ≤ tan π/8, from the lowest power: fitted to the least largest relative error of the
/// angle, 2e-8.
const TERMS: [f32; 4] = [-0.333_329_5, 0.199_777_04, -0.138_776_08, 0.080_534_76];

/// Up to here arctan is its polynomial; beyond it is π/4 and what remains.
const TAN_EIGHTH: f32 = 0.414_213_57;

/// The angle of the vector (x, y) in [-π, π], to two units in its last place, for numbers neither infinite nor NaN nor so large that their sum is; 0 of
/// the vector 0, as signs have it.
///
/// Without branches, since angles are random, and with a single division.
#[inline]
pub(super) fn atan2(y: f32, x: f32) -> f32 {
    let (across, along) = (y.abs(), x.abs());
    let choose = <f32 as Number>::select;
    let (less, more) = (choose(across > along, along, across), choose(across > along, across, along));
    let is_steep = less > TAN_EIGHTH * more;
    let numerator = choose(is_steep, less - more, less);
    let denominator = choose(is_steep, less + more, more);
    let z = if more > 0.0 { numerator / denominator } else { 0.0 };
    let square = z * z;
    let [c0, c1, c2, c3] = TERMS;
    let curve = ((c3 * square + c2) * square + c1) * square + c0;
    let angle = choose(is_steep, FRAC_PI_4, 0.0) + (z + z * square * curve);
    let angle = choose(across > along, FRAC_PI_2 - angle, angle);
    choose(x.is_sign_negative(), PI - angle, angle).copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_libm_all_around() {
        for i in 0..=1_000_000 {
            let angle = f64::from(i) / 1_000_000.0 * 2.0 * std::f64::consts::PI;
            for length in [1.0, 1e-30, 3e20] {
                let (y, x) = ((libm::sin(angle) * length) as f32, (libm::cos(angle) * length) as f32);
                let expected = libm::atan2(f64::from(y), f64::from(x));
                let off = (f64::from(atan2(y, x)) - expected).abs();
                assert!(off <= 2.4e-7 * expected.abs().max(1e-30), "{y} {x}: {off:e}");
            }
        }
    }

    #[test]
    fn vectors_along_the_axes_have_exact_angles_of_their_own_sign() {
        for (y, x) in [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (0.0, 0.0), (2.0, 2.0), (1.0, -1.0)] {
            for y in [y, -y] {
                assert_eq!(atan2(y, x).to_bits(), libm::atan2f(y, x).to_bits(), "{y} {x}");
            }
        }
        assert_eq!(atan2(0.0, -0.0), PI);
    }
}
