//! MTL's Phong terms, and the physically based ones that exporters add, into Disney parameters.

mod glass;
mod phong;
mod physical;

use glam::{Affine2, Mat2, Vec2};

use glass::{is_glass, refracts};

use super::{ConvertOptions, Note, Quality};
use crate::color::Rgb;
use crate::disney::{Model, Parameter};
use crate::record::Warning;
use crate::scene::Material;
use crate::scene::material::{NormalMap, Param, Sides, TextureChannel, TextureMap};
use crate::scene::source::{MtlMap, MtlMaterial, MtlSlot};
use crate::scene::texture::Wrap;

/// What a scalar reads of a colour image unless `-imfchan` says otherwise (the specification's default, `l`).
const SCALAR: TextureChannel = TextureChannel::Y;

/// The material `name` in Disney's terms, with a note on every statement that it holds.
///
/// Lambert where `illum` is 0 or 1, `Ks` is black, or nothing but the diffuse colour is given; a smooth dielectric for glass without
/// roughness; else the Disney model. OBJ surfaces have two sides.
pub(super) fn convert(
    name: &str,
    source: &MtlMaterial,
    options: &ConvertOptions,
    notes: &mut Vec<Note>,
    warnings: &mut Vec<Warning>,
) -> Material {
    let mut conversion = Conversion { name, source, options, notes, warnings, out: Material::default() };
    conversion.out.model = model(source);
    conversion.out.vertex_color = source.vertex_color;
    conversion.base_color();
    conversion.phong();
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
    let mapped = source.map(MtlSlot::Ks).is_some() || source.map(MtlSlot::Ns).is_some();
    let shiny = mapped || source.ks.is_some() || source.ns.is_some() || source.ni.is_some();
    let dull = has_no_highlight(source);
    match source.illum {
        _ if source.is_physically_based() => Model::Disney,
        Some(0 | 1) => Model::Diffuse,
        _ if shiny && !dull => Model::Disney,
        _ => Model::Diffuse,
    }
}

/// Whether `Ks` is black, as exporters write it for matt surfaces. From `illum` 4 on `Ni` reflects nevertheless.
fn has_no_highlight(source: &MtlMaterial) -> bool {
    let black = source.ks.is_some_and(|ks| ks.max_channel() <= 0.0) && source.map(MtlSlot::Ks).is_none();
    black && source.illum.unwrap_or(2) < 4
}

struct Conversion<'a> {
    name: &'a str,
    source: &'a MtlMaterial,
    options: &'a ConvertOptions,
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
        if map.wrap == Wrap::Clamp {
            let reason = "its edge goes on beyond the image, where MTL shows the material without it";
            self.note(&format!("{} -clamp", slot.statement()), Quality::Approximated, reason);
        }
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
            _ => SCALAR,
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

    fn normal(&mut self) {
        let bump = self.source.map(MtlSlot::Bump);
        if let Some(map) = self.map(MtlSlot::Norm, TextureChannel::R) {
            let scale = self.source.map(MtlSlot::Norm).map_or(1.0, |map| map.bump_multiplier);
            self.out.normal_map = Some(NormalMap { map, scale });
            self.note("norm", Quality::Exact, "");
            if bump.is_some() {
                self.note("map_Bump", Quality::Dropped, "norm is given");
            }
            return;
        }
        let Some(bump) = bump else { return };
        // The channel was read when the heights became normals.
        let Some(map) = self.map(MtlSlot::Bump, TextureChannel::R) else { return };
        self.out.normal_map = Some(NormalMap { map, scale: bump.bump_multiplier });
        let (quality, reason) = match bump.holds_normals {
            true => (Quality::Exact, "its image holds normals, not heights; -bm scales them"),
            false => (Quality::Approximated, "heights as slopes between texels: 1 is -bm texels high"),
        };
        self.note("map_Bump", quality, reason);
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
                MtlSlot::Disp => "surfaces are not displaced",
                _ => "this map is not read",
            };
            self.note(slot.statement(), Quality::Dropped, reason);
        }
        if self.out.model != Model::Disney {
            for slot in [MtlSlot::Pr, MtlSlot::Pm, MtlSlot::Ps, MtlSlot::Pc, MtlSlot::Pcr] {
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

#[cfg(test)]
mod tests;
