//! More samples where a picture is noisy, fewer where it is not, for as many rays as equal numbers would take.
//!
//! Each patch of pixels begins with a part of the samples. How many it goes on to is planned from the noise and the rays of the patches beside
//! it, never from its own: on a checkerboard, the patches of one colour plan for those of the other. So the number of a pixel's samples knows nothing
//! of what they find, and their mean stays unbiased, which it would not be if they went on until they agreed (Kirk and Arvo 1991,
//! "Unbiased Sampling Techniques for Image Synthesis"). Where nobody knows when the render ends, by a limit of time, plans for more and more samples
//! follow each other, all by what the first samples saw, for the same reason.

use rayon::prelude::*;

use super::tile::Seen;

/// Patches begin with the samples halved so often, and none has less.
const FIRST_HALVING: u32 = 2;
/// None has more than the samples doubled so often.
const LAST_DOUBLING: usize = 3;
/// With fewer samples, what patches begin with tells nothing.
pub(super) const FEWEST_SAMPLES: u32 = 16;
/// A patch is taken to have this part of the mean noise besides what those beside it show, which may miss what it has.
const UNKNOWN_NOISE: f64 = 0.02;

/// From one number of samples to the next; small, as there are five for each patch.
struct Step {
    /// Error that it takes away for a ray.
    worth: f64,
    patch: u32,
    /// The place of the next number.
    next: u32,
}

/// How many samples the pixels of each patch are to have in all.
pub(super) struct Plan {
    columns: usize,
    /// Row by row.
    samples: Vec<u32>,
}

/// What the first samples of a picture's patches saw, row by row.
pub(super) struct Sight {
    columns: usize,
    patches: Vec<Seen>,
}

/// What a plan is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Aim {
    /// The settings' samples.
    pub(super) spp: u32,
    /// Those that each pixel begins with: these, halved a few times.
    pub(super) first: u32,
    /// Those whose rays all pixels together are to have, if each had so many.
    pub(super) mean: u32,
}

/// The samples of each pixel with which a render begins; few if nobody knows whether there will be all that the settings ask for.
pub(super) fn first_samples(spp: u32, may_end_early: bool) -> u32 {
    let usual = spp >> FIRST_HALVING;
    if !may_end_early {
        return usual;
    }
    halved(usual).take_while(|&n| n >= FEWEST_SAMPLES).last().unwrap_or(usual)
}

/// The numbers for which plans may be made then, one after the other.
pub(super) fn planned_means(spp: u32, first: u32) -> impl Iterator<Item = u32> {
    let mut means: Vec<u32> = halved(spp).take_while(|&n| n > first).collect();
    means.reverse();
    means.into_iter()
}

/// No pixel has more.
pub(super) fn most_samples(spp: u32) -> u32 {
    spp.saturating_mul(1 << LAST_DOUBLING)
}

fn halved(n: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(n), |&n| Some(n / 2).filter(|&n| n > 0))
}

impl Aim {
    /// The numbers of samples that a pixel may have, from the first to the most.
    fn choices(self) -> Vec<u32> {
        let doubled = std::iter::successors(self.spp.checked_mul(2), |n| n.checked_mul(2));
        let later: Vec<u32> = planned_means(self.spp, self.first).chain(doubled).collect();
        let up_to_mean = later.partition_point(|&n| n <= self.mean);
        std::iter::once(self.first).chain(later.into_iter().take(up_to_mean + LAST_DOUBLING)).collect()
    }
}

impl Plan {
    /// By what a picture's first samples saw.
    pub(super) fn new(sight: &Sight, aim: Aim) -> Self {
        let mut samples = vec![aim.mean; sight.patches.len()];
        for colour in [0, 1] {
            let patches = (0..sight.patches.len()).filter(|&patch| sight.colour(patch) == colour);
            let planned = patches.filter_map(|patch| Some((patch, sight.seen_beside(patch)?)));
            let (places, expected): (Vec<usize>, Vec<Seen>) = planned.unzip();
            for (patch, shared) in places.into_iter().zip(shared_out(aim, &expected)) {
                samples[patch] = shared;
            }
        }
        Self { columns: sight.columns, samples }
    }

    /// Those of the patch in a column and a row, if it is in the picture.
    pub(super) fn samples(&self, (column, row): (u32, u32)) -> Option<u32> {
        let (column, row) = (column as usize, row as usize);
        self.samples.get(row * self.columns + column).copied().filter(|_| column < self.columns)
    }
}

