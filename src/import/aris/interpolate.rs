//! OmegaConf's interpolations: `${scene.width}`, `${.width}` beside the value, `${..spp}` one level up. Resolvers such as
//! `${oc.env:HOME}` are an error: they read what is not in the configuration.

use super::ArisError;
use super::edit::find;
use super::write::inline;
use super::yaml::{Node, Value};

/// The longest chain of interpolations.
const MAX_CHAIN: u32 = 16;
/// The most that interpolations insert, in values and bytes of text: a few lines can ask for more than there is memory.
const MAX_INSERTED: usize = 1 << 20;

/// The tree with every interpolation replaced by what it names; places stay those of the interpolations.
pub(super) fn resolve(tree: &Node) -> Result<Node, ArisError> {
    Resolver { tree, left: MAX_INSERTED }.node(tree, &mut Vec::new())
}

struct Resolver<'a> {
    tree: &'a Node,
    /// How much may still be inserted.
    left: usize,
}

impl Resolver<'_> {
    fn node(&mut self, node: &Node, path: &mut Vec<String>) -> Result<Node, ArisError> {
        let value = match &node.value {
            Value::Text(_) => self.value_of(node, path, 0)?,
            Value::List(items) => {
                let mut out = Vec::with_capacity(items.len());
                for (i, item) in items.iter().enumerate() {
                    path.push(i.to_string());
                    out.push(self.node(item, path)?);
                    path.pop();
                }
                Value::List(out)
            }
            Value::Map(entries) => {
                let mut out = Vec::with_capacity(entries.len());
                for (key, place, child) in entries {
                    path.push(key.clone());
                    out.push((key.clone(), place.clone(), self.node(child, path)?));
                    path.pop();
                }
                Value::Map(out)
            }
            other => other.clone(),
        };
        Ok(Node { place: node.place.clone(), value })
    }

    /// The value of a node at `path`: itself, what it names, or its text with what that names inserted.
    fn value_of(&mut self, node: &Node, path: &[String], chain: u32) -> Result<Value, ArisError> {
        let Value::Text(text) = &node.value else { return Ok(node.value.clone()) };
        let key = path.join(".");
        let error = |message: String, hint: &str| {
            let (place, hint) = (node.place.to_string(), hint.to_owned());
            Err(ArisError::Composition { place, message: format!("{key}: {message}"), hint })
        };
        if text == "???" {
            return error("a value must be given".to_owned(), &format!("{key}=…"));
        }
        if chain > MAX_CHAIN {
            return error(format!("{text:?} goes round in a circle, or too far"), "does it name itself?");
        }
        let mut out = String::new();
        let mut rest = text.as_str();
        while let Some(at) = rest.find("${") {
            // An odd number of backslashes makes it text, and each pair of them is one.
            let before = rest[..at].trim_end_matches('\\');
            let backslashes = at - before.len();
            out += before;
            out += &"\\".repeat(backslashes / 2);
            if !backslashes.is_multiple_of(2) {
                out += "${";
                rest = &rest[at + 2..];
                continue;
            }
            rest = &rest[at..];
            let Some(name) = rest[2..].split_once('}').map(|(name, _)| name) else {
                return error(format!("{text:?} has an interpolation without end"), "as in ${scene.width}");
            };
            if name.contains([':', '$', '{']) {
                let hint = "names of values are, as in ${scene.width}; resolvers and nested ones are not";
                return error(format!("${{{name}}} is more of OmegaConf than is read"), hint);
            }
            let target = absolute(path, name.trim());
            let keys: Vec<&str> = target.iter().map(String::as_str).collect();
            let Some(found) = find(self.tree, &keys) else {
                return error(
                    format!("${{{name}}} names nothing"),
                    "names begin at the top, or with dots at the value's own map",
                );
            };
            let value = self.value_of(found, &target, chain + 1)?;
            match self.left.checked_sub(size(&value)) {
                Some(left) => self.left = left,
                None => {
                    return error(
                        "interpolations insert too much".to_owned(),
                        "do they multiply each other?",
                    );
                }
            }
            if name.len() + 3 == text.len() {
                return match value {
                    // What stands inside may have interpolations of its own.
                    Value::Map(_) | Value::List(_) if has_interpolation(&value) => error(
                        format!("${{{name}}} names a map or list with interpolations"),
                        "name the values in it one by one",
                    ),
                    value => Ok(value),
                };
            }
            out += &match value {
                Value::Text(text) => text,
                other => inline(&other),
            };
            rest = &rest[3 + name.len()..];
        }
        out += rest;
        Ok(Value::Text(out))
    }
}

