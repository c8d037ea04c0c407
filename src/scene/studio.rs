//! Light for scenes without any: a studio with a key, a fill and a rim light in a soft dome, as an environment image.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::Vec3;

use super::environment::{EnvironmentMap, Equirectangular};
use super::light::Light;
use super::texture::Pixels;
use super::{Environment, Image, ImageId, Material, Scene};
use crate::color::Rgb;
use crate::math::Real;

const WIDTH: u32 = 512;
const HEIGHT: u32 = 256;

/// A rectangular light with soft edges, far away.
struct SoftBox {
    /// Towards its centre; need not be a unit vector.
    centre: Vec3,
    /// Tangents of half its angular width and height.
    half_size: [f32; 2],
    /// Its radiance over the dome's.
    radiance: Rgb,
}

/// The key shines from the left, above and before the scene as [`super::framing`] looks at it, the fill from the right, and the
/// rim from behind.
const LIGHTS: [SoftBox; 3] = [
    SoftBox {
        centre: Vec3::new(-0.3, 1.0, 0.8),
        half_size: [0.45, 0.35],
        radiance: Rgb::new(14.0, 13.4, 12.6),
    },
    SoftBox { centre: Vec3::new(1.0, 0.35, 0.1), half_size: [0.5, 0.6], radiance: Rgb::new(2.0, 2.1, 2.2) },
    SoftBox { centre: Vec3::new(0.3, 0.45, -1.0), half_size: [0.6, 0.15], radiance: Rgb::new(7.0, 7.3, 7.8) },
];

/// Replaces the scene's environment by the studio.
pub fn add_studio_lighting<M>(scene: &mut Scene<M>) {
    let image = ImageId(scene.images.len() as u32);
    scene.images.push(Arc::new(studio_image()));
    let map = EnvironmentMap::Image { image, mapping: Equirectangular::YUp };
    scene.environment = Some(Environment { map, ..Environment::constant(Rgb::WHITE) });
}

/// The studio as an equirectangular image of linear radiance, y up. A white diffuse plane that lies in the open on its floor
/// has a luminance of 1.
pub fn studio_image() -> Image {
    let mut radiance: Vec<Rgb> = Vec::with_capacity((WIDTH * HEIGHT) as usize);
    let mut irradiance = 0.0;
    for y in 0..HEIGHT {
        let theta = PI * (y as f32 + 0.5) / HEIGHT as f32;
        let (sin_theta, cos_theta) = (Real::sin(theta), Real::cos(theta));
        // The solid angle of a pixel, times the cosine at a plane that faces upwards.
        let weight = f64::from(cos_theta.max(0.0) * sin_theta * (PI / HEIGHT as f32) * (TAU / WIDTH as f32));
        for x in 0..WIDTH {
            let phi = TAU * ((x as f32 + 0.5) / WIDTH as f32 - 0.5);
            let direction = Vec3::new(sin_theta * Real::cos(phi), cos_theta, sin_theta * Real::sin(phi));
            let light = radiance_from(direction);
            irradiance += weight * f64::from(light.luminance());
            radiance.push(light);
        }
    }
    // A Lambert surface of reflectance 1 has the radiance E/π.
    let scale = PI / irradiance as f32;
    let pixels = radiance.into_iter().flat_map(|light| (light * scale).to_array()).collect();
    Image {
        name: "studio".to_owned(),
        width: WIDTH,
        height: HEIGHT,
        channels: 3,
        pixels: Pixels::F32(pixels),
    }
}

/// The studio's radiance from a unit direction, in units of the dome's zenith.
fn radiance_from(direction: Vec3) -> Rgb {
    let sky = 0.35 + 0.65 * smoothstep(-0.1, 0.9, direction.y);
    // The floor is darker, with a soft horizon.
    let dome = Rgb::new(0.96, 0.98, 1.0) * (sky * (0.25 + 0.75 * smoothstep(-0.25, 0.05, direction.y)));
    LIGHTS.iter().fold(dome, |sum, light| sum + light.radiance * light.coverage(direction))
}

