//! Which way a surface faces, told coarsely: cells of the octahedron that directions are mapped to.

use glam::{Vec2, Vec3};

use super::bounds::angle;
use crate::math::Real;

/// Cells along a side of the octahedral map (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors").
const SIDE: usize = 16;

/// So many ways are told apart.
pub(super) const COUNT: usize = SIDE * SIDE;

/// What of a cosine counts at least where surfaces of a cell may see something: its light must not be left to chance.
const LEAST_COSINE: f32 = 0.02;

/// The cell of a unit normal; none of one that isn't finite.
#[inline]
pub(super) fn cell_of(normal: Vec3) -> Option<usize> {
    let n = normal / normal.abs().element_sum();
    let flat = folded(n.truncate(), n.z);
    let place = (flat * 0.5 + 0.5) * SIDE as f32;
    let index = |v: f32| (v as usize).min(SIDE - 1);
    flat.is_finite().then(|| index(place.y) * SIDE + index(place.x))
}

/// The normals of a cell.
pub(super) struct Facing {
    center: Vec3,
    /// In the middle of the cell's quarters.
    some: [Vec3; 4],
    /// How far others are from the centre, in radians.
    radius: f32,
}

impl Facing {
    pub(super) fn new(cell: usize) -> Self {
        let corner = Vec2::new((cell % SIDE) as f32, (cell / SIDE) as f32);
        let at = |x: f32, y: f32| unfolded((corner + Vec2::new(x, y)) / SIDE as f32 * 2.0 - 1.0);
        let center = at(0.5, 0.5);
        let ends = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        Self {
            center,
            some: ends.map(|(x, y)| at(0.25 + 0.5 * x, 0.25 + 0.5 * y)),
            radius: ends.map(|(x, y)| angle(center, at(x, y))).into_iter().fold(0.0, f32::max),
        }
    }

    /// The mean cosine towards what lies around the `middle`, of which `others` are a part each: not 0 where any normal of the cell sees any of
    /// what is within `radius` radians of it.
    pub(super) fn mean_cosine(&self, middle: Vec3, others: &[Vec3; 4], radius: f32) -> f32 {
        // A little more, for what is between corners.
        let reach = 1.05 * (self.radius + radius);
        if reach < std::f32::consts::FRAC_PI_2 && middle.dot(self.center) < -Real::sin(reach) {
            return 0.0;
        }
        let pairs = self.some.iter().flat_map(|n| others.iter().map(|d| d.dot(*n).max(0.0)));
        (pairs.sum::<f32>() / 16.0).max(LEAST_COSINE)
    }
}

/// The unit direction at a place of the map in [-1, 1]².
fn unfolded(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    folded(p, z).extend(z).normalize()
}

/// The lower half of the octahedron turned over its edges, to the outside or back.
#[inline]
fn folded(p: Vec2, z: f32) -> Vec2 {
    if z >= 0.0 { p } else { Vec2::new((1.0 - p.y.abs()).copysign(p.x), (1.0 - p.x.abs()).copysign(p.y)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::math::warp;

    fn direction(i: u32) -> Vec3 {
        let random = |salt| unit_f32(combine(u64::from(i), salt) as u32);
        warp::uniform_sphere([random(1), random(2)]).into()
    }

    #[test]
    fn normals_are_near_the_others_of_their_cell() {
        let cells: Vec<Facing> = (0..COUNT).map(Facing::new).collect();
        assert!(cells.iter().all(|cell| cell.radius < 0.3), "no cell is wide");
        for normal in
            (0..20_000).map(direction).chain([Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z])
        {
            let cell = &cells[cell_of(normal).expect("a cell")];
            assert!(angle(normal, cell.center) < 1.05 * cell.radius + 1e-3, "{normal}");
        }
        assert_eq!(cell_of(Vec3::ZERO), None);
        assert_eq!(cell_of(Vec3::NAN), None);
    }

    #[test]
    fn what_a_normal_sees_has_a_mean_cosine_and_what_none_sees_has_not() {
        let mut hidden = 0;
        for i in 0..20_000 {
            let (normal, d) = (direction(2 * i), direction(2 * i + 1));
            let facing = Facing::new(cell_of(normal).expect("a cell"));
            let mean = facing.mean_cosine(d, &[d; 4], 0.0);
            assert!(mean > 0.0 || normal.dot(d) <= 0.0, "{normal} {d}");
            assert!((mean - normal.dot(d).max(0.0)).abs() < 0.3, "{normal} {d}: {mean}");
            hidden += u32::from(mean == 0.0);
        }
        assert!(hidden > 6_000, "{hidden}");
    }
}
