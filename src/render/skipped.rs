//! What a scene lets the renderer leave out, in words.

use std::collections::BTreeSet;

use super::Prepared;
use super::material::{PreparedMaterial, constant_bsdf};
use super::sharing::Saved;
use crate::disney::{Lobe, Model, Parameter};
use crate::scene::material::{Material, Param};

/// A material that an instance wears.
type Worn<'p> = (&'p Material, &'p PreparedMaterial);

impl Prepared {
    /// What this scene lets the renderer leave out, in words.
    pub fn skipped(&self) -> Vec<String> {
        let mut skipped = Vec::new();
        let constant = self.materials.iter().filter(|m| m.is_constant()).count();
        if constant > 0 {
            skipped.push(format!(
                "parameters worked out once for {constant} of {} materials",
                self.materials.len()
            ));
        }
        skipped.extend(self.unused_images());
        skipped.extend(self.spared_copies());
        if self.all_covered {
            skipped.push("opacity: every surface is opaque".to_owned());
        }
        let worn = self.worn();
        if !worn.iter().any(|(material, _)| material.transmits()) {
            skipped.push("transmission: nothing lets light through".to_owned());
        }
        skipped.extend(absent_lobes(&worn));
        skipped.extend(unread_attributes(&worn));
        if let Err(why) = &self.light_paths {
            skipped.push(format!("light paths: {why}"));
        }
        if let Err(why) = &self.path_reuse {
            skipped.push(format!("reuse of paths by neighbouring pixels: {why}"));
        }
        if let Err(why) = &self.splitting {
            skipped.push(format!("branches of samples: {why}"));
        }
        if let Err(why) = &self.adaptive {
            skipped.push(format!("more samples where it is noisy: {why}"));
        }
        skipped.extend(self.absent_lights());
        skipped
    }

    fn unused_images(&self) -> Option<String> {
        let undecoded = self.scene.images.iter().filter(|image| !image.is_decoded()).count();
        (undecoded > 0).then(|| match undecoded {
            1 => "textures: an image that nothing samples is not decoded".to_owned(),
            more => format!("textures: {more} images that nothing samples are not decoded"),
        })
    }

    fn spared_copies(&self) -> Option<String> {
        let Saved { instances, meshes, bytes, copied_bytes } = self.geometry.saved();
        let megabytes = |bytes: usize| bytes.div_ceil(1_000_000);
        (instances > 0).then(|| {
            let (meshes, bytes, copied) = (meshes, megabytes(bytes), megabytes(copied_bytes));
            let of = if meshes == 1 { "a mesh".to_owned() } else { format!("{meshes} meshes") };
            format!("copies of meshes: {instances} instances of {of} take {bytes} MB instead of {copied} MB")
        })
    }

    fn absent_lights(&self) -> Vec<String> {
        let counts = self.lights.counts();
        let kinds = counts.into_iter().zip(["area lights", "punctual lights", "environment"]);
        let mut absent: Vec<String> =
            kinds.filter(|(count, _)| *count == 0).map(|(_, kind)| format!("{kind}: none")).collect();
        if counts.iter().sum::<usize>() == 1 {
            absent.push("choice among lights: there is a single one".to_owned());
        }
        absent
    }

    /// The materials of instances.
    fn worn(&self) -> Vec<Worn<'_>> {
        let ids: BTreeSet<usize> = self.scene.instances.iter().map(|i| i.material.0 as usize).collect();
        ids.into_iter().map(|index| (&self.scene.materials[index].item, &self.materials[index])).collect()
    }
}

