//! MTL's Phong terms, and the physically based ones that exporters add, into Disney parameters.

use std::f32::consts::TAU;

use glam::{Affine2, Mat2, Vec2};

use super::{Note, Quality};
use crate::color::Rgb;
use crate::disney::{Model, Parameter};
use crate::math::Real;
use crate::record::Warning;
use crate::scene::Material;
use crate::scene::material::{NormalMap, Param, Sides, TextureChannel, TextureMap};
use crate::scene::source::{MtlMap, MtlMaterial, MtlSlot};

/// The material `name` in Disney's terms, with a note on every statement that it holds.
///
/// Lambert where `illum` is 0 or 1, or nothing but the diffuse colour is given; a smooth dielectric for glass without
/// roughness; else the Disney model. OBJ surfaces have two sides.
pub(super) fn convert(
    name: &str,
    source: &MtlMaterial,
    notes: &mut Vec<Note>,
    warnings: &mut Vec<Warning>,
) -> Material {
    let mut conversion = Conversion { name, source, notes, warnings, out: Material::default() };
    conversion.out.model = model(source);
    conversion.out.vertex_color = source.vertex_color;
    conversion.base_color();
    conversion.specular();
    conversion.physically_based();
    conversion.emission();
    conversion.opacity();
    conversion.transmission();
    conversion.normal();
    conversion.others();
    conversion.out
}

/// Which BSDF the statements ask for.
fn model(source: &MtlMaterial) -> Model {
    if is_glass(source) {
        return Model::Dielectric;
    }
    let shiny = source.ks.is_some() || source.ns.is_some() || source.ni.is_some();
    match source.illum {
        _ if source.is_physically_based() => Model::Disney,
        Some(0 | 1) => Model::Diffuse,
        _ if shiny => Model::Disney,
        _ => Model::Diffuse,
    }
}

/// Refraction is asked for by `illum` 6 or 7, or by 4 with a filter that lets light pass, and nothing makes the surface a metal.
fn refracts(source: &MtlMaterial) -> bool {
    let passes = source.tf.map(|tf| tf.max_channel() > 0.0);
    let asked = match source.illum {
        Some(6 | 7) => passes.unwrap_or(true),
        Some(4) => passes.unwrap_or(false),
        _ => false,
    };
    let metal = source.pm.unwrap_or(0.0) > 0.0 || source.map(MtlSlot::Pm).is_some();
    asked && !metal
}

/// Smooth glass: nothing makes a surface that refracts rough.
fn is_glass(source: &MtlMaterial) -> bool {
    let smooth = source.pr.unwrap_or(0.0) <= 0.0 && source.map(MtlSlot::Pr).is_none();
    refracts(source) && smooth
}

struct Conversion<'a> {
    name: &'a str,
    source: &'a MtlMaterial,
    notes: &'a mut Vec<Note>,
    warnings: &'a mut Vec<Warning>,
    out: Material,
}

