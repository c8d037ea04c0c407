//! Primitives into meshes.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::Accessors;
use super::deform::Deformation;
use super::error::GltfError;
use super::tangents;
use crate::import::validate::compact;
use crate::record::Warning;
use crate::scene::Mesh;

/// The most triangles that all meshes of a file may have together.
pub(super) const MAX_TRIANGLES: u64 = 1 << 27;

/// The most sets of texture coordinates that a mesh may have: each takes memory for a few characters in the file.
const MAX_UV_SETS: usize = 16;

/// What becomes of the alpha of vertex colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VertexAlpha {
    /// It counts.
    Keep,
    /// It is 1: the material's alpha mode is OPAQUE, which ignores alpha.
    Ignore,
}

/// A primitive as it is to be read.
pub(super) struct Part<'p> {
    /// The primitive.
    pub(super) primitive: &'p Primitive,
    /// Its place in the file.
    pub(super) element: &'p str,
    /// The name of the mesh that becomes of it.
    pub(super) name: String,
    /// What becomes of its vertex colours' alpha.
    pub(super) alpha: VertexAlpha,
    /// The texture coordinates that its tangents follow, if its material needs any.
    pub(super) tangents: Option<u32>,
    /// How its vertices are moved.
    pub(super) deformation: &'p Deformation,
}

/// Reads primitives and counts their triangles.
pub(super) struct Geometry<'a> {
    accessors: Accessors<'a>,
    triangles: u64,
    file: &'a str,
}

impl<'a> Geometry<'a> {
    /// Reading by `accessors`; `file` names the scene's file in warnings.
    pub(super) fn new(accessors: Accessors<'a>, file: &'a str) -> Self {
        Self { accessors, triangles: 0, file }
    }

