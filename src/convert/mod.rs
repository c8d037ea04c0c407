//! Source materials into Disney materials, with a note on every field: exact, carried, approximated or dropped.

mod aris;
mod gltf;
mod mtl;
mod tint;

pub use crate::settings::{ClearcoatScale, ConvertOptions, PhongRoughness};

pub(crate) use gltf::f0_of_ior;
pub(crate) use tint::{F0_OF_SPECULAR, disney_luminance};

use crate::disney::Model;
use crate::record::Warning;
use crate::scene::source::SourceMaterial;
use crate::scene::{Material, Named, Scene};

/// A converted scene and what the conversion has to say.
#[derive(Clone, Debug)]
pub struct Converted {
    /// The scene with Disney materials.
    pub scene: Scene<Material>,
    /// One a material and field that the source sets.
    pub notes: Vec<Note>,
    /// What was not as it should be.
    pub warnings: Vec<Warning>,
}

/// What became of one field of a source material.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// The material.
    pub material: String,
    /// The field, in the source's terms.
    pub field: String,
    /// How well it was kept.
    pub quality: Quality,
    /// Why, with a figure where one is known; empty where there is nothing to say.
    pub reason: String,
}

/// How well a conversion keeps a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// The same BSDF.
    Exact,
    /// The same parameter and value, while the two models differ by a known amount.
    Carried,
    /// Something near.
    Approximated,
    /// Not at all.
    Dropped,
}

named_variants! { Quality { Exact "exact", Carried "carried", Approximated "approximated", Dropped "dropped", } }

/// `scene` with its materials as Disney materials, and what became of each of their fields. It can't fail: importers have seen to
/// the ranges.
pub fn to_disney(scene: Scene<SourceMaterial>, options: &ConvertOptions) -> Converted {
    let (mut notes, mut warnings) = (Vec::new(), Vec::new());
    let scene = scene.map_materials(|Named { name, item }| {
        let mut material = match &item {
            SourceMaterial::Gltf(source) => gltf::convert(&name, source, options, &mut notes, &mut warnings),
            SourceMaterial::Mtl(source) => mtl::convert(&name, source, options, &mut notes, &mut warnings),
            SourceMaterial::Aris(source) => aris::convert(&name, source, &mut notes, &mut warnings),
        };
        if let (Model::Disney, Some(diffuse)) = (material.model, options.diffuse) {
            material.diffuse = diffuse;
        }
        Named { name, item: material }
    });
    Converted { scene, notes, warnings }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disney::DiffuseModel;
    use crate::scene::source::GltfMaterial;

    #[test]
    fn the_diffuse_term_is_the_callers() {
        let mut scene = Scene::empty();
        let source = SourceMaterial::Gltf(GltfMaterial::default());
        scene.materials.push(Named::new("ball", source));
        let with =
            |diffuse| to_disney(scene.clone(), &ConvertOptions { diffuse, ..ConvertOptions::default() });
        assert_eq!(with(None).scene.materials[0].item.diffuse, DiffuseModel::Burley);
        let converted = with(Some(DiffuseModel::LambertFresnel));
        assert_eq!(converted.scene.materials[0].item.diffuse, DiffuseModel::LambertFresnel);
        assert_eq!(converted.scene.materials[0].name, "ball");
        assert!(converted.notes.iter().all(|n| n.quality == Quality::Exact && n.material == "ball"));
    }
}
