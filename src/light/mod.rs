//! Which light to sample, and where on it; and how likely that was.
//!
//! The choice depends on the lights, on the place and side from which they are seen, and where the receiver says so on how it mirrors.
//! Every sampler stands beside its pdf.

mod bounds;
mod distribution;
mod emission;
mod environment;
mod environment_table;
mod facing;
mod gloss;
mod grid;
mod patch;
mod punctual;
mod tree;

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::color::Rgb;
use crate::scene::light::{Light, LightKind};
use crate::scene::material::Sides;
use bounds::LightBounds;
use emission::Emitters;
use patch::Patch;
use tree::LightTree;

pub use distribution::Distribution;
pub use emission::Emission;
pub use environment::{EnvironmentLight, SkyPlace};
pub use environment_table::{EnvironmentTable, EnvironmentTables, Partner};
pub use gloss::Gloss;

/// An emitting triangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissiveTriangle {
    /// Its index among the scene's triangles, as the tracer numbers them.
    pub triangle: u32,
    /// World positions, in the order that barycentric coordinates count.
    pub vertices: [Vec3; 3],
    /// Its mean radiance: only how often it is chosen depends on it.
    pub mean_radiance: Rgb,
    /// The sides that emit.
    pub sides: Sides,
    /// Its front is on the other side than its winding says.
    pub is_mirrored: bool,
}

/// A point of the scene that light falls on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Where.
    pub point: Vec3,
    /// The unit geometric normal, on the side that it is seen from.
    pub normal: Vec3,
    /// The sides whose light it scatters to there: both, where light comes through.
    pub sides: Sides,
    /// How it mirrors, where that is to count in the choice of a light.
    pub gloss: Option<Gloss>,
}

/// All lights of a scene.
#[derive(Debug)]
pub struct Lights {
    /// Lights with a place, as the tree counts them.
    near: Vec<NearLight>,
    tree: LightTree,
    /// Directional ones.
    far: Vec<Light>,
    environment: Option<EnvironmentLight>,
    /// Between all near lights, each far one, and the environment.
    selection: Distribution,
    emitters: Emitters,
    /// Where among the near lights a triangle is, by the triangle's index, sorted.
    by_triangle: Vec<(u32, PatchPart)>,
}

/// A light that has a place.
#[derive(Clone, Copy, Debug)]
enum NearLight {
    Patch(Patch),
    Punctual(Light),
}

/// A triangle of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct PatchPart {
    light: u32,
    /// Which of the patch's triangles.
    index: u32,
}

/// A point or direction on a light, as seen from a point of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards it.
    pub wi: Vec3,
    /// Where on which light.
    pub place: LightPlace,
    /// Probability density per unit solid angle, or the discrete probability for lights without extent; selection included.
    pub pdf: f32,
}

impl LightSample {
    /// The light has no extent: no other strategy finds it.
    #[inline]
    pub fn is_delta(&self) -> bool {
        matches!(self.place, LightPlace::Point { .. } | LightPlace::Far { sky: None, .. })
    }
}

/// Where a light sample lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightPlace {
    /// On an emitting triangle: the caller evaluates the emission there.
    Surface {
        /// The triangle.
        triangle: u32,
        /// The point's barycentric coordinates.
        barycentric: [f32; 3],
    },
    /// At a finite distance, without extent: no other strategy finds it.
    Point {
        /// Where.
        position: Vec3,
        /// What arrives, all but visibility: intensity over distance², per unit probability.
        radiance: Rgb,
    },
    /// Infinitely far.
    Far {
        /// What arrives.
        radiance: Rgb,
        /// Where in the environment; a light without extent, which no other strategy finds, is in none.
        sky: Option<SkyPlace>,
    },
}

