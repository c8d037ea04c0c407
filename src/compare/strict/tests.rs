//! Each rule of the strict mode.

use super::*;

fn flat(value: f32) -> Raster {
    let plane = vec![value; 100];
    let window = Window::sized(10, 10);
    let beauty = Layer::new("beauty", window)
        .with("R", plane.clone())
        .with("G", plane.clone())
        .with("B", plane.clone());
    let data = Layer::new("data", window).with("Z", plane.clone()).with("albedo.R", plane);
    Raster { display: window, layers: vec![beauty, data] }
}

fn verdict(a: &Raster, b: &Raster, limits: &StrictLimits) -> Verdict {
    compare(a, b, limits).unwrap().verdict()
}

#[test]
fn equal_pixels_are_the_same_whatever_the_channels_order_and_attributes() {
    let (a, mut b) = (flat(0.5), flat(0.5));
    b.layers[0].channels.reverse();
    b.layers[0].attributes.push(("build".into(), crate::raster::Attribute::Int(2)));
    assert_eq!(verdict(&a, &b, &StrictLimits::default()), Verdict::Same);
}

#[test]
fn a_difference_beyond_the_limit_says_where_and_what() {
    let (mut a, b) = (flat(0.5), flat(0.5));
    a.layers[0].channels[1].values[23] = 0.625;
    let Verdict::Differs { max_error, mean_error, why } = verdict(&a, &b, &StrictLimits::default()) else {
        panic!("should differ")
    };
    assert_eq!((max_error, mean_error), (0.125, 0.125 / 300.0));
    assert!(why.contains("picture: 1 of 100 pixels") && why.contains("(3, 2) G: 0.625 against 0.5"), "{why}");
}

#[test]
fn a_percentage_or_a_number_of_pixels_may_be_over() {
    let (mut a, b) = (flat(0.5), flat(0.5));
    for i in 0..3 {
        a.layers[0].channels[0].values[i] = 2.0;
    }
    let with = |fail_percent, allow_failures| StrictLimits {
        picture: Limits { fail_percent, allow_failures, ..Limits::default() },
        ..StrictLimits::default()
    };
    assert!(verdict(&a, &b, &with(3.0, 0)).passes());
    assert!(verdict(&a, &b, &with(0.0, 3)).passes());
    assert!(!verdict(&a, &b, &with(2.9, 2)).passes());
}

#[test]
fn hard_limit_mean_and_rms_hold_although_no_pixel_is_over() {
    let (a, b) = (flat(0.5), flat(0.25));
    let lenient = Limits { fail: 1.0, ..Limits::default() };
    let judged = |picture| verdict(&a, &b, &StrictLimits { picture, ..StrictLimits::default() });
    assert_eq!(judged(lenient), Verdict::Within { max_error: 0.25, mean_error: 0.25 });
    assert!(!judged(Limits { hard_fail: 0.2, ..lenient }).passes());
    assert!(!judged(Limits { mean: 0.2, ..lenient }).passes());
    assert!(!judged(Limits { rms: 0.2, ..lenient }).passes());
    assert!(judged(Limits { rms: 0.25, mean: 0.25, hard_fail: 0.25, ..lenient }).passes());
}

#[test]
fn values_that_are_not_finite_fail_even_where_both_images_have_them_and_in_any_layer() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (mut a, mut b) = (flat(0.5), flat(0.5));
        a.layers[1].channels[0].values[7] = bad;
        b.layers[1].channels[0].values[7] = bad;
        let comparison = compare(&a, &b, &StrictLimits::default()).unwrap();
        let Verdict::Differs { max_error, why, .. } = comparison.verdict() else { panic!("should differ") };
        assert!(max_error.is_finite());
        assert!(why.contains("Z: 1 values are not finite, the first at (7, 0) Z"), "{why}");
    }
}

#[test]
fn layers_are_measured_but_only_judged_by_limits_of_their_own() {
    let (mut a, b) = (flat(0.5), flat(0.5));
    a.layers[1].channels[1].values[0] = 0.75;
    let comparison = compare(&a, &b, &StrictLimits::default()).unwrap();
    assert_eq!(comparison.verdict(), Verdict::Within { max_error: 0.0, mean_error: 0.0 });
    let albedo = comparison.groups.iter().find(|g| g.group == "albedo").unwrap();
    assert_eq!((albedo.statistics.max_error, albedo.statistics.over), (0.25, 1));
    let layers = BTreeMap::from([("albedo".to_owned(), Limits { fail: 0.2, ..Limits::default() })]);
    assert!(!verdict(&a, &b, &StrictLimits { layers, ..StrictLimits::default() }).passes());
}

#[test]
fn shapes_that_differ_are_named_and_nothing_is_measured() {
    let why = |change: fn(&mut Raster)| {
        let mut b = flat(0.5);
        change(&mut b);
        let Verdict::Shape { why } = verdict(&flat(0.5), &b, &StrictLimits::default()) else {
            panic!("the shape should differ")
        };
        why
    };
    assert!(why(|b| b.display.width = 11).contains("the display window is 10 × 10 in the first, 11 × 10"));
    assert!(why(|b| b.layers[0].window.x = -1).contains("data window of part 0 \"beauty\""));
    assert!(
        why(|b| b.layers[0].channels[2].name = "A".into()).contains("channels B G R in the first, A G R")
    );
    assert!(why(|b| drop(b.layers.pop())).contains("2 parts in the first, 1 in the second"));
    assert!(why(|b| b.layers[1].name = "other".into()).contains("\"data\" in the first, \"other\""));
}

#[test]
fn the_relative_limit_spares_bright_pixels() {
    let limits = StrictLimits {
        picture: Limits { fail: 0.01, fail_relative: 0.1, ..Limits::default() },
        ..StrictLimits::default()
    };
    assert!(verdict(&flat(100.0), &flat(105.0), &limits).passes());
    assert!(!verdict(&flat(100.0), &flat(120.0), &limits).passes());
    assert!(!verdict(&flat(0.02), &flat(0.04), &limits).passes());
}

#[test]
fn broken_input_is_an_error() {
    let mut short = flat(0.5);
    short.layers[0].channels[0].values.pop();
    assert!(matches!(
        compare(&short, &flat(0.5), &StrictLimits::default()),
        Err(CompareError::Channel { .. })
    ));
    let empty = Raster { display: Window::sized(1, 1), layers: vec![] };
    assert!(matches!(
        compare(&flat(0.5), &empty, &StrictLimits::default()),
        Err(CompareError::NoLayers { .. })
    ));
    let nan =
        StrictLimits { picture: Limits { rms: f32::NAN, ..Limits::default() }, ..StrictLimits::default() };
    assert!(matches!(compare(&flat(0.5), &flat(0.5), &nan), Err(CompareError::Threshold { name: "rms" })));
}
