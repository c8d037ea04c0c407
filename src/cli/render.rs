//! `pipeline render`.

mod config_root;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use self::config_root::{Outputs, Shown};
use super::progress::Progress;
use super::reading::{Conversion, Reading};
use super::{Outcome, Talk, WELL, print};
use crate::imagefile;
use crate::import::ArisConfig;
use crate::job::{self, Build, JobError, LoadedRun, PlannedJob};
use crate::manifest::edit;
use crate::output::{stamp, tone};
use crate::raster::Raster;
use crate::record::{Job, Override, Value};
use crate::render::{Control, Prepared, render, replay};
use crate::settings::{Display, Filter, RenderSettings, ToneCurve};

/// Render a scene: glTF, OBJ, an Aris YAML scene, or a config root of Aris.
///
/// The result is an EXR of two parts, the picture and its data (albedo, normal, depth, variance, samples), or a PNG if the
/// output's name ends so.
///
/// A config root is a folder with render.yaml. It is composed with overrides as Aris' render.py (Hydra) does: scene=cbox chooses
/// from a group, scene/brdf=cbox_diffuse from a nested one, scene.width=400 changes a value, +key=value adds one, ~key deletes one.
/// Without -o, output.png, config.yaml and, with save_exr=true, output.exr go to hydra.run.dir, or below outputs/ to a folder
/// named after the overrides.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline render scenes/shaderball.glb -o ball.exr\n  pipeline render scenes/shaderball.glb -o ball.png --spp 256 --set material.ball.roughness=0.1\n  pipeline render model.obj -o model.exr --width 800 --set environment.rotation=90\n  pipeline render scenes/shaderball.glb -o normals.png --set render.integrator=normals\n  pipeline render model.glb -o model.exr --materials edited.yaml\n  pipeline render scenes/cornell.obj -o cornell.exr --error 0.005\n  pipeline render scenes/cornell.obj -o cornell.png --time-limit 10\n  pipeline render scenes/shaderball.glb --pixel 320,240 --sample 3\n  pipeline render scenes/aris/config scene=cbox integrator=path_mis spp=50 scale=0.5\n  pipeline render scenes/aris/config scene=cbox +scene.camera.config.aperture=0.1 --cfg"
)]
pub(super) struct Arguments {
    /// The scene, or the folder of a config root.
    scene: PathBuf,
    /// Overrides of a config root, as Hydra takes them.
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// The image to write, .exr or .png.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print the composed configuration of a config root, or with =origin where each value comes from, instead of rendering.
    #[arg(long, value_name = "WHAT", num_args = 0..=1, require_equals = true, default_missing_value = "config", conflicts_with_all = ["output", "pixel"])]
    cfg: Option<Shown>,
    /// Set a path of the scene, as in a manifest: material.NAME.FIELD, camera.FIELD, light.NAME.FIELD, environment.FIELD,
    /// render.FIELD, import.FIELD, convert.FIELD.
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
    /// Samples a pixel. Where much of the picture is sky, noisy parts get more and others fewer, for as many rays (`render.adaptive`).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    spp: Option<u32>,
    /// The error at which to stop, as `pipeline bench` measures it: 0.01 is 10% noise. --spp is then the most samples there may be,
    /// 65536 where absent.
    #[arg(long, value_name = "ERROR", value_parser = parse_error)]
    error: Option<f32>,
    /// Stop sampling after so many seconds. --spp is then the most samples there may be, 65536 where absent. The result depends on the
    /// machine.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    time_limit: Option<Duration>,
    /// Columns.
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    width: Option<u32>,
    /// Rows.
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    height: Option<u32>,
    /// The seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The largest number of scattering events.
    #[arg(long, value_name = "N")]
    max_depth: Option<u32>,
    /// Independent sample sets a pixel, for the variance; one makes the least noise, and its halves tell the variance.
    #[arg(long, value_name = "N")]
    replicates: Option<u32>,
    /// The camera, by name.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// The pixel filter.
    #[arg(long, value_name = "FILTER", value_parser = parse_enum::<Filter>)]
    filter: Option<Filter>,
    /// A material library to lay over the scene's materials, such as `pipeline convert` writes.
    #[arg(long, value_name = "FILE")]
    materials: Option<PathBuf>,
    /// The tone curve of a PNG: neutral, srgb or agx.
    #[arg(long, value_name = "CURVE", value_parser = parse_enum::<ToneCurve>, default_value = "neutral")]
    tone: ToneCurve,
    /// The exposure of a PNG in stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Trace one pixel's path again and tell where it goes, instead of rendering.
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, conflicts_with = "output")]
    pixel: Option<(u32, u32)>,
    /// Which of the pixel's samples.
    #[arg(long, value_name = "N", requires = "pixel", default_value_t = 0)]
    sample: u32,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    conversion: Conversion,
}

/// A value of an enum by its name in files.
pub(super) fn parse_enum<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    serde_json::from_value(serde_json::Value::String(text.to_owned())).map_err(|error| error.to_string())
}

