//! Textures as Mitsuba's `bitmap` reads them: factors and channels are worked into the pixels, and each file is written once.

use std::path::Path;

use glam::{Affine2, Affine3A, Mat3A, Vec3A};

use super::element::Element;
use crate::color::Rgb;
use crate::export::names::{Identifiers, file_stem};
use crate::imagefile::{ImageFileError, Interleaved, encode_texture};
use crate::scene::material::{TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, Image, Pixels, Texel, TexelFilter, Texture, Wrap};
use crate::scene::{ImageId, Material, Scene};

/// A power of a colour's channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Power {
    Root,
    One,
    Square,
}

impl Power {
    pub(super) fn of(self, value: f32) -> f32 {
        match self {
            Self::Root => value.sqrt(),
            Self::One => value,
            Self::Square => value * value,
        }
    }
}

/// What a parameter makes of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reading {
    /// A power of its colour times a factor.
    Color(Rgb, Power),
    /// A channel times a factor.
    Scalar(TextureChannel, f32),
    /// 1 where a channel times a factor reaches the last value, else 0.
    Cut(TextureChannel, f32, f32),
    /// Its colour times a factor, where it is there: times what [`Self::Scalar`] or, with a last value, [`Self::Cut`] say.
    Shining(Rgb, TextureChannel, f32, Option<f32>),
    /// A tangent-space normal whose x and y are multiplied by the scale.
    Normal(f32),
}

impl Reading {
    /// The values of a texel.
    fn of(self, texel: &Texel) -> Vec<f32> {
        match self {
            Self::Color(factor, power) => (texel.color * factor).map(|v| power.of(v)).to_array().into(),
            Self::Scalar(channel, factor) => vec![channel.of(texel) * factor],
            Self::Cut(channel, factor, least) => {
                vec![if channel.of(texel) * factor >= least { 1.0 } else { 0.0 }]
            }
            Self::Shining(factor, channel, of_alpha, least) => {
                let cover =
                    least.map_or(Self::Scalar(channel, of_alpha), |l| Self::Cut(channel, of_alpha, l));
                (texel.color * factor * cover.of(texel)[0]).to_array().into()
            }
            Self::Normal(scale) => {
                let Rgb { r, g, b } = texel.color;
                let scaled = |v: f32| 0.5 + (v - 0.5) * scale;
                vec![scaled(r), scaled(g), b]
            }
        }
    }

    /// The channels of an image that can stay the bytes they are, if this is all that is read of it.
    fn kept_channels(self, image: &Image, encoding: Encoding) -> Option<Vec<usize>> {
        let channels = usize::from(image.channels);
        let kept = match self {
            Self::Color(factor, Power::One) if factor == Rgb::WHITE => (0..channels).collect(),
            Self::Normal(scale) if scale == 1.0 && channels >= 3 && encoding == Encoding::Linear => {
                vec![0, 1, 2]
            }
            Self::Scalar(TextureChannel::A, factor) if factor == 1.0 && channels % 2 == 0 => {
                vec![channels - 1]
            }
            Self::Scalar(channel, factor)
                if factor == 1.0
                    && !matches!(channel, TextureChannel::A | TextureChannel::Y)
                    && encoding == Encoding::Linear =>
            {
                vec![if channels < 3 { 0 } else { channel as usize }]
            }
            _ => return None,
        };
        matches!(image.pixels, Pixels::U8(_)).then_some(kept)
    }
}

/// The textures of a scene that are used.
#[derive(Debug)]
pub(super) struct Textures<'s> {
    scene: &'s Scene<Material>,
    names: Identifiers,
    used: Vec<Used>,
}

#[derive(Debug)]
struct Used {
    image: ImageId,
    encoding: Encoding,
    reading: Reading,
    file: String,
}

impl<'s> Textures<'s> {
    pub(super) fn new(scene: &'s Scene<Material>) -> Self {
        Self { scene, names: Identifiers::default(), used: Vec::new() }
    }

    /// The texture element for the parameter `name`; its file will be written.
    pub(super) fn element(&mut self, name: &str, map: &TextureMap, reading: Reading) -> Element {
        let texture = &self.scene.textures[map.texture.0 as usize];
        let image = &self.scene.images[texture.image.0 as usize];
        let is_color = matches!(reading, Reading::Color(..));
        let is_kept = reading.kept_channels(image, texture.encoding).is_some();
        let is_srgb = is_color && is_kept && texture.encoding == Encoding::Srgb;
        // Thresholds make no values between.
        let is_cut = matches!(reading, Reading::Cut(..));
        let nearest = is_cut || texture.filter == TexelFilter::Nearest;
        let element = Element::plugin("texture", "bitmap")
            .named(name)
            .string("filename", &self.file(texture, reading))
            .boolean("raw", !is_srgb)
            .string("format", "variant")
            .string("wrap_mode", wrap_mode(texture.wrap[0]))
            .string("filter_type", if nearest { "nearest" } else { "bilinear" });
        if map.texture_from_uv == Affine2::IDENTITY {
            return element;
        }
        element.transform("to_uv", in_space(map.texture_from_uv))
    }

