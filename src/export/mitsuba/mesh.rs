//! Meshes as binary PLY: each instance in the world, with the winding and the normals that we render.

use glam::{Affine3A, Mat3, Vec3};

use crate::color::Rgb;
use crate::scene::Mesh;

/// What a material reads of a mesh beyond positions and normals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Attributes {
    /// The set of texture coordinates.
    pub(super) uv_set: Option<u32>,
    /// Vertex colours, times this.
    pub(super) color: Option<Rgb>,
    /// The alpha of vertex colours, times this.
    pub(super) opacity: Option<f32>,
}

/// Mitsuba's name for an attribute of properties r, g and b.
pub(super) const VERTEX_COLOR: &str = "vertex_color";
/// And for one of the property opacity_0.
pub(super) const VERTEX_OPACITY: &str = "vertex_opacity";

/// A mesh, wherever it stands in the world: all of its instances of one material are one shape.
#[derive(Debug)]
pub(super) struct Placed<'a> {
    mesh: &'a Mesh,
    attributes: Attributes,
    places: Vec<Place>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    world_from_object: Affine3A,
    normal_matrix: Mat3,
}

/// A vertex of the file: one of the mesh's in a place, maybe moved from there.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    place: Place,
    corner: u32,
    moved: Vec3,
}

impl<'a> Placed<'a> {
    pub(super) fn new(
        mesh: &'a Mesh,
        attributes: Attributes,
        places: impl IntoIterator<Item = Affine3A>,
    ) -> Self {
        let places = places.into_iter().map(|world_from_object| {
            let normal_matrix = Mat3::from(world_from_object.matrix3).inverse().transpose();
            Place { world_from_object, normal_matrix }
        });
        Self { mesh, attributes, places: places.collect() }
    }

    /// The mesh as it is.
    pub(super) fn front(&self) -> Vec<u8> {
        let count = self.mesh.positions.len() as u32;
        let vertices: Vec<Vertex> = self
            .places
            .iter()
            .flat_map(|&place| (0..count).map(move |corner| Vertex { place, corner, moved: Vec3::ZERO }))
            .collect();
        let triangles = self.places.iter().zip(0..).flat_map(|(place, i)| {
            self.triangles(place).map(move |triangle| triangle.map(|corner| i * count + corner))
        });
        self.ply(&vertices, &triangles.collect::<Vec<_>>(), 1.0)
    }

    /// The mesh turned round, each triangle by itself a little behind where it was: by 2⁻¹⁴ of the largest coordinate, which is
    /// more than rays mistake and less than one sees.
    pub(super) fn back(&self) -> Vec<u8> {
        let mut vertices = Vec::with_capacity(3 * self.mesh.triangles.len() * self.places.len());
        for place in &self.places {
            let all = (0..self.mesh.positions.len() as u32).map(|corner| self.position(place, corner));
            let step = all.map(|p| p.abs().max_element()).fold(0.0, f32::max) / 16384.0;
            for [a, b, c] in self.triangles(place) {
                let [pa, pb, pc] = [a, b, c].map(|corner| self.position(place, corner));
                let moved = (pb - pa).cross(pc - pa).normalize_or_zero() * -step;
                vertices.extend([a, c, b].map(|corner| Vertex { place: *place, corner, moved }));
            }
        }
        let triangles = (0..vertices.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        self.ply(&vertices, &triangles.collect::<Vec<_>>(), -1.0)
    }

    /// Counter-clockwise seen from the front, also where the transform mirrors.
    fn triangles(&self, place: &Place) -> impl Iterator<Item = [u32; 3]> {
        let mirrors = place.world_from_object.matrix3.determinant() < 0.0;
        self.mesh.triangles.iter().map(move |&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] })
    }

    fn position(&self, place: &Place, corner: u32) -> Vec3 {
        place.world_from_object.transform_point3(self.mesh.positions[corner as usize])
    }

    /// The file with these vertices and triangles; `side` multiplies normals.
    fn ply(&self, vertices: &[Vertex], triangles: &[[u32; 3]], side: f32) -> Vec<u8> {
        let Attributes { uv_set, color, opacity } = self.attributes;
        let has_normals = !self.mesh.normals.is_empty();
        let mut bytes = self.header(vertices.len(), triangles.len()).into_bytes();
        let mut put = |values: &[f32]| bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        let uvs = uv_set.and_then(|set| self.mesh.uvs.get(set as usize));
        for Vertex { place, corner, moved } in vertices {
            let at = *corner as usize;
            put(&(self.position(place, *corner) + *moved).to_array());
            if has_normals {
                let normal = self.mesh.normals[at];
                put(&((place.normal_matrix * normal).try_normalize().unwrap_or(normal) * side).to_array());
            }
            if uv_set.is_some() {
                put(&uvs.map_or([0.0; 2], |uvs| uvs[at].to_array()));
            }
            let [r, g, b, alpha] = self.mesh.colors.get(at).map_or([1.0; 4], |c| c.to_array());
            if let Some(factor) = color {
                put(&(factor * Rgb::new(r, g, b)).map(|v| v.clamp(0.0, 1.0)).to_array());
            }
            if let Some(factor) = opacity {
                put(&[(factor * alpha).clamp(0.0, 1.0)]);
            }
        }
        for triangle in triangles {
            bytes.push(3);
            bytes.extend(triangle.iter().flat_map(|corner| corner.to_le_bytes()));
        }
        bytes
    }

    fn header(&self, vertices: usize, triangles: usize) -> String {
        let Attributes { uv_set, color, opacity } = self.attributes;
        let properties: [(bool, &[&str]); 5] = [
            (true, &["x", "y", "z"]),
            (!self.mesh.normals.is_empty(), &["nx", "ny", "nz"]),
            (uv_set.is_some(), &["u", "v"]),
            (color.is_some(), &["r", "g", "b"]),
            (opacity.is_some(), &["opacity_0"]),
        ];
        let names = properties.iter().filter(|(is, _)| *is).flat_map(|(_, names)| *names);
        let properties: String = names.map(|name| format!("property float {name}\n")).collect();
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{properties}element face {triangles}\n\
             property list uchar uint vertex_index\nend_header\n"
        )
    }
}
