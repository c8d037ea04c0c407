//! Triangles in the very same place, of which the builder sees one: of thousands it would make a tree thousands of levels deep, in a
//! time that grows with their square.

use glam::Vec3;

use crate::math::hash;

/// Triangles by where they are: those with the same three corners, in any order, share a place.
pub(super) struct Places {
    /// The lowest triangle of each place, ascending.
    firsts: Vec<u32>,
    /// The other triangles, each after the first of its place; ascending.
    others: Vec<(u32, u32)>,
}

impl Places {
    /// The places of `triangles`.
    pub(super) fn new(triangles: &[[Vec3; 3]]) -> Self {
        let mut hashes = suspects(triangles);
        hashes.sort_unstable();
        let corners = |t: u32| sorted_bits(&triangles[t as usize]);
        let mut others = Vec::new();
        for group in hashes.chunk_by(|(a, _), (b, _)| a == b).filter(|group| group.len() > 1) {
            let first = group[0].1;
            // A hash that two places share by chance leaves the second one's triangles apart: no harm is done.
            let same = group[1..].iter().filter(|(_, t)| corners(*t) == corners(first));
            others.extend(same.map(|&(_, t)| (first, t)));
        }
        others.sort_unstable();
        let mut is_first = vec![true; triangles.len()];
        others.iter().for_each(|&(_, t)| is_first[t as usize] = false);
        let firsts = (0..).zip(is_first).filter_map(|(t, is_first)| is_first.then_some(t)).collect();
        Self { firsts, others }
    }

    /// The lowest triangle of each place.
    pub(super) fn firsts(&self) -> &[u32] {
        &self.firsts
    }

    /// How many triangles are in a place.
    pub(super) fn count(&self, place: u32) -> u32 {
        1 + self.others_in(place).len() as u32
    }

    /// The triangles in a place, ascending.
    pub(super) fn triangles(&self, place: u32) -> impl Iterator<Item = u32> {
        let others = self.others_in(place).iter().map(|&(_, t)| t);
        std::iter::once(self.firsts[place as usize]).chain(others)
    }

    fn others_in(&self, place: u32) -> &[(u32, u32)] {
        let first = self.firsts[place as usize];
        let from = self.others.partition_point(|&(f, _)| f < first);
        let rest = &self.others[from..];
        &rest[..rest.partition_point(|&(f, _)| f == first)]
    }
}

/// The triangles that may share a place, with their hashes: few where none do, and those are soon sorted.
fn suspects(triangles: &[[Vec3; 3]]) -> Vec<(u64, u32)> {
    let hashes: Vec<u64> = triangles.iter().map(hash_of).collect();
    // A bit for each end of a hash, sixteen times as many as there are triangles.
    let bits = (hashes.len() * 16).next_power_of_two().max(64);
    let place = |hash: u64| {
        let bit = hash as usize & (bits - 1);
        (bit / 64, 1 << (bit % 64))
    };
    let (mut once, mut again) = (vec![0u64; bits / 64], vec![0u64; bits / 64]);
    for (word, bit) in hashes.iter().map(|&hash| place(hash)) {
        again[word] |= once[word] & bit;
        once[word] |= bit;
    }
    let is_suspect = |&(hash, _): &(u64, u32)| {
        let (word, bit) = place(hash);
        again[word] & bit != 0
    };
    hashes.into_iter().zip(0..).filter(is_suspect).collect()
}

/// The bits of a corner; -0 is 0.
fn bits(corner: Vec3) -> [u32; 3] {
    corner.to_array().map(|v| (v + 0.0).to_bits())
}

fn sorted_bits(triangle: &[Vec3; 3]) -> [[u32; 3]; 3] {
    let mut corners = triangle.map(bits);
    corners.sort_unstable();
    corners
}

/// The same for any order of the corners.
fn hash_of(triangle: &[Vec3; 3]) -> u64 {
    let of_corner = |corner: Vec3| {
        let [x, y, z] = bits(corner).map(u64::from);
        hash::combine(x | y << 32, z)
    };
    triangle.iter().fold(0, |sum: u64, &corner| sum.wrapping_add(of_corner(corner)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

    fn all(places: &Places) -> Vec<Vec<u32>> {
        (0..places.firsts().len() as u32).map(|place| places.triangles(place).collect()).collect()
    }

    #[test]
    fn twenty_thousand_in_one_place_are_one_box() {
        let places = Places::new(&vec![TRIANGLE; 20_000]);
        assert_eq!(places.firsts(), [0]);
        assert_eq!(places.count(0), 20_000);
        assert!(places.triangles(0).eq(0..20_000));
    }

    #[test]
    fn any_order_of_the_corners_and_either_zero_is_the_same_place() {
        let [a, b, c] = TRIANGLE;
        let negative = Vec3::new(1.0, -0.0, 0.0);
        let triangles = [[a, b, b], [a, b, c], [b, a, c], [c, b, a], [a, b, -c], [b, c, negative]];
        let places = Places::new(&triangles);
        assert_eq!(all(&places), [vec![0], vec![1, 2, 3, 5], vec![4]]);
        assert_eq!([0, 1, 2].map(|place| places.count(place)), [1, 4, 1]);
    }

    #[test]
    fn triangles_apart_are_as_many_places() {
        let triangles: Vec<_> = (0..1000u16).map(|i| TRIANGLE.map(|p| p * f32::from(i))).collect();
        assert!(Places::new(&triangles).firsts().iter().copied().eq(0..1000));
        assert!(Places::new(&[]).firsts().is_empty());
    }
}
