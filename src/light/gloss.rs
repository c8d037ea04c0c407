//! What a glossy surface mirrors of a set of lights, for the choice among them.
//!
//! BSDF sampling alone finds the highlights of many small lights too seldom, and light sampling that goes by the light's cosine alone
//! chooses the one that is mirrored as seldom as any other. So the cosine gives way, by the highlight's part of what the surface
//! reflects, to the density of mirrored light: of normals by GTR2, D·cos θh/(4·(wo·h)), as towards the middle of the set, and wider by
//! what the set covers of the sky.

use glam::Vec3;

/// How a surface mirrors light to a viewer, as far as the choice of a light knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    wo: Vec3,
    normal: Vec3,
    alpha_squared: f32,
    part: f32,
}

/// The sharpest highlight that is told: floats give the cosines of sharper ones only roughly.
const LEAST_ALPHA_SQUARED: f32 = 1e-4;

/// So much of the choice at most goes by the highlight: its tails are only estimated.
const LARGEST_PART: f32 = 0.8;

/// How much of the squared sine of half the angle under which a set is seen widens alpha²: half vectors turn half as far as directions. A
/// tenth or a half of it leave the same error within 3%.
const WIDENING: f32 = 0.25;

impl Gloss {
    /// Towards a viewer in the unit direction `wo`, about the unit `normal` on its side, with the square of GTR2's alpha, of a highlight
    /// that is `part`, in [0, 1], of what the surface reflects.
    #[inline]
    pub fn new(wo: Vec3, normal: Vec3, alpha_squared: f32, part: f32) -> Self {
        Self {
            wo,
            normal,
            alpha_squared: alpha_squared.max(LEAST_ALPHA_SQUARED),
            part: part.min(LARGEST_PART),
        }
    }

    /// What stands for twice the cosine, `cosines`, of lights around the unit direction `[x, y, z]`, whose bounds are seen under an angle half
    /// of which has this squared sine.
    #[inline(always)]
    pub(super) fn instead_of(&self, cosines: f32, [x, y, z]: [f32; 3], sin_squared: f32) -> f32 {
        let (o, n) = (self.wo, self.normal);
        let half = [o.x + x, o.y + y, o.z + z];
        // 0 towards the viewer's opposite, where nothing is mirrored either.
        let length_squared = (half[0] * half[0] + half[1] * half[1] + half[2] * half[2]).max(1e-6);
        let along = (n.x * half[0] + n.y * half[1] + n.z * half[2]).max(0.0);
        let alpha_squared = self.alpha_squared + WIDENING * sin_squared;
        let spread = 1.0 + (alpha_squared - 1.0) * (along * along / length_squared);
        // 2π·D·cos θh/(4·(wo·h)), where wo·h is half the length.
        let mirrored = alpha_squared / (spread * spread) * (along / length_squared);
        cosines * (1.0 - self.part) + mirrored * self.part
    }
}
