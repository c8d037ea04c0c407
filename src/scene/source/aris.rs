//! Aris: a BRDF entry of a scene's YAML, and the area light on the same mesh.

use crate::color::Rgb;
use crate::disney::Parameter;

/// A material: a BRDF and what the mesh emits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ArisMaterial {
    /// The BRDF.
    pub brdf: ArisBrdf,
    /// The radiance that leaves the front, where an area light names the mesh.
    pub radiance: Option<Rgb>,
}

/// A BRDF. All act on the front of a surface alone.
#[derive(Clone, Debug, PartialEq)]
pub enum ArisBrdf {
    /// Burley 2012 with remapped masking.
    Disney(ArisDisney),
    /// Lambert.
    Diffuse {
        /// Linear reflectance in [0, 1].
        color: Rgb,
    },
    /// A perfect mirror.
    Mirror,
    /// A smooth interface between two clear media.
    Dielectric {
        /// The refractive index outside, above 0.
        ext_ior: f32,
        /// The refractive index inside, above 0.
        int_ior: f32,
    },
    /// Lambert under a Beckmann lobe of weight 1 - max(color).
    Microfacet {
        /// Linear diffuse reflectance in [0, 1].
        color: Rgb,
        /// The Beckmann alpha, in (0, 1].
        roughness: f32,
        /// The refractive index outside, above 0.
        ext_ior: f32,
        /// The refractive index inside, above 0.
        int_ior: f32,
    },
}

impl Default for ArisBrdf {
    fn default() -> Self {
        Self::Diffuse { color: Rgb::grey(0.8) }
    }
}

/// The parameters of `disney`, each in [0, 1], except `specular`, which may reach 12.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArisDisney {
    /// `color`, linear.
    pub color: Rgb,
    /// The ten scalars in the order of [`Parameter::BURLEY_2012`]; none where the file says nothing.
    pub scalars: [Option<f32>; 10],
}

impl ArisDisney {
    /// The key of a scalar in Aris' files.
    pub const fn key(parameter: Parameter) -> &'static str {
        match parameter {
            Parameter::SpecularTint => "specularTint",
            Parameter::SheenTint => "sheenTint",
            Parameter::ClearcoatGloss => "clearcoatGloss",
            other => other.name(),
        }
    }
}
