//! A tree over many lights, to choose one by what may arrive from it.
//!
//! Conty Estévez and Kulla 2018; from the root down, chance decides between up to eight sets of lights by their importance at the
//! receiver ([`Clusters::importance`]). The same numbers along the same way give the probability of a light again.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec3, Vec3};

use super::Receiver;
use super::bounds::{Clusters, LightBounds, WIDTH};
use crate::math::Real;

/// Lights in a tree, by their index.
#[derive(Debug, Default)]
pub(super) struct LightTree {
    /// The root first; none where there is a single light.
    nodes: Vec<Node>,
    /// Where each light is.
    places: Vec<Place>,
}

/// Sets to choose between.
#[derive(Clone, Debug)]
struct Node {
    clusters: Clusters,
    links: [Link; WIDTH],
    /// Where in the tree it is itself; none for the root.
    place: Option<Place>,
}

#[derive(Clone, Copy, Debug)]
enum Link {
    Light(u32),
    Node(u32),
}

/// A lane of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    node: u32,
    lane: u32,
}

/// Splits by cost down to this depth, then in halves, so that no tree is deep.
const DEEPEST_BY_COST: u32 = 32;
/// Lights are sorted into so many slices along an axis, between which a set may be split.
const BUCKETS: usize = 12;
/// Sets larger than this are split on a thread of their own.
const PARALLEL: usize = 4096;
/// A set has at least this chance against the other, unless its light can't arrive: the bounds know nothing of shadows.
const LEAST_CHANCE: f32 = 1.0 / 1024.0;

impl LightTree {
    /// A tree over lights with these bounds.
    pub(super) fn new(bounds: &[LightBounds]) -> Self {
        let mut tree = Self { nodes: Vec::new(), places: vec![Place::default(); bounds.len()] };
        let mut lights: Vec<u32> = (0..bounds.len() as u32).collect();
        if let Some(Branch { bounds: _, below: Below::Fork(branches) }) = Branch::over(&mut lights, bounds, 0)
        {
            tree.push(*branches, None);
        }
        tree
    }

    /// Makes a node of a fork, and nodes of what is below.
    fn push(&mut self, fork: [Branch; 2], place: Option<Place>) {
        let mut branches = Vec::from(fork);
        // The set that tells least of its lights is the next to be replaced by its parts.
        while branches.len() < WIDTH
            && let Some(widest) = (0..branches.len())
                .filter(|&i| matches!(branches[i].below, Below::Fork(_)))
                .max_by(|&i, &j| branches[i].cost().total_cmp(&branches[j].cost()))
        {
            if let Below::Fork(parts) = branches.swap_remove(widest).below {
                branches.extend(*parts);
            }
        }
        let node = self.nodes.len() as u32;
        let sets: Vec<LightBounds> = branches.iter().map(|b| b.bounds).collect();
        self.nodes.push(Node { clusters: Clusters::new(&sets), links: [Link::Light(0); WIDTH], place });
        for (lane, branch) in branches.into_iter().enumerate() {
            let place = Place { node, lane: lane as u32 };
            self.nodes[node as usize].links[lane] = match branch.below {
                Below::Light(light) => {
                    self.places[light as usize] = place;
                    Link::Light(light)
                }
                Below::Fork(fork) => {
                    let next = self.nodes.len() as u32;
                    self.push(*fork, Some(place));
                    Link::Node(next)
                }
            };
        }
    }

    /// The light that `u` in [0, 1) falls on, and its probability; none where no light can arrive.
    #[inline]
    pub(super) fn sample(&self, receiver: &Receiver, mut u: f64) -> Option<(usize, f32)> {
        let mut link = if self.nodes.is_empty() { Link::Light(0) } else { Link::Node(0) };
        let mut probability = 1.0;
        loop {
            let node = match link {
                Link::Light(light) => {
                    return (light < self.places.len() as u32).then_some((light as usize, probability));
                }
                Link::Node(index) => &self.nodes[index as usize],
            };
            let chances = node.chances(receiver)?;
            let mut below = 0.0;
            let mut found = None;
            for (lane, &chance) in chances.iter().enumerate().filter(|(_, chance)| **chance > 0.0) {
                // Where rounding leaves a gap below 1, the last one fills it.
                found = Some((lane, chance, (u - below) / f64::from(chance)));
                below += f64::from(chance);
                if u < below {
                    break;
                }
            }
            let (lane, chance, rest) = found?;
            (u, probability, link) = (rest.min(1.0), probability * chance, node.links[lane]);
        }
    }

