//! Fields of materials by the names that people use.

use crate::manifest::edit::{EditError, MaterialField};
use crate::manifest::nearest::nearest;

/// The field of that name, in snake_case, camelCase or as Aris calls it.
///
/// # Errors
/// [`EditError::UnknownField`].
pub fn field(name: &str) -> Result<MaterialField, EditError> {
    let plain = |name: &str| -> String {
        name.chars().filter(|c| !matches!(c, '_' | '-' | ' ')).flat_map(char::to_lowercase).collect()
    };
    let wanted = plain(name);
    let found = match wanted.as_str() {
        "color" => Some(MaterialField::BaseColor),
        "g" => Some(MaterialField::Masking),
        _ => MaterialField::ALL.iter().copied().find(|f| plain(f.name()) == wanted),
    };
    found.ok_or_else(|| {
        let known: Vec<&'static str> = MaterialField::ALL.iter().map(|f| f.name()).collect();
        EditError::UnknownField {
            of: "a material",
            field: name.chars().take(80).collect(),
            nearest: nearest(name, known.iter().copied()),
            known,
        }
    })
}
