//! Paths from the lights: what they bring to each surface is added to the pixel that sees it there.
//!
//! A camera's path finds light that a shiny ball throws onto a wall only if it happens to meet the ball just where that mirrors the light;
//! a path from the light is sent there by the ball. Both count, weighed by multiple importance sampling ([`super::from_light`]).
//!
//! All terms are those of the camera's path: at each vertex the BSDF, the shading frame and what is see-through are asked for the view
//! from the camera's side, so that what is not reciprocal, like smooth normals (Veach 1997, section 5.3), needs no correction of its
//! own. A path that is sent on from wi to wo with a density per solid angle is multiplied by
//! f(wo, wi)·|cos θi|·c(wo)/(c(wi)·pdf), with c the cosines to the geometric normal.

use glam::{Vec2, Vec3};

use super::Prepared;
use super::camera::Sight;
use super::direct::transmittance;
use super::from_light::mirrors_back;
use super::medium::{self, Medium};
use super::mis::power;
use super::offset::{offset, ray_to};
use super::path::next_surface;
use super::surface::{Shading, Surface};
use crate::accel::Ray;
use crate::color::Rgb;
use crate::disney::{BsdfSample, Lobe};
use crate::light::{Emission, Receiver, SkyPlace};
use crate::math::sobol::{Purpose, Sampler};
use crate::math::{Frame, warp};

/// That a scene has light paths, and how many.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightPaths {
    /// For each sample that every pixel gets.
    pub(super) per_sample: u32,
}

impl LightPaths {
    /// The light paths of so many samples of each pixel.
    pub(super) fn paths(&self, samples: u32) -> u64 {
        u64::from(samples) * u64::from(self.per_sample)
    }
}

/// What a light path adds to the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// The position on the film.
    pub(super) film: Vec2,
    /// Per pixel of the film, weighed.
    pub(super) radiance: Rgb,
    /// How many times as densely the camera's paths find it.
    pub(super) others: f32,
}

/// A light path under way.
#[derive(Clone, Copy)]
struct Flight {
    ray: Ray,
    /// The power that it carries: what arrives at a surface, over the density of the path.
    beta: Rgb,
    medium: Medium,
    scatterings: u32,
    /// How much likelier than by light paths this one is found by the camera's: [`super::from_light`]'s ratio the other way, as far as the
    /// path has come. Of both ways, the root of the sum of squares.
    others: f32,
    /// Where it began, while light can still be sampled there.
    light: Option<Start>,
}

/// Where a light path begins.
#[derive(Clone, Copy)]
enum Start {
    Surface {
        triangle: u32,
        point: Vec3,
    },
    /// A place of the environment.
    Far(SkyPlace),
}

/// Roulette begins at the first surface: most of what these paths are for happens there. In the Cornell boxes the error stays what it is with
/// roulette after the fourth, as for the camera's paths, and the paths cost two thirds.
const MAX_SURVIVAL: f32 = 0.95;

/// Traces one path. `splat` takes what is seen of it; the result is the number of rays.
pub(super) fn trace(scene: &Prepared, sampler: &Sampler, mut splat: impl FnMut(Seen)) -> u64 {
    let Some(mut flight) = start(scene, sampler) else { return 0 };
    let most = flight.beta.max_channel();
    let mut rays = 0;
    for vertex in 1.. {
        // Find the next surface.
        rays += 1;
        let view = -flight.ray.direction;
        let Some(hit) = next_surface(scene, sampler, vertex, &flight.ray, view) else { break };
        let surface = Surface::new(scene, &flight.ray, &hit);
        flight.medium = surface.medium_before(flight.medium);
        flight.beta *= medium::transmittance(flight.medium, hit.t);
        if flight.scatterings == scene.settings.max_depth {
            break;
        }
        let mut varying = None;
        let Some(shading) = surface.shading(scene, &mut varying) else { break };

        // Let the camera see it.
        let u_lens = || {
            let [u0, u1, ..] = sampler.set(vertex, Purpose::Camera);
            [u0, u1]
        };
        if let Some(sight) = scene.camera.see(surface.point, u_lens)
            && scene.is_on_film(sight.film)
            && !shading.bsdf.is_delta()
        {
            let seen = flight.seen(scene, &surface, &shading, &sight, &mut rays);
            seen.into_iter().for_each(&mut splat);
        }

        // Send it on.
        let [u_lobe, u0, u1, u_roulette] = sampler.set(vertex, Purpose::Bsdf);
        let Some(sample) = shading.bsdf.sample(shading.wo, u_lobe, [u0, u1]) else { break };
        let Some(next) = flight.scattered(scene, &surface, &shading, &sample) else { break };
        flight = next;
        if flight.beta.is_black() {
            break;
        }
        if scene.techniques.roulette {
            let survival = (flight.beta.max_channel() / most).min(MAX_SURVIVAL);
            if u_roulette >= survival {
                break;
            }
            flight.beta = flight.beta / survival;
        }
    }
    rays
}

