//! A tree with instances in it, against one over copies.

use glam::{Affine3A, Mat3, Vec3Swizzles};

use super::*;

/// The same scene twice: with every mesh once, and with copies.
struct Twins {
    shared: Bvh,
    copied: Bvh,
    /// All triangles in the world.
    corners: Vec<[Vec3; 3]>,
    /// How many instances are none of copies.
    placed: usize,
}

impl Twins {
    /// Meshes in their places; every fourth place has a copy even in the shared tree, as have those that can't share.
    fn new(meshes: Vec<Vec<[Vec3; 3]>>, places: &[(usize, Affine3A)]) -> Self {
        let (mut corners, mut own, mut ids) = (Vec::new(), Vec::new(), Vec::new());
        let shared = |triangles| Shared { triangles, placements: Vec::new() };
        let mut shared: Vec<Shared> = meshes.into_iter().map(shared).collect();
        for (i, &(mesh, to_world)) in places.iter().enumerate() {
            let Shared { triangles, placements } = &mut shared[mesh];
            let first = corners.len() as u32;
            corners.extend(triangles.iter().map(|t| t.map(|p| to_world.transform_point3(p))));
            let points = triangles.iter().flatten();
            let low = points.clone().fold(Vec3::INFINITY, |low, &p| low.min(p));
            let high = points.fold(Vec3::NEG_INFINITY, |high, &p| high.max(p));
            match Placement::new(first, &to_world, (low, high)).filter(|_| i % 4 != 3) {
                Some(placement) => placements.push(placement),
                None => {
                    own.extend_from_slice(&corners[first as usize..]);
                    ids.extend(first..corners.len() as u32);
                }
            }
        }
        let placed = shared.iter().map(|mesh| mesh.placements.len()).sum();
        let shared = Bvh::with_instances(&own, |id| ids[id as usize], &shared).unwrap();
        Self { shared, copied: Bvh::build(&corners).unwrap(), corners, placed }
    }

    /// Compares what `count` rays find; tells how many hit, and how many hit several triangles at the same distance.
    fn compare(&self, name: &str, count: u64) -> [u64; 2] {
        let portable = self.shared.clone().with_kernel(Kernel::PORTABLE);
        let (mut hit, mut tied) = (0, 0);
        for i in 0..count {
            let ray = ray(i, &self.corners);
            let closest = self.shared.closest(&ray).map(bits);
            assert_eq!(portable.closest(&ray).map(bits), closest, "{name}, ray {i}: {ray:?}");
            assert_eq!(self.shared.occluded(&ray), closest.is_some(), "{name}, ray {i}: {ray:?}");
            if is_vague(&ray) {
                continue;
            }
            let expected = self.copied.closest(&ray).map(bits);
            assert_eq!(closest, expected, "{name}, ray {i}: {ray:?}");
            let even = |h: &Hit| h.triangle.is_multiple_of(2);
            let found = self.shared.closest_where(&ray, even).map(bits);
            assert_eq!(found, self.copied.closest_where(&ray, even).map(bits), "{name}, ray {i}: {ray:?}");
            let sorted = |tree: &Bvh| {
                let mut hits = all_hits(tree, &ray);
                hits.sort_by_key(|&[triangle, t, ..]| (t, triangle));
                hits
            };
            let hits = sorted(&self.copied);
            assert_eq!(sorted(&self.shared), hits, "{name}, ray {i}: {ray:?}");
            hit += u64::from(closest.is_some());
            tied += u64::from(hits.len() > 1 && hits[0][1] == hits[1][1]);
        }
        [hit, tied]
    }
}

/// A ray of which something underflows or overflows in the test of a triangle. It may hit a triangle whose box it misses, so that even among
/// copies its hits depend on the shape of the tree.
fn is_vague(ray: &Ray) -> bool {
    let coordinates = [ray.origin, ray.direction].into_iter().flat_map(|v| v.to_array());
    coordinates.map(f32::abs).any(|v| v.is_finite() && v != 0.0 && !(1e-30..1e30).contains(&v))
}

fn vector(i: u64, salt: u64) -> Vec3 {
    Vec3::new(random(i, salt), random(i, salt + 1), random(i, salt + 2)) * 2.0 - 1.0
}

