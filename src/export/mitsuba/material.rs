//! Materials as Mitsuba's BSDFs.

use super::element::Element;
use super::mesh::{Attributes, VERTEX_COLOR, VERTEX_OPACITY};
use super::texture::{Power, Reading, Textures};
use crate::color::Rgb;
use crate::disney::{BASE_COLOR, Model, Parameter};
use crate::scene::Scene;
use crate::scene::material::{Material, Param, Sides, TextureMap};

/// Mitsuba's `specular` is F0 over this and ends at 1; `eta` says the same without an end.
const F0_OF_SPECULAR: f32 = 0.08;
/// With an F0 of 0 Mitsuba sees no surface, and with it no metal.
const LEAST_F0: f32 = 1e-7;
/// With an F0 of 1 the index would be infinite.
const LARGEST_F0: f32 = 0.999;
/// Mitsuba's coat is 4·(n·l)(n·v) times ours: with this part of its strength it is the same head-on.
const COAT: f32 = 0.25;

/// The scalars of `principled` that may be textures and are 0 where they aren't said, with their names there and what they are
/// multiplied by.
const SCALARS: [(Parameter, &str, f32); 8] = [
    (Parameter::Metallic, "metallic", 1.0),
    (Parameter::Anisotropic, "anisotropic", 1.0),
    (Parameter::Subsurface, "flatness", 1.0),
    (Parameter::SpecularTint, "spec_tint", 1.0),
    (Parameter::Sheen, "sheen", 1.0),
    (Parameter::SheenTint, "sheen_tint", 1.0),
    (Parameter::Clearcoat, "clearcoat", COAT),
    (Parameter::ClearcoatGloss, "clearcoat_gloss", 1.0),
];

/// What a material reads of its meshes.
pub(super) fn attributes(material: &Material) -> Attributes {
    Attributes {
        uv_set: maps(material).first().map(|(_, map)| map.uv_set),
        color: material.base_color.constant().filter(|_| material.vertex_color),
        opacity: vertex_opacity(material),
    }
}

/// The constant that the alpha of vertex colours is multiplied by, if the two are all of the opacity.
pub(super) fn vertex_opacity(material: &Material) -> Option<f32> {
    let alpha = material.opacity.alpha.constant();
    alpha.filter(|_| material.vertex_alpha && material.opacity.cutoff.is_none())
}

/// All textures that a material reads, with the names of its fields. The first decides which coordinates the meshes have.
pub(super) fn maps(material: &Material) -> Vec<(&'static str, &TextureMap)> {
    fn map_of<T>(param: &Param<T>) -> Option<&TextureMap> {
        match param {
            Param::Constant(_) => None,
            Param::Texture { map, .. } => Some(map),
        }
    }
    let colors = [
        (BASE_COLOR, Some(&material.base_color)),
        ("transmission_color", material.transmission_color.as_ref()),
        ("diff_trans_color", material.diff_trans_color.as_ref()),
        ("emission", Some(&material.emission.color)),
    ];
    let colors = colors.into_iter().filter_map(|(name, param)| Some((name, map_of(param?)?)));
    let normal = material.normal_map.iter().map(|normal| ("normal_map", &normal.map));
    let scalars = Parameter::ALL.into_iter().map(|p| (p.name(), material.scalar(p)));
    let scalars = scalars.chain([("opacity", &material.opacity.alpha)]);
    let scalars = scalars.filter_map(|(name, param)| Some((name, map_of(param)?)));
    colors.chain(normal).chain(scalars).collect()
}

/// May the parameter be above 0 anywhere?
pub(super) fn may(material: &Material, parameter: Parameter) -> bool {
    material.scalar(parameter).constant().is_none_or(|value| value > 0.0)
}

/// Whether a parameter that may be above 0 has anything to say.
fn matters(material: &Material, parameter: Parameter) -> bool {
    let of_what = match parameter {
        Parameter::SheenTint => Parameter::Sheen,
        Parameter::ClearcoatGloss => Parameter::Clearcoat,
        other => other,
    };
    may(material, parameter) && may(material, of_what)
}

