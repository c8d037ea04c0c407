//! Sweep manifests: TOML that says which scene, what is set in it, and along which axes it varies.
//!
//! [`Manifest::read`] parses with positions and tells all errors at once, [`expand`] makes jobs of it (pure: the caller looks
//! up [`Manifest::scene_patterns`]), [`check`] holds it against a loaded scene, and [`edit`] applies a job's overrides.
//! [`json_schema`] describes the format.

mod check;
pub mod edit;
mod error;
mod expand;
mod model;
pub(crate) mod names;
pub(crate) mod nearest;
mod parse;
mod schema;
mod steps;
#[cfg(test)]
mod tests;

pub use check::check;
pub use error::{Color, Diagnostic, ManifestError, ManifestErrors, Source};
pub use expand::expand;
pub use model::{
    Axis, CompareSpec, DEFAULT_MAX_JOBS, Distribution, Interval, Located, MAX_MAX_JOBS, Manifest, Point,
    Random, Reach, ScenePattern, Sequence, Setting, SheetSpec, Steps,
};
pub use schema::json_schema;