/// The lobes of reflection that some materials have, and none here.
fn absent_lobes(worn: &[Worn<'_>]) -> Option<String> {
    let absent: Vec<&str> = [Lobe::Diffuse, Lobe::Sheen, Lobe::Clearcoat]
        .into_iter()
        .filter(|&lobe| !worn.iter().any(|(material, _)| may_have(material, lobe)))
        .map(Lobe::name)
        .collect();
    (!absent.is_empty()).then(|| format!("{}: no material has any", absent.join(", ")))
}

/// What of a mesh's vertices no material needs.
fn unread_attributes(worn: &[Worn<'_>]) -> impl Iterator<Item = String> {
    let is_mapped = worn.iter().any(|(_, prepared)| prepared.has_normal_map());
    let follows_tangents = worn.iter().any(|(_, prepared)| prepared.needs_tangents());
    // Meshes without tangents have them from their texture coordinates.
    let reads_coordinates = follows_tangents || worn.iter().any(|(material, _)| reads_textures(material));
    [
        (is_mapped, "normal maps: none"),
        (follows_tangents, "tangents: no material follows them"),
        (reads_coordinates, "texture coordinates: no material reads any"),
    ]
    .into_iter()
    .filter(|(is_needed, _)| !is_needed)
    .map(|(_, line)| line.to_owned())
}

/// Whether a material scatters by `lobe`, as far as can be told without looking into textures.
fn may_have(material: &Material, lobe: Lobe) -> bool {
    if let Some(bsdf) = constant_bsdf(material) {
        return bsdf.lobes().contains(&lobe);
    }
    let strength = match lobe {
        Lobe::Sheen => Parameter::Sheen,
        Lobe::Clearcoat => Parameter::Clearcoat,
        _ => return true,
    };
    material.model == Model::Disney && material.scalar(strength).constant() != Some(0.0)
}

/// Whether a material reads any texture, normal maps aside.
fn reads_textures(material: &Material) -> bool {
    let colors = [
        Some(&material.base_color),
        material.transmission_color.as_ref(),
        material.diff_trans_color.as_ref(),
        Some(&material.emission.color),
    ];
    let is_texture = |param: &Param<f32>| param.constant().is_none();
    colors.into_iter().flatten().any(|color| color.constant().is_none())
        || material.scalars.iter().any(is_texture)
        || is_texture(&material.opacity.alpha)
        || material.anisotropy.as_ref().is_some_and(|anisotropy| anisotropy.map.is_some())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine3A, Vec2, Vec3};

    use super::*;
    use crate::color::Rgb;
    use crate::render::Geometry;
    use crate::scene::material::{NormalMap, TextureChannel, TextureMap};
    use crate::scene::texture::{Encoding, Pixels, TexelFilter, Wrap};
    use crate::scene::{
        Image, ImageId, Instance, MaterialId, Mesh, MeshId, Named, Scene, Texture, TextureId, framing,
    };
    use crate::settings::RenderSettings;

    const LOBES: &str = "sheen, clearcoat: no material has any";
    const COORDINATES: &str = "texture coordinates: no material reads any";
    const TANGENTS: &str = "tangents: no material follows them";
    const NORMALS: &str = "normal maps: none";
    const UNDECODED: &str = "textures: an image that nothing samples is not decoded";

    fn map() -> TextureMap {
        TextureMap::new(TextureId(0), TextureChannel::R)
    }

    /// Which of `lines` are told of a triangle of a material that `edit` makes, beside a spare one of every kind of lobe.
    fn told(lines: &[&str], edit: impl FnOnce(&mut Material)) -> Vec<bool> {
        let mut scene = Scene::empty();
        scene.meshes.push(Arc::new(Mesh {
            name: "triangle".into(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: Vec::new(),
            tangents: Vec::new(),
            uvs: vec![vec![Vec2::ZERO, Vec2::X, Vec2::Y]],
            colors: Vec::new(),
            triangles: vec![[0, 1, 2]],
        }));
        let (mesh, world_from_object) = (MeshId(0), Affine3A::IDENTITY);
        scene.instances.push(Instance {
            name: "it".into(),
            mesh,
            material: MaterialId(1),
            world_from_object,
        });
        let pixels = Pixels::U8(vec![128]);
        let image = Image { name: "grey".into(), width: 1, height: 1, channels: 1, pixels };
        scene.images = vec![Arc::new(image), Arc::new(Image::undecoded("spare".into()))];
        scene.textures.push(Texture {
            image: ImageId(0),
            encoding: Encoding::Linear,
            wrap: [Wrap::Repeat; 2],
            filter: TexelFilter::Nearest,
        });
        let mut spare = Material::default();
        for p in [Parameter::Sheen, Parameter::Clearcoat, Parameter::Anisotropic] {
            *spare.scalar_mut(p) = Param::Constant(0.5);
        }
        spare.normal_map = Some(NormalMap { map: map(), scale: 1.0 });
        let mut worn = Material::default();
        edit(&mut worn);
        scene.materials = vec![Named::new("spare", spare), Named::new("worn", worn)];
        scene.cameras.push(Named::new("camera", framing::frame(&scene)));
        let geometry = Arc::new(Geometry::build(&scene).unwrap());
        let prepared = Prepared::new(Arc::new(scene), geometry, &RenderSettings::default()).unwrap();
        let skipped = prepared.skipped();
        lines.iter().map(|line| skipped.iter().any(|told| told == line)).collect()
    }

    #[test]
    fn what_a_plain_material_needs_none_of_is_told() {
        let lines = [LOBES, COORDINATES, TANGENTS, NORMALS, UNDECODED];
        assert_eq!(told(&lines, |_| ()), [true; 5]);
    }

    #[test]
    fn a_lobe_that_is_there_or_may_be_is_not_told() {
        let coat = "clearcoat: no material has any";
        let textured = |factor| Param::Texture { map: map(), factor };
        let sheens = [Param::Constant(0.5), textured(1.0)];
        for sheen in sheens {
            let given = told(&[LOBES, coat], |m| *m.scalar_mut(Parameter::Sheen) = sheen);
            assert_eq!(given, [false, true]);
        }
        // What varies otherwise has its lobes told by the strength alone.
        assert_eq!(told(&[LOBES], |m| *m.scalar_mut(Parameter::Roughness) = textured(1.0)), [true]);
    }

    #[test]
    fn each_texture_needs_coordinates_and_a_normal_map_tangents_too() {
        let lines = [COORDINATES, TANGENTS, NORMALS];
        let color = || Param::Texture { map: map(), factor: Rgb::WHITE };
        let scalar = || Param::Texture { map: map(), factor: 1.0 };
        let colored = [
            told(&lines, |m| m.base_color = color()),
            told(&lines, |m| m.emission.color = color()),
            told(&lines, |m| m.opacity.alpha = scalar()),
            told(&lines, |m| *m.scalar_mut(Parameter::Metallic) = scalar()),
        ];
        assert!(colored.iter().all(|told| *told == [false, true, true]), "{colored:?}");
        let anisotropic = told(&lines, |m| *m.scalar_mut(Parameter::Anisotropic) = Param::Constant(0.5));
        assert_eq!(anisotropic, [false, false, true]);
        let mapped = told(&lines, |m| m.normal_map = Some(NormalMap { map: map(), scale: 1.0 }));
        assert_eq!(mapped, [false; 3]);
    }

    #[test]
    fn a_light_alone_is_told() {
        let (single, none) = ("choice among lights: there is a single one", "area lights: none");
        assert_eq!(told(&[single, none], |_| ()), [false, true]);
        let glows = |m: &mut Material| m.emission.color = Param::Constant(Rgb::WHITE);
        assert_eq!(told(&[single, none], glows), [true, false]);
    }
}
