//! The same job gives the same bits: with any number of threads, alone or in a sweep, in one part or several.

use crate::support::{Desk, SMALL, SMALL_ARGUMENTS, read, repository, same_pixels};

#[test]
fn one_thread_and_two_write_the_same_bytes() {
    let one = Desk::with_three_jobs("");
    let two = Desk::with_three_jobs("");
    one.sweep(&["--threads", "1"]).ends_with(0);
    two.sweep(&["--threads", "2"]).ends_with(0);
    assert_eq!(one.images().len(), 3);
    assert!(one.image_bytes() == two.image_bytes());
    assert!(one.bytes("results/sheet.exr") == two.bytes("results/sheet.exr"));
    assert!(one.bytes("results/sheet.png") == two.bytes("results/sheet.png"));
}

#[test]
fn a_job_alone_has_the_pixels_it_has_in_a_sweep() {
    let desk = Desk::with_three_jobs("");
    desk.sweep(&[]).ends_with(0);
    let scene = repository("scenes/spheres.glb");
    for (value, job) in [("0.1", "roughness=0.10"), ("0.9", "roughness=0.90")] {
        let set = format!("material.metallic.roughness={value}");
        let output = desk.path("alone.exr");
        let arguments = ["render", scene.to_str().unwrap(), "-o", output.to_str().unwrap(), "--set", &set];
        desk.run(arguments.iter().chain(&SMALL_ARGUMENTS)).ends_with(0);
        let inside = desk.raster(&format!("results/{job}.exr"));
        assert!(same_pixels(&read(&output), &inside), "{job}");
    }
    let (first, last) = (desk.raster("results/roughness=0.10.exr"), desk.raster("alone.exr"));
    assert!(!same_pixels(&first, &last), "the comparison sees differences");
}

#[test]
fn jobs_rendered_together_write_the_bytes_that_they_write_one_by_one() {
    let together = Desk::with_three_jobs("");
    let alone = Desk::with_three_jobs("");
    together.sweep(&[]).ends_with(0);
    alone.sweep(&["--together", "1"]).ends_with(0);
    assert_eq!(together.images().len(), 3);
    assert!(together.image_bytes() == alone.image_bytes());
    assert!(is_shared(&together, "roughness=0.10") && !is_shared(&alone, "roughness=0.10"));
}

fn is_shared(desk: &Desk, job: &str) -> bool {
    desk.record(job).skipped.iter().any(|skip| skip.contains("% of the rays"))
}

/// The job in the middle glows, so that its lights are its own: those before and after it are still rendered together.
#[test]
fn jobs_that_can_be_rendered_together_wait_for_each_other() {
    let scene = repository("scenes/spheres.glb");
    let desk = Desk::new(&format!(
        r#"scene = '{}'
        [[axis]]
        zip = ["material.metallic.roughness", "material.metallic.emission_color"]
        values = [[0.1, [0, 0, 0]], [0.5, [1, 1, 1]], [0.9, [0, 0, 0]]]
        labels = ["a", "b", "c"]
        {SMALL}"#,
        scene.display()
    ));
    desk.sweep(&[]).ends_with(0);
    let names: Vec<String> = desk.images().iter().map(|n| n.trim_end_matches(".exr").to_owned()).collect();
    let shared: Vec<bool> = names.iter().map(|name| is_shared(&desk, name)).collect();
    assert_eq!(shared, [true, false, true], "{names:?}");
}

#[test]
fn shards_split_the_jobs_and_come_together_to_the_whole() {
    let whole = Desk::with_three_jobs("");
    whole.sweep(&[]).ends_with(0);
    let parts = Desk::with_three_jobs("");
    let first = parts.sweep(&["--shard", "1/2"]).ends_with(0);
    let done = parts.images();
    let second = parts.sweep(&["--shard", "2/2"]).ends_with(0);
    let count = |text: &str| -> usize {
        let line = text.lines().last().expect("a last line");
        assert!(line.contains(" 0 reused"), "{line}");
        line.split(' ').next().and_then(|n| n.parse().ok()).expect("a count")
    };
    assert_eq!(count(&first.stdout), done.len());
    assert_eq!(count(&first.stdout) + count(&second.stdout), 3);
    assert!(parts.image_bytes() == whole.image_bytes());
    assert!(parts.bytes("results/sheet.exr") == whole.bytes("results/sheet.exr"), "the last shard shows all");
    parts.sweep(&[]).ends_with(0).says("0 rendered, 3 reused");
}

#[test]
fn another_seed_gives_another_picture() {
    let desk = Desk::with_three_jobs("");
    desk.sweep(&[]).ends_with(0);
    let before = desk.image_bytes();
    desk.rewrite(&crate::support::three_jobs("[0.1, 0.5, 0.9]", "seed = 7\n"));
    desk.sweep(&[]).ends_with(0);
    assert!(desk.image_bytes().iter().all(|(name, bytes)| before[name] != *bytes));
}
