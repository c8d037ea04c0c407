//! Materials to look into: the same at every point, with what was done to make them so.

use super::InspectError;
use crate::color::Rgb;
use crate::disney::{Alpha, BASE_COLOR, Bsdf, Lobe, Model, Parameter, alpha_from_roughness};
use crate::math::V3;
use crate::render::constant_bsdf;
use crate::scene::material::{Material, Param};
use crate::scene::{Named, Scene};

/// A material to look into.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Its name on page and charts.
    pub name: String,
    /// All parameters constant, without maps.
    pub material: Material,
    /// How it scatters light.
    pub bsdf: Bsdf,
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
    ///
    /// # Errors
    /// If something of it still varies.
    pub fn new(scene: &Scene<Material>, named: &Named<Material>) -> Result<Self, InspectError> {
        let material = &named.item;
        let (mut means, mut notes) = (Vec::new(), Vec::new());
        let base_color = constant_color(scene, &material.base_color, BASE_COLOR, &mut means);
        let scalar = |parameter: Parameter, means: &mut Vec<&'static str>| {
            let value = constant(scene, material.scalar(parameter), parameter.name(), means);
            // Textures and their factors may leave the range; the renderer clamps them too.
            Param::Constant(
                parameter.check(value).unwrap_or_else(|_| value.clamp(parameter.min(), parameter.max())),
            )
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
        if material.anisotropy.as_ref().is_some_and(|a| a.map.is_some()) {
            means.push("anisotropy");
        }
        flat = scene.with_mean_anisotropy(&flat);
        let emission = constant_color(scene, &material.emission.color, "emission_color", &mut means);
        flat.emission.color = Param::Constant(emission);
        for (color, name) in [
            (&mut flat.transmission_color, "transmission_color"),
            (&mut flat.diff_trans_color, "diff_trans_color"),
        ] {
            *color = color.take().map(|c| Param::Constant(constant_color(scene, &c, name, &mut means)));
        }
        flat.opacity.alpha = Param::Constant(constant(scene, &material.opacity.alpha, "opacity", &mut means));
        for (there, note) in [
            (material.normal_map.is_some(), "its normal map is left out"),
            (material.vertex_color || material.vertex_alpha, "the mesh's vertex colours are left out"),
        ] {
            if there {
                notes.push(note);
            }
        }
        let name = named.name.clone();
        match constant_bsdf(&flat) {
            Some(bsdf) => Ok(Self { name, material: flat, bsdf, means, notes }),
            None => Err(InspectError::Varies { material: name }),
        }
    }

    /// The roughness of the specular lobe's distribution along the tangent and across it.
    fn alpha(&self) -> Alpha<f32> {
        alpha_from_roughness(self.scalar(Parameter::Roughness), self.scalar(Parameter::Anisotropic))
    }

    /// The specular lobe's reflectance at normal incidence, if it has a distribution: straight from above its value is
    /// F0·D/4 with D = 1/(π ax ay).
    fn reflectance_at_normal(&self) -> Option<Rgb> {
        let normal = V3::new(0.0, 0.0, 1.0);
        let has_distribution = self.bsdf.lobes().contains(&Lobe::Specular);
        let alpha = self.alpha();
        let d = std::f32::consts::FRAC_1_PI / (alpha.x * alpha.y);
        has_distribution.then(|| self.bsdf.eval_lobe(Lobe::Specular, normal, normal) * (4.0 / d))
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
            row("masking", material.masking.name().to_owned(), material.masking == defaults.masking);
            row("diffuse", material.diffuse.name().to_owned(), material.diffuse == defaults.diffuse);
            for (name, color) in [
                ("transmission_color", &material.transmission_color),
                ("diff_trans_color", &material.diff_trans_color),
            ] {
                if let Some(color) = color.as_ref().and_then(Param::constant) {
                    row(name, color_text(color), false);
                }
            }
            if material.transmits() {
                let thin = material.thin_walled;
                row("thin_walled", thin.to_string(), thin == defaults.thin_walled);
            }
            if let Some(f0) = self.reflectance_at_normal() {
                row("F0", color_text(f0), false);
            }
            let alpha = self.alpha();
            row("α along the tangent", number(alpha.x.into()), false);
            row("α across it", number(alpha.y.into()), false);
        }
        if material.model == Model::Dielectric {
            let ior = self.scalar(Parameter::Ior);
            row("ior", number(ior.into()), ior == Parameter::Ior.default());
            let ratio = (ior - 1.0) / (ior + 1.0);
            row("F0", number((ratio * ratio).into()), false);
        }
        if material.is_interface() {
            let absorption = material.absorption;
            row("absorption", color_text(absorption), absorption == defaults.absorption);
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
            scene.mean_texel(map).color * *factor
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
    if param.constant().is_none() {
        means.push(name);
    }
    scene.mean_scalar(param)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::material::{TextureChannel, TextureMap};
    use crate::scene::texture::{Encoding, Pixels, TexelFilter, Wrap};
    use crate::scene::{Image, ImageId, Texture, TextureId};

    fn value<'a>(rows: &'a [ParameterRow], name: &str) -> &'a ParameterRow {
        rows.iter().find(|row| row.name == name).unwrap_or_else(|| panic!("no {name}"))
    }

    #[test]
    fn textures_count_as_their_mean_and_the_table_says_so() {
        let mut scene = Scene::empty();
        let pixels = Pixels::U8(vec![0, 255, 255, 255]);
        scene.images.push(Arc::new(Image { name: "x".into(), width: 4, height: 1, channels: 1, pixels }));
        scene.textures.push(Texture {
            image: ImageId(0),
            encoding: Encoding::Linear,
            wrap: [Wrap::Repeat; 2],
            filter: TexelFilter::Bilinear,
        });
        let map = TextureMap::new(TextureId(0), TextureChannel::R);
        let mut material = Material { vertex_color: true, ..Material::default() };
        *material.scalar_mut(Parameter::Roughness) = Param::Texture { map, factor: 0.8 };
        let subject = Subject::new(&scene, &Named::new("wood", material)).unwrap();
        assert!((subject.scalar(Parameter::Roughness) - 0.6).abs() < 1e-6);
        let rows = subject.parameters();
        assert_eq!(value(&rows, "roughness").value, "0.6");
        assert_eq!(value(&rows, "roughness").note, "the mean of its texture");
        assert!(value(&rows, "metallic").is_default && !value(&rows, "roughness").is_default);
        assert_eq!(subject.notes, ["the mesh's vertex colours are left out"]);
    }

    #[test]
    fn f0_and_alpha_follow_from_the_parameters() {
        let mut material = Material::default();
        for (parameter, value) in [(Parameter::Roughness, 0.6), (Parameter::Anisotropic, 0.5)] {
            *material.scalar_mut(parameter) = Param::Constant(value);
        }
        let rows = Subject::new(&Scene::empty(), &Named::new("x", material)).unwrap().parameters();
        // 0.08·specular; 0.36 over and times sqrt(1 - 0.9·0.5).
        assert_eq!(value(&rows, "F0").value, "0.04, 0.04, 0.04");
        assert_eq!(value(&rows, "α along the tangent").value, "0.4854");
        assert_eq!(value(&rows, "α across it").value, "0.267");
    }
}
