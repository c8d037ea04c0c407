//! Multiple importance sampling: what each way to find a light counts (Veach 1997, chapter 9).
//!
//! Camera paths find a light in two ways, by meeting it (BSDF sampling) and by choosing it (light sampling), light paths in a third. These
//! are weighed against the camera's two together by the power heuristic, for which two ways are as dense as the root of the sum of their
//! squares; what they leave the camera's two share by the [`Heuristic`] that suits the light. All combinations have the same expectation.

use super::Prepared;

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

/// How many times as densely as one of the camera's ways others find a light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rivals {
    /// The camera's other way.
    pub(super) camera: f32,
    pub(super) light_paths: f32,
    pub(super) heuristic: Heuristic,
}

impl Rivals {
    /// The weight, with all of them.
    #[inline]
    pub(super) fn weight(self) -> f32 {
        self.weight_in_camera() * power(self.light_paths_to_camera())
    }

    /// The weight if there were no light paths.
    #[inline]
    pub(super) fn weight_in_camera(self) -> f32 {
        match self.heuristic {
            Heuristic::Power => power(self.camera),
            Heuristic::Balance => 1.0 / (1.0 + self.camera),
        }
    }

    /// How many times as densely as both of the camera's ways together light paths find the light.
    #[inline]
    pub(super) fn light_paths_to_camera(self) -> f32 {
        // Beyond all bounds over beyond all bounds is as good as nothing: the camera's own weight is nothing there.
        (self.light_paths / (1.0 + self.camera * self.camera).sqrt()).max(0.0)
    }
}

/// The weight by the power heuristic with exponent 2 against what is `other` times as dense.
#[inline]
pub(super) fn power(other: f32) -> f32 {
    1.0 / (1.0 + other * other)
}

/// Which of the camera's ways to find a light count.
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
    #[inline]
    pub(super) fn w_bsdf(self, rivals: Rivals) -> f32 {
        match self {
            Self { nee: true, mis: true } => rivals.weight(),
            Self { nee: true, mis: false } if rivals.camera > 0.0 => 0.0,
            _ => 1.0,
        }
    }

    /// What a light sample counts; there are no rivals where nothing else finds the light.
    #[inline]
    pub(super) fn w_light(self, rivals: Option<Rivals>) -> f32 {
        match (self, rivals) {
            (_, None) | (Self { nee: true, mis: false }, _) => 1.0,
            (Self { nee: true, mis: true }, Some(rivals)) => rivals.weight(),
            (Self { nee: false, .. }, Some(_)) => 0.0,
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
                    Rivals { camera: camera / own, light_paths: light_paths / own, heuristic }.weight()
                };
                let camera = f64::hypot(f64::from(light), f64::from(bsdf));
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
                rivals.weight() * light / own
            };
            assert!((of(chosen, bsdf) - 1.0).abs() < 1e-6 && (of(bsdf, chosen) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_beyond_all_bounds_denser_leaves_nothing() {
        for light_paths in [0.0, 1.0, f32::INFINITY] {
            let rivals = Rivals { camera: f32::INFINITY, light_paths, heuristic: Heuristic::Power };
            assert_eq!(rivals.weight(), 0.0, "{light_paths}");
        }
    }
}
