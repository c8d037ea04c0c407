//! EXT_meshopt_compression: buffer views that are decoded before anything reads them.
//!
//! Source: the extension's README, appendix A (bitstream) and B (filters). Every reading of the data is checked; what is damaged
//! has no decoding.

use gltf::json::buffer::View;
use serde::Deserialize;

use super::error::GltfError;

/// The extension's name.
pub(super) const EXTENSION: &str = "EXT_meshopt_compression";

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
}

impl Compressed {
    /// What the extension says about `view`, if it is there.
    pub(super) fn of(view: &View) -> Result<Option<Self>, GltfError> {
        let json = view.extensions.as_ref().and_then(|e| e.others.get(EXTENSION));
        Ok(json.map(|json| gltf::json::deserialize::from_value(json.clone())).transpose()?)
    }

    /// The content of `view`, called `element`, from its compressed `data`.
    pub(super) fn decode(&self, view: &View, data: &[u8], element: &str) -> Result<Vec<u8>, GltfError> {
        let invalid =
            |expected| GltfError::Invalid { element: element.to_owned(), property: EXTENSION, expected };
        let stride = self.byte_stride;
        let fits = match (self.mode, self.filter) {
            (Mode::Attributes, Filter::None | Filter::Exponential) => stride.is_multiple_of(4),
            (Mode::Attributes, Filter::Octahedral) => stride == 4 || stride == 8,
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
        // Two bits may stand for sixteen bytes: what claims more is damaged, and nothing is allocated for it.
        let damaged = || invalid("undamaged data of the format's version 0");
        if size > data.len() as u128 * 64 {
            return Err(damaged());
        }
        let count = self.count as usize;
        let mut bytes = match self.mode {
            Mode::Attributes => attributes(data, count, stride),
            Mode::Triangles => triangles(data, count).and_then(|indices| store(&indices, stride)),
            Mode::Indices => indices(data, count).and_then(|indices| store(&indices, stride)),
        }
        .ok_or_else(damaged)?;
        match self.filter {
            Filter::None => {}
            Filter::Octahedral if stride == 4 => {
                for v in bytes.as_chunks_mut::<4>().0 {
                    let [x, y, z, w] = v.map(|b| i16::from(b as i8));
                    let [x, y, z] = octahedral([x, y, z], 127.0);
                    *v = [x as i8 as u8, y as i8 as u8, z as i8 as u8, w as u8];
                }
            }
            Filter::Octahedral => map_shorts(&mut bytes, |[x, y, z, w]| {
                let [x, y, z] = octahedral([x, y, z], 32767.0);
                [x, y, z, w]
            }),
            Filter::Quaternion => map_shorts(&mut bytes, quaternion),
            Filter::Exponential => {
                for v in bytes.as_chunks_mut::<4>().0 {
                    let word = i32::from_le_bytes(*v);
                    *v = libm::ldexpf((word << 8 >> 8) as f32, word >> 24).to_le_bytes();
                }
            }
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

/// Mode 0: `count` elements of `stride` bytes, as differences byte by byte.
fn attributes(mut data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    if byte(&mut data)? != 0xa0 {
        return None;
    }
    let (mut data, tail) = data.split_at_checked(data.len().checked_sub(stride.max(32))?)?;
    let mut last = tail[tail.len() - stride..].to_vec();
    let largest = ((8192 / stride) & !15).min(256);
    let mut out = vec![0; count * stride];
    for block in out.chunks_mut(largest * stride) {
        let elements = block.len() / stride;
        let groups = elements.div_ceil(16);
        for (k, last) in last.iter_mut().enumerate() {
            let headers = take(&mut data, groups.div_ceil(4))?;
            for group in 0..groups {
                let deltas = deltas(&mut data, headers[group / 4] >> (group % 4 * 2) & 3)?;
                for (i, delta) in deltas.into_iter().enumerate().take(elements - group * 16) {
                    *last = last.wrapping_add(if delta & 1 != 0 { !(delta >> 1) } else { delta >> 1 });
                    block[(group * 16 + i) * stride + k] = *last;
                }
            }
        }
    }
    data.is_empty().then_some(out)
}

/// The sixteen zigzag differences of a group, stored as `mode` says: none, with 2 or 4 bits and an escape, or as bytes.
fn deltas(data: &mut &[u8], mode: u8) -> Option<[u8; 16]> {
    let mut deltas = [0; 16];
    match mode {
        0 => {}
        3 => deltas.copy_from_slice(take(data, 16)?),
        _ => {
            let bits = usize::from(mode) * 2;
            let each = 8 / bits;
            let escape = (1u8 << bits) - 1;
            let packed = take(data, 16 / each)?;
            for (i, delta) in deltas.iter_mut().enumerate() {
                let value = packed[i / each] >> (8 - bits - i % each * bits) & escape;
                *delta = if value == escape { byte(data)? } else { value };
            }
        }
    }
    Some(deltas)
}

/// An integer of seven bits a byte.
fn varint(data: &mut &[u8]) -> Option<u32> {
    let mut value = 0u32;
    for shift in (0..35).step_by(7) {
        let next = byte(data)?;
        value |= u32::from(next & 0x7f) << shift;
        if next < 0x80 {
            return Some(value);
        }
    }
    None
}

/// The signed difference that a zigzag code stands for.
fn zigzag(code: u32) -> u32 {
    if code & 1 != 0 { !(code >> 1) } else { code >> 1 }
}

/// The last sixteen of something, the latest at 0.
struct Recent<T>([T; 16], usize);

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self([T::default(); 16], 0)
    }

    fn push(&mut self, value: T) {
        self.0[self.1 % 16] = value;
        self.1 = (self.1 + 1) % 16;
    }

    fn get(&self, back: u8) -> T {
        self.0[(self.1 + 31 - usize::from(back)) % 16]
    }
}

/// Mode 1: the indices of triangles that share edges and vertices with the latest ones.
fn triangles(mut data: &[u8], count: usize) -> Option<Vec<u32>> {
    if byte(&mut data)? != 0xe1 {
        return None;
    }
    let codes = take(&mut data, count / 3)?;
    let (mut data, table) = data.split_at_checked(data.len().checked_sub(16)?)?;
    let mut edges = Recent::<(u32, u32)>::new();
    let mut vertices = Recent::<u32>::new();
    let (mut next, mut last) = (0u32, 0u32);
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let (a, b) = edges.get(high);
            let c = match low {
                0 => step(&mut next),
                1..=12 => vertices.get(low),
                13 | 14 => {
                    last = if low == 13 { last.wrapping_sub(1) } else { last.wrapping_add(1) };
                    last
                }
                _ => explicit(&mut data, &mut last)?,
            };
            edges.push((c, b));
            edges.push((a, c));
            if low == 0 || low > 12 {
                vertices.push(c);
            }
            out.extend([a, b, c]);
            continue;
        }
        let by_table = low < 14;
        let pair = if by_table { table[usize::from(low)] } else { byte(&mut data)? };
        if !by_table && pair == 0 {
            next = 0;
        }
        let a = if low == 15 { explicit(&mut data, &mut last)? } else { step(&mut next) };
        let mut other = |nibble: u8| match nibble {
            0 => Some(step(&mut next)),
            15 if !by_table => explicit(&mut data, &mut last),
            recent => Some(vertices.get(recent - 1)),
        };
        let (b, c) = (other(pair >> 4)?, other(pair & 15)?);
        let is_new = |nibble: u8| nibble == 0 || (nibble == 15 && !by_table);
        edges.push((b, a));
        edges.push((c, b));
        edges.push((a, c));
        vertices.push(a);
        if is_new(pair >> 4) {
            vertices.push(b);
        }
        if is_new(pair & 15) {
            vertices.push(c);
        }
        out.extend([a, b, c]);
    }
    data.is_empty().then_some(out)
}

