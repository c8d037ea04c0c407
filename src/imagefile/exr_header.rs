//! Walking the header of an EXR: what it declares, checked before anything is allocated, and where its attributes lie.
//!
//! The pixels are the `exr` crate's work; it trusts sizes and keeps custom attributes in a hash map, so what a file declares
//! and the order of its attributes are looked after here. Layout: "OpenEXR File Layout", openexr.com.

use std::ops::Range;

use crate::raster::{Attribute, SampleType, Window};

use super::{ImageFileError, MAX_VALUES, check_declared};

/// Bits of the version field.
const LONG_NAMES: u32 = 0x400;
const DEEP: u32 = 0x800;
const MULTIPART: u32 = 0x1000;
const TILED: u32 = 0x200;

/// More parts than any file has; each costs at least one header.
const MAX_PARTS: usize = 4096;

/// Beyond this the `exr` crate and OpenEXR itself refuse coordinates: half of `i32`'s range.
const MAX_COORDINATE: i64 = (i32::MAX / 2) as i64;

/// Attributes that describe the file's structure; the rest are custom.
pub(super) const STRUCTURE: [&str; 15] = [
    "channels",
    "chromaticities",
    "chunkCount",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "maxSamplesPerPixel",
    "name",
    "pixelAspectRatio",
    "screenWindowCenter",
    "screenWindowWidth",
    "tiles",
    "type",
    "version",
];

/// One channel as the header declares it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ChannelHead {
    pub(super) name: String,
    pub(super) sample_type: SampleType,
}

/// One part as its header declares it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PartHead {
    pub(super) name: String,
    pub(super) window: Window,
    pub(super) display: Window,
    pub(super) channels: Vec<ChannelHead>,
    /// The custom text, int and float attributes, in the file's order.
    pub(super) attributes: Vec<(String, Attribute)>,
}

/// An attribute as it lies in the file.
struct RawAttribute<'a> {
    name: &'a [u8],
    kind: &'a [u8],
    value: &'a [u8],
    /// Name, type, size and value.
    extent: Range<usize>,
}

/// A place in the bytes; every step is checked.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

/// Why the walk stopped: what is damaged.
type Damage = &'static str;

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or("the file ends inside the header")?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn i32(&mut self) -> Result<i32, Damage> {
        let b = self.take(4)?;
        Ok(i32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    /// Text up to a zero byte, at most 255 bytes.
    fn text(&mut self) -> Result<&'a [u8], Damage> {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().take(256).position(|&b| b == 0).ok_or("a name in the header has no end")?;
        let text = &rest[..length];
        self.at += length + 1;
        Ok(text)
    }

    /// The next attribute, or nothing where the header ends.
    fn attribute(&mut self) -> Result<Option<RawAttribute<'a>>, Damage> {
        let start = self.at;
        let name = self.text()?;
        if name.is_empty() {
            return Ok(None);
        }
        let kind = self.text()?;
        let size = usize::try_from(self.i32()?).map_err(|_| "an attribute has a negative size")?;
        let value = self.take(size)?;
        Ok(Some(RawAttribute { name, kind, value, extent: start..self.at }))
    }
}

/// The attributes of each header, in the file's order.
fn headers(bytes: &[u8]) -> Result<(u32, Vec<Vec<RawAttribute<'_>>>), Damage> {
    let mut cursor = Cursor { bytes, at: 0 };
    cursor.take(4)?;
    let version = cursor.i32()? as u32;
    let mut parts = Vec::new();
    loop {
        let mut attributes = Vec::new();
        while let Some(attribute) = cursor.attribute()? {
            attributes.push(attribute);
        }
        if attributes.is_empty() {
            return if parts.is_empty() { Err("the header is empty") } else { Ok((version, parts)) };
        }
        parts.push(attributes);
        if version & MULTIPART == 0 {
            return Ok((version, parts));
        }
        if parts.len() > MAX_PARTS {
            return Err("it declares more than 4096 parts");
        }
    }
}

/// What the file declares, checked: known version, flat data, no subsampling, sane windows, no more than [`MAX_VALUES`].
pub(super) fn scan(bytes: &[u8], name: &str) -> Result<Vec<PartHead>, ImageFileError> {
    let damaged = |why: Damage| ImageFileError::Damaged { name: name.into(), why: why.into() };
    let unsupported = |what: String, hint| ImageFileError::Unsupported { name: name.into(), what, hint };
    let (version, raw) = headers(bytes).map_err(damaged)?;
    if version & 0xff != 2 {
        return Err(unsupported(format!("EXR version {}", version & 0xff), ""));
    }
    if version & !(0xff | TILED | LONG_NAMES | DEEP | MULTIPART) != 0 {
        return Err(unsupported(format!("unknown EXR version flags ({version:#x})"), ""));
    }
    let mut parts = Vec::with_capacity(raw.len());
    let mut values = 0_u64;
    for attributes in &raw {
        let deep = version & DEEP != 0
            || attributes.iter().any(|a| a.name == b"type" && a.value.starts_with(b"deep"));
        if deep {
            return Err(unsupported("deep data".into(), "; flatten it first"));
        }
        let part = part_head(attributes).map_err(|stop| match stop {
            Stop::Damage(why) => damaged(why),
            Stop::Subsampled(channel) => unsupported(
                format!("a subsampled channel ({channel:?}; luminance-chroma?)"),
                "; convert it to RGB first",
            ),
        })?;
        values =
            values.saturating_add((part.window.pixels() as u64).saturating_mul(part.channels.len() as u64));
        if values > MAX_VALUES {
            return Err(ImageFileError::TooLarge {
                name: name.into(),
                width: part.window.width.into(),
                height: part.window.height.into(),
                channels: part.channels.len() as u64,
            });
        }
        parts.push(part);
    }
    // A raster holds floats, whatever the file does.
    check_declared(values * 4, bytes.len(), name)?;
    Ok(parts)
}

