//! Surface nets: polygons from a field, with vertices on the surface and normals from the field's gradient.

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
/// Surface Nets"), put at the mean of the crossings on the cell's edges and projected to the surface, and one quad for each
/// crossed edge, cut along its shorter diagonal.
pub(crate) fn polygonise(field: &impl Field, lattice: &Lattice) -> Mesh {
    let size = ((lattice.end - lattice.origin) / lattice.cell).ceil();
    let [nx, ny, nz] = [size.x as usize + 1, size.y as usize + 1, size.z as usize + 1];
    let corner = |x: usize, y: usize, z: usize| lattice.origin + DVec3::new(x as f64, y as f64, z as f64) * lattice.cell;
    // Heights are outermost, so that vertices follow each other from bottom to top.
    let index = |x: usize, y: usize, z: usize| (y * nz + z) * nx + x;
    let mut values = Vec::with_capacity(nx * ny * nz);
    for y in 0..ny {
        for z in 0..nz {
            values.extend((0..nx).map(|x| field.at(corner(x, y, z))));
        }
    }

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
                for (a, b) in (0..8usize).flat_map(|a| [1, 2, 4].map(|bit| (a, a | bit))).filter(|(a, b)| a != b) {
                    if (at(a) < 0.0) != (at(b) < 0.0) {
                        let place = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
                        sum += place(a).lerp(place(b), at(a) / (at(a) - at(b)));
                        crossings += 1.0;
                    }
                }
                let position = field.project(corner(x, y, z) + sum / crossings * lattice.cell);
                vertex[index(x, y, z)] = mesh.positions.len() as u32;
                mesh.positions.push(position);
                mesh.normals.push(field.normal(position));
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
    mesh
}

impl Mesh {
    /// Two triangles, counter-clockwise seen from the side where `inside_first` says the edge leaves the solid.
    fn quad(&mut self, corners: [u32; 4], inside_first: bool) {
        let [a, b, c, d] = if inside_first { corners } else { [corners[3], corners[2], corners[1], corners[0]] };
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
