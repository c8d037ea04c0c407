//! The pixels of an EXR: every part and channel at full resolution.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use exr::block::UncompressedBlock;
use exr::block::reader::ChunksReader;
use exr::meta::header::Header;
use exr::prelude::{SampleType as FileType, Vec2, f16};

use crate::raster::{Channel, Layer, Raster, SampleType};

use super::ImageFileError;
use super::exr_header::{self, PartHead};

/// Decodes an EXR whose first bytes are known to be right.
pub(super) fn decode(bytes: &[u8], name: &str) -> Result<Raster, ImageFileError> {
    let parts = exr_header::scan(bytes, name)?;
    // The header is checked; blocks of compressed data are the crate's to judge, and some damage makes it panic. It holds no
    // state beyond this call, so a panic there is an error here.
    let layers = catch_unwind(AssertUnwindSafe(|| read_layers(bytes, parts.clone())))
        .unwrap_or_else(|_| Err(Failure::Damaged("its compressed data makes no sense".into())))
        .map_err(|failure| failure.about(name))?;
    Ok(Raster { display: parts[0].display, layers })
}

/// What went wrong, without the file's name.
enum Failure {
    Damaged(String),
    Unsupported(String),
}

impl Failure {
    fn about(self, name: &str) -> ImageFileError {
        match self {
            Self::Damaged(why) => ImageFileError::Damaged { name: name.into(), why },
            Self::Unsupported(what) => ImageFileError::Unsupported { name: name.into(), what, hint: "" },
        }
    }
}

impl From<exr::error::Error> for Failure {
    fn from(error: exr::error::Error) -> Self {
        match error {
            exr::error::Error::NotSupported(what) => Self::Unsupported(what.into_owned()),
            exr::error::Error::Invalid(why) => Self::Damaged(why.into_owned()),
            other => Self::Damaged(other.to_string()),
        }
    }
}

fn read_layers(bytes: &[u8], parts: Vec<PartHead>) -> Result<Vec<Layer>, Failure> {
    let reader = exr::block::read(Cursor::new(bytes), false)?;
    check_agreement(reader.headers(), &parts)?;
    let mut blocks = reader
        .filter_chunks(false, |_, tile, _| tile.level_index == Vec2(0, 0))?
        .sequential_decompressor(false);
    let mut layers: Vec<Filling> = parts.into_iter().map(Filling::new).collect();
    while let Some(block) = blocks.next() {
        let block = block?;
        let headers = &blocks.meta_data().headers;
        let (header, layer) = headers
            .get(block.index.layer)
            .zip(layers.get_mut(block.index.layer))
            .ok_or_else(|| Failure::Damaged("a block belongs to no part".into()))?;
        layer.take(&block, header)?;
    }
    layers.into_iter().map(Filling::finish).collect()
}

/// Our reading of the header must be the crate's.
fn check_agreement(headers: &[Header], parts: &[PartHead]) -> Result<(), Failure> {
    let agrees = |(header, part): (&Header, &PartHead)| {
        let size = Vec2(part.window.width as usize, part.window.height as usize);
        header.layer_size == size
            && header.own_attributes.layer_position == Vec2(part.window.x, part.window.y)
            && header.channels.list.len() == part.channels.len()
    };
    if headers.len() == parts.len() && headers.iter().zip(parts).all(agrees) {
        Ok(())
    } else {
        Err(Failure::Damaged("its header can be read in two ways".into()))
    }
}

/// A layer on its way.
struct Filling {
    layer: Layer,
    /// Blocks that have come, so that none counts twice.
    seen: BTreeSet<(usize, usize)>,
    pixels: usize,
}

impl Filling {
    fn new(part: PartHead) -> Self {
        let mut layer = Layer::new(part.name, part.window);
        layer.attributes = part.attributes;
        let pixels = part.window.pixels();
        layer.channels = part
            .channels
            .into_iter()
            .map(|c| Channel { name: c.name, stored_as: c.sample_type, values: vec![0.0; pixels] })
            .collect();
        Self { layer, seen: BTreeSet::new(), pixels: 0 }
    }

