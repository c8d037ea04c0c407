//! All triangles of a scene in world space, with the way back from a triangle to its mesh.
//!
//! Triangles count by instance, in the order of their meshes. Those of instances that share their mesh ([`super::sharing`]) are worked out
//! when they are asked for, by the operations that make copies, so that a picture is the same bits either way.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine3A, DAffine3, DVec3, Mat3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::RenderError;
use super::offset::Departure;
use super::sharing::{self, Saved};
use crate::accel::{BuildError, Bvh, Hit, Kernel, Placement, Ray, Shared};
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene};
use crate::settings::Use;

/// The triangles of a scene and the tree over them. It depends on meshes and instances alone, so that jobs that differ in
/// materials, lights or camera share it.
///
/// Floats are fine near 0 and coarse far away: 1/16 m at 1000 km. A scene that lies far from the origin for its size is rendered
/// around its own centre, [`Self::origin`], to which all positions in here are relative.
#[derive(Clone, Debug)]
pub struct Geometry {
    pub(super) bvh: Bvh,
    origin: Vec3,
    /// Of the instances that have copies.
    triangles: Vec<Triangle>,
    /// The instance and the triangle's index in its mesh. Nothing where instances share meshes: it is searched for among them.
    origins: Vec<(u32, u32)>,
    instances: Vec<PlacedMesh>,
    /// The instances that share their mesh, by index, ascending.
    placements: Vec<(u32, Placement)>,
    /// What they save.
    saved: Saved,
    /// The centre, relative to [`Self::origin`], and the radius, at least a tiny one, of a sphere around everything.
    pub(super) sphere: (Vec3, f32),
}

#[derive(Clone, Debug)]
struct PlacedMesh {
    mesh: Arc<Mesh>,
    id: MeshId,
    /// The index of its first triangle.
    first: u32,
    /// Where its copies begin, unless it shares its mesh.
    copies: Option<u32>,
    world_from_object: Affine3A,
    /// The inverse transpose: takes object normals to world.
    normal_matrix: Mat3,
    /// -1 where the transform mirrors, which turns the winding round.
    handedness: f32,
}

/// A triangle, and what rays that meet it ask for each time: worked out once, and one cache line long.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Triangle {
    /// Positions relative to the geometry's origin.
    vertices: [Vec3; 3],
    /// The unit normal of the front side, right to the last digits even for needles: in f64 the differences and products of f32
    /// coordinates are exact. 0 where the triangle has no area.
    normal: Vec3,
    /// Of the corners above the opposite edges, in metres: 0 where the triangle has no area.
    heights: [f32; 3],
    /// The largest coordinate of an edge.
    extent: f32,
}

impl Triangle {
    /// `handedness` is -1 where the front is on the other side than the winding says.
    fn new(vertices: [Vec3; 3], handedness: f32) -> Self {
        let [a, b, c] = vertices.map(|v| v.as_dvec3());
        let edges = [c - b, c - a, b - a];
        let area_vector = edges[2].cross(edges[1]);
        let twice_area = area_vector.length();
        let height = |edge: DVec3| if twice_area > 0.0 { twice_area / edge.length() } else { 0.0 };
        Self {
            vertices,
            normal: area_vector.try_normalize().map_or(Vec3::ZERO, |n| n.as_vec3() * handedness),
            heights: edges.map(|edge| height(edge) as f32),
            extent: edges.map(|edge| edge.abs().max_element() as f32).into_iter().fold(0.0, f32::max),
        }
    }

    /// A position, and a bound of how far rays must stay from the plane: see the room `offset`.
    #[inline]
    fn at(&self, [_, b1, b2]: [f32; 3]) -> (Vec3, f32) {
        let [a, b, c] = self.vertices;
        let (e1, e2) = (b - a, c - a);
        let point = a + (e1 * b1 + e2 * b2);
        (point, super::offset::bound(point, self.extent))
    }
}

