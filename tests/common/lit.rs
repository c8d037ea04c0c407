//! Scenes in which light takes every kind of way, and whether two ways to render one have the same expectation.

use std::sync::Arc;
use std::time::Duration;

use glam::{Vec2, Vec3};
use pipeline::color::Rgb;
use pipeline::disney::{Model, Parameter};
use pipeline::render::{Control, Geometry, Prepared, Rendered, render};
use pipeline::scene::camera::{Aperture, Lens};
use pipeline::scene::material::{NormalMap, Param, Sides, TextureChannel, TextureMap};
use pipeline::scene::texture::{Encoding, Image, Pixels, TexelFilter, Texture, Wrap};
use pipeline::scene::{Camera, ImageId, Material, Mesh, Scene, TextureId};
use pipeline::settings::{RenderSettings, Use};

use super::{cube, disney, emitting, glass, lambert, metal, scene, set_sky, sphere, square};

/// A coarse ball with smooth normals: what it reflects is not reciprocal.
pub(crate) fn ball(radius: f32, center: Vec3) -> Mesh {
    let mut mesh = sphere(radius, center, 6);
    mesh.normals = mesh.positions.iter().map(|p| (*p - center).normalize()).collect();
    mesh
}

/// A square of half the side `half` around `center` that looks along `normal`.
pub(crate) fn facing(half: f32, center: Vec3, normal: Vec3) -> Mesh {
    let mut mesh = square(half, 0.0);
    let turn = glam::Quat::from_rotation_arc(Vec3::Y, normal.normalize());
    mesh.positions.iter_mut().for_each(|p| *p = turn * *p + center);
    mesh.normals.iter_mut().for_each(|n| *n = turn * *n);
    mesh
}

pub(crate) fn lamp() -> (Mesh, Material) {
    (facing(0.2, Vec3::new(0.9, 2.2, 0.3), Vec3::new(-0.3, -1.0, 0.0)), emitting(lambert(0.0), 30.0))
}

pub(crate) fn walls() -> Vec<(Mesh, Material)> {
    vec![(square(2.0, 0.0), lambert(0.6)), (facing(2.0, Vec3::new(0.0, 1.0, -2.0), Vec3::Z), lambert(0.5))]
}

pub(crate) fn camera() -> Camera {
    Camera::look_at(Vec3::new(0.0, 1.2, 4.5), Vec3::Y * 0.6, Vec3::Y, 0.6)
}

pub(crate) fn shiny() -> Scene {
    let mut parts = walls();
    parts.push((ball(0.55, Vec3::new(-0.7, 0.6, 0.0)), metal(0.25)));
    parts.push((ball(0.4, Vec3::new(0.6, 0.4, 0.5)), disney(&[(Parameter::Clearcoat, 1.0)])));
    parts.push(lamp());
    scene(parts, camera())
}

/// Smooth glass with smooth normals, rough glass that absorbs, a mirror and a clear sheet between lamp and floor, through a lens.
pub(crate) fn clear() -> Scene {
    glassy(true)
}

/// The same without sheets and lens.
pub(crate) fn bottled() -> Scene {
    glassy(false)
}

fn glassy(with_sheets: bool) -> Scene {
    let mut tinted = glass(0.3);
    tinted.absorption = Rgb::new(0.4, 1.0, 2.0);
    let sheet = Material { thin_walled: true, ..glass(0.0) };
    let mirror = Material { model: Model::Mirror, ..Material::default() };
    let mut block = cube(0.3);
    block.positions.iter_mut().for_each(|p| *p += Vec3::new(0.7, 0.35, 0.5));
    let mut parts = walls();
    parts.push((ball(0.5, Vec3::new(-0.6, 0.6, 0.0)), glass(0.0)));
    parts.push((block, tinted));
    if with_sheets {
        parts.push((facing(0.6, Vec3::new(0.4, 1.6, 0.3), Vec3::new(0.2, 1.0, 0.0)), sheet.clone()));
    }
    parts.push((facing(0.7, Vec3::new(-1.9, 1.0, 0.0), Vec3::X), mirror));
    parts.push(lamp());
    // A lamp that the camera sees through another sheet.
    parts.push((facing(0.2, Vec3::new(1.1, 1.2, -1.5), Vec3::Z), emitting(lambert(0.0), 4.0)));
    let mut camera = camera();
    if !with_sheets {
        return scene(parts, camera);
    }
    parts.push((facing(0.4, Vec3::new(0.8, 1.2, 1.0), Vec3::Z), sheet));
    camera.lens = Some(Lens { radius: 0.05, focal_distance: 4.0, shape: Aperture::Disk });
    scene(parts, camera)
}

