//! A composed configuration into a scene: geometry, BRDFs, emitters, camera, environment.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};

use super::ArisError;
use super::yaml::{Node, Table, nearest};
use crate::color::Rgb;
use crate::disney::Parameter;
use crate::import::{Files, Images, obj};
use crate::record::Warning;
use crate::scene::camera::{Aperture, FovAxis, Lens, Projection};
use crate::scene::environment::{EnvironmentMap, Equirectangular};
use crate::scene::source::{ArisBrdf, ArisDisney, ArisMaterial, SourceMaterial};
use crate::scene::texture::Pixels;
use crate::scene::{Camera, Environment, ImageId, Instance, MaterialId, Mesh, MeshId, Named, Scene};

/// What transformed copies of meshes may take however small the files are, and for each byte of those.
const FREE_COPIES: u64 = 32 << 20;
const COPIED_PER_BYTE: u64 = 64;

/// The largest picture's side.
const MAX_SIDE: u32 = 65_536;

/// The keys that no scene goes without.
pub(super) const NEEDED: [&str; 3] = ["geometry", "brdf", "camera"];

/// The scene that `config` describes.
pub(super) fn build(
    files: &mut Files,
    config: &Node,
    warnings: &mut Vec<Warning>,
) -> Result<Scene<SourceMaterial>, ArisError> {
    let mut table = Table::new(config, "the scene")?;
    let geometry = table.require("geometry")?;
    let brdf = table.require("brdf")?;
    let emitters = table.get("emitters");
    let environment = table.get("environment");
    let camera = table.require("camera")?;
    let (width, height) = (table.get("width"), table.get("height"));
    table.finish()?;

    let mut scene = Scene::empty();
    let paths = read_geometry(files, geometry, &mut scene, warnings)?;
    let mut materials = read_brdfs(brdf, &paths, warnings)?;
    if let Some(emitters) = emitters {
        read_emitters(emitters, &mut materials)?;
    }
    for (i, (name, material)) in material_names(&paths).into_iter().zip(materials).enumerate() {
        scene.instances[i].material = MaterialId(i as u32);
        scene.materials.push(Named::new(name, SourceMaterial::Aris(material)));
    }
    let alone = |key| {
        let (place, within) = (config.place.to_string(), "the scene".to_owned());
        Err(ArisError::Missing { place, within, key })
    };
    let size = match (width, height) {
        (Some(w), Some(h)) => Some((w.whole("width", 1, MAX_SIDE)?, h.whole("height", 1, MAX_SIDE)?)),
        (None, None) => None,
        (Some(_), None) => return alone("height"),
        (None, Some(_)) => return alone("width"),
    };
    scene.cameras.push(Named::new("camera", read_camera(camera, size)?));
    if let Some(environment) = environment {
        read_environment(files, environment, &mut scene, warnings)?;
    }
    Ok(scene)
}

/// The `name` and `config` of an entry.
pub(super) fn entry<'a>(node: &'a Node, what: &str) -> Result<(&'a str, Table<'a>), ArisError> {
    let mut table = Table::new(node, what)?;
    let name = table.require("name")?.text("name")?;
    // A missing `config` is an empty one.
    let config = table.get("config");
    table.finish()?;
    let within = format!("{what} {name:?}");
    let config = match config {
        Some(config) => Table::new(config, within)?,
        None => Table::empty(&node.place, within),
    };
    Ok((name, config))
}

pub(super) fn unknown_name(node: &Node, what: &str, name: &str, known: &[&str]) -> ArisError {
    ArisError::Unsupported {
        place: node.place.to_string(),
        what: format!("{what} {name:?}"),
        hint: nearest(name, known),
    }
}

