//! Film positions into rays.

use glam::{Affine3A, Mat3, Vec2, Vec3};

use super::RenderError;
use crate::accel::Ray;
use crate::math::{Real, warp};
use crate::scene::camera::{Aperture, Camera, FovAxis, Lens, Projection};

/// A camera for an image of a given size.
#[derive(Debug)]
pub(super) struct FilmCamera {
    world_from_camera: Affine3A,
    /// Unit viewing axis in the world: depth is measured along it.
    pub(super) axis: Vec3,
    camera_from_world: Mat3,
    /// The gradient in the world of the camera's z: a row of `camera_from_world`.
    depth_gradient: Vec3,
    /// One over the area of a pixel on the plane one unit away, in the world's measure.
    per_area: f32,
    /// Camera-space x and y per pixel, on the plane one unit away (perspective) or in the film (orthographic).
    per_pixel: f32,
    half_size: Vec2,
    pixel_offset: Vec2,
    is_perspective: bool,
    lens: Option<Lens>,
}

impl FilmCamera {
    /// `origin` is where in the world rays have the position 0.
    pub(super) fn new(
        name: &str,
        camera: &Camera,
        origin: Vec3,
        width: u32,
        height: u32,
    ) -> Result<Self, RenderError> {
        let wrong = |why| Err(RenderError::Camera { name: name.to_owned(), why });
        let matrix = camera.world_from_camera.matrix3;
        if !camera.world_from_camera.is_finite() || matrix.determinant() == 0.0 {
            return wrong("its transform is not invertible");
        }
        let half_size = Vec2::new(width as f32, height as f32) * 0.5;
        let (per_pixel, is_perspective) = match camera.projection {
            Projection::Perspective { fov, axis } => {
                if !(fov > 0.0 && fov < std::f32::consts::PI) {
                    return wrong("its angle of view must be between 0 and 180 degrees");
                }
                let half = if axis == FovAxis::X { half_size.x } else { half_size.y };
                (Real::sin(fov * 0.5) / (Real::cos(fov * 0.5) * half), true)
            }
            Projection::Orthographic { half_height } => {
                if !(half_height > 0.0 && half_height.is_finite()) {
                    return wrong("the height of its view must be above 0");
                }
                (half_height / half_size.y, false)
            }
        };
        if camera.lens.is_some_and(|l| !(l.focal_distance > 0.0 && l.radius >= 0.0)) {
            return wrong("its focal distance must be above 0 and its lens radius not below 0");
        }
        let mut world_from_camera = camera.world_from_camera;
        world_from_camera.translation -= glam::Vec3A::from(origin);
        Ok(Self {
            world_from_camera,
            axis: Vec3::from(-matrix.z_axis).normalize(),
            camera_from_world: matrix.inverse().into(),
            depth_gradient: matrix.inverse().row(2).into(),
            per_area: 1.0 / (matrix.determinant().abs() * per_pixel * per_pixel),
            per_pixel,
            half_size,
            pixel_offset: camera.pixel_offset,
            is_perspective,
            lens: camera.lens.filter(|l| l.radius > 0.0),
        })
    }

    /// The ray from the middle of the lens along the viewing axis.
    pub(super) fn axis_ray(&self) -> Ray {
        Ray::new(Vec3::from(self.world_from_camera.translation), self.axis)
    }

    /// How far `point` lies in front along the camera's own -z, in units of its matrix: the parameter t of the ray (x/f, y/f, -1).
    pub(super) fn depth_of(&self, point: Vec3) -> f32 {
        (Vec3::from(self.world_from_camera.translation) - point).dot(self.depth_gradient)
    }

    /// The ray of a film position in pixels from the top left corner; its direction has unit length.
    pub(super) fn ray(&self, film: Vec2, u_lens: [f32; 2]) -> Ray {
        let p = film + self.pixel_offset - self.half_size;
        let on_plane = Vec3::new(p.x * self.per_pixel, -p.y * self.per_pixel, 0.0);
        let (mut origin, mut direction) =
            if self.is_perspective { (Vec3::ZERO, on_plane - Vec3::Z) } else { (on_plane, -Vec3::Z) };
        if let Some(lens) = &self.lens {
            let focus = origin + direction * lens.focal_distance;
            origin += lens_point(lens, u_lens);
            direction = focus - origin;
        }
        Ray::new(
            self.world_from_camera.transform_point3(origin),
            self.world_from_camera.transform_vector3(direction).normalize(),
        )
    }

    /// Whether [`Self::see`] finds anything: parallel rays have each but one direction, which no point of a scene can be chosen for.
    pub(super) fn can_see_points(&self) -> bool {
        self.is_perspective
    }

    /// How `point` is seen through the place of the lens that `u_lens` chooses as [`Self::ray`] does; none behind the camera and where
    /// rays are parallel.
    pub(super) fn see(&self, point: Vec3, u_lens: impl FnOnce() -> [f32; 2]) -> Option<Sight> {
        if !self.is_perspective {
            return None;
        }
        let on_lens = self.lens.as_ref().map_or(Vec3::ZERO, |lens| lens_point(lens, u_lens()));
        let origin = self.world_from_camera.transform_point3(on_lens);
        let to_point = point - origin;
        let distance = to_point.length();
        let direction = to_point / distance;
        let depth = -direction.dot(self.depth_gradient);
        if !(depth > 0.0 && distance > 0.0) {
            return None;
        }
        let mut on_plane = self.camera_from_world * (direction / depth);
        if let Some(lens) = &self.lens {
            on_plane += on_lens / lens.focal_distance;
        }
        let p = Vec2::new(on_plane.x, -on_plane.y) / self.per_pixel;
        let film = p - self.pixel_offset + self.half_size;
        Some(Sight { origin, direction, distance, film })
    }

