//! Smoothing groups as vertex normals.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::polygon;
use crate::math::Real;

/// The normals of corners that have none of their own but lie in a smoothing group: at each position the mean of the normals of the
/// group's faces that meet there, weighted by their angles (Thürmer and Wüthrich 1998), so that it does not matter how a face is cut
/// into triangles.
#[derive(Debug, Default)]
pub(super) struct SmoothNormals {
    /// Places in `sums` by (position, group); looked up only, so its order does not matter.
    places: HashMap<(usize, u32), usize>,
    sums: Vec<DVec3>,
}

impl SmoothNormals {
    /// The index of the normal at `position` in `group`.
    fn index(&mut self, position: usize, group: u32) -> usize {
        *self.places.entry((position, group)).or_insert_with(|| {
            self.sums.push(DVec3::ZERO);
            self.sums.len() - 1
        })
    }

    /// Adds a face of `group` with these corners, indices into `positions`; returns the indices of its corners' normals, from 0 in the
    /// order of first appearance.
    pub(super) fn add(&mut self, corners: &[usize], positions: &[Vec3], group: u32) -> Vec<usize> {
        let points: Vec<Vec3> = corners.iter().map(|&i| positions[i]).collect();
        // Relative to the first corner, so that a small face far from the origin keeps its digits.
        let local: Vec<Vec3> = points.iter().map(|&p| p - points[0]).collect();
        let normal = polygon::newell(&local).normalize_or_zero();
        let n = corners.len();
        let mut add = |(i, &corner): (usize, &usize)| {
            let edge = |to: usize| (points[to] - points[i]).as_dvec3();
            let (before, after) = (edge((i + n - 1) % n), edge((i + 1) % n));
            let angle = Real::atan2(before.cross(after).length(), before.dot(after));
            let place = self.index(corner, group);
            self.sums[place] += normal * angle;
            place
        };
        corners.iter().enumerate().map(&mut add).collect()
    }

    /// All normals by index, not normalised; `None` where faces without area or of opposite directions meet.
    pub(super) fn into_normals(self) -> impl Iterator<Item = Option<Vec3>> {
        // The sum of many opposite normals leaves rounding, which has no meaning as a direction.
        self.sums.into_iter().map(|sum| (sum.length() > 1e-6).then(|| sum.normalize().as_vec3()))
    }
}
