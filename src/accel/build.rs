//! From triangles to the tree: obvhs builds a binary one, whose nodes are merged into wide ones.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;

use super::block::Block;
use super::collapse::Plan;
use super::instance::{Instance, Placement};
use super::node::MOST_LEVELS;
use super::places::Places;
use super::{Bvh, Child, Kernel, Node};

/// The most triangles: their indices and those of nodes leave a bit for what is what.
const MOST_TRIANGLES: usize = (1 << 31) - 1;

/// The levels of eight to one that this many triangles need, eight of them a block.
const BALANCED_LEVELS: usize = 10;

/// Why a tree could not be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The triangle indices would not fit.
    #[error("the scene has {count} triangles; at most {MOST_TRIANGLES} can be rendered")]
    TooManyTriangles {
        /// How many there are.
        count: usize,
    },
}

impl BuildError {
    /// Checks a number of triangles.
    ///
    /// # Errors
    /// Where there are too many.
    pub fn check(count: usize) -> Result<(), Self> {
        if count > MOST_TRIANGLES { Err(Self::TooManyTriangles { count }) } else { Ok(()) }
    }
}

/// A mesh that stands in several places.
#[derive(Clone, Debug)]
pub struct Shared {
    /// Its triangles, in its own space.
    pub triangles: Vec<[Vec3; 3]>,
    /// Where it is. No two triangles have the same index.
    pub placements: Vec<Placement>,
}

/// The binary tree's quality, with one place a leaf: which of them share a block is for the plan to say. A longer search, and
/// a second round of moving nodes to better places, would make the build half again as long and rays no faster.
fn parameters() -> BvhBuildParams {
    BvhBuildParams {
        max_prims_per_leaf: 1,
        reinsertion_batch_ratio: 0.05,
        post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
        ..BvhBuildParams::fast_build()
    }
}

impl Bvh {
    /// A tree over `triangles`, whose vertices must be finite.
    ///
    /// # Errors
    /// [`BuildError`] where there are too many triangles.
    pub fn build(triangles: &[[Vec3; 3]]) -> Result<Self, BuildError> {
        BuildError::check(triangles.len())?;
        let mut layout = Layout::default();
        let root = layout.tree(triangles, Leaves::Blocks);
        Ok(layout.finish(root, triangles.len(), Vec::new()))
    }

    /// A tree over `triangles`, of which hits know the index that `index_of` gives, larger for later ones, and over the meshes that are
    /// `shared`. All vertices must be finite.
    ///
    /// # Errors
    /// [`BuildError`] where there are too many triangles, each instance's counted.
    pub fn with_instances(
        triangles: &[[Vec3; 3]],
        index_of: impl Fn(u32) -> u32,
        shared: &[Shared],
    ) -> Result<Self, BuildError> {
        let placed = shared.iter().map(|mesh| mesh.triangles.len() * mesh.placements.len());
        let count = triangles.len() + placed.sum::<usize>();
        BuildError::check(count)?;
        let mut layout = Layout::default();
        let own = layout.tree(triangles, Leaves::Blocks);
        layout.blocks.iter_mut().for_each(|block| block.renumber(&index_of));
        let (mut instances, mut spans) = (Vec::new(), Vec::new());
        for mesh in shared {
            let root = layout.tree(&mesh.triangles, Leaves::Blocks);
            for &Placement { first, frame, bounds: (low, high) } in &mesh.placements {
                instances.push(Instance { root, first, frame });
                // As a triangle that spans the instance's box: its corners are all that the build looks at.
                spans.push([low, high, low]);
            }
        }
        let first_leaf = layout.blocks.len();
        BuildError::check(first_leaf + instances.len())?;
        let placed = layout.tree(&spans, Leaves::Instances { first_leaf });
        let root = layout.joined([(triangles, own), (&spans, placed)]);
        Ok(layout.finish(root, count, instances))
    }
}

fn boxes(triangles: &[[Vec3; 3]], places: &Places) -> Vec<Aabb> {
    let of_first = |&t: &u32| Aabb::from_points(&triangles[t as usize].map(Vec3A::from));
    places.firsts().iter().map(of_first).collect()
}

/// What the leaves of a tree are.
#[derive(Clone, Copy)]
enum Leaves {
    Blocks,
    /// The first has the index of a leaf that follows all blocks.
    Instances {
        first_leaf: usize,
    },
}