impl Lights {
    /// Lights of a scene whose triangles fit into a sphere of this centre and radius (metres, above 0).
    pub fn new(
        triangles: &[EmissiveTriangle],
        punctual: &[Light],
        environment: Option<EnvironmentLight>,
        (center, scene_radius): (Vec3, f32),
    ) -> Self {
        let (patches, by_triangle) = patches(triangles);
        let (far, local): (Vec<Light>, Vec<Light>) = punctual
            .iter()
            .filter(|light| punctual::power(light, scene_radius) > 0.0)
            .partition(|light| matches!(light.kind, LightKind::Directional { .. }));

        let powers = patches.iter().map(Patch::power);
        let powers: Vec<f64> = powers.chain(local.iter().map(|l| punctual::power(l, scene_radius))).collect();
        let intensities = patches.iter().map(Patch::intensity).chain(local.iter().map(punctual::intensity));
        let intensities = with_floor(&intensities.collect::<Vec<f64>>());
        let places = patches.iter().map(Patch::bounds).chain(local.iter().map(punctual::bounds));
        let bounds: Vec<LightBounds> = places
            .zip(intensities)
            .map(|(bounds, intensity)| LightBounds { intensity: intensity as f32, ..bounds })
            .collect();

        let mut shares = vec![powers.iter().sum()];
        shares.extend(far.iter().map(|light| punctual::power(light, scene_radius)));
        let disk = std::f64::consts::PI * f64::from(scene_radius) * f64::from(scene_radius);
        let sky = environment.as_ref().map_or(0.0, |e| e.sampled_luminance() * disk);
        shares.push(sky);
        let selection = Distribution::new(&with_floor(&shares));
        let share = selection.probability(far.len() + 1);
        let emitters = Emitters::new(&powers[..patches.len()], sky, share, (center, scene_radius));
        let near =
            patches.into_iter().map(NearLight::Patch).chain(local.into_iter().map(NearLight::Punctual));
        Self {
            near: near.collect(),
            tree: LightTree::new(&bounds),
            far,
            environment,
            selection,
            emitters,
            by_triangle,
        }
    }

    /// There is nothing to sample.
    pub fn is_empty(&self) -> bool {
        self.selection.is_empty()
    }

    /// There are several lights with a place, so that one is chosen for each receiver.
    #[inline]
    pub fn has_choice(&self) -> bool {
        self.near.len() > 1
    }

    /// Emitting triangles, punctual lights and the environment, in that order.
    pub fn counts(&self) -> [usize; 3] {
        let patches = self.near.iter().map(|light| match light {
            NearLight::Patch(patch) => patch.len(),
            NearLight::Punctual(_) => 0,
        });
        let local = self.near.iter().filter(|light| matches!(light, NearLight::Punctual(_))).count();
        let environment = self.environment.as_ref().is_some_and(|e| e.total_luminance() > 0.0);
        [patches.sum(), local + self.far.len(), usize::from(environment)]
    }

    /// A light as seen from `receiver`; none if the chosen one can't shine there. The first two numbers say where on it, the third
    /// which, and the fourth continues the third's digits: 24 bits are too few to tell 100,000 lights apart. In the environment these
    /// two continue those of the first.
    #[inline]
    pub fn sample(&self, receiver: &Receiver, [u0, u1, u_light, u_digits]: [f32; 4]) -> Option<LightSample> {
        let (group, share, rest) = self.selection.sample_with_rest(u_light)?;
        if group == 0 {
            let rest = f64::from(rest) + f64::from(u_digits) * f64::from(Distribution::STEP / share);
            let (index, chance) = self.tree.sample(receiver, rest)?;
            return self.near[index].sample(receiver.point, [u0, u1], share * chance);
        }
        if let Some(light) = self.far.get(group - 1) {
            return punctual::sample(light, receiver.point, share);
        }
        let environment = self.environment.as_ref()?;
        let (wi, sky, pdf) = environment.sample(receiver.hemisphere(), [u0, u1], [rest, u_digits])?;
        let place = LightPlace::Far { radiance: environment.radiance_at(sky), sky: Some(sky) };
        Some(LightSample { wi, place, pdf: share * pdf })
    }

    /// The solid-angle density of [`Self::sample`] for `receiver`, at a point of an emitting triangle that lies `distance` along the
    /// unit direction `wi` from there; 0 for triangles that are not lights.
    pub fn pdf_triangle(&self, receiver: &Receiver, triangle: u32, wi: Vec3, distance: f32) -> f32 {
        let Some((patch, PatchPart { light, index })) = self.patch_of(triangle) else { return 0.0 };
        let chance = self.selection.probability(0) * self.tree.probability(receiver, light as usize);
        if chance > 0.0 { chance * patch.pdf(receiver.point, index, wi, distance) } else { 0.0 }
    }

    /// The patch that a triangle belongs to, if it is a light.
    #[inline]
    fn patch_of(&self, triangle: u32) -> Option<(&Patch, PatchPart)> {
        let found = self.by_triangle.binary_search_by_key(&triangle, |&(t, _)| t).ok()?;
        let part = self.by_triangle[found].1;
        match &self.near[part.light as usize] {
            NearLight::Patch(patch) => Some((patch, part)),
            NearLight::Punctual(_) => None,
        }
    }

    /// The environment's radiance from the unit direction `wi`, and where that is in it.
    #[inline]
    pub fn environment(&self, wi: Vec3) -> Option<(Rgb, SkyPlace)> {
        let environment = self.environment.as_ref()?;
        let place = environment.place(wi);
        Some((environment.radiance_at(place), place))
    }

    /// The solid-angle density of [`Self::sample`] for `receiver` at a place of the environment.
    #[inline]
    pub fn pdf_environment(&self, receiver: &Receiver, place: SkyPlace) -> f32 {
        self.pdf_sky(receiver.hemisphere(), place)
    }

