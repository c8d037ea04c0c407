//! `pipeline bench`: files, figures, and references that are kept; what techniques are worth; and rays a second.

use crate::support::{Desk, SQUARE, repository, run};

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

/// `pipeline bench rays` of few rays, twice each.
fn rays(desk: &Desk, scene: &str, more: &[&str]) -> crate::support::Run {
    let few = ["bench", "rays", scene, "--width", "40", "--height", "24", "--repetitions", "2"];
    desk.run(few.iter().chain(more))
}

#[test]
fn rays_a_second_are_printed_as_json_for_each_kind_of_ray() {
    let scene = repository("scenes/spheres.glb").to_str().expect("UTF-8").to_owned();
    let printed = rays(&Desk::new(""), &scene, &["--threads", "2", "--kernel", "portable"])
        .ends_with(0)
        .tells("million/s");
    let report: serde_json::Value = serde_json::from_str(&printed.stdout).expect("JSON and nothing else");
    assert_eq!(report["scene"], scene);
    assert_eq!(report["triangles"], 604);
    assert_eq!(report["size"], serde_json::json!([40, 24]));
    assert_eq!(report["kernels"], serde_json::json!(["portable"]));
    assert_eq!((&report["threads"], &report["repetitions"]), (&2.into(), &2.into()));
    assert!((40.0..400.0).contains(&report["bytes_per_triangle"].as_f64().unwrap()));
    assert!(report["build_seconds"].as_f64().unwrap() > 0.0);
    let sets = report["sets"].as_array().expect("sets");
    let names: Vec<&str> = sets.iter().map(|set| set["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["camera", "bounce 1", "bounce 2", "shadow"]);
    assert_eq!(sets[0]["rays"], 40 * 24);
    // Each bounce starts where a ray of the one before has hit.
    for (set, next) in sets.iter().zip(&sets[1..3]) {
        let hits = set["hits"].as_f64().unwrap() * set["rays"].as_f64().unwrap();
        assert!((hits - next["rays"].as_f64().unwrap()).abs() < 1e-6, "{set} {next}");
    }
    for set in sets {
        let rates = set["rates"].as_array().expect("rates");
        let all =
            rates.iter().map(|rate| (rate["query"].as_str().unwrap(), rate["threads"].as_u64().unwrap()));
        let closest = [("closest", 1), ("closest", 2)].into_iter().filter(|_| set["name"] != "shadow");
        assert!(all.eq(closest.chain([("any", 1), ("any", 2)])), "{rates:?}");
        for rate in rates {
            assert!(rate["kernel"] == "portable", "{rate}");
            assert!(rate["million_rays_per_second"].as_f64().unwrap() > 0.0, "{rate}");
        }
    }
}

/// The rays depend on nothing but the scene and the view.
#[test]
fn rays_are_the_same_for_any_number_of_threads_and_follow_the_view() {
    let desk = Desk::new("");
    let scene = repository("scenes/cornell.obj").to_str().expect("UTF-8").to_owned();
    let counts = |more: &[&str]| {
        let printed = rays(&desk, &scene, more).ends_with(0).stdout;
        let report: serde_json::Value = serde_json::from_str(&printed).expect("JSON");
        let sets = report["sets"].as_array().expect("sets").clone();
        sets.iter().map(|set| (set["rays"].as_u64(), set["hits"].as_f64())).collect::<Vec<_>>()
    };
    let framed = counts(&["--threads", "1"]);
    assert_eq!(framed, counts(&["--threads", "3"]));
    // From inside the box there is a wall wherever one looks, but behind.
    let inside = counts(&["--camera", "0,1,0.9", "--target", "0,1,-1", "--fov", "30"]);
    assert!(framed[0].1 < Some(0.9) && inside[0].1 == Some(1.0), "{framed:?} {inside:?}");
}

#[test]
fn rays_need_a_scene_and_a_view_of_it() {
    let desk = Desk::new("");
    std::fs::write(desk.path("square.obj"), SQUARE).unwrap();
    std::fs::write(desk.path("points.obj"), "v 0 0 0\nv 1 0 0\n").unwrap();
    let away = ["--camera", "0,0,5", "--target", "0,0,9"];
    let told = rays(&desk, "square.obj", &away).ends_with(2).tells("no ray of the camera meets a surface");
    assert!(told.stdout.is_empty());
    rays(&desk, "points.obj", &[]).ends_with(2).tells("points.obj has no face with an area");
    rays(&desk, "missing.obj", &[]).ends_with(2).tells("missing.obj");
    rays(&desk, "square.obj", &["--fov", "190"]).ends_with(2).tells("camera.fov");
    for wrong in ["1,2", "1,2,three", "1,2,inf", "1,2,3,4", ""] {
        rays(&desk, "square.obj", &["--camera", wrong]).ends_with(64).tells("three numbers are expected");
    }
    rays(&desk, "square.obj", &["--kernel", "neon"]).ends_with(64).tells("portable");
    run(["bench", "rays"]).ends_with(64);
    run(["bench"]).ends_with(64);
    run(["bench", "rays", "--help"]).ends_with(0).says("Example").says("pipeline bench rays ");
    run(["bench", "--help"]).ends_with(0).says("Example").says("pipeline bench ");
}

#[test]
fn what_each_technique_is_worth_is_a_table_of_ratios_and_a_chart() {
    let desk = Desk::with_three_jobs("");
    let scene = repository("scenes/cornell.obj").to_str().expect("UTF-8").to_owned();
    let few =
        ["bench", "--ablate", "--levels", "4,8", "--seeds", "1", "--reference", "256", "--height", "18"];
    let run = desk.run(few.into_iter().chain([scene.as_str(), "sweep.toml", "-o", "b"])).ends_with(0);
    let run = run.says("what it does").says("same bits").tells("b/ablation.png");
    for file in ["ablation.csv", "ablation.png", "ablation.svg"] {
        assert!(desk.names("b").iter().any(|name| name == file), "{file}");
    }
    assert!(desk.bytes("b/ablation.svg").starts_with(b"<svg xmlns"));
    let csv = String::from_utf8(desk.bytes("b/ablation.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let heads = ["scene", "variant", "what_it_does", "error_ratio", "time_ratio", "work_ratio", "same_bits"];
    assert!(reader.headers().unwrap().iter().eq(heads));
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    for scene in ["cornell", "roughness=0.10", "roughness=0.50", "roughness=0.90"] {
        let row = |variant: &str| {
            let found = rows.iter().find(|row| row[0] == *scene && row[1] == *variant);
            found.unwrap_or_else(|| panic!("{scene}: no {variant}"))
        };
        let ratio = |variant: &str, column: usize| row(variant)[column].parse::<f64>().expect("a number");
        for saving in ["whole, again", "no constants", "no coverage", "useless light"] {
            assert_eq!((&row(saving)[6], ratio(saving, 3)), ("yes", 1.0), "{scene}: {saving}");
        }
        for technique in ["no nee", "random numbers", "2 replicates", "4 replicates", "8 replicates"] {
            assert_eq!(&row(technique)[6], "no", "{scene}: {technique}");
        }
        assert!(rows.iter().all(|row| &row[1] != "1 replicate"), "that is what the whole renderer has");
        assert!(ratio("no nee", 3) > 2.0, "{scene}");
        for row in &rows {
            let [error, time, work] = [3, 4, 5].map(|column| row[column].parse::<f64>().expect("a number"));
            assert!(time > 0.0 && (work - error * time).abs() <= 1e-9 * work, "{row:?}");
        }
    }
    assert_eq!(run.stdout.lines().count(), rows.len() + 1);
}
