//! Image files as scenes use them: textures and environments.

use std::path::Path;

use super::{FileDigest, FileError, Files, Reach};
use crate::imagefile::{self, Decoded, ImageFileError, Samples};
use crate::record::Warning;
use crate::scene::Image;
use crate::scene::texture::Pixels;

/// Why an image that a job names can't be used.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// It has no file name.
    #[error("{path:?} is not the name of an image file")]
    Name {
        /// What it is.
        path: String,
    },
    /// It can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It can't be decoded.
    #[error(transparent)]
    Image(#[from] ImageFileError),
}

/// The most that all images of a scene may take together, decoded, in bytes.
const MAX_DECODED: u64 = 8 << 30;

/// What they may take however small their files are, and what for each byte of those: as much as a single image may.
const FREE_DECODED: u64 = 128 << 20;
const DECODED_PER_BYTE: u64 = 1100;

/// Decodes the images of a scene and counts what they take: many small files may come to more than there is memory.
#[derive(Debug, Default)]
pub struct Images {
    stored: u64,
    decoded: u64,
}

impl Images {
    /// The image in `bytes`, called `name` in messages, and a warning if values had to be replaced. 8 and 16 bits stay as they are.
    ///
    /// # Errors
    /// For formats that are not read, damaged files and images that are too large, before anything is allocated for them; and
    /// if the scene's images take too much together.
    pub(super) fn decode(
        &mut self,
        bytes: &[u8],
        name: &str,
    ) -> Result<(Image, Option<Warning>), ImageFileError> {
        self.stored = self.stored.saturating_add(bytes.len() as u64);
        let decoded = decode_image(bytes, name)?;
        self.count(decoded.0.bytes(), name)?;
        Ok(decoded)
    }

    /// Counts `bytes` of the image called `name`.
    ///
    /// # Errors
    /// If it is too much together with the others.
    pub(super) fn count(&mut self, bytes: u64, name: &str) -> Result<(), ImageFileError> {
        self.decoded = self.decoded.saturating_add(bytes);
        let limit =
            FREE_DECODED.saturating_add(DECODED_PER_BYTE.saturating_mul(self.stored)).min(MAX_DECODED);
        match self.decoded <= limit {
            true => Ok(()),
            false => Err(ImageFileError::TooMuchTogether { name: name.into(), limit }),
        }
    }
}

fn decode_image(bytes: &[u8], name: &str) -> Result<(Image, Option<Warning>), ImageFileError> {
    let Decoded { width, height, channels, samples, replaced } = imagefile::decode_texture(bytes, name)?;
    let pixels = match samples {
        Samples::U8(values) => Pixels::U8(values),
        Samples::U16(values) => Pixels::U16(values),
        Samples::F32(values) => Pixels::F32(values),
    };
    let warning = (replaced > 0)
        .then(|| Warning::new(name, format!("{replaced} values were negative or not finite and are 0 now")));
    Ok((Image { name: name.to_owned(), width, height, channels, pixels }, warning))
}

/// The image in the file that a scene or a library calls `name`, one of its `images`, and a warning if values had to be replaced.
///
/// # Errors
/// If it can't be read or decoded.
pub fn read_image(
    files: &mut Files,
    images: &mut Images,
    name: &str,
) -> Result<(Image, Option<Warning>), EnvironmentError> {
    let bytes = files.read(name)?;
    Ok(images.decode(&bytes, name)?)
}

/// The environment image that a job names by its path, with its digest for the job's identity. A link must lead no farther than
/// `reach`.
///
/// # Errors
/// If it can't be read or decoded.
pub fn read_environment(
    path: &Path,
    reach: Reach,
) -> Result<(Image, FileDigest, Option<Warning>), EnvironmentError> {
    let wrong = || EnvironmentError::Name { path: path.display().to_string() };
    let name = path.file_name().and_then(|n| n.to_str()).ok_or_else(wrong)?;
    let mut files = Files::new(path.parent().unwrap_or(Path::new("")), reach)?;
    let (image, warning) = read_image(&mut files, &mut Images::default(), name)?;
    let digest = files.into_digests().pop().ok_or_else(wrong)?;
    Ok((image, digest, warning))
}
