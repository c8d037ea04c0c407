//! The settings of a render that are not part of the scene: size, samples, seed, filter, depth; and how the scene is read.

mod loading;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use loading::{
    ClearcoatScale, ConvertOptions, DecodedImages, ImportOptions, LightUnits, PhongRoughness, Reach,
};

/// Everything about a render that can change a bit of its result and is not in the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RenderSettings {
    /// Columns of the image; from the camera's aspect (or 640) where absent.
    #[schemars(range(min = 1, max = 65536))]
    pub width: Option<u32>,
    /// Rows of the image; the camera's own size (or 480) where absent.
    #[schemars(range(min = 1, max = 65536))]
    pub height: Option<u32>,
    /// Samples a pixel; with `error` the most there may be.
    #[schemars(range(min = 1, max = 16_777_216))]
    pub spp: u32,
    /// The error at which to stop: the mean over pixels and channels of variance/(value² + 0.01), as `pipeline bench` measures it. Each
    /// tile of 16 × 16 pixels is judged by itself, at 16 samples and whenever their number has doubled. Stopping where the samples
    /// happen to agree biases pictures slightly.
    #[schemars(range(min = 0.0, max = 1.0))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f32>,
    /// Independently scrambled sample sets a pixel; sample i belongs to set i mod `replicates`. The variance comes from their spread. One set
    /// makes the least noise; its variance comes from its two halves, which complete each other: it is told too large, by a tenth to a half.
    #[schemars(range(min = 1, max = 64))]
    pub replicates: u32,
    /// The seed of every random decision. Jobs of a sweep share it.
    pub seed: u64,
    /// The largest number of scattering events of a path: 0 shows emission alone, 1 adds direct light.
    #[schemars(range(max = 65535))]
    pub max_depth: u32,
    /// The pixel filter.
    pub filter: Filter,
    /// The filter's radius in pixels; each filter has its own default.
    #[schemars(range(min = 0.1, max = 8.0))]
    pub filter_radius: Option<f32>,
    /// Which camera of the scene, by name; the first where absent.
    pub camera: Option<String>,
    /// What is worked out along each camera ray.
    #[serde(skip_serializing_if = "is_default")]
    pub integrator: Integrator,
    /// Sample lights at every scattering; without it paths find light by chance alone, except from lights without extent.
    #[serde(skip_serializing_if = "is_true")]
    pub nee: bool,
    /// Weigh light and BSDF samples against each other; without it light that `nee` samples is found by it alone.
    #[serde(skip_serializing_if = "is_true")]
    pub mis: bool,
    /// Trace paths from the lights too, weighed against the others: they find what mirrors, glass and shiny things throw onto other surfaces.
    #[serde(skip_serializing_if = "is_default")]
    pub light_paths: Use,
    /// Let neighbouring pixels use each other's paths from their second surfaces on: far less noise of indirect light, which is alike in blocks
    /// of four by two pixels then, of four by four where neighbours see alike, or of two by two where noisy parts get more samples.
    #[serde(skip_serializing_if = "is_default")]
    pub path_reuse: Use,
    /// Let two paths go on from the first surface of each sample, instead of one: less noise of what surfaces reflect for less than twice the
    /// time, where finding those surfaces is most of the work.
    #[serde(skip_serializing_if = "is_default")]
    pub splitting: Use,
    /// Give noisy parts of the picture more samples than others, up to eight times `spp`, and the others fewer, down to a quarter, for as many
    /// rays as `spp` samples everywhere take.
    #[serde(skip_serializing_if = "is_default")]
    pub adaptive: Use,
}

/// Whether a technique is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Use {
    /// Where it saves more than it costs, which a few samples tell before the render.
    #[default]
    Auto,
    /// Wherever it can be.
    Always,
    /// Not at all.
    Never,
}

impl Use {
    /// The use of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "auto" => Some(Self::Auto),
            "always" => Some(Self::Always),
            "never" => Some(Self::Never),
            _ => None,
        }
    }
}

// What a setting is by default is left out of identities, so that a setting more changes none.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_true(value: &bool) -> bool {
    *value
}

