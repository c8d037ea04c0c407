//! Files of others: `PIPELINE_CORPUS` names the folder.

use std::path::{Path, PathBuf};

use crate::outside::outside;

use pipeline::convert::{ConvertOptions, to_disney};
use pipeline::import::{GltfError, ImportError, ImportOptions, import};

/// What can't be imported, with what the error must name.
const REFUSED: [(&str, &str); 1] = [
    // The corpus lacks the file that holds its buffer.
    ("BoxDraco.gltf", "0.bin"),
];

#[test]
fn every_file_of_the_corpus_is_imported_or_refused_with_its_reason() {
    let Some(corpus) = outside("PIPELINE_CORPUS") else { return };
    let mut files = Vec::new();
    collect(&Path::new(&corpus).join("gltf"), &mut files);
    assert!(files.len() > 30, "{} files", files.len());
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let refused = REFUSED.iter().find(|(file, _)| *file == name);
        match (import(&path, &ImportOptions::default()), refused) {
            (Ok(imported), None) => {
                let triangles = imported.scene.triangle_count();
                let converted = to_disney(imported.scene, &ConvertOptions::default());
                assert!(triangles > 0 && converted.scene.bounds().is_some(), "{name}");
                assert!(!converted.scene.dump().contains("NaN"), "{name}");
            }
            (Err(ImportError::Gltf { cause, .. }), Some((_, reason))) => {
                let refusal = matches!(
                    *cause,
                    GltfError::Required { .. }
                        | GltfError::Extension { .. }
                        | GltfError::Image(_)
                        | GltfError::File { .. }
                );
                assert!(refusal && cause.to_string().contains(reason), "{name}: {cause}");
            }
            (Err(error), _) => panic!("{name}: {error}"),
            (Ok(_), Some(_)) => panic!("{name} is imported now"),
        }
    }
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            files.push(path);
        }
    }
}
