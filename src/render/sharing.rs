//! Which meshes are in the tree once for all their instances.
//!
//! A copy of a mesh for each instance is faster to trace, and takes memory and time to build. So copies are made as long as they are
//! few: meshes share only where copies would take more than [`ALL_COPIES`], and then all but those that save the least.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::accel::Placement;
use crate::scene::{Mesh, Scene};
use crate::settings::Use;

/// What copies beyond the meshes themselves may take, in bytes, for all to be copied: 3.6 million triangles, which are built in some seconds.
/// While that is built, it is about three times as much.
const ALL_COPIES: usize = 512 << 20;

/// What they may take where some meshes share: rays through both are slow where copies lie among shared meshes, so that only small meshes
/// are worth it.
const SOME_COPIES: usize = 64 << 20;

/// What a triangle of a copy takes, in bytes: itself, its origin and its part of the tree. The last is all that it takes in a shared mesh.
const OF_COPY: usize = 64 + 8 + OF_TREE;
const OF_TREE: usize = 73;

/// What an instance of a shared mesh takes beside it, in bytes: its placement, here and in the tree, and its part of the nodes above.
const OF_INSTANCE: usize = 160 + 128 + 64;

/// What sharing saves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Saved {
    /// The instances that have no copy.
    pub(super) instances: usize,
    /// Their meshes.
    pub(super) meshes: usize,
    /// What they take, about, in bytes.
    pub(super) bytes: usize,
    /// What copies would take, about, in bytes.
    pub(super) copied_bytes: usize,
}

/// A mesh that could be shared, with its instances.
struct Candidate {
    triangles: usize,
    /// Instances by index.
    placed: Vec<(u32, Placement)>,
}

impl Candidate {
    fn bytes(&self) -> usize {
        self.triangles * OF_TREE + self.placed.len() * OF_INSTANCE
    }

    fn copied_bytes(&self) -> usize {
        self.triangles * OF_COPY * self.placed.len()
    }

    fn saving(&self) -> usize {
        self.copied_bytes().saturating_sub(self.bytes())
    }
}

/// The instances that share their mesh, by index, ascending, in a scene whose instances' triangles count from `firsts`.
pub(super) fn shared<M>(scene: &Scene<M>, firsts: &[u32], sharing: Use) -> (Vec<(u32, Placement)>, Saved) {
    let mut candidates = candidates(scene, firsts, sharing);
    if sharing == Use::Auto {
        candidates.retain(|candidate| candidate.placed.len() > 1 && candidate.saving() > 0);
        candidates.sort_by_key(Candidate::saving);
        let all: usize = candidates.iter().map(Candidate::saving).sum();
        let most = if all > ALL_COPIES { SOME_COPIES } else { ALL_COPIES };
        let mut copies = 0;
        candidates.retain(|candidate| {
            copies += candidate.saving();
            copies > most
        });
    }
    let saved = Saved {
        instances: candidates.iter().map(|candidate| candidate.placed.len()).sum(),
        meshes: candidates.len(),
        bytes: candidates.iter().map(Candidate::bytes).sum(),
        copied_bytes: candidates.iter().map(Candidate::copied_bytes).sum(),
    };
    let mut placed: Vec<_> = candidates.into_iter().flat_map(|candidate| candidate.placed).collect();
    placed.sort_by_key(|&(instance, _)| instance);
    (placed, saved)
}

/// The meshes that have instances whose transform allows it, in the order of meshes.
fn candidates<M>(scene: &Scene<M>, firsts: &[u32], sharing: Use) -> Vec<Candidate> {
    if sharing == Use::Never {
        return Vec::new();
    }
    let mut instances = BTreeMap::<u32, Vec<u32>>::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        instances.entry(instance.mesh.0).or_default().push(i as u32);
    }
    let candidate = |(mesh, instances): (u32, Vec<u32>)| {
        let mesh = &scene.meshes[mesh as usize];
        let bounds = bounds(mesh)?;
        let place = |i: u32| {
            let to_world = &scene.instances[i as usize].world_from_object;
            Some((i, Placement::new(firsts[i as usize], to_world, bounds)?))
        };
        let placed: Vec<_> = instances.into_iter().filter_map(place).collect();
        (!placed.is_empty()).then_some(Candidate { triangles: mesh.triangles.len(), placed })
    };
    instances.into_iter().filter_map(candidate).collect()
}

/// The box around a mesh's triangles, none where it has none.
fn bounds(mesh: &Mesh) -> Option<(Vec3, Vec3)> {
    let mut corners = mesh.triangles.iter().flatten().map(|&c| mesh.positions[c as usize]);
    let first = corners.next()?;
    Some(corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
}
