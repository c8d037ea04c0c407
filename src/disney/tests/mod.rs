//! Tests of the whole BSDF: consistency, distribution, energy, extremes. This file holds what they share.

mod albedo;
mod albedo_table;
mod chi2;
mod consistency;
mod delta;
mod mercator;
mod stress;
mod transmission;

use super::stress::Random;
use super::{Bsdf, DiffuseModel, Masking, Parameter, Params};
use crate::color::Rgb;
use crate::math::{Number, Real, V3};

/// What the tests draw; the stress suite draws more at the extremes.
impl Random {
    fn square(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }

    /// In [0, 1], at an end a third of the time.
    fn parameter(&mut self) -> f32 {
        match self.bits() % 6 {
            0 => 0.0,
            1 => 1.0,
            _ => self.unit(),
        }
    }

    fn burley_params(&mut self) -> Params {
        let mut params = Params {
            base_color: Rgb::new(self.parameter(), self.parameter(), self.parameter()),
            ..Params::default()
        };
        for p in Parameter::BURLEY_2012 {
            *params.get_mut(p) = self.parameter() * p.max().min(4.0);
        }
        params
    }

    /// Parameters of a surface that may transmit.
    fn transmissive_params(&mut self) -> Params {
        let mut params = self.burley_params();
        if self.bits().is_multiple_of(2) {
            params.metallic = 0.0;
        }
        params.spec_trans = self.parameter();
        params.diff_trans = 2.0 * self.parameter();
        params.f90 = self.parameter();
        params.ior = match self.bits() % 6 {
            0 => 1.0,
            1 => Parameter::Ior.min(),
            2 => Parameter::Ior.max(),
            3 => 1.0 + 0.01 * (self.unit() - 0.5),
            _ => 1.0 + 1.5 * self.unit(),
        };
        params.thin_walled = self.bits().is_multiple_of(3);
        if self.bits().is_multiple_of(2) {
            let color = Rgb::new(self.parameter(), self.parameter(), self.parameter());
            params.transmission_color = Some(color);
            params.diff_trans_color = Some(color);
        }
        params
    }

    fn masking(&mut self) -> Masking {
        if self.bits().is_multiple_of(2) { Masking::Matched } else { Masking::Remapped }
    }

    fn diffuse_model(&mut self) -> DiffuseModel {
        match self.bits() % 3 {
            0 => DiffuseModel::Burley,
            1 => DiffuseModel::Lambert,
            _ => DiffuseModel::LambertFresnel,
        }
    }

    /// Of the upper hemisphere, with a cosine down to 10⁻⁷ a quarter of the time.
    fn direction(&mut self) -> V3<f32> {
        let z = match self.bits() % 4 {
            0 => Real::powf(10.0, -7.0 * self.unit()),
            _ => 1.0 - self.unit(),
        };
        let r = ((1.0 - z) * (1.0 + z)).safe_sqrt();
        let phi = 2.0 * std::f32::consts::PI * self.unit();
        V3::new(r * Real::cos(phi), r * Real::sin(phi), z)
    }

    /// Two directions; a third of the time near each other's mirror direction, now and then exactly there.
    fn pair(&mut self) -> (V3<f32>, V3<f32>) {
        let wo = self.direction();
        if !self.bits().is_multiple_of(3) {
            return (wo, self.direction());
        }
        let size = if self.bits().is_multiple_of(4) { 0.0 } else { Real::powf(10.0, -5.0 * self.unit()) };
        let off = V3::new(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5) * size;
        let wi = (V3::new(-wo.x, -wo.y, wo.z) + off).normalize();
        (wo, V3::new(wi.x, wi.y, wi.z.abs().max(1e-7)))
    }
}

fn cast(params: &Params) -> Params<f64> {
    params.cast()
}

/// A material with its `f64` twin.
#[derive(Clone)]
struct Twin {
    name: String,
    single: Bsdf<f32>,
    double: Bsdf<f64>,
    /// By which light that passes is bent: 1 where it isn't.
    ior: f64,
}

impl Twin {
    fn disney(name: &str, params: &Params, masking: Masking, diffuse: DiffuseModel) -> Self {
        Self {
            name: format!("{name} {masking:?} {diffuse:?}"),
            single: Bsdf::disney(params, masking, diffuse),
            double: Bsdf::disney(&cast(params), masking, diffuse),
            ior: if params.thin_walled { 1.0 } else { f64::from(params.ior) },
        }
    }
}

/// Materials that mix the lobes in different ways: named ones, and as many made at random.
fn mixed_materials() -> Vec<Twin> {
    let mut random = Random::new(77);
    let masking = |m: bool| if m { Masking::Remapped } else { Masking::Matched };
    let at_random = (0..14).map(|i| {
        let params = if i < 7 { random.burley_params() } else { random.transmissive_params() };
        Twin::disney(&format!("random {i} {params:?}"), &params, masking(i % 2 == 1), random.diffuse_model())
    });
    let at_random: Vec<Twin> = at_random.collect();
    reflecting_materials().into_iter().chain(transmitting_materials()).chain(at_random).collect()
}

