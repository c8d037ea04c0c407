//! Tangents by MikkTSpace, which glTF 2.0 (3.7.2.1) asks for where a mesh has none.

use std::collections::BTreeMap;

use bevy_mikktspace::{Ops, TangentSpace, generate_tangents};
use glam::{Vec3, Vec4};

use crate::math::{Number, Real};
use crate::scene::Mesh;

/// The most triangles around a vertex: the algorithm goes round them recursively.
const MAX_AROUND: u32 = 2000;

/// Gives `mesh` tangents that follow its texture coordinates `set`. Where the triangles around a vertex disagree it is split;
/// the result says for each vertex which one it was. None, and nothing happens, without normals or coordinates, with values that
/// aren't finite, and for more than [`MAX_AROUND`] triangles around a vertex: then the frame follows the coordinates.
pub(super) fn generate(mesh: &mut Mesh, set: usize) -> Option<Vec<u32>> {
    let uvs = mesh.uvs.get(set)?;
    let finite = mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite())
        && uvs.iter().all(|v| v.is_finite());
    if mesh.normals.is_empty() || !finite || most_around(mesh, set) > MAX_AROUND {
        return None;
    }
    let mut corners = Corners { mesh, set, tangents: vec![None; mesh.triangles.len()] };
    // The error has no value.
    generate_tangents(&mut corners).ok()?;
    let tangents = corners.tangents;
    Some(split(mesh, tangents))
}

/// The most triangles around a vertex, counting vertices that are alike as one, as the algorithm does.
fn most_around(mesh: &Mesh, set: usize) -> u32 {
    let mut around: BTreeMap<[u32; 8], u32> = BTreeMap::new();
    let mut uses = vec![0u32; mesh.positions.len()];
    for &i in mesh.triangles.iter().flatten() {
        uses[i as usize] = uses[i as usize].saturating_add(1);
    }
    for (i, &uses) in uses.iter().enumerate().filter(|(_, uses)| **uses > 0) {
        let (p, n, uv) = (mesh.positions[i], mesh.normals[i], mesh.uvs[set][i]);
        let key = [p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y].map(f32::to_bits);
        let count = around.entry(key).or_default();
        *count = count.saturating_add(uses);
    }
    around.into_values().max().unwrap_or(0)
}

/// The mesh as the algorithm reads it, and what it writes.
struct Corners<'m> {
    mesh: &'m Mesh,
    set: usize,
    tangents: Vec<Option<[Vec4; 3]>>,
}

/// Mathematics that is the same on every machine.
enum OwnOps {}

impl Ops for OwnOps {
    fn sqrt(x: f32) -> f32 {
        Number::sqrt(x)
    }

    fn acos(x: f32) -> f32 {
        Real::acos(f64::from(x)) as f32
    }
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl bevy_mikktspace::Geometry<OwnOps> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.mesh.uvs[self.set][self.vertex(face, corner)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // v grows downwards in glTF and upwards in MikkTSpace, which turns the bitangent round.
        let tangent = space.map_or(Vec4::ZERO, |s| {
            let sign = if s.is_orientation_preserving() { -1.0 } else { 1.0 };
            Vec3::from(s.tangent()).extend(sign)
        });
        let usable = tangent.is_finite() && tangent.truncate() != Vec3::ZERO;
        // Triangles without area or coordinates have none: any direction along the surface will do.
        let normal = self.mesh.normals[self.vertex(face, corner)];
        let any = || normal.try_normalize().map_or(Vec3::X, Vec3::any_orthonormal_vector).extend(1.0);
        self.tangents[face].get_or_insert([Vec4::ZERO; 3])[corner] = if usable { tangent } else { any() };
    }
}

