//! From a manifest file to jobs.

use std::path::{Path, PathBuf};

use super::SweepError;
use crate::import::Reach;
use crate::manifest::{Manifest, expand};
use crate::record::Job;

/// An opened manifest.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The manifest.
    pub manifest: Manifest,
    /// Its jobs, in order.
    pub jobs: Vec<Job>,
    /// Where the results go, unless another folder is asked for.
    pub folder: PathBuf,
    /// How far the scenes' names of files lead: as the manifest says, unless more is allowed.
    pub reach: Reach,
}

/// Reads a manifest, finds its scenes and expands its axes.
///
/// # Errors
/// If it can't be read, is wrong (all its errors at once), or its patterns match no scene.
pub fn open(path: &Path) -> Result<Sweep, SweepError> {
    let manifest = Manifest::read(path)?;
    let scenes = find_scenes(&manifest)?;
    let jobs = expand(&manifest, &scenes)?;
    let folder = match &manifest.output {
        Some(folder) => manifest.folder().join(folder),
        None => Path::new("outputs").join(manifest.folder_name()),
    };
    let reach = if manifest.allow_outside { Reach::Anywhere } else { Reach::Folder };
    Ok(Sweep { manifest, jobs, folder, reach })
}

/// The scene files that the manifest names, those of a pattern in alphabetical order.
fn find_scenes(manifest: &Manifest) -> Result<Vec<PathBuf>, SweepError> {
    let mut scenes = Vec::new();
    for (index, entry) in manifest.scene_patterns().into_iter().enumerate() {
        if let Some(path) = entry.path {
            scenes.push(path);
            continue;
        }
        let pattern = entry.pattern;
        let found = glob::glob(&entry.glob).map_err(|cause| SweepError::Pattern { pattern, cause })?;
        // A folder that can't be looked into has no scenes for us.
        let mut matches: Vec<PathBuf> = found.filter_map(Result::ok).filter(|path| path.is_file()).collect();
        if matches.is_empty() {
            return Err(manifest.no_scene(index).into());
        }
        matches.sort();
        scenes.extend(matches);
    }
    Ok(scenes)
}
