//! `pipeline diff`.

use std::path::{Path, PathBuf};

use comfy_table::{CellAlignment, LineStyle, Table, presets};

use super::{DIFFERENT, FAILED, Outcome, Talk, WELL, print, tell};
use crate::compare::strict::{self, Comparison};
use crate::compare::{self, Limits, Options, Parts, StrictLimits, Thresholds, Verbosity};
use crate::imagefile;
use crate::output::tone;
use crate::raster::Raster;
use crate::record::{CrossCheck, Verdict};
use crate::settings::{Display, ToneCurve};

/// Compare two images.
///
/// The mode `strict` fails on any value that is not finite and on any difference of size, window, parts or channel names; its
/// limits are independent of each other. The mode `idiff` gives the text and the exit codes of OpenImageIO's idiff (0 pass, 1
/// warning, 2 failure, 4 unreadable); its options are spelled with two dashes here, and -abs and -p are not there.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline diff a.exr b.exr\n  pipeline diff a.exr b.exr --fail 0.004 --failpercent 1\n  pipeline diff --mode idiff -a a.exr b.exr\n  pipeline diff a.exr b.exr -o difference.png --scale 10"
)]
pub(super) struct Arguments {
    /// The result.
    a: PathBuf,
    /// The reference.
    b: PathBuf,
    /// What counts as different.
    #[arg(long, value_enum, default_value_t = Mode::Strict)]
    mode: Mode,
    /// Compare all parts (strict always does).
    #[arg(short, long)]
    all: bool,
    /// A pixel fails if a value differs by more.
    #[arg(long, value_name = "X", default_value_t = 1e-6)]
    fail: f32,
    /// So many percent of the pixels may fail.
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0)]
    failpercent: f32,
    /// A value that differs by no more than this part of itself does not fail.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    failrelative: f32,
    /// No value may differ by more.
    #[arg(long, value_name = "X", default_value_t = f32::INFINITY)]
    hardfail: f32,
    /// So many pixels may fail.
    #[arg(long, value_name = "N", default_value_t = 0)]
    allowfailures: u32,
    /// As --fail, for a warning (mode idiff).
    #[arg(long, value_name = "X", default_value_t = 1e-6)]
    warn: f32,
    /// As --failpercent, for a warning (mode idiff).
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0)]
    warnpercent: f32,
    /// As --failrelative, for a warning (mode idiff).
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    warnrelative: f32,
    /// As --hardfail, for a warning (mode idiff).
    #[arg(long, value_name = "X", default_value_t = f32::INFINITY)]
    hardwarn: f32,
    /// The largest mean difference of the picture (mode strict).
    #[arg(long, value_name = "X", default_value_t = f32::INFINITY)]
    mean: f32,
    /// The largest RMS difference of the picture (mode strict).
    #[arg(long, value_name = "X", default_value_t = f32::INFINITY)]
    rms: f32,
    /// Say everything even if nothing differs (mode idiff).
    #[arg(short, long)]
    verbose: bool,
    /// Write a picture of the absolute differences, an EXR or a PNG.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Multiply that picture by this.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    scale: f32,
    /// Let the real idiff confirm the built-in one; it is an error if it can't or if they disagree.
    #[arg(long)]
    cross_check: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Mode {
    /// Nothing passes by accident.
    Strict,
    /// OpenImageIO's.
    Idiff,
}

/// `idiff`'s exit code for a file that it can't read.
const UNREADABLE: u8 = 4;

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    let (a, b) = match (imagefile::read(&arguments.a), imagefile::read(&arguments.b)) {
        (Ok(a), Ok(b)) => (a, b),
        (Err(error), _) | (_, Err(error)) if arguments.mode == Mode::Idiff => {
            tell(&format!("idiff ERROR: {error}"));
            return Ok(UNREADABLE);
        }
        (Err(error), _) | (_, Err(error)) => return Err(error.into()),
    };
    if arguments.cross_check {
        cross_check(arguments, talk)?;
    }
    if let Some(path) = &arguments.output {
        write_difference(path, &a, &b, arguments.scale)?;
    }
    match arguments.mode {
        Mode::Idiff => {
            let names = [&arguments.a, &arguments.b].map(|p| p.display().to_string());
            let report = match compare::idiff::idiff(
                [&names[0], &names[1]],
                &a,
                &b,
                &thresholds(arguments),
                options(arguments, talk),
            ) {
                Ok(report) => report,
                Err(error) => {
                    tell(&format!("idiff ERROR: {error}"));
                    return Ok(UNREADABLE);
                }
            };
            print(&report.stdout)?;
            if !report.stderr.is_empty() {
                tell(&report.stderr);
            }
            Ok(report.verdict.exit_code() as u8)
        }
        Mode::Strict => {
            let limits = Limits {
                fail: arguments.fail,
                fail_relative: arguments.failrelative,
                fail_percent: arguments.failpercent,
                allow_failures: arguments.allowfailures,
                hard_fail: arguments.hardfail,
                mean: arguments.mean,
                rms: arguments.rms,
            };
            let comparison =
                strict::compare(&a, &b, &StrictLimits { picture: limits, ..StrictLimits::default() })?;
            print(&told(&comparison))?;
            Ok(match comparison.verdict() {
                Verdict::Error { .. } => FAILED,
                verdict if verdict.passes() => WELL,
                _ => DIFFERENT,
            })
        }
    }
}

