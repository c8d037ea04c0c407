//! Materials into [`GltfMaterial`]s: the core from the crate's types, extensions from their JSON.

use gltf::json::Value;
use gltf::json::material::{AlphaMode as JsonAlphaMode, Material};
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use serde::Deserialize;

use super::error::GltfError;
use super::specular_glossiness;
use super::texture::{Slot, Textures};
use crate::color::Rgb;
use crate::scene::material::TextureMap;
use crate::scene::source::{
    AlphaMode, GltfAnisotropy, GltfClearcoat, GltfDiffuseTransmission, GltfMaterial, GltfSheen, GltfSpecular,
    GltfTransmission, GltfVolume,
};
use crate::scene::texture::Encoding;

/// The legal values of a number.
#[derive(Clone, Copy)]
pub(super) enum Limits {
    Unit,
    NotNegative,
    Positive,
    Finite,
    Ior,
}

/// Reads the material called `name`, `materials[index]`.
pub(super) fn read(
    json: &Material,
    name: &str,
    index: usize,
    vertex_color: bool,
    textures: &mut Textures,
) -> Result<GltfMaterial, GltfError> {
    let mut reader = Reader { name, index, textures, unread: Vec::new() };
    let pbr = &json.pbr_metallic_roughness;
    let [r, g, b, a] = pbr.base_color_factor.0;
    let metallic_roughness = pbr.metallic_roughness_texture.as_ref();
    let (metallic, roughness) = (pbr.metallic_factor.0, pbr.roughness_factor.0);
    let emissive = json.emissive_factor.0;
    let mut material = GltfMaterial {
        base_color_factor: reader.color("baseColorFactor", [r, g, b], Limits::Unit)?,
        alpha_factor: reader.number("baseColorFactor's alpha", a, Limits::Unit)?,
        base_color_texture: reader.info(
            pbr.base_color_texture.as_ref(),
            Encoding::Srgb,
            "baseColorTexture",
        )?,
        metallic_factor: reader.number("metallicFactor", metallic, Limits::Unit)?,
        roughness_factor: reader.number("roughnessFactor", roughness, Limits::Unit)?,
        metallic_roughness_texture: reader.info_times(
            &[metallic, roughness],
            metallic_roughness,
            Encoding::Linear,
            "metallicRoughnessTexture",
        )?,
        occlusion: json.occlusion_texture.is_some(),
        emissive_factor: reader.color("emissiveFactor", emissive, Limits::Unit)?,
        emissive_texture: reader.info_times(
            &emissive,
            json.emissive_texture.as_ref(),
            Encoding::Srgb,
            "emissiveTexture",
        )?,
        alpha_mode: reader.alpha_mode(json)?,
        double_sided: json.double_sided,
        vertex_color,
        ..GltfMaterial::default()
    };
    if let Some(normal) = json.normal_texture.as_ref().filter(|normal| reader.textures.want(&[normal.scale]))
    {
        let slot = Slot::normal(normal)?;
        let element = reader.element("normalTexture");
        material.normal_texture = Some(reader.textures.map(&slot, Encoding::Linear, &element)?);
        material.normal_scale = reader.number("normalTexture.scale", normal.scale, Limits::Finite)?;
    }
    if let Some(extensions) = &json.extensions {
        if let Some(emissive) = &extensions.emissive_strength {
            let strength = emissive.emissive_strength.0;
            material.emissive_strength = reader.number("emissiveStrength", strength, Limits::NotNegative)?;
        }
        for (extension, value) in &extensions.others {
            reader.extension(extension, value, &mut material)?;
        }
    }
    material.unread = reader.unread;
    Ok(material)
}

/// Reads the parts of a material.
pub(super) struct Reader<'r, 'a> {
    /// The material's name.
    pub(super) name: &'r str,
    index: usize,
    /// The file's textures.
    pub(super) textures: &'r mut Textures<'a>,
    unread: Vec<String>,
}

impl Reader<'_, '_> {
    fn element(&self, field: &str) -> String {
        format!("materials[{}].{field}", self.index)
    }

    /// The number `value` of `field`, if it is within `limits`.
    pub(super) fn number(&self, field: &'static str, value: f32, limits: Limits) -> Result<f32, GltfError> {
        let (fits, expected) = match limits {
            Limits::Unit => ((0.0..=1.0).contains(&value), "in [0, 1]"),
            Limits::NotNegative => (value.is_finite() && value >= 0.0, "finite and not negative"),
            Limits::Positive => (value.is_finite() && value > 0.0, "finite and above 0"),
            Limits::Finite => (value.is_finite(), "finite"),
            Limits::Ior => (value.is_finite() && (value == 0.0 || value >= 1.0), "0, or at least 1"),
        };
        let material = || self.name.to_owned();
        if fits { Ok(value) } else { Err(GltfError::Factor { material: material(), field, value, expected }) }
    }

