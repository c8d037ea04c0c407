//! What extensions say of a material: highlight, coat, sheen, anisotropy, and the light that goes through.

use super::material::{Conversion, factor_of, map_of};
use super::texture::{Part, Target};
use crate::color::Rgb;
use crate::convert::{F0_OF_SPECULAR, Quality, disney_luminance, f0_of_ior};
use crate::disney::{BASE_COLOR, Masking, Parameter};
use crate::export::rounding::reads_back_as;
use crate::math::Number;
use crate::scene::AnisotropyMap;
use crate::scene::material::{Curve, Material, Param, TextureChannel, TextureMap};
use crate::scene::source::{
    GltfAnisotropy, GltfClearcoat, GltfDiffuseTransmission, GltfSheen, GltfSpecular, GltfTransmission,
    GltfVolume,
};
use crate::scene::texture::Encoding;

/// Fills in the extensions' part of a material whose core is there.
pub(super) fn convert(c: &mut Conversion<'_>, thickness: f32) {
    transmission(c, thickness);
    specular(c);
    clearcoat(c);
    sheen(c);
    anisotropy(c);
}

/// How the lobe of a scalar differs between the two models, the scalar itself being the same.
pub(super) fn difference(parameter: Parameter, source: &Material) -> (Quality, &'static str) {
    match parameter {
        Parameter::Subsurface => (Quality::Dropped, "glTF has no such parameter"),
        Parameter::Roughness if source.masking == Masking::Remapped => (Quality::Carried, "see masking"),
        Parameter::Sheen => (
            Quality::Approximated,
            "glTF's lobe, Charlie's, is 6 to 26 times brighter at an equal factor; Disney's has no roughness: 1 is written",
        ),
        Parameter::Clearcoat => (
            Quality::Approximated,
            "factor = clearcoat/4; GGX for GTR1, and glTF darkens the base under the coat",
        ),
        Parameter::ClearcoatGloss => (Quality::Carried, "the same alpha: roughness² = 0.1 - 0.099·gloss"),
        Parameter::SpecTrans if source.thin_walled => (
            Quality::Approximated,
            "a thin sheet; Burley's roughness for what passes, (0.65·ior - 0.35)·roughness, is less than glTF's",
        ),
        Parameter::DiffTrans => (
            Quality::Approximated,
            "factor = diff_trans/2; glTF dims what passes by the highlight's Fresnel term",
        ),
        _ => (Quality::Exact, ""),
    }
}

/// What glTF's base colour has to be: it tints what passes the surface, too. Where nothing else shows, it is that tint alone.
pub(super) fn base_color(c: &mut Conversion<'_>) -> Param<Rgb> {
    let base = c.source.base_color.clone();
    let may_transmit = c.scalar(Parameter::SpecTrans).constant() != Some(0.0);
    let seen = match &c.source.transmission_color {
        _ if !may_transmit => return base,
        Some(color) => color.clone(),
        None if c.source.thin_walled => base.clone(),
        None => match base.constant() {
            Some(color) => Param::Constant(color.map(f32::sqrt)),
            None => {
                let reason = "glTF tints each crossing by the base colour, Disney by its root: the texture tints twice";
                c.note("transmission_color", Quality::Approximated, reason);
                return base;
            }
        },
    };
    let nothing_else = c.scalar(Parameter::SpecTrans).constant() == Some(1.0)
        && c.scalar(Parameter::Metallic).constant() == Some(0.0);
    if seen == base {
        return base;
    }
    if nothing_else {
        c.note("transmission_color", Quality::Exact, "as base colour, of which nothing else is seen");
        return seen;
    }
    let reason =
        format!("glTF tints what passes by the base colour alone, which keeps its value as {BASE_COLOR}");
    c.note("transmission_color", Quality::Approximated, reason);
    base
}

