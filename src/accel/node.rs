//! A step of a ray's way through a tree: which of a node's children it enters, and in which order they are visited.

use arrayvec::ArrayVec;

use super::lanes::{Floats, Lanes};
use super::{Child, Node, Ray};

/// The levels of inner nodes that a tree may have; the build sees to it.
pub(super) const MOST_LEVELS: usize = 26;

/// Each level on the way down leaves at most seven children behind; one more level joins two trees.
pub(super) const STACK: usize = 7 * (MOST_LEVELS + 1) + 1;

/// The far plane is moved out by this factor, so that rounding never makes a ray miss a box it grazes (Ize 2013, "Robust BVH
/// Ray Traversal", JCGT 2:2): 1 + 2γ(3), and for who multiplies the direction's reciprocal by it the rounding of that.
pub(super) const ROBUST_FAR: f32 = 1.000_000_5;

/// A ray made ready for eight boxes at a time.
pub(super) struct Beam<L: Lanes> {
    origin: [L::Floats; 3],
    /// The direction's reciprocal for near planes and for far ones: one multiplication fewer to wait for in every node.
    inverse: [[L::Floats; 3]; 2],
    /// The sides that near planes are on: 1 where it runs towards smaller coordinates.
    near: [usize; 3],
}

impl<L: Lanes> Beam<L> {
    /// None for a ray that isn't finite, which hits nothing.
    #[inline(always)]
    pub(super) fn new(lanes: L, ray: &Ray) -> Option<Self> {
        if !(ray.origin.is_finite() && ray.direction.is_finite()) {
            return None;
        }
        let inverse = ray.direction.to_array().map(|d| 1.0 / d);
        Some(Self {
            origin: ray.origin.to_array().map(|v| lanes.splat(v)),
            inverse: [1.0, ROBUST_FAR].map(|factor| inverse.map(|v| lanes.splat(v * factor))),
            near: inverse.map(|v| usize::from(v.is_sign_negative())),
        })
    }
}

impl Node {
    /// Where the ray enters the children, and which of them it enters before `t_max`.
    ///
    /// A direction component of 0 makes 0·∞ = NaN where the origin lies in the plane of a face: minimum and maximum then take
    /// their second operand, and the slab does not cut.
    #[inline(always)]
    pub(super) fn enter<L: Lanes>(&self, lanes: L, ray: &Beam<L>, t_max: f32) -> (L::Floats, u32) {
        let [near_x, far_x] = self.slab(lanes, ray, 0);
        let [near_y, far_y] = self.slab(lanes, ray, 1);
        let [near_z, far_z] = self.slab(lanes, ray, 2);
        let entry = near_x.max(near_y).max(near_z.max(lanes.splat(0.0)));
        let exit = far_x.min(far_y).min(far_z);
        (entry, entry.at_most(exit.min(lanes.splat(t_max))))
    }

    /// Where the ray crosses the near and the far planes across an axis.
    #[inline(always)]
    fn slab<L: Lanes>(&self, lanes: L, ray: &Beam<L>, axis: usize) -> [L::Floats; 2] {
        let (sides, near, origin) = (&self.bounds[axis], ray.near[axis], ray.origin[axis]);
        // The remainder spares a bounds check.
        let cross =
            |side: usize, inverse: &[L::Floats; 3]| (lanes.load(&sides[side % 2]) - origin) * inverse[axis];
        [cross(near, &ray.inverse[0]), cross(near ^ 1, &ray.inverse[1])]
    }

    /// The nearest of the children that are `entered`, at least one; the others wait, the nearer on top.
    #[inline(always)]
    pub(super) fn nearest_first(
        &self,
        entry: [f32; 8],
        mut entered: u32,
        pending: &mut ArrayVec<u64, STACK>,
    ) -> Child {
        let mut next = || {
            let lane = entered.trailing_zeros() as usize % 8;
            entered &= entered - 1;
            (entered, lane)
        };
        // A child and where the ray enters it, which is never negative, so that keys sort by the entry.
        let key = |lane: usize| u64::from(entry[lane].to_bits()) << 32 | u64::from(self.child[lane].0);
        let (rest, lane) = next();
        // Mostly there is one, which need not wait for where it is entered.
        if rest == 0 {
            return self.child[lane];
        }
        let one = key(lane);
        let (mut rest, lane) = next();
        let other = key(lane);
        let mut first = one.min(other);
        let bottom = pending.len();
        pending.push(one.max(other));
        while rest != 0 {
            let (left, lane) = next();
            rest = left;
            let other = key(lane);
            let farther = first.max(other);
            first = first.min(other);
            pending.push(farther);
            let mut at = pending.len() - 1;
            while at > bottom && pending[at - 1] < farther {
                pending[at] = pending[at - 1];
                at -= 1;
            }
            pending[at] = farther;
        }
        Child(first as u32)
    }

    /// The first that the tree keeps of the children that are `entered`, at least one; the others wait, the earlier on top.
    #[inline(always)]
    pub(super) fn first_kept(&self, entered: u32, pending: &mut ArrayVec<Child, STACK>) -> Child {
        // Before the others, as the traversal waits for it.
        let first = self.child[entered.trailing_zeros() as usize % 8];
        let mut others = entered & (entered - 1);
        if others & others.wrapping_sub(1) == 0 {
            // One or none: not told apart by a branch, which could not be guessed.
            let bottom = pending.len();
            pending.push(self.child[others.trailing_zeros() as usize % 8]);
            pending.truncate(bottom + usize::from(others != 0));
            return first;
        }
        while others != 0 {
            let last = 31 - others.leading_zeros();
            others ^= 1 << last;
            pending.push(self.child[last as usize % 8]);
        }
        first
    }
}

/// What waits on top; what begins behind `t_max` is left out.
#[inline(always)]
pub(super) fn next_before(t_max: f32, pending: &mut ArrayVec<u64, STACK>) -> Option<Child> {
    loop {
        let key = pending.pop()?;
        if f32::from_bits((key >> 32) as u32) <= t_max {
            return Some(Child(key as u32));
        }
    }
}