    /// The colour `color` of `field`, if it is within `limits`.
    pub(super) fn color(
        &self,
        field: &'static str,
        color: [f32; 3],
        limits: Limits,
    ) -> Result<Rgb, GltfError> {
        color.into_iter().try_for_each(|v| self.number(field, v, limits).map(drop))?;
        Ok(color.into())
    }

    /// The texture of `field`, if there is one, whose values mean `encoding`.
    pub(super) fn info(
        &mut self,
        info: Option<&Info>,
        encoding: Encoding,
        field: &'static str,
    ) -> Result<Option<TextureMap>, GltfError> {
        let element = self.element(field);
        info.map(|info| self.textures.map(&info.into(), encoding, &element)).transpose()
    }

    /// As [`Self::info`]; none where all `factors` of its values are 0, if only what is sampled is wanted.
    fn info_times(
        &mut self,
        factors: &[f32],
        info: Option<&Info>,
        encoding: Encoding,
        field: &'static str,
    ) -> Result<Option<TextureMap>, GltfError> {
        let wanted = info.filter(|_| self.textures.want(factors));
        self.info(wanted, encoding, field)
    }

    fn alpha_mode(&self, json: &Material) -> Result<AlphaMode, GltfError> {
        match json.alpha_mode {
            Checked::Valid(JsonAlphaMode::Opaque) => Ok(AlphaMode::Opaque),
            Checked::Valid(JsonAlphaMode::Blend) => Ok(AlphaMode::Blend),
            Checked::Valid(JsonAlphaMode::Mask) => {
                let cutoff = json.alpha_cutoff.unwrap_or_default().0;
                Ok(AlphaMode::Mask { cutoff: self.number("alphaCutoff", cutoff, Limits::NotNegative)? })
            }
            Checked::Invalid => Err(GltfError::Invalid {
                element: format!("materials[{}]", self.index),
                property: "alphaMode",
                expected: "OPAQUE, MASK or BLEND",
            }),
        }
    }

    /// Notes a texture of an extension that is not read.
    fn skip(&mut self, texture: Option<&Info>, name: &str) {
        if texture.is_some() {
            self.unread.push(name.to_owned());
        }
    }

    /// Reads what the material says in `extension`, or notes that it is not read.
    fn extension(
        &mut self,
        extension: &str,
        json: &Value,
        material: &mut GltfMaterial,
    ) -> Result<(), GltfError> {
        match extension {
            "KHR_materials_ior" => {
                let json: Ior = parse(json)?;
                material.ior = Some(self.number("ior", json.ior, Limits::Ior)?);
            }
            "KHR_materials_unlit" => material.unlit = true,
            "KHR_materials_pbrSpecularGlossiness" => specular_glossiness::read(json, self, material)?,
            "KHR_materials_specular" => {
                let json: Specular = parse(json)?;
                let (texture, color_texture) = (json.specular_texture, json.specular_color_texture);
                material.specular = Some(GltfSpecular {
                    factor: self.number("specularFactor", json.specular_factor, Limits::Unit)?,
                    texture: self.info_times(
                        &[json.specular_factor],
                        texture.as_ref(),
                        Encoding::Linear,
                        "specularTexture",
                    )?,
                    color: self.color(
                        "specularColorFactor",
                        json.specular_color_factor,
                        Limits::NotNegative,
                    )?,
                    color_texture: self.info_times(
                        &json.specular_color_factor,
                        color_texture.as_ref(),
                        Encoding::Srgb,
                        "specularColorTexture",
                    )?,
                });
            }
            "KHR_materials_clearcoat" => {
                let json: Clearcoat = parse(json)?;
                material.clearcoat = Some(GltfClearcoat {
                    factor: self.number("clearcoatFactor", json.clearcoat_factor, Limits::Unit)?,
                    texture: self.info_times(
                        &[json.clearcoat_factor],
                        json.clearcoat_texture.as_ref(),
                        Encoding::Linear,
                        "clearcoatTexture",
                    )?,
                    roughness: self.number(
                        "clearcoatRoughnessFactor",
                        json.clearcoat_roughness_factor,
                        Limits::Unit,
                    )?,
                    roughness_texture: self.info_times(
                        &[json.clearcoat_roughness_factor],
                        json.clearcoat_roughness_texture.as_ref(),
                        Encoding::Linear,
                        "clearcoatRoughnessTexture",
                    )?,
                });
                if json.clearcoat_normal_texture.is_some() {
                    self.unread.push("KHR_materials_clearcoat.clearcoatNormalTexture".into());
                }
            }
            "KHR_materials_sheen" => {
                let json: Sheen = parse(json)?;
                material.sheen = Some(GltfSheen {
                    color: self.color("sheenColorFactor", json.sheen_color_factor, Limits::Unit)?,
                    color_texture: self.info_times(
                        &json.sheen_color_factor,
                        json.sheen_color_texture.as_ref(),
                        Encoding::Srgb,
                        "sheenColorTexture",
                    )?,
                    roughness: self.number(
                        "sheenRoughnessFactor",
                        json.sheen_roughness_factor,
                        Limits::Unit,
                    )?,
                });
                self.skip(json.sheen_roughness_texture.as_ref(), "KHR_materials_sheen.sheenRoughnessTexture");
            }
            "KHR_materials_anisotropy" => {
                let json: Anisotropy = parse(json)?;
                material.anisotropy = Some(GltfAnisotropy {
                    strength: self.number("anisotropyStrength", json.anisotropy_strength, Limits::Unit)?,
                    rotation: self.number("anisotropyRotation", json.anisotropy_rotation, Limits::Finite)?,
                    texture: self.info_times(
                        &[json.anisotropy_strength],
                        json.anisotropy_texture.as_ref(),
                        Encoding::Linear,
                        "anisotropyTexture",
                    )?,
                });
            }
            "KHR_materials_transmission" => {
                let json: Transmission = parse(json)?;
                material.transmission = Some(GltfTransmission {
                    factor: self.number("transmissionFactor", json.transmission_factor, Limits::Unit)?,
                    texture: self.info_times(
                        &[json.transmission_factor],
                        json.transmission_texture.as_ref(),
                        Encoding::Linear,
                        "transmissionTexture",
                    )?,
                });
            }
            "KHR_materials_volume" => {
                let json: Volume = parse(json)?;
                let distance = json.attenuation_distance;
                material.volume = Some(GltfVolume {
                    thickness: self.number("thicknessFactor", json.thickness_factor, Limits::NotNegative)?,
                    attenuation_color: self.color(
                        "attenuationColor",
                        json.attenuation_color,
                        Limits::Unit,
                    )?,
                    attenuation_distance: match distance {
                        None => f32::INFINITY,
                        Some(distance) => self.number("attenuationDistance", distance, Limits::Positive)?,
                    },
                });
            }
            "KHR_materials_diffuse_transmission" => {
                let json: DiffuseTransmission = parse(json)?;
                let factor = json.diffuse_transmission_factor;
                let color = json.diffuse_transmission_color_factor;
                material.diffuse_transmission = Some(GltfDiffuseTransmission {
                    factor: self.number("diffuseTransmissionFactor", factor, Limits::Unit)?,
                    texture: self.info_times(
                        &[factor],
                        json.diffuse_transmission_texture.as_ref(),
                        Encoding::Linear,
                        "diffuseTransmissionTexture",
                    )?,
                    color: self.color("diffuseTransmissionColorFactor", color, Limits::Unit)?,
                    color_texture: self.info_times(
                        &color,
                        json.diffuse_transmission_color_texture.as_ref(),
                        Encoding::Srgb,
                        "diffuseTransmissionColorTexture",
                    )?,
                });
            }
            other => self.unread.push(other.to_owned()),
        }
        Ok(())
    }
}