/// A shiny sheet and a mirror whose smooth normals lean over, all the same way: light is reflected as if they stood at an angle.
pub(crate) fn leaning() -> Scene {
    let leaning = |center: Vec3, normal: Vec3, towards: Vec3| {
        let mut mesh = facing(0.6, center, normal);
        mesh.normals = vec![(normal + towards * 0.45).normalize(); mesh.positions.len()];
        mesh
    };
    let mirror = Material { model: Model::Mirror, ..Material::default() };
    let mut parts = walls();
    parts.push((leaning(Vec3::new(-0.7, 0.5, 0.2), Vec3::Y, -Vec3::Z), metal(0.2)));
    parts.push((leaning(Vec3::new(1.0, 0.3, 0.2), Vec3::Y, -Vec3::X), mirror));
    parts.push(lamp());
    scene(parts, camera())
}

/// The camera is under water, the lamp above it: light is bent once on its way.
pub(crate) fn submerged() -> Scene {
    let camera = Camera::look_at(Vec3::new(0.0, 0.9, 1.8), Vec3::ZERO, Vec3::Y, 0.7);
    let mut parts = walls();
    let absorption = Rgb::new(0.4, 0.1, 0.05);
    let white = Param::Constant(Rgb::WHITE);
    parts.push((square(2.5, 1.3), Material { base_color: white, absorption, ..glass(0.0) }));
    parts.push((ball(0.3, Vec3::new(0.5, 0.3, 0.0)), lambert(0.7)));
    parts.push((facing(0.8, Vec3::new(0.3, 2.2, 0.0), -Vec3::Y), emitting(lambert(0.0), 4.0)));
    scene(parts, camera)
}

pub(crate) fn add_texture(world: &mut Scene, channels: u8, pixels: Vec<f32>) -> TextureMap {
    world.images.push(Arc::new(Image {
        name: "map".into(),
        width: (pixels.len() / usize::from(channels)) as u32,
        height: 1,
        channels,
        pixels: Pixels::F32(pixels),
    }));
    world.textures.push(Texture {
        image: ImageId(world.images.len() as u32 - 1),
        encoding: Encoding::Linear,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Nearest,
    });
    TextureMap::new(TextureId(world.textures.len() as u32 - 1), TextureChannel::R)
}

/// A lamp of two colours that shines to both sides and is partly there, mapped normals that lean far over, a leaf, and half a screen.
pub(crate) fn mapped() -> Scene {
    partly_there(0.7, 0.5)
}

/// The same where all is there.
pub(crate) fn covered() -> Scene {
    partly_there(1.0, 1.0)
}

