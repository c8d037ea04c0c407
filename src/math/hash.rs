//! Integer hashing: the only source of randomness.

/// Mixes 64 bits so that every input bit reaches every output bit (the finaliser of SplitMix64, Steele et al. 2014).
#[inline]
pub const fn mix64(mut x: u64) -> u64 {
    x ^= x >> 30;
    x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^= x >> 27;
    x = x.wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash of two words, different for different orders.
#[inline]
pub const fn combine(a: u64, b: u64) -> u64 {
    mix64(a.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(mix64(b ^ 0xd1b5_4a32_d192_ed03)))
}

/// A float in [0, 1) from the upper 24 bits of a word: every value is representable and 1 never comes out.
#[inline]
pub const fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_flipped_bit_flips_about_half_of_the_output() {
        let mut flipped = 0u32;
        for x in 0..256u64 {
            for bit in 0..64 {
                flipped += (combine(7, x) ^ combine(7, x ^ (1 << bit))).count_ones();
            }
        }
        let mean = f64::from(flipped) / (256.0 * 64.0);
        assert!((mean - 32.0).abs() < 0.2, "{mean}");
    }

    #[test]
    fn unit_floats_stay_below_one() {
        assert_eq!(unit_f32(0), 0.0);
        assert!(unit_f32(u32::MAX) < 1.0);
    }
}