    #[inline]
    fn pdf_sky(&self, normal: Option<Vec3>, place: SkyPlace) -> f32 {
        let share = self.selection.probability(self.far.len() + 1);
        match &self.environment {
            Some(environment) if share > 0.0 => share * environment.pdf(normal, place),
            _ => 0.0,
        }
    }
}

impl Receiver {
    /// The normal of the hemisphere whose light counts; none where light of all directions does.
    #[inline]
    fn hemisphere(&self) -> Option<Vec3> {
        (self.sides == Sides::Front).then_some(self.normal)
    }
}

impl NearLight {
    /// A point of it, if it shines to `from`; `chance` is that of choosing this light.
    #[inline]
    fn sample(&self, from: Vec3, u: [f32; 2], chance: f32) -> Option<LightSample> {
        match self {
            Self::Punctual(light) => punctual::sample(light, from, chance),
            Self::Patch(patch) => {
                let point = patch.sample(from, u)?;
                let place = LightPlace::Surface { triangle: point.triangle, barycentric: point.barycentric };
                Some(LightSample { wi: point.wi, place, pdf: chance * point.pdf })
            }
        }
    }
}

impl EmissiveTriangle {
    /// The area in m², along the normal of the winding. In f64, where the product of two tiny edges does not vanish, nor the
    /// difference of the products of two long ones of a needle.
    fn area_vector(&self) -> DVec3 {
        let [a, b, c] = self.vertices.map(|v| v.as_dvec3());
        0.5 * (b - a).cross(c - a)
    }

    /// It shines at all, coloured beyond Rec. 709 or not.
    fn is_light(&self) -> bool {
        f64::from(self.mean_radiance.luminance()) * self.area_vector().length() > 0.0
    }

    /// What triangles have in common that emit from the same place to the same sides.
    fn place(&self) -> (bool, [[u32; 3]; 3]) {
        let mut corners = self.vertices.map(|v| v.to_array().map(f32::to_bits));
        if self.sides == Sides::Both {
            corners.sort_unstable();
        } else {
            // The winding stays; a mirrored triangle's is the other one.
            if self.is_mirrored {
                corners.swap(1, 2);
            }
            let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
            corners.rotate_left(first);
        }
        (self.sides == Sides::Both, corners)
    }
}

/// The triangles that shine, neighbours paired, and where each has gone. Of coincident lights one is seen: sampled on their own, each
/// would shine in full.
fn patches(triangles: &[EmissiveTriangle]) -> (Vec<Patch>, Vec<(u32, PatchPart)>) {
    let mut by_place = BTreeMap::new();
    let mut distinct: Vec<&EmissiveTriangle> = Vec::new();
    let mut copies: Vec<(u32, usize)> = Vec::new();
    for triangle in triangles.iter().filter(|t| t.is_light()) {
        let original = *by_place.entry(triangle.place()).or_insert(distinct.len());
        copies.push((triangle.triangle, original));
        if original == distinct.len() {
            distinct.push(triangle);
        }
    }
    let mut patches = Vec::new();
    let mut parts = Vec::with_capacity(distinct.len());
    while let Some(first) = distinct.get(parts.len()) {
        let pair = distinct.get(parts.len() + 1).and_then(|second| Patch::pair(first, second));
        let patch = pair.unwrap_or_else(|| Patch::single(first));
        parts.extend((0..patch.len() as u32).map(|index| PatchPart { light: patches.len() as u32, index }));
        patches.push(patch);
    }
    let mut by_triangle: Vec<_> = copies.into_iter().map(|(triangle, i)| (triangle, parts[i])).collect();
    by_triangle.sort_unstable();
    (patches, by_triangle)
}

/// The least probability of a light, relative to all others together: random numbers have 24 bits, and what they could hardly
/// choose would come as rare bright specks.
const LEAST_SHARE: f64 = 1.0 / (1 << 22) as f64;

