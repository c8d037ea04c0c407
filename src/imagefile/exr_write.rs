//! Writing EXR: parts as given, ZIP, channels in the order of their names, and the same bytes every time.

use std::collections::{BTreeSet, HashMap};
use std::io::Cursor;
use std::path::Path;

use exr::block::writer::ChunksWriter;
use exr::block::{UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::meta::BlockDescription;
use exr::meta::attribute::Chromaticities;
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{
    AttributeValue, ChannelDescription, Compression, IntegerBounds, LineOrder, SampleType as FileType, Text,
    Vec2, f16,
};
use rayon::prelude::*;

use crate::raster::{Attribute, Channel, Layer, Raster, SampleType, Window};

use super::exr_header::{STRUCTURE, sort_attributes};
use super::{ImageFileError, MAX_VALUES, write_whole};

/// The largest finite half.
const HALF_MAX: f32 = 65504.0;

/// How many blocks are compressed before they are written: bounds the memory beside the raster itself.
const BATCH: usize = 64;

/// An EXR in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedExr {
    /// The file.
    pub bytes: Vec<u8>,
    /// Finite values that were beyond ±65504 in a half channel and were brought back to it.
    pub clamped: u64,
}

/// Writes an EXR file, whole or not at all; returns how many values were clamped. See [`encode_exr`].
///
/// # Errors
/// As [`encode_exr`] and [`write_whole`].
pub fn write_exr(path: &Path, raster: &Raster) -> Result<u64, ImageFileError> {
    let encoded = encode_exr(raster)?;
    write_whole(path, &encoded.bytes)?;
    Ok(encoded.clamped)
}

/// Encodes a raster as EXR: one part a layer, scanlines in blocks of 16, ZIP, Rec. 709 chromaticities, each layer's own
/// attributes in its part's header.
///
/// Channels are sorted by name, as the format demands; dots in names stay as they are. [`SampleType::F16`] channels are
/// rounded to the nearest half, finite values beyond ±65504 clamped and counted, infinities and NaN kept.
/// [`SampleType::U32`] channels must hold whole numbers. 8 and 16-bit integers, which EXR does not have, become 32-bit floats.
/// The same raster gives the same bytes.
///
/// # Errors
/// If a layer is empty, too large, or unnamed beside others, if a name is empty, repeated, longer than 255 bytes or reserved
/// for the file's structure, or if a value does not fit its channel's type.
pub fn encode_exr(raster: &Raster) -> Result<EncodedExr, ImageFileError> {
    check(raster)?;
    let layers: Vec<Planes<'_>> =
        raster.layers.iter().map(Planes::new).collect::<Result<_, ImageFileError>>()?;
    let headers = raster.layers.iter().zip(&layers).map(|(l, p)| header(l, p, raster.display)).collect();
    let mut bytes = Vec::new();
    exr::block::write(Cursor::new(&mut bytes), headers, false, |meta, writer| {
        let places: Vec<_> = enumerate_ordered_header_block_indices(&meta.headers).collect();
        for batch in places.chunks(BATCH) {
            let chunks: Vec<_> = batch
                .par_iter()
                .map(|&(index, place)| {
                    let header = &meta.headers[place.layer];
                    let planes = &layers[place.layer];
                    UncompressedBlock::from_lines(&header.channels, place, |line| planes.copy(line))
                        .compress_to_chunk(&meta.headers)
                        .map(|chunk| (index, chunk))
                })
                .collect();
            for chunk in chunks {
                let (index, chunk) = chunk?;
                writer.write_chunk(index, chunk)?;
            }
        }
        Ok(())
    })
    .map_err(|error| refuse("the image", error.to_string()))?;
    sort_attributes(&mut bytes)?;
    Ok(EncodedExr { bytes, clamped: layers.iter().map(|planes| planes.clamped).sum() })
}

fn refuse(element: impl Into<String>, why: impl Into<String>) -> ImageFileError {
    ImageFileError::Encode { element: element.into(), why: why.into() }
}

/// What the format asks of the raster.
fn check(raster: &Raster) -> Result<(), ImageFileError> {
    if raster.layers.is_empty() {
        return Err(refuse("the image", "it has no layers"));
    }
    if raster.display.pixels() == 0 {
        return Err(refuse("the image", "its display window is empty"));
    }
    let mut values = 0_u64;
    let mut names = BTreeSet::new();
    for layer in &raster.layers {
        let element = format!("layer {:?}", layer.name);
        if raster.layers.len() > 1 && layer.name.is_empty() {
            return Err(refuse(element, "each of several layers needs a name"));
        }
        if !names.insert(&layer.name) {
            return Err(refuse(element, "another layer has the same name"));
        }
        check_layer(layer, &element)?;
        values = values.saturating_add(layer.window.pixels() as u64 * layer.channels.len() as u64);
    }
    if values > MAX_VALUES {
        return Err(refuse("the image", format!("it has {values} values; at most {MAX_VALUES} are written")));
    }
    Ok(())
}

