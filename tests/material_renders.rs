//! What conversions ask of materials beyond the BSDF: surfaces that the camera alone sees, backs that are not there, and textures that
//! hold another quantity than the parameter. Each render has an answer that is known or that another material gives.

mod common;

use std::sync::Arc;

use common::{lambert, largest_error, mean, render_scene, scene, small, square};
use glam::{Vec2, Vec3};
use pipeline::color::Rgb;
use pipeline::disney::{Model, Parameter};
use pipeline::scene::environment::Environment;
use pipeline::scene::light::{Light, LightKind};
use pipeline::scene::material::{Curve, Emission, Material, Param, Sides, TextureChannel, TextureMap};
use pipeline::scene::texture::{Encoding, Pixels, TexelFilter, Texture, Wrap};
use pipeline::scene::{AnisotropyMap, Camera, Image, ImageId, Mesh, Named, Scene, TextureId};
use pipeline::settings::{Integrator, RenderSettings};

fn looking_down(from: f32) -> Camera {
    Camera::look_at(Vec3::new(0.0, from, 0.0), Vec3::ZERO, Vec3::Z, 0.2)
}

fn unlit(color: Rgb) -> Material {
    let emission = Emission { color: Param::Constant(color), strength: 1.0, sides: Sides::Both, unlit: true };
    Material { emission, ..lambert(0.0) }
}

#[test]
fn an_unlit_surface_shows_its_colour_times_the_vertex_colour() {
    let mut sheet = square(2.0, 0.0);
    sheet.colors = vec![glam::Vec4::new(0.5, 0.5, 0.5, 1.0); sheet.positions.len()];
    let material = Material { vertex_color: true, ..unlit(Rgb::grey(0.6)) };
    let rendered = render_scene(&scene(vec![(sheet, material)], looking_down(3.0)), &small(8, 8, 4, 8));
    assert!(largest_error(&rendered, 0.3) < 1e-6);
}

#[test]
fn an_unlit_surface_lights_nothing_and_hides_what_is_behind_it() {
    // A white floor under an unlit ceiling, seen from between them.
    let parts = vec![(square(5.0, 0.0), lambert(0.9)), (square(5.0, 4.0), unlit(Rgb::WHITE))];
    let rendered = render_scene(&scene(parts.clone(), looking_down(3.0)), &small(8, 8, 16, 8));
    assert_eq!(mean(&rendered), 0.0);
    // Without the ceiling the sky above would shine on it.
    let mut lit = scene(parts, looking_down(3.0));
    lit.environment = Some(Environment::constant(Rgb::WHITE));
    let dim = mean(&render_scene(&lit, &small(8, 8, 64, 8)));
    assert!(dim > 0.05 && dim < 0.6, "{dim}");
}

/// The camera sees it in a mirror, but what the mirror throws on other surfaces is light, of which it has none.
#[test]
fn an_unlit_surface_is_seen_in_mirrors_and_lights_nothing_by_way_of_them() {
    let mirror = || Material { model: Model::Mirror, ..Material::default() };
    let unlit = || unlit(Rgb::grey(0.5));
    // A square under a ceiling, above a wider floor.
    let seen = |[below, ceiling, floor]: [Material; 3], integrator: Integrator| {
        let parts =
            vec![(square(1.0, 0.0), below), (square(20.0, 2.0), ceiling), (square(20.0, -1.0), floor)];
        let settings = RenderSettings { integrator, ..small(8, 8, 64, 8) };
        render_scene(&scene(parts, looking_down(1.5)), &settings)
    };
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let mirrored = seen([mirror(), unlit(), lambert(0.5)], integrator);
        assert!(largest_error(&mirrored, 0.5) < 1e-5, "{integrator:?}");
        let lit = seen([lambert(0.9), mirror(), unlit()], integrator);
        assert_eq!(mean(&lit), 0.0, "{integrator:?}");
    }
}

#[test]
fn a_culled_surface_is_there_from_its_front_alone() {
    let sheet = || Material { culled: true, ..lambert(0.5) };
    let view = |from: f32| {
        let mut world = scene(vec![(square(2.0, 0.0), sheet())], looking_down(from));
        world.environment = Some(Environment::constant(Rgb::WHITE));
        render_scene(&world, &small(8, 8, 64, 8))
    };
    assert!((mean(&view(3.0)) - 0.5).abs() < 0.01, "{}", mean(&view(3.0)));
    assert!(largest_error(&view(-3.0), 1.0) < 1e-6, "from behind there is only the sky");
}

