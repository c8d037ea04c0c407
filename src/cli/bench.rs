//! `pipeline bench`.

mod rays;

use std::path::{Path, PathBuf};

use super::progress::Progress;
use super::reading::{Conversion, Reading};
use super::{Outcome, Talk, WELL, print};
use crate::bench::{self, Bench, Plan, summarize};
use crate::imagefile::{encode_png, write_whole};
use crate::job::{self, Build, LoadedScene};
use crate::record::Job;
use crate::settings::RenderSettings;
use crate::sweep::{self, Scenes};

/// Measure error against time: how much work scenes are, and whether their pictures are right on average; or rays a second.
///
/// Each scene, or each job of a manifest, is rendered at several numbers of samples with several seeds, and held against a long render
/// of its own, which is kept for the next time. The error is the mean over pixels and channels of (x - ref)²/(ref² + 0.01). Work is
/// error times seconds: lower is better, and more samples leave it as it is. In the folder are runs.csv, summary.json, error.png and
/// error.svg.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  pipeline bench scenes/shaderball.glb scenes/cornell.obj\n  pipeline bench scenes/cornell.obj --levels 4,16,64,256 --seeds 4 --height 300\n  pipeline bench configs/glass.toml -o outputs/bench_glass\n  pipeline bench rays scenes/shaderball.glb"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    part: Option<Part>,
    /// Scenes, and manifests (.toml).
    #[arg(required = true)]
    targets: Vec<PathBuf>,
    /// Samples a pixel, in powers of two best.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "4,16,64", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    levels: Vec<u32>,
    /// How often each level is rendered, with a seed of its own.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=64))]
    seeds: u32,
    /// Samples a pixel of the reference; 64 times the highest level where absent. Its noise adds its share to every error.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    reference: Option<u32>,
    /// The folder to write into, where references are kept, too.
    #[arg(short, long, value_name = "FOLDER", default_value = "outputs/bench")]
    output: PathBuf,
    /// Columns, for scenes; a manifest says its own size.
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    width: Option<u32>,
    /// Rows, likewise.
    #[arg(long, value_name = "PIXELS", default_value_t = 150, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    height: u32,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    conversion: Conversion,
}

#[derive(Debug, clap::Subcommand)]
enum Part {
    Rays(rays::Arguments),
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    if let Some(Part::Rays(arguments)) = &arguments.part {
        return rays::run(arguments, talk);
    }
    let mut levels = arguments.levels.clone();
    levels.sort_unstable();
    levels.dedup();
    let highest = levels.last().copied().unwrap_or(1);
    let reference = arguments.reference.unwrap_or(highest.saturating_mul(64).min(1 << 24));
    let plan = Plan { levels, seeds: arguments.seeds, reference, folder: arguments.output.clone() };
    let mut measured = Vec::new();
    for target in &arguments.targets {
        let is_manifest = target.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        match is_manifest {
            true => measured.extend(of_manifest(target, &plan, talk)?),
            false => measured.push(of_scene(target, arguments, &plan, talk)?),
        }
    }
    write(&measured, &arguments.output)?;
    let rows: Vec<_> = measured.iter().map(|bench| (bench.name.as_str(), summarize(bench))).collect();
    print(&bench::table(&rows))?;
    talk.say(&format!("chart: {}", arguments.output.join("error.png").display()));
    Ok(WELL)
}

fn of_scene(
    path: &Path,
    arguments: &Arguments,
    plan: &Plan,
    talk: Talk,
) -> Result<Bench, Box<dyn std::error::Error>> {
    let (import, convert) = (arguments.reading.options(), arguments.conversion.options());
    let loaded = job::load(path, &import, &convert, None)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let settings = RenderSettings {
        width: arguments.width,
        height: Some(arguments.height),
        ..RenderSettings::default()
    };
    let job = Job {
        name: name.split('.').next().unwrap_or_default().to_owned(),
        scene: path.to_owned(),
        overrides: Vec::new(),
        settings,
        coordinates: Vec::new(),
    };
    measure(&job, &loaded, plan, talk)
}

fn of_manifest(path: &Path, plan: &Plan, talk: Talk) -> Result<Vec<Bench>, Box<dyn std::error::Error>> {
    let sweep = sweep::open(path)?;
    let mut scenes = Scenes::of(&sweep);
    let mut measured = Vec::new();
    for (_, job, reading) in scenes.scene_by_scene(&sweep.jobs)? {
        measured.push(measure(job, scenes.get(&reading)?, plan, talk)?);
    }
    Ok(measured)
}

fn measure(
    job: &Job,
    loaded: &LoadedScene,
    plan: &Plan,
    talk: Talk,
) -> Result<Bench, Box<dyn std::error::Error>> {
    let renders = plan.levels.len() * plan.seeds as usize + 1;
    let mut progress = Progress::new(renders, talk);
    let mut first = true;
    let bench = bench::measure(job, loaded, &Build::current()?, plan, &mut |name, control| {
        if !std::mem::take(&mut first) {
            progress.finish_job(false);
        }
        progress.follow(name, control);
    })?;
    Ok(bench)
}

fn write(measured: &[Bench], folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let summary: Vec<_> = measured
        .iter()
        .map(|bench| serde_json::json!({"scene": bench.name, "size": bench.size, "reference": bench.reference, "summary": summarize(bench)}))
        .collect();
    let (svg, picture) = bench::plot(measured)?;
    write_whole(&folder.join("runs.csv"), bench::csv(measured)?.as_bytes())?;
    write_whole(&folder.join("summary.json"), serde_json::to_string_pretty(&summary)?.as_bytes())?;
    write_whole(&folder.join("error.svg"), svg.as_bytes())?;
    let png = encode_png(picture.width, picture.height, &picture.rgb)?;
    Ok(write_whole(&folder.join("error.png"), &png)?)
}
