//! Files and folders into scenes to convert, each with a folder of its own.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use walkdir::WalkDir;

use super::ExportError;
use crate::import::is_aris_scene;

/// A scene to convert.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// Its file.
    pub source: PathBuf,
    /// Where its library goes.
    pub folder: PathBuf,
}

const ENDINGS: [&str; 3] = ["gltf", "glb", "obj"];
/// Of files that may be anything else as well.
const YAML_ENDINGS: [&str; 2] = ["yaml", "yml"];

/// The scenes that `paths` name, files as they are and folders with all scenes inside them, in alphabetical order; other YAML in
/// folders is passed over. Each has a folder under `output` after its path within the folder it was found in; a single file has
/// `output` itself.
///
/// # Errors
/// If a folder can't be looked into or has no scene.
pub fn inputs(paths: &[PathBuf], output: &Path) -> Result<Vec<Input>, ExportError> {
    if let [file] = paths
        && !file.is_dir()
    {
        return Ok(vec![Input { source: file.clone(), folder: output.to_owned() }]);
    }
    let mut inputs = Vec::new();
    let mut taken = BTreeSet::new();
    for path in paths {
        if path.is_dir() {
            for source in scenes_in(path)? {
                let inside = source.strip_prefix(path).unwrap_or(&source).to_owned();
                inputs.push(Input { folder: own_folder(output, &inside, &mut taken), source });
            }
        } else {
            let name = PathBuf::from(path.file_name().unwrap_or_default());
            inputs.push(Input { folder: own_folder(output, &name, &mut taken), source: path.clone() });
        }
    }
    Ok(inputs)
}

fn scenes_in(folder: &Path) -> Result<Vec<PathBuf>, ExportError> {
    let mut scenes = Vec::new();
    for entry in WalkDir::new(folder).sort_by_file_name() {
        let entry = entry.map_err(|error| ExportError::File {
            path: error.path().unwrap_or(folder).to_owned(),
            cause: error.into(),
        })?;
        if entry.file_type().is_file() && is_scene(entry.path()) {
            scenes.push(entry.into_path());
        }
    }
    if scenes.is_empty() { Err(ExportError::NoScene { path: folder.to_owned() }) } else { Ok(scenes) }
}

fn is_scene(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let unpacked = [".gz", ".zst"].iter().find_map(|packing| name.strip_suffix(packing)).unwrap_or(&name);
    unpacked.rsplit_once('.').is_some_and(|(stem, ending)| {
        let is_yaml = YAML_ENDINGS.contains(&ending) && unpacked == name;
        !stem.is_empty() && (ENDINGS.contains(&ending) || is_yaml && is_aris_scene(path))
    })
}

/// A folder that nothing else has: two files may differ in their ending alone, or in the folders they were found in.
fn own_folder(output: &Path, inside: &Path, taken: &mut BTreeSet<PathBuf>) -> PathBuf {
    let mut folder = output.join(inside.with_extension(""));
    let whole = output.join(inside);
    let mut again = 1;
    while !taken.insert(folder.clone()) {
        folder = whole.clone();
        if again > 1 {
            folder.as_mut_os_string().push(format!("-{again}"));
        }
        again += 1;
    }
    folder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_the_yaml_in_folders_scenes_alone_are_taken() {
        let root = tempfile::tempdir().unwrap();
        let scene = "geometry: {}\nbrdf: []\ncamera: {}\n";
        for (file, text) in [
            ("broken.yaml", "defaults: [lost]\n"),
            ("half.yaml", "geometry: {}\n"),
            ("library.yaml", "gold: {name: disney, config: {}}\n"),
            ("list.yaml", "- 1\n"),
            ("other.yml", "defaults: {run: {shell: bash}}\n"),
            ("packed.yaml.gz", scene),
            ("scene.yaml", scene),
            ("whole.YML", "defaults: [half, rest]\n"),
            ("rest.yaml", "brdf: []\ncamera: {}\n"),
            ("wrong.yaml", "{"),
        ] {
            std::fs::write(root.path().join(file), text).unwrap();
        }
        let found = inputs(&[root.path().to_owned()], Path::new("out")).unwrap();
        let names: Vec<_> = found.iter().filter_map(|i| i.source.file_name()).collect();
        assert_eq!(names, ["broken.yaml", "scene.yaml", "whole.YML"]);
        let named = ["half.yaml", "wrong.yaml"].map(|file| root.path().join(file));
        assert_eq!(inputs(&named, Path::new("out")).unwrap().len(), 2, "what is named is taken");
    }

    #[test]
    fn folders_are_walked_and_every_scene_has_a_folder_of_its_own() {
        let root = tempfile::tempdir().unwrap();
        for file in ["a.glb", "a.obj", "sub/b.GLTF", "c.obj.gz", "notes.txt", ".glb"] {
            let path = root.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let found = inputs(&[root.path().to_owned()], Path::new("out")).unwrap();
        let folders: Vec<String> = found.iter().map(|i| i.folder.display().to_string()).collect();
        assert_eq!(folders, ["out/a", "out/a.obj", "out/c.obj", "out/sub/b"]);
        let alike = ["x/a.glb", "y/a.glb", "z/a.glb", "w/a.glb"].map(PathBuf::from);
        let folders: BTreeSet<PathBuf> =
            inputs(&alike, Path::new("out")).unwrap().into_iter().map(|i| i.folder).collect();
        let expected = ["out/a", "out/a.glb", "out/a.glb-2", "out/a.glb-3"].map(PathBuf::from);
        assert_eq!(folders, BTreeSet::from(expected));
        let single = inputs(&[root.path().join("a.glb")], Path::new("out")).unwrap();
        assert_eq!(single[0].folder, Path::new("out"));
        let empty = tempfile::tempdir().unwrap();
        let error = inputs(&[empty.path().to_owned()], Path::new("out")).unwrap_err();
        assert!(matches!(error, ExportError::NoScene { .. }));
    }
}
