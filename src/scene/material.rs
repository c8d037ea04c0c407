//! Disney materials: each parameter a constant or a texture.

use glam::{Affine2, Vec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::texture::Texel;
use super::{AnisotropyMap, TextureId};
use crate::color::Rgb;
use crate::disney::{DiffuseModel, Masking, Model, Parameter};
use crate::math::Real;

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The kind of BSDF.
    pub model: Model,
    /// Linear reflectance.
    pub base_color: Param<Rgb>,
    /// The scalars, in the order of [`Parameter::ALL`].
    pub scalars: [Param<f32>; Parameter::COUNT],
    /// What one crossing of the dielectric interface lets pass; see [`crate::disney::Params`] for the default.
    pub transmission_color: Option<Param<Rgb>>,
    /// The colour of diffuse transmission; the base colour where absent.
    pub diff_trans_color: Option<Param<Rgb>>,
    /// A sheet without an inside.
    pub thin_walled: bool,
    /// What the inside of an interface takes of light, the coefficients of Beer's law per metre.
    pub absorption: Rgb,
    /// The roughness of the specular lobe's masking term.
    pub masking: Masking,
    /// The diffuse term.
    pub diffuse: DiffuseModel,
    /// Light that the surface sends out by itself.
    pub emission: Emission,
    /// How much of the surface is there.
    pub opacity: Opacity,
    /// Perturbs the shading normal.
    pub normal_map: Option<NormalMap>,
    /// glTF's anisotropy, in place of `anisotropic`: `roughness` is glTF's then.
    pub anisotropy: Option<AnisotropyMap>,
    /// Where the tangent comes from.
    pub frame: ShadingFrame,
    /// Turns the tangent about the normal, counter-clockwise, in radians.
    pub rotation: f32,
    /// The sides that scatter light; the other side blocks.
    pub sides: Sides,
    /// Its back is not there: what looks at it from behind sees through it.
    pub culled: bool,
    /// Whether the mesh's vertex colours multiply `base_color`.
    pub vertex_color: bool,
    /// Whether their alpha multiplies the opacity.
    pub vertex_alpha: bool,
}

impl Default for Material {
    /// The defaults of the model, on both sides, opaque, dark.
    fn default() -> Self {
        Self {
            model: Model::Disney,
            base_color: Param::Constant(Rgb::grey(0.8)),
            scalars: Parameter::ALL.map(|p| Param::Constant(p.default())),
            transmission_color: None,
            diff_trans_color: None,
            thin_walled: false,
            absorption: Rgb::BLACK,
            masking: Masking::default(),
            diffuse: DiffuseModel::default(),
            emission: Emission::default(),
            opacity: Opacity::default(),
            normal_map: None,
            anisotropy: None,
            frame: ShadingFrame::default(),
            rotation: 0.0,
            sides: Sides::Both,
            culled: false,
            vertex_color: false,
            vertex_alpha: false,
        }
    }
}

impl Material {
    /// The scalar of that name.
    pub fn scalar(&self, parameter: Parameter) -> &Param<f32> {
        &self.scalars[parameter as usize]
    }

    /// A mutable reference to the scalar of that name.
    pub fn scalar_mut(&mut self, parameter: Parameter) -> &mut Param<f32> {
        &mut self.scalars[parameter as usize]
    }

    /// Light goes through somewhere: by the dielectric interface, or diffusely.
    pub fn transmits(&self) -> bool {
        let may = |p| self.scalar(p).constant().is_none_or(|value| value > 0.0);
        match self.model {
            Model::Dielectric => true,
            Model::Disney => may(Parameter::SpecTrans) || may(Parameter::DiffTrans),
            Model::Diffuse | Model::Mirror => false,
        }
    }

    /// Its surface divides places: light that goes through enters or leaves an inside.
    pub fn is_interface(&self) -> bool {
        self.transmits() && (self.model == Model::Dielectric || !self.thin_walled)
    }

    /// Whether it lights other surfaces, or itself.
    pub fn is_light(&self) -> bool {
        self.emits() && !self.emission.unlit
    }

    /// Whether any light leaves the surface by itself.
    pub fn emits(&self) -> bool {
        let factor = match self.emission.color {
            Param::Constant(c) => c,
            Param::Texture { factor, .. } => factor,
        };
        self.emission.strength > 0.0 && !factor.is_black()
    }
}

/// A value that is the same everywhere, or varies over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Param<T> {
    /// The same everywhere.
    Constant(T),
    /// `factor` times the filtered texture.
    Texture {
        /// Which texture and how it lies on the surface.
        map: TextureMap,
        /// Multiplies the texture's value.
        factor: T,
    },
}

impl<T: Copy> Param<T> {
    /// The value, if it is the same everywhere.
    pub fn constant(&self) -> Option<T> {
        match *self {
            Self::Constant(value) => Some(value),
            Self::Texture { .. } => None,
        }
    }
}

