//! The parameters of the model, their ranges and defaults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::color::Rgb;
use crate::math::Real;

/// The name of the one parameter that is a colour.
pub const BASE_COLOR: &str = "base_color";

/// A scalar parameter: the ten of Burley 2012, and what later scenes need beyond them.
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
    /// The part of the base that is a rough dielectric interface instead of diffuse (Burley 2015).
    SpecTrans,
    /// That interface's refractive index, inside over outside.
    Ior,
    /// Twice the part of the diffuse light that goes through: 2 transmits all of it (Burley 2015).
    DiffTrans,
    /// The dielectric highlight's reflectance at grazing angles; a metal's is 1.
    F90,
}

impl Parameter {
    /// How many there are.
    pub const COUNT: usize = 14;

    /// All scalar parameters, those of Burley 2012 first.
    pub const ALL: [Self; Self::COUNT] = [
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
        Self::SpecTrans,
        Self::Ior,
        Self::DiffTrans,
        Self::F90,
    ];

    /// The ten of Burley 2012, in the report's order.
    pub const BURLEY_2012: [Self; 10] = match Self::ALL.first_chunk() {
        Some(ten) => *ten,
        None => unreachable!(),
    };

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
            Self::SpecTrans => "spec_trans",
            Self::Ior => "ior",
            Self::DiffTrans => "diff_trans",
            Self::F90 => "f90",
        }
    }

    /// The parameter of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// The smallest legal value.
    pub const fn min(self) -> f32 {
        match self {
            Self::Ior => 0.1,
            _ => 0.0,
        }
    }

    /// The largest legal value. F0 = 0.08·specular ends at 1; converted materials hold clearcoats up to 4.
    pub const fn max(self) -> f32 {
        match self {
            Self::Specular => 12.5,
            Self::Clearcoat => 4.0,
            Self::Ior => 10.0,
            Self::DiffTrans => 2.0,
            _ => 1.0,
        }
    }

    /// The value where a file says nothing.
    pub const fn default(self) -> f32 {
        match self {
            Self::Specular | Self::Roughness | Self::SheenTint => 0.5,
            Self::ClearcoatGloss | Self::F90 => 1.0,
            Self::Ior => 1.5,
            _ => 0.0,
        }
    }

    /// `value` if it is in range.
    ///
    /// # Errors
    /// [`OutOfRange`] for NaN and values outside [min, max].
    pub fn check(self, value: f32) -> Result<f32, OutOfRange> {
        check_range(self.name(), value, self.min(), self.max())
    }
}

/// `value` if it is in [min, max].
pub(crate) fn check_range(name: &'static str, value: f32, min: f32, max: f32) -> Result<f32, OutOfRange> {
    if (min..=max).contains(&value) { Ok(value) } else { Err(OutOfRange { name, value, min, max }) }
}

/// `color` if every channel is in [0, 1].
///
/// # Errors
/// [`OutOfRange`] with the first offending channel's value.
pub fn check_base_color(color: Rgb) -> Result<Rgb, OutOfRange> {
    color.to_array().into_iter().try_for_each(|v| check_range(BASE_COLOR, v, 0.0, 1.0).map(drop))?;
    Ok(color)
}

/// A parameter outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}, but must be in [{min}, {max}]")]
pub struct OutOfRange {
    /// The parameter.
    pub name: &'static str,
    /// What it was.
    pub value: f32,
    /// The smallest legal value.
    pub min: f32,
    /// The largest legal value.
    pub max: f32,
}

/// Which BSDF a material has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// All of Burley 2012, with the transmission of Burley 2015.
    #[default]
    Disney,
    /// Lambert, base_color/π, nothing else.
    Diffuse,
    /// A perfect mirror of reflectance 1.
    Mirror,
    /// A smooth interface between two clear media with exact Fresnel reflectance.
    Dielectric,
}

named_variants! { Model { Disney "disney", Diffuse "diffuse", Mirror "mirror", Dielectric "dielectric", } }

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

named_variants! { Masking { Matched "matched", Remapped "remapped", } }

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

named_variants! { DiffuseModel { Burley "burley", Lambert "lambert", LambertFresnel "lambert_fresnel", } }

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
    /// [`Parameter::SpecTrans`].
    pub spec_trans: F,
    /// [`Parameter::Ior`].
    pub ior: F,
    /// [`Parameter::DiffTrans`].
    pub diff_trans: F,
    /// [`Parameter::F90`].
    pub f90: F,
    /// A sheet without an inside: light that goes through isn't bent.
    pub thin_walled: bool,
    /// What one crossing of the dielectric interface lets pass; where absent the square root of the base colour, so that a pane
    /// crossed twice shows it once, and the base colour itself if thin-walled (Burley 2015, section 4.1).
    pub transmission_color: Option<Rgb<F>>,
    /// The colour of diffuse transmission; the base colour where absent.
    pub diff_trans_color: Option<Rgb<F>>,
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
            spec_trans: scalar(Parameter::SpecTrans),
            ior: scalar(Parameter::Ior),
            diff_trans: scalar(Parameter::DiffTrans),
            f90: scalar(Parameter::F90),
            thin_walled: false,
            transmission_color: None,
            diff_trans_color: None,
        }
    }
}

impl<F: Real> Params<F> {
    /// The part of the base that scatters by its dielectric interface alone, spec_trans·(1 - metallic).
    #[inline]
    pub(super) fn interface_part(&self) -> F {
        self.spec_trans * (F::ONE - self.metallic)
    }

    /// The part of the base that is neither metal nor such an interface: it holds diffuse reflection and transmission, and sheen.
    #[inline]
    pub(super) fn diffuse_part(&self) -> F {
        (F::ONE - self.metallic) * (F::ONE - self.spec_trans)
    }

    /// The same parameters in another float type.
    pub fn cast<G: Real>(&self) -> Params<G> {
        let mut cast = Params::<G> {
            base_color: self.base_color.cast(),
            thin_walled: self.thin_walled,
            transmission_color: self.transmission_color.map(Rgb::cast),
            diff_trans_color: self.diff_trans_color.map(Rgb::cast),
            ..Params::default()
        };
        for p in Parameter::ALL {
            *cast.get_mut(p) = G::of(self.get(p).to_f64());
        }
        cast
    }

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
            Parameter::SpecTrans => self.spec_trans,
            Parameter::Ior => self.ior,
            Parameter::DiffTrans => self.diff_trans,
            Parameter::F90 => self.f90,
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
            Parameter::SpecTrans => &mut self.spec_trans,
            Parameter::Ior => &mut self.ior,
            Parameter::DiffTrans => &mut self.diff_trans,
            Parameter::F90 => &mut self.f90,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_parameters_are_one_to_one() {
        assert_eq!(Parameter::BURLEY_2012[9], Parameter::ClearcoatGloss);
        for (i, p) in Parameter::ALL.into_iter().enumerate() {
            assert_eq!(Parameter::from_name(p.name()), Some(p));
            assert_eq!(p as usize, i);
            assert!(p.check(p.default()).is_ok());
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
