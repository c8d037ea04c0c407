//! All models in terms of the Disney model, for formats that know no other.

use crate::color::Rgb;
use crate::disney::{Model, Parameter};
use crate::scene::material::{Material, Param};

/// Burley's diffuse term of this roughness has Lambert's albedo within 1.5% up to 85° (at 1 it is 4% above at 0° and 40% at 85°).
const NEAR_LAMBERT: f32 = 0.45;

/// `material` by the parameters of the Disney model alone: Lambert as a base without highlight, a mirror as white metal, a dielectric as
/// its interface, the last two smooth.
pub(super) fn principled(material: &Material) -> Material {
    let mut flat = material.clone();
    if material.model == Model::Disney {
        return flat;
    }
    flat.model = Model::Disney;
    flat.scalars = Parameter::ALL.map(|p| Param::Constant(p.default()));
    let mut set = |parameter, value| *flat.scalar_mut(parameter) = Param::Constant(value);
    match material.model {
        Model::Disney => {}
        Model::Diffuse => {
            set(Parameter::Specular, 0.0);
            set(Parameter::F90, 0.0);
            set(Parameter::Roughness, NEAR_LAMBERT);
        }
        Model::Mirror => {
            set(Parameter::Metallic, 1.0);
            set(Parameter::Roughness, 0.0);
            flat.base_color = Param::Constant(Rgb::WHITE);
            flat.vertex_color = false;
        }
        Model::Dielectric => {
            set(Parameter::SpecTrans, 1.0);
            set(Parameter::Roughness, 0.0);
            *flat.scalar_mut(Parameter::Ior) = material.scalar(Parameter::Ior).clone();
            flat.base_color = Param::Constant(Rgb::WHITE);
            flat.transmission_color = Some(Param::Constant(Rgb::WHITE));
            flat.thin_walled = false;
            flat.vertex_color = false;
        }
    }
    flat
}
