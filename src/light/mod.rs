//! Which light to sample, and where on it; and how likely that was.
//!
//! The choice depends on the lights alone, never on a material: jobs of a sweep share it. Every sampler stands beside its pdf.

mod distribution;
mod environment;
mod punctual;

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::color::Rgb;
use crate::math::warp;
use crate::scene::light::{Light, LightKind};
use crate::scene::material::Sides;

pub use distribution::Distribution;
pub use environment::EnvironmentLight;

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
}

/// All lights of a scene.
#[derive(Debug)]
pub struct Lights {
    emitters: Vec<Emitter>,
    selection: Distribution,
    /// The emitter of a triangle, by the triangle's index, sorted.
    by_triangle: Vec<(u32, u32)>,
    environment: Option<(EnvironmentLight, f32)>,
}

#[derive(Clone, Copy, Debug)]
enum Emitter {
    Triangle {
        triangle: u32,
        vertices: [Vec3; 3],
        /// Along the normal, as long as the area.
        area_vector: Vec3,
    },
    Punctual(Light),
    Environment,
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
        /// The light has no extent: no other strategy finds it.
        is_delta: bool,
    },
}

impl Lights {
    /// Lights of a scene whose triangles fit into a sphere of `scene_radius` (metres, above 0).
    pub fn new(
        triangles: &[EmissiveTriangle],
        punctual: &[Light],
        environment: Option<EnvironmentLight>,
        scene_radius: f32,
    ) -> Self {
        let mut emitters = Vec::new();
        let mut powers = Vec::new();
        let mut by_triangle = Vec::new();
        let mut by_place = BTreeMap::new();
        for t in triangles {
            let area_vector = area_vector(t.vertices);
            let sides = if t.sides == Sides::Both { 2.0 } else { 1.0 };
            let power =
                f64::from(t.mean_radiance.luminance()) * area_vector.length() * std::f64::consts::PI * sides;
            // Coloured beyond Rec. 709 or not, what emits at all must have a chance.
            if power > 0.0 {
                // Of coincident lights one is seen: sampled on their own, each would shine in full.
                let emitter = *by_place.entry(place(t)).or_insert(emitters.len() as u32);
                by_triangle.push((t.triangle, emitter));
                if (emitter as usize) < emitters.len() {
                    continue;
                }
                emitters.push(Emitter::Triangle {
                    triangle: t.triangle,
                    vertices: t.vertices,
                    area_vector: area_vector.as_vec3(),
                });
                powers.push(power);
            }
        }
        for light in punctual {
            let power = punctual::power(light, scene_radius);
            if power > 0.0 {
                emitters.push(Emitter::Punctual(*light));
                powers.push(power);
            }
        }
        if let Some(environment) = &environment {
            let disk = std::f64::consts::PI * f64::from(scene_radius) * f64::from(scene_radius);
            let power = environment.total_luminance() * disk;
            if power > 0.0 {
                emitters.push(Emitter::Environment);
                powers.push(power);
            }
        }
        by_triangle.sort_unstable();
        let selection = Distribution::new(&with_floor(&powers));
        let environment = environment.map(|e| {
            let chosen = matches!(emitters.last(), Some(Emitter::Environment));
            let probability = if chosen { selection.probability(emitters.len() - 1) } else { 0.0 };
            (e, probability)
        });
        Self { emitters, selection, by_triangle, environment }
    }

    /// There is nothing to sample.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// Emitting triangles, punctual lights and the environment, in that order.
    pub fn counts(&self) -> [usize; 3] {
        let mut counts = [0; 3];
        for e in &self.emitters {
            counts[match e {
                Emitter::Triangle { .. } => 0,
                Emitter::Punctual(_) => 1,
                Emitter::Environment => 2,
            }] += 1;
        }
        counts
    }

    /// A light as seen from `from`, chosen by power; none if the chosen one can't shine there.
    pub fn sample(&self, from: Vec3, u_light: f32, u: [f32; 2]) -> Option<LightSample> {
        let (index, probability) = self.selection.sample(u_light)?;
        match &self.emitters[index] {
            Emitter::Triangle { triangle, vertices, area_vector } => {
                let [b1, b2] = warp::uniform_triangle(u);
                let barycentric = [1.0 - b1 - b2, b1, b2];
                let point = vertices[0] * barycentric[0] + vertices[1] * b1 + vertices[2] * b2;
                let to_light = point - from;
                let distance = to_light.length();
                let wi = to_light / distance;
                let pdf = probability * area_to_solid_angle(*area_vector, wi, distance)?;
                Some(LightSample { wi, place: LightPlace::Surface { triangle: *triangle, barycentric }, pdf })
            }
            Emitter::Punctual(light) => punctual::sample(light, from, probability),
            Emitter::Environment => {
                let (environment, _) = self.environment.as_ref()?;
                let (wi, radiance, pdf) = environment.sample(u)?;
                let place = LightPlace::Far { radiance, is_delta: false };
                Some(LightSample { wi, place, pdf: probability * pdf })
            }
        }
    }

    /// The solid-angle density of [`Self::sample`] at a point of an emitting triangle that lies `distance` along the unit
    /// direction `wi`; 0 for triangles that are not lights.
    pub fn pdf_triangle(&self, triangle: u32, wi: Vec3, distance: f32) -> f32 {
        let Ok(found) = self.by_triangle.binary_search_by_key(&triangle, |&(t, _)| t) else { return 0.0 };
        let index = self.by_triangle[found].1 as usize;
        match self.emitters[index] {
            Emitter::Triangle { area_vector, .. } => {
                self.selection.probability(index)
                    * area_to_solid_angle(area_vector, wi, distance).unwrap_or(0.0)
            }
            Emitter::Punctual(_) | Emitter::Environment => 0.0,
        }
    }

