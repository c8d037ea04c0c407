//! MaterialX 1.39 documents with a `disney_principled` node for each material.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};

use super::names::Identifiers;
use super::principled::principled;
use crate::color::Rgb;
use crate::convert::{Note, Quality};
use crate::disney::{BASE_COLOR, DiffuseModel, Masking, Model, Parameter};
use crate::library::TextureFiles;
use crate::scene::material::{Param, TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, TexelFilter, Wrap};
use crate::scene::{Material, Named, Scene};

/// A document's text with what the format has no place for.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) text: String,
    pub(super) notes: Vec<Note>,
}

/// What a document's file is called.
pub(super) const FILE_NAME: &str = "materials.mtlx";

/// The scalars that `disney_principled` has, with their names there.
const INPUTS: [(Parameter, &str); 11] = [
    (Parameter::Metallic, "metallic"),
    (Parameter::Roughness, "roughness"),
    (Parameter::Anisotropic, "anisotropic"),
    (Parameter::Specular, "specular"),
    (Parameter::SpecularTint, "specularTint"),
    (Parameter::Sheen, "sheen"),
    (Parameter::SheenTint, "sheenTint"),
    (Parameter::Clearcoat, "clearcoat"),
    (Parameter::ClearcoatGloss, "clearcoatGloss"),
    (Parameter::SpecTrans, "specTrans"),
    (Parameter::Ior, "ior"),
];

/// The materials of `scene`; `files` gives names to the textures that they use.
pub(super) fn document(
    scene: &Scene<Material>,
    files: &mut TextureFiles<'_>,
) -> Result<Document, std::io::Error> {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let mut names = Identifiers::default();
    let mut notes = Vec::new();
    let root = [("version", "1.39"), ("colorspace", "lin_rec709")];
    writer.create_element("materialx").with_attributes(root).write_inner_content(|writer| {
        // Materials first: they keep their names, and what belongs to them makes way.
        let ids: Vec<String> = scene.materials.iter().map(|m| names.of(&m.name)).collect();
        for (Named { name, item }, id) in scene.materials.iter().zip(ids) {
            let mut material = MaterialWriter { scene, files, writer, notes: &mut notes, name };
            material.write(&Nodes::of(id, &mut names), item)?;
        }
        Ok(())
    })?;
    let text = String::from_utf8(writer.into_inner()).map_err(std::io::Error::other)?;
    Ok(Document { text: text + "\n", notes })
}

/// What a material's nodes are called.
struct Nodes {
    material: String,
    shader: String,
    textures: String,
}

impl Nodes {
    fn of(material: String, names: &mut Identifiers) -> Self {
        let shader = names.of(&format!("{material}_shader"));
        let textures = names.of(&format!("{material}_textures"));
        Self { material, shader, textures }
    }
}

struct MaterialWriter<'w, 'f, 's> {
    scene: &'s Scene<Material>,
    files: &'w mut TextureFiles<'f>,
    writer: &'w mut Writer<Vec<u8>>,
    notes: &'w mut Vec<Note>,
    name: &'s str,
}

