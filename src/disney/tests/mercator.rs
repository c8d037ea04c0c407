//! Quadrature over the sphere in Mercator's coordinates about an axis.
//!
//! With s = ln tan(θ/2) the coordinates are conformal, dω = ds dφ/cosh² s, and a peak around the axis looks alike whatever its width. So
//! one grid of cells serves lobes of any roughness.

use crate::disney::dielectric::refracted;
use crate::disney::fresnel::dielectric_split;
use crate::math::{Real, V3};

/// The grid's extent in s; what is nearer to the axis or its opposite has no weight.
const S: [f64; 2] = [-15.0, 5.0];
const ROWS: usize = 40;
const COLUMNS: usize = 16;
/// Cells of the grid.
const CELLS: usize = ROWS * COLUMNS;

/// Cells of the whole sphere: a grid for each side of the surface, about that side's peak.
pub(super) const SPHERE_CELLS: usize = 2 * CELLS;

/// The grid about an axis.
struct Mercator {
    x: V3<f64>,
    y: V3<f64>,
    z: V3<f64>,
}

impl Mercator {
    fn about(z: V3<f64>) -> Self {
        let aside = if z.x.abs() < 0.5 { V3::new(1.0, 0.0, 0.0) } else { V3::new(0.0, 1.0, 0.0) };
        let x = aside.cross(z).normalize();
        Self { x, y: z.cross(x), z }
    }

    /// The cell that holds a direction; what is outside the extent counts to the nearest.
    fn cell(&self, w: V3<f64>) -> usize {
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
}

/// The directions on `wo`'s side of a surface about the mirror direction, and those on the other about the refracted one.
pub(super) struct Sphere {
    reflected: Mercator,
    transmitted: Mercator,
    is_above: bool,
}

impl Sphere {
    /// `ior` is the index inside over outside: 1 for light that isn't bent.
    pub(super) fn new(wo: V3<f64>, ior: f64) -> Self {
        let eta = if wo.z > 0.0 { ior } else { 1.0 / ior };
        let split = dielectric_split(wo.z.abs(), eta);
        // Under total reflection the facets that transmit lean far, and light comes out along the surface.
        let refracted = refracted(wo, split.cos_t, eta).normalize();
        Self {
            reflected: Mercator::about(V3::new(-wo.x, -wo.y, wo.z)),
            transmitted: Mercator::about(refracted),
            is_above: wo.z > 0.0,
        }
    }

    /// The cell that holds a direction.
    pub(super) fn cell(&self, w: V3<f64>) -> usize {
        if self.is_reflected(w) { self.reflected.cell(w) } else { CELLS + self.transmitted.cell(w) }
    }

    fn is_reflected(&self, w: V3<f64>) -> bool {
        (w.z > 0.0) == self.is_above
    }

    /// ∫ f dω over a cell.
    pub(super) fn integrate(&self, cell: usize, tolerance: f64, f: &impl Fn(V3<f64>) -> f64) -> f64 {
        let only = |side: bool| move |w: V3<f64>| if self.is_reflected(w) == side { f(w) } else { 0.0 };
        if cell < CELLS {
            self.reflected.integrate(cell, tolerance, &only(true))
        } else {
            self.transmitted.integrate(cell - CELLS, tolerance, &only(false))
        }
    }

    /// ∫ f dω.
    pub(super) fn total(&self, tolerance: f64, f: &impl Fn(V3<f64>) -> f64) -> f64 {
        (0..SPHERE_CELLS).map(|cell| self.integrate(cell, tolerance, f)).sum()
    }
}

#[test]
fn the_sphere_has_four_pi_and_cells_hold_their_directions() {
    for wo in [V3::new(0.6, 0.0, 0.8), V3::new(0.6, 0.0, -0.8)] {
        let sphere = Sphere::new(wo, 1.5);
        let area = sphere.total(1e-9, &|_| 1.0);
        assert!((area - 4.0 * f64::PI).abs() < 2e-2, "{area}");
        for cell in 0..SPHERE_CELLS {
            let inside = sphere.integrate(cell, 1.0, &|w| f64::from(u8::from(sphere.cell(w) == cell)));
            assert_eq!(inside, sphere.integrate(cell, 1.0, &|_| 1.0));
        }
    }
}
