//! The photographer's studio that the ball and the statue stand in: softboxes around, a sweep of paper behind.

use glam::DVec3;
use pipeline::math::Real;

use super::glb::Glb;
use super::mesh::{Mesh, Vertex, rectangle};

/// A rectangular area light that faces a point.
pub(crate) struct Softbox {
    /// Name of its mesh, node and material.
    pub(crate) name: &'static str,
    /// Its middle.
    pub(crate) position: DVec3,
    /// What its middle faces.
    pub(crate) target: DVec3,
    /// Width and height.
    pub(crate) size: [f64; 2],
    /// Colour of the emission, at most 1.
    pub(crate) color: [f64; 3],
    /// Radiance of a channel of 1.
    pub(crate) radiance: f64,
}

impl Softbox {
    /// Adds the light to a file.
    pub(crate) fn add(&self, glb: &mut Glb) {
        let forward = (self.target - self.position).normalize();
        let right = DVec3::Y.cross(forward).normalize() * self.size[0];
        let up = forward.cross(right).normalize() * self.size[1];
        let quad = rectangle(self.position - (right + up) / 2.0, right, up);
        let material = glb.emissive(self.name, self.color, self.radiance);
        glb.mesh(self.name, &quad, material);
    }
}

/// A sheet of paper: level from `front` to `back` (z), then a quarter circle of radius `radius` upwards, then a wall up to
/// `height`; from -`half_width` to `half_width` (x). u and v are x and the length along the sheet in units of `tile`, with
/// (½, ½) below the origin.
pub(crate) struct Sweep {
    pub(crate) half_width: f64,
    pub(crate) front: f64,
    pub(crate) back: f64,
    pub(crate) radius: f64,
    pub(crate) height: f64,
    pub(crate) tile: f64,
}

impl Sweep {
    /// The sheet as a mesh.
    pub(crate) fn mesh(&self) -> Mesh {
        const ARC: usize = 32;
        const COLUMNS: usize = 9;
        // (z, y, length along the sheet from z = 0 backwards, angle of the normal)
        let mut stations = vec![[self.front, 0.0, -self.front, 0.0], [0.0, 0.0, 0.0, 0.0]];
        for i in 0..=ARC {
            let angle = std::f64::consts::FRAC_PI_2 * i as f64 / ARC as f64;
            let (sin, cos) = (Real::sin(angle), Real::cos(angle));
            stations.push([
                self.back - self.radius * sin,
                self.radius * (1.0 - cos),
                -self.back + self.radius * angle,
                angle,
            ]);
        }
        let [z, y, length, angle] = stations[stations.len() - 1];
        stations.push([z, self.height, length + self.height - y, angle]);
        Mesh::grid(stations.len(), COLUMNS, |row, column| {
            let [z, y, length, angle] = stations[row];
            let x = self.half_width * (2.0 * column as f64 / (COLUMNS - 1) as f64 - 1.0);
            Vertex {
                position: DVec3::new(x, y, z),
                normal: DVec3::new(0.0, Real::cos(angle), Real::sin(angle)),
                uv: [0.5 + x / self.tile, 0.5 - length / self.tile],
            }
        })
    }
}
