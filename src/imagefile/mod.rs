//! Image files: a [`Raster`] from and to EXR, PNG, JPEG, WebP, KTX2 and Radiance HDR, with bounded memory.
//!
//! A file is known by its first bytes, never by its extension. Whatever a file declares is checked against [`MAX_VALUES`]
//! before memory is asked for, and whatever we write appears whole or not at all ([`write_whole`]).
//!
//! - `error`: what can go wrong
//! - `exr_header`: walking an EXR header: what it declares, and putting its attributes in order
//! - `exr_read`, `exr_write`: the pixels of an EXR
//! - `ktx2`: Basis Universal in KTX2
//! - `picture`: PNG, JPEG, WebP and HDR
//! - `texture`: any of them as a texture's interleaved pixels
//! - `whole`: files that appear whole

mod error;
mod exr_header;
mod exr_read;
mod exr_write;
mod ktx2;
mod picture;
mod texture;
mod whole;

use std::fs::File;
use std::io::Read;
use std::path::Path;

pub use error::ImageFileError;
pub use exr_write::{EncodedExr, encode_exr, write_exr};
pub use picture::{encode_png, write_png};
pub use texture::{Decoded, Interleaved, Samples, decode_texture, encode_texture};
pub use whole::{remove_leftovers, write_whole};

use crate::raster::Raster;

/// The most values (pixels times channels, over all parts) that a file may declare: 2^28, a gibibyte of floats.
pub const MAX_VALUES: u64 = 1 << 28;

/// The bytes of pixels that any file may declare, however small it is.
const FREE_BYTES: u64 = 64 << 20;

/// The bytes of pixels that a file may declare for each of its own beyond that. Deflate, which PNG and EXR pack with, comes to at most
/// 1032 (zlib's technical details); WebP alone could come to more, for large pictures of a single colour.
const BYTES_PER_BYTE: u64 = 1100;

/// The largest file that is read, in bytes: what [`MAX_VALUES`] take uncompressed, and as much again.
pub const MAX_FILE: u64 = 1 << 31;

/// The kinds of file that are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
    Jpeg,
    Hdr,
    WebP,
    Ktx2,
}

impl Format {
    /// The format that the first bytes announce.
    fn of(bytes: &[u8], name: &str) -> Result<Self, ImageFileError> {
        if let [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] = bytes {
            return Ok(Self::WebP);
        }
        let known: [(&[u8], Self); 6] = [
            (&[0x76, 0x2f, 0x31, 0x01], Self::Exr),
            (&[0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a], Self::Png),
            (&[0xff, 0xd8, 0xff], Self::Jpeg),
            (b"#?RADIANCE", Self::Hdr),
            (b"#?RGBE", Self::Hdr),
            (ktx2::MAGIC, Self::Ktx2),
        ];
        known
            .iter()
            .find(|(magic, _)| bytes.starts_with(magic))
            .map(|&(_, format)| format)
            .ok_or_else(|| ImageFileError::UnknownFormat { name: name.into(), what: recognised(bytes) })
    }
}

/// Formats that are known but not read, for a clearer message.
fn recognised(bytes: &[u8]) -> &'static str {
    match bytes {
        [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => "a TIFF image",
        [b'D', b'D', b'S', b' ', ..] => "a DDS image",
        [b'G', b'I', b'F', b'8', ..] => "a GIF image",
        [b'B', b'M', ..] => "a BMP image",
        _ => "of an unknown format",
    }
}

/// Reads an image file: every part and channel of an EXR at full resolution, or the single layer of a PNG, JPEG, WebP, KTX2 or HDR.
///
/// Integer samples become [0, 1]. Alpha is associated (premultiplied), as in EXR and as OpenImageIO reads PNG. Non-finite
/// values are kept.
///
/// # Errors
/// If the file cannot be read, is none of these formats, is damaged, declares more than [`MAX_VALUES`], or holds what a
/// raster cannot: deep data or subsampled channels.
pub fn read(path: &Path) -> Result<Raster, ImageFileError> {
    decode(&read_bounded(path)?, &path.display().to_string())
}

/// Reads an image from memory; `name` is for messages. As [`read`].
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], name: &str) -> Result<Raster, ImageFileError> {
    match Format::of(bytes, name)? {
        Format::Exr => exr_read::decode(bytes, name),
        format => picture::decode(bytes, format, name),
    }
}

/// Whether a file of `size` bytes can hold `declared` bytes of pixels.
///
/// # Errors
/// If so few can't, so that nobody needs to find memory for what never comes.
fn check_declared(declared: u64, size: usize, name: &str) -> Result<(), ImageFileError> {
    if declared > FREE_BYTES.saturating_add(BYTES_PER_BYTE.saturating_mul(size as u64)) {
        return Err(ImageFileError::TooSmall { name: name.into(), declared, size });
    }
    Ok(())
}

/// The bytes of a file of at most [`MAX_FILE`].
fn read_bounded(path: &Path) -> Result<Vec<u8>, ImageFileError> {
    let fail = |cause| ImageFileError::Read { path: path.into(), cause };
    // A device never ends.
    if !path.metadata().map_err(fail)?.is_file() {
        return Err(ImageFileError::NotAFile { path: path.into() });
    }
    let file = File::open(path).map_err(fail)?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE + 1).read_to_end(&mut bytes).map_err(fail)?;
    if bytes.len() as u64 > MAX_FILE {
        return Err(ImageFileError::FileTooLarge { path: path.into() });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_known_by_its_first_bytes() {
        assert_eq!(Format::of(b"#?RGBE\n", "x").unwrap(), Format::Hdr);
        assert!(
            matches!(decode(b"", "empty"), Err(ImageFileError::UnknownFormat { name, .. }) if name == "empty")
        );
        assert!(matches!(decode(b"GIF89a....", "x"), Err(ImageFileError::UnknownFormat { .. })));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("no/such/picture.exr")).unwrap_err();
        assert!(error.to_string().contains("no/such/picture.exr"), "{error}");
    }
}
