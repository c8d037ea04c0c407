//! Aris.

/// A material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ArisMaterial {}
