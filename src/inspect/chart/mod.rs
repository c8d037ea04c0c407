//! The charts of a material.

mod albedo;
mod density;
mod heat;
mod polar;

pub(super) use albedo::Albedo;
pub(super) use density::Density;
pub(super) use heat::Heat;
pub(super) use polar::{Polar, PolarPanel};
