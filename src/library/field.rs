//! Fields of materials by the names that people use, outside a scene.

use std::path::Path;

use crate::manifest::edit::{self, BoxedError, EditError, MaterialField};
use crate::manifest::nearest::nearest;
use crate::record::Value;
use crate::scene::{Image, Material, Named, Scene};
use crate::settings::RenderSettings;

/// The field of that name, in snake_case, camelCase or as Aris calls it.
///
/// # Errors
/// [`EditError::UnknownField`].
pub fn field(name: &str) -> Result<MaterialField, EditError> {
    let plain = |name: &str| -> String {
        name.chars().filter(|c| !matches!(c, '_' | '-' | ' ')).flat_map(char::to_lowercase).collect()
    };
    let wanted = plain(name);
    let found = match wanted.as_str() {
        "color" => Some(MaterialField::BaseColor),
        "g" => Some(MaterialField::Masking),
        _ => MaterialField::ALL.iter().copied().find(|f| plain(f.name()) == wanted),
    };
    found.ok_or_else(|| {
        let known: Vec<&'static str> = MaterialField::ALL.iter().map(|f| f.name()).collect();
        EditError::UnknownField {
            of: "a material",
            field: name.chars().take(80).collect(),
            nearest: nearest(name, known.iter().copied()),
            known,
        }
    })
}

/// Sets a field of a material.
///
/// # Errors
/// If the value does not suit the field; messages call it by its name alone.
pub fn set(material: &mut Material, field: MaterialField, value: &Value) -> Result<(), EditError> {
    let mut scene = Scene::empty();
    scene.materials.push(Named::new("material", std::mem::take(material)));
    let path = format!("material.material.{}", field.name());
    let mut no_image = |_: &Path| -> Result<Image, BoxedError> { Err("a material has no image".into()) };
    let result = edit::apply(&mut scene, &mut RenderSettings::default(), &path, value, &mut no_image);
    if let Some(edited) = scene.materials.pop() {
        *material = edited.item;
    }
    result.map_err(|error| match error {
        EditError::Value { found, expected, .. } => {
            EditError::Value { path: field.name().to_owned(), found, expected }
        }
        EditError::NotApplicable { why, .. } => {
            EditError::NotApplicable { path: field.name().to_owned(), why }
        }
        other => other,
    })
}
