//! Textures as glTF's slots want them: as they are where the channels lie where the slot reads them, else put together anew.

use std::sync::Arc;

use glam::{Affine2, Vec2};
use serde_json::{Value, json};

use super::buffer::Buffer;
use crate::color::srgb_from_linear;
use crate::export::ExportError;
use crate::export::rounding::reads_back_as;
use crate::imagefile::{Interleaved, encode_texture};
use crate::math::Real;
use crate::scene::material::{Material, TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, Image, Pixels, Texel, TexelFilter, Texture, Wrap};
use crate::scene::{ImageId, Scene, TextureId};

/// What a slot reads of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// A colour.
    Color,
    /// A grey whose luminance stands for a scalar.
    Grey,
    /// One channel.
    Channel(TextureChannel),
}

/// A texture that goes into a slot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'m> {
    pub(super) map: &'m TextureMap,
    pub(super) target: Target,
}

/// A texture in its slot.
#[derive(Clone, Debug)]
pub(super) struct Slot {
    pub(super) map: TextureMap,
    /// What the factor of each part has to be multiplied with: 1 but for floats above 1.
    pub(super) peaks: Vec<f32>,
    /// What became of it, where it is not as it was.
    pub(super) change: Option<&'static str>,
    /// Whether a value may have moved.
    pub(super) rounded: bool,
}

/// The textures of a scene and those that are made of them.
pub(super) struct Textures {
    textures: Vec<Texture>,
    images: Vec<Arc<Image>>,
    made: Vec<(Recipe, TextureId, Vec<f32>)>,
    /// The textures and images that the file has, by what they are of.
    written: Vec<(ImageId, [Wrap; 2], TexelFilter)>,
}

/// What an image is made of.
type Recipe = (Vec<(TextureId, TextureChannel, Target)>, bool);

impl Textures {
    /// Those of `scene`.
    pub(super) fn new(scene: &Scene<Material>) -> Self {
        Self {
            textures: scene.textures.clone(),
            images: scene.images.clone(),
            made: Vec::new(),
            written: Vec::new(),
        }
    }

    fn texture(&self, map: &TextureMap) -> &Texture {
        &self.textures[map.texture.0 as usize]
    }

    fn image(&self, map: &TextureMap) -> &Arc<Image> {
        &self.images[self.texture(map).image.0 as usize]
    }

    /// Whether two maps lie on the surface alike, so that one texture can hold both.
    pub(super) fn lie_alike(&self, a: &TextureMap, b: &TextureMap) -> bool {
        let (s, t) = (self.texture(a), self.texture(b));
        (a.uv_set, a.texture_from_uv, s.wrap, s.filter) == (b.uv_set, b.texture_from_uv, t.wrap, t.filter)
    }

