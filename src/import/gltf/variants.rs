//! KHR_materials_variants: the materials of a chosen variant.

use gltf::json::mesh::Primitive;
use gltf::json::{Root, Value};
use serde::Deserialize;

use super::error::GltfError;

const EXTENSION: &str = "KHR_materials_variants";

/// The variant whose materials are shown, if any.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variant(Option<usize>);

impl Variant {
    /// The variant called `name`; without a name, the materials that stand in the primitives themselves.
    pub(super) fn choose(root: &Root, name: Option<&str>) -> Result<Self, GltfError> {
        let Some(name) = name else { return Ok(Self(None)) };
        let json = root.extensions.as_ref().and_then(|e| e.others.get(EXTENSION));
        let known: Variants = json.map(parse).transpose()?.unwrap_or_default();
        match known.variants.iter().position(|variant| variant.name == name) {
            Some(index) => Ok(Self(Some(index))),
            None => Err(GltfError::Unknown {
                kind: "material variant",
                name: name.to_owned(),
                known: known.variants.into_iter().map(|variant| variant.name).collect(),
            }),
        }
    }

    /// The index of the material of `primitive`: what the variant maps it to, else its own.
    pub(super) fn material(self, primitive: &Primitive) -> Result<Option<usize>, GltfError> {
        let own = primitive.material.map(|m| m.value());
        let Some(chosen) = self.0 else { return Ok(own) };
        let json = primitive.extensions.as_ref().and_then(|e| e.others.get(EXTENSION));
        let mapped: Mappings = json.map(parse).transpose()?.unwrap_or_default();
        let mapping = mapped.mappings.iter().find(|mapping| mapping.variants.contains(&chosen));
        Ok(mapping.map_or(own, |mapping| Some(mapping.material)))
    }
}

fn parse<T: for<'de> Deserialize<'de>>(json: &Value) -> Result<T, GltfError> {
    Ok(gltf::json::deserialize::from_value(json.clone())?)
}

/// The file's list.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Variants {
    variants: Vec<Name>,
}

#[derive(Deserialize)]
struct Name {
    name: String,
}

/// A primitive's list.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Mappings {
    mappings: Vec<Mapping>,
}

#[derive(Deserialize)]
struct Mapping {
    material: usize,
    variants: Vec<usize>,
}