/// The index `next`, which then is one higher.
fn step(next: &mut u32) -> u32 {
    let index = *next;
    *next = next.wrapping_add(1);
    index
}

/// An index by its difference to the `last` one.
fn explicit(data: &mut &[u8], last: &mut u32) -> Option<u32> {
    *last = last.wrapping_add(zigzag(varint(data)?));
    Some(*last)
}

/// Mode 2: indices by their differences to one of two others.
fn indices(mut data: &[u8], count: usize) -> Option<Vec<u32>> {
    if byte(&mut data)? != 0xd1 {
        return None;
    }
    let (mut data, _) = data.split_at_checked(data.len().checked_sub(4)?)?;
    let mut last = [0u32; 2];
    let mut out = Vec::new();
    for _ in 0..count {
        let code = varint(&mut data)?;
        let last = &mut last[(code & 1) as usize];
        *last = last.wrapping_add(zigzag(code >> 1));
        out.push(*last);
    }
    data.is_empty().then_some(out)
}

/// Indices as bytes; none if one doesn't fit.
fn store(indices: &[u32], stride: usize) -> Option<Vec<u8>> {
    if stride == 4 {
        return Some(indices.iter().flat_map(|i| i.to_le_bytes()).collect());
    }
    let shorts: Result<Vec<u16>, _> = indices.iter().map(|&i| u16::try_from(i)).collect();
    Some(shorts.ok()?.into_iter().flat_map(u16::to_le_bytes).collect())
}

