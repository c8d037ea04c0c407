//! What is undone after the attributes are decoded.

/// Filter 1: unit vectors.
pub(super) fn octahedral(bytes: &mut [u8], stride: usize) {
    if stride == 8 {
        return map_shorts(bytes, |[x, y, z, w]| {
            let [x, y, z] = octahedral_vector([x, y, z], 32767.0);
            [x, y, z, w]
        });
    }
    for v in bytes.as_chunks_mut::<4>().0 {
        let [x, y, z, w] = v.map(|b| i16::from(b as i8));
        let [x, y, z] = octahedral_vector([x, y, z], 127.0);
        *v = [x as i8 as u8, y as i8 as u8, z as i8 as u8, w as u8];
    }
}

/// Filter 2: rotations.
pub(super) fn quaternion(bytes: &mut [u8]) {
    map_shorts(bytes, rotation);
}

/// Filter 3: floats as 24 bits times a power of two of 8.
pub(super) fn exponential(bytes: &mut [u8]) {
    for v in bytes.as_chunks_mut::<4>().0 {
        let word = i32::from_le_bytes(*v);
        *v = libm::ldexpf((word << 8 >> 8) as f32, word >> 24).to_le_bytes();
    }
}

/// Filter 4: colours as luma, two chromas and alpha, whose highest bit tells how many bits there are.
pub(super) fn color(bytes: &mut [u8], stride: usize) {
    if stride == 8 {
        return map_shorts(bytes, |[y, co, cg, a]| {
            rgba([i32::from(y as u16), co.into(), cg.into(), i32::from(a as u16)], 65535.0).map(|c| c as i16)
        });
    }
    for v in bytes.as_chunks_mut::<4>().0 {
        let [y, co, cg, a] = *v;
        let signed = |b: u8| i32::from(b as i8);
        *v = rgba([y.into(), signed(co), signed(cg), a.into()], 255.0).map(|c| c as u8);
    }
}

/// Red, green, blue and alpha as integers up to `max`.
fn rgba([y, co, cg, a]: [i32; 4], max: f32) -> [u16; 4] {
    let one = (1 << (32 - a.leading_zeros())) - 1;
    let low = a & (one >> 1);
    // Alpha has a bit less than the others.
    let channels = [y + co - cg, y + cg, y - co - cg, low << 1 | low & 1];
    channels.map(|c| (c as f32 * (max / one as f32)).round().clamp(0.0, max) as u16)
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
fn octahedral_vector(v: [i16; 3], max: f32) -> [i16; 3] {
    let [x, y, one] = v.map(f32::from);
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let t = z.min(0.0);
    let (x, y) = (x - t.copysign(x), y - t.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|c| (c / length * max).round() as i16)
}

/// Filter 2: a rotation without its largest component, whose number stands in the last two bits.
fn rotation(v: [i16; 4]) -> [i16; 4] {
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

    #[test]
    fn filters_give_unit_vectors_and_floats() {
        assert_eq!(octahedral_vector([0, 0, 127], 127.0), [0, 0, 127]);
        assert_eq!(octahedral_vector([511, 0, 511], 32767.0), [32767, 0, 0]);
        assert_eq!(octahedral_vector([127, 127, 127], 127.0), [0, 0, -127]);
        assert_eq!(octahedral_vector([0, 0, 0], 127.0), [0, 0, 0], "no unit: nothing sensible");
        assert_eq!(rotation([0, 0, 0, 2044]), [32767, 0, 0, 0]);
        assert_eq!(rotation([2047, 0, 0, 2047]), [23170, 0, 0, 23170]);
    }

    #[test]
    fn colours_come_back_from_luma_and_chroma() {
        // As meshoptimizer 1.3.0 encodes and decodes (1, 0.5, 0.25, 1), (0, 0.2, 1, 0.5) and so on with 8, 6 and 12 bits.
        let hex = |text: &str| -> Vec<u8> {
            (0..text.len() / 2).map(|i| u8::from_str_radix(&text[2 * i..2 * i + 2], 16).unwrap()).collect()
        };
        for (stride, filtered, decoded) in [
            (4, "905ff1ff5a81dac08de75980ff0000ff", "fe8140ff0134ff801be64d00ffffffff"),
            (4, "2417fd3f17e1f73023fa16203f00003f", "fb8641ff0439ff821ce74d00ffffffff"),
            (
                8,
                "0009ff0501ffff0f9a0501f89afd000ccd0867fe99050008ff0f00000000ff0f",
                "efff18800440ffff10004333ffff0880b2196ee6d44c0000ffffffffffffffff",
            ),
        ] {
            let mut bytes = hex(filtered);
            color(&mut bytes, stride);
            // The extension leaves the last place of 16 bits to the implementation.
            let numbers = |bytes: &[u8]| -> Vec<i32> {
                match stride {
                    4 => bytes.iter().map(|&b| b.into()).collect(),
                    _ => bytes.as_chunks::<2>().0.iter().map(|&b| u16::from_le_bytes(b).into()).collect(),
                }
            };
            let off =
                numbers(&bytes).into_iter().zip(numbers(&hex(decoded))).map(|(a, b)| (a - b).abs()).max();
            assert!(off <= Some(i32::from(stride == 8)), "{filtered}: {off:?}");
        }
        assert_eq!(rgba([0, 0, 0, 0], 255.0).len(), 4, "no bits at all is no panic");
    }
}
