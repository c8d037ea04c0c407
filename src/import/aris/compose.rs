//! Hydra's composition, as far as scenes use it: `defaults` lists with sibling files, groups and `_self_`.

use super::ArisError;
use super::yaml::{self, Node, Value};
use crate::import::Files;

/// The deepest chain of files.
const MAX_DEPTH: usize = 16;
/// The most files that one scene reads.
const MAX_FILES: usize = 256;

/// The scene file `name` with everything that its `defaults` name. Later entries win over earlier ones, maps are merged key by
/// key, and a file's own content comes where its list says `_self_`, else last (Hydra 1.1).
pub(super) fn compose(files: &mut Files, name: &str) -> Result<Node, ArisError> {
    let mut composer = Composer { files, left: MAX_FILES };
    composer.file(name, None, 0)
}

struct Composer<'a> {
    files: &'a mut Files,
    left: usize,
}

impl Composer<'_> {
    /// The composed content of a file. `wanted` is the entry of the list that names it.
    fn file(&mut self, name: &str, wanted: Option<&Node>, depth: usize) -> Result<Node, ArisError> {
        let place = wanted.map_or_else(|| name.to_owned(), |node| node.place.to_string());
        if depth > MAX_DEPTH || self.left == 0 {
            return Err(ArisError::Composition {
                place,
                message: format!("defaults go deeper than {MAX_DEPTH} files or name more than {MAX_FILES}"),
                hint: "does a file name itself?".to_owned(),
            });
        }
        self.left -= 1;
        let key = wanted.map_or_else(String::new, |_| "defaults".to_owned());
        let bytes = self.files.read(name).map_err(|cause| ArisError::File { place, key, cause })?;
        let node = yaml::parse(name, &bytes)?;
        let Value::Map(mut entries) = node.value else { return Ok(node) };
        let Some(at) = entries.iter().position(|(key, ..)| key == "defaults") else {
            return Ok(Node { place: node.place, value: Value::Map(entries) });
        };
        let (_, _, defaults) = entries.remove(at);
        let mut own = Some(Node { place: node.place.clone(), value: Value::Map(entries) });
        let mut out = Node { place: node.place, value: Value::Map(Vec::new()) };
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        for entry in defaults.list("defaults")? {
            match &entry.value {
                Value::Text(text) if text == "_self_" => match own.take() {
                    Some(own) => merge(&mut out, own),
                    None => {
                        return Err(misplaced(entry, "_self_ stands in the list twice", "keep one of them"));
                    }
                },
                Value::Text(text) => {
                    let content = self.file(&sibling(folder, entry, text)?, Some(entry), depth + 1)?;
                    merge(&mut out, content);
                }
                Value::Map(groups) => {
                    for (group, place, option) in groups {
                        // An option of nothing is a place for an override.
                        if matches!(option.value, Value::Null) {
                            continue;
                        }
                        let path = sibling(folder, entry, &format!("{group}/{}", option.text(group)?))?;
                        let content = self.file(&path, Some(option), depth + 1)?;
                        let value = Value::Map(vec![(group.clone(), place.clone(), content)]);
                        merge(&mut out, Node { place: place.clone(), value });
                    }
                }
                _ => return Err(entry.mismatch("defaults", "the name of a file, or group: option")),
            }
        }
        if let Some(own) = own {
            merge(&mut out, own);
        }
        Ok(out)
    }
}

fn misplaced(entry: &Node, message: &str, hint: &str) -> ArisError {
    ArisError::Composition {
        place: entry.place.to_string(),
        message: message.to_owned(),
        hint: hint.to_owned(),
    }
}

/// The file that an entry of the list in `folder` names.
fn sibling(folder: &str, entry: &Node, name: &str) -> Result<String, ArisError> {
    if name.contains(['@', ' ', '$']) || name.starts_with('/') {
        let message = format!("{name:?} is more of Hydra than is read");
        let hint = "files and groups beside the scene are, without packages, override or optional";
        return Err(misplaced(entry, &message, hint));
    }
    let file = format!("{}.yaml", name.strip_suffix(".yaml").unwrap_or(name));
    Ok(if folder.is_empty() { file } else { format!("{folder}/{file}") })
}

/// Puts `over` on top of `base`: maps key by key, everything else as a whole.
fn merge(base: &mut Node, over: Node) {
    match (&mut base.value, over.value) {
        (Value::Map(entries), Value::Map(overs)) => {
            for (key, place, node) in overs {
                match entries.iter_mut().find(|(k, ..)| *k == key) {
                    Some((_, at, existing)) => {
                        *at = place;
                        merge(existing, node);
                    }
                    None => entries.push((key, place, node)),
                }
            }
        }
        // A file without content changes nothing.
        (Value::Map(_), Value::Null) => {}
        (value, over_value) => {
            *value = over_value;
            base.place = over.place;
        }
    }
}
