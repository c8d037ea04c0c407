//! A mapped normal that a mirror could have: the reflected view stays above the surface.

use glam::Vec3;

use crate::math::Real;

/// The reflected view rises at least this much above the surface, or nearly as much as the view itself.
const RISE: f32 = 0.01;
const OF_VIEW: f32 = 0.9;

/// `mapped`, turned towards `geometric` just as far as it takes for the mirror image of `wo` to stay above the surface. All three are unit
/// vectors, and `wo` is above.
///
/// A path tracer loses the rays that a tilted normal reflects into the surface, and the map's slopes turn black. With φ the angle from
/// the geometric normal z to the mapped one, in the plane of both with x, the mirror image's height is
/// wo.x sin 2φ + wo.z cos 2φ = ρ cos(2φ - δ), δ = atan2(wo.x, wo.z): where it is too low, φ = ½(δ + acos(rise/ρ)) is the largest angle
/// that isn't. Cycles does the same to the same end (`ensure_valid_specular_reflection`). The normal depends on the view, so that
/// reciprocity holds only where nothing is turned; Schüssler et al. 2017 keep it at the cost of three evaluations.
#[inline]
pub(super) fn keep_reflection_above(mapped: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    let view_z = wo.dot(geometric);
    let rise = (OF_VIEW * view_z).min(RISE);
    let height = 2.0 * mapped.dot(wo) * mapped.dot(geometric) - view_z;
    if height >= rise && mapped.dot(geometric) > 0.0 {
        return mapped;
    }
    // Twice, since the first leaves the rounding of two nearly parallel vectors.
    let across = |v: Vec3| (v - geometric * v.dot(geometric)).try_normalize();
    let Some(x) = across(mapped).and_then(across) else { return geometric };
    let view_x = wo.dot(x);
    let in_plane = (view_x * view_x + view_z * view_z).sqrt();
    let phi = 0.5 * (Real::atan2(view_x, view_z) + Real::acos((rise / in_plane).min(1.0)));
    x * Real::sin(phi) + geometric * Real::cos(phi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::math::warp::uniform_sphere;

    #[test]
    fn every_reflection_stays_above_and_good_normals_stay_as_they_are() {
        let random = |i: u64, salt: u64| unit_f32(combine(i, salt) as u32);
        let direction = |i, salt| Vec3::from(uniform_sphere([random(i, salt), random(i, salt + 1)]));
        let (mut kept, mut turned) = (0, 0);
        for i in 0..100_000 {
            let (geometric, mapped, mut wo) = (direction(i, 1), direction(i, 3), direction(i, 5));
            if wo.dot(geometric) < 0.0 {
                wo = -wo;
            }
            let n = keep_reflection_above(mapped, geometric, wo);
            assert!((n.length() - 1.0).abs() < 1e-5, "{n}");
            let reflected = n * (2.0 * n.dot(wo)) - wo;
            let lowest = (OF_VIEW * wo.dot(geometric)).min(RISE);
            assert!(reflected.dot(geometric) > lowest - 1e-5, "{mapped} {geometric} {wo}");
            assert!(n.dot(wo) > -1e-6);
            if n == mapped {
                kept += 1;
            } else {
                turned += 1;
                // No further than needed: the reflection just rises enough.
                let is_upright = (n - geometric).length() < 1e-6;
                assert!(is_upright || reflected.dot(geometric) < lowest + 1e-4, "{mapped} {geometric} {wo}");
            }
        }
        assert!(kept > 10_000 && turned > 10_000);
    }
}
