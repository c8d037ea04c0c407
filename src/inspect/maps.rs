//! f·cos θ and the density of sampling over the sphere of directions.

use super::energy::Energy;
use super::measure::direction;
use crate::math::V3;

/// Cells around the normal, 3° wide; each is 2° high.
pub(super) const COLUMNS: usize = 120;
/// Points of a cell along each side.
const POINTS: usize = 4;

/// Means over cells, row by row from the normal on; azimuth 0 is away from the viewer, in the middle of a row.
#[derive(Clone, Debug)]
pub(super) struct Map {
    /// The angle of incidence in degrees.
    pub(super) angle: f64,
    /// 45 to the horizon, 90 where something goes below it.
    pub(super) rows: usize,
    /// f·|cos θ| by energy, in 1/sr.
    pub(super) wanted: Vec<f64>,
    /// In 1/sr.
    pub(super) density: Vec<f64>,
}

impl Map {
    /// The map of what is seen from `angle`; `below` tells whether anything goes below the surface.
    pub(super) fn new(energy: &Energy<'_>, angle: f64, below: bool) -> Self {
        let rows = if below { 90 } else { 45 };
        let mut wanted = vec![0.0; COLUMNS * rows];
        let mut density = wanted.clone();
        let count = (POINTS * POINTS) as f64;
        for (at, (wanted, density)) in wanted.iter_mut().zip(&mut density).enumerate() {
            for point in 0..POINTS * POINTS {
                let inside = |i: usize| (i as f64 + 0.5) / POINTS as f64;
                let azimuth = ((at % COLUMNS) as f64 + inside(point % POINTS)) * 3.0 - 180.0;
                let theta = ((at / COLUMNS) as f64 + inside(point / POINTS)) * 2.0;
                let (f, pdf) = energy.value_and_density(around(theta, azimuth));
                *wanted += f.luminance() / count;
                *density += pdf / count;
            }
        }
        // A highlight may be narrower than the points are apart.
        let row = ((angle / 2.0) as usize).min(rows - 1);
        let columns = if angle == 0.0 { 0..COLUMNS } else { COLUMNS / 2 - 1..COLUMNS / 2 + 1 };
        let (f, pdf) = energy.value_and_density(direction(angle));
        for at in columns.map(|column| row * COLUMNS + column) {
            wanted[at] = wanted[at].max(f.luminance());
            density[at] = density[at].max(pdf);
        }
        Self { angle, rows, wanted, density }
    }
}

/// The direction at `theta` from the normal and `azimuth` from the tangent, in degrees.
fn around(theta: f64, azimuth: f64) -> V3<f32> {
    let (theta, azimuth) = (theta.to_radians(), azimuth.to_radians());
    let r = libm::sin(theta);
    V3::new(r * libm::cos(azimuth), r * libm::sin(azimuth), libm::cos(theta)).cast()
}
