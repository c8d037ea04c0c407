//! A sweep's files, its table, and what a second run does again.

use crate::support::{Desk, SMALL, SQUARE, leftovers, same_pixels, three_jobs};

const JOBS: [&str; 3] = ["roughness=0.10", "roughness=0.50", "roughness=0.90"];

#[test]
fn a_sweep_leaves_an_image_and_a_record_for_each_job_and_a_sheet_and_a_page() {
    let desk = Desk::with_three_jobs("");
    let run = desk.sweep(&[]).ends_with(0).says("3 jobs: 3 rendered, 0 reused\n").tells("small: 3 jobs");
    let mut expected: Vec<String> =
        JOBS.iter().flat_map(|j| [format!("{j}.exr"), format!("{j}.json")]).collect();
    expected.extend(["index.html", "sheet.exr", "sheet.png"].map(str::to_owned));
    expected.sort();
    assert_eq!(desk.names("results"), expected);
    for job in JOBS {
        let row = run.stdout.lines().find(|l| l.contains(job)).expect("a row");
        assert!(row.contains("not compared"), "{row}");
        let record = desk.record(job);
        assert_eq!((record.job.name.as_str(), record.size, record.attempt), (job, [24, 18], 1));
        assert_eq!((record.counts.paths, record.counts.bad_samples), (24 * 18 * 4, 0));
        let digest = blake3::hash(&desk.bytes(&format!("results/{job}.exr"))).to_hex().to_string();
        assert_eq!(record.outputs.get(&format!("{job}.exr")), Some(&digest));
    }
    let sheet = desk.raster("results/sheet.png");
    assert!(sheet.display.width > 3 * 24 && sheet.display.height > 18, "{}", sheet.display);
    let page = String::from_utf8(desk.bytes("results/index.html")).unwrap();
    assert!(JOBS.iter().all(|job| page.contains(job)) && page.contains("sheet.png"));
    let mut files = desk.image_bytes().into_values();
    let first = files.next();
    assert!(files.all(|bytes| Some(bytes) != first), "the axis changes the picture");
}

#[test]
fn results_go_where_they_are_asked_for_and_quiet_says_nothing_but_the_table() {
    let desk = Desk::with_three_jobs("");
    let run = desk.sweep(&["-o", "elsewhere", "--quiet"]).ends_with(0).says("3 jobs: 3 rendered");
    assert_eq!(run.stderr, "");
    assert_eq!(desk.names("elsewhere").len(), 9);
    assert!(desk.names("results").is_empty());
}

#[test]
fn a_second_run_reuses_everything_and_touches_no_image_or_record() {
    let desk = Desk::with_three_jobs("");
    desk.sweep(&[]).ends_with(0);
    let before = desk.seen();
    assert_eq!(before.len(), 6);
    desk.sweep(&[]).ends_with(0).says("3 jobs: 0 rendered, 3 reused\n");
    assert!(desk.seen() == before);
}

#[test]
fn force_renders_again_to_the_same_bytes() {
    let desk = Desk::with_three_jobs("");
    desk.sweep(&[]).ends_with(0);
    let before = desk.image_bytes();
    desk.sweep(&["--force"]).ends_with(0).says("3 jobs: 3 rendered, 0 reused\n");
    assert!(desk.image_bytes() == before);
    assert!(JOBS.iter().all(|job| desk.record(job).attempt == 2));
}

#[test]
fn a_changed_value_renders_its_job_alone_and_a_changed_setting_all() {
    let labels = "labels = [\"a\", \"b\", \"c\"]\n";
    let manifest =
        |values: &str, more| three_jobs(values, more).replace("[render]", &format!("{labels}[render]"));
    let desk = Desk::new(&manifest("[0.1, 0.5, 0.9]", ""));
    desk.sweep(&[]).ends_with(0);
    let before = desk.seen();
    desk.rewrite(&manifest("[0.1, 0.6, 0.9]", ""));
    desk.sweep(&[]).ends_with(0).says("3 jobs: 1 rendered, 2 reused\n");
    let after = desk.seen();
    for (name, seen) in &before {
        assert_eq!(after[name] == *seen, !name.contains("=b."), "{name}");
    }
    desk.rewrite(&manifest("[0.1, 0.6, 0.9]", "seed = 1\n"));
    desk.sweep(&[]).ends_with(0).says("3 jobs: 3 rendered, 0 reused\n");
}

#[test]
fn a_change_in_any_file_of_the_scene_renders_it_again() {
    let desk = Desk::new(&format!("scene = \"square.obj\"\n{SMALL}"));
    let write = |name: &str, text: &str| std::fs::write(desk.path(name), text).unwrap();
    write("square.obj", SQUARE);
    write("square.mtl", "newmtl paint\nKd 0.5 0.4 0.3\n");
    desk.sweep(&[]).ends_with(0).says("1 job: 1 rendered, 0 reused\n");
    let first = desk.image_bytes();
    write("square.mtl", "newmtl paint\nKd 0.3 0.4 0.5\n");
    desk.sweep(&[]).ends_with(0).says("1 job: 1 rendered, 0 reused\n");
    assert!(desk.image_bytes() != first);
    write("square.obj", &SQUARE.replace("v 1 1 0", "v 1 2 0"));
    desk.sweep(&[]).ends_with(0).says("1 job: 1 rendered, 0 reused\n");
    desk.sweep(&[]).ends_with(0).says("1 job: 0 rendered, 1 reused\n");
}

