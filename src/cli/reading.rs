//! The choices that reading scenes and converting their materials leave to the user.

use super::Allowed;
use super::render::parse_enum;
use crate::convert::{ClearcoatScale, ConvertOptions, PhongRoughness};
use crate::disney::DiffuseModel;
use crate::import::{ImportOptions, LightUnits};

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Reading of scenes")]
pub(super) struct Reading {
    /// Read glTF's punctual lights as Blender does: divided by 683.
    #[arg(long)]
    blender_lights: bool,
    /// The material variant of a glTF file (KHR_materials_variants), by name.
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// The moment of a glTF file's animation that is taken; without it the pose at rest.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time: Option<f32>,
    /// The animation of a glTF file, by name; without it the first.
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    #[command(flatten)]
    allowed: Allowed,
}

impl Reading {
    pub(super) fn options(&self) -> ImportOptions {
        ImportOptions {
            light_units: if self.blender_lights { LightUnits::Blender } else { LightUnits::Photometric },
            variant: self.variant.clone(),
            time: self.time,
            animation: self.animation.clone(),
            reach: self.allowed.reach(),
            ..ImportOptions::default()
        }
    }
}

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Conversion of materials")]
pub(super) struct Conversion {
    /// The diffuse term of Disney materials: burley, lambert or lambert_fresnel.
    #[arg(long, value_name = "MODEL", value_parser = parse_enum::<DiffuseModel>)]
    diffuse: Option<DiffuseModel>,
    /// The Disney coat that glTF's of factor 1 becomes: matched, as bright as glTF's (4); published, as the parameter is defined (1).
    #[arg(long, value_name = "SCALE", value_parser = parse_enum::<ClearcoatScale>, default_value = "matched")]
    clearcoat: ClearcoatScale,
    /// Multiplies the sheen of glTF's materials, whose lobe is 6 to 26 times brighter than Disney's.
    #[arg(long, value_name = "FACTOR", value_parser = parse_scale, default_value_t = 1.0)]
    sheen_scale: f32,
    /// How MTL's Ns becomes a roughness: walter, a lobe as wide as Phong's; blender, 1 - sqrt(Ns/1000).
    #[arg(long, value_name = "RULE", value_parser = parse_enum::<PhongRoughness>, default_value = "walter")]
    phong: PhongRoughness,
    /// Leave the backs of single-sided glTF materials out, as the specification has it; without it both sides are seen.
    #[arg(long)]
    cull: bool,
}

impl Conversion {
    pub(super) fn options(&self) -> ConvertOptions {
        let Self { diffuse, clearcoat, sheen_scale, phong, cull } = *self;
        ConvertOptions { diffuse, clearcoat, sheen_scale, phong, cull }
    }
}

fn parse_scale(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|n: &f32| n.is_finite() && *n >= 0.0);
    number.ok_or_else(|| "a number is expected, at least 0".to_owned())
}
