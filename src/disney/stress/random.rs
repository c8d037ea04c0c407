//! Random input, more of it at the ends of ranges than between them.

use super::{Case, Material};
use crate::color::Rgb;
use crate::disney::dielectric::refracted;
use crate::disney::fresnel::dielectric_split;
use crate::disney::{DiffuseModel, Lobe, Masking, Model, Parameter, Params};
use crate::math::{Number, Real, V3, hash};

/// Numbers in [0, 1) from a seed and a running count.
pub(in crate::disney) struct Random {
    seed: u64,
    count: u64,
}

impl Random {
    pub(in crate::disney) fn new(seed: u64) -> Self {
        Self { seed, count: 0 }
    }

    pub(in crate::disney) fn bits(&mut self) -> u64 {
        self.count += 1;
        hash::combine(self.seed, self.count)
    }

    pub(in crate::disney) fn unit(&mut self) -> f32 {
        hash::unit_f32((self.bits() >> 32) as u32)
    }

    /// One of these.
    fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.bits() % choices.len() as u64) as usize]
    }

    /// 10^-x for a uniform x up to `decades`.
    fn log_uniform(&mut self, decades: f32) -> f32 {
        Real::powf(10.0, -decades * self.unit())
    }
}

/// What the suite draws.
impl Random {
    /// A number for a sampler: now and then the smallest or the largest.
    pub(super) fn sampler_unit(&mut self) -> f32 {
        match self.bits() % 16 {
            0 => 0.0,
            1 => 1.0 - f32::EPSILON / 2.0,
            _ => self.unit(),
        }
    }

    /// Of [0, 1]: half the time at an end, next to one, or denormal.
    fn share(&mut self) -> f32 {
        match self.bits() % 16 {
            0..=2 => 0.0,
            3..=5 => 1.0,
            6 => 1e-40,
            7 => self.log_uniform(9.0),
            8 => 1.0 - self.log_uniform(7.0),
            _ => self.unit(),
        }
    }

    fn color(&mut self) -> Rgb {
        match self.bits() % 8 {
            0 => Rgb::BLACK,
            1 => Rgb::WHITE,
            2 => self.pick(&[Rgb::new(1.0, 0.0, 0.0), Rgb::new(0.0, 1.0, 0.0), Rgb::new(0.0, 0.0, 1.0)]),
            3 => Rgb::grey(self.share()),
            4 => Rgb::new(self.share(), self.share(), self.share()) * self.pick(&[1e-3, 1e-20, 1e-40]),
            _ => Rgb::new(self.share(), self.share(), self.share()),
        }
    }

    fn ior(&mut self) -> f32 {
        let (min, max) = (Parameter::Ior.min(), Parameter::Ior.max());
        match self.bits() % 10 {
            0 => 1.0,
            1 => min,
            2 => max,
            // Either side of where an interface counts as smooth.
            3 => 1.0 + self.pick(&[1.0, -1.0]) * 1.01e-3,
            4 => 1.0 + self.pick(&[1.0, -1.0]) * 0.99e-3,
            5 => 1.0 + self.pick(&[1.0, -1.0]) * self.log_uniform(7.0).min(0.9),
            6 => min + (max - min) * self.unit(),
            7 => min + (1.0 - min) * self.unit(),
            _ => 1.0 + 1.5 * self.unit(),
        }
    }

    fn params(&mut self) -> Params {
        let mut params = Params { base_color: self.color(), ..Params::default() };
        // Each lobe alone would be rare otherwise.
        let only = self.bits() | self.bits();
        for p in Parameter::ALL {
            *params.get_mut(p) = match p {
                Parameter::Ior => self.ior(),
                Parameter::Metallic | Parameter::SpecTrans | Parameter::DiffTrans | Parameter::Sheen
                    if only >> (p as u32) & 1 == 0 =>
                {
                    0.0
                }
                Parameter::Specular | Parameter::Clearcoat => {
                    let max = self.pick(&[1.0, p.max()]);
                    self.share() * max
                }
                _ => self.share() * p.max(),
            };
        }
        params.thin_walled = self.bits().is_multiple_of(3);
        params.transmission_color = self.bits().is_multiple_of(2).then(|| self.color());
        params.diff_trans_color = self.bits().is_multiple_of(2).then(|| self.color());
        params
    }

