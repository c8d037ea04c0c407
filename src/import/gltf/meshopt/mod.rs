//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views that are decoded before anything reads them.
//!
//! Source: the extensions' READMEs, appendix A (bitstream) and B (filters). The second adds version 1 of the attributes' stream and the
//! colour filter. Every reading of the data is checked; what is damaged has no decoding.

mod attributes;
mod filters;
mod indices;

use gltf::json::buffer::View;
use serde::Deserialize;

use super::error::GltfError;

/// The extensions' names.
const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Whether one of the extensions is among those that a file uses.
pub(super) fn is_used(extensions: &[String]) -> bool {
    extensions.iter().any(|e| EXTENSIONS.contains(&e.as_str()))
}

/// The extension's object in a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    /// The buffer that holds the compressed data.
    pub(super) buffer: usize,
    /// Where the data begins in it.
    #[serde(default)]
    pub(super) byte_offset: u64,
    /// The size of the data.
    pub(super) byte_length: u64,
    byte_stride: usize,
    count: u64,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

/// How the data is compressed.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// What is undone after decompression.
#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

impl Compressed {
    /// What the extension says about `view`, if it is there.
    pub(super) fn of(view: &View) -> Result<Option<Self>, GltfError> {
        let of = |name: &&str| view.extensions.as_ref().and_then(|e| e.others.get(*name));
        let json = EXTENSIONS.iter().find_map(of);
        Ok(json.map(|json| gltf::json::deserialize::from_value(json.clone())).transpose()?)
    }

    /// The content of `view`, called `element`, from its compressed `data`.
    pub(super) fn decode(&self, view: &View, data: &[u8], element: &str) -> Result<Vec<u8>, GltfError> {
        let invalid = |expected| GltfError::Invalid {
            element: element.to_owned(),
            property: "meshopt_compression",
            expected,
        };
        let stride = self.byte_stride;
        let fits = match (self.mode, self.filter) {
            (Mode::Attributes, Filter::None | Filter::Exponential) => stride.is_multiple_of(4),
            (Mode::Attributes, Filter::Octahedral | Filter::Color) => stride == 4 || stride == 8,
            (Mode::Attributes, Filter::Quaternion) => stride == 8,
            (Mode::Triangles, Filter::None) => self.count.is_multiple_of(3) && (stride == 2 || stride == 4),
            (Mode::Indices, Filter::None) => stride == 2 || stride == 4,
            (Mode::Triangles | Mode::Indices, _) => false,
        };
        if !fits || !(1..=256).contains(&stride) {
            return Err(invalid("a byteStride and a filter that the mode allows"));
        }
        let size = u128::from(self.count) * stride as u128;
        if size != u128::from(view.byte_length.0) {
            return Err(invalid("count · byteStride bytes, as the view has"));
        }
        // A byte may stand for 256 elements' bytes, four positions of each: what claims more is damaged, and nothing is allocated for it.
        let damaged = || invalid("undamaged data of a known version");
        if size > data.len() as u128 * 1024 {
            return Err(damaged());
        }
        let count = self.count as usize;
        let mut bytes = match self.mode {
            Mode::Attributes => attributes::decode(data, count, stride),
            Mode::Triangles => indices::triangles(data, count).and_then(|list| indices::store(&list, stride)),
            Mode::Indices => indices::sequence(data, count).and_then(|list| indices::store(&list, stride)),
        }
        .ok_or_else(damaged)?;
        match self.filter {
            Filter::None => {}
            Filter::Octahedral => filters::octahedral(&mut bytes, stride),
            Filter::Quaternion => filters::quaternion(&mut bytes),
            Filter::Exponential => filters::exponential(&mut bytes),
            Filter::Color => filters::color(&mut bytes, stride),
        }
        Ok(bytes)
    }
}

/// The first of `data`, which then begins behind it.
fn byte(data: &mut &[u8]) -> Option<u8> {
    let (&first, rest) = data.split_first()?;
    *data = rest;
    Some(first)
}

/// The first `count` of `data`, which then begins behind them.
fn take<'a>(data: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (taken, rest) = data.split_at_checked(count)?;
    *data = rest;
    Some(taken)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any bytes at all decode to something or to nothing.
    #[test]
    fn no_data_causes_a_panic() {
        let mut state = 1u32;
        for round in 0..20_000 {
            let mut data: Vec<u8> = (0..round % 80)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 24) as u8
                })
                .collect();
            for header in [0xa0, 0xa1, 0xe1, 0xd1] {
                if let Some(first) = data.first_mut() {
                    *first = header;
                }
                for count in [0, 3, 12, 300] {
                    let _ = (
                        attributes::decode(&data, count, 4),
                        indices::triangles(&data, count),
                        indices::sequence(&data, count),
                    );
                }
            }
        }
    }
}
