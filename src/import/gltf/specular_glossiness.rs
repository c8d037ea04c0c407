//! KHR_materials_pbrSpecularGlossiness as metallic and roughness, as Khronos' own converter does it.
//!
//! Source: "PBR metallic-roughness to specular-glossiness workflows conversion" in the extension's `examples/convert-between-workflows`
//! (`babylon.pbrUtilities.js`). It is applied texel by texel, since the formula doesn't factor into textures and constants.

use glam::Vec2;
use gltf::json::Value;
use gltf::json::texture::Info;
use serde::Deserialize;

use super::error::GltfError;
use super::material::{Limits, Reader, parse};
use crate::color::{Rgb, srgb_from_linear};
use crate::math::Number;
use crate::scene::Image;
use crate::scene::material::TextureMap;
use crate::scene::source::GltfMaterial;
use crate::scene::texture::{Encoding, Pixels, Texel};

/// The reflectance of a dielectric head-on.
const DIELECTRIC: f64 = 0.04;

/// The extension's object.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularGlossiness {
    diffuse_factor: [f32; 4],
    diffuse_texture: Option<Info>,
    specular_factor: [f32; 3],
    glossiness_factor: f32,
    specular_glossiness_texture: Option<Info>,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self {
            diffuse_factor: [1.0; 4],
            diffuse_texture: None,
            specular_factor: [1.0; 3],
            glossiness_factor: 1.0,
            specular_glossiness_texture: None,
        }
    }
}

/// Replaces the base colour, metallic and roughness of `material` by what the extension `json` says.
pub(super) fn read(json: &Value, reader: &mut Reader, material: &mut GltfMaterial) -> Result<(), GltfError> {
    let json: SpecularGlossiness = parse(json)?;
    let [r, g, b, alpha] = json.diffuse_factor;
    let diffuse = reader.color("diffuseFactor", [r, g, b], Limits::Unit)?;
    let specular = reader.color("specularFactor", json.specular_factor, Limits::Unit)?;
    let glossiness = reader.number("glossinessFactor", json.glossiness_factor, Limits::Unit)?;
    material.specular_glossiness = true;
    material.alpha_factor = reader.number("diffuseFactor's alpha", alpha, Limits::Unit)?;
    let field = "specularGlossinessTexture";
    let gloss_map = reader.info(json.specular_glossiness_texture.as_ref(), Encoding::Srgb, field)?;
    let diffuse_map = reader.info(json.diffuse_texture.as_ref(), Encoding::Srgb, "diffuseTexture")?;

    let constant = solve(diffuse, specular);
    material.base_color_factor = constant.base_color;
    material.metallic_factor = constant.metallic;
    material.roughness_factor = 1.0 - glossiness;
    (material.base_color_texture, material.metallic_roughness_texture) = (None, None);

    // Of two textures that lie differently on the surface, the diffuse one is taken as the base colour.
    let place = |map: &TextureMap| (map.uv_set, map.texture_from_uv);
    let apart = matches!((&diffuse_map, &gloss_map), (Some(a), Some(b)) if place(a) != place(b));
    let baker = Baker { diffuse, specular, glossiness };
    let beside = diffuse_map.as_ref().filter(|_| !apart);
    if let Some((colors, rest)) = baker.bake(beside, gloss_map.as_ref(), reader)? {
        material.base_color_factor = if apart { diffuse } else { Rgb::WHITE };
        material.base_color_texture = if apart { diffuse_map } else { Some(colors) };
        (material.metallic_factor, material.roughness_factor) = (1.0, 1.0);
        material.metallic_roughness_texture = Some(rest);
    }
    Ok(())
}

/// A base colour and how metallic it is.
#[derive(Clone, Copy, Debug)]
struct Solved {
    base_color: Rgb,
    metallic: f32,
}

/// The metallic twin of a diffuse and a specular colour.
fn solve(diffuse: Rgb, specular: Rgb) -> Solved {
    const EPSILON: f64 = 1e-6;
    let (diffuse, specular): (Rgb<f64>, Rgb<f64>) = (diffuse.cast(), specular.cast());
    let rest = 1.0 - specular.max_channel();
    let metallic = solve_metallic(brightness(diffuse), brightness(specular), rest);
    let of_diffuse = diffuse.map(|d| d * rest / (1.0 - DIELECTRIC) / (1.0 - metallic).max(EPSILON));
    let of_specular = specular.map(|s| (s - DIELECTRIC * (1.0 - metallic)) / metallic.max(EPSILON));
    let base_color = of_diffuse.lerp(of_specular, Number::sqr(metallic)).map(|c| c.clamp(0.0, 1.0));
    Solved { base_color: base_color.cast(), metallic: metallic as f32 }
}

