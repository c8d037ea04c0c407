//! KTX2 images: Basis Universal (ETC1S and UASTC), as KHR_texture_basisu has them, through the `basisu` crate, and plain pixels of
//! 8 bits.

use std::io::Read;

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};

use super::texture::{Decoded, Samples};
use super::{ImageFileError, MAX_VALUES, check_declared};

/// The first bytes of a KTX2 file.
pub(super) const MAGIC: &[u8] = &[0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n'];

/// Supercompression by Zstandard, in the header.
const ZSTANDARD: u64 = 2;

/// What the header says about the largest level.
struct Header {
    vk_format: u64,
    width: u64,
    height: u64,
    scheme: u64,
    offset: u64,
    length: u64,
    unpacked: u64,
}

impl Header {
    /// The header at the beginning of `bytes` (KTX 2.0, section 3), if they are as long.
    fn of(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize, size: usize| {
            let bytes = bytes.get(at..at + size)?;
            Some(bytes.iter().rev().fold(0, |word, &b| word << 8 | u64::from(b)))
        };
        Some(Self {
            vk_format: word(12, 4)?,
            width: word(20, 4)?,
            height: word(24, 4)?,
            scheme: word(44, 4)?,
            offset: word(80, 8)?,
            length: word(88, 8)?,
            unpacked: word(96, 8)?,
        })
    }

    /// The channels of Vulkan's R8, R8G8, R8G8B8 and R8G8B8A8, linear or sRGB.
    fn plain_channels(&self) -> Option<u8> {
        match self.vk_format {
            9 | 15 => Some(1),
            23 | 29 => Some(3),
            37 | 43 => Some(4),
            _ => None,
        }
    }
}

/// Decodes the largest level of a KTX2 image.
pub(super) fn decode(bytes: &[u8], name: &str) -> Result<Decoded, ImageFileError> {
    let damaged = |why: &str| ImageFileError::Damaged { name: name.into(), why: why.into() };
    let header = Header::of(bytes).ok_or_else(|| damaged("it ends inside its header"))?;
    let (width, height) = (header.width, header.height);
    if width.saturating_mul(height).saturating_mul(4) > MAX_VALUES {
        return Err(ImageFileError::TooLarge { name: name.into(), width, height, channels: 4 });
    }
    if width == 0 || height == 0 {
        return Err(damaged("it has no pixels"));
    }
    check_declared(width * height * 4, bytes.len(), name)?;
    if let Some(channels) = header.plain_channels() {
        let values =
            plain(bytes, &header, channels).ok_or_else(|| damaged("its pixels are not all there"))?;
        let (width, height) = (width as u32, height as u32);
        return Ok(Decoded { width, height, channels, samples: Samples::U8(values), replaced: 0 });
    }
    // What is unpacked is blocks of 4 × 4 pixels, 16 bytes each.
    if header.scheme == ZSTANDARD && header.unpacked > width.div_ceil(4) * height.div_ceil(4) * 16 {
        return Err(damaged("it unpacks to more than its size needs"));
    }
    let image = Transcoder::new(bytes).map_err(|error| damaged(&format!("{error:?}")))?;
    if !matches!(image.source_format(), SourceFormat::Etc1s | SourceFormat::UastcLdr) {
        let (what, hint) = (format!("{:?} in a KTX2", image.source_format()), "; ETC1S and UASTC are read");
        return Err(ImageFileError::Unsupported { name: name.into(), what, hint });
    }
    let values = image
        .transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        .map_err(|error| damaged(&format!("{error:?}")))?;
    let (width, height) = image.base_dimensions();
    Ok(Decoded { width, height, channels: 4, samples: Samples::U8(values), replaced: 0 })
}

/// Pixels that are stored as they are, or packed by Zstandard.
fn plain(bytes: &[u8], header: &Header, channels: u8) -> Option<Vec<u8>> {
    let size = header.width * header.height * u64::from(channels);
    let start = usize::try_from(header.offset).ok()?;
    let stored = bytes.get(start..start.checked_add(usize::try_from(header.length).ok()?)?)?;
    let mut values = Vec::new();
    match header.scheme {
        0 => values.extend_from_slice(stored),
        ZSTANDARD => {
            let unpacked = ruzstd::StreamingDecoder::new(stored).ok()?;
            unpacked.take(size.saturating_add(1)).read_to_end(&mut values).ok()?;
        }
        _ => return None,
    }
    (values.len() as u64 == size).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of one level of 4 × 4 pixels that are `data`, with the colour model of its descriptor.
    fn file(vk_format: u32, model: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        for word in [vk_format, 1, 4, 4, 0, 0, 1, 1, 0, 104, 44, 0, 0, 0, 0, 0, 0] {
            bytes.extend(word.to_le_bytes());
        }
        for word in [148, data.len() as u64, data.len() as u64] {
            bytes.extend(word.to_le_bytes());
        }
        for word in [44, 0, 2 | 40 << 16, model | 1 << 8 | 1 << 16, 0x0303, 16, 0, 3 << 24, 0, 0, u32::MAX] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(data);
        bytes
    }

    #[test]
    fn a_solid_block_of_uastc_is_decoded() {
        // Mode 8: five bits of its code, then R, G, B and A.
        let block = 0x17u128 | 10 << 5 | 20 << 13 | 30 << 21 | 40 << 29;
        let decoded = decode(&file(0, 166, &block.to_le_bytes()), "x").unwrap();
        assert_eq!((decoded.width, decoded.height, decoded.channels), (4, 4, 4));
        assert_eq!(decoded.samples, Samples::U8([10, 20, 30, 40].repeat(16)));
    }

    #[test]
    fn plain_pixels_are_taken_as_they_are() {
        let pixels: Vec<u8> = (0..48).collect();
        assert_eq!(decode(&file(23, 1, &pixels), "x").unwrap().samples, Samples::U8(pixels.clone()));
        assert!(decode(&file(23, 1, &pixels[1..]), "x").is_err());
    }

    #[test]
    fn claims_are_checked_before_anything_is_allocated() {
        let file = |width: u32, height: u32, scheme: u32, unpacked: u64| {
            let mut bytes = MAGIC.to_vec();
            bytes.resize(200, 0);
            bytes[16] = 1;
            bytes[20..24].copy_from_slice(&width.to_le_bytes());
            bytes[24..28].copy_from_slice(&height.to_le_bytes());
            bytes[36] = 1;
            bytes[40] = 1;
            bytes[44..48].copy_from_slice(&scheme.to_le_bytes());
            bytes[96..104].copy_from_slice(&unpacked.to_le_bytes());
            bytes
        };
        let error = |bytes: &[u8]| decode(bytes, "x.ktx2").unwrap_err();
        assert!(matches!(error(&file(1 << 31, 1 << 31, 0, 0)), ImageFileError::TooLarge { .. }));
        let bomb = error(&file(4, 4, 2, u64::MAX)).to_string();
        assert!(bomb.contains("unpacks to more"), "{bomb}");
        assert!(matches!(error(&file(4, 4, 0, 0)), ImageFileError::Damaged { .. }));
        assert!(matches!(error(MAGIC), ImageFileError::Damaged { .. }));
    }
}
