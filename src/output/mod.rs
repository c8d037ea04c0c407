//! What a render leaves behind: provenance in the header, and tone curves for the eye.

mod provenance;
pub mod tone;

pub use provenance::{Provenance, stamp};
