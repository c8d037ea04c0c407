//! The stream of attributes (mode 0): differences byte by byte, and in version 1 also of 16-bit and 32-bit numbers.

use super::{byte, take};

/// The `count` elements of `stride` bytes, a multiple of 4 up to 256, in a stream.
pub(super) fn decode(mut data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let (is_v1, modes, least) = match byte(&mut data)? {
        0xa0 => (false, 0, 32),
        0xa1 => (true, stride / 4, 24),
        _ => return None,
    };
    let (mut data, tail) = data.split_at_checked(data.len().checked_sub((stride + modes).max(least))?)?;
    let (baseline, modes) = tail[tail.len() - stride - modes..].split_at(stride);
    let channels: Vec<Channel> = match is_v1 {
        true => modes.iter().map(|&mode| Channel::of(mode)).collect::<Option<_>>()?,
        false => vec![Channel::Bytes; stride / 4],
    };
    let mut last = baseline.to_vec();
    let largest = ((8192 / stride) & !15).min(256);
    let mut out = vec![0; count * stride];
    for block in out.chunks_mut(largest * stride) {
        let controls = if is_v1 { take(&mut data, stride / 4)? } else { &[] };
        for k in 0..stride {
            let control = controls.get(k / 4).map(|c| Control::of(c >> (k % 4 * 2) & 3));
            read_deltas(&mut data, control.unwrap_or(Control::Version0), block, stride, k)?;
        }
        for element in block.chunks_mut(stride) {
            let parts = element.as_chunks_mut::<4>().0.iter_mut().zip(last.as_chunks_mut::<4>().0);
            for ((delta, last), channel) in parts.zip(&channels) {
                *last = channel.next(*last, *delta);
                *delta = *last;
            }
        }
    }
    data.is_empty().then_some(out)
}

/// How the differences of one byte of a block's elements are stored.
#[derive(Clone, Copy)]
enum Control {
    /// Groups of 0, 2, 4 or 8 bits a difference.
    Version0,
    /// Groups of 0, 1, 2 or 4 bits.
    Short,
    /// Groups of 1, 2, 4 or 8 bits.
    Long,
    /// All are 0.
    Zero,
    /// All are bytes, without groups.
    Literal,
}

impl Control {
    fn of(bits: u8) -> Self {
        match bits {
            0 => Self::Short,
            1 => Self::Long,
            2 => Self::Zero,
            _ => Self::Literal,
        }
    }

    /// The bits of a difference in a group of which the header says `mode`.
    fn bits(self, mode: u8) -> u32 {
        let by_mode = match self {
            Self::Version0 => [0, 2, 4, 8],
            Self::Short => [0, 1, 2, 4],
            Self::Long => [1, 2, 4, 8],
            Self::Zero => [0; 4],
            Self::Literal => [8; 4],
        };
        by_mode[usize::from(mode & 3)]
    }
}

/// Puts the differences of the bytes `k` of the elements of `block` in their place.
fn read_deltas(data: &mut &[u8], control: Control, block: &mut [u8], stride: usize, k: usize) -> Option<()> {
    let elements = block.len() / stride;
    let groups = elements.div_ceil(16);
    match control {
        Control::Zero => return Some(()),
        Control::Literal => {
            let bytes = take(data, elements)?;
            for (i, &delta) in bytes.iter().enumerate() {
                block[i * stride + k] = delta;
            }
            return Some(());
        }
        Control::Version0 | Control::Short | Control::Long => {}
    }
    let headers = take(data, groups.div_ceil(4))?;
    for group in 0..groups {
        let deltas = group_of(data, control.bits(headers[group / 4] >> (group % 4 * 2)))?;
        for (i, delta) in deltas.into_iter().enumerate().take(elements - group * 16) {
            block[(group * 16 + i) * stride + k] = delta;
        }
    }
    Some(())
}