fn partly_there(lamp_alpha: f32, screen_alpha: f32) -> Scene {
    let with_coordinates = |mut mesh: Mesh| {
        mesh.uvs = vec![mesh.positions.iter().map(|p| Vec2::new(p.x + 0.37 * p.y, p.z + p.y)).collect()];
        mesh
    };
    let leaf = Material { thin_walled: true, ..disney(&[(Parameter::DiffTrans, 1.5)]) };
    let (lamp, mut shining) = lamp();
    shining.emission.sides = Sides::Both;
    shining.opacity.alpha = Param::Constant(lamp_alpha);
    let mut screen = lambert(0.3);
    screen.opacity.alpha = Param::Constant(screen_alpha);
    let mut parts = walls();
    parts.push((with_coordinates(ball(0.55, Vec3::new(-0.6, 0.6, 0.0))), metal(0.3)));
    parts.push((facing(0.5, Vec3::new(0.5, 1.5, 0.2), Vec3::new(0.2, 1.0, 0.0)), leaf));
    parts.push((facing(0.5, Vec3::new(0.5, 0.9, 0.4), Vec3::new(0.1, 1.0, 0.0)), screen));
    parts.push((with_coordinates(lamp), shining));
    let mirror = Material { model: Model::Mirror, ..Material::default() };
    parts.push((with_coordinates(facing(0.6, Vec3::new(1.5, 0.6, 0.3), -Vec3::X)), mirror));
    let mut world = scene(parts, camera());
    let normals = add_texture(&mut world, 3, vec![0.85, 0.5, 0.75, 0.3, 0.2, 0.7, 0.5, 0.95, 0.6]);
    for material in [2, 6] {
        world.materials[material].item.normal_map = Some(NormalMap { map: normals.clone(), scale: 1.0 });
    }
    let colors = add_texture(&mut world, 3, vec![1.0, 0.2, 0.1, 0.1, 0.6, 1.0]);
    world.materials[5].item.emission.color = Param::Texture { map: colors, factor: Rgb::grey(40.0) };
    world
}

/// A sky with a sun, which light reaches the floor from by way of a mirror and of glass, and a lamp.
pub(crate) fn sunny() -> Scene {
    let (width, height) = (32u32, 16u32);
    let mut values: Vec<f32> = (0..width * height).map(|i| 0.5 - 0.02 * (i / width) as f32).collect();
    values[(3 * width + 5) as usize] = 300.0;
    let mut parts = walls();
    parts.push((ball(0.55, Vec3::new(-0.7, 0.6, 0.0)), metal(0.2)));
    parts.push((ball(0.5, Vec3::new(0.7, 0.6, 0.3)), glass(0.0)));
    parts.push(lamp());
    let mut world = scene(parts, camera());
    set_sky(&mut world, [width, height], values);
    world
}

pub(crate) fn prepared(world: &Scene, settings: &RenderSettings) -> Prepared {
    let geometry = Arc::new(Geometry::build(world).expect("geometry"));
    Prepared::new(Arc::new(world.clone()), geometry, settings).expect("prepared")
}

pub(crate) fn rendered(world: &Arc<Scene>, settings: &RenderSettings) -> Rendered {
    rendered_within(None, world, settings)
}

pub(crate) fn rendered_within(
    time_limit: Option<Duration>,
    world: &Arc<Scene>,
    settings: &RenderSettings,
) -> Rendered {
    let prepared = prepared(world, settings);
    assert_eq!(prepared.has_light_paths(), settings.light_paths != Use::Never);
    assert_eq!(prepared.has_path_reuse(), settings.path_reuse != Use::Never);
    let control = Control { time_limit, ..Control::default() };
    let rendered = render(&prepared, &control);
    assert_eq!(rendered.counts.bad_samples, 0, "{:?} {settings:?}", rendered.counts.first_bad_samples);
    rendered
}

/// The means of the picture's tiles of 8 × 8 pixels, three channels each.
pub(crate) fn tiles(rendered: &Rendered) -> Vec<f64> {
    let channels = rendered.raster.picture().rgb().expect("colour");
    let (width, height) = (32, 24);
    let mean = |channel: &[f32], x0: usize, y0: usize| {
        let sum: f64 = (0..64).map(|i| f64::from(channel[(y0 + i / 8) * width + x0 + i % 8])).sum();
        sum / 64.0
    };
    let starts = |length: usize| (0..length).step_by(8);
    let places = starts(height).flat_map(|y| starts(width).map(move |x| (x, y)));
    places.flat_map(|(x, y)| channels.map(|channel| mean(channel, x, y))).collect()
}

