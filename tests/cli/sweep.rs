//! A sweep's files, its table, and what a second run does again.

use crate::support::{Desk, SMALL, SQUARE, leftovers, three_jobs};

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
