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

impl Mesh {
    /// The memory that its values take, in bytes.
    pub fn bytes(&self) -> usize {
        let uvs: usize = self.uvs.iter().map(Vec::len).sum();
        size_of_val(self.positions.as_slice())
            + size_of_val(self.normals.as_slice())
            + size_of_val(self.tangents.as_slice())
            + uvs * size_of::<Vec2>()
            + size_of_val(self.colors.as_slice())
            + size_of_val(self.triangles.as_slice())
    }
}
