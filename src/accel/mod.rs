//! Ray acceleration: the tree that obvhs builds, and watertight traversal of it. The only room that names obvhs.

mod build;
mod triangle;

use std::ops::ControlFlow;

use glam::Vec3;

pub use build::BuildError;
use triangle::{ShearedRay, Triangle};

/// A ray segment: origin + t·direction for t in (0, `t_max`). The direction need not have unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; t is measured in its length.
    pub direction: Vec3,
    /// Where it ends.
    pub t_max: f32,
    /// The triangle it starts on, which being flat it can't meet again: rounding must not say otherwise.
    pub source: Option<u32>,
}

impl Ray {
    /// A ray without end.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY, source: None }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The ray parameter.
    pub t: f32,
    /// The triangle's index in the list that the tree was built from.
    pub triangle: u32,
    /// Barycentric coordinates of the triangle's three vertices; they sum to 1.
    pub barycentric: [f32; 3],
}

/// A binary tree of boxes over triangles.
#[derive(Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// In leaf order.
    triangles: Vec<Triangle>,
    /// The input's index of each of `triangles`.
    ids: Vec<u32>,
}

/// Two children with their boxes: one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    min: [Vec3; 2],
    max: [Vec3; 2],
    /// The child's node, or the first triangle of a leaf.
    child: [u32; 2],
    /// The number of triangles of a leaf; 0 for an inner node.
    count: [u32; 2],
}

/// Pending nodes that traversal keeps without allocating. Only pathological trees, such as thousands of coincident triangles
/// make, are deeper.
const STACK: usize = 48;

/// What is left to visit: node or first triangle, triangle count, and where the ray enters.
struct Pending {
    top: usize,
    near: [(u32, u32, f32); STACK],
    spilled: Vec<(u32, u32, f32)>,
}

