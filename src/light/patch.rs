//! One or two emitting triangles that share an edge, sampled by the solid angle under which they are seen.
//!
//! The pivot, a corner that both have, and the other corners make a fan: r₀, r₁ and, of a pair, r₂. The first random number sweeps
//! over the fan around the pivot, the second goes from the pivot outwards, so that the points of a quad have one even spread and
//! not two halves of one.
//!
//! Sampling a spherical triangle is Arvo's (1995), in the form of Peters 2021 ("BRDF Importance Sampling for Polygonal Lights",
//! section 3), which needs one arcus tangent, one sine and cosine and no inverse of them. The determinant comes from the
//! triangle's own area vector: directions to the corners of a small triangle are too close to each other for their products.

use std::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::EmissiveTriangle;
use super::bounds::{Cone, LightBounds, angle};
use crate::math::{Number, Real, warp};
use crate::scene::material::Sides;

/// A patch whose radius is less than this fraction of the distance is sampled by area at once. Distances and cosines differ on it, but
/// smoothly, and well-spread points lose little by that: in the Cornell box the error stays the same, in a third of the time a sample.
const SMALL: f32 = 0.5;
/// Smaller solid angles (steradians) are sampled by area: the directions of floats are too coarse for them, and the distances and
/// cosines on a patch so small or far all but equal. The limits are those of Pharr, Jakob and Humphreys (2023, section 6.5.4).
const SMALLEST: f32 = 3e-4;
/// And larger ones too: seen from so near the plane of the triangle, its edges are all but opposite to each other.
const LARGEST: f32 = 6.22;

/// Triangles of a pair lie in one plane as far as this cosine between their normals tells.
const COPLANAR: f64 = 0.999;

/// One triangle or two.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    pivot: Vec3,
    ring: [Vec3; 3],
    wedges: [Wedge; 2],
    /// 1, or 2 for a pair.
    count: usize,
    center: Vec3,
    /// The squared distance from the centre beyond which the patch is sampled by area: see [`SMALL`].
    far_squared: f32,
    /// One over the area in m².
    per_area: f32,
    /// Luminance of the mean radiance times the area, in W/sr.
    intensity: f64,
    sides: Sides,
    is_mirrored: bool,
}

/// A triangle of the fan: the pivot, `ring[k]` and `ring[k + 1]`.
#[derive(Clone, Copy, Debug)]
struct Wedge {
    triangle: u32,
    /// Which of the triangle's corners is the pivot; the winding stays.
    first_corner: u8,
    /// Along the normal of the winding, as long as the area.
    area_vector: Vec3,
    /// Of the whole patch's area.
    share: f32,
}

/// A point of a patch as seen from a receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchSample {
    pub(super) wi: Vec3,
    pub(super) triangle: u32,
    pub(super) barycentric: [f32; 3],
    /// Per unit solid angle.
    pub(super) pdf: f32,
}

/// A wedge seen from a point.
#[derive(Clone, Copy, Debug, Default)]
struct View {
    /// Unit directions to the first corner of the ring, the pivot, and the second corner.
    directions: [Vec3; 3],
    /// The determinant of the directions; |d₀ + d₁ + d₂|² in parts: d₀·d₂ + d₁·d₂, and 1 + d₀·d₁.
    g: [f32; 3],
    /// The solid angle in steradians.
    solid_angle: f32,
}

impl Patch {
    /// A triangle on its own.
    pub(super) fn single(t: &EmissiveTriangle) -> Self {
        let wedge = Wedge {
            triangle: t.triangle,
            first_corner: 0,
            area_vector: t.area_vector().as_vec3(),
            share: 1.0,
        };
        let [pivot, r0, r1] = t.vertices;
        Self::of(t, pivot, [r0, r1, r1], [wedge; 2], 1)
    }

