//! Random and extreme input: nothing infinite, negative or NaN comes out, and weights stay bounded.

use super::Random;
use crate::color::Rgb;
use crate::disney::stress::{LOBES, run};
use crate::disney::{Bsdf, Lobe, Parameter, Params};
use crate::math::V3;

fn assert_sane(f: Rgb, pdf: f32, context: &dyn std::fmt::Debug) {
    assert!(f.is_finite() && f.to_array().iter().all(|&v| v >= 0.0), "{f:?} at {context:?}");
    assert!(pdf.is_finite() && pdf >= 0.0, "{pdf} at {context:?}");
}

#[test]
fn hundreds_of_thousands_of_extreme_triples_pass() {
    let report = run(300_000, 1);
    let violations = report.violations();
    assert!(violations.is_empty(), "{}\n{report}", violations.join("\n"));
    for (lobe, tally) in LOBES.into_iter().zip(&report.tallies) {
        // A sheen's directions count as diffuse.
        assert!(tally.samples > 500 || lobe == Lobe::Sheen, "{lobe:?}: {}", tally.samples);
        // What the bound allows, and attains, depends on the estimates of the lobes' albedos: poor ones show here.
        assert!(tally.weight.value < 1000.0 && tally.of_bound.value <= 1.0 + 1e-4, "{lobe:?}: {tally:?}");
        assert!(tally.of_bound.value > 0.9 || lobe == Lobe::Sheen, "a bound that is never reached: {lobe:?}");
    }
    let compared = |lobe: Lobe| report.lobes[lobe as usize].compared;
    for lobe in LOBES.into_iter().filter(|lobe| !lobe.is_delta()) {
        assert!(compared(lobe) > 10_000, "{lobe:?}: {}", compared(lobe));
    }
    // It is not the same arithmetic twice.
    assert!(report.pdf.error.value > 1e-8);
}

#[test]
fn the_report_depends_on_the_seed_alone() {
    let text = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(20_000, seed)).to_string()
    };
    assert_eq!(text(1, 3), text(3, 3));
    assert_ne!(text(1, 3), text(1, 4));
}

#[test]
fn lobes_are_listed_in_their_order() {
    for (i, lobe) in LOBES.into_iter().enumerate() {
        assert_eq!(lobe as usize, i);
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
