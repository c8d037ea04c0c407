//! What a BSDF reflects where, and how well its sampler follows.
//!
//! The plane of incidence holds the normal and the tangent. The viewer is on its left, at -θo; the angle of a direction to the
//! light is counted from the normal to the right, in degrees, so that the mirror direction is at +θo and angles beyond ±90° are
//! below the surface. Values are luminances.

use rayon::prelude::*;

use super::energy::Energy;
use super::maps::Map;
use super::quadrature::{Integrals, integrate};
use crate::color::Rgb;
use crate::disney::{Bsdf, Lobe};
use crate::math::V3;
use crate::math::sobol::{Purpose, Sampler};

/// The angles of incidence of slices and of the check of sampling, in degrees.
pub const VIEWS: [f64; 4] = [0.0, 30.0, 60.0, 80.0];
/// The angles of incidence of the albedo, in degrees.
const ALBEDO_ANGLES: [f64; 22] = [
    0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 74.0, 77.0, 80.0,
    83.0, 85.0, 87.0, 89.0,
];
/// Independently scrambled sample sets of an estimate; the spread of their means is the error.
const REPLICATES: u32 = 16;
/// Samples of each set.
const SAMPLES: u32 = 512;
/// Values of `u_lobe` that are tried when looking for delta lobes.
const TRIES: u32 = 512;

/// A curve over angles: (angle in degrees, value).
pub type Curve = Vec<(f64, f64)>;

/// Everything that is measured of a material.
#[derive(Clone, Debug)]
pub struct Measurements {
    /// The lobes that are there.
    pub lobes: Vec<Lobe>,
    /// One for each of [`VIEWS`].
    pub views: Vec<View>,
    /// The albedo against the angle of incidence.
    pub albedo: Vec<Estimate>,
}

/// What is seen from one direction.
#[derive(Clone, Debug)]
pub struct View {
    /// The angle of incidence in degrees.
    pub angle: f64,
    /// f·|cos θi| of each lobe that is no delta, in 1/sr.
    pub lobes: Vec<(Lobe, Curve)>,
    /// Their sum.
    pub total: Curve,
    /// The same counted by energy: what the density should follow.
    pub wanted: Curve,
    /// The density of sampling, in 1/sr.
    pub density: Curve,
    /// Delta lobes.
    pub spikes: Vec<Spike>,
    /// What sampling estimates.
    pub estimate: Estimate,
    /// What quadrature finds without it, apart from delta lobes.
    pub integrals: Integrals,
    /// `wanted` and `density` over all directions, for some views.
    pub(super) map: Option<Map>,
}

/// A delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spike {
    /// The lobe.
    pub lobe: Lobe,
    /// Its direction in degrees.
    pub angle: f64,
    /// The fraction of the light that goes there.
    pub weight: f64,
}

/// An estimate of the directional albedo by the BSDF's own sampler.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The angle of incidence in degrees.
    pub angle: f64,
    /// The albedo per channel.
    pub albedo: Rgb<f64>,
    /// The standard error of its luminance.
    pub error: f64,
    /// The albedo's luminance without delta lobes: what quadrature finds.
    pub smooth: f64,
    /// Each lobe's part of the luminance.
    pub lobes: Vec<(Lobe, f64)>,
    /// The standard deviation of one sample's weight f·|cos θi|/pdf over the mean: 0 is perfect sampling.
    pub relative_deviation: f64,
    /// The largest weight.
    pub largest_weight: f64,
    /// How many of the samples were made for each lobe, as a fraction.
    pub shares: Vec<(Lobe, f64)>,
    /// The fraction of samples that found no direction.
    pub lost: f64,
}

impl Estimate {
    /// The albedo's luminance.
    pub fn luminance(&self) -> f64 {
        self.albedo.luminance()
    }
}

/// Measures a BSDF.
pub fn measure(bsdf: &Bsdf) -> Measurements {
    Measurements {
        lobes: bsdf.lobes(),
        views: VIEWS.par_iter().map(|&angle| view(bsdf, angle)).collect(),
        albedo: ALBEDO_ANGLES
            .par_iter()
            .map(|&angle| estimate(bsdf, &Energy::new(bsdf, direction(-angle)), angle).0)
            .collect(),
    }
}

/// The direction at an angle of the plane of incidence, in degrees.
pub(super) fn direction(angle: f64) -> V3<f32> {
    let radians = angle.to_radians();
    V3::new(libm::sin(radians), 0.0, libm::cos(radians)).cast()
}

