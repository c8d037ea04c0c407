//! OpenImageIO's `idiff` 3.2: the same numbers, the same text, the same exit code.
//!
//! Its holes are kept: NaN "equals" NaN and any infinity any other; a value that is non-finite on one side only is neither
//! counted as a warning nor as a failure; differing sizes, windows and channel names are not differences of their own (what is
//! missing reads as 0, channels match by place); `hardfail`, `warn` and `hardwarn` only count once a pixel fails. Use
//! [`strict`](super::strict) to tell whether an image is right.
//!
//! Not covered: MIP levels (a raster holds the full resolution only), deep images and the perceptual test.

use std::fmt;
use std::fmt::Write as _;

use crate::raster::Raster;

use super::CompareError;
use super::idiff_text::{general, shortest};
use super::view::{Region, View, index};

/// Sums are collected in batches of this many pixels, which changes their rounding.
const BATCH: usize = 4096;

/// `idiff`'s options of the same names; all comparisons are strict ("more than").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// A pixel fails if a channel differs by more.
    pub fail: f32,
    /// As many percent of the first image's pixels may fail.
    pub failpercent: f32,
    /// A channel that differs by no more than this fraction of the values' mean does not fail.
    pub failrelative: f32,
    /// No value may differ by more, if any pixel fails at all.
    pub hardfail: f32,
    /// As many pixels may fail by any amount: then everything passes.
    pub allowfailures: u32,
    /// As `fail`, for a warning.
    pub warn: f32,
    /// As `failpercent`, for a warning.
    pub warnpercent: f32,
    /// As `failrelative`, for a warning.
    pub warnrelative: f32,
    /// As `hardfail`, for a warning.
    pub hardwarn: f32,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            fail: 1e-6,
            failpercent: 0.0,
            failrelative: 0.0,
            hardfail: f32::INFINITY,
            allowfailures: 0,
            warn: 1e-6,
            warnpercent: 0.0,
            warnrelative: 0.0,
            hardwarn: f32::INFINITY,
        }
    }
}

impl Thresholds {
    /// The float options with their names, in the order of the usage text.
    pub(super) const fn floats(&self) -> [(&'static str, f32); 8] {
        [
            ("fail", self.fail),
            ("failrelative", self.failrelative),
            ("failpercent", self.failpercent),
            ("hardfail", self.hardfail),
            ("warn", self.warn),
            ("warnrelative", self.warnrelative),
            ("warnpercent", self.warnpercent),
            ("hardwarn", self.hardwarn),
        ]
    }

    /// Checks that every threshold is a number.
    ///
    /// # Errors
    /// Names the first that is NaN.
    pub fn check(&self) -> Result<(), CompareError> {
        match self.floats().into_iter().find(|(_, value)| value.is_nan()) {
            Some((name, _)) => Err(CompareError::Threshold { name }),
            None => Ok(()),
        }
    }
}

/// Which parts are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parts {
    /// The first part of each image.
    #[default]
    First,
    /// Part by part, as with `-a`.
    All,
}

/// How much is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verbosity {
    /// Only `FAILURE`, on stderr, as with `-q`.
    Quiet,
    /// Statistics where something differs.
    #[default]
    Normal,
    /// Statistics always, as with `-v`.
    Verbose,
}

/// What is compared and said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Which parts.
    pub parts: Parts,
    /// How much is said.
    pub verbosity: Verbosity,
}

/// `idiff`'s verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum IdiffVerdict {
    /// Within the thresholds.
    #[default]
    Pass,
    /// Beyond those for a warning.
    Warning,
    /// Beyond those for a failure.
    Failure,
}

impl IdiffVerdict {
    /// The exit code: 0, 1 or 2.
    pub const fn exit_code(self) -> i32 {
        match self {
            Self::Pass => 0,
            Self::Warning => 1,
            Self::Failure => 2,
        }
    }
}

impl fmt::Display for IdiffVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pass => "PASS",
            Self::Warning => "WARNING",
            Self::Failure => "FAILURE",
        })
    }
}

/// What `idiff` measures on a pair of parts.
#[derive(Clone, Debug, PartialEq)]
pub struct PartStatistics {
    /// The mean of |a - b| over all values of the region.
    pub mean_error: f64,
    /// The root of the mean of squares.
    pub rms_error: f64,
    /// 20 log10 (largest value, at least 1 / RMS), in decibels.
    pub psnr: f64,
    /// The largest difference; infinite where only one value is not finite.
    pub max_error: f64,
    /// Where it is.
    pub at: (i64, i64),
    /// Its channel, in OpenImageIO's order.
    pub channel: usize,
    /// Pixels beyond `warn`.
    pub warned: u64,
    /// Pixels beyond `fail`.
    pub failed: u64,
}

