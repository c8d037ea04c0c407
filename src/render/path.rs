//! The path tracer: next-event estimation and BSDF sampling, combined by multiple importance sampling.

use std::ops::ControlFlow;

use glam::Vec3;

use super::Prepared;
use super::from_light::{FromLight, with_light};
use super::medium::{self, Medium};
use super::offset::offset;
use super::surface::{Shading, Surface};
use crate::accel::{Hit, Ray};
use crate::color::Rgb;
use crate::disney::Lobe;
use crate::light::{LightPlace, LightSample, Receiver};
use crate::math::sobol::{Purpose, Sampler};

/// What one camera path found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PathSample {
    pub(super) radiance: Rgb,
    /// At the first surface: albedo, world normal turned to the viewer, and depth along the viewing axis.
    pub(super) first: Option<FirstHit>,
    pub(super) rays: u64,
}

/// What the first surface of a path looks like.
#[derive(Clone, Copy, Debug)]
pub(super) struct FirstHit {
    pub(super) albedo: Rgb,
    pub(super) normal: Vec3,
    pub(super) depth: f32,
}

/// Where a path last scattered, for weighing what its ray finds against light sampling. None stands for places that light
/// sampling can't reach: the camera and specular surfaces.
#[derive(Clone, Copy)]
struct LastScatter {
    receiver: Receiver,
    pdf: f32,
}

/// Roulette begins after so many vertices.
const ROULETTE_START: u32 = 4;
/// And lets no more than this survive, so that a path through lossless surfaces ends.
const MAX_SURVIVAL: f32 = 0.95;

/// The power heuristic (Veach 1997) with exponent 2, safe from overflow: the weight of a sample by its density and those of the others.
#[inline]
pub(super) fn power_heuristic(pdf: f32, others: [f32; 2]) -> f32 {
    if !pdf.is_finite() {
        return 1.0;
    }
    let [a, b] = others.map(|other| other / pdf);
    1.0 / (1.0 + a * a + b * b)
}

/// Which of the ways to find a light count. All combinations have the same expectation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strategies {
    pub(super) nee: bool,
    pub(super) mis: bool,
}

impl Strategies {
    #[inline]
    fn of(scene: &Prepared) -> Self {
        Self { nee: scene.settings.nee, mis: scene.settings.mis }
    }

    /// What a path counts that met a light which light paths find `from_light` times as densely. `pdfs`: the density of the BSDF sample that
    /// led there, and that of sampling the light; none if it can't be sampled.
    #[inline]
    fn w_bsdf(self, pdfs: Option<(f32, f32)>, from_light: f32) -> f32 {
        let (pdf, pdf_light) = pdfs.unwrap_or((1.0, 0.0));
        match self {
            Self { nee: true, mis: true } => power_heuristic(1.0, [pdf_light / pdf, from_light]),
            Self { nee: true, mis: false } if pdf_light > 0.0 => 0.0,
            _ => 1.0,
        }
    }

    /// What a light sample of density `pdf` counts that BSDF sampling finds with density `pdf_bsdf` and light paths with `pdf_path`.
    #[inline]
    fn w_light(self, pdf: f32, pdf_bsdf: f32, pdf_path: f32) -> f32 {
        match self {
            Self { nee: true, mis: true } => power_heuristic(pdf, [pdf_bsdf, pdf_path]),
            Self { nee: true, mis: false } => 1.0,
            Self { nee: false, .. } => 0.0,
        }
    }
}

/// How light is found besides sampling it here.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ways {
    pub(super) strategies: Strategies,
    /// What light paths know of the path so far.
    pub(super) from_light: FromLight,
}

/// Traces one path. `inspect` is called at each vertex with the radiance gathered so far.
#[inline]
pub(super) fn trace(
    scene: &Prepared,
    sampler: &Sampler,
    camera_ray: Ray,
    inspect: impl FnMut(ReplayVertex),
) -> PathSample {
    Walk::new(scene, camera_ray).go_on(scene, sampler, None, |_| false, inspect).path()
}

/// A path under way, on the ray that its last surface sent out.
#[derive(Clone, Copy)]
pub(super) struct Walk {
    path: PathSample,
    camera_ray: Ray,
    ray: Ray,
    /// The surfaces it met.
    vertices: u32,
    beta: Rgb,
    last_scatter: Option<LastScatter>,
    /// Radiance grows by eta² on entering glass and shrinks again on leaving: roulette must not see that.
    eta_scale: f32,
    scatterings: u32,
    medium: Medium,
    from_light: FromLight,
}