/// A texture as one parameter uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureMap {
    /// The texture.
    pub texture: TextureId,
    /// What a scalar parameter reads of it; colours read R, G and B.
    pub channel: TextureChannel,
    /// What a scalar parameter makes of that, times the factor; colours are as they are.
    pub curve: Curve,
    /// The mesh's set of texture coordinates.
    pub uv_set: u32,
    /// Texture coordinates from the mesh's.
    pub texture_from_uv: Affine2,
}

impl TextureMap {
    /// `channel` of `texture` by the first set of coordinates as they are.
    pub fn new(texture: TextureId, channel: TextureChannel) -> Self {
        let (curve, texture_from_uv) = (Curve::Linear, Affine2::IDENTITY);
        Self { texture, channel, curve, uv_set: 0, texture_from_uv }
    }

    /// What a scalar parameter is where the filtered texture is `texel`.
    #[inline]
    pub fn scalar(&self, texel: &Texel, factor: f32) -> f32 {
        self.curve.at(factor * self.channel.of(texel))
    }

    /// Texture coordinates at the mesh's coordinates `uv`.
    pub fn coordinates(&self, uv: Vec2) -> Vec2 {
        self.texture_from_uv.transform_point2(uv)
    }
}

/// What a scalar reads of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureChannel {
    /// Red.
    #[default]
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha: 1 where the image has none.
    A,
    /// Luminance, by the weights of the Disney model.
    Y,
}

named_variants! { TextureChannel { R "r", G "g", B "b", A "a", Y "luminance", } }

impl TextureChannel {
    /// This channel of a texel.
    #[inline]
    pub fn of(self, texel: &Texel) -> f32 {
        match self {
            Self::R => texel.color.r,
            Self::G => texel.color.g,
            Self::B => texel.color.b,
            Self::A => texel.alpha,
            Self::Y => 0.3 * texel.color.r + 0.6 * texel.color.g + 0.1 * texel.color.b,
        }
    }
}

/// What a scalar parameter makes of a texture that holds another quantity. All are monotone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// The value itself.
    #[default]
    Linear,
    /// `clearcoat_gloss` of a coat's roughness: (0.1 - r²)/0.099, as Disney's alpha is lerp(0.1, 0.001, gloss).
    GlossOfRoughness,
    /// `roughness` of Phong's exponent n: (2/(n+2))^¼, the Beckmann width of the Blinn-Phong lobe (Walter 2007).
    RoughnessOfExponent,
}

named_variants! { Curve {
    Linear "linear",
    GlossOfRoughness "gloss_of_roughness",
    RoughnessOfExponent "roughness_of_exponent",
} }

impl Curve {
    /// The parameter where the texture times its factor is `value`.
    #[inline]
    pub fn at(self, value: f32) -> f32 {
        match self {
            Self::Linear => value,
            Self::GlossOfRoughness => ((0.1 - value * value) / 0.099).clamp(0.0, 1.0),
            Self::RoughnessOfExponent => Real::powf(2.0 / (value.max(0.0) + 2.0), 0.25),
        }
    }
}

/// Light that a surface sends out by itself: radiance = strength·color, the same in all directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission {
    /// Its colour.
    pub color: Param<Rgb>,
    /// Multiplies the colour.
    pub strength: f32,
    /// The sides it leaves.
    pub sides: Sides,
    /// The camera alone sees it, times the vertex colour if that counts: it lights nothing.
    pub unlit: bool,
}

impl Default for Emission {
    fn default() -> Self {
        Self { color: Param::Constant(Rgb::BLACK), strength: 1.0, sides: Sides::Front, unlit: false }
    }
}

/// How much of a surface is there: 0 lets everything pass, 1 nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Opacity {
    /// The alpha.
    pub alpha: Param<f32>,
    /// Alpha at or above this is 1 and below it is 0.
    pub cutoff: Option<f32>,
}

impl Default for Opacity {
    fn default() -> Self {
        Self { alpha: Param::Constant(1.0), cutoff: None }
    }
}

/// A tangent-space normal map.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Red and green hold x and y, [0, 1] for [-1, 1]; blue holds z.
    pub map: TextureMap,
    /// Multiplies x and y before normalising.
    pub scale: f32,
}

/// Where the shading frame's tangent comes from. It matters to anisotropic and normal-mapped materials alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadingFrame {
    /// The mesh's tangents, else its texture coordinates, else an arbitrary one.
    #[default]
    Surface,
    /// Nori's coordinate system of the shading normal, as Aris.
    Nori,
}

named_variants! { ShadingFrame { Surface "surface", Nori "nori", } }

/// Sides of a surface; the front is where its triangles are counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sides {
    /// The front alone.
    Front,
    /// Front and back.
    Both,
}

named_variants! { Sides { Front "front", Both "both", } }