/// The corner data of a hit triangle, interpolated on demand.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrianglePoint<'a> {
    placed: &'a PlacedMesh,
    /// In its mesh.
    index: u32,
    barycentric: [f32; 3],
    /// None of an instance without copies.
    copy: Option<&'a Triangle>,
}

impl PlacedMesh {
    fn triangle_count(&self) -> u32 {
        self.mesh.triangles.len() as u32
    }

    /// The vertices of the triangle at an index in the mesh, in a scene around the origin.
    fn vertices(&self, index: u32) -> [Vec3; 3] {
        let corners = self.mesh.triangles[index as usize];
        corners.map(|c| self.world_from_object.transform_point3(self.mesh.positions[c as usize]))
    }
}

impl Geometry {
    /// Builds the tree over the scene's instances, of copies or shared meshes, whichever serves better.
    ///
    /// # Errors
    /// [`RenderError::Build`] where there are too many triangles.
    pub fn build<M>(scene: &Scene<M>) -> Result<Self, RenderError> {
        Self::sharing(scene, Use::Auto)
    }

    /// As [`Self::build`], with meshes shared as told. Where positions are relative to another origin than the world's, all instances
    /// have copies: they are placed in f64, which trees are not traversed in.
    ///
    /// # Errors
    /// As above.
    pub fn sharing<M>(scene: &Scene<M>, sharing: Use) -> Result<Self, RenderError> {
        BuildError::check(scene.triangle_count())?;
        let (low, high) = scene.bounds().unwrap_or((Vec3::ZERO, Vec3::ZERO));
        let center = low * 0.5 + high * 0.5;
        let radius = radius_of(high - center);
        let origin = if center.abs().max_element() > FAR * radius { center } else { Vec3::ZERO };
        let mut instances = placed_meshes(scene);
        let firsts: Vec<u32> = instances.iter().map(|placed| placed.first).collect();
        let sharing = if origin == Vec3::ZERO { sharing } else { Use::Never };
        let (placements, saved) = sharing::shared(scene, &firsts, sharing);
        let count = number_copies(&mut instances, &placements);
        let (mut vertices, mut origins) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (i, placed) in instances.iter().enumerate().filter(|(_, placed)| placed.copies.is_some()) {
            for (k, corners) in placed.mesh.triangles.iter().enumerate() {
                vertices.push(if origin == Vec3::ZERO {
                    placed.vertices(k as u32)
                } else {
                    corners.map(|c| {
                        placed_from(origin, &placed.world_from_object, placed.mesh.positions[c as usize])
                    })
                });
                origins.push((i as u32, k as u32));
            }
        }
        let triangles = vertices
            .par_iter()
            .zip(&origins)
            .map(|(&vertices, &(instance, _))| {
                Triangle::new(vertices, instances[instance as usize].handedness)
            })
            .collect();
        if !placements.is_empty() {
            origins = Vec::new();
        }
        Ok(Self {
            bvh: tree_over(&vertices, &instances, &placements)?,
            origin,
            triangles,
            origins,
            instances,
            placements,
            saved,
            sphere: (center - origin, radius),
        })
    }

    /// Where in the world the positions of rays and hits are 0.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// The tree that rays are traced in.
    pub fn tree(&self) -> &Bvh {
        &self.bvh
    }

