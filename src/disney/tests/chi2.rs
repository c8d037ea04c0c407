//! Samplers against their densities: Pearson's chi² test, the samples in `f32`, the density integrated in `f64`.

use super::mercator::{SPHERE_CELLS, Sphere};
use super::{Random, Twin, cast, mixed_materials, views, views_from_both_sides};
use crate::color::Rgb;
use crate::disney::clearcoat::Clearcoat;
use crate::disney::microfacet::{Gtr2, alpha_from_roughness, smith};
use crate::disney::pair::Pair;
use crate::disney::{Bsdf, DiffuseModel, Masking, Params};
use crate::math::V3;
use crate::math::stats::{chi2_p_value, sidak};

const SAMPLES: u32 = 40_000;
/// The probability of a false alarm of one `#[test]`; seeds are fixed, so an alarm comes always or never.
const SIGNIFICANCE: f64 = 0.01;

/// The probability that samples from `pdf` differ from it at least as much as those of `sample` do.
///
/// Samples that are lost on the wrong side of the horizon, or belong to a delta lobe, are one more cell. Cells that expect fewer than
/// five samples are pooled. The cells are equally wide in the logarithm of the angle from where the peaks are, so that a lobe of any
/// alpha is spread over many of them.
fn p_value(
    wo: V3<f32>,
    ior: f64,
    seed: u64,
    sample: impl Fn(f32, [f32; 2]) -> Option<V3<f32>>,
    pdf: impl Fn(V3<f64>) -> f64,
) -> f64 {
    let grid = Sphere::new(wo.cast(), ior);
    let count = f64::from(SAMPLES);
    let mut observed = vec![0.0; SPHERE_CELLS + 1];
    let mut random = Random::new(seed);
    for _ in 0..SAMPLES {
        let cell = sample(random.unit(), random.square()).map_or(SPHERE_CELLS, |wi| grid.cell(wi.cast()));
        observed[cell] += 1.0;
    }
    let mut expected: Vec<f64> =
        (0..SPHERE_CELLS).map(|cell| count * grid.integrate(cell, 0.4 / count, &pdf)).collect();
    let lost = count - expected.iter().sum::<f64>();
    assert!(lost > -1e-3 * count, "the density integrates to {} > 1", 1.0 - lost / count);
    expected.push(lost.max(0.0));
    pearson(&observed, &expected)
}

fn pearson(observed: &[f64], expected: &[f64]) -> f64 {
    let mut statistic = 0.0;
    let mut cells = 0u32;
    let mut pool = (0.0, 0.0);
    let mut add = |o: f64, e: f64| {
        statistic += (o - e) * (o - e) / e;
        cells += 1;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if e >= 5.0 {
            add(o, e);
        } else {
            pool = (pool.0 + o, pool.1 + e);
        }
    }
    if pool.1 >= 1.0 {
        add(pool.0, pool.1);
    } else {
        assert!(pool.0 < 12.0, "{} samples where the density is next to 0: {}", pool.0, pool.1);
    }
    if cells < 2 { 1.0 } else { chi2_p_value(statistic, f64::from(cells - 1)) }
}

fn p_value_of(material: &Twin, wo: V3<f32>, seed: u64) -> f64 {
    p_value(
        wo,
        material.ior,
        seed,
        |u_lobe, u| material.single.sample(wo, u_lobe, u).filter(|s| !s.lobe.is_delta()).map(|s| s.wi),
        |wi| material.double.pdf(wo.cast(), wi),
    )
}

fn check_all(materials: &[Twin]) {
    let tests = materials.len() * views_from_both_sides().len();
    let level = sidak(SIGNIFICANCE, u32::try_from(tests).unwrap());
    for (m, material) in materials.iter().enumerate() {
        for (v, wo) in views_from_both_sides().into_iter().enumerate() {
            let p = p_value_of(material, wo, (m * 10 + v) as u64);
            assert!(p > level, "{} from {wo:?}: p = {p:e}", material.name);
        }
    }
}

