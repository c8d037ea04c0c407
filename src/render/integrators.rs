//! What is worked out along a camera ray: radiance by path tracing, or one of Aris' simpler looks at a scene.
//!
//! All share the film: samples, filter, replicates and data layers are the same whatever is integrated.

use std::f32::consts::PI;

use glam::Vec3;

use super::Prepared;
use super::direct::{direct_light, transmittance};
use super::from_light::FromLight;
use super::path::{PathSample, first_hit, next_surface, trace};
use super::replay::ReplayVertex;
use super::surface::Surface;
use crate::accel::Ray;
use crate::color::Rgb;
use crate::disney::Model;
use crate::light::LightPlace;
use crate::math::sobol::{Purpose, Sampler};
use crate::math::{Frame, warp};
use crate::settings::Integrator;

/// One sample of what the settings ask for. `inspect` is called at each vertex with what was gathered so far.
#[inline]
pub(super) fn integrate(
    scene: &Prepared,
    sampler: &Sampler,
    ray: Ray,
    mut inspect: impl FnMut(ReplayVertex),
) -> PathSample {
    match scene.settings.integrator {
        Integrator::Path => trace(scene, sampler, ray, inspect),
        Integrator::Whitted => whitted(scene, sampler, ray, inspect),
        Integrator::Normals => {
            at_first(scene, sampler, &ray, inspect, |s, _| rgb(s.front_normal(scene).abs()))
        }
        Integrator::Albedo => at_first(scene, sampler, &ray, inspect, |s, _| albedo(scene, s)),
        Integrator::DiffuseAlbedo => at_first(scene, sampler, &ray, inspect, |s, _| {
            if is_diffuse(scene, s.triangle) { albedo(scene, s) } else { Rgb::BLACK }
        }),
        Integrator::Depths => {
            at_first(scene, sampler, &ray, inspect, |s, _| Rgb::grey(1.0 / scene.camera.depth_of(s.point)))
        }
        Integrator::Ao => {
            at_first(scene, sampler, &ray, inspect, |s, rays| ambient_occlusion(scene, sampler, s, rays))
        }
        Integrator::Point { position, energy } => at_first(scene, sampler, &ray, inspect, |s, rays| {
            point_light(scene, s, Vec3::from(position) - scene.geometry.origin(), energy.into(), rays)
        }),
        Integrator::EmitterCheck => {
            at_first(scene, sampler, &ray, &mut inspect, |s, rays| emitter_check(scene, sampler, s, rays))
        }
    }
}