    /// What a ray meets first.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.bvh.closest(ray)
    }

    /// From where paths go on that `incoming`, of unit direction, brought to `hit`.
    pub fn departure(&self, incoming: &Ray, hit: &Hit) -> Departure {
        self.at(hit).departure(self, incoming, hit)
    }

    /// The same, traced with another kernel than the fastest.
    #[must_use]
    pub fn with_kernel(self, kernel: Kernel) -> Self {
        Self { bvh: self.bvh.with_kernel(kernel), ..self }
    }

    /// The corners of all triangles, those of instances without copies too, relative to [`Self::origin`].
    pub fn corners(&self) -> Vec<[Vec3; 3]> {
        (0..self.triangle_count() as u32).map(|triangle| self.vertices(triangle)).collect()
    }

    /// The tree built anew.
    ///
    /// # Errors
    /// None that the first one had not.
    pub fn rebuilt_tree(&self) -> Result<Bvh, RenderError> {
        let copies: Vec<_> = self.triangles.iter().map(|triangle| triangle.vertices).collect();
        Ok(tree_over(&copies, &self.instances, &self.placements)?)
    }

    /// The number of triangles, instances counted.
    pub fn triangle_count(&self) -> usize {
        self.bvh.len()
    }

    /// What sharing meshes saves.
    pub(super) fn saved(&self) -> Saved {
        self.saved
    }

    /// -1 where a triangle's front is on the other side than its winding says.
    pub(super) fn handedness(&self, triangle: u32) -> f32 {
        self.instances[self.instance_of(triangle)].handedness
    }

    /// The instance of a triangle.
    #[inline]
    pub(super) fn instance_of(&self, triangle: u32) -> usize {
        self.find(triangle).0
    }

    /// World positions, in the order that barycentric coordinates count.
    pub(super) fn vertices(&self, triangle: u32) -> [Vec3; 3] {
        let (instance, index, copy) = self.find(triangle);
        copy.map_or_else(|| self.instances[instance].vertices(index), |triangle| triangle.vertices)
    }

    /// The instance, the index in its mesh and the copy of a triangle.
    #[inline]
    fn find(&self, triangle: u32) -> (usize, u32, Option<&Triangle>) {
        match self.origins.get(triangle as usize) {
            Some(&(instance, index)) => (instance as usize, index, Some(&self.triangles[triangle as usize])),
            None => self.search(triangle),
        }
    }

    /// [`Self::find`] where instances share meshes.
    #[inline(never)]
    fn search(&self, triangle: u32) -> (usize, u32, Option<&Triangle>) {
        // Of several that begin there, all but the last are empty.
        let instance = self.instances.partition_point(|placed| placed.first <= triangle) - 1;
        let placed = &self.instances[instance];
        let index = triangle - placed.first;
        (instance, index, placed.copies.map(|start| &self.triangles[(start + index) as usize]))
    }

    /// Triangles with their instance's material.
    pub(super) fn materials<'a, M>(
        &'a self,
        scene: &'a Scene<M>,
    ) -> impl Iterator<Item = (u32, MaterialId)> + 'a {
        self.instances.iter().zip(&scene.instances).flat_map(|(placed, instance)| {
            let triangles = placed.first..placed.first + placed.triangle_count();
            triangles.map(|triangle| (triangle, instance.material))
        })
    }

    /// The data at a hit.
    #[inline]
    pub(super) fn at(&self, hit: &Hit) -> TrianglePoint<'_> {
        self.point_on(hit.triangle, hit.barycentric)
    }

    /// The data at a point of a triangle.
    #[inline]
    pub(super) fn point_on(&self, triangle: u32, barycentric: [f32; 3]) -> TrianglePoint<'_> {
        let (instance, index, copy) = self.find(triangle);
        TrianglePoint { placed: &self.instances[instance], index, barycentric, copy }
    }
}

/// The scene's instances, all of them without copies.
fn placed_meshes<M>(scene: &Scene<M>) -> Vec<PlacedMesh> {
    let mut first = 0;
    let mut placed = |instance: &Instance| {
        let (mesh, to_world) = (&scene.meshes[instance.mesh.0 as usize], instance.world_from_object);
        let placed = PlacedMesh {
            mesh: Arc::clone(mesh),
            id: instance.mesh,
            first,
            copies: None,
            world_from_object: to_world,
            normal_matrix: Mat3::from(to_world.matrix3).inverse().transpose(),
            handedness: if to_world.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 },
        };
        first += placed.triangle_count();
        placed
    };
    scene.instances.iter().map(&mut placed).collect()
}

