//! Animations at one moment: the transforms and morph weights that their samplers give (glTF 2.0, appendix C).

use std::collections::BTreeMap;

use glam::DQuat;
use gltf::json::animation::{Animation, Interpolation, Property, Sampler};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::accessor::Accessors;
use super::buffers::lookup;
use super::error::GltfError;
use crate::import::ImportOptions;
use crate::math::Real;
use crate::record::Warning;

/// What an animation says about nodes at a moment. Without one it is empty: the file's own rest pose.
#[derive(Default)]
pub(super) struct Pose {
    nodes: BTreeMap<usize, NodePose>,
}

/// What an animation says about a node.
#[derive(Default)]
pub(super) struct NodePose {
    /// Replaces the node's translation.
    pub(super) translation: Option<[f32; 3]>,
    /// Replaces the node's rotation.
    pub(super) rotation: Option<[f32; 4]>,
    /// Replaces the node's scale.
    pub(super) scale: Option<[f32; 3]>,
    /// Replaces the weights of the node's morph targets.
    pub(super) weights: Option<Vec<f32>>,
}

impl Pose {
    /// The pose that `options` ask for: the rest pose, or that of an animation (the first unless it is named) at a time.
    pub(super) fn sample(
        root: &Root,
        accessors: &Accessors,
        options: &ImportOptions,
        file: &str,
        warnings: &mut Vec<Warning>,
    ) -> Result<Self, GltfError> {
        let mut pose = Self::default();
        if options.time.is_none() && options.animation.is_none() {
            return Ok(pose);
        }
        let time = options.time.unwrap_or(0.0);
        if !time.is_finite() {
            let (element, property, expected) = ("the import".to_owned(), "time", "finite");
            return Err(GltfError::Range { element, property, value: time, expected });
        }
        let Some((index, animation)) = choose(root, options.animation.as_deref())? else {
            warnings.push(Warning::new(file, "no animation: the time asked for is of no effect"));
            return Ok(pose);
        };
        for (i, channel) in animation.channels.iter().enumerate() {
            let element = format!("animations[{index}].channels[{i}]");
            let Checked::Valid(property) = channel.target.path else {
                let message =
                    "it moves something else than translation, rotation, scale or weights, and is ignored";
                warnings.push(Warning::new(format!("{file}: {element}"), message));
                continue;
            };
            if channel.target.node.value() == NO_NODE {
                continue; // The specification says so.
            }
            let node = channel.target.node.value();
            let json = lookup(&root.nodes, node, &element, "nodes")?;
            if json.matrix.is_some() && property != Property::MorphTargetWeights {
                let message =
                    format!("nodes[{node}] has a matrix, which an animation can't move; it is ignored");
                warnings.push(Warning::new(format!("{file}: {element}"), message));
                continue;
            }
            let sampler = lookup(&animation.samplers, channel.sampler.value(), &element, "samplers")?;
            let name = format!("animations[{index}].samplers[{}]", channel.sampler.value());
            let track = Track { sampler, name, accessors, time };
            let moved = pose.nodes.entry(node).or_default();
            match property {
                Property::Translation => moved.translation = track.value(lerp)?,
                Property::Scale => moved.scale = track.value(lerp)?,
                Property::Rotation => moved.rotation = track.value(slerp)?,
                Property::MorphTargetWeights => {
                    let element = format!("nodes[{node}]");
                    let Some(mesh) = json.mesh else {
                        let property = "mesh, whose weights an animation moves";
                        return Err(GltfError::Missing { element, property });
                    };
                    let mesh = lookup(&root.meshes, mesh.value(), &element, "meshes")?;
                    let targets = mesh.primitives.iter().flat_map(|p| &p.targets).map(Vec::len).max();
                    let weights = track.values::<1>(targets.unwrap_or(0), lerp)?;
                    moved.weights = Some(weights.into_iter().map(|[weight]| weight).collect());
                }
            }
        }
        Ok(pose)
    }

    /// What is said about `nodes[index]`.
    pub(super) fn of(&self, index: usize) -> Option<&NodePose> {
        self.nodes.get(&index)
    }
}

/// Stands for the node of a channel that names none: opening the file puts it there.
pub(super) const NO_NODE: usize = u32::MAX as usize;

/// The animation called `name`, or the first, if there are any, with its index.
fn choose<'a>(root: &'a Root, name: Option<&str>) -> Result<Option<(usize, &'a Animation)>, GltfError> {
    let Some(name) = name else { return Ok(root.animations.first().map(|first| (0, first))) };
    let found = root.animations.iter().enumerate().find(|(_, a)| a.name.as_deref() == Some(name));
    found.map(Some).ok_or_else(|| GltfError::Unknown {
        kind: "animation",
        name: name.to_owned(),
        known: root.animations.iter().filter_map(|a| a.name.clone()).collect(),
    })
}

/// A sampler at a time.
struct Track<'a> {
    sampler: &'a Sampler,
    name: String,
    accessors: &'a Accessors<'a>,
    time: f32,
}

