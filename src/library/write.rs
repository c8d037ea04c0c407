//! A scene's materials as a library's text, with the images that it names.

use std::fmt::Write;

use super::{TextureFiles, keys};
use crate::color::Rgb;
use crate::disney::{Model, Parameter};
use crate::scene::Scene;
use crate::scene::material::{Curve, Material, Param, TextureChannel, TextureMap};
use crate::scene::texture::{TexelFilter, Wrap};

/// A library's text and its textures.
#[derive(Clone, Debug)]
pub struct Written<'a> {
    /// The YAML.
    pub text: String,
    /// The images that the text names.
    pub textures: TextureFiles<'a>,
}

/// The materials of `scene` as a library; `source` is named in its first line.
///
/// Every material says all of its model's own parameters, and what else differs from the default. Numbers are the shortest that read
/// back to the same bits.
pub fn write<'a>(scene: &'a Scene<Material>, source: &str) -> Written<'a> {
    let mut writer = Writer { scene, textures: TextureFiles::new(scene), text: String::new() };
    writer.line(0, &format!("# Materials of {source}: change a number and render with --materials FILE."));
    for material in &scene.materials {
        writer.line(0, &format!("{}:", quoted(&material.name)));
        writer.material(&material.item);
    }
    Written { text: writer.text, textures: writer.textures }
}

/// What a library's file is called.
pub const FILE_NAME: &str = "materials.yaml";

struct Writer<'a> {
    scene: &'a Scene<Material>,
    textures: TextureFiles<'a>,
    text: String,
}

