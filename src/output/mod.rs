//! What a render leaves behind: names, provenance, layers of a result, tone curves.

pub mod tone;