/// What `idiff` would print and return.
#[derive(Clone, Debug, PartialEq)]
pub struct IdiffReport {
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
    /// The verdict, with its exit code.
    pub verdict: IdiffVerdict,
    /// The statistics of each pair of parts.
    pub parts: Vec<PartStatistics>,
}

/// Compares two images as `idiff` does; `names` stand in the text.
///
/// # Errors
/// If an image has no layers, a channel does not fill its window, the windows are too far apart, a threshold is NaN, or the
/// channels are luminance and chroma.
pub fn idiff(
    names: [&str; 2],
    a: &Raster,
    b: &Raster,
    thresholds: &Thresholds,
    options: Options,
) -> Result<IdiffReport, CompareError> {
    thresholds.check()?;
    for (raster, name) in [(a, names[0]), (b, names[1])] {
        if raster.layers.is_empty() {
            return Err(CompareError::NoLayers { name: name.into() });
        }
    }
    let counts = [a.layers.len(), b.layers.len()];
    let compared = if options.parts == Parts::All { counts[0].min(counts[1]) } else { 1 };
    let quiet = options.verbosity == Verbosity::Quiet;
    let mut report = IdiffReport {
        stdout: String::new(),
        stderr: String::new(),
        verdict: IdiffVerdict::Pass,
        parts: Vec::with_capacity(compared),
    };
    let mut out = format!("Comparing \"{}\" and \"{}\"\n", names[0], names[1]);
    for (number, (a, b)) in a.layers.iter().zip(&b.layers).take(compared).enumerate() {
        let (a, b) = (View::new(a)?, View::new(b)?);
        let part = measure(&a, &b, thresholds)?;
        report.verdict = report.verdict.max(judge(&part, a.window.pixels(), thresholds));
        // An earlier part's verdict makes the later ones speak too.
        if options.verbosity == Verbosity::Verbose || report.verdict != IdiffVerdict::Pass {
            if options.parts == Parts::All {
                head(&mut out, &a, number, counts[0]);
            }
            describe(&mut out, &part, &a, &b, thresholds);
        }
        report.parts.push(part);
    }
    let [in_a, in_b] = counts;
    if options.parts == Parts::All && in_a != in_b {
        report.stderr = format!("Images had differing numbers of subimages ({in_a} vs {in_b})\n");
        report.verdict = IdiffVerdict::Failure;
    }
    if options.parts == Parts::First && (in_a > 1 || in_b > 1) {
        out += &format!("Only compared the first subimage (of {in_a} and {in_b}, respectively)\n");
    }
    if quiet {
        report.stderr =
            if report.verdict == IdiffVerdict::Failure { "FAILURE\n".into() } else { String::new() };
    } else {
        report.stdout = format!("{out}{}\n", report.verdict);
    }
    Ok(report)
}

/// The larger of two, the first where they cannot be ordered: C++'s `std::max`.
fn max(a: f32, b: f32) -> f32 {
    if a < b { b } else { a }
}

/// Whether a difference is within a limit; NaN is within none.
fn within(difference: f64, limit: f64) -> bool {
    difference <= limit
}

