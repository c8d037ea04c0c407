//! The race: kernels, kinds of rays and numbers of threads take turns on one tree.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use super::{RayKind, RaySet, ray_sets};
use crate::accel::{Bvh, Kernel, Ray};
use crate::bench::BenchError;
use crate::bench::summary::median;
use crate::bench::table::{columns, digits};
use crate::render::{Prepared, RenderError};

/// How often the tree is built: one of a million triangles takes seconds.
const BUILDS: usize = 3;
/// Rays that a thread takes at a time.
const SHARE: usize = 1024;

/// What is asked about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Query {
    /// What it meets first.
    Closest,
    /// Whether it meets anything.
    Any,
}

impl Query {
    /// How many of the rays meet something.
    fn count(self, tree: &Bvh, rays: &[Ray]) -> usize {
        match self {
            Self::Closest => rays.iter().filter(|ray| tree.closest(ray).is_some()).count(),
            Self::Any => rays.iter().filter(|ray| tree.occluded(ray)).count(),
        }
    }
}

/// How fast a tree is.
#[derive(Clone, Debug, Serialize)]
pub struct RayReport {
    /// Triangles, instances counted.
    pub triangles: usize,
    /// What the tree takes, its triangles included.
    pub bytes_per_triangle: f64,
    /// The median wall-clock time of a few builds on one thread.
    pub build_seconds: f64,
    /// Columns and rows of the picture whose rays they are.
    pub size: [u32; 2],
    /// The kernels that were measured: `avx2`, `portable`.
    pub kernels: Vec<&'static str>,
    /// The most threads.
    pub threads: usize,
    /// Passes over each set, of which the median counts.
    pub repetitions: u32,
    /// The kinds of rays.
    pub sets: Vec<SetReport>,
}

/// Rays of a kind.
#[derive(Clone, Debug, Serialize)]
pub struct SetReport {
    /// Their kind.
    pub name: &'static str,
    /// How many there are.
    pub rays: usize,
    /// The fraction that meets something.
    pub hits: f64,
    /// How fast they were answered.
    pub rates: Vec<Rate>,
}

/// One figure.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rate {
    /// The kernel.
    pub kernel: &'static str,
    /// What was asked.
    pub query: Query,
    /// Threads at work.
    pub threads: usize,
    /// Million rays a second.
    pub million_rays_per_second: f64,
}

/// What takes its turn in each round, and its times so far.
struct Runner<'a> {
    kernel: Kernel,
    set: &'a RaySet,
    query: Query,
    threads: usize,
    seconds: Vec<f64>,
}

/// Measures how fast the scene's triangles are found by rays of its picture, on one thread and on all of the current pool.
///
/// # Errors
/// If no ray of the camera hits anything, or the tree can't be built.
pub fn race(scene: &Prepared, kernels: &[Kernel], repetitions: u32) -> Result<RayReport, BenchError> {
    let sets = ray_sets(scene);
    // The second kind starts where the camera's rays hit.
    if !sets.iter().any(|set| set.kind == RayKind::FirstBounce) {
        return Err(BenchError::NothingSeen);
    }
    let (mut tree, build_seconds) = built(scene)?;
    let mut runners: Vec<Runner<'_>> = sets.iter().flat_map(|set| runners(set, kernels)).collect();
    for _ in 0..repetitions {
        for runner in &mut runners {
            tree = tree.with_kernel(runner.kernel);
            runner.run(&tree);
        }
    }
    let report = |set: &RaySet| SetReport {
        name: set.kind.name(),
        rays: set.rays.len(),
        hits: Query::Any.count(&tree, &set.rays) as f64 / set.rays.len() as f64,
        rates: runners.iter().filter(|runner| runner.set.kind == set.kind).map(Runner::rate).collect(),
    };
    let (width, height) = scene.size();
    Ok(RayReport {
        triangles: tree.len(),
        bytes_per_triangle: tree.bytes() as f64 / tree.len().max(1) as f64,
        build_seconds,
        size: [width, height],
        kernels: kernels.iter().map(|kernel| kernel.name()).collect(),
        threads: rayon::current_num_threads(),
        repetitions,
        sets: sets.iter().map(report).collect(),
    })
}

/// A tree over the scene's triangles, and the seconds it took.
fn built(scene: &Prepared) -> Result<(Bvh, f64), RenderError> {
    let mut seconds = Vec::new();
    let mut build = || {
        let start = Instant::now();
        let tree = scene.geometry().rebuilt_tree();
        seconds.push(start.elapsed().as_secs_f64());
        tree
    };
    for _ in 1..BUILDS {
        black_box(build()?);
    }
    let tree = build()?;
    Ok((tree, median(seconds)))
}

/// All that is measured of a set.
fn runners<'a>(set: &'a RaySet, kernels: &[Kernel]) -> Vec<Runner<'a>> {
    // What a shadow ray meets first is nobody's question.
    let queries: &[Query] = match set.kind {
        RayKind::Shadow => &[Query::Any],
        _ => &[Query::Closest, Query::Any],
    };
    let all_threads = rayon::current_num_threads();
    let threads = if all_threads > 1 { vec![1, all_threads] } else { vec![1] };
    let mut runners = Vec::new();
    for &kernel in kernels {
        for &query in queries {
            let runner = |&threads: &usize| Runner { kernel, set, query, threads, seconds: Vec::new() };
            runners.extend(threads.iter().map(runner));
        }
    }
    runners
}

impl Runner<'_> {
    fn run(&mut self, tree: &Bvh) {
        let count = |rays: &[Ray]| self.query.count(tree, rays);
        let start = Instant::now();
        black_box(match self.threads {
            1 => count(&self.set.rays),
            _ => self.set.rays.par_chunks(SHARE).map(count).sum::<usize>(),
        });
        self.seconds.push(start.elapsed().as_secs_f64());
    }

    fn rate(&self) -> Rate {
        let seconds = median(self.seconds.clone()).max(1e-9);
        Rate {
            kernel: self.kernel.name(),
            query: self.query,
            threads: self.threads,
            million_rays_per_second: self.set.rays.len() as f64 * 1e-6 / seconds,
        }
    }
}

/// The rates in columns, for people.
pub fn ray_table(report: &RayReport) -> String {
    let mut rows = Vec::new();
    for set in &report.sets {
        for rate in &set.rates {
            let query = if rate.query == Query::Closest { "closest" } else { "any" };
            rows.push([
                set.name.to_owned(),
                query.to_owned(),
                rate.kernel.to_owned(),
                rate.threads.to_string(),
                format!("{:.0}%", 100.0 * set.hits),
                digits(rate.million_rays_per_second),
            ]);
        }
    }
    columns(["rays", "hit", "kernel", "threads", "hits", "million/s"], &rows, 3)
}
