//! Light from infinitely far away.

use super::ImageId;
use crate::color::Rgb;

/// The environment: radiance by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// What it looks like.
    pub map: EnvironmentMap,
    /// Multiplies the map.
    pub color: Rgb,
    /// Multiplies the map.
    pub intensity: f32,
    /// Turns the image about the up axis, counter-clockwise seen from above, in radians.
    pub rotation: f32,
}

/// What the environment looks like.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentMap {
    /// The same in all directions.
    Constant,
    /// An equirectangular image of linear radiance; negative values have been replaced by 0.
    Image {
        /// The pixels, floats.
        image: ImageId,
        /// How directions become coordinates.
        mapping: Equirectangular,
    },
}

/// How directions become coordinates of an equirectangular image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equirectangular {
    /// y is up: u = ½ + atan2(z, x)/2π, v = acos(y)/π from the top; pixel centres at half-integers.
    YUp,
    /// Aris: z is up, u from -atan2(y, x)/π, v from 2·acos(z)/π - 1, bilinear with aligned corners.
    Aris,
}

impl Environment {
    /// The same radiance in all directions.
    pub fn constant(color: Rgb) -> Self {
        Self { map: EnvironmentMap::Constant, color, intensity: 1.0, rotation: 0.0 }
    }
}
