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
use crate::math::{Real, warp};
use crate::scene::material::Sides;

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
        Self { pivot, ring, wedges, count, intensity, sides: t.sides, is_mirrored: t.is_mirrored }
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

    /// As [`Self::sample`], uniform by area.
    fn sample_area(&self, from: Vec3, u: [f32; 2]) -> Option<PatchSample> {
        let first = self.wedges[0].share;
        let (k, u0) = match self.count {
            2 if u[0] >= first => (1, ((u[0] - first) / (1.0 - first)).min(1.0)),
            _ => (0, u[0] / first),
        };
        let [b1, b2] = warp::uniform_triangle([u0, u[1]]);
        let barycentric = [1.0 - b1 - b2, b1, b2];
        let [v0, v1, v2] = self.wedge_corners(k).map(|v| v - from);
        let to_light = v0 * barycentric[0] + v1 * b1 + v2 * b2;
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
        let to_pivot = self.pivot - from;
        let area_vector = self.wedges[0].area_vector;
        // Most patches of many are small: no need to look closer.
        let distance_squared = to_pivot.length_squared();
        if area_vector.length_squared() < (SMALLEST * self.wedges[0].share * distance_squared).powi(2) {
            return None;
        }
        let pivot = to_pivot / distance_squared.sqrt();
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
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::math::hash::{combine, unit_f32};

    fn random(i: u32, salt: u64) -> f32 {
        unit_f32(combine(u64::from(i), salt) as u32)
    }

    fn anywhere(i: u32, salt: u64) -> Vec3 {
        Vec3::new(random(i, salt), random(i, salt + 1), random(i, salt + 2)) * 2.0 - 1.0
    }

    fn triangle(index: u32, vertices: [Vec3; 3]) -> EmissiveTriangle {
        let (mean_radiance, sides) = (Rgb::WHITE, Sides::Both);
        EmissiveTriangle { triangle: index, vertices, mean_radiance, sides, is_mirrored: false }
    }

    /// Quads and triangles of all shapes, seen from the origin from near and far.
    fn patches() -> Vec<Patch> {
        let mut patches = Vec::new();
        for i in 0..40 {
            let (corner, u, v) =
                (anywhere(i, 1) * (i as f32 * 0.2).exp2() * 0.1, anywhere(i, 4), anywhere(i, 7));
            let a = triangle(3, [corner, corner + u, corner + u + v]);
            let b = triangle(4, [corner + u + v, corner + v, corner]);
            patches.extend([Patch::single(&a), Patch::pair(&a, &b).expect("neighbours")]);
        }
        patches
    }

    /// Of the directions to three corners, by l'Huilier's theorem in f64.
    fn solid_angle(corners: [Vec3; 3]) -> f64 {
        let [a, b, c] = corners.map(|v| v.as_dvec3().normalize());
        let arc = |p: DVec3, q: DVec3| 2.0 * libm::asin((0.5 * (p - q).length()).min(1.0));
        let [a, b, c] = [arc(b, c), arc(c, a), arc(a, b)];
        let s = 0.5 * (a + b + c);
        let tan = |x: f64| libm::tan(0.5 * x).max(0.0);
        4.0 * libm::atan((tan(s) * tan(s - a) * tan(s - b) * tan(s - c)).sqrt())
    }

    #[test]
    fn angles_are_the_library_s() {
        for i in 0..100_000 {
            let (x, y) = (2.0 * random(i, 1) - 1.0, random(i, 2).powi(1 + (i % 8) as i32));
            let exact = libm::atan2(f64::from(y), f64::from(x));
            let error = (f64::from(angle_of(x, y)) - exact).abs();
            assert!(error <= 2e-7 * exact, "{x} {y}: {error:e} of {exact}");
        }
    }

    #[test]
    fn the_walls_of_a_room_fill_the_sphere() {
        for i in 0..50 {
            let from = anywhere(i, 1) * 0.9;
            let mut sum = 0.0;
            for face in 0..6 {
                let axis = face % 3;
                let at = |s: f32, t: f32| {
                    let mut v = [s; 3];
                    v[axis] = if face < 3 { 1.0 } else { -1.0 };
                    v[(axis + 2) % 3] = t;
                    Vec3::from(v)
                };
                let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
                let wall = Patch::pair(&triangle(0, [a, b, c]), &triangle(1, [a, c, d])).expect("a quad");
                sum += wall.views(from).expect("neither small nor large").1;
            }
            assert!((sum - 4.0 * std::f32::consts::PI).abs() < 1e-4, "{from}: {sum}");
        }
    }

    #[test]
    fn solid_angles_are_those_of_the_triangles() {
        for patch in patches() {
            let Some((_, total)) = patch.views(Vec3::ZERO) else { continue };
            let exact: f64 = (0..patch.len()).map(|k| solid_angle(patch.wedge_corners(k))).sum();
            assert!((f64::from(total) - exact).abs() < 1e-4 * exact, "{total} {exact}");
        }
    }

    /// Points on parts of the fan come as often as their solid angles say: χ² with 31 degrees of freedom, one patch in 10⁶ above 85.
    #[test]
    fn points_are_even_by_solid_angle() {
        let n = 4096u32;
        let mut tested = 0;
        for patch in patches() {
            let Some((_, total)) = patch.views(Vec3::ZERO) else { continue };
            // Wedge, then a grid of 4 × 4 by the barycentric coordinates' quarters.
            let mut counts = [0.0f64; 32];
            for i in 0..n {
                let s = patch.sample(Vec3::ZERO, [random(i, 11), random(i, 12)]).expect("visible");
                let k = patch.wedges.iter().position(|w| w.triangle == s.triangle).expect("its own");
                let mut from_pivot = s.barycentric;
                from_pivot.rotate_left(usize::from(patch.wedges[k].first_corner));
                let quarter = |x: f32| ((x * 4.0) as usize).min(3);
                counts[16 * k
                    + 4 * quarter(from_pivot[0])
                    + quarter(from_pivot[1] / (1.0 - from_pivot[0]).max(1e-9))] += 1.0;
            }
            let mut chi_squared = 0.0;
            for k in 0..patch.len() {
                let [p, a, b] = patch.wedge_corners(k);
                // Between two lines across and two lines through the pivot.
                let at = |x: usize, y: usize| p.lerp(b.lerp(a, y as f32 / 4.0), 1.0 - x as f32 / 4.0);
                for x in 0..4 {
                    for y in 0..4 {
                        let corners = [at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)];
                        let part = solid_angle([corners[0], corners[1], corners[2]])
                            + if x < 3 { solid_angle([corners[0], corners[2], corners[3]]) } else { 0.0 };
                        let expected = f64::from(n) * part / f64::from(total);
                        chi_squared += (counts[16 * k + 4 * x + y] - expected).powi(2) / expected.max(0.5);
                    }
                }
            }
            assert!(chi_squared < 85.0, "{chi_squared}: {patch:?}");
            tested += 1;
        }
        assert!(tested > 50, "{tested}");
    }

    #[test]
    fn samples_are_on_the_patch_and_know_their_pdf() {
        for (i, patch) in patches().into_iter().enumerate() {
            for from in [Vec3::ZERO, anywhere(i as u32, 21) * 1e3, patch.pivot + Vec3::splat(1e-3)] {
                for j in 0..50 {
                    let Some(s) = patch.sample(from, [random(j, 22), random(j, 23)]) else { continue };
                    let k = patch.wedges.iter().position(|w| w.triangle == s.triangle).expect("its own");
                    let mut from_pivot = s.barycentric;
                    from_pivot.rotate_left(usize::from(patch.wedges[k].first_corner));
                    assert!(from_pivot.iter().all(|b| (-1e-6..=1.000_001).contains(b)), "{from_pivot:?}");
                    let corners = patch.wedge_corners(k).map(|v| v - from);
                    let point: Vec3 = corners.iter().zip(from_pivot).map(|(&v, b)| v * b).sum();
                    assert!((point.normalize() - s.wi).length() < 1e-5, "{point} {}", s.wi);
                    let pdf = patch.pdf(from, k as u32, s.wi, point.length());
                    assert!((pdf - s.pdf).abs() <= 1e-4 * pdf, "{pdf} {}", s.pdf);
                }
            }
        }
    }

    /// ∫ cos θ dω of a quad by Lambert's formula for polygons, from points near and far, in front of its plane and all but in it.
    #[test]
    fn sampled_irradiance_is_lambert_s() {
        let corners =
            [[-1.0, 1.0, -0.5], [1.0, 1.0, -0.5], [1.2, 1.3, 1.0], [-1.2, 1.3, 1.0]].map(Vec3::from);
        let [a, b, c, d] = corners;
        let quad = Patch::pair(&triangle(0, [a, b, c]), &triangle(1, [a, c, d])).expect("a plane quad");
        for from in
            [Vec3::ZERO, Vec3::new(0.0, 0.99, -0.2), Vec3::new(0.0, -60.0, 0.3), Vec3::new(1.0, 0.505, -3.0)]
        {
            let seen = corners.map(|v| (v - from).as_dvec3().normalize());
            let exact: f64 = (0..4)
                .map(|i| {
                    let (p, q) = (seen[i], seen[(i + 1) % 4]);
                    0.5 * libm::acos(p.dot(q)) * p.cross(q).normalize().y
                })
                .sum::<f64>()
                .abs();
            let n = 256;
            let sum: f64 = (0..n * n)
                .filter_map(|i| {
                    quad.sample(from, [(i % n) as f32 + 0.5, (i / n) as f32 + 0.5].map(|x| x / n as f32))
                })
                .map(|s| f64::from(s.wi.y / s.pdf))
                .sum();
            let mean = sum / f64::from(n * n);
            assert!((mean / exact - 1.0).abs() < 1e-3, "{from}: {mean} {exact}");
        }
    }

    #[test]
    fn only_neighbours_in_one_plane_that_emit_alike_are_a_pair() {
        let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 0.0, 1.0), Vec3::Z];
        let first = triangle(0, [a, b, c]);
        let pairs = |vertices| Patch::pair(&first, &triangle(1, vertices)).is_some();
        assert!(pairs([a, c, d]) && pairs([d, a, c]) && pairs([c, d, a]));
        assert!(!pairs([a, d, c]), "the other way round");
        assert!(!pairs([a, c, d + Vec3::Y]), "bent");
        assert!(!pairs([a + Vec3::X * 5.0, c, d]), "elsewhere");
        let darker = EmissiveTriangle { mean_radiance: Rgb::grey(0.5), ..triangle(1, [a, c, d]) };
        assert!(Patch::pair(&first, &darker).is_none());
    }
}
