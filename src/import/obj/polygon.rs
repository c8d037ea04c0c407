//! Polygons into triangles: fans for convex ones, ear clipping for the others.

use glam::{DVec2, DVec3, Vec3};

/// The most corners that a concave polygon may have: ear clipping takes the square of them.
pub(super) const MAX_CONCAVE: usize = 4096;

/// The most corners that any polygon may have.
pub(super) const MAX_CORNERS: usize = 1 << 16;

/// How a polygon went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Triangulation {
    /// The triangles cover the polygon.
    Whole,
    /// The polygon crosses itself or has no area: the triangles are a best effort.
    Doubtful,
    /// Concave and beyond [`MAX_CONCAVE`]: no triangles.
    TooLarge,
}

/// Adds the triangles of the polygon with these corners (at least 3) to `triangles`, as indices into `corners`, in the polygon's
/// orientation. A convex polygon becomes the fan around its first corner.
pub(super) fn triangulate(corners: &[Vec3], triangles: &mut Vec<[usize; 3]>) -> Triangulation {
    let n = corners.len();
    if n == 3 {
        triangles.push([0, 1, 2]);
        return Triangulation::Whole;
    }
    let points = flatten(corners);
    let turns_left = |i: usize| turn(points[(i + n - 1) % n], points[i], points[(i + 1) % n]) >= 0.0;
    if (0..n).all(turns_left) {
        triangles.extend((1..n - 1).map(|i| [0, i, i + 1]));
        return if newell(corners) == DVec3::ZERO { Triangulation::Doubtful } else { Triangulation::Whole };
    }
    if n > MAX_CONCAVE {
        return Triangulation::TooLarge;
    }
    Ears::new(&points).clip(triangles)
}

/// The normal of a polygon that need not be planar, as long as twice its area (Newell's method).
pub(super) fn newell(corners: &[Vec3]) -> DVec3 {
    let around = corners.iter().zip(corners.iter().cycle().skip(1));
    around.map(|(a, b)| a.as_dvec3().cross(b.as_dvec3())).sum()
}

/// The polygon seen along the axis nearest to its normal, counter-clockwise.
fn flatten(corners: &[Vec3]) -> Vec<DVec2> {
    // Relative to the first corner, so that a small polygon far from the origin keeps its digits.
    let local: Vec<Vec3> = corners.iter().map(|&c| c - corners[0]).collect();
    let normal = newell(&local);
    let size = normal.abs();
    let project = |p: DVec3| {
        if size.x >= size.y && size.x >= size.z {
            DVec2::new(p.y, p.z)
        } else if size.y >= size.z {
            DVec2::new(p.z, p.x)
        } else {
            DVec2::new(p.x, p.y)
        }
    };
    let facing = if size.x >= size.y && size.x >= size.z {
        normal.x
    } else if size.y >= size.z {
        normal.y
    } else {
        normal.z
    };
    let mirrored = if facing < 0.0 { DVec2::new(-1.0, 1.0) } else { DVec2::ONE };
    local.iter().map(|p| project(p.as_dvec3()) * mirrored).collect()
}

/// Twice the area of the triangle: positive where a, b, c turn left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

/// A polygon while its ears are clipped: a ring of corners, of which only the neighbours of a clipped ear change (Eberly,
/// "Triangulation by Ear Clipping").
struct Ears<'a> {
    points: &'a [DVec2],
    before: Vec<usize>,
    after: Vec<usize>,
    reflex: Vec<bool>,
    ear: Vec<bool>,
}

