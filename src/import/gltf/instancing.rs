//! EXT_mesh_gpu_instancing: a node that stands for many.

use glam::{DAffine3, DQuat, DVec3, Vec3};
use gltf::json::scene::Node;
use serde::Deserialize;

use super::accessor::Accessors;
use super::error::GltfError;
use crate::math::Number;

const EXTENSION: &str = "EXT_mesh_gpu_instancing";

/// The extension's object. Attributes of applications, such as `_ID`, say nothing about places.
#[derive(Deserialize)]
struct Instancing {
    attributes: Attributes,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct Attributes {
    translation: Option<usize>,
    rotation: Option<usize>,
    scale: Option<usize>,
}

/// The transform of each instance of the mesh of `node`, called `element`, in the node's space; none without the extension.
pub(super) fn transforms(
    node: &Node,
    element: &str,
    accessors: &Accessors,
) -> Result<Option<Vec<DAffine3>>, GltfError> {
    let Some(json) = node.extensions.as_ref().and_then(|e| e.others.get(EXTENSION)) else { return Ok(None) };
    let Instancing { attributes } = gltf::json::deserialize::from_value(json.clone())?;
    let element = format!("{element}.{EXTENSION}");
    let vectors = |index: Option<usize>| index.map(|i| accessors.floats::<3>(i, &element)).transpose();
    let translations = vectors(attributes.translation)?;
    let rotations = attributes.rotation.map(|i| accessors.floats::<4>(i, &element)).transpose()?;
    let scales = vectors(attributes.scale)?;

    let counts = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let count = counts.into_iter().flatten().next().unwrap_or(0);
    if counts.into_iter().flatten().any(|other| other != count) {
        return Err(GltfError::Invalid {
            element,
            property: "attributes",
            expected: "as many values in each attribute",
        });
    }
    let transform = |i: usize| {
        let vector = |of: &Option<Vec<[f32; 3]>>, default: DVec3| {
            of.as_ref().map_or(default, |values| Vec3::from(values[i]).as_dvec3())
        };
        let (translation, scale) = (vector(&translations, DVec3::ZERO), vector(&scales, DVec3::ONE));
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |r| DQuat::from_array(r[i].map(f64::from)));
        let length = Number::sqr(rotation.x)
            + Number::sqr(rotation.y)
            + Number::sqr(rotation.z)
            + Number::sqr(rotation.w);
        if !(length.is_finite() && length > 0.0 && translation.is_finite() && scale.is_finite()) {
            let expected = "finite numbers, and quaternions that are not 0";
            return Err(GltfError::Invalid { element: element.clone(), property: "attributes", expected });
        }
        Ok(DAffine3::from_scale_rotation_translation(scale, rotation.normalize(), translation))
    };
    (0..count).map(transform).collect::<Result<_, _>>().map(Some)
}
