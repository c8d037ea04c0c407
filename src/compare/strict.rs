//! The comparison that everything but `diff --mode idiff` uses: nothing passes by accident.
//!
//! - A value that is not finite fails, in either image, even if both have it.
//! - Parts, data windows, the display window and channel names must be the same; channels match by name.
//! - Limits are independent: each one that is exceeded is a failure of its own.
//! - Channels form groups, each with its own limits: the *picture* (R, G, B, A and the like), each dotted prefix (`albedo`,
//!   `variance`) and each other channel (`Z`). Only the picture is limited unless a group is named; all are measured.
//!
//! The ladder's first two steps are here: equal pixels, then limits. A test that tells noise from change would judge a
//! [`Comparison`] further whose picture is beyond its limits.

use std::collections::BTreeMap;
use std::fmt;

use crate::raster::{Layer, Raster, Window};
use crate::record::Verdict;

use super::CompareError;

/// The group of the undotted colour channels.
pub const PICTURE: &str = "picture";

/// What a group of channels may differ by; "no more than" passes. Infinite limits judge nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// A pixel is over the limit if a channel differs by more.
    pub fail: f32,
    /// A channel that differs by no more than this fraction of the two magnitudes' mean is not over the limit.
    pub fail_relative: f32,
    /// As many percent of the pixels may be over the limit.
    pub fail_percent: f32,
    /// As many pixels may be over the limit, if that is more.
    pub allow_failures: u32,
    /// No value may differ by more.
    pub hard_fail: f32,
    /// The mean of all absolute differences.
    pub mean: f32,
    /// The root of the mean of their squares.
    pub rms: f32,
}

impl Default for Limits {
    /// No pixel may differ by more than 10⁻⁶, as `idiff`'s default.
    fn default() -> Self {
        Self {
            fail: 1e-6,
            fail_relative: 0.0,
            fail_percent: 0.0,
            allow_failures: 0,
            hard_fail: f32::INFINITY,
            mean: f32::INFINITY,
            rms: f32::INFINITY,
        }
    }
}

impl Limits {
    /// Checks that every limit is a number.
    fn check(&self) -> Result<(), CompareError> {
        let limits = [
            ("fail", self.fail),
            ("failrelative", self.fail_relative),
            ("failpercent", self.fail_percent),
            ("hardfail", self.hard_fail),
            ("mean", self.mean),
            ("rms", self.rms),
        ];
        match limits.into_iter().find(|(_, limit)| limit.is_nan()) {
            Some((name, _)) => Err(CompareError::Threshold { name }),
            None => Ok(()),
        }
    }
}

/// The limits of each group of channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrictLimits {
    /// Of the picture.
    pub picture: Limits,
    /// Of other groups, by name: `albedo`, `Z`. Groups that are not here are measured but not judged.
    pub layers: BTreeMap<String, Limits>,
}

impl StrictLimits {
    fn of(&self, group: &str) -> Option<Limits> {
        self.layers.get(group).copied().or_else(|| (group == PICTURE).then_some(self.picture))
    }
}

/// A place with what the two images have there.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Column.
    pub x: i32,
    /// Row.
    pub y: i32,
    /// Channel.
    pub channel: String,
    /// In the first image and in the second.
    pub values: [f32; 2],
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.values;
        write!(f, "({}, {}) {}: {a} against {b}", self.x, self.y, self.channel)
    }
}

/// What was measured on a group of channels. Values that are not finite are counted, and left out of the rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Pixels.
    pub pixels: u64,
    /// The largest absolute difference.
    pub max_error: f64,
    /// Where it is, unless it is 0.
    pub worst: Option<Place>,
    /// The mean absolute difference.
    pub mean_error: f64,
    /// The root of the mean squared difference.
    pub rms_error: f64,
    /// The mean difference, first image less second: what is left of noise is bias.
    pub bias: f64,
    /// Pixels over the limit of `fail`, or that differ at all where there are no limits.
    pub over: u64,
    /// Values that are not finite in either image.
    pub non_finite: u64,
    /// The first of them.
    pub first_non_finite: Option<Place>,
}

/// A limit that was exceeded.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// Values that are not finite.
    NonFinite {
        /// How many.
        count: u64,
        /// The first.
        first: Place,
    },
    /// More pixels over `fail` than allowed.
    Pixels {
        /// How many.
        over: u64,
        /// Of how many.
        of: u64,
        /// The limit.
        fail: f32,
        /// How many may be.
        allowed: u64,
        /// The largest difference.
        worst: Option<Place>,
    },
    /// A value beyond `hardfail`.
    Hard {
        /// Where.
        worst: Option<Place>,
        /// The difference.
        error: f64,
        /// The limit.
        limit: f32,
    },
    /// The mean beyond its limit.
    Mean {
        /// The mean difference.
        error: f64,
        /// The limit.
        limit: f32,
    },
    /// The RMS beyond its limit.
    Rms {
        /// The RMS difference.
        error: f64,
        /// The limit.
        limit: f32,
    },
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |worst: &Option<Place>| worst.as_ref().map_or(String::new(), |place| format!(" at {place}"));
        match self {
            Self::NonFinite { count, first } => {
                write!(f, "{count} values are not finite, the first at {first}")
            }
            Self::Pixels { over, of, fail, allowed, worst } => {
                write!(
                    f,
                    "{over} of {of} pixels differ by more than {fail}, {allowed} may; the most{}",
                    at(worst)
                )
            }
            Self::Hard { worst, error, limit } => {
                write!(
                    f,
                    "the largest difference, {error:.3e}{}, is beyond the hard limit of {limit}",
                    at(worst)
                )
            }
            Self::Mean { error, limit } => write!(f, "the mean difference, {error:.3e}, is beyond {limit}"),
            Self::Rms { error, limit } => write!(f, "the RMS difference, {error:.3e}, is beyond {limit}"),
        }
    }
}

