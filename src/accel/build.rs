//! From triangles to the tree: obvhs builds a binary one, whose nodes are merged into wide ones.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;

use super::block::Block;
use super::collapse::Plan;
use super::places::Places;
use super::traverse::MOST_LEVELS;
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
        if triangles.len() > MOST_TRIANGLES {
            return Err(BuildError::TooManyTriangles { count: triangles.len() });
        }
        let mut layout = Layout { triangles, nodes: Vec::new(), blocks: Vec::new() };
        let root = if triangles.is_empty() {
            layout.block(&[])
        } else {
            let places = Places::new(triangles);
            let mut tree = build_bvh2(&boxes(triangles, &places), parameters(), &mut Duration::default());
            // Parents before their children, and near them in memory; who is whose parent needn't be known any more.
            tree.parents.clear();
            tree.reorder_in_stack_traversal_order();
            layout.subtree(&Plan::new(&tree, triangles, &places), 0, 0)
        };
        let Layout { nodes, blocks, .. } = layout;
        Ok(Self { root, nodes, blocks, len: triangles.len(), kernel: Kernel::detect() })
    }
}

fn boxes(triangles: &[[Vec3; 3]], places: &Places) -> Vec<Aabb> {
    let of_first = |&t: &u32| Aabb::from_points(&triangles[t as usize].map(Vec3A::from));
    places.firsts().iter().map(of_first).collect()
}

/// The wide tree as it grows.
struct Layout<'a> {
    triangles: &'a [[Vec3; 3]],
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Layout<'_> {
    /// Adds what the plan makes of a binary node that has `level` wide ones above it.
    fn subtree(&mut self, plan: &Plan<'_>, n: u32, level: usize) -> Child {
        if let Some(triangles) = plan.leaf(n) {
            // Of one place there may be more than a block holds.
            return self.balanced(&triangles);
        }
        // Thousands of boxes one in another, or in nearly one place, make a tree thousands of levels deep.
        if level == MOST_LEVELS - BALANCED_LEVELS {
            return self.balanced(&plan.triangles(n));
        }
        let index = self.inner();
        for (slot, n) in plan.wide_children(n).into_iter().enumerate() {
            let child = self.subtree(plan, n, level + 1);
            self.nodes[index].set(slot, plan.bounds(n), child);
        }
        Child::of_node(index)
    }

    /// Adds a tree of as few levels as there can be, keeping the order of `triangles`.
    fn balanced(&mut self, triangles: &[u32]) -> Child {
        if triangles.len() <= Block::ROOM {
            return self.block(triangles);
        }
        let index = self.inner();
        let share = triangles.len().div_ceil(8).next_multiple_of(Block::ROOM);
        for (slot, part) in triangles.chunks(share).enumerate() {
            let corners = part.iter().flat_map(|&t| self.triangles[t as usize]);
            let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let bounds = corners.fold(none, |(low, high), p| (low.min(p), high.max(p)));
            let child = self.balanced(part);
            self.nodes[index].set(slot, bounds, child);
        }
        Child::of_node(index)
    }

    fn inner(&mut self) -> usize {
        self.nodes.push(Node::empty());
        self.nodes.len() - 1
    }

    fn block(&mut self, triangles: &[u32]) -> Child {
        self.blocks.push(Block::new(triangles.iter().map(|&t| (t, self.triangles[t as usize]))));
        Child::of_block(self.blocks.len() - 1)
    }
}
