//! Transmission: limits with known answers, and energy.

use super::{Random, views};
use crate::color::Rgb;
use crate::disney::{Bsdf, Lobe, Params, fresnel_dielectric};
use crate::math::{Number, V3};

fn glass(roughness: f64, ior: f64, thin_walled: bool) -> Bsdf<f64> {
    let params = Params {
        base_color: Rgb::WHITE,
        spec_trans: 1.0,
        roughness,
        ior,
        thin_walled,
        specular: 0.0,
        ..Params::default()
    };
    Bsdf::disney(&params, Default::default(), Default::default())
}

#[test]
fn at_roughness_0_it_is_the_smooth_dielectric() {
    let mut random = Random::new(31);
    for _ in 0..10_000 {
        let ior = 0.5 + 2.0 * f64::from(random.unit());
        let wo = random.direction().cast::<f64>().normalize();
        let wo = if random.bits().is_multiple_of(2) { wo } else { -wo };
        let (rough, smooth) = (glass(0.0, ior, false), Bsdf::dielectric(ior));
        assert!(rough.is_delta() && rough.eval(wo, -wo).is_black());
        // The order in which the two lobes divide [0, 1) is each one's own.
        let reflectance = fresnel_dielectric(wo.z.abs(), if wo.z > 0.0 { ior } else { 1.0 / ior });
        let found = |bsdf: &Bsdf<f64>, lobe: Lobe| {
            [0.0, 1.0 - 1e-12]
                .into_iter()
                .filter_map(|u| bsdf.sample(wo, u, [0.0; 2]))
                .find(|s| s.lobe == lobe)
        };
        for lobe in [Lobe::DielectricReflection, Lobe::DielectricTransmission] {
            let (a, b) = (found(&rough, lobe), found(&smooth, lobe));
            let Some((a, b)) = a.zip(b) else {
                assert!(
                    reflectance > 1.0 - 1e-9 && lobe.is_transmission() || (ior - 1.0).abs() < 2e-3,
                    "{lobe:?} {ior}"
                );
                continue;
            };
            assert!((a.wi - b.wi).length() < 1e-12 && (a.pdf - b.pdf).abs() < 1e-12);
            assert!((a.f - b.f).map(f64::abs).max_channel() < 1e-9 * b.f.r);
        }
    }
}

#[test]
fn a_sharp_interface_nears_the_smooth_one() {
    // ∫ f·|cos| over each side, by its sampler, against Fresnel's parts.
    for wo in views().into_iter().chain(views().map(V3::mirrored_z)).map(V3::cast::<f64>) {
        let rough = glass(0.05, 1.5, false);
        let eta = if wo.z > 0.0 { 1.5 } else { 1.0 / 1.5 };
        let reflectance = fresnel_dielectric(wo.z.abs(), eta);
        let mut random = Random::new(32);
        let (mut reflected, mut passed) = (0.0, 0.0);
        let n = 20_000;
        for _ in 0..n {
            let [u0, u1] = random.square();
            let Some(s) = rough.sample(wo, random.unit().into(), [u0.into(), u1.into()]) else { continue };
            let weight = s.f.mean() * s.wi.z.abs() / s.pdf / f64::from(n);
            if s.lobe.is_transmission() { passed += weight * s.eta.sqr() } else { reflected += weight }
        }
        // At a cosine of 0.02 an alpha of 0.0025 is a tenth of it.
        let near = if wo.z.abs() < 0.1 { 0.06 } else { 0.01 };
        assert!((reflected - reflectance).abs() < near, "{wo:?}: {reflected} {reflectance}");
        assert!((passed - (1.0 - reflectance)).abs() < near, "{wo:?}: {passed} {reflectance}");
    }
}

#[test]
fn a_clear_sheet_lets_light_pass_straight_and_loses_none() {
    let sheet = glass(0.0, 1.5, true);
    for wo in views().map(V3::cast::<f64>) {
        let reflectance = fresnel_dielectric(wo.z, 1.5);
        let passing = sheet.straight_transmittance(wo).unwrap();
        assert!((passing.r + reflectance - 1.0).abs() < 1e-12);
        let s = sheet.sample(wo, 0.0, [0.0; 2]).unwrap();
        assert_eq!((s.lobe, s.wi, s.eta), (Lobe::StraightTransmission, -wo, 1.0));
        assert!((s.f.r * wo.z / s.pdf - 1.0).abs() < 1e-12 && (s.pdf - passing.r).abs() < 1e-12);
    }
    assert_eq!(glass(0.3, 1.5, true).straight_transmittance(V3::new(0.0, 0.0, 1.0)), None);
    assert_eq!(glass(0.0, 1.5, false).straight_transmittance(V3::new(0.0, 0.0, 1.0)), None);
}

#[test]
fn tints_are_the_square_root_for_solids_and_the_colour_for_sheets() {
    let base_color = Rgb::new(0.64, 0.25, 1.0);
    let straight_down = V3::new(0.0, 0.0, 1.0);
    let tint = |thin_walled, transmission_color| {
        let params = Params {
            base_color,
            spec_trans: 1.0,
            roughness: 0.0,
            thin_walled,
            transmission_color,
            ..Params::default()
        };
        let bsdf = Bsdf::<f64>::disney(&params, Default::default(), Default::default());
        let s = (0..10)
            .filter_map(|i| bsdf.sample(straight_down, f64::from(i) / 10.0, [0.0; 2]))
            .find(|s| s.lobe.is_transmission())
            .unwrap();
        let passing = 1.0 - fresnel_dielectric(1.0, 1.5);
        // f·|cos| is the transmitted part of radiance, over eta².
        s.f * (s.wi.z.abs() * s.eta.sqr() / passing)
    };
    let near = |a: Rgb<f64>, b: Rgb<f64>| (a - b).map(f64::abs).max_channel() < 1e-12;
    assert!(near(tint(false, None), Rgb::new(0.8, 0.5, 1.0)));
    assert!(near(tint(true, None), base_color));
    for thin_walled in [false, true] {
        let own = Rgb::new(0.1, 0.2, 0.3);
        assert!(near(tint(thin_walled, Some(own)), own));
    }
}

#[test]
fn the_front_blends_schlick_with_the_dielectric() {
    // At normal incidence: lerp(0.08·specular, ((n-1)/(n+1))², spec_trans)·(1 - metallic) + metallic·base_color.
    let with = |spec_trans: f64| Params {
        base_color: Rgb::grey(0.9),
        metallic: 0.25,
        specular: 1.0,
        roughness: 0.4,
        spec_trans,
        ior: 2.0,
        ..Params::default()
    };
    let up = V3::new(0.0, 0.0, 1.0);
    let specular = |spec_trans| {
        let bsdf = Bsdf::<f64>::disney(&with(spec_trans), Default::default(), Default::default());
        bsdf.eval_lobe(Lobe::Specular, up, up).r
    };
    let f0 = |spec_trans: f64| (0.08 + (1.0 / 9.0 - 0.08) * spec_trans) * 0.75 + 0.25 * 0.9;
    for spec_trans in [0.25, 0.5, 1.0] {
        let ratio = specular(spec_trans) / specular(0.0);
        assert!((ratio - f0(spec_trans) / f0(0.0)).abs() < 1e-12, "{spec_trans}");
    }
}