/// Meshes and instances; returns the mesh files.
fn read_geometry(
    files: &mut Files,
    node: &Node,
    scene: &mut Scene<SourceMaterial>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<String>, ArisError> {
    let (name, mut config) = entry(node, "geometry")?;
    if name != "mesh" {
        return Err(unknown_name(node, "geometry", name, &["mesh"]));
    }
    let paths = config.require("paths")?;
    let transforms = config.get("transforms");
    config.finish()?;
    let items = paths.list("geometry.config.paths")?;
    if items.is_empty() {
        return Err(paths.mismatch("geometry.config.paths", "a list of at least one mesh"));
    }
    let transforms = match transforms {
        None => Vec::new(),
        Some(node) => {
            let list = node.list("geometry.config.transforms")?;
            if list.len() != items.len() {
                return Err(ArisError::Count {
                    place: node.place.to_string(),
                    what: "geometry.config.transforms",
                    found: format!("{} entries", list.len()),
                    meshes: items.len(),
                    hint: "there must be one list of transforms (which may be empty) a mesh",
                });
            }
            list.iter().map(read_transform).collect::<Result<_, _>>()?
        }
    };
    let mut names = Vec::new();
    let (mut read, mut copied) = (0u64, 0u64);
    // Files that are named several times are read once, and shared where they are not transformed.
    let mut loaded: BTreeMap<String, (Arc<Mesh>, Option<MeshId>)> = BTreeMap::new();
    for (i, item) in items.iter().enumerate() {
        let key = format!("geometry.config.paths[{i}]");
        let path = item.text(&key)?;
        if !loaded.contains_key(path) {
            let place = item.place.to_string();
            let bytes = files.read(path).map_err(|cause| ArisError::File {
                place: place.clone(),
                key: key.clone(),
                cause,
                hint: String::new(),
            })?;
            read = read.saturating_add(bytes.len() as u64);
            let mesh = obj::read_mesh(path, &bytes, warnings).map_err(|cause| ArisError::Mesh {
                place,
                key: key.clone(),
                cause: Box::new(cause),
            })?;
            loaded.insert(path.to_owned(), (Arc::new(mesh), None));
        }
        let next = MeshId(scene.meshes.len() as u32);
        let Some((mesh, shared)) = loaded.get_mut(path) else { continue };
        let id = match transforms.get(i).filter(|steps| !steps.is_empty()) {
            Some(steps) => {
                copied = copied.saturating_add(mesh.bytes() as u64);
                let limit = FREE_COPIES.saturating_add(COPIED_PER_BYTE.saturating_mul(read));
                if copied > limit {
                    return Err(ArisError::Unsupported {
                        place: item.place.to_string(),
                        what: format!(
                            "a transformed copy of a mesh, as all would take more than {limit} bytes,"
                        ),
                        hint: "use fewer copies, or put them into the file itself".to_owned(),
                    });
                }
                scene.meshes.push(Arc::new(transformed(mesh, steps, item, &key)?));
                next
            }
            None => *shared.get_or_insert_with(|| {
                scene.meshes.push(mesh.clone());
                next
            }),
        };
        scene.instances.push(Instance {
            name: path.to_owned(),
            mesh: id,
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        });
        names.push(path.to_owned());
    }
    Ok(names)
}

/// One step of a mesh's transform.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Scale(Vec3),
    Translate(Vec3),
}

fn read_transform(node: &Node) -> Result<Vec<Step>, ArisError> {
    let step = |node: &Node| {
        let mut table = Table::new(node, "a transform")?;
        let kind = table.require("type")?;
        let params = table.require("params")?;
        table.finish()?;
        match kind.text("type")? {
            "scale" => Ok(Step::Scale(params.numbers("scale")?.into())),
            "translate" => Ok(Step::Translate(params.numbers("translate")?.into())),
            other => Err(unknown_name(kind, "the transform", other, &["scale", "translate"])),
        }
    };
    node.list("geometry.config.transforms")?.iter().map(step).collect()
}

/// The mesh with its positions moved; normals stay as they are, as in Aris.
fn transformed(mesh: &Mesh, steps: &[Step], node: &Node, key: &str) -> Result<Mesh, ArisError> {
    let mut mesh = mesh.clone();
    for position in &mut mesh.positions {
        for step in steps {
            match *step {
                Step::Scale(s) => *position *= s,
                Step::Translate(t) => *position += t,
            }
        }
        if !position.is_finite() {
            return Err(node.out_of_range(
                key,
                f64::from(position.max_element()),
                "finite after its transform",
            ));
        }
    }
    Ok(mesh)
}

