//! How rays leave surfaces: without meeting them again, and without slipping past a neighbour.
//!
//! # The bound
//!
//! A hit's point is computed as a + (e₁b₁ + e₂b₂), with e₁ = b - a and e₂ = c - a (Pharr, Jakob and Humphreys 2023, section 6.8,
//! whose world transform has no part in it: world vertices are floats by definition). With u = 2⁻²⁴, differences, products and the
//! inner sum are three roundings of at most extent = max |edge| (b₁, b₂ ≥ 0 sum to 1), and the outer sum is one of |point|: each
//! coordinate is off by at most u·|point| + 3u·extent, however wrong the barycentric coordinates are, since that moves the point
//! within the plane. Along a unit normal, whose components sum to at most √3, that makes 1.74 u·|point| + 5.2 u·extent.
//!
//! To that the bound adds
//! - once more 1.74 u·|point|: the plane of a coincident face has corners that were rounded on their own;
//! - and once more: moving the point rounds its coordinates;
//! - 4.3 u·extent: a ray from the new origin computes with the corners' distances from it, a difference, a product and a
//!   difference again in each of two coordinates, and must tell on which side of an edge it passes.
//!
//! The sign of a ray parameter near 0 is exact ([`crate::accel`]), and the triangle itself is left out by its index. So a ray that
//! starts beyond the bound meets neither the surface it leaves nor what lies in the same plane, at every scale and without a
//! constant in metres.
//!
//! # Edges
//!
//! Near an edge, the bound along one face's normal does not keep the ray off the other face: where they meet at a right angle, it
//! moves along it. There the origin is pushed from every plane nearby, to the side that the ray came from, whose origin was itself
//! so placed. Then no path leaves a closed mesh whose triangles are higher than their own rounding; `benches/closed_mesh.rs` counts.
//! Of rays aimed at the edges of thinner ones some in 100,000 do. Light that goes through has no free ray to follow on the other side
//! and starts off its own triangle alone.

use glam::{DVec3, Vec3};

use super::geometry::Geometry;
use crate::accel::Ray;

/// The bound for a point of a triangle whose longest edge, by its largest coordinate, is `extent`.
#[inline]
pub(super) fn bound(point: Vec3, extent: f32) -> f32 {
    const UNIT: f32 = f32::EPSILON * 0.5;
    6.0 * UNIT * point.abs().max_element() + 12.0 * UNIT * extent
}

/// An edge closer than so many bounds is near: two faces may meet at 15° before the bound above one of them is behind the other
/// farther from their edge.
pub(super) const NEAR: f32 = 4.0;

/// A triangle lower than this fraction of the bound has no plane to speak of: the rounding of its corners turns it about its edge.
pub(super) const THINNEST: f32 = 0.5;

/// Rounds of pushing, and by how much each goes beyond what is missing: in an acute corner one face's push undoes another's in part.
const ROUNDS: usize = 32;
const RELAXATION: f64 = 1.5;

/// Rays to lights end this much before them, in fractions of the distance.
const BEFORE_LIGHT: f32 = 1.0 - 1.0 / 65536.0;

/// `point` moved off its surface, to the side of `direction`, by its error.
#[inline(always)]
pub(super) fn offset(point: Vec3, error: f32, normal: Vec3, direction: Vec3) -> Vec3 {
    point + normal * error.copysign(direction.dot(normal))
}

/// The ray from a free place to a light or a place off its surface, ending just before it.
#[inline]
pub(super) fn ray_to(origin: Vec3, target: Vec3) -> Ray {
    Ray { t_max: BEFORE_LIGHT, ..Ray::new(origin, target - origin) }
}

/// A hit point, and where rays start that leave it.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    triangle: u32,
    pub(super) point: Vec3,
    /// How far `point` must be moved off the surface for a ray to leave it.
    error: f32,
    /// The geometric normal of the front side.
    pub(super) normal: Vec3,
    /// Where the incoming ray started.
    came_from: Vec3,
    /// Where rays start that leave to the side of the incoming one.
    this_side: Vec3,
    is_front: bool,
}