    /// The probability with which [`Self::sample`] chooses `light`.
    #[inline]
    pub(super) fn probability(&self, receiver: &Receiver, light: usize) -> f32 {
        let mut probability = 1.0;
        let mut place = (!self.nodes.is_empty()).then(|| self.places[light]);
        while let Some(Place { node, lane }) = place {
            let node = &self.nodes[node as usize];
            probability *= node.chances(receiver).map_or(0.0, |chances| chances[lane as usize]);
            place = node.place;
        }
        probability
    }
}

impl Node {
    /// The sets' probabilities; none where none can arrive.
    #[inline]
    fn chances(&self, receiver: &Receiver) -> Option<[f32; WIDTH]> {
        let importance = self.clusters.importance(receiver);
        let sum: f32 = importance.iter().sum();
        // Nor where a place is so far away that it is no number.
        if sum <= 0.0 || sum.is_nan() {
            return None;
        }
        let relative = importance.map(|i| if i > 0.0 { i / sum + LEAST_CHANCE } else { 0.0 });
        let scale = 1.0 / relative.iter().sum::<f32>();
        Some(relative.map(|r| r * scale))
    }
}

/// A tree in the making: of two branches everywhere.
struct Branch {
    bounds: LightBounds,
    below: Below,
}

enum Below {
    Light(u32),
    Fork(Box<[Branch; 2]>),
}

impl Branch {
    /// A branch over `lights`, which it sorts; none over none.
    fn over(lights: &mut [u32], bounds: &[LightBounds], depth: u32) -> Option<Self> {
        match lights {
            [] => None,
            [light] => Some(Self { bounds: bounds[*light as usize], below: Below::Light(*light) }),
            _ => {
                let middle = split(lights, bounds, depth);
                let (a, b) = lights.split_at_mut(middle);
                let (a, b) = if a.len() + b.len() > PARALLEL {
                    rayon::join(|| Self::over(a, bounds, depth + 1), || Self::over(b, bounds, depth + 1))
                } else {
                    (Self::over(a, bounds, depth + 1), Self::over(b, bounds, depth + 1))
                };
                let (a, b) = (a?, b?);
                let bounds = LightBounds::union(&a.bounds, &b.bounds);
                Some(Self { bounds, below: Below::Fork(Box::new([a, b])) })
            }
        }
    }

    /// How much a choice by its bounds may be wrong.
    fn cost(&self) -> f64 {
        Summary::of(&self.bounds).cost()
    }
}

/// Sorts lights into two sets that are worth telling apart; how many are in the first, neither none nor all.
fn split(lights: &mut [u32], bounds: &[LightBounds], depth: u32) -> usize {
    let center = |light: u32| bounds[light as usize].center();
    let (low, high) = lights.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &light| {
        (low.min(center(light)), high.max(center(light)))
    });
    let axis = (high - low).max_position();
    let along = |light: u32| f64::from(center(light)[axis]);
    let (low, width) = (f64::from(low[axis]), f64::from(high[axis]) - f64::from(low[axis]));
    let half = lights.len() / 2;
    if width <= 0.0 || width.is_nan() {
        return half;
    }
    // What fits into one node needs no thought.
    if depth >= DEEPEST_BY_COST || lights.len() <= WIDTH {
        lights.select_nth_unstable_by(half, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
        return half;
    }
    let bucket = |light: u32| (((along(light) - low) / width * BUCKETS as f64) as usize).min(BUCKETS - 1);
    let mut buckets = [Summary::EMPTY; BUCKETS];
    for &light in lights.iter() {
        buckets[bucket(light)].add(&Summary::of(&bounds[light as usize]));
    }
    let after = |last: usize| {
        let sum = |part: &[Summary]| {
            part.iter().fold(Summary::EMPTY, |mut sum, s| {
                sum.add(s);
                sum
            })
        };
        sum(&buckets[..=last]).cost() + sum(&buckets[last + 1..]).cost()
    };
    // The outermost lights are in the outermost buckets: no part is empty.
    let last = (0..BUCKETS - 1).min_by(|&a, &b| after(a).total_cmp(&after(b))).unwrap_or(0);
    let (first, second): (Vec<u32>, Vec<u32>) = lights.iter().partition(|&&light| bucket(light) <= last);
    lights[..first.len()].copy_from_slice(&first);
    lights[first.len()..].copy_from_slice(&second);
    first.len()
}