/// What an input holds.
enum Input<'a> {
    Float(&'a Param<f32>),
    Color(&'a Param<Rgb>),
}

impl MaterialWriter<'_, '_, '_> {
    fn note(&mut self, field: &str, quality: Quality, reason: &str) {
        let (material, field) = (self.name.to_owned(), field.to_owned());
        self.notes.push(Note { material, field, quality, reason: reason.to_owned() });
    }

    fn write(&mut self, nodes: &Nodes, material: &Material) -> std::io::Result<()> {
        let flat = principled(material);
        let mut inputs = vec![("baseColor", Input::Color(&flat.base_color))];
        inputs.extend(INPUTS.map(|(parameter, name)| (name, Input::Float(flat.scalar(parameter)))));
        inputs.push(("subsurface", Input::Float(flat.scalar(Parameter::Subsurface))));
        let textured: Vec<_> =
            inputs.iter().filter_map(|(name, input)| Some((*name, input.map()?, input))).collect();
        if !textured.is_empty() {
            self.graph(&nodes.textures, &textured)?;
        }
        let attributes = [("name", nodes.shader.as_str()), ("type", "surfaceshader")];
        self.writer.create_element("disney_principled").with_attributes(attributes).write_inner_content(
            |writer| {
                for (name, input) in &inputs {
                    let element = writer
                        .create_element("input")
                        .with_attributes([("name", *name), ("type", input.kind())]);
                    match input.constant() {
                        Some(value) => element.with_attribute(("value", value.as_str())).write_empty()?,
                        None => element
                            .with_attribute(("nodegraph", nodes.textures.as_str()))
                            .with_attribute(("output", format!("{name}_out").as_str()))
                            .write_empty()?,
                    };
                }
                Ok(())
            },
        )?;
        let attributes = [("name", nodes.material.as_str()), ("type", "material")];
        self.writer.create_element("surfacematerial").with_attributes(attributes).write_inner_content(
            |writer| {
                let input = [
                    ("name", "surfaceshader"),
                    ("type", "surfaceshader"),
                    ("nodename", nodes.shader.as_str()),
                ];
                writer.create_element("input").with_attributes(input).write_empty()?;
                Ok(())
            },
        )?;
        self.tell(material);
        Ok(())
    }

    /// The nodes that read textures, as the graph `graph` with an output for each input of the shader.
    fn graph(&mut self, graph: &str, textured: &[(&str, &TextureMap, &Input<'_>)]) -> std::io::Result<()> {
        let mut nodes = Vec::new();
        for (name, map, input) in textured {
            if map.texture_from_uv != glam::Affine2::IDENTITY {
                self.note(name, Quality::Dropped, "the texture's transform is not written");
            }
            let texture = &self.scene.textures[map.texture.0 as usize];
            nodes.push((*name, *map, *input, texture, self.files.of(texture.image)));
        }
        self.writer.create_element("nodegraph").with_attribute(("name", graph)).write_inner_content(
            |writer| {
                for (name, map, input, texture, file) in &nodes {
                    let image = format!("{name}_image");
                    let kind = if map.channel == TextureChannel::A { "color4" } else { "color3" };
                    writer
                        .create_element("image")
                        .with_attributes([("name", image.as_str()), ("type", kind)])
                        .write_inner_content(|writer| {
                            let space = match texture.encoding {
                                Encoding::Srgb => "srgb_texture",
                                Encoding::Linear => "lin_rec709",
                            };
                            let file = [
                                ("name", "file"),
                                ("type", "filename"),
                                ("value", file),
                                ("colorspace", space),
                            ];
                            writer.create_element("input").with_attributes(file).write_empty()?;
                            let [u, v] = texture.wrap.map(address_mode);
                            text_input(writer, "uaddressmode", u)?;
                            text_input(writer, "vaddressmode", v)?;
                            let filter =
                                if texture.filter == TexelFilter::Nearest { "closest" } else { "linear" };
                            text_input(writer, "filtertype", filter)
                        })?;
                    let last = match input {
                        Input::Color(param) => {
                            scaled(writer, name, "color3", &image, &factor_of_color(param))?
                        }
                        Input::Float(param) => {
                            let extracted = format!("{name}_channel");
                            let attributes = [("name", extracted.as_str()), ("type", "float")];
                            writer
                                .create_element("extract")
                                .with_attributes(attributes)
                                .write_inner_content(|writer| {
                                    node_input(writer, "in", kind, &image)?;
                                    let index = (map.channel as u8).to_string();
                                    let input =
                                        [("name", "index"), ("type", "integer"), ("value", index.as_str())];
                                    writer.create_element("input").with_attributes(input).write_empty()?;
                                    Ok(())
                                })?;
                            scaled(writer, name, "float", &extracted, &factor_of_float(param))?
                        }
                    };
                    let output = format!("{name}_out");
                    let attributes =
                        [("name", output.as_str()), ("type", input.kind()), ("nodename", last.as_str())];
                    writer.create_element("output").with_attributes(attributes).write_empty()?;
                }
                Ok(())
            },
        )?;
        Ok(())
    }

    /// What `disney_principled` has no place for, or means otherwise.
    fn tell(&mut self, material: &Material) {
        let has = |p: Parameter| material.scalar(p).constant().is_none_or(|v| v != p.default());
        let disney = material.model == Model::Disney;
        let dropped = [
            ("emission", material.emits()),
            ("opacity", material.opacity != Default::default()),
            ("normal_map", material.normal_map.is_some()),
            ("rotation", material.rotation != 0.0),
            ("vertex_color", material.vertex_color),
            ("absorption", material.absorption != Rgb::BLACK),
            ("thin_walled", material.thin_walled),
            ("diff_trans", disney && has(Parameter::DiffTrans)),
            ("f90", disney && has(Parameter::F90)),
            ("transmission_color", material.transmission_color.is_some()),
        ];
        for (field, _) in dropped.into_iter().filter(|(_, is)| *is) {
            self.note(field, Quality::Dropped, "disney_principled has no such input");
        }
        match material.model {
            Model::Disney => {
                let exact_terms =
                    material.masking == Masking::Matched && material.diffuse == DiffuseModel::Burley;
                let reason = match exact_terms {
                    true => {
                        "the same parameters; MaterialX layers sheen and coat by albedo, Disney adds them"
                    }
                    false => {
                        "the same parameters; the masking and diffuse terms chosen here are not MaterialX'"
                    }
                };
                self.note("disney", Quality::Carried, reason);
            }
            Model::Diffuse => {
                self.note(
                    BASE_COLOR,
                    Quality::Approximated,
                    "Burley's diffuse term of roughness 0.45 for Lambert's: the albedo is within 1.5% up to 85°",
                );
            }
            Model::Mirror => self.note("mirror", Quality::Exact, "a white metal of roughness 0"),
            Model::Dielectric => self.note("dielectric", Quality::Exact, "specTrans 1 at roughness 0"),
        }
    }
}

impl Input<'_> {
    fn kind(&self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Color(_) => "color3",
        }
    }

    fn map(&self) -> Option<&TextureMap> {
        match self {
            Self::Float(Param::Texture { map, .. }) | Self::Color(Param::Texture { map, .. }) => Some(map),
            Self::Float(Param::Constant(_)) | Self::Color(Param::Constant(_)) => None,
        }
    }

    fn constant(&self) -> Option<String> {
        match self {
            Self::Float(param) => param.constant().map(|v| v.to_string()),
            Self::Color(param) => param.constant().map(rgb),
        }
    }
}

