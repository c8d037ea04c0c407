//! Typed paths into a scene and its render settings: `material.ball.roughness`, `camera.orbit`, `render.spp`.
//!
//! [`check_value`] tells whether a value suits a path in any scene, [`apply_all`] sets values in one.
//!
//! | path | field |
//! |---|---|
//! | `material.NAME.FIELD` | [`MaterialField`]; `*` in NAME stands for any text, quotes around NAME take it literally |
//! | `light.NAME.FIELD` | [`LightField`] |
//! | `camera.FIELD` | [`CameraField`], of the camera that renders |
//! | `environment.FIELD` | [`EnvironmentField`]; a white one is made where the scene has none |
//! | `render.FIELD` | [`RenderField`] |
//! | `import.FIELD`, `convert.FIELD` | [`ImportField`], [`ConvertField`]: [`choose`] makes these choices before the scene is read |
//! | `scene` | the file: for the manifest, not for a loaded scene |

mod camera;
mod environment;
mod error;
mod field;
mod light;
mod loading;
mod material;
mod render;
mod target;
#[cfg(test)]
mod tests;
mod value;

use std::path::Path;
use std::sync::Arc;

pub use error::{BoxedError, EditError, Half};
pub use field::{
    CameraField, ConvertField, EnvironmentField, ImportField, LightField, MaterialField, RenderField,
};
pub use loading::choose;
pub use target::{NamePattern, Target};

use self::camera::CameraEdits;
use self::target::{ROOTS, shortened};
use self::value::{Mismatch, Outcome};
use crate::color::Rgb;
use crate::manifest::nearest::nearest;
use crate::record::{Override, Value};
use crate::scene::light::LightKind;
use crate::scene::{Image, Light, Material, Named, Scene};
use crate::settings::{ConvertOptions, ImportOptions, RenderSettings};

/// The largest whole number that a value holds exactly: 2^53.
pub const MAX_WHOLE: u64 = render::MAX_WHOLE;

/// Reads the image file that an override names. Floats that are not negative are used as they are.
pub type ImageLoader<'a> = dyn FnMut(&Path) -> Result<Arc<Image>, BoxedError> + 'a;

impl Target {
    /// What the path takes, with range and unit.
    pub const fn expects(&self) -> &'static str {
        match self {
            Self::Material(_, field) => field.expects(),
            Self::Camera(field) => field.expects(),
            Self::Light(_, field) => field.expects(),
            Self::Environment(field) => field.expects(),
            Self::Render(field) => field.expects(),
            Self::Import(field) => field.expects(),
            Self::Convert(field) => field.expects(),
            Self::Scene => "the file of a scene",
        }
    }
}

/// Whether `path` takes `value`, whatever the scene: by setting it in a scene of one material and one light of each kind.
///
/// # Errors
/// [`EditError::Value`] if the value is of another type or out of range; those of [`Target::parse`].
pub fn check_value(path: &str, value: &Value) -> Result<Target, EditError> {
    let target = Target::parse(path)?;
    let checked = match &target {
        Target::Material(_, field) => material::set(&mut Material::default(), *field, value).map(drop),
        Target::Light(_, field) => {
            let kind = LightKind::Point { position: glam::Vec3::ZERO, range: None };
            light::set(&mut Light { kind, color: Rgb::WHITE, intensity: 1.0 }, *field, value).map(drop)
        }
        Target::Camera(field) => CameraEdits::default().add(*field, value),
        Target::Environment(field) => environment::set(&mut None, *field, value),
        Target::Render(field) => render::set(&mut RenderSettings::default(), *field, value),
        Target::Import(field) => loading::set_import(&mut ImportOptions::default(), *field, value),
        Target::Convert(field) => loading::set_convert(&mut ConvertOptions::default(), *field, value),
        Target::Scene => value::text(value).map(drop),
    };
    checked.map_err(|Mismatch| mismatch(path, value, target.expects()))?;
    Ok(target)
}

/// Sets `path` to `value`, as [`apply_all`] of this one.
///
/// # Errors
/// As [`apply_all`].
pub fn apply(
    scene: &mut Scene<Material>,
    settings: &mut RenderSettings,
    path: &str,
    value: &Value,
    load_image: &mut ImageLoader<'_>,
) -> Result<(), EditError> {
    apply_all(scene, settings, &[Override { path: path.to_owned(), value: value.clone() }], load_image)
}

/// Sets a path of the render's settings, `render.FIELD`, for which no scene is needed.
///
/// # Errors
/// If it is not such a path, or does not take the value.
pub fn set_render(settings: &mut RenderSettings, path: &str, value: &Value) -> Result<(), EditError> {
    let target = Target::parse(path)?;
    let Target::Render(field) = target else {
        return Err(EditError::Incomplete { path: path.to_owned(), form: "render.FIELD" });
    };
    render::set(settings, field, value).map_err(|Mismatch| mismatch(path, value, target.expects()))
}