#[test]
fn damaged_and_missing_results_are_rendered_again() {
    let desk = Desk::with_three_jobs("");
    desk.sweep(&[]).ends_with(0);
    let before = desk.image_bytes();
    let image = |job: &str| desk.path(&format!("results/{job}.exr"));
    let whole = std::fs::read(image(JOBS[0])).unwrap();
    std::fs::write(image(JOBS[0]), &whole[..whole.len() / 2]).unwrap();
    let mut flipped = std::fs::read(image(JOBS[1])).unwrap();
    let last = flipped.len() - 1;
    flipped[last] ^= 0x40;
    std::fs::write(image(JOBS[1]), flipped).unwrap();
    desk.sweep(&[]).ends_with(0).says("3 jobs: 2 rendered, 1 reused\n");
    assert!(desk.image_bytes() == before);

    std::fs::remove_file(image(JOBS[2])).unwrap();
    std::fs::write(desk.path("results/roughness=0.10.json"), "{ \"job\": ").unwrap();
    std::fs::remove_file(desk.path("results/roughness=0.50.json")).unwrap();
    desk.sweep(&[]).ends_with(0).says("3 jobs: 3 rendered, 0 reused\n");
    assert!(desk.image_bytes() == before);
    assert_eq!(leftovers(&desk.names("results")), Vec::<&String>::new());
}

#[test]
fn list_and_dry_run_tell_the_jobs_and_do_nothing() {
    let desk = Desk::with_three_jobs("");
    let list = desk.sweep(&["--list"]).ends_with(0);
    assert_eq!(list.stdout, JOBS.map(|j| format!("{j}\n")).concat());
    let dry = desk.sweep(&["--dry-run"]).ends_with(0).says("3 jobs into ");
    for value in ["0.1", "0.5", "0.9"] {
        assert!(dry.stdout.contains(&format!("  material.metallic.roughness = {value}\n")), "{}", dry.stdout);
    }
    assert!(desk.names("results").is_empty());
}

/// A triangle that faces the camera, in white or, for the variant "night", in black; the animation moves it out of sight within a second.
const TRIANGLE: &str = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0.2, 0.2, 2]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.3, "znear": 0.1, "aspectRatio": 1}}],
    "materials": [{"name": "day", "pbrMetallicRoughness": {"metallicFactor": 0}}, {"name": "night", "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0,
        "extensions": {"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}}}]}],
    "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": 1, "output": 2}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8},
        {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
    "buffers": [{"byteLength": 68, "uri": "data:application/octet-stream;base64,@"}],
    "extensions": {"KHR_materials_variants": {"variants": [{"name": "night"}]}},
    "extensionsUsed": ["KHR_materials_variants"]}"#;

#[test]
fn variants_moments_and_conversions_are_axes() {
    let values = [0.0f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 1., 0., 0., 0., 9., 0., 0.];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let manifest = "scene = 'triangle.gltf'\n[render]\nwidth = 8\nheight = 8\nspp = 4\n\
        [[axis]]\npath = 'import.variant'\nvalues = [false, 'night']\nlabels = ['day', 'night']\n\
        [[axis]]\npath = 'import.time'\nvalues = [0, 1]\n\
        [[axis]]\npath = 'convert.diffuse'\nvalues = ['burley', 'lambert']\n";
    let desk = Desk::new(manifest);
    let text =
        TRIANGLE.replace('@', &base64::Engine::encode(&base64::engine::general_purpose::STANDARD, bytes));
    std::fs::write(desk.path("triangle.gltf"), text).unwrap();
    desk.sweep(&[]).ends_with(0).says("8 jobs: 8 rendered");
    let middle = |name: &str| {
        let raster = desk.raster(&format!("results/{name}.exr"));
        raster.picture().rgb().expect("a colour picture")[0][8 * 4 + 4]
    };
    let at = |variant: &str, time: &str, diffuse: &str| {
        middle(&format!("variant={variant},time={time},diffuse={diffuse}"))
    };
    assert!(at("day", "0", "burley") > 3.0 * at("night", "0", "burley"));
    assert!(at("day", "0", "burley") != at("day", "0", "lambert"));
    assert!(at("day", "1", "burley") == at("night", "1", "burley"), "out of sight");
    // The same picture as alone, and nothing to do again.
    desk.run([
        "render",
        "triangle.gltf",
        "-o",
        "alone.exr",
        "--variant",
        "night",
        "--time",
        "0",
        "--width",
        "8",
        "--height",
        "8",
        "--spp",
        "4",
        "--set",
        "convert.diffuse=lambert",
    ])
    .ends_with(0);
    let alone = desk.raster("alone.exr");
    assert!(same_pixels(&alone, &desk.raster("results/variant=night,time=0,diffuse=lambert.exr")));
    desk.sweep(&[]).ends_with(0).says("8 jobs: 0 rendered, 8 reused");
    // A name that the file doesn't have is told by each job that asks for it.
    desk.rewrite(&manifest.replace("'night']", "'noon']"));
    desk.sweep(&["--dry-run"]).tells("noon");
}
