//! From TOML text to a [`Manifest`], or to all that is wrong with it at once.
//!
//! What can be judged without a scene is judged here: keys, types, paths, ranges of values, the number of jobs.

mod axis;
pub(super) mod keys;
mod reader;

use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use self::reader::{Node, Reader, Table};
use super::error::{Diagnostic, ManifestError, ManifestErrors, Source};
use super::model::{
    Axis, CompareSpec, DEFAULT_MAX_JOBS, Located, MAX_MAX_JOBS, Manifest, Setting, SheetSpec, is_glob,
};
use super::names::{plain_name, stem};
use super::nearest::nearest;
use crate::record::Value;
use crate::settings::{Display, RenderSettings, ToneCurve};

/// The largest manifest that is read, in bytes.
const MAX_SIZE: u64 = 4 << 20;
/// The largest number of axes.
const MAX_AXES: usize = 64;
/// The largest number of `exclude` tables: each is held against each job.
const MAX_EXCLUDES: usize = 256;

impl Manifest {
    /// Reads a manifest.
    ///
    /// # Errors
    /// If the file cannot be read, or anything in it is wrong.
    pub fn read(path: &Path) -> Result<Self, ManifestErrors> {
        let failed = |error| ManifestErrors::of_file(path, error);
        let file = std::fs::File::open(path).map_err(|e| failed(ManifestError::Read(e)))?;
        let size = file.metadata().map_err(|e| failed(ManifestError::Read(e)))?.len();
        if size > MAX_SIZE {
            return Err(failed(ManifestError::TooLarge { size, limit: MAX_SIZE }));
        }
        let mut bytes = Vec::new();
        file.take(MAX_SIZE).read_to_end(&mut bytes).map_err(|e| failed(ManifestError::Read(e)))?;
        let text = std::str::from_utf8(&bytes)
            .map_err(|e| failed(ManifestError::NotUtf8 { at: e.valid_up_to() }))?;
        Self::parse(text, path)
    }

    /// Parses `text`, which comes from the file `path`: its folder is what paths are relative to.
    ///
    /// # Errors
    /// Everything that is wrong: all errors of syntax, or else all others.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ManifestErrors> {
        let source = Source { path: path.to_owned(), text: text.into() };
        let (tree, errors) = DeTable::parse_recoverable(text);
        if !errors.is_empty() {
            let note = |e: &toml::de::Error| Diagnostic {
                error: ManifestError::Toml { message: e.message().into() },
                span: e.span(),
                other: None,
            };
            return Err(ManifestErrors::new(source, errors.iter().map(note).collect()));
        }
        let mut reader = Reader::default();
        let manifest = manifest(&mut reader, tree.get_ref(), source.clone());
        if reader.errors.is_empty() { Ok(manifest) } else { Err(ManifestErrors::new(source, reader.errors)) }
    }
}

/// The whole manifest; sound if no errors were noted.
fn manifest(reader: &mut Reader, tree: &DeTable<'_>, source: Source) -> Manifest {
    let top = reader.known(tree, 0..0, "the manifest", keys::MANIFEST);
    let max_jobs = reader.whole(&top, "max_jobs", 1..=MAX_MAX_JOBS).unwrap_or(DEFAULT_MAX_JOBS);
    let name = top.get("name").and_then(|n| reader.text("name", n)).map(|n| n.value);
    let (scenes, scene_is_axis) = scenes(reader, &top);
    let mut short = |key: &str| top.get(key).map(|n| reader.settings(key, key, n)).unwrap_or_default();
    let [camera, environment, light, material] =
        ["camera", "environment", "light", "material"].map(&mut short);
    let set = top.get("set").map(|n| reader.settings("", "set", n)).unwrap_or_default();
    let (render, render_camera) = render(reader, &top);
    let (axes, all_axes_sound) = axes(reader, &top, max_jobs);
    let manifest = Manifest {
        name: name.unwrap_or_else(|| plain_name(&stem(&source.path))),
        scenes,
        scene_is_axis,
        materials: top.get("materials").and_then(|n| reader.text("materials", n)).map(|p| p.value.into()),
        allow_outside: reader.flag(&top, "allow_outside").unwrap_or_default(),
        set,
        exclude: exclude(reader, &top),
        max_jobs,
        render,
        render_camera,
        camera,
        environment,
        light,
        material,
        sheet: sheet(reader, &top),
        compare: top.get("compare").and_then(|n| compare(reader, n)),
        output: top.get("output").and_then(|n| reader.text("output", n)).map(|p| PathBuf::from(p.value)),
        axes,
        source,
    };
    check_settings(reader, &manifest);
    check_scene(reader, &top, &manifest);
    // A broken axis has been told; that others do not find it is no news.
    if all_axes_sound {
        check_axis_names(reader, &manifest);
    }
    check_count(reader, &manifest);
    manifest
}

