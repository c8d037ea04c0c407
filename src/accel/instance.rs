//! A mesh's tree in several places: boxes and triangles stay in the mesh's own space, and hits are those of copies, bit for bit.
//!
//! # The same bits
//!
//! A ray is tested against triangles in the world alone: those of a block that it reaches are put in their place first, by the
//! operations of [`Affine3A::transform_point3`] in the same order. So all that could differ from a tree over copies is which blocks are
//! reached. A block is left out for two reasons only.
//!
//! *Its box begins behind the nearest hit.* A hit's ray parameter is never less than where the ray enters the slab around its triangle
//! across the direction's largest axis (see [`super::block`]). Putting a corner of the box in place by the same operations, the corner
//! that each factor's sign makes the least, gives no more than any vertex in the box gets, since rounding is monotonic: the bound
//! needs no margin.
//!
//! *The ray passes it by.* That is tested in the mesh's space, where boxes are narrow, with boxes made wider by what rounding may do.
//! Let M, t and N, s be the transform to the world and the one back, as they are stored, u = 2⁻²⁴, p a vertex of the mesh, whose coordinates are at
//! most b, v = M p + t + e the one in the world, w the largest of |M| b + |t|, and o the ray's origin. N v + s lies off p by
//! - (N M - 1) p + (N t + s), which is worked out, in f64, from the matrices that are stored;
//! - N e, and |e| ≤ 4u w, the rounding of three products and three sums;
//!
//! and a ray that hits the triangle passes N v + s, for some v on it, within
//! - 16u |N| (|o| + w): its distance from the triangle in the world, by the rounding of the triangle's test, whose distances, shears and edge
//!   functions are off by at most 14u of the distance from the vertices;
//! - 4u (|N| |o| + |s|) and 3u |N| (|o| + w): the rounding of its origin and of its direction, as far as the triangle is away;
//! - 2u (|N| |o| + |s|), for adding the margin to the origin.
//!
//! The slabs' own rounding is taken care of as everywhere. All that is less than a part that the ray has no say in, and 32u |N| |o|.
//! (Pharr, Jakob and Humphreys 2023, section 6.8, derive such bounds.)

use std::ops::{ControlFlow, RangeInclusive};

use glam::{Affine3A, DMat3, DVec3, Mat3, Vec3};

use super::lanes::{Floats, Lanes, Portable};
use super::node::ROBUST_FAR;
use super::traverse::{Query, Space};
use super::triangle::ShearedRay;
use super::{Bvh, Child, Node, Ray};

/// A mesh's place in a tree, fit for being traced.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// The index that the mesh's first triangle has here.
    pub(super) first: u32,
    pub(super) frame: Frame,
    /// The box around it in the world.
    pub(super) bounds: (Vec3, Vec3),
}

/// A placed mesh's tree, as part of another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub(super) root: Child,
    /// What to add to the indices of its triangles.
    pub(super) first: u32,
    pub(super) frame: Frame,
}

/// The ways between a mesh's space and the world. A row of each matrix makes one coordinate; its last number is added.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    world_from_object: Rows,
    object_from_world: Rows,
    /// How much wider boxes are, by axis: a part that always is, and one for each unit of the largest coordinate of the ray's origin.
    margin: [[f32; 2]; 3],
}

type Rows = [[f32; 4]; 3];

/// Scales and sizes in which nothing underflows or overflows that the margin counts on.
const SANE: RangeInclusive<f64> = 1e-15..=1e15;

/// The widest margin, in extents of the mesh. With a wider one the world's floats are so coarse there that the mesh has 500 of them at
/// most from end to end, and so does its ray that is taken back.
const WIDEST: f64 = 1.0 / 16.0;

/// 32u, and a little for computing with it.
const UNCERTAIN: f64 = 32.001 * (f32::EPSILON * 0.5) as f64;

impl Placement {
    /// Puts a mesh, whose vertices are between `low` and `high`, in its place; its triangles count from `first`.
    ///
    /// None where rounding would spoil the way back: where the transform is singular or nearly, too small or too large, or so far away that
    /// floats hardly tell the mesh's ends apart.
    pub fn new(first: u32, world_from_object: &Affine3A, (low, high): (Vec3, Vec3)) -> Option<Self> {
        let frame = Frame::new(world_from_object, low, high)?;
        Some(Self { first, frame, bounds: frame.bounds(low, high) })
    }
}

