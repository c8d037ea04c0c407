//! Scenes of Mitsuba 3: `scene.xml`, with meshes as PLY and textures beside it.

mod camera;
mod element;
mod light;
mod material;
mod mesh;
mod texture;
mod told;

use std::collections::BTreeMap;

use element::Element;
use material::Bsdfs;
use mesh::Placed;
use texture::Textures;

use super::ExportError;
use super::names::{Identifiers, file_stem};
use crate::convert::{Note, Quality};
use crate::render::image_size;
use crate::scene::environment::EnvironmentMap;
use crate::scene::material::{Material, Sides};
use crate::scene::{Instance, Named, Scene, framing, studio};
use crate::settings::RenderSettings;

/// The file that is rendered.
pub(super) const MAIN: &str = "scene.xml";

/// The files of a scene, with their paths beside [`MAIN`], which is the last, and what it can't say.
#[derive(Debug)]
pub(super) struct Description {
    pub(super) files: Vec<(String, Vec<u8>)>,
    /// How many of them are images.
    pub(super) textures: usize,
    pub(super) notes: Vec<Note>,
}

/// `scene` as Mitsuba describes it. One without camera or light gets what `pipeline render` gives it.
///
/// # Errors
/// If the camera has no counterpart or an image can't be encoded.
pub(super) fn description(mut scene: Scene<Material>) -> Result<Description, ExportError> {
    let mut told = complete(&mut scene);
    let mut notes: Vec<Note> = scene.materials.iter().flat_map(|m| told::notes(&scene, m)).collect();
    let (sensor, of_camera) = sensor(&scene)?;
    told.extend(of_camera);
    let (emitters, of_lights) = emitters(&scene);
    told.extend(of_lights);
    notes.extend(told.into_iter().map(of_scene));

    let mut textures = Textures::new(&scene);
    let mut bsdfs = Bsdfs { scene: &scene, textures: &mut textures };
    let mut names = Identifiers::default();
    let ids: Vec<String> = scene.materials.iter().map(|m| names.of(&m.name)).collect();
    let materials: Vec<Element> =
        scene.materials.iter().zip(&ids).map(|(m, id)| bsdfs.of(&m.item).attribute("id", id)).collect();
    let mut files = Vec::new();
    let shapes = shapes(&mut bsdfs, &ids, &mut files);
    for file in textures.files() {
        files.push(file?);
    }
    let mut count = textures.count();
    if let Some(image) = environment_image(&scene)? {
        files.push((light::ENVIRONMENT.into(), image));
        count += 1;
    }
    let root = Element::scene().with_all(sensor).with(integrator(&scene));
    let root = root.with_all(materials).with_all(shapes).with_all(emitters);
    files.push((MAIN.into(), root.document().map_err(ExportError::Xml)?.into_bytes()));
    Ok(Description { files, textures: count, notes })
}

/// What is told of something beside the materials: the field, how well it is kept, and why.
type Told = (&'static str, Quality, &'static str);

fn of_scene((field, quality, reason): Told) -> Note {
    Note { material: String::new(), field: field.into(), quality, reason: reason.into() }
}

/// Adds a camera and light where there are none.
fn complete(scene: &mut Scene<Material>) -> Vec<Told> {
    let mut told = Vec::new();
    if scene.cameras.is_empty() {
        let camera = framing::frame(scene);
        scene.cameras.push(Named::new("default", camera));
        told.push((
            "camera",
            Quality::Approximated,
            "the scene has none: all of it is framed, as in our renders",
        ));
    }
    if !studio::is_lit(scene) {
        studio::add_studio_lighting(scene);
        told.push(("environment", Quality::Approximated, "the scene has no light: our studio is added"));
    }
    told
}

/// Depth counts scattering in our settings, and vertices here. Roulette begins at the same vertex. The integrator for media also lets
/// shadow rays pass what is partly there, as ours do.
fn integrator(scene: &Scene<Material>) -> Element {
    let needs = |material: &Material| !told::is_opaque(material) || material::absorption(material).is_some();
    let kind = if scene.materials.iter().any(|m| needs(&m.item)) { "volpath" } else { "path" };
    Element::plugin("integrator", kind)
        .integer("max_depth", RenderSettings::default().max_depth.saturating_add(1))
        .integer("rr_depth", 5)
}

