//! glTF materials into Disney materials.

use super::tint::{F0_OF_SPECULAR, disney_luminance, fit_tint};
use super::{ClearcoatScale, ConvertOptions, Note, Quality};
use crate::color::Rgb;
use crate::disney::{DiffuseModel, Masking, Model, Parameter};
use crate::math::Number;
use crate::record::Warning;
use crate::scene::material::{
    Curve, Emission, NormalMap, Opacity, Param, ShadingFrame, Sides, TextureChannel, TextureMap,
};
use crate::scene::source::{
    AlphaMode, GltfAnisotropy, GltfClearcoat, GltfMaterial, GltfSheen, GltfSpecular, GltfVolume,
};
use crate::scene::{AnisotropyMap, Material};

/// glTF's index of refraction where KHR_materials_ior says nothing.
const DEFAULT_IOR: f32 = 1.5;

/// The Disney material of the glTF material `source` called `name`, with glTF's own diffuse term replaced by that of `options`.
///
/// Disney's model with the matched G and `lambert_fresnel` is glTF's metallic-roughness model; under `burley` the parameters are
/// carried and the diffuse term differs.
pub(super) fn convert(
    name: &str,
    source: &GltfMaterial,
    options: &ConvertOptions,
    notes: &mut Vec<Note>,
    warnings: &mut Vec<Warning>,
) -> Material {
    let diffuse = options.diffuse.unwrap_or_default();
    let mut notes = Notes { material: name, notes };
    let mut material = Material {
        masking: Masking::Matched,
        diffuse,
        opacity: opacity(source, &mut notes),
        frame: ShadingFrame::Surface,
        sides: Sides::Both,
        culled: options.cull && !source.double_sided,
        vertex_color: source.vertex_color,
        vertex_alpha: source.vertex_color && source.alpha_mode != AlphaMode::Opaque,
        ..Material::default()
    };
    note_unread(source, &mut notes);
    if source.unlit {
        make_unlit(source, &mut material, &mut notes);
        return material;
    }

    let (core, reason) = quality_of_core(diffuse);
    material.base_color = colored(source.base_color_factor, source.base_color_texture.as_ref());
    notes.add("baseColorFactor", core, reason);
    if source.base_color_texture.is_some() {
        notes.add("baseColorTexture", core, reason);
    }
    if source.vertex_color {
        notes.add("COLOR_0", core, reason);
    }
    let map = source.metallic_roughness_texture.as_ref();
    *material.scalar_mut(Parameter::Metallic) = textured(source.metallic_factor, map, TextureChannel::B);
    *material.scalar_mut(Parameter::Roughness) = textured(source.roughness_factor, map, TextureChannel::G);
    notes.add("metallicFactor", core, reason);
    notes.add("roughnessFactor", core, reason);
    if map.is_some() {
        notes.add("metallicRoughnessTexture", core, reason);
    }

    convert_specular(source, core, reason, &mut material, &mut notes);
    for parameter in [
        Parameter::Subsurface,
        Parameter::Anisotropic,
        Parameter::Sheen,
        Parameter::SheenTint,
        Parameter::Clearcoat,
    ] {
        *material.scalar_mut(parameter) = Param::Constant(0.0);
    }
    *material.scalar_mut(Parameter::ClearcoatGloss) = Param::Constant(1.0);
    if let Some(coat) = &source.clearcoat {
        convert_clearcoat(coat, options.clearcoat, &mut material, &mut notes);
    }
    if let Some(sheen) = &source.sheen {
        convert_sheen(sheen, source, options.sheen_scale, &mut material, &mut notes);
    }
    if let Some(anisotropy) = &source.anisotropy {
        convert_anisotropy(anisotropy, source, &mut material, &mut notes);
    }
    convert_transmission(source, &mut material, &mut notes);
    convert_emission(source, &mut material, &mut notes);
    if let Some(map) = &source.normal_texture {
        material.normal_map = Some(NormalMap { map: map.clone(), scale: source.normal_scale });
        let reason =
            "with the mesh's tangents or MikkTSpace's; a mesh without normals has the triangles' own";
        notes.add("normalTexture", Quality::Exact, reason);
    }
    if source.occlusion {
        let reason = "not read: a path tracer computes what it approximates";
        notes.add("occlusionTexture", Quality::Exact, reason);
    }
    if let Some(specular) = material.scalar(Parameter::Specular).constant()
        && f64::from(specular) * F0_OF_SPECULAR > 0.5
        && source.metallic_factor < 1.0
    {
        let message = "a dielectric that reflects more than half of the light head-on; the Disney model adds its \
                       diffuse term without taking that away, so its albedo exceeds 1";
        warnings.push(Warning::new(format!("material {name:?}"), message));
    }
    material
}

