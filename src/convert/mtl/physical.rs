//! The physically based statements that exporters add to MTL: `Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `anisor` and their maps.

use std::f32::consts::TAU;

use super::{Conversion, SCALAR};
use crate::convert::Quality;
use crate::disney::{Model, Parameter};
use crate::scene::material::{Curve, Param, TextureMap};
use crate::scene::source::MtlSlot;

impl Conversion<'_> {
    pub(super) fn physically_based(&mut self) {
        if self.out.model != Model::Disney {
            return self.physically_based_left_out();
        }
        let source = self.source;
        let exact = (Quality::Carried, "");
        let sheen = (Quality::Approximated, "Disney's sheen has no roughness");
        let gloss = (Quality::Approximated, "GTR1 of the same alpha, which reaches from 0.001 to 0.1");
        self.mapped("Pr", source.pr, MtlSlot::Pr, Parameter::Roughness, Curve::Linear, exact);
        self.mapped("Pm", source.pm, MtlSlot::Pm, Parameter::Metallic, Curve::Linear, exact);
        self.mapped("Ps", source.ps, MtlSlot::Ps, Parameter::Sheen, Curve::Linear, sheen);
        self.mapped("Pc", source.pc, MtlSlot::Pc, Parameter::Clearcoat, Curve::Linear, exact);
        let (slot, curve) = (MtlSlot::Pcr, Curve::GlossOfRoughness);
        self.mapped("Pcr", source.pcr, slot, Parameter::ClearcoatGloss, curve, gloss);
        self.scalar("aniso", source.aniso, Parameter::Anisotropic, Curve::Linear, exact);
        if let Some(turns) = source.anisor {
            // Whole turns change nothing, and keep the angle small.
            self.out.rotation = turns.fract() * TAU;
            self.note("anisor", Quality::Carried, "in turns");
        }
    }

    fn physically_based_left_out(&mut self) {
        let source = self.source;
        let given = [
            ("Pr", source.pr),
            ("Pm", source.pm),
            ("Ps", source.ps),
            ("Pc", source.pc),
            ("Pcr", source.pcr),
            ("aniso", source.aniso),
            ("anisor", source.anisor),
        ];
        for (field, value) in given.into_iter().filter_map(|(field, value)| Some((field, value?))) {
            let none = value == 0.0;
            let quality = if none { Quality::Exact } else { Quality::Dropped };
            self.note(field, quality, if none { "" } else { "smooth glass has no such lobe" });
        }
    }

    fn scalar(
        &mut self,
        field: &str,
        value: Option<f32>,
        to: Parameter,
        curve: Curve,
        (quality, reason): (Quality, &str),
    ) {
        let Some(value) = value else { return };
        let value = self.limited(field, value, 1.0);
        self.set(to, curve.at(value));
        self.note(field, quality, reason);
    }

    /// A scalar that may have a map. The map is the value: exporters leave any number beside it.
    fn mapped(
        &mut self,
        field: &str,
        value: Option<f32>,
        slot: MtlSlot,
        to: Parameter,
        curve: Curve,
        told: (Quality, &str),
    ) {
        let Some(map) = self.map(slot, SCALAR) else {
            return self.scalar(field, value, to, curve, told);
        };
        *self.out.scalar_mut(to) = Param::Texture { map: TextureMap { curve, ..map }, factor: 1.0 };
        self.note(slot.statement(), told.0, told.1);
        if value.is_some() {
            self.note(field, Quality::Dropped, format!("{} is given", slot.statement()));
        }
    }
}
