//! Scenes that tests build by hand.
#![allow(dead_code, reason = "every test binary uses its own part")]

pub(crate) mod closed;
pub(crate) mod lit;
pub(crate) mod technique;

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use pipeline::color::Rgb;
use pipeline::disney::{Model, Parameter};
use pipeline::render::{Control, Geometry, Prepared, Rendered, render};
use pipeline::scene::environment::{Environment, EnvironmentMap, Equirectangular};
use pipeline::scene::material::{Emission, Param, Sides};
use pipeline::scene::texture::{Image, Pixels};
use pipeline::scene::{Camera, ImageId, Instance, Material, MaterialId, Mesh, MeshId, Named, Scene};
use pipeline::settings::RenderSettings;

/// A material that reflects `albedo` evenly.
pub(crate) fn lambert(albedo: f32) -> Material {
    Material { model: Model::Diffuse, base_color: Param::Constant(Rgb::grey(albedo)), ..Material::default() }
}

/// A Disney material of one colour with these parameters.
pub(crate) fn disney(scalars: &[(Parameter, f32)]) -> Material {
    let mut material =
        Material { base_color: Param::Constant(Rgb::new(0.9, 0.7, 0.5)), ..Material::default() };
    for &(parameter, value) in scalars {
        *material.scalar_mut(parameter) = Param::Constant(value);
    }
    material
}

/// A rough metal.
pub(crate) fn metal(roughness: f32) -> Material {
    disney(&[(Parameter::Metallic, 1.0), (Parameter::Roughness, roughness)])
}

/// Rough glass.
pub(crate) fn glass(roughness: f32) -> Material {
    disney(&[(Parameter::SpecTrans, 1.0), (Parameter::Roughness, roughness)])
}

/// Puts `world` under a sky of one grey value a pixel, row by row from the top.
pub(crate) fn set_sky(world: &mut Scene, [width, height]: [u32; 2], values: Vec<f32>) {
    let image = ImageId(world.images.len() as u32);
    let pixels = Pixels::F32(values);
    world.images.push(Arc::new(Image { name: "sky".into(), width, height, channels: 1, pixels }));
    let map = EnvironmentMap::Image { image, mapping: Equirectangular::YUp };
    let color = Rgb::new(1.0, 0.9, 0.8);
    world.environment = Some(Environment { map, color, intensity: 1.0, rotation: 0.4 });
}

/// `material` that also emits `radiance` on both sides.
pub(crate) fn emitting(material: Material, radiance: f32) -> Material {
    let color = Param::Constant(Rgb::grey(radiance));
    Material { emission: Emission { color, strength: 1.0, sides: Sides::Both, unlit: false }, ..material }
}

/// A closed sphere of flat triangles, facing outwards.
pub(crate) fn sphere(radius: f32, center: Vec3, rings: u32) -> Mesh {
    let segments = 2 * rings;
    let mut positions = Vec::new();
    for ring in 0..=rings {
        for segment in 0..segments {
            let theta = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let phi = std::f64::consts::TAU * f64::from(segment) / f64::from(segments);
            let (st, ct) = (libm::sin(theta), libm::cos(theta));
            let p = glam::DVec3::new(st * libm::cos(phi), ct, -st * libm::sin(phi));
            positions.push(p.as_vec3() * radius + center);
        }
    }
    // One vertex a pole, or rays would slip between copies that round differently.
    for segment in 0..segments {
        positions[segment as usize] = center + Vec3::Y * radius;
        positions[(rings * segments + segment) as usize] = center - Vec3::Y * radius;
    }
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let next = (segment + 1) % segments;
            let at = |r: u32, s: u32| r * segments + s;
            if ring > 0 {
                triangles.push([at(ring, segment), at(ring + 1, segment), at(ring, next)]);
            }
            if ring + 1 < rings {
                triangles.push([at(ring, next), at(ring + 1, segment), at(ring + 1, next)]);
            }
        }
    }
    Mesh { name: "sphere".into(), positions, triangles, ..Mesh::default() }
}

