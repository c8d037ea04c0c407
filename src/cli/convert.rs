//! `pipeline convert`.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::reading::{Conversion, Reading};
use super::{FAILED, Outcome, Talk, WELL, print, tell, terminal_width};
use crate::convert::ConvertOptions;
use crate::export::{self, Exported, Input, Target, export};
use crate::import::ImportOptions;

/// Convert scenes into Disney material libraries, MaterialX, Aris config roots, Mitsuba scenes or glTF, and tell what became of each
/// field.
///
/// The library, materials.yaml, is for editing by hand: `pipeline render model.glb --materials materials.yaml` lays it over the scene, and
/// unedited it gives the same picture. Textures are written beside it. A folder is converted with all scenes inside it, in parallel; a
/// broken file does not stop the others.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline convert scenes/shaderball.glb -o outputs/shaderball_materials\n  pipeline convert model.glb --report html > report.html\n  pipeline convert model.glb --to mtlx -o model_mtlx\n  pipeline convert model.glb --to aris -o root && pipeline render root/config spp=16\n  pipeline convert model.glb --to mitsuba -o model_mitsuba && mitsuba -m scalar_rgb -D spp=256 model_mitsuba/scene.xml\n  pipeline convert room.obj --to gltf -o room && pipeline render room/scene.glb\n  pipeline convert assets/ -o libraries"
)]
pub(super) struct Arguments {
    /// Scenes, or folders of scenes.
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// The folder to write into; outputs/convert/NAME where absent.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// What to convert into: library, a Disney material library; mtlx, a MaterialX document of disney_principled nodes; aris, a config
    /// root with meshes, of constants alone; mitsuba, a scene of Mitsuba 3 with meshes and textures; gltf, the whole scene in scene.glb.
    #[arg(long, value_name = "TARGET", value_parser = parse_target, default_value = "library")]
    to: Target,
    /// How to tell what became of the materials, on stdout.
    #[arg(long, value_enum, default_value_t = Report::Table)]
    report: Report,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    conversion: Conversion,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Report {
    Table,
    Json,
    Html,
}

fn parse_target(text: &str) -> Result<Target, String> {
    Target::from_name(text).ok_or_else(|| {
        let known: Vec<&str> = Target::ALL.iter().map(|t| t.name()).collect();
        format!("known are {}", known.join(" and "))
    })
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    let inputs = export::inputs(&arguments.scenes, &output(arguments))?;
    let options = (&arguments.reading.options(), &arguments.conversion.options());
    let (exported, failed) = convert_all(&inputs, arguments.to, options, talk);
    for warning in exported.iter().flat_map(|e| &e.warnings) {
        talk.say(&format!("warning: {warning}"));
    }
    print(&report(&exported, arguments.report)?)?;
    for (source, error) in &failed {
        let (text, file) = (error.to_string(), source.display().to_string());
        let place = if text.contains(&file) { String::new() } else { format!("{file}: ") };
        tell(&format!("error: {place}{text}"));
    }
    Ok(if failed.is_empty() { WELL } else { FAILED })
}

fn output(arguments: &Arguments) -> PathBuf {
    arguments.output.clone().unwrap_or_else(|| {
        let name = arguments.scenes.first().and_then(|s| s.file_stem()).unwrap_or_default();
        Path::new("outputs/convert").join(name)
    })
}

type Failures = Vec<(PathBuf, export::ExportError)>;

/// Converts in parallel; results and failures in the order of the inputs.
fn convert_all(
    inputs: &[Input],
    target: Target,
    (import_options, convert_options): (&ImportOptions, &ConvertOptions),
    talk: Talk,
) -> (Vec<Exported>, Failures) {
    let bar = match (talk, inputs.len()) {
        (Talk::Normal, 2..) => ProgressBar::new(inputs.len() as u64),
        _ => ProgressBar::hidden(),
    };
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {wide_msg}") {
        bar.set_style(style);
    }
    let results: Vec<_> = inputs
        .par_iter()
        .map(|input| {
            bar.set_message(input.source.display().to_string());
            let result = export(&input.source, &input.folder, target, import_options, convert_options);
            bar.inc(1);
            result.map_err(|error| (input.source.clone(), error))
        })
        .collect();
    bar.finish_and_clear();
    let mut failed = Vec::new();
    let exported =
        results.into_iter().filter_map(|r| r.map_err(|failure| failed.push(failure)).ok()).collect();
    (exported, failed)
}

fn report(exported: &[Exported], report: Report) -> Result<String, Box<dyn std::error::Error>> {
    let width = terminal_width();
    Ok(match report {
        Report::Table => exported.iter().map(|e| export::table(e, width)).collect::<Vec<_>>().join("\n"),
        Report::Json => format!("{:#}\n", export::json(exported)),
        Report::Html => export::html(exported)?,
    })
}
