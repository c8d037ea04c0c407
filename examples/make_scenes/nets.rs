//! Surface nets: polygons from a field, with vertices on the surface and normals from the field's gradient.

use std::collections::BTreeSet;

use glam::DVec3;

use super::field::Field;
use super::mesh::Mesh;

/// A box of cells.
pub(crate) struct Lattice {
    /// Its lowest corner.
    pub(crate) origin: DVec3,
    /// Its greatest corner; the lattice ends at or just beyond it.
    pub(crate) end: DVec3,
    /// A cell's side.
    pub(crate) cell: f64,
}

/// The field's surface inside of the lattice: one vertex a cell that the surface crosses (Gibson 1998, "Constrained Elastic
/// Surface Nets"), put at the mean of the crossings on the cell's edges, and one quad for each crossed edge, cut along its
/// shorter diagonal. Vertices are then spread evenly and projected to the surface; folds at creases
/// too sharp for the cells are smoothed cut out.
pub(crate) fn polygonise(field: &impl Field, lattice: &Lattice) -> Mesh {
    let size = ((lattice.end - lattice.origin) / lattice.cell).ceil();
    let [nx, ny, nz] = [size.x as usize + 1, size.y as usize + 1, size.z as usize + 1];
    let corner = |x: usize, y: usize, z: usize| {
        lattice.origin + DVec3::new(x as f64, y as f64, z as f64) * lattice.cell
    };
    // Heights are outermost, so that vertices follow each other from bottom to top.
    let index = |x: usize, y: usize, z: usize| (y * nz + z) * nx + x;
    let mut values = Vec::with_capacity(nx * ny * nz);
    for y in 0..ny {
        for z in 0..nz {
            values.extend((0..nx).map(|x| field.at(corner(x, y, z))));
        }
    }

    separate_sheets(&mut values, [nx, ny, nz]);

    let mut mesh = Mesh::default();
    let mut vertex = vec![u32::MAX; values.len()];
    for y in 0..ny - 1 {
        for z in 0..nz - 1 {
            for x in 0..nx - 1 {
                let at = |k: usize| values[index(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))];
                if (1..8).all(|k| (at(k) < 0.0) == (at(0) < 0.0)) {
                    continue;
                }
                let (mut sum, mut crossings) = (DVec3::ZERO, 0.0);
                for (a, b) in
                    (0..8usize).flat_map(|a| [1, 2, 4].map(|bit| (a, a | bit))).filter(|(a, b)| a != b)
                {
                    if (at(a) < 0.0) != (at(b) < 0.0) {
                        let place =
                            |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
                        sum += place(a).lerp(place(b), at(a) / (at(a) - at(b)));
                        crossings += 1.0;
                    }
                }
                vertex[index(x, y, z)] = mesh.positions.len() as u32;
                mesh.positions.push(corner(x, y, z) + sum / crossings * lattice.cell);
                mesh.normals.push(DVec3::ZERO);
            }
        }
    }

    for y in 1..ny - 1 {
        for z in 1..nz - 1 {
            for x in 1..nx - 1 {
                let here = values[index(x, y, z)] < 0.0;
                let v = |dx: usize, dy: usize, dz: usize| vertex[index(x - dx, y - dy, z - dz)];
                if here != (values[index(x + 1, y, z)] < 0.0) {
                    mesh.quad([v(0, 1, 1), v(0, 0, 1), v(0, 0, 0), v(0, 1, 0)], here);
                }
                if here != (values[index(x, y + 1, z)] < 0.0) {
                    mesh.quad([v(1, 0, 1), v(1, 0, 0), v(0, 0, 0), v(0, 0, 1)], here);
                }
                if here != (values[index(x, y, z + 1)] < 0.0) {
                    mesh.quad([v(1, 1, 0), v(0, 1, 0), v(0, 0, 0), v(1, 0, 0)], here);
                }
            }
        }
    }
    for _ in 0..RELAXATIONS {
        mesh.relax(field);
    }
    for _ in 0..UNFOLDINGS {
        let Some(folded) = mesh.triangles.iter().position(|&t| mesh.is_folded(t)) else { break };
        mesh.collapse_an_edge(field, folded);
    }
    mesh
}

