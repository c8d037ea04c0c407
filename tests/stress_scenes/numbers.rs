//! NaN and infinity in files: replaced and counted, or refused, before anything is rendered.

use std::path::Path;

use pipeline::imagefile::write_exr;
use pipeline::import::{ImportOptions, Reach, import, read_environment};
use pipeline::job::{Build, Destination, load, plan, run};
use pipeline::raster::{Layer, Raster, Window};
use pipeline::record::{Job, Outcome, Override, Value};
use pipeline::render::Control;
use pipeline::settings::RenderSettings;

const NAN: f32 = f32::NAN;
const INF: f32 = f32::INFINITY;

/// 4 × 2 pixels of 1, but for three values that are no light.
fn write_sky(path: &Path) {
    let plane = |i: usize, bad: f32| {
        let mut values = vec![1.0; 8];
        values[i] = bad;
        values
    };
    let layer = Layer::new("", Window::sized(4, 2))
        .with("R", plane(1, NAN))
        .with("G", plane(3, INF))
        .with("B", plane(6, -INF));
    write_exr(path, &Raster::single(layer)).expect("an EXR");
}

const OBJ: &str = "mtllib m.mtl\nusemtl m\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1 0\n\
    vt 0 0\nvt nan 1\nvt 1 inf\nvn 0 1 0\nvn nan 0 0\nvn 0 0 0\n\
    f 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/1/1\n";

#[test]
fn an_environment_with_nan_is_rendered_with_zeros_and_the_record_says_how_many() {
    let folder = tempfile::tempdir().expect("a folder");
    let sky = folder.path().join("sky.exr");
    write_sky(&sky);
    let (_, _, warning) = read_environment(&sky, Reach::Folder).expect("an environment");
    let warning = warning.expect("a warning").to_string();
    assert!(warning.contains("sky.exr") && warning.contains("3 values"), "{warning}");

    std::fs::write(folder.path().join("a.obj"), OBJ).expect("a file");
    std::fs::write(folder.path().join("m.mtl"), "newmtl m\nKd 0.5 0.5 0.5\nmap_Ke sky.exr\nKe 1 1 1\n")
        .expect("a file");
    let job = Job {
        name: "nan".into(),
        scene: folder.path().join("a.obj"),
        overrides: vec![Override {
            path: "environment.image".into(),
            value: Value::Text(sky.display().to_string()),
        }],
        settings: RenderSettings { width: Some(16), height: Some(12), spp: 4, ..RenderSettings::default() },
        coordinates: Vec::new(),
    };
    let loaded = load(&job.scene, &Default::default(), &Default::default(), None).expect("a scene");
    let build = Build::current().expect("the executable");
    let planned = plan(&job, &loaded, &build).expect("a plan");
    let destination = Destination { folder: folder.path().to_owned(), references: None };
    let record = run(&planned, &loaded, &build, &destination, &Control::default()).expect("a record");
    assert_eq!(record.outcome, Outcome::Done);
    assert_eq!(record.counts.bad_samples, 0);
    let told = |what: &str| record.warnings.iter().filter(|w| w.message.contains(what)).count();
    assert_eq!(told("3 values were negative or not finite"), 2, "texture and sky: {:?}", record.warnings);
}

#[test]
fn texture_coordinates_and_normals_of_an_obj_that_are_no_numbers_are_mended_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.obj");
    std::fs::write(&path, OBJ).expect("a file");
    let imported = import(&path, &ImportOptions::default()).expect("a scene");
    let mesh = &imported.scene.meshes[0];
    assert!(mesh.uvs.iter().flatten().all(|uv| uv.is_finite()));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-6));
    let all: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    assert!(all.iter().any(|w| w.contains("exture coordinates")), "{all:?}");
    assert!(all.iter().any(|w| w.contains("normal")), "{all:?}");
}
