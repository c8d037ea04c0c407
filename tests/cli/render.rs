//! `pipeline render`.

use std::path::Path;

use pipeline::raster::{Attribute, Raster};

use crate::support::{Desk, Run, SMALL_ARGUMENTS, SQUARE, repository};

/// Renders a scene of the repository, or one of the desk's.
fn render(desk: &Desk, scene: impl AsRef<Path>, more: &[&str]) -> Run {
    let scene = scene.as_ref().to_str().unwrap();
    desk.run(["render", scene].iter().chain(&SMALL_ARGUMENTS).chain(more))
}

fn desk() -> Desk {
    Desk::with_three_jobs("")
}

fn spheres() -> std::path::PathBuf {
    repository("scenes/spheres.glb")
}

#[test]
fn the_exr_has_a_picture_and_its_data_with_their_origin() {
    let desk = desk();
    let set = ["--set", "material.floor.roughness=0.3", "--seed", "18446744073709551615", "--max-depth", "5"];
    let run = render(&desk, spheres(), &[&["-o", "a.exr"], &set[..]].concat()).ends_with(0);
    run.tells("24 × 18, 4 samples a pixel");
    let Raster { display, layers } = desk.raster("a.exr");
    assert_eq!((display.width, display.height), (24, 18));
    let parts: Vec<(&str, Vec<&str>)> = layers
        .iter()
        .map(|l| (l.name.as_str(), l.channels.iter().map(|c| c.name.as_str()).collect()))
        .collect();
    let data = [
        "Z",
        "albedo.B",
        "albedo.G",
        "albedo.R",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "samples",
        "variance.B",
        "variance.G",
        "variance.R",
    ];
    let sorted = |mut names: Vec<&str>| -> Vec<String> {
        names.sort_unstable();
        names.into_iter().map(str::to_owned).collect()
    };
    assert_eq!(parts.len(), 2);
    assert_eq!((parts[0].0, sorted(parts[0].1.clone())), ("beauty", sorted(vec!["R", "G", "B"])));
    assert_eq!((parts[1].0, sorted(parts[1].1.clone())), ("data", sorted(data.to_vec())));
    for layer in &layers {
        assert!(layer.channels.iter().flat_map(|c| &c.values).all(|v| v.is_finite()));
        let text = |name: &str| match layer.attribute(name) {
            Some(Attribute::Text(text)) => text.clone(),
            other => panic!("{name}: {other:?}"),
        };
        for name in ["pipeline:identity", "pipeline:key"] {
            assert!(text(name).len() == 64 && text(name).bytes().all(|b| b.is_ascii_hexdigit()), "{name}");
        }
        assert_eq!(text("pipeline:overrides"), "material.floor.roughness = 0.3");
        assert_eq!(text("pipeline:seed"), u64::MAX.to_string());
        assert_eq!(text("Software"), format!("pipeline {}", env!("CARGO_PKG_VERSION")));
        assert_eq!(layer.attribute("pipeline:samples"), Some(&Attribute::Int(4)));
        assert_eq!(layer.attribute("pipeline:max_depth"), Some(&Attribute::Int(5)));
    }
    let samples = layers[1].channel("samples").unwrap();
    assert!(samples.values.iter().all(|&n| n == 4.0));
}

#[test]
fn a_png_is_the_picture_alone_under_a_tone_curve() {
    let desk = desk();
    render(&desk, spheres(), &["-o", "a.png"]).ends_with(0);
    render(&desk, spheres(), &["-o", "b.PNG", "--exposure", "-2", "--tone", "srgb"]).ends_with(0);
    let mean = |name: &str| {
        let raster = desk.raster(name);
        assert_eq!((raster.layers.len(), raster.display.width, raster.display.height), (1, 24, 18));
        let [r, _, _] = raster.picture().rgb().unwrap();
        r.iter().sum::<f32>() / r.len() as f32
    };
    assert!(desk.bytes("a.png").starts_with(b"\x89PNG"));
    assert!(mean("a.png") > 1.2 * mean("b.PNG") && mean("b.PNG") > 0.0);
}

#[test]
fn an_unknown_ending_is_told_before_anything_is_read() {
    let desk = desk();
    for name in ["a.jpg", "a", "a.exr.gz"] {
        let run = render(&desk, "no such scene.glb", &["-o", name]).ends_with(2);
        run.tells(name).tells("images are written as .exr or .png").tells_not("no such scene");
    }
    assert_eq!(desk.names("."), ["sweep.toml"]);
}