/// Leaves a light.
#[inline]
fn start(scene: &Prepared, sampler: &Sampler) -> Option<Flight> {
    let [u0, u1, ..] = sampler.set(0, Purpose::Bsdf);
    let (ray, radiance, pdf, light) = match scene.lights.emit(sampler.set(0, Purpose::Light), [u0, u1])? {
        Emission::Surface { triangle, barycentric, is_front, pdf } => {
            let at = scene.geometry.point_on(triangle, barycentric);
            let front = at.geometric_normal()?;
            let normal = if is_front { front } else { -front };
            let local = warp::cosine_hemisphere([u0, u1]);
            let direction = Frame::from_normal(normal).world_from_local(local).normalize();
            let material = scene.material_of(triangle);
            let coverage = material.alpha(&scene.scene, &at, -direction);
            let radiance = material.emitted(&scene.scene, &at, is_front) * coverage;
            let (point, error) = at.position();
            let origin = offset(point, error, normal, direction);
            let ray = Ray { source: Some(triangle), ..Ray::new(origin, direction) };
            (ray, radiance, pdf, Start::Surface { triangle, point })
        }
        Emission::Far { origin, wi, radiance, pdf, sky } => {
            (Ray::new(origin, -wi), radiance, pdf, Start::Far(sky))
        }
    };
    let beta = radiance / pdf;
    let medium = scene.medium_around(&ray);
    let flight = Flight { ray, beta, medium, scatterings: 0, others: 1.0 / pdf, light: Some(light) };
    (!beta.is_black()).then_some(flight)
}

/// How a surface that a light path meets scatters its light to a viewer.
struct Turned<'s> {
    view: Shading<'s>,
    /// The BSDF times |cos θi|.
    f: Rgb,
    /// The density with which a camera's path would be scattered to where the light comes from.
    pdf: f32,
    /// The geometric cosine of wo over that of wi.
    cosines: f32,
}

impl<'s> Turned<'s> {
    #[inline]
    fn new(scene: &Prepared, surface: &Surface<'_>, shading: &Shading<'s>, wo: Vec3) -> Option<Self> {
        let view = surface.shading_from(scene, shading, wo)?;
        let (f, pdf) = surface.seen_from(wo).reflected(&view, surface.wo);
        let (c_camera, c_light) = (surface.geometric_cosine(wo), surface.geometric_cosine(surface.wo));
        Some(Self { view, f, pdf, cosines: c_camera / c_light })
    }
}

impl Flight {
    /// What the camera sees of the light that is brought to a surface.
    #[inline]
    fn seen(
        &self,
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        sight: &Sight,
        rays: &mut u64,
    ) -> Option<Seen> {
        let wo = -sight.direction;
        let Turned { view, f, pdf, cosines } =
            Turned::new(scene, surface, shading, wo).filter(|t| !t.f.is_black())?;
        let density =
            cosines * scene.camera.pixels_per_steradian(sight.direction) / (sight.distance * sight.distance);
        let receiver = || surface.seen_from(wo).receiver_for(scene, &view);
        let per_sample = scene.light_paths.as_ref().ok()?.per_sample as f32;
        let others =
            self.others_with(scene, surface, pdf, receiver) * density * scene.camera_weight() / per_sample;
        let radiance = self.beta * f * (density * power(others));
        // What the camera finds beyond all bounds more densely is left to it: its weight here is nothing, of what may be no number.
        if radiance.is_black() || !others.is_finite() {
            return None;
        }
        *rays += 1;
        let shadow = ray_to(sight.origin, surface.leave(wo).origin);
        let medium = surface.seen_from(wo).medium_before(scene.camera_medium);
        let passing = transmittance(scene, &shadow) * medium::transmittance(medium, sight.distance);
        let radiance = radiance * passing;
        (!radiance.is_black()).then_some(Seen { film: sight.film, radiance, others })
    }

    /// [`Self::others`] with the density `pdf` of the camera's path from here to where the light came from; at the first surface also with that
    /// of choosing the light.
    #[inline]
    fn others_with(
        &self,
        scene: &Prepared,
        surface: &Surface<'_>,
        pdf: f32,
        receiver: impl FnOnce() -> Receiver,
    ) -> f32 {
        let pdf_light = match self.light {
            None => 0.0,
            Some(Start::Far(sky)) => scene.lights.pdf_environment(&receiver(), sky),
            Some(Start::Surface { triangle, point }) => {
                let distance = (surface.point - point).length();
                scene.lights.pdf_triangle(&receiver(), triangle, surface.wo, distance)
            }
        };
        self.others * (pdf * pdf + pdf_light * pdf_light).sqrt()
    }

    /// The path after the surface sent it on; none where it ends.
    #[inline]
    fn scattered(
        &self,
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        sample: &BsdfSample,
    ) -> Option<Self> {
        let weight = sample.f * (sample.wi.z.abs() / sample.pdf);
        if sample.lobe == Lobe::StraightTransmission {
            return Some(Self { ray: surface.leave(self.ray.direction), beta: self.beta * weight, ..*self });
        }
        let wo = shading.frame.world_from_local(sample.wi).normalize();
        if surface.same_side(wo) == sample.lobe.is_transmission() {
            return None;
        }
        let (factor, others) = if sample.lobe.is_delta() {
            if !mirrors_back(scene, surface, shading, wo) {
                return None;
            }
            // Light is not squeezed as radiance is: eta² takes that back.
            let cosines = surface.geometric_cosine(wo) / surface.geometric_cosine(surface.wo);
            let scale = sample.eta * sample.eta * cosines * (shading.wo.z / sample.wi.z).abs();
            (weight * scale, self.others)
        } else {
            let Turned { f, pdf, cosines, .. } = Turned::new(scene, surface, shading, wo)?;
            let others = self.others_with(scene, surface, pdf, || surface.seen_from(wo).receiver());
            (f * (cosines / sample.pdf), others * cosines / sample.pdf)
        };
        Some(Self {
            ray: surface.leave(wo),
            beta: self.beta * factor,
            medium: surface.medium_towards(wo, self.medium),
            scatterings: self.scatterings + 1,
            others,
            light: None,
        })
    }
}