/// How far a path went.
pub(super) enum Walked {
    /// To its end.
    Over(PathSample),
    /// To a surface where it was to stop, which has not scattered it yet.
    Before(Walk, Hit),
}

impl Walked {
    fn path(self) -> PathSample {
        match self {
            Self::Over(path) | Self::Before(Walk { path, .. }, _) => path,
        }
    }
}

impl Walk {
    pub(super) fn new(scene: &Prepared, camera_ray: Ray) -> Self {
        Self {
            path: PathSample::default(),
            camera_ray,
            ray: camera_ray,
            vertices: 0,
            beta: Rgb::WHITE,
            last_scatter: None,
            eta_scale: 1.0,
            scatterings: 0,
            medium: scene.camera_medium,
            from_light: FromLight::CAMERA,
        }
    }

    /// Goes on, from the surface `met` if it stopped there, until the path ends or meets one where it `stops`. `inspect` is called at each
    /// surface with the radiance gathered so far.
    #[inline(always)]
    pub(super) fn go_on(
        mut self,
        scene: &Prepared,
        sampler: &Sampler,
        mut met: Option<Hit>,
        stops: impl Fn(&Hit) -> bool,
        mut inspect: impl FnMut(ReplayVertex),
    ) -> Walked {
        loop {
            let hit = match met.take() {
                Some(hit) => hit,
                None => {
                    self.vertices += 1;
                    self.path.rays += 1;
                    let Some(hit) =
                        next_surface(scene, sampler, self.vertices, &self.ray, self.ray.direction)
                    else {
                        self.leave_scene(scene);
                        break;
                    };
                    if stops(&hit) {
                        return Walked::Before(self, hit);
                    }
                    hit
                }
            };
            if self.scatter(scene, sampler, &hit, &mut inspect).is_break() {
                break;
            }
        }
        Walked::Over(self.path)
    }

    /// The number of rays so far.
    pub(super) fn rays(&self) -> u64 {
        self.path.rays
    }

    /// Goes on to the end from a surface where it stopped.
    pub(super) fn finish(self, scene: &Prepared, sampler: &Sampler, met: Hit) -> PathSample {
        self.go_on(scene, sampler, Some(met), |_| false, |_| ()).path()
    }

    /// Meets nothing but the environment.
    #[inline(always)]
    fn leave_scene(&mut self, scene: &Prepared) {
        if let Some((radiance, pdf_light)) = scene.lights.environment(self.ray.direction) {
            let emission = || scene.lights.pdf_emission_far(pdf_light);
            let pdfs = self.last_scatter.map(|s| (s.pdf, pdf_light));
            let w_bsdf = Strategies::of(scene).w_bsdf(pdfs, self.from_light.at_light(emission));
            let passing = medium::transmittance(self.medium, f32::INFINITY);
            self.path.radiance += self.beta * radiance * w_bsdf * passing;
        }
    }

    /// Gathers what a surface sends towards the viewer, and lets it send the path on; breaks where it ends.
    #[inline(always)]
    fn scatter(
        &mut self,
        scene: &Prepared,
        sampler: &Sampler,
        hit: &Hit,
        inspect: &mut impl FnMut(ReplayVertex),
    ) -> ControlFlow<()> {
        let surface = Surface::new(scene, &self.ray, hit);
        self.medium = surface.medium_before(self.medium);
        if self.medium.is_some() {
            self.beta *= medium::transmittance(self.medium, hit.t);
        }
        self.add_emitted(scene, &surface);

        // Work out how it scatters.
        let mut varying = None;
        let shading = surface.shading(scene, &mut varying);
        if self.path.first.is_none() {
            self.path.first = Some(first_hit(scene, &self.camera_ray, &surface, shading.as_ref()));
        }
        inspect(ReplayVertex {
            point: (surface.point + scene.geometry.origin()).into(),
            radiance: self.path.radiance,
            beta: self.beta,
        });
        let Some(shading) = shading else { return ControlFlow::Break(()) };
        if self.scatterings == scene.settings.max_depth {
            // Going straight through a clear sheet is no scattering: shadow rays do it too.
            let passing = shading.bsdf.straight_transmittance(shading.wo);
            let Some(passing) = passing else { return ControlFlow::Break(()) };
            self.beta *= passing;
            self.ray = surface.leave(self.ray.direction);
            return ControlFlow::Continue(());
        }

        self.from_light.arrive(scene, &self.camera_ray, &surface);
        // Sample a light, unless no light could be reflected from it.
        let may_reflect = !(shading.bsdf.is_delta() && scene.techniques.useful_light);
        if may_reflect && !scene.lights.is_empty() {
            let u = sampler.set(self.vertices, Purpose::Light);
            if let Some(sample) = scene.lights.sample(&surface.receiver(), u) {
                let ways = Ways { strategies: Strategies::of(scene), from_light: self.from_light };
                let mut rays = 0;
                let direct = direct_light(scene, &surface, &shading, &sample, ways, self.medium, &mut rays);
                self.path.radiance += self.beta * direct;
                self.path.rays += rays;
            }
        }
        self.send_on(scene, &surface, &shading, sampler.set(self.vertices, Purpose::Bsdf))
    }

