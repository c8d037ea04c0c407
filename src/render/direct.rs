//! Light from a sampled point of a light: what arrives of it, and what a surface reflects.

use std::ops::ControlFlow;

use super::Prepared;
use super::from_light::{FromLight, with_light};
use super::medium::{self, Medium};
use super::mis::{Heuristic, Rivals, Share, Strategies};
use super::offset::offset;
use super::surface::{Shading, Surface};
use crate::accel::{Hit, Ray};
use crate::color::Rgb;
use crate::light::{LightPlace, LightSample};

/// What a sampled light sends to a surface, as long as nothing is in between.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arriving {
    pub(super) radiance: Rgb,
    shadow: Ray,
    is_far: bool,
}

/// What is reflected of a light sample, not weighed yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reflected {
    pub(super) radiance: Rgb,
    /// The density of the light's point, which the radiance has still to be divided by: together with its weight, as it may be tiny.
    pub(super) pdf: f32,
    /// What the sample counts against the other ways to find the light.
    pub(super) share: Share,
}

impl Reflected {
    const NOTHING: Self = Self { radiance: Rgb::BLACK, pdf: 1.0, share: Share::ALL };
}

impl Arriving {
    #[inline]
    pub(super) fn new(scene: &Prepared, surface: &Surface<'_>, sample: &LightSample) -> Self {
        let is_far = matches!(sample.place, LightPlace::Far { .. });
        let (radiance, shadow) = match sample.place {
            LightPlace::Surface { triangle, barycentric } => {
                let light = scene.geometry.point_on(triangle, barycentric);
                let normal = light.geometric_normal().unwrap_or(-sample.wi);
                let material = scene.material_of(triangle);
                let coverage = material.alpha(&scene.scene, &light, sample.wi);
                let emitted = material.emitted(&scene.scene, &light, normal.dot(sample.wi) < 0.0);
                let (point, error) = light.position();
                let target = offset(point, error, normal, -sample.wi);
                (emitted * coverage, surface.reach(sample.wi, target))
            }
            LightPlace::Point { position, radiance } => (radiance, surface.reach(sample.wi, position)),
            LightPlace::Far { radiance, .. } => (radiance, surface.leave(sample.wi)),
        };
        Self { radiance, shadow, is_far }
    }

    /// The fraction that comes through surfaces and the medium in between.
    #[inline]
    pub(super) fn passing(&self, scene: &Prepared, medium: Medium) -> Rgb {
        let passing = transmittance(scene, &self.shadow);
        if medium.is_none() {
            return passing;
        }
        let distance = if self.is_far { f32::INFINITY } else { self.shadow.direction.length() };
        passing * medium::transmittance(medium, distance)
    }
}

/// What arrives from a light sample and is reflected to the viewer of a surface, whose path came through the medium `arrived` and is found
/// from lights as `from_light` says.
#[inline]
pub(super) fn direct_light(
    scene: &Prepared,
    surface: &Surface<'_>,
    shading: &Shading<'_>,
    sample: &LightSample,
    from_light: FromLight,
    arrived: Medium,
    rays: &mut u64,
) -> Reflected {
    let (f, pdf_bsdf) = surface.reflected(shading, sample.wi);
    let is_left_out = |is_dark: bool| is_dark && scene.techniques.useful_light;
    if is_left_out(f.is_black()) {
        return Reflected::NOTHING;
    }
    let arriving = Arriving::new(scene, surface, sample);
    if is_left_out(arriving.radiance.is_black()) {
        return Reflected::NOTHING;
    }
    *rays += 1;
    let passing = arriving.passing(scene, surface.medium_towards(sample.wi, arrived));
    if is_left_out(passing.is_black()) {
        return Reflected::NOTHING;
    }
    let share = Heuristic::of(sample).map_or(Share::ALL, |heuristic| {
        let towards = from_light.towards(scene, surface, shading, sample.wi);
        let light_paths = with_light(towards, || pdf_emission(scene, sample)) / sample.pdf;
        Strategies::of(scene).of_light(Rivals { camera: pdf_bsdf / sample.pdf, light_paths, heuristic })
    });
    Reflected { radiance: f * arriving.radiance * passing, pdf: sample.pdf, share }
}

/// The density with which paths start from the light where `sample` is, which has an extent.
#[inline]
pub(super) fn pdf_emission(scene: &Prepared, sample: &LightSample) -> f32 {
    match sample.place {
        LightPlace::Surface { triangle, .. } => scene.lights.pdf_emission(triangle),
        LightPlace::Point { .. } => 0.0,
        LightPlace::Far { sky, .. } => sky.map_or(0.0, |sky| scene.lights.pdf_emission_far(sky)),
    }
}

/// The fraction of light that passes a segment: the product of what each surface on it lets through.
#[inline]
pub(super) fn transmittance(scene: &Prepared, shadow: &Ray) -> Rgb {
    if scene.all_opaque {
        return if scene.geometry.bvh.occluded(shadow) { Rgb::BLACK } else { Rgb::WHITE };
    }
    let mut passing = Rgb::WHITE;
    let ray = Ray { direction: shadow.direction.normalize(), ..*shadow };
    let blocked = scene.geometry.bvh.visit(shadow, |hit| {
        passing *= passing_surface(scene, &ray, &hit);
        if passing.is_black() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    if blocked { Rgb::BLACK } else { passing }
}

/// What a surface lets pass of light that goes straight through it along `ray`: where it isn't there, all, and a clear sheet its part.
#[inline]
fn passing_surface(scene: &Prepared, ray: &Ray, hit: &Hit) -> Rgb {
    let material = scene.material_of(hit.triangle);
    if material.blocks_shadow_rays() {
        return Rgb::BLACK;
    }
    let alpha = material.alpha(&scene.scene, &scene.geometry.at(hit), ray.direction);
    let absent = Rgb::grey(1.0 - alpha);
    if alpha == 0.0 || !material.lets_shadow_rays_pass {
        return absent;
    }
    let mut varying = None;
    let sheet = Surface::new(scene, ray, hit)
        .shading(scene, &mut varying)
        .and_then(|shading| shading.bsdf.straight_transmittance(shading.wo));
    sheet.map_or(absent, |passing| absent + passing * alpha)
}
