//! Materials in the terms of the file they come from, as plain data: conversion reads them, importers write them.

mod aris;
mod gltf;
mod mtl;

pub use aris::{ArisBrdf, ArisDisney, ArisMaterial};
pub use gltf::{
    AlphaMode, GltfAnisotropy, GltfClearcoat, GltfDiffuseTransmission, GltfMaterial, GltfSheen, GltfSpecular,
    GltfTransmission, GltfVolume,
};
pub use mtl::{MtlMap, MtlMaterial, MtlSlot};

/// A material as its file describes it.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a scene has few materials, and they are read once")]
pub enum SourceMaterial {
    /// glTF 2.0.
    Gltf(GltfMaterial),
    /// Wavefront MTL.
    Mtl(MtlMaterial),
    /// Aris YAML.
    Aris(ArisMaterial),
}
