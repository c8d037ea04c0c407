//! `pipeline convert --to gltf`: GLBs that the Khronos validator finds nothing wrong with, and that come back to the same picture.

use std::path::PathBuf;

use pipeline::raster::Raster;
use serde_json::{Value, json};

use crate::outside::outside;
use crate::support::{Desk, Run, SMALL_ARGUMENTS, repository, same_pixels};

/// Converts `scene` into `folder/scene.glb`.
fn convert(desk: &Desk, scene: &str, folder: &str) -> Run {
    desk.run(["convert", scene, "--to", "gltf", "-o", folder]).ends_with(0).says("scene.glb: ")
}

fn render(desk: &Desk, scene: &str, output: &str, more: &[&str]) -> Raster {
    desk.run(["render", scene, "-o", output].iter().chain(&SMALL_ARGUMENTS).chain(more)).ends_with(0);
    desk.raster(output)
}

/// `scene` before and after it went through a GLB.
fn there_and_back(desk: &Desk, scene: &str, more: &[&str]) -> [Raster; 2] {
    convert(desk, scene, "out");
    [render(desk, scene, "before.exr", more), render(desk, "out/scene.glb", "after.exr", more)]
}

/// The root mean square difference of two pictures over the mean of the first.
fn difference([before, after]: &[Raster; 2]) -> f64 {
    let values = |raster: &Raster| -> Vec<f64> {
        let [r, g, b] = raster.picture().rgb().expect("a picture");
        r.iter().chain(g).chain(b).map(|&v| f64::from(v)).collect()
    };
    let (a, b) = (values(before), values(after));
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    let mean = a.iter().sum::<f64>() / a.len() as f64;
    (squares / a.len() as f64).sqrt() / mean
}

/// What the Khronos validator finds in GLBs, none if it isn't at hand.
fn validate(files: &[PathBuf]) -> Option<String> {
    let validator = outside("PIPELINE_GLTF_VALIDATOR")?;
    let output = std::process::Command::new("node")
        .arg(repository("tests/check_gltf.mjs"))
        .args(files)
        .env("PIPELINE_GLTF_VALIDATOR", validator)
        .output()
        .expect("node starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).expect("UTF-8"))
}

#[track_caller]
fn assert_valid(files: &[PathBuf]) {
    let Some(found) = validate(files) else { return };
    let clean = found.lines().filter(|line| line.starts_with("0 errors, 0 warnings: ")).count();
    assert!(clean == files.len() && found.lines().count() == clean, "{found}");
}

fn shipped(name: &str) -> String {
    repository("scenes").join(name).to_str().expect("UTF-8").to_owned()
}

#[test]
fn the_shipped_gltf_scenes_come_back_to_the_same_bits() {
    let desk = Desk::new("");
    let mut files = Vec::new();
    for (i, name) in ["spheres.glb", "shaderball.glb", "statue.glb.gz"].into_iter().enumerate() {
        let [before, after] = there_and_back(&desk, &shipped(name), &[]);
        assert!(same_pixels(&before, &after), "{name}");
        let file = desk.path(&format!("{i}.glb"));
        std::fs::copy(desk.path("out/scene.glb"), &file).unwrap();
        files.push(file);
    }
    assert_valid(&files);
}

/// The OBJ's Lambert surfaces have no counterpart with Burley's diffuse term, and are the same under glTF's own.
#[test]
fn the_cornell_box_comes_back_under_gltfs_diffuse_term() {
    let desk = Desk::new("");
    let pictures = there_and_back(&desk, &shipped("cornell.obj"), &["--diffuse", "lambert_fresnel"]);
    let found = difference(&pictures);
    assert!(found < 0.02, "{found}");
    assert_valid(&[desk.path("out/scene.glb")]);
}

/// What glTF can't say of Aris' scenes is told; the depth is the same but for the camera's half pixel, which --set puts back.
#[test]
fn aris_scenes_come_back_but_for_what_is_told() {
    let desk = Desk::new("");
    let mut files = Vec::new();
    for (i, (name, bound)) in [("cbox", 0.3), ("cbox_balls", 0.3), ("cbox_copper", 0.3), ("cbox_diffuse", 0.3)].into_iter().enumerate() {
        let source = shipped(&format!("aris/config/scene/{name}.yaml"));
        let run = convert(&desk, &source, "out");
        run.says("pixel_offset").says("mirrored").says("single-sided");
        let offset = ["--set", "camera.pixel_offset=[-0.5, -0.5]", "--diffuse", "lambert"];
        let before = render(&desk, &source, "before.exr", &["--diffuse", "lambert"]);
        let after = render(&desk, "out/scene.glb", "after.exr", &offset);
        let found = difference(&[before, after]);
        eprintln!("{name}: {found}");
        assert!(found < bound, "{name}: {found}");
        let file = desk.path(&format!("{i}.glb"));
        std::fs::copy(desk.path("out/scene.glb"), &file).unwrap();
        files.push(file);
    }
    assert_valid(&files);
}
