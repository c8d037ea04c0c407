//! EXT_lights_image_based: a cube map as the scene's environment.
//!
//! A path tracer needs the sharpest cube alone: the blurred ones and the irradiance coefficients are what it computes.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use gltf::json::Root;
use serde::Deserialize;

use super::buffers::lookup;
use super::error::GltfError;
use super::texture::Textures;
use crate::color::Rgb;
use crate::math::Real;
use crate::scene::environment::{Environment, EnvironmentMap, Equirectangular};
use crate::scene::texture::{Encoding, Image, Pixels, TexelFilter, Texture, Wrap};
use crate::scene::{ImageId, Scene};

const EXTENSION: &str = "EXT_lights_image_based";

/// The most columns of the image that a cube becomes.
const MAX_WIDTH: u32 = 8192;

/// The extension's object in the file.
#[derive(Deserialize)]
struct Lights {
    lights: Vec<Light>,
}

/// The extension's object in a scene.
#[derive(Deserialize)]
struct Reference {
    light: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Light {
    #[serde(default = "identity")]
    rotation: [f64; 4],
    #[serde(default = "one")]
    intensity: f32,
    specular_images: Vec<Vec<usize>>,
}

const fn identity() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

const fn one() -> f32 {
    1.0
}

/// What surrounds a scene.
pub(super) struct Surroundings {
    /// Equirectangular, y up.
    image: Image,
    intensity: f32,
}

impl Surroundings {
    /// Makes them the environment of `scene`.
    pub(super) fn light<M>(self, scene: &mut Scene<M>) {
        let image = ImageId(scene.images.len() as u32);
        scene.images.push(Arc::new(self.image));
        scene.environment = Some(Environment {
            map: EnvironmentMap::Image { image, mapping: Equirectangular::YUp },
            color: Rgb::WHITE,
            intensity: self.intensity,
            rotation: 0.0,
        });
    }
}

/// The surroundings of the file's default scene, if it has any.
pub(super) fn read(root: &Root, textures: &mut Textures<'_>) -> Result<Option<Surroundings>, GltfError> {
    let shown = root.scene.map_or(0, |scene| scene.value());
    let of_scene = root.scenes.get(shown).and_then(|scene| scene.extensions.as_ref());
    let Some(reference) = of_scene.and_then(|e| e.others.get(EXTENSION)) else { return Ok(None) };
    let reference: Reference = gltf::json::deserialize::from_value(reference.clone())?;
    let of_root = root.extensions.as_ref().and_then(|e| e.others.get(EXTENSION));
    let lights: Option<Lights> =
        of_root.map(|json| gltf::json::deserialize::from_value(json.clone())).transpose()?;
    let lights = lights.map_or(Vec::new(), |lights| lights.lights);
    let element = format!("scenes[{shown}].{EXTENSION}");
    let light = lookup(&lights, reference.light, &element, "lights")?;
    let element = format!("{EXTENSION}.lights[{}]", reference.light);
    let invalid = |property, expected| GltfError::Invalid { element: element.clone(), property, expected };
    let rotation = DQuat::from_array(light.rotation);
    if (rotation.length() - 1.0).abs() > 1e-2 || !rotation.is_finite() {
        return Err(invalid("rotation", "a unit quaternion"));
    }
    if !(light.intensity.is_finite() && light.intensity >= 0.0) {
        return Err(invalid("intensity", "finite and not negative"));
    }
    let faces = light.specular_images.first().map_or(&[][..], Vec::as_slice);
    let faces: [usize; 6] =
        faces.try_into().map_err(|_| invalid("specularImages", "at least one level, of six images"))?;
    let faces = faces.into_iter().map(|index| textures.pixels(index, &element)).collect::<Result<_, _>>()?;
    let image = unfold(&Cube { faces }, rotation.normalize(), textures)?;
    Ok(Some(Surroundings { image, intensity: light.intensity }))
}

/// Faces towards +x, -x, +y, -y, +z and -z, each as it is seen from inside: the extension turns them about so.
struct Cube {
    faces: Vec<Arc<Image>>,
}

impl Cube {
    /// The radiance from a direction. A face with alpha holds colours to divide by it (RGBD).
    fn radiance(&self, direction: DVec3) -> Rgb {
        let size = direction.abs();
        let (face, forward, up) = match size.max_position() {
            0 => (usize::from(direction.x < 0.0), DVec3::X, DVec3::Y),
            1 => (2 + usize::from(direction.y < 0.0), DVec3::Y, DVec3::NEG_Z),
            _ => (4 + usize::from(direction.z < 0.0), DVec3::Z, DVec3::Y),
        };
        let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
        let (forward, up) = (forward * sign, if face == 3 { -up } else { up });
        let right = forward.cross(up);
        let depth = direction.dot(forward);
        let (x, y) = (direction.dot(right) / depth, direction.dot(up) / depth);
        let uv = glam::DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y).as_vec2();
        let reader = Texture {
            image: ImageId(0),
            encoding: Encoding::Srgb,
            wrap: [Wrap::Clamp; 2],
            filter: TexelFilter::Bilinear,
        };
        let texel = reader.sample(&self.faces[face], uv);
        // An alpha of 0 stands for no number.
        texel.color * (1.0 / texel.alpha.max(1.0 / 255.0))
    }
}