fn map_shorts(bytes: &mut [u8], map: impl Fn([i16; 4]) -> [i16; 4]) {
    for v in bytes.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, f, g, h] = *v;
        let [x, y, z, w] =
            map([[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes)).map(i16::to_le_bytes);
        *v = [x[0], x[1], y[0], y[1], z[0], z[1], w[0], w[1]];
    }
}

/// Filter 1: a unit vector, whose third number stands for 1, scaled to integers up to `max`.
fn octahedral(v: [i16; 3], max: f32) -> [i16; 3] {
    let [x, y, one] = v.map(f32::from);
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let t = z.min(0.0);
    let (x, y) = (x - t.copysign(x), y - t.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|c| (c / length * max).round() as i16)
}

/// Filter 2: a rotation without its largest component, whose number stands in the last two bits.
fn quaternion(v: [i16; 4]) -> [i16; 4] {
    let one = f32::from(v[3] | 3);
    let [x, y, z] = [v[0], v[1], v[2]].map(|c| f32::from(c) / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (v[3] & 3) as usize;
    let mut out = [0; 4];
    for (i, c) in [w, x, y, z].into_iter().enumerate() {
        out[(largest + i) % 4] = (c * 32767.0).round() as i16;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The README's example of sixteen differences of 4 bits with two escapes.
    #[test]
    fn the_specifications_example_is_decoded() {
        let mut data: &[u8] = &[0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
        let zigzag = |v: u8| if v & 1 != 0 { !(v >> 1) as i8 } else { (v >> 1) as i8 };
        let found = deltas(&mut data, 2).unwrap().map(zigzag);
        assert_eq!(found, [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]);
        assert!(data.is_empty());
    }

    #[test]
    fn attributes_are_differences_from_the_tail() {
        // Two elements of 4 bytes: byte 0 has differences of +1 and -1, the others none.
        let mut data = vec![0xa0, 1, 0b1001_0000, 0, 0, 0, 0, 0, 0];
        data.extend([0; 28]);
        data.extend([7, 8, 9, 10]);
        assert_eq!(attributes(&data, 2, 4).unwrap(), [8, 8, 9, 10, 7, 8, 9, 10]);
        for length in 0..data.len() {
            assert!(attributes(&data[..length], 2, 4).is_none(), "{length}");
        }
    }

    #[test]
    fn indices_follow_two_baselines() {
        let mut data = vec![0xd1, 4, 0x81, 1, 2 << 1 | 1 << 1];
        data.extend([0; 4]);
        // +1 on the first, +32 on the second, then zigzag 3, -2, on the first.
        assert_eq!(indices(&data, 3).unwrap(), [1, 32, u32::MAX]);
        assert!(store(&[1, 70_000], 2).is_none() && indices(&data, 4).is_none());
    }

    #[test]
    fn filters_give_unit_vectors_and_floats() {
        assert_eq!(octahedral([0, 0, 127], 127.0), [0, 0, 127]);
        assert_eq!(octahedral([511, 0, 511], 32767.0), [32767, 0, 0]);
        assert_eq!(octahedral([127, 127, 127], 127.0), [0, 0, -127]);
        assert_eq!(octahedral([0, 0, 0], 127.0), [0, 0, 0], "no unit: nothing sensible");
        assert_eq!(quaternion([0, 0, 0, 2044]), [32767, 0, 0, 0]);
        assert_eq!(quaternion([2047, 0, 0, 2047]), [23170, 0, 0, 23170]);
    }

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
            for header in [0xa0, 0xe1, 0xd1] {
                if let Some(first) = data.first_mut() {
                    *first = header;
                }
                for count in [0, 3, 12, 300] {
                    let _ = (attributes(&data, count, 4), triangles(&data, count), indices(&data, count));
                }
            }
        }
    }
}