impl Writer<'_> {
    fn line(&mut self, depth: usize, text: &str) {
        self.text.push_str(&"  ".repeat(depth));
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn entry(&mut self, key: &str, value: &str) {
        self.line(2, &format!("{key}: {value}"));
    }

    fn material(&mut self, m: &Material) {
        let default = Material::default();
        self.line(1, &format!("name: {}", m.model.name()));
        self.line(1, "config:");
        let start = self.text.len();
        match m.model {
            Model::Disney => {
                self.color(keys::COLOR, &m.base_color);
                for p in Parameter::ALL {
                    let is_own = Parameter::BURLEY_2012.contains(&p);
                    if is_own || m.scalar(p) != default.scalar(p) {
                        self.scalar(keys::of(p), m.scalar(p));
                    }
                }
                self.disney_choices(m, &default);
            }
            Model::Diffuse => self.color(keys::COLOR, &m.base_color),
            Model::Mirror => {}
            Model::Dielectric => {
                self.entry(keys::EXT_IOR, "1");
                self.scalar(keys::INT_IOR, m.scalar(Parameter::Ior));
            }
        }
        self.around(m, &default);
        if self.text.len() == start {
            // An empty map: nothing but the model.
            self.text.truncate(start - 1);
            self.text.push_str(" {}\n");
        }
    }

    /// What only the Disney model has, beyond its scalars.
    fn disney_choices(&mut self, m: &Material, default: &Material) {
        if let Some(color) = &m.transmission_color {
            self.color("transmissionColor", color);
        }
        if let Some(color) = &m.diff_trans_color {
            self.color("diffTransColor", color);
        }
        if m.thin_walled {
            self.entry("thinWalled", "true");
        }
        if m.masking != default.masking {
            self.entry("masking", m.masking.name());
        }
        if m.diffuse != default.diffuse {
            self.entry("diffuse", m.diffuse.name());
        }
    }

    /// What every model may have around its BSDF.
    fn around(&mut self, m: &Material, default: &Material) {
        if m.absorption != default.absorption {
            self.entry("absorption", &rgb(m.absorption));
        }
        if m.emits() {
            self.color("emissionColor", &m.emission.color);
            self.entry("emissionStrength", &number(m.emission.strength));
            self.entry(keys::EMISSION_SIDES, m.emission.sides.name());
            if m.emission.unlit {
                self.entry(keys::UNLIT, "true");
            }
        }
        if m.opacity != default.opacity {
            self.scalar("opacity", &m.opacity.alpha);
            if let Some(cutoff) = m.opacity.cutoff {
                self.entry("cutoff", &number(cutoff));
            }
        }
        if let Some(normal) = &m.normal_map {
            let map = self.map(&normal.map, None, None);
            self.entry(keys::NORMAL_MAP, &map);
            self.entry("normalScale", &number(normal.scale));
        }
        if let Some(anisotropy) = &m.anisotropy {
            if let Some(map) = &anisotropy.map {
                let map = self.map(map, None, None);
                self.entry(keys::ANISOTROPY_MAP, &map);
            }
            self.entry(keys::ANISOTROPY_STRENGTH, &number(anisotropy.strength));
        }
        if m.rotation != 0.0 {
            // In f64, so that it comes back to the same bits.
            self.entry("rotation", &f64::from(m.rotation).to_degrees().to_string());
        }
        if m.frame != default.frame {
            self.entry(keys::FRAME, m.frame.name());
        }
        if m.sides != default.sides {
            self.entry(keys::SIDES, m.sides.name());
        }
        for (key, is) in [
            (keys::CULLED, m.culled),
            (keys::VERTEX_COLOR, m.vertex_color),
            (keys::VERTEX_ALPHA, m.vertex_alpha),
        ] {
            if is {
                self.entry(key, "true");
            }
        }
    }

    fn scalar(&mut self, key: &str, param: &Param<f32>) {
        let text = match param {
            Param::Constant(value) => number(*value),
            Param::Texture { map, factor } => self.map(map, Some(map.channel), Some(number(*factor))),
        };
        self.entry(key, &text);
    }

    fn color(&mut self, key: &str, param: &Param<Rgb>) {
        let text = match param {
            Param::Constant(value) => rgb(*value),
            Param::Texture { map, factor } => self.map(map, None, Some(rgb(*factor))),
        };
        self.entry(key, &text);
    }

    /// A texture as one parameter uses it, as a map on one line; what is as by default is left out.
    fn map(&mut self, map: &TextureMap, channel: Option<TextureChannel>, factor: Option<String>) -> String {
        let texture = &self.scene.textures[map.texture.0 as usize];
        let mut text = format!("{{file: {}", quoted(&self.textures.of(texture.image)));
        let mut add = |key: &str, value: &str| {
            let _ = write!(text, ", {key}: {value}");
        };
        if let Some(channel) = channel {
            add(keys::CHANNEL, channel.name());
        }
        if let Some(factor) = factor {
            add(keys::FACTOR, &factor);
        }
        if map.curve != Curve::default() {
            add(keys::CURVE, map.curve.name());
        }
        add(keys::ENCODING, texture.encoding.name());
        if map.uv_set != 0 {
            add(keys::UV_SET, &map.uv_set.to_string());
        }
        if map.texture_from_uv != glam::Affine2::IDENTITY {
            let columns = map.texture_from_uv.to_cols_array().map(number);
            add(keys::TRANSFORM, &format!("[{}]", columns.join(", ")));
        }
        if texture.wrap != [Wrap::default(); 2] {
            let [u, v] = texture.wrap.map(|w| w.name());
            add(keys::WRAP, &format!("[{u}, {v}]"));
        }
        if texture.filter != TexelFilter::default() {
            add(keys::FILTER, texture.filter.name());
        }
        text.push('}');
        text
    }
}

/// The shortest decimal that reads back to the same float.
fn number(value: f32) -> String {
    value.to_string()
}

fn rgb(c: Rgb) -> String {
    format!("[{}, {}, {}]", number(c.r), number(c.g), number(c.b))
}

/// Text as YAML takes it for text, whatever it holds: JSON's strings are YAML's.
fn quoted(text: &str) -> String {
    let plain = !text.is_empty()
        && text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '/'))
        && !["true", "false", "null", "yes", "no", "on", "off", "y", "n", "inf", "nan"]
            .iter()
            .any(|word| text.eq_ignore_ascii_case(word));
    if plain { text.to_owned() } else { serde_json::Value::from(text).to_string() }
}
