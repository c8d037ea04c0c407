//! Fields of the camera that renders. They are gathered first and applied together, so that their order does not matter.

use glam::{Affine3A, Mat3A, Vec2, Vec3};

use super::error::EditError;
use super::field::CameraField;
use super::value::{self, Mismatch};
use crate::math::Real;
use crate::record::Value;
use crate::scene::Camera;
use crate::scene::camera::{Aperture, FovAxis, Lens, Projection};

/// The vertical angle of view of a camera that an edit makes, in radians: 40°.
const DEFAULT_FOV: f32 = 40.0 * std::f32::consts::PI / 180.0;

/// What is asked of the camera.
///
/// - `position`, `target` and `up` replace those of the camera. Its own target is the point on its viewing axis beside the
///   scene's centre, its own up the axis among ±y and ±z nearest to its up direction.
/// - `orbit` places the camera around the target at `distance`, or as far as it is: azimuth 0° looks from +z in a y-up scene,
///   from -y in a z-up one, and grows counter-clockwise seen from above.
/// - `distance` alone moves it along its line of sight.
/// - `c2w` replaces the whole pose and may mirror; otherwise a camera that mirrors goes on mirroring.
/// - `roll` turns the camera counter-clockwise, seen from behind it, after all that.
#[derive(Clone, Debug, Default)]
pub(super) struct CameraEdits {
    position: Option<Vec3>,
    target: Option<Vec3>,
    up: Option<Vec3>,
    orbit: Option<[f32; 2]>,
    distance: Option<f32>,
    roll: Option<f32>,
    world_from_camera: Option<Affine3A>,
    fov: Option<f32>,
    fov_x: Option<f32>,
    lens_radius: Option<f32>,
    focal_distance: Option<f32>,
    pixel_offset: Option<Vec2>,
}

impl CameraEdits {
    /// Gathers one field; of two values for one field the later stays. The name is not the camera's own: it chooses one.
    pub(super) fn add(&mut self, field: CameraField, value: &Value) -> Result<(), Mismatch> {
        match field {
            CameraField::Name => {
                value::text(value)?;
            }
            CameraField::Position => self.position = Some(value::vector(value)?),
            CameraField::Target => self.target = Some(value::vector(value)?),
            CameraField::Up => self.up = Some(value::direction(value)?),
            CameraField::Orbit => {
                let Value::List(angles) = value else { return Err(Mismatch) };
                let [azimuth, elevation] = angles.as_slice() else { return Err(Mismatch) };
                self.orbit = Some([value::any_degrees(azimuth)?, value::degrees(elevation, -90.0, 90.0)?]);
            }
            CameraField::Distance => self.distance = Some(value::positive(value)?),
            CameraField::Roll => self.roll = Some(value::any_degrees(value)?),
            CameraField::CameraToWorld => self.world_from_camera = Some(matrix(value)?),
            CameraField::Fov => self.fov = Some(value::degrees(value, 0.1, 179.0)?),
            CameraField::FovX => self.fov_x = Some(value::degrees(value, 0.1, 179.0)?),
            CameraField::LensRadius => self.lens_radius = Some(value::not_negative(value)?),
            CameraField::FocalDistance => self.focal_distance = Some(value::positive(value)?),
            CameraField::PixelOffset => self.pixel_offset = Some(value::numbers::<2>(value)?.into()),
        }
        Ok(())
    }

