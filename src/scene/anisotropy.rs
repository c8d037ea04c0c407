//! Anisotropy as glTF has it: a strength and a direction that a texture may vary.

use std::f32::consts::TAU;

use super::material::{Param, TextureMap};
use super::texture::Texel;
use super::{Material, Scene};
use crate::disney::Parameter;
use crate::math::{Number, Real};

/// KHR_materials_anisotropy where its terms vary over the surface, or the roughness that they belong to does. Disney's roughness and
/// anisotropic follow from both by [`Self::disney`] at each point; where nothing varies a conversion does that once.
#[derive(Clone, Debug, PartialEq)]
pub struct AnisotropyMap {
    /// Red and green hold the direction in tangent space, [0, 1] for [-1, 1]; blue multiplies the strength.
    pub map: Option<TextureMap>,
    /// How much longer the highlight is along the tangent, in [0, 1].
    pub strength: f32,
}

/// Disney's terms for glTF's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisneyAnisotropy {
    /// Roughness, in [0, 1].
    pub roughness: f32,
    /// Anisotropic; above 1 where the alphas' ratio is more than Disney's 10.
    pub anisotropic: f32,
}

impl AnisotropyMap {
    /// The strength where the map is `texel`, and the angle by which the direction there is turned from the tangent, in radians,
    /// counter-clockwise.
    pub fn at(&self, texel: Option<&Texel>) -> (f32, f32) {
        let Some(texel) = texel else { return (self.strength, 0.0) };
        let strength = (self.strength * texel.color.b).clamp(0.0, 1.0);
        let (x, y) = (2.0 * texel.color.r - 1.0, 2.0 * texel.color.g - 1.0);
        // The middle of 8 bits isn't 0: what is nearly no direction is none.
        let angle = if x.abs().max(y.abs()) < 0.01 { 0.0 } else { Real::atan2(y, x) };
        (strength, angle.rem_euclid(TAU))
    }

    /// Disney's terms for glTF's `roughness` and `strength`, both in [0, 1]: with a = roughness² along the bitangent and
    /// t = a + (1-a)·strength² along the tangent, Disney's alphas roughness²/aspect and roughness²·aspect are t and a for
    /// roughness = (t·a)^¼ and anisotropic = (1 - a/t)/0.9.
    pub fn disney(roughness: f32, strength: f32) -> DisneyAnisotropy {
        let a = Number::sqr(roughness);
        let t = a + (1.0 - a) * Number::sqr(strength);
        let ratio = if t > 0.0 { a / t } else { 1.0 };
        DisneyAnisotropy { roughness: (t * a).sqrt().sqrt(), anisotropic: (1.0 - ratio) / 0.9 }
    }
}

impl Scene<Material> {
    /// `material` with Disney's anisotropy in place of glTF's, from the means of what varies: for those who have no such map. Directions
    /// that differ have no mean; the tangent stands for them.
    pub fn with_mean_anisotropy(&self, material: &Material) -> Material {
        let mut flat = material.clone();
        let Some(anisotropy) = flat.anisotropy.take() else { return flat };
        let (strength, _) = anisotropy.at(anisotropy.map.as_ref().map(|map| self.mean_texel(map)).as_ref());
        let roughness = material.scalar(Parameter::Roughness);
        let disney = AnisotropyMap::disney(self.mean_scalar(roughness), strength);
        *flat.scalar_mut(Parameter::Anisotropic) = Param::Constant(disney.anisotropic.min(1.0));
        if roughness.constant().is_some() {
            *flat.scalar_mut(Parameter::Roughness) = Param::Constant(disney.roughness);
        }
        flat
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;

    #[test]
    fn disneys_alphas_are_those_of_gltf() {
        for (roughness, strength) in [(0.3, 0.1), (0.5, 0.4), (0.9, 1.0), (0.6, 0.0)] {
            let disney = AnisotropyMap::disney(roughness, strength);
            let aspect = (1.0 - 0.9 * disney.anisotropic).sqrt();
            let (ax, ay) = (disney.roughness.sqr() / aspect, disney.roughness.sqr() * aspect);
            let a = roughness * roughness;
            assert!((ax - (a + (1.0 - a) * strength * strength)).abs() < 1e-6, "{roughness} {strength}");
            assert!((ay - a).abs() < 1e-6, "{roughness} {strength}");
        }
    }

    #[test]
    fn a_texel_turns_and_weakens() {
        let map = AnisotropyMap { map: None, strength: 0.8 };
        let texel = |r, g, b| Texel { color: Rgb::new(r, g, b), alpha: 1.0 };
        assert_eq!(map.at(None), (0.8, 0.0));
        assert_eq!(map.at(Some(&texel(1.0, 0.5, 0.5))), (0.4, 0.0));
        let (_, up) = map.at(Some(&texel(0.5, 1.0, 1.0)));
        assert!((up - TAU / 4.0).abs() < 1e-6, "green is along the bitangent");
        assert_eq!(map.at(Some(&texel(0.502, 0.502, 1.0))), (0.8, 0.0), "8 bits have no middle");
    }
}
