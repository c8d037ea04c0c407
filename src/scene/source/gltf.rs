//! A glTF 2.0 material, in glTF's terms.

use crate::color::Rgb;
use crate::scene::material::TextureMap;

/// A material as glTF 2.0 describes it: the core's metallic-roughness model and the extensions that are read. Factors are in
/// the ranges of the specification; the importer sees to it.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfMaterial {
    /// `baseColorFactor`'s colour, linear, in [0, 1].
    pub base_color_factor: Rgb,
    /// `baseColorFactor`'s alpha, in [0, 1].
    pub alpha_factor: f32,
    /// `baseColorTexture`: sRGB colour and alpha.
    pub base_color_texture: Option<TextureMap>,
    /// `metallicFactor`, in [0, 1].
    pub metallic_factor: f32,
    /// `roughnessFactor`, in [0, 1]; alpha = roughness².
    pub roughness_factor: f32,
    /// `metallicRoughnessTexture`: roughness in green, metallic in blue.
    pub metallic_roughness_texture: Option<TextureMap>,
    /// `normalTexture`.
    pub normal_texture: Option<TextureMap>,
    /// `normalTexture.scale`.
    pub normal_scale: f32,
    /// Whether there is an `occlusionTexture`. It is not read: a path tracer computes what it approximates.
    pub occlusion: bool,
    /// `emissiveFactor`, in [0, 1].
    pub emissive_factor: Rgb,
    /// `emissiveTexture`, sRGB.
    pub emissive_texture: Option<TextureMap>,
    /// KHR_materials_emissive_strength; 1 without it.
    pub emissive_strength: f32,
    /// `alphaMode` with its cutoff.
    pub alpha_mode: AlphaMode,
    /// `doubleSided`.
    pub double_sided: bool,
    /// Whether a primitive with this material has a `COLOR_0`, which multiplies the base colour and, unless
    /// [`AlphaMode::Opaque`], the alpha.
    pub vertex_color: bool,
    /// KHR_materials_ior: 0, or at least 1.
    pub ior: Option<f32>,
    /// KHR_materials_specular.
    pub specular: Option<GltfSpecular>,
    /// KHR_materials_clearcoat.
    pub clearcoat: Option<GltfClearcoat>,
    /// KHR_materials_sheen.
    pub sheen: Option<GltfSheen>,
    /// KHR_materials_anisotropy.
    pub anisotropy: Option<GltfAnisotropy>,
    /// KHR_materials_transmission.
    pub transmission: Option<GltfTransmission>,
    /// KHR_materials_volume.
    pub volume: Option<GltfVolume>,
    /// KHR_materials_diffuse_transmission.
    pub diffuse_transmission: Option<GltfDiffuseTransmission>,
    /// KHR_materials_unlit: the surface shows its base colour whatever the light.
    pub unlit: bool,
    /// Whether base colour, metallic and roughness were computed from KHR_materials_pbrSpecularGlossiness.
    pub specular_glossiness: bool,
    /// What the file says about the material that is not read: extensions and textures of extensions, by name.
    pub unread: Vec<String>,
}

/// What a glTF material's alpha means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// It is ignored.
    #[default]
    Opaque,
    /// The surface is there where alpha is at least the cutoff.
    Mask {
        /// `alphaCutoff`, not negative.
        cutoff: f32,
    },
    /// It is the surface's coverage.
    Blend,
}

/// KHR_materials_specular.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfSpecular {
    /// `specularFactor`, in [0, 1].
    pub factor: f32,
    /// `specularTexture`: its alpha multiplies the factor.
    pub texture: Option<TextureMap>,
    /// `specularColorFactor`, not negative, linear.
    pub color: Rgb,
    /// `specularColorTexture`, sRGB.
    pub color_texture: Option<TextureMap>,
}

/// KHR_materials_clearcoat.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfClearcoat {
    /// `clearcoatFactor`, in [0, 1].
    pub factor: f32,
    /// `clearcoatTexture`: its red channel multiplies the factor.
    pub texture: Option<TextureMap>,
    /// `clearcoatRoughnessFactor`, in [0, 1].
    pub roughness: f32,
    /// `clearcoatRoughnessTexture`: its green channel multiplies the roughness.
    pub roughness_texture: Option<TextureMap>,
}