    /// Adds what a surface sends out by itself.
    #[inline(always)]
    fn add_emitted(&mut self, scene: &Prepared, surface: &Surface<'_>) {
        let emitted = surface.emitted(scene);
        if !emitted.is_black() {
            let pdfs = self.last_scatter.map(|s| {
                let distance = (surface.point - s.receiver.point).length();
                let (triangle, wi) = (surface.triangle, self.ray.direction);
                (s.pdf, scene.lights.pdf_triangle(&s.receiver, triangle, wi, distance))
            });
            let emission = || scene.lights.pdf_emission(surface.triangle);
            let w_bsdf = Strategies::of(scene).w_bsdf(pdfs, self.from_light.at_light(emission));
            self.path.radiance += self.beta * emitted * w_bsdf;
        }
        if self.last_scatter.is_none() {
            self.path.radiance += self.beta * surface.unlit(scene);
        }
    }

    /// Samples the BSDF for the next direction; breaks where the path ends.
    #[inline(always)]
    fn send_on(
        &mut self,
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        [u_lobe, u0, u1, u_roulette]: [f32; 4],
    ) -> ControlFlow<()> {
        let sample = shading.bsdf.sample(shading.wo, u_lobe, [u0, u1]);
        let Some(sample) = sample else { return ControlFlow::Break(()) };
        let goes_straight = sample.lobe == Lobe::StraightTransmission;
        let wi = match goes_straight {
            true => self.ray.direction,
            false => shading.frame.world_from_local(sample.wi).normalize(),
        };
        if surface.same_side(wi) == sample.lobe.is_transmission() {
            return ControlFlow::Break(());
        }
        self.beta *= sample.f * (sample.wi.z.abs() / sample.pdf);
        if self.beta.is_black() {
            return ControlFlow::Break(());
        }
        self.ray = surface.leave(wi);
        self.medium = surface.medium_towards(wi, self.medium);
        // What a clear sheet lets pass was weighed, and is still to be, as if the sheet were not there.
        if goes_straight {
            return ControlFlow::Continue(());
        }
        self.eta_scale *= sample.eta * sample.eta;
        self.scatterings += 1;
        self.last_scatter =
            (!sample.lobe.is_delta()).then(|| LastScatter { receiver: surface.receiver(), pdf: sample.pdf });
        match self.last_scatter {
            None => self.from_light.mirror(scene, surface, shading, wi),
            Some(_) => {
                self.from_light.scatter(self.from_light.towards(scene, surface, shading, wi), sample.pdf);
            }
        }

        // End paths that carry little, and let survivors stand for them.
        if self.scatterings > ROULETTE_START && scene.techniques.roulette {
            let survival = (self.beta.max_channel() * self.eta_scale).min(MAX_SURVIVAL);
            if u_roulette >= survival {
                return ControlFlow::Break(());
            }
            self.beta = self.beta / survival;
        }
        ControlFlow::Continue(())
    }
}

/// The nearest surface that is there for this path: a partly transparent one lets its share of paths pass. Each triangle decides
/// for itself, so that surfaces in the same plane are as transparent to paths as they are to shadow rays. `view` is the direction along the
/// ray in which the camera looks.
#[inline]
pub(super) fn next_surface(
    scene: &Prepared,
    sampler: &Sampler,
    vertex: u32,
    ray: &Ray,
    view: Vec3,
) -> Option<Hit> {
    let bvh = &scene.geometry.bvh;
    if scene.all_covered {
        return bvh.closest(ray);
    }
    bvh.closest_where(ray, |hit| {
        let alpha = scene.material_of(hit.triangle).alpha(&scene.scene, &scene.geometry.at(hit), view);
        alpha >= 1.0 || (alpha > 0.0 && sampler.set_of(vertex, Purpose::Opacity, hit.triangle)[0] < alpha)
    })
}

