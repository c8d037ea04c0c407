//! Watertight ray-triangle intersection: Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection" (JCGT 2:1).

use glam::Vec3;

use super::Ray;

/// A triangle as traversal reads it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// As arrays: a vector's components can't be indexed without a branch.
    vertices: [[f32; 3]; 3],
}

/// How far rounding may put the ray parameter off, in units of what it is made of (Pharr, Jakob and Humphreys 2023, section
/// 6.8.7, gathered into one factor).
const UNCERTAIN: f32 = 32.0 * f32::EPSILON;

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

    /// The corners of the box around it.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let [a, b, c] = self.vertices.map(Vec3::from);
        (a.min(b).min(c), a.max(b).max(c))
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
            // The difference of products may have underflowed or cancelled: f64 is exact here. Deviation: only those that are
            // 0, or the neighbour across an edge that isn't, which sees nothing of this, might find the other sign for it.
            let edge = |value: f32, px: f32, qy: f32, py: f32, qx: f32| {
                if value != 0.0 {
                    return value;
                }
                (f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx)) as f32
            };
            u = edge(u, cx, by, cy, bx);
            v = edge(v, ax, cy, ay, cx);
            w = edge(w, bx, ay, by, ax);
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
        let mut t = t_scaled * inverse;
        // Near the origin, rounding could take one side of the plane for the other.
        let largest = |a: f32, b: f32, c: f32| a.abs().max(b.abs()).max(c.abs());
        let (x, y, z) = (largest(ax, bx, cx), largest(ay, by, cy), largest(az, bz, cz));
        if t.abs() < UNCERTAIN * (x * y + z * (x + y)) * (z * scale * inverse).abs() {
            t = self.exact_t(ray);
        }
        // Also false for NaN.
        if !(t > 0.0 && t < t_max) {
            return None;
        }
        Some((t, [u * inverse, v * inverse, w * inverse]))
    }

    /// The ray parameter in f64, where differences and products of f32 coordinates are exact: its sign tells the side of the
    /// plane that the origin is on.
    #[cold]
    fn exact_t(&self, ray: &ShearedRay) -> f32 {
        let [a, b, c] = self.vertices.map(|p| {
            let [x, y, z] = std::array::from_fn(|i| f64::from(p[ray.axes[i]]) - f64::from(ray.origin[i]));
            let [sx, sy, _] = ray.shear.map(f64::from);
            [x - sx * z, y - sy * z, z]
        });
        let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        ((u * a[2] + v * b[2] + w * c[2]) / (u + v + w) * f64::from(ray.shear[2])) as f32
    }
}
