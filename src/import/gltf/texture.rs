//! Textures, samplers and images: each image is decoded once, and each texture made once for each encoding it is used with.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine2, Mat2, Vec2};
use gltf::json::Root;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::NormalTexture;
use gltf::json::texture::{Info, MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use serde::Deserialize;

use super::buffers::{Buffers, lookup, read_file, resolve};
use super::error::GltfError;
use super::uri::Target;
use crate::import::{DecodedImages, Files, Images};
use crate::math::Real;
use crate::record::Warning;
use crate::scene::material::{TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, Texel, TexelFilter, Wrap};
use crate::scene::{Image, ImageId, Texture, TextureId};

/// What all texture slots of a material have in common.
pub(super) struct Slot {
    index: usize,
    tex_coord: u32,
    transform: Option<TextureTransform>,
}

impl From<&Info> for Slot {
    fn from(info: &Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.clone());
        Self { index: info.index.value(), tex_coord: info.tex_coord, transform }
    }
}

impl Slot {
    /// A `normalTexture`, for whose transform the crate has no field.
    pub(super) fn normal(texture: &NormalTexture) -> Result<Self, GltfError> {
        let extensions = texture.extensions.as_ref();
        let transform = match extensions.and_then(|e| e.others.get("KHR_texture_transform")) {
            Some(json) => Some(gltf::json::deserialize::from_value(json.clone())?),
            None => None,
        };
        Ok(Self { index: texture.index.value(), tex_coord: texture.tex_coord, transform })
    }
}

/// KHR_texture_basisu and EXT_texture_webp.
#[derive(Deserialize)]
struct Source {
    source: usize,
}

/// The textures of a file, made as materials ask for them.
pub(super) struct Textures<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    files: &'a mut Files,
    textures: Vec<Texture>,
    images: Vec<Arc<Image>>,
    by_source: BTreeMap<usize, ImageId>,
    by_file: BTreeMap<String, ImageId>,
    by_view: BTreeMap<usize, ImageId>,
    by_use: BTreeMap<(usize, bool), TextureId>,
    decoder: Images,
    /// Textures are wanted whether or not they change what is seen.
    wants_all: bool,
    /// Whether what is asked for is sampled.
    decodes: bool,
    warnings: Vec<Warning>,
}

impl<'a> Textures<'a> {
    /// The textures of `root`, none of them made yet.
    pub(super) fn new(
        root: &'a Root,
        buffers: &'a Buffers<'a>,
        files: &'a mut Files,
        wanted: DecodedImages,
    ) -> Self {
        Self {
            root,
            buffers,
            files,
            textures: Vec::new(),
            images: Vec::new(),
            by_source: BTreeMap::new(),
            by_file: BTreeMap::new(),
            by_view: BTreeMap::new(),
            by_use: BTreeMap::new(),
            decoder: Images::default(),
            wants_all: wanted == DecodedImages::OfMaterials,
            decodes: true,
            warnings: Vec::new(),
        }
    }

    /// What was made, and what was noticed.
    pub(super) fn finish(self) -> (Vec<Texture>, Vec<Arc<Image>>, Vec<Warning>) {
        (self.textures, self.images, self.warnings)
    }

    /// From here on textures are for what nothing samples: images that aren't decoded yet stay so.
    pub(super) fn decode_no_more(&mut self) {
        self.decodes = false;
    }

    /// Whether a texture whose values are multiplied by these is wanted.
    pub(super) fn want(&self, factors: &[f32]) -> bool {
        self.wants_all || factors.iter().any(|&factor| factor != 0.0)
    }

    /// The texture of `slot`, whose values mean `encoding`, as `element` uses it.
    pub(super) fn map(
        &mut self,
        slot: &Slot,
        encoding: Encoding,
        element: &str,
    ) -> Result<TextureMap, GltfError> {
        let texture = self.texture(slot.index, encoding, element)?;
        let (mut uv_set, mut texture_from_uv) = (slot.tex_coord, Affine2::IDENTITY);
        if let Some(transform) = &slot.transform {
            uv_set = transform.tex_coord.unwrap_or(uv_set);
            texture_from_uv = affine(transform);
            if !texture_from_uv.is_finite() {
                return Err(GltfError::Invalid {
                    element: element.to_owned(),
                    property: "KHR_texture_transform",
                    expected: "finite numbers",
                });
            }
        }
        Ok(TextureMap { uv_set, texture_from_uv, ..TextureMap::new(texture, TextureChannel::R) })
    }

