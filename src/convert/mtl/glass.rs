//! MTL's refraction: smooth and rough glass.

use super::Conversion;
use crate::color::Rgb;
use crate::convert::Quality;
use crate::disney::{Model, Parameter};
use crate::scene::material::Param;
use crate::scene::source::{MtlMaterial, MtlSlot};

/// Refraction is asked for by `illum` 6 or 7, or by 4 with a filter that lets light pass, and nothing makes the surface a metal.
pub(super) fn refracts(source: &MtlMaterial) -> bool {
    let passes = source.tf.map(|tf| tf.max_channel() > 0.0);
    let asked = match source.illum {
        Some(6 | 7) => passes.unwrap_or(true),
        Some(4) => passes.unwrap_or(false),
        _ => false,
    };
    let metal = source.pm.unwrap_or(0.0) > 0.0 || source.map(MtlSlot::Pm).is_some();
    asked && !metal
}

/// Smooth glass: nothing makes a surface that refracts rough.
pub(super) fn is_glass(source: &MtlMaterial) -> bool {
    let smooth = source.pr.unwrap_or(0.0) <= 0.0 && source.map(MtlSlot::Pr).is_none();
    refracts(source) && smooth
}

impl Conversion<'_> {
    /// `Tf`, and `illum` where it asks for transmission.
    pub(super) fn transmission(&mut self) {
        let illum = self.source.illum;
        if self.out.model == Model::Dielectric {
            self.index_of_glass();
            self.note(
                "illum",
                Quality::Approximated,
                "a smooth dielectric: Fresnel reflection and refraction",
            );
            match self.source.tf {
                Some(tf) if tf != Rgb::WHITE => {
                    // The same interface in the model that has a tint.
                    self.out.model = Model::Disney;
                    self.set(Parameter::Roughness, 0.0);
                    self.tinted_interface(tf);
                }
                Some(_) => self.note("Tf", Quality::Exact, ""),
                None => {}
            }
            return;
        }
        if refracts(self.source) {
            self.index_of_glass();
            self.tinted_interface(self.source.tf.unwrap_or(Rgb::WHITE));
            self.note("illum", Quality::Approximated, "rough glass, of Pr's roughness");
            return;
        }
        let asks = matches!(illum, Some(4 | 6 | 7 | 9));
        if illum.is_some() {
            let overridden = self.source.is_physically_based();
            match illum {
                _ if overridden => {
                    self.note("illum", Quality::Exact, "overridden by the physically based statements")
                }
                Some(0..=2) => self.note("illum", Quality::Exact, ""),
                Some(4 | 6 | 7 | 9) => {
                    self.note("illum", Quality::Approximated, "reflections are the specular lobe's")
                }
                Some(10) => {
                    self.note("illum", Quality::Dropped, "casting shadows on invisible surfaces is not done")
                }
                _ => self.note("illum", Quality::Approximated, "reflections are the specular lobe's"),
            }
        }
        if let Some(tf) = self.source.tf {
            let reason = match illum {
                _ if !asks => "illum asks for no transmission",
                Some(9) => "transparency without refraction is d's",
                _ if tf.is_black() => "nothing passes",
                _ => "metal lets nothing pass",
            };
            let exact = !asks || tf.is_black();
            self.note("Tf", if exact { Quality::Exact } else { Quality::Dropped }, reason);
        }
    }

    /// `Ni` as the index of what lets light pass.
    fn index_of_glass(&mut self) {
        let Some(ni) = self.source.ni else { return };
        match Parameter::Ior.check(ni) {
            Ok(ni) => self.set(Parameter::Ior, ni),
            Err(range) => {
                self.warn(format!("Ni: {range}; {} is taken", Parameter::Ior.default()));
            }
        }
        self.note("Ni", Quality::Exact, "");
    }

    /// `Tf` as what each crossing of the surface lets pass.
    fn tinted_interface(&mut self, tf: Rgb) {
        self.set(Parameter::SpecTrans, 1.0);
        let tint = self.limited_color("Tf", tf);
        self.out.transmission_color = Some(Param::Constant(tint));
        if self.source.tf.is_some() {
            self.note(
                "Tf",
                Quality::Approximated,
                "tints each crossing of the surface, whatever the thickness",
            );
        }
    }
}