/// Names for the materials of meshes: the file's stem, with the index where several meshes share it.
fn material_names(paths: &[String]) -> Vec<String> {
    let stem = |path: &String| {
        let file = path.rsplit('/').next().unwrap_or(path);
        file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned()
    };
    let mut uses: BTreeMap<String, usize> = BTreeMap::new();
    for path in paths {
        *uses.entry(stem(path)).or_default() += 1;
    }
    let mut taken = BTreeSet::new();
    let mut names = Vec::new();
    for (i, path) in paths.iter().enumerate() {
        let stem = stem(path);
        let alone = uses[&stem] == 1;
        let mut name = if alone { stem } else { format!("{stem}_{i}") };
        while (!alone && uses.contains_key(&name)) || taken.contains(&name) {
            name.push('_');
        }
        taken.insert(name.clone());
        names.push(name);
    }
    names
}

fn read_brdfs(
    node: &Node,
    paths: &[String],
    warnings: &mut Vec<Warning>,
) -> Result<Vec<ArisMaterial>, ArisError> {
    let entries = node.list("brdf")?;
    if entries.len() != paths.len() {
        return Err(ArisError::Count {
            place: node.place.to_string(),
            what: "brdf",
            found: format!("{} entries", entries.len()),
            meshes: paths.len(),
            hint: "there must be one BRDF a mesh, in the meshes' order",
        });
    }
    let material =
        |(i, node): (usize, &Node)| Ok(ArisMaterial { brdf: read_brdf(i, node, warnings)?, radiance: None });
    entries.iter().enumerate().map(material).collect()
}

fn read_brdf(index: usize, node: &Node, warnings: &mut Vec<Warning>) -> Result<ArisBrdf, ArisError> {
    let label = format!("brdf[{index}]");
    let (name, mut config) = entry(node, &label)?;
    let brdf = match name {
        "diffuse" => ArisBrdf::Diffuse { color: reflectance(&mut config, &label)? },
        "mirror" => ArisBrdf::Mirror,
        "dielectric" => {
            let ext_ior = positive(&mut config, &label, "ext_ior")?;
            let int_ior = positive(&mut config, &label, "int_ior")?;
            let (ratio, least, most) = (int_ior / ext_ior, Parameter::Ior.min(), Parameter::Ior.max());
            if !(least..=most).contains(&ratio) {
                let key = format!("{label}.int_ior over {label}.ext_ior");
                return Err(node.out_of_range(&key, f64::from(ratio), format!("in [{least}, {most}]")));
            }
            ArisBrdf::Dielectric { ext_ior, int_ior }
        }
        "microfacet" => {
            let node = config.require("roughness")?;
            let roughness = in_range(node, &format!("{label}.roughness"), 0.0, 1.0)?;
            if roughness == 0.0 {
                return Err(node.out_of_range(&format!("{label}.roughness"), 0.0, "above 0"));
            }
            ArisBrdf::Microfacet {
                color: reflectance(&mut config, &label)?,
                roughness,
                ext_ior: positive(&mut config, &label, "ext_ior")?,
                int_ior: positive(&mut config, &label, "int_ior")?,
            }
        }
        "disney" => ArisBrdf::Disney(read_disney(&mut config, &label, node, warnings)?),
        "learned_diffuse" | "nerad" => {
            return Err(ArisError::Unsupported {
                place: node.place.to_string(),
                what: format!("{label} {name:?}"),
                hint: "its values are learned while Aris trains; give it a BRDF with values of its own"
                    .to_owned(),
            });
        }
        other => {
            let known = ["diffuse", "mirror", "dielectric", "microfacet", "disney"];
            return Err(unknown_name(node, &label, other, &known));
        }
    };
    config.finish()?;
    Ok(brdf)
}

