//! Single rays as the renderer shoots them, for those who measure.

use glam::{Vec2, Vec3};

use super::offset::Departure;
use super::{Geometry, Prepared};
use crate::accel::Ray;
use crate::light::LightPlace;

impl Prepared {
    /// What rays are traced in.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The ray through a position on the film, in pixels from its upper left corner, and through the middle of the lens. Its
    /// direction has unit length.
    pub fn camera_ray(&self, film: Vec2) -> Ray {
        self.camera.ray(film, [0.5; 2])
    }

    /// The shadow ray from a surface to the light, and the place on it, that three numbers in [0, 1) choose. It ends just before the
    /// light; none where that can't shine.
    pub fn shadow_ray(&self, from: &Departure, [u_light, u0, u1]: [f32; 3]) -> Option<Ray> {
        let sample = self.lights.sample(from.point, u_light, [u0, u1])?;
        Some(match sample.place {
            LightPlace::Surface { triangle, barycentric } => {
                let corners = self.geometry.vertices(triangle);
                let target: Vec3 = corners.into_iter().zip(barycentric).map(|(corner, b)| corner * b).sum();
                from.reach(sample.wi, target)
            }
            LightPlace::Point { position, .. } => from.reach(sample.wi, position),
            LightPlace::Far { .. } => from.ray(sample.wi),
        })
    }
}
