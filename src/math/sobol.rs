//! Owen-scrambled Sobol' points, four dimensions at a time, padded to any number of dimensions by hashing.
//!
//! Burley 2020, "Practical Hash-based Owen Scrambling" (JCGT 9:4), with the Laine-Karras-style hash of Vegdahl 2021,
//! "Building a Better LK Hash". Any number of samples gives a good set; powers of two give the best.

use super::hash::{combine, mix64, unit_f32};

/// The Sobol' generator matrices of the first four dimensions (Joe and Kuo 2008), as columns for each index bit from the lowest,
/// transposed so that one row holds what one index bit adds to each dimension.
const DIRECTIONS: [[u32; 4]; 32] = directions();

const fn directions() -> [[u32; 4]; 32] {
    let mut v = [[0u32; 4]; 32];
    let mut bit = 0;
    while bit < 32 {
        v[bit][0] = 1 << (31 - bit);
        bit += 1;
    }
    // (degree, inner coefficients of the primitive polynomial, initial direction numbers)
    let polynomials: [(usize, u32, [u32; 3]); 3] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];
    let mut d = 0;
    while d < 3 {
        let (s, a, m) = polynomials[d];
        let mut i = 0;
        while i < 32 {
            v[i][d + 1] = if i < s {
                m[i] << (31 - i)
            } else {
                let mut x = v[i - s][d + 1] ^ (v[i - s][d + 1] >> s);
                let mut k = 1;
                while k < s {
                    if (a >> (s - 1 - k)) & 1 == 1 {
                        x ^= v[i - k][d + 1];
                    }
                    k += 1;
                }
                x
            };
            i += 1;
        }
        d += 1;
    }
    v
}

/// What every value of every nibble of the index contributes: eight look-ups instead of 32 conditional additions.
///
/// Index and points are both kept with their bits in reverse, as the hash below takes and gives them.
const NIBBLES: [[[u32; 4]; 16]; 8] = nibbles();

const fn nibbles() -> [[[u32; 4]; 16]; 8] {
    let mut table = [[[0u32; 4]; 16]; 8];
    let mut n = 0;
    while n < 8 {
        let mut value = 0;
        while value < 16 {
            let mut bit = 0;
            while bit < 4 {
                if (value >> bit) & 1 == 1 {
                    let mut d = 0;
                    while d < 4 {
                        table[n][value][d] ^= DIRECTIONS[31 - (4 * n + bit)][d].reverse_bits();
                        d += 1;
                    }
                }
                bit += 1;
            }
            value += 1;
        }
        n += 1;
    }
    table
}

/// The unscrambled point of an index, as fixed-point fractions; the bits of index and fractions in reverse.
#[inline]
fn sobol4_reversed(reversed_index: u32) -> [u32; 4] {
    let mut point = [0u32; 4];
    for (n, table) in NIBBLES.iter().enumerate() {
        let part = table[(reversed_index >> (4 * n)) as usize & 15];
        for d in 0..4 {
            point[d] ^= part[d];
        }
    }
    point
}

/// Flips each bit depending on the seed and the bits below it: on reversed bits, Owen's nested uniform scramble in base 2, which flips
/// each bit depending on the bits above it.
#[inline]
const fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The random numbers of one camera path: a pure function of (seed, pixel, sample index, samples a pixel, path vertex, dimension).
///
/// A pixel's samples are `replicates` independently scrambled sets; sample i belongs to set i mod `replicates`.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    key: u64,
    /// Its place in its set, the bits in reverse.
    reversed_index: u32,
}

/// Pixels of a square of 2^`SQUARE_BITS` columns and rows take consecutive parts of one sequence.
const SQUARE_BITS: u32 = 2;

/// What a set of four numbers decides at a path vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Position on the film and on the lens.
    Camera = 0,
    /// Lobe, direction, and whether the path goes on.
    Bsdf = 1,
    /// Which light, and where on it.
    Light = 2,
    /// Whether the path passes through a partly opaque surface.
    Opacity = 3,
}

impl Sampler {
    /// The numbers of sample `sample` at pixel (x, y), independent of all other pixels.
    #[inline]
    pub fn new(seed: u64, x: u32, y: u32, sample: u32, replicates: u32) -> Self {
        let replicate = sample % replicates;
        let pixel = (u64::from(y) << 32) | u64::from(x);
        let key = combine(combine(seed, pixel), u64::from(replicate));
        Self { key, reversed_index: (sample / replicates).reverse_bits() }
    }

