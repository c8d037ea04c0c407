//! How much likelier a path is found from its light than from the camera.
//!
//! A path x₀ (camera), x₁, …, x_k (light) is found in three ways: the camera's path meets the light, or chooses it at x_{k-1}, or a path
//! from the light comes to x₁ and is seen there. Densities are per area at each vertex (Veach 1997, chapter 10). With n light paths
//! for each sample of a pixel, p the camera's pixels per steradian, d its distance from x₁, e the density of the light's start
//! ([`crate::light::Emission`]: a point's times 1/π for the cosine of its direction), c the geometric cosines at a vertex towards the
//! light and towards the camera, and →, ← the densities of BSDF sampling towards the light and back, distances and most cosines cancel
//! in the ratio of the last to the first:
//!
//! ```text
//! n·d²/p · ∏_{1 ≤ i < k} c_light/(c_camera·→) · ∏_{2 ≤ i < k} ← · e
//! ```
//!
//! Both kinds of path multiply it up vertex by vertex. Roulette and what clear sheets let pass are left out on both sides: weights
//! need only be the same function of the path for all three. So a delta lobe, whose densities have no common measure, counts 1; but
//! at x₁ it can't be seen, nor anywhere where the frame in which it mirrors depends on the viewer.

use glam::Vec3;

use super::Prepared;
use super::surface::{Shading, Surface};
use crate::accel::Ray;
use crate::math::Number;

/// The product without the light's own part, for a path from the camera; 0 where light paths don't find it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FromLight {
    ratio: f32,
    scatterings: u32,
}

impl FromLight {
    /// At the camera, whose paths light paths can't make yet.
    pub(super) const CAMERA: Self = Self { ratio: 0.0, scatterings: 0 };

    /// At a surface that is to scatter a path which began with `camera_ray`.
    #[inline]
    pub(super) fn arrive(&mut self, scene: &Prepared, camera_ray: &Ray, surface: &Surface<'_>) {
        if let (0, Ok(plan)) = (self.scatterings, &scene.light_paths) {
            let density = scene.camera.pixels_per_steradian(camera_ray.direction);
            self.ratio = plan.per_sample as f32 / scene.camera_weight()
                * surface.point.distance_squared(camera_ray.origin)
                / density;
        }
    }

    /// At a second surface, for a path that is weighed from there on for each that joined it there.
    #[inline]
    pub(super) fn begin_anew(&mut self, scene: &Prepared) {
        self.ratio = if scene.light_paths.is_ok() { 1.0 } else { 0.0 };
    }

    /// As the path goes on to `wi`: the ratio, times the density of BSDF sampling to there.
    #[inline]
    pub(super) fn towards(
        &self,
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        wi: Vec3,
    ) -> f32 {
        self.towards_for(surface, surface.wo, wi, || surface.shading_from(scene, shading, wi))
    }

    /// The same for a path to the viewer in the direction `wo`, where the surface is seen from `wi` as `back` says.
    #[inline]
    pub(super) fn towards_for<'s>(
        &self,
        surface: &Surface<'_>,
        wo: Vec3,
        wi: Vec3,
        back: impl FnOnce() -> Option<Shading<'s>>,
    ) -> f32 {
        if self.ratio == 0.0 {
            return 0.0;
        }
        let pdf_back = || back().map_or(0.0, |b| b.bsdf.pdf(b.wo, b.frame.local_from_world(wo)));
        let back = if self.scatterings == 0 { 1.0 } else { pdf_back() };
        towards(self.ratio, surface.geometric_cosine(wi), surface.geometric_cosine(wo), back)
    }

    /// The product so far.
    pub(super) fn ratio(&self) -> f32 {
        self.ratio
    }

    /// The path was scattered with the density `pdf`; `towards` is what [`Self::towards`] said.
    #[inline]
    pub(super) fn scatter(&mut self, towards: f32, pdf: f32) {
        self.ratio = towards / pdf;
        self.scatterings += 1;
    }

    /// A delta lobe sent the path to `wi`.
    #[inline]
    pub(super) fn mirror(
        &mut self,
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        wi: Vec3,
    ) {
        if self.scatterings == 0 || (self.ratio > 0.0 && !mirrors_back(scene, surface, shading, wi)) {
            self.ratio = 0.0;
        }
        self.scatterings += 1;
    }

    /// The whole ratio for a path that has met a light which starts with the density `emission`. Light that the camera sees at once, maybe
    /// through clear sheets, light paths leave to it.
    #[inline]
    pub(super) fn at_light(&self, emission: impl FnOnce() -> f32) -> f32 {
        if self.scatterings == 0 { 0.0 } else { with_light(self.ratio, emission) }
    }
}

/// [`FromLight::towards`] after a `ratio`: the cosines at the surface towards the light and the camera, and the density of sampling the way back
/// from the light, 1 at the first surface.
#[inline(always)]
pub(super) fn towards<F: Number>(ratio: F, to_light: F, to_camera: F, back: F) -> F {
    ratio * (to_light / to_camera) * back
}

/// `ratio` with the light's own part; where the ratio is 0, that is not asked for. What floats can't tell, beyond all bounds times nothing,
/// counts as nothing.
#[inline]
pub(super) fn with_light<F: Number>(ratio: F, emission: impl FnOnce() -> F) -> F {
    let is_found = ratio.above(F::ZERO);
    if F::any(is_found) { F::select(is_found, (ratio * emission()).max(F::ZERO), F::ZERO) } else { F::ZERO }
}

/// Whether a delta lobe that sends a path to `wi` sends one from there to the viewer.
#[inline]
pub(super) fn mirrors_back(scene: &Prepared, surface: &Surface<'_>, shading: &Shading<'_>, wi: Vec3) -> bool {
    surface
        .shading_from(scene, shading, wi)
        .is_some_and(|back| back.frame.normal.dot(shading.frame.normal).abs() > 1.0 - 1e-6)
}