/// Gives every corner its tangent: a vertex stays one where its corners agree.
fn split(mesh: &mut Mesh, tangents: Vec<Option<[Vec4; 3]>>) -> Vec<u32> {
    let mut source: Vec<u32> = Vec::new();
    let mut known: BTreeMap<(u32, [u32; 4]), u32> = BTreeMap::new();
    let mut kept = Vec::new();
    for (triangle, tangents) in mesh.triangles.iter_mut().zip(tangents) {
        for (corner, tangent) in triangle.iter_mut().zip(tangents.unwrap_or([Vec4::X; 3])) {
            let key = (*corner, tangent.to_array().map(f32::to_bits));
            *corner = *known.entry(key).or_insert_with(|| {
                source.push(*corner);
                kept.push(tangent);
                source.len() as u32 - 1
            });
        }
    }
    mesh.tangents = kept;
    pick(&mut mesh.positions, &source);
    pick(&mut mesh.normals, &source);
    pick(&mut mesh.colors, &source);
    mesh.uvs.iter_mut().for_each(|set| pick(set, &source));
    source
}

/// The values of the vertices in `source`, if there are any values.
fn pick<T: Copy>(values: &mut Vec<T>, source: &[u32]) {
    if !values.is_empty() {
        *values = source.iter().map(|&i| values[i as usize]).collect();
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    /// A square in the plane z = 0 whose image stands upright, mirrored on its right half.
    fn mesh() -> Mesh {
        let positions = [(0., 0.), (1., 0.), (1., 1.), (0., 1.), (2., 0.), (2., 1.)];
        let uvs = [(0., 1.), (1., 1.), (1., 0.), (0., 0.), (0., 1.), (0., 0.)];
        Mesh {
            positions: positions.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            normals: vec![Vec3::Z; 6],
            uvs: vec![uvs.map(|(u, v)| Vec2::new(u, v)).to_vec()],
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]],
            ..Mesh::default()
        }
    }

    #[test]
    fn tangents_follow_u_and_bitangents_the_image_upwards() {
        let mut mesh = mesh();
        let source = generate(&mut mesh, 0).unwrap();
        // The seam's two vertices have two tangents each.
        assert_eq!((source.len(), mesh.uvs[0].len(), mesh.positions.len()), (8, 8, 8));
        for (v, t) in mesh.tangents.iter().enumerate() {
            let bitangent = mesh.normals[v].cross(t.truncate()) * t.w;
            assert!((bitangent - Vec3::Y).length() < 1e-6, "{v}: {t}");
        }
        let of_triangle = |t: usize| mesh.tangents[mesh.triangles[t][0] as usize].x;
        assert_eq!([0, 1, 2, 3].map(of_triangle), [1.0, 1.0, -1.0, -1.0]);
    }

    #[test]
    fn what_can_have_no_tangents_keeps_none() {
        let mut flat = Mesh { normals: Vec::new(), ..mesh() };
        assert!(generate(&mut flat, 0).is_none() && flat.tangents.is_empty());
        assert!(generate(&mut mesh(), 1).is_none());
        let mut broken = mesh();
        broken.positions[3].x = f32::NAN;
        assert!(generate(&mut broken, 0).is_none());
        // A fan round one vertex, which would fill the stack.
        let n = 1_000_000;
        let fan = |n: u32| Mesh {
            positions: (0..=n).map(|i| Vec3::new(i.min(1) as f32, i as f32, 0.0)).collect(),
            normals: vec![Vec3::Z; n as usize + 1],
            uvs: vec![(0..=n).map(|i| Vec2::new(i.min(1) as f32, i as f32)).collect()],
            triangles: (1..n).map(|i| [0, i, i + 1]).collect(),
            ..Mesh::default()
        };
        assert!(generate(&mut fan(n), 0).is_none());
        assert!(generate(&mut fan(MAX_AROUND), 0).is_some());
    }

    #[test]
    fn degenerate_triangles_and_huge_numbers_have_tangents() {
        let mut mesh = mesh();
        mesh.triangles.push([0, 0, 1]);
        mesh.positions[4] = Vec3::new(f32::MAX, 0.0, -f32::MAX);
        mesh.uvs[0][5] = Vec2::splat(1e38);
        mesh.normals[3] = Vec3::ZERO;
        generate(&mut mesh, 0).unwrap();
        assert!(mesh.tangents.iter().all(|t| t.is_finite() && t.truncate() != Vec3::ZERO));
        let mut without = Mesh { uvs: vec![vec![Vec2::ZERO; 6]], ..self::mesh() };
        generate(&mut without, 0).unwrap();
        assert!(without.tangents.iter().all(|t| t.z == 0.0 && t.truncate().is_normalized()));
    }
}
