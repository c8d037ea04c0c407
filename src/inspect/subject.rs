//! Materials to look into: the same at every point, with what was done to make them so.

use crate::color::Rgb;
use crate::disney::{
    BASE_COLOR, Bsdf, DiffuseModel, Masking, Model, Parameter, Params, alpha_from_roughness,
    reflectance_at_normal,
};
use crate::render::scatter;
use crate::scene::material::{Material, Param, TextureChannel, TextureMap};
use crate::scene::{Named, Scene, texture::Texel};

/// A material to look into.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Its name on page and charts.
    pub name: String,
    /// All parameters constant, without maps.
    pub material: Material,
    /// The parameters that are means of textures, by name.
    pub means: Vec<&'static str>,
    /// What else of the material is not looked at.
    pub notes: Vec<&'static str>,
}

/// A line of the table of parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterRow {
    /// The parameter, or a quantity that follows from them.
    pub name: &'static str,
    /// Its value as text.
    pub value: String,
    /// Where it comes from, if there is something to say.
    pub note: &'static str,
    /// It is what the model has where nothing is said.
    pub is_default: bool,
}

impl Subject {
    /// The material at every point as it is on average over its textures.
    pub fn new(scene: &Scene<Material>, named: &Named<Material>) -> Self {
        let material = &named.item;
        let (mut means, mut notes) = (Vec::new(), Vec::new());
        let base_color = constant_color(scene, &material.base_color, BASE_COLOR, &mut means);
        let scalar = |parameter: Parameter, means: &mut Vec<&'static str>| {
            let value = constant(scene, material.scalar(parameter), parameter.name(), means);
            // Textures and their factors may leave the range; the renderer clamps them too.
            Param::Constant(parameter.check(value).unwrap_or_else(|_| value.clamp(0.0, parameter.max())))
        };
        let mut flat = Material {
            base_color: Param::Constant(base_color.map(|v| v.clamp(0.0, 1.0))),
            normal_map: None,
            vertex_color: false,
            vertex_alpha: false,
            ..material.clone()
        };
        for parameter in Parameter::ALL {
            *flat.scalar_mut(parameter) = scalar(parameter, &mut means);
        }
        let emission = constant_color(scene, &material.emission.color, "emission_color", &mut means);
        flat.emission.color = Param::Constant(emission);
        flat.opacity.alpha = Param::Constant(constant(scene, &material.opacity.alpha, "opacity", &mut means));
        for (there, note) in [
            (material.normal_map.is_some(), "its normal map is left out"),
            (material.vertex_color || material.vertex_alpha, "the mesh's vertex colours are left out"),
        ] {
            if there {
                notes.push(note);
            }
        }
        Self { name: named.name.clone(), material: flat, means, notes }
    }

    /// How it scatters light.
    pub fn bsdf(&self) -> Bsdf {
        scatter(&self.material, self.base_color(), |p| self.scalar(p))
    }

    /// All its parameters.
    fn params(&self) -> Params {
        let mut params = Params { base_color: self.base_color(), ..Params::default() };
        for parameter in Parameter::ALL {
            *params.get_mut(parameter) = self.scalar(parameter);
        }
        params
    }

    /// Its base colour.
    pub fn base_color(&self) -> Rgb {
        self.material.base_color.constant().unwrap_or(Rgb::WHITE)
    }

    /// A scalar parameter.
    pub fn scalar(&self, parameter: Parameter) -> f32 {
        self.material.scalar(parameter).constant().unwrap_or(parameter.default())
    }

    /// The parameters that its model reads, and what follows from them.
    pub fn parameters(&self) -> Vec<ParameterRow> {
        let defaults = Material::default();
        let material = &self.material;
        let mut rows = Vec::new();
        let mut row = |name, value: String, is_default| {
            let note = if self.means.contains(&name) { "the mean of its texture" } else { "" };
            rows.push(ParameterRow { name, value, note, is_default });
        };
        row("model", material.model.name().to_owned(), material.model == defaults.model);
        if matches!(material.model, Model::Disney | Model::Diffuse) {
            let color = self.base_color();
            row(BASE_COLOR, color_text(color), Some(color) == defaults.base_color.constant());
        }
        if material.model == Model::Disney {
            for parameter in Parameter::ALL {
                let value = self.scalar(parameter);
                row(parameter.name(), number(value.into()), value == parameter.default());
            }
            let masking = match material.masking {
                Masking::Matched => "matched",
                Masking::Remapped => "remapped",
            };
            row("masking", masking.to_owned(), material.masking == defaults.masking);
            let diffuse = match material.diffuse {
                DiffuseModel::Burley => "burley",
                DiffuseModel::Lambert => "lambert",
                DiffuseModel::LambertFresnel => "lambert_fresnel",
            };
            row("diffuse", diffuse.to_owned(), material.diffuse == defaults.diffuse);
            let params = self.params();
            row("F0", color_text(reflectance_at_normal(&params)), false);
            let alpha = alpha_from_roughness(params.roughness, params.anisotropic);
            row("α along the tangent", number(alpha.x.into()), false);
            row("α across it", number(alpha.y.into()), false);
        }
        if material.model == Model::Dielectric {
            row("ior", number(material.ior.into()), material.ior == defaults.ior);
            let ratio = (material.ior - 1.0) / (material.ior + 1.0);
            row("F0", number((ratio * ratio).into()), false);
        }
        if material.emits() {
            let color = material.emission.color.constant().unwrap_or(Rgb::BLACK) * material.emission.strength;
            row("emission_color", color_text(color), false);
        }
        if let Some(alpha) = material.opacity.alpha.constant().filter(|&a| a < 1.0) {
            row("opacity", number(alpha.into()), false);
        }
        rows
    }
}

/// A colour as the table shows it.
pub(super) fn color_text(color: Rgb) -> String {
    let [r, g, b] = color.to_array().map(|v| number(v.into()));
    format!("{r}, {g}, {b}")
}

/// Up to four decimals, without zeros behind.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A colour's value, or its texture's mean.
fn constant_color(
    scene: &Scene<Material>,
    param: &Param<Rgb>,
    name: &'static str,
    means: &mut Vec<&'static str>,
) -> Rgb {
    match param {
        Param::Constant(color) => *color,
        Param::Texture { map, factor } => {
            means.push(name);
            mean(scene, map).color * *factor
        }
    }
}

/// A scalar's value, or its texture's mean.
fn constant(
    scene: &Scene<Material>,
    param: &Param<f32>,
    name: &'static str,
    means: &mut Vec<&'static str>,
) -> f32 {
    match param {
        Param::Constant(value) => *value,
        Param::Texture { map, factor } => {
            means.push(name);
            let Texel { color, alpha } = mean(scene, map);
            factor
                * match map.channel {
                    TextureChannel::R => color.r,
                    TextureChannel::G => color.g,
                    TextureChannel::B => color.b,
                    TextureChannel::A => alpha,
                }
        }
    }
}

/// The mean of all texels of a texture, decoded.
fn mean(scene: &Scene<Material>, map: &TextureMap) -> Texel {
    let texture = &scene.textures[map.texture.0 as usize];
    let image = &scene.images[texture.image.0 as usize];
    let (mut color, mut alpha) = (Rgb::<f64>::BLACK, 0.0);
    for y in 0..image.height {
        for x in 0..image.width {
            let texel = image.texel(x, y, texture.encoding);
            color += texel.color.cast();
            alpha += f64::from(texel.alpha);
        }
    }
    let texels = (f64::from(image.width) * f64::from(image.height)).max(1.0);
    Texel { color: (color / texels).cast(), alpha: (alpha / texels) as f32 }
}