/// What is worked out along each camera ray: radiance, or a look at something else. All but `path` are Aris' and mean what they
/// mean there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Integrator {
    /// Radiance, by path tracing.
    #[default]
    Path,
    /// Each axis' absolute value of the shading normal in the world.
    Normals,
    /// The base colour; white for `mirror` and `dielectric`.
    Albedo,
    /// The colour of `diffuse` materials; black for all others, as Aris' `albedo`.
    DiffuseAlbedo,
    /// One over the depth along the viewing axis, in 1/m.
    Depths,
    /// The unoccluded part of the hemisphere, weighed by the cosine.
    Ao,
    /// Emission and direct light, also behind specular reflection and refraction.
    Whitted,
    /// The irradiance of a point light over π, whatever the material. Only Aris' configurations name it, as its light is theirs.
    #[schemars(skip)]
    Point {
        /// Where, in metres.
        position: [f32; 3],
        /// The power Φ of each channel, in watts.
        energy: [f32; 3],
    },
    /// Direct light without the cosines at surface and light: the integral of Le·V·f/d² over the lights' areas.
    EmitterCheck,
}

impl Integrator {
    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Normals => "normals",
            Self::Albedo => "albedo",
            Self::DiffuseAlbedo => "diffuse_albedo",
            Self::Depths => "depths",
            Self::Ao => "ao",
            Self::Whitted => "whitted",
            Self::Point { .. } => "point",
            Self::EmitterCheck => "emitter_check",
        }
    }

    /// The integrator of that name, of those that need no values of their own.
    pub fn from_name(name: &str) -> Option<Self> {
        use Integrator as I;
        [I::Path, I::Normals, I::Albedo, I::DiffuseAlbedo, I::Depths, I::Ao, I::Whitted, I::EmitterCheck]
            .into_iter()
            .find(|i| i.name() == name)
    }

    /// The name, and what of `settings` bears on it and is not as usual, for people.
    pub fn described(settings: &RenderSettings) -> String {
        let without = |is_on: bool, what: &'static str| if is_on { "" } else { what };
        let name = settings.integrator.name();
        format!("{name}{}{}", without(settings.nee, ", no nee"), without(settings.mis, ", no mis"))
    }

    /// Without light in the scene, its picture is black.
    pub const fn needs_light(self) -> bool {
        matches!(self, Self::Path | Self::Whitted | Self::EmitterCheck)
    }
}

/// A pixel filter, sampled by importance, so that every sample has the same weight and none is spread over several pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Constant; radius ½ by default.
    #[default]
    Box,
    /// Falling linearly to 0; radius 1 by default.
    Tent,
    /// Blackman-Harris, as in Cycles; radius 0.75 by default.
    BlackmanHarris,
    /// All samples at the pixel's centre: no antialiasing.
    Point,
}

impl Filter {
    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Tent => "tent",
            Self::BlackmanHarris => "blackman-harris",
            Self::Point => "point",
        }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: None,
            height: None,
            spp: 64,
            error: None,
            replicates: 1,
            seed: 0,
            max_depth: 16,
            filter: Filter::Box,
            filter_radius: None,
            camera: None,
            integrator: Integrator::Path,
            nee: true,
            mis: true,
            light_paths: Use::Auto,
            path_reuse: Use::Auto,
            splitting: Use::Auto,
            adaptive: Use::Auto,
        }
    }
}

impl RenderSettings {
    /// How many samples a pixel gets, for people.
    pub fn samples_described(&self) -> String {
        match self.error {
            None => format!("{} samples", self.spp),
            Some(error) => format!("samples to an error of {error}, at most {}", self.spp),
        }
    }

    /// The replicates that a render has: no more than it has samples.
    pub fn effective_replicates(&self) -> u32 {
        self.replicates.min(self.spp)
    }

    /// The parts of a pixel's samples from whose spread the variance comes: the replicates, or the halves of a single one. A single sample
    /// has but one.
    pub fn parts(&self) -> u32 {
        self.replicates.max(2).min(self.spp)
    }

    /// A single replicate that has halves.
    pub fn is_halved(&self) -> bool {
        self.parts() > self.effective_replicates()
    }
}

/// The tone curve of an 8-bit picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ToneCurve {
    /// Clipped and sRGB-encoded.
    Srgb,
    /// Khronos PBR Neutral: base colours stay what they are, highlights are compressed.
    #[default]
    Neutral,
    /// AgX: a filmic curve with desaturated highlights.
    Agx,
}

/// How a float picture becomes an 8-bit one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Display {
    /// The curve.
    pub tone: ToneCurve,
    /// Exposure in stops, applied before the curve.
    #[schemars(range(min = -32.0, max = 32.0))]
    pub exposure: f32,
}
