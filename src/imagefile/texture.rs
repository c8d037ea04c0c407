//! An image as a texture wants it: interleaved, 8 and 16-bit data as they are, floats finite and not negative.

use crate::raster::{Layer, Raster, Window};

use super::{Format, ImageFileError, MAX_VALUES, exr_read, exr_write, picture};

/// A decoded picture: pixels row-major from the top left, channels interleaved, alpha unassociated as far as the file's is.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Channels a pixel: 1 (grey), 2 (grey, alpha), 3 or 4.
    pub channels: u8,
    /// The values, width · height · channels of them.
    pub samples: Samples,
    /// Floats that were not finite or negative, and are 0 now.
    pub replaced: u64,
}

/// The values of a decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// [0, 255] for [0, 1].
    U8(Vec<u8>),
    /// [0, 65535] for [0, 1].
    U16(Vec<u16>),
    /// Floats.
    F32(Vec<f32>),
}

/// Decodes an image for use as a texture; `name` is for messages. PNG and JPEG keep their 8 or 16 bits; HDR and EXR are
/// floats, the non-finite and negative ones replaced by 0 and counted.
///
/// Of an EXR the first part is used: R, G, B and A if they are there, else Y (and A), else its only channel; pixels of the
/// display window outside the data window are 0.
///
/// # Errors
/// As [`decode`](super::decode); also if an EXR has none of these channels.
pub fn decode_texture(bytes: &[u8], name: &str) -> Result<Decoded, ImageFileError> {
    let mut decoded = match Format::of(bytes, name)? {
        Format::Exr => from_raster(&exr_read::decode(bytes, name)?, name)?,
        format => picture::decode_interleaved(bytes, format, name)?,
    };
    if let Samples::F32(values) = &mut decoded.samples {
        for value in values.iter_mut().filter(|v| !(v.is_finite() && **v >= 0.0)) {
            *value = 0.0;
            decoded.replaced += 1;
        }
    }
    Ok(decoded)
}