/// One group of channels, compared.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupComparison {
    /// The part of the file.
    pub part: String,
    /// The group: [`PICTURE`], a dotted prefix, or a channel's name.
    pub group: String,
    /// Its limits, if it is judged.
    pub limits: Option<Limits>,
    /// What was measured.
    pub statistics: Statistics,
    /// What was exceeded.
    pub failures: Vec<Failure>,
}

/// Two images, compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// How the shapes differ, in words; nothing was measured if this is not empty.
    pub shape: Vec<String>,
    /// Whether all values of all parts are equal and finite.
    pub equal: bool,
    /// Every group of channels, in the file's order.
    pub groups: Vec<GroupComparison>,
}

impl Comparison {
    /// The verdict, as records keep it. Its numbers are those of the picture, or of the first group that fails.
    pub fn verdict(&self) -> Verdict {
        if !self.shape.is_empty() {
            return Verdict::Shape { why: self.shape.join("; ") };
        }
        if let Some(failed) = self.groups.iter().find(|g| !g.failures.is_empty()) {
            let Statistics { max_error, mean_error, .. } = failed.statistics;
            return Verdict::Differs { max_error, mean_error, why: self.reasons() };
        }
        if self.equal {
            return Verdict::Same;
        }
        let main = self.groups.iter().find(|g| g.group == PICTURE).or_else(|| self.groups.first());
        let (max_error, mean_error) =
            main.map_or((0.0, 0.0), |g| (g.statistics.max_error, g.statistics.mean_error));
        Verdict::Within { max_error, mean_error }
    }

    /// Every failure, in words.
    fn reasons(&self) -> String {
        let reasons: Vec<String> = self
            .groups
            .iter()
            .flat_map(|g| g.failures.iter().map(move |failure| format!("{}: {failure}", g.group)))
            .collect();
        reasons.join("; ")
    }
}

/// Compares `a` (the result) with `b` (the reference).
///
/// # Errors
/// If an image has no layers, a channel does not fill its window, or a limit is NaN.
pub fn compare(a: &Raster, b: &Raster, limits: &StrictLimits) -> Result<Comparison, CompareError> {
    limits.picture.check()?;
    limits.layers.values().try_for_each(Limits::check)?;
    for (raster, name) in [(a, "the first image"), (b, "the second image")] {
        check(raster, name)?;
    }
    let shape = shape(a, b);
    let mut comparison = Comparison { equal: shape.is_empty(), shape, groups: Vec::new() };
    if !comparison.shape.is_empty() {
        return Ok(comparison);
    }
    for (a, b) in a.layers.iter().zip(&b.layers) {
        for (group, channels) in groups(a) {
            let limits = limits.of(&group);
            let statistics = measure(a, b, &channels, limits.as_ref());
            comparison.equal &= statistics.max_error == 0.0 && statistics.non_finite == 0;
            let failures = judge(&statistics, limits.as_ref());
            comparison.groups.push(GroupComparison {
                part: a.name.clone(),
                group,
                limits,
                statistics,
                failures,
            });
        }
    }
    Ok(comparison)
}

fn check(raster: &Raster, name: &str) -> Result<(), CompareError> {
    if raster.layers.is_empty() {
        return Err(CompareError::NoLayers { name: name.into() });
    }
    for layer in &raster.layers {
        let expected = layer.window.pixels();
        if let Some(channel) = layer.channels.iter().find(|c| c.values.len() != expected) {
            let has = channel.values.len();
            return Err(CompareError::Channel { channel: channel.name.clone(), has, expected });
        }
    }
    Ok(())
}

