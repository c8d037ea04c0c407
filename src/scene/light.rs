//! Lights without a surface.

use glam::Vec3;

use crate::color::Rgb;

/// A point, spot or directional light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// What kind it is and where.
    pub kind: LightKind,
    /// Radiant intensity (W/sr, or candela) of point and spot lights, irradiance (W/m², or lux) of directional ones.
    pub color: Rgb,
    /// Multiplies `color`.
    pub intensity: f32,
}

/// The kind of a light, in world space; directions are unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Shines equally in all directions.
    Point {
        /// Where it is.
        position: Vec3,
        /// Where its light ends, by the window that KHR_lights_punctual recommends; none is infinite.
        range: Option<f32>,
    },
    /// A cone with a soft edge: full inside `inner`, none outside `outer`.
    Spot {
        /// Where it is.
        position: Vec3,
        /// Where it points.
        direction: Vec3,
        /// Half angle of the full cone, in radians.
        inner: f32,
        /// Half angle of the whole cone, in radians.
        outer: f32,
        /// As for points.
        range: Option<f32>,
    },
    /// Parallel light.
    Directional {
        /// Where its light goes.
        direction: Vec3,
    },
}

impl Light {
    /// The light where positions are relative to `origin`.
    #[must_use]
    pub fn relative_to(mut self, origin: Vec3) -> Self {
        match &mut self.kind {
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position -= origin,
            LightKind::Directional { .. } => {}
        }
        self
    }
}