/// Paths see what the camera would: a floor sees the sun through a sheet whose back is towards it, and not through one that faces it.
#[test]
fn a_culled_surface_shades_what_its_front_sees() {
    let lit = |faces_floor: bool| {
        let (floor, mut shade) = (square(5.0, 0.0), square(5.0, 2.0));
        if faces_floor {
            shade.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        let parts = vec![(floor, lambert(0.5)), (shade, Material { culled: true, ..lambert(0.5) })];
        let mut world = scene(parts, looking_down(1.0));
        let kind = LightKind::Directional { direction: Vec3::NEG_Y };
        world.lights.push(Named::new("sun", Light { kind, color: Rgb::WHITE, intensity: 1.0 }));
        mean(&render_scene(&world, &small(4, 4, 4, 1)))
    };
    assert_eq!(lit(true), 0.0);
    let exact = 0.5 * std::f64::consts::FRAC_1_PI;
    assert!((lit(false) / exact - 1.0).abs() < 1e-5, "{}", lit(false));
}

/// A lit sheet with texture coordinates; `texel` is all of its one texture.
fn textured(texel: [f32; 3], material: impl Fn(TextureMap) -> Material) -> Scene {
    let mut sheet: Mesh = square(2.0, 0.0);
    sheet.uvs = vec![sheet.positions.iter().map(|p| Vec2::new(p.x, -p.z) * 0.25 + 0.5).collect()];
    let camera = Camera::look_at(Vec3::new(0.3, 3.0, 2.0), Vec3::ZERO, Vec3::Y, 0.4);
    let mut world = scene(vec![(sheet, material(TextureMap::new(TextureId(0), TextureChannel::R)))], camera);
    let pixels = Pixels::F32(texel.to_vec());
    world.images.push(Arc::new(Image { name: "texel".into(), width: 1, height: 1, channels: 3, pixels }));
    world.textures.push(Texture {
        image: ImageId(0),
        encoding: Encoding::Linear,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Nearest,
    });
    for (x, z) in [(0.5, -1.5), (-1.5, 0.3)] {
        let kind = LightKind::Directional { direction: Vec3::new(-x, -1.5, -z).normalize() };
        world.lights.push(Named::new("sun", Light { kind, color: Rgb::WHITE, intensity: 2.0 }));
    }
    world
}

/// The largest difference between two pictures.
fn difference(a: &Scene, b: &Scene) -> f32 {
    let settings = small(16, 16, 4, 1);
    let (a, b) = (render_scene(a, &settings), render_scene(b, &settings));
    let pixels = |r: &pipeline::render::Rendered| {
        r.raster
            .picture()
            .rgb()
            .expect("a colour picture")
            .iter()
            .flat_map(|c| c.to_vec())
            .collect::<Vec<f32>>()
    };
    pixels(&a).iter().zip(pixels(&b)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn with(values: &[(Parameter, f32)]) -> Material {
    let mut material = Material::default();
    for &(parameter, value) in values {
        *material.scalar_mut(parameter) = Param::Constant(value);
    }
    material
}

#[test]
fn anisotropy_by_texture_is_that_of_its_constants() {
    // A direction of 60° and half the strength.
    let texel = [0.75, 0.5 + 0.433_012_7, 0.5];
    let (roughness, angle) = (0.4, 60f32.to_radians());
    let by_texture = textured(texel, |map| Material {
        anisotropy: Some(AnisotropyMap { map: Some(map), strength: 0.8 }),
        rotation: 0.2,
        ..with(&[(Parameter::Roughness, roughness), (Parameter::Metallic, 1.0)])
    });
    let disney = AnisotropyMap::disney(roughness, 0.4);
    let by_constants = |rotation| {
        textured(texel, |_| Material {
            rotation,
            ..with(&[
                (Parameter::Roughness, disney.roughness),
                (Parameter::Anisotropic, disney.anisotropic),
                (Parameter::Metallic, 1.0),
            ])
        })
    };
    let off = difference(&by_texture, &by_constants(0.2 + angle));
    assert!(off < 1e-5, "{off}");
    assert!(difference(&by_texture, &by_constants(0.2)) > 1e-2, "the direction counts");
}

#[test]
fn a_rotated_highlight_lies_the_same_on_a_mirrored_map() {
    let brushed = Material {
        rotation: 0.6,
        ..with(&[(Parameter::Roughness, 0.4), (Parameter::Anisotropic, 0.9), (Parameter::Metallic, 1.0)])
    };
    let plain = textured([0.0; 3], |_| brushed.clone());
    // The picture in a mirror: v grows the other way, and the brush turns the other way.
    let mut mirrored = textured([0.0; 3], |_| Material { rotation: -0.6, ..brushed.clone() });
    let sheet = Arc::make_mut(&mut mirrored.meshes[0]);
    sheet.uvs[0].iter_mut().for_each(|uv| uv.y = -uv.y);
    let off = difference(&plain, &mirrored);
    assert!(off < 1e-5, "{off}");
    let turned = textured([0.0; 3], |_| Material { rotation: -0.6, ..brushed.clone() });
    assert!(difference(&plain, &turned) > 1e-2);
}

#[test]
fn a_coats_gloss_by_a_texture_of_its_roughness_is_that_of_its_constant() {
    let coat = [(Parameter::Clearcoat, 1.0), (Parameter::Roughness, 0.9)];
    let by_texture = textured([0.5, 0.0, 0.0], |map| {
        let mut material = with(&coat);
        let map = TextureMap { curve: Curve::GlossOfRoughness, ..map };
        *material.scalar_mut(Parameter::ClearcoatGloss) = Param::Texture { map, factor: 0.6 };
        material
    });
    let gloss = |r: f32| (0.1 - r * r) / 0.099;
    let by_constant = |g| {
        textured([0.0; 3], |_| {
            let mut material = with(&coat);
            *material.scalar_mut(Parameter::ClearcoatGloss) = Param::Constant(g);
            material
        })
    };
    assert!(difference(&by_texture, &by_constant(gloss(0.3))) < 1e-5);
    assert!(difference(&by_texture, &by_constant(gloss(0.15))) > 1e-3);
}

#[test]
fn a_scalar_may_read_a_colours_luminance() {
    let by_texture = textured([0.2, 0.5, 0.9], |map| {
        let mut material = Material::default();
        let map = TextureMap { channel: TextureChannel::Y, ..map };
        *material.scalar_mut(Parameter::Roughness) = Param::Texture { map, factor: 1.0 };
        material
    });
    let luminance = 0.3 * 0.2 + 0.6 * 0.5 + 0.1 * 0.9;
    let by_constant = textured([0.0; 3], |_| with(&[(Parameter::Roughness, luminance)]));
    assert!(difference(&by_texture, &by_constant) < 1e-5);
}