/// What `value` makes of the first surface, and black where there is none.
fn at_first(
    scene: &Prepared,
    sampler: &Sampler,
    ray: &Ray,
    mut inspect: impl FnMut(ReplayVertex),
    value: impl FnOnce(&Surface<'_>, &mut u64) -> Rgb,
) -> PathSample {
    let mut path = PathSample { rays: 1, ..PathSample::default() };
    if let Some(hit) = next_surface(scene, sampler, 1, ray, ray.direction) {
        let surface = Surface::new(scene, ray, &hit);
        path.first = Some(first_hit(scene, ray, &surface, surface.shading(scene, &mut None).as_ref()));
        path.radiance = value(&surface, &mut path.rays);
        let point = surface.in_world(scene).into();
        inspect(ReplayVertex { point, radiance: path.radiance, beta: Rgb::WHITE });
    }
    path
}

fn rgb(v: Vec3) -> Rgb {
    Rgb::from(v.to_array())
}

fn albedo(scene: &Prepared, surface: &Surface<'_>) -> Rgb {
    surface.material.bsdf(&scene.scene, &surface.at, &mut None).albedo()
}

fn is_diffuse(scene: &Prepared, triangle: u32) -> bool {
    let material = scene.scene.instances[scene.geometry.instance_of(triangle)].material;
    scene.scene.materials[material.0 as usize].item.model == Model::Diffuse
}

/// ∫ V·cos θ/π over the hemisphere, without a limit of distance: with directions sampled by the cosine, what each sees is the mean.
fn ambient_occlusion(scene: &Prepared, sampler: &Sampler, surface: &Surface<'_>, rays: &mut u64) -> Rgb {
    let [_, u0, u1, _] = sampler.set(1, Purpose::Bsdf);
    let frame = Frame::from_normal(surface.front_normal(scene));
    let wi = frame.world_from_local(warp::cosine_hemisphere([u0, u1])).normalize();
    *rays += 1;
    transmittance(scene, &surface.leave(wi))
}

/// Φ/(4π²)·max(0, cos θ)/d²·V: a point light of power Φ on a white Lambertian surface.
fn point_light(scene: &Prepared, surface: &Surface<'_>, position: Vec3, energy: Rgb, rays: &mut u64) -> Rgb {
    let to_light = position - surface.point;
    let distance = to_light.length();
    let wi = to_light / distance;
    let cos = surface.front_normal(scene).dot(wi);
    // In the light itself there is no direction.
    if !(cos > 0.0 && distance > 0.0) {
        return Rgb::BLACK;
    }
    *rays += 1;
    let passing = transmittance(scene, &surface.reach(wi, position));
    energy * passing * (cos / (4.0 * PI * PI) / (distance * distance))
}

/// ∫ Le·V·f/d² over the lights' areas: direct light without the cosines at surface and light. A point light counts with its
/// intensity; the environment, which has no distance, is left out.
fn emitter_check(scene: &Prepared, sampler: &Sampler, surface: &Surface<'_>, rays: &mut u64) -> Rgb {
    let mut varying = None;
    let Some(shading) = surface.shading(scene, &mut varying) else { return Rgb::BLACK };
    let u = sampler.set(1, Purpose::Light);
    let Some(sample) = scene.lights.sample(&surface.receiver(), u) else { return Rgb::BLACK };
    let cos_light = match sample.place {
        LightPlace::Surface { triangle, barycentric } => scene
            .geometry
            .point_on(triangle, barycentric)
            .geometric_normal()
            .map_or(1.0, |n| n.dot(sample.wi).abs()),
        LightPlace::Point { .. } => 1.0,
        LightPlace::Far { .. } => return Rgb::BLACK,
    };
    let cosines = shading.frame.local_from_world(sample.wi).z.abs() * cos_light;
    let (way, medium) = (FromLight::CAMERA, scene.camera_medium);
    let direct = direct_light(scene, surface, &shading, &sample, way, medium, rays);
    let direct = direct.radiance / direct.pdf;
    // What arrives at grazing angles below the smallest float is nothing.
    if direct.is_black() { direct } else { direct / cosines }
}

/// A specular path goes on with this probability, after as many vertices as few are longer than.
const SURVIVAL: f32 = 0.95;
const ROULETTE_START: u32 = 4;

/// Whitted (1980): emission and direct light at the first surface that is not purely specular, and emission on the way to it.
fn whitted(
    scene: &Prepared,
    sampler: &Sampler,
    camera_ray: Ray,
    mut inspect: impl FnMut(ReplayVertex),
) -> PathSample {
    let mut path = PathSample::default();
    let (mut ray, mut beta, mut medium) = (camera_ray, Rgb::WHITE, scene.camera_medium);
    for vertex in 1.. {
        path.rays += 1;
        let Some(hit) = next_surface(scene, sampler, vertex, &ray, ray.direction) else {
            if let Some((radiance, _)) = scene.lights.environment(ray.direction) {
                path.radiance += beta * radiance * super::medium::transmittance(medium, f32::INFINITY);
            }
            break;
        };
        let surface = Surface::new(scene, &ray, &hit);
        medium = surface.medium_before(medium);
        beta *= super::medium::transmittance(medium, hit.t);
        path.radiance += beta * (surface.emitted(scene) + surface.unlit(scene));
        let mut varying = None;
        let shading = surface.shading(scene, &mut varying);
        if path.first.is_none() {
            path.first = Some(first_hit(scene, &camera_ray, &surface, shading.as_ref()));
        }
        inspect(ReplayVertex { point: surface.in_world(scene).into(), radiance: path.radiance, beta });
        let Some(shading) = shading else { break };
        if vertex > scene.settings.max_depth {
            break;
        }
        if !shading.bsdf.is_delta() {
            let u = sampler.set(vertex, Purpose::Light);
            if let Some(sample) = scene.lights.sample(&surface.receiver(), u) {
                let (way, rays) = (FromLight::CAMERA, &mut path.rays);
                let direct = direct_light(scene, &surface, &shading, &sample, way, medium, rays);
                path.radiance += beta * direct.radiance / direct.pdf;
            }
            break;
        }
        let [u_lobe, u0, u1, u_roulette] = sampler.set(vertex, Purpose::Bsdf);
        let Some(sample) = shading.bsdf.sample(shading.wo, u_lobe, [u0, u1]) else { break };
        let wi = shading.frame.world_from_local(sample.wi).normalize();
        if surface.same_side(wi) == sample.lobe.is_transmission() {
            break;
        }
        beta *= sample.f * (sample.wi.z.abs() / sample.pdf);
        if vertex > ROULETTE_START {
            if u_roulette >= SURVIVAL {
                break;
            }
            beta = beta / SURVIVAL;
        }
        ray = surface.leave(wi);
        medium = surface.medium_towards(wi, medium);
    }
    path
}