enum Stop {
    Damage(Damage),
    Subsampled(String),
}

impl From<Damage> for Stop {
    fn from(why: Damage) -> Self {
        Self::Damage(why)
    }
}

fn part_head(attributes: &[RawAttribute<'_>]) -> Result<PartHead, Stop> {
    let find = |name: &str| attributes.iter().find(|a| a.name == name.as_bytes()).map(|a| a.value);
    let window = window(find("dataWindow").ok_or("it has no dataWindow")?)?;
    let display = self::window(find("displayWindow").ok_or("it has no displayWindow")?)?;
    let channels = channels(find("channels").ok_or("it has no channels")?)?;
    if let Some(tiles) = find("tiles") {
        // A tile is never larger than what it tiles in a file that was written in earnest, but the size is only bounded by
        // the format's 32 bits; the product must not overflow later.
        let mut cursor = Cursor { bytes: tiles, at: 0 };
        let (x, y) = (cursor.i32()?, cursor.i32()?);
        if x < 1 || y < 1 || i64::from(x).saturating_mul(y.into()) > MAX_VALUES as i64 {
            return Err(Stop::Damage("its tile size is not sensible"));
        }
    }
    let name = find("name").map(|v| String::from_utf8_lossy(v).into_owned()).unwrap_or_default();
    Ok(PartHead { name, window, display, channels, attributes: custom(attributes) })
}

/// A box of four corners, both inclusive.
fn window(value: &[u8]) -> Result<Window, Damage> {
    let mut cursor = Cursor { bytes: value, at: 0 };
    let [x0, y0, x1, y1] = [cursor.i32()?, cursor.i32()?, cursor.i32()?, cursor.i32()?];
    if [x0, y0, x1, y1].iter().any(|&v| i64::from(v).abs() > MAX_COORDINATE) {
        return Err("a window's coordinates are out of range");
    }
    if x1 < x0 || y1 < y0 {
        return Err("a window is empty");
    }
    Ok(Window { x: x0, y: y0, width: (x1 - x0 + 1) as u32, height: (y1 - y0 + 1) as u32 })
}

fn channels(value: &[u8]) -> Result<Vec<ChannelHead>, Stop> {
    let mut cursor = Cursor { bytes: value, at: 0 };
    let mut channels = Vec::new();
    loop {
        let name = cursor.text()?;
        if name.is_empty() {
            break;
        }
        let name = String::from_utf8_lossy(name).into_owned();
        let sample_type = match cursor.i32()? {
            0 => SampleType::U32,
            1 => SampleType::F16,
            2 => SampleType::F32,
            _ => return Err(Stop::Damage("a channel has an unknown type")),
        };
        cursor.take(4)?; // how lossy compression should quantise, and padding
        if (cursor.i32()?, cursor.i32()?) != (1, 1) {
            return Err(Stop::Subsampled(name));
        }
        channels.push(ChannelHead { name, sample_type });
    }
    if channels.is_empty() {
        return Err(Stop::Damage("it has no channels"));
    }
    Ok(channels)
}

/// The text, int and float attributes that don't describe the structure.
fn custom(attributes: &[RawAttribute<'_>]) -> Vec<(String, Attribute)> {
    let mut kept = Vec::new();
    for attribute in attributes {
        let name = String::from_utf8_lossy(attribute.name).into_owned();
        if STRUCTURE.contains(&name.as_str()) {
            continue;
        }
        let word = <[u8; 4]>::try_from(attribute.value);
        let value = match (attribute.kind, word) {
            (b"string", _) => Attribute::Text(String::from_utf8_lossy(attribute.value).into_owned()),
            (b"int", Ok(word)) => Attribute::Int(i32::from_le_bytes(word)),
            (b"float", Ok(word)) => Attribute::Float(f32::from_le_bytes(word)),
            _ => continue,
        };
        kept.push((name, value));
    }
    kept
}

/// Puts the attributes of every header in the order of their names, in place: the `exr` crate writes them in a hash map's
/// order, which differs from run to run.
pub(super) fn sort_attributes(bytes: &mut [u8]) -> Result<(), ImageFileError> {
    let sorted: Vec<(usize, Vec<u8>)> = {
        let (_, parts) = headers(bytes)
            .map_err(|why| ImageFileError::Encode { element: "the header".into(), why: why.into() })?;
        parts
            .into_iter()
            .filter_map(|mut attributes| {
                let start = attributes.first()?.extent.start;
                attributes.sort_by(|a, b| a.name.cmp(b.name));
                Some((start, attributes.iter().flat_map(|a| &bytes[a.extent.clone()]).copied().collect()))
            })
            .collect()
    };
    for (start, header) in sorted {
        bytes[start..start + header.len()].copy_from_slice(&header);
    }
    Ok(())
}
