//! The path tracer: next-event estimation and BSDF sampling, combined by multiple importance sampling.

use std::ops::ControlFlow;

use glam::Vec3;

use super::Prepared;
use super::direct::direct_light;
use super::from_light::FromLight;
use super::medium::{self, Medium};
use super::mis::{Heuristic, Rivals, Share, Strategies};
use super::replay::ReplayVertex;
use super::reuse::{Direct, Later, Met, Onward, Trail};
use super::surface::{Shading, Surface};
use crate::accel::{Hit, Ray};
use crate::color::Rgb;
use crate::disney::Lobe;
use crate::light::Receiver;
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

/// Roulette begins after so many scatterings, and lets all go on that carry at least so much: measured in the Cornell boxes, five
/// scatterings and a bound of 1 take 1.1 to 1.2 times the work.
const ROULETTE_START: u32 = 3;
const SPARED: f32 = 0.5;
/// And lets no more than this survive, so that a path through lossless surfaces ends.
const MAX_SURVIVAL: f32 = 0.95;
/// A path that others may have joined counts as one that carried at least this to there: they may carry more.
const LEAST_BEFORE: f32 = 0.05;

/// Traces one path. `inspect` is called at each vertex with the radiance gathered so far.
#[inline]
pub(super) fn trace(
    scene: &Prepared,
    sampler: &Sampler,
    camera_ray: Ray,
    inspect: impl FnMut(ReplayVertex),
) -> PathSample {
    let Some(first) = first_surface(scene, sampler, &camera_ray) else {
        return background(scene, &camera_ray);
    };
    let mut walk = Walk::new(scene, camera_ray);
    walk.go_on_from_first(scene, sampler, Some(first), |_| false, inspect);
    walk.path()
}

/// What a path finds whose first ray meets no surface: nothing else finds what the camera sees at once.
#[inline]
pub(super) fn background(scene: &Prepared, camera_ray: &Ray) -> PathSample {
    let passing = medium::transmittance(scene.camera_medium, f32::INFINITY);
    let seen = scene.lights.environment(camera_ray.direction).map(|(radiance, _)| radiance * passing);
    PathSample { radiance: seen.unwrap_or(Rgb::BLACK), first: None, rays: 1 }
}

/// A path under way, on the ray that its last surface sent out.
#[derive(Clone)]
pub(super) struct Walk {
    path: PathSample,
    /// Where the path was divided, for others to join it there: what it had found and carried until then. Both count from there anew.
    before: Option<Before>,
    pub(super) trail: Trail,
    camera_ray: Ray,
    ray: Ray,
    /// The surfaces it met.
    vertices: u32,
    beta: Rgb,
    last_scatter: Option<LastScatter>,
    /// Radiance grows by eta² on entering glass and shrinks again on leaving: roulette must not see that.
    eta_scale: f32,
    scatterings: u32,
    /// The camera sees where it is, maybe in mirrors and through glass.
    is_direct_view: bool,
    medium: Medium,
    from_light: FromLight,
}

/// What a path found and carried before it was divided.
#[derive(Clone, Copy)]
struct Before {
    radiance: Rgb,
    beta: Rgb,
}

impl Walk {
    pub(super) fn new(scene: &Prepared, camera_ray: Ray) -> Self {
        Self::on_trail(scene, camera_ray, Trail::unkept())
    }

    /// A path that others of its block may use.
    #[inline(always)]
    pub(super) fn shared(scene: &Prepared, camera_ray: Ray) -> Self {
        Self::on_trail(scene, camera_ray, Trail::kept())
    }

    /// Inline all the way, so that it is made where it stays: a copy waits for what was just written.
    #[inline(always)]
    fn on_trail(scene: &Prepared, camera_ray: Ray, trail: Trail) -> Self {
        Self {
            path: PathSample::default(),
            before: None,
            trail,
            camera_ray,
            ray: camera_ray,
            vertices: 0,
            beta: Rgb::WHITE,
            last_scatter: None,
            eta_scale: 1.0,
            scatterings: 0,
            is_direct_view: true,
            medium: scene.camera_medium,
            from_light: FromLight::CAMERA,
        }
    }

    /// Goes on, from the surface `met` if it stopped there, until the path ends or meets one where it `stops`, which has not scattered it yet:
    /// the result. `inspect` is called at each surface with the radiance gathered so far.
    #[inline(always)]
    pub(super) fn go_on(
        &mut self,
        scene: &Prepared,
        sampler: &Sampler,
        mut met: Option<Hit>,
        stops: impl Fn(&Hit) -> bool,
        mut inspect: impl FnMut(ReplayVertex),
    ) -> Option<Hit> {
        loop {
            let hit = match met.take() {
                Some(hit) => hit,
                None => {
                    let hit = next_surface(scene, sampler, self.vertices + 1, &self.ray, self.ray.direction);
                    self.arrive(scene, hit.as_ref());
                    let Some(hit) = hit else { break };
                    if stops(&hit) {
                        return Some(hit);
                    }
                    hit
                }
            };
            if self.scatter(scene, sampler, &hit, &mut inspect).is_break() {
                break;
            }
        }
        None
    }