#[test]
fn lambert_is_sampled_by_its_pdf() {
    let color = Rgb::grey(0.5);
    check_all(&[Twin {
        name: "lambert".into(),
        single: Bsdf::diffuse(color),
        double: Bsdf::diffuse(color.cast()),
        ior: 1.0,
    }]);
}

#[test]
fn specular_alone_is_sampled_by_its_pdf() {
    // A metal has no other lobe.
    let metal = |roughness, anisotropic, masking| {
        let params = Params { metallic: 1.0, roughness, anisotropic, ..Params::default() };
        Twin::disney(&format!("{roughness} {anisotropic}"), &params, masking, DiffuseModel::Burley)
    };
    check_all(&[
        metal(0.0, 0.0, Masking::Matched),
        metal(0.2, 0.0, Masking::Remapped),
        metal(0.5, 0.0, Masking::Matched),
        metal(1.0, 0.0, Masking::Remapped),
        metal(0.15, 1.0, Masking::Matched),
        metal(0.6, 0.8, Masking::Remapped),
        metal(1.0, 1.0, Masking::Matched),
    ]);
}

#[test]
fn clearcoat_alone_is_sampled_by_its_pdf() {
    let level = sidak(SIGNIFICANCE, 12);
    for gloss in [0.0f32, 0.7, 1.0] {
        let params = Params { clearcoat: 1.0, clearcoat_gloss: gloss, ..Params::default() };
        let single = Clearcoat::new(&params).unwrap();
        let double = Clearcoat::new(&cast(&params)).unwrap();
        for (v, wo) in views().into_iter().enumerate() {
            let p = p_value(
                wo,
                1.0,
                v as u64,
                |_, u| Some(single.sample(wo, u)).filter(|wi| wi.z > 0.0),
                |wi| Pair::new(wo.cast(), wi).map_or(0.0, |pair| double.eval_with_pdf(&pair).1),
            );
            assert!(p > level, "gloss {gloss} from {wo:?}: p = {p:e}");
        }
    }
}

#[test]
fn more_than_forty_mixed_materials_are_sampled_by_their_pdf() {
    let materials = mixed_materials();
    assert!(materials.len() > 40);
    check_all(&materials);
}

#[test]
fn lobes_that_are_equally_frequent_are_sampled_by_their_pdf_too() {
    let equal =
        |m: Twin| Twin { single: m.single.with_equal_lobes(), double: m.double.with_equal_lobes(), ..m };
    let materials: Vec<Twin> = mixed_materials().into_iter().step_by(4).map(equal).collect();
    check_all(&materials);
}

#[test]
fn transmission_alone_is_sampled_by_its_pdf() {
    // Without what reflects in front: from inside nothing else is there anyway.
    let clear = |roughness, anisotropic, ior, thin_walled, masking| {
        let params = Params {
            base_color: Rgb::WHITE,
            spec_trans: 1.0,
            roughness,
            anisotropic,
            ior,
            thin_walled,
            ..Params::default()
        };
        Twin::disney(&format!("{params:?}"), &params, masking, DiffuseModel::Burley)
    };
    let leaf = |thin_walled| {
        let params = Params { diff_trans: 2.0, specular: 0.0, f90: 0.0, thin_walled, ..Params::default() };
        Twin::disney(&format!("leaf, thin: {thin_walled}"), &params, Masking::Matched, DiffuseModel::Burley)
    };
    check_all(&[
        clear(0.032, 0.0, 1.5, false, Masking::Matched),
        clear(0.2, 0.0, 1.5, false, Masking::Remapped),
        clear(0.5, 0.0, 1.33, false, Masking::Matched),
        clear(1.0, 0.0, 1.5, false, Masking::Matched),
        clear(0.4, 0.9, 2.0, false, Masking::Matched),
        clear(0.3, 0.0, 0.6, false, Masking::Matched),
        clear(0.1, 0.0, 1.5, true, Masking::Matched),
        clear(0.8, 0.5, 1.5, true, Masking::Matched),
        leaf(false),
        leaf(true),
    ]);
}