/// Powers, none that there is much smaller than their sum. Everything is divided by the largest first, so that the sum is finite.
fn with_floor(powers: &[f64]) -> Vec<f64> {
    let largest = powers.iter().copied().fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return powers.to_vec();
    }
    let relative: Vec<f64> = powers.iter().map(|p| p / largest).collect();
    let least = relative.iter().sum::<f64>() * LEAST_SHARE;
    relative.into_iter().zip(powers).map(|(p, &power)| if power > 0.0 { p.max(least) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::scene::environment::Environment;

    fn random(i: u32, salt: u64) -> f32 {
        unit_f32(combine(u64::from(i), salt) as u32)
    }

    pub(super) fn quad_lights() -> Vec<EmissiveTriangle> {
        let v = |x: f32, z: f32| Vec3::new(x, 2.0, z);
        [[v(-1.0, -1.0), v(1.0, -1.0), v(1.0, 1.0)], [v(-1.0, -1.0), v(1.0, 1.0), v(-1.0, 1.0)]]
            .into_iter()
            .enumerate()
            .map(|(i, vertices)| EmissiveTriangle {
                triangle: 10 + i as u32,
                vertices,
                mean_radiance: Rgb::grey(1.0 + 3.0 * i as f32),
                sides: Sides::Front,
                is_mirrored: false,
            })
            .collect()
    }

    fn floor(point: Vec3) -> Receiver {
        Receiver { point, normal: Vec3::Y, sides: Sides::Front, gloss: None }
    }

    pub(super) fn numbers(i: u32) -> [f32; 4] {
        [1, 2, 3, 4].map(|salt| random(i, salt))
    }

    /// Form factor of a square light above a point, by sampling and by the closed formula.
    #[test]
    fn sampled_irradiance_of_a_square_is_the_analytic_one() {
        let lights = Lights::new(&quad_lights(), &[], None, (Vec3::ZERO, 3.0));
        let n = 40_000;
        let sum: f64 = (0..n)
            .filter_map(|i| lights.sample(&floor(Vec3::ZERO), numbers(i)))
            .map(|s| f64::from(s.wi.y / s.pdf))
            .sum();
        // Four corner rectangles of 1 × 1 at height 2: E/L = 4·(2/2)·(a/√(1+a²)·atan(a/√(1+a²)))/... with a = 1/2.
        let a = 0.5f64;
        let k = a / (1.0 + a * a).sqrt();
        let exact = 4.0 * k * libm::atan(k);
        assert!((sum / f64::from(n) - exact).abs() < 0.01 * exact, "{} {exact}", sum / f64::from(n));
    }

    #[test]
    fn triangle_pdf_is_that_of_the_sample() {
        let lights = Lights::new(&quad_lights(), &[], None, (Vec3::ZERO, 3.0));
        for i in 0..200 {
            let from = floor(Vec3::new(random(i, 5), 0.3, random(i, 6)));
            let s = lights.sample(&from, numbers(i)).unwrap();
            let LightPlace::Surface { triangle, .. } = s.place else { panic!("not a surface") };
            let distance = (2.0 - 0.3) / s.wi.y;
            let pdf = lights.pdf_triangle(&from, triangle, s.wi, distance);
            assert!((pdf - s.pdf).abs() < 1e-4 * pdf, "{pdf} {}", s.pdf);
        }
        assert_eq!(lights.pdf_triangle(&floor(Vec3::ZERO), 3, Vec3::Y, 1.0), 0.0);
    }

    /// Symmetric lights are told apart by their power alone.
    #[test]
    fn lights_are_chosen_by_power() {
        let lights = Lights::new(&quad_lights(), &[], None, (Vec3::ZERO, 3.0));
        let bright = (0..1000)
            .filter(|&i| {
                let s =
                    lights.sample(&floor(Vec3::ZERO), [0.3, 0.3, (i as f32 + 0.5) / 1000.0, 0.5]).unwrap();
                matches!(s.place, LightPlace::Surface { triangle: 11, .. })
            })
            .count();
        assert!((790..810).contains(&bright), "{bright}");
    }

    #[test]
    fn coincident_lights_are_one_light_unless_they_face_apart() {
        let mut lights = quad_lights();
        let mut again = lights[0];
        again.triangle = 20;
        again.vertices.rotate_left(1);
        let mut turned = EmissiveTriangle { triangle: 21, ..again };
        turned.vertices.swap(0, 1);
        lights.extend([again, turned]);
        let lights = Lights::new(&lights, &[], None, (Vec3::ZERO, 3.0));
        assert_eq!(lights.counts(), [3, 0, 0]);
        let pdf = |triangle| lights.pdf_triangle(&floor(Vec3::ZERO), triangle, Vec3::Y, 2.0);
        assert!(pdf(20) == pdf(10) && pdf(20) > 0.0);
    }

    #[test]
    fn a_dark_scene_has_nothing_to_sample() {
        let black = EnvironmentLight::new(
            &Environment::constant(Rgb::BLACK),
            None,
            Partner::None,
            &EnvironmentTables::default(),
        );
        let lights = Lights::new(&[], &[], Some(black), (Vec3::ZERO, 1.0));
        assert!(lights.is_empty());
        assert!(lights.sample(&floor(Vec3::ZERO), [0.5; 4]).is_none());
        let (radiance, place) = lights.environment(Vec3::Y).expect("an environment");
        assert_eq!((radiance, lights.pdf_environment(&floor(Vec3::ZERO), place)), (Rgb::BLACK, 0.0));
    }
}
