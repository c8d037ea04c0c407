//! Manifests that are wrong: everything is told at once, with its place, and nothing is rendered.

use crate::support::{Desk, SMALL, repository, three_jobs};

#[test]
fn all_errors_are_told_at_once_with_place_and_nearest_key() {
    let scene = repository("scenes/spheres.glb");
    let desk = Desk::new(&format!(
        "scene = '{}'\ntitel = \"x\"\n[[axis]]\npath = \"material.metallic.rougness\"\nvalues = [0.1, 0.5]\n\
         [render]\nwidht = 24\nspp = -4\n",
        scene.display()
    ));
    let run = desk.sweep(&[]).ends_with(2).tells_not("error: error:");
    for (place, error, hint) in [
        ("sweep.toml:4:1\n", "the manifest has no key `titel`", ""),
        ("sweep.toml:6:8\n", "a material has no field `rougness`", "did you mean `roughness`?"),
        ("sweep.toml:9:1\n", "the render has no field `widht`", "did you mean `width`?"),
        ("sweep.toml:10:7\n", "`render.spp` is -4, but must be a whole number", ""),
    ] {
        assert!([place, error, hint].iter().all(|t| run.stderr.contains(t)), "{place}: {}", run.stderr);
    }
    assert_eq!(run.stderr.matches("error: ").count(), 4, "{}", run.stderr);
    assert!(desk.names("results").is_empty());
}

#[test]
fn an_unknown_material_lists_what_the_scene_has_and_nothing_is_rendered() {
    let desk = Desk::new(&three_jobs("[0.1]", "[set]\n\"material.flor.roughness\" = 0.3\n"));
    desk.sweep(&[])
        .ends_with(2)
        .tells("the scene has no material `flor`")
        .tells("sweep.toml:12:1")
        .tells("did you mean `floor`? it has the materials `floor`, `textured`, `masked`, ");
    assert!(desk.images().is_empty());
}

#[test]
fn manifests_that_are_none_are_named() {
    let desk = Desk::with_three_jobs("");
    desk.run(["sweep", "none.toml"]).ends_with(2).tells("none.toml").tells("cannot read the manifest");
    desk.run(["sweep", "."]).ends_with(2).tells("cannot read the manifest");
    std::fs::write(desk.path("binary.toml"), [b'a', b'=', 0xff, 0xfe]).unwrap();
    desk.run(["sweep", "binary.toml"]).ends_with(2).tells("not UTF-8");
    std::fs::write(desk.path("torn.toml"), "scene = \"a.glb\"\n[render\n").unwrap();
    desk.run(["sweep", "torn.toml", "--list"]).ends_with(2).tells("torn.toml:2:");
    std::fs::write(desk.path("empty.toml"), "").unwrap();
    desk.run(["sweep", "empty.toml", "--dry-run"]).ends_with(2).tells("needs `scene`");
}

#[test]
fn a_pattern_finds_scenes_in_order_or_is_told() {
    let desk = Desk::new(&format!("scene = \"scenes/*.glb\"\n{SMALL}"));
    desk.sweep(&["--list"]).ends_with(2).tells("no scene matches `scenes/*.glb`").tells("sweep.toml:3:9");
    std::fs::create_dir(desk.path("scenes")).unwrap();
    for name in ["b.glb", "a.glb", "c.txt"] {
        std::fs::copy(repository("scenes/spheres.glb"), desk.path("scenes").join(name)).unwrap();
    }
    let list = desk.sweep(&["--list"]).ends_with(0);
    assert_eq!(list.stdout, "scene=a\nscene=b\n");
    desk.sweep(&[]).ends_with(0).says("2 jobs: 2 rendered");
}

#[test]
fn the_manifest_may_be_anywhere_and_its_paths_are_its_own() {
    let desk = Desk::with_three_jobs("");
    std::fs::create_dir(desk.path("deep")).unwrap();
    let text = String::from_utf8(desk.bytes("sweep.toml")).unwrap();
    let scene = repository("scenes/spheres.glb");
    std::fs::copy(&scene, desk.path("own.glb")).unwrap();
    let text = text.replace(&scene.display().to_string(), "../own.glb");
    std::fs::write(desk.path("deep/sweep.toml"), text).unwrap();
    desk.run(["sweep", "deep/sweep.toml"]).ends_with(0);
    assert_eq!(crate::support::images(&desk.names("deep/results")).len(), 3);
    assert!(desk.names("results").is_empty());
}
