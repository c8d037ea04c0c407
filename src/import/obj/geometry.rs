//! What `tobj` read into meshes with one index a vertex.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use super::polygon::{self, Triangulation};
use super::{Grouping, ObjError, clean};
use crate::color::linear_from_srgb;
use crate::record::Warning;
use crate::scene::Mesh;

/// A group's faces as a mesh.
#[derive(Debug)]
pub(super) struct Part {
    /// The object's or group's name; may be empty.
    pub name: String,
    /// The material's name, where the file gives one.
    pub material: Option<String>,
    /// The line of the first face.
    pub line: u32,
    /// Its triangles.
    pub mesh: Mesh,
}

/// The meshes of a file, and its material libraries with the lines that name them.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub parts: Vec<Part>,
    pub libraries: Vec<(String, u32)>,
}

/// Reads the geometry of the file `name`.
pub(super) fn read(
    name: &str,
    bytes: &[u8],
    grouping: Grouping,
    warnings: &mut Vec<Warning>,
) -> Result<Geometry, ObjError> {
    let cleaned = clean::clean(name, bytes, grouping, warnings)?;
    let options = tobj::LoadOptions::default();
    let no_library = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut cleaned.stream.as_bytes(), &options, no_library)
        .map_err(|cause| ObjError::Tobj { file: name.to_owned(), cause })?;
    let mut parts = Vec::new();
    for model in models.into_iter().filter(|model| !model.mesh.indices.is_empty()) {
        // Objects were named by their index.
        let Some(group) = model.name.parse().ok().and_then(|i: usize| cleaned.groups.get(i)) else {
            continue;
        };
        let place = format!("{name}:{}", group.line);
        let mesh = Builder::new(&model.mesh, &place).build(&group.name, warnings)?;
        if !mesh.triangles.is_empty() {
            parts.push(Part {
                name: group.name.clone(),
                material: group.material.clone(),
                line: group.line,
                mesh,
            });
        }
    }
    if parts.is_empty() {
        return Err(ObjError::NoFaces { file: name.to_owned() });
    }
    Ok(Geometry { parts, libraries: cleaned.libraries })
}

/// Turns faces with an index for each attribute into triangles with one.
struct Builder<'a> {
    source: &'a tobj::Mesh,
    place: &'a str,
    mesh: Mesh,
    /// Vertices by (position, uv, normal); looked up only, so its order does not matter.
    vertices: HashMap<(u32, Option<u32>, NormalKey), u32>,
    has_uvs: bool,
    has_normals: bool,
    has_colors: bool,
    uvs_missing: bool,
}

/// A vertex's normal: one of the file, or that of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum NormalKey {
    Given(u32),
    OfFace(usize),
    None,
}

impl<'a> Builder<'a> {
    fn new(source: &'a tobj::Mesh, place: &'a str) -> Self {
        let mut builder = Self {
            source,
            place,
            mesh: Mesh::default(),
            vertices: HashMap::new(),
            has_uvs: false,
            has_normals: false,
            has_colors: source.vertex_color.iter().any(|c| !c.is_nan()),
            uvs_missing: false,
        };
        let all = 0..source.indices.len();
        builder.has_uvs = all.clone().any(|corner| builder.uv_index(corner).is_some());
        builder.has_normals = all.clone().any(|corner| builder.normal_index(corner).is_some());
        builder
    }

