//! Each rule by hand; `tests/idiff_conformance.rs` holds them against the real `idiff`.

use super::*;
use crate::raster::{Layer, Window};

const NAN: f32 = f32::NAN;
const INF: f32 = f32::INFINITY;

/// A row of grey pixels.
fn row(values: &[f32]) -> Raster {
    Raster::single(Layer::new("", Window::sized(values.len() as u32, 1)).with("Y", values.to_vec()))
}

fn run(a: &Raster, b: &Raster, thresholds: &Thresholds) -> IdiffReport {
    idiff(["a.exr", "b.exr"], a, b, thresholds, Options::default()).unwrap()
}

fn verdict(a: &[f32], b: &[f32], thresholds: Thresholds) -> IdiffVerdict {
    run(&row(a), &row(b), &thresholds).verdict
}

#[test]
fn the_text_is_idiffs() {
    let mut a = Layer::new("", Window::sized(10, 10));
    for name in ["B", "G", "R"] {
        a = a.with(name, vec![0.5; 100]);
    }
    let mut b = a.clone();
    b.channels[1].values[23] = 0.6;
    let report = run(&Raster::single(a), &Raster::single(b), &Thresholds::default());
    let expected = "\
Comparing \"a.exr\" and \"b.exr\"
  Mean error = 0.000333333
  RMS error = 0.0057735
  Peak SNR = 44.7712
  Max error  = 0.1 @ (3, 2, G)  values are 0.5, 0.5, 0.5 vs 0.5, 0.6, 0.5
  1 pixels (1%) over 1e-06
  1 pixels (1%) over 1e-06
FAILURE
";
    assert_eq!(report.stdout, expected);
    assert_eq!(report.verdict.exit_code(), 2);
}

#[test]
fn equal_images_pass_with_two_lines() {
    let report = run(&row(&[0.25]), &row(&[0.25]), &Thresholds::default());
    assert_eq!(report.stdout, "Comparing \"a.exr\" and \"b.exr\"\nPASS\n");
    let verbose = Options { verbosity: Verbosity::Verbose, ..Options::default() };
    let report = idiff(["a", "b"], &row(&[0.25]), &row(&[0.25]), &Thresholds::default(), verbose).unwrap();
    assert!(report.stdout.contains("  Peak SNR = inf\n  Max error  = 0\n"), "{}", report.stdout);
}

#[test]
fn the_holes_are_kept() {
    let plain = Thresholds::default();
    assert_eq!(verdict(&[NAN; 3], &[0.5; 3], plain), IdiffVerdict::Pass);
    assert_eq!(verdict(&[INF], &[0.5], plain), IdiffVerdict::Pass, "the first is recorded, not counted");
    assert_eq!(verdict(&[INF; 2], &[0.5; 2], plain), IdiffVerdict::Failure, "infinity over infinity is NaN");
    assert_eq!(verdict(&[NAN; 3], &[-NAN; 3], plain), IdiffVerdict::Pass);
    assert_eq!(verdict(&[INF; 3], &[-INF; 3], plain), IdiffVerdict::Pass);
}

#[test]
fn thresholds_are_strict_and_the_hard_ones_need_a_failing_pixel() {
    let with = |change: fn(&mut Thresholds)| {
        let mut thresholds = Thresholds::default();
        change(&mut thresholds);
        verdict(&[0.0, 0.0, 0.0, 0.0], &[0.5, 0.0, 0.0, 0.0], thresholds)
    };
    assert_eq!(with(|t| t.fail = 0.5), IdiffVerdict::Pass);
    assert_eq!(with(|t| t.fail = 0.499), IdiffVerdict::Failure);
    assert_eq!(with(|t| t.failpercent = 25.0), IdiffVerdict::Warning);
    assert_eq!(with(|t| (t.failpercent, t.warnpercent) = (25.0, 25.0)), IdiffVerdict::Pass);
    assert_eq!(
        with(|t| (t.failpercent, t.warnpercent, t.hardwarn) = (25.0, 25.0, 0.4)),
        IdiffVerdict::Warning
    );
    assert_eq!(with(|t| (t.failpercent, t.hardfail) = (25.0, 0.4)), IdiffVerdict::Failure);
    assert_eq!(with(|t| (t.fail, t.hardfail) = (1.0, 0.1)), IdiffVerdict::Pass, "no pixel fails");
    assert_eq!(with(|t| (t.allowfailures, t.hardfail) = (1, 0.1)), IdiffVerdict::Pass);
    assert_eq!(with(|t| t.failrelative = 2.0), IdiffVerdict::Pass, "0.5 is twice the mean of 0 and 0.5");
    assert_eq!(with(|t| t.failrelative = 1.9), IdiffVerdict::Failure);
}

