//! Light that starts at its source: where on which emitting triangle, or from which direction of the environment.
//!
//! Lights without extent send out none: paths that only they could find would change what a picture shows.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

use super::patch::Patch;
use super::{Distribution, Lights, NearLight, SkyPlace};
use crate::color::Rgb;
use crate::math::{Frame, warp};
use crate::scene::material::Sides;

/// A place and direction where light starts, with densities that include the choice of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emission {
    /// From a point of an emitting triangle: the caller chooses the direction by the cosine.
    Surface {
        /// The triangle.
        triangle: u32,
        /// The point's barycentric coordinates.
        barycentric: [f32; 3],
        /// The light leaves to the front.
        is_front: bool,
        /// Per m² of each side that emits, times 1/π for the direction: per steradian without its cosine.
        pdf: f32,
    },
    /// From the environment.
    Far {
        /// A point that the light passes before it meets the scene.
        origin: Vec3,
        /// Unit direction to where it comes from.
        wi: Vec3,
        /// What comes from there.
        radiance: Rgb,
        /// Per steradian, and per m² across the direction.
        pdf: f32,
        /// Where that is.
        sky: SkyPlace,
    },
}

/// How light starts.
#[derive(Clone, Debug)]
pub(super) struct Emitters {
    /// Between the lights that have a surface, in the order of the near lights, and the environment.
    choice: Distribution,
    environment: usize,
    /// A sphere around everything.
    center: Vec3,
    radius: f32,
    /// Of light from the environment: [`Emission`]'s density over that of choosing the direction from a surface.
    per_choice: f32,
}

impl Emitters {
    /// From the powers of the near lights' patches and of the environment, and its probability of being chosen from a surface.
    pub(super) fn new(patches: &[f64], environment: f64, share: f32, (center, radius): (Vec3, f32)) -> Self {
        let mut powers = patches.to_vec();
        powers.push(if share > 0.0 { environment } else { 0.0 });
        let choice = Distribution::new(&super::with_floor(&powers));
        let per_choice = choice.probability(patches.len()) / (share * PI * radius * radius);
        Self { choice, environment: patches.len(), center, radius, per_choice }
    }
}

impl Lights {
    /// Some light can start.
    pub fn can_emit(&self) -> bool {
        !self.emitters.choice.is_empty()
    }

    /// Light that starts in proportion to power, and evenly on each triangle. The first two numbers say where on it or from which
    /// direction, the third which light, the fourth to which side; the other two where light from the environment passes.
    #[inline]
    pub fn emit(&self, [u0, u1, u_light, u_side]: [f32; 4], u_disk: [f32; 2]) -> Option<Emission> {
        let (index, _, rest) = self.emitters.choice.sample_with_rest(u_light)?;
        if index == self.emitters.environment {
            let environment = self.environment.as_ref()?;
            let (wi, sky, _) = environment.sample(None, [u0, u1], [u_side, rest])?;
            let radiance = environment.radiance_at(sky);
            let [x, y] = warp::concentric_disk(u_disk);
            let frame = Frame::from_normal(wi);
            let across = frame.tangent * x + frame.bitangent * y;
            let origin = self.emitters.center + (across + wi) * self.emitters.radius;
            let pdf = self.pdf_emission_far(sky);
            return Some(Emission::Far { origin, wi, radiance, pdf, sky });
        }
        let NearLight::Patch(patch) = self.near.get(index)? else { return None };
        let (triangle, barycentric) = patch.point([u0, u1]);
        let is_front = patch.sides() == Sides::Front || u_side < 0.5;
        Some(Emission::Surface { triangle, barycentric, is_front, pdf: self.pdf_on(index, patch) })
    }

    /// The density of [`Emission::Surface`] on each side of a triangle that emits; 0 for triangles that are not lights.
    #[inline]
    pub fn pdf_emission(&self, triangle: u32) -> f32 {
        self.patch_of(triangle).map_or(0.0, |(patch, part)| self.pdf_on(part.light as usize, patch))
    }

    #[inline]
    fn pdf_on(&self, index: usize, patch: &Patch) -> f32 {
        let sides = if patch.sides() == Sides::Both { 0.5 } else { 1.0 };
        self.emitters.choice.probability(index) * sides * patch.pdf_point() * FRAC_1_PI
    }

    /// The density of [`Emission::Far`] from a place of the environment.
    #[inline]
    pub fn pdf_emission_far(&self, place: SkyPlace) -> f32 {
        let pdf = self.pdf_sky(None, place);
        if pdf > 0.0 { pdf * self.emitters.per_choice } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::tests::{numbers, quad_lights};
    use crate::light::{EnvironmentLight, EnvironmentTables, Partner};
    use crate::scene::environment::Environment;

    /// The mean of what is sent out over its density is the power: π·L·A for each side, and the environment's through a disk.
    #[test]
    fn emission_over_its_density_is_the_power() {
        let sky = Environment::constant(Rgb::grey(0.25));
        let sky = EnvironmentLight::new(&sky, None, Partner::None, &EnvironmentTables::default());
        let (lights, radius) = (quad_lights(), 3.0);
        let lights_power = lights.iter().map(|t| t.area_vector().length() * f64::from(t.mean_radiance.r));
        let lights_power = lights_power.sum::<f64>() * std::f64::consts::PI;
        let sky_power = 0.25 * 4.0 * std::f64::consts::PI * std::f64::consts::PI * 9.0;
        let radiance = |t: u32| lights.iter().find(|l| l.triangle == t).unwrap().mean_radiance.r;
        let all = Lights::new(&lights, &[], Some(sky), (Vec3::X, radius));
        let n = 20_000;
        let (mut near, mut far) = (0.0, 0.0);
        for i in 0..n {
            match all.emit(numbers(i), [0.3, 0.6]).unwrap() {
                Emission::Surface { triangle, pdf, is_front, .. } => {
                    assert!(is_front);
                    assert!((all.pdf_emission(triangle) / pdf - 1.0).abs() < 1e-6);
                    near += f64::from(radiance(triangle) / pdf);
                }
                Emission::Far { origin, wi, radiance, pdf, .. } => {
                    // It passes outside the sphere, in front of everything.
                    assert!(((origin - Vec3::X).dot(wi) - radius).abs() < 1e-5);
                    assert!((origin - Vec3::X - wi * radius).length() <= radius * 1.0001);
                    far += f64::from(radiance.r / pdf);
                }
            }
        }
        let n = f64::from(n);
        assert!((near / n / lights_power - 1.0).abs() < 0.05, "{} {lights_power}", near / n);
        assert!((far / n / sky_power - 1.0).abs() < 0.02, "{} {sky_power}", far / n);
    }
}