    /// Columns and rows of a texture that was made.
    pub(super) fn size(&self, id: TextureId) -> (u32, u32) {
        let image = &self.images[self.textures[id.0 as usize].image.0 as usize];
        (image.width, image.height)
    }

    /// The value at `uv` of a texture that was made.
    pub(super) fn sample(&self, id: TextureId, uv: Vec2) -> Texel {
        let texture = &self.textures[id.0 as usize];
        texture.sample(&self.images[texture.image.0 as usize], uv)
    }

    /// A texture of `image`, whose values mean `encoding`, with the sampler of a texture that was made.
    pub(super) fn add(&mut self, image: Image, encoding: Encoding, like: TextureId) -> TextureId {
        let image_id = ImageId(self.images.len() as u32);
        self.images.push(Arc::new(image));
        let id = TextureId(self.textures.len() as u32);
        self.textures.push(Texture { image: image_id, encoding, ..self.textures[like.0 as usize].clone() });
        id
    }

    /// Counts what the image called `name` will take, before it is made of others.
    pub(super) fn count_decoded(&mut self, bytes: u64, name: &str) -> Result<(), GltfError> {
        Ok(self.decoder.count(bytes, name)?)
    }

    fn texture(&mut self, index: usize, encoding: Encoding, element: &str) -> Result<TextureId, GltfError> {
        let key = (index, encoding == Encoding::Srgb);
        if let Some(&id) = self.by_use.get(&key) {
            return Ok(id);
        }
        let json = lookup(&self.root.textures, index, element, "textures")?;
        let name = format!("textures[{index}]");
        let others = json.extensions.as_ref().map(|e| &e.others);
        // The extension's image comes first: the other one is for those who can't read it.
        let of_extension =
            |o: &'a serde_json::Map<_, _>| o.get("KHR_texture_basisu").or_else(|| o.get("EXT_texture_webp"));
        let source = match others.and_then(of_extension) {
            Some(json) => gltf::json::deserialize::from_value::<Source>(json.clone())?.source,
            None => json.source.value(),
        };
        if source == u32::MAX as usize {
            for extension in ["MSFT_texture_dds", "EXT_texture_avif"] {
                if others.is_some_and(|o| o.contains_key(extension)) {
                    return Err(GltfError::Extension { element: name, extension });
                }
            }
            return Err(GltfError::Missing { element: name, property: "source" });
        }
        let (wrap, filter) = match json.sampler {
            Some(sampler) => {
                let index = sampler.value();
                read_sampler(lookup(&self.root.samplers, index, &name, "samplers")?, index)?
            }
            None => ([Wrap::Repeat; 2], TexelFilter::Bilinear),
        };
        let image = self.image(source, &name)?;
        let id = TextureId(self.textures.len() as u32);
        self.textures.push(Texture { image, encoding, wrap, filter });
        self.by_use.insert(key, id);
        Ok(id)
    }

    fn image(&mut self, index: usize, element: &str) -> Result<ImageId, GltfError> {
        if let Some(&id) = self.by_source.get(&index) {
            return Ok(id);
        }
        let id = self.read_image(index, element)?;
        self.by_source.insert(index, id);
        Ok(id)
    }

    /// The content of `images[index]`, of which `element` speaks.
    pub(super) fn pixels(&mut self, index: usize, element: &str) -> Result<Arc<Image>, GltfError> {
        let id = self.image(index, element)?;
        Ok(self.images[id.0 as usize].clone())
    }

