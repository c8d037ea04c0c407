//! The built-in comparator against the real `idiff`, on random pairs of images: equal text, equal exit code.
//!
//! The environment's `PIPELINE_IDIFF` names OpenImageIO 3.2's `idiff`; without it the test is left out.
//! `PIPELINE_IDIFF_CASES` changes the number of pairs.

#[path = "common/outside.rs"]
mod outside;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use image::{ExtendedColorType, ImageEncoder};
use outside::outside;
use pipeline::compare::external::run_idiff;
use pipeline::compare::idiff::idiff;
use pipeline::compare::{Options, Parts, Thresholds, Verbosity};
use pipeline::imagefile;
use pipeline::math::Real;
use pipeline::math::hash::mix64;
use pipeline::raster::{Channel, Layer, Raster, SampleType, Window};

const CASES: u64 = 1000;

/// Random numbers of one case.
struct Dice(u64);

impl Dice {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix64(self.0)
    }

    /// In [0, n).
    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    /// In [0, 1).
    fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn chance(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u64) as usize].clone()
    }
}

const CHANNELS: [&str; 12] = [
    "R G B",
    "R G B",
    "R G B A",
    "Y",
    "Z",
    "Y A",
    "R G B Z samples",
    "albedo.R albedo.G albedo.B normal.X normal.Y normal.Z Z variance.R variance.G variance.B",
    "X Y Z",
    "a-x.R a.R AR b.Depth b.Z b.A",
    "R",
    "alpha blue green real imag",
];

fn value(dice: &mut Dice, style: u64) -> f32 {
    match style {
        0 => dice.unit(),
        1 => (dice.unit() - 0.5) * 4.0,
        2 => Real::powf(2.0_f32, dice.unit() * 60.0 - 30.0) * if dice.chance(0.3) { -1.0 } else { 1.0 },
        3 => dice.pick(&[0.0, -0.0, 0.5, 1.0, 1e-6, 1e7, 3e38, -3e38, 1e-40, 65504.0]),
        _ => (dice.unit() * 8.0).floor() / 8.0,
    }
}

fn bad(dice: &mut Dice) -> f32 {
    dice.pick(&[f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY])
}

fn window(dice: &mut Dice) -> Window {
    let most = if dice.chance(0.08) { 110 } else { 40 };
    let (width, height) = (1 + dice.below(most) as u32, 1 + dice.below(most) as u32);
    let offset = |dice: &mut Dice| if dice.chance(0.6) { 0 } else { dice.below(30) as i32 - 15 };
    Window { x: offset(dice), y: offset(dice), width, height }
}

fn layer(dice: &mut Dice, name: &str) -> Layer {
    let mut layer = Layer::new(name, window(dice));
    let style = dice.below(5);
    let bad_share = if dice.chance(0.25) { dice.pick(&[0.002, 0.05, 0.5, 1.0]) } else { 0.0 };
    let half = dice.chance(0.3);
    for name in dice.pick(&CHANNELS).split(' ') {
        let whole = name == "samples" && dice.chance(0.5);
        let values = (0..layer.window.pixels())
            .map(|_| match () {
                () if whole => dice.below(4096) as f32,
                () if dice.chance(bad_share) => bad(dice),
                () => value(dice, style),
            })
            .collect();
        let stored_as = match () {
            () if whole => SampleType::U32,
            () if half => SampleType::F16,
            () => SampleType::F32,
        };
        layer.channels.push(Channel { name: name.into(), stored_as, values });
    }
    layer
}

/// The other image's layer: like the first, changed a little, or something else altogether.
fn partner(dice: &mut Dice, layer: &Layer) -> Layer {
    if dice.chance(0.12) {
        return self::layer(dice, &layer.name);
    }
    let mut other = layer.clone();
    if dice.chance(0.1) && other.channels.len() > 1 {
        other.channels.pop();
    }
    if dice.chance(0.1) {
        other.window.x += dice.below(5) as i32 - 2;
    }
    let share = dice.pick(&[0.0, 0.002, 0.02, 0.3, 1.0]);
    let size = dice.pick(&[1e-7, 1e-6, 1e-3, 0.1, 10.0]);
    let bad_share = if dice.chance(0.15) { 0.01 } else { 0.0 };
    for channel in &mut other.channels {
        if channel.stored_as == SampleType::U32 {
            continue;
        }
        for value in &mut channel.values {
            if dice.chance(share) {
                *value += (dice.unit() - 0.5) * size;
            }
            if dice.chance(bad_share) {
                *value = bad(dice);
            }
        }
    }
    other
}

fn thresholds(dice: &mut Dice) -> Thresholds {
    let mut thresholds = Thresholds::default();
    let size = [0.0, 1e-7, 1e-6, 5e-4, 0.05, 0.5, 1.0, 3.5, 1e30, f32::INFINITY, 0.1];
    let percent = [0.0, 0.01, 1.0, 10.0, 50.0, 99.9, 100.0, 250.0];
    let Thresholds {
        fail,
        failpercent,
        failrelative,
        hardfail,
        warn,
        warnpercent,
        warnrelative,
        hardwarn,
        ..
    } = &mut thresholds;
    for (threshold, choices) in [
        (fail, &size[..]),
        (warn, &size),
        (hardfail, &size),
        (hardwarn, &size),
        (failrelative, &size),
        (warnrelative, &size),
        (failpercent, &percent),
        (warnpercent, &percent),
    ] {
        if dice.chance(0.35) {
            *threshold = dice.pick(choices);
        }
    }
    if dice.chance(0.2) {
        thresholds.allowfailures = dice.pick(&[1, 2, 10, 1000]);
    }
    thresholds
}

