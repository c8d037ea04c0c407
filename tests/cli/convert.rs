//! `pipeline convert`, and laying its libraries over scenes.

use crate::outside::outside;
use crate::support::{Desk, SMALL_ARGUMENTS, repository};

fn scene(name: &str) -> String {
    repository(&format!("scenes/{name}")).to_str().unwrap().to_owned()
}

fn render(desk: &Desk, scene: &str, more: &[&str]) {
    desk.run(["render", scene].iter().chain(&SMALL_ARGUMENTS).chain(more)).ends_with(0);
}

#[test]
fn an_unedited_library_gives_the_same_picture_and_an_edited_one_another() {
    let desk = Desk::new("");
    for file in ["spheres.glb", "cornell.obj", "aris/config/scene/cbox_balls.yaml"] {
        let scene = scene(file);
        desk.run(["convert", &scene, "-o", "lib"]).ends_with(0).says("fields: ");
        render(&desk, &scene, &["-o", "plain.exr"]);
        render(&desk, &scene, &["-o", "laid.exr", "--materials", "lib/materials.yaml"]);
        let pixels =
            |name: &str| desk.raster(name).layers.into_iter().map(|l| l.channels).collect::<Vec<_>>();
        assert_eq!(pixels("plain.exr"), pixels("laid.exr"), "{file}");
    }
    let spheres = scene("spheres.glb");
    std::fs::write(desk.path("edited.yaml"), "floor: {roughness: 0.05, metallic: 1}\n").unwrap();
    render(&desk, &spheres, &["-o", "edited.exr", "--materials", "edited.yaml"]);
    render(&desk, &spheres, &["-o", "plain.exr"]);
    let set = ["--set", "material.floor.roughness=0.05", "--set", "material.floor.metallic=1"];
    render(&desk, &spheres, &[&["-o", "set.exr"], &set[..]].concat());
    let picture = |name: &str| desk.raster(name).layers.swap_remove(0).channels;
    assert_ne!(picture("edited.exr"), picture("plain.exr"));
    assert_eq!(picture("edited.exr"), picture("set.exr"));
}

#[test]
fn a_manifest_lays_a_library_over_its_scenes_and_a_changed_one_renders_again() {
    let manifest = format!(
        "scene = {:?}\nmaterials = \"library.yaml\"\n[render]\nwidth = 24\nheight = 18\nspp = 2\n",
        scene("spheres.glb")
    );
    let desk = Desk::new(&manifest);
    let library = |text: &str| std::fs::write(desk.path("library.yaml"), text).unwrap();
    library("floor: {roughness: 0.05}\n");
    desk.sweep(&[]).ends_with(0).says("1 rendered, 0 reused");
    desk.sweep(&[]).ends_with(0).says("0 rendered, 1 reused");
    library("floor: {roughness: 0.5}\n");
    desk.sweep(&[]).ends_with(0).says("1 rendered, 0 reused");
    library("flor: {roughness: 0.5}\n");
    desk.sweep(&[]).ends_with(2);
    desk.run(["render", &scene("spheres.glb"), "-o", "a.exr", "--materials", "library.yaml"])
        .ends_with(2)
        .tells("library.yaml:1:1: the scene has no material `flor`")
        .tells("did you mean `floor`?");
}

#[test]
fn a_folder_is_converted_in_one_go_and_a_broken_file_does_not_stop_the_rest() {
    let desk = Desk::new("");
    let assets = desk.path("assets");
    std::fs::create_dir_all(assets.join("sub")).unwrap();
    std::fs::copy(scene("spheres.glb"), assets.join("sub/spheres.glb")).unwrap();
    std::fs::write(assets.join("broken.glb"), "glTF").unwrap();
    std::fs::copy(scene("cornell.obj"), assets.join("cornell.obj")).unwrap();
    std::fs::copy(scene("cornell.mtl"), assets.join("cornell.mtl")).unwrap();
    let run = desk.run(["convert", "assets", "-o", "out", "--report", "json"]).ends_with(2);
    let run = run.tells("error: assets/broken.glb");
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let scenes: Vec<&str> = report.as_array().unwrap().iter().map(|s| s["scene"].as_str().unwrap()).collect();
    assert_eq!(scenes, ["assets/cornell.obj", "assets/sub/spheres.glb"]);
    assert!(report[1]["notes"].as_array().unwrap().iter().any(|n| n["quality"] == "carried"));
    assert_eq!(desk.names("out"), ["cornell", "sub"]);
    assert_eq!(desk.names("out/sub/spheres"), ["materials.yaml", "textures"]);
    let page =
        desk.run(["convert", "assets/cornell.obj", "-o", "out", "--report", "html"]).ends_with(0).stdout;
    assert!(page.starts_with("<!doctype html>") && !page.contains("http"));
    desk.run(["convert", "results", "-o", "out"]).ends_with(2);
}

