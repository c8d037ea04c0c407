//! A leaf: up to eight triangles, tested at once.
//!
//! # Ties
//!
//! A hit's ray parameter is never less than where the ray enters the box around its triangle, computed as for the boxes of the
//! tree; larger boxes are entered no later, since rounding is monotonic. So a box that is entered behind the nearest hit holds
//! nothing as near, and which of several equally near hits counts, the one of the lowest index, does not depend on the order
//! in which boxes are visited.

use std::ops::ControlFlow;

use glam::Vec3;

use super::Hit;
use super::instance::Instance;
use super::lanes::{Floats, Lanes};
use super::triangle::{NOBODY, ShearedRay, UNCERTAIN, intersect};

/// Triangles, one a lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))] // Whole cache lines.
pub(super) struct Block {
    /// By vertex and axis; NaN in free lanes, which no ray hits.
    vertices: [[[f32; 8]; 3]; 3],
    /// The triangles' indices in the input.
    ids: [u32; 8],
}

impl Block {
    /// How many triangles there is room for.
    pub(super) const ROOM: usize = 8;

    /// Holds the first eight of `triangles`, given with their indices.
    pub(super) fn new(triangles: impl IntoIterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut block = Self { vertices: [[[f32::NAN; 8]; 3]; 3], ids: [NOBODY; 8] };
        for (lane, (id, corners)) in triangles.into_iter().take(Self::ROOM).enumerate() {
            for (vertex, corner) in block.vertices.iter_mut().zip(corners) {
                for (axis, value) in vertex.iter_mut().zip(corner.to_array()) {
                    axis[lane] = value;
                }
            }
            block.ids[lane] = id;
        }
        block
    }