/// The cube, turned by `rotation`, as an equirectangular image of about its resolution.
fn unfold(cube: &Cube, rotation: DQuat, textures: &mut Textures<'_>) -> Result<Image, GltfError> {
    let largest = cube.faces.iter().map(|face| face.width.max(face.height)).max().unwrap_or(1);
    let width = largest.saturating_mul(4).min(MAX_WIDTH);
    let height = width / 2;
    textures.count_decoded(u64::from(width) * u64::from(height) * 12, "the environment")?;
    let cube_from_world = rotation.inverse();
    let mut pixels = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..height {
        let theta = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(height);
        let (sin_theta, cos_theta) = (Real::sin(theta), Real::cos(theta));
        for x in 0..width {
            let phi = std::f64::consts::TAU * ((f64::from(x) + 0.5) / f64::from(width) - 0.5);
            let direction = DVec3::new(sin_theta * Real::cos(phi), cos_theta, sin_theta * Real::sin(phi));
            pixels.extend(cube.radiance(cube_from_world * direction).to_array());
        }
    }
    Ok(Image { name: "environment.exr".into(), width, height, channels: 3, pixels: Pixels::F32(pixels) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A face of 2 × 2 texels with a colour each: top left, top right, bottom left, bottom right.
    fn face(texels: [[u8; 3]; 4]) -> Arc<Image> {
        let pixels = Pixels::U8(texels.concat());
        Arc::new(Image { name: "face".into(), width: 2, height: 2, channels: 3, pixels })
    }

    #[test]
    fn faces_are_seen_from_inside() {
        let (red, black) = ([255, 0, 0], [0; 3]);
        // Each face is red in its right column, and the top row adds green.
        let faces = (0..6).map(|_| face([[0, 255, 0], [255, 255, 0], black, red])).collect();
        let cube = Cube { faces };
        // (forward, right, up) as one who looks forward sees them.
        for (forward, right, up) in [
            (DVec3::X, DVec3::Z, DVec3::Y),
            (DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y),
            (DVec3::Z, DVec3::NEG_X, DVec3::Y),
            (DVec3::NEG_Z, DVec3::X, DVec3::Y),
            (DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z),
            (DVec3::NEG_Y, DVec3::NEG_X, DVec3::Z),
        ] {
            let at = |x: f64, y: f64| cube.radiance(forward + right * x + up * y).to_array();
            assert_eq!(at(0.7, -0.7), [1.0, 0.0, 0.0], "{forward}");
            assert_eq!(at(-0.7, 0.7), [0.0, 1.0, 0.0], "{forward}");
            assert_eq!(at(-0.7, -0.7), [0.0; 3], "{forward}");
        }
    }

    #[test]
    fn alpha_divides() {
        let pixels = Pixels::U8(vec![255, 255, 255, 51]);
        let bright = Image { name: "face".into(), width: 1, height: 1, channels: 4, pixels };
        let cube = Cube { faces: std::iter::repeat_n(Arc::new(bright), 6).collect() };
        assert!((cube.radiance(DVec3::new(0.3, 0.2, -1.0)).r - 5.0).abs() < 1e-4);
    }
}
