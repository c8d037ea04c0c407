//! Surfaces of revolution about the y axis, from profiles of lines and arcs with exact normals.

use glam::{DVec2, DVec3};
use pipeline::math::Real;

use super::mesh::{Mesh, Vertex};

/// A profile in the plane of (radius, height), walked with the solid on its left: upwards on the outside.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    points: Vec<Point>,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    at: DVec2,
    /// Unit direction of the walk.
    along: DVec2,
}

fn direction(angle: f64) -> DVec2 {
    DVec2::new(Real::cos(angle), Real::sin(angle))
}

impl Profile {
    /// A chain of straight lines through corners (radius, height, fillet radius); the ends' fillets don't matter. Lines are
    /// cut into pieces no longer than `piece`.
    pub(crate) fn corners(corners: &[[f64; 3]], piece: f64) -> Self {
        let mut profile = Self::default();
        let at = |i: usize| DVec2::new(corners[i][0], corners[i][1]);
        let mut start = at(0);
        for i in 1..corners.len() {
            let along = (at(i) - at(i - 1)).normalize();
            if i + 1 == corners.len() {
                profile.line(start, at(i), piece);
                break;
            }
            let next = (at(i + 1) - at(i)).normalize();
            let turn = Real::atan2(along.perp_dot(next), along.dot(next));
            let fillet = corners[i][2];
            // The distance from the corner to where the arc begins: r·tan(turn/2).
            let cut = fillet * (1.0 - along.dot(next)) / along.perp_dot(next).abs();
            profile.line(start, at(i) - along * cut, piece);
            let center = at(i) - along * cut + along.perp() * fillet.copysign(turn);
            let begin = Real::atan2(along.y, along.x);
            profile.turn(center, fillet, begin, turn, 8);
            start = at(i) + next * cut;
        }
        profile
    }

    fn line(&mut self, from: DVec2, to: DVec2, piece: f64) {
        let along = (to - from).normalize();
        let pieces = (from.distance(to) / piece).ceil().max(1.0) as usize;
        self.points
            .extend((0..=pieces).map(|i| Point { at: from.lerp(to, i as f64 / pieces as f64), along }));
    }

    /// An arc of radius `radius` about `center` that is walked in direction `begin` first and turns by `turn` (radians,
    /// positive to the left).
    pub(crate) fn turn(&mut self, center: DVec2, radius: f64, begin: f64, turn: f64, steps: usize) {
        for i in 0..=steps {
            let along = direction(begin + turn * i as f64 / steps as f64);
            self.points.push(Point { at: center - along.perp() * radius.copysign(turn), along });
        }
    }

    /// The profile followed by another one.
    pub(crate) fn then(mut self, other: Self) -> Self {
        self.points.extend(other.points);
        self
    }

    /// The greatest value of `f` over the profile's points (radius, height).
    pub(crate) fn greatest(&self, f: impl Fn(DVec2) -> f64) -> f64 {
        self.points.iter().map(|p| f(p.at)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The surface with `columns` facets around. u goes once around, v from 1 at the profile's beginning to 0 at its end
    /// in proportion to its length.
    pub(crate) fn revolve(mut self, columns: usize) -> Mesh {
        self.points.dedup_by(|b, a| a.at.distance(b.at) < 1e-9);
        let mut lengths = vec![0.0];
        for pair in self.points.windows(2) {
            lengths.push(lengths[lengths.len() - 1] + pair[0].at.distance(pair[1].at));
        }
        let total = lengths[lengths.len() - 1];
        Mesh::grid(self.points.len(), columns + 1, |row, column| {
            let Point { at, along } = self.points[row];
            // The last column is the first one's place exactly, so that the seam has no gap.
            let angle = (column % columns) as f64 / columns as f64 * std::f64::consts::TAU;
            let (out, z) = (Real::sin(angle), Real::cos(angle));
            let normal = DVec2::new(along.y, -along.x);
            let pole = at.x.abs() < 1e-9;
            let radius = if pole { 0.0 } else { at.x };
            Vertex {
                position: DVec3::new(radius * out, at.y, radius * z),
                normal: if pole {
                    DVec3::Y * normal.y.signum()
                } else {
                    DVec3::new(normal.x * out, normal.y, normal.x * z)
                },
                // A pole has one vertex a column: its u is that of the middle of the column's triangle.
                uv: [
                    (column as f64 - if pole { 0.5 } else { 0.0 }) / columns as f64,
                    1.0 - lengths[row] / total,
                ],
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Boundary;
    use super::*;

    #[test]
    fn a_bevelled_cylinder_is_closed_and_its_normals_lean_no_more_than_its_bevel() {
        let profile =
            Profile::corners(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 0.5, 0.1], [0.0, 0.5, 0.0]], 1.0);
        let cylinder = profile.revolve(24).checked("cylinder", Boundary::Closed).unwrap();
        for (p, n) in cylinder.positions.iter().zip(&cylinder.normals) {
            let beyond = DVec2::new((p.x * p.x + p.z * p.z).sqrt() - 0.9, (p.y - 0.25).abs() - 0.15);
            if beyond.min_element() > 1e-9 {
                assert!((beyond.length() - 0.1).abs() < 1e-12);
                assert!((n.y.abs() - beyond.y / 0.1).abs() < 1e-9);
            }
        }
    }
}
