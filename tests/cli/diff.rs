//! `pipeline diff`.

use pipeline::imagefile;
use pipeline::raster::{Layer, Raster, Window};

use crate::support::{Desk, Run};

/// A grey picture of 4 × 3 pixels whose value at (2, 1) is `value`.
fn grey(value: f32) -> Raster {
    let plane = || {
        let mut values = vec![0.5; 12];
        values[6] = value;
        values
    };
    let window = Window::sized(4, 3);
    Raster::single(Layer::new("", window).with("R", plane()).with("G", plane()).with("B", plane()))
}

fn desk() -> Desk {
    let desk = Desk::with_three_jobs("");
    let write = |name: &str, raster: &Raster| imagefile::write_exr(&desk.path(name), raster).unwrap();
    write("a.exr", &grey(0.5));
    write("b.exr", &grey(0.75));
    write("nan.exr", &grey(f32::NAN));
    let window = Window::sized(5, 3);
    let plane = || vec![0.5; 15];
    write(
        "wide.exr",
        &Raster::single(Layer::new("", window).with("R", plane()).with("G", plane()).with("B", plane())),
    );
    std::fs::write(desk.path("text.exr"), "no image").unwrap();
    desk
}

fn diff(desk: &Desk, arguments: &str) -> Run {
    desk.run(["diff"].into_iter().chain(arguments.split(' ')))
}

#[test]
fn strict_ends_with_0_1_or_2_and_tells_why() {
    let desk = desk();
    let same = diff(&desk, "a.exr a.exr").ends_with(0);
    assert!(same.stdout.ends_with("\n\nsame\n"), "{}", same.stdout);
    diff(&desk, "a.exr b.exr")
        .ends_with(1)
        .says("DIFFERS: picture: 1 of 12 pixels")
        .says("(2, 1)")
        .says("2.500e-1");
    diff(&desk, "a.exr b.exr --fail 0.3").ends_with(0).says("within limits");
    diff(&desk, "a.exr b.exr --allowfailures 1").ends_with(0);
    diff(&desk, "a.exr b.exr --failpercent 8").ends_with(1);
    diff(&desk, "a.exr b.exr --failpercent 9").ends_with(0);
    diff(&desk, "a.exr b.exr --fail 0.3 --hardfail 0.2").ends_with(1);
    diff(&desk, "a.exr b.exr --fail 0.3 --mean 0.001").ends_with(1);
    diff(&desk, "a.exr wide.exr").ends_with(1).says("SHAPE DIFFERS");
    diff(&desk, "a.exr nan.exr --fail 10").ends_with(1);
    diff(&desk, "nan.exr nan.exr").ends_with(1);
    diff(&desk, "a.exr b.exr --fail nan").ends_with(2).tells("error: ");
}

#[test]
fn what_cannot_be_read_is_2_and_named() {
    let desk = desk();
    diff(&desk, "a.exr none.exr").ends_with(2).tells("error: cannot read none.exr");
    diff(&desk, "none.exr a.exr").ends_with(2).tells("none.exr");
    diff(&desk, "a.exr text.exr").ends_with(2).tells("text.exr");
    diff(&desk, "a.exr .").ends_with(2).tells("error: ");
}

#[test]
fn idiff_mode_has_idiff_s_codes_and_text() {
    let desk = desk();
    let same = diff(&desk, "--mode idiff a.exr a.exr").ends_with(0);
    assert_eq!(same.stdout, "Comparing \"a.exr\" and \"a.exr\"\nPASS\n");
    let failure = diff(&desk, "--mode idiff a.exr b.exr").ends_with(2);
    let lines: Vec<&str> = failure.stdout.lines().collect();
    assert_eq!(lines[0], "Comparing \"a.exr\" and \"b.exr\"");
    assert!(lines[1].starts_with("  Mean error = "));
    assert!(lines[4].starts_with("  Max error  = 0.25 @ (2, 1, R)"), "{}", failure.stdout);
    assert_eq!(lines.last(), Some(&"FAILURE"));
    diff(&desk, "--mode idiff --failpercent 50 a.exr b.exr").ends_with(1).says("WARNING\n");
    diff(&desk, "--mode idiff --failpercent 50 --warnpercent 50 a.exr b.exr").ends_with(0).says("PASS\n");
    let quiet = diff(&desk, "--mode idiff -q a.exr b.exr").ends_with(2);
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", "FAILURE\n"));
    diff(&desk, "--mode idiff a.exr none.exr").ends_with(4).tells("idiff ERROR: ").tells("none.exr");
    diff(&desk, "--mode idiff text.exr a.exr").ends_with(4).tells("text.exr");
}

#[test]
fn a_picture_of_the_differences_is_written_and_scaled() {
    let desk = desk();
    diff(&desk, "a.exr b.exr -o d.exr --scale 2").ends_with(1);
    let raster = desk.raster("d.exr");
    let [r, _, _] = raster.picture().rgb().unwrap();
    let expected: Vec<f32> = (0..12).map(|i| if i == 6 { 0.5 } else { 0.0 }).collect();
    assert_eq!(r, expected);
    diff(&desk, "a.exr b.exr -o d.png --scale 4").ends_with(1);
    let raster = desk.raster("d.png");
    let [r, _, _] = raster.picture().rgb().unwrap();
    assert!(r[6] == 1.0 && r.iter().sum::<f32>() == 1.0, "{r:?}");
    diff(&desk, "a.exr b.exr -o no/folder/d.png").ends_with(2).tells("no/folder/d.png");
}

#[test]
fn a_cross_check_without_idiff_is_an_error() {
    let desk = desk();
    let output = assert_cmd::Command::new(crate::support::PROGRAM)
        .current_dir(desk.path("."))
        .env("PATH", "")
        .env_remove("PIPELINE_IDIFF")
        .args(["diff", "a.exr", "b.exr", "--cross-check"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("there is no idiff on PATH"));
    if crate::outside::outside("PIPELINE_IDIFF").is_some() {
        diff(&desk, "a.exr b.exr --cross-check").ends_with(1);
    }
}
