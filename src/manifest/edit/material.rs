//! Fields of materials.

use super::field::MaterialField;
use super::value::{self, Mismatch, Outcome};
use crate::color::Rgb;
use crate::disney::{DiffuseModel, Masking, Model};
use crate::record::Value;
use crate::scene::Material;
use crate::scene::material::Param;

/// Sets one field. A constant takes the place of a texture, a base colour that of vertex colours, and
/// `anisotropic` that of glTF's anisotropy.
pub(super) fn set(material: &mut Material, field: MaterialField, value: &Value) -> Result<Outcome, Mismatch> {
    if let Some(parameter) = field.parameter() {
        let number = parameter.check(value::any_number(value)?).map_err(|_| Mismatch)?;
        *material.scalar_mut(parameter) = Param::Constant(number);
        if field == MaterialField::Anisotropic {
            material.anisotropy = None;
        }
        return Ok(Outcome::Set);
    }
    match field {
        MaterialField::BaseColor => {
            material.base_color = Param::Constant(value::color(value, 1.0)?);
            material.vertex_color = false;
        }
        MaterialField::Model => material.model = value::choice(value, Model::from_name)?,
        MaterialField::Masking => {
            material.masking = value::choice(value, Masking::from_name)?;
        }
        MaterialField::Diffuse => {
            material.diffuse = value::choice(value, DiffuseModel::from_name)?;
        }
        MaterialField::TransmissionColor => {
            let color = value::or_none(value, |v| value::color(v, 1.0))?;
            material.transmission_color = color.map(Param::Constant);
        }
        MaterialField::DiffTransColor => {
            let color = value::or_none(value, |v| value::color(v, 1.0))?;
            material.diff_trans_color = color.map(Param::Constant);
        }
        MaterialField::ThinWalled => material.thin_walled = value::flag(value)?,
        MaterialField::Absorption => {
            let coefficients = value::numbers::<3>(value)?;
            if coefficients.iter().any(|&c| c < 0.0) {
                return Err(Mismatch);
            }
            material.absorption = Rgb::from(coefficients);
        }
        MaterialField::EmissionColor => {
            let color: Rgb = value::color(value, f32::MAX)?;
            material.emission.color = Param::Constant(color);
        }
        MaterialField::EmissionStrength => material.emission.strength = value::not_negative(value)?,
        MaterialField::Opacity => {
            material.opacity.alpha = Param::Constant(value::number(value, 0.0, 1.0)?);
            material.vertex_alpha = false;
        }
        MaterialField::Cutoff => {
            material.opacity.cutoff = value::or_none(value, |v| value::number(v, 0.0, 1.0))?;
        }
        MaterialField::NormalScale => {
            let scale = value::any_number(value)?;
            match &mut material.normal_map {
                Some(map) => map.scale = scale,
                None => return Ok(Outcome::NotApplicable("the material has no normal map")),
            }
        }
        MaterialField::Rotation => material.rotation = value::any_degrees(value)?,
        // The scalars, done above.
        MaterialField::Subsurface
        | MaterialField::Metallic
        | MaterialField::Specular
        | MaterialField::SpecularTint
        | MaterialField::Roughness
        | MaterialField::Anisotropic
        | MaterialField::Sheen
        | MaterialField::SheenTint
        | MaterialField::Clearcoat
        | MaterialField::ClearcoatGloss
        | MaterialField::SpecTrans
        | MaterialField::Ior
        | MaterialField::DiffTrans
        | MaterialField::F90 => return Err(Mismatch),
    }
    Ok(Outcome::Set)
}
