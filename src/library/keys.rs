//! What fields are called in a library: Aris' names for what Aris has, and the like for the rest.

use crate::disney::Parameter;

pub(super) const COLOR: &str = "color";
pub(super) const EXT_IOR: &str = "ext_ior";
pub(super) const INT_IOR: &str = "int_ior";
pub(super) const EMISSION_SIDES: &str = "emissionSides";
pub(super) const UNLIT: &str = "unlit";
pub(super) const NORMAL_MAP: &str = "normalMap";
pub(super) const ANISOTROPY_MAP: &str = "anisotropyMap";
pub(super) const ANISOTROPY_STRENGTH: &str = "anisotropyStrength";
pub(super) const FRAME: &str = "frame";
pub(super) const CULLED: &str = "culled";
pub(super) const SIDES: &str = "sides";
pub(super) const VERTEX_COLOR: &str = "vertexColor";
pub(super) const VERTEX_ALPHA: &str = "vertexAlpha";

// Of a texture.
pub(super) const FILE: &str = "file";
pub(super) const CHANNEL: &str = "channel";
pub(super) const CURVE: &str = "curve";
pub(super) const FACTOR: &str = "factor";
pub(super) const ENCODING: &str = "encoding";
pub(super) const UV_SET: &str = "uvSet";
pub(super) const TRANSFORM: &str = "transform";
pub(super) const WRAP: &str = "wrap";
pub(super) const FILTER: &str = "filter";

/// The key of a scalar, in camelCase as Aris has it.
pub const fn of(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::SpecularTint => "specularTint",
        Parameter::SheenTint => "sheenTint",
        Parameter::ClearcoatGloss => "clearcoatGloss",
        Parameter::SpecTrans => "specTrans",
        Parameter::DiffTrans => "diffTrans",
        other => other.name(),
    }
}