    /// What reads the file's accessors.
    pub(super) fn accessors(&self) -> &Accessors<'a> {
        &self.accessors
    }

    /// The mesh of a primitive; none, with a warning, if it has no triangles.
    pub(super) fn read(
        &mut self,
        part: Part,
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<Arc<Mesh>>, GltfError> {
        let Part { primitive, element, name, alpha, tangents: tangent_set, deformation } = part;
        let file = self.file;
        let mut warn = |message: String| {
            warnings.push(Warning::new(format!("{file}: mesh {name:?} ({element})"), message));
        };
        let Some(positions) = attribute(primitive, Semantic::Positions) else {
            warn("it has no POSITION and is left out".into());
            return Ok(None);
        };
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(mode) => {
                warn(format!("points and lines are not rendered; this one is {mode:?} and is left out"));
                return Ok(None);
            }
            Checked::Invalid => {
                let (property, expected) = ("mode", "an integer from 0 to 6");
                return Err(GltfError::Invalid { element: element.to_owned(), property, expected });
            }
        };

        let mut mesh = Mesh { positions: vectors(&self.accessors, positions, element)?, ..Mesh::default() };
        let vertices = mesh.positions.len();
        let corners = match primitive.indices {
            Some(index) => self.accessors.indices(index.value(), element)?,
            None => (0..u32::try_from(vertices).unwrap_or(u32::MAX)).collect(),
        };
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
            let (element, count) = (element.to_owned(), vertices as u64);
            return Err(GltfError::VertexIndex { element, index, count });
        }
        if mode == Mode::Triangles && !corners.len().is_multiple_of(3) {
            warn(format!("{} indices are not whole triangles; the last ones are ignored", corners.len()));
        }
        mesh.triangles = triangles(&corners, mode);
        self.count(mesh.triangles.len())?;
        self.read_attributes(primitive, element, alpha, &mut mesh, &mut warn)?;
        deformation.morph(primitive, element, &self.accessors, &mut mesh)?;
        let set = tangent_set.filter(|_| mesh.tangents.is_empty());
        let split = set.and_then(|set| tangents::generate(&mut mesh, set as usize));
        deformation.skin(primitive, element, &self.accessors, split.as_deref(), &mut mesh, &mut warn)?;
        mesh.name = name;
        compact(&mut mesh);
        Ok(Some(Arc::new(mesh)))
    }

    /// Everything of a vertex but its position.
    fn read_attributes(
        &self,
        primitive: &Primitive,
        element: &str,
        alpha: VertexAlpha,
        mesh: &mut Mesh,
        warn: &mut impl FnMut(String),
    ) -> Result<(), GltfError> {
        let vertices = mesh.positions.len();
        let check = |attribute: &str, found: usize| {
            if found == vertices {
                return Ok(());
            }
            let (element, attribute) = (element.to_owned(), attribute.to_owned());
            Err(GltfError::AttributeCount { element, attribute, found, vertices })
        };
        if let Some(index) = attribute(primitive, Semantic::Normals) {
            mesh.normals = vectors(&self.accessors, index, element)?;
            check("NORMAL", mesh.normals.len())?;
        }
        // Without normals the specification asks for flat ones and to ignore the tangents.
        if let Some(index) = attribute(primitive, Semantic::Tangents).filter(|_| !mesh.normals.is_empty()) {
            mesh.tangents = self.accessors.floats::<4>(index, element)?.into_iter().map(Vec4::from).collect();
            check("TANGENT", mesh.tangents.len())?;
        }
        while mesh.uvs.len() < MAX_UV_SETS
            && let Some(index) = attribute(primitive, Semantic::TexCoords(mesh.uvs.len() as u32))
        {
            let set = self.accessors.floats::<2>(index, element)?;
            check(&format!("TEXCOORD_{}", mesh.uvs.len()), set.len())?;
            mesh.uvs.push(set.into_iter().map(Vec2::from).collect());
        }
        for semantic in primitive.attributes.keys() {
            match semantic {
                Checked::Valid(Semantic::TexCoords(n)) if *n as usize >= mesh.uvs.len() => {
                    warn(format!(
                        "TEXCOORD_{n} is ignored: at most {MAX_UV_SETS} sets are read, numbered from 0 without a gap"
                    ));
                }
                Checked::Valid(Semantic::Colors(n)) if *n > 0 => {
                    warn(format!("COLOR_{n} is ignored: glTF gives COLOR_0 alone a meaning"));
                }
                _ => {}
            }
        }
        if let Some(index) = attribute(primitive, Semantic::Colors(0)) {
            mesh.colors = self.colors(index, element, alpha)?;
            check("COLOR_0", mesh.colors.len())?;
        }
        Ok(())
    }

    /// Vertex colours with or without alpha; they are linear (glTF 2.0, 3.7.2.1).
    fn colors(&self, index: usize, element: &str, alpha: VertexAlpha) -> Result<Vec<Vec4>, GltfError> {
        if self.accessors.components(index, element)? == 3 {
            let colors = self.accessors.floats::<3>(index, element)?;
            return Ok(colors.into_iter().map(|c| Vec3::from(c).extend(1.0)).collect());
        }
        let colors = self.accessors.floats::<4>(index, element)?;
        let with_alpha = |[r, g, b, a]: [f32; 4]| match alpha {
            VertexAlpha::Keep => Vec4::new(r, g, b, a),
            VertexAlpha::Ignore => Vec4::new(r, g, b, 1.0),
        };
        Ok(colors.into_iter().map(with_alpha).collect())
    }

    fn count(&mut self, triangles: usize) -> Result<(), GltfError> {
        self.triangles = self.triangles.saturating_add(triangles as u64);
        if self.triangles > MAX_TRIANGLES {
            return Err(GltfError::TooMany { what: "triangles", limit: MAX_TRIANGLES });
        }
        Ok(())
    }
}

/// `accessors[index]` as vectors.
pub(super) fn vectors(accessors: &Accessors, index: usize, element: &str) -> Result<Vec<Vec3>, GltfError> {
    Ok(accessors.floats::<3>(index, element)?.into_iter().map(Vec3::from).collect())
}

/// The accessor of an attribute.
pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value())
}

/// The triangles of a list, strip or fan, by the formulas of glTF 2.0, 3.7.2.1: a strip's every second triangle is turned round.
fn triangles(corners: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => match corners {
            [hub, rim @ ..] => rim.windows(2).map(|w| [w[0], w[1], *hub]).collect(),
            [] => Vec::new(),
        },
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_orientation() {
        assert_eq!(triangles(&[0, 1, 2, 3, 4], Mode::TriangleStrip), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(&[9, 1, 2, 3], Mode::TriangleFan), [[1, 2, 9], [2, 3, 9]]);
        assert_eq!(triangles(&[0, 1, 2, 3], Mode::Triangles), [[0, 1, 2]]);
        for mode in [Mode::Triangles, Mode::TriangleStrip, Mode::TriangleFan] {
            assert!(triangles(&[0, 1], mode).is_empty());
            assert!(triangles(&[], mode).is_empty());
        }
    }
}
