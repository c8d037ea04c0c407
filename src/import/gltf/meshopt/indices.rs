//! Streams of indices: triangles (mode 1) and sequences (mode 2).

use super::{byte, take};

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
pub(super) fn triangles(mut data: &[u8], count: usize) -> Option<Vec<u32>> {
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
pub(super) fn sequence(mut data: &[u8], count: usize) -> Option<Vec<u32>> {
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
pub(super) fn store(indices: &[u32], stride: usize) -> Option<Vec<u8>> {
    if stride == 4 {
        return Some(indices.iter().flat_map(|i| i.to_le_bytes()).collect());
    }
    let shorts: Result<Vec<u16>, _> = indices.iter().map(|&i| u16::try_from(i)).collect();
    Some(shorts.ok()?.into_iter().flat_map(u16::to_le_bytes).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_follow_two_baselines() {
        let mut data = vec![0xd1, 4, 0x81, 1, 2 << 1 | 1 << 1];
        data.extend([0; 4]);
        // +1 on the first, +32 on the second, then zigzag 3, -2, on the first.
        assert_eq!(sequence(&data, 3).unwrap(), [1, 32, u32::MAX]);
        assert!(store(&[1, 70_000], 2).is_none() && sequence(&data, 4).is_none());
    }
}
