//! Aris: config roots in Hydra's layout, `CONFIG_ROOT/render.yaml` with its groups, and single scenes `config/scene/NAME.yaml`.
//!
//! `yaml` reads located trees; `compose` follows `defaults`; `overrides` reads those of the command line, which `edit` puts into
//! the tree; `interpolate` resolves `${…}`; `scene` makes a scene of the result and `settings` a render's settings. Paths in a
//! scene are relative to the folder that holds the config root, or `config/`, or to the scene file's own where there is no such
//! folder above it.
//! A material is named after the mesh file of its entry, `sphere1` for `data/meshes/cbox/sphere1.obj`; where several meshes
//! share a file's name the mesh's index follows: `sphere_0`, `sphere_1`.

mod compose;
mod edit;
mod interpolate;
mod overrides;
mod root;
mod scene;
mod settings;
mod write;
pub(crate) mod yaml;

use std::path::Path;

pub use root::{ArisConfig, ArisRun};
use yaml::{Node, Value};

use super::{FileError, Files, Imported, ObjError, Reach};
use crate::imagefile::ImageFileError;

/// Why an Aris scene cannot be read. Places are `file:line:column`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArisError {
    /// The scene's folder cannot be opened, or the file's name is not Unicode.
    #[error("cannot read the scene {path}: {cause}")]
    Scene {
        /// The file.
        path: String,
        /// The reason.
        cause: FileError,
    },
    /// A file that the scene names cannot be read.
    #[error("{place}: {}{cause}{hint}", if key.is_empty() { String::new() } else { format!("{key}: ") })]
    File {
        /// Where it is named.
        place: String,
        /// The key that names it.
        key: String,
        /// The reason.
        cause: FileError,
        /// What else there is.
        hint: String,
    },
    /// A configuration file is too large.
    #[error("{file} has {size} bytes; a configuration has at most {max}")]
    TooLarge {
        /// The file.
        file: String,
        /// Its size in bytes.
        size: usize,
        /// The limit.
        max: usize,
    },
    /// The text is not YAML, or more of it than is allowed.
    #[error("{file}:{line}:{column}: {message}")]
    Yaml {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// The column, from 1.
        column: u64,
        /// The parser's message.
        message: String,
    },
    /// The `defaults` cannot be followed.
    #[error("{place}: {message}; hint: {hint}")]
    Composition {
        /// Where.
        place: String,
        /// What is wrong.
        message: String,
        /// What would be right.
        hint: String,
    },
    /// A key that is not known.
    #[error("{place}: {within} has no key {key:?}; {hint}")]
    UnknownKey {
        /// Where.
        place: String,
        /// The map.
        within: String,
        /// The key.
        key: String,
        /// The nearest known key.
        hint: String,
    },
    /// A key that must be there.
    #[error("{place}: {within} needs the key {key:?}")]
    Missing {
        /// Where the map begins.
        place: String,
        /// The map.
        within: String,
        /// The key.
        key: &'static str,
    },
    /// A value of the wrong kind.
    #[error("{place}: {key} must be {expected}, but is {found}")]
    Type {
        /// Where.
        place: String,
        /// The key.
        key: String,
        /// What was expected.
        expected: String,
        /// What was there.
        found: &'static str,
    },
    /// A number out of range.
    #[error("{place}: {key} is {value}, but must be {expected}")]
    Range {
        /// Where.
        place: String,
        /// The entry and key.
        key: String,
        /// The value.
        value: f64,
        /// What is allowed.
        expected: String,
    },
    /// Two lists do not go together.
    #[error("{place}: {what}: {found}, but there are {meshes} meshes; {hint}")]
    Count {
        /// Where.
        place: String,
        /// The list.
        what: &'static str,
        /// How many or which were found.
        found: String,
        /// The number of meshes.
        meshes: usize,
        /// How they belong together.
        hint: &'static str,
    },
    /// Something that Aris knows and this importer does not.
    #[error("{place}: {what} is not read; hint: {hint}")]
    Unsupported {
        /// Where.
        place: String,
        /// What.
        what: String,
        /// Why, or what to do.
        hint: String,
    },
    /// A mesh cannot be read.
    #[error("{place}: {key}: {cause}")]
    Mesh {
        /// Where it is named.
        place: String,
        /// The key that names it.
        key: String,
        /// The reason.
        cause: Box<ObjError>,
    },
    /// An image cannot be read.
    #[error("{place}: {key}: {cause}")]
    Image {
        /// Where it is named.
        place: String,
        /// The key that names it.
        key: String,
        /// The reason.
        cause: Box<ImageFileError>,
    },
}

