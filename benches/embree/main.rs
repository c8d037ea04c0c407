//! How fast rays are traced beside Embree: `cargo bench --bench embree -- --library PATH [SCENE…]`, one thread.
//!
//! The library is Embree 4's, loaded at run time from `--library` or the environment's `EMBREE_LIBRARY`; without one there is nothing to
//! do. Rays of a 640 × 480 picture, two diffuse bounces of them and shadow rays, as `pipeline bench rays` makes them but that none
//! knows the triangle it starts on, which Embree has no word for. Figures are millions of rays a second, the medians of rounds in which
//! our tree, Embree's and its robust one take turns, and the ratios of ours to both. It ends with 1 if they differ on what is hit by
//! more than one ray in 10,000.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark's result is its output")]

#[path = "../common/mod.rs"]
mod common;
mod ffi;

use std::collections::HashMap;
use std::error::Error;
use std::fmt;
use std::iter::successors;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use glam::Vec3;
use pipeline::accel::{Bvh, Ray};
use pipeline::bench::rays::{RaySet, ray_sets};
use pipeline::math::Real;

use common::{in_turns, middle, prepared, timed};
use ffi::{Embree, Mode, Scene};

const HOW_TO_GET_IT: &str = "\
No Embree to race: name its library with --library PATH or EMBREE_LIBRARY. `pip download embreex==4.4.0.post1 --no-deps` and `unzip` get
it: embreex.libs/libembree4-*.so.4, which finds its libtbb beside it or in LD_LIBRARY_PATH.";

/// How often each tree is built.
const BUILDS: usize = 3;
/// The fraction of rays on which trees may differ: some meet an edge.
const TOLERANCE: f64 = 1e-4;

fn main() -> ExitCode {
    let Options { library, scenes } = match Options::parse() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(64);
        }
    };
    let Some(library) = library else {
        println!("{HOW_TO_GET_IT}");
        return ExitCode::SUCCESS;
    };
    match race(&library, &scenes) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            let causes = successors(Some(&*error as &(dyn Error + 'static)), |&error| error.source());
            eprintln!("{}", causes.map(ToString::to_string).collect::<Vec<_>>().join(": "));
            ExitCode::FAILURE
        }
    }
}

struct Options {
    library: Option<PathBuf>,
    scenes: Vec<PathBuf>,
}

impl Options {
    /// `cargo` adds options of its own; those that aren't ours are left alone.
    fn parse() -> Result<Self, &'static str> {
        let mut library = std::env::var_os("EMBREE_LIBRARY").filter(|path| !path.is_empty());
        let mut scenes = Vec::new();
        let mut arguments = std::env::args_os().skip(1);
        while let Some(argument) = arguments.next() {
            if argument == "--library" {
                library = Some(arguments.next().ok_or("--library wants a path")?);
            } else if !argument.as_encoded_bytes().starts_with(b"-") {
                scenes.push(argument.into());
            }
        }
        if scenes.is_empty() {
            let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
            scenes = ["cornell.obj", "shaderball.glb", "statue.glb.gz"].map(|name| own.join(name)).to_vec();
        }
        Ok(Self { library: library.map(PathBuf::from), scenes })
    }
}