/// What arrives from a light sample and is reflected to the viewer, weighed against BSDF sampling.
#[inline]
pub(super) fn direct_light(
    scene: &Prepared,
    surface: &Surface<'_>,
    shading: &Shading<'_>,
    sample: &LightSample,
    Ways { strategies, from_light }: Ways,
    arrived: Medium,
    rays: &mut u64,
) -> Rgb {
    let wi = shading.frame.local_from_world(sample.wi);
    let goes_through = (wi.z < 0.0) != (shading.wo.z < 0.0);
    if surface.same_side(sample.wi) == goes_through {
        return Rgb::BLACK;
    }
    let (f, pdf_bsdf) = shading.bsdf.eval_with_pdf(shading.wo, wi);
    let is_left_out = |is_dark: bool| is_dark && scene.techniques.useful_light;
    if is_left_out(f.is_black()) {
        return Rgb::BLACK;
    }
    let (arriving, w_light, shadow) = match sample.place {
        LightPlace::Surface { triangle, barycentric } => {
            let light = scene.geometry.point_on(triangle, barycentric);
            let normal = light.geometric_normal().unwrap_or(-sample.wi);
            let material = scene.material_of(triangle);
            let coverage = material.alpha(&scene.scene, &light, sample.wi);
            let radiance = material.emitted(&scene.scene, &light, normal.dot(sample.wi) < 0.0) * coverage;
            let (point, error) = light.position();
            let target = offset(point, error, normal, -sample.wi);
            let towards = from_light.towards(scene, surface, shading, sample.wi);
            let pdf_path = with_light(towards, || scene.lights.pdf_emission(triangle));
            (radiance, strategies.w_light(sample.pdf, pdf_bsdf, pdf_path), surface.reach(sample.wi, target))
        }
        LightPlace::Point { position, radiance } => (radiance, 1.0, surface.reach(sample.wi, position)),
        LightPlace::Far { radiance, is_delta } => {
            let pdf_path = || {
                let towards = from_light.towards(scene, surface, shading, sample.wi);
                with_light(towards, || scene.lights.pdf_emission_far(sample.pdf))
            };
            let w_light = if is_delta { 1.0 } else { strategies.w_light(sample.pdf, pdf_bsdf, pdf_path()) };
            (radiance, w_light, surface.leave(sample.wi))
        }
    };
    if is_left_out(arriving.is_black() || w_light == 0.0) {
        return Rgb::BLACK;
    }
    *rays += 1;
    let mut passing = transmittance(scene, &shadow);
    let medium = surface.medium_towards(sample.wi, arrived);
    if medium.is_some() {
        let is_far = matches!(sample.place, LightPlace::Far { .. });
        let distance = if is_far { f32::INFINITY } else { shadow.direction.length() };
        passing *= medium::transmittance(medium, distance);
    }
    f * arriving * passing * (wi.z.abs() * w_light / sample.pdf)
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

pub(super) fn first_hit(
    scene: &Prepared,
    ray: &Ray,
    surface: &Surface<'_>,
    shading: Option<&Shading<'_>>,
) -> FirstHit {
    FirstHit {
        albedo: shading.map_or(Rgb::BLACK, |s| s.bsdf.albedo()),
        normal: shading.map_or(Vec3::ZERO, |s| if s.wo.z < 0.0 { -s.frame.normal } else { s.frame.normal }),
        depth: (surface.point - ray.origin).dot(scene.camera.axis),
    }
}

/// One vertex of a replayed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayVertex {
    /// World position.
    pub point: [f32; 3],
    /// The radiance gathered up to here, this surface's emission included.
    pub radiance: Rgb,
    /// The throughput with which the path arrived.
    pub beta: Rgb,
}

/// A path told vertex by vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// The sample's radiance, as it is: not finite if the sample is bad.
    pub radiance: Rgb,
    /// Where the path went.
    pub vertices: Vec<ReplayVertex>,
}

/// Traces sample `sample` of pixel (x, y) again and tells where it went.
pub fn replay(scene: &Prepared, x: u32, y: u32, sample: u32) -> Replay {
    let mut vertices = Vec::new();
    let path = super::film::sample_pixel(scene, x, y, sample, |v| vertices.push(v));
    Replay { radiance: path.radiance, vertices }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_two_strategies_sum_to_one() {
        for (a, b) in [(1.0, 2.0), (1e30, 1e-30), (1e-38, 1e38), (5.0, 0.0)] {
            let sum = power_heuristic(a, [b, 0.0]) + power_heuristic(b, [0.0, a]);
            // A strategy that can't make the sample has no say.
            assert!((sum - 1.0).abs() < 1e-6 || b == 0.0, "{a} {b}: {sum}");
            assert!(power_heuristic(a, [b, 0.0]).is_finite());
        }
    }
}
