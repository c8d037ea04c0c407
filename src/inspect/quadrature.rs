//! Integrals over directions that know nothing of the sampler, to hold it against.

use super::energy::Energy;
use crate::math::V3;

/// Steps of the angle from the axis, evenly in its logarithm.
const RINGS: u32 = 480;
/// Steps around the axis.
const SECTORS: u32 = 240;
/// The smallest angle from the axis in radians: well inside the narrowest lobe, whose alpha is 0.001.
const SMALLEST: f64 = 2e-5;

/// Integrals over both hemispheres, apart from delta lobes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integrals {
    /// Of the luminance of f·|cos θi|, by energy: the albedo.
    pub albedo: f64,
    /// Of the density: 1 less the samples that are lost or go to delta lobes.
    pub density: f64,
}

/// Integrates about the mirror direction above the surface, and about `below` under it if something goes there, in rings whose
/// radii grow geometrically.
pub(super) fn integrate(energy: &Energy<'_>, below: Option<V3<f64>>) -> Integrals {
    let wo = energy.wo;
    let mirror = V3::new(-wo.x, -wo.y, wo.z).cast();
    let upper = half(energy, mirror, 1.0);
    let lower = below.map_or_else(Integrals::default, |axis| half(energy, axis, -1.0));
    Integrals { albedo: upper.albedo + lower.albedo, density: upper.density + lower.density }
}

/// The part on one side, `side` being the sign of z.
fn half(energy: &Energy<'_>, axis: V3<f64>, side: f64) -> Integrals {
    // The axis lies near the plane of x and z, so it is never along y.
    let across = V3::new(0.0, 1.0, 0.0).cross(axis).normalize();
    let up = axis.cross(across);
    let (low, high) = (libm::log(SMALLEST), libm::log(std::f64::consts::PI));
    let step = (high - low) / f64::from(RINGS);
    let sector = std::f64::consts::TAU / f64::from(SECTORS);
    let mut sum = Integrals::default();
    for ring in 0..RINGS {
        let delta = libm::exp(low + (f64::from(ring) + 0.5) * step);
        let (sin, cos) = (libm::sin(delta), libm::cos(delta));
        // dω = sin δ dδ dψ, dδ = δ d(ln δ).
        let solid_angle = sin * delta * step * sector;
        for i in 0..SECTORS {
            let psi = (f64::from(i) + 0.5) * sector;
            let wi = axis * cos + across * (sin * libm::sin(psi)) + up * (sin * libm::cos(psi));
            if wi.z * side <= 0.0 {
                continue;
            }
            let (value, density) = energy.value_and_density(wi.cast());
            sum.albedo += value.luminance() * solid_angle;
            sum.density += density * solid_angle;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::disney::{Bsdf, DiffuseModel, Masking, Params};
    use crate::inspect::measure::{direction, measure};

    #[test]
    fn lambert_reflects_its_colour() {
        let bsdf = Bsdf::diffuse(Rgb::grey(0.4));
        let integrals = integrate(&Energy::new(&bsdf, direction(-30.0)), None);
        assert!(
            (integrals.albedo - 0.4).abs() < 1e-3 && (integrals.density - 1.0).abs() < 2e-3,
            "{integrals:?}"
        );
    }

    #[test]
    fn quadrature_and_sampling_agree_for_narrow_and_wide_lobes() {
        for (roughness, clearcoat, anisotropic) in [(0.02, 0.0, 0.0), (0.3, 1.0, 0.8), (1.0, 0.0, 0.0)] {
            let params =
                Params::<f32> { roughness, clearcoat, anisotropic, metallic: 0.5, ..Params::default() };
            let bsdf = Bsdf::disney(&params, Masking::Matched, DiffuseModel::Burley);
            for view in measure(&bsdf).views {
                let (by_sampling, by_quadrature) = (view.estimate.smooth, view.integrals.albedo);
                let allowed = 4.0 * view.estimate.error + 4e-3 * by_quadrature;
                assert!(
                    (by_sampling - by_quadrature).abs() < allowed,
                    "{params:?} {}: {by_sampling} {by_quadrature}",
                    view.angle
                );
                let whole = view.integrals.density + view.estimate.lost;
                assert!((whole - 1.0).abs() < 6e-3, "{params:?} {}: {whole}", view.angle);
                let lobes: f64 = view.estimate.lobes.iter().map(|(_, part)| part).sum();
                assert!((lobes - by_sampling).abs() < 1e-5 * by_sampling, "lobes sum to the whole");
                let shares: f64 = view.estimate.shares.iter().map(|(_, share)| share).sum();
                assert!((shares + view.estimate.lost - 1.0).abs() < 1e-9);
            }
        }
    }
}
