//! Looking into a material: what its lobes reflect where, how well they are sampled, and how it looks.
//!
//! - [`eval`]: rows of parameters and directions to BRDF values, as golden files have them

pub mod eval;
