//! glTF 2.0: `.gltf` and `.glb`.
//!
//! Of the `gltf` crate only the JSON types are used. Its validation rejects files that it could read and its accessor readers
//! panic on malformed ones, so the container, the accessors and every reference are checked here; nothing in this room indexes
//! by a number from the file without looking first.
//!
//! `container` opens the file, `buffers` and `uri` find the bytes, `meshopt` and `draco` unpack them, `accessor` reads them, `geometry`, `texture`, `material` and
//! `nodes` make the parts of the scene, and this file puts them together.

mod accessor;
mod animation;
mod buffers;
mod container;
mod deform;
mod draco;
mod error;
mod geometry;
mod image_based;
mod instancing;
mod material;
mod meshopt;
mod nodes;
mod specular_glossiness;
mod tangents;
mod texture;
mod uri;
mod variants;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{Affine3A, DAffine3};
use gltf::json::Root;
use gltf::json::mesh::Semantic;

pub use error::{GltfError, UriProblem};

use self::accessor::Accessors;
use self::animation::Pose;
use self::buffers::{Buffers, lookup};
use self::deform::Deformation;
use self::geometry::{Geometry, Part, VertexAlpha};
use self::nodes::Placed;
use self::texture::Textures;
use self::variants::Variant;
use crate::import::{DecodedImages, Files, ImportOptions};
use crate::record::Warning;
use crate::scene::source::{AlphaMode, GltfMaterial, SourceMaterial};
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Named, Scene};

/// The most instances that a scene may have.
const MAX_INSTANCES: u64 = 1 << 22;

/// The memory that meshes and instances may take together, however small the file is, in bytes; and what for each byte of the file and its buffers.
/// A few lines can show one array of vertices, or one mesh, again and again.
const FREE_MEMORY: u64 = 32 << 20;
const MEMORY_PER_BYTE: u64 = 64;

/// The scene in `bytes`, the content of the file called `name`, with what was noticed.
pub(super) fn import(
    files: &mut Files,
    name: &str,
    bytes: &[u8],
    options: &ImportOptions,
) -> Result<(Scene<SourceMaterial>, Vec<Warning>), GltfError> {
    let mut document = container::open(bytes)?;
    let mut buffers = Buffers::load(&document, files)?;
    buffers.decompress(&mut document.root)?;
    draco::decompress(&mut document.root, &mut buffers)?;
    let root = &document.root;
    let mut warnings = unread_extensions(root, name);
    let accessors = Accessors::new(root, &buffers);
    let pose = Pose::sample(root, &accessors, options, name, &mut warnings)?;
    let placed = nodes::place(root, &pose, name, &mut warnings)?;
    let variant = Variant::choose(root, options.variant.as_deref())?;

    let mut scene = Scene::empty();
    let mut textures = Textures::new(root, &buffers, files, options.images);
    let shown = match options.images {
        DecodedImages::OfMaterials => (0..root.materials.len()).collect(),
        DecodedImages::OfInstances => shown_materials(root, variant, &placed)?,
    };
    let mut materials = read_materials(root, variant, &mut textures, |index| shown.contains(&index))?;
    let surroundings = image_based::read(root, &mut textures)?;
    textures.decode_no_more();
    materials.extend(read_materials(root, variant, &mut textures, |index| !shown.contains(&index))?);
    let replaced;
    (scene.textures, scene.images, replaced) = textures.finish();
    warnings.extend(replaced);
    if let Some(surroundings) = surroundings {
        surroundings.light(&mut scene);
    }

    let geometry = Geometry::new(accessors, name);
    let mut worlds = vec![None; root.nodes.len()];
    for placed in &placed {
        worlds[placed.index] = Some(placed.world_from_node);
    }
    let size = (bytes.len() as u64).saturating_add(buffers.stored());
    let memory = FREE_MEMORY.saturating_add(MEMORY_PER_BYTE.saturating_mul(size));
    let mut stage = Stage {
        root,
        memory: Memory { limit: memory, left: memory },
        pose,
        worlds,
        file: name,
        geometry,
        variant,
        meshes: BTreeMap::new(),
        materials: materials.into_values().collect(),
        default_material: None,
        scene,
        warnings,
    };
    for placed in &placed {
        stage.place(placed, options)?;
    }
    let Stage { mut scene, materials, mut warnings, .. } = stage;
    scene.materials =
        materials.into_iter().map(|m| Named::new(m.name, SourceMaterial::Gltf(m.item))).collect();
    missing_coordinates(&scene, name, &mut warnings);
    Ok((scene, warnings))
}