    /// Goes on as below, where the first ray met what [`first_surface`] says.
    #[inline(always)]
    pub(super) fn go_on_from_first(
        &mut self,
        scene: &Prepared,
        sampler: &Sampler,
        first: Option<Hit>,
        stops: impl Fn(&Hit) -> bool,
        inspect: impl FnMut(ReplayVertex),
    ) -> Option<Hit> {
        self.arrive(scene, first.as_ref());
        match first {
            Some(hit) if !stops(&hit) => self.go_on(scene, sampler, Some(hit), stops, inspect),
            stopped => stopped,
        }
    }

    /// Its ray was traced, and met a surface or none.
    #[inline(always)]
    fn arrive(&mut self, scene: &Prepared, hit: Option<&Hit>) {
        self.vertices += 1;
        self.path.rays += 1;
        if hit.is_none() {
            self.leave_scene(scene);
        }
    }

    /// The same after it went on to its end from the surface `met` where it stopped, if it did.
    pub(super) fn finished(&self, scene: &Prepared, sampler: &Sampler, met: Option<Hit>) -> Self {
        let mut walk = self.clone();
        if met.is_some() {
            walk.go_on(scene, sampler, met, |_| false, |_| ());
        }
        walk
    }

    /// What it found; of a path that was divided, without what it found from there on.
    pub(super) fn path(&self) -> PathSample {
        PathSample { radiance: self.before.map_or(self.path.radiance, |before| before.radiance), ..self.path }
    }

    /// What a path that was divided found from there on, light paths' part in it aside.
    pub(super) fn beyond(&self) -> Rgb {
        if self.before.is_some() { self.path.radiance } else { Rgb::BLACK }
    }

    /// Meets nothing but the environment.
    #[inline(always)]
    fn leave_scene(&mut self, scene: &Prepared) {
        if let Some((radiance, sky)) = scene.lights.environment(self.ray.direction) {
            let passing = medium::transmittance(self.medium, f32::INFINITY);
            let pdf_light = |from: &Receiver| scene.lights.pdf_environment(from, sky);
            let emission = || scene.lights.pdf_emission_far(sky);
            self.add_met(scene, radiance * passing, Heuristic::Balance, pdf_light, emission);
        }
    }

    /// Adds the radiance of a light that the path met, which light sampling shares by such a heuristic. `pdf_light` is the density of
    /// sampling it where the path last scattered, `emission` that of its own paths' start.
    #[inline(always)]
    fn add_met(
        &mut self,
        scene: &Prepared,
        radiance: Rgb,
        heuristic: Heuristic,
        pdf_light: impl FnOnce(&Receiver) -> f32,
        emission: impl FnOnce() -> f32,
    ) {
        let radiance = self.beta * radiance;
        let last = self.last_scatter.map(|last| (last.pdf, pdf_light(&last.receiver)));
        if self.vertices == 3
            && let Some(onward) = &mut self.trail.onward
        {
            (onward.met, onward.heuristic) = (radiance, heuristic);
            onward.pdf_light = last.map_or(0.0, |(_, pdf_light)| pdf_light);
            onward.emission = if scene.light_paths.is_ok() { emission() } else { 0.0 };
            return;
        }
        let camera = last.map_or(0.0, |(pdf, pdf_light)| pdf_light / pdf);
        let rivals = Rivals { camera, light_paths: self.from_light.at_light(emission), heuristic };
        self.add(radiance, 1.0, Strategies::of(scene).of_bsdf(rivals));
    }