    /// The same where each pixel gets `samples`, and the pixels of a square of 4 × 4 complete each other: in the order of a Z-shaped
    /// curve they take consecutive parts of one sequence, so that what 2 × 2 or 4 × 4 of them have together is as evenly spread as what
    /// each has (Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels").
    #[inline]
    pub fn in_square(seed: u64, (x, y): (u32, u32), sample: u32, samples: u32, replicates: u32) -> Self {
        let square = Self::new(seed, x >> SQUARE_BITS, y >> SQUARE_BITS, sample, replicates);
        let place: u32 =
            (0..SQUARE_BITS).map(|bit| ((x >> bit & 1) | (y >> bit & 1) << 1) << (2 * bit)).sum();
        let part = samples.div_ceil(replicates).next_power_of_two();
        let index = place.wrapping_mul(part).wrapping_add(sample / replicates);
        Self { reversed_index: index.reverse_bits(), ..square }
    }

    /// Branch 0 or 1 of two: those of all samples of a replicate are consecutive parts of one sequence of twice as many.
    #[inline]
    #[must_use]
    pub fn branch(self, branch: u32) -> Self {
        Self { reversed_index: self.reversed_index >> 1 | branch << 31, ..self }
    }

    /// The same of branches that know nothing of each other.
    #[inline]
    #[must_use]
    pub fn independent_branch(self, branch: u32) -> Self {
        Self { key: combine(self.key, u64::from(branch)), ..self }
    }

    /// Four numbers in [0, 1) that are well distributed over the samples of a replicate, independent of all other sets.
    #[inline]
    pub fn set(&self, vertex: u32, purpose: Purpose) -> [f32; 4] {
        self.numbers(mix64(self.key ^ mix64((u64::from(vertex) << 8) | purpose as u64)))
    }

    /// As [`Self::set`], a set of its own for each `item` that is decided about at a vertex.
    #[inline]
    pub fn set_of(&self, vertex: u32, purpose: Purpose, item: u32) -> [f32; 4] {
        let place = mix64((u64::from(vertex) << 8) | purpose as u64);
        self.numbers(combine(self.key ^ place, u64::from(item)))
    }

