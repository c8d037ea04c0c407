//! What `-p NAME=VALUE` says.

use super::InspectError;
use crate::library::field;
use crate::manifest::edit::MaterialField;
use crate::record::Value;

/// A field of a material with its values; more than one make variants to compare.
#[derive(Clone, Debug, PartialEq)]
pub struct Edit {
    /// The field.
    pub field: MaterialField,
    /// At least one.
    pub values: Vec<Value>,
}

impl Edit {
    /// Reads `NAME=VALUE` or `NAME=VALUE,VALUE…`, each value as in TOML, and text without quotes where it is no TOML. Three numbers
    /// for a colour are one value.
    ///
    /// # Errors
    /// If there is no `=`, no value, or no such field.
    pub fn parse(text: &str) -> Result<Self, InspectError> {
        let malformed = || InspectError::MalformedEdit { text: text.to_owned() };
        let (name, values) = text.split_once('=').ok_or_else(malformed)?;
        let field = field(name.trim()).map_err(InspectError::Edit)?;
        let values: Vec<Value> =
            split(values).into_iter().map(value).collect::<Option<_>>().ok_or_else(malformed)?;
        let is_color = matches!(
            field,
            MaterialField::BaseColor
                | MaterialField::EmissionColor
                | MaterialField::TransmissionColor
                | MaterialField::DiffTransColor
                | MaterialField::Absorption
        );
        let one_color = is_color && values.len() == 3 && values.iter().all(|v| matches!(v, Value::Number(_)));
        Ok(Self { field, values: if one_color { vec![Value::List(values)] } else { values } })
    }
}

/// The parts of `text` between commas that are outside brackets and quotes.
fn split(text: &str) -> Vec<&str> {
    let (mut depth, mut quote, mut start) = (0u32, None, 0);
    let mut parts = Vec::new();
    for (i, c) in text.char_indices() {
        match (quote, c) {
            (Some(q), _) if q == c => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[') => depth += 1,
            (None, ']') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(text[start..i].trim());
                start = i + 1;
            }
            (None, _) => {}
        }
    }
    parts.push(text[start..].trim());
    parts
}

/// A value as in TOML, or the text as it stands; `None` if there is nothing, or a table or a date.
fn value(text: &str) -> Option<Value> {
    if text.is_empty() {
        return None;
    }
    // Also `.5` and `1.`, which TOML has not.
    if let Ok(number) = text.parse() {
        return Some(Value::Number(number));
    }
    Value::from_text(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disney::Parameter;
    use crate::manifest::edit::set_material;
    use crate::scene::Material;

    fn values(text: &str) -> Vec<Value> {
        Edit::parse(text).unwrap().values
    }

    #[test]
    fn lists_are_variants_and_colours_are_one_value() {
        assert_eq!(values("roughness=0.1, 0.3"), [Value::Number(0.1), Value::Number(0.3)]);
        let red = Value::List([0.9, 0.1, 0.1].map(Value::Number).to_vec());
        for color in ["color", "emission_color", "transmission_color", "diff_trans_color", "absorption"] {
            assert_eq!(values(&format!("{color}=0.9,0.1,0.1")), std::slice::from_ref(&red), "{color}");
        }
        assert_eq!(values("baseColor=[0.9, 0.1, 0.1], #aabbcc"), [red, Value::Text("#aabbcc".into())]);
        assert_eq!(values("model=mirror,disney").len(), 2);
        for wrong in ["roughness", "roughness=", "roughness=0.1,,0.2", "roughness=1999-01-01"] {
            assert!(matches!(Edit::parse(wrong), Err(InspectError::MalformedEdit { .. })), "{wrong}");
        }
    }

    #[test]
    fn every_parameter_is_found_in_both_spellings_and_slips_find_the_name() {
        for parameter in Parameter::ALL {
            assert_eq!(field(parameter.name()).unwrap().name(), parameter.name());
        }
        assert_eq!(field("clearcoatGloss").unwrap(), MaterialField::ClearcoatGloss);
        let error = field("rougness").unwrap_err();
        assert!(error.hint().unwrap().contains("did you mean `roughness`?"));
    }

    #[test]
    fn a_value_out_of_range_is_told_by_the_field_s_name() {
        let mut material = Material::default();
        set_material(&mut material, MaterialField::Roughness, &Value::Number(0.25)).unwrap();
        assert_eq!(material.scalar(Parameter::Roughness).constant(), Some(0.25));
        let error = set_material(&mut material, MaterialField::Roughness, &Value::Number(1.5)).unwrap_err();
        assert_eq!(error.to_string(), "`roughness` is 1.5, but must be a number in [0, 1]");
        assert_eq!(material.scalar(Parameter::Roughness).constant(), Some(0.25), "the rest stays");
    }
}