    /// `parts`, which lie alike, as one texture whose colours mean `encoding`. The channels `ones` are read as well and must be 1.
    pub(super) fn slot(&mut self, parts: &[Part<'_>], ones: &[TextureChannel], encoding: Encoding) -> Slot {
        let first = parts[0].map;
        let sheared = !placement(first.texture_from_uv).exact;
        if self.fits(parts, ones, encoding) {
            let map = TextureMap { channel: TextureChannel::R, ..first.clone() };
            let change = sheared.then_some(SHEARED);
            return Slot { map, peaks: vec![1.0; parts.len()], change, rounded: sheared };
        }
        let ingredients = parts.iter().map(|p| (p.map.texture, p.map.channel, p.target)).collect();
        let recipe = (ingredients, encoding == Encoding::Srgb);
        let whole = self.keeps_bytes(parts, encoding);
        let (texture, peaks) = match self.made.iter().find(|(of, ..)| *of == recipe) {
            Some((_, id, peaks)) => (*id, peaks.clone()),
            None => {
                let (image, peaks) = self.make(parts, encoding, whole);
                let id = TextureId(self.textures.len() as u32);
                let like = self.texture(first).clone();
                self.textures.push(Texture { image: ImageId(self.images.len() as u32), encoding, ..like });
                self.images.push(Arc::new(image));
                self.made.push((recipe, id, peaks.clone()));
                (id, peaks)
            }
        };
        let change = match (sheared, whole) {
            (true, _) => SHEARED,
            (false, true) => "its channels are copied to where glTF reads them",
            (false, false) => "made anew of 16 bits: off by up to 1/131070 of the encoded value",
        };
        let map = TextureMap { texture, channel: TextureChannel::R, ..first.clone() };
        Slot { map, peaks, change: Some(change), rounded: sheared || !whole }
    }

    /// Whether the image of the first part is what the slot wants.
    fn fits(&self, parts: &[Part<'_>], ones: &[TextureChannel], encoding: Encoding) -> bool {
        let first = self.texture(parts[0].map);
        let image = &self.images[first.image.0 as usize];
        let is_grey = image.channels <= 2;
        let is_color = |c: TextureChannel| c != TextureChannel::A;
        parts.iter().all(|part| {
            let (texture, channel) = (self.texture(part.map), part.map.channel);
            let same = texture.image == first.image;
            let (lies, colored) = match part.target {
                Target::Color => (true, true),
                Target::Grey => (is_grey && is_color(channel), true),
                Target::Channel(to) => {
                    (channel == to || is_grey && is_color(channel) && is_color(to), is_color(to))
                }
            };
            same && lies && (!colored || texture.encoding == encoding)
        }) && !matches!(image.pixels, Pixels::F32(_))
            && ones.iter().all(|&channel| is_one(image, channel))
    }

    /// Whether values of 8 bits can be copied as they are.
    fn keeps_bytes(&self, parts: &[Part<'_>], encoding: Encoding) -> bool {
        let first = self.image(parts[0].map);
        parts.iter().all(|part| {
            let image = self.image(part.map);
            let from = match part.target {
                Target::Color => TextureChannel::R,
                Target::Grey | Target::Channel(_) => part.map.channel,
            };
            let encoded =
                if from == TextureChannel::A { Encoding::Linear } else { self.texture(part.map).encoding };
            let wanted =
                if part.target == Target::Channel(TextureChannel::A) { Encoding::Linear } else { encoding };
            matches!(image.pixels, Pixels::U8(_))
                && (image.width, image.height) == (first.width, first.height)
                && encoded == wanted
        })
    }

    /// The image of `parts`, the larger one's size, of 8 bits if `whole`, else of 16; what they are divided by to end at 1.
    fn make(&self, parts: &[Part<'_>], encoding: Encoding, whole: bool) -> (Image, Vec<f32>) {
        let size = |of: fn(&Image) -> u32| parts.iter().map(|p| of(self.image(p.map))).max().unwrap_or(1);
        let (width, height) = (size(|i| i.width), size(|i| i.height));
        let peaks: Vec<f32> = parts.iter().map(|part| self.peak(part)).collect();
        let has_alpha = parts.iter().any(|p| p.target == Target::Channel(TextureChannel::A));
        let channels = if has_alpha { 4 } else { 3 };
        let mut values = Vec::with_capacity(width as usize * height as usize * channels);
        for y in 0..height {
            for x in 0..width {
                let mut pixel = [1.0; 4];
                for (part, peak) in parts.iter().zip(&peaks) {
                    let texel = self.texel(part.map, x, y, width, height);
                    match part.target {
                        Target::Color => pixel[..3].copy_from_slice(&(texel.color * peak.recip()).to_array()),
                        Target::Grey => pixel[..3].fill(part.map.channel.of(&texel) / peak),
                        Target::Channel(to) => pixel[to as usize] = part.map.channel.of(&texel) / peak,
                    }
                }
                if encoding == Encoding::Srgb {
                    pixel[..3].iter_mut().for_each(|v| *v = srgb_from_linear(*v));
                }
                values.extend_from_slice(&pixel[..channels]);
            }
        }
        let code = |v: f32, most: f32| (v.clamp(0.0, 1.0) * most).round();
        let pixels = if whole {
            Pixels::U8(values.into_iter().map(|v| code(v, 255.0) as u8).collect())
        } else {
            Pixels::U16(values.into_iter().map(|v| code(v, 65535.0) as u16).collect())
        };
        let name = self.image(parts[0].map).name.clone();
        (Image { name, width, height, channels: channels as u8, pixels }, peaks)
    }

    /// The texel of a map in an image of this size, filtered if its own has another.
    fn texel(&self, map: &TextureMap, x: u32, y: u32, width: u32, height: u32) -> Texel {
        let (texture, image) = (self.texture(map), self.image(map));
        if (image.width, image.height) == (width, height) {
            return image.texel(x, y, texture.encoding);
        }
        let at = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        texture.sample(image, Vec2::new(at(x, width), at(y, height)))
    }

    /// The largest value of a part, at least 1.
    fn peak(&self, part: &Part<'_>) -> f32 {
        let (texture, image) = (self.texture(part.map), self.image(part.map));
        if !matches!(image.pixels, Pixels::F32(_)) {
            return 1.0;
        }
        let texels = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
        texels.fold(1.0, |peak, (x, y)| {
            let texel = image.texel(x, y, texture.encoding);
            peak.max(match part.target {
                Target::Color => texel.color.max_channel(),
                Target::Grey | Target::Channel(_) => part.map.channel.of(&texel),
            })
        })
    }

    /// The number in the file of a texture that a material uses.
    pub(super) fn index_of(&mut self, id: TextureId) -> usize {
        let Texture { image, wrap, filter, .. } = self.textures[id.0 as usize];
        let wanted = (image, wrap, filter);
        self.written.iter().position(|w| *w == wanted).unwrap_or_else(|| {
            self.written.push(wanted);
            self.written.len() - 1
        })
    }

    /// Writes what [`Self::index_of`] was asked for: images into `buffer`, and the JSON of textures, samplers and images.
    ///
    /// # Errors
    /// If an image can't be encoded or the buffer is full.
    pub(super) fn write(&self, buffer: &mut Buffer) -> Result<[Vec<Value>; 3], ExportError> {
        let (mut samplers, mut images) = (Vec::new(), Vec::new());
        let mut textures = Vec::new();
        for (image, wrap, filter) in &self.written {
            let source = index_in(&mut images, *image);
            let sampler = index_in(&mut samplers, (*wrap, *filter));
            textures.push(json!({"source": source, "sampler": sampler}));
        }
        let samplers = samplers.into_iter().map(|(wrap, filter)| sampler(wrap, filter)).collect();
        let write = |id: ImageId| {
            let image = &self.images[id.0 as usize];
            let pixels = match &image.pixels {
                Pixels::U8(values) => Interleaved::U8(values),
                Pixels::U16(values) => Interleaved::U16(values),
                Pixels::F32(values) => Interleaved::F32(values),
                // Which the encoder refuses: an import for writing decodes all.
                Pixels::Undecoded => Interleaved::U8(&[]),
            };
            let file = encode_texture(image.width, image.height, image.channels, pixels)?;
            let view = buffer.image(&file)?;
            Ok(json!({"name": image.name, "bufferView": view, "mimeType": "image/png"}))
        };
        let images = images.into_iter().map(write).collect::<Result<_, ExportError>>()?;
        Ok([textures, samplers, images])
    }
}

const SHEARED: &str = "KHR_texture_transform has no shear: what its coordinates are sheared by is left out";

/// The place of `item` in `list`, at whose end it comes if it isn't there.
fn index_in<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|other| *other == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

fn is_one(image: &Image, channel: TextureChannel) -> bool {
    let texels = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    image.channels == 3 && channel == TextureChannel::A
        || texels.into_iter().all(|(x, y)| channel.of(&image.texel(x, y, Encoding::Linear)) == 1.0)
}

fn sampler(wrap: [Wrap; 2], filter: TexelFilter) -> Value {
    let [s, t] = wrap.map(|wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    });
    // Nearest, or linear with mip levels for those who have them.
    let [mag, min] = match filter {
        TexelFilter::Nearest => [9728, 9728],
        TexelFilter::Bilinear => [9729, 9987],
    };
    json!({"magFilter": mag, "minFilter": min, "wrapS": s, "wrapT": t})
}

/// KHR_texture_transform's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub(super) offset: [f32; 2],
    pub(super) rotation: f32,
    pub(super) scale: [f32; 2],
    /// Whether they say all of it.
    pub(super) exact: bool,
}

/// T·R·S with R = [[c, s], [-s, c]] of an affine map: R's first column turns its x axis to (c, -s).
pub(super) fn placement(texture_from_uv: Affine2) -> Placement {
    let (x, y) = (texture_from_uv.matrix2.x_axis, texture_from_uv.matrix2.y_axis);
    let offset = texture_from_uv.translation.to_array();
    if x.y == 0.0 && y.x == 0.0 {
        return Placement { offset, rotation: 0.0, scale: [x.x, y.y], exact: true };
    }
    // The longer axis tells the angle: the other may have no length.
    let (rotation, along) = if x.length() >= y.length() {
        (Real::atan2(-x.y, x.x), x.length())
    } else {
        (Real::atan2(y.x, y.y), y.length())
    };
    let turned = |angle: f32| Vec2::new(Real::cos(angle), -Real::sin(angle));
    let first = turned(rotation);
    let second = Vec2::new(-first.y, first.x);
    let scale = [x.dot(first), y.dot(second)];
    let exact = (first * scale[0] - x).length().max((second * scale[1] - y).length()) < 1e-5 * along;
    let rotation = reads_back_as(x.y, rotation, |angle| turned(angle).y * scale[0]);
    Placement { offset, rotation, scale, exact }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;

    fn scene(images: Vec<(u8, Vec<u8>, Encoding)>) -> Scene<Material> {
        let mut scene = Scene::empty();
        for (i, (channels, values, encoding)) in images.into_iter().enumerate() {
            let width = (values.len() / usize::from(channels)) as u32;
            let pixels = Pixels::U8(values);
            let image = Image { name: format!("image{i}"), width, height: 1, channels, pixels };
            scene.images.push(Arc::new(image));
            let (wrap, filter) = ([Wrap::Repeat; 2], TexelFilter::Bilinear);
            scene.textures.push(Texture { image: ImageId(i as u32), encoding, wrap, filter });
        }
        scene
    }

    fn map(texture: u32, channel: TextureChannel) -> TextureMap {
        TextureMap::new(TextureId(texture), channel)
    }

    #[test]
    fn what_lies_where_the_slot_reads_it_is_passed_on() {
        let scene = scene(vec![(3, vec![1, 2, 3, 4, 5, 6], Encoding::Linear)]);
        let mut textures = Textures::new(&scene);
        let (rough, metal) = (map(0, TextureChannel::G), map(0, TextureChannel::B));
        let parts = [(&rough, TextureChannel::G), (&metal, TextureChannel::B)]
            .map(|(map, to)| Part { map, target: Target::Channel(to) });
        let slot = textures.slot(&parts, &[], Encoding::Linear);
        assert_eq!((slot.map.texture, slot.change), (TextureId(0), None));
        // Metallic would be multiplied with a blue that is not 1.
        let slot = textures.slot(&parts[..1], &[TextureChannel::B], Encoding::Linear);
        assert_eq!((slot.map.texture, slot.rounded), (TextureId(1), false));
        assert_eq!(textures.images[1].pixels, Pixels::U8(vec![255, 2, 255, 255, 5, 255]));
        // A colour of the same bytes means something else.
        let part = Part { map: &rough, target: Target::Color };
        assert!(textures.slot(&[part], &[], Encoding::Srgb).rounded);
        let again = textures.slot(&[part], &[], Encoding::Srgb);
        assert_eq!((again.map.texture, textures.images.len()), (TextureId(2), 3), "made once");
    }

    #[test]
    fn colour_and_alpha_of_two_images_are_joined_to_the_byte() {
        let all: Vec<u8> = (0..=255).collect();
        let color: Vec<u8> = all.iter().flat_map(|&v| [v, 255 - v, v / 2]).collect();
        let scene = scene(vec![(3, color.clone(), Encoding::Srgb), (1, all, Encoding::Linear)]);
        let mut textures = Textures::new(&scene);
        let (color_map, alpha) = (map(0, TextureChannel::R), map(1, TextureChannel::R));
        let parts = [
            Part { map: &color_map, target: Target::Color },
            Part { map: &alpha, target: Target::Channel(TextureChannel::A) },
        ];
        let slot = textures.slot(&parts, &[], Encoding::Srgb);
        assert!(!slot.rounded && slot.change.is_some());
        let joined = (0..=255u8).flat_map(|v| [v, 255 - v, v / 2, v]).collect();
        assert_eq!(textures.images[2].pixels, Pixels::U8(joined));
    }

    #[test]
    fn floats_end_at_one_and_their_factor_grows() {
        let mut scene = scene(vec![(1, vec![0], Encoding::Linear)]);
        let pixels = Pixels::F32(vec![0.5, 0.25, 8.0, 2.0, 0.0, 1.0]);
        scene.images[0] = Arc::new(Image { name: "light".into(), width: 2, height: 1, channels: 3, pixels });
        let mut textures = Textures::new(&scene);
        let color = map(0, TextureChannel::R);
        let slot = textures.slot(&[Part { map: &color, target: Target::Color }], &[], Encoding::Srgb);
        assert_eq!((slot.peaks, slot.rounded), (vec![8.0], true));
        let made = &textures.images[1];
        let expected = Rgb::new(0.0625, 0.03125, 1.0);
        let found = made.texel(0, 0, Encoding::Srgb).color;
        assert!((found.r - expected.r).abs() < 1e-5 && (found.g - expected.g).abs() < 1e-5 && found.b == 1.0);
    }

    #[test]
    fn transforms_are_taken_apart() {
        let of = |rotation: f32, scale: [f32; 2]| {
            let (s, c) = (Real::sin(rotation), Real::cos(rotation));
            let turn = glam::Mat2::from_cols(Vec2::new(c, -s), Vec2::new(s, c));
            let matrix = turn * glam::Mat2::from_diagonal(scale.into());
            Affine2::from_mat2_translation(matrix, Vec2::new(0.5, -0.25))
        };
        for (rotation, scale) in
            [(0.0, [-2.0, 3.0]), (0.7, [2.0, 0.5]), (-2.5, [0.1, -4.0]), (1.0, [0.0, 2.0])]
        {
            let at = placement(of(rotation, scale));
            assert!(at.exact && at.offset == [0.5, -0.25], "{at:?}");
            let back = of(at.rotation, at.scale);
            assert!(back.abs_diff_eq(of(rotation, scale), 1e-6), "{rotation} {scale:?}: {at:?}");
        }
        let sheared = Affine2::from_mat2(glam::Mat2::from_cols(Vec2::new(1.0, 0.0), Vec2::new(0.5, 1.0)));
        assert!(!placement(sheared).exact);
    }
}
