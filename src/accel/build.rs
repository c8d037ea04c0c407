//! From triangles to the tree: obvhs builds it, we lay it out for traversal.

use std::time::Duration;

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::triangle::Triangle;
use super::{Bvh, Node};

/// Why a tree could not be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The triangle indices would not fit.
    #[error("the scene has {count} triangles; at most {} can be rendered", u32::MAX)]
    TooManyTriangles {
        /// How many there are.
        count: usize,
    },
}

/// The tree's quality and leaf size: obvhs' slow build costs some 70 ms for 60,000 triangles and pays after a few samples.
fn parameters() -> BvhBuildParams {
    BvhBuildParams { pre_split: false, max_prims_per_leaf: 4, ..BvhBuildParams::slow_build() }
}

impl Bvh {
    /// A tree over `triangles`, whose vertices must be finite.
    ///
    /// # Errors
    /// [`BuildError`] where there are too many triangles.
    pub fn build(triangles: &[[Vec3; 3]]) -> Result<Self, BuildError> {
        if u32::try_from(triangles.len()).is_err() {
            return Err(BuildError::TooManyTriangles { count: triangles.len() });
        }
        if triangles.is_empty() {
            return Ok(Self { nodes: Vec::new(), triangles: Vec::new(), ids: Vec::new() });
        }
        let boxes: Vec<Aabb> =
            triangles.iter().map(|t| Aabb::from_points(&t.map(glam::Vec3A::from))).collect();
        let tree = build_bvh2(&boxes, parameters(), &mut Duration::default());
        Ok(Self {
            nodes: layout(&tree),
            triangles: tree.primitive_indices.iter().map(|&i| Triangle::new(triangles[i as usize])).collect(),
            ids: tree.primitive_indices,
        })
    }
}

/// Inner nodes with their children's boxes, the root first.
fn layout(tree: &Bvh2) -> Vec<Node> {
    // obvhs keeps a node's box in the node itself; ours holds its two children's, so leaves need no node.
    let mut index = vec![u32::MAX; tree.nodes.len()];
    let mut inner = 0;
    for (i, node) in tree.nodes.iter().enumerate() {
        if node.prim_count == 0 {
            index[i] = inner;
            inner += 1;
        }
    }
    let child = |i: usize| {
        let node = &tree.nodes[i];
        let target = if node.prim_count == 0 { index[i] } else { node.first_index };
        (Vec3::from(node.aabb.min), Vec3::from(node.aabb.max), target, node.prim_count)
    };
    let pair = |a: (Vec3, Vec3, u32, u32), b: (Vec3, Vec3, u32, u32)| Node {
        min: [a.0, b.0],
        max: [a.1, b.1],
        child: [a.2, b.2],
        count: [a.3, b.3],
    };
    if inner == 0 {
        // A single leaf: the other child's box is empty, so that no ray enters it.
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0, 0);
        return vec![pair(child(0), nothing)];
    }
    tree.nodes
        .iter()
        .filter(|node| node.prim_count == 0)
        .map(|node| pair(child(node.first_index as usize), child(node.first_index as usize + 1)))
        .collect()
}
