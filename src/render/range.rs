//! Textures must keep parameters in their ranges: nothing is clamped to get there but roundings.

use super::RenderError;
use crate::color::Rgb;
use crate::disney::{BASE_COLOR, Parameter};
use crate::scene::material::{Curve, Material, Param, TextureChannel, TextureMap};
use crate::scene::texture::Pixels;
use crate::scene::{Named, Scene};

/// Factors times 8-bit codes, and filtering between texels, may leave a range by this fraction.
const ROUNDING: f32 = 1e-5;

/// A channel of a texture that a parameter reads, and what it may hold after the factor.
struct Reading<'a> {
    parameter: &'static str,
    map: &'a TextureMap,
    channel: TextureChannel,
    factor: f32,
    curve: Curve,
    min: f32,
    max: f32,
}

/// Checks every textured parameter of every material against the values that its image holds.
///
/// # Errors
/// [`RenderError::TextureRange`] for the first that leaves its range.
pub(super) fn check(scene: &Scene) -> Result<(), RenderError> {
    for Named { name, item } in &scene.materials {
        for reading in readings(item) {
            let Reading { parameter, map, min, max, factor, curve, .. } = reading;
            for found in extremes(scene, map, reading.channel).map(|value| curve.at(value * factor)) {
                let slack = ROUNDING * max;
                if !(min - slack..=max + slack).contains(&found) {
                    let image = scene.textures[map.texture.0 as usize].image;
                    let image = scene.images[image.0 as usize].name.clone();
                    let material = name.clone();
                    return Err(RenderError::TextureRange { material, parameter, found, image, min, max });
                }
            }
        }
    }
    Ok(())
}

/// All that a material reads of textures, emission and normals aside, which have no range.
fn readings<'m>(material: &'m Material) -> Vec<Reading<'m>> {
    let mut readings = Vec::new();
    let mut scalar = |parameter, param: &'m Param<f32>, min, max| {
        if let Param::Texture { map, factor } = param {
            let (channel, curve) = (map.channel, map.curve);
            readings.push(Reading { parameter, map, channel, factor: *factor, curve, min, max });
        }
    };
    for p in Parameter::ALL {
        scalar(p.name(), material.scalar(p), p.min(), p.max());
    }
    scalar("opacity", &material.opacity.alpha, 0.0, 1.0);
    let colors = [
        (BASE_COLOR, Some(&material.base_color)),
        ("transmission_color", material.transmission_color.as_ref()),
        ("diff_trans_color", material.diff_trans_color.as_ref()),
    ];
    for (parameter, color) in colors {
        let Some(Param::Texture { map, factor: Rgb { r, g, b } }) = color else { continue };
        let channels = [(TextureChannel::R, *r), (TextureChannel::G, *g), (TextureChannel::B, *b)];
        readings.extend(channels.map(|(channel, factor)| Reading {
            parameter,
            map,
            channel,
            factor,
            curve: Curve::Linear,
            min: 0.0,
            max: 1.0,
        }));
    }
    readings
}

/// The least and the largest value of a channel. Integers are taken to span [0, 1], which is what they can hold.
fn extremes(scene: &Scene, map: &TextureMap, channel: TextureChannel) -> [f32; 2] {
    let texture = &scene.textures[map.texture.0 as usize];
    let image = &scene.images[texture.image.0 as usize];
    if !matches!(image.pixels, Pixels::F32(_)) {
        return [0.0, 1.0];
    }
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    for y in 0..image.height {
        for x in 0..image.width {
            let value = channel.of(&image.texel(x, y, texture.encoding));
            range = [range[0].min(value), range[1].max(value)];
        }
    }
    range
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::texture::{Encoding, Image, TexelFilter, Texture, Wrap};
    use crate::scene::{ImageId, TextureId};

    fn with_texels(values: Vec<f32>, set: impl Fn(&mut Material, TextureMap)) -> Result<(), RenderError> {
        let mut scene = Scene::empty();
        let pixels = Pixels::F32(values);
        scene.images.push(Arc::new(Image {
            name: "map.exr".into(),
            width: 2,
            height: 1,
            channels: 1,
            pixels,
        }));
        scene.textures.push(Texture {
            image: ImageId(0),
            encoding: Encoding::Linear,
            wrap: [Wrap::Repeat; 2],
            filter: TexelFilter::Bilinear,
        });
        let mut material = Material::default();
        set(&mut material, TextureMap::new(TextureId(0), TextureChannel::R));
        scene.materials.push(Named::new("ball", material));
        check(&scene)
    }

    #[test]
    fn a_texture_beyond_a_parameters_range_is_an_error_with_material_and_field() {
        let roughness = |factor| {
            move |m: &mut Material, map| *m.scalar_mut(Parameter::Roughness) = Param::Texture { map, factor }
        };
        assert!(with_texels(vec![0.0, 1.0], roughness(1.0)).is_ok());
        assert!(with_texels(vec![0.0, 2.0], roughness(0.5)).is_ok());
        let error = with_texels(vec![0.25, 1.5], roughness(1.0)).unwrap_err();
        let expected = "material \"ball\": roughness reads 1.5 from \"map.exr\", but must be in [0, 1]";
        assert_eq!(error.to_string(), expected);
        let error = with_texels(vec![0.5, -0.5], |m, map| {
            m.base_color = Param::Texture { map, factor: Rgb::WHITE };
        });
        assert!(error.unwrap_err().to_string().contains("base_color reads -0.5"));
    }
}
