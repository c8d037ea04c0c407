//! Images and how they are sampled. 8-bit data stays 8 bits wide and is decoded per texel.

use glam::Vec2;

use crate::color::{Rgb, linear_from_srgb};

/// Pixels in memory, row-major from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// For messages: the file, or the name inside it.
    pub name: String,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Interleaved channels a pixel: 1 (grey), 2 (grey, alpha), 3 or 4.
    pub channels: u8,
    /// The values, width · height · channels of them, if it was decoded.
    pub pixels: Pixels,
}

impl Image {
    /// The memory that its values take, in bytes.
    pub fn bytes(&self) -> u64 {
        match &self.pixels {
            Pixels::U8(values) => size_of_val(values.as_slice()) as u64,
            Pixels::U16(values) => size_of_val(values.as_slice()) as u64,
            Pixels::F32(values) => size_of_val(values.as_slice()) as u64,
            Pixels::Undecoded => 0,
        }
    }

    /// The image called `name` that nothing samples; its size stays unknown.
    pub fn undecoded(name: String) -> Self {
        Self { name, width: 1, height: 1, channels: 1, pixels: Pixels::Undecoded }
    }

    /// Whether its pixels are there.
    pub fn is_decoded(&self) -> bool {
        self.pixels != Pixels::Undecoded
    }
}

/// The values of an image.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// [0, 255] for [0, 1].
    U8(Vec<u8>),
    /// [0, 65535] for [0, 1].
    U16(Vec<u16>),
    /// Floats, finite.
    F32(Vec<f32>),
    /// None: nothing that is seen samples the image, so it was not decoded. It reads as white.
    Undecoded,
}

/// An image with its encoding and sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The image.
    pub image: super::ImageId,
    /// What its colour values mean.
    pub encoding: Encoding,
    /// Outside [0, 1], horizontally and vertically.
    pub wrap: [Wrap; 2],
    /// Between texels.
    pub filter: TexelFilter,
}

/// What the stored values of a texture mean; alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// As they are.
    Linear,
    /// sRGB's curve.
    Srgb,
}

/// Texture coordinates outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every other one mirrored.
    Mirror,
    /// The edge's texels go on.
    Clamp,
}

/// Between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TexelFilter {
    /// Weighted by distance.
    #[default]
    Bilinear,
    /// The nearest one.
    Nearest,
}

named_variants! { Encoding { Linear "linear", Srgb "srgb", } }
named_variants! { Wrap { Repeat "repeat", Mirror "mirror", Clamp "clamp", } }
named_variants! { TexelFilter { Bilinear "bilinear", Nearest "nearest", } }

/// A decoded texel: linear colour and alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Linear colour.
    pub color: Rgb,
    /// Alpha, 1 where the image has none.
    pub alpha: f32,
}

impl Image {
    /// The texel at a pixel inside the image.
    #[inline]
    pub fn texel(&self, x: u32, y: u32, encoding: Encoding) -> Texel {
        let [texel] = self.texels([(x, y)], encoding);
        texel
    }

    /// The texels at pixels inside the image: what they are stored as is asked once for all.
    #[inline]
    pub fn texels<const N: usize>(&self, places: [(u32, u32); N], encoding: Encoding) -> [Texel; N] {
        let channels = usize::from(self.channels);
        let stored = |(x, y): (u32, u32)| {
            let first = (y as usize * self.width as usize + x as usize) * channels;
            first..first + channels
        };
        let decode = |value: f32| match encoding {
            Encoding::Linear => value,
            Encoding::Srgb => linear_from_srgb(value),
        };
        match (&self.pixels, encoding) {
            (Pixels::U8(v), Encoding::Linear) => {
                places.map(|place| Texel::of(&v[stored(place)], unit_of_u8, unit_of_u8))
            }
            (Pixels::U8(v), Encoding::Srgb) => {
                let table = srgb_table();
                places.map(|place| Texel::of(&v[stored(place)], |code| table[usize::from(code)], unit_of_u8))
            }
            (Pixels::U16(v), _) => places
                .map(|place| Texel::of(&v[stored(place)], |code| decode(unit_of_u16(code)), unit_of_u16)),
            (Pixels::F32(v), Encoding::Linear) => {
                places.map(|place| Texel::of(&v[stored(place)], |value| value, |alpha| alpha))
            }
            (Pixels::F32(v), Encoding::Srgb) => {
                places.map(|place| Texel::of(&v[stored(place)], linear_from_srgb, |alpha| alpha))
            }
            (Pixels::Undecoded, _) => [Texel { color: Rgb::WHITE, alpha: 1.0 }; N],
        }
    }
}

