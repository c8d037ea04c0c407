//! The directional albedo: importance sampling against quadrature.

use super::mercator::Mercator;
use super::{Random, mixed_materials, views};
use crate::color::Rgb;
use crate::disney::clearcoat::Clearcoat;
use crate::disney::diffuse::Diffuse;
use crate::disney::pair::Pair;
use crate::disney::sheen::Sheen;
use crate::disney::specular::Specular;
use crate::disney::{DiffuseModel, Masking, Params};
use crate::math::V3;

#[test]
fn importance_sampled_albedo_is_the_integral() {
    for (m, material) in mixed_materials().iter().enumerate() {
        for (v, wo) in views().into_iter().enumerate() {
            let grid = Mercator::about_mirror_direction(wo.cast());
            let integral = grid.total(1e-5, &|wi| material.double.eval(wo.cast(), wi).mean() * wi.z.max(0.0));
            let mut random = Random::new((m * 5 + v) as u64);
            let samples = 20_000;
            let (mut sum, mut sum2) = (0.0, 0.0);
            for _ in 0..samples {
                let weight = material
                    .single
                    .sample(wo, random.unit(), random.square())
                    .map_or(0.0, |s| f64::from(s.f.mean() * s.wi.z / s.pdf));
                sum += weight;
                sum2 += weight * weight;
            }
            let mean = sum / f64::from(samples);
            let variance = (sum2 / f64::from(samples) - mean * mean).max(0.0);
            let error = (variance / f64::from(samples)).sqrt();
            assert!(
                (mean - integral).abs() < 4.0 * error + 1e-4 * integral,
                "{} from {wo:?}: {mean} ± {error} against {integral}",
                material.name
            );
        }
    }
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
        let grid = Mercator::about_mirror_direction(wo);
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
            let lobe = Specular::new(&Params { roughness, ..white }, Rgb::grey(f0), masking);
            let name = format!("specular {masking:?} {f0} {roughness}");
            assert_estimate(&name, 1.5, 0.003, |p| lobe.eval_with_pdf(p).0.r, |wo| lobe.albedo(wo));
        }
    }
    let sheen = Sheen::new(&Params { sheen: 1.0, ..white }, Rgb::WHITE).unwrap();
    assert_estimate("sheen", 1.4, 0.002, |p| sheen.eval(p).r, |wo| sheen.albedo(wo));
    for model in [DiffuseModel::Burley, DiffuseModel::Lambert, DiffuseModel::LambertFresnel] {
        for (roughness, subsurface) in [(0.0, 0.0), (0.5, 0.5), (1.0, 0.0), (1.0, 1.0)] {
            let params = Params { roughness, subsurface, ..white };
            let lobe = Diffuse::new(&params, Rgb::grey(0.04), model).unwrap();
            let estimate = |wo| {
                let (cosine, uniform) = lobe.albedos(wo);
                cosine + uniform
            };
            assert_estimate(&format!("{model:?} {params:?}"), 1.25, 0.0, |p| lobe.eval(p).r, estimate);
        }
    }
}