/// Says where the copies of those begin that have no placement; tells how many there are.
fn number_copies(instances: &mut [PlacedMesh], placements: &[(u32, Placement)]) -> usize {
    let mut shared = placements.iter().map(|&(instance, _)| instance).peekable();
    let mut count = 0;
    for (i, placed) in (0..).zip(instances) {
        if shared.next_if_eq(&i).is_none() {
            placed.copies = Some(count);
            count += placed.triangle_count();
        }
    }
    count as usize
}

/// The tree over `copies` and the meshes that are placed.
fn tree_over(
    copies: &[[Vec3; 3]],
    instances: &[PlacedMesh],
    placements: &[(u32, Placement)],
) -> Result<Bvh, BuildError> {
    if placements.is_empty() {
        return Bvh::build(copies);
    }
    let copied = instances.iter().filter(|placed| placed.copies.is_some());
    let indices: Vec<u32> = copied.flat_map(|p| p.first..p.first + p.triangle_count()).collect();
    let mut shared = BTreeMap::new();
    for &(instance, placement) in placements {
        let placed = &instances[instance as usize];
        let mesh = shared.entry(placed.id).or_insert_with(|| {
            let position = |c: u32| placed.mesh.positions[c as usize];
            let triangles = placed.mesh.triangles.iter().map(|corners| corners.map(position)).collect();
            Shared { triangles, placements: Vec::new() }
        });
        mesh.placements.push(placement);
    }
    let shared: Vec<_> = shared.into_values().collect();
    Bvh::with_instances(copies, |copy| indices[copy as usize], &shared)
}

/// A scene lies far from the origin if its centre is more than this many of its radii away along an axis.
const FAR: f32 = 8.0;

/// A mesh's point relative to `origin`: in f64, so that what the sum of large numbers would lose is kept.
fn placed_from(origin: Vec3, to_world: &Affine3A, p: Vec3) -> Vec3 {
    let to_world = DAffine3::from_mat3_translation(
        glam::Mat3::from(to_world.matrix3).as_dmat3(),
        Vec3::from(to_world.translation).as_dvec3() - origin.as_dvec3(),
    );
    to_world.transform_point3(p.as_dvec3()).as_vec3()
}

/// The length of a box's half diagonal as a finite number above 0, whatever the scale.
fn radius_of(half_diagonal: Vec3) -> f32 {
    let length = half_diagonal.as_dvec3().length();
    length.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32
}

