//! How a ray finds its way through a tree: in the world and then, where it comes to an instance, in the space of its mesh. For trees without
//! instances it is compiled apart, as code that knows nothing of them is faster.

use std::ops::ControlFlow;

use arrayvec::ArrayVec;

use super::block::Block;
use super::instance::Inside;
use super::lanes::{Floats, Lanes};
use super::node::{Beam, STACK, next_before};
use super::triangle::ShearedRay;
use super::{Bvh, Child, Hit, Node, Ray};

/// What a tree's boxes and leaves are to a ray, by the space that they are in.
pub(super) trait Space<L: Lanes> {
    /// A bound of where the ray hits what is in the children, never too large nor negative, and which of them it enters before
    /// `t_max`.
    fn enter(&self, node: &Node, t_max: f32) -> (L::Floats, u32);

    /// Tells `query` what the ray hits in a leaf.
    fn leaf<Q: Query>(&mut self, leaf: usize, query: &mut Q) -> ControlFlow<()>;
}

/// What one wants to know of the hits.
pub(super) trait Query {
    /// How far hits are of interest.
    fn t_max(&self) -> f32;

    /// Takes notice of a hit no farther; breaks when it wants no more.
    fn found(&mut self, hit: Hit) -> ControlFlow<()>;

    /// Searches what is under `root`.
    fn search<L: Lanes, S: Space<L>>(
        &mut self,
        nodes: &[Node],
        space: &mut S,
        root: Child,
    ) -> ControlFlow<()>;

    /// Finds the hits in a block.
    #[inline(always)]
    fn look_at<L: Lanes>(&mut self, lanes: L, block: &Block, ray: &ShearedRay) -> ControlFlow<()> {
        let t_max = self.t_max();
        block.each_hit(lanes, ray, t_max, |hit| self.found(hit))
    }
}

/// The world, in which the tree has its root, and maybe `INSTANCES`.
struct World<'a, L: Lanes, const INSTANCES: bool> {
    lanes: L,
    bvh: &'a Bvh,
    ray: &'a Ray,
    beam: Beam<L>,
    /// Many rays meet no leaf.
    sheared: Option<ShearedRay>,
}

impl<'a, L: Lanes, const INSTANCES: bool> World<'a, L, INSTANCES> {
    #[inline(always)]
    fn new(lanes: L, bvh: &'a Bvh, ray: &'a Ray) -> Option<Self> {
        let beam = Beam::new(lanes, ray)?;
        Some(Self { lanes, bvh, ray, beam, sheared: None })
    }
}

impl<L: Lanes, const INSTANCES: bool> Space<L> for World<'_, L, INSTANCES> {
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: f32) -> (L::Floats, u32) {
        node.enter(self.lanes, &self.beam, t_max)
    }

    #[inline(always)]
    fn leaf<Q: Query>(&mut self, leaf: usize, query: &mut Q) -> ControlFlow<()> {
        let sheared = self.sheared.get_or_insert_with(|| ShearedRay::new(self.ray));
        if INSTANCES && let Some(instance) = self.bvh.instance(leaf) {
            let mut inside = Inside::new(self.lanes, self.bvh, instance, self.ray, sheared);
            return query.search(&self.bvh.nodes, &mut inside, instance.root);
        }
        query.look_at(self.lanes, &self.bvh.blocks[leaf], sheared)
    }
}

/// The nearest of the hits that `counts`, among equally near ones the one of the lowest index.
#[inline(always)]
pub(super) fn closest<L: Lanes, const INSTANCES: bool>(
    lanes: L,
    bvh: &Bvh,
    ray: &Ray,
    counts: impl FnMut(&Hit) -> bool,
) -> Option<Hit> {
    let mut world = World::<L, INSTANCES>::new(lanes, bvh, ray)?;
    // No index is lower than 0: the ray's end itself is out of reach.
    let mut query = Nearest { t_max: ray.t_max, rival: 0, nearest: None, counts };
    let _ = query.search(&bvh.nodes, &mut world, bvh.root);
    query.nearest
}

/// Calls `visitor` with the hits in no particular order until it breaks; tells whether it did.
#[inline(always)]
pub(super) fn visit<L: Lanes, const INSTANCES: bool>(
    lanes: L,
    bvh: &Bvh,
    ray: &Ray,
    visitor: impl FnMut(Hit) -> ControlFlow<()>,
) -> bool {
    let Some(mut world) = World::<L, INSTANCES>::new(lanes, bvh, ray) else { return false };
    let mut query = Each { t_max: ray.t_max, visitor };
    query.search(&bvh.nodes, &mut world, bvh.root).is_break()
}

/// Asks for the nearest hit that counts.
struct Nearest<C> {
    t_max: f32,
    /// The triangle of the nearest hit so far.
    rival: u32,
    nearest: Option<Hit>,
    counts: C,
}

impl<C: FnMut(&Hit) -> bool> Query for Nearest<C> {
    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn found(&mut self, hit: Hit) -> ControlFlow<()> {
        let is_nearer = hit.t < self.t_max || (hit.t == self.t_max && hit.triangle < self.rival);
        if is_nearer && (self.counts)(&hit) {
            (self.t_max, self.rival) = (hit.t, hit.triangle);
            self.nearest = Some(hit);
        }
        ControlFlow::Continue(())
    }

    /// The nearest child first.
    #[inline(always)]
    fn search<L: Lanes, S: Space<L>>(
        &mut self,
        nodes: &[Node],
        space: &mut S,
        root: Child,
    ) -> ControlFlow<()> {
        let mut pending = ArrayVec::<u64, STACK>::new();
        let mut child = root;
        loop {
            if let Some(leaf) = child.leaf() {
                space.leaf(leaf, self)?;
            } else {
                let node = &nodes[child.node()];
                let (entry, entered) = space.enter(node, self.t_max);
                if entered != 0 {
                    child = node.nearest_first(entry.to_array(), entered, &mut pending);
                    continue;
                }
            }
            match next_before(self.t_max, &mut pending) {
                Some(next) => child = next,
                None => return ControlFlow::Continue(()),
            }
        }
    }
}

/// Asks for every hit.
struct Each<V> {
    t_max: f32,
    visitor: V,
}

impl<V: FnMut(Hit) -> ControlFlow<()>> Query for Each<V> {
    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn found(&mut self, hit: Hit) -> ControlFlow<()> {
        if hit.t < self.t_max { (self.visitor)(hit) } else { ControlFlow::Continue(()) }
    }

    /// Children are visited in the order that the tree keeps them: those first that most likely hide something for the least work.
    #[inline(always)]
    fn search<L: Lanes, S: Space<L>>(
        &mut self,
        nodes: &[Node],
        space: &mut S,
        root: Child,
    ) -> ControlFlow<()> {
        let mut pending = ArrayVec::<Child, STACK>::new();
        let mut child = root;
        loop {
            if let Some(leaf) = child.leaf() {
                space.leaf(leaf, self)?;
            } else {
                let node = &nodes[child.node()];
                let (_, entered) = space.enter(node, self.t_max);
                if entered != 0 {
                    child = node.first_kept(entered, &mut pending);
                    continue;
                }
            }
            match pending.pop() {
                Some(next) => child = next,
                None => return ControlFlow::Continue(()),
            }
        }
    }
}
