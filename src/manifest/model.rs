//! What a manifest says, as plain data. The JSON Schema of the format comes from these types.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::error::Source;
use super::names::plain_name;
use super::schema::{CameraTable, EnvironmentTable, LightTable, MaterialTable, OneOrMany, SettingTree};
use crate::record::Value;
use crate::settings::{Display, RenderSettings};

/// The jobs that a manifest may ask for where it says nothing.
pub const DEFAULT_MAX_JOBS: u64 = 100_000;
/// The largest legal `max_jobs`.
pub const MAX_MAX_JOBS: u64 = 1_000_000;

/// A value with its place in the manifest.
#[derive(Clone, Debug)]
pub struct Located<T> {
    /// The value.
    pub value: T,
    /// Where it stands, in bytes.
    pub span: Range<usize>,
}

impl<T> Located<T> {
    pub(super) fn new(value: T, span: Range<usize>) -> Self {
        Self { value, span }
    }
}

impl<T: JsonSchema> JsonSchema for Located<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }
    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }
    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// A sweep: one scene or several, what is set in all jobs, and the axes whose product the jobs are.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Sweep manifest")]
pub struct Manifest {
    /// The name of the sweep and of its folder of outputs; the file's stem where absent.
    #[schemars(with = "Option<String>")]
    pub name: String,
    /// The scene file, relative to the manifest. A list or a glob pattern is an axis, the slowest one.
    #[schemars(rename = "scene", with = "Option<OneOrMany>")]
    pub scenes: Vec<Located<String>>,
    /// Whether `scene` is a list or a pattern, and so an axis even if it comes to one file.
    #[schemars(skip)]
    pub scene_is_axis: bool,
    /// A material library, relative to the manifest, to lay over the materials of every scene.
    #[schemars(with = "Option<String>")]
    pub materials: Option<PathBuf>,
    /// Whether the scenes and the library may name files outside their own folders.
    #[schemars(default)]
    pub allow_outside: bool,
    /// What is set in every job, by path, as in `"material.ball.metallic" = 1.0`.
    #[schemars(with = "Option<BTreeMap<String, SettingTree>>")]
    pub set: Vec<Setting>,
    /// The axes; the last one is the fastest.
    #[schemars(rename = "axis", with = "Option<Vec<Axis>>")]
    pub axes: Vec<Axis>,
    /// Jobs to leave out: those that have all values of one of these tables. A value is a path's or an axis name's, and may
    /// be given by its label.
    #[schemars(with = "Option<Vec<BTreeMap<String, Value>>>")]
    pub exclude: Vec<Located<Vec<Setting>>>,
    /// The largest number of jobs before `exclude`: a guard against slips.
    #[schemars(default = "default_max_jobs", range(min = 1, max = 1_000_000))]
    pub max_jobs: u64,
    /// How every job is rendered.
    #[schemars(with = "Option<RenderSettings>")]
    pub render: RenderSettings,
    /// Where `render.camera` is given, for messages.
    #[schemars(skip)]
    pub render_camera: Option<Range<usize>>,
    /// Short for `camera.FIELD` in `[set]`.
    #[schemars(with = "Option<CameraTable>")]
    pub camera: Vec<Setting>,
    /// Short for `environment.FIELD` in `[set]`.
    #[schemars(with = "Option<EnvironmentTable>")]
    pub environment: Vec<Setting>,
    /// By light, short for `light.NAME.FIELD` in `[set]`.
    #[schemars(with = "Option<BTreeMap<String, LightTable>>")]
    pub light: Vec<Setting>,
    /// By material, short for `material.NAME.FIELD` in `[set]`.
    #[schemars(with = "Option<BTreeMap<String, MaterialTable>>")]
    pub material: Vec<Setting>,
    /// The contact sheet.
    #[schemars(with = "Option<SheetSpec>")]
    pub sheet: SheetSpec,
    /// What the results are compared with; nothing where absent.
    pub compare: Option<CompareSpec>,
    /// The folder of the results, relative to the manifest; `outputs/NAME` of the working folder where absent.
    pub output: Option<PathBuf>,
    /// The text it was read from.
    #[schemars(skip)]
    pub source: Source,
}

