//! The camera, with film, filter and sampler.

use glam::{Affine3A, Mat3A, Vec2, Vec3A};

use super::Told;
use super::element::Element;
use crate::convert::Quality;
use crate::export::ExportError;
use crate::scene::camera::{Aperture, FovAxis, Lens, Projection};
use crate::scene::{Camera, Material, Scene};

/// The sensor for a picture of `width` × `height` pixels, and a word for each thing that it can't do as our camera does.
///
/// # Errors
/// If the camera is sheared, which Mitsuba's are not, or lies in a plane.
pub(super) fn sensor(
    scene: &Scene<Material>,
    camera: &Camera,
    [width, height]: [u32; 2],
) -> Result<(Element, Vec<Told>), ExportError> {
    let mut notes = Vec::new();
    let (axes, scale) = axes_and_scale(camera)?;
    let place = |right: f32, up: f32| Affine3A {
        // Mitsuba's cameras look along z, with x to the left.
        matrix3: Mat3A::from_cols(-axes.x_axis * right, axes.y_axis * up, -axes.z_axis),
        translation: camera.world_from_camera.translation,
    };
    let aspect = width as f32 / height as f32;
    let sensor = match camera.projection {
        Projection::Orthographic { half_height } => {
            let half_width = half_height * scale * aspect;
            Element::plugin("sensor", "orthographic").transform("to_world", place(half_width, half_width))
        }
        Projection::Perspective { fov, axis } => {
            let offset = camera.pixel_offset;
            let sensor = match camera.lens.filter(|lens| lens.radius > 0.0) {
                None => Element::plugin("sensor", "perspective")
                    .float("principal_point_offset_x", offset.x / width as f32)
                    .float("principal_point_offset_y", offset.y / height as f32),
                Some(lens) => {
                    if lens.shape == Aperture::Square {
                        notes.push(("lens", Quality::Approximated, "a disk of the square's area"));
                    }
                    if offset != Vec2::ZERO {
                        let reason =
                            "with a lens Mitsuba's pixels have no offset: the picture moves by half a pixel";
                        notes.push(("camera", Quality::Approximated, reason));
                    }
                    Element::plugin("sensor", "thinlens")
                        .float("aperture_radius", disk_radius(lens) * scale)
                        .float("focus_distance", lens.focal_distance * scale)
                }
            };
            sensor
                .float("fov", fov.to_degrees())
                .string("fov_axis", if axis == FovAxis::X { "x" } else { "y" })
                .transform("to_world", place(1.0, 1.0))
        }
    };
    let reach = reach(scene, camera);
    let film = Element::plugin("film", "hdrfilm")
        .integer_of("width", "resx")
        .integer_of("height", "resy")
        .string("pixel_format", "rgb")
        .string("component_format", "float32")
        .with(Element::plugin("rfilter", "box"));
    let sampler = Element::plugin("sampler", "independent").integer_of("sample_count", "spp");
    let sensor = sensor.float("near_clip", reach * 1e-6).float("far_clip", reach * 10.0);
    Ok((sensor.with(film).with(sampler), notes))
}

/// The camera's axes as unit vectors, which may be mirrored, and what they were scaled by.
fn axes_and_scale(camera: &Camera) -> Result<(Mat3A, f32), ExportError> {
    let matrix = camera.world_from_camera.matrix3;
    let lengths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length());
    let scale = (lengths[0] + lengths[1] + lengths[2]) / 3.0;
    if !(camera.world_from_camera.is_finite() && scale > 0.0) {
        return Err(ExportError::Camera { why: "its transform is not invertible" });
    }
    let z = matrix.z_axis.normalize_or_zero();
    let y = (matrix.y_axis - z * z.dot(matrix.y_axis)).normalize_or_zero();
    let x = y.cross(z) * matrix.determinant().signum();
    let axes = Mat3A::from_cols(x, y, z);
    let differs = |a: Vec3A, b: Vec3A| (a / scale - b).length() > 1e-3;
    if differs(matrix.x_axis, x) || differs(matrix.y_axis, y) || differs(matrix.z_axis, z) {
        return Err(ExportError::Camera {
            why: "Mitsuba has no cameras that are sheared or scaled unevenly",
        });
    }
    Ok((axes, scale))
}

/// The radius of the disk that has the lens' area.
fn disk_radius(lens: Lens) -> f32 {
    match lens.shape {
        Aperture::Disk => lens.radius,
        Aperture::Square => lens.radius * 2.0 / std::f32::consts::PI.sqrt(),
    }
}

/// How far there is anything to be seen, in metres: rays end where they are clipped.
fn reach(scene: &Scene<Material>, camera: &Camera) -> f32 {
    let (low, high) = scene.bounds().unwrap_or_default();
    let eye = glam::Vec3::from(camera.world_from_camera.translation);
    let farthest = (low - eye).abs().max((high - eye).abs()).length();
    if farthest.is_finite() && farthest > 0.0 { farthest } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn scaled_and_mirrored_cameras_have_unit_axes_and_sheared_ones_none() {
        let straight = Camera::look_at(Vec3::new(3.0, 1.0, 2.0), Vec3::ZERO, Vec3::Y, 0.5);
        let transformed = |by: Mat3A| {
            let mut camera = straight.clone();
            camera.world_from_camera.matrix3 *= by;
            axes_and_scale(&camera)
        };
        let diagonal = |x, y, z| Mat3A::from_diagonal(Vec3::new(x, y, z));
        let (axes, scale) = transformed(diagonal(-2.0, 2.0, 2.0)).unwrap();
        assert!((scale - 2.0).abs() < 1e-5);
        let expected = straight.world_from_camera.matrix3 * diagonal(-1.0, 1.0, 1.0);
        assert!(axes.abs_diff_eq(expected, 1e-5), "{axes} {expected}");
        let sheared = Mat3A::from_cols(Vec3A::X, Vec3A::new(0.3, 1.0, 0.0), Vec3A::Z);
        for wrong in [diagonal(1.0, 2.0, 1.0), sheared, Mat3A::ZERO, diagonal(f32::NAN, 1.0, 1.0)] {
            assert!(transformed(wrong).is_err(), "{wrong}");
        }
    }
}