fn raster(layers: Vec<Layer>) -> Raster {
    Raster { display: Window::sized(20, 20), layers }
}

/// A PNG of grey, grey and alpha, RGB or RGBA with 8 or 16 bits, and one that differs in some bytes.
fn png_pair(dice: &mut Dice) -> [Vec<u8>; 2] {
    use ExtendedColorType::{L8, L16, La8, La16, Rgb8, Rgb16, Rgba8, Rgba16};
    let (color, bytes) =
        dice.pick(&[(L8, 1), (La8, 2), (Rgb8, 3), (Rgba8, 4), (L16, 2), (La16, 4), (Rgb16, 6), (Rgba16, 8)]);
    let (width, height) = (1 + dice.below(40) as u32, 1 + dice.below(40) as u32);
    let pixels: Vec<u8> = (0..width * height * bytes).map(|_| dice.bits() as u8).collect();
    let share = dice.pick(&[0.0, 0.01, 1.0]);
    let changed: Vec<u8> =
        pixels.iter().map(|&v| if dice.chance(share) { dice.bits() as u8 } else { v }).collect();
    [pixels, changed].map(|pixels| {
        let mut file = Vec::new();
        image::codecs::png::PngEncoder::new(&mut file).write_image(&pixels, width, height, color).unwrap();
        file
    })
}

/// Writes the pair of a case.
fn write_pair(dice: &mut Dice, folder: &Path, case: u64) -> [PathBuf; 2] {
    if dice.chance(0.1) {
        let paths = ["a", "b"].map(|name| folder.join(format!("{case}{name}.png")));
        for (path, file) in paths.iter().zip(png_pair(dice)) {
            imagefile::write_whole(path, &file).unwrap();
        }
        return paths;
    }
    let parts = if dice.chance(0.2) { 2 + dice.below(2) } else { 1 };
    let a: Vec<Layer> = (0..parts).map(|i| layer(dice, &format!("part{i}"))).collect();
    let mut b: Vec<Layer> = a.iter().map(|layer| partner(dice, layer)).collect();
    if dice.chance(0.2) && b.len() > 1 {
        b.pop();
    }
    let (mut a, mut b) = (raster(a), raster(b));
    if dice.chance(0.5) {
        std::mem::swap(&mut a, &mut b);
    }
    let paths = ["a", "b"].map(|name| folder.join(format!("{case}{name}.exr")));
    for (path, raster) in paths.iter().zip([a, b]) {
        imagefile::write_exr(path, &raster).unwrap();
    }
    paths
}

/// Runs one case; what differs, if anything.
fn run_case(program: &Path, folder: &Path, case: u64) -> Option<String> {
    let mut dice = Dice(mix64(case));
    let [a, b] = write_pair(&mut dice, folder, case);
    let thresholds = thresholds(&mut dice);
    let options = Options {
        parts: if dice.chance(0.3) { Parts::All } else { Parts::First },
        verbosity: dice.pick(&[Verbosity::Normal, Verbosity::Normal, Verbosity::Verbose, Verbosity::Quiet]),
    };
    let names = [&a, &b].map(|path| path.display().to_string());
    let (raster_a, raster_b) = (imagefile::read(&a).unwrap(), imagefile::read(&b).unwrap());
    let ours = idiff([&names[0], &names[1]], &raster_a, &raster_b, &thresholds, options).unwrap();
    let theirs = run_idiff(program, &a, &b, &thresholds, options, Duration::from_secs(60)).unwrap();
    let equal = ours.stdout == theirs.stdout
        && ours.stderr == theirs.stderr
        && theirs.exit_code == Some(ours.verdict.exit_code());
    if equal {
        for path in [&a, &b] {
            std::fs::remove_file(path).unwrap();
        }
        return None;
    }
    Some(format!(
        "case {case}: {thresholds:?} {options:?}\nours ({}):\n{}{}theirs ({:?}):\n{}{}",
        ours.verdict.exit_code(),
        ours.stdout,
        ours.stderr,
        theirs.exit_code,
        theirs.stdout,
        theirs.stderr
    ))
}

#[test]
fn text_and_exit_code_equal_the_real_idiffs_on_random_pairs() {
    let Some(program) = outside("PIPELINE_IDIFF") else { return };
    let cases =
        std::env::var("PIPELINE_IDIFF_CASES").map_or(CASES, |n| n.parse().expect("a number of cases"));
    let folder = tempfile::tempdir().unwrap();
    let (next, differences) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let case = next.fetch_add(1, Ordering::Relaxed);
                    if case >= cases {
                        break;
                    }
                    if let Some(difference) = run_case(&program, folder.path(), case) {
                        differences.lock().unwrap().push((case, difference));
                    }
                }
            });
        }
    });
    let mut differences = differences.into_inner().unwrap();
    differences.sort();
    let shown: Vec<String> = differences.iter().take(5).map(|(_, text)| text.clone()).collect();
    assert!(differences.is_empty(), "{} of {cases} cases differ:\n{}", differences.len(), shown.join("\n"));
}