/// Sets all paths in order: the later of two values for one path stays.
///
/// Fields of the camera are gathered and applied together at the end, to the camera that the settings then name: position,
/// target and up make one pose in any order. A spot's two angles, too, are judged when all is set. `camera.name` is the same
/// as `render.camera`. Image files are named as the override says; `load_image` decides what that is relative to.
///
/// # Errors
/// If the scene lacks what a path names, if a value does not suit it, or if fields contradict each other. Scene and settings
/// may be half changed then.
pub fn apply_all(
    scene: &mut Scene<Material>,
    settings: &mut RenderSettings,
    overrides: &[Override],
    load_image: &mut ImageLoader<'_>,
) -> Result<(), EditError> {
    let mut camera = CameraEdits::default();
    let mut edits_camera = false;
    let mut cones: Option<&str> = None;
    for Override { path, value } in overrides {
        let target = Target::parse(path)?;
        let wrong = |Mismatch| mismatch(path, value, target.expects());
        match &target {
            Target::Material(name, field) => {
                set_named(path, "material", &mut scene.materials, name, |m| {
                    material::set(m, *field, value).map_err(wrong)
                })?;
            }
            Target::Light(name, field) => {
                set_named(path, "light", &mut scene.lights, name, |l| {
                    light::set(l, *field, value).map_err(wrong)
                })?;
                if matches!(field, LightField::Inner | LightField::Outer) {
                    cones = Some(path);
                }
            }
            Target::Environment(EnvironmentField::Image) => {
                let file = value::text(value).map_err(wrong)?;
                environment::set_image(scene, Path::new(file), load_image)?;
            }
            Target::Environment(field) => {
                environment::set(&mut scene.environment, *field, value).map_err(wrong)?;
            }
            Target::Camera(field) => {
                camera.add(*field, value).map_err(wrong)?;
                if *field == CameraField::Name {
                    render::set(settings, RenderField::Camera, value).map_err(wrong)?;
                } else {
                    edits_camera = true;
                }
            }
            Target::Render(field) => render::set(settings, *field, value).map_err(wrong)?,
            // Made when the scene was read.
            Target::Import(_) | Target::Convert(_) => {}
            Target::Scene => return Err(EditError::SceneItself),
        }
    }
    if let Some(path) = cones
        && !scene.lights.iter().all(|l| light::cone_is_sound(&l.item))
    {
        let why = "a spot's inner angle would be larger than its outer one, or the outer one 0";
        return Err(EditError::NotApplicable { path: path.to_owned(), why });
    }
    let chosen = chosen_camera(scene, settings)?;
    if edits_camera {
        edit_camera(scene, chosen, &camera)?;
    }
    Ok(())
}

/// Sets a field of a material that no scene has.
///
/// # Errors
/// If the value does not suit the field, or the material has no such thing; messages call the field by its name alone.
pub fn set_material(material: &mut Material, field: MaterialField, value: &Value) -> Result<(), EditError> {
    match material::set(material, field, value) {
        Ok(Outcome::Set) => Ok(()),
        Ok(Outcome::NotApplicable(why)) => {
            Err(EditError::NotApplicable { path: field.name().to_owned(), why })
        }
        Err(Mismatch) => Err(mismatch(field.name(), value, field.expects())),
    }
}

/// Sets a field of everything that the pattern matches and that has it.
fn set_named<T>(
    path: &str,
    kind: &'static str,
    all: &mut [Named<T>],
    name: &NamePattern,
    mut set: impl FnMut(&mut T) -> Result<Outcome, EditError>,
) -> Result<(), EditError> {
    let mut any = false;
    let mut refused = None;
    for named in all.iter_mut().filter(|n| name.matches(&n.name)) {
        match set(&mut named.item)? {
            Outcome::Set => any = true,
            Outcome::NotApplicable(why) => refused = Some(why),
        }
    }
    match refused {
        _ if any => Ok(()),
        Some(why) => Err(EditError::NotApplicable { path: path.to_owned(), why }),
        None => Err(unknown_name(kind, name.as_str(), all)),
    }
}

/// The camera that the settings name, or the first; none if the scene has none.
fn chosen_camera(scene: &Scene<Material>, settings: &RenderSettings) -> Result<Option<usize>, EditError> {
    match &settings.camera {
        Some(name) => match scene.cameras.iter().position(|c| c.name == *name) {
            Some(index) => Ok(Some(index)),
            None => Err(unknown_name("camera", name, &scene.cameras)),
        },
        None => Ok(if scene.cameras.is_empty() { None } else { Some(0) }),
    }
}

fn edit_camera(
    scene: &mut Scene<Material>,
    index: Option<usize>,
    edits: &CameraEdits,
) -> Result<(), EditError> {
    let centre = || scene.bounds().map(|(low, high)| (low + high) * 0.5);
    let edited = edits.apply(index.map(|i| &scene.cameras[i].item), &centre)?;
    match index {
        Some(index) => scene.cameras[index].item = edited,
        None => scene.cameras.push(Named::new("camera", edited)),
    }
    Ok(())
}

fn unknown_name<T>(kind: &'static str, name: &str, all: &[Named<T>]) -> EditError {
    EditError::UnknownName {
        kind,
        name: shortened(name),
        nearest: nearest(name, all.iter().map(|n| n.name.as_str())).map(str::to_owned),
        known: all.iter().map(|n| shortened(&n.name)).collect(),
    }
}

fn mismatch(path: &str, value: &Value, expected: &'static str) -> EditError {
    let found = match value {
        Value::Text(text) => format!("{:?}", shortened(text)),
        other => shortened(&other.to_string()),
    };
    EditError::Value { path: path.to_owned(), found, expected }
}