impl Sight {
    /// Of a picture of so many columns and rows of patches, of each of which something was `seen`.
    pub(super) fn new((columns, rows): (u32, u32), seen: impl Iterator<Item = ((u32, u32), Seen)>) -> Self {
        let columns = columns as usize;
        let mut patches = vec![Seen::default(); columns * rows as usize];
        for ((column, row), seen) in seen {
            patches[row as usize * columns + column as usize] = seen;
        }
        Self { columns, patches }
    }

    fn colour(&self, patch: usize) -> usize {
        (patch % self.columns + patch / self.columns) % 2
    }

    /// What those beside a patch have seen on average, all of the other colour; none if it is alone.
    fn seen_beside(&self, patch: usize) -> Option<Seen> {
        let column = patch % self.columns;
        let left = patch.checked_sub(1).filter(|_| column > 0);
        let right = Some(patch + 1).filter(|_| column + 1 < self.columns);
        let (above, below) = (patch.checked_sub(self.columns), Some(patch + self.columns));
        let beside = [left, right, above, below].into_iter().flatten();
        let (mut sum, mut count) = (Seen::default(), 0.0);
        for seen in beside.filter_map(|patch| self.patches.get(patch)) {
            sum = Seen { noise: sum.noise + seen.noise, rays: sum.rays + seen.rays };
            count += 1.0;
        }
        (count > 0.0).then(|| Seen { noise: sum.noise / count, rays: sum.rays / count })
    }
}

