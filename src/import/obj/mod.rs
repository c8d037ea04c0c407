//! Wavefront OBJ with its MTL libraries.
//!
//! `clean` makes a stream that `tobj` reads, `geometry` and `polygon` turn its faces into triangles, `mtl` reads the libraries,
//! and `maps` finds and loads what they name. Faces of one object (or group) and material become a mesh and an instance, in
//! the order of the file. Corners without normals take those of their smoothing group, or are flat. The file's v goes upwards and
//! is turned; its vertex colours are taken as sRGB and used where the file names no material.

mod clean;
mod geometry;
mod heights;
mod maps;
mod mtl;
mod polygon;
mod smoothing;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{Affine3A, Vec4};

use super::Files;
use crate::record::Warning;
use crate::scene::source::{MtlMaterial, SourceMaterial};
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Named, Scene};
use geometry::Part;
use maps::Maps;

/// The material of faces that name none.
const DEFAULT_MATERIAL: &str = "default";

/// The colour of a mesh without vertex colours whose material others have them for: as grey as without any.
const UNCOLORED: Vec4 = Vec4::new(0.8, 0.8, 0.8, 1.0);

/// Why an OBJ file cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// A face has a corner that isn't a reference.
    #[error(
        "{file}:{line}: {word:?} is not a face's corner; expected v, v/vt, v//vn or v/vt/vn with whole numbers"
    )]
    Face {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u32,
        /// What was there.
        word: String,
    },
    /// A face refers to something that isn't there.
    #[error(
        "{file}:{line}: {word:?} names a {what} that is not there; the file has {count} (numbered from 1)"
    )]
    Index {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u32,
        /// The reference.
        word: String,
        /// What it refers to.
        what: &'static str,
        /// How many of them the file holds.
        count: usize,
    },
    /// A polygon is too large.
    #[error(
        "{place}: a polygon has {corners} corners; at most {}, or {} if it is concave, are read; hint: export triangles",
        polygon::MAX_CORNERS,
        polygon::MAX_CONCAVE
    )]
    PolygonTooLarge {
        /// The file and the line of the group's first face.
        place: String,
        /// Its corners, or as many as were counted.
        corners: usize,
    },
    /// A mesh has too many vertices.
    #[error("{place}: a mesh has more than 2³² vertices; hint: split it into several groups")]
    TooManyVertices {
        /// The file and the line of the group's first face.
        place: String,
    },
    /// Nothing to render.
    #[error("{file} has no face with an area; hint: is it an OBJ file with polygons?")]
    NoFaces {
        /// The file.
        file: String,
    },
    /// The parser refused the cleaned file.
    #[error("{file}: {cause}")]
    Tobj {
        /// The file.
        file: String,
        /// Its reason.
        cause: tobj::LoadError,
    },
}

/// Whether a file's groups are kept apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Grouping {
    /// A mesh for each pair of object and material.
    ByObjectAndMaterial,
    /// One mesh.
    Whole,
}

/// Reads the file `name` of the scene's folder, whose content is `bytes`, with its libraries and maps.
///
/// # Errors
/// If a face cannot be read or the file has none. Everything else that is wrong is a warning.
pub(super) fn import(
    files: &mut Files,
    name: &str,
    bytes: &[u8],
) -> Result<(Scene<SourceMaterial>, Vec<Warning>), ObjError> {
    let mut warnings = Vec::new();
    let geometry = geometry::read(name, bytes, Grouping::ByObjectAndMaterial, &mut warnings)?;
    let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
    let library = read_libraries(files, name, folder, &geometry.libraries, &mut warnings);

    let mut scene = Scene::empty();
    let mut maps = Maps::default();
    let mut ids = BTreeMap::new();
    for (material, mut item, folder) in used_materials(name, library, &geometry.parts, &mut warnings) {
        maps.load(files, &folder, &mut item, &mut warnings);
        ids.insert(material.clone(), MaterialId(scene.materials.len() as u32));
        scene.materials.push(Named::new(material, SourceMaterial::Mtl(item)));
    }
    for mut part in geometry.parts {
        let Some(&material) = ids.get(part.material.as_deref().unwrap_or(DEFAULT_MATERIAL)) else { continue };
        if takes_vertex_colors(&scene.materials[material.0 as usize].item) && part.mesh.colors.is_empty() {
            part.mesh.colors = vec![UNCOLORED; part.mesh.positions.len()];
        }
        let label = if part.name.is_empty() { name.to_owned() } else { part.name };
        scene.instances.push(Instance {
            name: label,
            mesh: MeshId(scene.meshes.len() as u32),
            material,
            world_from_object: Affine3A::IDENTITY,
        });
        scene.meshes.push(Arc::new(part.mesh));
    }
    (scene.images, scene.textures) = (maps.images, maps.textures);
    Ok((scene, warnings))
}

