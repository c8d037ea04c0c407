//! Maps from the unit square to shapes, each beside its pdf.

use super::{Number, Real, V3};

/// The unit disk, by Shirley and Chiu's concentric map (1997): area is preserved and neighbours stay neighbours.
/// The pdf is 1/π per unit area.
pub fn concentric_disk<F: Real>(u: [F; 2]) -> [F; 2] {
    let two = F::of(2.0);
    let (x, y) = (two * u[0] - F::ONE, two * u[1] - F::ONE);
    if x == F::ZERO && y == F::ZERO {
        return [F::ZERO, F::ZERO];
    }
    // The angle is π/4·y/x from the x axis in two of the square's quarters, π/4·x/y from the y axis in the others. Chosen without a
    // branch: the quarters are random.
    let along_x = x.abs() > y.abs();
    let (radius, across) = (F::select(along_x, x, y), F::select(along_x, y, x));
    let (sin, cos) = (F::of(0.5) * (across / radius)).sin_cos_quarter();
    let (near, far) = (radius * cos, radius * sin);
    [F::select(along_x, near, far), F::select(along_x, far, near)]
}

/// A direction of the upper hemisphere, by the cosine; its pdf is [`cosine_hemisphere_pdf`].
pub fn cosine_hemisphere<F: Real>(u: [F; 2]) -> V3<F> {
    let [x, y] = concentric_disk(u);
    V3::new(x, y, (F::ONE - x * x - y * y).safe_sqrt())
}

/// cos θ/π per unit solid angle, 0 below the horizon.
pub fn cosine_hemisphere_pdf<F: Number>(cos_theta: F) -> F {
    cos_theta.max(F::ZERO) * F::FRAC_1_PI
}

/// A direction of the upper hemisphere, uniform by solid angle; its pdf is [`uniform_hemisphere_pdf`].
/// The cosine is above 0 for every u in [0, 1).
pub fn uniform_hemisphere<F: Real>(u: [F; 2]) -> V3<F> {
    let z = F::ONE - u[0];
    let r = (u[0] * (F::ONE + z)).safe_sqrt();
    let (sin, cos) = u[1].sin_cos_turn();
    V3::new(r * cos, r * sin, z)
}

/// 1/2π per unit solid angle, above the horizon.
pub fn uniform_hemisphere_pdf<F: Number>() -> F {
    F::of(0.5) * F::FRAC_1_PI
}

/// A direction of the whole sphere; the pdf is 1/4π per unit solid angle.
pub fn uniform_sphere<F: Real>(u: [F; 2]) -> V3<F> {
    let z = F::ONE - F::of(2.0) * u[0];
    let r = (F::ONE - z * z).safe_sqrt();
    let (sin, cos) = u[1].sin_cos_turn();
    V3::new(r * cos, r * sin, z)
}

/// Barycentric coordinates (of the second and third vertex) of a point of a triangle, uniform by area, by Heitz' low-distortion
/// map (2019, "A Low-Distortion Map Between Triangle and Square"). The pdf is 1/area.
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    let (half_0, half_1) = (u[0] * 0.5, u[1] * 0.5);
    let is_above = u[1] > u[0];
    [Number::select(is_above, half_0, u[0] - half_1), Number::select(is_above, u[1] - half_0, half_1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: u32) -> impl Iterator<Item = [f64; 2]> {
        let at = move |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        (0..n * n).map(move |i| [at(i % n), at(i / n)])
    }

    #[test]
    fn disk_has_uniform_area() {
        // The mean of r² over a uniform disk is ½, of r⁴ is ⅓.
        let n = 512;
        let (mut r2, mut r4) = (0.0, 0.0);
        for u in grid(n) {
            let [x, y] = concentric_disk(u);
            let r = x * x + y * y;
            assert!(r <= 1.0 + 1e-12);
            r2 += r;
            r4 += r * r;
        }
        let count = f64::from(n * n);
        assert!((r2 / count - 0.5).abs() < 1e-4);
        assert!((r4 / count - 1.0 / 3.0).abs() < 1e-4);
    }

    #[test]
    fn cosine_hemisphere_has_its_pdf() {
        // E[1/pdf · cos/π] = 1 and E[cos] = 2/3 under cos/π.
        // The cosine falls as a square root at the rim, so the midpoint rule converges slowly.
        let n = 1024;
        let mean: f64 = grid(n).map(|u| cosine_hemisphere(u).z).sum::<f64>() / f64::from(n * n);
        assert!((mean - 2.0 / 3.0).abs() < 1e-4, "{mean}");
        assert!((cosine_hemisphere_pdf(1.0f64) - std::f64::consts::FRAC_1_PI).abs() < 1e-15);
    }

    #[test]
    fn uniform_hemisphere_has_its_pdf() {
        // The mean cosine is ½, and 1/(pdf·2π) = 1.
        let n = 256;
        let mean: f64 = grid(n).map(|u| uniform_hemisphere(u).z).sum::<f64>() / f64::from(n * n);
        assert!((mean - 0.5).abs() < 1e-12, "{mean}");
        assert!((uniform_hemisphere([0.3f64, 0.7]).length() - 1.0).abs() < 1e-15);
        assert!((uniform_hemisphere_pdf::<f64>() * 2.0 * std::f64::consts::PI - 1.0).abs() < 1e-15);
    }

    #[test]
    fn triangle_points_are_inside_and_centred() {
        let n = 256;
        let (mut s0, mut s1) = (0.0, 0.0);
        for u in grid(n) {
            let [b0, b1] = uniform_triangle(u.map(|v| v as f32));
            assert!(b0 >= 0.0 && b1 >= 0.0 && b0 + b1 <= 1.0);
            s0 += f64::from(b0);
            s1 += f64::from(b1);
        }
        let count = f64::from(n * n);
        assert!((s0 / count - 1.0 / 3.0).abs() < 1e-4);
        assert!((s1 / count - 1.0 / 3.0).abs() < 1e-4);
    }
}