/// Its groups, its base and the config of a render are no scenes.
#[test]
fn of_a_config_root_its_scenes_are_converted() {
    let desk = Desk::new("");
    desk.run(["convert", &scene("aris"), "-o", "out"]).ends_with(0);
    assert_eq!(desk.names("out/config"), ["scene"]);
    assert_eq!(desk.names("out/config/scene"), ["cbox", "cbox_balls", "cbox_copper", "cbox_diffuse"]);
}

#[test]
fn a_scene_s_own_textures_and_configs_are_never_written_over() {
    let desk = Desk::new("");
    desk.run(["convert", &scene("spheres.glb"), "-o", "model"]).ends_with(0);
    std::fs::remove_file(desk.path("model/materials.yaml")).unwrap();
    let quad =
        "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl floor\nf 1/1 2/2 3/3\n";
    std::fs::write(desk.path("model/quad.obj"), quad).unwrap();
    std::fs::write(desk.path("model/quad.mtl"), "newmtl floor\nmap_Kd textures/chess.png\n").unwrap();
    let files = ["model/textures/chess.png", "root/config/scene/cbox_balls.yaml"];
    desk.run(["convert", &scene("aris/config/scene/cbox_balls.yaml"), "--to", "aris", "-o", "root"])
        .ends_with(0);
    let changed = |file| desk.path(file).metadata().unwrap().modified().unwrap();
    let before = files.map(changed);
    desk.run(["convert", "model/quad.obj", "-o", "model"])
        .ends_with(2)
        .tells("model/textures/chess.png is the scene itself or belongs to it");
    desk.run(["convert", files[1], "--to", "aris", "-o", "root"]).ends_with(2).tells("would be overwritten");
    assert_eq!(files.map(changed), before);
    assert_eq!(
        desk.names("model"),
        ["quad.mtl", "quad.obj", "textures"],
        "nothing is written before it is told"
    );
    desk.run(["convert", "model/quad.obj", "-o", "model/disney"]).ends_with(0).says("1 texture;");
}

/// MaterialX's own library knows every node, finds nothing wrong, and generates a shader of each material.
#[test]
fn materialx_reads_the_documents() {
    let Some(python) = outside("PIPELINE_MATERIALX_PYTHON") else { return };
    let desk = Desk::new("");
    let mut documents = Vec::new();
    for (i, file) in ["spheres.glb", "shaderball.glb", "cornell.obj"].into_iter().enumerate() {
        let folder = format!("mtlx{i}");
        desk.run(["convert", &scene(file), "--to", "mtlx", "-o", &folder]).ends_with(0).says("fields: ");
        documents.push(desk.path(&folder).join("materials.mtlx"));
    }
    let check = repository("tests/check_mtlx.py");
    let output =
        std::process::Command::new(python).arg(check).args(&documents).output().expect("Python starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(text.trim(), "7\n7\n6");
}

/// What Aris can say comes back to the same bits; Hydra composes the root as we do.
#[test]
fn an_aris_scene_comes_back_from_a_config_root_to_the_same_picture() {
    let desk = Desk::new("");
    let source = scene("aris/config/scene/cbox_balls.yaml");
    desk.run(["convert", &source, "--to", "aris", "-o", "root"]).ends_with(0);
    render(&desk, &source, &["-o", "source.exr"]);
    render(&desk, "root/config", &["-o", "root.exr"]);
    let picture = |name: &str| desk.raster(name).layers.swap_remove(0).channels;
    assert!(picture("source.exr") == picture("root.exr"), "the pictures differ");
    let Some(python) = outside("PIPELINE_HYDRA_PYTHON") else { return };
    let code = "import sys, hydra\nwith hydra.initialize_config_dir(version_base=None, config_dir=sys.argv[1]):\n    \
                c = hydra.compose('render', ['spp=2'])\n    print(c.spp, len(c.scene.brdf), c.scene.camera.config.fov)";
    let output =
        std::process::Command::new(python).args(["-c", code]).arg(desk.path("root/config")).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(text.trim(), "2 6 28", "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_gltf_scene_renders_from_a_config_root_with_its_losses_told() {
    let desk = Desk::new("");
    let source = scene("spheres.glb");
    let run = desk.run(["convert", &source, "--to", "aris", "-o", "root"]).ends_with(0);
    run.says("the texture's mean").says("Aris' pixels lie around whole coordinates").says("dropped");
    render(&desk, "root/config", &["-o", "root.exr"]);
    render(&desk, &source, &["-o", "source.exr"]);
    let mean = |name: &str| {
        let values = desk.raster(name).layers.swap_remove(0).channels.swap_remove(0).values;
        values.iter().sum::<f32>() / values.len() as f32
    };
    let ratio = mean("root.exr") / mean("source.exr");
    assert!((0.5..1.5).contains(&ratio), "the same scene, but for what was told: {ratio}");
}