/// Prints a table for each scene and a summary; tells whether all found the same hits.
fn race(library: &Path, scenes: &[PathBuf]) -> Result<bool, Box<dyn Error>> {
    let embree = Embree::load(library)?;
    println!("Embree {}", embree.version().map(|number| number.to_string()).join("."));
    let mut rows = Vec::new();
    for path in scenes {
        let prepared = prepared(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let contest = Contest::new(&embree, &prepared.geometry().corners())?;
        let scene = path.file_name().unwrap_or_default().display();
        println!("\n{scene}: {}\n{}", contest.report, Row::HEADS);
        for RaySet { kind, mut rays } in ray_sets(&prepared) {
            rays.iter_mut().for_each(|ray| ray.source = None);
            for (hit, outcomes) in [("closest", contest.closest(&rays)), ("any", contest.any(&rays))] {
                let row =
                    Row { scene: scene.to_string(), rays: kind.name(), hit, count: rays.len(), outcomes };
                println!("{row}");
                rows.push(row);
            }
        }
    }
    println!();
    summarize(&rows, "default", |row| row.ratios()[0]);
    summarize(&rows, "robust", |row| row.ratios()[1]);
    let differing: Vec<&Row> = rows.iter().filter(|row| !row.agrees()).collect();
    for row in &differing {
        println!("DIFFERENCE {}: {:?} hits", row.name(), row.outcomes.map(|outcome| outcome.hits));
    }
    Ok(differing.is_empty())
}

fn summarize(rows: &[Row], mode: &str, ratio: impl Fn(&Row) -> f64) {
    let lowest = rows.iter().min_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    let Some(lowest) = lowest else { return };
    let log_mean = rows.iter().map(|row| Real::ln(ratio(row))).sum::<f64>() / rows.len() as f64;
    let mean = Real::exp(log_mean);
    println!("over {mode}: geometric mean {mean:.2}, lowest {:.2} ({})", ratio(lowest), lowest.name());
}

/// How one tree did.
#[derive(Clone, Copy)]
struct Outcome {
    /// Million rays a second.
    rate: f64,
    hits: usize,
}

/// How ours, Embree's default and its robust tree did with rays of a kind.
struct Row {
    scene: String,
    rays: &'static str,
    hit: &'static str,
    count: usize,
    outcomes: [Outcome; 3],
}

impl Row {
    const HEADS: &str = "  rays      hit      thousand     ours  default   robust  ours/default  ours/robust";

    fn name(&self) -> String {
        format!("{}, {}, {}", self.scene, self.rays, self.hit)
    }

    /// Our rate over that of the default and of the robust mode.
    fn ratios(&self) -> [f64; 2] {
        let [ours, default, robust] = self.outcomes.map(|outcome| outcome.rate);
        [ours / default, ours / robust]
    }

    fn agrees(&self) -> bool {
        let [ours, theirs @ ..] = self.outcomes.map(|outcome| outcome.hits);
        theirs.iter().all(|hits| hits.abs_diff(ours) as f64 <= TOLERANCE * self.count as f64)
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [ours, default, robust] = self.outcomes.map(|outcome| outcome.rate);
        let [over_default, over_robust] = self.ratios();
        let (rays, hit, thousand) = (self.rays, self.hit, self.count as f64 * 1e-3);
        write!(f, "  {rays:<9} {hit:<8} {thousand:>8.0} {ours:>8.2} {default:>8.2} {robust:>8.2}")?;
        write!(f, " {over_default:>13.2} {over_robust:>12.2}")
    }
}

/// A tree of ours and two of Embree's, over the same triangles.
struct Contest<'a> {
    ours: Bvh,
    default: Scene<'a>,
    robust: Scene<'a>,
    /// What building them took.
    report: String,
}

impl<'a> Contest<'a> {
    fn new(embree: &'a Embree, triangles: &[[Vec3; 3]]) -> Result<Self, Box<dyn Error>> {
        let (points, corners) = indexed(triangles);
        let (mut ours, mut default, mut robust) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..BUILDS {
            ours.push(timed(|| Bvh::build(triangles)));
            default.push(timed(|| embree.scene(&points, &corners, Mode::Default)));
            robust.push(timed(|| embree.scene(&points, &corners, Mode::Robust)));
        }
        let (own_time, ours) = middle(ours);
        let (default_time, default) = middle(default);
        let (robust_time, robust) = middle(robust);
        let report = format!(
            "{} triangles; built in {:.1} ms, by Embree in {:.1} ms, by its robust mode in {:.1} ms",
            triangles.len(),
            own_time * 1e3,
            default_time * 1e3,
            robust_time * 1e3
        );
        Ok(Self { ours: ours?, default: default?, robust: robust?, report })
    }

    /// The rays' nearest hits.
    fn closest(&self, rays: &[Ray]) -> [Outcome; 3] {
        take_turns(
            rays,
            |ray| self.ours.closest(ray).is_some(),
            |ray| self.default.closest(ray),
            |ray| self.robust.closest(ray),
        )
    }

    /// Whether there is any hit.
    fn any(&self, rays: &[Ray]) -> [Outcome; 3] {
        take_turns(
            rays,
            |ray| self.ours.occluded(ray),
            |ray| self.default.occluded(ray),
            |ray| self.robust.occluded(ray),
        )
    }
}

/// Triangles with their corners shared, as meshes have them.
fn indexed(triangles: &[[Vec3; 3]]) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut points = Vec::new();
    let mut known = HashMap::new();
    let mut index = |corner: Vec3| {
        let point = corner.to_array();
        *known.entry(point.map(f32::to_bits)).or_insert_with(|| {
            points.push(point);
            u32::try_from(points.len() - 1).expect("an index of 32 bits")
        })
    };
    let corners = triangles.iter().map(|triangle| triangle.map(&mut index)).collect();
    (points, corners)
}

/// How three trees do that tell of a ray whether it hits.
fn take_turns(
    rays: &[Ray],
    ours: impl Fn(&Ray) -> bool,
    default: impl Fn(&Ray) -> bool,
    robust: impl Fn(&Ray) -> bool,
) -> [Outcome; 3] {
    in_turns(rays, ours, default, robust)
        .map(|(seconds, hits)| Outcome { rate: rays.len() as f64 * 1e-6 / seconds, hits })
}
