//! The configs that come with the project.

use crate::support::{Desk, repository};

/// Each config with the number of its jobs.
const CONFIGS: [(&str, usize); 6] = [
    ("glass", 16),
    ("pink_and_green_balls", 1),
    ("roughness", 11),
    ("roughness_by_metal", 22),
    ("statue", 4),
    ("two_copper_spheres", 1),
];

#[test]
fn every_config_lists_its_jobs() {
    let desk = Desk::with_three_jobs("");
    for (name, jobs) in CONFIGS {
        let config = repository(&format!("configs/{name}.toml"));
        let config = config.to_str().unwrap();
        let list = desk.run(["sweep", config, "--list"]).ends_with(0).stdout;
        let mut names: Vec<&str> = list.lines().collect();
        assert_eq!(names.len(), jobs, "{name}: {list}");
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), jobs, "{name}: two jobs of one name");
        let dry = desk.run(["sweep", config, "--dry-run"]).ends_with(0);
        assert!(dry.stdout.ends_with(&format!("{jobs} jobs into outputs/{name}\n")), "{}", dry.stdout);
    }
    assert!(desk.names("outputs").is_empty());
}

#[test]
fn the_list_above_is_whole() {
    let mut names: Vec<String> = std::fs::read_dir(repository("configs"))
        .unwrap()
        .map(|e| e.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    assert_eq!(names, CONFIGS.map(|(name, _)| name));
}

/// `--dry-run` looks at no scene; a run with a small picture does.
#[test]
fn configs_fit_their_scenes() {
    for (name, jobs) in CONFIGS {
        let text = std::fs::read_to_string(repository(&format!("configs/{name}.toml"))).unwrap();
        let mut manifest: toml::Table = text.parse().unwrap();
        let render = manifest.entry("render").or_insert_with(|| toml::Table::new().into());
        let render = render.as_table_mut().unwrap();
        for (key, value) in [("width", 32), ("height", 24), ("spp", 4)] {
            render.insert(key.into(), value.into());
        }
        manifest.remove("compare");
        let scene = repository("configs").join(manifest["scene"].as_str().unwrap());
        manifest.insert("scene".into(), scene.to_str().unwrap().into());
        let desk = Desk::with_three_jobs("");
        std::fs::write(desk.path("sweep.toml"), manifest.to_string()).unwrap();
        desk.sweep(&["-o", "results"]).ends_with(0).says(&format!(": {jobs} rendered, 0 reused\n"));
        assert_eq!(desk.images().len(), jobs);
        for image in desk.images() {
            assert_eq!(desk.record(image.trim_end_matches(".exr")).counts.bad_samples, 0, "{image}");
        }
    }
}