/// How the shapes differ, in words.
fn shape(a: &Raster, b: &Raster) -> Vec<String> {
    let mut found = Vec::new();
    let mut windows = |what: String, a: Window, b: Window| {
        if a != b {
            found.push(format!("{what} is {a} in the first, {b} in the second"));
        }
    };
    windows("the display window".into(), a.display, b.display);
    for (number, (a, b)) in a.layers.iter().zip(&b.layers).enumerate() {
        windows(format!("the data window of part {number} {:?}", a.name), a.window, b.window);
    }
    if a.layers.len() != b.layers.len() {
        found.push(format!(
            "there are {} parts in the first, {} in the second",
            a.layers.len(),
            b.layers.len()
        ));
    }
    for (number, (a, b)) in a.layers.iter().zip(&b.layers).enumerate() {
        if a.name != b.name {
            found.push(format!("part {number} is {:?} in the first, {:?} in the second", a.name, b.name));
        }
        let (names_a, names_b) = (sorted_names(a), sorted_names(b));
        if names_a != names_b {
            let (a, b) = (names_a.join(" "), names_b.join(" "));
            found.push(format!("part {number} has the channels {a} in the first, {b} in the second"));
        }
    }
    found
}

fn sorted_names(layer: &Layer) -> Vec<&str> {
    let mut names: Vec<&str> = layer.channels.iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    names
}

/// The groups of a layer's channels: names with the channels' indices, in the order of their first channel.
fn groups(layer: &Layer) -> Vec<(String, Vec<usize>)> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, channel) in layer.channels.iter().enumerate() {
        let name = match channel.name.rsplit_once('.') {
            Some((prefix, _)) => prefix,
            None if matches!(channel.name.as_str(), "R" | "G" | "B" | "A" | "Y") => PICTURE,
            None => &channel.name,
        };
        match groups.iter_mut().find(|(group, _)| group == name) {
            Some((_, indices)) => indices.push(index),
            None => groups.push((name.into(), vec![index])),
        }
    }
    groups
}

/// Measures some channels over two layers of the same shape.
fn measure(a: &Layer, b: &Layer, channels: &[usize], limits: Option<&Limits>) -> Statistics {
    let pairs: Vec<(&str, &[f32], &[f32])> = channels
        .iter()
        .filter_map(|&i| {
            let channel = &a.channels[i];
            let other = b.channel(&channel.name)?;
            Some((channel.name.as_str(), channel.values.as_slice(), other.values.as_slice()))
        })
        .collect();
    let (fail, relative) = limits.map_or((0.0, 0.0), |l| (l.fail, l.fail_relative));
    let mut statistics = Statistics { pixels: a.window.pixels() as u64, ..Statistics::default() };
    let (mut sum, mut squares, mut signed, mut count) = (0.0_f64, 0.0_f64, 0.0_f64, 0_u64);
    for index in 0..a.window.pixels() {
        let mut over = false;
        for &(name, values_a, values_b) in &pairs {
            let values = [values_a[index], values_b[index]];
            let place = || place(&a.window, index, name, values);
            if !values.iter().all(|v| v.is_finite()) {
                statistics.non_finite += 1;
                statistics.first_non_finite.get_or_insert_with(place);
                continue;
            }
            let [va, vb] = values.map(f64::from);
            let error = (va - vb).abs();
            over |= error > f64::from(fail) && error > f64::from(relative) * 0.5 * (va.abs() + vb.abs());
            if error > statistics.max_error {
                statistics.max_error = error;
                statistics.worst = Some(place());
            }
            sum += error;
            squares += error * error;
            signed += va - vb;
            count += 1;
        }
        statistics.over += u64::from(over);
    }
    let count = count.max(1) as f64;
    statistics.mean_error = sum / count;
    statistics.rms_error = (squares / count).sqrt();
    statistics.bias = signed / count;
    statistics
}

fn place(window: &Window, index: usize, channel: &str, values: [f32; 2]) -> Place {
    let (row, column) = (index / window.width as usize, index % window.width as usize);
    let at = |start: i32, offset: usize| (i64::from(start) + offset as i64) as i32;
    Place { x: at(window.x, column), y: at(window.y, row), channel: channel.into(), values }
}

/// What is exceeded.
fn judge(statistics: &Statistics, limits: Option<&Limits>) -> Vec<Failure> {
    let mut failures = Vec::new();
    if let Some(first) = &statistics.first_non_finite {
        failures.push(Failure::NonFinite { count: statistics.non_finite, first: first.clone() });
    }
    let Some(limits) = limits else { return failures };
    let percent = f64::from(limits.fail_percent) / 100.0 * statistics.pixels as f64;
    let allowed = u64::from(limits.allow_failures).max(percent.max(0.0) as u64);
    if statistics.over > allowed {
        failures.push(Failure::Pixels {
            over: statistics.over,
            of: statistics.pixels,
            fail: limits.fail,
            allowed,
            worst: statistics.worst.clone(),
        });
    }
    if statistics.max_error > f64::from(limits.hard_fail) {
        failures.push(Failure::Hard {
            worst: statistics.worst.clone(),
            error: statistics.max_error,
            limit: limits.hard_fail,
        });
    }
    if statistics.mean_error > f64::from(limits.mean) {
        failures.push(Failure::Mean { error: statistics.mean_error, limit: limits.mean });
    }
    if statistics.rms_error > f64::from(limits.rms) {
        failures.push(Failure::Rms { error: statistics.rms_error, limit: limits.rms });
    }
    failures
}

#[cfg(test)]
mod tests;