/// The samples of patches from which such noise is expected: those go on first of which that takes away the most error for a ray, as long
/// as all together take no more rays than with equal numbers.
fn shared_out(aim: Aim, expected: &[Seen]) -> Vec<u32> {
    let mean_noise = expected.iter().map(|seen| seen.noise).sum::<f64>() / expected.len().max(1) as f64;
    // None, or more than numbers can tell: then nothing is known.
    if !(mean_noise > 0.0 && mean_noise.is_finite()) {
        return vec![aim.mean; expected.len()];
    }
    let choices = aim.choices();
    let mut steps = Vec::new();
    let rays = |seen: &Seen, next: usize| seen.rays * f64::from(choices[next] - choices[next - 1]);
    for (patch, seen) in (0..).zip(expected) {
        // Of n samples, the error is noise/n.
        let noise = seen.noise + UNKNOWN_NOISE * mean_noise;
        for next in 1..choices.len() {
            let gain = noise * (1.0 / f64::from(choices[next - 1]) - 1.0 / f64::from(choices[next]));
            steps.push(Step { worth: gain / rays(seen, next), patch, next: next as u32 });
        }
    }
    // Each step of a patch is worth less than the one before.
    steps.par_sort_unstable_by(|a, b| {
        b.worth.total_cmp(&a.worth).then_with(|| (a.patch, a.next).cmp(&(b.patch, b.next)))
    });
    let rays_a_sample: f64 = expected.iter().map(|seen| seen.rays).sum();
    let mut rays_left = rays_a_sample * f64::from(aim.mean - choices[0]) * (1.0 + 1e-9);
    let mut plan = vec![choices[0]; expected.len()];
    for Step { patch, next, .. } in steps {
        let (patch, next) = (patch as usize, next as usize);
        rays_left -= rays(&expected[patch], next);
        if rays_left < 0.0 {
            break;
        }
        plan[patch] = choices[next];
    }
    plan
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn aim(spp: u32) -> Aim {
        Aim { spp, first: first_samples(spp, false), mean: spp }
    }

    fn plan(columns: u32, patches: &[Seen], spp: u32) -> Plan {
        let places = (0..).map(|i: u32| (i % columns, i / columns));
        let rows = patches.len() as u32 / columns;
        Plan::new(&Sight::new((columns, rows), places.zip(patches.iter().copied())), aim(spp))
    }

    fn patch() -> impl Strategy<Value = Seen> {
        (prop_oneof![Just(0.0), 1e-6..10.0], 1.0..20.0).prop_map(|(noise, rays)| Seen { noise, rays })
    }

    proptest! {
        #[test]
        fn what_a_patch_has_seen_does_not_tell_its_own_samples(
            patches in prop::collection::vec(patch(), 35),
            others in prop::collection::vec(patch(), 35),
            spp in 16..200u32,
        ) {
            // In odd columns and rows, colours alternate all along.
            let colour = |index: usize| (index % 7 + index / 7) % 2;
            let mixed = |changed: usize| {
                let choose = |(i, (a, b)): (usize, (&Seen, &Seen))| if colour(i) == changed { *b } else { *a };
                patches.iter().zip(&others).enumerate().map(choose).collect::<Vec<_>>()
            };
            let before = plan(7, &patches, spp);
            for changed in [0, 1] {
                let after = plan(7, &mixed(changed), spp);
                for i in (0..35).filter(|&i| colour(i) == changed) {
                    prop_assert_eq!(before.samples[i], after.samples[i]);
                }
            }
        }

        #[test]
        fn plans_take_no_more_rays_than_equal_numbers_and_leave_less_error(
            expected in prop::collection::vec(patch(), 1..60),
            spp in 16..200u32,
        ) {
            let plan = shared_out(aim(spp), &expected);
            let rays: f64 = expected.iter().zip(&plan).map(|(seen, &n)| seen.rays * f64::from(n)).sum();
            let all: f64 = expected.iter().map(|seen| seen.rays * f64::from(spp)).sum();
            prop_assert!(rays <= all * (1.0 + 1e-6));
            let choices = aim(spp).choices();
            prop_assert!(plan.iter().all(|n| choices.contains(n)), "{:?}", plan);
        }

        /// As plans follow each other, no patch is to have less than it has.
        #[test]
        fn a_plan_for_more_gives_no_patch_less(
            expected in prop::collection::vec(patch(), 1..60),
            spp in 16..2000u32,
        ) {
            let first = first_samples(spp, true);
            let mut before = vec![first; expected.len()];
            for mean in planned_means(spp, first) {
                let plan = shared_out(Aim { spp, first, mean }, &expected);
                prop_assert!(plan.iter().zip(&before).all(|(n, before)| n >= before), "{plan:?} {before:?}");
                before = plan;
            }
        }
    }

    #[test]
    fn equal_noise_gets_equal_samples_and_sixteen_times_the_noise_up_to_four_times_as_many() {
        let even = [Seen { noise: 0.3, rays: 5.0 }; 24];
        assert!(plan(6, &even, 64).samples.iter().all(|&n| n == 64));
        // With 128 and 32 samples they take seven eighths of the rays; for those that are left some of the quiet ones go on.
        let noise = |i: usize| if i < 16 { 1.0 } else { 1.0 / 16.0 };
        let expected: Vec<Seen> = (0..64).map(|i| Seen { noise: noise(i), rays: 3.0 }).collect();
        let plan = shared_out(aim(64), &expected);
        assert!(plan[..16].iter().all(|&n| n == 128), "{plan:?}");
        let of = |number: u32| plan[16..].iter().filter(|&&n| n == number).count();
        assert_eq!((of(32), of(64)), (32, 16), "{plan:?}");
    }

    #[test]
    fn noise_that_overflows_is_no_guide() {
        for noise in [f64::INFINITY, f64::NAN, 0.0] {
            let mut expected = [Seen { noise: 0.3, rays: 5.0 }; 24];
            expected[7].noise = noise;
            let plan = shared_out(aim(64), &expected);
            assert_eq!(plan.iter().all(|&n| n == 64), !noise.is_finite(), "{noise}: {plan:?}");
        }
    }

    #[test]
    fn numbers_of_samples_are_doubled_from_a_quarter_to_eight_times() {
        assert_eq!(aim(64).choices(), [16, 32, 64, 128, 256, 512]);
        assert_eq!(aim(50).choices(), [12, 25, 50, 100, 200, 400]);
    }

    #[test]
    fn where_the_end_is_not_known_plans_begin_at_sixteen_samples() {
        let means = |spp| {
            let first = first_samples(spp, true);
            std::iter::once(first).chain(planned_means(spp, first)).collect::<Vec<_>>()
        };
        assert_eq!(means(16), [4, 8, 16]);
        assert_eq!(means(50), [12, 25, 50]);
        assert_eq!(means(200), [25, 50, 100, 200]);
        assert_eq!(means(1 << 16)[..3], [16, 32, 64]);
        assert_eq!(Aim { spp: 1 << 16, first: 16, mean: 32 }.choices(), [16, 32, 64, 128, 256]);
    }
}
