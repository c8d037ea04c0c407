//! MTL's Phong terms: `Ks`, `Ns` and `Ni` with their maps.

use super::{Conversion, SCALAR};
use crate::color::Rgb;
use crate::convert::tint::fit_tint;
use crate::convert::{PhongRoughness, Quality};
use crate::disney::{Model, Parameter};
use crate::math::Number;
use crate::scene::material::{Curve, Param, TextureChannel, TextureMap};
use crate::scene::source::MtlSlot;

/// A hue that Kd's tints to less than this is grey: rounding must not invent one.
const LEAST_TINT: f32 = 1e-3;

impl Conversion<'_> {
    pub(super) fn phong(&mut self) {
        self.set(Parameter::Specular, 0.0);
        if self.out.model != Model::Disney {
            return self.phong_left_out();
        }
        self.specular_color();
        self.refractive_index();
        self.exponent();
    }

    /// `Ks` and `map_Ks`.
    fn specular_color(&mut self) {
        let map = self.map(MtlSlot::Ks, TextureChannel::Y);
        let Some(mut ks) = self.source.ks.or(map.as_ref().map(|_| Rgb::WHITE)) else { return };
        ks = self.limited_color("Ks", ks);
        if ks.is_black() && map.is_some() {
            self.warn("Ks is black and would hide map_Ks; the map is taken as it is".to_owned());
            ks = Rgb::WHITE;
        }
        self.set(Parameter::Specular, ks.mean());
        if self.source.ks.is_some() {
            let (quality, reason) = match self.reflecting_index() {
                Some(_) => (Quality::Dropped, "Ni gives the specular"),
                None => {
                    let reason = "the mean is Disney's specular; Phong's Ks has no Fresnel term";
                    (Quality::Approximated, reason)
                }
            };
            self.note("Ks", quality, reason);
        }
        if let Some(map) = map {
            *self.out.scalar_mut(Parameter::Specular) = Param::Texture { map, factor: ks.mean() };
            let reason = "its luminance multiplies Disney's specular; Phong's Ks has no Fresnel term";
            self.note("map_Ks", Quality::Approximated, reason);
        }
        let tint = fit_tint(ks.cast(), self.source.kd.unwrap_or(Rgb::grey(0.8))).amount;
        if tint > LEAST_TINT {
            self.set(Parameter::SpecularTint, tint);
            let reason = format!("specular_tint {tint:.3} towards Kd's hue");
            self.note("Ks hue", Quality::Approximated, reason);
        }
    }

    /// `Ni`, where `illum` asks for Fresnel reflection.
    fn reflecting_index(&self) -> Option<f32> {
        self.source.ni.filter(|&ni| ni > 0.0 && self.source.illum.unwrap_or(2) >= 4)
    }

    /// The specular by `Ni`, where it decides.
    fn refractive_index(&mut self) {
        let Some(ni) = self.source.ni else { return };
        if self.source.illum.unwrap_or(2) < 4 {
            self.note("Ni", Quality::Dropped, "below illum 4 the specular is Ks's");
        } else if let Some(ni) = self.reflecting_index() {
            // F0 of a dielectric interface over the 0.08 of specular = 1.
            let f0 = ((ni - 1.0) / (ni + 1.0)).sqr();
            let specular = self.limited("specular from Ni", f0 / 0.08, Parameter::Specular.max());
            match self.out.scalar_mut(Parameter::Specular) {
                Param::Texture { factor, .. } => *factor = specular,
                constant => *constant = Param::Constant(specular),
            }
            let reason = "specular from the refractive index, in place of Ks's mean";
            self.note("Ni", Quality::Carried, reason);
        } else {
            self.warn(format!("Ni is {ni}, but must be above 0; left out"));
            self.note("Ni", Quality::Dropped, "not above 0");
        }
    }

    /// `Ns` and `map_Ns`.
    fn exponent(&mut self) {
        let has_map = self.source.map(MtlSlot::Ns).is_some();
        let rough = self.source.pr.is_some() || self.source.map(MtlSlot::Pr).is_some();
        if rough {
            let given = [("Ns", self.source.ns.is_some()), ("map_Ns", has_map)];
            for (field, _) in given.into_iter().filter(|(_, given)| *given) {
                self.note(field, Quality::Dropped, "Pr is given");
            }
            return;
        }
        let map = self.map(MtlSlot::Ns, SCALAR);
        match self.options.phong {
            PhongRoughness::Walter => self.exponent_by_walter(map),
            PhongRoughness::Blender => self.exponent_by_blender(map),
        }
    }

    fn exponent_by_walter(&mut self, map: Option<TextureMap>) {
        let curve = Curve::RoughnessOfExponent;
        let Some(ns) = self.source.ns else {
            if map.is_some() {
                self.note("map_Ns", Quality::Dropped, "it multiplies Ns, which is not given");
            }
            return;
        };
        let roughness = curve.at(ns);
        self.set(Parameter::Roughness, roughness);
        let reason = format!("roughness {roughness:.3}: GGX of the same width");
        self.note("Ns", Quality::Approximated, reason);
        if let Some(map) = map {
            let map = TextureMap { curve, ..map };
            *self.out.scalar_mut(Parameter::Roughness) = Param::Texture { map, factor: ns.max(0.0) };
            self.note("map_Ns", Quality::Approximated, "multiplies Ns: GGX of the same width");
        }
    }

    fn exponent_by_blender(&mut self, map: Option<TextureMap>) {
        if let Some(map) = map {
            *self.out.scalar_mut(Parameter::Roughness) = Param::Texture { map, factor: 1.0 };
            self.note("map_Ns", Quality::Approximated, "taken for the roughness, as Blender does");
        }
        let Some(ns) = self.source.ns else { return };
        if self.source.map(MtlSlot::Ns).is_some_and(|map| map.texture.is_some()) {
            return self.note("Ns", Quality::Dropped, "map_Ns is given");
        }
        let roughness = 1.0 - (ns.clamp(0.0, 1000.0) / 1000.0).sqrt();
        self.set(Parameter::Roughness, roughness);
        self.note("Ns", Quality::Approximated, format!("roughness {roughness:.3}, as Blender reads it"));
    }

    /// Notes on specular statements that the model has no place for.
    fn phong_left_out(&mut self) {
        let glass = self.out.model == Model::Dielectric;
        let (quality, reason) = match self.source.illum {
            _ if glass => (Quality::Approximated, "smooth glass reflects by its refractive index"),
            Some(0 | 1) => (Quality::Exact, "illum 0 and 1 have no highlight"),
            _ => (Quality::Exact, "there is no highlight: Ks is black"),
        };
        let given = [
            ("Ks", self.source.ks.is_some()),
            ("Ns", self.source.ns.is_some()),
            ("map_Ks", self.source.map(MtlSlot::Ks).is_some()),
            ("map_Ns", self.source.map(MtlSlot::Ns).is_some()),
        ];
        for (field, _) in given.into_iter().filter(|(_, given)| *given) {
            self.note(field, quality, reason);
        }
        if self.source.ni.is_some() && !glass {
            self.note("Ni", Quality::Exact, reason);
        }
    }
}
