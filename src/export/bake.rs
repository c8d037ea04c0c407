//! Textures that hold the parameters themselves, for formats that read them so.

use std::sync::Arc;

use crate::convert::{Note, Quality};
use crate::disney::Parameter;
use crate::scene::material::{Curve, Material, Param, TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, Image, Pixels, Texture};
use crate::scene::{ImageId, Scene, TextureId};

/// What was baked, so that it is baked once: what was read, and by which curve with which factor.
type Recipe = (TextureId, TextureChannel, Curve, u32);

/// `scene` with Disney's anisotropy for glTF's where `keeps_anisotropy` says nothing else, and with new textures for the scalars that
/// `wants` names: each holds what the curve makes of the factor times the channel, in 16 bits.
pub(super) fn bake(
    mut scene: Scene<Material>,
    keeps_anisotropy: bool,
    wants: impl Fn(Parameter, &TextureMap) -> bool,
    notes: &mut Vec<Note>,
) -> Scene<Material> {
    let mut known: Vec<(Recipe, TextureId)> = Vec::new();
    for index in 0..scene.materials.len() {
        let name = scene.materials[index].name.clone();
        let mut tell = |field: &str, reason: &str| {
            let (material, field, reason) = (name.clone(), field.to_owned(), reason.to_owned());
            notes.push(Note { material, field, quality: Quality::Approximated, reason });
        };
        if !keeps_anisotropy && scene.materials[index].item.anisotropy.is_some() {
            scene.materials[index].item = scene.with_mean_anisotropy(&scene.materials[index].item);
            tell("anisotropic", "the mean of its texture, along the tangent");
        }
        for parameter in Parameter::ALL {
            let Param::Texture { map, factor } = scene.materials[index].item.scalar(parameter).clone() else {
                continue;
            };
            if !wants(parameter, &map) {
                continue;
            }
            let recipe = (map.texture, map.channel, map.curve, factor.to_bits());
            let texture = match known.iter().find(|(of, _)| *of == recipe) {
                Some(&(_, texture)) => texture,
                None => {
                    let texture = add(&mut scene, &map, factor, parameter);
                    known.push((recipe, texture));
                    texture
                }
            };
            let (channel, curve) = (TextureChannel::R, Curve::Linear);
            let map = TextureMap { texture, channel, curve, ..map };
            *scene.materials[index].item.scalar_mut(parameter) = Param::Texture { map, factor: 1.0 };
            tell(parameter.name(), "worked out for each texel, and read between texels");
        }
    }
    scene
}

/// A new texture of what `map` and `factor` give `parameter`.
fn add(scene: &mut Scene<Material>, map: &TextureMap, factor: f32, parameter: Parameter) -> TextureId {
    let source = scene.textures[map.texture.0 as usize].clone();
    let image = &scene.images[source.image.0 as usize];
    let (width, height) = (image.width, image.height);
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    // All that is baked lies in [0, 1].
    let code = |v: f32| (v.clamp(0.0, 1.0) * 65535.0).round() as u16;
    let values = texels.map(|(x, y)| code(map.scalar(&image.texel(x, y, source.encoding), factor)));
    let pixels = Pixels::U16(values.collect());
    let (stem, _) = image.name.rsplit_once('.').unwrap_or((&image.name, ""));
    let name = format!("{stem}-{}.png", parameter.name());
    let texture = TextureId(scene.textures.len() as u32);
    let image = ImageId(scene.images.len() as u32);
    scene.images.push(Arc::new(Image { name, width, height, channels: 1, pixels }));
    scene.textures.push(Texture { image, encoding: Encoding::Linear, ..source });
    texture
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::{TexelFilter, Wrap};
    use crate::scene::{AnisotropyMap, Named};

    #[test]
    fn baked_textures_hold_the_parameters() {
        let mut scene = Scene::empty();
        let pixels = Pixels::U8(vec![0, 51, 255]);
        let image = Image { name: "coat.png".into(), width: 3, height: 1, channels: 1, pixels };
        scene.images.push(Arc::new(image));
        let (encoding, wrap, filter) = (Encoding::Linear, [Wrap::Clamp; 2], TexelFilter::Nearest);
        scene.textures.push(Texture { image: ImageId(0), encoding, wrap, filter });
        let mut material = Material::default();
        let map =
            TextureMap { curve: Curve::GlossOfRoughness, ..TextureMap::new(TextureId(0), TextureChannel::G) };
        *material.scalar_mut(Parameter::ClearcoatGloss) = Param::Texture { map, factor: 0.5 };
        material.anisotropy = Some(AnisotropyMap { map: None, strength: 0.5 });
        scene.materials = vec![Named::new("a", material.clone()), Named::new("b", material)];
        let mut notes = Vec::new();
        let baked = bake(scene, false, |_, map| map.curve != Curve::Linear, &mut notes);
        assert_eq!((baked.images.len(), baked.textures.len()), (2, 2), "baked once");
        assert_eq!(notes.len(), 4);
        let image = &baked.images[1];
        assert_eq!(image.name, "coat-clearcoat_gloss.png");
        let gloss = |roughness: f32| ((0.1 - roughness * roughness) / 0.099).clamp(0.0, 1.0);
        for (x, roughness) in [(0, 0.0), (1, 0.1), (2, 0.5)] {
            let found = image.texel(x, 0, Encoding::Linear).color.r;
            assert!((found - gloss(roughness)).abs() < 1e-5, "{roughness}: {found}");
        }
        let Param::Texture { map, factor } = baked.materials[1].item.scalar(Parameter::ClearcoatGloss) else {
            panic!("a texture")
        };
        assert_eq!((map.texture, map.curve, *factor), (TextureId(1), Curve::Linear, 1.0));
        assert!(baked.materials[0].item.anisotropy.is_none());
    }
}