fn read_disney(
    config: &mut Table<'_>,
    label: &str,
    entry: &Node,
    warnings: &mut Vec<Warning>,
) -> Result<ArisDisney, ArisError> {
    let color = reflectance(config, label)?;
    let mut scalars = [None; 10];
    for parameter in Parameter::BURLEY_2012 {
        let key = ArisDisney::key(parameter);
        let Some(node) = config.get(key) else {
            let what = format!("{label}.{key} is not given; {} is taken", parameter.default());
            warnings.push(Warning::new(entry.place.to_string(), what));
            continue;
        };
        // Clearcoats above 1 exist only where a conversion makes them.
        let max = if parameter == Parameter::Clearcoat { 1.0 } else { parameter.max() };
        scalars[parameter as usize] = Some(in_range(node, &format!("{label}.{key}"), 0.0, max)?);
    }
    Ok(ArisDisney { color, scalars })
}

pub(super) fn in_range(node: &Node, key: &str, low: f32, high: f32) -> Result<f32, ArisError> {
    let value = node.number(key)?;
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(node.out_of_range(key, f64::from(value), format!("in [{low}, {high}]")))
    }
}

fn positive(config: &mut Table<'_>, label: &str, key: &'static str) -> Result<f32, ArisError> {
    let node = config.require(key)?;
    let key = format!("{label}.{key}");
    let value = node.number(&key)?;
    if value > 0.0 { Ok(value) } else { Err(node.out_of_range(&key, f64::from(value), "above 0")) }
}

/// A colour in [0, 1].
fn reflectance(config: &mut Table<'_>, label: &str) -> Result<Rgb, ArisError> {
    let node = config.require("color")?;
    let key = format!("{label}.color");
    let color: [f32; 3] = node.numbers(&key)?;
    match color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        None => Ok(color.into()),
        Some(&value) => Err(node.out_of_range(&key, f64::from(value), "in [0, 1]")),
    }
}

/// A colour of at least 0.
pub(super) fn radiance(node: &Node, key: &str) -> Result<Rgb, ArisError> {
    let color: [f32; 3] = node.numbers(key)?;
    match color.iter().find(|c| **c < 0.0) {
        None => Ok(color.into()),
        Some(&value) => Err(node.out_of_range(key, f64::from(value), "at least 0")),
    }
}

fn read_emitters(node: &Node, materials: &mut [ArisMaterial]) -> Result<(), ArisError> {
    for (i, node) in node.list("emitters")?.iter().enumerate() {
        let label = format!("emitters[{i}]");
        let (name, mut config) = entry(node, &label)?;
        if name != "area" {
            return Err(unknown_name(node, &label, name, &["area"]));
        }
        let light = radiance(config.require("radiance")?, &format!("{label}.radiance"))?;
        let target = config.require("i_primitive")?;
        let reason = "Aris fills it in while it runs; leave it empty";
        config.refuse("geometry", reason)?;
        config.refuse("i_emitter", reason)?;
        config.finish()?;
        let index = target.whole(&format!("{label}.i_primitive"), 0, u32::MAX)?;
        let meshes = materials.len();
        let count = |hint| ArisError::Count {
            place: target.place.to_string(),
            what: "i_primitive",
            found: format!("mesh {index}"),
            meshes,
            hint,
        };
        let material =
            materials.get_mut(index as usize).ok_or_else(|| count("it is the index of a mesh, from 0"))?;
        if material.radiance.replace(light).is_some() {
            return Err(count("another emitter names this mesh already"));
        }
    }
    Ok(())
}

