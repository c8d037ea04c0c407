//! Watertight ray-triangle intersection: Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection" (JCGT 2:1), for one
//! triangle. [`super::block`] does the same for eight, and hands those here whose signs f32 can't tell.

use glam::Vec3;

use super::Ray;

/// The index of no triangle.
pub(super) const NOBODY: u32 = u32::MAX;

/// How far rounding may put the ray parameter off, in units of what it is made of (Pharr, Jakob and Humphreys 2023, section
/// 6.8.7, gathered into one factor).
pub(super) const UNCERTAIN: f32 = 32.0 * f32::EPSILON;

/// A ray in the space where it is the z axis: what all its triangle tests share.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShearedRay {
    /// Along `axes`.
    pub(super) origin: [f32; 3],
    /// The axes, the last one the direction's largest.
    pub(super) axes: [usize; 3],
    pub(super) shear: [f32; 2],
    /// The direction's reciprocal along `axes`.
    pub(super) inverse: [f32; 3],
    /// The triangle that it starts on.
    pub(super) source: u32,
}

impl ShearedRay {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let a = d.map(f32::abs);
        let kz = if a[0] > a[1] && a[0] > a[2] {
            0
        } else if a[1] > a[2] {
            1
        } else {
            2
        };
        let (kx, ky) = ([1, 2, 0][kz], [2, 0, 1][kz]);
        // Keeps the triangles' winding.
        let axes = if d[kz] < 0.0 { [ky, kx, kz] } else { [kx, ky, kz] };
        let [dx, dy, dz] = axes.map(|k| d[k]);
        Self {
            origin: axes.map(|k| ray.origin.to_array()[k]),
            axes,
            shear: [dx / dz, dy / dz],
            inverse: [1.0 / dx, 1.0 / dy, 1.0 / dz],
            source: ray.source.unwrap_or(NOBODY),
        }
    }

    /// A point in the ray's space: sheared x and y, and unscaled z.
    fn shear(&self, p: Vec3) -> (f32, f32, f32) {
        let [x, y, z] = std::array::from_fn(|i| p[self.axes[i]] - self.origin[i]);
        (x - self.shear[0] * z, y - self.shear[1] * z, z)
    }
}

/// The ray parameter above 0 and the barycentric coordinates where the ray hits either side of a triangle. f64 steps in where f32
/// can't tell a sign.
#[cold]
#[inline(never)]
pub(super) fn intersect(vertices: [Vec3; 3], ray: &ShearedRay) -> Option<(f32, [f32; 3])> {
    let [(ax, ay, az), (bx, by, bz), (cx, cy, cz)] = vertices.map(|p| ray.shear(p));
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
    let scale = ray.inverse[2];
    let inverse = 1.0 / det;
    let mut t = (u * (scale * az) + v * (scale * bz) + w * (scale * cz)) * inverse;
    // Near the origin, rounding could take one side of the plane for the other.
    let largest = |a: f32, b: f32, c: f32| a.abs().max(b.abs()).max(c.abs());
    let (x, y, z) = (largest(ax, bx, cx), largest(ay, by, cy), largest(az, bz, cz));
    if t.abs() < UNCERTAIN * (x * y + z * (x + y)) * (z * scale * inverse).abs() {
        t = exact_t(vertices, ray);
    }
    // Also false for NaN.
    (t > 0.0).then(|| (not_before(entry(vertices, ray), t), [u * inverse, v * inverse, w * inverse]))
}

/// The ray parameter in f64, where differences and products of f32 coordinates are exact: its sign tells the side of the
/// plane that the origin is on.
fn exact_t(vertices: [Vec3; 3], ray: &ShearedRay) -> f32 {
    let [a, b, c] = vertices.map(|p| {
        let [x, y, z] = std::array::from_fn(|i| f64::from(p[ray.axes[i]]) - f64::from(ray.origin[i]));
        let [sx, sy] = ray.shear.map(f64::from);
        [x - sx * z, y - sy * z, z]
    });
    let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    ((u * a[2] + v * b[2] + w * c[2]) / (u + v + w) * f64::from(ray.inverse[2])) as f32
}

/// Where the ray enters the slabs of the box around a triangle. NaN where it runs in a face.
fn entry([a, b, c]: [Vec3; 3], ray: &ShearedRay) -> [f32; 3] {
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    std::array::from_fn(|i| {
        let near = if ray.inverse[i] < 0.0 { high } else { low };
        (near[ray.axes[i]] - ray.origin[i]) * ray.inverse[i]
    })
}

/// `t`, but not before the entry into the triangle's box: see [`super::block`].
fn not_before(entry: [f32; 3], t: f32) -> f32 {
    entry.into_iter().rev().fold(t, |t, near| if near > t { near } else { t })
}