/// The first camera, and what its numbers of pixels and samples are by default.
fn sensor(scene: &Scene<Material>) -> Result<(Vec<Element>, Vec<Told>), ExportError> {
    let settings = RenderSettings::default();
    let (Some(camera), Ok((width, height))) = (scene.cameras.first(), image_size(scene, &settings)) else {
        return Err(ExportError::Camera { why: "there is none" });
    };
    let (sensor, told) = camera::sensor(scene, &camera.item, [width, height])?;
    let defaults = [("resx", width), ("resy", height), ("spp", settings.spp)];
    Ok((
        defaults.map(|(name, value)| Element::default_of(name, value)).into_iter().chain([sensor]).collect(),
        told,
    ))
}

/// The shapes, whose materials are called by their `ids`; meshes join the `files`.
fn shapes(bsdfs: &mut Bsdfs<'_, '_>, ids: &[String], files: &mut Vec<(String, Vec<u8>)>) -> Vec<Element> {
    let scene = bsdfs.scene;
    let mut names = Identifiers::default();
    let mut shapes = Vec::new();
    for instances in alike(scene) {
        let first = instances[0];
        let (mesh, material) = (scene.mesh_of(first), &scene.materials[first.material.0 as usize].item);
        let places = instances.iter().map(|instance| instance.world_from_object);
        let placed = Placed::new(mesh, material::attributes(material), places);
        let medium = material::absorption(material).map(|a| material::medium(a).named("interior"));
        let emitter = bsdfs.emitter(material);
        let mut add = |name: &str, bytes: Vec<u8>, bsdf: Element| {
            let file = format!("meshes/{}.ply", names.of(&file_stem(name)));
            let shape = Element::plugin("shape", "ply")
                .string("filename", &file)
                .boolean("face_normals", mesh.normals.is_empty())
                .with(bsdf)
                .with_all(medium.clone())
                .with_all(emitter.clone());
            files.push((file, bytes));
            shapes.push(shape);
        };
        let bsdf = Element::reference(&ids[first.material.0 as usize]);
        add(&first.name, placed.front(), bsdf.clone());
        let shines_behind = emitter.is_some() && material.emission.sides == Sides::Both;
        if shines_behind && told::can_shine_behind(material) {
            // What is partly there must not be there twice.
            let bsdf = if told::is_opaque(material) { bsdf } else { Element::plugin("bsdf", "null") };
            add(&format!("{}_back", first.name), placed.back(), bsdf);
        }
    }
    shapes
}

/// The instances that have triangles, those of the same mesh and material together.
fn alike(scene: &Scene<Material>) -> Vec<Vec<&Instance>> {
    let mut group_of = BTreeMap::new();
    let mut groups: Vec<Vec<&Instance>> = Vec::new();
    for instance in scene.instances.iter().filter(|i| !scene.mesh_of(i).triangles.is_empty()) {
        let group = *group_of.entry((instance.mesh, instance.material)).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(instance);
    }
    groups
}

/// The lights without a surface, and the environment.
fn emitters(scene: &Scene<Material>) -> (Vec<Element>, Vec<Told>) {
    let (mut emitters, mut told) = (Vec::new(), Vec::new());
    for light in &scene.lights {
        let (emitter, of_light) = light::emitter(&light.item);
        emitters.push(emitter);
        told.extend(of_light);
    }
    if let Some(environment) = &scene.environment {
        let (emitter, of_environment) = light::environment(environment, scene);
        emitters.push(emitter);
        told.extend(of_environment);
    }
    (emitters, told)
}

fn environment_image(scene: &Scene<Material>) -> Result<Option<Vec<u8>>, ExportError> {
    let Some(environment) = &scene.environment else { return Ok(None) };
    let EnvironmentMap::Image { image, mapping } = environment.map else { return Ok(None) };
    let image = &scene.images[image.0 as usize];
    Ok(Some(light::environment_image(environment, mapping, image)?))
}