/// The mean of each tile over seeds, and its variance; and last of all tiles' sum, of which channels and neighbours are not independent.
pub(crate) fn pooled(
    world: &Arc<Scene>,
    settings: &RenderSettings,
    seeds: std::ops::Range<u64>,
) -> Vec<(f64, f64)> {
    let n = seeds.clone().count() as f64;
    let run = |seed| {
        let mut tiles = tiles(&rendered(world, &RenderSettings { seed, ..settings.clone() }));
        tiles.push(tiles.iter().sum());
        tiles
    };
    let runs: Vec<_> = seeds.map(run).collect();
    (0..runs[0].len())
        .map(|tile| {
            let mean = runs.iter().map(|run| run[tile]).sum::<f64>() / n;
            let squares = runs.iter().map(|run| (run[tile] - mean) * (run[tile] - mean));
            (mean, squares.sum::<f64>() / (n - 1.0) / n)
        })
        .collect()
}

/// Every part of the two pictures has the same mean, as far as 16 seeds of each tell; `what` names them.
#[track_caller]
pub(crate) fn assert_same_means(what: &str, world: &Arc<Scene>, a: &RenderSettings, b: &RenderSettings) {
    let (a, b) = (pooled(world, a, 0..16), pooled(world, b, 16..32));
    let total = a.len() - 1;
    for (tile, (&(a, va), &(b, vb))) in a.iter().zip(&b).enumerate() {
        let sigma = (va + vb).sqrt();
        if tile < total {
            // One of 144 tiles and channels, of Student's distribution with some 20 degrees of freedom.
            assert!((a - b).abs() < 5.5 * sigma, "{what}, tile {tile}: {a} {b} ± {sigma}");
        } else {
            assert!((a - b).abs() < 4.0 * sigma, "{what}: {a} {b} ± {sigma}");
            // Or the test could not fail.
            assert!(sigma < 0.003 * b, "{what}: {b} ± {sigma}");
        }
    }
}

/// Walls and a dull ball.
pub(crate) fn dull() -> Scene {
    let mut parts = walls();
    parts.push((sphere(0.5, Vec3::new(-0.5, 0.6, 0.0), 12), lambert(0.4)));
    parts.push(lamp());
    scene(parts, camera())
}

/// One, two and five threads make the same picture.
#[track_caller]
pub(crate) fn assert_same_on_any_threads(world: &Arc<Scene>, settings: &RenderSettings) {
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
        pool.install(|| rendered(world, settings))
    };
    let one = with_threads(1);
    for n in [2, 5] {
        let many = with_threads(n);
        assert_eq!(one.raster, many.raster);
        assert_eq!(one.counts, many.counts);
    }
}

/// A ball in the open, of which the picture shows mostly the sky.
pub(crate) fn open(radius: f32) -> Scene {
    let mut world = scene(vec![(ball(radius, Vec3::Y), lambert(0.6))], camera());
    set_sky(
        &mut world,
        [8, 4],
        (0..32).map(|i| if i == 11 { 6.0 } else { 0.2 + 0.01 * (i % 5) as f32 }).collect(),
    );
    world
}

/// The error of four renders relative to a long one, and the rays that they take.
pub(crate) fn error_and_rays(
    world: &Arc<Scene>,
    settings: &RenderSettings,
    long: &RenderSettings,
) -> (f64, f64) {
    let reference = rendered(world, long).raster.picture().rgb().expect("colour").map(<[f32]>::to_vec);
    let (mut error, mut rays) = (0.0, 0.0);
    for seed in 0..4 {
        let rendered = rendered(world, &RenderSettings { seed, ..settings.clone() });
        rays += rendered.counts.rays as f64;
        let picture = rendered.raster.picture().rgb().expect("colour");
        let values = picture.into_iter().flatten().zip(reference.iter().flatten());
        error += values.map(|(x, r)| f64::from((x - r) * (x - r)) / f64::from(r * r + 0.01)).sum::<f64>();
    }
    (error, rays)
}
