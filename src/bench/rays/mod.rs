//! Rays as paths shoot them, made beforehand, and how fast a tree answers them.

mod race;

use glam::Vec2;
use rayon::prelude::*;

pub use race::{Query, Rate, RayReport, SetReport, race, ray_table};

use crate::accel::{Bvh, Ray};
use crate::math::{Frame, hash, warp};
use crate::render::{Departure, Prepared};

/// Rays of one kind, in the order of the picture's tiles.
#[derive(Clone, Debug)]
pub struct RaySet {
    /// Where they come from.
    pub kind: RayKind,
    /// The rays, relative to the geometry's origin.
    pub rays: Vec<Ray>,
}

/// Where rays come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// The camera, through the middle of each pixel.
    Camera,
    /// The first surface, in directions by the cosine around its normal.
    FirstBounce,
    /// The surface after that.
    SecondBounce,
    /// The first surface, towards a light.
    Shadow,
}

impl RayKind {
    /// The name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::FirstBounce => "bounce 1",
            Self::SecondBounce => "bounce 2",
            Self::Shadow => "shadow",
        }
    }
}

/// The rays of a picture: from the camera, after one and after two diffuse bounces, and from the first surfaces to the lights. Kinds
/// of which there are none, as where nothing is hit or there is no light, are left out.
pub fn ray_sets(scene: &Prepared) -> Vec<RaySet> {
    let tree = scene.geometry().tree();
    let camera = camera_rays(scene);
    let first = footholds(scene, tree, &camera);
    let bounced_once = bounced(&first, 1);
    let bounced_twice = bounced(&footholds(scene, tree, &bounced_once), 2);
    let sets = [
        (RayKind::Camera, camera),
        (RayKind::FirstBounce, bounced_once),
        (RayKind::SecondBounce, bounced_twice),
        (RayKind::Shadow, shadow_rays(scene, &first)),
    ];
    sets.into_iter().filter(|(_, rays)| !rays.is_empty()).map(|(kind, rays)| RaySet { kind, rays }).collect()
}

fn camera_rays(scene: &Prepared) -> Vec<Ray> {
    let through = |(x, y): (u32, u32)| scene.camera_ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
    scene.pixels().into_iter().map(through).collect()
}

/// Where a ray has hit.
struct Foothold {
    departure: Departure,
    /// The ray's place among its like: what is random here depends on it.
    index: u64,
}

impl Foothold {
    /// Four numbers in [0, 1), others for each purpose.
    fn numbers(&self, purpose: u64) -> [f32; 4] {
        [0, 1, 2, 3].map(|i| {
            let word = hash::combine(hash::combine(self.index, purpose), i);
            hash::unit_f32((word >> 32) as u32)
        })
    }
}

fn footholds(scene: &Prepared, tree: &Bvh, rays: &[Ray]) -> Vec<Foothold> {
    let foothold = |(index, ray): (usize, &Ray)| {
        let departure = scene.geometry().departure(ray, &tree.closest(ray)?);
        Some(Foothold { departure, index: index as u64 })
    };
    rays.par_iter().enumerate().filter_map(foothold).collect()
}

fn bounced(footholds: &[Foothold], bounce: u64) -> Vec<Ray> {
    let ray = |foothold: &Foothold| {
        let [u0, u1, ..] = foothold.numbers(bounce);
        let local = warp::cosine_hemisphere([u0, u1]);
        foothold
            .departure
            .ray(Frame::from_normal(foothold.departure.viewed_normal()).world_from_local(local).normalize())
    };
    footholds.par_iter().map(ray).collect()
}

/// Rays to lights above the surface: to others the renderer shoots none.
fn shadow_rays(scene: &Prepared, footholds: &[Foothold]) -> Vec<Ray> {
    let ray = |foothold: &Foothold| {
        let ray = scene.shadow_ray(&foothold.departure, foothold.numbers(0))?;
        (ray.direction.dot(foothold.departure.viewed_normal()) > 0.0).then_some(ray)
    };
    footholds.par_iter().filter_map(ray).collect()
}
