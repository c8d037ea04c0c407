//! Entries onto a scene's materials, with the textures that they name.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Affine2;

use super::read::{Entry, form};
use super::{Library, LibraryError, field, keys};
use crate::color::Rgb;
use crate::disney::Parameter;
use crate::import::yaml::{self, Node, Place};
use crate::import::{FileDigest, Files, Images, read_image};
use crate::manifest::edit::{MaterialField, set_material};
use crate::manifest::nearest::nearest;
use crate::record::{Value, Warning};
use crate::scene::material::{NormalMap, Param, ShadingFrame, Sides, TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, TexelFilter, Texture, Wrap};
use crate::scene::{ImageId, Material, Scene, TextureId};

pub(super) fn lay_over(
    library: Library,
    scene: &mut Scene<Material>,
) -> Result<(Vec<FileDigest>, Vec<Warning>), LibraryError> {
    let Library { entries, files } = library;
    let mut overlay =
        Overlay { scene, files, images: BTreeMap::new(), decoder: Images::default(), warnings: Vec::new() };
    for entry in &entries {
        overlay.entry(entry)?;
    }
    Ok((overlay.files.into_digests(), overlay.warnings))
}

struct Overlay<'a> {
    scene: &'a mut Scene<Material>,
    files: Files,
    /// By file.
    images: BTreeMap<String, ImageId>,
    decoder: Images,
    warnings: Vec<Warning>,
}

impl Overlay<'_> {
    fn entry(&mut self, entry: &Entry) -> Result<(), LibraryError> {
        let names = || self.scene.materials.iter().map(|m| m.name.as_str());
        let Some(index) = names().position(|name| name == entry.name) else {
            return Err(LibraryError::UnknownMaterial {
                place: entry.place.to_string(),
                name: entry.name.chars().take(80).collect(),
                nearest: nearest(&entry.name, names()).map(str::to_owned),
                known: names().map(str::to_owned).collect(),
            });
        };
        let mut material = self.scene.materials[index].item.clone();
        for (key, place, node) in &entry.fields {
            self.field(&mut material, key, place, node)?;
        }
        self.scene.materials[index].item = material;
        Ok(())
    }

    fn field(
        &mut self,
        material: &mut Material,
        key: &str,
        place: &Place,
        node: &Node,
    ) -> Result<(), LibraryError> {
        match key {
            // Aris has two indices; what counts is one over the other.
            keys::EXT_IOR | keys::INT_IOR => self.index_of(material, key, node),
            keys::EMISSION_SIDES => choice(node, Sides::from_name).map(|s| material.emission.sides = s),
            keys::SIDES => choice(node, Sides::from_name).map(|s| material.sides = s),
            keys::FRAME => choice(node, ShadingFrame::from_name).map(|f| material.frame = f),
            keys::VERTEX_COLOR => flag(node).map(|is| material.vertex_color = is),
            keys::VERTEX_ALPHA => flag(node).map(|is| material.vertex_alpha = is),
            keys::NORMAL_MAP => {
                let (map, _) = self.texture(node, Encoding::Linear)?;
                let scale = material.normal_map.as_ref().map_or(1.0, |n| n.scale);
                material.normal_map = Some(NormalMap { map, scale });
                Ok(())
            }
            _ => {
                let at = |place: &Place, cause| LibraryError::Field { place: place.to_string(), cause };
                let field = field(key).map_err(|cause| at(place, cause))?;
                if matches!(node.value, yaml::Value::Map(_)) {
                    return self.textured(material, field, node);
                }
                let value = value(node)
                    .ok_or_else(|| form(&node.place, &format!("`{key}` must be {}", field.expects())))?;
                set_material(material, field, &value).map_err(|cause| at(&node.place, cause))
            }
        }
    }

    fn index_of(&mut self, material: &mut Material, key: &str, node: &Node) -> Result<(), LibraryError> {
        let index = match number(node) {
            Ok(index) if index > 0.0 => index,
            _ => return Err(form(&node.place, &format!("`{key}` must be a number above 0"))),
        };
        let now = material.scalar(Parameter::Ior).constant().unwrap_or(Parameter::Ior.default());
        // The outer one comes first, and stands for an inner one of 1 until that is read.
        let ior = if key == keys::EXT_IOR { 1.0 / index } else { now * index };
        let checked = Parameter::Ior.check(ior).map_err(|range| form(&node.place, &range.to_string()))?;
        *material.scalar_mut(Parameter::Ior) = Param::Constant(checked);
        Ok(())
    }

    /// A field that a texture gives.
    fn textured(
        &mut self,
        material: &mut Material,
        field: MaterialField,
        node: &Node,
    ) -> Result<(), LibraryError> {
        let color = match field {
            MaterialField::BaseColor => Some(&mut material.base_color),
            MaterialField::EmissionColor => Some(&mut material.emission.color),
            MaterialField::TransmissionColor => {
                Some(material.transmission_color.get_or_insert(Param::Constant(Rgb::WHITE)))
            }
            MaterialField::DiffTransColor => {
                Some(material.diff_trans_color.get_or_insert(Param::Constant(Rgb::WHITE)))
            }
            _ => None,
        };
        if let Some(color) = color {
            let (map, factor) = self.texture(node, Encoding::Srgb)?;
            let factor = match factor {
                None => Rgb::WHITE,
                Some(node) => Rgb::from(numbers::<3>(node)?),
            };
            *color = Param::Texture { map, factor };
            return Ok(());
        }
        let scalar = match (field, field.parameter()) {
            (_, Some(parameter)) => material.scalar_mut(parameter),
            (MaterialField::Opacity, _) => &mut material.opacity.alpha,
            _ => {
                let why = format!("`{}` must be {}, not a texture", field.name(), field.expects());
                return Err(form(&node.place, &why));
            }
        };
        let (map, factor) = self.texture(node, Encoding::Linear)?;
        let factor = match factor {
            None => 1.0,
            Some(node) => number(node)?,
        };
        *scalar = Param::Texture { map, factor };
        Ok(())
    }

    /// A texture and its factor; `encoding` where the entry says none.
    fn texture<'n>(
        &mut self,
        node: &'n Node,
        encoding: Encoding,
    ) -> Result<(TextureMap, Option<&'n Node>), LibraryError> {
        let yaml::Value::Map(entries) = &node.value else {
            return Err(form(&node.place, "a texture is expected, such as {file: textures/oak.png}"));
        };
        let (mut file, mut factor) = (None, None);
        let mut channel = TextureChannel::default();
        let (mut uv_set, mut texture_from_uv) = (0, Affine2::IDENTITY);
        let mut texture = Texture {
            image: ImageId(0),
            encoding,
            wrap: [Wrap::default(); 2],
            filter: TexelFilter::default(),
        };
        for (key, place, node) in entries {
            match key.as_str() {
                keys::FILE => file = Some(node),
                keys::FACTOR => factor = Some(node),
                keys::CHANNEL => channel = choice(node, TextureChannel::from_name)?,
                keys::ENCODING => texture.encoding = choice(node, Encoding::from_name)?,
                keys::FILTER => texture.filter = choice(node, TexelFilter::from_name)?,
                keys::UV_SET => uv_set = number(node)?.clamp(0.0, 255.0) as u32,
                keys::TRANSFORM => texture_from_uv = Affine2::from_cols_array(&numbers::<6>(node)?),
                keys::WRAP => {
                    let yaml::Value::List(items) = &node.value else {
                        return Err(form(&node.place, "two of repeat, mirror and clamp are expected"));
                    };
                    let [u, v] = items.as_slice() else {
                        return Err(form(&node.place, "two of repeat, mirror and clamp are expected"));
                    };
                    texture.wrap = [choice(u, Wrap::from_name)?, choice(v, Wrap::from_name)?];
                }
                _ => return Err(form(place, &format!("a texture has no `{key}`; {}", known_of_texture()))),
            }
        }
        let file = file.ok_or_else(|| form(&node.place, "a texture names its file"))?;
        texture.image = self.image(file)?;
        let found = self.scene.textures.iter().position(|t| *t == texture);
        let index = found.unwrap_or_else(|| {
            self.scene.textures.push(texture);
            self.scene.textures.len() - 1
        });
        Ok((TextureMap { texture: TextureId(index as u32), channel, uv_set, texture_from_uv }, factor))
    }

    fn image(&mut self, node: &Node) -> Result<ImageId, LibraryError> {
        let yaml::Value::Text(file) = &node.value else {
            return Err(form(&node.place, "the file's name is expected"));
        };
        if let Some(&image) = self.images.get(file) {
            return Ok(image);
        }
        let (image, warning) = read_image(&mut self.files, &mut self.decoder, file)
            .map_err(|cause| LibraryError::Image { place: node.place.to_string(), cause })?;
        self.warnings.extend(warning);
        let id = ImageId(self.scene.images.len() as u32);
        self.scene.images.push(Arc::new(image));
        self.images.insert(file.clone(), id);
        Ok(id)
    }
}