/// What the cost of a set depends on.
#[derive(Clone, Copy)]
struct Summary {
    low: Vec3,
    high: Vec3,
    intensity: f64,
    axes: DVec3,
    count: f64,
}

impl Summary {
    const EMPTY: Self =
        Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, intensity: 0.0, axes: DVec3::ZERO, count: 0.0 };

    fn of(bounds: &LightBounds) -> Self {
        // The mean of directions spread evenly over a cone.
        let mean = 0.5 * (1.0 + Real::cos(f64::from(bounds.cone.spread)));
        Self {
            low: bounds.low,
            high: bounds.high,
            intensity: f64::from(bounds.intensity),
            axes: bounds.cone.axis.as_dvec3() * mean,
            count: 1.0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.intensity += other.intensity;
        self.axes += other.axes;
        self.count += other.count;
    }

    /// Intensity × size² × the directions that it shines to, as if normals were spread evenly over a cone of their mean's length.
    fn cost(&self) -> f64 {
        if self.count == 0.0 {
            return 0.0;
        }
        let cos_spread = (2.0 * self.axes.length() / self.count - 1.0).clamp(-1.0, 1.0);
        let spread = Real::acos(cos_spread);
        let sin_spread = Real::sin(spread);
        let reach = (spread + FRAC_PI_2).min(PI);
        let directions = TAU * (1.0 - cos_spread)
            + FRAC_PI_2
                * (2.0 * reach * sin_spread - Real::cos(spread - 2.0 * reach) - 2.0 * spread * sin_spread
                    + cos_spread);
        let size_squared = (self.high.as_dvec3() - self.low.as_dvec3()).length_squared();
        self.intensity * size_squared * directions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disney::{Bsdf, DiffuseModel, Masking, Params};
    use crate::light::Gloss;
    use crate::light::bounds::Cone;
    use crate::math::Frame;
    use crate::math::Number;
    use crate::math::hash::{combine, unit_f32};
    use crate::scene::material::Sides;

    fn random(i: u32, salt: u64) -> f32 {
        unit_f32(combine(u64::from(i), salt) as u32)
    }

    fn anywhere(i: u32, salt: u64) -> Vec3 {
        Vec3::new(random(i, salt), random(i, salt + 1), random(i, salt + 2)) * 2.0 - 1.0
    }

    /// Small flat lights all over a cube, facing anywhere; every fifth to both sides.
    fn lights(n: u32) -> Vec<LightBounds> {
        let light = |i| {
            let (place, both_sides) = (anywhere(i, 1), i % 5 == 0);
            let cone = Cone {
                axis: anywhere(i, 4).normalize(),
                spread: 0.0,
                emission: FRAC_PI_2 as f32,
                both_sides,
            };
            let size = Vec3::splat(0.001);
            LightBounds { low: place - size, high: place + size, intensity: 0.01 + random(i, 7), cone }
        };
        (0..n).map(light).collect()
    }

    fn receiver(i: u32, sides: Sides) -> Receiver {
        Receiver { point: anywhere(i, 11), normal: anywhere(i, 14).normalize(), sides, gloss: None }
    }

    /// A direction on the side that the receiver is seen from.
    fn before(receiver: &Receiver, i: u32) -> Vec3 {
        (receiver.normal * 1.1 + anywhere(i, 31).normalize()).normalize()
    }

    /// A receiver with a highlight of this roughness that is this part of what it reflects.
    fn glossy(receiver: Receiver, i: u32, roughness: f32, part: f32) -> Receiver {
        let alpha_squared = roughness.sqr().sqr();
        let gloss = Gloss::new(before(&receiver, i), receiver.normal, alpha_squared, part);
        Receiver { gloss: Some(gloss), ..receiver }
    }

    /// What a light of no extent would give.
    fn irradiance(light: &LightBounds, receiver: &Receiver) -> f64 {
        let to_light = (light.center() - receiver.point).as_dvec3();
        let wi = to_light.normalize();
        let cos = |n: Vec3, both: bool| {
            let cos = n.as_dvec3().dot(wi);
            if both { cos.abs() } else { cos.max(0.0) }
        };
        let emitted = cos(-light.cone.axis, light.cone.both_sides);
        let received = cos(receiver.normal, receiver.sides == Sides::Both);
        f64::from(light.intensity) * emitted * received / to_light.length_squared()
    }

    #[test]
    fn what_shines_on_a_receiver_has_a_chance() {
        let lights = lights(500);
        let tree = LightTree::new(&lights);
        let mut wasted = 0.0;
        for i in 0..200 {
            for sides in [Sides::Front, Sides::Both] {
                let receiver = receiver(i, sides);
                let chances: Vec<f32> = (0..lights.len()).map(|l| tree.probability(&receiver, l)).collect();
                let sum: f64 = chances.iter().map(|&p| f64::from(p)).sum();
                assert!(sum < 1.0 + 1e-5, "{sum}");
                wasted += (1.0 - sum) / 400.0;
                for (light, &chance) in lights.iter().zip(&chances) {
                    assert!(chance > 0.0 || irradiance(light, &receiver) < 1e-6, "{light:?} {receiver:?}");
                }
            }
        }
        // Now and then nothing arrives from a set whose bounds promise something.
        assert!(wasted < 0.1, "{wasted}");
    }

    /// Also by χ²: of 99 degrees of freedom, one receiver in 10⁶ lies above 178.
    #[test]
    fn lights_come_as_often_as_their_probability_says() {
        let lights = lights(100);
        let tree = LightTree::new(&lights);
        for i in 0..30 {
            let diffuse = receiver(i, Sides::Front);
            let receiver = if i < 20 { diffuse } else { glossy(diffuse, i, 0.1 * (i - 19) as f32, 0.8) };
            let n = 20_000;
            let mut counts = vec![0.0f64; lights.len()];
            for k in 0..n {
                let u = f64::from(random(k, 21 + u64::from(i)));
                let Some((light, p)) = tree.sample(&receiver, u) else { continue };
                assert!((p - tree.probability(&receiver, light)).abs() <= 1e-5 * p);
                counts[light] += 1.0;
            }
            let chi_squared: f64 = (0..lights.len())
                .map(|l| (counts[l], f64::from(n) * f64::from(tree.probability(&receiver, l))))
                .map(
                    |(count, expected)| {
                        if expected > 0.0 { (count - expected).sqr() / expected.max(1.0) } else { count }
                    },
                )
                .sum();
            assert!(chi_squared < 178.0, "{chi_squared}");
        }
    }

    /// The variance of Σ E/p, relative to (Σ E)², against that of choosing by intensity alone.
    #[test]
    fn near_and_facing_lights_are_chosen_more_often() {
        let lights = lights(1000);
        let tree = LightTree::new(&lights);
        let total: f64 = lights.iter().map(|l| f64::from(l.intensity)).sum();
        let (mut by_tree, mut by_power) = (0.0, 0.0);
        for i in 0..100 {
            let receiver = receiver(i, Sides::Front);
            let shares = lights.iter().enumerate().filter_map(|(l, light)| {
                let e = irradiance(light, &receiver);
                (e > 1e-6).then(|| {
                    (e, f64::from(tree.probability(&receiver, l)), f64::from(light.intensity) / total)
                })
            });
            let sums = shares
                .fold([0.0; 3], |[e1, t, p], (e, tree, power)| [e1 + e, t + e * e / tree, p + e * e / power]);
            by_tree += sums[1] / (sums[0] * sums[0]) - 1.0;
            by_power += sums[2] / (sums[0] * sums[0]) - 1.0;
        }
        assert!(by_tree < 0.1 * by_power, "{by_tree} {by_power}");
    }

    /// The variance of Σ f·E/p on rough metal, and on plastic, against that of choosing by what arrives.
    #[test]
    fn lights_that_a_glossy_surface_mirrors_are_chosen_more_often() {
        let lights = lights(1000);
        let tree = LightTree::new(&lights);
        for (metallic, roughness, bound) in [(1.0, 0.2, 0.2), (1.0, 0.4, 0.5), (0.0, 0.3, 0.97)] {
            let params = Params { metallic, roughness, specular: 0.5, ..Params::default() };
            let bsdf = Bsdf::disney(&params, Masking::Matched, DiffuseModel::default());
            let (mut by_gloss, mut by_arrival) = (0.0, 0.0);
            for i in 0..100 {
                let plain = receiver(i, Sides::Front);
                let frame = Frame::from_normal(plain.normal);
                let wo = frame.local_from_world(before(&plain, i));
                let (alpha_squared, part) = bsdf.highlight(wo).expect("a highlight");
                let gloss = Gloss::new(frame.world_from_local(wo), plain.normal, alpha_squared, part);
                let seen = Receiver { gloss: Some(gloss), ..plain };
                let (mut sum, mut squares) = (0.0, [0.0; 2]);
                for (l, light) in lights.iter().enumerate() {
                    let wi = frame.local_from_world((light.center() - plain.point).normalize());
                    let reflected = f64::from(bsdf.eval(wo, wi).luminance()) * irradiance(light, &plain);
                    if reflected > 1e-9 {
                        let chances = [&seen, &plain].map(|r| f64::from(tree.probability(r, l)));
                        sum += reflected;
                        for (square, chance) in squares.iter_mut().zip(chances) {
                            *square += reflected * reflected / chance;
                        }
                    }
                }
                by_gloss += squares[0] / (sum * sum) - 1.0;
                by_arrival += squares[1] / (sum * sum) - 1.0;
            }
            assert!(by_gloss < bound * by_arrival, "{metallic} {roughness}: {by_gloss} {by_arrival}");
        }
    }

    #[test]
    fn no_light_is_no_choice_and_one_light_is_none() {
        let receiver = receiver(0, Sides::Both);
        assert_eq!(LightTree::new(&[]).sample(&receiver, 0.5), None);
        let one = LightTree::new(&lights(1));
        assert_eq!((one.sample(&receiver, 0.999), one.probability(&receiver, 0)), (Some((0, 1.0)), 1.0));
    }

    #[test]
    fn hostile_lights_are_still_lights() {
        let mut hostile = lights(3000);
        for (i, light) in hostile.iter_mut().enumerate() {
            match i % 4 {
                // All in one place, with and without extent; some far apart, some all but dark.
                0 => (light.low, light.high) = (Vec3::ZERO, Vec3::ZERO),
                1 => (light.low, light.high) = (Vec3::splat(-1.0), Vec3::splat(1.0)),
                2 => (light.low, light.high) = (light.low * 1e18, light.low * 1e18),
                _ => light.intensity = 1e-30,
            }
        }
        let tree = LightTree::new(&hostile);
        for i in 0..50 {
            let receiver = Receiver {
                point: if i == 0 { Vec3::ZERO } else { anywhere(i, 1) },
                ..receiver(i, Sides::Both)
            };
            let sum: f64 = (0..hostile.len()).map(|l| f64::from(tree.probability(&receiver, l))).sum();
            assert!((0.9..1.000_1).contains(&sum), "{sum}");
            for u in [0.0, 0.3, 0.9, 1.0 - f64::EPSILON] {
                let Some((light, p)) = tree.sample(&receiver, u) else { continue };
                assert!(p > 0.0 && (p - tree.probability(&receiver, light)).abs() <= 1e-5 * p);
            }
        }
    }

    #[test]
    fn the_tree_is_the_same_on_any_number_of_threads() {
        let lights = lights(20_000);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| format!("{:?}", LightTree::new(&lights)))
        };
        assert!(on(1) == on(3));
    }
}