    /// Copies a block's values to their places.
    fn take(&mut self, block: &UncompressedBlock, header: &Header) -> Result<(), Failure> {
        let Vec2(x, y) = block.index.pixel_position;
        let Vec2(width, height) = block.index.pixel_size;
        if !self.seen.insert((x, y)) {
            return Err(Failure::Damaged(format!("the block at column {x}, row {y} comes twice")));
        }
        let bytes_per_pixel: usize = self.layer.channels.iter().map(|c| bytes_per_sample(c.stored_as)).sum();
        if block.data.len() != width * height * bytes_per_pixel {
            return Err(Failure::Damaged(format!("the block at column {x}, row {y} has a wrong size")));
        }
        let stride = self.layer.window.width as usize;
        for line in block.lines(&header.channels) {
            let start = line.location.position.y() * stride + line.location.position.x();
            let place = self
                .layer
                .channels
                .get_mut(line.location.channel)
                .and_then(|channel| channel.values.get_mut(start..start + width))
                .ok_or_else(|| Failure::Damaged("a block lies outside the data window".into()))?;
            let sample_type = header.channels.list[line.location.channel].sample_type;
            copy_line(line.value, sample_type, place);
        }
        self.pixels += width * height;
        Ok(())
    }

    fn finish(self) -> Result<Layer, Failure> {
        let expected = self.layer.window.pixels();
        if self.pixels == expected {
            Ok(self.layer)
        } else {
            Err(Failure::Damaged(format!("{} of {expected} pixels are there", self.pixels)))
        }
    }
}

const fn bytes_per_sample(sample_type: SampleType) -> usize {
    match sample_type {
        SampleType::F16 | SampleType::U16 => 2,
        SampleType::F32 | SampleType::U32 => 4,
        SampleType::U8 => 1,
    }
}

