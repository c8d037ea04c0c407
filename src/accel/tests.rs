//! What rays find, against brute force and against the other kernel.

mod instances;

use super::*;
use crate::math::hash::{combine, mix64, unit_f32};
use crate::math::warp;

fn random(i: u64, salt: u64) -> f32 {
    unit_f32(combine(i, salt) as u32)
}

fn soup(n: u64, size: f32) -> Vec<[Vec3; 3]> {
    (0..n)
        .map(|i| {
            let at = |k: u64| Vec3::new(random(i, k), random(i, k + 1), random(i, k + 2));
            let center = at(0) * 2.0 - 1.0;
            [center, center + (at(10) - 0.5) * size, center + (at(20) - 0.5) * size]
        })
        .collect()
}

fn direction(i: u64) -> Vec3 {
    warp::uniform_sphere([random(i, 77), random(i, 78)]).into()
}

/// A closed sphere of triangles.
fn sphere(rings: u32, segments: u32) -> Vec<[Vec3; 3]> {
    use crate::math::Real;
    let at = |ring: u32, segment: u32| {
        let theta = std::f32::consts::PI * ring as f32 / rings as f32;
        let phi = std::f32::consts::TAU * (segment % segments) as f32 / segments as f32;
        if ring == 0 {
            Vec3::Y
        } else if ring == rings {
            -Vec3::Y
        } else {
            Vec3::new(Real::sin(theta) * Real::cos(phi), Real::cos(theta), Real::sin(theta) * Real::sin(phi))
        }
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let (a, b) = (at(ring, segment), at(ring, segment + 1));
            let (c, d) = (at(ring + 1, segment), at(ring + 1, segment + 1));
            if ring > 0 {
                triangles.push([a, b, c]);
            }
            if ring + 1 < rings {
                triangles.push([b, d, c]);
            }
        }
    }
    triangles
}

