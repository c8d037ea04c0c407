//! Records for tests.

use std::collections::BTreeMap;

use crate::record::{
    Coordinate, Counts, CrossCheck, Job, JobRecord, Outcome, Override, Timings, Value, Verdict, Warning,
};
use crate::settings::RenderSettings;

/// A job with a place on each axis: its name, index and label.
pub(super) fn job(name: &str, axes: &[(&str, usize, &str)]) -> Job {
    let coordinate = |&(axis, index, label): &(&str, usize, &str)| Coordinate {
        axis: axis.to_owned(),
        index,
        label: label.to_owned(),
    };
    Job {
        name: name.to_owned(),
        scene: "scenes/ball.glb".into(),
        overrides: vec![Override { path: "material.ball.metallic".to_owned(), value: Value::Number(1.0) }],
        settings: RenderSettings::default(),
        coordinates: axes.iter().map(coordinate).collect(),
    }
}

/// A record with one warning and one output.
pub(super) fn record(name: &str, outcome: Outcome, verdict: Verdict) -> JobRecord {
    JobRecord {
        job: job(name, &[("material.ball.roughness", 0, "0.00")]),
        identity: "1d".to_owned(),
        key: "4e".to_owned(),
        outcome,
        verdict,
        cross_check: CrossCheck::NotRun,
        size: [240, 180],
        counts: Counts { paths: 2_764_800, rays: 9_000_000, triangles: 61_234, ..Counts::default() },
        skipped: vec!["clearcoat".to_owned()],
        warnings: vec![Warning::new("ball.glb: material \"ball\"", "no normals; made from the faces")],
        timings: Timings { prepare: 0.75, render: 3.0, output: 0.25 },
        host: "here".to_owned(),
        attempt: 1,
        outputs: BTreeMap::from([(format!("{name}.exr"), "b3".to_owned())]),
    }
}
