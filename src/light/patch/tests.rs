//! Against formulas of their own: l'Huilier's and Lambert's, and counts.

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
    for i in 0..80 {
        let (corner, u, v) =
            (anywhere(i, 1) * libm::exp2f(i as f32 * 0.1) * 0.1, anywhere(i, 4), anywhere(i, 7));
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
        let (x, y) = (2.0 * random(i, 1) - 1.0, libm::powf(random(i, 2), (1 + i % 8) as f32));
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
                    chi_squared += (counts[16 * k + 4 * x + y] - expected).sqr() / expected.max(0.5);
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
    let corners = [[-1.0, 1.0, -0.5], [1.0, 1.0, -0.5], [1.2, 1.3, 1.0], [-1.2, 1.3, 1.0]].map(Vec3::from);
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
        // Where it is sampled by area, the seam between both triangles lies across the midpoints.
        let n = 1024;
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
