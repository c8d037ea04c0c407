//! Closed meshes, and rays that must not leave them.

use std::sync::Arc;

use glam::{Affine3A, DQuat, DVec3, Vec3};
use pipeline::accel::Ray;
use pipeline::math::{hash, warp};
use pipeline::render::Geometry;
use pipeline::scene::{Instance, MaterialId, Mesh, MeshId, Scene};
use rayon::prelude::*;

use super::sphere;

/// A closed mesh of about unit size around the origin, facing outwards.
pub(crate) struct Closed {
    pub(crate) name: &'static str,
    pub(crate) mesh: Mesh,
    /// No triangle is so thin that rounding its corners could turn it over.
    pub(crate) is_sound: bool,
    /// The radius of the circle in the plane y = 0 around which rays start.
    ring: f32,
    /// And how far from it, along each axis.
    spread: f32,
}

/// Every kind of closed mesh: round and with corners, of few triangles and many, of needles, with triangles of no area, and with
/// every face twice.
pub(crate) fn meshes() -> Vec<Closed> {
    let around = |name, mesh, spread| Closed { name, mesh, is_sound: true, ring: 0.0, spread };
    let thin = |name, mesh, spread| Closed { is_sound: false, ..around(name, mesh, spread) };
    vec![
        around("coarse sphere", sphere(1.0, Vec3::ZERO, 4), 0.3),
        around("fine sphere", sphere(1.0, Vec3::ZERO, 64), 0.5),
        Closed { name: "torus", mesh: torus(24, 12), is_sound: true, ring: 0.7, spread: 0.08 },
        around("cube of needles", needle_cube(DQuat::IDENTITY), 0.5),
        thin("turned cube of needles", needle_cube(DQuat::from_xyzw(0.1, 0.5, -0.3, 0.8).normalize()), 0.4),
        thin("sphere with zero areas", with_zero_areas(sphere(1.0, Vec3::ZERO, 12)), 0.5),
        around("doubled sphere", doubled(sphere(1.0, Vec3::ZERO, 12)), 0.5),
        around("wedge of 15 degrees", wedge(15.0), 0.05),
    ]
}

/// A torus about the y axis with the radii 0.7 and 0.3.
fn torus(around: u32, across: u32) -> Mesh {
    let angle = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let positions = (0..around * across).map(|i| {
        let (theta, phi) = (angle(i / across, around), angle(i % across, across));
        let r = 0.7 + 0.3 * libm::cos(phi);
        DVec3::new(r * libm::cos(theta), 0.3 * libm::sin(phi), r * libm::sin(theta)).as_vec3()
    });
    let at = |i: u32, k: u32| i % around * across + k % across;
    let quads = (0..around).flat_map(|i| (0..across).map(move |k| (i, k)));
    let triangles = quads.flat_map(|(i, k)| {
        let [a, b, c, d] = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
        [[a, b, c], [a, c, d]]
    });
    Mesh { positions: positions.collect(), triangles: triangles.collect(), ..Mesh::default() }
}

/// A cube whose faces are fans from their middles; the nearer to a corner, the narrower the triangles: down to 10⁻⁶ of their length.
fn needle_cube(turn: DQuat) -> Mesh {
    let steps = [-1.0, -1.0 + 1e-6, -1.0 + 2e-6, -1.0 + 1e-4, -0.5, -1e-6, 0.0, 0.7, 1.0 - 1e-3, 1.0 - 1e-6];
    let mut mesh = Mesh::default();
    let mut vertex = |p: DVec3| {
        let p = (turn * p).as_vec3();
        mesh.positions.iter().position(|&q| q == p).unwrap_or_else(|| {
            mesh.positions.push(p);
            mesh.positions.len() - 1
        }) as u32
    };
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let point = |u: f64, v: f64| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
                vertex(DVec3::from(p))
            };
            let (mut point, mut rim) = (point, Vec::new());
            let middle = point(0.0, 0.0);
            rim.extend(steps.map(|s| point(s, -1.0)));
            rim.extend(steps.map(|s| point(1.0, s)));
            // Edges are divided alike, whichever way a face runs along them.
            rim.extend(steps.iter().rev().map(|&s| point(s, 1.0)).collect::<Vec<_>>());
            rim.insert(20, point(1.0, 1.0));
            rim.extend(steps.iter().rev().map(|&s| point(-1.0, s)));
            rim.dedup();
            let next = |i: usize| rim[(i + 1) % rim.len()];
            for (i, &a) in rim.iter().enumerate().filter(|&(i, &a)| next(i) != a) {
                mesh.triangles.push(if side > 0.0 { [middle, a, next(i)] } else { [middle, next(i), a] });
            }
        }
    }
    mesh
}

