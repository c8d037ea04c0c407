//! Meshes: vertices are written once, however many materials and instances use them.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::{Affine3A, Mat3, Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::buffer::Buffer;
use crate::export::ExportError;
use crate::math::Frame;
use crate::scene::material::{Material, ShadingFrame};
use crate::scene::source::GltfMaterial;
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene};

/// What a material asks of its meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Needs {
    /// The set of texture coordinates that tangents follow, where there must be tangents.
    tangents: Option<Tangents>,
    /// Vertex colours.
    color: bool,
    /// Their alpha.
    alpha: bool,
    /// How many sets of texture coordinates are read.
    sets: u32,
}

/// Where tangents come from that a mesh doesn't have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Tangents {
    set: u32,
    nori: bool,
    /// Also where there are no normals: the specification wants them given for anisotropy without a normal map.
    always: bool,
}

impl Needs {
    /// Of `out`, made of `source`.
    pub(super) fn of(source: &Material, out: &GltfMaterial) -> Self {
        let tangents = out.tangent_set().map(|set| Tangents {
            set,
            nori: source.frame == ShadingFrame::Nori && out.anisotropy.is_some(),
            always: out.anisotropy.is_some() && out.normal_texture.is_none(),
        });
        let sets = out.textures().map(|(_, map)| map.uv_set + 1).max().unwrap_or(0);
        Self { tangents, color: out.vertex_color, alpha: source.vertex_alpha, sets }
    }
}

/// Where in the file a mesh's vertices and triangles are.
#[derive(Clone, Debug)]
struct Written {
    vertices: usize,
    positions: usize,
    triangles: usize,
    normals: Option<usize>,
    tangents: Option<usize>,
    uvs: Vec<usize>,
    /// By whether they have colour and alpha.
    colors: BTreeMap<(bool, bool), usize>,
}

/// The meshes of a file.
pub(super) struct Meshes<'a> {
    scene: &'a Scene<Material>,
    needs: Vec<Needs>,
    written: BTreeMap<(MeshId, Option<Tangents>), Written>,
    by_use: BTreeMap<(MeshId, MaterialId), usize>,
    pub(super) json: Vec<Value>,
}

impl<'a> Meshes<'a> {
    /// Of `scene`, whose materials have these `needs`.
    pub(super) fn new(scene: &'a Scene<Material>, needs: Vec<Needs>) -> Self {
        Self { scene, needs, written: BTreeMap::new(), by_use: BTreeMap::new(), json: Vec::new() }
    }

    /// The number of the mesh that `instance` shows, written when it is first asked for.
    ///
    /// # Errors
    /// If the buffer is full.
    pub(super) fn of(&mut self, instance: &Instance, buffer: &mut Buffer) -> Result<usize, ExportError> {
        if let Some(&index) = self.by_use.get(&(instance.mesh, instance.material)) {
            return Ok(index);
        }
        let mesh = self.scene.mesh_of(instance);
        let needs = self.needs[instance.material.0 as usize];
        let made = needs.tangents.filter(|t| mesh.tangents.is_empty() && can_have_tangents(mesh, *t));
        let shaped = made.map_or(Cow::Borrowed(mesh), |t| Cow::Owned(with_tangents(mesh, t)));
        let key = (instance.mesh, made);
        let mut written = match self.written.remove(&key) {
            Some(written) => written,
            None => write(&shaped, buffer)?,
        };
        let primitive = primitive(&shaped, &mut written, needs, instance.material, buffer)?;
        self.written.insert(key, written);
        let index = self.push(mesh, primitive);
        self.by_use.insert((instance.mesh, instance.material), index);
        Ok(index)
    }

    /// The number of a mesh of this instance alone, placed in the world: for a transform that a node can't have.
    ///
    /// # Errors
    /// If the buffer is full.
    pub(super) fn placed(&mut self, instance: &Instance, buffer: &mut Buffer) -> Result<usize, ExportError> {
        let needs = self.needs[instance.material.0 as usize];
        let mut mesh = placed(self.scene.mesh_of(instance), &instance.world_from_object);
        if let Some(tangents) =
            needs.tangents.filter(|t| mesh.tangents.is_empty() && can_have_tangents(&mesh, *t))
        {
            mesh = with_tangents(&mesh, tangents);
        }
        let mut written = write(&mesh, buffer)?;
        let primitive = primitive(&mesh, &mut written, needs, instance.material, buffer)?;
        Ok(self.push(&mesh, primitive))
    }