fn rgb(c: Rgb) -> String {
    format!("{}, {}, {}", c.r, c.g, c.b)
}

fn factor_of_color(param: &Param<Rgb>) -> String {
    match param {
        Param::Texture { factor, .. } | Param::Constant(factor) => rgb(*factor),
    }
}

fn factor_of_float(param: &Param<f32>) -> String {
    match param {
        Param::Texture { factor, .. } | Param::Constant(factor) => factor.to_string(),
    }
}

fn address_mode(wrap: Wrap) -> &'static str {
    match wrap {
        Wrap::Repeat => "periodic",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    }
}

fn text_input(writer: &mut Writer<Vec<u8>>, name: &str, value: &str) -> std::io::Result<()> {
    let attributes = [("name", name), ("type", "string"), ("value", value)];
    writer.create_element("input").with_attributes(attributes).write_empty()?;
    Ok(())
}

fn node_input(writer: &mut Writer<Vec<u8>>, name: &str, kind: &str, node: &str) -> std::io::Result<()> {
    let attributes = [("name", name), ("type", kind), ("nodename", node)];
    writer.create_element("input").with_attributes(attributes).write_empty()?;
    Ok(())
}

/// A node that multiplies another by `factor`; returns its name.
fn scaled(
    writer: &mut Writer<Vec<u8>>,
    name: &str,
    kind: &str,
    node: &str,
    factor: &str,
) -> std::io::Result<String> {
    let product = format!("{name}_scaled");
    let attributes = [("name", product.as_str()), ("type", kind)];
    writer.create_element("multiply").with_attributes(attributes).write_inner_content(|writer| {
        node_input(writer, "in1", kind, node)?;
        let input = [("name", "in2"), ("type", kind), ("value", factor)];
        writer.create_element("input").with_attributes(input).write_empty()?;
        Ok(())
    })?;
    Ok(product)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_nodes_share_a_name_and_every_material_has_its_own_shader() {
        let mut scene = Scene::empty();
        for name in ["a", "a_shader", "a_textures", "A"] {
            scene.materials.push(Named::new(name, Material::default()));
        }
        let text = document(&scene, &mut TextureFiles::new(&scene)).unwrap().text;
        let named = |element: &str| -> Vec<&str> {
            let start = format!("<{element} name=\"");
            text.split(&start).skip(1).filter_map(|rest| rest.split('"').next()).collect()
        };
        let (materials, shaders) = (named("surfacematerial"), named("disney_principled"));
        assert_eq!(materials, ["a", "a_shader", "a_textures", "A_2"]);
        let names: BTreeSet<&str> = materials.iter().chain(&shaders).copied().collect();
        assert_eq!(names.len(), 8, "{names:?}");
        for (shader, used) in shaders.iter().zip(text.split("nodename=\"").skip(1)) {
            assert_eq!(used.split('"').next(), Some(*shader));
        }
    }
}