/// Pixels of a texture to be written.
#[derive(Clone, Copy, Debug)]
pub enum Interleaved<'a> {
    /// [0, 255] for [0, 1].
    U8(&'a [u8]),
    /// [0, 65535] for [0, 1].
    U16(&'a [u16]),
    /// Floats.
    F32(&'a [f32]),
}

/// Encodes a texture so that [`decode_texture`] gives the same values back: integers as PNG, floats as EXR. `channels` is 1 (grey), 2 (grey,
/// alpha), 3 or 4.
///
/// # Errors
/// If the image is empty, or the number of values isn't width · height · channels.
pub fn encode_texture(
    width: u32,
    height: u32,
    channels: u8,
    pixels: Interleaved<'_>,
) -> Result<Vec<u8>, ImageFileError> {
    let count = match pixels {
        Interleaved::U8(values) => values.len(),
        Interleaved::U16(values) => values.len(),
        Interleaved::F32(values) => values.len(),
    };
    let expected = width as usize * height as usize * usize::from(channels);
    if expected == 0 || count != expected || channels > 4 {
        let why = format!("{count} values for {width} × {height} pixels of {channels} channels");
        return Err(ImageFileError::Encode { element: "the texture".into(), why });
    }
    match pixels {
        Interleaved::U8(values) => picture::encode_interleaved(width, height, channels, 8, values),
        Interleaved::U16(values) => {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
            picture::encode_interleaved(width, height, channels, 16, &bytes)
        }
        Interleaved::F32(values) => {
            let names: &[&str] = match channels {
                1 => &["Y"],
                2 => &["Y", "A"],
                3 => &["R", "G", "B"],
                _ => &["R", "G", "B", "A"],
            };
            let plane = |c: usize| values.iter().skip(c).step_by(names.len()).copied().collect();
            let layer = names
                .iter()
                .enumerate()
                .fold(Layer::new("", Window::sized(width, height)), |layer, (c, name)| {
                    layer.with(*name, plane(c))
                });
            Ok(exr_write::encode_exr(&Raster::single(layer))?.bytes)
        }
    }
}

fn from_raster(raster: &Raster, name: &str) -> Result<Decoded, ImageFileError> {
    let layer = raster.picture();
    let planes = planes(layer).ok_or_else(|| ImageFileError::Unsupported {
        name: name.into(),
        what: format!("the channels {}", channel_names(layer)),
        hint: "; a texture needs R G B (A), Y (A) or a single channel",
    })?;
    let (frame, window) = (raster.display, layer.window);
    if (frame.pixels() as u64).saturating_mul(planes.len() as u64) > MAX_VALUES {
        return Err(ImageFileError::TooLarge {
            name: name.into(),
            width: frame.width.into(),
            height: frame.height.into(),
            channels: planes.len() as u64,
        });
    }
    let mut values = vec![0.0; frame.pixels() * planes.len()];
    for (index, pixel) in values.chunks_exact_mut(planes.len()).enumerate() {
        let x = i64::from(frame.x) + (index % frame.width as usize) as i64;
        let y = i64::from(frame.y) + (index / frame.width as usize) as i64;
        // The header's windows are within half of i32's range.
        if let Some(from) = window.index_of(x as i32, y as i32) {
            for (value, plane) in pixel.iter_mut().zip(&planes) {
                *value = plane[from];
            }
        }
    }
    Ok(Decoded {
        width: frame.width,
        height: frame.height,
        channels: planes.len() as u8,
        samples: Samples::F32(values),
        replaced: 0,
    })
}

/// The planes of a texture, 1 to 4.
fn planes(layer: &Layer) -> Option<Vec<&[f32]>> {
    let plane = |name: &str| layer.channel(name).map(|c| c.values.as_slice());
    let mut planes: Vec<&[f32]> = match (layer.rgb(), plane("Y")) {
        (Some(rgb), _) => rgb.to_vec(),
        (None, Some(grey)) => vec![grey],
        (None, None) => {
            return match layer.channels.as_slice() {
                [only] => Some(vec![&only.values]),
                _ => None,
            };
        }
    };
    planes.extend(plane("A"));
    Some(planes)
}

fn channel_names(layer: &Layer) -> String {
    layer.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imagefile::{encode_exr, encode_png};
    use crate::raster::Window;

    #[test]
    fn a_png_keeps_its_bytes() {
        let decoded = decode_texture(&encode_png(2, 1, &[1, 2, 3, 4, 5, 6]).unwrap(), "x").unwrap();
        assert_eq!((decoded.width, decoded.height, decoded.channels), (2, 1, 3));
        assert_eq!(decoded.samples, Samples::U8(vec![1, 2, 3, 4, 5, 6]));
    }

    #[test]
    fn floats_that_are_no_light_are_replaced_and_counted() {
        let layer = Layer::new("", Window::sized(3, 1))
            .with("R", vec![1.0, f32::NAN, 2.0])
            .with("G", vec![f32::INFINITY, 0.5, 70000.0])
            .with("B", vec![-1.0, -0.0, 3.0]);
        let decoded = decode_texture(&encode_exr(&Raster::single(layer)).unwrap().bytes, "x").unwrap();
        assert_eq!(decoded.samples, Samples::F32(vec![1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 2.0, 70000.0, 3.0]));
        assert_eq!(decoded.replaced, 3);
    }

    #[test]
    fn an_exr_fills_its_display_window() {
        let layer = Layer::new("", Window { x: 1, y: 1, width: 2, height: 1 }).with("Y", vec![5.0, 6.0]);
        let raster = Raster { display: Window::sized(2, 2), layers: vec![layer] };
        let decoded = decode_texture(&encode_exr(&raster).unwrap().bytes, "x").unwrap();
        assert_eq!(decoded.samples, Samples::F32(vec![0.0, 0.0, 0.0, 5.0]));
    }

    #[test]
    fn channels_that_are_no_colour_are_an_error_that_lists_them() {
        let layer = Layer::new("", Window::sized(1, 1)).with("U", vec![0.0]).with("V", vec![0.0]);
        let error = decode_texture(&encode_exr(&Raster::single(layer)).unwrap().bytes, "uv.exr").unwrap_err();
        assert!(error.to_string().contains("uv.exr has the channels U V"), "{error}");
    }
}