/// Changes the sign of the smallest value of a face whose signs alternate, until there is none: where two sheets pass
/// through one face, one vertex a cell would tie them together in an edge of four triangles.
fn separate_sheets(values: &mut [f64], [nx, ny, nz]: [usize; 3]) {
    let strides = [1, nx * nz, nx];
    for _ in 0..PASSES {
        let mut alternating = 0;
        for (u, v) in [(0, 1), (1, 2), (2, 0)] {
            let ends = [nx, ny, nz].map(|n| n - 1);
            for y in 0..ends[1] {
                for z in 0..ends[2] {
                    for x in 0..ends[0] {
                        let first = (y * nz + z) * nx + x;
                        let face =
                            [0, strides[u], strides[u] + strides[v], strides[v]].map(|step| first + step);
                        let inside = face.map(|i| values[i] < 0.0);
                        if inside[0] == inside[2] && inside[1] == inside[3] && inside[0] != inside[1] {
                            let smallest =
                                face.into_iter().min_by(|&i, &j| values[i].abs().total_cmp(&values[j].abs()));
                            smallest.into_iter().for_each(|i| values[i] = -values[i]);
                            alternating += 1;
                        }
                    }
                }
            }
        }
        if alternating == 0 {
            break;
        }
    }
}

/// How often the lattice is searched for alternating signs at most.
const PASSES: usize = 8;

/// How often all vertices are spread evenly.
const RELAXATIONS: usize = 6;
/// How many edges are collapsed at most, one after another.
const UNFOLDINGS: usize = 200;

impl Mesh {
    /// Takes each vertex halfway to the mean of its neighbours and back to the surface: needles become triangles.
    fn relax(&mut self, field: &impl Field) {
        let mut means = vec![(DVec3::ZERO, 0.0); self.positions.len()];
        for [a, b, c] in &self.triangles {
            for (at, next) in [(a, b), (b, c), (c, a)] {
                let mean = &mut means[*at as usize];
                mean.0 += self.positions[*next as usize];
                mean.1 += 1.0;
            }
        }
        for (i, (sum, count)) in means.into_iter().enumerate() {
            self.positions[i] = field.project(self.positions[i].lerp(sum / count, 0.5));
            self.normals[i] = field.normal(self.positions[i]);
        }
    }

    /// Whether a triangle leans more than 85° away from its normals.
    fn is_folded(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = self.corners(triangle);
        let normal: DVec3 = triangle.iter().map(|&i| self.normals[i as usize]).sum();
        let across = (b - a).cross(c - a);
        across.dot(normal) < 0.087 * across.length() * normal.length()
    }

    /// Makes one vertex of the shortest edge of a triangle that may go: one whose ends have two neighbours in common, so that
    /// the surface stays a surface (Dey et al. 1999, the link condition).
    fn collapse_an_edge(&mut self, field: &impl Field, triangle: usize) {
        let at = |i: u32| self.positions[i as usize];
        let [a, b, c] = self.triangles[triangle];
        let mut edges = [(a, b), (b, c), (c, a)];
        edges.sort_by(|e, f| at(e.0).distance(at(e.1)).total_cmp(&at(f.0).distance(at(f.1))));
        let neighbours = |v: u32| -> BTreeSet<u32> {
            self.triangles.iter().filter(|t| t.contains(&v)).flatten().copied().filter(|&i| i != v).collect()
        };
        let may_go = |&&(a, b): &&(u32, u32)| neighbours(a).intersection(&neighbours(b)).count() == 2;
        let Some(&(stays, goes)) = edges.iter().find(may_go) else { return };
        let middle = field.project((at(stays) + at(goes)) / 2.0);
        self.positions[stays as usize] = middle;
        self.normals[stays as usize] = field.normal(middle);
        self.triangles.retain(|t| !(t.contains(&stays) && t.contains(&goes)));
        for corner in self.triangles.iter_mut().flatten().filter(|i| **i == goes) {
            *corner = stays;
        }
    }

    /// Two triangles, counter-clockwise seen from the side where `inside_first` says the edge leaves the solid.
    fn quad(&mut self, corners: [u32; 4], inside_first: bool) {
        let [a, b, c, d] =
            if inside_first { corners } else { [corners[3], corners[2], corners[1], corners[0]] };
        let at = |i: u32| self.positions[i as usize];
        let split = if at(a).distance_squared(at(c)) <= at(b).distance_squared(at(d)) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        };
        self.triangles.extend(split);
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Boundary;
    use super::*;

    #[test]
    fn a_torus_is_closed_and_every_vertex_lies_on_it() {
        let torus = |p: DVec3| {
            let around = (p.x * p.x + p.z * p.z).sqrt() - 0.6;
            (around * around + p.y * p.y).sqrt() - 0.25
        };
        let lattice = Lattice { origin: DVec3::splat(-1.01), end: DVec3::splat(1.01), cell: 0.05 };
        let mesh = polygonise(&torus, &lattice).checked("torus", Boundary::Closed).unwrap();
        assert!(mesh.triangles.len() > 1000);
        assert!(mesh.positions.iter().all(|&p| torus(p).abs() < 1e-12));
        // Euler's characteristic of a torus is 0.
        assert_eq!(2 * mesh.positions.len(), mesh.triangles.len());
    }
}