impl Departure {
    #[inline(always)]
    pub(super) fn new(triangle: u32, point: Vec3, error: f32, normal: Vec3, incoming: &Ray) -> Self {
        let this_side = offset(point, error, normal, -incoming.direction);
        let is_front = incoming.direction.dot(normal) <= 0.0;
        Self { triangle, point, error, normal, came_from: incoming.origin, this_side, is_front }
    }

    /// The unit geometric normal of the front side, or towards the viewer where the triangle is too thin to have one.
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// The unit geometric normal on the side that the incoming ray came from.
    #[inline]
    pub fn viewed_normal(&self) -> Vec3 {
        if self.is_front { self.normal } else { -self.normal }
    }

    /// The ray in `direction`.
    #[inline]
    pub fn ray(&self, direction: Vec3) -> Ray {
        let cos = direction.dot(self.normal);
        // Along the plane there is no other side to go to.
        let crosses = if self.is_front { cos < 0.0 } else { cos > 0.0 };
        let origin =
            if crosses { offset(self.point, self.error, self.normal, direction) } else { self.this_side };
        self.ray_from(origin, direction)
    }

    /// The ray in the direction `wi` to a point of a light, ending just before it.
    #[inline]
    pub(super) fn reach(&self, wi: Vec3, target: Vec3) -> Ray {
        let Ray { origin, source, .. } = self.ray(wi);
        Ray { source, ..ray_to(origin, target) }
    }

    /// Moves the origin of this side's rays off all triangles nearby; `has_plane` tells whether that of the one that was hit can be
    /// trusted.
    ///
    /// For light that goes through there is no ray that knows the other side: it starts off its own triangle alone.
    #[cold]
    pub(super) fn keep_clear(&mut self, geometry: &Geometry, has_plane: bool) {
        let clearance = f64::from(self.error);
        let reach = Vec3::splat(2.0 * NEAR * self.error);
        let from = self.came_from.as_dvec3();
        let mut faces = Vec::new();
        geometry.bvh.visit_box(self.point - reach, self.point + reach, |t| {
            let Some(face) = Face::new(geometry.vertices(t).map(|v| v.as_dvec3()), from, clearance) else {
                return;
            };
            // What shows its other side lies behind a ridge.
            let is_front = face.shows_winding == (geometry.handedness(t) > 0.0);
            if t == self.triangle || !has_plane || is_front == self.is_front {
                faces.push(face);
            }
        });
        let mut origin = self.this_side.as_dvec3();
        for _ in 0..ROUNDS {
            let mut is_clear = true;
            for face in &faces {
                if let Some(push) = face.push_off(origin, clearance) {
                    origin += push;
                    is_clear = false;
                }
            }
            if is_clear {
                break;
            }
        }
        self.this_side = origin.as_vec3();
        // Among triangles as thin as their own rounding no plane is certain, but the incoming ray was free.
        let back = self.came_from - self.point;
        let mut fraction = 4.0 * self.error / back.length();
        while fraction < 1.0 && self.is_cut_off(geometry) {
            self.this_side = self.point + back * fraction;
            fraction *= 4.0;
        }
    }

    /// Whether something lies between the origin of rays and that of the incoming one, nearer to here.
    fn is_cut_off(&self, geometry: &Geometry) -> bool {
        let mut ray = self.ray_from(self.this_side, self.came_from - self.this_side);
        ray.t_max = 0.5;
        geometry.bvh.occluded(&ray)
    }

    fn ray_from(&self, origin: Vec3, direction: Vec3) -> Ray {
        Ray { source: Some(self.triangle), ..Ray::new(origin, direction) }
    }
}

/// A triangle with its unit normal on the side that is seen.
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    shows_winding: bool,
}