fn check_layer(layer: &Layer, element: &str) -> Result<(), ImageFileError> {
    if layer.window.pixels() == 0 {
        return Err(refuse(element, "its data window is empty"));
    }
    if layer.channels.is_empty() {
        return Err(refuse(element, "it has no channels"));
    }
    let mut names = BTreeSet::new();
    for channel in &layer.channels {
        let element = format!("{element}: channel {:?}", channel.name);
        check_name(&channel.name, &element)?;
        if !names.insert(&channel.name) {
            return Err(refuse(element, "another channel has the same name"));
        }
        let (has, expected) = (channel.values.len(), layer.window.pixels());
        if has != expected {
            return Err(refuse(element, format!("it has {has} values; its window has {expected} pixels")));
        }
    }
    let mut names = BTreeSet::new();
    for (name, _) in &layer.attributes {
        let element = format!("{element}: attribute {name:?}");
        check_name(name, &element)?;
        if STRUCTURE.contains(&name.as_str()) {
            return Err(refuse(element, "the name is reserved for the file's structure"));
        }
        if !names.insert(name) {
            return Err(refuse(element, "another attribute has the same name"));
        }
    }
    Ok(())
}

/// Names end with a zero byte and are at most 255 bytes long.
fn check_name(name: &str, element: &str) -> Result<(), ImageFileError> {
    if name.is_empty() || name.len() > 255 || name.contains('\0') {
        return Err(refuse(element, "a name has 1 to 255 bytes, none of them zero"));
    }
    Ok(())
}

fn text(content: &str) -> Text {
    Text::from_slice_unchecked(content.as_bytes())
}

fn bounds(window: Window) -> IntegerBounds {
    IntegerBounds::new((window.x, window.y), (window.width as usize, window.height as usize))
}

fn header(layer: &Layer, planes: &Planes<'_>, display: Window) -> Header {
    let other: HashMap<Text, AttributeValue> = layer
        .attributes
        .iter()
        .map(|(name, value)| {
            let value = match value {
                Attribute::Text(content) => AttributeValue::Text(text(content)),
                Attribute::Int(number) => AttributeValue::I32(*number),
                Attribute::Float(number) => AttributeValue::F32(*number),
            };
            (text(name), value)
        })
        .collect();
    let channels = planes
        .sorted
        .iter()
        .map(|plane| ChannelDescription {
            name: text(&plane.channel.name),
            sample_type: plane.file_type,
            quantize_linearly: false,
            sampling: Vec2(1, 1),
        })
        .collect();
    let mut own = LayerAttributes::named("").with_position(Vec2(layer.window.x, layer.window.y));
    own.layer_name = (!layer.name.is_empty()).then(|| text(&layer.name));
    own.other = other;
    let mut shared = ImageAttributes::new(bounds(display));
    // ITU-R BT.709, which these pixels are in; said although it is what a reader must assume.
    shared.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let size = (layer.window.width as usize, layer.window.height as usize);
    Header::new(Text::default(), size, channels)
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(own)
        .with_shared_attributes(shared)
}

/// A layer's channels in the file's order.
struct Planes<'a> {
    sorted: Vec<Plane<'a>>,
    width: usize,
    clamped: u64,
}

struct Plane<'a> {
    channel: &'a Channel,
    file_type: FileType,
}

impl<'a> Planes<'a> {
    fn new(layer: &'a Layer) -> Result<Self, ImageFileError> {
        let mut sorted = Vec::with_capacity(layer.channels.len());
        let mut clamped = 0;
        for channel in &layer.channels {
            let file_type = match channel.stored_as {
                SampleType::F16 => FileType::F16,
                SampleType::F32 | SampleType::U8 | SampleType::U16 => FileType::F32,
                SampleType::U32 => FileType::U32,
            };
            match file_type {
                FileType::F16 => {
                    clamped +=
                        channel.values.iter().filter(|v| v.is_finite() && v.abs() > HALF_MAX).count() as u64;
                }
                FileType::U32 => check_whole(channel, layer)?,
                FileType::F32 => {}
            }
            sorted.push(Plane { channel, file_type });
        }
        sorted.sort_by(|a, b| a.channel.name.as_bytes().cmp(b.channel.name.as_bytes()));
        Ok(Self { sorted, width: layer.window.width as usize, clamped })
    }

    /// Fills one line of a block.
    fn copy(&self, line: exr::block::lines::LineRefMut<'_>) {
        let plane = &self.sorted[line.location.channel];
        let start = line.location.position.y() * self.width + line.location.position.x();
        let values = &plane.channel.values[start..start + line.location.sample_count];
        match plane.file_type {
            FileType::F16 => {
                for (to, &v) in line.value.chunks_exact_mut(2).zip(values) {
                    let v = if v.is_finite() { v.clamp(-HALF_MAX, HALF_MAX) } else { v };
                    to.copy_from_slice(&f16::from_f32(v).to_ne_bytes());
                }
            }
            FileType::F32 => {
                for (to, &v) in line.value.chunks_exact_mut(4).zip(values) {
                    to.copy_from_slice(&v.to_ne_bytes());
                }
            }
            FileType::U32 => {
                for (to, &v) in line.value.chunks_exact_mut(4).zip(values) {
                    to.copy_from_slice(&(v as u32).to_ne_bytes());
                }
            }
        }
    }
}

