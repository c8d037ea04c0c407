//! The elements of a scene description, as a tree.

use glam::{Affine3A, Mat4, Vec3};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};

use crate::color::Rgb;

/// An element with its attributes and children.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Element>,
}

impl Element {
    fn new(tag: &'static str) -> Self {
        Self { tag, attributes: Vec::new(), children: Vec::new() }
    }

    /// The root of a description.
    pub(super) fn scene() -> Self {
        Self::new("scene").attribute("version", "3.0.0")
    }

    /// An object that the plugin `kind` makes.
    pub(super) fn plugin(tag: &'static str, kind: &str) -> Self {
        Self::new(tag).attribute("type", kind)
    }

    /// What `$NAME` stands for unless the caller says otherwise, as in `mitsuba -D NAME=VALUE scene.xml`.
    pub(super) fn default_of(name: &str, value: u32) -> Self {
        Self::new("default").named(name).attribute("value", value.to_string())
    }

    /// The object that is called `id` elsewhere.
    pub(super) fn reference(id: &str) -> Self {
        Self::new("ref").attribute("id", id)
    }

    pub(super) fn attribute(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((name, value.into()));
        self
    }

    /// The same as the parameter `name` of what holds it.
    pub(super) fn named(self, name: &str) -> Self {
        self.attribute("name", name)
    }

    pub(super) fn with(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    pub(super) fn with_all(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    fn value(self, tag: &'static str, name: &str, value: String) -> Self {
        self.with(Self::new(tag).named(name).attribute("value", value))
    }

    pub(super) fn float(self, name: &str, value: f32) -> Self {
        self.value("float", name, value.to_string())
    }

    pub(super) fn integer(self, name: &str, value: u32) -> Self {
        self.value("integer", name, value.to_string())
    }

    /// An integer that is what `$VARIABLE` stands for.
    pub(super) fn integer_of(self, name: &str, variable: &str) -> Self {
        self.value("integer", name, format!("${variable}"))
    }

    pub(super) fn boolean(self, name: &str, value: bool) -> Self {
        self.value("boolean", name, value.to_string())
    }

    pub(super) fn string(self, name: &str, value: &str) -> Self {
        self.value("string", name, value.to_owned())
    }

    pub(super) fn rgb(self, name: &str, Rgb { r, g, b }: Rgb) -> Self {
        self.value("rgb", name, format!("{r} {g} {b}"))
    }

    /// A point or a direction, as `tag` says.
    pub(super) fn vector(self, tag: &'static str, name: &str, Vec3 { x, y, z }: Vec3) -> Self {
        self.value(tag, name, format!("{x} {y} {z}"))
    }

    /// A transform by its matrix, row by row.
    pub(super) fn transform(self, name: &str, transform: Affine3A) -> Self {
        let rows = Mat4::from(transform).transpose().to_cols_array();
        let numbers: Vec<String> = rows.iter().map(f32::to_string).collect();
        let matrix = Self::new("matrix").attribute("value", numbers.join(" "));
        self.with(Self::new("transform").named(name).with(matrix))
    }

    /// The document of which this is the root.
    ///
    /// # Errors
    /// If XML can't be written.
    pub(super) fn document(&self) -> std::io::Result<String> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        self.write(&mut writer)?;
        String::from_utf8(writer.into_inner()).map(|text| text + "\n").map_err(std::io::Error::other)
    }

    fn write(&self, writer: &mut Writer<Vec<u8>>) -> std::io::Result<()> {
        let attributes = self.attributes.iter().map(|(name, value)| (*name, value.as_str()));
        let element = writer.create_element(self.tag).with_attributes(attributes);
        if self.children.is_empty() {
            element.write_empty()?;
        } else {
            element.write_inner_content(|writer| self.children.iter().try_for_each(|c| c.write(writer)))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_becomes_a_document() {
        let turned = Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0));
        let bsdf =
            Element::plugin("bsdf", "diffuse").attribute("id", "a&b").rgb("reflectance", Rgb::grey(0.5));
        let root = Element::scene()
            .with(bsdf)
            .with(Element::plugin("emitter", "envmap").transform("to_world", turned));
        let expected = r#"<?xml version="1.0" encoding="UTF-8"?>
<scene version="3.0.0">
  <bsdf type="diffuse" id="a&amp;b">
    <rgb name="reflectance" value="0.5 0.5 0.5"/>
  </bsdf>
  <emitter type="envmap">
    <transform name="to_world">
      <matrix value="1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1"/>
    </transform>
  </emitter>
</scene>
"#;
        assert_eq!(root.document().unwrap(), expected);
    }
}