impl Face {
    /// None for triangles without a plane to speak of, or seen edge-on.
    fn new([a, b, c]: [DVec3; 3], from: DVec3, clearance: f64) -> Option<Self> {
        let area_vector = (b - a).cross(c - a);
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        let area = area_vector.length();
        let side = area_vector.dot(from - a);
        let normal = area_vector / area.copysign(side);
        let has_plane = area > f64::from(THINNEST) * clearance * longest && side != 0.0;
        has_plane.then_some(Self { corners: [a, b, c], normal, shows_winding: side > 0.0 })
    }

    /// The push that brings `origin` more than `clearance` off the plane; none if it is there already, or not over the triangle.
    fn push_off(&self, origin: DVec3, clearance: f64) -> Option<DVec3> {
        let [a, b, c] = self.corners;
        let missing = clearance - self.normal.dot(origin - a);
        let winding = if self.shows_winding { self.normal } else { -self.normal };
        let is_over = |p: DVec3, q: DVec3| {
            let inward = winding.cross(q - p);
            inward.dot(origin - p) > -0.99 * clearance * inward.length()
        };
        let near = missing > 0.0 && is_over(a, b) && is_over(b, c) && is_over(c, a);
        near.then(|| self.normal * (missing * RELAXATION))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Affine3A;

    use super::*;
    use crate::math::hash::{combine, mix64, unit_f32};
    use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene};

    fn random(i: u64, salt: u64) -> f32 {
        unit_f32(combine(i, salt) as u32)
    }

    fn vector(i: u64, salt: u64) -> Vec3 {
        Vec3::new(random(i, salt), random(i, salt + 1), random(i, salt + 2)) * 2.0 - 1.0
    }

    /// Triangles of sizes from 1e-6 to 1e6, as far from the origin as they are large, much nearer or much farther.
    fn geometry(count: u64) -> Geometry {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let power = |salt: u64, range: f32| libm::powf(10.0, (2.0 * random(i, salt) - 1.0) * range);
            let (size, distance) = (power(1, 6.0), power(2, 3.0));
            let at = vector(i, 10) * size * distance;
            // One in four is a needle.
            let thin = if i % 4 == 0 { 1e-4 } else { 1.0 };
            let along = vector(i, 30);
            mesh.positions.extend([at, at + along * size, at + (along * 0.7 + vector(i, 40) * thin) * size]);
            mesh.triangles.push([0, 1, 2].map(|k| 3 * i as u32 + k));
        }
        let mut scene = Scene::<()>::empty();
        scene.meshes.push(Arc::new(mesh));
        scene.instances.push(Instance {
            name: "soup".into(),
            mesh: MeshId(0),
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        });
        Geometry::build(&scene).unwrap()
    }

    /// Two million points: none is farther from its exact plane than half the bound, whose other half is for what it is measured
    /// against; and an origin is always on its side.
    #[test]
    fn points_lie_within_the_bound_and_origins_beyond_the_plane() {
        let count = 20_000;
        let geometry = geometry(count);
        let mut worst = 0.0f64;
        for i in 0..100 * count {
            let triangle = (i % count) as u32;
            let corners = geometry.vertices(triangle).map(|v| v.as_dvec3());
            let [a, b, c] = corners;
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let (u, v) = (random(mix64(i), 1), random(mix64(i), 2));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let at = geometry.point_on(triangle, [1.0 - u - v, u, v]);
            let (point, error) = at.position();
            let distance = normal.dot(point.as_dvec3() - a).abs();
            worst = worst.max(distance / f64::from(error));
            let n = at.geometric_normal().unwrap();
            let origin = offset(point, error, n, n);
            assert!(normal.dot(origin.as_dvec3() - a) > 0.25 * f64::from(error), "{corners:?} {u} {v}");
        }
        assert!(worst < 0.5, "{worst}");
        assert!(worst > 0.1, "the bound would be needlessly wide: {worst}");
    }
}
