//! Materials as one HTML page that needs no other file: charts are inline SVG, pictures `data:` addresses.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use serde::Serialize;

use super::measure::View;
use super::subject::number;
use super::{InspectError, Inspected};
use crate::color::{Rgb, srgb_from_linear};
use crate::disney::BASE_COLOR;

static TEMPLATE: &str = include_str!("page.html");

/// One material with its charts.
#[derive(Debug)]
pub(super) struct Section<'a> {
    pub(super) inspected: &'a Inspected,
    pub(super) sphere_png: Vec<u8>,
    /// SVG elements.
    pub(super) polar: String,
    pub(super) albedo: String,
    pub(super) density: String,
    pub(super) maps_png: Option<Vec<u8>>,
}

/// The page; `comparison` holds the charts of all materials together.
pub(super) fn html(
    sections: &[Section<'_>],
    comparison: Option<(String, String)>,
) -> Result<String, InspectError> {
    let mut environment = Environment::empty();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("safe", |text: String| minijinja::Value::from_safe_string(text));
    let view = PageView::of(sections, comparison);
    Ok(environment.render_named_str("page.html", TEMPLATE, Serde(view))?)
}

#[derive(Debug, Serialize)]
struct PageView<'a> {
    title: String,
    materials: Vec<MaterialView<'a>>,
    parameters: Vec<ParameterView>,
    comparison: Option<ComparisonView>,
}

#[derive(Debug, Serialize)]
struct ComparisonView {
    polar: String,
    albedo: String,
}

#[derive(Debug, Serialize)]
struct MaterialView<'a> {
    name: &'a str,
    id: String,
    sphere: String,
    polar: &'a str,
    albedo: &'a str,
    density: &'a str,
    maps: Option<String>,
    notes: Vec<&'static str>,
    error: String,
    lobes: Vec<&'static str>,
    sampling: Vec<SamplingView>,
}

/// A line of the table of parameters: a cell for each material.
#[derive(Debug, Serialize)]
struct ParameterView {
    name: &'static str,
    differs: bool,
    cells: Vec<CellView>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
struct CellView {
    value: String,
    note: &'static str,
    is_default: bool,
    /// A CSS colour.
    swatch: Option<String>,
}

/// A line of the check of sampling.
#[derive(Debug, Serialize)]
struct SamplingView {
    angle: String,
    sampled: String,
    quadrature: String,
    deviation: String,
    largest: String,
    density: String,
    lost: String,
    shares: Vec<String>,
}

impl<'a> PageView<'a> {
    fn of(sections: &'a [Section<'a>], comparison: Option<(String, String)>) -> Self {
        let names: Vec<&str> = sections.iter().map(|s| s.inspected.subject.name.as_str()).collect();
        Self {
            title: names.join(", "),
            materials: sections.iter().enumerate().map(|(i, s)| MaterialView::of(i, s)).collect(),
            parameters: parameters(sections),
            comparison: comparison.map(|(polar, albedo)| ComparisonView { polar, albedo }),
        }
    }
}

impl<'a> MaterialView<'a> {
    fn of(i: usize, section: &'a Section<'a>) -> Self {
        let Inspected { subject, measurements, .. } = section.inspected;
        let shares = &measurements.views[0].estimate.shares;
        let error = measurements.albedo.iter().map(|e| e.error).fold(0.0, f64::max);
        Self {
            name: &subject.name,
            id: format!("material-{i}"),
            sphere: data_address(&section.sphere_png),
            polar: &section.polar,
            albedo: &section.albedo,
            density: &section.density,
            maps: section.maps_png.as_deref().map(data_address),
            notes: subject.notes.clone(),
            error: format!("{error:.1e}"),
            lobes: shares.iter().map(|(lobe, _)| lobe.name()).collect(),
            sampling: measurements.views.iter().map(|view| sampling(view, shares.len())).collect(),
        }
    }
}

fn sampling(view: &View, lobes: usize) -> SamplingView {
    let estimate = &view.estimate;
    let percent = |share: f64| format!("{:.1}%", 100.0 * share);
    let mut shares: Vec<String> = estimate.shares.iter().map(|(_, share)| percent(*share)).collect();
    shares.resize(lobes, String::new());
    SamplingView {
        angle: format!("{}°", view.angle),
        sampled: format!("{:.4} ± {:.1e}", estimate.smooth, estimate.error),
        quadrature: format!("{:.4}", view.integrals.albedo),
        deviation: format!("{:.3}", estimate.relative_deviation),
        largest: number(estimate.largest_weight),
        density: format!("{:.4}", view.integrals.density),
        lost: percent(estimate.lost),
        shares,
    }
}

/// The parameters of all materials, in the order in which they first appear.
fn parameters(sections: &[Section<'_>]) -> Vec<ParameterView> {
    let tables: Vec<_> = sections.iter().map(|s| s.inspected.subject.parameters()).collect();
    let mut names: Vec<&'static str> = Vec::new();
    for row in tables.iter().flatten() {
        if !names.contains(&row.name) {
            names.push(row.name);
        }
    }
    let cell = |name: &str, i: usize| -> CellView {
        let Some(row) = tables[i].iter().find(|row| row.name == name) else { return CellView::default() };
        let swatch = (name == BASE_COLOR).then(|| css(sections[i].inspected.subject.base_color()));
        CellView { value: row.value.clone(), note: row.note, is_default: row.is_default, swatch }
    };
    let line = |name: &'static str| {
        let cells: Vec<CellView> = (0..tables.len()).map(|i| cell(name, i)).collect();
        ParameterView { name, differs: differ(&cells), cells }
    };
    names.into_iter().map(line).collect()
}

/// Whether the materials that have a parameter have it differently.
fn differ(cells: &[CellView]) -> bool {
    let mut values = cells.iter().map(|c| &c.value).filter(|v| !v.is_empty());
    let first = values.next();
    values.any(|v| Some(v) != first)
}

/// A linear colour as CSS has it.
fn css(color: Rgb) -> String {
    let [r, g, b] = color.to_array().map(|v| (255.0 * srgb_from_linear(v.clamp(0.0, 1.0))).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn data_address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png))
}