fn thresholds(arguments: &Arguments) -> Thresholds {
    Thresholds {
        fail: arguments.fail,
        failpercent: arguments.failpercent,
        failrelative: arguments.failrelative,
        hardfail: arguments.hardfail,
        allowfailures: arguments.allowfailures,
        warn: arguments.warn,
        warnpercent: arguments.warnpercent,
        warnrelative: arguments.warnrelative,
        hardwarn: arguments.hardwarn,
    }
}

fn options(arguments: &Arguments, talk: Talk) -> Options {
    Options {
        parts: if arguments.all { Parts::All } else { Parts::First },
        verbosity: match (talk == Talk::Quiet, arguments.verbose) {
            (true, _) => Verbosity::Quiet,
            (false, true) => Verbosity::Verbose,
            (false, false) => Verbosity::Normal,
        },
    }
}

fn cross_check(arguments: &Arguments, talk: Talk) -> Result<(), Box<dyn std::error::Error>> {
    let program = compare::find_idiff(None)?;
    let checked = compare::cross_check(
        program.as_deref(),
        &arguments.a,
        &arguments.b,
        &thresholds(arguments),
        options(arguments, talk),
    )?;
    if checked == CrossCheck::NotInstalled {
        return Err("there is no idiff on PATH to confirm the comparison; OpenImageIO's wheel has one: pip install OpenImageIO".into());
    }
    Ok(())
}

fn write_difference(
    path: &Path,
    a: &Raster,
    b: &Raster,
    scale: f32,
) -> Result<(), Box<dyn std::error::Error>> {
    let difference = compare::diff_image(a, b, scale)?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    if !matches!(extension.as_deref(), Some("png" | "exr")) {
        return Err(format!("{}: differences are written as .exr or .png", path.display()).into());
    }
    if extension.as_deref() == Some("png") {
        let layer = difference.picture();
        let rgb = layer.rgb().ok_or("a difference without R, G and B can be written as EXR alone")?;
        let pixels = tone::to_srgb8(rgb, &Display { tone: ToneCurve::Srgb, exposure: 0.0 });
        imagefile::write_png(path, layer.window.width, layer.window.height, &pixels)?;
    } else {
        imagefile::write_exr(path, &difference)?;
    }
    Ok(())
}

/// A table of the groups of channels, then the verdict with its reasons.
fn told(comparison: &Comparison) -> String {
    let mut table = Table::new();
    let rule = LineStyle::none().fill('─').junction('─');
    table.load_style(presets::NOTHING.header_separator(rule));
    table.set_header([
        "part",
        "channels",
        "max error",
        "mean error",
        "RMS error",
        "bias",
        "pixels over",
        "not finite",
        "worst at",
    ]);
    for g in &comparison.groups {
        let s = &g.statistics;
        let over = if g.limits.is_some() { s.over.to_string() } else { format!("({})", s.over) };
        let worst = s.worst.as_ref().map_or(String::new(), |w| format!("({}, {}) {}", w.x, w.y, w.channel));
        let figure = |v: f64| format!("{v:.3e}");
        table.add_row([
            g.part.clone(),
            g.group.clone(),
            figure(s.max_error),
            figure(s.mean_error),
            figure(s.rms_error),
            figure(s.bias),
            over,
            s.non_finite.to_string(),
            worst,
        ]);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let verdict = comparison.verdict();
    let why = match &verdict {
        Verdict::Differs { why, .. } | Verdict::Shape { why } => format!(": {why}"),
        _ => String::new(),
    };
    let table =
        if comparison.groups.is_empty() { String::new() } else { format!("{}\n\n", table.trim_fmt()) };
    format!("{table}{}{why}\n", verdict.word())
}