    /// The triangles with their indices.
    pub(super) fn triangles(&self) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let taken = self.ids.iter().take_while(|&&id| id != NOBODY);
        taken.enumerate().map(|(lane, &id)| (id, self.corners(lane)))
    }

    /// Calls `visitor` with the index of every triangle whose box touches the one between `low` and `high`.
    pub(super) fn visit_box(&self, low: Vec3, high: Vec3, visitor: &mut impl FnMut(u32)) {
        for (id, [a, b, c]) in self.triangles() {
            if a.min(b).min(c).cmple(high).all() && a.max(b).max(c).cmpge(low).all() {
                visitor(id);
            }
        }
    }

    /// Gives the triangles the indices that `index_of` makes of their own.
    pub(super) fn renumber(&mut self, index_of: impl Fn(u32) -> u32) {
        self.ids = self.ids.map(|id| if id == NOBODY { NOBODY } else { index_of(id) });
    }

    /// The triangles in their place in the world, under the indices that they have there.
    #[inline(always)]
    pub(super) fn placed<L: Lanes>(&self, lanes: L, instance: &Instance) -> Self {
        let mut placed = *self;
        for (to, [x, y, z]) in placed.vertices.iter_mut().zip(&self.vertices) {
            for (axis, to) in to.iter_mut().enumerate() {
                *to = instance.frame.placed_lanes(lanes, axis, [x, y, z]).to_array();
            }
        }
        placed.renumber(|id| id + instance.first);
        placed
    }

    fn corners(&self, lane: usize) -> [Vec3; 3] {
        self.vertices.map(|vertex| Vec3::from_array(vertex.map(|axis| axis[lane])))
    }

    /// Calls `found` with the hits no farther than `t_max`, in the order of lanes, until it breaks.
    #[inline(always)]
    pub(super) fn each_hit<L: Lanes>(
        &self,
        lanes: L,
        ray: &ShearedRay,
        t_max: f32,
        mut found: impl FnMut(Hit) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let [a, b, c] = &self.vertices;
        let (ax, ay, az) = sheared(lanes, ray, a);
        let (bx, by, bz) = sheared(lanes, ray, b);
        let (cx, cy, cz) = sheared(lanes, ray, c);
        // Without fusing, two neighbours agree on the sign of their edge.
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let zero = lanes.splat(0.0);
        let touched = zero.at_most(least) | most.at_most(zero);
        if touched == 0 {
            return ControlFlow::Continue(());
        }
        let inside = zero.less(least) | most.less(zero);

        let scale = lanes.splat(ray.inverse[2]);
        let inverse = lanes.splat(1.0) / (u + v + w);
        let (along_a, along_b, along_c) = (scale * az, scale * bz, scale * cz);
        let t = (u * along_a + v * along_b + w * along_c) * inverse;
        let (x, y, z) = (largest(ax, bx, cx), largest(ay, by, cy), largest(az, bz, cz));
        let uncertain =
            t.abs().less(lanes.splat(UNCERTAIN) * (x * y + z * (x + y)) * (z * scale * inverse).abs());
        let in_front = zero.less(t);
        let doubtful = touched & (uncertain | !inside);
        let t_max_lanes = lanes.splat(t_max);
        // Most are out already, before the boxes, which only make t larger.
        let may_hit = inside & in_front & t.at_most(t_max_lanes);
        if doubtful | may_hit == 0 {
            return ControlFlow::Continue(());
        }
        // Rounding is monotonic: the least of them is the entry across the last axis.
        let t = along_a.min(along_b).min(along_c).max(t);
        let t = self.entry(lanes, ray, 0).max(self.entry(lanes, ray, 1).max(t));
        let mut candidates = doubtful | (may_hit & t.at_most(t_max_lanes));
        let t = t.to_array();
        let barycentric = [u, v, w].map(|edge| (edge * inverse).to_array());
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize % 8;
            candidates &= candidates - 1;
            let triangle = self.ids[lane];
            if triangle == ray.source {
                continue;
            }
            let (t, barycentric) = if doubtful >> lane & 1 == 0 {
                (t[lane], barycentric.map(|b| b[lane]))
            } else {
                match intersect(self.corners(lane), ray) {
                    Some(hit) if hit.0 <= t_max => hit,
                    _ => continue,
                }
            };
            found(Hit { t, triangle, barycentric })?;
        }
        ControlFlow::Continue(())
    }

    /// Where the ray enters the slabs around the triangles across one of the two sheared axes; NaN where it runs in a face.
    #[inline(always)]
    fn entry<L: Lanes>(&self, lanes: L, ray: &ShearedRay, i: usize) -> L::Floats {
        let axis = ray.axes[i];
        let (a, b) = (lanes.load(&self.vertices[0][axis]), lanes.load(&self.vertices[1][axis]));
        let c = lanes.load(&self.vertices[2][axis]);
        // The least or, running backward, the greatest: without a branch, as scattered rays have no favourite.
        let sign = lanes.splat(1.0_f32.copysign(ray.inverse[i]));
        let near = sign * (sign * a).min(sign * b).min(sign * c);
        (near - lanes.splat(ray.origin[i])) * lanes.splat(ray.inverse[i])
    }
}

/// The largest absolute value of three.
#[inline(always)]
fn largest<F: Floats>(a: F, b: F, c: F) -> F {
    a.abs().max(b.abs()).max(c.abs())
}

/// Points in the ray's space: sheared x and y, and unscaled z.
#[inline(always)]
fn sheared<L: Lanes>(
    lanes: L,
    ray: &ShearedRay,
    points: &[[f32; 8]; 3],
) -> (L::Floats, L::Floats, L::Floats) {
    let ShearedRay { axes: [kx, ky, kz], origin: [ox, oy, oz], shear: [sx, sy], .. } = *ray;
    let z = lanes.load(&points[kz]) - lanes.splat(oz);
    let x = lanes.load(&points[kx]) - lanes.splat(ox) - lanes.splat(sx) * z;
    let y = lanes.load(&points[ky]) - lanes.splat(oy) - lanes.splat(sy) * z;
    (x, y, z)
}