    /// Pixels per steradian in the unit `direction` away from the camera, wherever on the lens: M takes the plane z = -1 to the world,
    /// and the solid angle of a pixel there, v, is |det M|·pixel²/|Mv|³. 0 where rays are parallel.
    pub(super) fn pixels_per_steradian(&self, direction: Vec3) -> f32 {
        let depth = -direction.dot(self.depth_gradient);
        if self.is_perspective { self.per_area / (depth * depth * depth) } else { 0.0 }
    }
}

/// A point of the scene, as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// On the lens.
    pub(super) origin: Vec3,
    /// Unit direction from there to the point.
    pub(super) direction: Vec3,
    pub(super) distance: f32,
    /// In pixels from the top left corner, maybe outside of the picture.
    pub(super) film: Vec2,
}

fn lens_point(lens: &Lens, u: [f32; 2]) -> Vec3 {
    let [x, y] = match lens.shape {
        Aperture::Disk => warp::concentric_disk(u),
        Aperture::Square => u.map(|u| 2.0 * u - 1.0),
    };
    Vec3::new(x, y, 0.0) * lens.radius
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(fov: f32, axis: FovAxis) -> Camera {
        let mut c = Camera::look_at(Vec3::ZERO, -Vec3::Z, Vec3::Y, fov);
        c.projection = Projection::Perspective { fov, axis };
        c
    }

    #[test]
    fn edges_of_the_film_see_half_the_angle_of_view() {
        let fov = std::f32::consts::FRAC_PI_2;
        let film = FilmCamera::new("c", &camera(fov, FovAxis::Y), Vec3::ZERO, 200, 100).unwrap();
        let top = film.ray(Vec2::new(100.0, 0.0), [0.5; 2]).direction;
        assert!((top - Vec3::new(0.0, 1.0, -1.0).normalize()).length() < 1e-6);
        let film = FilmCamera::new("c", &camera(fov, FovAxis::X), Vec3::ZERO, 200, 100).unwrap();
        let right = film.ray(Vec2::new(200.0, 50.0), [0.5; 2]).direction;
        assert!((right - Vec3::new(1.0, 0.0, -1.0).normalize()).length() < 1e-6);
    }

    #[test]
    fn rays_through_a_lens_meet_in_the_focal_plane() {
        for shape in [Aperture::Disk, Aperture::Square] {
            let mut c = camera(0.6, FovAxis::Y);
            c.lens = Some(Lens { radius: 0.2, focal_distance: 3.0, shape });
            let film = FilmCamera::new("c", &c, Vec3::ZERO, 64, 48).unwrap();
            let at_focus = |u| {
                let ray = film.ray(Vec2::new(10.0, 7.0), u);
                ray.origin + ray.direction * (-3.0 - ray.origin.z) / ray.direction.z
            };
            assert!((at_focus([0.1, 0.9]) - at_focus([0.8, 0.3])).length() < 1e-5);
        }
    }

    /// Also through a camera whose matrix scales, shears and mirrors.
    fn skewed(lens: bool) -> FilmCamera {
        let mut c = camera(0.9, FovAxis::Y);
        let m = &mut c.world_from_camera.matrix3;
        (m.x_axis, m.y_axis) = (m.x_axis * -2.0, m.y_axis * 1.5 + m.x_axis * 0.4);
        c.world_from_camera.translation = glam::Vec3A::new(1.0, 2.0, 3.0);
        c.lens = lens.then_some(Lens { radius: 0.2, focal_distance: 3.0, shape: Aperture::Disk });
        FilmCamera::new("c", &c, Vec3::ZERO, 64, 48).unwrap()
    }

    #[test]
    fn a_point_on_a_ray_is_seen_where_the_ray_began() {
        for camera in [skewed(false), skewed(true)] {
            for (film, u) in [(Vec2::new(10.0, 7.5), [0.1, 0.9]), (Vec2::new(60.0, 40.0), [0.8, 0.3])] {
                let ray = camera.ray(film, u);
                let sight = camera.see(ray.origin + ray.direction * 5.0, || u).unwrap();
                assert!((sight.film - film).length() < 1e-3, "{} {film}", sight.film);
                assert!((sight.direction - ray.direction).length() < 1e-5);
                assert!((sight.distance - 5.0).abs() < 1e-4);
                assert!(camera.see(ray.origin - ray.direction, || u).is_none());
            }
        }
    }

    #[test]
    fn density_is_that_of_the_directions_of_neighbouring_film_positions() {
        for camera in [skewed(false), skewed(true)] {
            let direction = |x: f32, y: f32| camera.ray(Vec2::new(x, y), [0.3, 0.6]).direction.as_dvec3();
            let (x, y, step) = (50.0, 10.0, 0.25);
            let across = (direction(x + step, y) - direction(x - step, y)) / f64::from(2.0 * step);
            let down = (direction(x, y + step) - direction(x, y - step)) / f64::from(2.0 * step);
            let expected = 1.0 / across.cross(down).length();
            let density = f64::from(camera.pixels_per_steradian(direction(x, y).as_vec3()));
            assert!((density / expected - 1.0).abs() < 1e-3, "{density} {expected}");
        }
    }

    #[test]
    fn unusable_cameras_are_refused() {
        for fov in [0.0, -1.0, 3.2, f32::NAN] {
            assert!(FilmCamera::new("c", &camera(fov, FovAxis::Y), Vec3::ZERO, 4, 4).is_err());
        }
        let mut flat = camera(0.6, FovAxis::Y);
        flat.world_from_camera.matrix3.x_axis = glam::Vec3A::ZERO;
        assert!(FilmCamera::new("c", &flat, Vec3::ZERO, 4, 4).is_err());
    }
}