/// The notes of one material.
struct Notes<'a> {
    material: &'a str,
    notes: &'a mut Vec<Note>,
}

impl Notes<'_> {
    fn add(&mut self, field: &str, quality: Quality, reason: &str) {
        let (material, field) = (self.material.to_owned(), field.to_owned());
        self.notes.push(Note { material, field, quality, reason: reason.to_owned() });
    }
}

/// How well the core model is kept under a diffuse term.
fn quality_of_core(diffuse: DiffuseModel) -> (Quality, &'static str) {
    match diffuse {
        DiffuseModel::LambertFresnel => (Quality::Exact, ""),
        DiffuseModel::Burley => (
            Quality::Carried,
            "Burley's diffuse term for Lambert times 1 - F: albedo of a white dielectric +5% (roughness 0.5, 0°), +8% \
             (roughness 1, 0°), +24% (75°), +47% (85°)",
        ),
        DiffuseModel::Lambert => (
            Quality::Carried,
            "Lambert without 1 - F: the diffuse term keeps the light that the highlight reflects",
        ),
    }
}

fn colored(factor: Rgb, map: Option<&TextureMap>) -> Param<Rgb> {
    match map {
        Some(map) => Param::Texture { map: map.clone(), factor },
        None => Param::Constant(factor),
    }
}

fn textured(factor: f32, map: Option<&TextureMap>, channel: TextureChannel) -> Param<f32> {
    match map {
        Some(map) => Param::Texture { map: TextureMap { channel, ..map.clone() }, factor },
        None => Param::Constant(factor),
    }
}

/// OPAQUE, MASK and BLEND as coverage.
fn opacity(source: &GltfMaterial, notes: &mut Notes) -> Opacity {
    let alpha = textured(source.alpha_factor, source.base_color_texture.as_ref(), TextureChannel::A);
    match source.alpha_mode {
        AlphaMode::Opaque => Opacity::default(),
        AlphaMode::Mask { cutoff } => {
            notes.add("alphaMode", Quality::Exact, "MASK");
            Opacity { alpha, cutoff: Some(cutoff) }
        }
        AlphaMode::Blend => {
            notes.add("alphaMode", Quality::Exact, "BLEND: alpha as coverage");
            Opacity { alpha, cutoff: None }
        }
    }
}

fn note_unread(source: &GltfMaterial, notes: &mut Notes) {
    for name in &source.unread {
        let reason = match name.as_str() {
            "KHR_materials_dispersion" => "all wavelengths are bent alike",
            "KHR_materials_iridescence" => "Disney's lobes have no thin film",
            _ => "not read",
        };
        notes.add(name, Quality::Dropped, reason);
    }
    if source.specular_glossiness {
        let mut reason =
            "metallic and base colour by Khronos' solveMetallic; F0 of a dielectric is 0.04".to_owned();
        if source.metallic_roughness_texture.is_some() {
            reason.push_str("; textures are converted texel by texel, to 8 bits");
        }
        notes.add("KHR_materials_pbrSpecularGlossiness", Quality::Approximated, &reason);
    }
}

/// The sides that light leaves: back faces of single-sided materials aren't there for glTF.
fn emitting_sides(source: &GltfMaterial) -> Sides {
    if source.double_sided { Sides::Both } else { Sides::Front }
}

