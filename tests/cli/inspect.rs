//! `pipeline inspect`.

use std::path::{Path, PathBuf};

use crate::outside::outside;
use crate::support::{PROGRAM, run, run_in};

/// Our own golden rows, whose values stand in columns of other names.
const ROWS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/disney_brdf.csv");

fn columns(line: &str) -> Vec<&str> {
    line.split(',').collect()
}

/// Writes `text` to a file of its own.
fn file(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("the file is written");
    path
}

/// Our golden rows with the given values of one variant as fr, fg, fb.
fn golden(variant: &str) -> String {
    std::fs::read_to_string(ROWS)
        .unwrap()
        .replace(&format!("{variant}_r,{variant}_g,{variant}_b"), "fr,fg,fb")
}

/// The largest relative difference that the summary tells.
fn told_difference(stderr: &str) -> f64 {
    let (_, rest) = stderr.split_once("rows: ").unwrap_or_else(|| panic!("{stderr}"));
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn eval_gives_the_oracle_s_values() {
    let Some(folder) = outside("PIPELINE_ORACLE") else { return };
    for (name, g) in [("disney_brdf.csv", "matched"), ("disney_brdf_2012_g.csv", "remapped")] {
        let path = Path::new(&folder).join(name);
        let run = run(["inspect", "--eval", path.to_str().unwrap(), "--g", g]).ends_with(0);
        assert!(told_difference(&run.stderr) < 1e-4, "{}", run.stderr);
        let text = std::fs::read_to_string(path).unwrap();
        assert_eq!(run.stdout.lines().count(), text.lines().count());
        for (is, should) in run.stdout.lines().zip(text.lines()).skip(1) {
            let (is, should) = (columns(is), columns(should));
            assert_eq!(is[..19], should[..19], "inputs keep their text");
            for c in 19..22 {
                let (is, should): (f64, f64) = (is[c].parse().unwrap(), should[c].parse().unwrap());
                assert!((is - should).abs() <= 1e-4 * should, "{is} for {should}");
            }
        }
    }
}

#[test]
fn eval_has_both_maskings_and_all_diffuse_terms() {
    let folder = tempfile::tempdir().unwrap();
    for (g, diffuse) in [("matched", "burley"), ("remapped", "lambert"), ("matched", "lambert_fresnel")] {
        let rows = file(folder.path(), "rows.csv", &golden(&format!("{g}_{diffuse}")));
        let eval = ["inspect", "--eval", rows.to_str().unwrap(), "--g", g, "--diffuse", diffuse];
        let run = run(eval).ends_with(0).tells("600 rows; largest relative difference");
        assert!(told_difference(&run.stderr) < 1e-4, "{g} {diffuse}: {}", run.stderr);
    }
    let rows = file(folder.path(), "rows.csv", &golden("remapped_burley"));
    let run = run(["inspect", "--eval", rows.to_str().unwrap()]).ends_with(0);
    assert!(told_difference(&run.stderr) > 1e-2, "the wrong G is seen: {}", run.stderr);
}

#[test]
fn eval_reads_stdin_and_its_own_output() {
    let text = std::fs::read(ROWS).unwrap();
    let eval = |input: Vec<u8>| {
        let mut command = assert_cmd::Command::new(PROGRAM);
        let output = command.args(["inspect", "--quiet", "--eval", "-"]).write_stdin(input).output().unwrap();
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0));
        output.stdout
    };
    let once = eval(text);
    assert!(once.starts_with(b"base_color_r,") && once.len() > 600 * 100);
    assert_eq!(eval(once.clone()), once);
}

#[test]
fn eval_tells_every_bad_row_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let text = golden("matched_burley");
    let mut lines: Vec<String> = text.lines().take(5).map(str::to_owned).collect();
    let roughness = columns(&lines[0]).iter().position(|c| *c == "roughness").unwrap();
    let mut cells: Vec<String> = columns(&lines[2]).into_iter().map(str::to_owned).collect();
    cells[roughness] = "1.5".to_owned();
    lines[2] = cells.join(",");
    lines[4] = "1,2,3".to_owned();
    file(folder.path(), "rows.csv", &lines.join("\r\n"));
    let run = run_in(folder.path(), ["inspect", "--eval", "rows.csv"]).ends_with(2);
    let out: Vec<&str> = run.stdout.lines().collect();
    assert_eq!(out.len(), 5);
    assert_eq!(columns(out[2])[roughness], "1.5");
    assert!(out[2].ends_with(',') && !out[1].ends_with(',') && !out[3].ends_with(','));
    run.tells("rows.csv:3: column roughness is 1.5, but must be in [0, 1]")
        .tells("rows.csv:5: the row has 3 cells")
        .tells("4 rows, 2 of them could not be evaluated");
}

#[test]
fn eval_refuses_files_that_are_no_rows() {
    let folder = tempfile::tempdir().unwrap();
    file(folder.path(), "short.csv", "base_color_r,rougness\n1,2\n");
    file(folder.path(), "empty.csv", "");
    let eval = |name: &str| run_in(folder.path(), ["inspect", "--eval", name]).ends_with(2);
    let run = eval("short.csv").tells("`roughness` (is it `rougness`?)").tells("`vz`");
    assert!(run.stdout.is_empty());
    eval("empty.csv").tells("the file is empty");
    eval("none.csv").tells("none.csv");
    run_in(folder.path(), ["inspect", "--eval", "short.csv", "--g", "new"]).ends_with(64).tells("matched");
}