fn default_max_jobs() -> u64 {
    DEFAULT_MAX_JOBS
}

/// One path with its value.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The path.
    pub path: Located<String>,
    /// Its value.
    pub value: Located<Value>,
}

/// One axis: a path, or several that change together, with its values.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Axis {
    /// What changes.
    #[schemars(flatten)]
    pub reach: Reach,
    /// The values.
    #[schemars(flatten)]
    pub steps: Steps,
    /// The key in the jobs' names and on the sheet; the path's last part where absent.
    #[schemars(with = "Option<String>")]
    pub name: Option<Located<String>>,
    /// One a value: what stands for it in the jobs' names and on the sheet.
    #[schemars(with = "Option<Vec<String>>")]
    pub labels: Option<Vec<Located<String>>>,
    /// The values computed, each with its label.
    #[schemars(skip)]
    pub points: Vec<Point>,
    /// Where it stands.
    #[schemars(skip)]
    pub span: Range<usize>,
}

/// One value of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// One a path.
    pub values: Vec<Value>,
    /// What stands for it.
    pub label: String,
    /// Where it stands, or the axis' steps where it was computed.
    pub span: Range<usize>,
}

/// What an axis changes.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(rename_all = "snake_case")]
pub enum Reach {
    /// One path.
    Path(Located<String>),
    /// Several paths that change together; each entry of `values` is a list with one value a path.
    Zip(Vec<Located<String>>),
}

/// How an axis gives its values.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(rename_all = "snake_case")]
pub enum Steps {
    /// One after the other.
    Values(Vec<Located<Value>>),
    /// Evenly spaced, both ends included, rounded to 12 significant digits.
    Range(Interval),
    /// With equal ratios, both ends included and above 0, rounded to 6 significant digits.
    LogRange(Interval),
    /// Random, the same for the same seed, rounded to 6 significant digits. A larger count keeps the first values.
    Random(Random),
    /// The first Sobol' sequence (van der Corput's), which fills the interval evenly, rounded to 6 significant digits. A larger
    /// count keeps the first values.
    Sobol(Sequence),
}

/// Steps from one number to another.
#[derive(Clone, Copy, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Interval {
    /// The first value.
    pub from: f64,
    /// The last value.
    pub to: f64,
    /// The number of values; 1 only where both ends are the same.
    #[schemars(range(min = 1))]
    pub steps: u64,
}

/// A sequence that fills [from, to).
#[derive(Clone, Copy, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Sequence {
    /// The number of values.
    #[schemars(range(min = 1))]
    pub count: u64,
    /// The smallest value.
    pub from: f64,
    /// The largest value.
    pub to: f64,
}

/// Random values.
#[derive(Clone, Copy, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Random {
    /// Chooses the values; has nothing to do with the render's seed.
    pub seed: u64,
    /// The number of values.
    #[schemars(range(min = 1))]
    pub count: u64,
    /// How they are distributed.
    #[schemars(default)]
    pub distribution: Distribution,
    /// The smallest value; needed unless the distribution is normal, which is cut off there if it is given.
    pub from: Option<f64>,
    /// The largest value; likewise.
    pub to: Option<f64>,
    /// The normal distribution's mean.
    pub mean: Option<f64>,
    /// The normal distribution's standard deviation, above 0.
    pub sd: Option<f64>,
}

/// A distribution of random values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// The same everywhere in [from, to).
    #[default]
    Uniform,
    /// Uniform in the logarithm; both ends above 0.
    LogUniform,
    /// Gauss'.
    Normal,
}

/// How the contact sheet is laid out.
#[derive(Clone, Debug, Default, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SheetSpec {
    /// The axis across, by name or path; the last one where absent.
    #[schemars(with = "Option<String>")]
    pub columns: Option<Located<String>>,
    /// The axis down, by name or path; the one before the last where absent and there are two or more.
    #[schemars(with = "Option<String>")]
    pub rows: Option<Located<String>>,
    /// The title; the sweep's name where absent.
    pub title: Option<String>,
    /// The width of a cell's picture in pixels; the render's own where absent.
    #[schemars(range(min = 16, max = 4096))]
    pub cell_width: Option<u32>,
    /// How radiance becomes 8-bit values.
    #[schemars(default)]
    pub display: Display,
}