/// A turn about any axis, scaled by axes, and moved.
fn turned(i: u64, scale: Vec3, translation: Vec3) -> Affine3A {
    let rotation = glam::Quat::from_axis_angle(direction(i), random(i, 200) * 6.0);
    Affine3A::from_scale_rotation_translation(scale, rotation, translation)
}

/// Any matrix at all.
fn sheared(i: u64, translation: Vec3) -> Affine3A {
    let matrix = Mat3::from_cols(vector(i, 210), vector(i, 220), vector(i, 230));
    Affine3A::from_mat3_translation(matrix, translation)
}

/// `count` instances of two meshes, the first one's more often.
fn places(count: u64, of: impl Fn(u64) -> Affine3A) -> Vec<(usize, Affine3A)> {
    (0..count).map(|i| (usize::from(i % 3 == 1), of(i))).collect()
}

/// A flat square in a plane across an axis, so that boxes around its triangles have no thickness, and a cube of such.
fn tiles() -> Vec<[Vec3; 3]> {
    let at = |x: u16, y: u16| Vec3::new(f32::from(x), f32::from(y), 0.0) / 5.0 - Vec3::new(1.0, 1.0, 0.0);
    let cell = |x: u16, y: u16| {
        let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
        [[a, b, d], [a, d, c]]
    };
    let face: Vec<_> = (0..100).flat_map(|i| cell(i % 10, i / 10)).collect();
    let turned = |to: fn(Vec3) -> Vec3| face.clone().into_iter().map(move |t| t.map(to));
    let cube: [fn(Vec3) -> Vec3; 6] = [
        |p| p + Vec3::Z,
        |p| p - Vec3::Z,
        |p| p.yzx() + Vec3::Y,
        |p| p.yzx() - Vec3::Y,
        |p| p.zxy() + Vec3::X,
        |p| p.zxy() - Vec3::X,
    ];
    cube.into_iter().flat_map(turned).collect()
}

/// Four hundred thousand rays: what is found in shared meshes is what copies give, by every kernel, to the last bit.
#[test]
fn instances_are_hit_as_copies_are() {
    let plain = || vec![soup(300, 0.4), sphere(12, 24)];
    let uniform = |i: u64, by: f32| turned(i, Vec3::splat(by * (0.5 + random(i, 240))), vector(i, 250) * by);
    let signs = |i: u64| Vec3::new(1.0, if i.is_multiple_of(2) { -1.0 } else { 1.0 }, 1.0);
    let far = |i: u64, by: f32| turned(i, signs(i), vector(i, 250) + Vec3::new(by, -0.3 * by, 0.01 * by));
    let squashed = |i: u64| turned(i, Vec3::new(2.0, 0.01, 0.3) * signs(i), vector(i, 250));
    let needles = soup(300, 1.0).into_iter().map(|[a, b, _]| [a, b, a.lerp(b, 0.3) + Vec3::splat(1e-4)]);
    let scenes = [
        ("turned", Twins::new(plain(), &places(24, |i| uniform(i, 1.0)))),
        ("sheared", Twins::new(plain(), &places(24, |i| sheared(i, vector(i, 250))))),
        ("squashed and mirrored", Twins::new(plain(), &places(24, squashed))),
        ("tiny", Twins::new(plain(), &places(24, |i| uniform(i, 1e-6)))),
        ("huge", Twins::new(plain(), &places(24, |i| uniform(i, 1e6)))),
        ("far", Twins::new(plain(), &places(24, |i| far(i, 1000.0)))),
        ("farther", Twins::new(plain(), &places(24, |i| far(i, 30_000.0)))),
        ("in one place", Twins::new(plain(), &places(24, |i| uniform(i / 8, 1.0)))),
        (
            "many in one place",
            Twins::new(vec![soup(20, 0.5), sphere(3, 5)], &places(60, |_| uniform(7, 1.0))),
        ),
        ("where the mesh is", Twins::new(plain(), &places(5, |_| Affine3A::IDENTITY))),
        ("flat", Twins::new(vec![tiles(), sphere(2, 4)], &places(12, |i| uniform(i, 1.0)))),
        ("needles", Twins::new(vec![needles.collect(), soup(9, 0.5)], &places(24, |i| uniform(i, 1.0)))),
        (
            "on a grid",
            Twins::new(
                vec![tiles(), tiles()],
                &places(12, |i| {
                    let at = (vector(i, 250) * 2.0).round();
                    Affine3A::from_translation(at)
                        * Affine3A::from_rotation_y((i / 2) as f32 * std::f32::consts::FRAC_PI_2)
                }),
            ),
        ),
    ];
    let (mut hit, mut tied, mut least) = (0, 0, 1.0);
    for (name, twins) in scenes {
        assert!(twins.placed > 3, "{name}: {}", twins.placed);
        let count = 30_000;
        let [h, t] = twins.compare(name, count);
        (hit, tied, least) = (hit + h, tied + t, f64::min(least, h as f64 / count as f64));
    }
    assert!(hit > 200_000 && tied > 20_000 && least > 0.2, "{hit} hits, {tied} ties, at least {least}");
}

