//! What can go wrong with an image file.

use std::path::PathBuf;

use super::{MAX_FILE, MAX_VALUES};

/// Why an image could not be read or written. `name` is the file, or the image's name inside another file.
#[derive(Debug, thiserror::Error)]
pub enum ImageFileError {
    /// The file isn't there or can't be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The file is larger than any that is read.
    #[error("{} is too large: at most {MAX_FILE} bytes are read", path.display())]
    FileTooLarge {
        /// The file.
        path: PathBuf,
    },
    /// The file could not be written; nothing is left of the attempt.
    #[error("cannot write {}: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// Its first bytes are none that are known.
    #[error(
        "{name} is not an image that can be read: it is {what}; OpenEXR, PNG, JPEG and Radiance HDR are read"
    )]
    UnknownFormat {
        /// The image.
        name: String,
        /// What it seems to be.
        what: &'static str,
    },
    /// It declares more than fits the limit.
    #[error(
        "{name} declares {width} × {height} pixels with {channels} channels: more than the limit of {MAX_VALUES} values"
    )]
    TooLarge {
        /// The image.
        name: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
        /// Channels, over all parts.
        channels: u64,
    },
    /// It is damaged: truncated, contradictory or not what it says.
    #[error("{name} is damaged: {why}")]
    Damaged {
        /// The image.
        name: String,
        /// What is wrong.
        why: String,
    },
    /// It holds something valid that cannot be read here.
    #[error("{name} has {what}, which cannot be read{hint}")]
    Unsupported {
        /// The image.
        name: String,
        /// What it has.
        what: String,
        /// What to do, starting with `; `, or empty.
        hint: &'static str,
    },
    /// The raster cannot be written as asked.
    #[error("cannot encode {element}: {why}")]
    Encode {
        /// The layer, channel or attribute.
        element: String,
        /// What is wrong and what was expected.
        why: String,
    },
}