/// What results are compared with, and how far they may be off. The first nine limits mean what they mean to OpenImageIO's
/// `idiff`; what is absent has its default.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct CompareSpec {
    /// The folder of the reference images, relative to the manifest.
    pub references: PathBuf,
    /// A pixel fails if a value is off by more than this. 1e-6 where absent.
    #[schemars(range(min = 0.0))]
    pub fail: Option<f64>,
    /// The image fails if more than this many per cent of the pixels do. 0 where absent.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub failpercent: Option<f64>,
    /// A pixel fails only if a value is off by more than this part of itself, too. 0 where absent.
    #[schemars(range(min = 0.0))]
    pub failrelative: Option<f64>,
    /// The image fails if any value is off by more than this. No limit where absent.
    #[schemars(range(min = 0.0))]
    pub hardfail: Option<f64>,
    /// So many failing pixels are allowed. 0 where absent.
    pub allowfailures: Option<u64>,
    /// As `fail`, for warnings.
    #[schemars(range(min = 0.0))]
    pub warn: Option<f64>,
    /// As `failpercent`, for warnings.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub warnpercent: Option<f64>,
    /// As `failrelative`, for warnings.
    #[schemars(range(min = 0.0))]
    pub warnrelative: Option<f64>,
    /// As `hardfail`, for warnings.
    #[schemars(range(min = 0.0))]
    pub hardwarn: Option<f64>,
    /// The image fails if the mean absolute error is larger. No limit where absent.
    #[schemars(range(min = 0.0))]
    pub mean: Option<f64>,
    /// The image fails if the root mean square error is larger. No limit where absent.
    #[schemars(range(min = 0.0))]
    pub rms: Option<f64>,
}

/// One entry of `scene`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenePattern {
    /// As written.
    pub pattern: String,
    /// With the manifest's folder in front, whose own special characters are escaped: for the `glob` crate.
    pub glob: String,
    /// As a file name, for an entry without `*`, `?` or `[`.
    pub path: Option<PathBuf>,
}

impl Manifest {
    /// The manifest's folder: what its paths are relative to.
    pub fn folder(&self) -> &Path {
        self.source.path.parent().unwrap_or(Path::new(""))
    }

    /// The sweep's name as a folder's: without separators or anything else that file systems dislike.
    pub fn folder_name(&self) -> String {
        plain_name(&self.name)
    }

    /// The entries of `scene`, for the caller to look up.
    pub fn scene_patterns(&self) -> Vec<ScenePattern> {
        let folder = self.folder();
        let escaped = glob::Pattern::escape(&folder.to_string_lossy());
        self.scenes
            .iter()
            .map(|s| ScenePattern {
                pattern: s.value.clone(),
                glob: Path::new(&escaped).join(&s.value).to_string_lossy().into_owned(),
                path: (!is_glob(&s.value)).then(|| folder.join(&s.value)),
            })
            .collect()
    }

    /// What all jobs have in common, in the order in which it is applied: the short tables, then `[set]`.
    pub fn fixed(&self) -> impl Iterator<Item = &Setting> {
        [&self.camera, &self.environment, &self.light, &self.material, &self.set].into_iter().flatten()
    }
}

/// Whether a scene's name is a pattern.
pub(super) fn is_glob(name: &str) -> bool {
    name.contains(['*', '?', '['])
}

impl Axis {
    /// Its paths.
    pub fn paths(&self) -> &[Located<String>] {
        match &self.reach {
            Reach::Path(path) => std::slice::from_ref(path),
            Reach::Zip(paths) => paths,
        }
    }

    /// What coordinates and the sheet call it: its name, or its path or paths.
    pub fn id(&self) -> String {
        match &self.name {
            Some(name) => name.value.clone(),
            None => self.paths().iter().map(|p| p.value.as_str()).collect::<Vec<_>>().join(" + "),
        }
    }
}
