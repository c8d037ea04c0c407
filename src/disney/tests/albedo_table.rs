//! The directional albedo over roughness and angle: quadrature in `f64` against importance sampling in `f32` and against the values
//! that were accepted, with a closed form and an independent rule for one column.

use std::fmt::Write;

use rayon::prelude::*;

use super::albedo::{estimate, quadrature};
use super::{Random, Twin};
use crate::color::Rgb;
use crate::disney::{DiffuseModel, Masking, Params};
use crate::math::{Number, Real, V3};

const ROUGHNESSES: [f32; 12] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
const COSINES: [f32; 6] = [1.0, 0.8, 0.5, 0.2, 0.1, 0.02];

/// The material and the side it is seen from; white where it has a colour, so that what is missing is lost.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Metal,
    RemappedMetal,
    Plastic,
    GlassFromOutside,
    GlassFromInside,
    /// Alone; its gloss is 1 - roughness.
    Coat,
    Wax,
}

impl Kind {
    const ALL: [Self; 7] = [
        Self::Metal,
        Self::RemappedMetal,
        Self::Plastic,
        Self::GlassFromOutside,
        Self::GlassFromInside,
        Self::Coat,
        Self::Wax,
    ];

    fn material(self, roughness: f32) -> Twin {
        let white = Params { base_color: Rgb::WHITE, roughness, ..Params::default() };
        let params = match self {
            Self::Metal | Self::RemappedMetal => Params { metallic: 1.0, ..white },
            Self::Plastic => white,
            Self::GlassFromOutside | Self::GlassFromInside => Params { spec_trans: 1.0, ..white },
            Self::Coat => Params {
                base_color: Rgb::BLACK,
                specular: 0.0,
                f90: 0.0,
                clearcoat: 1.0,
                clearcoat_gloss: 1.0 - roughness,
                ..white
            },
            Self::Wax => Params { subsurface: 1.0, specular: 0.0, f90: 0.0, ..white },
        };
        let masking = if matches!(self, Self::RemappedMetal) { Masking::Remapped } else { Masking::Matched };
        Twin::disney(&format!("{self:?} {roughness}"), &params, masking, DiffuseModel::Burley)
    }

    fn view(self, cosine: f32) -> V3<f32> {
        let wo = V3::new(((1.0 - cosine) * (1.0 + cosine)).sqrt(), 0.0, cosine);
        if matches!(self, Self::GlassFromInside) { wo.mirrored_z() } else { wo }
    }
}

/// Both ways to the albedo for all angles, after checking that they agree. Smooth glass is made of delta lobes and has none.
fn row(kind: Kind, roughness: f32) -> [f64; COSINES.len()] {
    let material = kind.material(roughness);
    COSINES.map(|cosine| {
        let wo = kind.view(cosine);
        let integral = quadrature(&material, wo, 1e-6);
        let mut random = Random::new(u64::from(cosine.to_bits()));
        let (mean, error) = estimate(20_000, || {
            let sample = material.single.sample(wo, random.unit(), random.square());
            let spread = sample.filter(|s| !s.lobe.is_delta());
            spread.map_or(0.0, |s| f64::from(s.f.r * s.wi.z.abs() / s.pdf))
        });
        assert!(
            (mean - integral).abs() <= 4.5 * error + 3e-4 * integral,
            "{} at {cosine}: {mean} ± {error} against {integral}",
            material.name
        );
        integral
    })
}

#[test]
fn the_table_is_what_was_accepted() {
    let mut table = String::new();
    for kind in Kind::ALL {
        let rows: Vec<_> = ROUGHNESSES.into_par_iter().map(|roughness| row(kind, roughness)).collect();
        writeln!(table, "{kind:?}, by roughness (down) and cosine (across)").unwrap();
        let heads = COSINES.map(|cosine| format!("{cosine:>8}"));
        writeln!(table, "      {}", heads.concat()).unwrap();
        for (roughness, row) in ROUGHNESSES.into_iter().zip(rows) {
            writeln!(table, "{roughness:<6}{}", row.map(|albedo| format!("{albedo:8.4}")).concat()).unwrap();
        }
        table.push('\n');
    }
    insta::assert_snapshot!("directional_albedo", table);
}

/// At normal incidence nothing masks the view, and half vectors of θ send light to 2θ: for F = 1
///
/// E = 2 ∫ π D(θ) G1(2θ) cos θ sin θ dθ up to θ = π/4.
///
/// With alpha = 1, π D = 1 and G1(2θ) = 2 - 1/cos² θ, so E = 2 [sin² θ + ln cos θ] = 1 - ln 2.
#[test]
fn a_white_metal_seen_head_on_has_its_closed_form() {
    let head_on = |roughness| quadrature(&Kind::Metal.material(roughness), Kind::Metal.view(1.0), 1e-6);
    assert!((head_on(1.0) - (1.0 - std::f64::consts::LN_2)).abs() < 2e-5, "{}", head_on(1.0));
    for roughness in [0.2, 0.4, 0.5, 0.6, 0.8, 0.9] {
        let alpha2 = Real::powf(f64::from(roughness), 4.0);
        // In c = cos² θ, 2 cos θ sin θ dθ = dc from ½ to 1, with the textbook's forms of D and G1.
        let n = 200_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let c = 0.5 + 0.5 * (f64::from(i) + 0.5) / f64::from(n);
                let pi_d = alpha2 / Number::sqr(1.0 + (alpha2 - 1.0) * c);
                let cos_light = 2.0 * c - 1.0;
                let tan2 = 1.0 / Number::sqr(cos_light) - 1.0;
                pi_d * 2.0 / (1.0 + (1.0 + alpha2 * tan2).sqrt())
            })
            .sum();
        let expected = 0.5 * sum / f64::from(n);
        let is = head_on(roughness);
        assert!((is - expected).abs() < 5e-5, "{roughness}: {is} against {expected}");
    }
}
