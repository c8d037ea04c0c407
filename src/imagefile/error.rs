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
    /// It is a folder, a device or a pipe.
    #[error("{} is not a file with content of its own", path.display())]
    NotAFile {
        /// What it is the path of.
        path: PathBuf,
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
        "{name} is not an image that can be read: it is {what}; OpenEXR, PNG, JPEG, WebP, KTX2 and Radiance HDR are read"
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
    /// It declares more than so few bytes can hold.
    #[error("{name} is damaged: it declares {declared} bytes of pixels, more than its {size} bytes can hold")]
    TooSmall {
        /// The image.
        name: String,
        /// The bytes that its pixels would take.
        declared: u64,
        /// Its size in bytes.
        size: usize,
    },
    /// It takes too much together with the other images of its scene.
    #[error(
        "with {name} the scene's images take more than {limit} bytes, which is more than files of their size hold"
    )]
    TooMuchTogether {
        /// The image.
        name: String,
        /// What they may take.
        limit: u64,
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