    fn of(t: &EmissiveTriangle, pivot: Vec3, ring: [Vec3; 3], wedges: [Wedge; 2], count: usize) -> Self {
        let area: f64 = wedges[..count].iter().map(|w| f64::from(w.area_vector.length())).sum();
        let intensity = f64::from(t.mean_radiance.luminance()) * area;
        let corners = [pivot, ring[0], ring[1], ring[2]];
        let center = (pivot * 0.25 + ring[0] * 0.25) + (ring[1] * 0.25 + ring[2] * 0.25);
        let radius_squared = corners.map(|c| c.distance_squared(center)).into_iter().fold(0.0, f32::max);
        let far_squared = radius_squared / SMALL.sqr();
        let (sides, is_mirrored) = (t.sides, t.is_mirrored);
        let per_area = (1.0 / area) as f32;
        Self { pivot, ring, wedges, count, center, far_squared, per_area, intensity, sides, is_mirrored }
    }

    /// Two triangles that share an edge and a plane, wind the same way round and emit alike; None if these don't.
    pub(super) fn pair(a: &EmissiveTriangle, b: &EmissiveTriangle) -> Option<Self> {
        let alike =
            a.mean_radiance == b.mean_radiance && a.sides == b.sides && a.is_mirrored == b.is_mirrored;
        let (area_a, area_b) = (a.area_vector(), b.area_vector());
        let (length_a, length_b) = (area_a.length(), area_b.length());
        if !alike || area_a.dot(area_b) < COPLANAR * length_a * length_b {
            return None;
        }
        // The edge's end is the pivot of both: a runs to it, b from it.
        (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).find_map(|(i, j)| {
            let corner = |t: &EmissiveTriangle, k: usize| t.vertices[k % 3];
            let shared = corner(a, i) == corner(b, j) && corner(a, i + 2) == corner(b, j + 1);
            let wedge = |t: &EmissiveTriangle, first_corner, area: DVec3| Wedge {
                triangle: t.triangle,
                first_corner: first_corner as u8,
                area_vector: area.as_vec3(),
                share: (area.length() / (length_a + length_b)) as f32,
            };
            shared.then(|| {
                let ring = [corner(a, i + 1), corner(a, i + 2), corner(b, j + 2)];
                Self::of(a, corner(a, i), ring, [wedge(a, i, area_a), wedge(b, j, area_b)], 2)
            })
        })
    }

    /// How many triangles.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Light sent out straight ahead, in W/sr.
    pub(super) fn intensity(&self) -> f64 {
        self.intensity
    }

    /// Light sent out, in watts.
    pub(super) fn power(&self) -> f64 {
        let sides = if self.sides == Sides::Both { 2.0 } else { 1.0 };
        self.intensity * std::f64::consts::PI * sides
    }

    /// Where it is and where it shines.
    pub(super) fn bounds(&self) -> LightBounds {
        let (low, high) =
            self.ring.iter().fold((self.pivot, self.pivot), |(low, high), &p| (low.min(p), high.max(p)));
        let both_sides = self.sides == Sides::Both;
        let front = if self.is_mirrored { -1.0 } else { 1.0 };
        let normals = self.wedges.map(|w| w.area_vector.normalize_or(Vec3::Y) * front);
        let axis = (normals[0] + normals[1]).normalize_or(normals[0]);
        // Of two normals that will do, the one that others take, too.
        let axis = if both_sides && axis[axis.abs().max_position()] < 0.0 { -axis } else { axis };
        let spread = if self.count == 1 { 0.0 } else { angle(normals[0], normals[1]) };
        let cone = Cone { axis, spread, emission: FRAC_PI_2, both_sides };
        LightBounds { low, high, intensity: 1.0, cone }
    }

    /// None of its light leaves in the direction of `from`.
    #[inline]
    fn faces_away(&self, from: Vec3) -> bool {
        let front = if self.is_mirrored { -1.0 } else { 1.0 };
        let to = (from - self.pivot) * front;
        self.sides == Sides::Front && self.wedges[..self.count].iter().all(|w| w.area_vector.dot(to) <= 0.0)
    }