    /// `images[index]`, which `element` refers to. What two of them have in common, a file or a bufferView, is decoded once.
    fn read_image(&mut self, index: usize, element: &str) -> Result<ImageId, GltfError> {
        let json = lookup(&self.root.images, index, element, "images")?;
        let element = format!("images[{index}]");
        let name = |fallback: &str| json.name.clone().unwrap_or_else(|| fallback.to_owned());
        let id = ImageId(self.images.len() as u32);
        let (image, replaced) = match (&json.uri, json.buffer_view) {
            (_, Some(view)) => {
                let known = *self.by_view.entry(view.value()).or_insert(id);
                if known != id {
                    return Ok(known);
                }
                let (bytes, _) = self.buffers.view(self.root, view.value(), &element)?;
                match self.decodes {
                    true => self.decoder.decode(bytes, &name(&element))?,
                    false => (Image::undecoded(name(&element)), None),
                }
            }
            (Some(uri), None) => match resolve(uri, &element)? {
                Target::Data(_) if !self.decodes => (Image::undecoded(name(&element)), None),
                Target::Data(bytes) => self.decoder.decode(&bytes, &name(&element))?,
                Target::File(file) => {
                    let known = *self.by_file.entry(file.clone()).or_insert(id);
                    if known != id {
                        return Ok(known);
                    }
                    match self.decodes {
                        true => self.decoder.decode(&read_file(self.files, &file, &element)?, &file)?,
                        false => (Image::undecoded(file), None),
                    }
                }
            },
            (None, None) => return Err(GltfError::Missing { element, property: "uri or bufferView" }),
        };
        self.warnings.extend(replaced);
        self.images.push(Arc::new(image));
        Ok(id)
    }
}

/// Wrapping and filter of a sampler. There are no mip levels, so the magnification filter alone counts.
fn read_sampler(sampler: &Sampler, index: usize) -> Result<([Wrap; 2], TexelFilter), GltfError> {
    let invalid =
        |property, expected| GltfError::Invalid { element: format!("samplers[{index}]"), property, expected };
    let wrap = |mode: Checked<WrappingMode>, property| match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Invalid => Err(invalid(property, "10497, 33071 or 33648")),
    };
    let filter = match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => TexelFilter::Nearest,
        Some(Checked::Valid(MagFilter::Linear)) | None => TexelFilter::Bilinear,
        Some(Checked::Invalid) => return Err(invalid("magFilter", "9728 or 9729")),
    };
    Ok(([wrap(sampler.wrap_s, "wrapS")?, wrap(sampler.wrap_t, "wrapT")?], filter))
}

/// KHR_texture_transform: uv' = T·R·S·uv with R = [[c, s], [-s, c]]. The extension's text and sample images turn this way; its GLSL
/// listing has the sign wrong.
fn affine(transform: &TextureTransform) -> Affine2 {
    let (s, c) = (Real::sin(transform.rotation.0), Real::cos(transform.rotation.0));
    // Columns: R's first is (c, -s), its second (s, c).
    let rotation = Mat2::from_cols(Vec2::new(c, -s), Vec2::new(s, c));
    let scale = Mat2::from_diagonal(Vec2::from(transform.scale.0));
    Affine2::from_mat2_translation(rotation * scale, Vec2::from(transform.offset.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_transforms_scale_then_turn_then_move() {
        let json = r#"{"offset": [0.5, 0.25], "rotation": 1.5707963267948966, "scale": [2.0, 3.0]}"#;
        let transform = gltf::json::deserialize::from_str(json).unwrap();
        let at = |u, v| affine(&transform).transform_point2(Vec2::new(u, v));
        // R turns (1, 0) to (0, -1) and (0, 1) to (1, 0).
        assert!((at(1.0, 0.0) - Vec2::new(0.5, -1.75)).length() < 1e-6);
        assert!((at(0.0, 1.0) - Vec2::new(3.5, 0.25)).length() < 1e-6);
    }

    #[test]
    fn samplers_are_read_and_checked() {
        let read = |json: &str| read_sampler(&gltf::json::deserialize::from_str(json).unwrap(), 0);
        assert_eq!(read("{}").unwrap(), ([Wrap::Repeat; 2], TexelFilter::Bilinear));
        let json = r#"{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9987}"#;
        assert_eq!(read(json).unwrap(), ([Wrap::Clamp, Wrap::Mirror], TexelFilter::Nearest));
        assert!(matches!(read(r#"{"wrapT": 1}"#), Err(GltfError::Invalid { property: "wrapT", .. })));
    }
}
