//! Triangle meshes in double precision, and what is asked of them: fronts that agree with the normals, closed surfaces.

use std::collections::BTreeMap;

use glam::DVec3;

/// A triangle mesh; `uvs` and `colors` are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<DVec3>,
    /// Unit shading normals.
    pub(crate) normals: Vec<DVec3>,
    /// glTF convention: (0, 0) is the upper left corner of the image.
    pub(crate) uvs: Vec<[f64; 2]>,
    /// Linear.
    pub(crate) colors: Vec<[f64; 3]>,
    /// Counter-clockwise seen from the front.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// What is wrong with a mesh.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MeshError {
    #[error("mesh \"{mesh}\": {count} triangles face away from their normals")]
    Winding { mesh: &'static str, count: usize },
    #[error("mesh \"{mesh}\": expected a closed surface, found {count} edges without a partner")]
    Open { mesh: &'static str, count: usize },
    #[error("mesh \"{mesh}\": vertex {vertex} is not finite or its normal is no unit vector")]
    Vertex { mesh: &'static str, vertex: usize },
}

/// Whether a surface has a boundary.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Boundary {
    /// Every edge has two triangles.
    Closed,
    /// A sheet.
    Open,
}

/// A vertex of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub(crate) position: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) uv: [f64; 2],
}

impl Mesh {
    /// A mesh of `rows` × `columns` vertices with two triangles a cell. Cells whose edge has collapsed to a pole get one
    /// triangle. Triangles are turned towards the normals.
    pub(crate) fn grid(rows: usize, columns: usize, vertex: impl Fn(usize, usize) -> Vertex) -> Self {
        let mut mesh = Self::default();
        for row in 0..rows {
            for column in 0..columns {
                let v = vertex(row, column);
                mesh.positions.push(v.position);
                mesh.normals.push(v.normal);
                mesh.uvs.push(v.uv);
            }
        }
        let at = |row: usize, column: usize| (row * columns + column) as u32;
        for row in 1..rows {
            for column in 1..columns {
                let (a, b) = (at(row - 1, column - 1), at(row - 1, column));
                let (c, d) = (at(row, column - 1), at(row, column));
                for triangle in [[a, b, d], [a, d, c]] {
                    mesh.push_unless_degenerate(triangle);
                }
            }
        }
        mesh.face_the_normals();
        mesh
    }

    /// The corner positions of a triangle.
    pub(crate) fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }

    fn push_unless_degenerate(&mut self, triangle: [u32; 3]) {
        let [a, b, c] = self.corners(triangle);
        if (b - a).cross(c - a).length() > 1e-14 {
            self.triangles.push(triangle);
        }
    }

    /// Whether a triangle's front is on the side of its shading normals.
    fn faces_its_normals(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = self.corners(triangle);
        let normals: DVec3 = triangle.iter().map(|&i| self.normals[i as usize]).sum();
        (b - a).cross(c - a).dot(normals) > 0.0
    }

    /// Turns the whole mesh over when most triangles face away from their normals.
    pub(crate) fn face_the_normals(&mut self) {
        let away = self.triangles.iter().filter(|&&t| !self.faces_its_normals(t)).count();
        if 2 * away > self.triangles.len() {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
    }

    /// Adds the other mesh's triangles; both have the same attributes.
    pub(crate) fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.colors.extend(&other.colors);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
    }

    /// The mesh moved by `offset`.
    pub(crate) fn moved(mut self, offset: DVec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p += offset);
        self
    }

    /// The mesh with positions on a grid of 2⁻¹³ and normals on one of 2⁻⁹ (at most 0.2° off, 0.002 longer or shorter): so
    /// that gzip finds something to do.
    pub(crate) fn rounded(mut self) -> Self {
        self.positions.iter_mut().for_each(|p| *p = (*p * 8192.0).round() / 8192.0);
        self.normals.iter_mut().for_each(|n| *n = (*n * 512.0).round() / 512.0);
        self
    }

    /// Edges that are not shared by exactly two triangles in opposite directions, once vertices at the same place are one.
    pub(crate) fn open_edges(&self) -> usize {
        let mut places = BTreeMap::new();
        let welded: Vec<usize> = self
            .positions
            .iter()
            .map(|p| {
                // Seams are computed twice; a micrometre is far below any edge's length.
                let key = p.to_array().map(|x| (x * 1e6).round() as i64);
                let next = places.len();
                *places.entry(key).or_insert(next)
            })
            .collect();
        let mut balance: BTreeMap<(usize, usize), (i32, i32)> = BTreeMap::new();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| welded[i as usize]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let edge = balance.entry((from.min(to), from.max(to))).or_default();
                edge.0 += 1;
                edge.1 += if from < to { 1 } else { -1 };
            }
        }
        balance.values().filter(|&&edge| edge != (2, 0)).count()
    }

    /// The mesh, when it is as it should be.
    pub(crate) fn checked(self, mesh: &'static str, boundary: Boundary) -> Result<Self, MeshError> {
        let sound = |i: usize| {
            self.positions[i].is_finite()
                && (self.normals[i].length() - 1.0).abs() < 0.003
                && self.uvs.get(i).is_none_or(|uv| uv.iter().all(|x| x.is_finite()))
        };
        if let Some(vertex) = (0..self.positions.len()).find(|&i| !sound(i)) {
            return Err(MeshError::Vertex { mesh, vertex });
        }
        match self.triangles.iter().filter(|&&t| !self.faces_its_normals(t)).count() {
            0 => {}
            count => return Err(MeshError::Winding { mesh, count }),
        }
        match (boundary, self.open_edges()) {
            (Boundary::Open, _) | (Boundary::Closed, 0) => Ok(self),
            (Boundary::Closed, count) => Err(MeshError::Open { mesh, count }),
        }
    }

    /// Parts of at most 65,535 vertices, so that 16-bit indices do, in the order of the triangles.
    pub(crate) fn parts(&self) -> Vec<Self> {
        const MOST: usize = 65_535;
        let mut parts = vec![];
        let mut part = Self::default();
        let mut local = vec![u32::MAX; self.positions.len()];
        let mut taken = vec![];
        for triangle in &self.triangles {
            if taken.len() + 3 > MOST {
                parts.push(std::mem::take(&mut part));
                taken.drain(..).for_each(|i: usize| local[i] = u32::MAX);
            }
            part.triangles.push(triangle.map(|i| {
                let i = i as usize;
                if local[i] == u32::MAX {
                    local[i] = taken.len() as u32;
                    taken.push(i);
                    part.positions.push(self.positions[i]);
                    part.normals.push(self.normals[i]);
                    part.uvs.extend(self.uvs.get(i));
                    part.colors.extend(self.colors.get(i));
                }
                local[i]
            }));
        }
        if !part.triangles.is_empty() {
            parts.push(part);
        }
        parts
    }
}