fn read_camera(node: &Node, size: Option<(u32, u32)>) -> Result<Camera, ArisError> {
    let (name, mut config) = entry(node, "camera")?;
    let thin = match name {
        "perspective" => false,
        "thin" => true,
        other => return Err(unknown_name(node, "the camera", other, &["perspective", "thin"])),
    };
    let fov_node = config.require("fov")?;
    let fov = fov_node.number("camera.fov")?;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(fov_node.out_of_range("camera.fov", f64::from(fov), "between 0 and 180 degrees"));
    }
    let world_from_camera = read_c2w(config.require("c2w")?)?;
    let lens = if thin {
        let aperture = in_range(config.require("aperture")?, "camera.aperture", 0.0, f32::MAX)?;
        let focal_distance = positive(&mut config, "camera", "focal_distance")?;
        (aperture > 0.0).then_some(Lens { radius: aperture, focal_distance, shape: Aperture::Square })
    } else {
        None
    };
    config.finish()?;
    Ok(Camera {
        world_from_camera,
        projection: Projection::Perspective { fov: fov.to_radians(), axis: FovAxis::X },
        lens,
        // Aris' pixel lies around its integer coordinate.
        pixel_offset: Vec2::splat(-0.5),
        size,
        aspect: None,
    })
}

/// The 3 × 4 matrix, row by row: x right, y up, looking along -z. It may mirror.
fn read_c2w(node: &Node) -> Result<Affine3A, ArisError> {
    let wrong = || node.mismatch("camera.c2w", "three rows of four numbers");
    let rows = node.list("camera.c2w").map_err(|_| wrong())?;
    let [x, y, z] = rows else { return Err(wrong()) };
    let rows: [[f32; 4]; 3] =
        [x.numbers("camera.c2w[0]")?, y.numbers("camera.c2w[1]")?, z.numbers("camera.c2w[2]")?];
    let column = |i: usize| Vec3A::new(rows[0][i], rows[1][i], rows[2][i]);
    let matrix3 = Mat3A::from_cols(column(0), column(1), column(2));
    let determinant = matrix3.determinant();
    // A vanishing or overflowing determinant leaves no direction to look along.
    if !determinant.is_normal() {
        return Err(node.out_of_range(
            "determinant of camera.c2w",
            f64::from(determinant),
            "a finite number other than 0",
        ));
    }
    Ok(Affine3A { matrix3, translation: column(3) })
}

fn read_environment(
    files: &mut Files,
    node: &Node,
    scene: &mut Scene<SourceMaterial>,
    warnings: &mut Vec<Warning>,
) -> Result<(), ArisError> {
    let (name, mut config) = entry(node, "environment")?;
    match name {
        "none" => {}
        "constant" => {
            let color = radiance(config.require("color")?, "environment.color")?;
            scene.environment = Some(Environment::constant(color));
        }
        "envmap" => {
            let path = config.require("path")?;
            let key = "environment.config.path";
            let (place, name) = (path.place.to_string(), path.text(key)?);
            let bytes = files.read(name).map_err(|cause| ArisError::File {
                place: place.clone(),
                key: key.to_owned(),
                cause,
                hint: String::new(),
            })?;
            let (image, replaced) = Images::default().decode(&bytes, name).map_err(|cause| {
                ArisError::Image { place: place.clone(), key: key.to_owned(), cause: Box::new(cause) }
            })?;
            if !matches!(image.pixels, Pixels::F32(_)) {
                return Err(path.mismatch(key, "an image of floats, EXR or HDR"));
            }
            warnings.extend(replaced.map(|w| Warning::new(place, format!("{name}: {}", w.message))));
            let id = ImageId(scene.images.len() as u32);
            scene.images.push(Arc::new(image));
            scene.environment = Some(Environment {
                map: EnvironmentMap::Image { image: id, mapping: Equirectangular::Aris },
                ..Environment::constant(Rgb::WHITE)
            });
        }
        other => return Err(unknown_name(node, "the environment", other, &["none", "constant", "envmap"])),
    }
    config.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn material_names_are_stems_and_unique() {
        let paths = ["m/sphere.obj", "n/sphere.obj", "m/sphere_0.obj", "floor.obj", "sphere.obj", ".obj", ""];
        let names = material_names(&paths.map(str::to_owned));
        assert_eq!(names, ["sphere_0_", "sphere_1", "sphere_0", "floor", "sphere_4", "_5", "_6"]);
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    }
}