fn view(bsdf: &Bsdf, angle: f64) -> View {
    let wo = direction(-angle);
    let energy = Energy::new(bsdf, wo);
    let (estimate, below) = estimate(bsdf, &energy, angle);
    let angles = slice_angles(angle, below.is_some());
    let curve = |value: &dyn Fn(V3<f32>) -> f64| -> Curve {
        angles.iter().map(|&a| (a, value(direction(a)))).collect()
    };
    let seen = |f: Rgb, wi: V3<f32>| f64::from(f.luminance() * wi.z.abs());
    let lobes = bsdf.lobes().into_iter().filter(|lobe| !lobe.is_delta());
    let lobes = lobes.map(|lobe| (lobe, curve(&|wi| seen(bsdf.eval_lobe(lobe, wo, wi), wi)))).collect();
    let integrals = integrate(&energy, below);
    // Maps of two views show what there is to see: one near the normal, one near grazing.
    let is_mapped = angle == VIEWS[1] || angle == VIEWS[2];
    View {
        angle,
        lobes,
        total: curve(&|wi| seen(bsdf.eval(wo, wi), wi)),
        wanted: curve(&|wi| energy.value_and_density(wi).0.luminance()),
        density: curve(&|wi| energy.value_and_density(wi).1),
        spikes: spikes(bsdf, wo),
        map: (is_mapped && estimate.smooth > 0.0).then(|| Map::new(&energy, angle, below.is_some())),
        estimate,
        integrals,
    }
}

/// Every half degree, and closer and closer around the mirror direction, where a highlight may be narrow.
fn slice_angles(mirror: f64, below: bool) -> Vec<f64> {
    let end = if below { 360 } else { 180 };
    let mut angles: Vec<f64> = (-end..=end).map(|i| f64::from(i) / 2.0).collect();
    let mut off = 0.005;
    while off < 8.0 {
        angles.extend([mirror - off, mirror + off]);
        off *= 1.25;
    }
    angles.push(mirror);
    angles.retain(|a| a.abs() <= f64::from(end) / 2.0);
    angles.sort_unstable_by(f64::total_cmp);
    angles.dedup();
    angles
}

/// The delta lobes, each once.
fn spikes(bsdf: &Bsdf, wo: V3<f32>) -> Vec<Spike> {
    let mut spikes: Vec<Spike> = Vec::new();
    for i in 0..TRIES {
        let u_lobe = (i as f32 + 0.5) / TRIES as f32;
        let Some(sample) = bsdf.sample(wo, u_lobe, [0.5, 0.5]).filter(|s| s.lobe.is_delta()) else {
            continue;
        };
        let weight = f64::from(sample.f.luminance() * sample.wi.z.abs() * sample.eta * sample.eta);
        if !spikes.iter().any(|s| s.lobe == sample.lobe) {
            let angle = libm::atan2(sample.wi.x.into(), sample.wi.z.into()).to_degrees();
            spikes.push(Spike { lobe: sample.lobe, angle, weight });
        }
    }
    spikes
}

/// Estimates the albedo; also the mean direction of the samples below the surface, if there are any that are no delta.
fn estimate(bsdf: &Bsdf, energy: &Energy<'_>, angle: f64) -> (Estimate, Option<V3<f64>>) {
    let lobes = bsdf.lobes();
    let count = f64::from(REPLICATES * SAMPLES);
    let mut means = [0.0; REPLICATES as usize];
    let mut albedo = Rgb::<f64>::BLACK;
    let mut parts = vec![0.0; lobes.len()];
    let mut shares: Vec<(Lobe, f64)> = lobes.iter().map(|&lobe| (lobe, 0.0)).collect();
    let (mut smooth, mut lost, mut squares, mut largest_weight) = (0.0, 0.0, 0.0, 0.0f64);
    let mut below = V3::<f64>::new(0.0, 0.0, 0.0);
    for i in 0..REPLICATES * SAMPLES {
        let [u_lobe, u, v, _] =
            Sampler::new(0, (angle * 16.0) as u32, 0, i, REPLICATES).set(0, Purpose::Bsdf);
        let Some(sample) = bsdf.sample(energy.wo, u_lobe, [u, v]) else {
            lost += 1.0 / count;
            continue;
        };
        let weight = energy.weight(&sample);
        albedo += weight / count;
        if !sample.lobe.is_delta() {
            smooth += weight.luminance() / count;
        }
        means[(i % REPLICATES) as usize] += weight.luminance() / f64::from(SAMPLES);
        squares += weight.luminance() * weight.luminance() / count;
        largest_weight = largest_weight.max(weight.luminance());
        for (part, &lobe) in parts.iter_mut().zip(&lobes) {
            *part += match sample.lobe.is_delta() {
                true if sample.lobe == lobe => weight.luminance() / count,
                true => 0.0,
                false => energy.lobe(lobe, sample.wi).luminance() / (f64::from(sample.pdf) * count),
            };
        }
        match shares.iter_mut().find(|(lobe, _)| *lobe == sample.lobe) {
            Some((_, share)) => *share += 1.0 / count,
            None => shares.push((sample.lobe, 1.0 / count)),
        }
        if sample.wi.z < 0.0 && !sample.lobe.is_delta() {
            below = below + sample.wi.cast();
        }
    }
    let mean = albedo.luminance();
    let replicates = f64::from(REPLICATES);
    let spread = means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / (replicates - 1.0);
    let estimate = Estimate {
        angle,
        albedo,
        error: (spread / replicates).sqrt(),
        smooth,
        lobes: lobes.into_iter().zip(parts).collect(),
        relative_deviation: if mean > 0.0 { (squares - mean * mean).max(0.0).sqrt() / mean } else { 0.0 },
        largest_weight,
        shares,
        lost,
    };
    (estimate, (below.z < 0.0).then(|| below.normalize()))
}
