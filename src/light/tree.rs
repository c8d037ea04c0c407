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
        if !(sum > 0.0) {
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
    if !(width > 0.0) {
        return half;
    }
    if depth >= DEEPEST_BY_COST {
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
