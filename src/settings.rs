//! The settings of a render that are not part of the scene: size, samples, seed, filter, depth.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Samples a pixel.
    #[schemars(range(min = 1, max = 16_777_216))]
    pub spp: u32,
    /// Independently scrambled sample sets a pixel; sample i belongs to set i mod `replicates`. The variance comes from their spread.
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
}

/// A pixel filter, sampled by importance, so that every sample has the same weight and no pixel shares samples with another.
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
}

impl Filter {
    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Tent => "tent",
            Self::BlackmanHarris => "blackman-harris",
        }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: None,
            height: None,
            spp: 64,
            replicates: 4,
            seed: 0,
            max_depth: 16,
            filter: Filter::Box,
            filter_radius: None,
            camera: None,
        }
    }
}

impl RenderSettings {
    /// The replicates that a render has: no more than it has samples.
    pub fn effective_replicates(&self) -> u32 {
        self.replicates.min(self.spp)
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