#[test]
fn a_wrong_path_or_value_is_told_with_a_hint() {
    let desk = desk();
    for (set, error, hint) in [
        ("material.flor.roughness=0.3", "no material `flor`", "did you mean `floor`?"),
        ("material.floor.rougness=0.3", "no field `rougness`", "did you mean `roughness`?"),
        ("camra.fov=30", "no path begins with `camra`", "did you mean `camera`?"),
        ("material.floor.roughness=1.5", "`material.floor.roughness` is 1.5, but must be", ""),
        ("material.floor.roughness=rough", "is \"rough\", but must be", ""),
        ("environment.image=none.hdr", "`environment.image`: ", ""),
    ] {
        let run = render(&desk, spheres(), &["-o", "a.exr", "--set", set]).ends_with(2).tells(error);
        if !hint.is_empty() {
            run.tells(&format!("hint: {hint}"));
        }
    }
    render(&desk, spheres(), &["-o", "a.exr", "--camera", "top"]).ends_with(2).tells("no camera `top`");
    assert_eq!(desk.names("."), ["sweep.toml"]);
}

#[test]
fn sizes_and_samples_out_of_range_are_told() {
    let desk = desk();
    let spheres = spheres();
    let scene = spheres.to_str().unwrap();
    let wrong = [["--spp", "0"], ["--width", "0"], ["--height", "4000000000"]];
    for (wrong, code) in wrong.map(|w| (w, 64)).into_iter().chain([(["--replicates", "0"], 2)]) {
        let run = desk.run(["render", scene, "-o", "a.exr"].iter().chain(&wrong)).ends_with(code);
        run.tells("error: ").tells_not("panicked");
    }
    let huge = ["--width", "65536", "--height", "65536", "--spp", "1"];
    desk.run(["render", scene, "-o", "a.exr"].iter().chain(&huge)).ends_with(2).tells_not("panicked");
    assert_eq!(desk.names("."), ["sweep.toml"]);
}

#[test]
fn one_sample_s_path_is_printed_and_adds_up_to_its_pixel() {
    let desk = desk();
    let one = ["--width", "24", "--height", "18", "--spp", "1"];
    let spheres = spheres();
    let base = || ["render", spheres.to_str().unwrap()].into_iter().chain(one);
    for (splitting, starts) in [("never", "  1  at ("), ("always", "branch 1 of 2\n  1  at (")] {
        let splitting = format!("render.splitting={splitting}");
        let base = || base().chain(["--set", &splitting]);
        desk.run(base().chain(["-o", "a.exr"])).ends_with(0);
        let raster = desk.raster("a.exr");
        let [r, _, _] = raster.picture().rgb().unwrap();
        let lit = (0..r.len()).rev().find(|&i| r[i] > 0.0).expect("a lit pixel");
        let pixel = format!("{},{}", lit % 24, lit / 24);
        let run = desk.run(base().chain(["--pixel", &pixel, "--sample", "0"])).ends_with(0);
        assert!(run.stdout.starts_with(starts), "{}", run.stdout);
        assert_eq!(run.stdout.contains("\nbranch 2 of 2\n  1  at ("), starts.starts_with("branch"));
        let last = run.stdout.lines().last().unwrap();
        let red: f32 = last.strip_prefix("radiance [").unwrap().split(',').next().unwrap().parse().unwrap();
        assert!((red - r[lit]).abs() <= 1e-6 * r[lit], "{red} against {}", r[lit]);
    }
    for (pixel, sample) in [("24,0", "0"), ("0,18", "0"), ("0,0", "1")] {
        let run = desk.run(base().chain(["--pixel", pixel, "--sample", sample])).ends_with(2);
        run.tells("the image has 24 × 18 pixels of 1 samples");
    }
}

#[test]
fn missing_and_unknown_scenes_are_named() {
    let desk = desk();
    render(&desk, "none.glb", &["-o", "a.exr"]).ends_with(2).tells("error: cannot read ").tells("none.glb: ");
    render(&desk, ".", &["-o", "a.exr"]).ends_with(2).tells("error: ");
    std::fs::write(desk.path("model.fbx"), "x").unwrap();
    render(&desk, "model.fbx", &["-o", "a.exr"]).ends_with(2).tells("model.fbx");
    for (name, content) in [("empty.glb", ""), ("empty.obj", ""), ("text.gltf", "{}"), ("empty.yaml", "")] {
        std::fs::write(desk.path(name), content).unwrap();
        render(&desk, name, &["-o", "a.exr"]).ends_with(2).tells(name).tells_not("panicked");
    }
}

