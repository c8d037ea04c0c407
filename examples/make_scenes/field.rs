//! Signed distance fields: negative inside. Roundings are circular arcs, so a bevel is as smooth as the faces it joins.

use glam::{DVec2, DVec3};

/// A function whose zeros are a surface; negative inside. Near its zeros it is close to a distance.
pub(crate) trait Field {
    /// The value at a point.
    fn at(&self, p: DVec3) -> f64;

    /// The gradient, by central differences whose error is far below `f32`'s.
    fn gradient(&self, p: DVec3) -> DVec3 {
        const STEP: f64 = 1e-5;
        let along = |axis: DVec3| self.at(p + axis * STEP) - self.at(p - axis * STEP);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * STEP)
    }

    /// The outward unit normal at a point of the surface.
    fn normal(&self, p: DVec3) -> DVec3 {
        self.gradient(p).normalize()
    }

    /// The surface point that Newton steps along the gradient lead to from a point nearby.
    fn project(&self, mut p: DVec3) -> DVec3 {
        for _ in 0..12 {
            let value = self.at(p);
            if value.abs() < 1e-11 {
                break;
            }
            let gradient = self.gradient(p);
            p -= gradient * (value / gradient.length_squared().max(1e-6));
        }
        p
    }
}

impl<F: Fn(DVec3) -> f64> Field for F {
    fn at(&self, p: DVec3) -> f64 {
        self(p)
    }
}

/// The intersection of two solids, its convex edge rounded with radius `r`.
pub(crate) fn round_max(a: f64, b: f64, r: f64) -> f64 {
    a.max(b).min(-r) + DVec2::new(a + r, b + r).max(DVec2::ZERO).length()
}

/// The union of two solids that flow into each other over a width of about `k` (Quilez, cubic polynomial smooth minimum:
/// the result has two continuous derivatives where the parts have).
pub(crate) fn blend(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * h * k / 6.0
}

/// `a` without `b`, blended over `k`.
pub(crate) fn carve(a: f64, b: f64, k: f64) -> f64 {
    -blend(-a, b, k)
}

/// A box with half sides `half`, its edges rounded with radius `r` inside of the box.
pub(crate) fn round_box(p: DVec3, half: DVec3, r: f64) -> f64 {
    let q = p.abs() - (half - DVec3::splat(r));
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - r
}

/// A rectangle with half sides `half` and corners of radius `r`.
pub(crate) fn round_rectangle(p: DVec2, half: DVec2, r: f64) -> f64 {
    let q = p.abs() - (half - DVec2::splat(r));
    q.max(DVec2::ZERO).length() + q.max_element().min(0.0) - r
}

/// An ellipsoid with radii `r` (Quilez' bound: exact on the surface, close to a distance nearby).
pub(crate) fn ellipsoid(p: DVec3, r: DVec3) -> f64 {
    let k = (p / r).length();
    let l = (p / (r * r)).length();
    if l < 1e-12 { -r.min_element() } else { k * (k - 1.0) / l }
}

/// A cone with round ends: radius `ra` at `a`, `rb` at `b`, linear between (a bound, close to a distance where the radii
/// are alike).
pub(crate) fn limb(p: DVec3, a: DVec3, b: DVec3, ra: f64, rb: f64) -> f64 {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    p.distance(a + axis * t) - (ra + (rb - ra) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounded_edge_is_a_circular_arc() {
        let corner = |p: DVec3| round_max(p.x, p.y, 0.1);
        for (x, y) in [(-0.1, 0.0), (-0.1 + 0.06, -0.1 + 0.08), (0.0, -0.1), (0.0, -0.7)] {
            assert!(corner(DVec3::new(x, y, 0.3)).abs() < 1e-15, "({x}, {y})");
        }
    }

    #[test]
    fn projection_ends_on_the_surface() {
        let radii = DVec3::new(0.5, 0.8, 0.3);
        let field = |p: DVec3| ellipsoid(p, radii);
        let p = field.project(DVec3::new(0.3, 0.5, 0.2));
        assert!(((p / radii).length() - 1.0).abs() < 1e-12);
        let expected = (p / (radii * radii)).normalize();
        assert!(field.normal(p).distance(expected) < 1e-8);
    }
}
