//! What was measured, for programs.

use serde_json::{Map, Value, json};

use super::Inspected;
use super::measure::{Estimate, View};
use crate::disney::Lobe;

/// All figures as JSON: an array of materials with their parameters, lobes, albedo against angle, and for each view the check of
/// sampling. Angles are in degrees.
pub fn numbers(inspected: &[Inspected]) -> Value {
    inspected.iter().map(material).collect()
}

fn material(inspected: &Inspected) -> Value {
    let rows = inspected.subject.parameters();
    let parameters: Map<String, Value> =
        rows.into_iter().map(|row| (row.name.to_owned(), Value::String(row.value))).collect();
    let measured = &inspected.measurements;
    json!({
        "name": inspected.subject.name,
        "parameters": parameters,
        "means_of_textures": inspected.subject.means,
        "lobes": measured.lobes.iter().map(|lobe| lobe.name()).collect::<Vec<_>>(),
        "albedo": measured.albedo.iter().map(albedo).collect::<Vec<_>>(),
        "views": measured.views.iter().map(view).collect::<Vec<_>>(),
    })
}

fn albedo(estimate: &Estimate) -> Value {
    json!({
        "angle": estimate.angle,
        "rgb": estimate.albedo.to_array(),
        "luminance": estimate.luminance(),
        "standard_error": estimate.error,
        "lobes": by_name(&estimate.lobes),
    })
}

fn view(view: &View) -> Value {
    let estimate = &view.estimate;
    json!({
        "angle": view.angle,
        "albedo": estimate.luminance(),
        "standard_error": estimate.error,
        "albedo_without_delta_lobes": estimate.smooth,
        "albedo_by_quadrature": view.integrals.albedo,
        "density_by_quadrature": view.integrals.density,
        "relative_deviation_of_weights": estimate.relative_deviation,
        "largest_weight": estimate.largest_weight,
        "shares": by_name(&estimate.shares),
        "lost": estimate.lost,
        "delta_lobes": view.spikes.iter().map(|s| json!({
            "lobe": s.lobe.name(), "angle": s.angle, "weight": s.weight,
        })).collect::<Vec<_>>(),
    })
}

fn by_name(values: &[(Lobe, f64)]) -> Map<String, Value> {
    values.iter().map(|(lobe, value)| (lobe.name().to_owned(), json!(value))).collect()
}