impl Frame {
    fn new(to_world: &Affine3A, low: Vec3, high: Vec3) -> Option<Self> {
        let m = Mat3::from(to_world.matrix3).as_dmat3();
        let t = Vec3::from(to_world.translation).as_dvec3();
        // As they are stored.
        let n = m.inverse().as_mat3().as_dmat3();
        let s = (-(m.inverse() * t)).as_vec3().as_dvec3();
        let largest = low.abs().max(high.abs()).as_dvec3();
        let extent = f64::from((high - low).max_element());
        let reach = (absolute(m) * largest + t.abs()).max_element();
        let scale = absolute(n) * DVec3::ONE;
        let missed = absolute(n * m - DMat3::IDENTITY) * largest + (n * t + s).abs();
        let margin = missed + UNCERTAIN * (scale * reach + s.abs());
        let is_sane =
            [extent, reach, scale.max_element(), scale.min_element()].iter().all(|v| SANE.contains(v));
        // Also false for NaN.
        let is_fit = is_sane && n.is_finite() && s.is_finite() && margin.max_element() <= WIDEST * extent;
        is_fit.then(|| Self {
            world_from_object: rows(m, t),
            object_from_world: rows(n, s),
            margin: [0, 1, 2].map(|k| [margin[k], UNCERTAIN * scale[k]].map(|v| v as f32)),
        })
    }

    /// The box in the world around all that is placed from between `low` and `high`.
    fn bounds(&self, low: Vec3, high: Vec3) -> (Vec3, Vec3) {
        let corner = |axis: usize, is_upper: bool| {
            let [x, y, z, _] = self.world_from_object[axis];
            let of = |k: usize, factor: f32| if (factor < 0.0) != is_upper { high[k] } else { low[k] };
            self.placed(axis, [of(0, x), of(1, y), of(2, z)])
        };
        let face = |is_upper: bool| Vec3::from_array([0, 1, 2].map(|axis| corner(axis, is_upper)));
        (face(false), face(true))
    }

    /// A coordinate of a placed point.
    fn placed(&self, axis: usize, [px, py, pz]: [f32; 3]) -> f32 {
        let [x, y, z, t] = self.world_from_object[axis];
        x * px + y * py + z * pz + t
    }

    /// A coordinate of eight placed points.
    #[inline(always)]
    pub(super) fn placed_lanes<L: Lanes>(
        &self,
        lanes: L,
        axis: usize,
        [px, py, pz]: [&[f32; 8]; 3],
    ) -> L::Floats {
        let [x, y, z, t] = self.world_from_object[axis].map(|v| lanes.splat(v));
        x * lanes.load(px) + y * lanes.load(py) + z * lanes.load(pz) + t
    }
}

fn absolute(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

fn rows(m: DMat3, t: DVec3) -> Rows {
    [0, 1, 2].map(|k| [m.x_axis[k], m.y_axis[k], m.z_axis[k], t[k]].map(|v| v as f32))
}

/// A placed mesh's own space.
pub(super) struct Inside<'a, L: Lanes> {
    lanes: L,
    bvh: &'a Bvh,
    instance: &'a Instance,
    /// In the world.
    ray: &'a ShearedRay,
    beam: WideBeam<L>,
    /// Whether the upper bound of a box makes its corner that the ray, along its main axis, comes to first.
    upper: [bool; 3],
}

impl<'a, L: Lanes> Inside<'a, L> {
    #[inline(always)]
    pub(super) fn new(
        lanes: L,
        bvh: &'a Bvh,
        instance: &'a Instance,
        ray: &Ray,
        sheared: &'a ShearedRay,
    ) -> Self {
        let [x, y, z, _] = instance.frame.world_from_object[sheared.axes[2]];
        let runs_backward = sheared.inverse[2] < 0.0;
        let upper = [x, y, z].map(|factor| (factor < 0.0) != runs_backward);
        Self { lanes, bvh, instance, ray: sheared, beam: beam(lanes, &instance.frame, ray), upper }
    }
}

/// A ray taken to the mesh's space, for boxes as wide as the margin makes them.
struct WideBeam<L: Lanes> {
    /// Where it starts for near planes and for far ones.
    origins: [[L::Floats; 3]; 2],
    inverse: [L::Floats; 3],
    backward: [bool; 3],
}

impl<L: Lanes> WideBeam<L> {
    /// Where the ray enters a node's children and where it leaves them: as [`Node::enter`].
    #[inline(always)]
    fn cross(&self, lanes: L, node: &Node) -> [L::Floats; 2] {
        let [near_x, far_x] = self.slab(lanes, node, 0);
        let [near_y, far_y] = self.slab(lanes, node, 1);
        let [near_z, far_z] = self.slab(lanes, node, 2);
        let entry = near_x.max(near_y).max(near_z.max(lanes.splat(0.0)));
        [entry, far_x.min(far_y).min(far_z) * lanes.splat(ROBUST_FAR)]
    }

