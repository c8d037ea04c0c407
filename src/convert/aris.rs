//! Aris BRDFs into Disney materials.

use super::{Note, Quality};
use crate::disney::{DiffuseModel, Masking, Model, Parameter};
use crate::math::Number;
use crate::record::Warning;
use crate::scene::Material;
use crate::scene::material::{Param, ShadingFrame, Sides};
use crate::scene::source::{ArisBrdf, ArisDisney, ArisMaterial};

/// The material `name` in Disney's terms, with a note on every field. Surfaces scatter and emit at their front alone.
pub(super) fn convert(
    name: &str,
    source: &ArisMaterial,
    notes: &mut Vec<Note>,
    warnings: &mut Vec<Warning>,
) -> Material {
    let mut out = Material { sides: Sides::Front, frame: ShadingFrame::Nori, ..Material::default() };
    let mut note = |field: &str, quality: Quality, reason: &str| {
        let (material, field, reason) = (name.to_owned(), field.to_owned(), reason.to_owned());
        notes.push(Note { material, field, quality, reason });
    };
    match &source.brdf {
        ArisBrdf::Disney(disney) => {
            set_disney(&mut out, disney);
            note("color", Quality::Exact, "");
            for (parameter, value) in Parameter::BURLEY_2012.into_iter().zip(disney.scalars) {
                if value.is_some() {
                    note(ArisDisney::key(parameter), Quality::Exact, "");
                }
            }
        }
        ArisBrdf::Diffuse { color } => {
            out.model = Model::Diffuse;
            out.base_color = Param::Constant(*color);
            note("color", Quality::Exact, "");
        }
        ArisBrdf::Mirror => {
            out.model = Model::Mirror;
            note("mirror", Quality::Exact, "");
        }
        ArisBrdf::Dielectric { ext_ior, int_ior } => {
            out.model = Model::Dielectric;
            *out.scalar_mut(Parameter::Ior) = Param::Constant(int_ior / ext_ior);
            // Light passes from either side.
            out.sides = Sides::Both;
            note("ext_ior", Quality::Exact, "");
            note("int_ior", Quality::Exact, "");
        }
        ArisBrdf::Microfacet { color, roughness, ext_ior, int_ior } => {
            out.base_color = Param::Constant(*color);
            out.diffuse = DiffuseModel::Lambert;
            let ks = 1.0 - color.max_channel();
            let f0 = ((int_ior - ext_ior) / (int_ior + ext_ior)).sqr();
            let specular = (ks * f0 / 0.08).min(Parameter::Specular.max());
            *out.scalar_mut(Parameter::Specular) = Param::Constant(specular);
            *out.scalar_mut(Parameter::Roughness) = Param::Constant(roughness.sqrt());
            note("color", Quality::Exact, "");
            note(
                "roughness",
                Quality::Approximated,
                "GGX of the Beckmann lobe's alpha: its tails are longer",
            );
            let reason =
                "specular from the indices, times 1 - max(color); Schlick's Fresnel for the exact one";
            note("ext_ior", Quality::Approximated, reason);
            note("int_ior", Quality::Approximated, reason);
            if ks > 0.0 && ks < 1.0 {
                let what = "the weight 1 - max(color) scales the reflectance at normal incidence, not at grazing angles";
                warnings.push(Warning::new(format!("material {name:?}"), what));
            }
        }
    }
    if let Some(radiance) = source.radiance {
        out.emission.color = Param::Constant(radiance);
        out.emission.sides = Sides::Front;
        note("radiance", Quality::Exact, "");
    }
    out
}

fn set_disney(out: &mut Material, disney: &ArisDisney) {
    out.model = Model::Disney;
    out.masking = Masking::Remapped;
    out.base_color = Param::Constant(disney.color);
    for (parameter, value) in Parameter::BURLEY_2012.into_iter().zip(disney.scalars) {
        *out.scalar_mut(parameter) = Param::Constant(value.unwrap_or(parameter.default()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;

    fn converted(brdf: ArisBrdf, radiance: Option<Rgb>) -> (Material, Vec<Note>) {
        let (mut notes, mut warnings) = (Vec::new(), Vec::new());
        let material = convert("m", &ArisMaterial { brdf, radiance }, &mut notes, &mut warnings);
        (material, notes)
    }

    #[test]
    fn disney_is_exact_with_remapped_masking_in_noris_frame() {
        let scalars = std::array::from_fn(|i| (i != 3).then_some(0.05 * i as f32));
        let (material, notes) =
            converted(ArisBrdf::Disney(ArisDisney { color: Rgb::grey(0.3), scalars }), None);
        assert_eq!((material.masking, material.frame), (Masking::Remapped, ShadingFrame::Nori));
        assert_eq!((material.model, material.sides), (Model::Disney, Sides::Front));
        for (i, parameter) in Parameter::BURLEY_2012.into_iter().enumerate() {
            let expected = if i == 3 { parameter.default() } else { 0.05 * i as f32 };
            assert_eq!(material.scalar(parameter).constant(), Some(expected), "{parameter:?}");
        }
        assert_eq!(notes.len(), 10, "a colour and nine scalars");
        assert!(notes.iter().all(|n| n.quality == Quality::Exact));
    }

    #[test]
    fn lights_shine_from_the_front_of_their_material() {
        let (material, _) = converted(ArisBrdf::Diffuse { color: Rgb::BLACK }, Some(Rgb::grey(40.0)));
        assert_eq!((material.model, material.sides), (Model::Diffuse, Sides::Front));
        assert_eq!(material.emission.sides, Sides::Front);
        assert!(material.emits());
    }

    #[test]
    fn delta_materials_keep_their_index() {
        assert_eq!(converted(ArisBrdf::Mirror, None).0.model, Model::Mirror);
        let (glass, _) = converted(ArisBrdf::Dielectric { ext_ior: 1.25, int_ior: 1.5 }, None);
        assert_eq!((glass.model, glass.sides), (Model::Dielectric, Sides::Both));
        assert_eq!(glass.scalar(Parameter::Ior).constant(), Some(1.2));
    }

    #[test]
    fn microfacet_is_near() {
        let brdf =
            ArisBrdf::Microfacet { color: Rgb::grey(0.2), roughness: 0.25, ext_ior: 1.0, int_ior: 1.5 };
        let (material, notes) = converted(brdf, None);
        assert_eq!(material.diffuse, DiffuseModel::Lambert);
        assert_eq!(material.scalar(Parameter::Roughness).constant(), Some(0.5));
        assert!((material.scalar(Parameter::Specular).constant().unwrap() - 0.4).abs() < 1e-6);
        assert!(notes.iter().any(|n| n.quality == Quality::Approximated));
    }
}