    /// Adds a share of radiance that was found with the density `pdf`: if it depends on light paths and the path was divided, each that
    /// joined it there has its own.
    #[inline(always)]
    fn add(&mut self, radiance: Rgb, pdf: f32, share: Share) {
        if share.light_paths > 0.0 && self.before.is_some() {
            let radiance = radiance * (share.in_camera / pdf);
            self.trail.later.push(Later { radiance, light_paths: share.light_paths });
        } else {
            self.path.radiance += radiance * (share.weight() / pdf);
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
            point: surface.in_world(scene).into(),
            radiance: self.before.map_or(self.path.radiance, |b| b.radiance + b.beta * self.path.radiance),
            beta: self.before.map_or(self.beta, |b| b.beta * self.beta),
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
        if self.trail.is_kept && self.medium.is_none() && !shading.bsdf.is_delta() {
            if self.vertices == 1 {
                self.trail.first = Some(Met { ray: self.ray, hit: *hit });
            } else if self.vertices == 2 && self.trail.leads_on() {
                self.trail.second = Some(Met { ray: self.ray, hit: *hit });
                return self.divide(scene, sampler, &surface, &shading);
            }
        }
        // Sample a light, unless no light could be reflected from it.
        let may_reflect = !(shading.bsdf.is_delta() && scene.techniques.useful_light);
        let receiver = self.receiver(scene, &surface, &shading);
        if may_reflect && !scene.lights.is_empty() {
            let u = sampler.set(self.vertices, Purpose::Light);
            if let Some(sample) = scene.lights.sample(&receiver, u) {
                let (way, rays) = (self.from_light, &mut self.path.rays);
                let direct = direct_light(scene, &surface, &shading, &sample, way, self.medium, rays);
                self.add(self.beta * direct.radiance, direct.pdf, direct.share);
            }
        }
        let u = sampler.set(self.vertices, Purpose::Bsdf);
        let flow = self.send_on(scene, &surface, &shading, receiver, u);
        if self.vertices == 1
            && self.trail.is_kept
            && let Some(last) = self.last_scatter
            && surface.same_side(self.ray.direction)
        {
            (self.trail.weight, self.trail.pdf) = (self.beta, last.pdf);
        }
        flow
    }

    /// Scatters the path where others may join it: what it finds from here on is kept for all of them.
    #[inline(always)]
    fn divide(
        &mut self,
        scene: &Prepared,
        sampler: &Sampler,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
    ) -> ControlFlow<()> {
        let receiver = surface.receiver();
        if !scene.lights.is_empty() {
            let u = sampler.set(self.vertices, Purpose::Light);
            let sample = scene.lights.sample(&receiver, u);
            self.trail.direct =
                sample.and_then(|s| Direct::new(scene, surface, shading, &s, &mut self.path.rays));
        }
        let beta = std::mem::replace(&mut self.beta, Rgb::WHITE);
        let u = sampler.set(self.vertices, Purpose::Bsdf);
        let flow = self.send_on(scene, surface, shading, receiver, u);
        let weight = self.beta;
        self.beta = beta * weight;
        if flow.is_continue()
            && let Some(LastScatter { pdf, .. }) = self.last_scatter
        {
            self.trail.onward = Some(Onward::new(self.ray.direction, weight, pdf));
            self.before = Some(Before { radiance: self.path.radiance, beta: self.beta });
            (self.path.radiance, self.beta) = (Rgb::BLACK, Rgb::WHITE);
            self.from_light.begin_anew(scene);
        }
        flow
    }

    /// Adds what a surface sends out by itself.
    #[inline(always)]
    fn add_emitted(&mut self, scene: &Prepared, surface: &Surface<'_>) {
        let emitted = surface.emitted(scene);
        if !emitted.is_black() {
            let (triangle, wi) = (surface.triangle, self.ray.direction);
            let pdf_light = |from: &Receiver| {
                scene.lights.pdf_triangle(from, triangle, wi, (surface.point - from.point).length())
            };
            let emission = || scene.lights.pdf_emission(triangle);
            self.add_met(scene, emitted, Heuristic::Power, pdf_light, emission);
        }
        if self.is_direct_view {
            self.path.radiance += self.beta * surface.unlit(scene);
        }
    }

    /// A surface that is to scatter the path, as the choice of a light knows it: of the first one also what it mirrors. Later ones that others
    /// may join look different to each of them.
    #[inline(always)]
    fn receiver(&self, scene: &Prepared, surface: &Surface<'_>, shading: &Shading<'_>) -> Receiver {
        if self.scatterings == 0 { surface.receiver_for(scene, shading) } else { surface.receiver() }
    }

    /// Samples the BSDF for the next direction; breaks where the path ends.
    #[inline(always)]
    fn send_on(
        &mut self,
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        receiver: Receiver,
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
        self.is_direct_view &= sample.lobe.is_delta();
        self.last_scatter = (!sample.lobe.is_delta()).then_some(LastScatter { receiver, pdf: sample.pdf });
        match self.last_scatter {
            None => self.from_light.mirror(scene, surface, shading, wi),
            Some(_) => {
                self.from_light.scatter(self.from_light.towards(scene, surface, shading, wi), sample.pdf);
            }
        }

        // End paths that carry little, and let survivors stand for them.
        if self.scatterings > ROULETTE_START && scene.techniques.roulette {
            let before = self.before.map_or(1.0, |before| before.beta.max_channel().max(LEAST_BEFORE));
            let carried = self.beta.max_channel() * before * self.eta_scale;
            let survival = (carried / SPARED).min(MAX_SURVIVAL);
            if u_roulette >= survival {
                return ControlFlow::Break(());
            }
            self.beta = self.beta / survival;
        }
        ControlFlow::Continue(())
    }
}

/// What the camera's ray of a path meets.
#[inline]
pub(super) fn first_surface(scene: &Prepared, sampler: &Sampler, ray: &Ray) -> Option<Hit> {
    next_surface(scene, sampler, 1, ray, ray.direction)
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