impl Track<'_> {
    /// The one value of a sampler.
    fn value<const N: usize>(&self, between: Between<N>) -> Result<Option<[f32; N]>, GltfError> {
        Ok(self.values(1, between)?.pop())
    }

    /// The sampler's values, `width` of them at each of its times. Before the first and after the last time they stay as they are.
    fn values<const N: usize>(&self, width: usize, between: Between<N>) -> Result<Vec<[f32; N]>, GltfError> {
        let read = |index: Index<_>| self.accessors.floats::<N>(index.value(), &self.name);
        let input: Vec<f32> = self
            .accessors
            .floats::<1>(self.sampler.input.value(), &self.name)?
            .into_iter()
            .flatten()
            .collect();
        let invalid =
            |property, expected| GltfError::Invalid { element: self.name.clone(), property, expected };
        let increasing = input.windows(2).all(|pair| pair[0] < pair[1]);
        let (Some(&first), Some(&last)) = (input.first(), input.last()) else {
            return Err(invalid("input", "at least one time"));
        };
        if !increasing || !first.is_finite() || !last.is_finite() {
            return Err(invalid("input", "finite times that increase"));
        }
        let Checked::Valid(interpolation) = self.sampler.interpolation else {
            return Err(invalid("interpolation", "LINEAR, STEP or CUBICSPLINE"));
        };
        let output = read(self.sampler.output)?;
        let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if output.len() as u128 != input.len() as u128 * width as u128 * parts {
            let expected = "as many values as its times need, three for each with CUBICSPLINE";
            return Err(invalid("output", expected));
        }

        let time = self.time.clamp(first, last);
        let k = input.partition_point(|&t| t <= time).saturating_sub(1);
        let next = (k + 1).min(input.len() - 1);
        let span = f64::from(input[next]) - f64::from(input[k]);
        let t = if span > 0.0 { (f64::from(time) - f64::from(input[k])) / span } else { 0.0 };
        Ok((0..width)
            .map(|i| {
                let at = |key: usize| output[key * width + i];
                match interpolation {
                    Interpolation::Step => at(k),
                    Interpolation::Linear => between(at(k), at(next), t),
                    Interpolation::CubicSpline => {
                        // In-tangents, values and out-tangents of a time follow each other.
                        let part = |key: usize, part: usize| output[(key * 3 + part) * width + i];
                        hermite(part(k, 1), part(k, 2), part(next, 0), part(next, 1), t, span)
                    }
                }
            })
            .collect())
    }
}

/// What lies between two values.
type Between<const N: usize> = fn([f32; N], [f32; N], f64) -> [f32; N];

fn lerp<const N: usize>(a: [f32; N], b: [f32; N], t: f64) -> [f32; N] {
    std::array::from_fn(|i| (f64::from(a[i]) * (1.0 - t) + f64::from(b[i]) * t) as f32)
}

/// Spherical interpolation the shorter way round (glTF 2.0, C.4). What is no rotation stays as it is, for the node to refuse.
fn slerp(a: [f32; 4], b: [f32; 4], t: f64) -> [f32; 4] {
    let unit = |q: [f32; 4]| DQuat::from_array(q.map(f64::from)).normalize();
    let (a_unit, mut b_unit) = (unit(a), unit(b));
    if !a_unit.is_finite() || !b_unit.is_finite() {
        return if t < 1.0 { a } else { b };
    }
    let mut cosine = a_unit.dot(b_unit);
    if cosine < 0.0 {
        (cosine, b_unit) = (-cosine, -b_unit);
    }
    // Nearly the same rotation: the arc is its chord.
    let (wa, wb) = if cosine > 1.0 - 1e-9 {
        (1.0 - t, t)
    } else {
        let angle = Real::acos(cosine);
        let sine = Real::sin(angle);
        (Real::sin((1.0 - t) * angle) / sine, Real::sin(t * angle) / sine)
    };
    (a_unit * wa + b_unit * wb).normalize().to_array().map(|c| c as f32)
}

/// The cubic spline of glTF 2.0, C.5: `out` and `into` are the tangents at its two ends, per second.
fn hermite<const N: usize>(
    a: [f32; N],
    out: [f32; N],
    into: [f32; N],
    b: [f32; N],
    t: f64,
    span: f64,
) -> [f32; N] {
    let (t2, t3) = (t * t, t * t * t);
    std::array::from_fn(|i| {
        let [a, out, into, b] = [a, out, into, b].map(|v| f64::from(v[i]));
        ((2.0 * t3 - 3.0 * t2 + 1.0) * a
            + span * (t3 - 2.0 * t2 + t) * out
            + (3.0 * t2 - 2.0 * t3) * b
            + span * (t3 - t2) * into) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_go_the_shorter_way_round() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let quarter_turn = [0.0, 0.0, half, half];
        let eighth = slerp([0.0, 0.0, 0.0, 1.0], quarter_turn, 0.5);
        assert!((eighth[2] - 0.382_683_43).abs() < 1e-6, "{eighth:?}");
        let other_sign = slerp([0.0, 0.0, 0.0, 1.0], quarter_turn.map(|c| -c), 0.5);
        assert_eq!(eighth, other_sign);
        assert_eq!(slerp(quarter_turn, quarter_turn, 0.3), quarter_turn);
        assert_eq!(slerp([0.0; 4], quarter_turn, 0.3), [0.0; 4], "no rotation");
    }

    #[test]
    fn splines_pass_through_their_ends_with_their_tangents() {
        let at = |t| hermite([1.0], [2.0], [-1.0], [5.0], t, 2.0)[0];
        assert_eq!((at(0.0), at(1.0)), (1.0, 5.0));
        assert!(((at(1e-4) - at(0.0)) / 2e-4 - 2.0).abs() < 1e-2);
    }
}