    /// The environment's radiance from the unit direction `wi`, and the solid-angle density of [`Self::sample`] there.
    pub fn environment(&self, wi: Vec3) -> Option<(Rgb, f32)> {
        let (environment, probability) = self.environment.as_ref()?;
        let radiance = environment.radiance(wi);
        Some((radiance, if *probability > 0.0 { probability * environment.pdf(wi) } else { 0.0 }))
    }
}

/// The least probability of a light, relative to all others together: random numbers have 24 bits, and what they could hardly
/// choose would come as rare bright specks.
const LEAST_SHARE: f64 = 1.0 / (1 << 22) as f64;

/// Powers, none much smaller than their sum. Everything is divided by the largest first, so that the sum is finite.
fn with_floor(powers: &[f64]) -> Vec<f64> {
    let largest = powers.iter().copied().fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return powers.to_vec();
    }
    let relative: Vec<f64> = powers.iter().map(|p| p / largest).collect();
    let least = relative.iter().sum::<f64>() * LEAST_SHARE;
    relative.into_iter().map(|p| p.max(least)).collect()
}

/// 1/area as a density of directions: distance²/(area·cos). None where it isn't finite.
fn area_to_solid_angle(area_vector: Vec3, wi: Vec3, distance: f32) -> Option<f32> {
    let pdf = distance * distance / area_vector.dot(wi).abs();
    (pdf.is_finite() && pdf > 0.0).then_some(pdf)
}

/// What triangles have in common that emit from the same place to the same sides.
fn place(t: &EmissiveTriangle) -> (bool, [[u32; 3]; 3]) {
    let mut corners = t.vertices.map(|v| v.to_array().map(f32::to_bits));
    if t.sides == Sides::Both {
        corners.sort_unstable();
    } else {
        // The winding stays.
        let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(first);
    }
    (t.sides == Sides::Both, corners)
}

/// The area of a triangle in m², along its normal. In f64, where the product of two tiny edges does not vanish, nor the difference
/// of the products of two long ones of a needle.
fn area_vector(v: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = v.map(|v| v.as_dvec3());
    0.5 * (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::scene::environment::Environment;

    fn random(i: u32, salt: u64) -> f32 {
        unit_f32(combine(u64::from(i), salt) as u32)
    }

    fn quad_lights() -> Vec<EmissiveTriangle> {
        let v = |x: f32, z: f32| Vec3::new(x, 2.0, z);
        [[v(-1.0, -1.0), v(1.0, -1.0), v(1.0, 1.0)], [v(-1.0, -1.0), v(1.0, 1.0), v(-1.0, 1.0)]]
            .into_iter()
            .enumerate()
            .map(|(i, vertices)| EmissiveTriangle {
                triangle: 10 + i as u32,
                vertices,
                mean_radiance: Rgb::grey(1.0 + 3.0 * i as f32),
                sides: Sides::Front,
            })
            .collect()
    }

    /// Form factor of a square light above a point, by sampling and by the closed formula.
    #[test]
    fn sampled_irradiance_of_a_square_is_the_analytic_one() {
        let lights = Lights::new(&quad_lights(), &[], None, 3.0);
        let n = 40_000;
        let sum: f64 = (0..n)
            .filter_map(|i| lights.sample(Vec3::ZERO, random(i, 1), [random(i, 2), random(i, 3)]))
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
        let lights = Lights::new(&quad_lights(), &[], None, 3.0);
        for i in 0..200 {
            let from = Vec3::new(random(i, 5), 0.3, random(i, 6));
            let s = lights.sample(from, random(i, 1), [random(i, 2), random(i, 3)]).unwrap();
            let LightPlace::Surface { triangle, .. } = s.place else { panic!("not a surface") };
            let distance = (2.0 - 0.3) / s.wi.y;
            let pdf = lights.pdf_triangle(triangle, s.wi, distance);
            assert!((pdf - s.pdf).abs() < 1e-4 * pdf, "{pdf} {}", s.pdf);
        }
        assert_eq!(lights.pdf_triangle(3, Vec3::Y, 1.0), 0.0);
    }

    #[test]
    fn lights_are_chosen_by_power() {
        let lights = Lights::new(&quad_lights(), &[], None, 3.0);
        let bright = (0..1000)
            .filter(|&i| {
                let s = lights.sample(Vec3::ZERO, (i as f32 + 0.5) / 1000.0, [0.3, 0.3]).unwrap();
                matches!(s.place, LightPlace::Surface { triangle: 11, .. })
            })
            .count();
        assert_eq!(bright, 800);
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
        let lights = Lights::new(&lights, &[], None, 3.0);
        assert_eq!(lights.counts(), [3, 0, 0]);
        let pdf = |triangle| lights.pdf_triangle(triangle, Vec3::Y, 2.0);
        assert!(pdf(20) == pdf(10) && pdf(20) > 0.0);
    }

    #[test]
    fn a_dark_scene_has_nothing_to_sample() {
        let black = EnvironmentLight::new(&Environment::constant(Rgb::BLACK), None);
        let lights = Lights::new(&[], &[], Some(black), 1.0);
        assert!(lights.is_empty());
        assert!(lights.sample(Vec3::ZERO, 0.5, [0.5, 0.5]).is_none());
        assert_eq!(lights.environment(Vec3::Y), Some((Rgb::BLACK, 0.0)));
    }
}
