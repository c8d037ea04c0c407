//! The renderer, but for one thing.

use crate::accel::Kernel;
use crate::render::Techniques;
use crate::settings::RenderSettings;

/// What is another way.
#[derive(Clone, Copy, Debug)]
enum Change {
    Nothing,
    Settings(fn(&mut RenderSettings)),
    Replicates(u32),
    /// A technique that lessens the error is left out.
    Without(fn(&mut Techniques)),
    /// One that saves work alone.
    WithoutSaving(fn(&mut Techniques)),
    /// One that saves rays, by which uneven samples are planned.
    WithoutSavingRays(fn(&mut Techniques)),
    PortableKernel,
}

/// A renderer to be measured.
#[derive(Clone, Debug)]
pub(super) struct Variant {
    name: String,
    what: &'static str,
    change: Change,
}

/// How many independent sets of samples are tried.
const REPLICATES: [u32; 4] = [1, 2, 4, 8];

impl Variant {
    fn new(name: &str, what: &'static str, change: Change) -> Self {
        Self { name: name.to_owned(), what, change }
    }

    /// All that there are for a job of these settings on this machine. The first is the renderer as it is.
    pub(super) fn all(settings: &RenderSettings) -> Vec<Self> {
        let mut variants = vec![
            Self::new("whole", "nothing is left out", Change::Nothing),
            Self::new(
                "whole, again",
                "nothing is left out: what differs is noise of the clock",
                Change::Nothing,
            ),
            Self::new(
                "no mis",
                "light that light samples can find is found by them alone; light paths and path reuse, which weigh both, go too",
                Change::Settings(|settings| settings.mis = false),
            ),
            Self::new(
                "no nee",
                "light is found by chance alone; light paths and path reuse, which weigh light samples, go too",
                Change::Settings(|settings| settings.nee = false),
            ),
            Self::new(
                "equal lobes",
                "each lobe is sampled equally often, not by its albedo",
                Change::Without(|techniques| techniques.lobes_by_albedo = false),
            ),
            Self::new(
                "lights by arrival",
                "a light is chosen by what arrives of it, not by what a glossy surface mirrors",
                Change::Without(|techniques| techniques.lights_by_gloss = false),
            ),
            Self::new(
                "random numbers",
                "independent ones instead of Sobol' points, made in the same time",
                Change::Without(|techniques| techniques.sobol = false),
            ),
            Self::new(
                "no light paths",
                "paths start from the camera alone",
                Change::Without(|techniques| techniques.light_paths = false),
            ),
            Self::new(
                "no path reuse",
                "neighbouring pixels don't use each other's paths",
                Change::Without(|techniques| techniques.path_reuse = false),
            ),
            Self::new(
                "no splitting",
                "one path goes on from the first surface of each sample",
                Change::Without(|techniques| techniques.splitting = false),
            ),
            Self::new(
                "even samples",
                "all pixels get equally many",
                Change::Without(|techniques| techniques.adaptive = false),
            ),
            Self::new(
                "no roulette",
                "paths go on to the greatest depth",
                Change::Without(|techniques| techniques.roulette = false),
            ),
        ];
        let others = REPLICATES.into_iter().filter(|&count| count != settings.replicates);
        variants.extend(others.map(|count| {
            let name = format!("{count} replicate{}", if count == 1 { "" } else { "s" });
            let what = "so many independent sets of samples a pixel, at most as many as samples";
            Self { name, what, change: Change::Replicates(count) }
        }));
        variants.extend([
            Self::new(
                "no constants",
                "parameters that are the same all over are worked out at each point",
                Change::WithoutSaving(|techniques| techniques.constants = false),
            ),
            Self::new(
                "no coverage",
                "rays ask materials whether they are there, also where all are opaque",
                Change::WithoutSaving(|techniques| techniques.coverage = false),
            ),
            Self::new(
                "useless light",
                "light is sampled on mirrors, and shadow rays are traced for light that is black",
                Change::WithoutSavingRays(|techniques| techniques.useful_light = false),
            ),
        ]);
        if Kernel::avx2().is_some() {
            variants.push(Self::new("no avx2", "rays are traced in plain Rust", Change::PortableKernel));
        }
        variants
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn what(&self) -> &'static str {
        self.what
    }

    /// Whether its pictures have the same bits as the whole renderer's, given whether they have as many samples.
    pub(super) fn must_be_same(&self, has_as_many_samples: bool) -> bool {
        match self.change {
            Change::Nothing | Change::WithoutSaving(_) | Change::PortableKernel => true,
            Change::WithoutSavingRays(_) => has_as_many_samples,
            Change::Settings(_) | Change::Replicates(_) | Change::Without(_) => false,
        }
    }

    pub(super) fn is_portable(&self) -> bool {
        matches!(self.change, Change::PortableKernel)
    }

    pub(super) fn techniques(&self) -> Techniques {
        let mut techniques = Techniques::default();
        if let Change::Without(leave_out)
        | Change::WithoutSaving(leave_out)
        | Change::WithoutSavingRays(leave_out) = self.change
        {
            leave_out(&mut techniques);
        }
        techniques
    }

    pub(super) fn change(&self, settings: &mut RenderSettings) {
        match self.change {
            Change::Settings(change) => change(settings),
            Change::Replicates(count) => settings.replicates = count.min(settings.spp),
            _ => {}
        }
    }
}
