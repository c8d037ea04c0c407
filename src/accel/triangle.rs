//! Watertight ray-triangle intersection: Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection" (JCGT 2:1).

use glam::Vec3;

use super::Ray;

/// A triangle as traversal reads it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// As arrays: a vector's components can't be indexed without a branch.
    vertices: [[f32; 3]; 3],
}

/// A ray in the space where it is the z axis: what all its triangle tests share.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShearedRay {
    /// Along `axes`.
    origin: [f32; 3],
    /// The axes, the last one the direction's largest.
    axes: [usize; 3],
    shear: [f32; 3],
}

impl ShearedRay {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let a = d.abs();
        let kz = if a.x > a.y && a.x > a.z {
            0
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (mut kx, mut ky) = ((kz + 1) % 3, (kz + 2) % 3);
        // Keeps the triangles' winding.
        if d[kz] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let axes = [kx, ky, kz];
        Self { origin: axes.map(|k| ray.origin[k]), axes, shear: [d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]] }
    }

    /// A point in the ray's space: sheared x and y, and unscaled z.
    #[inline(always)]
    fn shear(&self, p: &[f32; 3]) -> (f32, f32, f32) {
        let [kx, ky, kz] = self.axes;
        let z = p[kz] - self.origin[2];
        let (x, y) = (p[kx] - self.origin[0], p[ky] - self.origin[1]);
        (x - self.shear[0] * z, y - self.shear[1] * z, z)
    }
}

impl Triangle {
    pub(super) fn new(vertices: [Vec3; 3]) -> Self {
        Self { vertices: vertices.map(|v| v.to_array()) }
    }

    /// The ray parameter in (0, `t_max`) and the barycentric coordinates, if the ray hits either side.
    #[inline(always)]
    pub(super) fn intersect(&self, ray: &ShearedRay, t_max: f32) -> Option<(f32, [f32; 3])> {
        let (ax, ay, az) = ray.shear(&self.vertices[0]);
        let (bx, by, bz) = ray.shear(&self.vertices[1]);
        let (cx, cy, cz) = ray.shear(&self.vertices[2]);
        // Two neighbours compute a shared edge's function from the same products, so that they agree on its sign.
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            // The difference of products may have underflowed or cancelled: f64 is exact here.
            let edge = |px: f32, qy: f32, py: f32, qx: f32| {
                (f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx)) as f32
            };
            u = edge(cx, by, cy, bx);
            v = edge(ax, cy, ay, cx);
            w = edge(bx, ay, by, ax);
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let scale = ray.shear[2];
        let t_scaled = u * (scale * az) + v * (scale * bz) + w * (scale * cz);
        let inverse = 1.0 / det;
        let t = t_scaled * inverse;
        // Also false for NaN.
        if !(t > 0.0 && t < t_max) {
            return None;
        }
        Some((t, [u * inverse, v * inverse, w * inverse]))
    }
}