/// KHR_materials_sheen.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfSheen {
    /// `sheenColorFactor`, in [0, 1], linear.
    pub color: Rgb,
    /// `sheenColorTexture`, sRGB.
    pub color_texture: Option<TextureMap>,
    /// `sheenRoughnessFactor`, in [0, 1]. Its texture is not read: no lobe here has a roughness of sheen.
    pub roughness: f32,
}

/// KHR_materials_anisotropy.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfAnisotropy {
    /// `anisotropyStrength`, in [0, 1].
    pub strength: f32,
    /// `anisotropyRotation`, counter-clockwise from the tangent, in radians.
    pub rotation: f32,
    /// `anisotropyTexture`: direction in red and green, in blue what multiplies the strength.
    pub texture: Option<TextureMap>,
}

/// KHR_materials_transmission.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfTransmission {
    /// `transmissionFactor`, in [0, 1].
    pub factor: f32,
    /// `transmissionTexture`: its red channel multiplies the factor.
    pub texture: Option<TextureMap>,
}

/// KHR_materials_volume, its constant factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GltfVolume {
    /// `thicknessFactor`, not negative: 0 is a thin sheet. A path tracer needs no more of it.
    pub thickness: f32,
    /// `attenuationColor`, in [0, 1], linear: what is left of white light after `attenuation_distance`.
    pub attenuation_color: Rgb,
    /// `attenuationDistance` in metres, above 0; infinite where the file says nothing.
    pub attenuation_distance: f32,
}

/// KHR_materials_diffuse_transmission.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfDiffuseTransmission {
    /// `diffuseTransmissionFactor`, in [0, 1].
    pub factor: f32,
    /// `diffuseTransmissionTexture`: its alpha multiplies the factor.
    pub texture: Option<TextureMap>,
    /// `diffuseTransmissionColorFactor`, in [0, 1], linear.
    pub color: Rgb,
    /// `diffuseTransmissionColorTexture`, sRGB.
    pub color_texture: Option<TextureMap>,
}

impl Default for GltfMaterial {
    /// The specification's default material: white metal of roughness 1.
    fn default() -> Self {
        Self {
            base_color_factor: Rgb::WHITE,
            alpha_factor: 1.0,
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion: false,
            emissive_factor: Rgb::BLACK,
            emissive_texture: None,
            emissive_strength: 1.0,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            vertex_color: false,
            ior: None,
            specular: None,
            clearcoat: None,
            sheen: None,
            anisotropy: None,
            transmission: None,
            volume: None,
            diffuse_transmission: None,
            unlit: false,
            specular_glossiness: false,
            unread: Vec::new(),
        }
    }
}

impl GltfMaterial {
    /// The set of texture coordinates that the surface's tangents follow, if the material depends on them.
    pub fn tangent_set(&self) -> Option<u32> {
        let normal = self.normal_texture.as_ref().map(|map| map.uv_set);
        normal.or_else(|| self.anisotropy.as_ref().map(|_| 0))
    }

    /// Every texture that is read, with the field it stands in.
    pub fn textures(&self) -> impl Iterator<Item = (&'static str, &TextureMap)> {
        let coat = self.clearcoat.as_ref().and_then(|c| c.texture.as_ref());
        let diffuse = self.diffuse_transmission.as_ref();
        let specular = self.specular.as_ref();
        [
            ("baseColorTexture", self.base_color_texture.as_ref()),
            ("metallicRoughnessTexture", self.metallic_roughness_texture.as_ref()),
            ("normalTexture", self.normal_texture.as_ref()),
            ("emissiveTexture", self.emissive_texture.as_ref()),
            ("specularTexture", specular.and_then(|s| s.texture.as_ref())),
            ("specularColorTexture", specular.and_then(|s| s.color_texture.as_ref())),
            ("sheenColorTexture", self.sheen.as_ref().and_then(|s| s.color_texture.as_ref())),
            ("clearcoatTexture", coat),
            ("transmissionTexture", self.transmission.as_ref().and_then(|t| t.texture.as_ref())),
            ("diffuseTransmissionTexture", diffuse.and_then(|d| d.texture.as_ref())),
            ("diffuseTransmissionColorTexture", diffuse.and_then(|d| d.color_texture.as_ref())),
        ]
        .into_iter()
        .filter_map(|(field, map)| map.map(|map| (field, map)))
    }
}
