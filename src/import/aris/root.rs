//! A config root: a folder with `render.yaml`, composed with the overrides of a command line.

use std::path::{Path, PathBuf};

use super::compose::compose;
use super::overrides::{Action, Override, parse};
use super::yaml::{Node, Value};
use super::{ArisError, edit, interpolate, scene, settings, write};
use crate::import::{FileDigest, FileError, Files, Imported, Reach};
use crate::settings::RenderSettings;

/// The file that makes a folder a config root.
const PRIMARY: &str = "render.yaml";
/// The one setting of Hydra itself that is read.
const RUN_FOLDER: &str = "hydra.run.dir";

/// A composed configuration of Aris' `render.py`.
#[derive(Clone, Debug)]
pub struct ArisConfig {
    /// The folder that holds the config root, from which meshes and images are found.
    folder: PathBuf,
    reach: Reach,
    tree: Node,
    run_folder: Option<String>,
    name: String,
}

/// A scene of a config root and how to render it.
#[derive(Clone, Debug)]
pub struct ArisRun {
    /// The scene. Its files are the composed scene, whatever files and overrides it came from, and what that names.
    pub imported: Imported,
    /// The settings.
    pub settings: RenderSettings,
    /// Whether the configuration asks for an EXR beside the PNG.
    pub save_exr: bool,
}

impl ArisConfig {
    /// Whether `path` is a folder that holds `render.yaml`.
    pub fn is_root(path: &Path) -> bool {
        path.join(PRIMARY).is_file()
    }

    /// Composes the configuration of the config root `path` with `overrides` such as `scene=cbox`, `scene/brdf=cbox_diffuse`,
    /// `spp=50`, `+scene.camera.config.aperture=0.3` or `~scene/environment`, as Hydra 1.3 does. Its files lie in the folder that
    /// holds the config root, or elsewhere as far as `reach` says.
    ///
    /// # Errors
    /// If a file is missing or is not YAML, a defaults list can't be followed, or an override can't be read or names nothing.
    pub fn compose(path: &Path, overrides: &[String], reach: Reach) -> Result<Self, ArisError> {
        let failed = |cause| ArisError::Scene { path: path.display().to_string(), cause };
        let io = |cause| failed(FileError::Read { path: path.into(), cause });
        let root = path.canonicalize().map_err(io)?;
        let (Some(folder), Some(top)) = (root.parent(), root.file_name().and_then(|name| name.to_str()))
        else {
            let why = "its name is not Unicode, or it is the root of all files";
            return Err(io(std::io::Error::new(std::io::ErrorKind::InvalidInput, why)));
        };
        let mut files = Files::new(folder, reach).map_err(failed)?;
        let overrides = overrides.iter().map(|line| parse(line)).collect::<Result<Vec<_>, _>>()?;
        let (of_hydra, overrides): (Vec<_>, Vec<_>) =
            overrides.into_iter().partition(|o| o.key.split(['.', '/']).next() == Some("hydra"));
        let run_folder = of_hydra.iter().map(run_folder).collect::<Result<Vec<_>, _>>()?.pop();
        // A map is a value, also for a group: it is merged with the content of the group's file.
        let is_map = |o: &Override| matches!(o.value.as_ref().map(|v| &v.value), Some(Value::Map(_)));
        let is_group = |o: &Override| !is_map(o) && files.is_folder(&format!("{top}/{}", o.key));
        let (choices, values): (Vec<_>, Vec<_>) = overrides.iter().partition(|o| is_group(o));
        let mut tree = compose(&mut files, top, PRIMARY, &choices)?;
        if let Value::Map(entries) = &mut tree.value {
            entries.retain(|(key, ..)| key != "hydra");
        }
        for o in &values {
            edit::apply(&mut tree, o)?;
        }
        let lines: Vec<&str> = overrides.iter().map(|o| o.line.as_str()).collect();
        Ok(Self { folder: folder.to_owned(), reach, tree, run_folder, name: name_of(&lines) })
    }

    /// The configuration as YAML, interpolations as they stand.
    pub fn to_yaml(&self) -> String {
        write::to_yaml(&self.tree)
    }

