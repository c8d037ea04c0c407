//! Multiple importance sampling: what each way to find a light counts (Veach 1997, chapter 9).
//!
//! Camera paths find a light in two ways, by meeting it (BSDF sampling) and by choosing it (light sampling), light paths in a third. Light
//! paths are weighed against the camera's two together by the power heuristic, for which two ways are as dense as the root of the sum of their
//! squares; what they leave the camera's two share by the [`Heuristic`] that suits the light.

use super::Prepared;
use crate::light::{LightPlace, LightSample};
use crate::math::Number;

/// How light sampling and BSDF sampling share a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Heuristic {
    /// By the squares of their densities: each is far the better one for some lights and surfaces, and should have them alone.
    #[default]
    Power,
    /// By their densities. The table of an environment has what BSDF sampling lacks
    /// ([`crate::light::Partner::Bsdf`]): light over the sum of both is even, which squares would spoil.
    Balance,
}

impl Heuristic {
    /// That of a light that was sampled; none of lights without extent, which nothing else finds. Who meets a light has the same:
    /// [`Self::Balance`] of the environment, [`Self::Power`] of surfaces.
    #[inline(always)]
    pub(super) fn of(sample: &LightSample) -> Option<Self> {
        let heuristic = match sample.place {
            LightPlace::Far { .. } => Self::Balance,
            LightPlace::Surface { .. } | LightPlace::Point { .. } => Self::Power,
        };
        (!sample.is_delta()).then_some(heuristic)
    }
}

/// How many times as densely as one of the camera's ways others find a light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rivals<F = f32> {
    /// The camera's other way.
    pub(super) camera: F,
    pub(super) light_paths: F,
    pub(super) heuristic: Heuristic,
}

/// What one of the camera's ways counts of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share<F = f32> {
    /// The weight against the camera's other way alone.
    pub(super) in_camera: F,
    /// How many times as densely as both together light paths find the light.
    pub(super) light_paths: F,
}

impl<F: Number> Share<F> {
    /// Of what nothing else finds.
    pub(super) const ALL: Self = Self { in_camera: F::ONE, light_paths: F::ZERO };
    const NONE: Self = Self { in_camera: F::ZERO, light_paths: F::ZERO };

    /// The weight against all.
    #[inline(always)]
    pub(super) fn weight(self) -> F {
        self.in_camera * power(self.light_paths)
    }
}

impl<F: Number> Rivals<F> {
    #[inline(always)]
    fn share(self) -> Share<F> {
        let in_camera = match self.heuristic {
            Heuristic::Power => power(self.camera),
            Heuristic::Balance => F::ONE / (F::ONE + self.camera),
        };
        // Spares a root where there are no light paths.
        if !F::any(self.light_paths.above(F::ZERO)) {
            return Share { in_camera, light_paths: F::ZERO };
        }
        // Beyond all bounds over beyond all bounds is as good as nothing: the camera's own weight is next to nothing there.
        let light_paths = (self.light_paths / (F::ONE + self.camera.sqr()).sqrt()).max(F::ZERO);
        Share { in_camera, light_paths }
    }
}

/// The weight by the power heuristic with exponent 2 against what is `other` times as dense.
#[inline(always)]
pub(super) fn power<F: Number>(other: F) -> F {
    F::ONE / (F::ONE + other.sqr())
}

/// Which of the camera's ways to find a light count. All combinations have the same expectation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strategies {
    nee: bool,
    mis: bool,
}

impl Strategies {
    #[inline]
    pub(super) fn of(scene: &Prepared) -> Self {
        Self { nee: scene.settings.nee, mis: scene.settings.mis }
    }

    /// What a path counts that met a light.
    #[inline(always)]
    pub(super) fn of_bsdf<F: Number>(self, rivals: Rivals<F>) -> Share<F> {
        match self {
            Self { nee: true, mis: true } => rivals.share(),
            Self { nee: true, mis: false } => {
                let is_chosen = rivals.camera.above(F::ZERO);
                Share { in_camera: F::select(is_chosen, F::ZERO, F::ONE), ..Share::ALL }
            }
            Self { nee: false, .. } => Share::ALL,
        }
    }

    /// What a sample of a light counts that has an extent.
    #[inline(always)]
    pub(super) fn of_light<F: Number>(self, rivals: Rivals<F>) -> Share<F> {
        match self {
            Self { nee: true, mis: true } => rivals.share(),
            Self { nee: true, mis: false } => Share::ALL,
            Self { nee: false, .. } => Share::NONE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With densities of light sampling, BSDF sampling and light paths.
    #[test]
    fn weights_of_three_ways_sum_to_one() {
        let densities = [
            [1.0, 2.0, 3.0],
            [1.0, 1e-6, 0.0],
            [1e30, 1e-30, 0.0],
            [1e-38, 1e38, 1.0],
            [1.0, 1.0, 1e19],
            [5.0, 1e-10, 1e-30],
        ];
        for heuristic in [Heuristic::Power, Heuristic::Balance] {
            for [light, bsdf, light_paths] in densities {
                let of = |own: f32, camera: f32| {
                    Rivals { camera: camera / own, light_paths: light_paths / own, heuristic }
                        .share()
                        .weight()
                };
                let [light_squared, bsdf_squared] = [light, bsdf].map(|p| f64::from(p) * f64::from(p));
                let camera = (light_squared + bsdf_squared).sqrt();
                let of_light_paths = power((camera / f64::from(light_paths)) as f32);
                let sum = of(light, bsdf) + of(bsdf, light) + of_light_paths;
                assert!((sum - 1.0).abs() < 1e-6, "{heuristic:?} {light} {bsdf} {light_paths}: {sum}");
            }
        }
    }

    /// Where a light is chosen for what BSDF sampling lacks of it, all samples have the same value over the sum of both densities.
    #[test]
    fn balance_makes_complementary_densities_even() {
        let light = 3.0_f32;
        for bsdf in [0.1, 1.0, 2.5] {
            let chosen = light - bsdf;
            let of = |own: f32, other: f32| {
                let rivals =
                    Rivals { camera: other / own, heuristic: Heuristic::Balance, ..Rivals::default() };
                rivals.share().weight() * light / own
            };
            assert!((of(chosen, bsdf) - 1.0).abs() < 1e-6 && (of(bsdf, chosen) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_beyond_all_bounds_denser_leaves_nothing() {
        for heuristic in [Heuristic::Power, Heuristic::Balance] {
            for light_paths in [0.0, 1.0, f32::INFINITY] {
                let rivals = Rivals { camera: f32::INFINITY, light_paths, heuristic };
                assert_eq!(rivals.share().weight(), 0.0, "{heuristic:?} {light_paths}");
            }
        }
    }

    #[test]
    fn switched_off_ways_count_nothing_and_leave_all_to_the_other() {
        let rivals = Rivals { camera: 3.0, ..Rivals::default() };
        for (nee, mis, light, bsdf) in [
            (true, true, 0.1, 0.1),
            (true, false, 1.0, 0.0),
            (false, true, 0.0, 1.0),
            (false, false, 0.0, 1.0),
        ] {
            let strategies = Strategies { nee, mis };
            let weights = [strategies.of_light(rivals), strategies.of_bsdf(rivals)].map(Share::weight);
            assert_eq!(weights, [light, bsdf], "{strategies:?}");
        }
        // What light sampling can't find is left to BSDF sampling.
        let without_mis = Strategies { nee: true, mis: false };
        assert_eq!(without_mis.of_bsdf(Rivals::<f32>::default()).weight(), 1.0);
    }
}
