//! `pipeline bench`.

mod ablation;
mod rays;

use std::path::{Path, PathBuf};

use super::progress::Progress;
use super::reading::{Conversion, Reading};
use super::{Outcome, Talk, WELL, print};
use crate::bench::{self, Bench, BenchError, Plan, Subject, Watch, summarize};
use crate::imagefile::{encode_png, write_whole};
use crate::job::{self, Build, LoadedScene};
use crate::record::Job;
use crate::settings::{ConvertOptions, ImportOptions, Reach, RenderSettings};
use crate::sweep::{self, Scenes};

/// Measure error against time: how much work scenes are, and whether their pictures are right on average; what each technique of the
/// renderer has to do with it; or rays a second.
///
/// Each scene, or each job of a manifest, is rendered at several numbers of samples with several seeds, and held against a long render
/// of its own, which is kept for the next time. The error is the mean over pixels and channels of (x - ref)²/(ref² + 0.01). Work is
/// error times seconds: lower is better, and more samples leave it as it is. In the folder are runs.csv, summary.json, error.png and
/// error.svg.
///
/// With --ablate each is also rendered without one technique after the other, and the errors, wall-clock times and work are given as
/// ratios to the whole renderer's, which takes its turn in the same rounds: the geometric mean over the levels, of times the median
/// over the seeds. What saves work alone must not change a bit; if it does, the exit code is 1. In the folder are ablation.csv,
/// ablation.png and ablation.svg.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  pipeline bench scenes/shaderball.glb scenes/cornell.obj\n  pipeline bench scenes/cornell.obj --levels 4,16,64,256 --seeds 4 --height 300\n  pipeline bench configs/glass.toml -o outputs/bench_glass\n  pipeline bench --ablate scenes/shaderball.glb --levels 4,16\n  pipeline bench rays scenes/shaderball.glb"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    part: Option<Part>,
    /// Scenes, and manifests (.toml).
    #[arg(required = true)]
    targets: Vec<PathBuf>,
    /// Tell what each technique is worth.
    #[arg(long)]
    ablate: bool,
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
    if arguments.ablate {
        return ablation::run(arguments, &plan, talk);
    }
    let build = Build::current()?;
    let mut measured = Vec::new();
    for_each_job(arguments, |job, loaded| {
        let renders = plan.levels.len() * plan.seeds as usize + 1;
        let subject = Subject { job, loaded, build: &build };
        measured.push(with_progress(renders, talk, |watch| bench::measure(&subject, &plan, watch))?);
        Ok(())
    })?;
    write(&measured, &arguments.output)?;
    let rows: Vec<_> = measured.iter().map(|bench| (bench.name.as_str(), summarize(bench))).collect();
    print(&bench::table(&rows))?;
    talk.say(&format!("chart: {}", arguments.output.join("error.png").display()));
    Ok(WELL)
}

/// Does something with each scene, and with each job of manifests.
fn for_each_job(
    arguments: &Arguments,
    mut act: impl FnMut(&Job, &LoadedScene) -> Result<(), Box<dyn std::error::Error>>,
) -> Result<(), Box<dyn std::error::Error>> {
    let (import, convert) = (arguments.reading.options(), arguments.conversion.options());
    for target in &arguments.targets {
        if !target.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            let loaded = job::load(target, &import, &convert, None).map_err(|error| error.told())?;
            act(&described(target, arguments), &loaded)?;
            continue;
        }
        let reach = import.reach;
        let usual = (ImportOptions { reach, ..ImportOptions::default() }, ConvertOptions::default());
        if (&import, &convert) != (&usual.0, &usual.1) {
            let why =
                "a manifest says itself how its scenes are read; hint: [set] with import.… and convert.…";
            return Err(format!("{}: {why}", target.display()).into());
        }
        let mut sweep = sweep::open(target)?;
        if reach != Reach::default() {
            sweep.reach = reach;
        }
        let mut scenes = Scenes::of(&sweep);
        for (_, job, reading) in scenes.in_order(&sweep.jobs)? {
            act(job, scenes.get(&reading)?)?;
        }
    }
    Ok(())
}

/// The job that renders a scene file.
fn described(path: &Path, arguments: &Arguments) -> Job {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let settings = RenderSettings {
        width: arguments.width,
        height: Some(arguments.height),
        ..RenderSettings::default()
    };
    Job {
        name: name.split('.').next().unwrap_or_default().to_owned(),
        scene: path.to_owned(),
        overrides: Vec::new(),
        settings,
        coordinates: Vec::new(),
    }
}

/// Measures with a bar over the renders.
fn with_progress<T>(
    renders: usize,
    talk: Talk,
    measure: impl FnOnce(&mut Watch<'_>) -> Result<T, BenchError>,
) -> Result<T, BenchError> {
    let mut progress = Progress::new(renders, talk);
    let mut first = true;
    measure(&mut |name, control| {
        if !std::mem::take(&mut first) {
            progress.finish_job(false);
        }
        progress.follow(&[name], control);
    })
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
