//! Settings of the render.

use super::field::RenderField;
use super::value::{self, Mismatch};
use crate::record::Value;
use crate::settings::{Filter, Integrator, RenderSettings, Use};

/// The largest whole number up to which every one is an `f64`: 2^53.
pub(super) const MAX_WHOLE: u64 = 1 << 53;

/// Sets one setting.
pub(super) fn set(settings: &mut RenderSettings, field: RenderField, value: &Value) -> Result<(), Mismatch> {
    let small = |low: u64, high: u64| value::whole(value, low, high).map(|n| n as u32);
    match field {
        RenderField::Width => settings.width = Some(small(1, 65_536)?),
        RenderField::Height => settings.height = Some(small(1, 65_536)?),
        RenderField::Spp => settings.spp = small(1, 1 << 24)?,
        RenderField::Error => {
            settings.error = match value {
                Value::Bool(false) => None,
                _ => Some(value::number(value, f32::MIN_POSITIVE, 1.0)?),
            };
        }
        RenderField::Replicates => settings.replicates = small(1, 64)?,
        RenderField::Seed => settings.seed = value::whole(value, 0, MAX_WHOLE)?,
        RenderField::MaxDepth => settings.max_depth = small(0, 65_535)?,
        RenderField::Filter => {
            settings.filter = value::choice(value, |name| match name {
                "box" => Some(Filter::Box),
                "tent" => Some(Filter::Tent),
                "blackman-harris" => Some(Filter::BlackmanHarris),
                "point" => Some(Filter::Point),
                _ => None,
            })?;
        }
        RenderField::FilterRadius => settings.filter_radius = Some(value::number(value, 0.1, 8.0)?),
        RenderField::Camera => settings.camera = Some(value::text(value)?.to_owned()),
        RenderField::Integrator => settings.integrator = value::choice(value, Integrator::from_name)?,
        RenderField::Nee => settings.nee = value::flag(value)?,
        RenderField::Mis => settings.mis = value::flag(value)?,
        RenderField::LightPaths => settings.light_paths = value::choice(value, Use::from_name)?,
        RenderField::PathReuse => settings.path_reuse = value::choice(value, Use::from_name)?,
        RenderField::Splitting => settings.splitting = value::choice(value, Use::from_name)?,
        RenderField::Adaptive => settings.adaptive = value::choice(value, Use::from_name)?,
    }
    Ok(())
}
