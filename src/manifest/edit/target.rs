//! What a path reaches.

use super::error::EditError;
use super::field::{
    CameraField, ConvertField, EnvironmentField, Field, ImportField, LightField, MaterialField, RenderField,
};
use crate::manifest::nearest::nearest;

/// What paths begin with.
pub(super) const ROOTS: &[&str] =
    &["material", "camera", "light", "environment", "render", "import", "convert", "scene"];

/// What a path reaches, in any scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// `material.NAME.FIELD`.
    Material(NamePattern, MaterialField),
    /// `camera.FIELD`.
    Camera(CameraField),
    /// `light.NAME.FIELD`.
    Light(NamePattern, LightField),
    /// `environment.FIELD`.
    Environment(EnvironmentField),
    /// `render.FIELD`.
    Render(RenderField),
    /// `import.FIELD`.
    Import(ImportField),
    /// `convert.FIELD`.
    Convert(ConvertField),
    /// `scene`: the file.
    Scene,
}

/// A name, or a pattern in which `*` stands for any text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamePattern {
    text: String,
    is_literal: bool,
}

impl Target {
    /// Reads a path. The name is what stands between the first dot and the last, so that `material.Metal.001.roughness` needs
    /// no quotes; quotes, as in `material."a*".roughness`, take `*` literally.
    ///
    /// # Errors
    /// If the path begins with nothing known, is incomplete or ends with an unknown field.
    pub fn parse(path: &str) -> Result<Self, EditError> {
        let (root, rest) = path.split_once('.').unwrap_or((path, ""));
        match root {
            "material" => {
                let (name, field) = name_and_field(path, rest, "material.NAME.FIELD")?;
                Ok(Self::Material(name, known("a material", field)?))
            }
            "light" => {
                let (name, field) = name_and_field(path, rest, "light.NAME.FIELD")?;
                Ok(Self::Light(name, known("a light", field)?))
            }
            "camera" => known("the camera", only_field(path, rest, "camera.FIELD")?).map(Self::Camera),
            "environment" => {
                known("the environment", only_field(path, rest, "environment.FIELD")?).map(Self::Environment)
            }
            "render" => known("the render", only_field(path, rest, "render.FIELD")?).map(Self::Render),
            "import" => known("the import", only_field(path, rest, "import.FIELD")?).map(Self::Import),
            "convert" => known("the conversion", only_field(path, rest, "convert.FIELD")?).map(Self::Convert),
            "scene" if path == "scene" => Ok(Self::Scene),
            "scene" => Err(EditError::Incomplete { path: shortened(path), form: "scene" }),
            _ => Err(EditError::UnknownRoot {
                root: shortened(root),
                nearest: nearest(root, ROOTS.iter().copied()),
            }),
        }
    }
}

/// The field after a root that stands for one thing.
fn only_field<'a>(path: &str, rest: &'a str, form: &'static str) -> Result<&'a str, EditError> {
    if rest.is_empty() { Err(EditError::Incomplete { path: shortened(path), form }) } else { Ok(rest) }
}

/// The name and the field after a root that stands for several things.
fn name_and_field<'a>(
    path: &str,
    rest: &'a str,
    form: &'static str,
) -> Result<(NamePattern, &'a str), EditError> {
    let (name, field) = rest
        .rsplit_once('.')
        .filter(|(name, field)| !name.is_empty() && !field.is_empty())
        .ok_or_else(|| EditError::Incomplete { path: shortened(path), form })?;
    let quoted = name.strip_prefix('"').and_then(|n| n.strip_suffix('"')).filter(|n| !n.is_empty());
    Ok((NamePattern { text: quoted.unwrap_or(name).to_owned(), is_literal: quoted.is_some() }, field))
}

/// The field of `of` that is called `name`.
fn known<F: Field>(of: &'static str, name: &str) -> Result<F, EditError> {
    F::of_name(name).ok_or_else(|| EditError::UnknownField {
        of,
        field: shortened(name),
        nearest: nearest(name, F::NAMES.iter().copied()),
        known: F::NAMES.to_vec(),
    })
}

/// Text short enough for a message.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

impl NamePattern {
    /// The name or pattern as written, without quotes.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Whether `name` is meant.
    pub fn matches(&self, name: &str) -> bool {
        if self.is_literal || !self.text.contains('*') {
            return self.text == name;
        }
        let mut parts = self.text.split('*');
        let first = parts.next().unwrap_or_default();
        let Some(mut rest) = name.strip_prefix(first) else { return false };
        let mut parts: Vec<&str> = parts.collect();
        let last = parts.pop().unwrap_or_default();
        // Every part between two stars where it occurs first: that leaves the most for the others.
        for part in parts {
            match rest.find(part) {
                Some(at) => rest = &rest[at + part.len()..],
                None => return false,
            }
        }
        rest.ends_with(last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(path: &str) -> NamePattern {
        match Target::parse(path).unwrap() {
            Target::Material(name, _) | Target::Light(name, _) => name,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn names_may_hold_dots_and_quotes_make_them_literal() {
        assert_eq!(name("material.ball.roughness").as_str(), "ball");
        assert_eq!(name("material.Metal.001.roughness").as_str(), "Metal.001");
        assert_eq!(name("material.\"a.b\".roughness").as_str(), "a.b");
        assert!(!name("material.\"a*\".roughness").matches("ab"));
        assert!(name("material.\"a*\".roughness").matches("a*"));
    }

    #[test]
    fn stars_stand_for_any_text() {
        let matches = |pattern: &str, text: &str| name(&format!("light.{pattern}.intensity")).matches(text);
        assert!(matches("*", "") && matches("*", "anything"));
        assert!(matches("key*", "key_light") && !matches("key*", "a_key"));
        assert!(matches("*_light", "key_light") && !matches("*_light", "light"));
        assert!(matches("a*b*c", "aXbYc") && !matches("a*b*c", "aXcYb"));
        assert!(!matches("ab*b", "ab"), "a star does not share characters");
        assert!(!matches("ball", "Ball"));
    }

    #[test]
    fn unknown_paths_name_the_nearest() {
        let error = Target::parse("materal.ball.roughness").unwrap_err();
        assert!(error.hint().unwrap().starts_with("did you mean `material`?"), "{:?}", error.hint());
        let error = Target::parse("material.ball.rougness").unwrap_err();
        assert_eq!(error.to_string(), "a material has no field `rougness`");
        assert!(error.hint().unwrap().starts_with("did you mean `roughness`?"));
        for incomplete in
            ["material", "material.ball", "material..roughness", "camera", "light.a.", "scene.x", "render."]
        {
            assert!(matches!(Target::parse(incomplete), Err(EditError::Incomplete { .. })), "{incomplete}");
        }
        assert!(matches!(Target::parse("camera.position.x"), Err(EditError::UnknownField { .. })));
        assert!(matches!(Target::parse(""), Err(EditError::UnknownRoot { .. })));
    }

    #[test]
    fn every_field_has_a_path() {
        for f in CameraField::ALL {
            assert_eq!(Target::parse(&format!("camera.{}", f.name())).unwrap(), Target::Camera(*f));
        }
        for f in EnvironmentField::ALL {
            assert_eq!(Target::parse(&format!("environment.{}", f.name())).unwrap(), Target::Environment(*f));
        }
        for f in RenderField::ALL {
            assert_eq!(Target::parse(&format!("render.{}", f.name())).unwrap(), Target::Render(*f));
        }
    }
}
