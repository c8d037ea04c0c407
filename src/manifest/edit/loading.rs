//! Choices that are made when a scene is read, before anything can be set in it.

use super::field::{ConvertField, ImportField};
use super::target::Target;
use super::value::{self, Mismatch};
use super::{EditError, mismatch};
use crate::disney::DiffuseModel;
use crate::record::{Override, Value};
use crate::settings::{ClearcoatScale, ConvertOptions, ImportOptions, LightUnits, PhongRoughness};

/// Makes the choices among `overrides`, in order; those that reach into the scene are left for [`super::apply_all`].
///
/// # Errors
/// If a path is none, or does not take its value.
pub fn choose(
    import: &mut ImportOptions,
    convert: &mut ConvertOptions,
    overrides: &[Override],
) -> Result<(), EditError> {
    for Override { path, value } in overrides {
        let target = Target::parse(path)?;
        let set = match target {
            Target::Import(field) => set_import(import, field, value),
            Target::Convert(field) => set_convert(convert, field, value),
            _ => Ok(()),
        };
        set.map_err(|Mismatch| mismatch(path, value, target.expects()))?;
    }
    Ok(())
}

pub(super) fn set_import(
    options: &mut ImportOptions,
    field: ImportField,
    value: &Value,
) -> Result<(), Mismatch> {
    let name = |value: &Value| value::or_none(value, |v| value::text(v).map(str::to_owned));
    match field {
        ImportField::Variant => options.variant = name(value)?,
        ImportField::Time => options.time = value::or_none(value, value::any_number)?,
        ImportField::Animation => options.animation = name(value)?,
        ImportField::LightUnits => options.light_units = value::choice(value, LightUnits::from_name)?,
    }
    Ok(())
}

pub(super) fn set_convert(
    options: &mut ConvertOptions,
    field: ConvertField,
    value: &Value,
) -> Result<(), Mismatch> {
    match field {
        ConvertField::Diffuse => {
            options.diffuse = value::or_none(value, |v| value::choice(v, DiffuseModel::from_name))?;
        }
        ConvertField::Clearcoat => options.clearcoat = value::choice(value, ClearcoatScale::from_name)?,
        ConvertField::SheenScale => options.sheen_scale = value::not_negative(value)?,
        ConvertField::Phong => options.phong = value::choice(value, PhongRoughness::from_name)?,
        ConvertField::Cull => options.cull = value::flag(value)?,
    }
    Ok(())
}