/// A flat rectangle with corner `corner` and sides `u` and `v`, facing `u` × `v`.
pub(crate) fn rectangle(corner: DVec3, u: DVec3, v: DVec3) -> Mesh {
    let normal = u.cross(v).normalize();
    Mesh::grid(2, 2, |row, column| {
        let (s, t) = (column as f64, row as f64);
        Vertex { position: corner + u * s + v * t, normal, uv: [s, 1.0 - t] }
    })
}

/// A geodesic sphere: an icosahedron whose faces are cut into `frequency`² triangles.
pub(crate) fn geodesic_sphere(center: DVec3, radius: f64, frequency: usize) -> Mesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners = vec![];
    for (a, b) in [(-1.0, -golden), (1.0, -golden), (-1.0, golden), (1.0, golden)] {
        corners.push(DVec3::new(a, b, 0.0).normalize());
        corners.push(DVec3::new(0.0, a, b).normalize());
        corners.push(DVec3::new(b, 0.0, a).normalize());
    }
    let edge =
        (0..12).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| corners[i].distance(corners[j]));
    let edge = edge.fold(f64::INFINITY, f64::min) * 1.001;
    let mut mesh = Mesh::default();
    let mut places = BTreeMap::new();
    let mut vertex = |mesh: &mut Mesh, direction: DVec3| {
        let key = direction.to_array().map(|x| (x * 1e9).round() as i64);
        *places.entry(key).or_insert_with(|| {
            mesh.positions.push(center + direction * radius);
            mesh.normals.push(direction);
            (mesh.positions.len() - 1) as u32
        })
    };
    for i in 0..12 {
        for j in 0..i {
            for k in 0..j {
                let (a, b, c) = (corners[i], corners[j], corners[k]);
                if a.distance(b) > edge || b.distance(c) > edge || c.distance(a) > edge {
                    continue;
                }
                let (b, c) = if (b - a).cross(c - a).dot(a) > 0.0 { (b, c) } else { (c, b) };
                let n = frequency as f64;
                let at = |p: usize, q: usize| {
                    (a * (frequency - p - q) as f64 / n + b * p as f64 / n + c * q as f64 / n).normalize()
                };
                for p in 0..frequency {
                    for q in 0..frequency - p {
                        let up = [at(p, q), at(p + 1, q), at(p, q + 1)].map(|d| vertex(&mut mesh, d));
                        mesh.triangles.push(up);
                        if p + q + 1 < frequency {
                            let down =
                                [at(p + 1, q), at(p + 1, q + 1), at(p, q + 1)].map(|d| vertex(&mut mesh, d));
                            mesh.triangles.push(down);
                        }
                    }
                }
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geodesic_sphere_is_closed_and_faces_outwards() {
        let sphere = geodesic_sphere(DVec3::new(1.0, 2.0, 3.0), 0.5, 5);
        assert_eq!(sphere.triangles.len(), 20 * 25);
        assert_eq!(sphere.positions.len(), 10 * 25 + 2);
        assert!(sphere.checked("sphere", Boundary::Closed).is_ok());
    }

    #[test]
    fn a_rectangle_is_open_and_a_turned_triangle_is_found() {
        let sheet = rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
        assert_eq!(sheet.open_edges(), 4);
        assert!(matches!(
            sheet.clone().checked("sheet", Boundary::Closed),
            Err(MeshError::Open { count: 4, .. })
        ));
        let mut turned = sheet;
        turned.triangles[0].swap(0, 1);
        assert!(matches!(turned.checked("sheet", Boundary::Open), Err(MeshError::Winding { count: 1, .. })));
    }

    #[test]
    fn parts_hold_every_triangle_with_small_indices() {
        let sphere = geodesic_sphere(DVec3::ZERO, 1.0, 100);
        let parts = sphere.parts();
        assert!(parts.len() > 1);
        assert!(parts.iter().all(|p| p.positions.len() <= 65_535));
        let triangles = parts.iter().flat_map(|p| p.triangles.iter().map(|&t| p.corners(t)));
        assert!(triangles.eq(sphere.triangles.iter().map(|&t| sphere.corners(t))));
    }
}