    /// Where each value comes from: its path, its value, and file, line and column or the override, one a line.
    pub fn provenance(&self) -> String {
        let mut lines = String::new();
        trace(&self.tree, &mut String::new(), &mut lines);
        lines
    }

    /// The folder for what is written, relative to the working directory: `hydra.run.dir`, or below `outputs` one named after the
    /// overrides.
    pub fn output_folder(&self) -> PathBuf {
        match &self.run_folder {
            Some(folder) => folder.into(),
            None => Path::new("outputs").join(&self.name),
        }
    }

    /// How far the names in its files lead.
    pub fn reach(&self) -> Reach {
        self.reach
    }

    /// A short name of the run: its overrides.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reads the scene and what it names.
    ///
    /// # Errors
    /// If a mesh or an image is missing or can't be read, a key is unknown or missing, or a value is of the wrong kind or out of
    /// range.
    pub(in crate::import) fn import(&self) -> Result<ArisRun, ArisError> {
        let tree = interpolate::resolve(&self.tree)?;
        let Some(of_scene) = edit::find(&tree, &["scene"]) else {
            let place = tree.place.to_string();
            return Err(ArisError::Missing { place, within: "the configuration".to_owned(), key: "scene" });
        };
        let mut warnings = Vec::new();
        let mut files = Files::new(&self.folder, self.reach)
            .map_err(|cause| ArisError::Scene { path: self.folder.display().to_string(), cause })?;
        let scene = scene::build(&mut files, of_scene, &mut warnings)?;
        let size = scene.cameras.first().and_then(|camera| camera.item.size);
        let (settings, save_exr) = settings::read(&tree, size, &mut warnings)?;
        let composed = blake3::hash(write::to_yaml(of_scene).as_bytes());
        let mut digests = vec![FileDigest { name: "scene".to_owned(), digest: composed }];
        digests.extend(files.into_digests());
        let imported = Imported { scene, warnings, files: digests, folder: self.folder.clone() };
        Ok(ArisRun { imported, settings, save_exr })
    }
}

fn run_folder(o: &Override) -> Result<String, ArisError> {
    match o.value.as_ref().map(|v| &v.value) {
        Some(Value::Text(folder))
            if o.key == RUN_FOLDER && o.action != Action::Delete && !folder.contains("${") =>
        {
            Ok(folder.clone())
        }
        _ => {
            let hint = "only the folder is read, as in hydra.run.dir=outputs/one";
            Err(o.error("it is about how Hydra itself runs", hint))
        }
    }
}

/// The longest name of an output folder.
const MAX_NAME: usize = 120;

/// The overrides in one name, as Hydra's `override_dirname`, in characters that file systems take.
fn name_of(lines: &[&str]) -> String {
    if lines.is_empty() {
        return "default".to_owned();
    }
    let text = lines.join(",");
    let plain = |c: char| if c.is_alphanumeric() || "=,+-~._".contains(c) { c } else { '_' };
    let name: String = text.chars().map(plain).collect();
    // Names that were shortened or changed stay different.
    if name.len() <= MAX_NAME && name.replace('_', "/") == text.replace('_', "/") && !name.starts_with('.') {
        return name;
    }
    let kept: String = name.chars().filter(char::is_ascii).take(MAX_NAME - 9).collect();
    format!("{}-{}", kept.trim_start_matches('.'), &blake3::hash(text.as_bytes()).to_hex()[..8])
}

fn trace(node: &Node, path: &mut String, lines: &mut String) {
    let length = path.len();
    let mut descend = |key: &str, child: &Node| {
        if length > 0 {
            path.push('.');
        }
        path.push_str(key);
        trace(child, path, lines);
        path.truncate(length);
    };
    match &node.value {
        Value::Map(entries) if !entries.is_empty() => {
            entries.iter().for_each(|(key, _, child)| descend(key, child));
        }
        Value::List(items) if items.iter().any(|i| matches!(i.value, Value::Map(_) | Value::List(_))) => {
            items.iter().enumerate().for_each(|(i, child)| descend(&i.to_string(), child));
        }
        value => *lines += &format!("{path} = {}  # {}\n", write::inline(value), node.place),
    }
}
