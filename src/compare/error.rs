//! Why a comparison could not be made, or cannot be trusted.

use std::path::PathBuf;
use std::time::Duration;

use crate::imagefile::{ImageFileError, MAX_VALUES};

use super::idiff::IdiffVerdict;

/// Why a comparison could not be made, or cannot be trusted.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// An image could not be read.
    #[error(transparent)]
    Image(#[from] ImageFileError),
    /// An image has no layers.
    #[error("{name} has no layers; an image to compare needs at least one")]
    NoLayers {
        /// The image.
        name: String,
    },
    /// A channel does not fill its window.
    #[error("channel {channel:?} has {has} values; its window has {expected} pixels")]
    Channel {
        /// The channel.
        channel: String,
        /// Its number of values.
        has: usize,
        /// The window's number of pixels.
        expected: usize,
    },
    /// The data windows lie so far apart that the region that holds both is too large.
    #[error(
        "the data windows together span {width} × {height} pixels with {channels} channels: more than {MAX_VALUES} values"
    )]
    RegionTooLarge {
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
        /// Channels.
        channels: usize,
    },
    /// Channels `Y`, `BY` and `RY` are luminance and chroma, which `idiff` converts to RGB.
    #[error(
        "an image of luminance and chroma (Y, BY, RY) cannot be compared as idiff does; convert it to RGB first"
    )]
    LuminanceChroma,
    /// A threshold is not a number.
    #[error("the threshold {name} is not a number")]
    Threshold {
        /// The threshold.
        name: &'static str,
    },
    /// The `idiff` that was asked for isn't there.
    #[error("there is no idiff at {}", path.display())]
    IdiffMissing {
        /// Where it should be.
        path: PathBuf,
    },
    /// The real `idiff` could not be run.
    #[error("cannot run {}: {cause}", path.display())]
    IdiffRun {
        /// The program.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The real `idiff` took too long and was stopped.
    #[error("{} did not finish within {} s and was stopped", path.display(), limit.as_secs_f32())]
    IdiffTimeout {
        /// The program.
        path: PathBuf,
        /// How long it had.
        limit: Duration,
    },
    /// The real `idiff` did not compare: it ended with another code than 0, 1 or 2, or its last line does not fit its code.
    #[error("idiff gave no verdict (exit code {code:?}): {said}")]
    IdiffFailed {
        /// Its exit code, if it ended by itself.
        code: Option<i32>,
        /// What it said.
        said: String,
    },
    /// The built-in comparator and the real `idiff` came to different verdicts.
    #[error(
        "the comparators disagree about {} and {}: built in {builtin}, idiff {external}",
        a.display(),
        b.display()
    )]
    Disagree {
        /// The first image.
        a: PathBuf,
        /// The second image.
        b: PathBuf,
        /// Our verdict.
        builtin: IdiffVerdict,
        /// The real `idiff`'s.
        external: IdiffVerdict,
    },
}
