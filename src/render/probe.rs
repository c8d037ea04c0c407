//! Single rays as the renderer shoots them, for those who measure.

use glam::{Vec2, Vec3};

use super::offset::Departure;
use super::tile::Tile;
use super::{Geometry, Prepared};
use crate::accel::Ray;
use crate::light::{LightPlace, Receiver};
use crate::scene::material::Sides;

impl Prepared {
    /// What rays are traced in.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Columns and rows of the picture's pixels, in the order in which one thread renders them.
    pub fn pixels(&self) -> Vec<(u32, u32)> {
        Tile::all(self).iter().flat_map(Tile::places).collect()
    }

    /// The ray through a position on the film, in pixels from its upper left corner, and through the middle of the lens. Its
    /// direction has unit length.
    pub fn camera_ray(&self, film: Vec2) -> Ray {
        self.camera.ray(film, [0.5; 2])
    }

    /// The shadow ray from a surface to the light, and the place on it, that four numbers in [0, 1) choose. It ends just before the
    /// light; none where that can't shine.
    pub fn shadow_ray(&self, from: &Departure, u: [f32; 4]) -> Option<Ray> {
        let normal = from.viewed_normal();
        let receiver = Receiver { point: from.point, normal, sides: Sides::Front, gloss: None };
        let sample = self.lights.sample(&receiver, u)?;
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