fn reflecting_materials() -> Vec<Twin> {
    use DiffuseModel::{Burley, Lambert, LambertFresnel};
    use Masking::{Matched, Remapped};
    use Parameter as P;
    let brushed = [(P::Metallic, 1.0), (P::Roughness, 0.4), (P::Anisotropic, 1.0)];
    let half_wax = [(P::Subsurface, 0.5), (P::Roughness, 0.2), (P::Clearcoat, 0.5)];
    let satin = [(P::Clearcoat, 4.0), (P::ClearcoatGloss, 0.0), (P::Roughness, 0.7)];
    let everything = [
        (P::Metallic, 0.3),
        (P::Subsurface, 0.4),
        (P::SpecularTint, 0.8),
        (P::Roughness, 0.25),
        (P::Anisotropic, 0.7),
        (P::Sheen, 0.6),
        (P::Clearcoat, 0.9),
        (P::ClearcoatGloss, 0.8),
    ];
    vec![
        recipe("plastic", &[], Matched, Burley),
        recipe("polished plastic", &[(P::Roughness, 0.1)], Remapped, Burley),
        recipe("rough", &[(P::Roughness, 1.0), (P::Specular, 1.0)], Matched, LambertFresnel),
        recipe("metal", &[(P::Metallic, 1.0), (P::Roughness, 0.3)], Matched, Burley),
        recipe("brushed metal", &brushed, Remapped, Burley),
        recipe("mirror-like metal", &[(P::Metallic, 1.0), (P::Roughness, 0.0)], Matched, Burley),
        recipe("cloth", &[(P::Sheen, 1.0), (P::Roughness, 0.9), (P::Specular, 0.0)], Matched, Lambert),
        recipe("wax", &[(P::Subsurface, 1.0), (P::Roughness, 0.6)], Matched, Burley),
        recipe("half wax", &half_wax, Remapped, LambertFresnel),
        recipe("car paint", &[(P::Metallic, 0.5), (P::Clearcoat, 1.0)], Matched, Burley),
        recipe("satin coat", &satin, Remapped, Burley),
        recipe("everything", &everything, Remapped, Burley),
    ]
}

/// Glass, sheets and leaves; those at roughness 0 have delta lobes beside others.
fn transmitting_materials() -> Vec<Twin> {
    use Masking::{Matched, Remapped};
    use Parameter as P;
    let glass = |name: &str, scalars: &[(P, f32)], masking| {
        let all: Vec<_> = [(P::SpecTrans, 1.0)].into_iter().chain(scalars.iter().copied()).collect();
        recipe(name, &all, masking, DiffuseModel::Burley)
    };
    let sheet = |name: &str, scalars: &[(P, f32)]| {
        let mut params =
            Params { base_color: Rgb::new(0.9, 0.6, 0.3), thin_walled: true, ..Params::default() };
        for (parameter, value) in scalars {
            *params.get_mut(*parameter) = *value;
        }
        Twin::disney(name, &params, Matched, DiffuseModel::Burley)
    };
    let half = [(P::SpecTrans, 0.5), (P::Roughness, 0.3), (P::Clearcoat, 1.0), (P::Sheen, 0.5)];
    let metal = [(P::Metallic, 0.4), (P::Roughness, 0.25), (P::SpecularTint, 1.0)];
    let leaf = [(P::DiffTrans, 1.0), (P::Roughness, 0.4), (P::Subsurface, 0.5)];
    let everything = [(P::DiffTrans, 1.2), (P::SpecTrans, 0.4), (P::Roughness, 0.35), (P::Sheen, 1.0)];
    vec![
        glass("ground glass", &[(P::Roughness, 0.5)], Matched),
        glass("polished glass", &[(P::Roughness, 0.1)], Matched),
        glass("dense glass", &[(P::Roughness, 0.4), (P::Ior, 2.4)], Matched),
        glass("bubble", &[(P::Roughness, 0.3), (P::Ior, 0.7)], Matched),
        glass("hardly bending", &[(P::Roughness, 0.6), (P::Ior, 1.02)], Matched),
        glass("brushed glass", &[(P::Roughness, 0.5), (P::Anisotropic, 0.9)], Matched),
        glass("remapped glass", &[(P::Roughness, 0.3)], Remapped),
        glass("smooth glass under a coat", &[(P::Roughness, 0.0), (P::Clearcoat, 1.0)], Matched),
        glass("index-matched", &[(P::Roughness, 0.5), (P::Ior, 1.0)], Matched),
        recipe("half glass", &half, Matched, DiffuseModel::Burley),
        glass("glass and metal", &metal, Remapped),
        recipe(
            "smooth and diffuse",
            &[(P::SpecTrans, 0.5), (P::Roughness, 0.0)],
            Remapped,
            DiffuseModel::Lambert,
        ),
        recipe("solid leaf", &leaf, Matched, DiffuseModel::Burley),
        recipe("solid everything", &everything, Matched, DiffuseModel::LambertFresnel),
        sheet("frosted sheet", &[(P::SpecTrans, 1.0), (P::Roughness, 0.5)]),
        sheet("clear sheet", &[(P::SpecTrans, 0.7), (P::Roughness, 0.0)]),
        sheet("leaf", &leaf),
        sheet("sheet of everything", &everything),
    ]
}

fn recipe(name: &str, scalars: &[(Parameter, f32)], masking: Masking, diffuse: DiffuseModel) -> Twin {
    let mut params = Params { base_color: Rgb::new(0.7, 0.3, 0.1), ..Params::default() };
    for (parameter, value) in scalars {
        *params.get_mut(*parameter) = *value;
    }
    Twin::disney(name, &params, masking, diffuse)
}

/// Views from the normal to grazing, off the axes of anisotropy.
fn views() -> [V3<f32>; 4] {
    [1.0, 0.6, 0.2, 0.02].map(|z: f32| {
        let r = (1.0 - z * z).sqrt();
        V3::new(r * Real::cos(0.5), r * Real::sin(0.5), z)
    })
}

/// The same from inside.
fn views_from_both_sides() -> Vec<V3<f32>> {
    views().into_iter().chain(views().map(V3::mirrored_z)).collect()
}
