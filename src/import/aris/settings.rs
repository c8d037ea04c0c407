//! What a composed configuration says beside its scene: integrator, samples, scale.

use super::ArisError;
use super::scene::{entry, in_range, radiance, unknown_name};
use super::yaml::{Node, Table, Value, nearest};
use crate::record::Warning;
use crate::settings::{Filter, Integrator, RenderSettings};

/// The longest path that there is: more than any that is not ended by roulette.
const MAX_PATH_LENGTH: u32 = 65_536;
/// Keys that are about how Aris works, not about what it renders.
const WITHOUT_EFFECT: &[&str] = &["block_size", "device"];
/// The keys of a configuration.
const KEYS: &[&str] = &["scene", "integrator", "scale", "spp", "block_size", "gui", "device", "save_exr"];

/// A render of a scene of `size`, and whether an EXR is wanted as well.
pub(super) fn read(
    config: &Node,
    size: Option<(u32, u32)>,
    warnings: &mut Vec<Warning>,
) -> Result<(RenderSettings, bool), ArisError> {
    let mut table = Table::new(config, "the configuration")?;
    let integrator = table.require("integrator")?;
    let spp = table.require("spp")?.whole("spp", 1, 1 << 24)?;
    let scale = table.get("scale");
    let save_exr = table.get("save_exr").map_or(Ok(false), |node| node.flag("save_exr"))?;
    let gui = table.get("gui").map_or(Ok(false), |node| node.flag("gui"))?;
    warn_of_others(config, gui, warnings);

    let mut settings = RenderSettings { spp, ..RenderSettings::default() };
    // A single sample goes through the pixel's own coordinate.
    if spp == 1 {
        settings.filter = Filter::Point;
    }
    read_integrator(integrator, &mut settings)?;
    if let (Some((width, height)), Some(node)) = (size, scale) {
        node.number("scale")?;
        let scale = decimal(node);
        // The default, -1, is no scale.
        if scale > 0.0 {
            let scaled = |side: u32| {
                let pixels = f64::from(side) * scale;
                if (1.0..=65_536.0).contains(&pixels) {
                    Ok(pixels as u32)
                } else {
                    let expected = format!("such that {side} pixels become between 1 and 65536");
                    Err(node.out_of_range("scale", scale, expected))
                }
            };
            (settings.width, settings.height) = (Some(scaled(width)?), Some(scaled(height)?));
        }
    }
    Ok((settings, save_exr))
}

/// A number as precise as it is written, as sizes are truncated: Python's 0.29·100 is 28.999….
fn decimal(node: &Node) -> f64 {
    match node.value {
        Value::Whole(value) => value as f64,
        Value::Number(value) => value,
        _ => 0.0,
    }
}

fn warn_of_others(config: &Node, gui: bool, warnings: &mut Vec<Warning>) {
    let Value::Map(entries) = &config.value else { return };
    if gui {
        warnings.push(Warning::new(config.place.to_string(), "gui: there is no window here"));
    }
    for (key, place, _) in entries {
        if !KEYS.contains(&key.as_str()) && !WITHOUT_EFFECT.contains(&key.as_str()) {
            let message = format!("{key:?} has no effect; {}", nearest(key, KEYS));
            warnings.push(Warning::new(place.to_string(), message));
        }
    }
}

fn read_integrator(node: &Node, settings: &mut RenderSettings) -> Result<(), ArisError> {
    let (name, mut config) = entry(node, "integrator")?;
    settings.integrator = match name {
        "path" => {
            read_path_length(&mut config, settings)?;
            settings.mis = flag(&mut config, "mis")?;
            settings.nee = flag(&mut config, "enable_emitter_sample")?;
            Integrator::Path
        }
        "whitted" => {
            read_path_length(&mut config, settings)?;
            Integrator::Whitted
        }
        "normals" => Integrator::Normals,
        "albedo" => Integrator::DiffuseAlbedo,
        "depths" => Integrator::Depths,
        "ao" => Integrator::Ao,
        "point" => {
            let position = config.require("position")?.numbers("integrator.position")?;
            let energy = radiance(config.require("energy")?, "integrator.energy")?.to_array();
            Integrator::Point { position, energy }
        }
        "emitter_check" => Integrator::EmitterCheck,
        "learned_diffuse" | "nerad" => {
            return Err(ArisError::Unsupported {
                place: node.place.to_string(),
                what: format!("the integrator {name:?}"),
                hint: "it trains, which is not rendering; integrator=path_mis renders".to_owned(),
            });
        }
        other => {
            let known = ["path", "whitted", "normals", "albedo", "depths", "ao", "point", "emitter_check"];
            return Err(unknown_name(node, "the integrator", other, &known));
        }
    };
    config.finish()
}

/// Surface vertices of a path, the one on a light included: one more than it scatters. Roulette changes no expectation, so its
/// probability `cont_prob` is checked and left at that.
fn read_path_length(config: &mut Table<'_>, settings: &mut RenderSettings) -> Result<(), ArisError> {
    let vertices = config.require("max_path_length")?;
    let vertices = vertices.whole("integrator.max_path_length", 1, MAX_PATH_LENGTH)?;
    settings.max_depth = vertices - 1;
    if let Some(node) = config.get("cont_prob") {
        in_range(node, "integrator.cont_prob", 0.0, 1.0)?;
    }
    Ok(())
}

fn flag(config: &mut Table<'_>, key: &'static str) -> Result<bool, ArisError> {
    config.get(key).map_or(Ok(true), |node| node.flag(&format!("integrator.{key}")))
}