fn convert_emission(source: &GltfMaterial, material: &mut Material, notes: &mut Notes) {
    let color = colored(source.emissive_factor, source.emissive_texture.as_ref());
    material.emission =
        Emission { color, strength: source.emissive_strength, sides: emitting_sides(source), unlit: false };
    if material.emits() {
        notes.add("emissiveFactor", Quality::Exact, "");
        if source.emissive_texture.is_some() {
            notes.add("emissiveTexture", Quality::Exact, "");
        }
        if source.emissive_strength != 1.0 {
            notes.add("KHR_materials_emissive_strength", Quality::Exact, "");
        }
    }
}

/// KHR_materials_unlit: the base colour as emission, no reflection.
fn make_unlit(source: &GltfMaterial, material: &mut Material, notes: &mut Notes) {
    material.model = Model::Diffuse;
    material.base_color = Param::Constant(Rgb::BLACK);
    material.vertex_color = source.vertex_color;
    material.emission = Emission {
        color: colored(source.base_color_factor, source.base_color_texture.as_ref()),
        strength: 1.0,
        sides: Sides::Both,
        unlit: true,
    };
    notes.add("KHR_materials_unlit", Quality::Exact, "the base colour, which the camera alone sees");
    if source.vertex_color {
        notes.add("COLOR_0", Quality::Exact, "");
    }
}

/// F0 of a smooth interface to air: ((n-1)/(n+1))²; glTF's ior 0 stands for F = 1 everywhere.
pub(crate) fn f0_of_ior(ior: f32) -> f64 {
    let ior = f64::from(ior);
    if ior == 0.0 { 1.0 } else { Number::sqr((ior - 1.0) / (ior + 1.0)) }
}

/// KHR_materials_ior and KHR_materials_specular: F0 = min(F0(ior)·color, 1)·factor as specular and specular_tint.
fn convert_specular(
    source: &GltfMaterial,
    core: Quality,
    reason: &str,
    material: &mut Material,
    notes: &mut Notes,
) {
    let f0_ior = f0_of_ior(source.ior.unwrap_or(DEFAULT_IOR));
    let none = GltfSpecular { factor: 1.0, texture: None, color: Rgb::WHITE, color_texture: None };
    let extension = source.specular.as_ref().unwrap_or(&none);
    // In f64, so that the default F0 of 0.04 is specular 0.5 to the bit.
    let f0 = extension.color.cast().map(|c: f64| (f0_ior * c).min(1.0) * f64::from(extension.factor));
    let tint = fit_tint(f0, source.base_color_factor);
    // Rounding may lift the luminance of white above 1.
    let specular = ((disney_luminance(f0) / F0_OF_SPECULAR) as f32).min(Parameter::Specular.max());
    // F0 is in proportion to the factor, and so to its texture.
    let strength = extension.texture.as_ref();
    let (map, channel) = match (strength, extension.color_texture.as_ref()) {
        (Some(strength), _) => (Some(strength), TextureChannel::A),
        (None, color) => (color, TextureChannel::Y),
    };
    *material.scalar_mut(Parameter::Specular) = textured(specular, map, channel);
    *material.scalar_mut(Parameter::SpecularTint) = Param::Constant(tint.amount);
    *material.scalar_mut(Parameter::F90) = textured(extension.factor, strength, TextureChannel::A);
    match source.ior {
        Some(0.0) => {
            let reason = "0 means a reflectance of 1 at all angles: F0 is 1, but the diffuse term stays";
            notes.add("KHR_materials_ior", Quality::Approximated, reason);
        }
        Some(ior) if core == Quality::Carried && ior > 1.5 => {
            let reason = format!("{reason}; more with a higher ior: +9% at 1.8, +17% at 2.42 under burley");
            notes.add("KHR_materials_ior", core, &reason);
        }
        Some(_) => notes.add("KHR_materials_ior", core, reason),
        None => {}
    }
    if source.specular.is_some() {
        let mut reason = format!("luminance of F0 exact, hue: {}", tint.describe());
        if extension.factor != 1.0 {
            reason.push_str("; f90 carries the factor to grazing angles");
        }
        notes.add("KHR_materials_specular", Quality::Approximated, &reason);
        let (quality, reason) = match (strength, &extension.color_texture) {
            (_, None) => return,
            (Some(_), Some(_)) => (Quality::Dropped, "a parameter has one texture: that is specularTexture"),
            (None, Some(_)) => {
                (Quality::Approximated, "its luminance varies the specular, its hue is the factor's")
            }
        };
        notes.add("KHR_materials_specular.specularColorTexture", quality, reason);
    }
}

