//! A [`GltfMaterial`] as glTF's JSON: what is the specification's default is not written.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::texture::{Textures, placement};
use crate::color::Rgb;
use crate::scene::material::TextureMap;
use crate::scene::source::{AlphaMode, GltfMaterial};

/// A number as its shortest decimal that reads back to the same bits.
pub(super) fn number(value: f32) -> Value {
    let short = value.to_string().parse().ok().filter(|short: &f64| *short as f32 == value);
    short.unwrap_or(f64::from(value)).into()
}

/// A list of [`number`]s.
pub(super) fn numbers(values: &[f32]) -> Value {
    values.iter().copied().map(number).collect()
}

/// An object that leaves out what is as by default.
#[derive(Default)]
struct Object(Map<String, Value>);

impl Object {
    fn put(&mut self, key: &str, value: impl Into<Value>) {
        self.0.insert(key.to_owned(), value.into());
    }

    fn number(&mut self, key: &str, value: f32, default: f32) {
        if value != default {
            self.put(key, number(value));
        }
    }

    fn color(&mut self, key: &str, color: Rgb, default: Rgb) {
        if color != default {
            self.put(key, numbers(&color.to_array()));
        }
    }

    fn texture(&mut self, key: &str, map: Option<&TextureMap>, writer: &mut MaterialWriter) {
        if let Some(map) = map {
            self.put(key, writer.info(map));
        }
    }

    fn object(&mut self, key: &str, object: Self) {
        if !object.0.is_empty() {
            self.put(key, object.0);
        }
    }
}

/// Writes materials, and remembers what they use.
pub(super) struct MaterialWriter<'w> {
    pub(super) textures: &'w mut Textures,
    pub(super) extensions: &'w mut BTreeSet<&'static str>,
}