#[test]
fn a_wrong_jacobian_of_refraction_is_found_out() {
    let glass = &mixed_materials()[12];
    assert!(glass.name.starts_with("ground glass"));
    for wo in [views()[1], views()[0].mirrored_z()] {
        let sample = |u_lobe: f32, u: [f32; 2]| glass.single.sample(wo, u_lobe, u).map(|s| s.wi);
        let pdf = |wi: V3<f64>| glass.double.pdf(wo.cast(), wi);
        assert!(p_value(wo, glass.ior, 1, sample, pdf) > SIGNIFICANCE);
        // 3% more where light passes, as a forgotten factor would have it, only far less.
        let wrong = |wi: V3<f64>| pdf(wi) * if wi.z * f64::from(wo.z) < 0.0 { 0.97 } else { 1.0 };
        assert!(p_value(wo, glass.ior, 1, sample, wrong) < 1e-6);
    }
}

#[test]
fn a_wrong_pdf_is_found_out() {
    let params = |roughness| Params { metallic: 1.0, roughness, ..Params::default() };
    let alpha = alpha_from_roughness(0.5f64, 0.0);
    let (d, wo) = (Gtr2::new(alpha), views()[2]);
    let bsdf = Bsdf::disney(&params(0.5), Masking::Matched, DiffuseModel::Burley);
    let sample = |u_lobe: f32, u: [f32; 2]| bsdf.sample(wo, u_lobe, u).map(|s| s.wi);
    let half = |wi: V3<f64>| Pair::new(wo.cast(), wi);

    let right = |wi| half(wi).map_or(0.0, |p| 0.5 * d.density(&p) * smith(p.wo, alpha));
    assert!(p_value(wo, 1.0, 1, sample, right) > SIGNIFICANCE);
    // All normals of D instead of the visible ones.
    let all_normals = |wi| half(wi).map_or(0.0, |p| 0.5 * d.density(&p) * p.sum.z / p.sum2);
    assert!(p_value(wo, 1.0, 1, sample, all_normals) < 1e-9);
    // Three percent more roughness.
    let rougher = Bsdf::disney(&cast(&params(0.515)), Masking::Matched, DiffuseModel::Burley);
    assert!(p_value(wo, 1.0, 1, sample, |wi| rougher.pdf(wo.cast(), wi)) < 1e-6);
    // A lobe's probability off by a few percent.
    let plastic = &mixed_materials()[0];
    let metallic = Params { base_color: Rgb::new(0.7, 0.3, 0.1), metallic: 0.2, ..Params::default() };
    let other = Bsdf::disney(&cast(&metallic), Masking::Matched, DiffuseModel::Burley);
    let p = p_value(
        wo,
        1.0,
        1,
        |u_lobe, u| plastic.single.sample(wo, u_lobe, u).map(|s| s.wi),
        |wi| other.pdf(wo.cast(), wi),
    );
    assert!(p < 1e-6, "{p}");
}

#[test]
fn the_pdf_integrates_to_one_less_delta_lobes_and_lost_samples() {
    for (m, material) in mixed_materials().iter().enumerate() {
        for (v, wo) in views_from_both_sides().into_iter().enumerate() {
            let grid = Sphere::new(wo.cast(), material.ior);
            let kept = grid.total(1e-5, &|wi| material.double.pdf(wo.cast(), wi));
            assert!(kept <= 1.0 + 1e-4, "{}: {kept}", material.name);
            let mut random = Random::new((m * 7 + v) as u64);
            let samples = 20_000;
            let found = (0..samples)
                .filter_map(|_| material.single.sample(wo, random.unit(), random.square()))
                .filter(|s| !s.lobe.is_delta())
                .count();
            let fraction = found as f64 / f64::from(samples);
            let deviation = (kept * (1.0 - kept).max(0.0) / f64::from(samples)).sqrt();
            assert!(
                (fraction - kept).abs() < 4.0 * deviation + 2e-4,
                "{} from {wo:?}: {kept} against {fraction}",
                material.name
            );
        }
    }
}
