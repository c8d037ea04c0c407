//! Mtl.

/// A material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterial {}
