//! A three-component vector over any [`Real`]: directions in the local shading frame.

use std::ops::{Add, Mul, Neg, Sub};

use glam::{BVec4A, Vec3, Vec4};

use super::{Number, Real};

/// A vector, usually a unit direction in the local frame whose z is the shading normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct V3<F> {
    /// Along the tangent.
    pub x: F,
    /// Along the bitangent.
    pub y: F,
    /// Along the normal.
    pub z: F,
}

impl<F: Number> V3<F> {
    /// The vector (x, y, z).
    #[inline]
    pub fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }

    /// The scalar product.
    #[inline]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The vector product.
    #[inline]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// |self|².
    #[inline]
    pub fn length_squared(self) -> F {
        self.dot(self)
    }

    /// |self|.
    #[inline]
    pub fn length(self) -> F {
        self.length_squared().sqrt()
    }

    /// self/|self|; not finite for the zero vector.
    #[inline]
    pub fn normalize(self) -> Self {
        self * (F::ONE / self.length())
    }

    /// Mirrored by the plane z = 0.
    #[inline]
    pub fn mirrored_z(self) -> Self {
        Self::new(self.x, self.y, -self.z)
    }

    /// `wo` mirrored about `n`, both pointing away from the surface: 2(wo·n)n - wo.
    ///
    /// glam's `reflect` takes the incoming direction, that is, the other sign.
    #[inline]
    pub fn reflect(wo: Self, n: Self) -> Self {
        let twice = F::of(2.0) * wo.dot(n);
        n * twice - wo
    }
}

impl<F: Real> V3<F> {
    /// The same direction in another float type.
    #[inline]
    pub fn cast<G: Real>(self) -> V3<G> {
        V3::new(G::of(self.x.to_f64()), G::of(self.y.to_f64()), G::of(self.z.to_f64()))
    }
}

impl V3<Vec4> {
    /// Four vectors side by side.
    #[inline(always)]
    pub fn beside(four: [Vec3; 4]) -> Self {
        let axis = |of: fn(&Vec3) -> f32| Vec4::from_array(four.each_ref().map(of));
        Self::new(axis(|v| v.x), axis(|v| v.y), axis(|v| v.z))
    }

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self::new(Vec4::splat(v.x), Vec4::splat(v.y), Vec4::splat(v.z))
    }

    /// The vector in a lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// `yes` where the mask says so, and `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: BVec4A, yes: Self, no: Self) -> Self {
        let choose = |yes: Vec4, no: Vec4| Vec4::select(mask, yes, no);
        Self::new(choose(yes.x, no.x), choose(yes.y, no.y), choose(yes.z, no.z))
    }
}

impl From<Vec3> for V3<f32> {
    #[inline]
    fn from(v: Vec3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<V3<f32>> for Vec3 {
    #[inline]
    fn from(v: V3<f32>) -> Self {
        Vec3::new(v.x, v.y, v.z)
    }
}

impl<F: Number> Add for V3<F> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<F: Number> Sub for V3<F> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<F: Number> Neg for V3<F> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<F: Number> Mul<F> for V3<F> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: F) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflect_keeps_the_normal_part_and_turns_the_rest() {
        let n = V3::new(0.0, 0.0, 1.0f32);
        assert_eq!(V3::reflect(V3::new(0.6, 0.0, 0.8), n), V3::new(-0.6, 0.0, 0.8));
    }

    #[test]
    fn cross_is_right_handed() {
        let x = V3::new(1.0f64, 0.0, 0.0);
        let y = V3::new(0.0, 1.0, 0.0);
        assert_eq!(x.cross(y), V3::new(0.0, 0.0, 1.0));
    }
}
