//! Fields of lights.

use std::f32::consts::FRAC_PI_2;

use super::field::LightField;
use super::value::{self, Mismatch, Outcome};
use crate::record::Value;
use crate::scene::Light;
use crate::scene::light::LightKind;

/// Sets one field. A spot's angles are compared when all are set: see [`cone_is_sound`].
pub(super) fn set(light: &mut Light, field: LightField, value: &Value) -> Result<Outcome, Mismatch> {
    match field {
        LightField::Color => light.color = value::color(value, f32::MAX)?,
        LightField::Intensity => light.intensity = value::not_negative(value)?,
        LightField::Position => {
            let new = value::vector(value)?;
            match &mut light.kind {
                LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position = new,
                LightKind::Directional { .. } => {
                    return Ok(Outcome::NotApplicable("a directional light has no position"));
                }
            }
        }
        LightField::Direction => {
            let new = value::direction(value)?;
            match &mut light.kind {
                LightKind::Spot { direction, .. } | LightKind::Directional { direction } => *direction = new,
                LightKind::Point { .. } => {
                    return Ok(Outcome::NotApplicable("a point light has no direction"));
                }
            }
        }
        LightField::Inner | LightField::Outer => {
            let new = value::degrees(value, 0.0, 90.0)?.min(FRAC_PI_2);
            match (&mut light.kind, field) {
                (LightKind::Spot { inner, .. }, LightField::Inner) => *inner = new,
                (LightKind::Spot { outer, .. }, _) => *outer = new,
                _ => return Ok(Outcome::NotApplicable("only a spot light has a cone")),
            }
        }
        LightField::Range => {
            let new = value::or_none(value, value::positive)?;
            match &mut light.kind {
                LightKind::Point { range, .. } | LightKind::Spot { range, .. } => *range = new,
                LightKind::Directional { .. } => {
                    return Ok(Outcome::NotApplicable("a directional light has no range"));
                }
            }
        }
    }
    Ok(Outcome::Set)
}

/// Whether a spot's full cone lies inside its whole one.
pub(super) fn cone_is_sound(light: &Light) -> bool {
    match light.kind {
        LightKind::Spot { inner, outer, .. } => inner <= outer && outer > 0.0,
        LightKind::Point { .. } | LightKind::Directional { .. } => true,
    }
}