impl MaterialWriter<'_> {
    /// The reference to a texture, with its transform.
    fn info(&mut self, map: &TextureMap) -> Map<String, Value> {
        let mut info = Object::default();
        info.put("index", self.textures.index_of(map.texture));
        if map.uv_set != 0 {
            info.put("texCoord", map.uv_set);
        }
        let at = placement(map.texture_from_uv);
        let mut transform = Object::default();
        if at.offset != [0.0; 2] {
            transform.put("offset", numbers(&at.offset));
        }
        transform.number("rotation", at.rotation, 0.0);
        if at.scale != [1.0; 2] {
            transform.put("scale", numbers(&at.scale));
        }
        if !transform.0.is_empty() {
            self.extensions.insert("KHR_texture_transform");
            info.put("extensions", json!({"KHR_texture_transform": transform.0}));
        }
        info.0
    }

    /// The material called `name`.
    pub(super) fn write(&mut self, name: &str, m: &GltfMaterial) -> Value {
        let mut pbr = Object::default();
        let [r, g, b] = m.base_color_factor.to_array();
        if [r, g, b, m.alpha_factor] != [1.0; 4] {
            pbr.put("baseColorFactor", numbers(&[r, g, b, m.alpha_factor]));
        }
        pbr.texture("baseColorTexture", m.base_color_texture.as_ref(), self);
        pbr.number("metallicFactor", m.metallic_factor, 1.0);
        pbr.number("roughnessFactor", m.roughness_factor, 1.0);
        pbr.texture("metallicRoughnessTexture", m.metallic_roughness_texture.as_ref(), self);
        let mut material = Object::default();
        material.put("name", name);
        material.object("pbrMetallicRoughness", pbr);
        if let Some(map) = &m.normal_texture {
            let mut normal = Object(self.info(map));
            normal.number("scale", m.normal_scale, 1.0);
            material.object("normalTexture", normal);
        }
        material.color("emissiveFactor", m.emissive_factor, Rgb::BLACK);
        material.texture("emissiveTexture", m.emissive_texture.as_ref(), self);
        match m.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Blend => material.put("alphaMode", "BLEND"),
            AlphaMode::Mask { cutoff } => {
                material.put("alphaMode", "MASK");
                material.number("alphaCutoff", cutoff, 0.5);
            }
        }
        if m.double_sided {
            material.put("doubleSided", true);
        }
        let mut extensions = Map::new();
        for (extension, object) in self.extensions(m) {
            self.extensions.insert(extension);
            extensions.insert(extension.to_owned(), object.0.into());
        }
        material.object("extensions", Object(extensions));
        material.0.into()
    }

    /// The extensions that the material has, in the order of their names.
    fn extensions(&mut self, m: &GltfMaterial) -> Vec<(&'static str, Object)> {
        let mut all = Vec::new();
        let mut add = |name, fill: &mut dyn FnMut(&mut Object)| {
            let mut object = Object::default();
            fill(&mut object);
            all.push((name, object));
        };
        if let Some(anisotropy) = &m.anisotropy {
            add("KHR_materials_anisotropy", &mut |o| {
                o.number("anisotropyStrength", anisotropy.strength, 0.0);
                o.number("anisotropyRotation", anisotropy.rotation, 0.0);
                o.texture("anisotropyTexture", anisotropy.texture.as_ref(), self);
            });
        }
        if let Some(coat) = &m.clearcoat {
            add("KHR_materials_clearcoat", &mut |o| {
                o.number("clearcoatFactor", coat.factor, 0.0);
                o.texture("clearcoatTexture", coat.texture.as_ref(), self);
                o.number("clearcoatRoughnessFactor", coat.roughness, 0.0);
                o.texture("clearcoatRoughnessTexture", coat.roughness_texture.as_ref(), self);
            });
        }
        if let Some(diffuse) = &m.diffuse_transmission {
            add("KHR_materials_diffuse_transmission", &mut |o| {
                o.number("diffuseTransmissionFactor", diffuse.factor, 0.0);
                o.texture("diffuseTransmissionTexture", diffuse.texture.as_ref(), self);
                o.color("diffuseTransmissionColorFactor", diffuse.color, Rgb::WHITE);
                o.texture("diffuseTransmissionColorTexture", diffuse.color_texture.as_ref(), self);
            });
        }
        if m.emissive_strength != 1.0 {
            add("KHR_materials_emissive_strength", &mut |o| {
                o.number("emissiveStrength", m.emissive_strength, 1.0);
            });
        }
        if let Some(ior) = m.ior {
            add("KHR_materials_ior", &mut |o| o.number("ior", ior, 1.5));
        }
        if let Some(sheen) = &m.sheen {
            add("KHR_materials_sheen", &mut |o| {
                o.color("sheenColorFactor", sheen.color, Rgb::BLACK);
                o.texture("sheenColorTexture", sheen.color_texture.as_ref(), self);
                o.number("sheenRoughnessFactor", sheen.roughness, 0.0);
            });
        }
        if let Some(specular) = &m.specular {
            add("KHR_materials_specular", &mut |o| {
                o.number("specularFactor", specular.factor, 1.0);
                o.texture("specularTexture", specular.texture.as_ref(), self);
                o.color("specularColorFactor", specular.color, Rgb::WHITE);
                o.texture("specularColorTexture", specular.color_texture.as_ref(), self);
            });
        }
        if let Some(transmission) = &m.transmission {
            add("KHR_materials_transmission", &mut |o| {
                o.number("transmissionFactor", transmission.factor, 0.0);
                o.texture("transmissionTexture", transmission.texture.as_ref(), self);
            });
        }
        if m.unlit {
            add("KHR_materials_unlit", &mut |_| ());
        }
        if let Some(volume) = &m.volume {
            add("KHR_materials_volume", &mut |o| {
                o.number("thicknessFactor", volume.thickness, 0.0);
                o.color("attenuationColor", volume.attenuation_color, Rgb::WHITE);
                o.number("attenuationDistance", volume.attenuation_distance, f32::INFINITY);
            });
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_read_back_to_the_same_bits() {
        assert_eq!(numbers(&[0.8, 1.0, 1e-30, -0.1]).to_string(), "[0.8,1.0,1e-30,-0.1]");
        let mut bits = 1u32;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let value = f32::from_bits(bits);
            if value.is_finite() {
                let read: f64 = number(value).to_string().parse().unwrap();
                assert_eq!(read as f32, value);
            }
        }
    }
}
