//! `pipeline bench rays`.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use crate::accel::Kernel;
use crate::bench::rays::{RayReport, race, ray_table};
use crate::cli::reading::Reading;
use crate::cli::{Outcome, Talk, WELL, print};
use crate::convert::ConvertOptions;
use crate::job::{self, Build};
use crate::record::{Job, Override, Value};
use crate::render::Prepared;
use crate::settings::RenderSettings;

/// Measure how many million rays a second are traced through a scene.
///
/// The rays are those of a picture, made beforehand: from the camera, pixel by pixel in small tiles, after one and after two diffuse
/// bounces, and from the first surfaces to the lights. Of all, but those to lights, is asked what they meet first and whether they meet
/// anything, on one thread and on all; everything takes turns, and medians are printed, as JSON.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline bench rays scenes/shaderball.glb\n  pipeline bench rays scenes/cornell.obj --kernel both --threads 1\n  pipeline bench rays room.obj --camera 2,1.6,3 --target 0,1,0 --fov 60"
)]
pub(super) struct Arguments {
    /// The scene: glTF, OBJ or an Aris YAML scene.
    scene: PathBuf,
    /// Where to look from; without it from the scene's first camera, or one that frames it.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    camera: Option<[f32; 3]>,
    /// Where to look to.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    target: Option<[f32; 3]>,
    /// The vertical angle of view.
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f32>,
    /// Columns of the picture.
    #[arg(long, value_name = "PIXELS", default_value_t = 640, value_parser = clap::value_parser!(u32).range(1..=4096))]
    width: u32,
    /// Rows.
    #[arg(long, value_name = "PIXELS", default_value_t = 480, value_parser = clap::value_parser!(u32).range(1..=4096))]
    height: u32,
    /// What to trace with; the fastest that the processor has where absent.
    #[arg(long, value_enum)]
    kernel: Option<Kernels>,
    /// How often each kind of rays is traced.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: u32,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Kernels {
    /// Eight boxes or triangles at a time.
    Avx2,
    /// Plain Rust, for every processor.
    Portable,
    /// One after the other.
    Both,
}

impl Kernels {
    fn chosen(choice: Option<Self>) -> Result<Vec<Kernel>, &'static str> {
        let avx2 = || Kernel::avx2().ok_or("this processor has no AVX2; hint: --kernel portable");
        Ok(match choice {
            None => vec![Kernel::detect()],
            Some(Self::Avx2) => vec![avx2()?],
            Some(Self::Portable) => vec![Kernel::PORTABLE],
            Some(Self::Both) => vec![avx2()?, Kernel::PORTABLE],
        })
    }
}

fn parse_point(text: &str) -> Result<[f32; 3], String> {
    let numbers: Option<Vec<f32>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f32| n.is_finite())).collect();
    let point = numbers.and_then(|numbers| numbers.try_into().ok());
    point.ok_or_else(|| "three numbers are expected, such as 2,1.6,-3".to_owned())
}

/// What is printed.
#[derive(Serialize)]
struct Printed<'a> {
    scene: &'a str,
    #[serde(flatten)]
    report: &'a RayReport,
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    let kernels = Kernels::chosen(arguments.kernel)?;
    let loaded = job::load(&arguments.scene, &arguments.reading.options(), &ConvertOptions::default(), None)
        .map_err(|error| error.told())?;
    let planned =
        job::plan(&described(arguments), &loaded, &Build::current()?).map_err(|error| error.told())?;
    for warning in loaded.warnings.iter().chain(&planned.warnings) {
        talk.say(&format!("warning: {warning}"));
    }
    let prepared = Prepared::new(planned.scene, Arc::clone(&loaded.geometry), &planned.settings)?;
    let report = race(&prepared, &kernels, arguments.repetitions)?;
    talk.say(&format!(
        "{} triangles, {:.1} bytes each, built in {:.3} s\n{}",
        report.triangles,
        report.bytes_per_triangle,
        report.build_seconds,
        ray_table(&report)
    ));
    let printed = Printed { scene: &arguments.scene.to_string_lossy(), report: &report };
    print(&(serde_json::to_string_pretty(&printed)? + "\n"))?;
    Ok(WELL)
}

/// The job whose picture the rays are of.
fn described(arguments: &Arguments) -> Job {
    let point = |numbers: [f32; 3]| Value::List(numbers.map(|n| Value::Number(n.into())).to_vec());
    let view = [
        ("camera.position", arguments.camera.map(point)),
        ("camera.target", arguments.target.map(point)),
        ("camera.fov", arguments.fov.map(|degrees| Value::Number(degrees.into()))),
    ];
    let set = |(path, value): (&str, Option<Value>)| Some(Override { path: path.to_owned(), value: value? });
    Job {
        name: "rays".to_owned(),
        scene: arguments.scene.clone(),
        overrides: view.into_iter().filter_map(set).collect(),
        settings: RenderSettings {
            width: Some(arguments.width),
            height: Some(arguments.height),
            ..RenderSettings::default()
        },
        coordinates: Vec::new(),
    }
}
