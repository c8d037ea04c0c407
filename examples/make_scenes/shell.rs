//! The outer ball: a thick spherical shell with a bevelled port and a groove around it.
//!
//! In the ball's own frame the port looks along +z. The surface is the zero set of a field; its mesh is a grid laid along the
//! shape's own lines, from the pole behind on the outside, over the groove, into the port and to the pole behind on the inside.
//! Each vertex is then projected to the surface, so bevels are crisp and highlights exact.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DQuat, DVec2, DVec3};
use pipeline::math::{Number, Real};

use super::field::{Field, round_max, round_rectangle};
use super::mesh::{Mesh, Vertex};

/// Radius of the inside of the shell; the outside's is 1.
pub(crate) const INSIDE: f64 = 0.86;
/// Radius of the port's bevels.
const BEVEL: f64 = 0.035;
/// The port's half sides and the radius of its corners, in the stereographic plane (near 0 these are radians).
const PORT: DVec2 = DVec2::new(0.74, 0.56);
const CORNER: f64 = 0.34;
/// The groove's angle from the port's axis, the radius of its section and of its lips.
const GROOVE: f64 = 1.36;
const GROOVE_RADIUS: f64 = 0.03;
const LIP: f64 = 0.012;
/// Facets around the port.
const COLUMNS: usize = 192;

/// The solid in the ball's frame.
pub(crate) fn solid(p: DVec3) -> f64 {
    let radius = p.length();
    let shell = (radius - 1.0).max(INSIDE - radius);
    let cut = round_max(shell, -port(p), BEVEL);
    let around = DVec2::new(p.x, p.y).length();
    let (sin, cos) = (Real::sin(GROOVE), Real::cos(GROOVE));
    let groove = DVec2::new(around - sin, p.z - cos).length() - GROOVE_RADIUS;
    round_max(cut, -groove, LIP)
}

/// The port's distance, negative inside: a rounded rectangle in the stereographic plane, which keeps angles, so that its
/// walls stand on the spheres.
fn port(p: DVec3) -> f64 {
    let depth = p.length() + p.z;
    if depth < 1e-6 {
        return 1.0;
    }
    round_rectangle(DVec2::new(p.x, p.y) * (2.0 / depth), PORT, CORNER) * depth / 2.0
}

/// The point of the unit sphere over a point of the stereographic plane.
fn from_plane(q: DVec2) -> DVec3 {
    let s = q.length_squared() / 4.0;
    DVec3::new(q.x, q.y, 1.0 - s) / (1.0 + s)
}

/// The point of the unit sphere at an angle from the port's axis and an azimuth.
fn from_angles(polar: f64, azimuth: f64) -> DVec3 {
    let sin = Real::sin(polar);
    DVec3::new(sin * Real::cos(azimuth), sin * Real::sin(azimuth), Real::cos(polar))
}

fn polar(p: DVec3) -> f64 {
    Real::atan2(DVec2::new(p.x, p.y).length(), p.z)
}

/// A column of the grid: a place on the port's outline.
struct Column {
    /// The centre of the corner's arc that the outline's nearest point belongs to, or the foot on the inner rectangle.
    core: DVec2,
    /// Outward, across the outline.
    across: DVec2,
    /// Where the column ends behind: an azimuth.
    azimuth: f64,
}

