//! What reading a scene and converting its materials leave to the user.

use serde::{Deserialize, Serialize};

use crate::disney::DiffuseModel;

/// What an import leaves to its caller.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportOptions {
    /// The unit that the intensities of glTF's punctual lights are read in.
    pub light_units: LightUnits,
    /// The variant of glTF's KHR_materials_variants whose materials are taken, by name. None takes the primitives' own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// The moment of a glTF file's animation that is shown, in seconds. None, without an animation either, is the rest pose:
    /// nodes and morph weights as they stand in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f32>,
    /// The animation that `time` is of, by name. None is the first; one without a time is shown at 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// How far the names of files in the scene lead. No part of a job's identity: what was read is.
    #[serde(skip)]
    pub reach: Reach,
    /// Which images are decoded. No part of a job's identity either: no picture depends on it.
    #[serde(skip)]
    pub images: DecodedImages,
}

/// Which of a scene's images are decoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DecodedImages {
    /// Those of all materials: what writes materials needs them, whoever wears them.
    #[default]
    OfMaterials,
    /// Those of materials that an instance may wear, as no ray meets the others, where factors don't make nothing of them. The files of others
    /// aren't even read.
    OfInstances,
}

/// The unit of glTF's punctual lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LightUnits {
    /// Candela and lux as they are, beside emission in nits: all keep their ratio.
    #[default]
    Photometric,
    /// Divided by 683 lm/W, as Blender's importer does.
    Blender,
}

named_variants! { LightUnits { Photometric "photometric", Blender "blender", } }

/// How far the names in a scene lead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reach {
    /// To files in the scene's folder and below, links followed: a scene may come from anyone.
    #[default]
    Folder,
    /// To any file that the user may read.
    Anywhere,
}

/// What a conversion leaves to its caller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConvertOptions {
    /// The diffuse term of all Disney materials; each dialect has its own where absent ([`DiffuseModel::Burley`] for glTF).
    pub diffuse: Option<DiffuseModel>,
    /// How strong a coat is that glTF calls 1.
    pub clearcoat: ClearcoatScale,
    /// Multiplies the sheen of glTF's materials, at least 0: Charlie's lobe is 6 to 26 times brighter than Disney's at an equal factor.
    pub sheen_scale: f32,
    /// How MTL's exponent becomes a roughness.
    pub phong: PhongRoughness,
    /// Whether the backs of glTF's single-sided materials are not there.
    pub cull: bool,
}

impl Default for ConvertOptions {
    fn default() -> Self {
        let (clearcoat, phong) = (ClearcoatScale::default(), PhongRoughness::default());
        Self { diffuse: None, clearcoat, sheen_scale: 1.0, phong, cull: false }
    }
}

/// How strong a Disney coat is that glTF calls 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClearcoatScale {
    /// 4, the factor that Disney's lobe divides by: as bright as glTF's.
    #[default]
    Matched,
    /// 1, as the parameter is published.
    Published,
}

named_variants! { ClearcoatScale { Matched "matched", Published "published", } }

/// How MTL's `Ns` becomes a roughness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PhongRoughness {
    /// (2/(Ns+2))^¼: a lobe as wide as Phong's (Walter 2007).
    #[default]
    Walter,
    /// 1 - √(Ns/1000), as Blender reads and writes it.
    Blender,
}

named_variants! { PhongRoughness { Walter "walter", Blender "blender", } }
