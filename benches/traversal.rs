//! How fast rays are traced: `cargo bench --bench traversal`, one thread.
//!
//! Rays of a 640 × 480 picture, two diffuse bounces of them and shadow rays, as `pipeline bench rays` makes them, through the project's scenes and, where the environment's
//! `PIPELINE_CORPUS` names the folder, through its kitchen and bunny. Beside ours stands the traversal that obvhs comes with, of its
//! binary and of its eight-wide tree, with its triangle test, which is not watertight. Figures are millions of rays a second, the medians
//! of rounds in which all take turns, and the ratio of ours to the faster of the others.

use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use pipeline::accel::{Bvh, Ray};
use pipeline::bench::rays::{RaySet, ray_sets};

#[path = "common/mod.rs"]
mod common;

use common::{ROUNDS, in_turns, middle, prepared, timed};

fn main() {
    let mut out = std::io::stdout().lock();
    let mut line = |text: String| writeln!(out, "{text}").expect("stdout");
    for path in files() {
        let prepared = prepared(&path).expect("a scene that can be rendered");
        let contest = Contest::new(&prepared.geometry().corners());
        line(format!("{}: {}", path.file_name().unwrap_or_default().display(), contest.report));
        line(format!(
            "  {:<9} {:<8} {:>8} {:>8} {:>8} {:>8} {:>8}",
            "rays", "hit", "thousand", "ours", "bvh2", "cwbvh", "ratio"
        ));
        for RaySet { kind, rays } in ray_sets(&prepared) {
            let kind = kind.name();
            for (hit, [ours, bvh2, cwbvh]) in
                [("closest", contest.closest(&rays)), ("any", contest.any(&rays))]
            {
                let thousand = rays.len() as f64 * 1e-3;
                let ratio = ours / bvh2.max(cwbvh);
                line(format!(
                    "  {kind:<9} {hit:<8} {thousand:>8.0} {ours:>8.2} {bvh2:>8.2} {cwbvh:>8.2} {ratio:>8.2}"
                ));
            }
        }
    }
}

/// The scenes there are.
fn files() -> Vec<PathBuf> {
    let own = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes"));
    let mut files: Vec<PathBuf> =
        ["shaderball.glb", "statue.glb.gz", "cornell.obj"].iter().map(|name| own.join(name)).collect();
    if let Some(corpus) = std::env::var_os("PIPELINE_CORPUS") {
        let obj = PathBuf::from(corpus).join("obj");
        files.extend(["kitchen.obj.zst", "stanford-bunny.obj.zst"].map(|name| obj.join(name)));
    }
    files
}

/// A tree of ours and two of obvhs', over the same triangles.
struct Contest {
    ours: Bvh,
    bvh2: Bvh2,
    cwbvh: CwBvh,
    /// In the order of each of their trees.
    bvh2_triangles: Vec<RtTriangle>,
    cwbvh_triangles: Vec<RtTriangle>,
    /// What building them took, in milliseconds.
    report: String,
}

impl Contest {
    fn new(triangles: &[[Vec3; 3]]) -> Self {
        let corners = |t: &[Vec3; 3]| t.map(Vec3A::from);
        let theirs: Vec<Triangle> =
            triangles.iter().map(corners).map(|[v0, v1, v2]| Triangle { v0, v1, v2 }).collect();
        let medium = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let (mut ours, mut bvh2) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            ours.push(timed(|| Bvh::build(triangles).expect("a tree")));
            bvh2.push(timed(|| build_bvh2_from_tris(&theirs, medium, &mut Duration::default())));
        }
        let (own_time, own) = middle(ours);
        let (their_time, bvh2) = middle(bvh2);
        let cwbvh = build_cwbvh_from_tris(&theirs, medium, &mut Duration::default());
        let ordered = |order: &[u32]| order.iter().map(|&i| RtTriangle::from(&theirs[i as usize])).collect();
        Self {
            report: format!(
                "{} triangles, {:.1} bytes each; built in {:.1} ms, obvhs' medium binary tree in {:.1} ms",
                own.len(),
                own.bytes() as f64 / own.len() as f64,
                own_time * 1e3,
                their_time * 1e3
            ),
            bvh2_triangles: ordered(&bvh2.primitive_indices),
            cwbvh_triangles: ordered(&cwbvh.primitive_indices),
            ours: own,
            bvh2,
            cwbvh,
        }
    }

    /// Millions of rays a second whose nearest hit is found: ours, obvhs' binary and its wide tree.
    fn closest(&self, rays: &[Ray]) -> [f64; 3] {
        let bvh2 = |ray: &Ray| {
            let mut hit = RayHit::none();
            let test = |ray: &obvhs::ray::Ray, i: usize| self.bvh2_triangles[i].intersect(ray);
            self.bvh2.ray_traverse(theirs(ray), &mut hit, test)
        };
        let cwbvh = |ray: &Ray| {
            let mut hit = RayHit::none();
            let test = |ray: &obvhs::ray::Ray, i: usize| self.cwbvh_triangles[i].intersect(ray);
            self.cwbvh.ray_traverse(theirs(ray), &mut hit, test)
        };
        race(rays, |ray| self.ours.closest(ray).is_some(), bvh2, cwbvh)
    }

    /// The same for rays that ask whether there is any hit.
    fn any(&self, rays: &[Ray]) -> [f64; 3] {
        let bvh2 = |ray: &Ray| {
            !self.bvh2.ray_traverse_miss(theirs(ray), |ray, i| self.bvh2_triangles[i].intersect(ray))
        };
        let cwbvh = |ray: &Ray| {
            !self.cwbvh.ray_traverse_miss(theirs(ray), |ray, i| self.cwbvh_triangles[i].intersect(ray))
        };
        race(rays, |ray| self.ours.occluded(ray), bvh2, cwbvh)
    }
}

fn theirs(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max)
}

/// How many million `rays` a second each of three can tell whether they hit.
fn race(
    rays: &[Ray],
    ours: impl Fn(&Ray) -> bool,
    bvh2: impl Fn(&Ray) -> bool,
    cwbvh: impl Fn(&Ray) -> bool,
) -> [f64; 3] {
    in_turns(rays, ours, bvh2, cwbvh).map(|(seconds, _)| rays.len() as f64 * 1e-6 / seconds)
}
