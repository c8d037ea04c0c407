//! One sample again, told vertex by vertex.

use super::Prepared;
use super::film::{camera_sample, sample_pixel};
use super::path::{PathSample, Walk, first_surface};
use super::reuse::{block_around, gather};
use super::splitting::{BRANCHES, Joint, of_branch};
use crate::color::Rgb;
use crate::math::sobol::Sampler;

/// One vertex of a replayed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayVertex {
    /// World position.
    pub point: [f32; 3],
    /// The radiance gathered up to here, this surface's emission included. Beyond the second surface, where neighbours may join the path, it
    /// lacks what is weighed against light paths.
    pub radiance: Rgb,
    /// The throughput with which the path arrived.
    pub beta: Rgb,
}

/// A sample told vertex by vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// The sample's radiance as it counts in the picture, with what it has from its neighbours' paths: not finite if the sample is bad.
    pub radiance: Rgb,
    /// Where its path went, or each of the branches that it has from the first surface on.
    pub branches: Vec<Vec<ReplayVertex>>,
}

/// Traces sample `sample` of pixel (x, y) again and tells where it went.
pub fn replay(scene: &Prepared, x: u32, y: u32, sample: u32) -> Replay {
    if scene.path_reuse.is_err() && scene.splitting.is_err() {
        let mut vertices = Vec::new();
        let path = sample_pixel(scene, x, y, sample, |v| vertices.push(v));
        return Replay { radiance: path.radiance, branches: vec![vertices] };
    }
    if scene.splitting.is_err() {
        let (path, vertices) = again(scene, (x, y), sample, |sampler| sampler);
        return Replay { radiance: path.radiance, branches: vec![vertices] };
    }
    let mut joint = Joint::default();
    let mut branches = Vec::new();
    for branch in BRANCHES {
        let (path, vertices) = again(scene, (x, y), sample, |sampler| of_branch(scene, sampler, branch));
        joint.add(&path, 0);
        branches.push(vertices);
    }
    Replay { radiance: joint.path.radiance, branches }
}

/// Traces a sample of a pixel's block, with such numbers from the first surface on.
fn again(
    scene: &Prepared,
    pixel: (u32, u32),
    sample: u32,
    numbers: impl Fn(Sampler) -> Sampler,
) -> (PathSample, Vec<ReplayVertex>) {
    let sides = scene.path_reuse.as_ref().map_or((1, 1), |size| size.sides());
    let (mut own, mut vertices) = (0, Vec::new());
    let mut block = Vec::new();
    for place in block_around(pixel, sides, scene.size()) {
        let (sampler, ray) = camera_sample(scene, place.0, place.1, sample);
        let first = first_surface(scene, &sampler, &ray);
        let mut walk =
            if scene.path_reuse.is_ok() { Walk::shared(scene, ray) } else { Walk::new(scene, ray) };
        if place == pixel {
            own = block.len();
        }
        walk.go_on_from_first(
            scene,
            &numbers(sampler),
            first,
            |_| false,
            |vertex| {
                if place == pixel {
                    vertices.push(vertex);
                }
            },
        );
        block.push(walk);
    }
    let mut found = PathSample::default();
    gather(scene, &block, |(place, path)| {
        if place == own {
            found = *path;
        }
    });
    (found, vertices)
}