    /// The camera with all edits; `centre` tells the scene's centre and is asked only if it matters.
    pub(super) fn apply(
        &self,
        camera: Option<&Camera>,
        centre: &dyn Fn() -> Option<Vec3>,
    ) -> Result<Camera, EditError> {
        self.check_conflicts()?;
        let mut camera = match (camera, self.position) {
            (Some(camera), _) => camera.clone(),
            (None, Some(position)) => {
                let target = self.target.or_else(centre).unwrap_or(Vec3::ZERO);
                Camera::look_at(position, target, Vec3::Y, DEFAULT_FOV)
            }
            (None, None) if self.world_from_camera.is_some() => {
                Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, DEFAULT_FOV)
            }
            (None, None) => return Err(EditError::NoCamera),
        };
        let mut view = None;
        if let Some(matrix) = self.world_from_camera {
            camera.world_from_camera = matrix;
        } else if self.moves() || self.needs_focus(&camera) {
            view = Some(self.place(&mut camera, centre())?);
        }
        if let Some(roll) = self.roll {
            let (sin, cos) = (Real::sin(roll), Real::cos(roll));
            let turn = Mat3A::from_cols_array(&[cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0]);
            camera.world_from_camera.matrix3 *= turn;
        }
        self.change_optics(&mut camera, view)?;
        Ok(camera)
    }

    /// Whether the camera's place or direction changes.
    fn moves(&self) -> bool {
        self.position.is_some()
            || self.target.is_some()
            || self.up.is_some()
            || self.orbit.is_some()
            || self.distance.is_some()
    }

    /// Whether a lens is asked for without saying what is sharp.
    fn needs_focus(&self, camera: &Camera) -> bool {
        self.lens_radius.is_some_and(|r| r > 0.0) && self.focal_distance.is_none() && camera.lens.is_none()
    }

    fn check_conflicts(&self) -> Result<(), EditError> {
        let given = [
            ("position", self.position.is_some()),
            ("orbit", self.orbit.is_some()),
            ("distance", self.distance.is_some()),
            ("target", self.target.is_some()),
            ("up", self.up.is_some()),
        ];
        let is_given = |name: &str| given.iter().any(|(n, is)| *n == name && *is);
        if self.world_from_camera.is_some()
            && let Some((second, _)) = given.iter().find(|(_, is)| *is)
        {
            return Err(EditError::Conflict { first: "c2w", second });
        }
        for second in ["orbit", "distance"] {
            if is_given("position") && is_given(second) {
                return Err(EditError::Conflict { first: "position", second });
            }
        }
        if self.fov.is_some() && self.fov_x.is_some() {
            return Err(EditError::Conflict { first: "fov", second: "fov_x" });
        }
        Ok(())
    }

    /// Moves and turns the camera, and returns how far its target is.
    fn place(&self, camera: &mut Camera, centre: Option<Vec3>) -> Result<f32, EditError> {
        let own = camera.world_from_camera;
        let own_position = Vec3::from(own.translation);
        let forward = -Vec3::from(own.matrix3.z_axis).normalize_or(Vec3::Z);
        let reach = centre.map_or(1.0, |c| {
            let along = (c - own_position).dot(forward);
            if along > 1e-3 { along } else { (c - own_position).length().max(1e-3) }
        });
        let target = self.target.unwrap_or(own_position + forward * reach);
        let up = self.up.unwrap_or_else(|| world_up(Vec3::from(own.matrix3.y_axis)));
        let position = match (self.position, self.orbit, self.distance) {
            (Some(position), _, _) => position,
            (None, Some(angles), distance) => {
                let radius = distance.unwrap_or_else(|| (own_position - target).length());
                target + orbit_direction(angles, up) * radius
            }
            (None, None, Some(distance)) => {
                target + (own_position - target).try_normalize().unwrap_or(-forward) * distance
            }
            (None, None, None) => own_position,
        };
        let distance = (position - target).length();
        if !distance.is_finite() || distance <= 1e-6 * position.length().max(1e-6) {
            return Err(EditError::NoViewDirection { x: position.x, y: position.y, z: position.z });
        }
        if self.moves() {
            let mirrors = own.matrix3.determinant() < 0.0;
            let mut pose = Camera::look_at(position, target, up, DEFAULT_FOV).world_from_camera;
            if mirrors {
                pose.matrix3.x_axis = -pose.matrix3.x_axis;
            }
            camera.world_from_camera = pose;
        }
        Ok(distance)
    }

    /// Angle of view, lens and pixel offset; `view` is the distance of the target where it is known.
    fn change_optics(&self, camera: &mut Camera, view: Option<f32>) -> Result<(), EditError> {
        let fov = self.fov.map(|f| (f, FovAxis::Y)).or(self.fov_x.map(|f| (f, FovAxis::X)));
        if let Some((new, new_axis)) = fov {
            match &mut camera.projection {
                Projection::Perspective { fov, axis } => (*fov, *axis) = (new, new_axis),
                Projection::Orthographic { .. } => {
                    return Err(EditError::NotApplicable {
                        path: if self.fov.is_some() { "camera.fov".into() } else { "camera.fov_x".into() },
                        why: "an orthographic camera has no angle of view",
                    });
                }
            }
        }
        camera.lens = match (self.lens_radius, camera.lens) {
            (Some(0.0), _) => None,
            (Some(radius), Some(lens)) => Some(Lens { radius, ..lens }),
            (Some(radius), None) => {
                let focal_distance =
                    self.focal_distance.or(view).ok_or_else(|| EditError::NotApplicable {
                        path: "camera.lens_radius".into(),
                        why: "with `camera.c2w` the sharp distance is not known: set `camera.focal_distance` too",
                    })?;
                Some(Lens { radius, focal_distance, shape: Aperture::Disk })
            }
            (None, lens) => lens,
        };
        if let Some(distance) = self.focal_distance {
            match &mut camera.lens {
                Some(lens) => lens.focal_distance = distance,
                None if self.lens_radius.is_some() => {}
                None => {
                    return Err(EditError::NotApplicable {
                        path: "camera.focal_distance".into(),
                        why: "the camera is a pinhole: set `camera.lens_radius` too",
                    });
                }
            }
        }
        if let Some(offset) = self.pixel_offset {
            camera.pixel_offset = offset;
        }
        Ok(())
    }
}

/// The axis among ±y and ±z that is nearest to a camera's up direction.
fn world_up(up: Vec3) -> Vec3 {
    if up.z.abs() > up.y.abs() { Vec3::Z * up.z.signum() } else { Vec3::Y * up.y.signum() }
}

/// The unit vector from the target to a camera at [azimuth, elevation] in radians.
fn orbit_direction([azimuth, elevation]: [f32; 2], up: Vec3) -> Vec3 {
    let front = Vec3::Z.reject_from_normalized(up).try_normalize();
    let front = front.unwrap_or_else(|| (-Vec3::Y).reject_from_normalized(up).normalize_or(Vec3::X));
    let side = up.cross(front);
    let level = front * Real::cos(azimuth) + side * Real::sin(azimuth);
    level * Real::cos(elevation) + up * Real::sin(elevation)
}

/// Three rows of four numbers, with a linear part that can be inverted.
fn matrix(value: &Value) -> Result<Affine3A, Mismatch> {
    let Value::List(rows) = value else { return Err(Mismatch) };
    let [x, y, z] = rows.as_slice() else { return Err(Mismatch) };
    let rows = [value::numbers::<4>(x)?, value::numbers::<4>(y)?, value::numbers::<4>(z)?];
    let column = |c: usize| Vec3::new(rows[0][c], rows[1][c], rows[2][c]);
    let (a, b, c) = (column(0), column(1), column(2));
    let volume = a.dot(b.cross(c)).abs();
    let box_volume = a.length() * b.length() * c.length();
    if volume.is_finite() && volume > 1e-6 * box_volume {
        Ok(Affine3A {
            matrix3: Mat3A::from_cols(a.into(), b.into(), c.into()),
            translation: column(3).into(),
        })
    } else {
        Err(Mismatch)
    }
}
