//! `pipeline inspect`.

use std::path::{Path, PathBuf};

use crate::outside::outside;
use crate::support::{PROGRAM, Run, repository, run, run_in};

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

/// A library whose names are awkward for files and pages.
const LIBRARY: &str = "gold: {color: [1.0, 0.77, 0.34], metallic: 1, roughness: 0.3, specularTint: 0.5}\n\"<b>&\\\"steel/../é\": {metallic: 1, anisotropic: 0.9}\nglass: {model: dielectric, ior: 1.5}\n";

/// The smallest sphere that shows something.
const SMALL: [&str; 4] = ["--size", "16", "--spp", "2"];

/// Runs `pipeline inspect` in `folder` with results in `out`.
fn inspect(folder: &Path, arguments: &[&str]) -> Run {
    run_in(folder, ["inspect", "-o", "out"].iter().chain(&SMALL).chain(arguments))
}

fn page(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("out/index.html")).expect("a page")
}

/// The value of every attribute called `name`.
fn attributes<'a>(page: &'a str, name: &str) -> Vec<&'a str> {
    let start = format!(" {name}=\"");
    page.split(&start).skip(1).map(|rest| rest.split('"').next().unwrap()).collect()
}

#[test]
fn the_page_is_self_contained_and_every_picture_is_there() {
    let folder = tempfile::tempdir().unwrap();
    file(folder.path(), "metals.yaml", LIBRARY);
    let run = inspect(folder.path(), &["metals.yaml"]).ends_with(0);
    let files: Vec<&str> = run.stdout.lines().collect();
    assert_eq!(files.len(), 1 + 3 * 4 + 1, "{files:?}");
    assert!(files[0].ends_with("index.html") && files[13].ends_with("comparison.png"));
    for what in ["sphere", "polar", "albedo", "density"] {
        for name in ["gold", "_b___steel_.._é", "glass"] {
            let path = Path::new("out").join(format!("{what}_{name}.png"));
            assert!(files.contains(&path.to_str().unwrap()), "{path:?} in {files:?}");
            let raster = pipeline::imagefile::read(&folder.path().join(path)).unwrap();
            let [r, _, _] = raster.picture().rgb().unwrap();
            let (low, high) = r.iter().fold((1.0f32, 0.0f32), |(l, h), &v| (l.min(v), h.max(v)));
            assert!(high - low > 0.1, "something is to be seen");
        }
    }
    let page = page(folder.path());
    for foreign in ["http:", "https:", "//", "<script", "url(", "@import", "<link", "NaN"] {
        // Base64 may hold two slashes.
        let text: String =
            page.split("data:image/png;base64,").map(|p| p.split_once('"').map_or(p, |x| x.1)).collect();
        assert!(!text.contains(foreign), "{foreign}");
    }
    assert!(attributes(&page, "src").iter().all(|s| s.starts_with("data:image/png;base64,")));
    assert!(attributes(&page, "href").iter().all(|s| s.starts_with('#')));
    assert!(!page.contains("<b>") && page.contains("&lt;b&gt;"), "names are escaped");
    for text in ["specular_tint", "0.5", "delta transmission", "F0", "α along the tangent", "Side by side"] {
        assert!(page.contains(text), "no {text}");
    }
}

#[test]
fn the_same_command_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let once = || {
        inspect(folder.path(), &["-p", "roughness=0.2", "-p", "clearcoat=1"]).ends_with(0);
        let names = ["index.html", "sphere_default.png", "polar_default.png", "density_default.png"];
        names.map(|name| std::fs::read(folder.path().join("out").join(name)).unwrap())
    };
    assert!(once() == once());
    assert!(
        !folder.path().join("out/comparison.png").exists(),
        "one material has nothing to be compared with"
    );
}

#[test]
fn a_material_of_a_scene_is_edited_and_its_figures_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    let target = format!("{}#ball", repository("scenes/shaderball.glb").display());
    let run = inspect(
        folder.path(),
        &[&target, "-p", "metallic=1", "-p", "roughness=0.1,0.4", "--g", "remapped", "--json"],
    );
    let figures: serde_json::Value = serde_json::from_str(&run.ends_with(0).stdout).unwrap();
    let materials = figures.as_array().unwrap();
    assert_eq!(materials.len(), 2);
    for (material, roughness) in materials.iter().zip(["0.1", "0.4"]) {
        assert_eq!(material["name"], format!("ball roughness={roughness}"));
        assert_eq!(material["parameters"]["roughness"], roughness);
        assert_eq!(material["parameters"]["metallic"], "1");
        assert_eq!(material["parameters"]["masking"], "remapped");
        assert_eq!(material["lobes"], serde_json::json!(["specular"]));
        for view in material["views"].as_array().unwrap() {
            let figure = |name: &str| view[name].as_f64().unwrap();
            let (sampled, quadrature) = (figure("albedo"), figure("albedo_by_quadrature"));
            assert!(
                (sampled - quadrature).abs() < 4.0 * figure("standard_error") + 0.004 * quadrature,
                "{view}"
            );
        }
    }
    assert!(page(folder.path()).contains("ball roughness=0.4"));
}

#[test]
fn what_is_unknown_or_out_of_range_is_told_with_what_is_near() {
    let folder = tempfile::tempdir().unwrap();
    file(folder.path(), "metals.yaml", LIBRARY);
    file(folder.path(), "slip.yaml", "gold:\n  rougness: 0.3\n");
    let scene = repository("scenes/shaderball.glb");
    let bal = format!("{}#bal", scene.display());
    for (arguments, error, hint) in [
        (vec!["-p", "rougness=0.3"], "a material has no field `rougness`", "did you mean `roughness`?"),
        (vec!["-p", "roughness=1.5"], "`roughness` is 1.5, but must be a number in [0, 1]", ""),
        (vec!["-p", "roughness"], "is not NAME=VALUE", ""),
        (vec!["metals.yaml#golt"], "metals.yaml has no material `golt`", "did you mean `gold`?"),
        (vec![bal.as_str()], "no material `bal`", "did you mean `ball`?"),
        (vec!["slip.yaml"], "slip.yaml:2:3: a material has no field `rougness`", "did you mean `roughness`?"),
        (vec!["none.glb"], "none.glb", ""),
        (vec!["none.yaml"], "none.yaml", ""),
        (vec!["rows.csv"], "no importer for this kind of file", ""),
    ] {
        let run = inspect(folder.path(), &arguments).ends_with(2).tells(error).tells_not("panicked");
        if !hint.is_empty() {
            run.tells(&format!("hint: {hint}"));
        }
    }
    assert!(!folder.path().join("out").exists(), "nothing is made in vain");
    run(["inspect", "--eval", "rows.csv", "-p", "roughness=0.3"]).ends_with(64);
}

#[test]
fn more_materials_than_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let many: String = (0..10).map(|i| format!("m{i}: {{roughness: 0.{i}}}\n")).collect();
    file(folder.path(), "many.yaml", &many);
    let run = inspect(folder.path(), &["many.yaml"]).ends_with(0);
    run.tells("8 materials are compared; 2 are left out: m8, m9");
    assert!(
        folder.path().join("out/sphere_m7.png").exists() && !folder.path().join("out/sphere_m8.png").exists()
    );
}