#[test]
fn an_obj_without_camera_and_light_is_framed_and_lit_and_says_so() {
    let desk = desk();
    std::fs::write(desk.path("square.obj"), SQUARE).unwrap();
    std::fs::write(desk.path("square.mtl"), "newmtl paint\nKd 0.5 0.4 0.3\n").unwrap();
    let run = render(&desk, "square.obj", &["-o", "a.exr"]).ends_with(0);
    run.tells("warning: square.obj: no camera: ").tells("warning: square.obj: no light: ");
    let raster = desk.raster("a.exr");
    let depth = &raster.layer("data").unwrap().channel("Z").unwrap().values;
    assert!(depth.iter().any(|&z| z > 0.0), "the square is in view");
    let [r, _, _] = raster.picture().rgb().unwrap();
    assert!(r.iter().zip(depth).any(|(&r, &z)| z > 0.0 && r > 0.01), "and lit");
    let quiet = render(&desk, "square.obj", &["-o", "a.exr", "--quiet"]).ends_with(0);
    assert_eq!(quiet.stderr, "");
}

#[test]
fn an_obj_without_its_mtl_is_rendered_with_a_warning() {
    let desk = desk();
    std::fs::write(desk.path("square.obj"), SQUARE).unwrap();
    render(&desk, "square.obj", &["-o", "a.exr"]).ends_with(0).tells("warning: ").tells("square.mtl");
}

#[test]
fn an_output_that_cannot_be_written_is_told_and_nothing_is_left() {
    let desk = desk();
    render(&desk, spheres(), &["-o", "no/such/folder/a.exr"]).ends_with(2).tells("no/such/folder");
    render(&desk, spheres(), &["-o", "sweep.toml/a.exr"]).ends_with(2).tells("sweep.toml/a.exr");
    std::fs::create_dir(desk.path("folder.exr")).unwrap();
    render(&desk, spheres(), &["-o", "folder.exr"]).ends_with(2).tells("folder.exr");
    assert_eq!(desk.names("."), ["folder.exr", "sweep.toml"]);
}

/// To make a white environment for it would light the scene unasked.
#[test]
fn turning_an_environment_that_is_not_there_is_refused() {
    let desk = desk();
    for field in ["rotation=30", "intensity=2"] {
        let set = format!("environment.{field}");
        render(&desk, spheres(), &["-o", "a.exr", "--set", &set]).ends_with(2).tells("has no environment");
    }
    assert_eq!(desk.names("."), ["sweep.toml"]);
}

#[test]
fn a_render_ends_at_an_error_or_when_time_is_up() {
    let desk = desk();
    let scene = spheres();
    let attribute = |name: &str, image: &str| desk.raster(image).picture().attribute(name).cloned();
    let run = |more: &[&str]| {
        let fixed = ["render", scene.to_str().unwrap(), "--width", "48", "--height", "32"];
        desk.run(fixed.iter().chain(more))
    };
    run(&["-o", "a.exr", "--error", "0.003"]).ends_with(0).tells("samples a pixel on average");
    assert_eq!(attribute("pipeline:error", "a.exr"), Some(Attribute::Float(0.003)));
    assert!(attribute("pipeline:key", "a.exr").is_some());
    let samples = &desk.raster("a.exr").layer("data").unwrap().channel("samples").unwrap().values.clone();
    assert!(samples.iter().all(|n| (16.0..65536.0).contains(n)));
    assert!(samples.iter().any(|n| *n != samples[0]), "no tile needed more samples than another");

    run(&["-o", "b.exr", "--time-limit", "0.2"]).ends_with(0).tells("samples a pixel on average");
    assert_eq!(attribute("pipeline:time_limit", "b.exr"), Some(Attribute::Float(0.2)));
    for name in ["pipeline:key", "pipeline:identity"] {
        assert_eq!(attribute(name, "b.exr"), None, "the machine had a say");
    }

    // So many seconds are beyond what clocks count.
    run(&["-o", "b.exr", "--time-limit", "1e19", "--spp", "4"]).ends_with(0).tells(", 4 samples a pixel");

    for (option, value) in [("--error", "0"), ("--error", "2"), ("--error", "nan"), ("--time-limit", "-1")] {
        run(&["-o", "c.exr", &format!("{option}={value}")]).ends_with(64).tells("is expected, such as");
    }
    run(&["-o", "c.exr", "--error", "0.02", "--spp", "1"]).ends_with(2).tells("a single sample");
}