    /// A point of the patch as seen from `from`; none where it is seen edge-on.
    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<PatchSample> {
        if self.faces_away(from) {
            return None;
        }
        let Some((views, total)) = self.views(from) else { return self.sample_area(from, u) };
        // Sweep over the fan.
        let target = u[0] * total;
        let (k, u0) = match self.count {
            2 if target >= views[0].solid_angle => {
                (1, ((target - views[0].solid_angle) / views[1].solid_angle).min(1.0))
            }
            2 => (0, target / views[0].solid_angle),
            _ => (0, u[0]),
        };
        let direction = views[k].sample([u0, u[1]]);
        let [v0, v1, v2] = self.wedge_corners(k).map(|v| v - from);
        // Where the direction meets the plane (Möller and Trumbore 1997), not beyond the edges by rounding.
        let (e1, e2) = (v1 - v0, v2 - v0);
        let p = direction.cross(e2);
        let determinant = e1.dot(p);
        let b1 = (-v0).dot(p) / determinant;
        let b2 = direction.dot((-v0).cross(e1)) / determinant;
        let barycentric = inside([1.0 - b1 - b2, b1, b2])?;
        let wi = (v0 * barycentric[0] + v1 * barycentric[1] + v2 * barycentric[2]).try_normalize()?;
        Some(self.wedges[k].found(wi, barycentric, 1.0 / total))
    }

    /// The sides that emit.
    pub(super) fn sides(&self) -> Sides {
        self.sides
    }

    /// A triangle and a point of it, barycentric, uniform by area.
    #[inline]
    pub(super) fn point(&self, u: [f32; 2]) -> (u32, [f32; 3]) {
        let (k, barycentric) = self.point_of_wedge(u);
        let found = self.wedges[k].found(Vec3::ZERO, barycentric, self.pdf_point());
        (found.triangle, found.barycentric)
    }

    /// The density of [`Self::point`] per m².
    #[inline]
    pub(super) fn pdf_point(&self) -> f32 {
        self.per_area
    }

    #[inline]
    fn point_of_wedge(&self, u: [f32; 2]) -> (usize, [f32; 3]) {
        let first = self.wedges[0].share;
        // Without a branch: which wedge it is, is random.
        let is_second = self.count == 2 && u[0] >= first;
        let beyond = Number::select(is_second, u[0] - first, u[0]);
        let width = Number::select(is_second, 1.0 - first, first);
        let (k, u0) = (usize::from(is_second), (beyond / width).min(1.0));
        let [b1, b2] = warp::uniform_triangle([u0, u[1]]);
        (k, [1.0 - b1 - b2, b1, b2])
    }

    /// As [`Self::sample`], uniform by area.
    fn sample_area(&self, from: Vec3, u: [f32; 2]) -> Option<PatchSample> {
        let (k, barycentric) = self.point_of_wedge(u);
        let [v0, v1, v2] = self.wedge_corners(k).map(|v| v - from);
        let to_light = v0 * barycentric[0] + v1 * barycentric[1] + v2 * barycentric[2];
        let distance = to_light.length();
        let wi = to_light / distance;
        let pdf = self.wedges[k].pdf_area(wi, distance)?;
        Some(self.wedges[k].found(wi, barycentric, pdf))
    }

    /// The density of [`Self::sample`] at a point of its `index`-th triangle that lies `distance` along the unit direction `wi` from
    /// `from`.
    #[inline]
    pub(super) fn pdf(&self, from: Vec3, index: u32, wi: Vec3, distance: f32) -> f32 {
        match self.views(from) {
            Some((_, total)) => 1.0 / total,
            None => self.wedges[index as usize].pdf_area(wi, distance).unwrap_or(0.0),
        }
    }

    /// The wedges as seen from a point, and their solid angle; none where that is better sampled by area.
    #[inline]
    fn views(&self, from: Vec3) -> Option<([View; 2], f32)> {
        if from.distance_squared(self.center) > self.far_squared {
            return None;
        }
        let pivot = (self.pivot - from).normalize();
        let mut views = [View::default(); 2];
        let mut total = 0.0;
        for (k, view) in views.iter_mut().enumerate().take(self.count) {
            *view = View::new(from, pivot, [self.ring[k], self.ring[k + 1]], self.wedges[k].area_vector);
            total += view.solid_angle;
        }
        (SMALLEST..LARGEST).contains(&total).then_some((views, total))
    }