/// The coefficients of the medium inside, if it takes any light.
pub(super) fn absorption(material: &Material) -> Option<Rgb> {
    Some(material.absorption).filter(|absorption| material.is_interface() && !absorption.is_black())
}

/// Nothing but a smooth interface: Mitsuba has the same.
pub(super) fn is_smooth_glass(material: &Material) -> bool {
    let is = |p: Parameter, value: f32| material.scalar(p).constant() == Some(value);
    !material.thin_walled
        && is(Parameter::SpecTrans, 1.0)
        && [Parameter::Roughness, Parameter::Metallic, Parameter::Clearcoat, Parameter::DiffTrans]
            .into_iter()
            .all(|p| is(p, 0.0))
}

/// Makes BSDFs, and gathers the textures that they read.
pub(super) struct Bsdfs<'a, 's> {
    pub(super) scene: &'s Scene<Material>,
    pub(super) textures: &'a mut Textures<'s>,
}

impl Bsdfs<'_, '_> {
    /// The BSDF of a material.
    pub(super) fn of(&mut self, material: &Material) -> Element {
        let bsdf = match material.model {
            Model::Diffuse => {
                let diffuse = Element::plugin("bsdf", "diffuse");
                sided(material, self.base_color(diffuse, "reflectance", material))
            }
            Model::Mirror => sided(material, Element::plugin("bsdf", "conductor").string("material", "none")),
            Model::Dielectric => self.glass(material),
            Model::Disney if is_smooth_glass(material) => {
                let (tint, power) = tint(material);
                let glass = self.glass(material);
                self.color(glass, "specular_transmittance", tint, power)
            }
            Model::Disney => self.disney(material),
        };
        // The map is outside of `twosided`: seen from behind, the normal is the same one turned round.
        let mapped = match &material.normal_map {
            None => bsdf,
            Some(normal) => {
                let map = self.textures.element("normalmap", &normal.map, Reading::Normal(normal.scale));
                let adapter = Element::plugin("bsdf", "normalmap").boolean("use_shadowing_function", false);
                adapter.with(map).with(bsdf)
            }
        };
        match self.mask(material) {
            None => mapped,
            Some(mask) => mask.with(mapped),
        }
    }

    /// A smooth interface.
    fn glass(&self, material: &Material) -> Element {
        Element::plugin("bsdf", "dielectric")
            .float("int_ior", self.mean(material, Parameter::Ior))
            .float("ext_ior", 1.0)
    }

    /// A surface, blended with the sheets that let light pass where it is no metal: our BSDF is linear in either part.
    fn disney(&mut self, material: &Material) -> Element {
        let dielectric = 1.0 - self.mean(material, Parameter::Metallic);
        let interface = may(material, Parameter::SpecTrans);
        let mut bsdf = self.principled(material);
        if !interface || material.thin_walled {
            bsdf = sided(material, bsdf);
        }
        if interface && material.thin_walled {
            let sheet = self.sheet(material);
            bsdf = self.blend(bsdf, sheet, material.scalar(Parameter::SpecTrans), dielectric);
        }
        if may(material, Parameter::DiffTrans) {
            let color = material.diff_trans_color.as_ref().unwrap_or(&material.base_color);
            let leaf = Element::plugin("bsdf", "principledthin").float("diff_trans", 2.0);
            let leaf = self.color(leaf, "base_color", color, Power::One);
            bsdf = self.blend(bsdf, leaf, material.scalar(Parameter::DiffTrans), 0.5 * dielectric);
        }
        bsdf
    }