/// The nearest hit by testing every triangle on its own.
fn brute_force(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<Hit> {
    let sheared = triangle::ShearedRay::new(ray);
    let hit = |(id, &corners): (usize, &[Vec3; 3])| {
        let (t, barycentric) = triangle::intersect(corners, &sheared)?;
        let counts = t < ray.t_max && ray.source != Some(id as u32);
        counts.then_some(Hit { t, triangle: id as u32, barycentric })
    };
    triangles.iter().enumerate().filter_map(hit).min_by(|a, b| a.t.total_cmp(&b.t))
}

#[test]
fn tree_and_brute_force_find_the_same_bits() {
    let triangles = soup(800, 0.3);
    let bvh = Bvh::build(&triangles).unwrap();
    let mut hits = 0;
    for i in 0..4000 {
        let origin = Vec3::new(random(i, 1), random(i, 2), random(i, 3)) * 4.0 - 2.0;
        let target = triangles[i as usize % 800][0] + direction(i) * 0.1;
        let source = (i % 3 == 0).then_some(i as u32 % 800);
        let ray = Ray { source, ..Ray::new(origin, target - origin) };
        let brute = brute_force(&triangles, &ray);
        assert_eq!(bvh.closest(&ray), brute, "ray {i}");
        assert_eq!(bvh.occluded(&ray), brute.is_some());
        hits += u32::from(brute.is_some());
    }
    assert!(hits > 500, "the test must hit something: {hits}");
}

#[test]
fn axis_parallel_rays_in_the_plane_of_a_face_still_hit() {
    let quad = [[Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y], [Vec3::ZERO, Vec3::X + Vec3::Y, Vec3::Y]];
    let bvh = Bvh::build(&quad).unwrap();
    for origin in [Vec3::new(0.5, 0.5, 1.0), Vec3::new(0.0, 0.5, 1.0), Vec3::new(0.5, 0.0, 1.0)] {
        assert!(bvh.closest(&Ray::new(origin, -Vec3::Z)).is_some(), "{origin}");
    }
}

#[test]
fn no_ray_aimed_at_an_edge_or_a_vertex_leaves_a_closed_sphere() {
    let triangles = sphere(24, 48);
    let bvh = Bvh::build(&triangles).unwrap();
    for (i, t) in triangles.iter().enumerate() {
        let i = i as u64;
        for k in 0..12 {
            let along = random(i, 100 + k);
            let target = if k < 3 {
                t[k as usize]
            } else {
                t[(k % 3) as usize].lerp(t[((k + 1) % 3) as usize], along)
            };
            let origin = Vec3::new(random(i, k), random(i, k + 30), random(i, k + 60)) * 0.8 - 0.4;
            let ray = Ray::new(origin, target - origin);
            assert!(bvh.closest(&ray).is_some(), "triangle {i}, ray {k}");
        }
    }
}

#[test]
fn barycentric_coordinates_give_the_point_back() {
    let triangles = soup(50, 1.0);
    let bvh = Bvh::build(&triangles).unwrap();
    for i in 0..500 {
        let ray = Ray::new(Vec3::splat(random(i, 5) - 0.5), direction(i));
        if let Some(hit) = bvh.closest(&ray) {
            let t = triangles[hit.triangle as usize];
            let b = hit.barycentric;
            let p = t[0] * b[0] + t[1] * b[1] + t[2] * b[2];
            assert!((p - (ray.origin + ray.direction * hit.t)).length() < 1e-5);
        }
    }
}

#[test]
fn an_empty_tree_and_degenerate_triangles_are_never_hit() {
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert!(Bvh::build(&[]).unwrap().closest(&ray).is_none());
    let degenerate = [[Vec3::Z; 3], [Vec3::Z, Vec3::Z * 2.0, Vec3::Z * 3.0]];
    assert!(Bvh::build(&degenerate).unwrap().closest(&ray).is_none());
}

#[test]
fn thousands_of_coincident_triangles_build_and_are_all_visited() {
    let triangles =
        vec![[Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(0.0, 1.0, 1.0)]; 20_000];
    let bvh = Bvh::build(&triangles).unwrap();
    let mut seen = Vec::new();
    bvh.visit(&Ray::new(Vec3::ZERO, Vec3::Z), |hit| {
        seen.push(hit.triangle);
        ControlFlow::Continue(())
    });
    seen.sort_unstable();
    assert!(seen.into_iter().eq(0..20_000));
}

/// Stacks of one triangle to two dozen, their corners turned round, mixed with what stands alone.
#[test]
fn stacks_hit_as_each_of_their_triangles_would_alone() {
    let single = soup(60, 0.8);
    let turned = |[a, b, c]: [Vec3; 3], i: usize| [[a, b, c], [b, c, a], [c, b, a]][i % 3];
    let triangles: Vec<_> =
        (0..1440).filter(|i| i / 60 <= i % 60).map(|i| turned(single[i % 60], i / 60)).collect();
    let bvh = Bvh::build(&triangles).unwrap();
    let mut stacked = 0;
    for i in 0..4000 {
        let k = (random(i, 4) * triangles.len() as f32) as usize;
        let origin = Vec3::new(random(i, 1), random(i, 2), random(i, 3)) * 4.0 - 2.0;
        let source = i.is_multiple_of(3).then_some(k as u32);
        let target = triangles[k].iter().sum::<Vec3>() / 3.0 + direction(i) * 0.1;
        let ray = Ray { source, ..Ray::new(origin, target - origin) };
        let sheared = triangle::ShearedRay::new(&ray);
        let alone = |&id: &u32| {
            let hit = triangle::intersect(triangles[id as usize], &sheared);
            ray.source != Some(id) && hit.is_some_and(|(t, _)| t < ray.t_max)
        };
        let expected: Vec<u32> = (0..triangles.len() as u32).filter(alone).collect();
        let mut found: Vec<u32> = all_hits(&bvh, &ray).into_iter().map(|[id, ..]| id).collect();
        found.sort_unstable();
        assert_eq!(found, expected, "ray {i}");
        assert_eq!(bvh.closest(&ray), brute_force(&triangles, &ray), "ray {i}");
        stacked += usize::from(expected.len() > 9);
    }
    assert!(stacked > 300, "the test must hit stacks: {stacked}");
}

/// Meshes in which something is extreme: sizes, places, shapes, or how many are in one place.
fn meshes() -> Vec<Vec<[Vec3; 3]>> {
    let scaled = |by: f32| soup(200, 0.5).into_iter().map(|t| t.map(|p| p * by)).collect::<Vec<_>>();
    let needles = soup(300, 1.0).into_iter().map(|[a, b, _]| [a, b, a.lerp(b, 0.3) + Vec3::splat(1e-7)]);
    let on_grid = soup(400, 2.0).into_iter().map(|t| t.map(|p| (p * 2.0).round() * 0.5));
    let tripled = [soup(100, 0.5), soup(100, 0.5), soup(100, 0.5)].concat();
    vec![
        soup(800, 0.3),
        sphere(24, 48),
        tripled,
        needles.collect(),
        on_grid.collect(),
        scaled(1e-30),
        scaled(1e25),
        scaled(2e38),
        vec![[Vec3::Z, Vec3::Z + Vec3::X, Vec3::Z + Vec3::Y]; 30],
        soup(1, 1.0),
        Vec::new(),
    ]
}

/// Rays of all kinds: anywhere, along an axis, from and to corners and edges, short, starting on a triangle, and none that one
/// should trace.
fn ray(i: u64, triangles: &[[Vec3; 3]]) -> Ray {
    let nothing = [Vec3::ZERO; 3];
    let pick = |salt: u64| {
        let k = (random(i, salt) * triangles.len() as f32) as usize;
        triangles.get(k).unwrap_or(&nothing)
    };
    let size = pick(1).iter().map(|p| p.abs().max_element()).fold(1e-30, f32::max);
    let [a, b, c] = *pick(2);
    let origin = match i % 5 {
        0 => a,
        1 => a.lerp(b, random(i, 3)),
        2 => a * 0.25 + b * 0.5 + c * 0.25,
        _ => direction(i) * random(i, 4) * 2.0 * size,
    };
    let [a, b, c] = *pick(5);
    let axis = [Vec3::X, Vec3::Y, Vec3::Z][(i / 7 % 3) as usize];
    let direction = match i / 5 % 7 {
        0 => axis,
        1 => -axis,
        2 => a - origin,
        3 => a.lerp(b, random(i, 6)) - origin,
        4 => (a + b + c) / 3.0 - origin,
        5 => direction(mix64(i)) * (Vec3::ONE - axis),
        _ => direction(mix64(i)),
    };
    let t_max = if (i / 35).is_multiple_of(3) { random(i, 7) * 2.0 } else { f32::INFINITY };
    let source = (i / 105).is_multiple_of(2).then_some((random(i, 2) * triangles.len() as f32) as u32);
    let odd = [0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::MIN_POSITIVE, 1e-42, f32::MAX];
    let spoilt = |v: Vec3, salt: u64| {
        let mut v = v.to_array();
        if i.is_multiple_of(11) {
            v[(random(i, salt) * 3.0) as usize] = odd[(random(i, salt + 1) * 8.0) as usize];
        }
        Vec3::from_array(v)
    };
    let t_max = if i.is_multiple_of(1009) { f32::NAN } else { t_max };
    Ray { origin: spoilt(origin, 8), direction: spoilt(direction, 10), t_max, source }
}

fn bits(hit: Hit) -> [u32; 5] {
    let [b0, b1, b2] = hit.barycentric.map(f32::to_bits);
    [hit.triangle, hit.t.to_bits(), b0, b1, b2]
}

fn all_hits(bvh: &Bvh, ray: &Ray) -> Vec<[u32; 5]> {
    let mut hits = Vec::new();
    bvh.visit(ray, |hit| {
        hits.push(bits(hit));
        ControlFlow::Continue(())
    });
    hits
}

/// A million rays: the kernel of this machine and the portable one find the same hits in the same order, and the nearest of
/// all hits, of equally near ones the first in the list, is the closest.
#[test]
fn kernels_find_the_same_bits_on_any_ray() {
    let (mut hit, mut tied) = (0, 0);
    for (m, triangles) in meshes().into_iter().enumerate() {
        let bvh = Bvh::build(&triangles).unwrap();
        let twin = Bvh::build(&triangles).unwrap().with_kernel(Kernel::PORTABLE);
        for i in 0..100_000 {
            let ray = ray(i, &triangles);
            let closest = bvh.closest(&ray).map(bits);
            assert_eq!(closest, twin.closest(&ray).map(bits), "mesh {m}, ray {i}: {ray:?}");
            let mut hits = all_hits(&bvh, &ray);
            assert_eq!(hits, all_hits(&twin, &ray), "mesh {m}, ray {i}: {ray:?}");
            // Positive floats sort like their bits.
            hits.sort_by_key(|&[triangle, t, ..]| (t, triangle));
            assert_eq!(closest, hits.first().copied(), "mesh {m}, ray {i}: {ray:?}");
            assert_eq!(bvh.occluded(&ray), closest.is_some());
            let even = |h: &Hit| h.triangle.is_multiple_of(2);
            let nearest_even = hits.iter().find(|h| h[0] % 2 == 0).copied();
            assert_eq!(bvh.closest_where(&ray, even).map(bits), nearest_even, "mesh {m}, ray {i}: {ray:?}");
            hit += u32::from(closest.is_some());
            tied += u32::from(hits.len() > 1 && hits[0][1] == hits[1][1]);
        }
    }
    assert!(hit > 200_000 && tied > 20_000, "{hit} hits, {tied} ties");
}

/// A tree with something else in it has other boxes, and is searched in another order.
#[test]
fn hits_do_not_depend_on_the_shape_of_the_tree() {
    for triangles in [soup(400, 0.4), sphere(16, 32), [soup(80, 0.5), soup(80, 0.5)].concat()] {
        let bvh = Bvh::build(&triangles).unwrap();
        let far = soup(777, 3.0).into_iter().map(|t| t.map(|p| p * 5.0 + Vec3::new(40.0, -30.0, 35.0)));
        let larger = Bvh::build(&[triangles.clone(), far.collect()].concat()).unwrap();
        let count = triangles.len() as u32;
        for i in 0..50_000 {
            let ray = ray(i, &triangles);
            let found = larger.closest_where(&ray, |hit| hit.triangle < count);
            assert_eq!(bvh.closest(&ray).map(bits), found.map(bits), "ray {i}: {ray:?}");
        }
    }
}

/// The levels of inner nodes, once it is clear that every triangle is in the tree, once, and inside all boxes above it.
fn levels(bvh: &Bvh) -> usize {
    fn below(bvh: &Bvh, child: Child, (low, high): (Vec3, Vec3), seen: &mut [u32]) -> usize {
        if let Some(block) = child.leaf() {
            for (id, corners) in bvh.blocks[block].triangles() {
                seen[id as usize] += 1;
                assert!(corners.iter().all(|p| p.cmpge(low).all() && p.cmple(high).all()));
            }
            return 0;
        }
        let node = &bvh.nodes[child.node()];
        let corner = |slot: usize, side: usize| Vec3::from_array(node.bounds.map(|axis| axis[side][slot]));
        let taken = (0..8).filter(|&slot| corner(slot, 0).is_finite());
        1 + taken
            .map(|slot| {
                let (l, h) = (corner(slot, 0), corner(slot, 1));
                assert!(l.cmpge(low).all() && h.cmple(high).all());
                below(bvh, node.child[slot], (l, h), seen)
            })
            .max()
            .expect("a child")
    }
    let mut seen = vec![0; bvh.len()];
    let levels = below(bvh, bvh.root, (Vec3::NEG_INFINITY, Vec3::INFINITY), &mut seen);
    assert!(seen.iter().all(|&times| times == 1));
    levels
}

#[test]
fn trees_hold_every_triangle_once_and_are_never_too_deep() {
    let deepest = meshes().iter().map(|triangles| levels(&Bvh::build(triangles).unwrap())).max();
    assert!(deepest <= Some(node::MOST_LEVELS));
    let levels_of_sphere = levels(&Bvh::build(&sphere(24, 48)).unwrap());
    assert!(levels_of_sphere <= 6, "{levels_of_sphere} for 2208 triangles");
    let one = [Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(0.0, 1.0, 1.0)];
    let nested = (0..20_000).map(|i| one.map(|p| p * (1.0 + i as f32 * 1e-6)));
    let doubled = (0..80).map(|i| one.map(|p| p * libm::exp2f(i as f32 - 40.0)));
    for triangles in [vec![one; 20_000], nested.collect(), doubled.collect()] {
        let bvh = Bvh::build(&triangles).unwrap();
        let levels = levels(&bvh);
        assert!(levels <= node::MOST_LEVELS, "{levels}");
        assert_eq!(all_hits(&bvh, &Ray::new(Vec3::ZERO, Vec3::Z)).len(), triangles.len());
    }
}

#[test]
fn a_triangle_takes_less_than_a_hundred_bytes() {
    let bvh = Bvh::build(&sphere(100, 200)).unwrap();
    let each = bvh.bytes() as f64 / bvh.len() as f64;
    assert!((40.0..100.0).contains(&each), "{each}");
}
