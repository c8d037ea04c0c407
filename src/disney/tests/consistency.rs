//! `eval`, `pdf` and `sample` agree with each other.

use super::{Random, cast};
use crate::color::Rgb;
use crate::disney::{Bsdf, Lobe};
use crate::math::Real;

#[test]
fn samples_carry_the_values_of_eval_and_pdf() {
    let mut random = Random::new(1);
    let mut lobes = [0; 3];
    for _ in 0..2000 {
        let params = random.burley_params();
        let bsdf = Bsdf::disney(&params, random.masking(), random.diffuse_model());
        for _ in 0..20 {
            let wo = random.direction();
            let Some(s) = bsdf.sample(wo, random.unit(), random.square()) else { continue };
            assert_eq!(s.f, bsdf.eval(wo, s.wi));
            assert_eq!(s.pdf, bsdf.pdf(wo, s.wi));
            assert_eq!((s.f, s.pdf), bsdf.eval_with_pdf(wo, s.wi));
            assert!((s.wi.length() - 1.0).abs() < 2e-6 && s.wi.z > 0.0 && s.pdf > 0.0);
            assert!(s.eta == 1.0 && !s.lobe.is_delta());
            lobes[match s.lobe {
                Lobe::Diffuse => 0,
                Lobe::Specular => 1,
                Lobe::Clearcoat => 2,
                _ => unreachable!("a Disney material has no delta lobe"),
            }] += 1;
        }
    }
    assert!(lobes.iter().all(|&n| n > 1000), "{lobes:?}");
}

#[test]
fn samples_of_transmitting_materials_carry_the_values_of_eval_and_pdf() {
    let mut random = Random::new(21);
    let mut found = std::collections::BTreeMap::new();
    for _ in 0..4000 {
        let params = random.transmissive_params();
        let bsdf = Bsdf::disney(&params, random.masking(), random.diffuse_model());
        for _ in 0..20 {
            let wo = random.direction();
            let wo = if random.bits().is_multiple_of(2) { wo } else { -wo };
            let Some(s) = bsdf.sample(wo, random.unit(), random.square()) else { continue };
            assert!(wo.z > 0.0 || !params.thin_walled, "a sheet has no inside");
            assert!((s.wi.length() - 1.0).abs() < 2e-6 && s.pdf > 0.0, "{s:?}");
            assert_eq!((s.wi.z < 0.0) != (wo.z < 0.0), s.lobe.is_transmission(), "{s:?} {wo:?}");
            let side = if wo.z > 0.0 { params.ior } else { 1.0 / params.ior };
            let bends = matches!(s.lobe, Lobe::Transmission | Lobe::DielectricTransmission);
            assert_eq!(s.eta, if bends && !params.thin_walled { side } else { 1.0 });
            if s.lobe.is_delta() {
                assert!(s.pdf <= 1.0 + 1e-6);
            } else {
                assert_eq!((s.f, s.pdf), bsdf.eval_with_pdf(wo, s.wi));
            }
            *found.entry(s.lobe.name()).or_insert(0) += 1;
        }
    }
    assert!(found.len() == 8 && found.values().all(|&n| n > 300), "{found:?}");
}

#[test]
fn lobes_sum_to_the_whole() {
    let mut random = Random::new(22);
    for _ in 0..20_000 {
        let bsdf = Bsdf::disney(&random.transmissive_params(), random.masking(), random.diffuse_model());
        let (wo, wi) = (random.direction(), random.direction());
        for (wo, wi) in [(wo, wi), (-wo, -wi), (wo, -wi), (-wo, wi)] {
            let sum =
                bsdf.lobes().into_iter().fold(Rgb::BLACK, |sum, lobe| sum + bsdf.eval_lobe(lobe, wo, wi));
            let whole = bsdf.eval(wo, wi);
            assert!(
                (sum - whole).map(f32::abs).max_channel() <= 1e-6 * whole.max_channel(),
                "{sum:?} {whole:?}"
            );
        }
    }
}