/// Whether the colours of the meshes' vertices are the material.
fn takes_vertex_colors(material: &SourceMaterial) -> bool {
    matches!(material, SourceMaterial::Mtl(mtl) if mtl.vertex_color)
}

/// All triangles of the OBJ file `name` as one mesh, without materials.
///
/// # Errors
/// As [`import`].
pub(super) fn read_mesh(name: &str, bytes: &[u8], warnings: &mut Vec<Warning>) -> Result<Mesh, ObjError> {
    let geometry = geometry::read(name, bytes, Grouping::Whole, warnings)?;
    let no_faces = || ObjError::NoFaces { file: name.to_owned() };
    let mut mesh = geometry.parts.into_iter().next().ok_or_else(no_faces)?.mesh;
    name.clone_into(&mut mesh.name);
    Ok(mesh)
}

/// A material of a library and the folder its maps are relative to.
type Library = BTreeMap<String, (usize, MtlMaterial, String)>;

/// All materials of the libraries with their place among them. A name that two libraries define has the first one's.
fn read_libraries(
    files: &mut Files,
    obj: &str,
    folder: &str,
    libraries: &[(String, u32)],
    warnings: &mut Vec<Warning>,
) -> Library {
    let mut all = Library::new();
    let mut seen = BTreeSet::new();
    for (written, line) in libraries {
        let place = format!("{obj}:{line}");
        // One name, blanks included, or several names.
        let candidates = match maps::find(files, folder, written) {
            Ok(found) => vec![(written.as_str(), Ok(found))],
            Err(_) => {
                written.split_whitespace().map(|word| (word, maps::find(files, folder, word))).collect()
            }
        };
        for (written, found) in candidates {
            let found = match found {
                Ok(found) => found,
                Err(why) => {
                    let what = format!("material library {written:?} {why}; its materials get defaults");
                    warnings.push(Warning::new(&place, what));
                    continue;
                }
            };
            if !seen.insert(found.name.clone()) {
                continue;
            }
            match files.read(&found.name) {
                Err(error) => warnings.push(Warning::new(&place, error.to_string())),
                Ok(bytes) => {
                    let folder = found.name.rsplit_once('/').map_or("", |(folder, _)| folder);
                    for (name, material) in mtl::parse(&found.name, &bytes, warnings) {
                        let order = all.len();
                        all.entry(name).or_insert((order, material, folder.to_owned()));
                    }
                }
            }
        }
    }
    all
}

/// The materials that faces use, in the order of the libraries, then those that no library has, by first use.
fn used_materials(
    obj: &str,
    mut library: Library,
    parts: &[Part],
    warnings: &mut Vec<Warning>,
) -> Vec<(String, MtlMaterial, String)> {
    let mut found = Vec::new();
    let mut missing = Vec::new();
    let (mut seen, mut of_library) = (BTreeSet::new(), BTreeSet::new());
    let mut colors_left_out = false;
    for part in parts {
        let name = part.material.as_deref().unwrap_or(DEFAULT_MATERIAL);
        let is_new = seen.insert(name);
        if is_new && let Some((order, material, folder)) = library.remove(name) {
            of_library.insert(name);
            found.push((order, (name.to_owned(), material, folder)));
        }
        let is_of_library = of_library.contains(name);
        colors_left_out |= is_of_library && !part.mesh.colors.is_empty();
        if is_of_library || !is_new {
            continue;
        }
        if part.material.is_some() {
            let what = format!("material {name:?} is in no library; a grey one is taken");
            warnings.push(Warning::new(format!("{obj}:{}", part.line), what));
        }
        let shares = |other: &&Part| other.material.as_deref().unwrap_or(DEFAULT_MATERIAL) == name;
        let vertex_color = parts.iter().filter(shares).any(|part| !part.mesh.colors.is_empty());
        missing.push((
            name.to_owned(),
            MtlMaterial { vertex_color, ..MtlMaterial::default() },
            String::new(),
        ));
    }
    if colors_left_out {
        warnings.push(Warning::new(obj, "vertex colours are not used where a library gives the material"));
    }
    found.sort_by_key(|(order, _)| *order);
    found.into_iter().map(|(_, material)| material).chain(missing).collect()
}

#[cfg(test)]
mod tests;
