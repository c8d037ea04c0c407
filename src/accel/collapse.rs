//! Which nodes of a binary tree become nodes of the wide one: the optimum by dynamic programming of Ylitie, Karras and Laine 2017,
//! "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.2.

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

use super::places::Places;

/// What a wide node and a block of triangles cost, whatever they hold: both are tested at once.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 1.0;

/// The cheapest ways to cut a binary tree into wide nodes.
pub(super) struct Plan<'a> {
    tree: &'a Bvh2,
    /// What its leaves hold.
    places: &'a Places,
    /// How many triangles a leaf has room for.
    leaf_room: usize,
    /// The half area of the root's box.
    whole: f64,
    /// What is under each node.
    parts: Vec<Part>,
}

/// A binary node as part of wide ones.
#[derive(Clone, Copy, Default)]
struct Part {
    /// The cost of at most 1, 2, … 7 children that hold the node's triangles, relative to a test of the root.
    costs: [f32; 7],
    /// How many triangles those are.
    count: u32,
    /// The area of their places.
    area: f32,
}

impl<'a> Plan<'a> {
    /// Plans for a `tree` with one of the `places` a leaf and parents before their children.
    pub(super) fn new(tree: &'a Bvh2, triangles: &[[Vec3; 3]], places: &'a Places, leaf_room: usize) -> Self {
        let area = |&t: &u32| {
            let [a, b, c] = triangles[t as usize];
            (b - a).cross(c - a).length()
        };
        // In the order of memory.
        let areas: Vec<f32> = places.firsts().iter().map(area).collect();
        let mut plan = Self {
            tree,
            places,
            leaf_room,
            whole: half_area(&tree.nodes[0].aabb).max(f64::MIN_POSITIVE),
            parts: vec![Part::default(); tree.nodes.len()],
        };
        for n in (0..tree.nodes.len() as u32).rev() {
            plan.parts[n as usize] = match plan.children(n) {
                None => {
                    let place = plan.place(n);
                    let count = places.count(place);
                    let blocks = count.div_ceil(leaf_room as u32) as f32;
                    let costs = [BLOCK_COST * blocks * plan.probability(n); 7];
                    Part { costs, count, area: areas[place as usize] }
                }
                Some(children) => plan.joined(n, children.map(|c| plan.parts[c as usize])),
            };
        }
        plan
    }

    fn joined(&self, n: u32, [left, right]: [Part; 2]) -> Part {
        let cut = |room: usize| {
            let costs = (1..room).map(|k| left.costs[k - 1] + right.costs[room - k - 1]);
            costs.fold(f32::INFINITY, f32::min)
        };
        let count = left.count + right.count;
        let probability = self.probability(n);
        let inner = NODE_COST * probability + cut(8);
        let fits = count as usize <= self.leaf_room;
        let mut costs = [if fits { inner.min(BLOCK_COST * probability) } else { inner }; 7];
        for i in 1..7 {
            costs[i] = cut(i + 1).min(costs[i - 1]);
        }
        Part { costs, count, area: left.area + right.area }
    }

    /// A node's triangles, if it is to be a leaf: those of one place, or as many as a block holds.
    pub(super) fn leaf(&self, n: u32) -> Option<Vec<u32>> {
        let part = &self.parts[n as usize];
        let is_block =
            part.count as usize <= self.leaf_room && BLOCK_COST * self.probability(n) <= part.costs[0];
        (is_block || self.children(n).is_none()).then(|| self.triangles(n))
    }

    /// The binary nodes that become an inner node's two to eight children: those first that are the most likely to stop a ray
    /// for what they cost.
    pub(super) fn wide_children(&self, n: u32) -> Vec<u32> {
        let mut chosen = Vec::with_capacity(8);
        self.cut(n, 8, &mut chosen);
        let promise = |n: u32| {
            let part = &self.parts[n as usize];
            part.area / part.costs[0].max(f32::MIN_POSITIVE)
        };
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
        let mut found = Vec::with_capacity(self.parts[n as usize].count as usize);
        let mut pending = vec![n];
        while let Some(n) = pending.pop() {
            match self.children(n) {
                None => found.extend(self.places.triangles(self.place(n))),
                Some([l, r]) => pending.extend([r, l]),
            }
        }
        found
    }

    /// Divides an inner node into at most `room` children.
    fn cut(&self, n: u32, room: usize, chosen: &mut Vec<u32>) {
        let Some([l, r]) = self.children(n) else { return chosen.push(n) };
        let left = self.cheapest_cut(l, r, room);
        for (child, mut room) in [(l, left), (r, room - left)] {
            let costs = &self.parts[child as usize].costs;
            while room > 1 && costs[room - 2] <= costs[room - 1] {
                room -= 1;
            }
            if room == 1 { chosen.push(child) } else { self.cut(child, room, chosen) }
        }
    }

    /// How many of `room` children the left one should get.
    fn cheapest_cut(&self, left: u32, right: u32, room: usize) -> usize {
        let [l, r] = [left, right].map(|n| &self.parts[n as usize].costs);
        let cost = |k: usize| l[k - 1] + r[room - k - 1];
        (1..room).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(1)
    }

    /// That a ray meets a node's box if it meets the root's.
    fn probability(&self, n: u32) -> f32 {
        (half_area(&self.tree.nodes[n as usize].aabb) / self.whole) as f32
    }

    fn children(&self, n: u32) -> Option<[u32; 2]> {
        let node = &self.tree.nodes[n as usize];
        (node.prim_count == 0).then_some([node.first_index, node.first_index + 1])
    }

    fn place(&self, leaf: u32) -> u32 {
        self.tree.primitive_indices[self.tree.nodes[leaf as usize].first_index as usize]
    }
}

/// In f64, which no area of floats overflows.
fn half_area(aabb: &Aabb) -> f64 {
    let size = Vec3::from(aabb.max).as_dvec3() - Vec3::from(aabb.min).as_dvec3();
    size.x * size.y + size.y * size.z + size.z * size.x
}
