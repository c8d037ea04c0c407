//! What the races of trees share: their scenes, ready to be looked at, and their clock.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use pipeline::accel::Ray;
use pipeline::convert::ConvertOptions;
use pipeline::import::ImportOptions;
use pipeline::job::load;
use pipeline::render::Prepared;
use pipeline::scene::Camera;
use pipeline::settings::RenderSettings;

/// How often each takes its turn.
pub(crate) const ROUNDS: usize = 7;
/// Columns and rows of the picture whose rays are shot.
const SIZE: (u32, u32) = (640, 480);

/// A scene ready to be rendered with its own or a fitting view; the corpus's kitchen is looked at from inside.
pub(crate) fn prepared(path: &Path) -> Result<Prepared, Box<dyn std::error::Error>> {
    let loaded = load(path, &ImportOptions::default(), &ConvertOptions::default(), None)?;
    let mut scene = (*loaded.scene).clone();
    if let Some((low, high)) = scene.bounds().filter(|_| path.ends_with("kitchen.obj.zst")) {
        let eye = low + (high - low) * Vec3::new(0.7, 0.55, 0.8);
        scene.cameras[0].item = Camera::look_at(eye, low.midpoint(high), Vec3::Y, 0.9);
    }
    let (width, height) = SIZE;
    let settings = RenderSettings { width: Some(width), height: Some(height), ..RenderSettings::default() };
    Ok(Prepared::new(Arc::new(scene), loaded.geometry, &settings)?)
}

/// What `work` gives, and the seconds it takes.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = black_box(work());
    (start.elapsed().as_secs_f64(), result)
}

/// Seconds and number of hits of each of three ways to tell of `rays` whether they hit, which take turns.
pub(crate) fn in_turns(
    rays: &[Ray],
    a: impl Fn(&Ray) -> bool,
    b: impl Fn(&Ray) -> bool,
    c: impl Fn(&Ray) -> bool,
) -> [(f64, usize); 3] {
    let mut runs = [const { Vec::new() }; 3];
    for _ in 0..ROUNDS {
        runs[0].push(timed(|| rays.iter().filter(|ray| a(ray)).count()));
        runs[1].push(timed(|| rays.iter().filter(|ray| b(ray)).count()));
        runs[2].push(timed(|| rays.iter().filter(|ray| c(ray)).count()));
    }
    runs.map(middle)
}

/// The run of median time.
pub(crate) fn middle<T>(mut runs: Vec<(f64, T)>) -> (f64, T) {
    runs.sort_by(|a, b| a.0.total_cmp(&b.0));
    runs.swap_remove(runs.len() / 2)
}
