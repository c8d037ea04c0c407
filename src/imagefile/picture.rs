//! PNG, JPEG, WebP and Radiance HDR, through the `image` crate.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::{PngDecoder, PngEncoder};
use image::codecs::webp::WebPDecoder;
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, Limits};

use crate::raster::{Channel, Layer, Raster, SampleType, Window};

use super::texture::{Decoded, Samples};
use super::{Format, ImageFileError, MAX_VALUES, check_declared, ktx2, write_whole};

/// Decodes a picture to a raster of one layer: channels `Y`, `Y A`, `R G B` or `R G B A`, integers as value / maximum, alpha
/// associated.
pub(super) fn decode(bytes: &[u8], format: Format, name: &str) -> Result<Raster, ImageFileError> {
    let decoded = decode_interleaved(bytes, format, name)?;
    Ok(Raster::single(layer(decoded)))
}

/// Decodes a picture to interleaved samples, alpha as it is stored.
pub(super) fn decode_interleaved(
    bytes: &[u8],
    format: Format,
    name: &str,
) -> Result<Decoded, ImageFileError> {
    // The decoders are made for hostile input; should one still panic, it has no state beyond this call.
    catch_unwind(AssertUnwindSafe(|| match format {
        Format::Ktx2 => ktx2::decode(bytes, name),
        _ => interleaved(decode_dynamic(bytes, format, name)?, name),
    }))
    .unwrap_or_else(|_| Err(damaged(name, "its compressed data makes no sense")))
}

fn damaged(name: &str, why: impl ToString) -> ImageFileError {
    ImageFileError::Damaged { name: name.into(), why: why.to_string() }
}

fn decode_dynamic(bytes: &[u8], format: Format, name: &str) -> Result<DynamicImage, ImageFileError> {
    let about = |error: ImageError| about(error, name);
    let input = Cursor::new(bytes);
    match format {
        Format::Png => finish(PngDecoder::with_limits(input, limits()).map_err(about)?, bytes.len(), name),
        Format::Jpeg => finish(JpegDecoder::new(input).map_err(about)?, bytes.len(), name),
        Format::WebP => finish(WebPDecoder::new(input).map_err(about)?, bytes.len(), name),
        Format::Hdr => finish(HdrDecoder::new(input).map_err(about)?, bytes.len(), name),
        Format::Exr | Format::Ktx2 => Err(damaged(name, "it came to the wrong decoder")),
    }
}

/// What decoders may ask for: room for the largest image, 16 bytes a pixel, and their own buffers.
fn limits() -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_VALUES * 8);
    limits
}

/// Checks what a file of `size` bytes declares, then decodes.
fn finish<D: ImageDecoder>(mut decoder: D, size: usize, name: &str) -> Result<DynamicImage, ImageFileError> {
    let (width, height) = decoder.dimensions();
    let channels = decoder.color_type().channel_count();
    if u64::from(width).saturating_mul(height.into()).saturating_mul(channels.into()) > MAX_VALUES {
        return Err(ImageFileError::TooLarge {
            name: name.into(),
            width: width.into(),
            height: height.into(),
            channels: channels.into(),
        });
    }
    if width == 0 || height == 0 {
        return Err(damaged(name, "it has no pixels"));
    }
    check_declared(decoder.total_bytes(), size, name)?;
    decoder.set_limits(limits()).map_err(|error| about(error, name))?;
    DynamicImage::from_decoder(decoder).map_err(|error| about(error, name))
}

fn about(error: ImageError, name: &str) -> ImageFileError {
    match error {
        ImageError::Unsupported(what) => {
            ImageFileError::Unsupported { name: name.into(), what: what.to_string(), hint: "" }
        }
        other => damaged(name, other),
    }
}