impl Column {
    /// Columns go counter-clockwise from +x; straight sides and corners get facets in proportion to their lengths.
    fn new(index: usize) -> Self {
        let inner = PORT - DVec2::splat(CORNER);
        let arc = FRAC_PI_2 * CORNER;
        let quarter = inner.x + inner.y + arc;
        let position = index as f64 / COLUMNS as f64 * 4.0;
        let (quadrant, along) = (position.floor(), position.fract() * quarter);
        // The quadrant from +x to +y; odd quadrants run backwards, mirrored.
        let mirrored = quadrant as u32 % 2 == 1;
        let along = if mirrored { quarter - along } else { along };
        let (core, across) = if along < inner.y {
            (DVec2::new(inner.x, along), DVec2::X)
        } else if along < inner.y + arc {
            let angle = (along - inner.y) / CORNER;
            (inner, DVec2::new(Real::cos(angle), Real::sin(angle)))
        } else {
            (DVec2::new(quarter - along, inner.y), DVec2::Y)
        };
        let sign = match quadrant as u32 {
            0 => DVec2::new(1.0, 1.0),
            1 => DVec2::new(-1.0, 1.0),
            2 => DVec2::new(-1.0, -1.0),
            _ => DVec2::new(1.0, -1.0),
        };
        Self { core: core * sign, across: across * sign, azimuth: index as f64 / COLUMNS as f64 * TAU }
    }

    /// The point of the unit sphere `offset` outside of the outline.
    fn beside(&self, offset: f64) -> DVec3 {
        let edge = self.core + self.across * CORNER;
        // The plane is larger than the sphere by this factor.
        let scale = 1.0 + edge.length_squared() / 4.0;
        from_plane(edge + self.across * (offset * scale))
    }

    /// The point of the unit sphere `polar` from the axis far from the port, and close to the port as far outside of its
    /// outline as a circle of the outline's mean angle would be.
    fn behind(&self, polar_angle: f64) -> DVec3 {
        let near = mean_edge();
        let t = ((polar_angle - near) / (GROOVE - 0.1 - near)).clamp(0.0, 1.0);
        let far = t * t * (3.0 - 2.0 * t);
        let edge = self.beside(BEVEL + polar_angle - near);
        let turn = Real::atan2(edge.y, edge.x) - self.azimuth;
        let turn = turn - TAU * (turn / TAU).round();
        from_angles(polar(edge).lerp(polar_angle, far), self.azimuth + turn * (1.0 - far))
    }
}

/// The mean angle from the axis at which the outer bevel begins.
fn mean_edge() -> f64 {
    (PORT.x + PORT.y) / 2.0 + BEVEL
}

/// What a row of the grid follows.
#[derive(Clone, Copy)]
enum Row {
    /// A circle behind the port, at an angle from the axis, on a sphere of this radius.
    Circle { polar: f64, radius: f64 },
    /// A line along the port's outline: so far outside of it, on a sphere of this radius.
    Outline { offset: f64, radius: f64 },
    /// A line along the bottom of the groove: the angle around its section.
    Groove { angle: f64 },
}

impl Row {
    fn guess(self, column: &Column) -> DVec3 {
        match self {
            Self::Circle { polar, radius } => column.behind(polar) * radius,
            Self::Outline { offset, radius } => column.beside(offset) * radius,
            Self::Groove { angle } => {
                let middle = from_angles(GROOVE, column.azimuth);
                let backwards = from_angles(GROOVE + FRAC_PI_2, column.azimuth);
                middle + (backwards * Real::cos(angle) - middle * Real::sin(angle)) * GROOVE_RADIUS
            }
        }
    }
}

/// Angles from `from` to `to` whose steps are `fine` at the ends named by `fine_ends` and grow to `coarse`.
fn graded(from: f64, to: f64, fine: f64, coarse: f64, fine_ends: [bool; 2]) -> Vec<f64> {
    let length = (to - from).abs();
    let mut at = vec![0.0];
    while at[at.len() - 1] < length {
        let here = at[at.len() - 1];
        let reach = |fine_end: bool, distance: f64| if fine_end { distance } else { f64::INFINITY };
        let distance = reach(fine_ends[0], here).min(reach(fine_ends[1], length - here));
        at.push(here + coarse.min(fine + 0.3 * distance.max(0.0)));
    }
    let scale = (to - from) / at[at.len() - 1];
    at.iter().map(|x| from + x * scale).collect()
}