/// `strength` times Disney's tint: white, or towards the hue of the base colour's factor.
fn tinted(c: &Conversion<'_>, strength: f64, tint: f32) -> Rgb<f64> {
    let base: Rgb<f64> = c.out.base_color_factor.cast();
    let luminance = disney_luminance(base);
    let hue = if luminance > 0.0 { base * (1.0 / luminance) } else { Rgb::WHITE };
    Rgb::WHITE.lerp(hue, f64::from(tint)) * strength
}

/// KHR_materials_ior and KHR_materials_specular: specular = lum(F0(ior)·colour)·factor/0.08 and f90 = factor.
fn specular(c: &mut Conversion<'_>) {
    let tint = c.constant(Parameter::SpecularTint, "KHR_materials_specular tints by a colour");
    let specular = c.scalar(Parameter::Specular).clone();
    let mut f90 = c.scalar(Parameter::F90).clone();
    if map_of(&f90).is_some() && map_of(&f90) != map_of(&specular) {
        let why = "glTF's specularTexture multiplies the reflectance at all angles";
        f90 = Param::Constant(c.constant(Parameter::F90, why));
    }
    let plain = map_of(&specular).is_none() && tint == 0.0 && f90 == Param::Constant(1.0);
    let luminance_of = |f0_ior: f64, color: f32, factor: f32| {
        let f0 = (f0_ior * f64::from(color)).min(1.0) * f64::from(factor);
        (disney_luminance(Rgb::grey(f0)) / F0_OF_SPECULAR) as f32
    };
    let wanted = factor_of(&specular);
    if plain && c.out.ior.is_none() && !c.source.transmits() {
        let root = (f64::from(wanted) * F0_OF_SPECULAR).sqrt();
        let ior = ((1.0 + root) / (1.0 - root)) as f32;
        let read = |ior: f32| luminance_of(f0_of_ior(ior), 1.0, 1.0);
        let ior = reads_back_as(wanted, ior, read);
        if ior >= 1.0 && ior.is_finite() && read(ior) == wanted {
            c.out.ior = Some(ior).filter(|&ior| ior != 1.5);
            return;
        }
    }
    let f0_ior = f0_of_ior(c.out.ior.unwrap_or(1.5));
    if plain && luminance_of(f0_ior, 1.0, 1.0) == wanted {
        return;
    }
    // A factor of 0 leaves nothing that a colour could scale.
    let factor = factor_of(&f90);
    let scale = f0_ior * f64::from(factor);
    let strength = if scale > 0.0 { f64::from(wanted) * F0_OF_SPECULAR / scale } else { 1.0 };
    let color = if tint == 0.0 {
        let read = |color: f32| luminance_of(f0_ior, color, factor);
        Rgb::grey(reads_back_as(wanted, strength as f32, read).max(0.0))
    } else {
        tinted(c, strength, tint).cast()
    };
    let (mut texture, mut color_texture) = (None, None);
    let mut peak = 1.0;
    if let (Some(map), Some(_)) = (map_of(&specular), map_of(&f90)) {
        let part = Part { map, target: Target::Channel(TextureChannel::A) };
        texture = Some(c.slot("specular", &[part], &[], Encoding::Linear).map);
    } else if let Some(map) = map_of(&specular) {
        let part = Part { map, target: colored(map) };
        let slot = c.slot("specular", &[part], &[], Encoding::Srgb);
        peak = slot.peaks[0];
        color_texture = Some(slot.map);
    }
    c.out.specular = Some(GltfSpecular { factor, texture, color: color * peak, color_texture });
}

/// KHR_materials_clearcoat: clearcoat = 4·factor, gloss = (0.1 - roughness²)/0.099.
fn clearcoat(c: &mut Conversion<'_>) {
    let clearcoat = c.scalar(Parameter::Clearcoat).clone();
    if clearcoat == Param::Constant(0.0) {
        return;
    }
    let (factor, texture) =
        c.single("clearcoat", &clearcoat, Target::Channel(TextureChannel::R), Encoding::Linear);
    let (roughness, roughness_texture) = coat_roughness(c);
    c.out.clearcoat = Some(GltfClearcoat { factor: factor / 4.0, texture, roughness, roughness_texture });
}