fn parse_error(text: &str) -> Result<f32, String> {
    let error = text.parse().ok().filter(|error| *error > 0.0 && *error <= 1.0);
    error.ok_or_else(|| "a number above 0 and at most 1 is expected, such as 0.01".to_owned())
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|s: &f64| *s > 0.0);
    let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    limit.ok_or_else(|| "a number of seconds above 0 is expected, such as 30".to_owned())
}

fn parse_pixel(text: &str) -> Result<(u32, u32), String> {
    let pixel =
        text.split_once(',').and_then(|(x, y)| Some((x.trim().parse().ok()?, y.trim().parse().ok()?)));
    pixel.ok_or_else(|| format!("{text:?} is not a pixel; two whole numbers are expected, such as 320,240"))
}

/// `PATH=VALUE`, the value as in TOML; what isn't TOML is text.
fn parse_override(text: &str) -> Result<Override, String> {
    let (path, value) = text.split_once('=').ok_or_else(|| format!("{text:?} is not PATH=VALUE"))?;
    let value =
        Value::from_text(value.trim()).ok_or_else(|| format!("{text:?}: a table or a date is no value"))?;
    Ok(Override { path: path.trim().to_owned(), value })
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    // Before minutes are spent on an image that can't be kept.
    let format = arguments.output.as_deref().map(Format::of).transpose()?;
    arguments.output.as_deref().map(check_folder).transpose()?;
    let config = config_root::composed(arguments)?;
    if let (Some(config), Some(shown)) = (&config, arguments.cfg) {
        return config_root::show(config, shown);
    }
    let (mut import_options, mut convert_options) =
        (arguments.reading.options(), arguments.conversion.options());
    edit::choose(&mut import_options, &mut convert_options, &arguments.set)
        .map_err(|error| with_hint(error.into()))?;
    let materials = arguments.materials.as_deref();
    let run = match &config {
        Some(config) => job::load_configured(config, &convert_options, materials),
        None => job::load(&arguments.scene, &import_options, &convert_options, materials)
            .map(|loaded| LoadedRun { loaded, settings: RenderSettings::default(), save_exr: false }),
    };
    let LoadedRun { loaded, settings, save_exr } = run.map_err(with_hint)?;
    let build = Build::current()?;
    let planned =
        job::plan(&described(arguments, config.as_ref(), settings), &loaded, &build).map_err(with_hint)?;
    for warning in loaded.warnings.iter().chain(&planned.warnings) {
        talk.say(&format!("warning: {warning}"));
    }
    let prepared =
        Prepared::new(Arc::clone(&planned.scene), Arc::clone(&loaded.geometry), &planned.settings)?;
    if let Some((x, y)) = arguments.pixel {
        return tell_path(&prepared, x, y, arguments.sample);
    }
    let outputs = match &config {
        Some(config) if format.is_none() => {
            Some(Outputs::prepare(config, save_exr, planned.settings.integrator)?)
        }
        _ => None,
    };
    let mut rendered = render_with_progress(&prepared, &planned, arguments.time_limit, talk);
    stamp(&mut rendered, &planned.provenance(&build, arguments.time_limit));
    if let Some(config) = &config {
        config_root::stamp_config(&mut rendered, config);
    }
    if let (Some(output), Some(format)) = (&arguments.output, format) {
        write(output, format, &rendered, &Display { tone: arguments.tone, exposure: arguments.exposure })?;
    }
    outputs.map_or(Ok(WELL), |outputs| outputs.write(&rendered, talk))
}

/// The error with what may help below it.
fn with_hint(error: JobError) -> Box<dyn std::error::Error> {
    match error.hint() {
        Some(hint) => format!("{error}\nhint: {hint}").into(),
        None => error.into(),
    }
}

/// Samples a pixel where an error or a time ends the render, and nobody says how many there may be.
const MOST_SAMPLES: u32 = 65_536;

/// The job that the arguments describe: what they say, and else what `base` is.
fn described(arguments: &Arguments, config: Option<&ArisConfig>, base: RenderSettings) -> Job {
    let ends_otherwise = arguments.error.is_some() || arguments.time_limit.is_some();
    let spp = arguments.spp.unwrap_or(if ends_otherwise { MOST_SAMPLES } else { base.spp });
    let filter = match (arguments.filter, config) {
        (Some(filter), _) => filter,
        // Aris' single sample is not moved.
        (None, Some(_)) if spp == 1 => Filter::Point,
        (None, Some(_)) => Filter::Box,
        (None, None) => base.filter,
    };
    // A side alone keeps the camera's aspect.
    let (width, height) = match (arguments.width, arguments.height) {
        (None, None) => (base.width, base.height),
        size => size,
    };
    let settings = RenderSettings {
        width,
        height,
        spp,
        error: arguments.error.or(base.error),
        filter,
        seed: arguments.seed.unwrap_or(base.seed),
        max_depth: arguments.max_depth.unwrap_or(base.max_depth),
        replicates: arguments.replicates.unwrap_or(base.replicates),
        camera: arguments.camera.clone(),
        ..base
    };
    let stem = || arguments.scene.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    Job {
        name: config.map_or_else(stem, |config| config.name().to_owned()),
        scene: arguments.scene.clone(),
        overrides: arguments.set.clone(),
        settings,
        coordinates: Vec::new(),
    }
}

