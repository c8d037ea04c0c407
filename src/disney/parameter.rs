//! The parameters of the model, their ranges and defaults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::color::Rgb;
use crate::math::Real;

/// The name of the one parameter that is a colour.
pub const BASE_COLOR: &str = "base_color";

/// A scalar parameter of Burley 2012.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Parameter {
    /// Blends the diffuse shape towards a flattened, Hanrahan-Krueger-like one.
    Subsurface,
    /// 0 is a dielectric, 1 a metal whose specular colour is the base colour.
    Metallic,
    /// The dielectric's reflectance at normal incidence, F0 = 0.08·specular.
    Specular,
    /// Tints that reflectance towards the base colour's hue.
    SpecularTint,
    /// Surface roughness; alpha = roughness².
    Roughness,
    /// The highlight's aspect.
    Anisotropic,
    /// A grazing component for cloth.
    Sheen,
    /// Tints the sheen towards the base colour's hue.
    SheenTint,
    /// The strength of the second specular lobe.
    Clearcoat,
    /// That lobe's gloss: 0 is satin, 1 gloss.
    ClearcoatGloss,
}

impl Parameter {
    /// All scalar parameters, in the report's order.
    pub const ALL: [Self; 10] = [
        Self::Subsurface,
        Self::Metallic,
        Self::Specular,
        Self::SpecularTint,
        Self::Roughness,
        Self::Anisotropic,
        Self::Sheen,
        Self::SheenTint,
        Self::Clearcoat,
        Self::ClearcoatGloss,
    ];

    /// The name in files and paths.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Subsurface => "subsurface",
            Self::Metallic => "metallic",
            Self::Specular => "specular",
            Self::SpecularTint => "specular_tint",
            Self::Roughness => "roughness",
            Self::Anisotropic => "anisotropic",
            Self::Sheen => "sheen",
            Self::SheenTint => "sheen_tint",
            Self::Clearcoat => "clearcoat",
            Self::ClearcoatGloss => "clearcoat_gloss",
        }
    }

    /// The parameter of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// The largest legal value; the smallest is 0. F0 = 0.08·specular ends at 1; converted materials hold clearcoats up to 4.
    pub const fn max(self) -> f32 {
        match self {
            Self::Specular => 12.5,
            Self::Clearcoat => 4.0,
            _ => 1.0,
        }
    }

    /// The value where a file says nothing.
    pub const fn default(self) -> f32 {
        match self {
            Self::Specular | Self::Roughness | Self::SheenTint => 0.5,
            Self::ClearcoatGloss => 1.0,
            _ => 0.0,
        }
    }

    /// `value` if it is in range.
    ///
    /// # Errors
    /// [`OutOfRange`] for NaN and values outside [0, max].
    pub fn check(self, value: f32) -> Result<f32, OutOfRange> {
        check_range(self.name(), value, self.max())
    }
}

/// `value` if it is in [0, max].
pub(crate) fn check_range(name: &'static str, value: f32, max: f32) -> Result<f32, OutOfRange> {
    if (0.0..=max).contains(&value) { Ok(value) } else { Err(OutOfRange { name, value, max }) }
}

/// `color` if every channel is in [0, 1].
///
/// # Errors
/// [`OutOfRange`] with the first offending channel's value.
pub fn check_base_color(color: Rgb) -> Result<Rgb, OutOfRange> {
    color.to_array().into_iter().try_for_each(|v| check_range(BASE_COLOR, v, 1.0).map(drop))?;
    Ok(color)
}

/// A parameter outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}, but must be in [0, {max}]")]
pub struct OutOfRange {
    /// The parameter.
    pub name: &'static str,
    /// What it was.
    pub value: f32,
    /// The largest legal value.
    pub max: f32,
}

/// Which BSDF a material has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// All of Burley 2012.
    #[default]
    Disney,
    /// Lambert, base_color/π, nothing else.
    Diffuse,
    /// A perfect mirror of reflectance 1.
    Mirror,
    /// A smooth interface between two clear media with exact Fresnel reflectance.
    Dielectric,
}

impl Model {
    /// All models.
    pub const ALL: [Self; 4] = [Self::Disney, Self::Diffuse, Self::Mirror, Self::Dielectric];

    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Disney => "disney",
            Self::Diffuse => "diffuse",
            Self::Mirror => "mirror",
            Self::Dielectric => "dielectric",
        }
    }

    /// The model of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }
}

