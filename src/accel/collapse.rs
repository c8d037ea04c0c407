//! Which nodes of a binary tree become nodes of the wide one: the optimum by dynamic programming of Ylitie, Karras and Laine 2017,
//! "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.2.

use glam::Vec3;
use obvhs::bvh2::Bvh2;

use super::block::Block;

/// What a wide node and a block of triangles cost, whatever they hold: both are tested at once.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 1.0;

/// The cheapest ways to cut a binary tree into wide nodes.
pub(super) struct Plan<'a> {
    tree: &'a Bvh2,
    /// By node and number: the cost of at most 1, 2, … 7 children that hold the node's triangles, relative to a test of the root.
    costs: Vec<[f32; 7]>,
    /// By node, the number and the area of its triangles.
    contents: Vec<(u32, f32)>,
}

impl<'a> Plan<'a> {
    /// Plans for a `tree` with one triangle a leaf.
    pub(super) fn new(tree: &'a Bvh2, triangles: &[[Vec3; 3]]) -> Self {
        let mut plan = Self {
            tree,
            costs: vec![[0.0; 7]; tree.nodes.len()],
            contents: vec![(0, 0.0); tree.nodes.len()],
        };
        for n in parents_first(tree).into_iter().rev() {
            let probability = plan.probability(n);
            let (contents, costs) = match plan.children(n) {
                None => {
                    let [a, b, c] = triangles[plan.triangle(n) as usize];
                    ((1, (b - a).cross(c - a).length()), [BLOCK_COST * probability; 7])
                }
                Some([l, r]) => {
                    let (left, right) = (plan.contents[l as usize], plan.contents[r as usize]);
                    let count = left.0 + right.0;
                    let inner = NODE_COST * probability + plan.cheapest_cut(l, r, 8).1;
                    let leaf = BLOCK_COST * probability;
                    let mut costs = [if count as usize <= Block::ROOM { leaf.min(inner) } else { inner }; 7];
                    for i in 1..7 {
                        costs[i] = plan.cheapest_cut(l, r, i + 1).1.min(costs[i - 1]);
                    }
                    ((count, left.1 + right.1), costs)
                }
            };
            plan.contents[n as usize] = contents;
            plan.costs[n as usize] = costs;
        }
        plan
    }

    /// A node's triangles, if it is to be a leaf.
    pub(super) fn leaf(&self, n: u32) -> Option<Vec<u32>> {
        let fits = self.contents[n as usize].0 as usize <= Block::ROOM;
        let is_leaf = match self.children(n) {
            None => true,
            Some([l, r]) if fits => {
                let probability = self.probability(n);
                let inner = NODE_COST * probability + self.cheapest_cut(l, r, 8).1;
                BLOCK_COST * probability <= inner
            }
            Some(_) => false,
        };
        is_leaf.then(|| self.triangles(n))
    }

    /// The binary nodes that become an inner node's two to eight children: those first that are the most likely to stop a ray
    /// for what they cost.
    pub(super) fn wide_children(&self, n: u32) -> Vec<u32> {
        let mut chosen = Vec::with_capacity(8);
        self.cut(n, 8, &mut chosen);
        let promise = |n: u32| self.contents[n as usize].1 / self.costs[n as usize][0].max(f32::MIN_POSITIVE);
        chosen.sort_by(|&a, &b| promise(b).total_cmp(&promise(a)));
        chosen
    }

    /// The corners of the box around a node.
    pub(super) fn bounds(&self, n: u32) -> (Vec3, Vec3) {
        let aabb = &self.tree.nodes[n as usize].aabb;
        (aabb.min.into(), aabb.max.into())
    }

    /// The triangles under a node, in the tree's order.
    pub(super) fn triangles(&self, n: u32) -> Vec<u32> {
        let mut found = Vec::with_capacity(self.contents[n as usize].0 as usize);
        let mut pending = vec![n];
        while let Some(n) = pending.pop() {
            match self.children(n) {
                None => found.push(self.triangle(n)),
                Some([l, r]) => pending.extend([r, l]),
            }
        }
        found
    }

    /// Divides an inner node into at most `room` children.
    fn cut(&self, n: u32, room: usize, chosen: &mut Vec<u32>) {
        let Some([l, r]) = self.children(n) else { return chosen.push(n) };
        let (left, _) = self.cheapest_cut(l, r, room);
        for (child, mut room) in [(l, left), (r, room - left)] {
            let costs = &self.costs[child as usize];
            while room > 1 && costs[room - 2] <= costs[room - 1] {
                room -= 1;
            }
            if room == 1 { chosen.push(child) } else { self.cut(child, room, chosen) }
        }
    }

    /// How many of `room` children the left one should get, and what that costs.
    fn cheapest_cut(&self, left: u32, right: u32, room: usize) -> (usize, f32) {
        let (l, r) = (&self.costs[left as usize], &self.costs[right as usize]);
        let mut best = (1, l[0] + r[room - 2]);
        for k in 2..room {
            let cost = l[k - 1] + r[room - k - 1];
            if cost < best.1 {
                best = (k, cost);
            }
        }
        best
    }

    /// That a ray meets a node's box if it meets the root's. In f64, which no area of floats overflows.
    fn probability(&self, n: u32) -> f32 {
        let area = |n: u32| {
            let aabb = &self.tree.nodes[n as usize].aabb;
            let size = Vec3::from(aabb.max).as_dvec3() - Vec3::from(aabb.min).as_dvec3();
            size.x * size.y + size.y * size.z + size.z * size.x
        };
        (area(n) / area(0).max(f64::MIN_POSITIVE)) as f32
    }

    fn children(&self, n: u32) -> Option<[u32; 2]> {
        let node = &self.tree.nodes[n as usize];
        (node.prim_count == 0).then_some([node.first_index, node.first_index + 1])
    }

    fn triangle(&self, leaf: u32) -> u32 {
        self.tree.primitive_indices[self.tree.nodes[leaf as usize].first_index as usize]
    }
}

/// All nodes, each before its children.
fn parents_first(tree: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut pending = vec![0];
    while let Some(n) = pending.pop() {
        order.push(n);
        let node = &tree.nodes[n as usize];
        if node.prim_count == 0 {
            pending.extend([node.first_index, node.first_index + 1]);
        }
    }
    order
}