/// The roughness that a coat's gloss came from, or comes to.
fn coat_roughness(c: &mut Conversion<'_>) -> (f32, Option<TextureMap>) {
    let curve = Curve::GlossOfRoughness;
    let gloss = c.scalar(Parameter::ClearcoatGloss).clone();
    if map_of(&gloss).is_some_and(|map| map.curve == curve) {
        return c.single("clearcoat_gloss", &gloss, Target::Channel(TextureChannel::G), Encoding::Linear);
    }
    let why = "glTF's textures hold the roughness, which is no multiple of it";
    let gloss = c.constant(Parameter::ClearcoatGloss, why);
    (reads_back_as(gloss, (0.1 - 0.099 * gloss).max(0.0).sqrt(), |r| curve.at(r)), None)
}

/// What a colour's slot reads of a scalar's texture: the colour whose luminance it is, or grey.
fn colored(map: &TextureMap) -> Target {
    if map.channel == TextureChannel::Y { Target::Color } else { Target::Grey }
}

/// KHR_materials_sheen: a colour of sheen's luminance.
fn sheen(c: &mut Conversion<'_>) {
    let sheen = c.scalar(Parameter::Sheen).clone();
    if sheen == Param::Constant(0.0) {
        return;
    }
    let tint = c.constant(Parameter::SheenTint, "KHR_materials_sheen tints by a colour");
    let target = map_of(&sheen).map_or(Target::Grey, colored);
    let (amount, color_texture) = c.single("sheen", &sheen, target, Encoding::Srgb);
    let grey = |v: f32| disney_luminance(Rgb::grey(f64::from(v))) as f32;
    let color = if tinted(c, 1.0, tint) == Rgb::WHITE {
        Rgb::grey(reads_back_as(amount, amount, grey))
    } else {
        tinted(c, f64::from(amount), tint).cast()
    };
    c.out.sheen = Some(GltfSheen { color: color.map(|v| v.clamp(0.0, 1.0)), color_texture, roughness: 1.0 });
}

/// KHR_materials_anisotropy: with the aspect² = 1 - 0.9·anisotropic the alphas are t = roughness²/aspect along the tangent and a =
/// roughness²·aspect along the bitangent; glTF has a = roughness² and t = a + (1 - a)·strength².
fn anisotropy(c: &mut Conversion<'_>) {
    if let Some(AnisotropyMap { map, strength }) = c.source.anisotropy.clone() {
        let part = map.as_ref().map(|map| Part { map, target: Target::Color });
        let texture = part.map(|part| c.slot("anisotropy", &[part], &[], Encoding::Linear).map);
        c.out.anisotropy = Some(GltfAnisotropy { strength, rotation: c.source.rotation, texture });
        return c.note("anisotropic", Quality::Exact, "glTF's own terms");
    }
    if c.scalar(Parameter::Anisotropic) == &Param::Constant(0.0) {
        return;
    }
    let why = "anisotropyTexture holds the strength, which is no multiple of it";
    let anisotropic = f64::from(c.constant(Parameter::Anisotropic, why));
    let aspect = (1.0 - 0.9 * anisotropic).sqrt();
    let is_textured = c.out.metallic_roughness_texture.is_some();
    let roughness = f64::from(c.out.roughness_factor);
    let a = if is_textured { Number::sqr(roughness) } else { Number::sqr(roughness) * aspect };
    let t = a / (aspect * aspect);
    let strength = if a < 1.0 { ((t - a) / (1.0 - a)).clamp(0.0, 1.0).sqrt() } else { 0.0 };
    if !is_textured {
        // The smoother axis is kept where the rougher one ends.
        c.out.roughness_factor = a.sqrt() as f32;
    }
    c.out.anisotropy =
        Some(GltfAnisotropy { strength: strength as f32, rotation: c.source.rotation, texture: None });
    if c.source.rotation != 0.0 {
        c.note("rotation", Quality::Exact, "");
    }
}