/// KHR_materials_clearcoat: Disney's coat is 0.25·clearcoat·GTR1 with F0 0.04, so factor 1 is clearcoat 4.
fn convert_clearcoat(
    coat: &GltfClearcoat,
    scale: ClearcoatScale,
    material: &mut Material,
    notes: &mut Notes,
) {
    let (factor, told) = match scale {
        ClearcoatScale::Matched => (4.0 * coat.factor, "clearcoat = 4·factor"),
        ClearcoatScale::Published => (coat.factor, "clearcoat = factor, 4.3 to 8 times dimmer than glTF's"),
    };
    *material.scalar_mut(Parameter::Clearcoat) = textured(factor, coat.texture.as_ref(), TextureChannel::R);
    // Disney's alpha is lerp(0.1, 0.001, gloss), glTF's roughness².
    let curve = Curve::GlossOfRoughness;
    *material.scalar_mut(Parameter::ClearcoatGloss) = match &coat.roughness_texture {
        None => Param::Constant(curve.at(coat.roughness)),
        Some(map) => Param::Texture {
            map: TextureMap { channel: TextureChannel::G, curve, ..map.clone() },
            factor: coat.roughness,
        },
    };
    let mut reason = format!("{told}; GTR1 for GGX, and the base is not darkened under the coat");
    // lerp(0.1, 0.001, 0) is the roughest coat there is.
    if coat.roughness * coat.roughness > 0.1 {
        reason.push_str("; the coat's alpha ends at 0.1");
    }
    notes.add("KHR_materials_clearcoat", Quality::Approximated, &reason);
}

/// KHR_materials_sheen: colour as sheen and sheen_tint.
fn convert_sheen(
    sheen: &GltfSheen,
    source: &GltfMaterial,
    scale: f32,
    material: &mut Material,
    notes: &mut Notes,
) {
    let color = sheen.color.cast();
    let tint = fit_tint(color, source.base_color_factor);
    let amount = (scale * disney_luminance(color) as f32).min(1.0);
    *material.scalar_mut(Parameter::Sheen) =
        textured(amount, sheen.color_texture.as_ref(), TextureChannel::Y);
    *material.scalar_mut(Parameter::SheenTint) = Param::Constant(tint.amount);
    let reason = format!(
        "no roughness; Charlie's lobe is 6 to 26 times brighter than Disney's at an equal factor; hue: {}",
        tint.describe()
    );
    notes.add("KHR_materials_sheen", Quality::Approximated, &reason);
    if sheen.color_texture.is_some() {
        let reason = "its luminance varies the sheen, its hue is the factor's";
        notes.add("KHR_materials_sheen.sheenColorTexture", Quality::Approximated, reason);
    }
}

/// KHR_materials_anisotropy: worked out once, or at each point where a texture varies it or the roughness.
fn convert_anisotropy(
    anisotropy: &GltfAnisotropy,
    source: &GltfMaterial,
    material: &mut Material,
    notes: &mut Notes,
) {
    let GltfAnisotropy { strength, rotation, ref texture } = *anisotropy;
    material.rotation = rotation;
    let disney = AnisotropyMap::disney(source.roughness_factor, strength);
    if texture.is_some() || source.metallic_roughness_texture.is_some() {
        material.anisotropy = Some(AnisotropyMap { map: texture.clone(), strength });
    } else {
        *material.scalar_mut(Parameter::Anisotropic) = Param::Constant(disney.anisotropic.min(1.0));
        *material.scalar_mut(Parameter::Roughness) = Param::Constant(disney.roughness);
    }
    let (quality, reason) = match disney.anisotropic <= 1.0 {
        true => (Quality::Exact, ""),
        false => {
            (Quality::Approximated, "the ratio of the two alphas is more than Disney's 10 and ends there")
        }
    };
    notes.add("KHR_materials_anisotropy", quality, reason);
    if texture.is_some() {
        notes.add("KHR_materials_anisotropy.anisotropyTexture", quality, reason);
    }
}

