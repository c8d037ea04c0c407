//! Material libraries: YAML files that map names to materials of constants.
//!
//! ```yaml
//! gold: {model: disney, base_color: [1.0, 0.77, 0.34], metallic: 1, roughness: 0.3}
//! glass: {model: dielectric, ior: 1.5}
//! ```
//!
//! Fields are called as in paths, or as Aris calls them (`specularTint`, `color`). A file of fields alone is one material that
//! is named after it. Files without any material, such as Aris scenes, are for others to read.

use super::InspectError;
use super::edit::{field, set};
use crate::import::yaml::{self, Node};
use crate::record::Value;
use crate::scene::{Material, Named};

/// Top-level keys that make a file an Aris scene.
const SCENE_KEYS: [&str; 5] = ["defaults", "geometry", "brdf", "emitters", "camera"];

/// The materials of the file called `name`, or `None` if it is a scene.
///
/// # Errors
/// If it isn't YAML, or has keys or values that no material has, with their place.
pub(super) fn read(name: &str, bytes: &[u8]) -> Result<Option<Vec<Named<Material>>>, InspectError> {
    let root = yaml::parse(name, bytes).map_err(Box::new)?;
    let yaml::Value::Map(entries) = &root.value else {
        return Err(wrong(&root, "a map from names to materials is expected"));
    };
    if entries.iter().any(|(key, ..)| SCENE_KEYS.contains(&key.as_str())) {
        return Ok(None);
    }
    if entries.is_empty() {
        return Err(wrong(&root, "the library has no materials"));
    }
    let is_map = |node: &Node| matches!(node.value, yaml::Value::Map(_));
    if !entries.iter().any(|(_, _, node)| is_map(node)) {
        let stem = std::path::Path::new(name).file_stem().map_or(name.into(), |s| s.to_string_lossy());
        return Ok(Some(vec![Named::new(stem, material(&root)?)]));
    }
    entries
        .iter()
        .map(|(key, _, node)| Ok(Named::new(key, material(node)?)))
        .collect::<Result<_, _>>()
        .map(Some)
}

/// The material that a map of fields describes.
fn material(node: &Node) -> Result<Material, InspectError> {
    let yaml::Value::Map(entries) = &node.value else {
        return Err(wrong(node, "a map of fields is expected, such as {roughness: 0.3}"));
    };
    let mut material = Material::default();
    for (key, place, node) in entries {
        let at = |place: &yaml::Place, cause| InspectError::Library { place: place.to_string(), cause };
        let field = field(key).map_err(|cause| at(place, cause))?;
        let value = value(node).ok_or_else(|| {
            wrong(
                node,
                &format!("`{}` must be {}; textures are not read here", field.name(), field.expects()),
            )
        })?;
        set(&mut material, field, &value).map_err(|cause| at(&node.place, cause))?;
    }
    Ok(material)
}

fn value(node: &Node) -> Option<Value> {
    Some(match &node.value {
        yaml::Value::Number(n) => Value::Number(*n),
        yaml::Value::Text(text) => Value::Text(text.clone()),
        yaml::Value::List(items) => Value::List(items.iter().map(value).collect::<Option<_>>()?),
        yaml::Value::Bool(b) => Value::Bool(*b),
        yaml::Value::Null | yaml::Value::Map(_) => return None,
    })
}

fn wrong(node: &Node, why: &str) -> InspectError {
    InspectError::NoLibrary { place: node.place.to_string(), why: why.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disney::{Model, Parameter};

    fn library(text: &str) -> Vec<Named<Material>> {
        read("metals.yaml", text.as_bytes()).unwrap().unwrap()
    }

    #[test]
    fn names_map_to_materials_in_either_spelling() {
        let materials = library(
            "gold: {model: disney, base_color: [1.0, 0.77, 0.34], specularTint: 0.5}\nglass:\n  model: dielectric\n  ior: 1.33\n",
        );
        assert_eq!(materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["gold", "glass"]);
        assert_eq!(materials[0].item.scalar(Parameter::SpecularTint).constant(), Some(0.5));
        assert_eq!(materials[1].item.model, Model::Dielectric);
        assert_eq!(materials[1].item.scalar(Parameter::Ior).constant(), Some(1.33));
        let single = library("color: [0.1, 0.2, 0.3]\nroughness: 0.9\n");
        assert_eq!((single.len(), single[0].name.as_str()), (1, "metals"));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let error = |text: &str| read("m.yaml", text.as_bytes()).unwrap_err();
        let unknown = error("gold:\n  rougness: 0.3\n");
        assert_eq!(unknown.to_string(), "m.yaml:2:3: a material has no field `rougness`");
        assert!(unknown.hint().unwrap().contains("`roughness`"));
        assert_eq!(
            error("gold:\n  roughness: 3\n").to_string(),
            "m.yaml:2:14: `roughness` is 3, but must be a number in [0, 1]"
        );
        assert!(error("gold: {roughness: {file: a.png}}").to_string().contains("textures are not read here"));
        assert!(error("gold: 3\nsilver: {}").to_string().contains("m.yaml:1:7: a map of fields"));
        assert!(error("[1, 2]").to_string().contains("a map from names"));
        assert!(error("{").to_string().starts_with("m.yaml:1:"));
    }

    #[test]
    fn a_scene_is_left_to_its_importer() {
        assert!(read("cbox.yaml", b"defaults:\n  - cbox_base\n").unwrap().is_none());
    }
}