/// The roughness that the masking-shadowing term G of the specular lobe uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Masking {
    /// The same (ax, ay) as D, as BRDF Explorer's current file and glTF.
    #[default]
    Matched,
    /// Roughness replaced by 0.5 + roughness/2, as the 2012 report and Aris.
    Remapped,
}

/// The diffuse term of the Disney model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DiffuseModel {
    /// Burley 2012, with retroreflection.
    #[default]
    Burley,
    /// base_color/π.
    Lambert,
    /// base_color/π · (1 - F), F the specular lobe's Fresnel term: glTF's own.
    LambertFresnel,
}

/// The parameters at one point of a surface, in range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params<F = f32> {
    /// Linear reflectance.
    pub base_color: Rgb<F>,
    /// [`Parameter::Subsurface`].
    pub subsurface: F,
    /// [`Parameter::Metallic`].
    pub metallic: F,
    /// [`Parameter::Specular`].
    pub specular: F,
    /// [`Parameter::SpecularTint`].
    pub specular_tint: F,
    /// [`Parameter::Roughness`].
    pub roughness: F,
    /// [`Parameter::Anisotropic`].
    pub anisotropic: F,
    /// [`Parameter::Sheen`].
    pub sheen: F,
    /// [`Parameter::SheenTint`].
    pub sheen_tint: F,
    /// [`Parameter::Clearcoat`].
    pub clearcoat: F,
    /// [`Parameter::ClearcoatGloss`].
    pub clearcoat_gloss: F,
}

impl<F: Real> Default for Params<F> {
    fn default() -> Self {
        let scalar = |p: Parameter| F::of(f64::from(p.default()));
        Self {
            base_color: Rgb::grey(F::of(0.8)),
            subsurface: scalar(Parameter::Subsurface),
            metallic: scalar(Parameter::Metallic),
            specular: scalar(Parameter::Specular),
            specular_tint: scalar(Parameter::SpecularTint),
            roughness: scalar(Parameter::Roughness),
            anisotropic: scalar(Parameter::Anisotropic),
            sheen: scalar(Parameter::Sheen),
            sheen_tint: scalar(Parameter::SheenTint),
            clearcoat: scalar(Parameter::Clearcoat),
            clearcoat_gloss: scalar(Parameter::ClearcoatGloss),
        }
    }
}

impl<F: Real> Params<F> {
    /// The scalar of that name.
    pub fn get(&self, parameter: Parameter) -> F {
        match parameter {
            Parameter::Subsurface => self.subsurface,
            Parameter::Metallic => self.metallic,
            Parameter::Specular => self.specular,
            Parameter::SpecularTint => self.specular_tint,
            Parameter::Roughness => self.roughness,
            Parameter::Anisotropic => self.anisotropic,
            Parameter::Sheen => self.sheen,
            Parameter::SheenTint => self.sheen_tint,
            Parameter::Clearcoat => self.clearcoat,
            Parameter::ClearcoatGloss => self.clearcoat_gloss,
        }
    }

    /// A mutable reference to the scalar of that name.
    pub fn get_mut(&mut self, parameter: Parameter) -> &mut F {
        match parameter {
            Parameter::Subsurface => &mut self.subsurface,
            Parameter::Metallic => &mut self.metallic,
            Parameter::Specular => &mut self.specular,
            Parameter::SpecularTint => &mut self.specular_tint,
            Parameter::Roughness => &mut self.roughness,
            Parameter::Anisotropic => &mut self.anisotropic,
            Parameter::Sheen => &mut self.sheen,
            Parameter::SheenTint => &mut self.sheen_tint,
            Parameter::Clearcoat => &mut self.clearcoat,
            Parameter::ClearcoatGloss => &mut self.clearcoat_gloss,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_parameters_are_one_to_one() {
        for p in Parameter::ALL {
            assert_eq!(Parameter::from_name(p.name()), Some(p));
            let mut params = Params::<f32>::default();
            *params.get_mut(p) = 0.25;
            assert_eq!(params.get(p), 0.25);
        }
    }

    #[test]
    fn nan_and_values_out_of_range_are_refused() {
        assert!(Parameter::Roughness.check(f32::NAN).is_err());
        assert!(Parameter::Roughness.check(-1e-9).is_err());
        assert!(Parameter::Roughness.check(1.0).is_ok());
        assert!(Parameter::Specular.check(2.155).is_ok());
        let error = check_base_color(Rgb::new(0.1, 1.5, 0.0)).unwrap_err();
        assert_eq!(error.to_string(), "base_color is 1.5, but must be in [0, 1]");
    }
}