/// A colour of 0 stands for this little: nothing would be left at any distance, and infinity is no coefficient.
const DARKEST: f64 = 1e-6;

/// KHR_materials_transmission, _volume and _diffuse_transmission: a thin sheet, unless the volume has a thickness.
fn convert_transmission(source: &GltfMaterial, material: &mut Material, notes: &mut Notes) {
    let solid = source.volume.filter(|v| v.thickness > 0.0);
    let transmits = source.transmission.is_some() || source.diffuse_transmission.is_some();
    material.thin_walled = transmits && solid.is_none();
    if transmits {
        set_ior(source, material, notes);
    }
    if let Some(transmission) = &source.transmission {
        let map = transmission.texture.as_ref();
        *material.scalar_mut(Parameter::SpecTrans) = textured(transmission.factor, map, TextureChannel::R);
        if solid.is_some() {
            material.transmission_color = Some(material.base_color.clone());
            let reason = "the base colour tints each crossing of the surface";
            notes.add("KHR_materials_transmission", Quality::Exact, reason);
        } else {
            let reason = "a thin sheet, tinted once by the base colour; Burley's roughness for what passes, (0.65·ior - \
                          0.35)·roughness, is less than glTF's";
            notes.add("KHR_materials_transmission", Quality::Approximated, reason);
        }
    }
    if let Some(diffuse) = &source.diffuse_transmission {
        let map = diffuse.texture.as_ref();
        *material.scalar_mut(Parameter::DiffTrans) = textured(2.0 * diffuse.factor, map, TextureChannel::A);
        material.diff_trans_color = Some(colored(diffuse.color, diffuse.color_texture.as_ref()));
        let reason = "diff_trans = 2·factor; what passes isn't dimmed by the highlight's Fresnel term";
        notes.add("KHR_materials_diffuse_transmission", Quality::Approximated, reason);
    }
    if let Some(volume) = source.volume {
        convert_volume(&volume, transmits, material, notes);
    }
}

fn convert_volume(volume: &GltfVolume, transmits: bool, material: &mut Material, notes: &mut Notes) {
    let field = "KHR_materials_volume";
    if volume.thickness == 0.0 {
        notes.add(field, Quality::Exact, "thickness 0: a thin sheet");
    } else if !transmits {
        notes.add(field, Quality::Exact, "of no effect, since nothing passes the surface");
    } else {
        let distance = f64::from(volume.attenuation_distance);
        let color = volume.attenuation_color.cast::<f64>();
        material.absorption = color.map(|c| -libm::log(c.max(DARKEST)) / distance).cast();
        match color.to_array().contains(&0.0) {
            true => notes.add(field, Quality::Approximated, "an attenuation colour of 0 is taken for 10⁻⁶"),
            false => notes.add(field, Quality::Exact, "for a closed mesh"),
        }
    }
}

/// The index by which light that passes is bent. Without KHR_materials_ior it is 1.5.
fn set_ior(source: &GltfMaterial, material: &mut Material, notes: &mut Notes) {
    let ior = source.ior.unwrap_or(DEFAULT_IOR);
    // 0 stands for a reflectance of 1: nothing passes that it could bend.
    let taken = if ior == 0.0 { Parameter::Ior.max() } else { ior.min(Parameter::Ior.max()) };
    *material.scalar_mut(Parameter::Ior) = Param::Constant(taken);
    if taken != ior {
        let reason = format!("what passes is bent as by an index of {taken}");
        notes.add("KHR_materials_ior", Quality::Approximated, &reason);
    }
}

#[cfg(test)]
mod tests;
