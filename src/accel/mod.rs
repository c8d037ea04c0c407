//! Ray acceleration: a tree eight children wide, and watertight traversal of it. The only room that names obvhs.
//!
//! obvhs builds a binary tree, of which an optimal choice of nodes becomes the wide one (Ylitie, Karras and Laine 2017). A ray is
//! tested against eight boxes or eight triangles at a time, with AVX2 where the processor has it and in plain Rust elsewhere: the
//! same operations in the same order, so that hits are the same bits. Triangles are watertight by Woop, Benthin and Wald 2013, boxes
//! by Ize 2013.
//!
//! A mesh that stands in many places can be in the tree once: see `instance.rs`. Hits are those that copies would give, bit for bit.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod block;
mod build;
mod collapse;
mod instance;
mod lanes;
mod node;
mod places;
#[cfg(test)]
mod tests;
mod traverse;
mod triangle;

use std::ops::ControlFlow;

use glam::Vec3;

use block::Block;
pub use build::{BuildError, Shared};
use instance::Instance;
pub use instance::Placement;
use lanes::Portable;

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

/// A tree of boxes over triangles.
#[derive(Clone, Debug)]
pub struct Bvh {
    root: Child,
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Meshes in their places, whose trees are among the nodes and blocks.
    instances: Vec<Instance>,
    /// The number of triangles, each instance's counted.
    len: usize,
    kernel: Kernel,
}

/// Up to eight children with their boxes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
struct Node {
    /// The lower and the upper bounds by axis. A free place has none that a ray could be between.
    bounds: [[[f32; 8]; 2]; 3],
    child: [Child; 8],
}

impl Node {
    fn empty() -> Self {
        Self { bounds: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3], child: [Child::of_leaf(0); 8] }
    }

    fn set(&mut self, slot: usize, (low, high): (Vec3, Vec3), child: Child) {
        for (axis, [lower, upper]) in self.bounds.iter_mut().enumerate() {
            (lower[slot], upper[slot]) = (low[axis], high[axis]);
        }
        self.child[slot] = child;
    }

    /// The bounds of a child.
    fn corners(&self, slot: usize) -> (Vec3, Vec3) {
        let corner = |side: usize| Vec3::from_array(self.bounds.map(|axis| axis[side][slot]));
        (corner(0), corner(1))
    }

    fn touches(&self, slot: usize, low: Vec3, high: Vec3) -> bool {
        let axes = self.bounds.iter().enumerate();
        axes.into_iter().all(|(axis, [lower, upper])| lower[slot] <= high[axis] && upper[slot] >= low[axis])
    }
}

/// The index of a node, or of a leaf where the highest bit is set: that is a block of triangles or, beyond the last block, an
/// instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    fn of_node(index: usize) -> Self {
        Self(index as u32)
    }

    fn of_leaf(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }

    #[inline(always)]
    fn leaf(self) -> Option<usize> {
        (self.0 & Self::LEAF != 0).then_some((self.0 & !Self::LEAF) as usize)
    }

    /// The index, if it is no leaf's.
    #[inline(always)]
    fn node(self) -> usize {
        self.0 as usize
    }
}

/// What traversal computes with. All find the same bits.
#[derive(Clone, Copy, Debug)]
pub struct Kernel(Instructions);

#[derive(Clone, Copy, Debug)]
enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
    Portable,
}

impl Kernel {
    /// Plain Rust, for every processor.
    pub const PORTABLE: Self = Self(Instructions::Portable);

    /// AVX2, where the processor has it.
    pub fn avx2() -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        return avx2::Avx2::detect().map(|avx2| Self(Instructions::Avx2(avx2)));
        #[cfg(not(target_arch = "x86_64"))]
        None
    }

    /// The fastest that the processor has.
    pub fn detect() -> Self {
        Self::avx2().unwrap_or(Self::PORTABLE)
    }

    /// The name: `avx2` or `portable`.
    pub const fn name(self) -> &'static str {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(_) => "avx2",
            Instructions::Portable => "portable",
        }
    }
}

impl Bvh {
    /// The nearest hit; of several at the same distance, that of the lowest index.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_where(ray, |_| true)
    }

    /// The nearest of the hits that `counts`, as [`Self::closest`]; it may be asked about hits that are not the nearest, in any
    /// order.
    #[inline]
    pub fn closest_where(&self, ray: &Ray, counts: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        if self.instances.is_empty() {
            self.closest_in::<false>(ray, counts)
        } else {
            self.closest_in::<true>(ray, counts)
        }
    }

    #[inline]
    fn closest_in<const INSTANCES: bool>(&self, ray: &Ray, counts: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        match self.kernel.0 {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(avx2) => avx2.closest::<INSTANCES>(self, ray, counts),
            Instructions::Portable => traverse::closest::<_, INSTANCES>(Portable, self, ray, counts),
        }
    }

    /// Whether anything is hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.visit(ray, |_| ControlFlow::Break(()))
    }

    /// Calls `visitor` with the hits in no particular order until it breaks; tells whether it did.
    #[inline]
    pub fn visit(&self, ray: &Ray, visitor: impl FnMut(Hit) -> ControlFlow<()>) -> bool {
        if self.instances.is_empty() {
            self.visit_in::<false>(ray, visitor)
        } else {
            self.visit_in::<true>(ray, visitor)
        }
    }

    #[inline]
    fn visit_in<const INSTANCES: bool>(
        &self,
        ray: &Ray,
        visitor: impl FnMut(Hit) -> ControlFlow<()>,
    ) -> bool {
        match self.kernel.0 {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(avx2) => avx2.visit::<INSTANCES>(self, ray, visitor),
            Instructions::Portable => traverse::visit::<_, INSTANCES>(Portable, self, ray, visitor),
        }
    }

    /// Calls `visitor` with the index of every triangle whose box touches the one between `low` and `high`.
    pub fn visit_box(&self, low: Vec3, high: Vec3, mut visitor: impl FnMut(u32)) {
        let mut pending = vec![self.root];
        while let Some(child) = pending.pop() {
            let Some(leaf) = child.leaf() else {
                let node = &self.nodes[child.node()];
                pending.extend((0..8).filter(|&k| node.touches(k, low, high)).map(|k| node.child[k]));
                continue;
            };
            match self.instance(leaf) {
                Some(instance) => self.visit_box_inside(instance, (low, high), &mut visitor),
                None => self.blocks[leaf].visit_box(low, high, &mut visitor),
            }
        }
    }

    /// The same tree, traversed with another kernel than the fastest.
    #[must_use]
    pub fn with_kernel(self, kernel: Kernel) -> Self {
        Self { kernel, ..self }
    }

    /// What traversal computes with.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// The number of triangles, each instance's counted.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// What the tree takes, its triangles included.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..]) + size_of_val(&self.instances[..])
    }
}