    #[inline]
    fn numbers(&self, set: u64) -> [f32; 4] {
        let point = sobol4_reversed(laine_karras(self.reversed_index, set as u32));
        // Two words of 64 bits hold four seeds.
        let first = mix64((set >> 32).wrapping_add(0x9e37_79b9_7f4a_7c15));
        let second = mix64(first.wrapping_add(0x9e37_79b9_7f4a_7c15));
        let seeds = [first as u32, (first >> 32) as u32, second as u32, (second >> 32) as u32];
        std::array::from_fn(|d| unit_f32(laine_karras(point[d], seeds[d]).reverse_bits()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Number;

    #[test]
    fn every_power_of_two_prefix_is_stratified_in_each_dimension() {
        for seed in 0..20 {
            let points: Vec<_> =
                (0..256).map(|i| Sampler::new(seed, 3, 5, i, 1).set(2, Purpose::Bsdf)).collect();
            for log2 in 0..=8 {
                let n = 1usize << log2;
                for d in 0..4 {
                    let mut seen = vec![false; n];
                    for p in &points[..n] {
                        seen[(p[d] * n as f32) as usize] = true;
                    }
                    assert!(seen.iter().all(|&s| s), "seed {seed}, {n} points, dimension {d}");
                }
            }
        }
    }

    /// Sixteen pixels of four samples each, and four of them: as evenly spread as 64 and 16 samples of one.
    #[test]
    fn pixels_of_a_square_complete_each_other() {
        for seed in 0..20 {
            for (corner, side) in [((0, 0), 4u32), ((4, 8), 4), ((2, 0), 2), ((6, 6), 2), ((3, 5), 1)] {
                for replicates in [1, 2] {
                    let samples = 4 * replicates;
                    let pixels = (0..side * side).map(|i| (corner.0 + i % side, corner.1 + i / side));
                    let points = pixels.flat_map(|pixel| {
                        (0..samples).filter(|sample| sample % replicates == 0).map(move |sample| {
                            Sampler::in_square(seed, pixel, sample, samples, replicates)
                                .set(1, Purpose::Light)
                        })
                    });
                    let count = side * side * 4;
                    for d in 0..4 {
                        let mut places: Vec<u32> =
                            points.clone().map(|p| (p[d] * count as f32) as u32).collect();
                        places.sort_unstable();
                        assert_eq!(places, Vec::from_iter(0..count), "seed {seed}, side {side}");
                    }
                }
            }
        }
    }

    /// As evenly as twice as many samples, in each replicate.
    #[test]
    fn branches_of_a_pixels_samples_complete_each_other() {
        for (seed, replicates) in (0..20).flat_map(|seed| [1, 2].map(|replicates| (seed, replicates))) {
            let samples = (0..8 * replicates).filter(|sample| sample % replicates == 0);
            let samples = samples.map(|i| Sampler::in_square(seed, (5, 6), i, 8 * replicates, replicates));
            let branches = samples.flat_map(|sampler| [sampler.branch(0), sampler.branch(1)]);
            let points: Vec<_> = branches.map(|branch| branch.set(1, Purpose::Bsdf)).collect();
            for d in 0..4 {
                let mut places: Vec<u32> = points.iter().map(|p| (p[d] * 16.0) as u32).collect();
                places.sort_unstable();
                assert_eq!(places, Vec::from_iter(0..16), "seed {seed}, dimension {d}");
            }
        }
    }

    #[test]
    fn branches_that_know_nothing_of_each_other_are_unlike() {
        let sampler = Sampler::new(3, 1, 2, 0, 4);
        let sets = [0, 1].map(|branch| sampler.independent_branch(branch).set(1, Purpose::Bsdf));
        assert!((0..4).all(|d| sets[0][d] != sets[1][d]), "{sets:?}");
    }

    #[test]
    fn samples_in_squares_are_all_different() {
        let places = (0..8).flat_map(|y| (0..8).map(move |x| (x, y)));
        let all = places.flat_map(|place| (0..5).map(move |i| Sampler::in_square(7, place, i, 5, 1)));
        let mut all: Vec<_> = all.map(|s| (s.key, s.reversed_index)).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 8 * 8 * 5);
    }

    /// The first two dimensions are a (0, 2)-sequence: every elementary interval of 2^-k area holds one of 2^k points.
    #[test]
    fn first_two_dimensions_fill_every_elementary_interval() {
        let k = 6;
        let points: Vec<_> =
            (0..1 << k).map(|i| Sampler::new(9, 0, 0, i, 1).set(0, Purpose::Camera)).collect();
        for a in 0..=k {
            let (nx, ny) = (1usize << a, 1usize << (k - a));
            let mut seen = vec![false; nx * ny];
            for p in &points {
                seen[(p[0] * nx as f32) as usize * ny + (p[1] * ny as f32) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s), "{nx} × {ny}");
        }
    }

    /// The spread of the estimate of ∫ x·y·z·w over many scrambles, ours against the `sobol_burley` crate's.
    #[test]
    fn four_dimensional_error_matches_an_independent_implementation() {
        let n = 256;
        let rms = |estimate: &dyn Fn(u32) -> f64| {
            let trials = 200;
            let sum: f64 = (0..trials).map(|t| (estimate(t) - 1.0 / 16.0).sqr()).sum();
            (sum / f64::from(trials)).sqrt()
        };
        let product = |p: [f32; 4]| p.iter().map(|&v| f64::from(v)).product::<f64>();
        let ours = rms(&|t| {
            (0..n).map(|i| product(Sampler::new(u64::from(t), 0, 0, i, 1).set(0, Purpose::Bsdf))).sum::<f64>()
                / f64::from(n)
        });
        let theirs =
            rms(&|t| (0..n).map(|i| product(sobol_burley::sample_4d(i, 0, t))).sum::<f64>() / f64::from(n));
        let random = (1.0f64 / 81.0 - 1.0 / 256.0).sqrt() / f64::from(n).sqrt();
        assert!(ours < 1.25 * theirs, "ours {ours:e}, theirs {theirs:e}");
        assert!(ours < 0.2 * random, "ours {ours:e}, random {random:e}");
    }

    #[test]
    fn sets_of_different_vertices_purposes_and_replicates_are_uncorrelated() {
        let n = 4096;
        let streams: [&dyn Fn(u32) -> f32; 4] = [
            &|i| Sampler::new(1, 2, 3, i, 1).set(1, Purpose::Bsdf)[0],
            &|i| Sampler::new(1, 2, 3, i, 1).set(2, Purpose::Bsdf)[0],
            &|i| Sampler::new(1, 2, 3, i, 1).set(1, Purpose::Light)[0],
            &|i| Sampler::new(1, 2, 4, i, 1).set(1, Purpose::Bsdf)[0],
        ];
        for (a, f) in streams.iter().enumerate() {
            for g in &streams[a + 1..] {
                let covariance: f64 =
                    (0..n).map(|i| f64::from(f(i) - 0.5) * f64::from(g(i) - 0.5)).sum::<f64>() / f64::from(n);
                assert!((covariance * 12.0).abs() < 0.06, "correlation {}", covariance * 12.0);
            }
        }
    }
}
