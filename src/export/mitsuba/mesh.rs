//! Meshes as binary PLY: each instance in the world, with the winding and the normals that we render.

use glam::{Affine3A, Mat3, Vec3};

use crate::color::Rgb;
use crate::scene::{Instance, Mesh};

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

/// A mesh that stands in the world.
#[derive(Debug)]
pub(super) struct Placed<'a> {
    mesh: &'a Mesh,
    world_from_object: Affine3A,
    normal_matrix: Mat3,
    attributes: Attributes,
}

/// A vertex of the file: one of the mesh's, maybe elsewhere.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    corner: u32,
    moved: Vec3,
}

impl<'a> Placed<'a> {
    pub(super) fn new(mesh: &'a Mesh, instance: &Instance, attributes: Attributes) -> Self {
        let world_from_object = instance.world_from_object;
        let normal_matrix = Mat3::from(world_from_object.matrix3).inverse().transpose();
        Self { mesh, world_from_object, normal_matrix, attributes }
    }

    /// The mesh as it is.
    pub(super) fn front(&self) -> Vec<u8> {
        let vertex = |corner| Vertex { corner, moved: Vec3::ZERO };
        let vertices: Vec<Vertex> = (0..self.mesh.positions.len() as u32).map(vertex).collect();
        let triangles: Vec<[u32; 3]> = self.triangles().collect();
        self.ply(&vertices, &triangles, 1.0)
    }

    /// The mesh turned round, each triangle by itself a little behind where it was: by 2⁻¹⁴ of the largest coordinate, which is
    /// more than rays mistake and less than one sees.
    pub(super) fn back(&self) -> Vec<u8> {
        let all = (0..self.mesh.positions.len() as u32).map(|c| self.position(c));
        let step = all.map(|p| p.abs().max_element()).fold(0.0, f32::max) / 16384.0;
        let vertices: Vec<Vertex> = self
            .triangles()
            .flat_map(|[a, b, c]| {
                let [pa, pb, pc] = [a, b, c].map(|corner| self.position(corner));
                let moved = (pb - pa).cross(pc - pa).normalize_or_zero() * -step;
                [a, c, b].map(|corner| Vertex { corner, moved })
            })
            .collect();
        let triangles: Vec<[u32; 3]> =
            (0..vertices.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        self.ply(&vertices, &triangles, -1.0)
    }

    /// Counter-clockwise seen from the front, also where the transform mirrors.
    fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        let mirrors = self.world_from_object.matrix3.determinant() < 0.0;
        self.mesh.triangles.iter().map(move |&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] })
    }

    fn position(&self, corner: u32) -> Vec3 {
        self.world_from_object.transform_point3(self.mesh.positions[corner as usize])
    }

    /// The file with these vertices and triangles; `side` multiplies normals.
    fn ply(&self, vertices: &[Vertex], triangles: &[[u32; 3]], side: f32) -> Vec<u8> {
        let has_normals = !self.mesh.normals.is_empty();
        let Attributes { uv_set, color, opacity } = self.attributes;
        let properties = [
            (true, &["x", "y", "z"][..]),
            (has_normals, &["nx", "ny", "nz"]),
            (uv_set.is_some(), &["u", "v"]),
            (color.is_some(), &["r", "g", "b"]),
            (opacity.is_some(), &["opacity_0"]),
        ];
        let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", vertices.len());
        for name in properties.iter().filter(|(is, _)| *is).flat_map(|(_, names)| *names) {
            header += &format!("property float {name}\n");
        }
        header +=
            &format!("element face {}\nproperty list uchar uint vertex_index\nend_header\n", triangles.len());
        let mut bytes = header.into_bytes();
        let mut put = |values: &[f32]| bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        let uvs = uv_set.and_then(|set| self.mesh.uvs.get(set as usize));
        for &Vertex { corner, moved } in vertices {
            let at = corner as usize;
            put(&(self.position(corner) + moved).to_array());
            if has_normals {
                let normal = self.mesh.normals[at];
                put(&((self.normal_matrix * normal).try_normalize().unwrap_or(normal) * side).to_array());
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
}
