//! One sample again, told vertex by vertex.

use super::Prepared;
use super::film::{camera_sample, sample_pixel};
use super::path::Walk;
use super::reuse::{block_around, gather};
use crate::color::Rgb;

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

/// A path told vertex by vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// The sample's radiance as it counts in the picture, with what it has from its neighbours' paths: not finite if the sample is bad.
    pub radiance: Rgb,
    /// Where the path went.
    pub vertices: Vec<ReplayVertex>,
}

/// Traces sample `sample` of pixel (x, y) again and tells where it went.
pub fn replay(scene: &Prepared, x: u32, y: u32, sample: u32) -> Replay {
    let mut vertices = Vec::new();
    let Ok(size) = &scene.path_reuse else {
        let path = sample_pixel(scene, x, y, sample, |v| vertices.push(v));
        return Replay { radiance: path.radiance, vertices };
    };
    let mut own = 0;
    let mut block = Vec::new();
    for place in block_around((x, y), size.sides(), scene.size()) {
        let (sampler, ray) = camera_sample(scene, place.0, place.1, sample);
        let mut walk = Walk::shared(scene, ray);
        if place == (x, y) {
            own = block.len();
            walk.go_on(scene, &sampler, None, |_| false, |v| vertices.push(v));
        } else {
            walk.go_on(scene, &sampler, None, |_| false, |_| ());
        }
        block.push(walk);
    }
    let mut radiance = Rgb::BLACK;
    gather(scene, &block, |(place, path)| {
        if place == own {
            radiance = path.radiance;
        }
    });
    Replay { radiance, vertices }
}
