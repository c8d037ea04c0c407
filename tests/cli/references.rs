//! Exit codes of a sweep with references, and accepting results as references.

use pipeline::imagefile;
use pipeline::record::{CrossCheck, Verdict};

use crate::outside::outside;
use crate::support::Desk;

const COMPARE: &str = "[compare]\nreferences = \"references\"\n";
const JOB: &str = "roughness=0.50";

/// Three jobs whose results are their references.
fn accepted() -> Desk {
    let desk = Desk::with_three_jobs(COMPARE);
    desk.sweep(&[]).ends_with(2);
    desk.run(["accept", "sweep.toml", "--all"]).ends_with(0);
    desk
}

/// Adds `by` to the first red value of a job's reference.
fn edit_reference(desk: &Desk, by: f32) {
    let path = format!("references/{JOB}.exr");
    let mut raster = desk.raster(&path);
    let red = raster.layers[0].channels.iter_mut().find(|c| c.name == "R").expect("R");
    red.values[0] += by;
    imagefile::write_exr(&desk.path(&path), &raster).unwrap();
}

#[test]
fn missing_references_are_errors_that_name_the_files() {
    let desk = Desk::with_three_jobs(COMPARE);
    let run = desk.sweep(&[]).ends_with(2).says("3 without a reference\n");
    for job in ["roughness=0.10", JOB, "roughness=0.90"] {
        let line = run.stdout.lines().find(|l| l.starts_with(&format!("{job}: NO REFERENCE: ")));
        assert!(line.is_some_and(|l| l.ends_with(&format!("{job}.exr"))), "{}", run.stdout);
    }
    assert_eq!(desk.images().len(), 3, "the results are there all the same");
}

#[test]
fn accepted_results_are_the_same_and_are_not_rendered_again() {
    let desk = Desk::with_three_jobs(COMPARE);
    desk.sweep(&[]).ends_with(2);
    desk.run(["accept", "sweep.toml", "--all"])
        .ends_with(0)
        .says("new  roughness=0.10\n")
        .tells("3 references accepted");
    assert_eq!(desk.names("references"), ["roughness=0.10.exr", "roughness=0.50.exr", "roughness=0.90.exr"]);
    let images = desk.image_bytes();
    desk.sweep(&[]).ends_with(0).says("3 jobs: 0 rendered, 3 reused, 3 same\n");
    assert!(desk.image_bytes() == images);
    assert_eq!(desk.record(JOB).verdict, Verdict::Same);
    desk.sweep(&["--force"]).ends_with(0).says("3 jobs: 3 rendered, 0 reused, 3 same\n");
    desk.run(["accept", "sweep.toml", JOB]).ends_with(0).says("+0.000%  roughness=0.50\n");
}

#[test]
fn one_name_accepts_one_job_and_wrong_ones_accept_nothing() {
    let desk = Desk::with_three_jobs(COMPARE);
    desk.run(["accept", "sweep.toml", "--all"]).ends_with(2).tells("run the sweep first");
    desk.sweep(&[]).ends_with(2);
    desk.run(["accept", "sweep.toml", JOB, "roughness=0.51"]).ends_with(2).tells("no job \"roughness=0.51\"");
    assert!(desk.names("references").is_empty());
    desk.run(["accept", "sweep.toml", JOB]).ends_with(0);
    assert_eq!(desk.names("references"), ["roughness=0.50.exr"]);
    desk.sweep(&[]).ends_with(2).says("3 reused, 1 same, 2 without a reference\n");
    Desk::with_three_jobs("").run(["accept", "sweep.toml", "--all"]).ends_with(2).tells("[compare]");
}

#[test]
fn a_difference_is_1_and_limits_may_allow_it() {
    let desk = accepted();
    edit_reference(&desk, 0.01);
    desk.sweep(&[])
        .ends_with(1)
        .says("2 same, 1 DIFFER\n")
        .says("roughness=0.50: DIFFERS: picture: 1 of 432 pixels");
    assert!(matches!(desk.record(JOB).verdict, Verdict::Differs { .. }));
    let manifest = String::from_utf8(desk.bytes("sweep.toml")).unwrap();
    std::fs::write(desk.path("sweep.toml"), manifest + "fail = 0.02\n").unwrap();
    desk.sweep(&[]).ends_with(0).says("3 reused, 2 same, 1 within limits\n");
}

#[test]
fn an_error_beats_a_difference() {
    let desk = accepted();
    edit_reference(&desk, 0.01);
    std::fs::remove_file(desk.path("references/roughness=0.90.exr")).unwrap();
    desk.sweep(&[]).ends_with(2).says("1 same, 1 DIFFER, 1 without a reference\n");
}

#[test]
fn references_of_another_shape_or_with_infinities_differ_and_damaged_ones_are_errors() {
    let desk = accepted();
    edit_reference(&desk, f32::INFINITY);
    desk.sweep(&[]).ends_with(1).says("roughness=0.50: DIFFERS: ");

    let larger = ["--width", "26", "--height", "18", "--spp", "4", "-q"];
    let scene = crate::support::repository("scenes/spheres.glb");
    let scene = scene.to_str().unwrap();
    desk.run(["render", scene, "-o", "references/roughness=0.50.exr"].iter().chain(&larger)).ends_with(0);
    desk.sweep(&[]).ends_with(1).says("roughness=0.50: SHAPE DIFFERS: ");

    std::fs::write(desk.path("references/roughness=0.50.exr"), "no image").unwrap();
    desk.sweep(&[]).ends_with(2).says("roughness=0.50: ERROR: ").says("1 not comparable\n");
}

#[test]
fn an_idiff_that_is_asked_for_must_be_there() {
    let desk = Desk::with_three_jobs(COMPARE);
    desk.sweep(&["--idiff", "no/such/idiff"]).ends_with(2).tells("no/such/idiff");
    assert!(desk.images().is_empty(), "nothing is rendered first");
}

#[cfg(unix)]
#[test]
fn an_idiff_that_disagrees_is_an_error() {
    use std::os::unix::fs::PermissionsExt;
    let desk = accepted();
    let program = desk.path("idiff");
    std::fs::write(&program, "#!/bin/sh\necho FAILURE\nexit 2\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    desk.sweep(&["--idiff", "./idiff"]).ends_with(2).says("3 not comparable\n").says("disagree");
}

#[test]
fn the_real_idiff_agrees() {
    let Some(program) = outside("PIPELINE_IDIFF") else { return };
    let desk = accepted();
    edit_reference(&desk, 0.01);
    desk.sweep(&["--idiff", program.to_str().unwrap()]).ends_with(1).says("2 same, 1 DIFFER\n");
    assert_eq!(desk.record(JOB).cross_check, CrossCheck::Agrees);
}