impl Texel {
    /// What the channels of a pixel say: grey, grey and alpha, colour, or colour and alpha.
    #[inline(always)]
    fn of<T: Copy>(stored: &[T], color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> Self {
        match *stored {
            [grey] => Self { color: Rgb::grey(color(grey)), alpha: 1.0 },
            [grey, a] => Self { color: Rgb::grey(color(grey)), alpha: alpha(a) },
            [r, g, b, a] => Self { color: Rgb::new(color(r), color(g), color(b)), alpha: alpha(a) },
            [r, g, b, ..] => Self { color: Rgb::new(color(r), color(g), color(b)), alpha: 1.0 },
            [] => Self { color: Rgb::WHITE, alpha: 1.0 },
        }
    }

    #[inline(always)]
    fn lerp(self, other: Self, t: f32) -> Self {
        Self { color: self.color.lerp(other.color, t), alpha: self.alpha * (1.0 - t) + other.alpha * t }
    }
}

#[inline(always)]
fn unit_of_u8(code: u8) -> f32 {
    f32::from(code) * (1.0 / 255.0)
}

#[inline(always)]
fn unit_of_u16(code: u16) -> f32 {
    f32::from(code) * (1.0 / 65535.0)
}

/// Linear values of all 8-bit sRGB codes.
fn srgb_table() -> &'static [f32; 256] {
    static TABLE: std::sync::OnceLock<[f32; 256]> = std::sync::OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)))
}

impl Wrap {
    /// The pixel in [0, size) that stands for `i`.
    #[inline]
    pub fn pixel(self, i: i64, size: u32) -> u32 {
        let n = i64::from(size);
        // Most are inside, and division is slow.
        if (0..n).contains(&i) {
            return i as u32;
        }
        let wrapped = match self {
            Self::Clamp => i.clamp(0, n - 1),
            Self::Repeat => i.rem_euclid(n),
            Self::Mirror => {
                let j = i.rem_euclid(2 * n);
                if j < n { j } else { 2 * n - 1 - j }
            }
        };
        wrapped as u32
    }
}

/// The largest whole number not above `t`, which must fit an i64, and the rest. Without SSE 4.1 `f32::floor` is a call.
#[inline(always)]
pub(crate) fn whole_and_rest(t: f32) -> (i64, f32) {
    let towards_zero = t as i64;
    let whole = towards_zero - i64::from(t < towards_zero as f32);
    (whole, t - whole as f32)
}

impl Texture {
    /// The filtered value at texture coordinates `uv` ((0, 0) is the top left corner of the image). Coordinates that are not
    /// finite read the first texel.
    pub fn sample(&self, image: &Image, uv: Vec2) -> Texel {
        // Beyond 2^31 the fraction is lost anyway, and `as i64` must not saturate into nonsense.
        let position = |t: f32, size: u32| {
            let p = t * size as f32;
            if p.is_finite() && p.abs() < 2.147e9 { p } else { 0.0 }
        };
        let (px, py) = (position(uv.x, image.width), position(uv.y, image.height));
        let column = |x: i64| self.wrap[0].pixel(x, image.width);
        let row = |y: i64| self.wrap[1].pixel(y, image.height);
        match self.filter {
            TexelFilter::Nearest => {
                image.texel(column(whole_and_rest(px).0), row(whole_and_rest(py).0), self.encoding)
            }
            TexelFilter::Bilinear => {
                let ((x, tx), (y, ty)) = (whole_and_rest(px - 0.5), whole_and_rest(py - 0.5));
                let (x0, x1, y0, y1) = (column(x), column(x + 1), row(y), row(y + 1));
                let places = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)];
                let [a, b, c, d] = image.texels(places, self.encoding);
                a.lerp(b, tx).lerp(c.lerp(d, tx), ty)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ImageId;

    fn two_by_one() -> (Image, Texture) {
        let image =
            Image { name: "test".into(), width: 2, height: 1, channels: 1, pixels: Pixels::U8(vec![0, 255]) };
        let texture = Texture {
            image: ImageId(0),
            encoding: Encoding::Linear,
            wrap: [Wrap::Repeat; 2],
            filter: TexelFilter::Bilinear,
        };
        (image, texture)
    }

    #[test]
    fn bilinear_meets_texel_centres_and_mixes_between() {
        let (image, texture) = two_by_one();
        let at = |u: f32| texture.sample(&image, Vec2::new(u, 0.5)).color.r;
        assert_eq!(at(0.25), 0.0);
        assert_eq!(at(0.75), 1.0);
        assert_eq!(at(0.5), 0.5);
        assert_eq!(at(0.0), 0.5, "repeats across the edge");
        assert_eq!(at(-0.75), 0.0);
    }

    #[test]
    fn wraps_name_the_right_pixel() {
        assert_eq!([-1, 0, 2, 3].map(|i| Wrap::Repeat.pixel(i, 3)), [2, 0, 2, 0]);
        assert_eq!([-1, 0, 2, 3].map(|i| Wrap::Mirror.pixel(i, 3)), [0, 0, 2, 2]);
        assert_eq!([-1, 0, 2, 3].map(|i| Wrap::Clamp.pixel(i, 3)), [0, 0, 2, 2]);
    }

    #[test]
    fn coordinates_that_are_not_finite_do_no_harm() {
        let (image, texture) = two_by_one();
        for u in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
            assert!(texture.sample(&image, Vec2::new(u, u)).color.is_finite());
        }
    }
}