/// Renders, and says how it went.
fn render_with_progress(
    prepared: &Prepared,
    planned: &PlannedJob,
    time_limit: Option<Duration>,
    talk: Talk,
) -> Raster {
    let start = Instant::now();
    let control = Arc::new(Control { time_limit, ..Control::default() });
    let mut progress = Progress::new(1, talk);
    progress.follow(&[&planned.job.name], &control);
    let rendered = render(prepared, &control);
    drop(progress);
    let seconds = start.elapsed().as_secs_f64();
    let (width, height) = prepared.size();
    let pixels = u64::from(width) * u64::from(height);
    let counts = &rendered.counts;
    talk.say(&format!(
        "{width} × {height}, {} samples a pixel{}, {} triangles, {seconds:.1} s, {:.2} M rays/s",
        counts.paths / pixels,
        if counts.paths == pixels * u64::from(planned.settings.spp) { "" } else { " on average" },
        counts.triangles,
        counts.rays as f64 * 1e-6 / seconds.max(1e-9),
    ));
    let skipped = prepared.skipped();
    if !skipped.is_empty() {
        talk.say(&format!("without work for what the scene lacks ({})", skipped.join("; ")));
    }
    if counts.bad_samples > 0 {
        let which = counts.first_bad_samples.first().map_or_else(
            || "all of paths from lights".to_owned(),
            |bad| format!("the first: --pixel {},{} --sample {}", bad.x, bad.y, bad.sample),
        );
        let count = counts.bad_samples;
        talk.say(&format!("warning: {count} samples were not finite or negative and were dropped; {which}"));
    }
    rendered.raster
}

/// Whether a file can be made where `path` is to be.
fn check_folder(path: &Path) -> Result<(), String> {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::tempfile_in(parent).map(drop).map_err(|cause| {
        format!("{}: no file can be written in {}: {cause}", path.display(), parent.display())
    })
}

/// What an image is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

impl Format {
    /// By the file's ending.
    fn of(path: &Path) -> Result<Self, String> {
        match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(format!("{}: images are written as .exr or .png", path.display())),
        }
    }
}

fn write(path: &Path, format: Format, raster: &Raster, display: &Display) -> Outcome {
    let layer = raster.picture();
    match (format, layer.rgb()) {
        (Format::Png, Some(rgb)) => {
            imagefile::write_png(
                path,
                layer.window.width,
                layer.window.height,
                &tone::to_srgb8(rgb, display),
            )?;
        }
        _ => {
            imagefile::write_exr(path, raster)?;
        }
    }
    Ok(WELL)
}

fn tell_path(prepared: &Prepared, x: u32, y: u32, sample: u32) -> Outcome {
    let (width, height) = prepared.size();
    let most = prepared.most_samples();
    if x >= width || y >= height || sample >= most {
        let samples = if prepared.is_adaptive() { format!("at most {most}") } else { most.to_string() };
        return Err(format!(
            "the image has {width} × {height} pixels of {samples} samples; there is no sample {sample} of pixel {x},{y}",
        )
        .into());
    }
    let path = replay(prepared, x, y, sample);
    let mut text = String::new();
    for (branch, vertices) in path.branches.iter().enumerate() {
        if path.branches.len() > 1 {
            text += &format!("branch {} of {}\n", branch + 1, path.branches.len());
        }
        for (i, v) in vertices.iter().enumerate() {
            let [px, py, pz] = v.point;
            let (beta, radiance) = (v.beta.to_array(), v.radiance.to_array());
            text += &format!(
                "{:>3}  at ({px}, {py}, {pz})  beta {beta:?}  radiance so far {radiance:?}\n",
                i + 1
            );
        }
    }
    let joined = if prepared.has_path_reuse() { ", with what neighbours' paths bring" } else { "" };
    let lit = if prepared.has_light_paths() { ", without what light paths bring" } else { "" };
    print(&format!("{text}radiance {:?}{joined}{lit}\n", path.radiance.to_array()))?;
    Ok(WELL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_read_toml_values_and_plain_words() {
        let value = |text: &str| parse_override(text).map(|o| o.value);
        assert_eq!(value("a.b=0.5"), Ok(Value::Number(0.5)));
        assert_eq!(value("a.b = 1"), Ok(Value::Number(1.0)));
        assert_eq!(value("a.b=mirror"), Ok(Value::Text("mirror".into())));
        assert_eq!(value("a.b=[1, 0.5, 0]"), Ok(Value::List([1.0, 0.5, 0.0].map(Value::Number).to_vec())));
        assert!(parse_override("a.b").is_err());
    }

    #[test]
    fn pixels_are_two_whole_numbers() {
        assert_eq!(parse_pixel("3, 4"), Ok((3, 4)));
        assert!(parse_pixel("3;4").is_err() && parse_pixel("-1,2").is_err());
    }
}