/// Transforms without a way back, or one that floats can't hold.
#[test]
fn what_cannot_be_traced_in_its_own_space_is_refused() {
    let unit = (-Vec3::ONE, Vec3::ONE);
    let is_refused = |to_world: Affine3A| Placement::new(0, &to_world, unit).is_none();
    let scale = |x: f32, y: f32, z: f32| Affine3A::from_scale(Vec3::new(x, y, z));
    let flat = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::X + Vec3::Y);
    for refused in [
        scale(1.0, 0.0, 1.0),
        scale(0.0, 0.0, 0.0),
        scale(1.0, 1e-8, 1.0),
        scale(1e-30, 1e-30, 1e-30),
        scale(1e30, 1e30, 1e30),
        scale(f32::NAN, 1.0, 1.0),
        scale(f32::INFINITY, 1.0, 1.0),
        Affine3A::from_mat3(flat),
        Affine3A::from_translation(Vec3::splat(1e7)),
        Affine3A::from_translation(Vec3::splat(f32::MAX)),
    ] {
        assert!(is_refused(refused), "{refused:?}");
    }
    for accepted in [scale(1.0, 1.0, 1.0), scale(-1e-9, 1e-9, 1e-9), scale(1.0, 1e-3, 1.0)] {
        assert!(!is_refused(accepted), "{accepted:?}");
    }
    let point = Placement::new(0, &Affine3A::IDENTITY, (Vec3::ONE, Vec3::ONE));
    assert!(point.is_none(), "nothing to search in a mesh without extent");
}

#[test]
fn boxes_touch_the_triangles_of_instances_as_those_of_copies() {
    let twins = Twins::new(vec![soup(300, 0.4), sphere(12, 24)], &places(24, |i| sheared(i, vector(i, 250))));
    let mut touched = 0;
    for i in 0..2000 {
        let center = twins.corners[(random(i, 1) * twins.corners.len() as f32) as usize][0];
        let reach = Vec3::splat(0.1 * random(i, 2));
        let among = |tree: &Bvh| {
            let mut found = Vec::new();
            tree.visit_box(center - reach, center + reach, |id| found.push(id));
            found.sort_unstable();
            found
        };
        let found = among(&twins.shared);
        assert_eq!(found, among(&twins.copied), "box {i}");
        touched += found.len();
    }
    assert!(touched > 5000, "{touched}");
}

#[test]
fn a_shared_mesh_takes_its_own_memory_alone() {
    let ball = sphere(50, 100);
    let [one, many] = [1, 300].map(|count| {
        let place = |i: u16| {
            let to_world = Affine3A::from_translation(Vec3::X * (3.0 * f32::from(i)));
            Placement::new(u32::from(i) * ball.len() as u32, &to_world, (-Vec3::ONE, Vec3::ONE)).unwrap()
        };
        let shared = Shared { triangles: ball.clone(), placements: (0..count).map(place).collect() };
        Bvh::with_instances(&[], |id| id, &[shared]).unwrap()
    });
    assert_eq!(many.len(), 300 * one.len());
    let each = (many.bytes() - one.bytes()) as f64 / 299.0;
    assert!((128.0..300.0).contains(&each), "{each} bytes an instance");
}

#[test]
fn too_many_triangles_are_told_even_if_they_are_few_in_memory() {
    let placement = Placement::new(0, &Affine3A::IDENTITY, (-Vec3::ONE, Vec3::ONE)).unwrap();
    let shared = Shared { triangles: vec![[Vec3::ZERO; 3]; 1 << 20], placements: vec![placement; 2048] };
    let error = Bvh::with_instances(&[], |id| id, &[shared]).unwrap_err();
    assert!(error.to_string().contains("2147483648 triangles"), "{error}");
}
