//! Ray acceleration: a tree eight children wide, and watertight traversal of it. The only room that names obvhs.
//!
//! obvhs builds a binary tree, of which an optimal choice of nodes becomes the wide one (Ylitie, Karras and Laine 2017). A ray is
//! tested against eight boxes or eight triangles at a time, with AVX2 where the processor has it and in plain Rust elsewhere: the
//! same operations in the same order, so that hits are the same bits. Triangles are watertight by Woop, Benthin and Wald 2013, boxes
//! by Ize 2013.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod block;
mod build;
mod collapse;
mod lanes;
mod places;
#[cfg(test)]
mod tests;
mod traverse;
mod triangle;

use std::ops::ControlFlow;

use glam::Vec3;

use block::Block;
pub use build::BuildError;
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
    /// The number of triangles.
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
        Self { bounds: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3], child: [Child::of_block(0); 8] }
    }

    fn set(&mut self, slot: usize, (low, high): (Vec3, Vec3), child: Child) {
        for (axis, [lower, upper]) in self.bounds.iter_mut().enumerate() {
            (lower[slot], upper[slot]) = (low[axis], high[axis]);
        }
        self.child[slot] = child;
    }

    fn touches(&self, slot: usize, low: Vec3, high: Vec3) -> bool {
        let axes = self.bounds.iter().enumerate();
        axes.into_iter().all(|(axis, [lower, upper])| lower[slot] <= high[axis] && upper[slot] >= low[axis])
    }
}

/// The index of a node, or of a block of triangles where the highest bit is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
struct Child(u32);

impl Child {
    const BLOCK: u32 = 1 << 31;

    fn of_node(index: usize) -> Self {
        Self(index as u32)
    }

    fn of_block(index: usize) -> Self {
        Self(index as u32 | Self::BLOCK)
    }

    #[inline(always)]
    fn block(self) -> Option<usize> {
        (self.0 & Self::BLOCK != 0).then_some((self.0 & !Self::BLOCK) as usize)
    }

    /// The index, if it is no block's.
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
        match self.kernel.0 {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(avx2) => avx2.closest(self, ray, counts),
            Instructions::Portable => traverse::closest(Portable, self, ray, counts),
        }
    }

    /// Whether anything is hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.visit(ray, |_| ControlFlow::Break(()))
    }

    /// Calls `visitor` with the hits in no particular order until it breaks; tells whether it did.
    #[inline]
    pub fn visit(&self, ray: &Ray, visitor: impl FnMut(Hit) -> ControlFlow<()>) -> bool {
        match self.kernel.0 {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(avx2) => avx2.visit(self, ray, visitor),
            Instructions::Portable => traverse::visit(Portable, self, ray, visitor),
        }
    }

    /// Calls `visitor` with the index of every triangle whose box touches the one between `low` and `high`.
    pub fn visit_box(&self, low: Vec3, high: Vec3, mut visitor: impl FnMut(u32)) {
        let mut pending = vec![self.root];
        while let Some(child) = pending.pop() {
            let Some(block) = child.block() else {
                let node = &self.nodes[child.node()];
                pending.extend((0..8).filter(|&k| node.touches(k, low, high)).map(|k| node.child[k]));
                continue;
            };
            for (id, [a, b, c]) in self.blocks[block].triangles() {
                if a.min(b).min(c).cmple(high).all() && a.max(b).max(c).cmpge(low).all() {
                    visitor(id);
                }
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

    /// The number of triangles.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// What the tree takes, its triangles included.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..])
    }
}