/// Every triangle's first edge is split at its middle, and the gap is closed by a triangle without area, or hardly any. Some others
/// have coincident corners.
fn with_zero_areas(mut mesh: Mesh) -> Mesh {
    for [a, b, c] in std::mem::take(&mut mesh.triangles) {
        let middle = mesh.positions.len() as u32;
        mesh.positions.push((mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.5);
        mesh.triangles.extend([[a, middle, c], [middle, b, c], [a, b, middle], [a, a, b], [c, c, c]]);
    }
    mesh
}

fn doubled(mut mesh: Mesh) -> Mesh {
    mesh.triangles.extend_from_within(..);
    mesh
}

/// A roof whose two long faces meet at an acute angle.
fn wedge(degrees: f64) -> Mesh {
    let half = libm::tan((degrees / 2.0).to_radians());
    let x = [-0.5, 0.5];
    let corner = |y: f64, z: f64| DVec3::new(x[usize::from(y != 0.0)], y, z).as_vec3();
    let positions = [-0.5, 0.5].into_iter().flat_map(|z| [corner(0.0, z), corner(-half, z), corner(half, z)]);
    Mesh {
        positions: positions.collect(),
        triangles: vec![
            [0, 2, 1],
            [3, 4, 5],
            [0, 1, 4],
            [0, 4, 3],
            [0, 3, 5],
            [0, 5, 2],
            [1, 2, 5],
            [1, 5, 4],
        ],
        ..Mesh::default()
    }
}

/// Where rays go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Aim {
    /// In random directions.
    Anywhere,
    /// A quarter of them each to points of edges and to vertices, from where paths then go on.
    Edges,
}

/// Where a mesh stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    pub(crate) scale: f64,
    /// How far from the origin, in m along each axis.
    pub(crate) offset: f64,
}

impl Closed {
    /// The mesh placed, with its vertices as floats in the world.
    pub(crate) fn placed(&self, at: Placement) -> Mesh {
        let mut mesh = self.mesh.clone();
        for p in &mut mesh.positions {
            *p = (p.as_dvec3() * at.scale + at.center()).as_vec3();
        }
        mesh
    }

    /// A point well inside.
    pub(crate) fn inside(&self, at: Placement) -> Vec3 {
        (DVec3::X * f64::from(self.ring) * at.scale + at.center()).as_vec3()
    }

    /// Shoots at least `rays` rays inside, along paths of up to 16 that leave surfaces as the renderer's do.
    pub(crate) fn shoot(&self, at: Placement, aim: Aim, rays: u64) -> Shots {
        let geometry = Geometry::build(&scene_of(self.placed(at))).expect("a tree");
        let mesh = self.placed(at);
        let per_chunk = 1 << 14;
        (0..rays.div_ceil(per_chunk))
            .into_par_iter()
            .map(|chunk| {
                let mut random = Random(hash::mix64(chunk));
                let mut shots = Shots::default();
                while shots.rays < per_chunk {
                    self.path(at, aim, &geometry, &mesh, &mut random, &mut shots);
                }
                shots
            })
            .reduce(Shots::default, Shots::plus)
    }

