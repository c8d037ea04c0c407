//! Where an image comes from, in its header. No time of day and no machine: the same job writes the same bytes.

use std::time::Duration;

use crate::raster::{Attribute, Raster};
use crate::record::Job;
use crate::settings::{Integrator, RenderSettings};

/// What an image's header tells about its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance<'a> {
    /// Hash of everything that can change a bit, the executable included (hex).
    pub identity: &'a str,
    /// The same without the executable (hex).
    pub key: &'a str,
    /// The job: its name and overrides.
    pub job: &'a Job,
    /// The settings with the overrides applied.
    pub settings: &'a RenderSettings,
    /// The crate's version.
    pub build: &'a str,
    /// The processor features that the code was compiled for.
    pub feature_level: &'a str,
    /// When the render was to stop, if the machine's speed decided about samples: then there is no identity, nor a key.
    pub time_limit: Option<Duration>,
}

impl Provenance<'_> {
    fn filter(&self) -> String {
        let name = self.settings.filter.name().to_owned();
        self.settings.filter_radius.map_or(name.clone(), |radius| format!("{name}, radius {radius}"))
    }
}

/// Writes `provenance` into the header of every part.
pub fn stamp(raster: &mut Raster, provenance: &Provenance<'_>) {
    let text = |s: &str| Attribute::Text(s.to_owned());
    let overrides: Vec<String> =
        provenance.job.overrides.iter().map(|o| format!("{} = {}", o.path, o.value)).collect();
    let settings = provenance.settings;
    let attributes = [
        ("Software", text(&format!("pipeline {}", provenance.build))),
        ("pipeline:camera", text(settings.camera.as_deref().unwrap_or_default())),
        ("pipeline:feature_level", text(provenance.feature_level)),
        ("pipeline:filter", text(&provenance.filter())),
        ("pipeline:identity", text(provenance.identity)),
        ("pipeline:integrator", text(&Integrator::described(settings))),
        ("pipeline:job", text(&provenance.job.name)),
        ("pipeline:key", text(provenance.key)),
        ("pipeline:max_depth", Attribute::Int(settings.max_depth as i32)),
        ("pipeline:overrides", text(&overrides.join("\n"))),
        ("pipeline:replicates", Attribute::Int(settings.effective_replicates() as i32)),
        ("pipeline:samples", Attribute::Int(settings.spp as i32)),
        // 64 bits do not fit into EXR's integers.
        ("pipeline:seed", text(&settings.seed.to_string())),
    ];
    let ends = [
        ("pipeline:error", settings.error.map(Attribute::Float)),
        ("pipeline:time_limit", provenance.time_limit.map(|limit| Attribute::Float(limit.as_secs_f32()))),
    ];
    let ends = ends.into_iter().filter_map(|(name, value)| Some((name, value?)));
    let is_known =
        |name: &str| provenance.time_limit.is_none() || !matches!(name, "pipeline:identity" | "pipeline:key");
    let attributes: Vec<_> = attributes.into_iter().filter(|(name, _)| is_known(name)).chain(ends).collect();
    for layer in &mut raster.layers {
        layer.attributes.extend(attributes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
    }
}
