//! `pipeline bench`: files, figures, and references that are kept.

use crate::support::{Desk, repository};

const MEASURE: [&str; 9] =
    ["bench", "--levels", "16,4", "--seeds", "3", "--reference", "512", "--height", "24"];

#[test]
fn a_scene_is_measured_against_its_own_long_render_which_is_kept() {
    let desk = Desk::new("");
    let scene = repository("scenes/cornell.obj").to_str().expect("UTF-8").to_owned();
    let arguments = || MEASURE.into_iter().chain([scene.as_str(), "-o", "results"]);
    desk.run(arguments()).ends_with(0).says("scene").says("cornell").tells("results/error.png");
    let names = desk.names("results");
    let references: Vec<&String> = names.iter().filter(|name| name.starts_with("reference-")).collect();
    assert_eq!((names.len(), references.len()), (5, 1), "{names:?}");
    let runs = String::from_utf8(desk.bytes("results/runs.csv")).unwrap();
    let rows: Vec<Vec<&str>> = runs.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.iter().map(|row| row[1]).collect::<Vec<_>>(), ["4", "4", "4", "16", "16", "16"]);
    let error = |row: &Vec<&str>| row[5].parse::<f64>().unwrap();
    assert!(rows[..3].iter().map(error).sum::<f64>() > 2.0 * rows[3..].iter().map(error).sum::<f64>());

    let summary: serde_json::Value = serde_json::from_slice(&desk.bytes("results/summary.json")).unwrap();
    let (one, bias) = (&summary[0]["summary"], &summary[0]["summary"]["bias"]);
    assert_eq!(summary[0]["size"], serde_json::json!([32, 24]));
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    assert!(number(&one["work"]) > 0.0 && number(&one["seconds_to_goal"]) > 0.0);
    // The seeds are fixed, so this holds always or never.
    assert!(number(&bias["value"]).abs() < number(&bias["half_width"]), "{bias}");
    let svg = String::from_utf8(desk.bytes("results/error.svg")).unwrap();
    assert!(svg.starts_with("<svg xmlns") && svg.trim_end().ends_with("</svg>"));

    // The reference is read the next time, and the errors are the same to the digit.
    let kept = desk.bytes(&format!("results/{}", references[0]));
    let before: Vec<f64> = rows.iter().map(error).collect();
    desk.run(arguments()).ends_with(0);
    assert!(desk.bytes(&format!("results/{}", references[0])) == kept);
    let again = String::from_utf8(desk.bytes("results/runs.csv")).unwrap();
    let again: Vec<f64> = again.lines().skip(1).map(|l| error(&l.split(',').collect::<Vec<_>>())).collect();
    assert_eq!(before, again);
}

#[test]
fn a_manifests_jobs_are_measured_one_by_one() {
    let desk = Desk::with_three_jobs("");
    let run = desk
        .run(["bench", "sweep.toml", "--levels", "4", "--seeds", "1", "--reference", "16", "-o", "b"])
        .ends_with(0);
    let rows: Vec<&str> = run.stdout.lines().skip(1).collect();
    assert_eq!(rows.len(), 3);
    for (row, name) in rows.iter().zip(["roughness=0.10", "roughness=0.50", "roughness=0.90"]) {
        assert!(row.starts_with(name), "{row}");
        // One level has no slope, one seed no interval.
        assert!(row.contains(" - ") && !row.contains('±'), "{row}");
    }
}

#[test]
fn a_damaged_reference_is_told_and_not_used() {
    let desk = Desk::with_three_jobs("");
    let arguments = ["bench", "sweep.toml", "--levels", "4", "--seeds", "1", "--reference", "16", "-o", "b"];
    desk.run(arguments).ends_with(0);
    let name = desk.names("b").into_iter().find(|name| name.starts_with("reference-")).expect("a reference");
    std::fs::write(desk.path(&format!("b/{name}")), b"no picture").unwrap();
    desk.run(arguments).ends_with(2).tells(&name);
}
