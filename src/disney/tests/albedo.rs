//! The directional albedo: importance sampling against quadrature.

use super::mercator::Sphere;
use super::{Random, Twin, mixed_materials, views, views_from_both_sides};
use crate::color::Rgb;
use crate::disney::clearcoat::Clearcoat;
use crate::disney::diffuse::Diffuse;
use crate::disney::fresnel::DielectricSplit;
use crate::disney::pair::Pair;
use crate::disney::sheen::Sheen;
use crate::disney::specular::{Schlick, Specular};
use crate::disney::{DiffuseModel, Masking, Params};
use crate::math::warp::uniform_sphere;
use crate::math::{Number, Real, V3};

/// ∫ f·|cos| dω of a material's lobes that aren't deltas, by quadrature in `f64`.
pub(super) fn quadrature(material: &Twin, wo: V3<f32>, tolerance: f64) -> f64 {
    let wo = wo.cast();
    let grid = Sphere::new(wo, material.ior);
    grid.total(tolerance, &|wi| material.double.eval(wo, wi).mean() * wi.z.abs())
}

/// The mean of `samples` values with its standard error.
pub(super) fn estimate(samples: u32, mut value: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut sum2) = (0.0, 0.0);
    for _ in 0..samples {
        let v = value();
        sum += v;
        sum2 += v * v;
    }
    let n = f64::from(samples);
    let mean = sum / n;
    (mean, ((sum2 / n - mean * mean).max(0.0) / n).sqrt())
}

#[test]
fn importance_sampled_albedo_is_the_integral() {
    for (m, material) in mixed_materials().iter().enumerate() {
        for (v, wo) in views_from_both_sides().into_iter().enumerate() {
            let integral = quadrature(material, wo, 1e-5);
            let mut random = Random::new((m * 5 + v) as u64);
            let (mean, error) = estimate(20_000, || {
                let sample = material.single.sample(wo, random.unit(), random.square());
                let spread = sample.filter(|s| !s.lobe.is_delta());
                spread.map_or(0.0, |s| f64::from(s.f.mean() * s.wi.z.abs() / s.pdf))
            });
            assert!(
                (mean - integral).abs() < 4.0 * error + 2e-4 * integral + 1e-6,
                "{} from {wo:?}: {mean} ± {error} against {integral}",
                material.name
            );
        }
    }
}

/// What uniform sampling of the sphere should find, and its standard error after `samples`, by quadrature.
fn uniform_estimate(material: &Twin, wo: V3<f32>, samples: u32) -> (f64, f64) {
    let integral = quadrature(material, wo, 1e-5);
    let grid = Sphere::new(wo.cast(), material.ior);
    let square = grid.total(1e-3, &|wi| Number::sqr(material.double.eval(wo.cast(), wi).mean() * wi.z));
    (integral, ((4.0 * f64::PI * square - integral * integral) / f64::from(samples)).sqrt())
}

#[test]
fn uniformly_sampled_albedo_is_the_integral() {
    let mut compared = 0;
    for (m, material) in mixed_materials().iter().enumerate() {
        for (v, wo) in views_from_both_sides().into_iter().enumerate() {
            let samples = 40_000;
            let (integral, error) = uniform_estimate(material, wo, samples);
            // Uniform directions hardly ever find a sharp peak.
            if integral == 0.0 || error > 0.02 * integral {
                continue;
            }
            compared += 1;
            let mut random = Random::new((m * 9 + v) as u64);
            let (mean, _) = estimate(samples, || {
                let wi = uniform_sphere(random.square());
                f64::from(material.single.eval(wo, wi).mean() * wi.z.abs()) * 4.0 * f64::PI
            });
            let name = &material.name;
            assert!(
                (mean - integral).abs() < 4.5 * error,
                "{name} from {wo:?}: {mean} ± {error} against {integral}"
            );
        }
    }
    assert!(compared > 90, "{compared}");
}

/// Checks an estimate that lobe probabilities are made of: within `factor` of the integral, apart from `dim`, too little to matter.
fn assert_estimate(
    name: &str,
    factor: f64,
    dim: f64,
    f: impl Fn(&Pair<f64>) -> f64,
    estimate: impl Fn(V3<f64>) -> f64,
) {
    for wo in views() {
        let wo = wo.cast();
        let grid = Sphere::new(wo, 1.0);
        let integral = grid.total(3e-5, &|wi| Pair::new(wo, wi).map_or(0.0, |pair| f(&pair) * wi.z));
        let is = estimate(wo);
        assert!(
            is > 0.0 && is < factor * integral + dim && integral < factor * is + dim,
            "{name} from {wo:?}: {is} for {integral}"
        );
    }
}

#[test]
fn lobe_probabilities_follow_the_albedos() {
    let white = Params::<f64> { base_color: Rgb::WHITE, ..Params::default() };
    for clearcoat_gloss in [0.0, 0.5, 1.0] {
        let coat = Clearcoat::new(&Params { clearcoat: 1.0, clearcoat_gloss, ..white }).unwrap();
        assert_estimate("coat", 1.8, 0.0, |p| coat.eval_with_pdf(p).0, |wo| coat.albedo(wo));
    }
    for masking in [Masking::Matched, Masking::Remapped] {
        for (f0, roughness) in
            [(0.0, 0.0), (0.0, 0.3), (0.0, 0.8), (0.5, 0.2), (0.5, 0.6), (1.0, 0.0), (1.0, 1.0)]
        {
            let lobe =
                Specular::new(&Params { roughness, specular: f0 / 0.08, ..white }, Rgb::WHITE, masking);
            let name = format!("specular {masking:?} {f0} {roughness}");
            let none = DielectricSplit::OPAQUE;
            let value = |p: &Pair<f64>| lobe.fresnel(p.edge, &none).r * lobe.shape_with_pdf(p).0;
            assert_estimate(&name, 1.5, 0.003, value, |wo| lobe.albedo(wo, &none));
        }
    }
    let sheen = Sheen::new(&Params { sheen: 1.0, ..white }, Rgb::WHITE).unwrap();
    assert_estimate("sheen", 1.4, 0.002, |p| sheen.eval(p).r, |wo| sheen.albedo(wo));
    for model in [DiffuseModel::Burley, DiffuseModel::Lambert, DiffuseModel::LambertFresnel] {
        for (roughness, subsurface) in [(0.0, 0.0), (0.5, 0.5), (1.0, 0.0), (1.0, 1.0)] {
            let params = Params { roughness, subsurface, ..white };
            let left = Schlick { f0: Rgb::grey(0.96), f90: 0.0 };
            let lobe = Diffuse::new(&params, left, model).unwrap();
            let estimate = |wo| {
                let (cosine, uniform) = lobe.albedos(wo);
                cosine + uniform
            };
            assert_estimate(&format!("{model:?} {params:?}"), 1.25, 0.0, |p| lobe.eval(p).r, estimate);
        }
    }
}