    /// The file that holds what `reading` makes of `texture`.
    fn file(&mut self, texture: &Texture, reading: Reading) -> String {
        let (image, encoding) = (texture.image, texture.encoding);
        let same = |u: &&Used| (u.image, u.encoding, u.reading) == (image, encoding, reading);
        if let Some(used) = self.used.iter().find(same) {
            return used.file.clone();
        }
        let pixels = &self.scene.images[image.0 as usize];
        let stem = Path::new(&pixels.name).file_stem().map_or("image".into(), |s| s.to_string_lossy());
        let stem = self.names.of(&file_stem(&stem));
        let extension = if reading.kept_channels(pixels, encoding).is_some() { "png" } else { "exr" };
        let file = format!("textures/{stem}.{extension}");
        self.used.push(Used { image, encoding, reading, file: file.clone() });
        file
    }

    /// How many files there are.
    pub(super) fn count(&self) -> usize {
        self.used.len()
    }

    /// The files, with their names relative to the scene's.
    ///
    /// # Errors
    /// If an image can't be encoded.
    pub(super) fn files(&self) -> impl Iterator<Item = Result<(String, Vec<u8>), ImageFileError>> {
        self.used.iter().map(|used| {
            let image = &self.scene.images[used.image.0 as usize];
            Ok((used.file.clone(), encode(image, used.encoding, used.reading)?))
        })
    }
}

/// The pixels that `reading` makes of an image, as a file. Rows and columns that are alone are doubled: `bitmap` needs two.
fn encode(image: &Image, encoding: Encoding, reading: Reading) -> Result<Vec<u8>, ImageFileError> {
    let (width, height) = (image.width.max(2), image.height.max(2));
    let places =
        (0..height).flat_map(|y| (0..width).map(move |x| (x.min(image.width - 1), y.min(image.height - 1))));
    if let (Pixels::U8(values), Some(kept)) = (&image.pixels, reading.kept_channels(image, encoding)) {
        let pixel = |(x, y): (u32, u32)| {
            (y as usize * image.width as usize + x as usize) * usize::from(image.channels)
        };
        let bytes: Vec<u8> =
            places.map(pixel).flat_map(|at| kept.iter().map(move |c| values[at + c])).collect();
        return encode_texture(width, height, kept.len() as u8, Interleaved::U8(&bytes));
    }
    let values: Vec<f32> = places.flat_map(|(x, y)| reading.of(&image.texel(x, y, encoding))).collect();
    let channels = if matches!(reading, Reading::Scalar(..) | Reading::Cut(..)) { 1 } else { 3 };
    encode_texture(width, height, channels, Interleaved::F32(&values))
}

/// Both axes have the horizontal one's.
fn wrap_mode(wrap: Wrap) -> &'static str {
    match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    }
}

/// A transform of texture coordinates as the part of a spatial one that `to_uv` reads.
fn in_space(transform: Affine2) -> Affine3A {
    let axis = |v: glam::Vec2| Vec3A::new(v.x, v.y, 0.0);
    Affine3A {
        matrix3: Mat3A::from_cols(axis(transform.matrix2.x_axis), axis(transform.matrix2.y_axis), Vec3A::Z),
        translation: axis(transform.translation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imagefile::{Samples, decode_texture};

    fn encoded(values: Vec<u8>, channels: u8, reading: Reading) -> (Samples, [u32; 2]) {
        let image = Image { name: "a.png".into(), width: 1, height: 1, channels, pixels: Pixels::U8(values) };
        let bytes = encode(&image, Encoding::Srgb, reading).unwrap();
        let decoded = decode_texture(&bytes, "a").unwrap();
        (decoded.samples, [decoded.width, decoded.height])
    }

    #[test]
    fn bytes_stay_bytes_where_nothing_is_worked_in_and_single_pixels_are_doubled() {
        let white = Reading::Color(Rgb::WHITE, Power::One);
        let (samples, size) = encoded(vec![1, 2, 3], 3, white);
        assert_eq!((samples, size), (Samples::U8([1, 2, 3].repeat(4)), [2, 2]));
        let (alpha, _) = encoded(vec![1, 2, 3, 77], 4, Reading::Scalar(TextureChannel::A, 1.0));
        assert_eq!(alpha, Samples::U8(vec![77; 4]));
        let (halved, _) = encoded(vec![255, 0, 255], 3, Reading::Color(Rgb::grey(0.5), Power::Square));
        assert_eq!(halved, Samples::F32([0.25, 0.0, 0.25].repeat(4)));
        let (cut, _) = encoded(vec![9, 9, 9, 128], 4, Reading::Cut(TextureChannel::A, 1.0, 0.5));
        assert_eq!(cut, Samples::F32(vec![1.0; 4]));
        let (normal, _) = encoded(vec![255, 0, 255], 3, Reading::Normal(0.5));
        assert_eq!(normal, Samples::F32([0.75, 0.25, 1.0].repeat(4)));
    }
}