/// A square of side 2·`half` in the plane y = `height`, facing up.
pub(crate) fn square(half: f32, height: f32) -> Mesh {
    let v = |x: f32, z: f32| Vec3::new(x * half, height, z * half);
    Mesh {
        name: "square".into(),
        positions: vec![v(-1.0, -1.0), v(-1.0, 1.0), v(1.0, 1.0), v(1.0, -1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A scene of meshes with their materials, seen by `camera`.
pub(crate) fn scene(parts: Vec<(Mesh, Material)>, camera: Camera) -> Scene {
    let mut scene = Scene::empty();
    for (i, (mesh, material)) in parts.into_iter().enumerate() {
        scene.meshes.push(Arc::new(mesh));
        scene.materials.push(Named::new(format!("m{i}"), material));
        scene.instances.push(Instance {
            name: format!("i{i}"),
            mesh: MeshId(i as u32),
            material: MaterialId(i as u32),
            world_from_object: Affine3A::IDENTITY,
        });
    }
    scene.cameras.push(Named::new("camera", camera));
    scene
}

/// Renders `scene`.
pub(crate) fn render_scene(scene: &Scene, settings: &RenderSettings) -> Rendered {
    let geometry = Arc::new(Geometry::build(scene).expect("geometry"));
    let prepared = Prepared::new(Arc::new(scene.clone()), geometry, settings).expect("prepared");
    render(&prepared, &Control::default())
}

/// Settings for a small image.
pub(crate) fn small(width: u32, height: u32, spp: u32, max_depth: u32) -> RenderSettings {
    RenderSettings { width: Some(width), height: Some(height), spp, max_depth, ..RenderSettings::default() }
}

/// Mean of the red channel of the picture.
pub(crate) fn mean(rendered: &Rendered) -> f64 {
    let [r, _, _] = rendered.raster.picture().rgb().expect("a colour picture");
    r.iter().map(|&v| f64::from(v)).sum::<f64>() / r.len() as f64
}

/// The largest |pixel/exact - 1| of the red channel.
pub(crate) fn largest_error(rendered: &Rendered, exact: f64) -> f64 {
    let [r, _, _] = rendered.raster.picture().rgb().expect("a colour picture");
    r.iter().map(|&v| (f64::from(v) / exact - 1.0).abs()).fold(0.0, f64::max)
}

/// A closed cube of half side `half` around the origin, facing outwards.
pub(crate) fn cube(half: f32) -> Mesh {
    let positions = (0..8)
        .map(|i| {
            let side = |bit: u32| if i >> bit & 1 == 1 { half } else { -half };
            Vec3::new(side(0), side(1), side(2))
        })
        .collect();
    let triangles = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    Mesh { name: "cube".into(), positions, triangles: triangles.to_vec(), ..Mesh::default() }
}

/// A cube's inside whose ceiling is open where z < 0; the opening is [`skylight`].
pub(crate) fn room_with_skylight(material: Material) -> Vec<(Mesh, Material)> {
    let mut walls = cube(0.5);
    walls.triangles.retain(|t| !t.iter().all(|&c| walls.positions[c as usize].y > 0.0));
    let mut ceiling = skylight();
    for p in &mut ceiling.positions {
        p.z += 0.5;
    }
    vec![(walls, material.clone()), (ceiling, material)]
}

/// The half of the plane y = ½ over the room where z < 0.
pub(crate) fn skylight() -> Mesh {
    let at = |x: f32, z: f32| Vec3::new(x, 0.5, z);
    let positions = vec![at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.0), at(-0.5, 0.0)];
    Mesh { name: "skylight".into(), positions, triangles: vec![[0, 2, 1], [0, 3, 2]], ..Mesh::default() }
}

/// The three colour channels `NAME.R`, `NAME.G` and `NAME.B` of the data part.
pub(crate) fn layer<'a>(rendered: &'a Rendered, name: &str) -> [&'a [f32]; 3] {
    let data = rendered.raster.layers.iter().find(|l| l.name == "data").expect("a data part");
    ["R", "G", "B"].map(|c| &data.channel(&format!("{name}.{c}")).expect("a channel").values[..])
}