/// KHR_materials_transmission, _volume and _diffuse_transmission.
fn transmission(c: &mut Conversion<'_>, thickness: f32) {
    if !c.source.transmits() {
        return;
    }
    let index = c.constant(Parameter::Ior, "KHR_materials_ior has no texture").max(1.0);
    c.out.ior = Some(index).filter(|&n| n != 1.5);
    let is_solid = c.source.is_interface();
    let may = |c: &Conversion<'_>, p| c.scalar(p) != &Param::Constant(0.0);
    if may(c, Parameter::SpecTrans) {
        let param = c.scalar(Parameter::SpecTrans).clone();
        let (factor, texture) =
            c.single("spec_trans", &param, Target::Channel(TextureChannel::R), Encoding::Linear);
        c.out.transmission = Some(GltfTransmission { factor: factor.min(1.0), texture });
    }
    if may(c, Parameter::DiffTrans) {
        let param = c.scalar(Parameter::DiffTrans).clone();
        let (factor, texture) =
            c.single("diff_trans", &param, Target::Channel(TextureChannel::A), Encoding::Linear);
        let color = c.source.diff_trans_color.clone().unwrap_or_else(|| c.source.base_color.clone());
        let (color, color_texture) = c.color("diff_trans_color", &color);
        let factor = (factor / 2.0).min(1.0);
        c.out.diffuse_transmission = Some(GltfDiffuseTransmission { factor, texture, color, color_texture });
    }
    if is_solid {
        let volume = volume(c.source.absorption, thickness);
        let reads_back = absorption(volume.attenuation_color, volume.attenuation_distance);
        let off = (reads_back - c.source.absorption).map(f32::abs).max_channel();
        let mut reason = format!(
            "thicknessFactor {thickness}, the mesh's smallest extent, is for those who trace no rays"
        );
        if off > 0.0 {
            reason.push_str(&format!("; the coefficients read back off by {off:e}"));
        }
        c.note("absorption", Quality::Exact, reason);
        c.out.volume = Some(volume);
    }
}

/// The coefficients of a colour that is left after a distance, as they are read.
fn absorption(color: Rgb, distance: f32) -> Rgb {
    color.cast::<f64>().map(|v| -libm::log(v.max(1e-6)) / f64::from(distance)).cast()
}

/// Beer's coefficients as a colour and a distance. Colours are rounded to floats: of many distances the first is taken that reads back to
/// the same bits, else the one at which the strongest coefficient leaves 1/e, where rounding matters least.
fn volume(coefficients: Rgb, thickness: f32) -> GltfVolume {
    let strongest = coefficients.max_channel();
    let of = |distance: f32| {
        let left = |c: f32| libm::exp(-f64::from(c) * f64::from(distance)) as f32;
        let (attenuation_color, attenuation_distance) = (coefficients.map(left), distance);
        GltfVolume { thickness, attenuation_color, attenuation_distance }
    };
    let unit = strongest.recip();
    if strongest == 0.0 || !unit.is_normal() {
        return GltfVolume { thickness, attenuation_color: Rgb::WHITE, attenuation_distance: f32::INFINITY };
    }
    let reads_back = |v: &GltfVolume| absorption(v.attenuation_color, v.attenuation_distance) == coefficients;
    let candidates = (0..4096).map(|i| of(unit * (1.0 + i as f32 / 1024.0)));
    candidates.into_iter().find(reads_back).unwrap_or_else(|| of(unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absorption_reads_back_to_the_bits_where_it_can() {
        let mut exact = 0;
        for i in 0..100 {
            let color = Rgb::new(0.2 + 0.007 * i as f32, 0.9, 0.5);
            let wanted = absorption(color, 0.25);
            let volume = volume(wanted, 1.0);
            let found = absorption(volume.attenuation_color, volume.attenuation_distance);
            exact += i32::from(found == wanted);
            let off = (found - wanted).map(f32::abs).max_channel();
            assert!(off <= 1e-6 * wanted.max_channel(), "{wanted:?} {found:?}");
        }
        assert!(exact > 90, "{exact}");
        assert_eq!(volume(Rgb::BLACK, 1.0).attenuation_distance, f32::INFINITY);
    }
}