/// Goes over the region's values, rows first, channels last, as `ImageBufAlgo::compare`.
fn measure(a: &View<'_>, b: &View<'_>, thresholds: &Thresholds) -> Result<PartStatistics, CompareError> {
    let channels = a.channels.len().max(b.channels.len());
    let region = Region::new(&a.window, &b.window, channels)?;
    let (mut total, mut total_squares) = (0.0_f64, 0.0_f64);
    let (mut batch, mut batch_squares) = (0.0_f64, 0.0_f64);
    let mut largest_value = 1.0_f32;
    let mut part = PartStatistics {
        mean_error: 0.0,
        rms_error: 0.0,
        psnr: 0.0,
        max_error: 0.0,
        at: (0, 0),
        channel: 0,
        warned: 0,
        failed: 0,
    };
    let exceeds = |f: f64, relative: f64, limit: f32, relative_limit: f32| {
        !within(f, limit.into()) && !within(relative, relative_limit.into())
    };
    for (count, (x, y)) in region.iter().enumerate() {
        if count > 0 && count % BATCH == 0 {
            total += std::mem::take(&mut batch);
            total_squares += std::mem::take(&mut batch_squares);
        }
        let (in_a, in_b) = (index(&a.window, x, y), index(&b.window, x, y));
        let (mut warned, mut failed) = (false, false);
        for channel in 0..channels {
            let (value_a, value_b) = (a.value(channel, in_a), b.value(channel, in_b));
            if !value_a.is_finite() || !value_b.is_finite() {
                if value_a.is_nan() == value_b.is_nan() && value_a.is_infinite() == value_b.is_infinite() {
                    continue;
                }
                if part.max_error.is_finite() {
                    (part.max_error, part.at, part.channel) = (f64::INFINITY, (x, y), channel);
                    continue;
                }
            }
            largest_value = max(largest_value, max(value_a.abs(), value_b.abs()));
            let f = f64::from((value_a - value_b).abs());
            let mean = (0.5 * f64::from(value_a.abs()) + 0.5 * f64::from(value_b.abs())) as f32;
            let relative = if mean > 0.0 { f / f64::from(mean) } else { 0.0 };
            batch += f;
            batch_squares += f * f;
            if !within(f, part.max_error) {
                (part.max_error, part.at, part.channel) = (f, (x, y), channel);
            }
            warned |= exceeds(f, relative, thresholds.warn, thresholds.warnrelative);
            failed |= exceeds(f, relative, thresholds.fail, thresholds.failrelative);
        }
        part.warned += u64::from(warned);
        part.failed += u64::from(failed);
    }
    let values = (region.pixels() * channels as u64) as f64;
    part.mean_error = (total + batch) / values;
    part.rms_error = ((total_squares + batch_squares) / values).sqrt();
    part.psnr = 20.0 * libm::log10(f64::from(largest_value) / part.rms_error);
    Ok(part)
}

/// The verdict on a pair of parts; percentages are of the first image's own pixels.
fn judge(part: &PartStatistics, pixels: usize, thresholds: &Thresholds) -> IdiffVerdict {
    let allowed = |percent: f32| f64::from(percent) / 100.0 * pixels.max(1) as f64;
    if part.failed <= u64::from(thresholds.allowfailures) {
        IdiffVerdict::Pass
    } else if part.failed as f64 > allowed(thresholds.failpercent)
        || part.max_error > f64::from(thresholds.hardfail)
    {
        IdiffVerdict::Failure
    } else if part.warned as f64 > allowed(thresholds.warnpercent)
        || part.max_error > f64::from(thresholds.hardwarn)
    {
        IdiffVerdict::Warning
    } else {
        IdiffVerdict::Pass
    }
}

/// The line above a part's statistics with `-a`.
fn head(out: &mut String, a: &View<'_>, number: usize, parts: usize) {
    if parts > 1 {
        let _ = write!(out, "Subimage {number} : ");
    }
    let _ = writeln!(out, "{} x {}, {} channels", a.window.width, a.window.height, a.channels.len());
}

/// A part's statistics.
fn describe(out: &mut String, part: &PartStatistics, a: &View<'_>, b: &View<'_>, thresholds: &Thresholds) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "  Mean error = {}", unsigned(part.mean_error));
    let _ = writeln!(out, "  RMS error = {}", unsigned(part.rms_error));
    let _ = writeln!(out, "  Peak SNR = {}", unsigned(part.psnr));
    let _ = write!(out, "  Max error  = {}", general(part.max_error, 6));
    if part.max_error != 0.0 {
        let (x, y) = part.at;
        let channel = a.channels.get(part.channel).or_else(|| b.channels.get(part.channel));
        let name = channel.map_or("", |c| c.name.as_str());
        let values = |view: &View<'_>| {
            let inside = index(&view.window, x, y);
            let values: Vec<_> = (0..view.channels.len()).map(|c| shortest(view.value(c, inside))).collect();
            values.join(", ")
        };
        let _ = write!(out, " @ ({x}, {y}, {name})  values are {} vs {}", values(a), values(b));
    }
    out.push('\n');
    let pixels = a.window.pixels().max(1) as f64;
    for (count, limit) in [(part.warned, thresholds.warn), (part.failed, thresholds.fail)] {
        let percent = general(100.0 * count as f64 / pixels, 3);
        let _ = writeln!(out, "  {count} pixels ({percent}%) over {}", general(limit.into(), 6));
    }
}

/// Not-a-number and infinity without a sign, as `safe_double_print` there.
fn unsigned(value: f64) -> String {
    if value.is_finite() { general(value, 6) } else { general(value.abs(), 6) }
}

#[cfg(test)]
mod tests;
