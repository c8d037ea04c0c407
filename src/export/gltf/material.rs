//! Disney materials in glTF's terms: the inverse of what `convert` makes of glTF, field by field.
//!
//! This file has the core, `lobes` what extensions add. What a reader makes of the result is found by reading it: a parameter that does
//! not come back is told with both values.

use super::lobes;
use super::texture::{Part, Slot, Target, Textures};
use crate::color::Rgb;
use crate::convert::{ConvertOptions, Note, Quality, to_disney};
use crate::disney::{BASE_COLOR, DiffuseModel, Masking, Model, Parameter};
use crate::export::principled::principled;
use crate::scene::material::{Material, Param, ShadingFrame, Sides, TextureChannel, TextureMap};
use crate::scene::source::{AlphaMode, GltfMaterial, SourceMaterial};
use crate::scene::texture::Encoding;
use crate::scene::{Named, Scene};

/// A material on its way.
pub(super) struct Conversion<'c> {
    scene: &'c Scene<Material>,
    name: &'c str,
    /// As it is, by the parameters of the Disney model.
    pub(super) source: Material,
    textures: &'c mut Textures,
    notes: &'c mut Vec<Note>,
    pub(super) out: GltfMaterial,
}

/// The glTF material for `named`, one of `scene`'s. Where it has an inside, that is `thickness` metres across for readers that follow no
/// rays through it.
pub(super) fn convert(
    scene: &Scene<Material>,
    named: &Named<Material>,
    thickness: f32,
    textures: &mut Textures,
    notes: &mut Vec<Note>,
) -> GltfMaterial {
    let (name, source) = (named.name.as_str(), principled(&named.item));
    let out = GltfMaterial { vertex_color: source.vertex_color, ..GltfMaterial::default() };
    let mut conversion = Conversion { scene, name, source, textures, notes, out };
    if is_unlit(&named.item) {
        conversion.unlit();
        return conversion.out;
    }
    conversion.core();
    conversion.tell_model(named.item.model);
    lobes::convert(&mut conversion, thickness);
    conversion.emission();
    conversion.normal();
    conversion.sides();
    if named.item.model == Model::Disney {
        conversion.tell_scalars();
    }
    conversion.out
}

/// Black but for what the camera alone sees of it, on both sides and no more than white: KHR_materials_unlit.
fn is_unlit(m: &Material) -> bool {
    let factor = factor_of(&m.emission.color);
    m.model == Model::Diffuse
        && m.base_color.constant().is_some_and(Rgb::is_black)
        && m.emission.unlit
        && m.emits()
        && m.emission.sides == Sides::Both
        && m.emission.strength == 1.0
        && factor.max_channel() <= 1.0
}

/// The texture of a parameter.
pub(super) fn map_of<T>(param: &Param<T>) -> Option<&TextureMap> {
    match param {
        Param::Constant(_) => None,
        Param::Texture { map, .. } => Some(map),
    }
}

/// The constant, or what multiplies the texture.
pub(super) fn factor_of<T: Copy>(param: &Param<T>) -> T {
    match *param {
        Param::Constant(factor) | Param::Texture { factor, .. } => factor,
    }
}