/// The number of values in it and of bytes of their texts.
fn size(value: &Value) -> usize {
    1 + match value {
        Value::Text(text) => text.len(),
        Value::List(items) => items.iter().map(|i| size(&i.value)).sum(),
        Value::Map(entries) => entries.iter().map(|(key, _, n)| key.len() + size(&n.value)).sum(),
        _ => 0,
    }
}

fn has_interpolation(value: &Value) -> bool {
    match value {
        Value::Text(text) => text.contains("${"),
        Value::List(items) => items.iter().any(|i| has_interpolation(&i.value)),
        Value::Map(entries) => entries.iter().any(|(.., n)| has_interpolation(&n.value)),
        _ => false,
    }
}

/// The path that `name` means for a value at `path`: one dot is the map that holds the value, each more one level up.
fn absolute(path: &[String], name: &str) -> Vec<String> {
    let dots = name.len() - name.trim_start_matches('.').len();
    let kept = if dots == 0 { 0 } else { path.len().saturating_sub(dots) };
    let parts = name[dots..].split(['.', '[']).map(|part| part.trim_end_matches(']'));
    path[..kept].iter().cloned().chain(parts.filter(|p| !p.is_empty()).map(str::to_owned)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::aris::{write, yaml};

    fn resolved(text: &str) -> Result<String, ArisError> {
        resolve(&yaml::parse("a.yaml", text.as_bytes()).unwrap()).map(|node| write::inline(&node.value))
    }

    #[test]
    fn interpolations_are_what_they_name() {
        for (text, expected) in [
            ("a: 3\nb: ${a}\n", "{a: 3, b: 3}"),
            ("s: {w: 4, h: '${.w}', d: {x: '${..w}'}}\n", "{s: {w: 4, h: 4, d: {x: 4}}}"),
            ("l: [1, {q: 2}]\nb: ${l[1].q}\nc: ${l.0}\n", "{l: [1, {q: 2}], b: 2, c: 1}"),
            ("n: cbox\np: data/${n}_${n}.obj\n", "{n: cbox, p: data/cbox_cbox.obj}"),
            ("a: ${b}\nb: ${c}\nc: [1, 2]\n", "{a: [1, 2], b: [1, 2], c: [1, 2]}"),
            ("a: '\\${b}'\n", "{a: '${b}'}"),
            // As OmegaConf has it: pairs of backslashes are one, and let what follows be.
            ("b: 1\na: 'x\\\\${b}'\n", "{b: 1, a: x\\1}"),
            ("b: 1\na: '\\\\\\${b} ${b}'\n", "{b: 1, a: '\\${b} 1'}"),
        ] {
            assert_eq!(resolved(text).unwrap_or_else(|e| panic!("{text}: {e}")), expected, "{text}");
        }
    }

    /// Ten levels of ten times the one before.
    fn bomb() -> String {
        let level = |i: u32| format!("a{}: '{}'\n", i + 1, format!("${{a{i}}}").repeat(10));
        "a0: xxxxxxxxxx\n".to_owned() + &(0..10).map(level).collect::<String>()
    }

    #[test]
    fn what_names_nothing_or_itself_is_told_with_its_place() {
        for (text, expected) in [
            ("x:\n  a: ${b}\n", "a.yaml:2:6: x.a: ${b} names nothing"),
            ("a: ${a}\n", "goes round in a circle"),
            ("a: ${b}\nb: ${a}\n", "goes round in a circle"),
            ("a: ${oc.env:HOME}\n", "${oc.env:HOME} is more of OmegaConf than is read"),
            ("a: ${b\n", "without end"),
            (&bomb(), "interpolations insert too much"),
            ("a: ???\n", "a: a value must be given; hint: a=…"),
        ] {
            let told = resolved(text).unwrap_err().to_string();
            assert!(told.contains(expected), "{told}");
        }
    }
}
