//! Comparing images.
//!
//! Two modes on the same pixels:
//!
//! - [`idiff`]: OpenImageIO's `idiff` 3.2 to the letter, text and exit code alike, holes included;
//! - [`strict`]: what everything else uses: non-finite values and shapes that differ always fail, limits are independent of each
//!   other, and each layer has its own.
//!
//! [`external`] runs the real `idiff` beside ours; a disagreement is an error. [`difference`] makes a picture of what differs.
//! `view` puts the channels in the order in which OpenImageIO counts them.

pub mod difference;
mod error;
pub mod external;
pub mod idiff;
mod idiff_text;
pub mod strict;
mod view;

pub use difference::diff_image;
pub use error::CompareError;
pub use external::{cross_check, find_idiff};
pub use idiff::{IdiffReport, IdiffVerdict, Options, Parts, Thresholds, Verbosity};
pub use strict::{Comparison, Limits, StrictLimits};