/// A warning for each extension that the file uses without requiring it and that is not read. Conversion tells about materials'.
fn unread_extensions(root: &Root, file: &str) -> Vec<Warning> {
    let used: BTreeSet<&str> = root.extensions_used.iter().map(String::as_str).collect();
    let of_materials = |e: &str| e.starts_with("KHR_materials_");
    used.into_iter()
        .filter(|e| !container::EXTENSIONS.contains(e) && !of_materials(e))
        .map(|e| Warning::new(file, format!("the extension {e} is not read; what it adds is missing")))
        .collect()
}

/// The materials of meshes that visible nodes carry.
fn shown_materials(root: &Root, variant: Variant, placed: &[Placed]) -> Result<BTreeSet<usize>, GltfError> {
    let meshes = placed.iter().filter(|p| p.visible).filter_map(|p| root.meshes.get(p.node.mesh?.value()));
    let mut shown = BTreeSet::new();
    for primitive in meshes.flat_map(|mesh| &mesh.primitives) {
        shown.extend(variant.material(primitive)?);
    }
    Ok(shown)
}

/// The materials of the file that are `wanted`, by index, and named by it where they have no name.
fn read_materials(
    root: &Root,
    variant: Variant,
    textures: &mut Textures,
    wanted: impl Fn(usize) -> bool,
) -> Result<BTreeMap<usize, Named<GltfMaterial>>, GltfError> {
    let mut colored = BTreeSet::new();
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    for primitive in primitives.filter(|p| geometry::attribute(p, Semantic::Colors(0)).is_some()) {
        colored.extend(variant.material(primitive)?);
    }
    let read = |(index, json): (usize, &gltf::json::Material)| {
        let name = json.name.clone().unwrap_or_else(|| format!("material_{index}"));
        let material = material::read(json, &name, index, colored.contains(&index), textures)?;
        Ok((index, Named::new(name, material)))
    };
    root.materials.iter().enumerate().filter(|(index, _)| wanted(*index)).map(read).collect()
}

/// The meshes and materials of a mesh's primitives.
type Parts = Vec<(MeshId, MaterialId)>;

/// What meshes and instances may take, in bytes.
struct Memory {
    limit: u64,
    left: u64,
}

impl Memory {
    /// Takes `bytes` of what is left.
    fn take(&mut self, bytes: usize) -> Result<(), GltfError> {
        let left = self.left.checked_sub(bytes as u64);
        self.left = left.ok_or(GltfError::TooMany {
            what: "bytes for meshes and instances, more than any file of its size",
            limit: self.limit,
        })?;
        Ok(())
    }
}

/// The scene as it is put together.
struct Stage<'a> {
    root: &'a Root,
    memory: Memory,
    file: &'a str,
    geometry: Geometry<'a>,
    variant: Variant,
    pose: Pose,
    /// Where each node of the file stands, if the scene has it.
    worlds: Vec<Option<DAffine3>>,
    /// What became of each mesh of the file, for itself or for a node that deforms it: its primitives' meshes and materials.
    meshes: BTreeMap<(usize, Option<usize>), Parts>,
    materials: Vec<Named<GltfMaterial>>,
    default_material: Option<MaterialId>,
    scene: Scene<SourceMaterial>,
    warnings: Vec<Warning>,
}

