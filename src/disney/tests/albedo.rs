//! The directional albedo: importance sampling against quadrature.

use super::mercator::Mercator;
use super::{Random, mixed_materials, views};

#[test]
fn importance_sampled_albedo_is_the_integral() {
    for (m, material) in mixed_materials().iter().enumerate() {
        for (v, wo) in views().into_iter().enumerate() {
            let grid = Mercator::about_mirror_direction(wo.cast());
            let integral = grid.total(1e-6, &|wi| material.double.eval(wo.cast(), wi).mean() * wi.z.max(0.0));
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
            if std::env::var_os("SHOW").is_some() {
                println!(
                    "{} cos {}: albedo {integral:.4}, deviation of a weight {:.3}",
                    material.name,
                    wo.z,
                    variance.sqrt() / mean
                );
            }
            assert!(
                (mean - integral).abs() < 4.0 * error + 1e-4 * integral,
                "{} from {wo:?}: {mean} ± {error} against {integral}",
                material.name
            );
        }
    }
}

#[test]
fn show_lobes() {
    use crate::color::Rgb;
    use crate::disney::*;
    use crate::disney::{
        clearcoat::Clearcoat, diffuse::Diffuse, fresnel::schlick_weight, pair::Pair, sheen::Sheen,
        specular::Specular,
    };
    use crate::math::V3;
    let zs = [1.0f64, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.02, 0.005];
    let at = |z: f64| V3::new((1.0 - z * z).sqrt() * 0.8, (1.0 - z * z).sqrt() * 0.6, z);
    let run = |name: String, f: &dyn Fn(Pair<f64>) -> f64, est: &dyn Fn(f64) -> f64| {
        print!("{name:40}");
        for z in zs {
            let wo = at(z);
            let grid = Mercator::about_mirror_direction(wo);
            let i = grid.total(1e-6, &|wi| Pair::new(wo, wi).map_or(0.0, |p| f(p) * wi.z));
            print!(" {i:.4}/{:.4}", est(z));
        }
        println!();
    };
    for gloss in [0.0, 0.5, 1.0] {
        let c =
            Clearcoat::new(&Params::<f64> { clearcoat: 1.0, clearcoat_gloss: gloss, ..Params::default() })
                .unwrap();
        run(format!("coat {gloss}"), &|p| c.eval_with_pdf(&p).0, &|z| c.albedo(z, schlick_weight(z)));
    }
    for m in [Masking::Matched, Masking::Remapped] {
        for f0 in [0.0, 1.0] {
            for r in [0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0] {
                let s = Specular::new(&Params::<f64> { roughness: r, ..Params::default() }, Rgb::grey(f0), m);
                run(format!("spec {m:?} f0 {f0} r {r}"), &|p| s.eval_with_pdf(&p).0.r, &|z| {
                    s.albedo(at(z), schlick_weight(z))
                });
            }
        }
    }
    let s =
        Sheen::new(&Params::<f64> { sheen: 1.0, sheen_tint: 0.0, ..Params::default() }, Rgb::WHITE).unwrap();
    run("sheen".into(), &|p| s.eval(&p).r, &|z| s.albedo(schlick_weight(z)));
    for (r, ss, m) in [
        (0.0, 0.0, DiffuseModel::Burley),
        (0.5, 0.0, DiffuseModel::Burley),
        (1.0, 0.0, DiffuseModel::Burley),
        (0.0, 1.0, DiffuseModel::Burley),
        (0.5, 1.0, DiffuseModel::Burley),
        (1.0, 1.0, DiffuseModel::Burley),
        (0.5, 0.0, DiffuseModel::LambertFresnel),
    ] {
        let p = Params::<f64> { roughness: r, subsurface: ss, base_color: Rgb::WHITE, ..Params::default() };
        let d = Diffuse::new(&p, Rgb::grey(0.04), m).unwrap();
        run(format!("diffuse r {r} ss {ss} {m:?}"), &|p| d.eval(&p).r, &|_| d.albedos().0 + d.albedos().1);
    }
}
