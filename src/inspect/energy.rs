//! f·|cos θi| as the energy that it carries.

use crate::color::Rgb;
use crate::disney::{Bsdf, BsdfSample, Lobe};
use crate::math::V3;
use crate::math::sobol::{Purpose, Sampler};

/// Samples that are looked at to learn the lobes' eta.
const TRIES: u32 = 1024;

/// A BSDF seen from one direction, its light weighed by energy: radiance that crosses an interface is squeezed by 1/eta² (Veach 1997,
/// section 5.2), so what a refracting lobe gives counts eta² times. Then its integral is the albedo, and the density of sampling
/// can follow it.
#[derive(Clone, Debug)]
pub(super) struct Energy<'a> {
    bsdf: &'a Bsdf,
    pub(super) wo: V3<f32>,
    /// The lobes with an eta that is not 1, and its square.
    refracting: Vec<(Lobe, f64)>,
}

impl<'a> Energy<'a> {
    /// `bsdf` seen from `wo`. A lobe's eta is read off its samples.
    pub(super) fn new(bsdf: &'a Bsdf, wo: V3<f32>) -> Self {
        let mut refracting: Vec<(Lobe, f64)> = Vec::new();
        for i in 0..TRIES {
            let [u_lobe, u, v, _] = Sampler::new(0, 0, 0, i, 1).set(0, Purpose::Bsdf);
            let Some(sample) = bsdf.sample(wo, u_lobe, [u, v]) else { continue };
            if sample.eta != 1.0 && !refracting.iter().any(|(lobe, _)| *lobe == sample.lobe) {
                refracting.push((sample.lobe, f64::from(sample.eta) * f64::from(sample.eta)));
            }
        }
        Self { bsdf, wo, refracting }
    }

    /// f·|cos θi| of one lobe that is no delta, in 1/sr.
    pub(super) fn lobe(&self, lobe: Lobe, wi: V3<f32>) -> Rgb<f64> {
        let eta2 = self.refracting.iter().find(|(l, _)| *l == lobe).map_or(1.0, |(_, eta2)| *eta2);
        self.bsdf.eval_lobe(lobe, self.wo, wi).cast::<f64>() * (eta2 * f64::from(wi.z.abs()))
    }

    /// f·|cos θi|, in 1/sr, apart from delta lobes, and the density of sampling.
    pub(super) fn value_and_density(&self, wi: V3<f32>) -> (Rgb<f64>, f64) {
        let (f, pdf) = self.bsdf.eval_with_pdf(self.wo, wi);
        let mut value = f.cast::<f64>();
        for &(lobe, eta2) in self.refracting.iter().filter(|_| wi.z < 0.0) {
            value += self.bsdf.eval_lobe(lobe, self.wo, wi).cast::<f64>() * (eta2 - 1.0);
        }
        (value * f64::from(wi.z.abs()), pdf.into())
    }

    /// The energy that a sample stands for: f·|cos θi|/pdf.
    pub(super) fn weight(&self, sample: &BsdfSample) -> Rgb<f64> {
        let value = if sample.lobe.is_delta() {
            let eta2 = f64::from(sample.eta) * f64::from(sample.eta);
            sample.f.cast::<f64>() * (eta2 * f64::from(sample.wi.z.abs()))
        } else {
            self.value_and_density(sample.wi).0
        };
        value / f64::from(sample.pdf)
    }
}
