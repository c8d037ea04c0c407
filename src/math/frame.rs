//! Orthonormal frames: between the world and the local frame whose z is the shading normal.

use glam::Vec3;

use super::{Real, V3};

/// A right-handed orthonormal frame (tangent, bitangent, normal) in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x.
    pub tangent: Vec3,
    /// Local y.
    pub bitangent: Vec3,
    /// Local z.
    pub normal: Vec3,
}

impl Frame {
    /// A frame around a unit normal with an arbitrary, continuous tangent (Duff et al. 2017,
    /// "Building an Orthonormal Basis, Revisited").
    #[inline]
    pub fn from_normal(normal: Vec3) -> Self {
        let sign = 1.0f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// Nori's coordinate system, which Aris scenes shade in: the tangent is perpendicular to the normal in the plane of x and z
    /// or of y and z, whichever is better conditioned.
    #[inline]
    pub fn nori(normal: Vec3) -> Self {
        let bitangent = if normal.x.abs() > normal.y.abs() {
            let inv_len = 1.0 / (normal.x * normal.x + normal.z * normal.z).sqrt();
            Vec3::new(normal.z * inv_len, 0.0, -normal.x * inv_len)
        } else {
            let inv_len = 1.0 / (normal.y * normal.y + normal.z * normal.z).sqrt();
            Vec3::new(0.0, normal.z * inv_len, -normal.y * inv_len)
        };
        Self { tangent: bitangent.cross(normal), bitangent, normal }
    }

    /// A frame around a unit normal whose tangent is `tangent` made perpendicular to it. Falls back to an arbitrary tangent
    /// where the two are parallel or the tangent is zero.
    #[inline]
    pub fn from_normal_and_tangent(normal: Vec3, tangent: Vec3) -> Self {
        let projected = tangent - normal * normal.dot(tangent);
        match projected.try_normalize() {
            Some(tangent) => Self { tangent, bitangent: normal.cross(tangent), normal },
            None => Self::from_normal(normal),
        }
    }

    /// The frame turned about its normal, counter-clockwise by `angle` radians.
    #[inline]
    pub fn rotated(self, angle: f32) -> Self {
        let (sin, cos) = (Real::sin(angle), Real::cos(angle));
        Self {
            tangent: self.tangent * cos + self.bitangent * sin,
            bitangent: self.bitangent * cos - self.tangent * sin,
            normal: self.normal,
        }
    }

    /// A world direction in this frame.
    #[inline]
    pub fn local_from_world(&self, w: Vec3) -> V3<f32> {
        V3::new(self.tangent.dot(w), self.bitangent.dot(w), self.normal.dot(w))
    }

    /// A local direction in the world.
    #[inline]
    pub fn world_from_local(&self, w: V3<f32>) -> Vec3 {
        self.tangent * w.x + self.bitangent * w.y + self.normal * w.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let phi = i as f32 * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * Real::cos(phi), r * Real::sin(phi), z)
        })
    }

    #[test]
    fn every_frame_is_orthonormal_and_right_handed() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
        for n in normals().chain(axes) {
            let turned = Frame::from_normal(n).rotated(0.7);
            for f in [
                Frame::from_normal(n),
                Frame::nori(n),
                Frame::from_normal_and_tangent(n, Vec3::new(0.3, -0.2, 0.9)),
                turned,
            ] {
                assert!(f.tangent.dot(f.bitangent).abs() < 1e-6);
                assert!(f.tangent.dot(f.normal).abs() < 1e-6);
                assert!((f.tangent.length() - 1.0).abs() < 1e-6);
                assert!((f.tangent.cross(f.bitangent) - f.normal).length() < 2e-6, "{n}: {f:?}");
            }
        }
    }

    #[test]
    fn local_and_world_are_inverse() {
        let f = Frame::from_normal(Vec3::new(0.48, -0.6, 0.64));
        let w = Vec3::new(0.0, 0.6, 0.8);
        assert!((f.world_from_local(f.local_from_world(w)) - w).length() < 1e-6);
    }
}