impl Conversion<'_> {
    pub(super) fn note(&mut self, field: &str, quality: Quality, reason: impl Into<String>) {
        let (material, field) = (self.name.to_owned(), field.to_owned());
        self.notes.push(Note { material, field, quality, reason: reason.into() });
    }

    pub(super) fn scalar(&self, parameter: Parameter) -> &Param<f32> {
        self.source.scalar(parameter)
    }

    /// The value of a scalar that is the same everywhere, else its mean, which is told.
    pub(super) fn constant(&mut self, parameter: Parameter, why: &str) -> f32 {
        let param = self.scalar(parameter).clone();
        self.mean(parameter.name(), &param, why)
    }

    fn mean(&mut self, field: &str, param: &Param<f32>, why: &str) -> f32 {
        match param {
            Param::Constant(value) => *value,
            Param::Texture { map, factor } => {
                let mean = map.scalar(&self.scene.mean_texel(map), *factor);
                self.note(field, Quality::Approximated, format!("the texture's mean, {mean}: {why}"));
                mean
            }
        }
    }

    pub(super) fn lie_alike(&self, a: &TextureMap, b: &TextureMap) -> bool {
        self.textures.lie_alike(a, b)
    }

    /// Parts as a slot's texture; what they have to be changed for is told of `field`.
    pub(super) fn slot(
        &mut self,
        field: &str,
        parts: &[Part<'_>],
        ones: &[TextureChannel],
        encoding: Encoding,
    ) -> Slot {
        let slot = self.textures.slot(parts, ones, encoding);
        if let Some(change) = slot.change {
            let quality = if slot.rounded { Quality::Approximated } else { Quality::Exact };
            self.note(&format!("{field} texture"), quality, change);
        }
        slot
    }

    /// A scalar in a slot of its own: its factor and the texture.
    pub(super) fn single(
        &mut self,
        field: &str,
        param: &Param<f32>,
        target: Target,
        encoding: Encoding,
    ) -> (f32, Option<TextureMap>) {
        let Param::Texture { map, factor } = param else { return (factor_of(param), None) };
        let slot = self.slot(field, &[Part { map, target }], &[], encoding);
        (factor * slot.peaks[0], Some(slot.map))
    }

    /// A colour in a slot of its own.
    pub(super) fn color(&mut self, field: &str, param: &Param<Rgb>) -> (Rgb, Option<TextureMap>) {
        let Param::Texture { map, factor } = param else { return (factor_of(param), None) };
        let slot = self.slot(field, &[Part { map, target: Target::Color }], &[], Encoding::Srgb);
        (*factor * slot.peaks[0], Some(slot.map))
    }

    fn unlit(&mut self) {
        self.out.unlit = true;
        let color = self.source.emission.color.clone();
        self.base_color("emission", &color);
        self.note("emission", Quality::Exact, "KHR_materials_unlit");
        self.normal();
        self.out.double_sided = true;
    }

    /// How well the base is kept: what kind of surface becomes which parameters, and the Disney model's own terms.
    fn tell_model(&mut self, model: Model) {
        let (quality, reason) = match model {
            Model::Disney => self.difference_of_base(),
            Model::Diffuse => (
                Quality::Carried,
                "without a highlight (specularFactor 0) glTF's diffuse term is Lambert's; read back it is Burley's of roughness 0.45, whose \
                 albedo is within 1.5% up to 85°, unless --diffuse says otherwise",
            ),
            Model::Mirror => (
                Quality::Approximated,
                "a white metal of roughness 0, whose alpha is 0.001 when it is read back",
            ),
            Model::Dielectric => (Quality::Exact, "transmissionFactor 1 at roughness 0, with a volume"),
        };
        let field = if matches!(model, Model::Disney | Model::Diffuse) { BASE_COLOR } else { model.name() };
        self.note(field, quality, reason);
        if self.source.vertex_color {
            self.note("vertex_color", quality, "COLOR_0");
        }
        if model == Model::Disney && self.source.masking == Masking::Remapped {
            let reason = "glTF's G is that of the roughness itself, not of 0.5 + roughness/2";
            self.note("masking", Quality::Approximated, reason);
        }
    }

    /// The difference of the Disney model's diffuse term, where it shows, from glTF's.
    fn difference_of_base(&self) -> (Quality, &'static str) {
        let is_one = |p| self.scalar(p).constant() == Some(1.0);
        if is_one(Parameter::Metallic) || is_one(Parameter::SpecTrans) {
            return (Quality::Exact, "");
        }
        match self.source.diffuse {
            DiffuseModel::LambertFresnel => (
                Quality::Exact,
                "glTF's own diffuse term; pipeline reads it back with --diffuse lambert_fresnel",
            ),
            DiffuseModel::Burley => (
                Quality::Carried,
                "glTF has Lambert times 1 - F for Burley's diffuse term: elsewhere a white dielectric is darker by 5% (roughness 0.5, 0°), \
                 7% (roughness 1, 0°), 19% (75°), 32% (85°); read back it is Burley's",
            ),
            DiffuseModel::Lambert => {
                (Quality::Carried, "glTF's diffuse term is Lambert's times 1 - F; read back it is Burley's")
            }
        }
    }

    /// glTF's metallic-roughness model with its alpha.
    fn core(&mut self) {
        let color = lobes::base_color(self);
        self.base_color(BASE_COLOR, &color);
        self.metallic_roughness();
    }

    /// `color` and the opacity in baseColorTexture and its factor.
    fn base_color(&mut self, field: &str, color: &Param<Rgb>) {
        let opacity = self.source.opacity.clone();
        let mut alpha = opacity.alpha;
        let opaque = alpha == Param::Constant(1.0) && opacity.cutoff.is_none() && !self.source.vertex_alpha;
        self.out.alpha_mode = match opacity.cutoff {
            // An alpha is never below 0.
            Some(cutoff) => AlphaMode::Mask { cutoff: cutoff.max(0.0) },
            None if opaque => AlphaMode::Opaque,
            None => AlphaMode::Blend,
        };
        if !opaque {
            self.note("opacity", Quality::Exact, if opacity.cutoff.is_some() { "MASK" } else { "BLEND" });
        }
        if let (Some(a), Some(b)) = (map_of(color), map_of(&alpha))
            && !self.lie_alike(a, b)
        {
            let why = "glTF has one texture for colour and alpha, and these two lie differently";
            alpha = Param::Constant(self.mean("opacity", &alpha.clone(), why));
        }
        let of_color = map_of(color).map(|map| Part { map, target: Target::Color });
        let of_alpha = map_of(&alpha).map(|map| Part { map, target: Target::Channel(TextureChannel::A) });
        let parts: Vec<Part<'_>> = of_color.into_iter().chain(of_alpha).collect();
        let ones: &[TextureChannel] = match (&of_color, &of_alpha) {
            (Some(_), None) if !opaque => &[TextureChannel::A],
            (None, Some(_)) => &[TextureChannel::R, TextureChannel::G, TextureChannel::B],
            _ => &[],
        };
        let (mut factor, mut alpha_factor) = (factor_of(color), factor_of(&alpha));
        if !parts.is_empty() {
            let slot = self.slot(field, &parts, ones, Encoding::Srgb);
            let mut peaks = slot.peaks.iter();
            factor = factor * of_color.and_then(|_| peaks.next()).copied().unwrap_or(1.0);
            alpha_factor *= of_alpha.and_then(|_| peaks.next()).unwrap_or(&1.0);
            self.out.base_color_texture = Some(slot.map);
        }
        // Only rounding lifts a factor times the largest value above 1.
        self.out.base_color_factor = factor.map(|v| v.clamp(0.0, 1.0));
        self.out.alpha_factor = alpha_factor.clamp(0.0, 1.0);
    }

    fn metallic_roughness(&mut self) {
        let roughness = self.scalar(Parameter::Roughness).clone();
        let mut metallic = self.scalar(Parameter::Metallic).clone();
        if let (Some(a), Some(b)) = (map_of(&metallic), map_of(&roughness))
            && !self.lie_alike(a, b)
        {
            let why = "glTF has one texture for metallic and roughness, and these two lie differently";
            metallic = Param::Constant(self.constant(Parameter::Metallic, why));
        }
        let (g, b) = (TextureChannel::G, TextureChannel::B);
        let (mut parts, mut ones) = (Vec::new(), Vec::new());
        for (param, channel) in [(&roughness, g), (&metallic, b)] {
            match param {
                Param::Texture { map, .. } => parts.push(Part { map, target: Target::Channel(channel) }),
                Param::Constant(factor) if *factor != 0.0 => ones.push(channel),
                Param::Constant(_) => {}
            }
        }
        let mut peaks = [1.0; 2];
        if !parts.is_empty() {
            let slot = self.slot("metallic and roughness", &parts, &ones, Encoding::Linear);
            let mut each = slot.peaks.into_iter();
            for (peak, param) in peaks.iter_mut().zip([&roughness, &metallic]) {
                *peak = map_of(param).and_then(|_| each.next()).unwrap_or(1.0);
            }
            self.out.metallic_roughness_texture = Some(slot.map);
        }
        self.out.roughness_factor = (factor_of(&roughness) * peaks[0]).min(1.0);
        self.out.metallic_factor = (factor_of(&metallic) * peaks[1]).min(1.0);
    }

    /// emissiveFactor ends at 1, KHR_materials_emissive_strength has no end. A power of two between them rounds nothing.
    fn emission(&mut self) {
        if !self.source.emits() {
            return;
        }
        let color = self.source.emission.color.clone();
        let (factor, map) = self.color("emission", &color);
        let scale = power_of_two_above(factor.max_channel());
        self.out.emissive_factor = factor * scale.recip();
        self.out.emissive_strength = self.source.emission.strength * scale;
        self.out.emissive_texture = map;
        match self.source.emission.unlit {
            false => self.note("emission", Quality::Exact, ""),
            true => self.note("emission", Quality::Approximated, "it also lights other surfaces"),
        }
    }

    fn normal(&mut self) {
        let Some(normal) = self.source.normal_map.clone() else { return };
        let part = Part { map: &normal.map, target: Target::Color };
        self.out.normal_texture = Some(self.slot("normal_map", &[part], &[], Encoding::Linear).map);
        self.out.normal_scale = normal.scale;
        self.note("normal_map", Quality::Exact, "with the tangents it has here");
    }

    fn sides(&mut self) {
        let emits_in_front = self.source.emits() && self.source.emission.sides == Sides::Front;
        // The extension wants closed surfaces with volumes to have one side.
        let has_volume = self.out.volume.is_some();
        let has_back = self.source.sides == Sides::Both && !self.source.culled;
        self.out.double_sided = has_back && !emits_in_front && !has_volume;
        if self.source.culled {
            self.note("culled", Quality::Exact, "single-sided; pipeline leaves its back out with --cull");
        } else if self.source.sides == Sides::Front && !has_volume {
            let reason = "single-sided: others leave out its back, which is black here, and pipeline shades it when it is read back";
            self.note("sides", Quality::Approximated, reason);
        } else if emits_in_front {
            let reason = "single-sided, since light leaves the front alone: others leave out its back";
            self.note("sides", Quality::Approximated, reason);
        }
        if self.out.anisotropy.is_some() && self.source.frame == ShadingFrame::Nori {
            let reason = "the tangents are Nori's at the vertices, and interpolated between them";
            self.note("frame", Quality::Approximated, reason);
        }
    }

    /// What becomes of each scalar that plays a part: which difference the models have, and what it reads back as. Defaults that stay are not told.
    fn tell_scalars(&mut self) {
        let back = self.read_back();
        let parts: Vec<Parameter> = Parameter::ALL.into_iter().filter(|&p| self.plays_a_part(p)).collect();
        for parameter in parts {
            let (here, there) = (self.scalar(parameter), back.scalar(parameter));
            let (wanted, found) = (factor_of(here), factor_of(there));
            let same_kind = map_of(here).is_some() == map_of(there).is_some();
            let is_core = matches!(parameter, Parameter::Metallic | Parameter::Roughness);
            let is_default = !is_core && here.constant() == Some(parameter.default());
            let moved = same_kind && (wanted - found).abs() > 1e-5 * wanted.abs().max(1.0);
            let (quality, reason) = lobes::difference(parameter, &self.source);
            if moved && quality != Quality::Dropped {
                let reason = format!("{wanted} here, {found} when it is read back");
                self.note(parameter.name(), Quality::Approximated, reason);
            } else if !is_default {
                self.note(parameter.name(), quality, reason);
            }
        }
    }

    /// Whether a scalar can change anything beside the others.
    fn plays_a_part(&self, parameter: Parameter) -> bool {
        let is = |p: Parameter| self.scalar(p).constant() != Some(0.0);
        match parameter {
            Parameter::SpecularTint => is(Parameter::Specular),
            Parameter::SheenTint => is(Parameter::Sheen),
            Parameter::ClearcoatGloss => is(Parameter::Clearcoat),
            Parameter::Ior => self.source.transmits(),
            _ => true,
        }
    }

    /// What pipeline makes of the result.
    fn read_back(&self) -> Material {
        let mut scene = Scene::empty();
        scene.materials.push(Named::new(self.name, SourceMaterial::Gltf(self.out.clone())));
        let options = ConvertOptions { diffuse: Some(self.source.diffuse), ..ConvertOptions::default() };
        to_disney(scene, &options).scene.materials.swap_remove(0).item
    }
}

/// The least power of two that is not below `value`, at least 1.
pub(super) fn power_of_two_above(value: f32) -> f32 {
    let mut power = 1.0;
    while power < value {
        power *= 2.0;
    }
    power
}