    pub(in crate::disney) fn material(&mut self) -> Material {
        let model = match self.bits() % 32 {
            0 => Model::Diffuse,
            1 => Model::Mirror,
            2 => Model::Dielectric,
            _ => Model::Disney,
        };
        Material {
            model,
            params: self.params(),
            masking: self.pick(&[Masking::Matched, Masking::Remapped]),
            diffuse: self.pick(&[DiffuseModel::Burley, DiffuseModel::Lambert, DiffuseModel::LambertFresnel]),
        }
    }

    /// A unit vector from either side, half the time with a cosine spread evenly in its logarithm down to 10⁻⁷.
    pub(in crate::disney) fn view(&mut self) -> V3<f32> {
        let z = match self.bits() % 8 {
            0..=3 => self.log_uniform(7.0),
            4 => 1.0 - self.log_uniform(7.0),
            5 => self.pick(&[1.0, 1e-7]),
            _ => 1.0 - self.unit(),
        };
        let r = ((1.0 - z) * (1.0 + z)).safe_sqrt();
        let anywhere = self.unit();
        let (sin, cos) = self.pick(&[0.0, 0.25, anywhere, anywhere]).sin_cos_turn();
        V3::new(r * cos, r * sin, self.pick(&[z, z, -z]))
    }

    /// A direction to the light to evaluate at: one that was sampled, one near the mirror direction or near the refracted one, or any.
    pub(super) fn light(&mut self, case: &Case) -> V3<f32> {
        let Case { material, wo, .. } = *case;
        let nearby = match self.bits() % 8 {
            0..=2 if !case.lobe.is_none_or(Lobe::is_delta) => return case.wi,
            3..=4 => V3::new(-wo.x, -wo.y, wo.z),
            5..=6 => {
                let eta = if wo.z > 0.0 { material.params.ior } else { 1.0 / material.params.ior };
                let eta = if material.params.thin_walled { 1.0 } else { eta };
                refracted(wo, dielectric_split(wo.z.abs(), eta).cos_t, eta)
            }
            _ => return self.view(),
        };
        let size = self.log_uniform(6.0);
        let off = V3::new(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5);
        (nearby + off * size).normalize()
    }
}

impl Material<f64> {
    /// Every input that isn't 0 or 1, which are exact, moved up or down, at random, by `halves` times half a unit in the last place
    /// of `f32`.
    pub(super) fn nudged(mut self, random: &mut Random, halves: f64) -> Self {
        for p in Parameter::ALL {
            let value = self.params.get_mut(p);
            *value = random.nudged(*value, halves);
        }
        self.params.base_color = random.nudged_color(self.params.base_color, halves);
        self.params.transmission_color =
            self.params.transmission_color.map(|c| random.nudged_color(c, halves));
        self.params.diff_trans_color = self.params.diff_trans_color.map(|c| random.nudged_color(c, halves));
        self
    }
}

impl Random {
    fn nudged(&mut self, value: f64, halves: f64) -> f64 {
        let single = value as f32;
        if single == 0.0 || single == 1.0 {
            return value;
        }
        let neighbour = if self.bits() >> 63 == 0 { single.next_up() } else { single.next_down() };
        value + 0.5 * halves * (f64::from(neighbour) - value)
    }

    fn nudged_color(&mut self, color: Rgb<f64>, halves: f64) -> Rgb<f64> {
        color.to_array().map(|channel| self.nudged(channel, halves)).into()
    }

    pub(super) fn nudged_direction(&mut self, w: V3<f64>, halves: f64) -> V3<f64> {
        V3::new(self.nudged(w.x, halves), self.nudged(w.y, halves), self.nudged(w.z, halves))
    }
}
