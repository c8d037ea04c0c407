//! Rendering: a scene is prepared once, paths are traced pixel by pixel, and the film becomes the layers of a raster.
//!
//! [`Geometry`] holds what the jobs of a sweep share; [`Prepared`] adds what a job's own materials, lights and camera need.

mod adaptive;
mod camera;
mod direct;
mod film;
mod filter;
mod from_light;
mod geometry;
mod integrators;
mod light_image;
mod light_path;
mod mapped_normal;
mod material;
mod medium;
mod mis;
mod offset;
mod pace;
mod path;
mod pilot;
mod prepare;
mod probe;
mod range;
mod replay;
mod reuse;
mod sharing;
mod skipped;
mod splitting;
mod surface;
mod techniques;
mod tile;
mod variants;
mod viewers;

use crate::accel::BuildError;

pub use film::{Control, Rendered, render, render_together};
pub use geometry::Geometry;
pub use material::constant_bsdf;
pub use offset::Departure;
pub use prepare::{Prepared, image_size};
pub use replay::{Replay, ReplayVertex, replay};
pub use techniques::Techniques;
pub use variants::Variants;

/// Why a scene can't be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The tree could not be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// There is nothing to look through.
    #[error("the scene has no camera")]
    NoCamera,
    /// The settings name a camera that isn't there.
    #[error("there is no camera {name:?}; the scene has {}", known.join(", "))]
    UnknownCamera {
        /// The name.
        name: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// A setting is out of range.
    #[error("render.{setting} is {value}, but must be {expected}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// What it is.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
    /// The camera's transform or lens is unusable.
    #[error("camera {name:?}: {why}")]
    Camera {
        /// The camera.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A texture takes a parameter out of its range.
    #[error("material {material:?}: {parameter} reads {found} from {image:?}, but must be in [{min}, {max}]")]
    TextureRange {
        /// The material.
        material: String,
        /// The parameter.
        parameter: &'static str,
        /// What the image holds, times the factor.
        found: f32,
        /// The image.
        image: String,
        /// The smallest legal value.
        min: f32,
        /// The largest.
        max: f32,
    },
    /// A light emits more than a float holds.
    #[error("light {light:?}: its light, colour times intensity, is beyond what a float holds")]
    LightEmission {
        /// The light.
        light: String,
    },
    /// A material emits more than a float holds.
    #[error("material {material:?}: its emission, colour times strength, is beyond what a float holds")]
    Emission {
        /// The material.
        material: String,
    },
}
