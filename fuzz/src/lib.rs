//! Fuzzing of what reads files that others wrote: the three importers, manifests and images.

pub mod bodies;
#[path = "../../tests/common/glb.rs"]
mod glb;
pub mod guard;
pub mod mutate;