/// `scene`: the entries, and whether they are an axis.
fn scenes(reader: &mut Reader, top: &Table<'_, '_>) -> (Vec<Located<String>>, bool) {
    match top.get("scene") {
        None => (Vec::new(), false),
        Some(node) if matches!(node.get_ref(), DeValue::Array(_)) => {
            let items =
                reader.items("scene", "a file, or a list of files, at least one", node).unwrap_or_default();
            (items.iter().filter_map(|item| reader.text("scene", item)).collect(), true)
        }
        Some(node) => match reader.text("scene", node) {
            Some(scene) => {
                let is_axis = is_glob(&scene.value);
                (vec![scene], is_axis)
            }
            None => (Vec::new(), false),
        },
    }
}

/// `[render]`, read through the same paths as `render.FIELD`.
fn render(reader: &mut Reader, top: &Table<'_, '_>) -> (RenderSettings, Option<Range<usize>>) {
    let mut settings = RenderSettings::default();
    let Some(node) = top.get("render") else { return (settings, None) };
    let mut camera = None;
    for Setting { path, value } in reader.settings("render", "render", node) {
        if path.value == "render.camera" {
            camera = Some(value.span.clone());
        }
        let before = reader.errors.len();
        reader.check(&path, &value);
        if reader.errors.len() == before {
            set_render(&mut settings, &path.value, &value.value);
        }
    }
    (settings, camera)
}

/// Sets a render setting that has been checked.
fn set_render(settings: &mut RenderSettings, path: &str, value: &Value) {
    let set = super::edit::set_render(settings, path, value);
    debug_assert!(set.is_ok(), "{path} was checked");
}

/// `[[axis]]`, and whether all of them are sound.
fn axes(reader: &mut Reader, top: &Table<'_, '_>, max_jobs: u64) -> (Vec<Axis>, bool) {
    let Some(node) = top.get("axis") else { return (Vec::new(), true) };
    let Some(nodes) = axis::nodes(node) else {
        reader.expected("axis", "one or several tables: write `[[axis]]`", node.span());
        return (Vec::new(), false);
    };
    if nodes.len() > MAX_AXES {
        reader.expected("axis", format!("given at most {MAX_AXES} times"), node.span());
        return (Vec::new(), false);
    }
    let mut budget = axis::Budget { jobs: 1, max_jobs, is_spent: false };
    let axes: Vec<Axis> = nodes.iter().filter_map(|n| axis::axis(reader, n, &mut budget)).collect();
    let all_sound = axes.len() == nodes.len();
    (axes, all_sound)
}

/// `[[exclude]]`.
fn exclude(reader: &mut Reader, top: &Table<'_, '_>) -> Vec<Located<Vec<Setting>>> {
    let Some(node) = top.get("exclude") else { return Vec::new() };
    let Some(nodes) = axis::nodes(node) else {
        reader.expected("exclude", "a list of tables: write `[[exclude]]`", node.span());
        return Vec::new();
    };
    if nodes.len() > MAX_EXCLUDES {
        reader.expected("exclude", format!("given at most {MAX_EXCLUDES} times"), node.span());
        return Vec::new();
    }
    let rule = |reader: &mut Reader, node: &Node<'_>| {
        let settings = reader.settings("", "exclude", node);
        if settings.is_empty() && matches!(node.get_ref(), DeValue::Table(_)) {
            reader.note(
                ManifestError::Missing { table: "[[exclude]]", what: "an axis with a value" },
                node.span(),
            );
        }
        Located::new(settings, node.span())
    };
    nodes.iter().map(|n| rule(reader, n)).collect()
}

/// `[sheet]`.
fn sheet(reader: &mut Reader, top: &Table<'_, '_>) -> SheetSpec {
    let Some(t) = top.get("sheet").and_then(|n| reader.table("sheet", n, "[sheet]", keys::SHEET)) else {
        return SheetSpec::default();
    };
    let [columns, rows, title] =
        ["columns", "rows", "title"].map(|key| t.get(key).and_then(|n| reader.text(key, n)));
    let cell_width = reader.whole(&t, "cell_width", 16..=4096).map(|n| n as u32);
    let display = t.get("display").map(|n| display(reader, n)).unwrap_or_default();
    SheetSpec { columns, rows, title: title.map(|t| t.value), cell_width, display }
}

/// `[sheet.display]`.
fn display(reader: &mut Reader, node: &Node<'_>) -> Display {
    let mut display = Display::default();
    let Some(t) = reader.table("display", node, "[sheet.display]", keys::DISPLAY) else { return display };
    if let Some(node) = t.get("tone") {
        match node.get_ref().as_str() {
            Some("srgb") => display.tone = ToneCurve::Srgb,
            Some("neutral") => display.tone = ToneCurve::Neutral,
            Some("agx") => display.tone = ToneCurve::Agx,
            _ => reader.expected("tone", "one of \"srgb\", \"neutral\", \"agx\"", node.span()),
        }
    }
    display.exposure = reader.number(&t, "exposure", -32.0..=32.0).unwrap_or(0.0) as f32;
    display
}

