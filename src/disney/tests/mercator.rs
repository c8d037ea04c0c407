//! Quadrature over the sphere in Mercator's coordinates about an axis.
//!
//! With s = ln tan(θ/2) the coordinates are conformal, dω = ds dφ/cosh² s, and a peak around the axis looks alike whatever its width. So
//! one grid of cells serves lobes of any roughness.

use crate::math::{Real, V3};

/// The grid's extent in s; what is nearer to the axis or its opposite has no weight.
const S: [f64; 2] = [-15.0, 5.0];
const ROWS: usize = 40;
const COLUMNS: usize = 16;
/// Cells of the grid.
pub(super) const CELLS: usize = ROWS * COLUMNS;

/// The grid about an axis.
pub(super) struct Mercator {
    x: V3<f64>,
    y: V3<f64>,
    z: V3<f64>,
}

impl Mercator {
    /// About the direction in which `wo` is mirrored by the surface, where the peaks are.
    pub(super) fn about_mirror_direction(wo: V3<f64>) -> Self {
        let z = V3::new(-wo.x, -wo.y, wo.z);
        let aside = if z.x.abs() < 0.5 { V3::new(1.0, 0.0, 0.0) } else { V3::new(0.0, 1.0, 0.0) };
        let x = aside.cross(z).normalize();
        Self { x, y: z.cross(x), z }
    }

    /// The cell that holds a direction; what is outside the extent counts to the nearest.
    pub(super) fn cell(&self, w: V3<f64>) -> usize {
        let (x, y, z) = (w.dot(self.x), w.dot(self.y), w.dot(self.z));
        // tan(θ/2) = sin θ/(1 + cos θ).
        let s = Real::ln(((x * x + y * y).sqrt() / (1.0 + z).max(1e-12)).max(1e-12));
        let phi = Real::atan2(y, x) / (2.0 * f64::PI) + 0.5;
        let row = ((s - S[0]) / (S[1] - S[0]) * ROWS as f64).clamp(0.0, ROWS as f64 - 1.0) as usize;
        let column = (phi * COLUMNS as f64).clamp(0.0, COLUMNS as f64 - 1.0) as usize;
        row * COLUMNS + column
    }

    /// ∫ f dω over a cell to about `tolerance`, by midpoint rules that double until two agree.
    pub(super) fn integrate(&self, cell: usize, tolerance: f64, f: &impl Fn(V3<f64>) -> f64) -> f64 {
        let mut before = f64::INFINITY;
        for n in [8, 16, 32, 64, 128] {
            let now = self.midpoint_rule(cell, n, f);
            if (now - before).abs() < tolerance {
                return now;
            }
            before = now;
        }
        before
    }

    fn midpoint_rule(&self, cell: usize, n: usize, f: &impl Fn(V3<f64>) -> f64) -> f64 {
        let ds = (S[1] - S[0]) / (ROWS * n) as f64;
        let dphi = 2.0 * f64::PI / (COLUMNS * n) as f64;
        let (row, column) = (cell / COLUMNS, cell % COLUMNS);
        let around: Vec<V3<f64>> = (0..n)
            .map(|j| {
                let phi = -f64::PI + ((column * n + j) as f64 + 0.5) * dphi;
                self.x * Real::cos(phi) + self.y * Real::sin(phi)
            })
            .collect();
        let mut sum = 0.0;
        for i in 0..n {
            let e = Real::exp(S[0] + ((row * n + i) as f64 + 0.5) * ds);
            // sin θ = 1/cosh s, cos θ = -tanh s.
            let sin = 2.0 * e / (1.0 + e * e);
            let cos = (1.0 - e * e) / (1.0 + e * e);
            for &across in &around {
                let w = across * sin + self.z * cos;
                sum += f(w) * sin * sin;
            }
        }
        sum * ds * dphi
    }

    /// ∫ f dω over the sphere.
    pub(super) fn total(&self, tolerance: f64, f: &impl Fn(V3<f64>) -> f64) -> f64 {
        (0..CELLS).map(|cell| self.integrate(cell, tolerance, f)).sum()
    }
}

#[test]
fn the_sphere_has_four_pi_and_cells_hold_their_directions() {
    let grid = Mercator::about_mirror_direction(V3::new(0.6, 0.0, 0.8));
    let area = grid.total(1e-9, &|_| 1.0);
    assert!((area - 4.0 * f64::PI).abs() < 1e-3, "{area}");
    for cell in 0..CELLS {
        let inside = grid.integrate(cell, 1.0, &|w| f64::from(u8::from(grid.cell(w) == cell)));
        assert_eq!(inside, grid.integrate(cell, 1.0, &|_| 1.0));
    }
}