impl Conversion<'_> {
    fn note(&mut self, field: &str, quality: Quality, reason: impl Into<String>) {
        let (material, field) = (self.name.to_owned(), field.to_owned());
        self.notes.push(Note { material, field, quality, reason: reason.into() });
    }

    fn warn(&mut self, message: String) {
        let place = if self.source.library.is_empty() {
            format!("material {:?}", self.name)
        } else {
            format!("{}:{}: material {:?}", self.source.library, self.source.line, self.name)
        };
        self.warnings.push(Warning { place, message });
    }

    /// `value` limited to [0, max]; a limit that bites is told.
    fn limited(&mut self, field: &str, value: f32, max: f32) -> f32 {
        let limited = value.clamp(0.0, max);
        if limited != value {
            self.warn(format!("{field} is {value}, limited to [0, {max}]"));
        }
        limited
    }

    fn limited_color(&mut self, field: &str, color: Rgb) -> Rgb {
        let limited = color.map(|c| c.clamp(0.0, 1.0));
        if limited != color {
            self.warn(format!("{field} is {:?}, limited to [0, 1]", color.to_array()));
        }
        limited
    }

    /// A slot's map as one parameter uses it; a note where the file could not be loaded.
    fn map(&mut self, slot: MtlSlot, channel: TextureChannel) -> Option<TextureMap> {
        let map = self.source.map(slot)?;
        let Some(texture) = map.texture else {
            self.note(slot.statement(), Quality::Dropped, format!("{:?} could not be loaded", map.file));
            return None;
        };
        let channel = map.channel.unwrap_or(channel);
        Some(TextureMap { texture_from_uv: texture_from_uv(map), ..TextureMap::new(texture, channel) })
    }

    /// How exactly the diffuse colour is kept.
    fn diffuse_quality(&self) -> (Quality, &'static str) {
        match self.out.model {
            Model::Diffuse => (Quality::Exact, ""),
            Model::Disney => (Quality::Carried, "Burley's diffuse term instead of Lambert's"),
            Model::Mirror | Model::Dielectric => (Quality::Dropped, "clear glass has no diffuse colour"),
        }
    }

    fn base_color(&mut self) {
        let (quality, reason) = self.diffuse_quality();
        let mut factor = self.source.kd.map(|kd| self.limited_color("Kd", kd));
        if self.source.kd.is_some() {
            self.note("Kd", quality, reason);
        }
        let map = self.map(MtlSlot::Kd, TextureChannel::R);
        if map.is_some() {
            self.note("map_Kd", quality, reason);
            if factor.is_some_and(Rgb::is_black) {
                self.warn("Kd is black and would hide map_Kd; the map is taken as it is".to_owned());
                factor = None;
            }
        }
        self.out.base_color = match map {
            Some(map) => Param::Texture { map, factor: factor.unwrap_or(Rgb::WHITE) },
            // Vertex colours are the whole colour.
            None if self.source.vertex_color => Param::Constant(factor.unwrap_or(Rgb::WHITE)),
            None => Param::Constant(factor.unwrap_or(Rgb::grey(0.8))),
        };
    }

    fn set(&mut self, parameter: Parameter, value: f32) {
        *self.out.scalar_mut(parameter) = Param::Constant(value);
    }

    /// `Ks`, `Ns` and `Ni`.
    fn specular(&mut self) {
        self.set(Parameter::Specular, 0.0);
        if self.out.model != Model::Disney {
            self.specular_left_out();
            return;
        }
        if let Some(ks) = self.source.ks {
            let ks = self.limited_color("Ks", ks);
            self.set(Parameter::Specular, ks.mean());
            self.note(
                "Ks",
                Quality::Approximated,
                "the mean is Disney's specular; Phong's Ks has no Fresnel term",
            );
            let tint = fit_tint(ks, self.source.kd.unwrap_or(Rgb::grey(0.8)));
            if tint > 0.0 {
                self.set(Parameter::SpecularTint, tint);
                self.note(
                    "Ks hue",
                    Quality::Approximated,
                    format!("specular_tint {tint:.3} towards Kd's hue"),
                );
            }
        }
        if let Some(ni) = self.source.ni {
            if self.source.illum.unwrap_or(2) < 4 {
                self.note("Ni", Quality::Dropped, "below illum 4 the specular is Ks's");
            } else if ni > 0.0 {
                // F0 of a dielectric interface over the 0.08 of specular = 1.
                let f0 = ((ni - 1.0) / (ni + 1.0)).sqr();
                let specular = self.limited("specular from Ni", f0 / 0.08, Parameter::Specular.max());
                self.set(Parameter::Specular, specular);
                self.note(
                    "Ni",
                    Quality::Carried,
                    "specular from the refractive index, in place of Ks's mean",
                );
            } else {
                self.warn(format!("Ni is {ni}, but must be above 0; left out"));
                self.note("Ni", Quality::Dropped, "not above 0");
            }
        }
        if let Some(ns) = self.source.ns {
            if self.source.pr.is_some() || self.source.map(MtlSlot::Pr).is_some() {
                self.note("Ns", Quality::Dropped, "Pr is given");
            } else {
                // The Blinn-Phong exponent of the Beckmann width alpha is 2/alpha² - 2 (Walter 2007); alpha = roughness².
                let roughness = Real::powf(2.0 / (ns.max(0.0) + 2.0), 0.25);
                self.set(Parameter::Roughness, roughness);
                self.note(
                    "Ns",
                    Quality::Approximated,
                    format!("roughness {roughness:.3}: GGX of the same width"),
                );
            }
        }
    }

    /// Notes on specular statements that the model has no place for.
    fn specular_left_out(&mut self) {
        let glass = self.out.model == Model::Dielectric;
        let reason = if glass {
            "smooth glass reflects by its refractive index"
        } else {
            "illum 0 and 1 have no highlight"
        };
        let quality = if glass { Quality::Approximated } else { Quality::Exact };
        let given = [("Ks", self.source.ks.is_some()), ("Ns", self.source.ns.is_some())];
        for (field, _) in given.into_iter().filter(|(_, given)| *given) {
            self.note(field, quality, reason);
        }
        if self.source.ni.is_some() && !glass {
            self.note("Ni", Quality::Exact, reason);
        }
    }

    /// `Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `anisor` and the maps of the first two.
    fn physically_based(&mut self) {
        if self.out.model != Model::Disney {
            let source = self.source;
            let given = [
                ("Pr", source.pr),
                ("Pm", source.pm),
                ("Ps", source.ps),
                ("Pc", source.pc),
                ("Pcr", source.pcr),
                ("aniso", source.aniso),
                ("anisor", source.anisor),
            ];
            for (field, value) in given.into_iter().filter_map(|(field, value)| Some((field, value?))) {
                let none = value == 0.0;
                let quality = if none { Quality::Exact } else { Quality::Dropped };
                self.note(field, quality, if none { "" } else { "smooth glass has no such lobe" });
            }
            return;
        }
        self.mapped("Pr", self.source.pr, MtlSlot::Pr, Parameter::Roughness);
        self.mapped("Pm", self.source.pm, MtlSlot::Pm, Parameter::Metallic);
        self.scalar(
            "Ps",
            self.source.ps,
            Parameter::Sheen,
            Quality::Approximated,
            "Disney's sheen has no roughness",
        );
        self.scalar("Pc", self.source.pc, Parameter::Clearcoat, Quality::Carried, "");
        if let Some(pcr) = self.source.pcr {
            let r = self.limited("Pcr", pcr, 1.0);
            self.set(Parameter::ClearcoatGloss, ((0.1 - r * r) / 0.099).clamp(0.0, 1.0));
            self.note(
                "Pcr",
                Quality::Approximated,
                "GTR1 of the same alpha, which reaches from 0.001 to 0.1",
            );
        }
        self.scalar("aniso", self.source.aniso, Parameter::Anisotropic, Quality::Carried, "");
        if let Some(turns) = self.source.anisor {
            // Whole turns change nothing, and keep the angle small.
            self.out.rotation = turns.fract() * TAU;
            self.note("anisor", Quality::Carried, "in turns");
        }
    }

    fn scalar(&mut self, field: &str, value: Option<f32>, to: Parameter, quality: Quality, reason: &str) {
        let Some(value) = value else { return };
        let value = self.limited(field, value, 1.0);
        self.set(to, value);
        self.note(field, quality, reason);
    }

    /// A scalar that may have a map. The map is the value: exporters leave any number beside it.
    fn mapped(&mut self, field: &str, value: Option<f32>, slot: MtlSlot, to: Parameter) {
        let map = self.map(slot, TextureChannel::R);
        match map {
            None => self.scalar(field, value, to, Quality::Carried, ""),
            Some(map) => {
                *self.out.scalar_mut(to) = Param::Texture { map, factor: 1.0 };
                self.note(slot.statement(), Quality::Carried, "");
                if value.is_some() {
                    self.note(field, Quality::Dropped, format!("{} is given", slot.statement()));
                }
            }
        }
    }

    fn emission(&mut self) {
        let map = self.map(MtlSlot::Ke, TextureChannel::R);
        if self.source.ke.is_none() && map.is_none() {
            return;
        }
        let mut ke = self.source.ke.unwrap_or(Rgb::WHITE);
        if ke.to_array().iter().any(|&c| c < 0.0) {
            self.warn(format!("Ke is {:?}; negative light is 0", ke.to_array()));
            ke = ke.map(|c| c.max(0.0));
        }
        if ke.is_black() && map.is_some() {
            self.warn("Ke is black and would hide map_Ke; the map is taken as it is".to_owned());
            ke = Rgb::WHITE;
        }
        self.out.emission.sides = Sides::Both;
        let reason = if ke.is_black() { "" } else { "leaves both sides, as OBJ surfaces have two" };
        if self.source.ke.is_some() {
            self.note("Ke", Quality::Exact, reason);
        }
        self.out.emission.color = match map {
            None => Param::Constant(ke),
            Some(map) => {
                self.note("map_Ke", Quality::Exact, reason);
                Param::Texture { map, factor: ke }
            }
        };
    }

    /// `d`, `Tr` and `map_d`.
    fn opacity(&mut self) {
        let channel = match self.source.map(MtlSlot::D) {
            Some(map) if map.has_alpha => TextureChannel::A,
            _ => TextureChannel::R,
        };
        let alpha = match (self.source.d, self.source.tr) {
            (Some(d), tr) => {
                if tr.is_some() {
                    self.note("Tr", Quality::Dropped, "d is given");
                }
                Some(("d", self.limited("d", d, 1.0)))
            }
            (None, Some(tr)) => Some(("Tr", 1.0 - self.limited("Tr", tr, 1.0))),
            (None, None) => None,
        };
        if refracts(self.source) {
            let reason = "the glass lets light pass already";
            let exact = alpha.is_some_and(|(_, alpha)| alpha == 1.0);
            if let Some((field, _)) = alpha {
                let quality = if exact { Quality::Exact } else { Quality::Dropped };
                self.note(field, quality, if exact { "" } else { reason });
            }
            if self.source.map(MtlSlot::D).is_some() {
                self.note("map_d", Quality::Dropped, reason);
            }
            return;
        }
        if let Some((field, _)) = alpha {
            self.note(field, Quality::Exact, "");
        }
        let factor = alpha.map_or(1.0, |(_, alpha)| alpha);
        self.out.opacity.alpha = match self.map(MtlSlot::D, channel) {
            None => Param::Constant(factor),
            Some(map) => {
                self.note("map_d", Quality::Exact, "");
                Param::Texture { map, factor }
            }
        };
    }

    /// `Tf`, and `illum` where it asks for transmission.
    fn transmission(&mut self) {
        let illum = self.source.illum;
        if self.out.model == Model::Dielectric {
            self.index_of_glass();
            self.note(
                "illum",
                Quality::Approximated,
                "a smooth dielectric: Fresnel reflection and refraction",
            );
            match self.source.tf {
                Some(tf) if tf != Rgb::WHITE => {
                    // The same interface in the model that has a tint.
                    self.out.model = Model::Disney;
                    self.set(Parameter::Roughness, 0.0);
                    self.tinted_interface(tf);
                }
                Some(_) => self.note("Tf", Quality::Exact, ""),
                None => {}
            }
            return;
        }
        if refracts(self.source) {
            self.index_of_glass();
            self.tinted_interface(self.source.tf.unwrap_or(Rgb::WHITE));
            self.note("illum", Quality::Approximated, "rough glass, of Pr's roughness");
            return;
        }
        let asks = matches!(illum, Some(4 | 6 | 7 | 9));
        if illum.is_some() {
            let overridden = self.source.is_physically_based();
            match illum {
                _ if overridden => {
                    self.note("illum", Quality::Exact, "overridden by the physically based statements")
                }
                Some(0..=2) => self.note("illum", Quality::Exact, ""),
                Some(4 | 6 | 7 | 9) => {
                    self.note("illum", Quality::Approximated, "reflections are the specular lobe's")
                }
                Some(10) => {
                    self.note("illum", Quality::Dropped, "casting shadows on invisible surfaces is not done")
                }
                _ => self.note("illum", Quality::Approximated, "reflections are the specular lobe's"),
            }
        }
        if let Some(tf) = self.source.tf {
            let reason = match illum {
                _ if !asks => "illum asks for no transmission",
                Some(9) => "transparency without refraction is d's",
                _ if tf.is_black() => "nothing passes",
                _ => "metal lets nothing pass",
            };
            let exact = !asks || tf.is_black();
            self.note("Tf", if exact { Quality::Exact } else { Quality::Dropped }, reason);
        }
    }

    /// `Ni` as the index of what lets light pass.
    fn index_of_glass(&mut self) {
        let Some(ni) = self.source.ni else { return };
        match Parameter::Ior.check(ni) {
            Ok(ni) => self.set(Parameter::Ior, ni),
            Err(range) => {
                self.warn(format!("Ni: {range}; {} is taken", Parameter::Ior.default()));
            }
        }
        self.note("Ni", Quality::Exact, "");
    }

    /// `Tf` as what each crossing of the surface lets pass.
    fn tinted_interface(&mut self, tf: Rgb) {
        self.set(Parameter::SpecTrans, 1.0);
        let tint = self.limited_color("Tf", tf);
        self.out.transmission_color = Some(Param::Constant(tint));
        if self.source.tf.is_some() {
            self.note(
                "Tf",
                Quality::Approximated,
                "tints each crossing of the surface, whatever the thickness",
            );
        }
    }

    fn normal(&mut self) {
        let Some(map) = self.map(MtlSlot::Norm, TextureChannel::R) else { return };
        let scale = self.source.map(MtlSlot::Norm).map_or(1.0, |map| map.bump_multiplier);
        self.out.normal_map = Some(NormalMap { map, scale });
        self.note("norm", Quality::Exact, "");
    }

    /// Statements that nothing stands for.
    fn others(&mut self) {
        if self.source.ka.is_some() {
            self.note("Ka", Quality::Exact, "ambient light is what the path tracer computes");
        }
        let source = self.source;
        for (slot, _) in source.maps.iter().filter(|(slot, _)| !slot.is_read()) {
            let reason = match slot {
                MtlSlot::Ka => "ambient light is what the path tracer computes",
                MtlSlot::Bump => "height maps are not read; a normal map belongs under norm",
                _ => "this map is not read",
            };
            self.note(slot.statement(), Quality::Dropped, reason);
        }
        if self.out.model != Model::Disney {
            for slot in [MtlSlot::Pr, MtlSlot::Pm] {
                if source.map(slot).is_some() {
                    self.note(slot.statement(), Quality::Dropped, "the model has no such parameter");
                }
            }
        }
    }
}

/// Image coordinates (v downwards) from the mesh's (v downwards): the options act on v upwards, scale first.
fn texture_from_uv(map: &MtlMap) -> Affine2 {
    let (s, o) = (map.scale, map.offset);
    Affine2::from_mat2_translation(Mat2::from_diagonal(s), Vec2::new(o.x, 1.0 - s.y - o.y))
}

/// The specular tint, in [0, 1], whose colour lerp(white, `base`'s hue, tint) is nearest to `ks`'s hue by least squares.
fn fit_tint(ks: Rgb, base: Rgb) -> f32 {
    // The model's own luminance.
    let hue = |c: Rgb| {
        let y = 0.3 * c.r + 0.6 * c.g + 0.1 * c.b;
        (y > 0.0).then(|| (c * (1.0 / y)).map(|c| c - 1.0))
    };
    let (Some(target), Some(full)) = (hue(ks), hue(base)) else { return 0.0 };
    let dot = |a: Rgb, b: Rgb| a.r * b.r + a.g * b.g + a.b * b.b;
    let length = dot(full, full);
    // Greys have no hue; rounding must not invent one.
    if length < 1e-6 || dot(target, target) < 1e-6 {
        0.0
    } else {
        (dot(target, full) / length).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests;