/// `[compare]`.
fn compare(reader: &mut Reader, node: &Node<'_>) -> Option<CompareSpec> {
    let t = reader.table("compare", node, "[compare]", keys::COMPARE)?;
    let references = match t.get("references") {
        Some(node) => reader.text("references", node),
        None => {
            reader.missing(&t, &["references"], "`references`, the folder of the reference images");
            None
        }
    };
    let allowfailures = reader.whole(&t, "allowfailures", 0..=u64::from(u32::MAX));
    let mut limit = |key: &str| reader.number(&t, key, 0.0..=f64::MAX);
    let [fail, failrelative, hardfail, warn, warnrelative, hardwarn, mean, rms] =
        ["fail", "failrelative", "hardfail", "warn", "warnrelative", "hardwarn", "mean", "rms"]
            .map(&mut limit);
    let [failpercent, warnpercent] =
        ["failpercent", "warnpercent"].map(|key| reader.number(&t, key, 0.0..=100.0));
    let references = PathBuf::from(references?.value);
    Some(CompareSpec {
        references,
        fail,
        failpercent,
        failrelative,
        hardfail,
        allowfailures,
        warn,
        warnpercent,
        warnrelative,
        hardwarn,
        mean,
        rms,
    })
}

/// Every fixed path is known, suits its value, and is set once, be it fixed or by an axis.
fn check_settings(reader: &mut Reader, manifest: &Manifest) {
    let mut first: BTreeMap<&str, Range<usize>> = BTreeMap::new();
    let axes = manifest.axes.iter().flat_map(Axis::paths);
    for Setting { path, value } in manifest.fixed() {
        if path.value == "scene" {
            let what = "`scene` at the top, not in a table";
            reader.note(ManifestError::Missing { table: "the manifest", what }, path.span.clone());
            continue;
        }
        reader.check(path, value);
    }
    for path in manifest.fixed().map(|s| &s.path).chain(axes) {
        match first.get(path.value.as_str()) {
            Some(earlier) => {
                let error = ManifestError::Twice { path: path.value.as_str().into() };
                let twice = Diagnostic::new(error, path.span.clone()).and(earlier.clone(), "first here");
                reader.errors.push(twice);
            }
            None => {
                first.insert(&path.value, path.span.clone());
            }
        }
    }
}

/// The scene is named once: at the top or by an axis.
fn check_scene(reader: &mut Reader, top: &Table<'_, '_>, manifest: &Manifest) {
    let axis = manifest.axes.iter().flat_map(Axis::paths).find(|p| p.value == "scene");
    match (top.get("scene"), axis) {
        (Some(node), Some(axis)) => {
            let twice = Diagnostic::new(ManifestError::Twice { path: "scene".into() }, axis.span.clone());
            reader.errors.push(twice.and(node.span(), "first here"));
        }
        (None, None) => reader.missing(top, &["scene"], "`scene`, the file to render"),
        _ => {}
    }
}

/// What `[sheet]` and `[[exclude]]` call an axis is one.
fn check_axis_names(reader: &mut Reader, manifest: &Manifest) {
    let sheet = [&manifest.sheet.columns, &manifest.sheet.rows].into_iter().flatten();
    let excluded = manifest.exclude.iter().flat_map(|rule| &rule.value).map(|s| &s.path);
    for named in sheet.chain(excluded) {
        if manifest.axis_id(&named.value).is_none() {
            let mut known: Vec<String> = manifest.axes.iter().map(Axis::id).collect();
            if manifest.scene_is_axis {
                known.insert(0, "scene".into());
            }
            let nearest = nearest(&named.value, known.iter().map(String::as_str)).map(Into::into);
            let error = ManifestError::NotAnAxis { path: named.value.as_str().into(), nearest, known };
            reader.note(error, named.span.clone());
        }
    }
    if let (Some(columns), Some(rows)) = (&manifest.sheet.columns, &manifest.sheet.rows)
        && manifest.axis_id(&columns.value).is_some()
        && manifest.axis_id(&columns.value) == manifest.axis_id(&rows.value)
    {
        let twice =
            Diagnostic::new(ManifestError::Twice { path: "axis of the sheet".into() }, rows.span.clone());
        reader.errors.push(twice.and(columns.span.clone(), "first here"));
    }
    let mut ids: BTreeMap<String, Range<usize>> = BTreeMap::new();
    for axis in &manifest.axes {
        if let Some(name) = &axis.name
            && let Some(earlier) = ids.insert(name.value.clone(), name.span.clone())
        {
            let error = ManifestError::Twice { path: format!("name = {:?}", name.value).into() };
            let twice = Diagnostic::new(error, name.span.clone()).and(earlier, "first here");
            reader.errors.push(twice);
        }
    }
}

/// There are not too many jobs, as far as the axes tell.
fn check_count(reader: &mut Reader, manifest: &Manifest) {
    let jobs = manifest.count(1);
    if jobs > manifest.max_jobs {
        let span = manifest.axes.last().map_or(0..0, |a| a.span.clone());
        reader.note(ManifestError::TooManyJobs { jobs, limit: manifest.max_jobs }, span);
    }
}
