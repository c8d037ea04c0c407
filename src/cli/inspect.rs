//! `pipeline inspect`.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::progress::Progress;
use super::reading::{Conversion, Reading};
use super::render::parse_enum;
use super::{FAILED, Outcome, Talk, WELL, print, print_bytes, tell};
use crate::disney::Masking;
use crate::inspect::eval::{Variant, evaluate};
use crate::inspect::{Edit, InspectError, MOST, Options, Target, gather, look, numbers, write_report};
use crate::render::Control;

/// The most rows that are evaluated at once, in bytes: some 700,000.
const MAX_ROWS: u64 = 128 << 20;

/// Look into materials: a page with a lit sphere, their lobes, albedo and sampling; or BRDF values for rows of a CSV file.
///
/// A target is a scene or a material library (YAML, `name: {roughness: 0.3, …}`), alone for all its materials or followed by
/// #NAME for one; without any the model's default material is looked at. Several materials are compared.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline inspect scenes/shaderball.glb#ball -p roughness=0.3 -p metallic=1\n  pipeline inspect -p roughness=0.1,0.3,0.6 -o outputs/roughness\n  pipeline inspect metals.yaml#gold metals.yaml#copper\n  pipeline inspect --eval rows.csv --g remapped > values.csv"
)]
pub(super) struct Arguments {
    /// FILE or FILE#NAME: a scene or a material library, and one of its materials.
    #[arg(value_name = "TARGET")]
    targets: Vec<String>,
    /// Set a parameter of every material; several values, as in roughness=0.1,0.3,0.6, make variants to compare.
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    params: Vec<String>,
    /// The folder for index.html and the PNGs, or the page if it ends in .html: the PNGs lie beside it.
    #[arg(short, long, value_name = "FOLDER", default_value = "outputs/inspect")]
    output: PathBuf,
    /// Read rows of parameters and directions, with the columns base_color_r … clearcoat_gloss, lx, ly, lz (to the light) and vx, vy,
    /// vz (to the viewer), and print them with fr, fg, fb (the BRDF without the cosine) and pdf; `-` reads from stdin.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["targets", "params", "output", "spp", "size", "json"])]
    eval: Option<PathBuf>,
    /// The roughness of the masking term G: matched (that of D) or remapped (0.5 + roughness/2); the material's own where absent.
    #[arg(long, value_name = "G", value_parser = parse_enum::<Masking>)]
    g: Option<Masking>,
    /// Samples a pixel of the sphere.
    #[arg(long, value_name = "N", default_value_t = Options::default().spp, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    spp: u32,
    /// The side of the sphere's picture.
    #[arg(long, value_name = "PIXELS", default_value_t = Options::default().size, value_parser = clap::value_parser!(u32).range(16..=2048))]
    size: u32,
    /// Print the figures as JSON instead of the files' names.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    conversion: Conversion,
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    match &arguments.eval {
        Some(file) => evaluate_rows(arguments, file, talk),
        None => Ok(inspect(arguments, talk).map_err(with_hint)?),
    }
}

fn inspect(arguments: &Arguments, talk: Talk) -> Result<u8, InspectError> {
    let targets: Vec<Target> = arguments.targets.iter().map(|text| Target::parse(text)).collect();
    let edits: Vec<Edit> = arguments.params.iter().map(|text| Edit::parse(text)).collect::<Result<_, _>>()?;
    let (import, convert) = (arguments.reading.options(), arguments.conversion.options());
    let gathered = gather(&targets, &edits, (&import, &convert), arguments.g)?;
    for warning in &gathered.warnings {
        talk.say(&format!("warning: {warning}"));
    }
    if !gathered.left_out.is_empty() {
        talk.say(&format!(
            "{MOST} materials are compared; {} are left out: {}",
            gathered.left_out.len(),
            gathered.left_out.join(", ")
        ));
    }
    let options = Options { size: arguments.size, spp: arguments.spp };
    let mut progress = Progress::new(gathered.subjects.len(), talk);
    let mut inspected = Vec::new();
    for subject in gathered.subjects {
        let control = Arc::new(Control::default());
        progress.follow(&[&subject.name], &control);
        inspected.push(look(subject, options, &control)?);
        progress.finish_job(false);
    }
    drop(progress);
    let files = write_report(&arguments.output, &inspected)?;
    let text = if arguments.json {
        format!("{:#}\n", numbers(&inspected))
    } else {
        files.iter().map(|file| format!("{}\n", file.display())).collect()
    };
    print(&text).map_err(|cause| InspectError::File { path: "stdout".into(), cause })?;
    Ok(WELL)
}

/// The error with what may help below it.
fn with_hint(error: InspectError) -> String {
    error.hint().map_or_else(|| error.to_string(), |hint| format!("{error}\nhint: {hint}"))
}

fn evaluate_rows(arguments: &Arguments, file: &Path, talk: Talk) -> Outcome {
    let (bytes, name) = read(file)?;
    let variant = Variant {
        masking: arguments.g.unwrap_or_default(),
        diffuse: arguments.conversion.options().diffuse.unwrap_or_default(),
    };
    let mut out = Vec::new();
    let summary = evaluate(&bytes, &name, variant, &mut out)?;
    print_bytes(&out)?;
    for failure in &summary.failures {
        tell(&format!("{name}:{}: {}", failure.line, failure.why));
    }
    talk.say(&format!("{name}: {summary}"));
    Ok(if summary.failures.is_empty() { WELL } else { FAILED })
}

/// The content of a file, or of stdin for `-`, and what messages call it.
fn read(file: &Path) -> Result<(Vec<u8>, String), String> {
    let is_stdin = file == Path::new("-");
    let name = if is_stdin { "stdin".to_owned() } else { file.display().to_string() };
    let mut bytes = Vec::new();
    let read = if is_stdin {
        std::io::stdin().lock().take(MAX_ROWS + 1).read_to_end(&mut bytes)
    } else {
        File::open(file).and_then(|file| file.take(MAX_ROWS + 1).read_to_end(&mut bytes))
    };
    match read {
        Err(cause) => Err(format!("{name}: {cause}")),
        Ok(size) if size as u64 > MAX_ROWS => {
            Err(format!("{name}: at most {MAX_ROWS} bytes of rows are read at once"))
        }
        Ok(_) => Ok((bytes, name)),
    }
}
