//! Bytes of an image file into a [`scene::Image`](crate::scene::Image).

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

use crate::scene::Image;
use crate::scene::texture::Pixels;

/// The largest width and height, in pixels.
const MAX_SIDE: u32 = 16384;
/// The most memory that decoding one image may take, in bytes: 16384² pixels of four 16-bit channels.
const MAX_BYTES: u64 = 16384 * 16384 * 8;

/// Why an image can't be used.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// It is of a kind that is not read.
    #[error("{name} is {kind}; PNG, JPEG and HDR images are read")]
    Kind {
        /// The image.
        name: String,
        /// What it seems to be.
        kind: String,
    },
    /// It is damaged, truncated or larger than any image should be.
    #[error(
        "{name} cannot be decoded: {cause} (at most {MAX_SIDE} x {MAX_SIDE} pixels and {MAX_BYTES} bytes are read)"
    )]
    Decode {
        /// The image.
        name: String,
        /// The decoder's reason.
        cause: image::ImageError,
    },
    /// A float in it is NaN or infinite.
    #[error("{name}: the value at pixel ({x}, {y}) is {value}; all must be finite")]
    NotFinite {
        /// The image.
        name: String,
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// The value.
        value: f32,
    },
}

/// The image in `bytes`, a PNG, JPEG or HDR file, called `name` in messages. Its 8 and 16 bits stay as they are.
///
/// # Errors
/// For other formats, damaged files, images of more than 16384 pixels a side (before anything is allocated for them) and floats
/// that are not finite.
pub(super) fn decode_image(bytes: &[u8], name: &str) -> Result<Image, ImageError> {
    let kind = |kind: String| ImageError::Kind { name: name.to_owned(), kind };
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Hdr)) => format,
        Ok(other) => return Err(kind(format!("a {other:?} image"))),
        Err(_) if bytes.starts_with(b"\xabKTX 20\xbb\r\n\x1a\n") => {
            return Err(kind("a KTX2 image (KHR_texture_basisu)".into()));
        }
        Err(_) => return Err(kind("of an unknown format".into())),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|cause| ImageError::Decode { name: name.to_owned(), cause })?;

    let (width, height) = (decoded.width(), decoded.height());
    let (channels, pixels) = match decoded {
        DynamicImage::ImageLuma8(i) => (1, Pixels::U8(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, Pixels::U8(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, Pixels::U8(i.into_raw())),
        DynamicImage::ImageRgba8(i) => (4, Pixels::U8(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, Pixels::U16(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, Pixels::U16(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, Pixels::U16(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, Pixels::U16(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, Pixels::F32(i.into_raw())),
        DynamicImage::ImageRgba32F(i) => (4, Pixels::F32(i.into_raw())),
        other => return Err(kind(format!("of the pixel type {:?}", other.color()))),
    };
    if let Pixels::F32(values) = &pixels
        && let Some(at) = values.iter().position(|v| !v.is_finite())
    {
        let pixel = (at / usize::from(channels)) as u32;
        let (x, y) = (pixel % width, pixel / width);
        return Err(ImageError::NotFinite { name: name.to_owned(), x, y, value: values[at] });
    }
    Ok(Image { name: name.to_owned(), width, height, channels, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(image: &DynamicImage) -> Vec<u8> {
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    }

    #[test]
    fn depth_and_channels_are_kept() {
        let eight = image::GrayAlphaImage::from_raw(1, 2, vec![1, 2, 3, 4]).unwrap();
        let read = decode_image(&png(&eight.into()), "a").unwrap();
        assert_eq!((read.width, read.height, read.channels), (1, 2, 2));
        assert_eq!(read.pixels, Pixels::U8(vec![1, 2, 3, 4]));
        let sixteen =
            DynamicImage::ImageRgb16(image::ImageBuffer::from_raw(1, 1, vec![1u16, 40000, 65535]).unwrap());
        assert_eq!(decode_image(&png(&sixteen), "b").unwrap().pixels, Pixels::U16(vec![1, 40000, 65535]));
    }

    #[test]
    fn a_huge_declared_size_fails_before_it_is_allocated() {
        let mut bytes = png(&image::GrayImage::new(1, 1).into());
        bytes[16..20].copy_from_slice(&100_000u32.to_be_bytes());
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = decode_image(&bytes, "bomb.png").unwrap_err();
        assert!(matches!(&error, ImageError::Decode { cause: image::ImageError::Limits(_), .. }), "{error}");
    }

    #[test]
    fn damaged_and_foreign_files_are_told_apart() {
        let whole = png(&image::RgbImage::from_fn(9, 9, |x, y| image::Rgb([x as u8, y as u8, 3])).into());
        assert!(matches!(
            decode_image(&whole[..whole.len() / 2], "half.png"),
            Err(ImageError::Decode { .. })
        ));
        let ktx = decode_image(b"\xabKTX 20\xbb\r\n\x1a\n....", "t.ktx2").unwrap_err();
        assert!(ktx.to_string().contains("KTX2"));
        assert!(matches!(decode_image(b"", "none"), Err(ImageError::Kind { .. })));
    }

    /// The checksum of PNG's chunks.
    fn crc32(bytes: &[u8]) -> u32 {
        let mut crc = flate2::Crc::new();
        crc.update(bytes);
        crc.sum()
    }
}
