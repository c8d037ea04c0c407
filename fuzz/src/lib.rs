//! Fuzzing of what reads files that others wrote: the three importers, manifests and images.

pub mod bodies;
pub mod guard;
pub mod mutate;