impl TrianglePoint<'_> {
    /// The position, and a bound of how far rays must stay from the plane of its triangle: see the room `offset`.
    #[inline]
    pub(super) fn position(&self) -> (Vec3, f32) {
        self.ask(|triangle| triangle.at(self.barycentric))
    }

    /// What the triangle answers.
    #[inline(always)]
    fn ask<R>(&self, question: impl FnOnce(&Triangle) -> R) -> R {
        match self.copy {
            Some(triangle) => question(triangle),
            None => self.ask_placed(question),
        }
    }

    /// [`Self::ask`] of one that has no copy: out of line, so that scenes of copies, which are most, have short code.
    #[cold]
    #[inline(never)]
    fn ask_placed<R>(&self, question: impl FnOnce(&Triangle) -> R) -> R {
        question(&Triangle::new(self.placed.vertices(self.index), self.placed.handedness))
    }

    /// The unit geometric normal of the front side. None where the triangle has no area.
    #[inline]
    pub(super) fn geometric_normal(&self) -> Option<Vec3> {
        let normal = self.ask(|triangle| triangle.normal);
        (normal != Vec3::ZERO).then_some(normal)
    }

    /// From where rays leave the point that `incoming` hit.
    #[inline(always)]
    pub(super) fn departure(&self, geometry: &Geometry, incoming: &Ray, hit: &Hit) -> Departure {
        let of_triangle = |t: &Triangle| (t.at(self.barycentric), t.normal, t.heights);
        let ((point, error), normal, [h0, h1, h2]) = self.ask(of_triangle);
        // A triangle thinner than rounding moves its corners has no plane to speak of: any normal is right that faces the viewer.
        let has_plane = h0.min(h1).min(h2) > super::offset::THINNEST * error;
        let normal = if has_plane { normal } else { -incoming.direction };
        let mut departure = Departure::new(hit.triangle, point, error, normal, incoming);
        // A barycentric coordinate is the distance from an edge in heights above it.
        let [b0, b1, b2] = self.barycentric;
        let near = super::offset::NEAR * error;
        if (b0 * h0).min(b1 * h1).min(b2 * h2) <= near {
            departure.keep_clear(geometry, has_plane);
        }
        departure
    }

    /// The unit shading normal, on the front side: interpolated, or the geometric one where the mesh has none.
    #[inline]
    pub(super) fn shading_normal(&self, geometric: Vec3) -> Vec3 {
        let normals = &self.placed.mesh.normals;
        if normals.is_empty() {
            return geometric;
        }
        let object = self.interpolate(|c| normals[c]);
        (self.placed.normal_matrix * object).try_normalize().unwrap_or(geometric)
    }

    /// The coordinates of a set, (0, 0) where the mesh has no such set.
    #[inline]
    pub(super) fn uv(&self, set: u32) -> Vec2 {
        let Some(uvs) = self.placed.mesh.uvs.get(set as usize) else { return Vec2::ZERO };
        let [b0, b1, b2] = self.barycentric;
        let [c0, c1, c2] = self.corners();
        uvs[c0] * b0 + uvs[c1] * b1 + uvs[c2] * b2
    }

    /// The vertex colour, white where the mesh has none.
    #[inline]
    pub(super) fn color(&self) -> Vec4 {
        let colors = &self.placed.mesh.colors;
        if colors.is_empty() {
            return Vec4::ONE;
        }
        let [b0, b1, b2] = self.barycentric;
        let [c0, c1, c2] = self.corners();
        colors[c0] * b0 + colors[c1] * b1 + colors[c2] * b2
    }

    /// The world tangent (not orthogonal to the normal) and the bitangent's sign: the mesh's own, else along growing u of the
    /// set. None where neither gives a direction.
    pub(super) fn tangent(&self, set: u32) -> Option<(Vec3, f32)> {
        let mesh = &self.placed.mesh;
        if !mesh.tangents.is_empty() {
            let object = self.interpolate(|c| mesh.tangents[c].truncate());
            let world = self.placed.world_from_object.transform_vector3(object).try_normalize()?;
            return Some((world, mesh.tangents[self.corners()[0]].w * self.placed.handedness));
        }
        let uvs = mesh.uvs.get(set as usize)?;
        let [t0, t1, t2] = self.corners().map(|c| uvs[c]);
        let (d1, d2) = (t1 - t0, t2 - t0);
        let [a, b, c] = self.ask(|triangle| triangle.vertices);
        let (e1, e2) = (b - a, c - a);
        let det = d1.perp_dot(d2);
        let tangent = ((e1 * d2.y - e2 * d1.y) * det.signum()).try_normalize()?;
        // v grows downwards in the image while tangent space has +y up.
        Some((tangent, -det.signum() * self.placed.handedness))
    }

    #[inline]
    fn interpolate(&self, corner: impl Fn(usize) -> Vec3) -> Vec3 {
        let [b0, b1, b2] = self.barycentric;
        let [c0, c1, c2] = self.corners();
        corner(c0) * b0 + corner(c1) * b1 + corner(c2) * b2
    }

    /// The mesh's vertices. Most hits need none of them.
    #[inline]
    fn corners(&self) -> [usize; 3] {
        self.placed.mesh.triangles[self.index as usize].map(|c| c as usize)
    }
}