fn known_of_texture() -> String {
    let known = [
        keys::FILE,
        keys::CHANNEL,
        keys::FACTOR,
        keys::ENCODING,
        keys::UV_SET,
        keys::TRANSFORM,
        keys::WRAP,
        keys::FILTER,
    ];
    format!("it has {}", known.join(", "))
}

fn value(node: &Node) -> Option<Value> {
    Some(match &node.value {
        yaml::Value::Number(n) => Value::Number(*n),
        yaml::Value::Whole(n) => Value::Number(*n as f64),
        yaml::Value::Text(text) => Value::Text(text.clone()),
        yaml::Value::List(items) => Value::List(items.iter().map(value).collect::<Option<_>>()?),
        yaml::Value::Bool(b) => Value::Bool(*b),
        yaml::Value::Null | yaml::Value::Map(_) => return None,
    })
}

fn number(node: &Node) -> Result<f32, LibraryError> {
    match value(node) {
        Some(Value::Number(n)) if (n as f32).is_finite() => Ok(n as f32),
        _ => Err(form(&node.place, "a number is expected")),
    }
}

fn numbers<const N: usize>(node: &Node) -> Result<[f32; N], LibraryError> {
    let wrong = || form(&node.place, &format!("{N} numbers are expected"));
    let yaml::Value::List(items) = &node.value else { return Err(wrong()) };
    let numbers: Vec<f32> = items.iter().map(number).collect::<Result<_, _>>()?;
    numbers.try_into().map_err(|_| wrong())
}

fn flag(node: &Node) -> Result<bool, LibraryError> {
    match node.value {
        yaml::Value::Bool(is) => Ok(is),
        _ => Err(form(&node.place, "true or false is expected")),
    }
}

fn choice<T>(node: &Node, from_name: impl Fn(&str) -> Option<T>) -> Result<T, LibraryError> {
    let yaml::Value::Text(text) = &node.value else { return Err(form(&node.place, "a word is expected")) };
    from_name(text).ok_or_else(|| {
        let text: String = text.chars().take(60).collect();
        form(&node.place, &format!("`{text}` is not one of the words that stand here"))
    })
}