/// All rows, from the pole behind on the outside to the pole behind on the inside.
fn rows() -> Vec<Row> {
    let lip = GROOVE_RADIUS + LIP + 0.012;
    let outside = |polar| Row::Circle { polar, radius: 1.0 };
    let mut rows = vec![];
    rows.extend(graded(PI, GROOVE + lip, 0.01, 0.04, [false, true]).into_iter().map(outside));
    rows.extend((1..5).map(|i| outside(GROOVE + lip - 0.005 * f64::from(i))));
    rows.extend((0..=10).map(|i| Row::Groove { angle: 0.3 + (PI - 0.6) * f64::from(i) / 10.0 }));
    rows.extend((1..5).rev().map(|i| outside(GROOVE - lip + 0.005 * f64::from(i))));
    rows.extend(graded(GROOVE - lip, mean_edge(), 0.01, 0.04, [true, true]).into_iter().map(outside));
    let bevel = |i: u32, radius: f64, outward: f64| {
        let angle = FRAC_PI_2 * f64::from(i) / 8.0;
        let (sin, cos) = (Real::sin(angle), Real::cos(angle));
        Row::Outline { offset: BEVEL * (1.0 - sin), radius: radius + outward * BEVEL * (cos - 1.0) }
    };
    rows.extend((1..=8).map(|i| bevel(i, 1.0, 1.0)));
    let (top, bottom) = (1.0 - BEVEL, INSIDE + BEVEL);
    rows.extend((1..4).map(|i| Row::Outline { offset: 0.0, radius: top.lerp(bottom, f64::from(i) / 4.0) }));
    rows.extend((0..=8).rev().map(|i| bevel(i, INSIDE, -1.0)));
    let inside = graded(mean_edge(), PI, 0.012, 0.06, [true, false]);
    rows.extend(inside.into_iter().skip(1).map(|polar| Row::Circle { polar, radius: INSIDE }));
    rows
}

/// The shell around the origin, turned by `orientation`.
///
/// u is the azimuth about the port's axis, seamless once around; v is the length of the way from the pole behind in units of
/// π, from 1 there downwards and on below 0 on the inside: textures repeat.
pub(crate) fn mesh(orientation: DQuat) -> Mesh {
    let rows = rows();
    let mut points = vec![];
    for column in (0..COLUMNS).map(Column::new) {
        let mut walked = 0.0;
        let mut last: Option<DVec3> = None;
        for (i, row) in rows.iter().enumerate() {
            let pole = i == 0 || i + 1 == rows.len();
            let guess = row.guess(&column);
            let position = if pole { DVec3::NEG_Z * guess.length() } else { solid.project(guess) };
            let normal =
                if pole { DVec3::NEG_Z * if i == 0 { 1.0 } else { -1.0 } } else { solid.normal(position) };
            walked += last.map_or(0.0, |last| last.distance(position));
            last = Some(position);
            points.push((position, normal, 1.0 - walked / PI, pole));
        }
    }
    Mesh::grid(rows.len(), COLUMNS + 1, |row, column| {
        let (position, normal, v, pole) = points[(column % COLUMNS) * rows.len() + row];
        let u = (column as f64 - if pole { 0.5 } else { 0.0 }) / COLUMNS as f64;
        Vertex { position: orientation * position, normal: orientation * normal, uv: [u, v] }
    })
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Boundary;
    use super::*;

    #[test]
    fn the_shell_is_closed_and_lies_on_its_surface() {
        let mesh = mesh(DQuat::IDENTITY).checked("ball", Boundary::Closed).unwrap();
        assert!(mesh.positions.iter().all(|&p| solid(p).abs() < 1e-9));
    }

    #[test]
    fn no_triangle_is_a_needle_away_from_the_poles() {
        let mesh = mesh(DQuat::IDENTITY);
        for t in &mesh.triangles {
            let [a, b, c] = mesh.corners(*t);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let area = (b - a).cross(c - a).length();
            assert!(longest < 0.1, "{a} {b} {c}");
            assert!(a.z < -0.8 || area > 0.02 * longest * longest, "{a} {b} {c}");
        }
    }
}
