//! How many rays leave closed meshes: none should.
//!
//! `cargo bench --bench closed_mesh -- --rays 100000000` shoots that many in random directions, shared out evenly among meshes, scales
//! and offsets, and a tenth as many half of which are aimed at edges and vertices. Paths leave surfaces as the renderer's do. It
//! ends with 1 if any ray left, but for meshes with triangles as thin as rounding, where aimed at or folded by coarse floats.

use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

#[path = "../tests/common/mod.rs"]
mod common;

use common::closed::{Aim, Placement, meshes};

const PLACEMENTS: [(f64, f64); 7] =
    [(1e-5, 0.0), (1e-3, 0.0), (1.0, 0.0), (1e3, 0.0), (1e6, 0.0), (10.0, 1e6), (1e3, 1e6)];

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip_while(|a| a != "--rays").skip(1);
    let rays: u64 = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(10_000_000);
    let meshes = meshes();
    let share = rays.div_ceil((meshes.len() * PLACEMENTS.len()) as u64);
    let mut out = std::io::stdout().lock();
    let mut line = |text: String| writeln!(out, "{text}").expect("stdout");
    line(format!(
        "{:<24} {:>9} {:>7} {:>7} {:>8} {:>11} {:>8} {:>8} {:>9}",
        "mesh", "triangles", "scale", "offset", "aim", "rays", "escaped", "outside", "million/s"
    ));
    let (mut total, mut lost, mut excused) = (0, 0, 0);
    let runs = [(Aim::Anywhere, share), (Aim::Edges, share / 10)];
    for closed in meshes {
        for (scale, offset) in PLACEMENTS {
            for (aim, rays) in runs {
                let start = Instant::now();
                let shots = closed.shoot(Placement { scale, offset }, aim, rays);
                let speed = shots.rays as f64 / start.elapsed().as_secs_f64() * 1e-6;
                line(format!(
                    "{:<24} {:>9} {:>7e} {:>7e} {:>8} {:>11} {:>8} {:>8} {:>9.1}",
                    closed.name,
                    closed.mesh.triangles.len(),
                    scale,
                    offset,
                    format!("{aim:?}").to_lowercase(),
                    shots.rays,
                    shots.escaped,
                    shots.outside,
                    speed
                ));
                total += shots.rays;
                let left = shots.escaped + shots.outside;
                // Far from the origin floats are coarser than slivers are thin: what was closed is folded.
                let counts = closed.is_sound || (aim == Aim::Anywhere && offset == 0.0);
                *if counts { &mut lost } else { &mut excused } += left;
            }
        }
    }
    line(format!("{lost} of {total} rays left their mesh, and {excused} that met slivers"));
    if lost == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