fn interleaved(image: DynamicImage, name: &str) -> Result<Decoded, ImageFileError> {
    let (width, height) = (image.width(), image.height());
    let (channels, samples) = match image {
        DynamicImage::ImageLuma8(i) => (1, Samples::U8(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, Samples::U8(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, Samples::U8(i.into_raw())),
        DynamicImage::ImageRgba8(i) => (4, Samples::U8(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, Samples::U16(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, Samples::U16(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, Samples::U16(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, Samples::U16(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, Samples::F32(i.into_raw())),
        DynamicImage::ImageRgba32F(i) => (4, Samples::F32(i.into_raw())),
        other => {
            let what = format!("pixels of type {:?}", other.color());
            return Err(ImageFileError::Unsupported { name: name.into(), what, hint: "" });
        }
    };
    Ok(Decoded { width, height, channels, samples, replaced: 0 })
}

/// Planes from interleaved samples.
fn layer(decoded: Decoded) -> Layer {
    let window = Window::sized(decoded.width, decoded.height);
    let count = usize::from(decoded.channels);
    let names: &[&str] = match count {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    let has_alpha = names.last() == Some(&"A");
    let (stored_as, values) = match decoded.samples {
        Samples::U8(mut v) => {
            if has_alpha {
                associate(&mut v, count, |color, alpha| {
                    rounded_product(color.into(), alpha.into(), 255) as u8
                });
            }
            (SampleType::U8, v.into_iter().map(|v| f32::from(v) * (1.0 / 255.0)).collect::<Vec<_>>())
        }
        Samples::U16(mut v) => {
            if has_alpha {
                associate(&mut v, count, |color, alpha| {
                    rounded_product(color.into(), alpha.into(), 65535) as u16
                });
            }
            (SampleType::U16, v.into_iter().map(|v| f32::from(v) * (1.0 / 65535.0)).collect())
        }
        Samples::F32(v) => (SampleType::F32, v),
    };
    let mut layer = Layer::new("", window);
    for (c, name) in names.iter().enumerate() {
        let plane = values.iter().skip(c).step_by(count).copied().collect();
        layer.channels.push(Channel { name: (*name).into(), stored_as, values: plane });
    }
    layer
}

/// Multiplies the colours of each pixel by its alpha, in the file's own integers and encoding, as OpenImageIO does.
fn associate<T: Copy>(values: &mut [T], channels: usize, product: impl Fn(T, T) -> T) {
    for pixel in values.chunks_exact_mut(channels) {
        if let Some((&mut alpha, colors)) = pixel.split_last_mut() {
            for color in colors {
                *color = product(*color, alpha);
            }
        }
    }
}

/// `color · alpha / max` to the nearest integer; `max` is odd, so there are no ties.
const fn rounded_product(color: u64, alpha: u64, max: u64) -> u64 {
    (color * alpha + max / 2) / max
}

/// Encodes 8-bit RGB, interleaved and row-major from the top left, as PNG.
///
/// # Errors
/// If the number of bytes is not 3 · width · height, or the image is empty.
pub fn encode_png(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, ImageFileError> {
    let refuse = |why: String| ImageFileError::Encode { element: "the PNG".into(), why };
    let expected = u64::from(width).saturating_mul(height.into()).saturating_mul(3);
    if expected == 0 || expected != rgb.len() as u64 {
        let has = rgb.len();
        return Err(refuse(format!(
            "it has {has} bytes; {width} × {height} pixels need {expected}, at least 3"
        )));
    }
    encode_interleaved(width, height, 3, 8, rgb)
}

/// Encodes integers of 8 or 16 bits, the latter in this machine's byte order, interleaved and row-major, as PNG. There are as many as they
/// should be.
pub(super) fn encode_interleaved(
    width: u32,
    height: u32,
    channels: u8,
    bits: u8,
    values: &[u8],
) -> Result<Vec<u8>, ImageFileError> {
    let color = match (channels, bits) {
        (1, 8) => ExtendedColorType::L8,
        (2, 8) => ExtendedColorType::La8,
        (3, 8) => ExtendedColorType::Rgb8,
        (_, 8) => ExtendedColorType::Rgba8,
        (1, _) => ExtendedColorType::L16,
        (2, _) => ExtendedColorType::La16,
        (3, _) => ExtendedColorType::Rgb16,
        (_, _) => ExtendedColorType::Rgba16,
    };
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(values, width, height, color)
        .map_err(|error| ImageFileError::Encode { element: "the PNG".into(), why: error.to_string() })?;
    Ok(bytes)
}

/// Writes 8-bit RGB as a PNG file, whole or not at all. See [`encode_png`].
///
/// # Errors
/// As [`encode_png`] and [`write_whole`].
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<(), ImageFileError> {
    write_whole(path, &encode_png(width, height, rgb)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imagefile::decode;
    use crate::math::hash;

    fn png(color: ExtendedColorType, width: u32, height: u32, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        PngEncoder::new(&mut out).write_image(bytes, width, height, color).unwrap();
        out
    }

    #[test]
    fn a_png_comes_back_as_the_values_over_255() {
        let bytes = encode_png(2, 1, &[0, 51, 255, 1, 2, 3]).unwrap();
        let raster = decode(&bytes, "x.png").unwrap();
        let [r, g, b] = raster.picture().rgb().unwrap();
        assert_eq!((r[0], g[0], b[0]), (0.0, 51.0 * (1.0 / 255.0), 1.0));
        assert_eq!(b[1], 3.0 * (1.0 / 255.0));
        assert_eq!(raster.picture().channels[0].stored_as, SampleType::U8);
    }

    #[test]
    fn grey_and_alpha_have_their_names_and_colours_are_multiplied_by_alpha() {
        let raster = decode(&png(ExtendedColorType::La8, 1, 1, &[100, 128]), "x").unwrap();
        let names: Vec<_> = raster.picture().channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["Y", "A"]);
        // 100 · 128 / 255 = 50.2
        assert_eq!(raster.picture().channels[0].values, [50.0 * (1.0 / 255.0)]);
        let wide = [0xff, 0xff, 0x00, 0x80].map(|b: u8| b);
        let raster = decode(&png(ExtendedColorType::La16, 1, 1, &wide), "x").unwrap();
        assert_eq!(raster.picture().channels[0].stored_as, SampleType::U16);
    }

    #[test]
    fn an_hdr_is_read_as_floats() {
        let file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x40\x20\x82";
        let raster = decode(file, "x.hdr").unwrap();
        let [r, g, b] = raster.picture().rgb().unwrap();
        assert_eq!((r, g, b), (&[1.0, 2.0][..], &[1.0, 1.0][..], &[1.0, 0.5][..]));
    }

    #[test]
    fn truncated_and_flipped_pictures_never_panic() {
        let pixels: Vec<u8> = (0..12 * 9 * 3).map(|i| (i * 7 % 251) as u8).collect();
        let mut jpeg = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut jpeg)
            .write_image(&pixels, 12, 9, ExtendedColorType::Rgb8)
            .unwrap();
        let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X 12\n".to_vec();
        hdr.extend(pixels.iter().chain(&pixels).take(12 * 9 * 4));
        for file in [encode_png(12, 9, &pixels).unwrap(), jpeg, hdr] {
            let whole = decode(&file, "whole").unwrap();
            assert_eq!(whole.display, Window::sized(12, 9));
            for length in 0..file.len() {
                let _may_fail = decode(&file[..length], "cut");
            }
            for seed in 0..500_u64 {
                let mut flipped = file.clone();
                let bits = hash::mix64(seed);
                let at = (bits >> 8) as usize % flipped.len();
                flipped[at] ^= (bits & 0xff).max(1) as u8;
                if let Ok(raster) = decode(&flipped, "flipped") {
                    assert_eq!(raster.picture().channels[0].values.len(), raster.display.pixels());
                }
            }
        }
    }

    #[test]
    fn a_declared_size_beyond_the_limit_is_refused() {
        let error =
            decode(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n", "big.hdr").unwrap_err();
        assert!(matches!(error, ImageFileError::TooLarge { width: 100_000, .. }), "{error}");
    }

    #[test]
    fn a_png_of_the_wrong_length_is_refused() {
        assert!(encode_png(2, 2, &[0; 11]).unwrap_err().to_string().contains("11 bytes"));
        assert!(encode_png(0, 2, &[]).is_err());
    }
}