#[test]
fn windows_are_joined_and_what_is_missing_is_zero() {
    let a = Raster::single(Layer::new("", Window::sized(1, 1)).with("R", vec![0.5]));
    let b = Raster::single(
        Layer::new("", Window { x: 1, y: 0, width: 1, height: 1 }).with("R", vec![0.0]).with("G", vec![0.25]),
    );
    let report = run(&a, &b, &Thresholds::default());
    assert!(
        report.stdout.contains("Max error  = 0.5 @ (0, 0, R)  values are 0.5 vs 0, 0\n"),
        "{}",
        report.stdout
    );
    // Two pixels fail of image A's one.
    assert!(report.stdout.contains("  2 pixels (200%) over 1e-06\n"), "{}", report.stdout);
}

#[test]
fn channels_match_by_their_place_in_open_image_ios_order() {
    let a = Layer::new("", Window::sized(1, 1)).with("A", vec![1.0]).with("R", vec![0.5]);
    let b = Layer::new("", Window::sized(1, 1)).with("G", vec![0.5]).with("Z", vec![1.0]);
    let report = run(&Raster::single(a), &Raster::single(b), &Thresholds::default());
    assert_eq!(report.verdict, IdiffVerdict::Pass);
}

#[test]
fn parts_are_compared_one_by_one_with_all_and_their_number_counts() {
    let part = |name: &str, value| Layer::new(name, Window::sized(1, 1)).with("Y", vec![value]);
    let file = |values: &[f32]| Raster {
        display: Window::sized(1, 1),
        layers: values.iter().enumerate().map(|(i, &v)| part(&format!("p{i}"), v)).collect(),
    };
    let all = Options { parts: Parts::All, ..Options::default() };
    let check = |a: &[f32], b: &[f32], options| {
        idiff(["a", "b"], &file(a), &file(b), &Thresholds::default(), options).unwrap()
    };
    assert_eq!(check(&[1.0, 2.0], &[1.0, 3.0], Options::default()).verdict, IdiffVerdict::Pass);
    let report = check(&[1.0, 2.0], &[1.0, 3.0], all);
    assert_eq!(report.verdict, IdiffVerdict::Failure);
    assert!(report.stdout.contains("Subimage 1 : 1 x 1, 1 channels\n"), "{}", report.stdout);
    let report = check(&[1.0], &[1.0, 3.0], all);
    assert_eq!(report.stderr, "Images had differing numbers of subimages (1 vs 2)\n");
    assert_eq!(report.verdict, IdiffVerdict::Failure);
    let quiet = Options { verbosity: Verbosity::Quiet, ..all };
    let report = check(&[1.0, 2.0], &[1.0, 3.0], quiet);
    assert_eq!((report.stdout.as_str(), report.stderr.as_str()), ("", "FAILURE\n"));
}

#[test]
fn a_threshold_that_is_no_number_is_an_error() {
    let thresholds = Thresholds { warn: NAN, ..Thresholds::default() };
    let result = idiff(["a", "b"], &row(&[0.0]), &row(&[0.0]), &thresholds, Options::default());
    assert!(matches!(result, Err(CompareError::Threshold { name: "warn" })));
}