/// Khronos' `solveMetallic`: the metallic at which the diffuse and the specular brightness come from one base colour.
fn solve_metallic(diffuse: f64, specular: f64, rest: f64) -> f64 {
    if specular < DIELECTRIC {
        return 0.0;
    }
    let a = DIELECTRIC;
    let b = diffuse * rest / (1.0 - DIELECTRIC) + specular - 2.0 * DIELECTRIC;
    let c = DIELECTRIC - specular;
    // c ≤ 0, so the root is real.
    ((-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).clamp(0.0, 1.0)
}

/// The perceived brightness of a linear colour.
fn brightness(c: Rgb<f64>) -> f64 {
    (0.299 * c.r * c.r + 0.587 * c.g * c.g + 0.114 * c.b * c.b).sqrt()
}

/// The factors that textures are multiplied by.
struct Baker {
    diffuse: Rgb,
    specular: Rgb,
    glossiness: f32,
}

impl Baker {
    /// The base colour and the metallic-roughness texture of the maps, which lie alike, as large as the larger of their images; none
    /// without maps.
    fn bake(
        &self,
        diffuse: Option<&TextureMap>,
        gloss: Option<&TextureMap>,
        reader: &mut Reader,
    ) -> Result<Option<(TextureMap, TextureMap)>, GltfError> {
        let size = |map: &TextureMap| reader.textures.size(map.texture);
        let largest = [diffuse, gloss].into_iter().flatten().max_by_key(|map| {
            let (width, height) = size(map);
            u64::from(width) * u64::from(height)
        });
        let Some(lie) = largest.cloned() else { return Ok(None) };
        let (width, height) = size(&lie);
        reader.textures.count_decoded(u64::from(width) * u64::from(height) * 7, "a pair of images")?;
        let (mut colors, mut rest) = (Vec::new(), Vec::new());
        let code = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        for y in 0..height {
            for x in 0..width {
                let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                let white = Texel { color: Rgb::WHITE, alpha: 1.0 };
                let texel = |map: Option<&TextureMap>| {
                    map.map_or(white, |map| reader.textures.sample(map.texture, uv))
                };
                let (diffuse, gloss) = (texel(diffuse), texel(gloss));
                let solved = solve(self.diffuse * diffuse.color, self.specular * gloss.color);
                let [r, g, b] = solved.base_color.to_array().map(|c| code(srgb_from_linear(c)));
                colors.extend([r, g, b, code(diffuse.alpha)]);
                rest.extend([0, code(1.0 - self.glossiness * gloss.alpha), code(solved.metallic)]);
            }
        }
        let image = |kind: &str, channels, values| Image {
            name: format!("{} ({kind} of specular-glossiness)", reader.name),
            width,
            height,
            channels,
            pixels: Pixels::U8(values),
        };
        let (colors, rest) = (image("base colour", 4, colors), image("metallic-roughness", 3, rest));
        let mut map = |image, encoding| TextureMap {
            texture: reader.textures.add(image, encoding, lie.texture),
            ..lie.clone()
        };
        Ok(Some((map(colors, Encoding::Srgb), map(rest, Encoding::Linear))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectrics_and_metals_are_told_apart() {
        let dielectric = solve(Rgb::new(0.5, 0.25, 0.125), Rgb::grey(0.04));
        assert!(dielectric.metallic < 1e-6, "{dielectric:?}");
        assert!((dielectric.base_color.r - 0.5).abs() < 1e-5, "{dielectric:?}");
        let gold = solve(Rgb::BLACK, Rgb::new(1.0, 0.766, 0.336));
        assert!((gold.metallic - 1.0).abs() < 1e-6 && (gold.base_color.b - 0.336).abs() < 1e-5, "{gold:?}");
        let black = solve(Rgb::BLACK, Rgb::BLACK);
        assert_eq!((black.metallic, black.base_color), (0.0, Rgb::BLACK));
    }

    #[test]
    fn any_colours_have_a_twin_in_range() {
        let steps = [0.0, 1e-7, 0.039, 0.04, 0.041, 0.3, 1.0];
        for d in steps {
            for s in steps {
                for specular in [Rgb::grey(s), Rgb::new(s, 0.0, 1.0)] {
                    let solved = solve(Rgb::grey(d), specular);
                    let colors = solved.base_color.to_array();
                    assert!(
                        colors.into_iter().all(|c| (0.0..=1.0).contains(&c)),
                        "{d} {specular:?} {solved:?}"
                    );
                    assert!((0.0..=1.0).contains(&solved.metallic), "{d} {specular:?} {solved:?}");
                }
            }
        }
    }
}