    fn build(mut self, name: &str, warnings: &mut Vec<Warning>) -> Result<Mesh, ObjError> {
        let (mut doubtful, mut without_area) = (0_u64, 0_u64);
        let mut triangles = Vec::new();
        let mut points = Vec::new();
        let mut start = 0;
        let faces = self.source.indices.len() / 3;
        // No arities means triangles alone.
        let arities: Box<dyn Iterator<Item = usize>> = if self.source.face_arities.is_empty() {
            Box::new(std::iter::repeat_n(3, faces))
        } else {
            Box::new(self.source.face_arities.iter().map(|&n| n as usize))
        };
        for (face, arity) in arities.enumerate() {
            points.clear();
            points.extend((start..start + arity).map(|corner| self.position(corner)));
            triangles.clear();
            match polygon::triangulate(&points, &mut triangles) {
                Triangulation::Whole => {}
                Triangulation::Doubtful => doubtful += 1,
                Triangulation::TooLarge => {
                    return Err(ObjError::PolygonTooLarge { place: self.place.to_owned(), corners: arity });
                }
            }
            // A face without area is never hit: any direction will do.
            let face_normal = polygon::newell(&points).normalize_or(glam::DVec3::Z).as_vec3();
            for t in &triangles {
                let [a, b, c] = t.map(|i| points[i]);
                if a == b || b == c || c == a {
                    without_area += 1;
                    continue;
                }
                let mut triangle = [0; 3];
                for (slot, &i) in triangle.iter_mut().zip(t) {
                    *slot = self.vertex(start + i, face, face_normal)?;
                }
                self.mesh.triangles.push(triangle);
            }
            start += arity;
        }
        let mut warn = |count: u64, what: &str| {
            if count > 0 {
                warnings.push(Warning::new(self.place, format!("{count} {what}")));
            }
        };
        warn(doubtful, "polygons cross themselves or have no area; their triangles are a best effort");
        warn(without_area, "triangles with two corners in one place left out");
        if self.uvs_missing {
            warnings
                .push(Warning::new(self.place, "some corners have no texture coordinates; read as (0, 0)"));
        }
        name.clone_into(&mut self.mesh.name);
        Ok(self.mesh)
    }

    fn position(&self, corner: usize) -> Vec3 {
        let at = self.source.indices[corner] as usize * 3;
        Vec3::from_slice(&self.source.positions[at..at + 3])
    }

    /// The texture coordinates' index, unless they are missing.
    fn uv_index(&self, corner: usize) -> Option<u32> {
        let index = *self.source.texcoord_indices.get(corner)?;
        (!self.source.texcoords[index as usize * 2].is_nan()).then_some(index)
    }

    /// The normal's index, unless it is missing.
    fn normal_index(&self, corner: usize) -> Option<u32> {
        let index = *self.source.normal_indices.get(corner)?;
        (!self.source.normals[index as usize * 3].is_nan()).then_some(index)
    }

    /// The index of the vertex at a corner, made on first use.
    fn vertex(&mut self, corner: usize, face: usize, face_normal: Vec3) -> Result<u32, ObjError> {
        let position = self.source.indices[corner];
        let uv = self.uv_index(corner);
        let normal = match self.normal_index(corner) {
            _ if !self.has_normals => NormalKey::None,
            Some(index) => NormalKey::Given(index),
            None => NormalKey::OfFace(face),
        };
        if let Some(&index) = self.vertices.get(&(position, uv, normal)) {
            return Ok(index);
        }
        let index = u32::try_from(self.mesh.positions.len())
            .map_err(|_| ObjError::TooManyVertices { place: self.place.to_owned() })?;
        self.vertices.insert((position, uv, normal), index);
        self.mesh.positions.push(self.position(corner));
        if self.has_uvs {
            self.uvs_missing |= uv.is_none();
            if self.mesh.uvs.is_empty() {
                self.mesh.uvs.push(Vec::new());
            }
            // The file's v goes upwards, the image's rows downwards.
            self.mesh.uvs[0].push(uv.map_or(Vec2::ZERO, |i| {
                let at = i as usize * 2;
                Vec2::new(self.source.texcoords[at], 1.0 - self.source.texcoords[at + 1])
            }));
        }
        match normal {
            NormalKey::None => {}
            NormalKey::OfFace(_) => self.mesh.normals.push(face_normal),
            NormalKey::Given(i) => {
                let given = Vec3::from_slice(&self.source.normals[i as usize * 3..][..3]);
                // In f64 neither tiny nor huge vectors lose their direction.
                self.mesh.normals.push(given.as_dvec3().normalize_or_zero().as_vec3());
            }
        }
        if self.has_colors {
            let color = &self.source.vertex_color[position as usize * 3..][..3];
            // Painting programs write display colours.
            let linear = |c: f32| linear_from_srgb(c.clamp(0.0, 1.0));
            self.mesh.colors.push(match color {
                [r, ..] if r.is_nan() => Vec4::ONE,
                rgb => Vec4::new(linear(rgb[0]), linear(rgb[1]), linear(rgb[2]), 1.0),
            });
        }
        Ok(index)
    }
}