    /// Pivot first.
    #[inline]
    fn wedge_corners(&self, k: usize) -> [Vec3; 3] {
        [self.pivot, self.ring[k], self.ring[k + 1]]
    }
}

impl Wedge {
    /// 1/area as a density of directions: distance²/(area·cos). None where it isn't finite.
    #[inline]
    fn pdf_area(&self, wi: Vec3, distance: f32) -> Option<f32> {
        let pdf = self.share * distance * distance / self.area_vector.dot(wi).abs();
        (pdf.is_finite() && pdf > 0.0).then_some(pdf)
    }

    /// A point with barycentric coordinates from the pivot on.
    #[inline]
    fn found(&self, wi: Vec3, from_pivot: [f32; 3], pdf: f32) -> PatchSample {
        let mut barycentric = from_pivot;
        barycentric.rotate_right(usize::from(self.first_corner));
        PatchSample { wi, triangle: self.triangle, barycentric, pdf }
    }
}

impl View {
    #[inline]
    fn new(from: Vec3, pivot: Vec3, ring: [Vec3; 2], area_vector: Vec3) -> Self {
        let [r0, r1] = ring.map(|r| r - from);
        let (l0, l1) = (r0.length(), r1.length());
        let directions = [r0 / l0, pivot, r1 / l1];
        let [d0, d1, d2] = directions;
        let determinant = (2.0 * area_vector.dot(d1) / (l0 * l1)).abs();
        let (g1, g2) = (d0.dot(d2) + d1.dot(d2), 1.0 + d0.dot(d1));
        // Van Oosterom and Strackee 1983.
        let solid_angle = 2.0 * angle_of(g1 + g2, determinant);
        Self { directions, g: [determinant, g1, g2], solid_angle }
    }

    /// A direction of the spherical triangle, uniform by solid angle.
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let ([d0, d1, d2], [determinant, g1, g2]) = (self.directions, self.g);
        // The corner up to which the triangle has u₀ of its solid angle: d₀ mirrored about the middle between both.
        let (sin, cos) = (self.solid_angle * (0.25 * std::f32::consts::FRAC_1_PI) * u[0]).sin_cos_turn();
        let middle = d0 * (determinant * cos - g1 * sin) + d2 * (g2 * sin);
        let corner = middle * (2.0 * d0.dot(middle) / middle.length_squared()) - d0;
        // Then on the arc from the pivot to it.
        let end = d1.dot(corner);
        let cos_arc = 1.0 + (end - 1.0) * u[1];
        let denominator = 1.0 - end * end;
        let across =
            if denominator > 0.0 { ((1.0 - cos_arc * cos_arc) / denominator).max(0.0).sqrt() } else { u[1] };
        d1 * (cos_arc - across * end) + corner * across
    }
}

/// The angle in [0, π] of the vector (x, y), y not below 0, to a relative error of 2·10⁻⁷. The polynomial is that of Moshier's Cephes
/// (`atanf`), several times as fast as the library's function for all quadrants.
#[inline]
fn angle_of(x: f32, y: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const TAN_OF_EIGHTH: f32 = 0.414_213_56;
    let ahead = x.abs();
    let (from, t) = if y <= TAN_OF_EIGHTH * ahead {
        (0.0, y / ahead)
    } else if ahead <= TAN_OF_EIGHTH * y {
        (FRAC_PI_2, -ahead / y)
    } else {
        (FRAC_PI_4, (y - ahead) / (y + ahead))
    };
    let t2 = t * t;
    let series = ((8.053_744_5e-2 * t2 - 1.387_768_6e-1) * t2 + 1.997_771_1e-1) * t2 - 3.333_295e-1;
    let angle = from + (series * t2 * t + t);
    if x < 0.0 { PI - angle } else { angle }
}

/// Barycentric coordinates that rounding may have carried over an edge; none if they are not numbers.
#[inline]
fn inside(b: [f32; 3]) -> Option<[f32; 3]> {
    let b = b.map(|x| x.max(0.0));
    let sum = b[0] + b[1] + b[2];
    (sum.is_finite() && sum > 0.0).then(|| b.map(|x| x / sum))
}

#[cfg(test)]
mod tests;