/// An extension's object.
pub(super) fn parse<T: for<'de> Deserialize<'de>>(json: &Value) -> Result<T, GltfError> {
    Ok(gltf::json::deserialize::from_value(json.clone())?)
}

/// KHR_materials_ior.
#[derive(Deserialize)]
#[serde(default)]
struct Ior {
    ior: f32,
}

impl Default for Ior {
    fn default() -> Self {
        Self { ior: 1.5 }
    }
}

/// KHR_materials_specular.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Specular {
    specular_factor: f32,
    specular_texture: Option<Info>,
    specular_color_factor: [f32; 3],
    specular_color_texture: Option<Info>,
}

impl Default for Specular {
    fn default() -> Self {
        Self {
            specular_factor: 1.0,
            specular_texture: None,
            specular_color_factor: [1.0; 3],
            specular_color_texture: None,
        }
    }
}

/// KHR_materials_clearcoat.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Clearcoat {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<Value>,
}

/// KHR_materials_sheen.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Sheen {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

/// KHR_materials_anisotropy.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Anisotropy {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<Info>,
}

/// KHR_materials_transmission.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transmission {
    transmission_factor: f32,
    transmission_texture: Option<Info>,
}

/// KHR_materials_volume. The thickness texture is for rasterisers, as the extension says.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Volume {
    thickness_factor: f32,
    attenuation_distance: Option<f32>,
    attenuation_color: [f32; 3],
}

impl Default for Volume {
    fn default() -> Self {
        Self { thickness_factor: 0.0, attenuation_distance: None, attenuation_color: [1.0; 3] }
    }
}

/// KHR_materials_diffuse_transmission.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct DiffuseTransmission {
    diffuse_transmission_factor: f32,
    diffuse_transmission_texture: Option<Info>,
    diffuse_transmission_color_factor: [f32; 3],
    diffuse_transmission_color_texture: Option<Info>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self {
            diffuse_transmission_factor: 0.0,
            diffuse_transmission_texture: None,
            diffuse_transmission_color_factor: [1.0; 3],
            diffuse_transmission_color_texture: None,
        }
    }
}
