//! What becomes of each field of a material: exact, carried, approximated or dropped, and why.

use super::material::{absorption, is_smooth_glass, maps, may, shines_where_it_is, vertex_opacity};
use crate::convert::{Note, Quality};
use crate::disney::{DiffuseModel, Masking, Model, Parameter};
use crate::scene::material::{Material, ShadingFrame, Sides};
use crate::scene::{Named, Scene};

use Quality::{Approximated, Carried, Dropped, Exact};

/// Gathers notes on one material.
struct Notes<'a> {
    scene: &'a Scene<Material>,
    name: &'a str,
    material: &'a Material,
    notes: Vec<Note>,
}

/// The notes on a material.
pub(super) fn notes(scene: &Scene<Material>, Named { name, item }: &Named<Material>) -> Vec<Note> {
    let mut notes = Notes { scene, name, material: item, notes: Vec::new() };
    notes.of_model();
    notes.of_textures();
    notes.of_surface();
    notes.of_emission();
    notes.notes
}

impl Notes<'_> {
    fn tell(&mut self, field: &str, quality: Quality, reason: &str) {
        let (material, field, reason) = (self.name.to_owned(), field.to_owned(), reason.to_owned());
        self.notes.push(Note { material, field, quality, reason });
    }

    fn tell_if(&mut self, is: bool, field: &str, quality: Quality, reason: &str) {
        if is {
            self.tell(field, quality, reason);
        }
    }

    fn of_model(&mut self) {
        match self.material.model {
            Model::Diffuse => self.tell("diffuse", Exact, ""),
            Model::Mirror => self.tell("mirror", Exact, "a conductor that reflects all"),
            Model::Dielectric => self.tell("dielectric", Exact, ""),
            Model::Disney if is_smooth_glass(self.material) => {
                self.tell("disney", Exact, "a smooth interface, which is Mitsuba's dielectric");
                self.tell_if(absorption(self.material).is_some(), "absorption", Exact, "a medium inside");
            }
            Model::Disney => self.of_disney(),
        }
    }

    fn of_disney(&mut self) {
        let m = self.material;
        let interface = may(m, Parameter::SpecTrans) && !m.thin_walled;
        if !interface {
            self.of_highlight();
        }
        let masking = "the roughness of G is that of the highlight";
        self.tell_if(m.masking == Masking::Remapped, "masking", Approximated, masking);
        self.tell_if(m.diffuse != DiffuseModel::Burley, "diffuse", Approximated, "Burley's diffuse term");
        let hue = "the hue is the colour over Rec. 709's luminance, not over 0.3 R + 0.6 G + 0.1 B";
        self.tell_if(may(m, Parameter::SpecularTint), "specular_tint", Carried, hue);
        let tints_sheen = may(m, Parameter::Sheen) && may(m, Parameter::SheenTint);
        self.tell_if(tints_sheen, "sheen_tint", Carried, hue);
        let coat = "a quarter: Mitsuba's is 4·(n·l)(n·v) times Burley's, so the same head-on, half at 45° and less beyond";
        self.tell_if(may(m, Parameter::Clearcoat), "clearcoat", Approximated, coat);
        self.of_grain();
        self.tell_if(absorption(m).is_some(), "absorption", Exact, "a medium inside");
        if may(m, Parameter::SpecTrans) {
            self.of_transmission(interface);
        }
        let leaf = "blended with a sheet: highlights, sheen and coat fade by as much as the sheet lets pass";
        self.tell_if(may(m, Parameter::DiffTrans), "diff_trans", Approximated, leaf);
    }

    /// The highlight of a surface that no interface lies behind.
    fn of_highlight(&mut self) {
        let constant = |p: Parameter| self.material.scalar(p).constant();
        let (specular, f90) = (constant(Parameter::Specular), constant(Parameter::F90));
        let is_metal = constant(Parameter::Metallic) == Some(1.0);
        let is_dull = specular == Some(0.0);
        if is_metal || (is_dull && f90 == Some(0.0)) {
            return self.tell("disney", Exact, "principled has the same terms");
        }
        if is_dull {
            let reason = "no highlight: with specular 0 ours still rises to f90 at grazing angles";
            return self.tell("disney", Approximated, reason);
        }
        let reason = "the same terms in principled, but dielectric highlights by Fresnel's equations for Schlick's: at ior 1.5 up to 0.02 more of the light at 60°";
        self.tell("disney", Carried, reason);
        self.tell_if(f90 != Some(1.0), "f90", Dropped, "highlights rise to 1 at grazing angles");
        match specular {
            None => self.tell("specular", Approximated, "the texture's mean"),
            Some(specular) => self.tell_if(specular > 12.48, "specular", Approximated, "F0 ends at 0.999"),
        }
    }

    fn of_grain(&mut self) {
        let m = self.material;
        if !may(m, Parameter::Anisotropic) {
            return;
        }
        match m.frame {
            ShadingFrame::Surface => {
                self.tell("anisotropic", Carried, "along growing u, whatever tangents the mesh has")
            }
            ShadingFrame::Nori => self.tell("anisotropic", Approximated, "the grain runs another way"),
        }
        self.tell_if(m.rotation != 0.0, "rotation", Dropped, "the grain runs along u");
    }

    fn of_transmission(&mut self, interface: bool) {
        let m = self.material;
        let constant = |p: Parameter| m.scalar(p).constant();
        self.tell_if(constant(Parameter::Ior).is_none(), "ior", Approximated, "the texture's mean");
        let is_smooth = constant(Parameter::Roughness).is_none_or(|r| r == 0.0);
        self.tell_if(
            is_smooth,
            "roughness",
            Approximated,
            "alpha is at least 0.001, where 0 is perfectly smooth",
        );
        let is_whole = constant(Parameter::SpecTrans) == Some(1.0);
        if interface {
            let reason = "a rough interface by the same terms";
            self.tell("spec_trans", if is_whole { Exact } else { Carried }, reason);
            self.tell_if(!is_whole, "specular", Approximated, "one index for both: ior");
            self.tell_if(
                !is_whole && m.transmission_color.is_some(),
                "transmission_color",
                Approximated,
                "the square root of the base colour",
            );
        } else {
            self.tell("spec_trans", Exact, "blended with principledthin");
            let partly = |p: Parameter| constant(p) != Some(0.0) && constant(p) != Some(1.0);
            let reason = "where it is neither 0 nor 1, too much or too little is blended";
            self.tell_if(partly(Parameter::Metallic), "metallic", Approximated, reason);
        }
    }

    fn of_textures(&mut self) {
        let maps = maps(self.material);
        let Some((_, first)) = maps.first() else { return };
        for (field, map) in &maps {
            let texture = &self.scene.textures[map.texture.0 as usize];
            let other = "the coordinates of another set: Mitsuba's meshes have one";
            self.tell_if(map.uv_set != first.uv_set, field, Approximated, other);
            let [u, v] = texture.wrap;
            self.tell_if(u != v, field, Approximated, "outside the image both axes go on as the first does");
        }
    }

    fn of_surface(&mut self) {
        let m = self.material;
        self.tell_if(m.culled, "culled", Dropped, "the back is there, and shaded");
        if m.normal_map.is_some() {
            let reason = "read as if u and v were nowhere mirrored; normals that face away are turned over, not just far enough";
            self.tell("normal_map", Carried, reason);
        }
        let textured = m.base_color.constant().is_none();
        match (m.vertex_color, textured) {
            (true, true) => self.tell("vertex_color", Dropped, "Mitsuba multiplies no textures"),
            (true, false) => self.tell("vertex_color", Exact, "with the base colour in the meshes"),
            (false, _) => {}
        }
        let lost = m.vertex_alpha && vertex_opacity(m).is_none();
        self.tell_if(lost, "vertex_alpha", Dropped, "Mitsuba multiplies no textures");
        match (&m.opacity.alpha.constant(), m.opacity.cutoff) {
            (None, Some(_)) => {
                self.tell("opacity", Approximated, "cut at the edges of texels, not between them")
            }
            (Some(1.0), _) => {}
            _ => self.tell("opacity", Exact, ""),
        }
    }

    fn of_emission(&mut self) {
        let m = self.material;
        if !m.emits() {
            return;
        }
        self.tell_if(m.emission.unlit, "unlit", Approximated, "it lights other surfaces, too");
        match (m.emission.sides, can_shine_behind(m)) {
            (Sides::Front, _) => self.tell("emission", Exact, ""),
            (Sides::Both, true) => {
                self.tell("emission", Carried, "a second mesh just behind shines to the back")
            }
            (Sides::Both, false) => self.tell("emission", Approximated, "the front alone shines"),
        }
        let is_varied = !is_opaque(m) && m.emission.color.constant().is_none() && shines_where_it_is(m);
        let reason =
            "seen as it is, but what Mitsuba has it throw on others was up to 1.2 times as much in a test";
        self.tell_if(is_varied, "emission", Approximated, reason);
        self.tell_if(!shines_where_it_is(m), "emission", Approximated, "what is cut out shines too");
    }
}

/// A second mesh may stand behind one that shines to both sides: what is not opaque has a clear one.
pub(super) fn can_shine_behind(material: &Material) -> bool {
    !material.transmits()
}

/// All of it is there.
pub(super) fn is_opaque(material: &Material) -> bool {
    material.opacity == Default::default() && !material.vertex_alpha
}
