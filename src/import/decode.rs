//! Encoded images into [`Image`]s, with bounded memory.

use std::io::Cursor;

use crate::scene::Image;
use crate::scene::texture::Pixels;

/// The most pixels an image may have.
const MAX_PIXELS: u64 = 1 << 28;
/// The longest side an image may have.
const MAX_SIDE: u32 = 1 << 16;

/// Why an image cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// It is damaged, or of a format that is not read.
    #[error("cannot decode {name}: {cause}")]
    Decode {
        /// The image.
        name: String,
        /// The decoder's reason.
        cause: image::ImageError,
    },
    /// It is a damaged EXR file, or has no colour channels.
    #[error("cannot decode {name}: {cause}")]
    Exr {
        /// The image.
        name: String,
        /// The decoder's reason.
        cause: exr::error::Error,
    },
    /// It is empty or too large.
    #[error(
        "{name} is {width} × {height} pixels; at least 1 and at most {MAX_SIDE} a side and {MAX_PIXELS} in all are read"
    )]
    Size {
        /// The image.
        name: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// Some value is infinite or NaN.
    #[error("{name} holds values that are not finite, the first at pixel ({x}, {y})")]
    NotFinite {
        /// The image.
        name: String,
        /// The pixel's column.
        x: u64,
        /// Its row.
        y: u64,
    },
}

/// The image `name`, encoded as PNG, JPEG, HDR or EXR.
///
/// # Errors
/// If it is damaged, of another format, too large, or holds values that are not finite.
pub(super) fn decode_image(bytes: &[u8], name: &str) -> Result<Image, ImageError> {
    let image = if bytes.starts_with(&exr::meta::magic_number::BYTES) {
        exr(bytes, name)?
    } else {
        other(bytes, name)?
    };
    if let Pixels::F32(values) = &image.pixels
        && let Some(at) = values.iter().position(|v| !v.is_finite())
    {
        let pixel = (at / usize::from(image.channels)) as u64;
        let (x, y) = (pixel % u64::from(image.width), pixel / u64::from(image.width));
        return Err(ImageError::NotFinite { name: name.to_owned(), x, y });
    }
    Ok(image)
}

fn check_size(name: &str, width: u64, height: u64) -> Result<(), ImageError> {
    let side = 1..=u64::from(MAX_SIDE);
    if side.contains(&width) && side.contains(&height) && width * height <= MAX_PIXELS {
        Ok(())
    } else {
        Err(ImageError::Size { name: name.to_owned(), width, height })
    }
}

fn other(bytes: &[u8], name: &str) -> Result<Image, ImageError> {
    use image::DynamicImage;
    let failed = |cause| ImageError::Decode { name: name.to_owned(), cause };
    let open = || {
        let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format();
        reader.map_err(|cause| failed(image::ImageError::IoError(cause)))
    };
    let (width, height) = open()?.into_dimensions().map_err(failed)?;
    check_size(name, width.into(), height.into())?;
    let mut reader = open()?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 16);
    reader.limits(limits);
    let (channels, pixels) = match reader.decode().map_err(failed)? {
        DynamicImage::ImageLuma8(i) => (1, Pixels::U8(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, Pixels::U8(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, Pixels::U8(i.into_raw())),
        DynamicImage::ImageRgba8(i) => (4, Pixels::U8(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, Pixels::U16(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, Pixels::U16(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, Pixels::U16(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, Pixels::U16(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, Pixels::F32(i.into_raw())),
        float => (4, Pixels::F32(float.into_rgba32f().into_raw())),
    };
    Ok(Image { name: name.to_owned(), width, height, channels, pixels })
}

fn exr(bytes: &[u8], name: &str) -> Result<Image, ImageError> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let failed = |cause| ImageError::Exr { name: name.to_owned(), cause };
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    for header in &meta.headers {
        check_size(name, header.layer_size.0 as u64, header.layer_size.1 as u64)?;
    }
    let read = exr::prelude::read().no_deep_data().largest_resolution_level();
    let read = read.rgb_channels(
        |size, _| (size.0, vec![0.0_f32; size.0 * size.1 * 3]),
        |(width, values): &mut (usize, Vec<f32>), at, (r, g, b): (f32, f32, f32)| {
            let at = (at.1 * *width + at.0) * 3;
            values[at..at + 3].copy_from_slice(&[r, g, b]);
        },
    );
    let image = read
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(failed)?;
    let size = image.layer_data.size;
    let (_, values) = image.layer_data.channel_data.pixels;
    // The sizes were checked above.
    let (width, height) = (size.0 as u32, size.1 as u32);
    Ok(Image { name: name.to_owned(), width, height, channels: 3, pixels: Pixels::F32(values) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(format: image::ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let pixels = image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([x as u8 * 100, y as u8 * 200, 7]));
        image::DynamicImage::ImageRgb8(pixels).write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn png_stays_eight_bits_wide() {
        let image = decode_image(&encoded(image::ImageFormat::Png), "a.png").unwrap();
        assert_eq!((image.width, image.height, image.channels), (3, 2, 3));
        let Pixels::U8(values) = image.pixels else { panic!("{:?}", image.pixels) };
        assert_eq!(values[..6], [0, 0, 7, 100, 0, 7]);
    }

    #[test]
    fn exr_is_read_as_floats_and_nan_is_refused() {
        let write = |value: f32| {
            let mut bytes = Cursor::new(Vec::new());
            let channels = exr::prelude::SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| {
                (at.0 as f32, value, 0.5_f32)
            });
            let image = exr::prelude::Image::from_channels((4, 2), channels);
            exr::prelude::WritableImage::write(&image).to_buffered(&mut bytes).unwrap();
            bytes.into_inner()
        };
        let image = decode_image(&write(9.0), "a.exr").unwrap();
        let Pixels::F32(values) = &image.pixels else { panic!("{:?}", image.pixels) };
        assert_eq!((image.width, image.height, &values[3..6]), (4, 2, &[1.0, 9.0, 0.5][..]));
        assert!(matches!(
            decode_image(&write(f32::NAN), "a.exr"),
            Err(ImageError::NotFinite { x: 0, y: 0, .. })
        ));
    }

    #[test]
    fn damaged_images_are_errors() {
        let png = encoded(image::ImageFormat::Png);
        for bytes in [&b""[..], b"not an image", &png[..40], &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]] {
            assert!(decode_image(bytes, "bad").is_err());
        }
    }
}
