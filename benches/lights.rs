//! How fast lights are sampled: `cargo bench --bench lights`. Each figure is the time of [`BATCH`] calls.

use std::sync::Arc;

use divan::{Bencher, black_box};
use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::light::{
    EmissiveTriangle, EnvironmentLight, EnvironmentTable, EnvironmentTables, LightPlace, Lights, Partner,
    Receiver,
};
use pipeline::math::hash;
use pipeline::scene::environment::{Environment, EnvironmentMap, Equirectangular};
use pipeline::scene::material::Sides;
use pipeline::scene::texture::Pixels;
use pipeline::scene::{Image, ImageId};

/// Calls a measurement makes, each with other places and numbers.
const BATCH: u32 = 1024;

/// Emitting triangles: a quad, many, and very many.
const COUNTS: [u32; 3] = [2, 1000, 100_000];

fn main() {
    divan::main();
}

/// A number in [0, 1).
fn unit(call: u32, dimension: u64) -> f32 {
    hash::unit_f32((hash::combine(u64::from(call), dimension) >> 32) as u32)
}

fn anywhere(call: u32, dimension: u64) -> Vec3 {
    Vec3::from([0, 1, 2].map(|d| unit(call, dimension + d))) * 2.0 - 1.0
}

fn numbers(call: u32) -> [f32; 4] {
    [0, 1, 2, 3].map(|d| unit(call, d))
}

/// Quads all over a room, the smaller the more there are.
fn triangles(count: u32) -> Vec<EmissiveTriangle> {
    let size = 0.5 / (count as f32).sqrt();
    (0..count)
        .map(|i| {
            let quad = i / 2;
            let (corner, normal) = (anywhere(quad, 10), anywhere(quad, 13).normalize());
            let u = normal.any_orthonormal_vector() * size;
            let v = normal.cross(u);
            let vertices = match i % 2 {
                0 => [corner, corner + u, corner + u + v],
                _ => [corner, corner + u + v, corner + v],
            };
            let mean_radiance = Rgb::grey(0.1 + unit(quad, 16));
            EmissiveTriangle { triangle: i, vertices, mean_radiance, sides: Sides::Both, is_mirrored: false }
        })
        .collect()
}

fn lights(count: u32) -> Lights {
    Lights::new(&triangles(count), &[], None, (Vec3::ZERO, 2.0))
}

fn receivers() -> Vec<Receiver> {
    (0..BATCH)
        .map(|call| Receiver {
            point: anywhere(call, 20),
            normal: anywhere(call, 23).normalize(),
            sides: Sides::Front,
            gloss: None,
        })
        .collect()
}

#[divan::bench(args = COUNTS)]
fn build(bencher: Bencher<'_, '_>, count: u32) {
    let triangles = triangles(count);
    bencher.bench(|| Lights::new(black_box(&triangles), &[], None, (Vec3::ZERO, 2.0)));
}

#[divan::bench(args = COUNTS)]
fn sample(bencher: Bencher<'_, '_>, count: u32) {
    let (lights, receivers) = (lights(count), receivers());
    bencher.bench(|| {
        for (call, receiver) in (0..).zip(&receivers) {
            black_box(lights.sample(receiver, numbers(call)));
        }
    });
}

#[divan::bench(args = COUNTS)]
fn pdf(bencher: Bencher<'_, '_>, count: u32) {
    let (lights, receivers) = (lights(count), receivers());
    let hits: Vec<_> = (0..)
        .zip(&receivers)
        .filter_map(|(call, receiver)| {
            let sample = lights.sample(receiver, numbers(call))?;
            let LightPlace::Surface { triangle, .. } = sample.place else { return None };
            Some((receiver, triangle, sample.wi))
        })
        .collect();
    bencher.bench(|| {
        for &(receiver, triangle, wi) in &hits {
            black_box(lights.pdf_triangle(receiver, triangle, wi, 1.0));
        }
    });
}

/// Clouds, and a sun of a few pixels.
fn sky() -> Arc<Image> {
    let (width, height) = (2048u32, 1024u32);
    let pixels = (0..width * height)
        .map(|i| if i % width / 4 == 99 && i / width / 4 == 70 { 1e4 } else { unit(i / 64, 0) });
    let pixels = Pixels::F32(pixels.collect());
    Arc::new(Image { name: "sky".into(), width, height, channels: 1, pixels })
}

fn environment() -> EnvironmentLight {
    let map = EnvironmentMap::Image { image: ImageId(0), mapping: Equirectangular::YUp };
    let environment = Environment { map, color: Rgb::WHITE, intensity: 1.0, rotation: 0.3 };
    EnvironmentLight::new(&environment, Some(&sky()), Partner::Bsdf, &EnvironmentTables::default())
}

#[divan::bench]
fn environment_build(bencher: Bencher<'_, '_>) {
    let sky = sky();
    bencher.bench(|| EnvironmentTable::new(black_box(&sky), Equirectangular::YUp, Partner::Bsdf));
}

#[divan::bench]
fn environment_sample(bencher: Bencher<'_, '_>) {
    let environment = environment();
    bencher.bench(|| {
        for call in 0..BATCH {
            black_box(environment.sample(Some(Vec3::Y), [unit(call, 0), unit(call, 1)], [0.5; 2]));
        }
    });
}

#[divan::bench]
fn environment_look_up_with_pdf(bencher: Bencher<'_, '_>) {
    let environment = environment();
    let directions: Vec<Vec3> = (0..BATCH).map(|call| anywhere(call, 0).normalize()).collect();
    bencher.bench(|| {
        for &wi in &directions {
            let place = environment.place(wi);
            black_box((environment.radiance_at(place), environment.pdf(Some(Vec3::Y), place)));
        }
    });
}