impl Stage<'_> {
    /// Puts what `placed` carries into the scene.
    fn place(&mut self, placed: &Placed, options: &ImportOptions) -> Result<(), GltfError> {
        let element = format!("nodes[{}]", placed.index);
        if let Some(mesh) = placed.node.mesh.filter(|_| placed.visible) {
            self.place_mesh(mesh.value(), placed, &element)?;
        }
        if let Some(index) = placed.node.camera {
            let json = lookup(&self.root.cameras, index.value(), &element, "cameras")?;
            let camera = nodes::camera(json, index.value(), placed)?;
            let name = placed.node.name.clone().or_else(|| json.name.clone());
            let name = name.unwrap_or_else(|| format!("camera_{}", self.scene.cameras.len()));
            self.scene.cameras.push(Named::new(name, camera));
        }
        let extension = placed.node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(extension) = extension.filter(|_| placed.visible) {
            let lights =
                self.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()).map(|e| &e.lights);
            let index = extension.light.value();
            let json = lookup(lights.map_or(&[][..], Vec::as_slice), index, &element, "lights")?;
            let light = nodes::light(json, index, placed, options)?;
            let name = placed.node.name.clone().or_else(|| json.name.clone());
            let name = name.unwrap_or_else(|| format!("light_{}", self.scene.lights.len()));
            self.scene.lights.push(Named::new(name, light));
        }
        Ok(())
    }

    fn place_mesh(&mut self, index: usize, placed: &Placed, element: &str) -> Result<(), GltfError> {
        let (deformer, deformation) = self.deformation(index, placed, element)?;
        let world = match deformation.joints {
            // The joints alone say where a skinned mesh stands.
            Some(_) => vec![Affine3A::IDENTITY],
            None => self.instances(placed, element)?,
        };
        let parts = if world.is_empty() {
            Vec::new()
        } else {
            self.read_mesh(index, deformer, &deformation, element)?
        };
        let count = world.len().saturating_mul(parts.len());
        self.check_instances(count)?;
        self.memory.take(count.saturating_mul(size_of::<Instance>() + placed.name().len()))?;
        for world_from_object in world {
            for &(mesh, material) in &parts {
                let name = placed.name();
                self.scene.instances.push(Instance { name, mesh, material, world_from_object });
            }
        }
        Ok(())
    }

    /// Where the node's mesh stands: once, or as EXT_mesh_gpu_instancing says.
    fn instances(&mut self, placed: &Placed, element: &str) -> Result<Vec<Affine3A>, GltfError> {
        let instances = instancing::transforms(placed.node, element, self.geometry.accessors())?;
        let instances = instances.unwrap_or_else(|| vec![DAffine3::IDENTITY]);
        let count = instances.len();
        self.check_instances(count)?;
        let world: Vec<Affine3A> = instances
            .into_iter()
            .map(|node_from_object| placed.world_from_node * node_from_object)
            .filter(|m| m.matrix3.determinant() != 0.0)
            .map(|m| Affine3A::from_cols_array(&m.to_cols_array().map(|v| v as f32)))
            .collect();
        if world.len() < count {
            let message = "its transform has no inverse (a scale of 0); its mesh is left out";
            self.warnings.push(Warning::new(format!("{}: {element}", self.file), message));
        }
        Ok(world)
    }

    /// Whether there may be `more` instances.
    fn check_instances(&self, more: usize) -> Result<(), GltfError> {
        match (self.scene.instances.len() as u64).saturating_add(more as u64) {
            0..=MAX_INSTANCES => Ok(()),
            _ => Err(GltfError::TooMany { what: "instances", limit: MAX_INSTANCES }),
        }
    }

    /// How the node `placed` deforms `meshes[index]`, and the node's index if the mesh is not as other nodes show it.
    fn deformation(
        &self,
        index: usize,
        placed: &Placed,
        element: &str,
    ) -> Result<(Option<usize>, Deformation), GltfError> {
        let mesh = lookup(&self.root.meshes, index, element, "meshes")?;
        let posed = self.pose.of(placed.index).and_then(|pose| pose.weights.as_ref());
        let own = posed.or(placed.node.weights.as_ref());
        let weights = own.or(mesh.weights.as_ref()).cloned().unwrap_or_default();
        let joints = match placed.node.skin {
            Some(skin) => {
                let accessors = self.geometry.accessors();
                Some(deform::joints(self.root, skin.value(), element, &self.worlds, accessors)?)
            }
            None => None,
        };
        let deformer = (own.is_some() || joints.is_some()).then_some(placed.index);
        Ok((deformer, Deformation { weights, joints }))
    }

    /// The meshes and materials of `meshes[index]` as `deformation` moves it, read when it is first asked for.
    fn read_mesh(
        &mut self,
        index: usize,
        deformer: Option<usize>,
        deformation: &Deformation,
        element: &str,
    ) -> Result<Parts, GltfError> {
        let json = lookup(&self.root.meshes, index, element, "meshes")?;
        if let Some(parts) = self.meshes.get(&(index, deformer)) {
            return Ok(parts.clone());
        }
        let mesh_name = json.name.clone().unwrap_or_else(|| format!("mesh_{index}"));
        let mut parts = Vec::new();
        for (i, primitive) in json.primitives.iter().enumerate() {
            let element = format!("meshes[{index}].primitives[{i}]");
            let name =
                if json.primitives.len() == 1 { mesh_name.clone() } else { format!("{mesh_name}/{i}") };
            let colored = geometry::attribute(primitive, Semantic::Colors(0)).is_some();
            let material = self.material_of(self.variant.material(primitive)?, colored, &element)?;
            let source = &self.materials[material.0 as usize].item;
            let tangents = source.tangent_set();
            let alpha = match source.alpha_mode {
                AlphaMode::Opaque => VertexAlpha::Ignore,
                AlphaMode::Mask { .. } | AlphaMode::Blend => VertexAlpha::Keep,
            };
            let part = Part { primitive, element: &element, name, alpha, tangents, deformation };
            let mesh = self.geometry.read(part, &mut self.warnings)?;
            if let Some(mesh) = mesh {
                self.memory.take(mesh.bytes())?;
                let id = MeshId(self.scene.meshes.len() as u32);
                self.scene.meshes.push(mesh);
                parts.push((id, material));
            }
        }
        self.meshes.insert((index, deformer), parts.clone());
        Ok(parts)
    }

    /// The material that a primitive names, or the specification's default one.
    fn material_of(
        &mut self,
        index: Option<usize>,
        colored: bool,
        element: &str,
    ) -> Result<MaterialId, GltfError> {
        if let Some(index) = index {
            lookup(&self.root.materials, index, element, "materials")?;
            return Ok(MaterialId(index as u32));
        }
        let next = MaterialId(self.materials.len() as u32);
        let id = *self.default_material.get_or_insert(next);
        if id == next {
            self.materials.push(Named::new("default", GltfMaterial::default()));
        }
        self.materials[id.0 as usize].item.vertex_color |= colored;
        Ok(id)
    }
}

/// A warning for each material and mesh where a texture asks for coordinates that the mesh doesn't have.
fn missing_coordinates(scene: &Scene<SourceMaterial>, file: &str, warnings: &mut Vec<Warning>) {
    let mut told = BTreeSet::new();
    for instance in &scene.instances {
        let material = &scene.materials[instance.material.0 as usize];
        let mesh: &Arc<Mesh> = &scene.meshes[instance.mesh.0 as usize];
        let SourceMaterial::Gltf(source) = &material.item else { continue };
        if !told.insert((instance.mesh, instance.material)) {
            continue;
        }
        let lacking = source.textures().find(|(_, map)| map.uv_set as usize >= mesh.uvs.len());
        if let Some((field, map)) = lacking {
            let message =
                format!("its {field} uses TEXCOORD_{}, which mesh {:?} doesn't have", map.uv_set, mesh.name);
            warnings.push(Warning::new(format!("{file}: material {:?}", material.name), message));
        }
    }
}