fn copy_line(bytes: &[u8], sample_type: FileType, values: &mut [f32]) {
    match sample_type {
        FileType::F16 => {
            for (value, b) in values.iter_mut().zip(bytes.chunks_exact(2)) {
                *value = f16::from_ne_bytes([b[0], b[1]]).to_f32();
            }
        }
        FileType::F32 => {
            for (value, b) in values.iter_mut().zip(bytes.chunks_exact(4)) {
                *value = f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
            }
        }
        FileType::U32 => {
            for (value, b) in values.iter_mut().zip(bytes.chunks_exact(4)) {
                *value = u32::from_ne_bytes([b[0], b[1], b[2], b[3]]) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples};
    use exr::prelude::{Compression, LayerAttributes, LineOrder, Vec2, WritableImage, f16};

    use crate::imagefile::{ImageFileError, decode, encode_exr};
    use crate::math::hash;
    use crate::raster::{Attribute, Layer, Raster, SampleType, Window};

    fn small() -> Vec<u8> {
        let window = Window { x: -1, y: 2, width: 5, height: 20 };
        let values = |k: f32| (0..100).map(|i| k * i as f32).collect::<Vec<_>>();
        let mut beauty = Layer::new("beauty", window)
            .with("B", values(1.0))
            .with("G", values(0.5))
            .with("R", values(0.25));
        beauty.channels[0].stored_as = SampleType::F16;
        beauty.attributes.push(("pipeline:key".into(), Attribute::Text("abc".into())));
        let data = Layer::new("data", window).with("Z", values(-3.0));
        encode_exr(&Raster { display: Window::sized(8, 30), layers: vec![beauty, data] }).unwrap().bytes
    }

    #[test]
    fn a_truncated_file_is_an_error_wherever_it_ends() {
        let bytes = small();
        assert!(decode(&bytes, "whole").is_ok());
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length], "cut").is_err(), "{length} of {} bytes", bytes.len());
        }
    }

    #[test]
    fn flipped_bytes_never_panic_and_never_exceed_what_the_header_declares() {
        let bytes = small();
        for seed in 0..3000_u64 {
            let mut damaged = bytes.clone();
            for k in 0..=seed % 3 {
                let bits = hash::mix64(seed * 4 + k);
                let at = (bits >> 8) as usize % damaged.len();
                damaged[at] ^= (bits & 0xff).max(1) as u8;
            }
            if let Ok(raster) = decode(&damaged, "flipped") {
                for layer in &raster.layers {
                    assert!(layer.channels.iter().all(|c| c.values.len() == layer.window.pixels()));
                }
            }
        }
    }

    /// A small image with the crate's own writer: what ours does not write.
    fn written_by_others(compression: Compression, blocks: Blocks) -> Vec<u8> {
        let size = Vec2(37, 23);
        let halves = |k: f32| {
            let values = (0..size.area()).map(|i| f16::from_f32((i % 97) as f32 * k)).collect();
            AnyChannel::new("H", FlatSamples::F16(values))
        };
        let floats =
            AnyChannel::new("F", FlatSamples::F32((0..size.area()).map(|i| i as f32 / 7.0).collect()));
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let channels = AnyChannels::sort([halves(0.25), floats].into_iter().collect());
        let mut bytes = Vec::new();
        exr::image::Image::from_layer(exr::image::Layer::new(
            size,
            LayerAttributes::named("x"),
            encoding,
            channels,
        ))
        .write()
        .non_parallel()
        .to_buffered(std::io::Cursor::new(&mut bytes))
        .unwrap();
        bytes
    }

    #[test]
    fn every_lossless_compression_is_read_and_damage_to_any_compression_is_an_error_not_a_panic() {
        let tiles = Blocks::Tiles(Vec2(16, 16));
        for (compression, lossless) in [
            (Compression::Uncompressed, true),
            (Compression::RLE, true),
            (Compression::ZIP1, true),
            (Compression::ZIP16, true),
            (Compression::PIZ, true),
            (Compression::PXR24, false),
            (Compression::B44, false),
            (Compression::DWAA(None), false),
        ] {
            for blocks in [Blocks::ScanLines, tiles] {
                let bytes = written_by_others(compression, blocks);
                let raster = decode(&bytes, "whole").unwrap();
                let values = &raster.picture().channel("F").unwrap().values;
                let tolerance = if lossless { 0.0 } else { 0.2 };
                let near = |(i, v): (usize, &f32)| (v - i as f32 / 7.0).abs() <= tolerance;
                assert!(values.iter().enumerate().all(near), "{compression}");
                for seed in 0..150_u64 {
                    let mut damaged = bytes.clone();
                    let bits = hash::mix64(seed);
                    let at = (bits >> 8) as usize % damaged.len();
                    damaged[at] ^= (bits & 0xff).max(1) as u8;
                    let _may_fail = decode(&damaged, "flipped");
                    let _must_not_panic = decode(&bytes[..at], "cut");
                }
            }
        }
    }

    #[test]
    fn a_header_that_declares_too_much_is_refused_before_memory_is_asked_for() {
        let mut bytes = small();
        let at =
            bytes.windows(10).position(|w| w == b"dataWindow").unwrap() + b"dataWindow\0box2i\0".len() + 4;
        bytes[at..at + 16].copy_from_slice(&[0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 31, 255, 255, 255, 31]);
        let error = decode(&bytes, "huge").unwrap_err();
        assert!(matches!(error, ImageFileError::TooLarge { .. }), "{error}");
    }

    #[test]
    fn deep_and_subsampled_files_are_refused_by_name() {
        let mut deep = small();
        deep[5] |= 0x08;
        let error = decode(&deep, "deep.exr").unwrap_err().to_string();
        assert!(error.contains("deep.exr") && error.contains("deep data"), "{error}");
        let mut chroma = small();
        let at = chroma.windows(7).position(|w| w == b"chlist\0").unwrap() + 7 + 4 + 2 + 4 + 4;
        chroma[at] = 2;
        let error = decode(&chroma, "c.exr").unwrap_err().to_string();
        assert!(error.contains("subsampled"), "{error}");
    }

    #[test]
    fn a_block_that_comes_twice_is_damage() {
        let mut bytes = small();
        // The first block's row, repeated in the second block of the first part: its offsets stand after the header.
        let rows: Vec<usize> = bytes
            .windows(8)
            .enumerate()
            .filter(|(_, w)| {
                w[..4] == [0, 0, 0, 0] && (w[4..] == 2_i32.to_le_bytes() || w[4..] == 18_i32.to_le_bytes())
            })
            .map(|(at, _)| at + 4)
            .collect();
        let second = *rows.iter().find(|&&at| bytes[at] == 18).expect("the second block of the first part");
        bytes[second] = 2;
        assert!(decode(&bytes, "twice").is_err());
    }
}
