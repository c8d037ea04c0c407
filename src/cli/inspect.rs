//! `pipeline inspect`.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::render::parse_enum;
use super::{FAILED, Outcome, Talk, WELL, print, tell};
use crate::disney::{DiffuseModel, Masking};
use crate::inspect::eval::{Variant, evaluate};

/// Look into materials: their lobes, albedo and sampling, or BRDF values for rows of a CSV file.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline inspect --eval rows.csv > values.csv\n  pipeline inspect --eval rows.csv --g remapped > values.csv"
)]
pub(super) struct Arguments {
    /// Read rows of parameters and directions, with the columns base_color_r … clearcoat_gloss, lx, ly, lz (to the light) and vx, vy,
    /// vz (to the viewer), and print them with fr, fg, fb (the BRDF without the cosine) and pdf; `-` reads from stdin.
    #[arg(long, value_name = "FILE")]
    eval: PathBuf,
    /// The roughness of the masking term G: matched (that of D) or remapped (0.5 + roughness/2).
    #[arg(long, value_name = "G", value_parser = parse_enum::<Masking>)]
    g: Option<Masking>,
    /// The diffuse term: burley, lambert or lambert_fresnel.
    #[arg(long, value_name = "MODEL", value_parser = parse_enum::<DiffuseModel>)]
    diffuse: Option<DiffuseModel>,
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    evaluate_rows(arguments, &arguments.eval, talk)
}

fn evaluate_rows(arguments: &Arguments, file: &Path, talk: Talk) -> Outcome {
    let (bytes, name) = read(file)?;
    let variant =
        Variant { masking: arguments.g.unwrap_or_default(), diffuse: arguments.diffuse.unwrap_or_default() };
    let mut out = Vec::new();
    let summary = evaluate(&bytes, &name, variant, &mut out)?;
    print(&out)?;
    for failure in &summary.failures {
        tell(&format!("{name}:{}: {}", failure.line, failure.why));
    }
    talk.say(&format!("{name}: {summary}"));
    Ok(if summary.failures.is_empty() { WELL } else { FAILED })
}

/// The content of a file, or of stdin for `-`, and what messages call it.
fn read(file: &Path) -> Result<(Vec<u8>, String), String> {
    if file == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes).map_err(|cause| format!("stdin: {cause}"))?;
        return Ok((bytes, "stdin".to_owned()));
    }
    let name = file.display().to_string();
    let bytes = std::fs::read(file).map_err(|cause| format!("{name}: {cause}"))?;
    Ok((bytes, name))
}
