//! What the renderer does to be fast and to have little noise, each to be left out for measuring what it is worth.

/// Techniques, all in use by default. They are no settings: without any of them pictures have the same expectation, and without those
/// that save work alone, the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Techniques {
    /// Sobol' points; without them independent random numbers, made in the same time.
    pub sobol: bool,
    /// Lobes are chosen by their albedo; without it each that is there equally often.
    pub lobes_by_albedo: bool,
    /// Among several lights what a glossy first surface mirrors is chosen more often; without it the light that arrives alone counts.
    pub lights_by_gloss: bool,
    /// Paths that carry little end early; without it at the greatest depth.
    pub roulette: bool,
    /// Paths start from lights too; without it from the camera alone.
    pub light_paths: bool,
    /// Neighbouring pixels use each other's paths; without it each has its own.
    pub path_reuse: bool,
    /// Samples branch at their first surface where that pays; without it none does.
    pub splitting: bool,
    /// Noisy parts of a picture get more samples than others where that pays; without it all pixels get equally many.
    pub adaptive: bool,
    /// Saves work: what is the same all over a material is worked out once; without it at each point.
    pub constants: bool,
    /// Saves work: where all surfaces are opaque, rays ask no material whether it is there.
    pub coverage: bool,
    /// Saves work: no light is sampled on mirrors, and no shadow ray traced for light that doesn't arrive or is not reflected.
    pub useful_light: bool,
}

impl Default for Techniques {
    fn default() -> Self {
        Self {
            sobol: true,
            lobes_by_albedo: true,
            lights_by_gloss: true,
            roulette: true,
            light_paths: true,
            path_reuse: true,
            splitting: true,
            adaptive: true,
            constants: true,
            coverage: true,
            useful_light: true,
        }
    }
}