/// Sixteen differences of so many bits; all bits set stand for a byte that follows them.
fn group_of(data: &mut &[u8], bits: u32) -> Option<[u8; 16]> {
    let mut deltas = [0; 16];
    match bits {
        0 => {}
        8 => deltas.copy_from_slice(take(data, 16)?),
        _ => {
            let bits = bits as usize;
            let each = 8 / bits;
            let escape = (1u8 << bits) - 1;
            let packed = take(data, 16 / each)?;
            for (i, delta) in deltas.iter_mut().enumerate() {
                // Single bits begin with the lowest, others with the highest.
                let shift = if bits == 1 { i % 8 } else { 8 - bits - i % each * bits };
                let value = packed[i / each] >> shift & escape;
                *delta = if value == escape { byte(data)? } else { value };
            }
        }
    }
    Some(deltas)
}

/// What the differences of four bytes are of.
#[derive(Clone, Copy)]
enum Channel {
    /// Each byte, zigzag.
    Bytes,
    /// Two 16-bit numbers, zigzag.
    Shorts,
    /// The bits of a 32-bit number, rotated to the right by so many: the encoder, of whose rotation the extension speaks, turns them left.
    Xor(u32),
}

impl Channel {
    fn of(mode: u8) -> Option<Self> {
        match (mode & 15, mode >> 4) {
            (0, 0) => Some(Self::Bytes),
            (1, 0) => Some(Self::Shorts),
            (2, rotation) => Some(Self::Xor(u32::from(rotation))),
            _ => None,
        }
    }

    /// What comes after `last`.
    fn next(self, last: [u8; 4], delta: [u8; 4]) -> [u8; 4] {
        match self {
            Self::Bytes => std::array::from_fn(|i| {
                let d = delta[i];
                last[i].wrapping_add(if d & 1 != 0 { !(d >> 1) } else { d >> 1 })
            }),
            Self::Shorts => {
                let next = |i: usize| {
                    let d = u16::from_le_bytes([delta[i], delta[i + 1]]);
                    let d = if d & 1 != 0 { !(d >> 1) } else { d >> 1 };
                    u16::from_le_bytes([last[i], last[i + 1]]).wrapping_add(d).to_le_bytes()
                };
                let ([a, b], [c, d]) = (next(0), next(2));
                [a, b, c, d]
            }
            Self::Xor(rotation) => {
                (u32::from_le_bytes(last) ^ u32::from_le_bytes(delta).rotate_right(rotation)).to_le_bytes()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The README's example of sixteen differences of 4 bits with two escapes.
    #[test]
    fn the_specifications_example_is_decoded() {
        let mut data: &[u8] = &[0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
        let zigzag = |v: u8| if v & 1 != 0 { !(v >> 1) as i8 } else { (v >> 1) as i8 };
        let found = group_of(&mut data, 4).unwrap().map(zigzag);
        assert_eq!(found, [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]);
        assert!(data.is_empty());
    }

    /// `version1.bin` is what meshoptimizer 1.3.0 makes of these elements (encodeVertexBufferLevel, level 3, version 1): all three kinds
    /// of channels, and bytes stored with control modes of every kind.
    #[test]
    fn version_1_is_read_as_the_reference_writes_it() {
        let stream = include_bytes!("version1.bin");
        let mut state = 1u32;
        let mut expected = Vec::new();
        for i in 0..300u16 {
            expected.extend((f32::from(i) * 0.25 + 100.0).to_le_bytes());
            expected.extend(i.wrapping_mul(300).wrapping_sub(40_000).to_le_bytes());
            expected.extend((i % 7).to_le_bytes());
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let spike = if i % 40 == 0 { 200 } else { 0 };
            expected.extend([(i >> 3) as u8, (state >> 24) as u8, 5, spike]);
            expected.extend(0x0102_0304u32.to_le_bytes());
        }
        assert!(decode(stream, 300, 16).unwrap() == expected);
        for length in 0..stream.len() {
            assert!(decode(&stream[..length], 300, 16).as_ref() != Some(&expected), "{length}");
        }
    }

    #[test]
    fn attributes_are_differences_from_the_tail() {
        // Two elements of 4 bytes: byte 0 has differences of +1 and -1, the others none.
        let mut data = vec![0xa0, 1, 0b1001_0000, 0, 0, 0, 0, 0, 0];
        data.extend([0; 28]);
        data.extend([7, 8, 9, 10]);
        assert_eq!(decode(&data, 2, 4).unwrap(), [8, 8, 9, 10, 7, 8, 9, 10]);
        for length in 0..data.len() {
            assert!(decode(&data[..length], 2, 4).is_none(), "{length}");
        }
    }
}