impl<'a> Ears<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let n = points.len();
        let mut ears = Self {
            points,
            before: (0..n).map(|i| (i + n - 1) % n).collect(),
            after: (0..n).map(|i| (i + 1) % n).collect(),
            reflex: vec![false; n],
            ear: vec![false; n],
        };
        for i in 0..n {
            ears.reflex[i] = ears.turn_at(i) < 0.0;
        }
        for i in 0..n {
            ears.ear[i] = ears.is_ear(i);
        }
        ears
    }

    fn clip(mut self, triangles: &mut Vec<[usize; 3]>) -> Triangulation {
        let mut result = Triangulation::Whole;
        let mut left = self.points.len();
        let mut at = 0;
        while left > 3 {
            let mut steps = 0;
            while !self.ear[at] && steps < left {
                at = self.after[at];
                steps += 1;
            }
            if !self.ear[at] {
                // A simple polygon always has an ear; this one crosses itself or is degenerate.
                result = Triangulation::Doubtful;
            }
            let (before, after) = (self.before[at], self.after[at]);
            triangles.push([before, at, after]);
            self.after[before] = after;
            self.before[after] = before;
            self.reflex[at] = false;
            for i in [before, after] {
                self.reflex[i] = self.turn_at(i) < 0.0;
            }
            for i in [before, after] {
                self.ear[i] = self.is_ear(i);
            }
            // Going on two corners later makes better triangles than a fan of slivers.
            at = self.after[after];
            left -= 1;
        }
        triangles.push([self.before[at], at, self.after[at]]);
        result
    }

    fn turn_at(&self, i: usize) -> f64 {
        turn(self.points[self.before[i]], self.points[i], self.points[self.after[i]])
    }

    /// Whether the triangle at `i` turns left and holds no other corner; only reflex corners can be in it.
    fn is_ear(&self, i: usize) -> bool {
        let [a, b, c] = [self.before[i], i, self.after[i]].map(|k| self.points[k]);
        if turn(a, b, c) <= 0.0 {
            return false;
        }
        let inside = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
        (0..self.points.len())
            .filter(|&k| self.reflex[k])
            .map(|k| self.points[k])
            .all(|p| p == a || p == b || p == c || !inside(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[Vec3], triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|t| newell(&t.map(|i| corners[i])).length() / 2.0).sum()
    }

    fn polygon(points: &[(f32, f32)]) -> Vec<Vec3> {
        // On a tilted plane, so that no projection is the identity.
        points.iter().map(|&(x, y)| Vec3::new(10.0 + x, 0.5 * x - y, y + 3.0)).collect()
    }

    #[test]
    fn a_convex_polygon_is_the_fan_of_its_first_corner() {
        let mut triangles = Vec::new();
        let corners = polygon(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        assert_eq!(triangulate(&corners, &mut triangles), Triangulation::Whole);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn concave_polygons_keep_area_and_orientation_either_way_round() {
        let shapes: [&[(f32, f32)]; 3] = [
            &[(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.5, 1.0)],
            &[(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)],
            &[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (1.9, 3.9), (1.0, 1.0), (0.0, 4.0)],
        ];
        for shape in shapes {
            let mut shape = shape.to_vec();
            for _ in 0..2 {
                let corners = polygon(&shape);
                let whole = newell(&corners);
                let mut triangles = Vec::new();
                assert_eq!(triangulate(&corners, &mut triangles), Triangulation::Whole);
                assert_eq!(triangles.len(), corners.len() - 2);
                assert!((area(&corners, &triangles) - whole.length() / 2.0).abs() < 1e-5);
                for t in &triangles {
                    assert!(newell(&t.map(|i| corners[i])).dot(whole) > 0.0, "{t:?}");
                }
                shape.reverse();
            }
        }
    }

    #[test]
    fn polygons_that_cross_themselves_or_have_no_area_end() {
        let bow = polygon(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 3.0)]);
        let line = polygon(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (1.0, 0.0)]);
        for corners in [bow, line, vec![Vec3::ONE; 6]] {
            let mut triangles = Vec::new();
            triangulate(&corners, &mut triangles);
            assert_eq!(triangles.len(), corners.len() - 2);
            assert!(triangles.iter().flatten().all(|&i| i < corners.len()));
        }
    }

    #[test]
    fn a_huge_concave_polygon_is_refused_and_a_huge_convex_one_is_not() {
        let circle = |n: usize, dent: f32| -> Vec<Vec3> {
            (0..n)
                .map(|i| {
                    let t = i as f32 / n as f32 * std::f32::consts::TAU;
                    let r = if i == 0 { dent } else { 1.0 };
                    Vec3::new(r * libm::cosf(t), r * libm::sinf(t), 0.0)
                })
                .collect()
        };
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&circle(MAX_CONCAVE + 1, 0.1), &mut triangles), Triangulation::TooLarge);
        assert!(triangles.is_empty());
        assert_eq!(triangulate(&circle(1000, 0.1), &mut triangles), Triangulation::Whole);
    }
}
