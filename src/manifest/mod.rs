//! Sweep manifests.
mod nearest;
pub mod edit;
