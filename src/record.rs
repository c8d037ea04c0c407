//! What is known about a job: plain data that the job, the sweep, the comparison and the report share.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::settings::RenderSettings;

/// Something that was not as it should be but did not stop the work. Printed once by the command and kept in the record.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct Warning {
    /// Where: a file, with a line where there is one, and the element, such as `model.glb: material "ball"`.
    pub place: String,
    /// What, and what was done about it.
    pub message: String,
}

impl Warning {
    /// A warning about `place`.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into() }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

/// The value of an override: what a manifest's `[set]` or axis gives to a path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Value {
    /// true or false.
    Bool(bool),
    /// A number.
    Number(f64),
    /// Text, such as a name or a file.
    Text(String),
    /// A list, such as a colour or a position.
    List(Vec<Value>),
}

impl Value {
    /// The value of a command line's text, which is written as in TOML; what isn't TOML is text. `None` for tables and dates.
    pub fn from_text(text: &str) -> Option<Self> {
        match format!("v = {text}").parse::<toml::Table>() {
            Ok(mut table) => Self::from_toml(table.remove("v")?),
            Err(_) => Some(Self::Text(text.to_owned())),
        }
    }

    fn from_toml(value: toml::Value) -> Option<Self> {
        Some(match value {
            toml::Value::Boolean(b) => Self::Bool(b),
            toml::Value::Integer(i) => Self::Number(i as f64),
            toml::Value::Float(f) => Self::Number(f),
            toml::Value::String(s) => Self::Text(s),
            toml::Value::Array(items) => {
                Self::List(items.into_iter().map(Self::from_toml).collect::<Option<_>>()?)
            }
            toml::Value::Table(_) | toml::Value::Datetime(_) => return None,
        })
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool(b) => write!(f, "{b}"),
            Self::Number(n) => write!(f, "{n}"),
            Self::Text(t) => write!(f, "{t}"),
            Self::List(items) => {
                write!(f, "[")?;
                for (i, item) in items.iter().enumerate() {
                    write!(f, "{}{item}", if i == 0 { "" } else { ", " })?;
                }
                write!(f, "]")
            }
        }
    }
}

/// One fully expanded job: it replays alone and gives the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Job {
    /// The name, made of the axes' values, and of the output file.
    pub name: String,
    /// The scene file.
    pub scene: std::path::PathBuf,
    /// What is set in the scene, by path, in the order it is applied.
    pub overrides: Vec<Override>,
    /// How it is rendered.
    pub settings: RenderSettings,
    /// The job's place on each axis.
    pub coordinates: Vec<Coordinate>,
}

/// One path of the scene with its new value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Override {
    /// The path, such as `material.ball.roughness`.
    pub path: String,
    /// Its value.
    pub value: Value,
}

/// A job's place on an axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Coordinate {
    /// The axis: its path or paths.
    pub axis: String,
    /// Which of the axis' values, from 0.
    pub index: usize,
    /// The value as the sheet shows it.
    pub label: String,
}

/// How a result stands against its reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Verdict {
    /// Every pixel is equal.
    Same,
    /// The differences are within the limits.
    Within {
        /// The largest difference.
        max_error: f64,
        /// The mean difference.
        mean_error: f64,
    },
    /// The differences are beyond the limits.
    Differs {
        /// The largest difference.
        max_error: f64,
        /// The mean difference.
        mean_error: f64,
        /// What failed, in words.
        why: String,
    },
    /// Size, data window or channels differ.
    Shape {
        /// What differs.
        why: String,
    },
    /// There is no reference.
    MissingReference {
        /// Where it should be.
        path: String,
    },
    /// The two comparators disagree, or the comparison could not be made.
    Error {
        /// Why.
        why: String,
    },
    /// The manifest names no references.
    NotCompared,
}

impl Verdict {
    /// Neither a difference nor an error.
    pub const fn passes(&self) -> bool {
        matches!(self, Self::Same | Self::Within { .. } | Self::NotCompared)
    }

    /// One or two words for tables.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Within { .. } => "within limits",
            Self::Differs { .. } => "DIFFERS",
            Self::Shape { .. } => "SHAPE DIFFERS",
            Self::MissingReference { .. } => "NO REFERENCE",
            Self::Error { .. } => "ERROR",
            Self::NotCompared => "not compared",
        }
    }
}

/// Whether the real `idiff` confirmed the built-in comparator.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum CrossCheck {
    /// No reference to compare with, or none asked for.
    #[default]
    NotRun,
    /// `idiff` is not installed.
    NotInstalled,
    /// Both came to the same verdict.
    Agrees,
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Outcome {
    /// The image was written.
    Done,
    /// It could not be rendered or written.
    Failed {
        /// The error with its causes.
        error: String,
    },
}

/// A sample that was dropped because its radiance was not finite or negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct BadSample {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// The sample's index in its pixel.
    pub sample: u32,
}

/// What a render counted.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Counts {
    /// Camera paths traced.
    pub paths: u64,
    /// Rays traced: path segments and shadow rays, those that jobs rendered together share as well.
    pub rays: u64,
    /// Samples dropped because they were not finite or negative.
    pub bad_samples: u64,
    /// The first of them, at most 16, in pixel order.
    pub first_bad_samples: Vec<BadSample>,
    /// Triangles in the scene, instances counted.
    pub triangles: u64,
}

/// Wall-clock seconds of a job's steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Timings {
    /// Preparing materials, lights and camera. The scene and its tree are made once for many jobs and don't count.
    pub prepare: f64,
    /// Rendering; of jobs that were rendered together each one's share.
    pub render: f64,
    /// Writing and comparing.
    pub output: f64,
}

/// All that is known about a finished or failed job. Written last: a result is done when its record is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobRecord {
    /// The job itself.
    pub job: Job,
    /// Hash of everything that can change a bit, the executable included (hex).
    pub identity: String,
    /// The same without the executable (hex): finds references across builds.
    pub key: String,
    /// How it ended.
    pub outcome: Outcome,
    /// How it stands against its reference.
    pub verdict: Verdict,
    /// Whether the real `idiff` agreed.
    pub cross_check: CrossCheck,
    /// The size in pixels.
    pub size: [u32; 2],
    /// What the render counted.
    pub counts: Counts,
    /// What was left out because the scene doesn't need it.
    pub skipped: Vec<String>,
    /// What was noticed on the way.
    pub warnings: Vec<Warning>,
    /// Seconds.
    pub timings: Timings,
    /// The operating system, architecture and feature level.
    pub host: String,
    /// The how-manieth try this was, from 1.
    pub attempt: u32,
    /// The output file's name beside the record, and its BLAKE3 digest (hex).
    pub outputs: BTreeMap<String, String>,
}
