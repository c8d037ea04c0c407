//! No ray leaves a closed mesh. `benches/closed_mesh.rs` shoots a hundred times as many.

use crate::common::closed::{Aim, Placement, meshes};

const PLACEMENTS: [(f64, f64); 7] =
    [(1e-5, 0.0), (1e-3, 0.0), (1.0, 0.0), (1e3, 0.0), (1e6, 0.0), (10.0, 1e6), (1e3, 1e6)];

#[test]
fn no_ray_leaves_a_closed_mesh() {
    for closed in meshes() {
        for (scale, offset) in PLACEMENTS {
            // Far from the origin floats are coarser than slivers are thin: what was closed is folded.
            if !closed.is_sound && offset > 0.0 {
                continue;
            }
            let shots = closed.shoot(Placement { scale, offset }, Aim::Anywhere, 16_000);
            assert_eq!(
                (shots.escaped, shots.outside),
                (0, 0),
                "{}, scale {scale}, offset {offset}",
                closed.name
            );
        }
    }
}

#[test]
fn no_ray_slips_through_an_edge_or_a_vertex_or_starts_behind_one() {
    for closed in meshes().iter().filter(|m| m.is_sound) {
        for (scale, offset) in PLACEMENTS {
            let shots = closed.shoot(Placement { scale, offset }, Aim::Edges, 16_000);
            assert_eq!(
                (shots.escaped, shots.outside),
                (0, 0),
                "{}, scale {scale}, offset {offset}",
                closed.name
            );
        }
    }
}
