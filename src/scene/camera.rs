//! Cameras: x right, y up, looking along -z in their own space.

use glam::{Affine3A, Vec2, Vec3};

/// A camera. Its transform may mirror.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Camera space to world.
    pub world_from_camera: Affine3A,
    /// How points become pixels.
    pub projection: Projection,
    /// A finite aperture; none is a pinhole.
    pub lens: Option<Lens>,
    /// Added to every film position, in pixels. Aris' pixel covers [i-½, i+½] around its integer coordinate: (-½, -½).
    pub pixel_offset: Vec2,
    /// The size that the scene asks for, in pixels.
    pub size: Option<(u32, u32)>,
    /// Width over height, where the scene asks for it without a size.
    pub aspect: Option<f32>,
}

/// How points become pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Lines of sight meet in a point.
    Perspective {
        /// The full angle of view along `axis`, in radians, in (0, π).
        fov: f32,
        /// The axis it is measured along.
        axis: FovAxis,
    },
    /// Lines of sight are parallel.
    Orthographic {
        /// Half the height of the view.
        half_height: f32,
    },
}

/// The axis of an angle of view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FovAxis {
    /// Across the width.
    X,
    /// Across the height.
    Y,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the disk, or half the side of the square.
    pub radius: f32,
    /// The distance along the viewing axis that is sharp.
    pub focal_distance: f32,
    /// The aperture's shape.
    pub shape: Aperture,
}

/// The shape of an aperture, sampled uniformly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aperture {
    /// A disk.
    Disk,
    /// A square, as in Aris.
    Square,
}

impl Camera {
    /// A pinhole camera at `position` that looks at `target` with the vertical angle of view `fov_y` in radians.
    /// Where the direction is parallel to `up`, another up is taken.
    pub fn look_at(position: Vec3, target: Vec3, up: Vec3, fov_y: f32) -> Self {
        let back = (position - target).try_normalize().unwrap_or(Vec3::Z);
        let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
        let up = back.cross(right);
        Self {
            world_from_camera: Affine3A {
                matrix3: glam::Mat3A::from_cols(right.into(), up.into(), back.into()),
                translation: position.into(),
            },
            projection: Projection::Perspective { fov: fov_y, axis: FovAxis::Y },
            lens: None,
            pixel_offset: Vec2::ZERO,
            size: None,
            aspect: None,
        }
    }
}
