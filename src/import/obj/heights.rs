//! Height maps as normal maps.

use glam::Vec3;

use crate::scene::Image;
use crate::scene::material::TextureChannel;
use crate::scene::texture::{Encoding, Pixels, Wrap};

/// The tangent-space normals (x to the right, y up, [0, 65535] for [-1, 1]) of the heights in `channel` of `image`, of which 1 is one texel
/// high. A scale of x and y is one of the heights: the normal is normalize(-∂h/∂x, -∂h/∂y, 1) by central differences.
pub(super) fn normals(image: &Image, channel: TextureChannel, wrap: Wrap) -> Image {
    let (width, height) = (image.width, image.height);
    let at = |x: i64, y: i64| {
        channel.of(&image.texel(wrap.pixel(x, width), wrap.pixel(y, height), Encoding::Linear))
    };
    let mut pixels = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..i64::from(height) {
        for x in 0..i64::from(width) {
            let along_x = 0.5 * (at(x + 1, y) - at(x - 1, y));
            // Rows go downwards.
            let along_y = 0.5 * (at(x, y - 1) - at(x, y + 1));
            let normal = Vec3::new(-along_x, -along_y, 1.0).normalize_or(Vec3::Z);
            pixels.extend((normal * 0.5 + 0.5).to_array().map(|c| (c * 65535.0).round() as u16));
        }
    }
    let (stem, _) = image.name.rsplit_once('.').unwrap_or((&image.name, ""));
    Image { name: format!("{stem}-normals.png"), width, height, channels: 3, pixels: Pixels::U16(pixels) }
}

/// What the [`normals`] of an image take, in bytes.
pub(super) fn normals_bytes(image: &Image) -> u64 {
    u64::from(image.width) * u64::from(image.height) * 3 * size_of::<u16>() as u64
}

/// Texels that are looked at to tell normals from heights.
const LOOKED_AT: u32 = 4096;

/// Whether the image holds normals, not heights: nearly all texels are upward vectors of length 1, and they are not grey.
pub(super) fn are_normals(image: &Image) -> bool {
    if image.channels < 3 {
        return false;
    }
    let all = u64::from(image.width) * u64::from(image.height);
    let step = all.div_ceil(u64::from(LOOKED_AT)).max(1);
    let (mut looked, mut unit, mut coloured) = (0_u64, 0_u64, 0_u64);
    for i in (0..all).step_by(step as usize) {
        let (x, y) = ((i % u64::from(image.width)) as u32, (i / u64::from(image.width)) as u32);
        let c = image.texel(x, y, Encoding::Linear).color;
        let v = Vec3::new(c.r, c.g, c.b) * 2.0 - 1.0;
        looked += 1;
        // Compression and filtering shorten normals; only grey of 0.79 is a unit vector among greys.
        unit += u64::from(v.z > 0.0 && (0.8..1.2).contains(&v.length()));
        coloured += u64::from((c.b - c.r).abs().max((c.b - c.g).abs()) > 0.1);
    }
    10 * unit >= 9 * looked && 2 * coloured >= looked
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(channels: u8, pixels: Vec<u8>, width: u32) -> Image {
        let height = (pixels.len() / usize::from(channels)) as u32 / width;
        Image { name: "a/wall.bmp".into(), width, height, channels, pixels: Pixels::U8(pixels) }
    }

    fn normal(image: &Image, x: u32, y: u32) -> Vec3 {
        let c = image.texel(x, y, Encoding::Linear).color;
        Vec3::new(c.r, c.g, c.b) * 2.0 - 1.0
    }

    #[test]
    fn normals_lean_away_from_what_is_higher() {
        // Rising by half a texel a texel to the right.
        let ramp = image(1, vec![0, 51, 102, 0, 51, 102, 0, 51, 102], 3);
        let normals = normals(&ramp, TextureChannel::R, Wrap::Clamp);
        assert_eq!(normals.name, "a/wall-normals.png");
        let expected = Vec3::new(-0.2, 0.0, 1.0).normalize();
        assert!((normal(&normals, 1, 1) - expected).length() < 1e-4);
        // At the edge half of it, the texel beyond being the edge's own.
        assert!((normal(&normals, 0, 1) - Vec3::new(-0.1, 0.0, 1.0).normalize()).length() < 1e-4);
    }

    #[test]
    fn what_rises_upwards_in_the_picture_leans_down() {
        let ramp = image(1, vec![255, 255, 128, 128, 0, 0], 2);
        let n = normal(&normals(&ramp, TextureChannel::R, Wrap::Clamp), 0, 1);
        assert!(n.y < -0.4 && n.x.abs() < 1e-4, "{n}");
    }

    #[test]
    fn a_repeating_map_has_no_edge() {
        let heights = image(1, vec![0, 0, 255], 3);
        let left = normal(&normals(&heights, TextureChannel::R, Wrap::Repeat), 0, 0);
        assert!(left.x > 0.4, "the texel to its left is the last one: {left}");
    }

    #[test]
    fn normals_are_told_from_heights() {
        let blue: Vec<u8> = (0..64).flat_map(|i| [118 + i % 20, 138 - i % 20, 254]).collect();
        assert!(are_normals(&image(3, blue, 8)));
        // 202 is the grey whose vector has length 1.
        for grey in [0, 128, 202, 255] {
            assert!(!are_normals(&image(3, vec![grey; 192], 8)), "{grey}");
            assert!(!are_normals(&image(1, vec![grey; 64], 8)));
        }
        let bricks: Vec<u8> = (0..64).flat_map(|i| [150 + i, 60, 40]).collect();
        assert!(!are_normals(&image(3, bricks, 8)), "a photograph taken for heights");
    }
}