impl Pending {
    #[inline(always)]
    fn new() -> Self {
        Self { top: 0, near: [(0, 0, 0.0); STACK], spilled: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, entry: (u32, u32, f32)) {
        if self.top < STACK {
            self.near[self.top] = entry;
            self.top += 1;
        } else {
            self.spilled.push(entry);
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(u32, u32, f32)> {
        if self.top == STACK
            && let Some(entry) = self.spilled.pop()
        {
            return Some(entry);
        }
        self.top = self.top.checked_sub(1)?;
        Some(self.near[self.top])
    }
}

/// The far plane is moved out by this factor, so that rounding never makes a ray miss a box it grazes (Ize 2013, "Robust BVH
/// Ray Traversal"): 1 + 2γ(3).
const ROBUST_FAR: f32 = 1.000_000_4;

impl Bvh {
    /// The nearest hit.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_where(ray, |_| true)
    }

    /// The nearest of the hits that `counts`; it may be asked about hits that are not the nearest, in any order.
    #[inline]
    pub fn closest_where(&self, ray: &Ray, mut counts: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.each_hit(ray, |ray, hit| {
            if counts(&hit) {
                ray.t_max = hit.t;
                nearest = Some(hit);
            }
            ControlFlow::Continue(())
        });
        nearest
    }

    /// Whether anything is hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.visit(ray, |_| ControlFlow::Break(()))
    }

    /// Calls `visitor` with the hits in no particular order until it breaks; tells whether it did.
    pub fn visit(&self, ray: &Ray, mut visitor: impl FnMut(Hit) -> ControlFlow<()>) -> bool {
        self.each_hit(ray, |_, hit| visitor(hit))
    }

    /// Calls `found` with each hit nearer than the ray's end, which it may bring nearer; tells whether it broke off.
    #[inline(always)]
    fn each_hit(&self, ray: &Ray, mut found: impl FnMut(&mut Ray, Hit) -> ControlFlow<()>) -> bool {
        let mut ray = *ray;
        let sheared = ShearedRay::new(&ray);
        self.traverse(&mut ray, |ray, first, count| {
            for i in first..first + count {
                if let Some((t, barycentric)) = self.triangles[i].intersect(&sheared, ray.t_max)
                    && ray.source != Some(self.ids[i])
                {
                    found(ray, Hit { t, triangle: self.ids[i], barycentric })?;
                }
            }
            ControlFlow::Continue(())
        })
    }

    /// Calls `visitor` with the index of every triangle whose box touches the one between `low` and `high`.
    pub fn visit_box(&self, low: Vec3, high: Vec3, mut visitor: impl FnMut(u32)) {
        let touches = |min: Vec3, max: Vec3| min.cmple(high).all() && max.cmpge(low).all();
        let mut pending = Pending::new();
        pending.push((0, 0, 0.0));
        while let Some((node, count, _)) = pending.pop() {
            let (first, count) = (node as usize, count as usize);
            for i in first..first + count {
                let (min, max) = self.triangles[i].bounds();
                if touches(min, max) {
                    visitor(self.ids[i]);
                }
            }
            if count == 0
                && let Some(n) = self.nodes.get(first)
            {
                for k in (0..2).filter(|&k| touches(n.min[k], n.max[k])) {
                    pending.push((n.child[k], n.count[k], 0.0));
                }
            }
        }
    }

    /// The number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Visits the leaves that the ray's segment may touch, nearer child first. The leaf's visitor may shorten the ray.
    #[inline(always)]
    fn traverse(
        &self,
        ray: &mut Ray,
        mut leaf: impl FnMut(&mut Ray, usize, usize) -> ControlFlow<()>,
    ) -> bool {
        if self.nodes.is_empty() {
            return false;
        }
        let inverse = ray.direction.recip();
        let mut pending = Pending::new();
        let (mut node, mut count) = (0u32, 0u32);
        loop {
            if count > 0 {
                if leaf(ray, node as usize, count as usize).is_break() {
                    return true;
                }
            } else {
                let n = &self.nodes[node as usize];
                let near = [entry(n.min[0], n.max[0], ray, inverse), entry(n.min[1], n.max[1], ray, inverse)];
                let order = match near {
                    [None, None] => None,
                    [Some(_), None] => Some((0, None)),
                    [None, Some(_)] => Some((1, None)),
                    [Some(a), Some(b)] if a <= b => Some((0, Some((1, b)))),
                    [Some(a), Some(_)] => Some((1, Some((0, a)))),
                };
                if let Some((first, second)) = order {
                    if let Some((far, t)) = second {
                        pending.push((n.child[far], n.count[far], t));
                    }
                    (node, count) = (n.child[first], n.count[first]);
                    continue;
                }
            }
            loop {
                let Some((next, triangles, near)) = pending.pop() else { return false };
                if near < ray.t_max {
                    (node, count) = (next, triangles);
                    break;
                }
            }
        }
    }
}

/// Where the ray enters a box, if it does before its end.
///
/// A direction component of 0 makes 0·∞ = NaN where the origin lies in the plane of a face; comparisons with it are false, so that
/// the slab does not cut.
#[inline(always)]
fn entry(min: Vec3, max: Vec3, ray: &Ray, inverse: Vec3) -> Option<f32> {
    let mut near = 0.0f32;
    let mut far = ray.t_max;
    for axis in 0..3 {
        let t0 = (min[axis] - ray.origin[axis]) * inverse[axis];
        let t1 = (max[axis] - ray.origin[axis]) * inverse[axis];
        let (t0, t1) = if inverse[axis] < 0.0 { (t1, t0) } else { (t0, t1) };
        let t1 = t1 * ROBUST_FAR;
        // One instruction each; `f32::max` and `min` take three.
        near = if t0 > near { t0 } else { near };
        far = if t1 < far { t1 } else { far };
    }
    (near <= far).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::math::warp;

    fn random(i: u64, salt: u64) -> f32 {
        unit_f32(combine(i, salt) as u32)
    }

    fn soup(n: u64, size: f32) -> Vec<[Vec3; 3]> {
        (0..n)
            .map(|i| {
                let at = |k: u64| Vec3::new(random(i, k), random(i, k + 1), random(i, k + 2));
                let center = at(0) * 2.0 - 1.0;
                [center, center + (at(10) - 0.5) * size, center + (at(20) - 0.5) * size]
            })
            .collect()
    }

    fn direction(i: u64) -> Vec3 {
        warp::uniform_sphere([random(i, 77), random(i, 78)]).into()
    }

    /// A closed sphere of triangles.
    fn sphere(rings: u32, segments: u32) -> Vec<[Vec3; 3]> {
        use crate::math::Real;
        let at = |ring: u32, segment: u32| {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::TAU * (segment % segments) as f32 / segments as f32;
            if ring == 0 {
                Vec3::Y
            } else if ring == rings {
                -Vec3::Y
            } else {
                Vec3::new(
                    Real::sin(theta) * Real::cos(phi),
                    Real::cos(theta),
                    Real::sin(theta) * Real::sin(phi),
                )
            }
        };
        let mut triangles = Vec::new();
        for ring in 0..rings {
            for segment in 0..segments {
                let (a, b) = (at(ring, segment), at(ring, segment + 1));
                let (c, d) = (at(ring + 1, segment), at(ring + 1, segment + 1));
                if ring > 0 {
                    triangles.push([a, b, c]);
                }
                if ring + 1 < rings {
                    triangles.push([b, d, c]);
                }
            }
        }
        triangles
    }

    #[test]
    fn tree_and_brute_force_find_the_same_hits() {
        let triangles = soup(800, 0.3);
        let bvh = Bvh::build(&triangles).unwrap();
        let mut hits = 0;
        for i in 0..4000 {
            let origin = Vec3::new(random(i, 1), random(i, 2), random(i, 3)) * 4.0 - 2.0;
            let target = triangles[i as usize % 800][0] + direction(i) * 0.1;
            let ray = Ray::new(origin, target - origin);
            let sheared = ShearedRay::new(&ray);
            let brute = triangles
                .iter()
                .filter_map(|&t| Triangle::new(t).intersect(&sheared, f32::INFINITY).map(|h| h.0))
                .min_by(f32::total_cmp);
            assert_eq!(bvh.closest(&ray).map(|h| h.t), brute, "ray {i}");
            assert_eq!(bvh.occluded(&ray), brute.is_some());
            hits += u32::from(brute.is_some());
        }
        assert!(hits > 500, "the test must hit something: {hits}");
    }

    #[test]
    fn axis_parallel_rays_in_the_plane_of_a_face_still_hit() {
        let quad = [[Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y], [Vec3::ZERO, Vec3::X + Vec3::Y, Vec3::Y]];
        let bvh = Bvh::build(&quad).unwrap();
        for origin in [Vec3::new(0.5, 0.5, 1.0), Vec3::new(0.0, 0.5, 1.0), Vec3::new(0.5, 0.0, 1.0)] {
            assert!(bvh.closest(&Ray::new(origin, -Vec3::Z)).is_some(), "{origin}");
        }
    }

    #[test]
    fn no_ray_aimed_at_an_edge_or_a_vertex_leaves_a_closed_sphere() {
        let triangles = sphere(24, 48);
        let bvh = Bvh::build(&triangles).unwrap();
        for (i, t) in triangles.iter().enumerate() {
            let i = i as u64;
            for k in 0..12 {
                let along = random(i, 100 + k);
                let target = if k < 3 {
                    t[k as usize]
                } else {
                    t[(k % 3) as usize].lerp(t[((k + 1) % 3) as usize], along)
                };
                let origin = Vec3::new(random(i, k), random(i, k + 30), random(i, k + 60)) * 0.8 - 0.4;
                let ray = Ray::new(origin, target - origin);
                assert!(bvh.closest(&ray).is_some(), "triangle {i}, ray {k}");
            }
        }
    }

    #[test]
    fn barycentric_coordinates_give_the_point_back() {
        let triangles = soup(50, 1.0);
        let bvh = Bvh::build(&triangles).unwrap();
        for i in 0..500 {
            let ray = Ray::new(Vec3::splat(random(i, 5) - 0.5), direction(i));
            if let Some(hit) = bvh.closest(&ray) {
                let t = triangles[hit.triangle as usize];
                let b = hit.barycentric;
                let p = t[0] * b[0] + t[1] * b[1] + t[2] * b[2];
                assert!((p - (ray.origin + ray.direction * hit.t)).length() < 1e-5);
            }
        }
    }

    #[test]
    fn an_empty_tree_and_degenerate_triangles_are_never_hit() {
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        assert!(Bvh::build(&[]).unwrap().closest(&ray).is_none());
        let degenerate = [[Vec3::Z; 3], [Vec3::Z, Vec3::Z * 2.0, Vec3::Z * 3.0]];
        assert!(Bvh::build(&degenerate).unwrap().closest(&ray).is_none());
    }

    #[test]
    fn thousands_of_coincident_triangles_build_and_are_all_visited() {
        let triangles =
            vec![[Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(0.0, 1.0, 1.0)]; 5000];
        let bvh = Bvh::build(&triangles).unwrap();
        let mut seen = 0;
        bvh.visit(&Ray::new(Vec3::ZERO, Vec3::Z), |_| {
            seen += 1;
            ControlFlow::Continue(())
        });
        assert_eq!(seen, 5000);
    }
}