/// Reads the scene file at `path` with everything it names within `reach`.
///
/// # Errors
/// If a file is missing or cannot be read, a key is unknown or missing, or a value is of the wrong kind or out of range.
pub(super) fn import(path: &Path, reach: Reach) -> Result<Imported, ArisError> {
    let (mut files, composed) = composed(path, reach)?;
    let composed = interpolate::resolve(&composed)?;
    let mut warnings = Vec::new();
    let scene = scene::build(&mut files, &composed, &mut warnings)?;
    Ok(Imported { scene, warnings, folder: files.root().to_owned(), files: files.into_digests() })
}

/// Whether the YAML at `path` is a scene: with what its `defaults` name it has all that a scene needs. Groups, bases of scenes and
/// configs of whole renders are none, nor is what others write in YAML. Where its `defaults` can't be followed it counts as one: who
/// imports it is told why.
pub(crate) fn is_scene(path: &Path) -> bool {
    let has = |node: &Node, key: &str| edit::find(node, &[key]).is_some();
    let Some(own) = small_yaml(path) else { return false };
    let has_defaults = matches!(edit::find(&own, &["defaults"]), Some(Node { value: Value::List(_), .. }));
    if !has_defaults && !has(&own, "geometry") {
        return false;
    }
    match composed(path, Reach::Folder) {
        Ok((_, composed)) => scene::NEEDED.iter().all(|key| has(&composed, key)),
        Err(_) => true,
    }
}

/// What a file holds, if it is YAML and no larger than a configuration may be.
fn small_yaml(path: &Path) -> Option<Node> {
    let size = path.metadata().ok()?.len();
    let bytes = (size <= yaml::MAX_BYTES as u64).then(|| std::fs::read(path).ok())??;
    yaml::parse(&path.display().to_string(), &bytes).ok()
}

/// The file at `path` with all that its `defaults` name, and the files of its scene.
fn composed(path: &Path, reach: Reach) -> Result<(Files, Node), ArisError> {
    let failed = |cause| ArisError::Scene { path: path.display().to_string(), cause };
    let absolute =
        path.canonicalize().map_err(|cause| failed(FileError::Read { path: path.into(), cause }))?;
    let own_folder = absolute.parent().unwrap_or(Path::new("/"));
    let config =
        absolute.ancestors().skip(1).find(|folder| folder.file_name().is_some_and(|name| name == "config"));
    let root = config.and_then(Path::parent).unwrap_or(own_folder);
    let mut files = Files::new(root, reach).map_err(failed)?;
    let name = absolute.strip_prefix(root).ok().and_then(Path::to_str).map(|name| name.replace('\\', "/"));
    let name = name.ok_or_else(|| {
        let cause = std::io::Error::new(std::io::ErrorKind::InvalidInput, "its name is not Unicode");
        failed(FileError::Read { path: path.into(), cause })
    })?;
    let (top, name) = match name.strip_prefix("config/") {
        Some(name) if config.is_some() => ("config", name),
        _ => ("", name.as_str()),
    };
    let composed = compose::compose(&mut files, top, name, &[])?;
    Ok((files, composed))
}

#[cfg(test)]
mod tests;