/// Veach 1997, eq. 5.14, for rough refraction: f(wo, wi)·η² is symmetric, η being the index on wi's side; what passes diffusely
/// or through a sheet isn't bent, and symmetric as it is.
#[test]
fn transmission_scales_by_eta_squared() {
    let mut random = Random::new(23);
    let mut compared = 0;
    for _ in 0..100_000 {
        let mut params = random.transmissive_params();
        params.roughness = 0.1 + 0.9 * params.roughness;
        params.ior = if params.ior == 1.0 { 1.4 } else { params.ior };
        let bsdf: Bsdf<f64> = Bsdf::disney(&cast(&params), random.masking(), random.diffuse_model());
        let (wo, wi) = (random.direction().cast().normalize(), -random.direction().cast().normalize());
        if params.thin_walled {
            let symmetric = bsdf.eval(wo, wi) - bsdf.eval(wi.mirrored_z(), wo.mirrored_z());
            assert!(symmetric.map(f64::abs).max_channel() <= 1e-9 * bsdf.eval(wo, wi).max_channel());
            continue;
        }
        let eta2 = f64::from(params.ior) * f64::from(params.ior);
        let there = bsdf.eval_lobe(Lobe::Transmission, wo, wi) * eta2;
        let back = bsdf.eval_lobe(Lobe::Transmission, wi, wo);
        compared += u32::from(!there.is_black());
        assert!(
            (there - back).map(f64::abs).max_channel() <= 1e-9 * there.max_channel(),
            "{there:?} {back:?}"
        );
        let diffuse = |wo, wi| bsdf.eval_lobe(Lobe::DiffuseTransmission, wo, wi);
        assert_eq!(diffuse(wo, wi), diffuse(wi, wo));
    }
    assert!(compared > 5000, "{compared}");
}

fn largest_difference<F: Real>(a: Rgb<F>, b: Rgb<F>) -> f64 {
    let channels = a.to_array().into_iter().zip(b.to_array());
    let relative = channels.filter(|(a, b)| a != b).map(|(a, b)| ((a - b).abs() / a.max(b)).to_f64());
    relative.fold(0.0, f64::max)
}

/// To a relative 10⁻⁵, unless the directions nearly cancel. What differs is Schlick's weight, by the lengths' difference over |wo + wi|, and
/// what it leaves of 1 relatively by that over |wo + wi|²: lengths are off by 10⁻⁷ in `f32`, by 10⁻¹⁶ in `f64`.
#[test]
fn reflection_is_reciprocal() {
    let mut random = Random::new(2);
    for _ in 0..100_000 {
        let (mut params, masking, model) =
            (random.transmissive_params(), random.masking(), random.diffuse_model());
        // Keeps F0 below 1: else glTF's 1 - F may cancel at any angle.
        params.specular_tint = 0.0;
        let (single, double) =
            (Bsdf::disney(&params, masking, model), Bsdf::disney(&cast(&params), masking, model));
        let (wo, wi) = random.pair();
        for (wo, wi) in [(wo, wi), (wo.mirrored_z(), wi.mirrored_z())] {
            let opposite = f64::from((wo + wi).length_squared());
            for lobe in single.lobes() {
                let both = [single.eval_lobe(lobe, wo, wi), single.eval_lobe(lobe, wi, wo)];
                let difference = largest_difference(both[0], both[1]);
                assert!(difference <= 1e-5 + 1e-6 / opposite, "{lobe:?}: {both:?} {wo:?} {wi:?} {single:?}");
                let (wo, wi) = (wo.cast::<f64>().normalize(), wi.cast::<f64>().normalize());
                let both = [double.eval_lobe(lobe, wo, wi), double.eval_lobe(lobe, wi, wo)];
                let difference = largest_difference(both[0], both[1]);
                assert!(difference <= 1e-5 + 2e-15 / opposite, "{lobe:?}: {both:?} {wo:?} {wi:?} {double:?}");
            }
        }
    }
}

#[test]
fn nothing_is_scattered_to_or_from_below() {
    let mut random = Random::new(3);
    for _ in 0..1000 {
        let bsdf = Bsdf::disney(&random.burley_params(), random.masking(), random.diffuse_model());
        let (wo, wi) = (random.direction(), random.direction());
        for (wo, wi) in [(-wo, wi), (wo, -wi), (-wo, -wi)] {
            assert!(bsdf.eval(wo, wi).is_black() && bsdf.pdf(wo, wi) == 0.0);
        }
        assert_eq!(bsdf.sample(-wo, random.unit(), random.square()), None);
    }
}
