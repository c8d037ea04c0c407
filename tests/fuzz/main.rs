//! The bodies of the fuzz targets over their seeds, and over everything that fuzzing found, each file named for what it did.

#[allow(unreachable_pub, reason = "in the crate of the targets others use it")]
#[path = "../../fuzz/src/bodies.rs"]
mod bodies;

use std::path::{Path, PathBuf};

/// The files of a folder, in order; none if it isn't there.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn seeds_and_what_was_found_do_no_harm() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (target, body) in bodies::ALL {
        let seeds = files(&root.join("fuzz/seeds").join(target));
        assert!(!seeds.is_empty(), "{target} has no seeds");
        for file in seeds.into_iter().chain(files(&root.join("tests/fuzz/crashes").join(target))) {
            let input = std::fs::read(&file).unwrap();
            let survived = std::panic::catch_unwind(|| body(&input));
            assert!(survived.is_ok(), "{}", file.display());
        }
    }
}

/// Seeds that are only refused would try nothing.
#[test]
fn the_largest_seeds_are_rendered() {
    for (target, name) in [
        ("gltf", "everything.glb"),
        ("obj", "two_materials.obj"),
        ("aris", "library.yaml"),
        ("aris", "root.yaml"),
    ] {
        let seed = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(target).join(name);
        let rendered = bodies::rendered(target, &std::fs::read(seed).unwrap());
        assert!(rendered.is_ok(), "{name}: {}", rendered.unwrap_err());
    }
}
