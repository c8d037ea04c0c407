//! Random and extreme input: nothing infinite, negative or NaN comes out, and weights stay bounded.

use super::Random;
use crate::color::Rgb;
use crate::disney::{Bsdf, Parameter, Params};
use crate::math::V3;

fn assert_sane(f: Rgb, pdf: f32, context: &dyn std::fmt::Debug) {
    assert!(f.is_finite() && f.to_array().iter().all(|&v| v >= 0.0), "{f:?} at {context:?}");
    assert!(pdf.is_finite() && pdf >= 0.0, "{pdf} at {context:?}");
}

#[test]
fn random_and_extreme_triples_stay_finite() {
    let mut random = Random::new(5);
    for _ in 0..200_000 {
        let params = random.params();
        let bsdf = Bsdf::disney(&params, random.masking(), random.diffuse_model());
        let (wo, wi) = random.pair();
        let (f, pdf) = bsdf.eval_with_pdf(wo, wi);
        assert_sane(f, pdf, &(params, wo, wi));
        assert!(f.is_black() || pdf > 0.0, "no sampler finds {f:?}: {wo:?} {wi:?} {params:?}");
        if let Some(s) = bsdf.sample(wo, random.unit(), random.square()) {
            assert_sane(s.f, s.pdf, &(params, wo, s.wi));
            assert!(s.pdf > 0.0);
        }
    }
}

#[test]
fn corners_of_everything_stay_finite() {
    let below_one = 1.0 - f32::EPSILON / 2.0;
    let cosines = [1.0, 0.5, 1e-3, 1e-7, 1e-20, f32::MIN_POSITIVE, 1e-45];
    let directions: Vec<V3<f32>> = cosines
        .iter()
        .flat_map(|&z: &f32| {
            let r = (1.0 - z * z).sqrt();
            [V3::new(r, 0.0, z), V3::new(-r, 0.0, z), V3::new(0.0, r, z)]
        })
        .collect();
    let mut random = Random::new(6);
    for corner in 0..1u32 << Parameter::BURLEY_2012.len() {
        let mut params = Params { base_color: Rgb::new(1.0, 0.0, 0.5), ..Params::default() };
        for (bit, p) in Parameter::BURLEY_2012.into_iter().enumerate() {
            *params.get_mut(p) = if corner >> bit & 1 == 1 { p.max() } else { 0.0 };
        }
        if corner % 3 == 0 {
            params.base_color = Rgb::BLACK;
        }
        let bsdf = Bsdf::disney(&params, random.masking(), random.diffuse_model());
        for &wo in &directions {
            for &wi in &directions {
                let (f, pdf) = bsdf.eval_with_pdf(wo, wi);
                assert_sane(f, pdf, &(params, wo, wi));
            }
            for u_lobe in [0.0, 0.3, 0.6, below_one] {
                for u in [[0.0, 0.0], [0.0, below_one], [below_one, 0.0], [0.5, below_one]] {
                    if let Some(s) = bsdf.sample(wo, u_lobe, u) {
                        assert_sane(s.f, s.pdf, &(params, wo, s.wi));
                    }
                }
            }
        }
    }
}

#[test]
fn invalid_directions_give_nothing() {
    let bsdf = Bsdf::disney(&Params::default(), Default::default(), Default::default());
    let good = V3::new(0.6, 0.0, 0.8);
    for bad in [
        V3::new(f32::NAN, 0.0, 1.0),
        V3::new(0.0, 0.0, f32::NAN),
        V3::new(f32::INFINITY, 0.0, 1.0),
        V3::new(0.0, 0.0, 0.0),
    ] {
        assert!(bsdf.eval(good, bad).is_black() && bsdf.pdf(bad, good) == 0.0);
        assert_eq!(bsdf.sample(bad, 0.99, [0.5, 0.5]), None);
    }
}

#[test]
fn weights_of_samples_are_bounded() {
    // The colour enters tints as a ratio of up to 10; these colours keep it below 2.
    let mut random = Random::new(7);
    let mut worst = (0.0, String::new());
    for _ in 0..200_000 {
        let mut params = random.params();
        params.base_color = Rgb::new(0.8, 0.6, 0.5);
        params.specular = params.specular.min(1.0);
        params.clearcoat = params.clearcoat.min(1.0);
        let bsdf = Bsdf::disney(&params, random.masking(), random.diffuse_model());
        let wo = random.direction();
        if let Some(s) = bsdf.sample(wo, random.unit(), random.square()) {
            let weight = (s.f * (s.wi.z / s.pdf)).max_channel();
            if weight > worst.0 {
                worst = (weight, format!("{s:?} {wo:?} {params:?}"));
            }
        }
    }
    assert!(worst.0 < 12.0, "{worst:?}");
}