    fn push(&mut self, mesh: &Mesh, primitive: Value) -> usize {
        self.json.push(json!({"name": mesh.name, "primitives": [primitive]}));
        self.json.len() - 1
    }
}

/// What every use of a mesh shares.
fn write(mesh: &Mesh, buffer: &mut Buffer) -> Result<Written, ExportError> {
    let positions = buffer.positions(&mesh.positions)?;
    let normals = match mesh.normals.is_empty() {
        true => None,
        false => Some(buffer.vectors(mesh.normals.iter().map(|n| n.to_array()))?),
    };
    let mut uvs = Vec::new();
    for set in &mesh.uvs {
        uvs.push(buffer.vectors(set.iter().map(|uv| uv.to_array()))?);
    }
    let triangles = buffer.triangles(&mesh.triangles, mesh.positions.len())?;
    let vertices = mesh.positions.len();
    Ok(Written { vertices, positions, triangles, normals, tangents: None, uvs, colors: BTreeMap::new() })
}

/// A mesh's triangles with `material`, and what that needs more.
fn primitive(
    mesh: &Mesh,
    written: &mut Written,
    needs: Needs,
    material: MaterialId,
    buffer: &mut Buffer,
) -> Result<Value, ExportError> {
    let mut attributes = json!({"POSITION": written.positions});
    if let Some(normals) = written.normals {
        attributes["NORMAL"] = normals.into();
        // Without normals the specification asks to ignore tangents.
        if needs.tangents.is_some() && !mesh.tangents.is_empty() {
            if written.tangents.is_none() {
                written.tangents = Some(buffer.vectors(mesh.tangents.iter().map(|t| t.to_array()))?);
            }
            attributes["TANGENT"] = written.tangents.into();
        }
    }
    // A set that isn't there is read as zeros; in the file it has to be there.
    while (written.uvs.len() as u32) < needs.sets {
        written.uvs.push(buffer.zeros(written.vertices));
    }
    for (set, accessor) in written.uvs.iter().enumerate() {
        attributes[format!("TEXCOORD_{set}")] = (*accessor).into();
    }
    if (needs.color || needs.alpha) && !mesh.colors.is_empty() {
        attributes["COLOR_0"] = colors(mesh, written, (needs.color, needs.alpha), buffer)?.into();
    }
    Ok(json!({"attributes": attributes, "indices": written.triangles, "material": material.0}))
}

/// Vertex colours, white or without alpha where the material doesn't read them.
fn colors(
    mesh: &Mesh,
    written: &mut Written,
    (color, alpha): (bool, bool),
    buffer: &mut Buffer,
) -> Result<usize, ExportError> {
    if let Some(&index) = written.colors.get(&(color, alpha)) {
        return Ok(index);
    }
    let rgb = |c: &Vec4| if color { c.truncate() } else { Vec3::ONE };
    let index = match alpha {
        true => buffer.vectors(mesh.colors.iter().map(|c| rgb(c).extend(c.w).to_array()))?,
        false => buffer.vectors(mesh.colors.iter().map(|c| rgb(c).to_array()))?,
    };
    written.colors.insert((color, alpha), index);
    Ok(index)
}

/// Whether tangents can be given to a mesh: they need something to follow, and normals, which are made for those alone that must have
/// them. Readers make the flat ones of a mesh without normals, and tangents, as the renderer does here.
fn can_have_tangents(mesh: &Mesh, tangents: Tangents) -> bool {
    let followed = mesh.uvs.len() > tangents.set as usize;
    tangents.always || (followed && !mesh.normals.is_empty())
}

