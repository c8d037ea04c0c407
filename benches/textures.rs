//! How fast textures are looked up: `cargo bench --bench textures`. Each figure is the time of [`BATCH`] look-ups.

use divan::{Bencher, black_box};
use glam::Vec2;
use pipeline::math::hash;
use pipeline::scene::texture::{Encoding, Pixels, TexelFilter, Wrap};
use pipeline::scene::{Image, ImageId, Texture};

/// Look-ups a measurement makes, each elsewhere.
const BATCH: u32 = 1024;

/// Columns and rows of the image: with three channels of 8 bits 12 MiB, more than most caches hold.
const SIZE: u32 = 2048;

/// What an image's values are.
#[derive(Clone, Copy, Debug)]
enum Stored {
    Srgb8,
    Linear8,
    Linear16,
    Float,
}

const STORED: [Stored; 4] = [Stored::Srgb8, Stored::Linear8, Stored::Linear16, Stored::Float];

fn main() {
    divan::main();
}

/// 32 bits for a number and a purpose.
fn random(call: u32, purpose: u64) -> u32 {
    (hash::combine(u64::from(call), purpose) >> 32) as u32
}

/// An image of noise with three channels, and a texture of it.
fn texture(stored: Stored, filter: TexelFilter) -> (Image, Texture) {
    let noise = (0..SIZE * SIZE * 3).map(|i| random(i, 0));
    let pixels = match stored {
        Stored::Srgb8 | Stored::Linear8 => Pixels::U8(noise.map(|bits| (bits >> 24) as u8).collect()),
        Stored::Linear16 => Pixels::U16(noise.map(|bits| (bits >> 16) as u16).collect()),
        Stored::Float => Pixels::F32(noise.map(hash::unit_f32).collect()),
    };
    let image = Image { name: "noise".into(), width: SIZE, height: SIZE, channels: 3, pixels };
    let encoding = match stored {
        Stored::Srgb8 => Encoding::Srgb,
        Stored::Linear8 | Stored::Linear16 | Stored::Float => Encoding::Linear,
    };
    (image, Texture { image: ImageId(0), encoding, wrap: [Wrap::Repeat; 2], filter })
}

/// Along a row, half a pixel apart, as neighbouring paths that meet a surface.
fn coherent() -> Vec<Vec2> {
    (0..BATCH).map(|call| Vec2::new(call as f32 * 0.5, 0.3 * SIZE as f32) / SIZE as f32).collect()
}

/// All over the image and its repetitions, as scattered paths.
fn scattered() -> Vec<Vec2> {
    (0..BATCH).map(|call| Vec2::from([1, 2].map(|d| hash::unit_f32(random(call, d)) * 4.0 - 2.0))).collect()
}

fn look_up(bencher: Bencher<'_, '_>, stored: Stored, filter: TexelFilter, places: &[Vec2]) {
    let (image, texture) = texture(stored, filter);
    bencher.bench(|| {
        for &uv in places {
            black_box(texture.sample(&image, black_box(uv)));
        }
    });
}

#[divan::bench(args = STORED)]
fn nearest_coherent(bencher: Bencher<'_, '_>, stored: Stored) {
    look_up(bencher, stored, TexelFilter::Nearest, &coherent());
}

#[divan::bench(args = STORED)]
fn nearest_scattered(bencher: Bencher<'_, '_>, stored: Stored) {
    look_up(bencher, stored, TexelFilter::Nearest, &scattered());
}

#[divan::bench(args = STORED)]
fn bilinear_coherent(bencher: Bencher<'_, '_>, stored: Stored) {
    look_up(bencher, stored, TexelFilter::Bilinear, &coherent());
}

#[divan::bench(args = STORED)]
fn bilinear_scattered(bencher: Bencher<'_, '_>, stored: Stored) {
    look_up(bencher, stored, TexelFilter::Bilinear, &scattered());
}