    fn path(
        &self,
        at: Placement,
        aim: Aim,
        geometry: &Geometry,
        mesh: &Mesh,
        random: &mut Random,
        shots: &mut Shots,
    ) {
        let scale = at.scale as f32;
        let relative = |p: Vec3| p - geometry.origin();
        let ring: Vec3 = warp::uniform_sphere([0.5, random.unit()]).into();
        let spread = Vec3::from_array([(); 3].map(|()| 2.0 * random.unit() - 1.0)) * self.spread;
        let ring = Vec3::new(ring.x, 0.0, ring.y);
        let start = relative(at.center().as_vec3()) + (ring * self.ring + spread) * scale;
        let mut ray = Ray::new(start, random.direction(aim, start, mesh, relative));
        for _ in 0..16 {
            shots.rays += 1;
            let Some(hit) = geometry.closest(&ray) else {
                shots.escaped += 1;
                return;
            };
            let departure = geometry.departure(&ray, &hit);
            let has_side = departure.normal() != -ray.direction;
            let inward = if has_side { -departure.normal() } else { -ray.direction };
            // On an edge a ray may touch a face that turns away behind it, and slivers may be folded.
            let [a, b, c] =
                mesh.triangles[hit.triangle as usize].map(|i| mesh.positions[i as usize].as_dvec3());
            let longest = (b - a).length_squared().max((c - a).length_squared());
            let is_sliver = (b - a).cross(c - a).length() < 1e-5 * longest;
            let in_face = has_side && !is_sliver && hit.barycentric.iter().all(|&b| b > 1e-5);
            if in_face && ray.direction.dot(inward) > 1e-3 {
                shots.outside += 1;
                return;
            }
            let point = ray.origin + ray.direction * hit.t;
            let direction = random.direction(aim, point, mesh, relative);
            let direction = if direction.dot(inward) < 0.0 { -direction } else { direction };
            ray = departure.ray(direction);
        }
    }
}

impl Placement {
    fn center(self) -> DVec3 {
        DVec3::new(1.0, -1.0, 1.0) * self.offset
    }
}

/// What became of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Shots {
    pub(crate) rays: u64,
    /// They hit nothing.
    pub(crate) escaped: u64,
    /// They hit a face from outside.
    pub(crate) outside: u64,
}

impl Shots {
    fn plus(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            escaped: self.escaped + other.escaped,
            outside: self.outside + other.outside,
        }
    }
}

/// Independent random numbers.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        hash::mix64(self.0)
    }

    fn unit(&mut self) -> f32 {
        hash::unit_f32((self.bits() >> 32) as u32)
    }

    /// Anywhere, or from `point` to a point of an edge or to a vertex of `mesh`.
    fn direction(&mut self, aim: Aim, point: Vec3, mesh: &Mesh, relative: impl Fn(Vec3) -> Vec3) -> Vec3 {
        if aim == Aim::Anywhere {
            return warp::uniform_sphere([self.unit(), self.unit()]).into();
        }
        let choice = self.bits() % 4;
        let triangle = mesh.triangles[self.bits() as usize % mesh.triangles.len()];
        let first = self.bits() as usize % 3;
        let [a, b] = [first, (first + 1) % 3].map(|k| relative(mesh.positions[triangle[k] as usize]));
        let aim = match choice {
            0 => a,
            1 => a + (b - a) * self.unit(),
            _ => point,
        };
        (aim - point)
            .try_normalize()
            .unwrap_or_else(|| warp::uniform_sphere([self.unit(), self.unit()]).into())
    }
}

/// A scene of one mesh.
fn scene_of(mesh: Mesh) -> Scene<()> {
    let mut scene = Scene::empty();
    scene.meshes.push(Arc::new(mesh));
    scene.instances.push(Instance {
        name: "closed".into(),
        mesh: MeshId(0),
        material: MaterialId(0),
        world_from_object: Affine3A::IDENTITY,
    });
    scene
}