    #[inline(always)]
    fn slab(&self, lanes: L, node: &Node, axis: usize) -> [L::Floats; 2] {
        let [lower, upper] = &node.bounds[axis];
        let (near, far) = if self.backward[axis] { (upper, lower) } else { (lower, upper) };
        let ([near_origin, far_origin], inverse) = (self.origins, self.inverse[axis]);
        [(lanes.load(near) - near_origin[axis]) * inverse, (lanes.load(far) - far_origin[axis]) * inverse]
    }
}

/// The ray in the mesh's space, each box as much wider as rounding may be wrong.
#[inline(always)]
fn beam<L: Lanes>(lanes: L, frame: &Frame, ray: &Ray) -> WideBeam<L> {
    let [o, d] = [ray.origin.to_array(), ray.direction.to_array()];
    let far = ray.origin.abs().max_element();
    let along = |[x, y, z, _]: [f32; 4], [px, py, pz]: [f32; 3]| x * px + y * py + z * pz;
    let mut direction = frame.object_from_world.map(|row| along(row, d));
    let mut origin = frame.object_from_world.map(|row| along(row, o) + row[3]);
    let mut margin = frame.margin.map(|[always, by_distance]| always + by_distance * far);
    let length = direction.into_iter().map(f32::abs).fold(0.0, f32::max);
    let reach = origin.into_iter().zip(margin).map(|(o, m)| o.abs() + m).fold(0.0, f32::max);
    // What nearly underflows or overflows is no guide: every box is entered. NaN passes no maximum.
    let is_guide = (1e-15..1e15).contains(&length)
        && reach < 1e30
        && direction.into_iter().chain(origin).all(f32::is_finite);
    if !is_guide {
        (direction, origin, margin) = ([1.0; 3], [0.0; 3], [f32::MAX; 3]);
    }
    let inverse = direction.map(|v| 1.0 / v);
    let backward = inverse.map(|v| v < 0.0);
    let widened = |sign: f32| {
        std::array::from_fn(|k| {
            let margin = if backward[k] { -margin[k] } else { margin[k] };
            lanes.splat(origin[k] + sign * margin)
        })
    };
    WideBeam { origins: [widened(1.0), widened(-1.0)], inverse: inverse.map(|v| lanes.splat(v)), backward }
}

impl<L: Lanes> Space<L> for Inside<'_, L> {
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: f32) -> (L::Floats, u32) {
        let lanes = self.lanes;
        let [entry, exit] = self.beam.cross(lanes, node);
        let corner = std::array::from_fn(|k| {
            let [lower, upper] = &node.bounds[k];
            if self.upper[k] { upper } else { lower }
        });
        let main = self.instance.frame.placed_lanes(lanes, self.ray.axes[2], corner);
        let bound = (main - lanes.splat(self.ray.origin[2])) * lanes.splat(self.ray.inverse[2]);
        let bound = bound.max(lanes.splat(0.0));
        let passes = entry.at_most(exit.min(lanes.splat(f32::INFINITY)));
        (bound, passes & bound.at_most(lanes.splat(t_max)))
    }

    #[inline(always)]
    fn leaf<Q: Query>(&mut self, leaf: usize, query: &mut Q) -> ControlFlow<()> {
        let block = self.bvh.blocks[leaf].placed(self.lanes, self.instance);
        query.look_at(self.lanes, &block, self.ray)
    }
}

impl Bvh {
    /// Leaves beyond the last block are instances.
    #[inline(always)]
    pub(super) fn instance(&self, leaf: usize) -> Option<&Instance> {
        let index = leaf.checked_sub(self.blocks.len())?;
        self.instances.get(index)
    }

    /// [`Bvh::visit_box`] among the triangles of an instance.
    pub(super) fn visit_box_inside(
        &self,
        instance: &Instance,
        (low, high): (Vec3, Vec3),
        visitor: &mut impl FnMut(u32),
    ) {
        let mut pending = vec![instance.root];
        while let Some(child) = pending.pop() {
            let Some(leaf) = child.leaf() else {
                let node = &self.nodes[child.node()];
                let touches = |&slot: &usize| {
                    let (from, to) = node.corners(slot);
                    let is_taken = from.is_finite();
                    let (from, to) = instance.frame.bounds(from, to);
                    is_taken && from.cmple(high).all() && to.cmpge(low).all()
                };
                pending.extend((0..8).filter(touches).map(|slot| node.child[slot]));
                continue;
            };
            let block = self.blocks[leaf].placed(Portable, instance);
            block.visit_box(low, high, visitor);
        }
    }
}