/// The mesh with tangents where it has none, each corner a vertex of its own: along the texture coordinates of its triangle, or Nori's
/// or any around the normal. Without normals each triangle is flat.
fn with_tangents(mesh: &Mesh, from: Tangents) -> Mesh {
    let corners: Vec<usize> = mesh.triangles.iter().flatten().map(|&i| i as usize).collect();
    let pick = |values: &[Vec3]| -> Vec<Vec3> { corners.iter().map(|&i| values[i]).collect() };
    let mut out = Mesh {
        name: mesh.name.clone(),
        positions: pick(&mesh.positions),
        normals: if mesh.normals.is_empty() { Vec::new() } else { pick(&mesh.normals) },
        uvs: mesh.uvs.iter().map(|set| corners.iter().map(|&i| set[i]).collect()).collect(),
        colors: if mesh.colors.is_empty() {
            Vec::new()
        } else {
            corners.iter().map(|&i| mesh.colors[i]).collect()
        },
        triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        tangents: Vec::new(),
    };
    if out.normals.is_empty() {
        out.normals = out.positions.chunks_exact(3).flat_map(|p| [flat_normal(p); 3]).collect();
    }
    let set = out.uvs.get(from.set as usize).filter(|_| !from.nori);
    out.tangents = (0..corners.len())
        .map(|i| {
            let first = i - i % 3;
            let normal = out.normals[i];
            let along = set.and_then(|set| along_u(&out.positions[first..first + 3], &set[first..first + 3]));
            along.unwrap_or_else(|| match from.nori {
                true => Frame::nori(normal).tangent.extend(1.0),
                false => Frame::from_normal(normal).tangent.extend(1.0),
            })
        })
        .collect();
    out
}

fn flat_normal(corners: &[Vec3]) -> Vec3 {
    let [a, b, c] = [corners[0], corners[1], corners[2]].map(|p| p.as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |n| n.as_vec3())
}

/// The direction of growing u on a triangle, with the sign of the bitangent, which goes along falling v.
fn along_u(p: &[Vec3], uv: &[Vec2]) -> Option<Vec4> {
    let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let det = d1.perp_dot(d2);
    let tangent = ((p[1] - p[0]) * d2.y - (p[2] - p[0]) * d1.y) * det.signum();
    Some(tangent.try_normalize()?.extend(-det.signum()))
}

/// The mesh in the world. A transform that mirrors turns triangles round.
fn placed(mesh: &Mesh, to_world: &Affine3A) -> Mesh {
    let normal_to_world = Mat3::from(to_world.matrix3).inverse().transpose();
    let mirrors = to_world.matrix3.determinant() < 0.0;
    let turned = |v: Vec3, by: Vec3| by.try_normalize().unwrap_or(v);
    Mesh {
        positions: mesh.positions.iter().map(|&p| to_world.transform_point3(p)).collect(),
        normals: mesh.normals.iter().map(|&n| turned(n, normal_to_world * n)).collect(),
        tangents: mesh
            .tangents
            .iter()
            .map(|t| {
                let along = to_world.transform_vector3(t.truncate());
                turned(t.truncate(), along).extend(if mirrors { -t.w } else { t.w })
            })
            .collect(),
        triangles: match mirrors {
            true => mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
            false => mesh.triangles.clone(),
        },
        ..mesh.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            uvs: vec![vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn tangents_follow_the_coordinates_of_their_triangle() {
        let from = Tangents { set: 0, nori: false, always: true };
        let mesh = with_tangents(&square(), from);
        assert_eq!((mesh.positions.len(), mesh.normals.as_slice()), (6, &[Vec3::Z; 6][..]));
        // The image stands upright, so the bitangent n × t points upwards.
        assert_eq!(mesh.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 6]);
        let nori = with_tangents(&square(), Tangents { nori: true, ..from });
        assert_eq!(nori.tangents[0].truncate(), Frame::nori(Vec3::Z).tangent);
        assert!(!can_have_tangents(&square(), Tangents { always: false, ..from }), "it has no normals");
    }

    #[test]
    fn a_mirrored_mesh_keeps_its_front() {
        let mesh = Mesh { normals: vec![Vec3::Z; 4], ..square() };
        let mirrored = placed(&mesh, &Affine3A::from_scale(Vec3::new(-1.0, 2.0, 1.0)));
        assert_eq!(mirrored.triangles[0], [0, 2, 1]);
        let p: Vec<Vec3> = mirrored.triangles[0].iter().map(|&i| mirrored.positions[i as usize]).collect();
        assert_eq!((flat_normal(&p), mirrored.normals[0]), (Vec3::Z, Vec3::Z));
    }
}
