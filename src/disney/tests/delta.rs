//! Mirror and dielectric: Fresnel's energy, Snell's directions, reciprocity of transport.

use super::Random;
use crate::color::Rgb;
use crate::disney::{Bsdf, BsdfSample, Lobe, fresnel_dielectric};
use crate::math::{Number, Real, V3};

/// What a sample multiplies radiance with.
fn weight(s: &BsdfSample<f64>) -> f64 {
    s.f.r * s.wi.z.abs() / s.pdf
}

fn random_direction(random: &mut Random) -> V3<f64> {
    let w = random.direction().cast::<f64>().normalize();
    if random.bits().is_multiple_of(2) { w } else { -w }
}

#[test]
fn the_mirror_reflects_all_light_from_the_front() {
    let mirror = Bsdf::<f64>::mirror();
    let wo = V3::new(0.36, 0.48, 0.8);
    let s = mirror.sample(wo, 0.5, [0.5, 0.5]).unwrap();
    assert_eq!((s.wi, s.pdf, s.lobe, s.eta), (V3::new(-0.36, -0.48, 0.8), 1.0, Lobe::Mirror, 1.0));
    assert!((weight(&s) - 1.0).abs() < 1e-15);
    assert_eq!(mirror.sample(-wo, 0.5, [0.5, 0.5]), None);
    assert!(mirror.is_delta() && mirror.eval(wo, s.wi).is_black() && mirror.pdf(wo, s.wi) == 0.0);
    assert_eq!(mirror.albedo(), Rgb::WHITE);
}

#[test]
fn reflected_and_refracted_energy_sum_to_one() {
    let mut random = Random::new(8);
    let (mut both, mut total) = (0, 0);
    for _ in 0..10_000 {
        let ior = 0.4 + 2.0 * f64::from(random.unit());
        let glass = Bsdf::dielectric(ior);
        let wo = random_direction(&mut random);
        let reflected = glass.sample(wo, 0.0, [0.0; 2]).unwrap();
        assert_eq!(reflected.lobe, Lobe::DielectricReflection);
        assert_eq!(reflected.wi, V3::new(-wo.x, -wo.y, wo.z));
        let side = if wo.z > 0.0 { ior } else { 1.0 / ior };
        assert!((reflected.pdf - fresnel_dielectric(wo.z.abs(), side)).abs() < 1e-15);
        assert!((weight(&reflected) - 1.0).abs() < 1e-12);
        let other = glass.sample(wo, 1.0 - 1e-16, [0.0; 2]).unwrap();
        if other.lobe == Lobe::DielectricTransmission {
            assert!((reflected.pdf + other.pdf - 1.0).abs() < 1e-12);
            // Radiance changes by 1/eta²; flux doesn't.
            assert!((weight(&other) * other.eta.sqr() - 1.0).abs() < 1e-12);
            both += 1;
        } else {
            assert_eq!(reflected.pdf, 1.0);
            total += 1;
        }
    }
    assert!(both > 5000 && total > 500, "{both} {total}");
}

#[test]
fn refraction_follows_snell() {
    let mut random = Random::new(9);
    for _ in 0..10_000 {
        let ior = 1.0 + f64::from(random.unit());
        let wo = random_direction(&mut random);
        let Some(s) = Bsdf::dielectric(ior).sample(wo, 1.0 - 1e-16, [0.0; 2]) else { panic!("{wo:?}") };
        if s.lobe != Lobe::DielectricTransmission {
            continue;
        }
        assert!(s.wi.z * wo.z < 0.0 && (s.wi.length() - 1.0).abs() < 1e-12);
        assert_eq!(s.eta, if wo.z > 0.0 { ior } else { 1.0 / ior });
        // η sin θ is the same on both sides, in the same plane.
        assert!((s.wi.x * s.eta + wo.x).abs() < 1e-12 && (s.wi.y * s.eta + wo.y).abs() < 1e-12);
    }
}

#[test]
fn transmission_is_reciprocal_with_the_square_of_eta() {
    let mut random = Random::new(10);
    for _ in 0..10_000 {
        let glass = Bsdf::dielectric(1.0 + f64::from(random.unit()));
        let wo = random.direction().cast::<f64>().normalize();
        let Some(there) = glass.sample(wo, 1.0 - 1e-16, [0.0; 2]) else { panic!("{wo:?}") };
        let Some(back) = glass.sample(there.wi, 1.0 - 1e-16, [0.0; 2]) else { panic!("{wo:?}") };
        assert!((back.wi + -wo).length() < 1e-6 || (back.wi - wo).length() < 1e-6);
        // Veach 1997, eq. 5.14: f(wo → wi)/ηi² is symmetric; with |cos θi| in f it is the Fresnel transmittance and the weights' product
        // that agree.
        assert!((there.pdf - back.pdf).abs() < 1e-7);
        assert!((weight(&there) * weight(&back) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn equal_media_let_light_pass_straight() {
    let air = Bsdf::dielectric(1.0f32);
    let wo = V3::new(0.6, 0.0, 0.8);
    let s = air.sample(wo, 0.0, [0.0; 2]).unwrap();
    assert_eq!((s.lobe, s.pdf), (Lobe::DielectricTransmission, 1.0));
    assert!((s.wi + wo).length() < 1e-6);
}

#[test]
fn extreme_dielectrics_stay_finite() {
    let mut random = Random::new(11);
    for _ in 0..20_000 {
        let ior: f32 = Real::powf(10.0, 4.0 * random.unit() - 2.0);
        let wo = random.direction();
        let wo = if random.bits().is_multiple_of(2) { wo } else { -wo };
        if let Some(s) = Bsdf::dielectric(ior).sample(wo, random.unit(), random.square()) {
            assert!(s.f.is_finite() && s.f.r > 0.0 && s.pdf > 0.0 && s.pdf <= 1.0 && s.lobe.is_delta());
        }
    }
    for ior in [0.0, f32::NAN, f32::INFINITY, 1e-30] {
        for wo in [V3::new(0.6, 0.0, 0.8), V3::new(0.6, 0.0, -0.8), V3::new(1.0, 0.0, 0.0)] {
            for u in [0.0, 0.5, 0.999] {
                if let Some(s) = Bsdf::dielectric(ior).sample(wo, u, [0.0; 2]) {
                    assert!(s.f.is_finite() && s.pdf > 0.0 && s.wi.length() < 1.01, "{ior} {s:?}");
                }
            }
        }
    }
}