    /// A sheet that reflects and lets pass without diffuse light.
    fn sheet(&mut self, material: &Material) -> Element {
        let (tint, power) = tint(material);
        let sheet = Element::plugin("bsdf", "principledthin")
            .float("eta", self.mean(material, Parameter::Ior))
            .float("spec_trans", 1.0);
        let sheet = self.color(sheet, "base_color", tint, power);
        let sheet = self.scalar(sheet, "roughness", material.scalar(Parameter::Roughness), 1.0);
        if !may(material, Parameter::Anisotropic) {
            return sheet;
        }
        self.scalar(sheet, "anisotropic", material.scalar(Parameter::Anisotropic), 1.0)
    }

    /// All that isn't thin.
    fn principled(&mut self, material: &Material) -> Element {
        let interface = may(material, Parameter::SpecTrans) && !material.thin_walled;
        let mut element = Element::plugin("bsdf", "principled");
        element = match &material.transmission_color {
            // Its root is what Mitsuba lets pass, and there is nothing else of the colour to be seen.
            Some(tint) if interface && material.scalar(Parameter::SpecTrans).constant() == Some(1.0) => {
                self.color(element, "base_color", tint, Power::Square)
            }
            _ => self.base_color(element, "base_color", material),
        };
        element = self.scalar(element, "roughness", material.scalar(Parameter::Roughness), 1.0);
        for (parameter, name, factor) in SCALARS {
            if matters(material, parameter) {
                element = self.scalar(element, name, material.scalar(parameter), factor);
            }
        }
        if interface {
            let element = self.scalar(element, "spec_trans", material.scalar(Parameter::SpecTrans), 1.0);
            return element.float("eta", self.mean(material, Parameter::Ior));
        }
        let f0 = (F0_OF_SPECULAR * self.mean(material, Parameter::Specular)).clamp(LEAST_F0, LARGEST_F0);
        if f0 <= F0_OF_SPECULAR {
            element.float("specular", f0 / F0_OF_SPECULAR)
        } else {
            element.float("eta", 2.0 / (1.0 - f0.sqrt()) - 1.0)
        }
    }

    /// `weight` times `factor` of `second`, and the rest of `first`.
    fn blend(&mut self, first: Element, second: Element, weight: &Param<f32>, factor: f32) -> Element {
        if factor == 0.0 {
            return first;
        }
        if weight.constant().is_some_and(|weight| weight * factor >= 1.0) {
            return second;
        }
        let blend = Element::plugin("bsdf", "blendbsdf");
        self.scalar(blend, "weight", weight, factor).with(first).with(second)
    }

    /// What a cut-out or see-through material is wrapped into.
    fn mask(&mut self, material: &Material) -> Option<Element> {
        let mask = Element::plugin("bsdf", "mask");
        let opacity = &material.opacity;
        match &opacity.alpha {
            _ if vertex_opacity(material).is_some() => {
                Some(mask.with(mesh_attribute("opacity", VERTEX_OPACITY)))
            }
            Param::Constant(alpha) => {
                let alpha = constant_opacity(material).unwrap_or(*alpha);
                (alpha < 1.0).then(|| mask.float("opacity", alpha))
            }
            Param::Texture { map, factor } => {
                let reading = match opacity.cutoff {
                    None => Reading::Scalar(map.channel, *factor),
                    Some(cutoff) => Reading::Cut(map.channel, *factor, cutoff),
                };
                Some(mask.with(self.textures.element("opacity", map, reading)))
            }
        }
    }

    /// The base colour, or the vertex colours, which have it worked in.
    fn base_color(&mut self, element: Element, name: &str, material: &Material) -> Element {
        match material.base_color {
            Param::Constant(_) if material.vertex_color => element.with(mesh_attribute(name, VERTEX_COLOR)),
            _ => self.color(element, name, &material.base_color, Power::One),
        }
    }

    fn color(&mut self, element: Element, name: &str, param: &Param<Rgb>, power: Power) -> Element {
        match param {
            Param::Constant(color) => element.rgb(name, color.map(|v| power.of(v))),
            Param::Texture { map, factor } => {
                element.with(self.textures.element(name, map, Reading::Color(*factor, power)))
            }
        }
    }