/// The first value that is not a whole number of 32 bits is an error.
fn check_whole(channel: &Channel, layer: &Layer) -> Result<(), ImageFileError> {
    let fits = |v: &&f32| !(**v >= 0.0 && **v < 4_294_967_296.0 && v.fract() == 0.0);
    match channel.values.iter().find(fits) {
        None => Ok(()),
        Some(v) => Err(refuse(
            format!("layer {:?}: channel {:?}", layer.name, channel.name),
            format!("{v} is not a whole number of 32 bits"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imagefile::decode;

    fn raster() -> Raster {
        let window = Window { x: 3, y: -2, width: 4, height: 33 };
        let values = |k: f32| (0..132).map(|i| k * i as f32 - 7.0).collect::<Vec<_>>();
        let mut beauty = Layer::new("beauty", window);
        for name in ["R", "G", "B"] {
            beauty = beauty.with(name, values(1.5));
        }
        for k in 0..20 {
            beauty.attributes.push((format!("pipeline:a{k:02}"), Attribute::Int(k)));
        }
        beauty.attributes.push(("pipeline:text".into(), Attribute::Text("Zürich ✓\nline".into())));
        let mut data = Layer::new("data", window).with("albedo.R", values(0.1)).with("Z", values(9.0));
        data = data.with("samples", (0..132).map(|i| i as f32).collect());
        data.channels[2].stored_as = SampleType::U32;
        data.attributes.push(("pipeline:float".into(), Attribute::Float(0.1)));
        Raster { display: Window::sized(10, 40), layers: vec![beauty, data] }
    }

    #[test]
    fn what_is_written_is_read_back_with_channels_sorted() {
        let raster = raster();
        let back = decode(&encode_exr(&raster).unwrap().bytes, "x").unwrap();
        let mut expected = raster;
        for layer in &mut expected.layers {
            layer.channels.sort_by(|a, b| a.name.cmp(&b.name));
        }
        assert_eq!(back, expected);
    }

    #[test]
    fn non_finite_values_keep_their_bits_and_halves_clamp_with_a_count() {
        let values = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e6, -1e6, 65504.0, 65519.0, -0.0];
        let mut layer =
            Layer::new("", Window::sized(8, 1)).with("F", values.clone()).with("H", values.clone());
        layer.channels[1].stored_as = SampleType::F16;
        let encoded = encode_exr(&Raster::single(layer)).unwrap();
        assert_eq!(encoded.clamped, 3);
        let back = decode(&encoded.bytes, "x").unwrap();
        let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back.layers[0].channels[0].values), bits(&values));
        let halves = &back.layers[0].channels[1].values;
        assert!(halves[0].is_nan());
        assert_eq!(
            bits(&halves[1..]),
            bits(&[f32::INFINITY, f32::NEG_INFINITY, 65504.0, -65504.0, 65504.0, 65504.0, -0.0])
        );
    }

    #[test]
    fn the_same_raster_gives_the_same_bytes_whatever_the_hash_map_does() {
        let first = encode_exr(&raster()).unwrap();
        for _ in 0..5 {
            assert_eq!(encode_exr(&raster()).unwrap(), first);
        }
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let plain = || Layer::new("a", Window::sized(1, 1)).with("R", vec![0.5]);
        let error = |layers: Vec<Layer>| {
            encode_exr(&Raster { display: Window::sized(1, 1), layers }).unwrap_err().to_string()
        };
        assert!(error(vec![]).contains("no layers"));
        assert!(error(vec![plain(), plain()]).contains("same name"));
        assert!(error(vec![plain().with("R", vec![0.5])]).contains("another channel"));
        assert!(error(vec![Layer::new("e", Window::sized(1, 1))]).contains("no channels"));
        assert!(error(vec![Layer::new("e", Window::sized(0, 1)).with("R", vec![])]).contains("empty"));
        let mut reserved = plain();
        reserved.attributes.push(("dataWindow".into(), Attribute::Int(1)));
        assert!(error(vec![reserved]).contains("reserved"));
        let mut fraction = plain();
        fraction.channels[0].stored_as = SampleType::U32;
        assert!(error(vec![fraction]).contains("0.5 is not a whole number"));
        let mut short = plain();
        short.channels[0].values.clear();
        assert!(error(vec![short]).contains("0 values"));
        assert!(
            error(vec![plain(), Layer::new("", Window::sized(1, 1)).with("R", vec![0.0])])
                .contains("needs a name")
        );
    }
}