impl Leaves {
    /// How many triangles, or what stands for them, fit into one.
    fn room(self) -> usize {
        match self {
            Self::Blocks => Block::ROOM,
            Self::Instances { .. } => 1,
        }
    }

    /// The levels of a tree of eight to one over as many as there can be.
    fn balanced_levels(self) -> usize {
        match self {
            Self::Blocks => BALANCED_LEVELS,
            Self::Instances { .. } => BALANCED_LEVELS + 1,
        }
    }
}

/// Wide trees as they grow.
#[derive(Default)]
struct Layout {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Layout {
    /// Adds a tree over `triangles`.
    fn tree(&mut self, triangles: &[[Vec3; 3]], leaves: Leaves) -> Child {
        if triangles.is_empty() {
            return Growing { layout: self, triangles, leaves: Leaves::Blocks }.leaf(&[]);
        }
        let places = Places::new(triangles);
        let mut tree = build_bvh2(&boxes(triangles, &places), parameters(), &mut Duration::default());
        // Parents before their children, and near them in memory; who is whose parent needn't be known any more.
        tree.parents.clear();
        tree.reorder_in_stack_traversal_order();
        let plan = Plan::new(&tree, triangles, &places, leaves.room());
        Growing { layout: self, triangles, leaves }.subtree(&plan, 0, 0)
    }

    /// Adds the node above two trees, each given after what it is over; of an empty one there is no need.
    fn joined(&mut self, trees: [(&[[Vec3; 3]], Child); 2]) -> Child {
        match trees {
            [(_, only), ([], _)] | [([], _), (_, only)] => only,
            both => {
                let index = self.inner();
                for (slot, (triangles, child)) in both.into_iter().enumerate() {
                    self.nodes[index].set(slot, bounds(triangles.iter().flatten()), child);
                }
                Child::of_node(index)
            }
        }
    }

    fn inner(&mut self) -> usize {
        self.nodes.push(Node::empty());
        self.nodes.len() - 1
    }

    fn finish(self, root: Child, len: usize, instances: Vec<Instance>) -> Bvh {
        Bvh { root, nodes: self.nodes, blocks: self.blocks, instances, len, kernel: Kernel::detect() }
    }
}

/// The box around points.
fn bounds<'a>(points: impl Iterator<Item = &'a Vec3>) -> (Vec3, Vec3) {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    points.fold(none, |(low, high), &p| (low.min(p), high.max(p)))
}

/// A wide tree as it grows.
struct Growing<'a> {
    layout: &'a mut Layout,
    triangles: &'a [[Vec3; 3]],
    leaves: Leaves,
}

impl Growing<'_> {
    /// Adds what the plan makes of a binary node that has `level` wide ones above it.
    fn subtree(&mut self, plan: &Plan<'_>, n: u32, level: usize) -> Child {
        if let Some(triangles) = plan.leaf(n) {
            // Of one place there may be more than a block holds.
            return self.balanced(&triangles);
        }
        // Thousands of boxes one in another, or in nearly one place, make a tree thousands of levels deep.
        if level == MOST_LEVELS - self.leaves.balanced_levels() {
            return self.balanced(&plan.triangles(n));
        }
        let index = self.layout.inner();
        for (slot, n) in plan.wide_children(n).into_iter().enumerate() {
            let child = self.subtree(plan, n, level + 1);
            self.layout.nodes[index].set(slot, plan.bounds(n), child);
        }
        Child::of_node(index)
    }

    /// Adds a tree of as few levels as there can be, keeping the order of `triangles`.
    fn balanced(&mut self, triangles: &[u32]) -> Child {
        let room = self.leaves.room();
        if triangles.len() <= room {
            return self.leaf(triangles);
        }
        let index = self.layout.inner();
        let share = triangles.len().div_ceil(8).next_multiple_of(room);
        for (slot, part) in triangles.chunks(share).enumerate() {
            let bounds = bounds(part.iter().flat_map(|&t| &self.triangles[t as usize]));
            let child = self.balanced(part);
            self.layout.nodes[index].set(slot, bounds, child);
        }
        Child::of_node(index)
    }

    fn leaf(&mut self, triangles: &[u32]) -> Child {
        if let (Leaves::Instances { first_leaf }, &[instance]) = (self.leaves, triangles) {
            return Child::of_leaf(first_leaf + instance as usize);
        }
        let blocks = &mut self.layout.blocks;
        blocks.push(Block::new(triangles.iter().map(|&t| (t, self.triangles[t as usize]))));
        Child::of_leaf(blocks.len() - 1)
    }
}