    fn scalar(&mut self, element: Element, name: &str, param: &Param<f32>, factor: f32) -> Element {
        match param {
            Param::Constant(value) => element.float(name, value * factor),
            Param::Texture { map, factor: own } => {
                let reading = Reading::Scalar(map.channel, own * factor);
                element.with(self.textures.element(name, map, reading))
            }
        }
    }

    /// A parameter that Mitsuba has no textures for.
    fn mean(&self, material: &Material, parameter: Parameter) -> f32 {
        self.scene.mean_scalar(material.scalar(parameter))
    }

    /// What a mesh of this material shines with. Mitsuba's masks leave emission as it is, so that it is what is there that shines.
    pub(super) fn emitter(&mut self, material: &Material) -> Option<Element> {
        if !material.emits() {
            return None;
        }
        let emission = &material.emission;
        let cover = constant_opacity(material).unwrap_or(1.0) * emission.strength;
        let emitter = Element::plugin("emitter", "area");
        Some(match (&emission.color, &material.opacity.alpha) {
            (Param::Constant(color), _) => emitter.rgb("radiance", *color * cover),
            (Param::Texture { map, factor }, Param::Texture { map: of_alpha, factor: alpha })
                if shines_where_it_is(material) =>
            {
                let least = material.opacity.cutoff;
                let reading = Reading::Shining(*factor * cover, of_alpha.channel, *alpha, least);
                emitter.with(self.textures.element("radiance", map, reading))
            }
            (Param::Texture { map, factor }, _) => {
                let reading = Reading::Color(*factor * cover, Power::One);
                emitter.with(self.textures.element("radiance", map, reading))
            }
        })
    }
}

/// The opacity, if it is the same everywhere.
fn constant_opacity(material: &Material) -> Option<f32> {
    let opacity = &material.opacity;
    let alpha = opacity.alpha.constant().filter(|_| !material.vertex_alpha)?;
    Some(opacity.cutoff.map_or(alpha.clamp(0.0, 1.0), |cutoff| f32::from(alpha >= cutoff)))
}

/// Whether what is cut out can be taken out of the emission as well: a constant, or a texture that lies as the emission's does.
pub(super) fn shines_where_it_is(material: &Material) -> bool {
    match (&material.emission.color, &material.opacity.alpha) {
        _ if constant_opacity(material).is_some() => true,
        (Param::Texture { map: a, .. }, Param::Texture { map: b, .. }) => {
            let place = |map: &TextureMap| (map.texture, map.uv_set, map.texture_from_uv);
            place(a) == place(b) && !material.vertex_alpha
        }
        _ => false,
    }
}

/// What one crossing of an interface, or of a sheet, lets pass, as a power of a parameter.
fn tint(material: &Material) -> (&Param<Rgb>, Power) {
    match &material.transmission_color {
        Some(tint) => (tint, Power::One),
        None if material.thin_walled => (&material.base_color, Power::One),
        None => (&material.base_color, Power::Root),
    }
}

/// The BSDF on the sides that the material scatters from.
fn sided(material: &Material, bsdf: Element) -> Element {
    match material.sides {
        Sides::Front => bsdf,
        Sides::Both => Element::plugin("bsdf", "twosided").with(bsdf),
    }
}

fn mesh_attribute(parameter: &str, attribute: &str) -> Element {
    Element::plugin("texture", "mesh_attribute").named(parameter).string("name", attribute)
}

/// The medium inside an interface: it takes light and scatters none.
pub(super) fn medium(absorption: Rgb) -> Element {
    // Colours end at 1, the factor doesn't.
    let largest = absorption.max_channel();
    Element::plugin("medium", "homogeneous")
        .rgb("albedo", Rgb::BLACK)
        .rgb("sigma_t", absorption / largest)
        .float("scale", largest)
}
