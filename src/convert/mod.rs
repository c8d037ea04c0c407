//! Source materials into Disney materials, with a note on every field: exact, carried, approximated or dropped.

mod aris;
mod mtl;

use crate::record::Warning;
use crate::scene::source::SourceMaterial;
use crate::scene::{Material, Scene};

/// A converted scene and what the conversion has to say.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The scene with Disney materials.
    pub scene: Scene<Material>,
    /// One a material and field that the source sets.
    pub notes: Vec<Note>,
    /// What was not as it should be.
    pub warnings: Vec<Warning>,
}

/// What became of one field of a source material.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// The material.
    pub material: String,
    /// The field, in the source's terms.
    pub field: String,
    /// How well it was kept.
    pub quality: Quality,
    /// Why, with a figure where one is known; empty where there is nothing to say.
    pub reason: String,
}

/// How well a conversion keeps a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// The same BSDF.
    Exact,
    /// The same parameter and value, while the two models differ by a known amount.
    Carried,
    /// Something near.
    Approximated,
    /// Not at all.
    Dropped,
}