impl SoftBox {
    /// How much of the light is seen in a direction, in [0, 1].
    fn coverage(&self, direction: Vec3) -> f32 {
        let centre = self.centre.normalize();
        let along = direction.dot(centre);
        if along <= 0.0 {
            return 0.0;
        }
        let right = Vec3::Y.cross(centre).normalize();
        let up = centre.cross(right);
        let soft = |t: f32, half: f32| 1.0 - smoothstep(0.8 * half, 1.2 * half, t.abs());
        soft(direction.dot(right) / along, self.half_size[0])
            * soft(direction.dot(up) / along, self.half_size[1])
    }
}

/// 0 up to `low`, 1 from `high`, smooth between (Hermite).
fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Whether anything lights the scene: a light, an environment, or an instance whose material emits evenly. Emission by a texture is
/// taken for a decal, such as a display: it hardly lights what it sits on.
pub fn is_lit(scene: &Scene<Material>) -> bool {
    let shines = |light: &Light| light.intensity > 0.0 && !light.color.is_black();
    let emits = |instance: &super::Instance| {
        let material = scene.materials.get(instance.material.0 as usize);
        material.is_some_and(|m| m.item.is_light() && m.item.emission.color.constant().is_some())
            && !scene.mesh_of(instance).triangles.is_empty()
    };
    scene.lights.iter().any(|light| shines(&light.item))
        || scene.environment.as_ref().is_some_and(|e| e.intensity > 0.0 && !e.color.is_black())
        || scene.instances.iter().any(emits)
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;

    use super::*;
    use crate::scene::light::LightKind;
    use crate::scene::material::Param;
    use crate::scene::texture::Encoding;
    use crate::scene::{Instance, MaterialId, Mesh, MeshId, Named};

    #[test]
    fn a_white_plane_on_the_floor_comes_out_at_one() {
        let image = studio_image();
        // Cosine-weighted directions on a grid: the mean radiance is E/π.
        let n = 200;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let (u, phi) = ((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32);
                let theta = Real::acos(u.sqrt());
                let x = (phi * WIDTH as f32) as u32;
                let y = (theta / PI * HEIGHT as f32) as u32;
                sum += image.texel(x, y, Encoding::Linear).color.luminance();
            }
        }
        let mean = sum / (n * n) as f32;
        assert!((mean - 1.0).abs() < 0.01, "{mean}");
    }

    #[test]
    fn the_key_is_brightest_and_the_floor_darkest() {
        let key = radiance_from(LIGHTS[0].centre.normalize()).luminance();
        let rim = radiance_from(LIGHTS[2].centre.normalize()).luminance();
        let top = radiance_from(Vec3::new(0.0, 0.8, -0.6)).luminance();
        let floor = radiance_from(Vec3::NEG_Y).luminance();
        assert!(key > rim && rim > top && top > 2.0 * floor && floor > 0.0, "{key} {rim} {top} {floor}");
        assert!(
            matches!(&studio_image().pixels, Pixels::F32(v) if v.iter().all(|v| v.is_finite() && *v > 0.0))
        );
    }

    #[test]
    fn a_scene_is_lit_by_lights_environments_and_emitting_instances_alone() {
        let mut scene: Scene<Material> = Scene::empty();
        assert!(!is_lit(&scene));
        let mut glowing = Material::default();
        glowing.emission.color = Param::Constant(Rgb::WHITE);
        scene.materials.push(Named::new("glowing", glowing));
        assert!(!is_lit(&scene), "nothing is made of it");
        let mut lit = scene.clone();
        lit.meshes.push(Arc::new(Mesh {
            triangles: vec![[0, 0, 0]],
            positions: vec![Vec3::ZERO],
            ..Mesh::default()
        }));
        lit.instances.push(Instance {
            name: String::new(),
            mesh: MeshId(0),
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        });
        assert!(is_lit(&lit));
        let mut lamp = Light {
            kind: LightKind::Point { position: Vec3::ZERO, range: None },
            color: Rgb::WHITE,
            intensity: 0.0,
        };
        scene.lights.push(Named::new("lamp", lamp));
        assert!(!is_lit(&scene), "it is off");
        lamp.intensity = 1.0;
        scene.lights[0].item = lamp;
        assert!(is_lit(&scene));
        scene.lights.clear();
        scene.environment = Some(Environment::constant(Rgb::BLACK));
        assert!(!is_lit(&scene));
        add_studio_lighting(&mut scene);
        assert!(is_lit(&scene));
    }
}
