//! Triangle meshes.

use glam::{Vec2, Vec3, Vec4};

/// A triangle mesh in object space. All positions are finite and every index is in range: importers see to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a vertex, or none: then each triangle is flat.
    pub normals: Vec<Vec3>,
    /// Unit tangents with the bitangent's sign in w, one a vertex, or none.
    pub tangents: Vec<Vec4>,
    /// Texture coordinate sets, each with one pair a vertex; (0, 0) is the first pixel of the first row.
    pub uvs: Vec<Vec<Vec2>>,
    /// Linear colour and alpha, one a vertex, or none.
    pub colors: Vec<Vec4>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}
