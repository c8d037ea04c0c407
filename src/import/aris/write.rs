//! Trees as YAML text, as OmegaConf writes them: block style, lists not indented below their key.

use super::yaml::{Node, Value};

/// The document.
pub(super) fn to_yaml(node: &Node) -> String {
    let mut out = String::new();
    block(&node.value, 0, &mut out);
    out
}

fn block(value: &Value, indent: usize, out: &mut String) {
    match value {
        Value::Map(entries) if !entries.is_empty() => {
            for (i, (key, _, node)) in entries.iter().enumerate() {
                if i > 0 {
                    out.extend(std::iter::repeat_n(' ', indent));
                }
                *out += &scalar_text(key);
                out.push(':');
                match &node.value {
                    Value::Map(inner) if !inner.is_empty() => {
                        line(indent + 2, out);
                        block(&node.value, indent + 2, out);
                    }
                    Value::List(inner) if !inner.is_empty() => {
                        line(indent, out);
                        block(&node.value, indent, out);
                    }
                    other => *out += &format!(" {}\n", inline(other)),
                }
            }
        }
        Value::List(items) if !items.is_empty() => {
            for (i, item) in items.iter().enumerate() {
                if i > 0 {
                    out.extend(std::iter::repeat_n(' ', indent));
                }
                *out += "- ";
                block(&item.value, indent + 2, out);
            }
        }
        other => *out += &format!("{}\n", inline(other)),
    }
}

fn line(indent: usize, out: &mut String) {
    out.push('\n');
    out.extend(std::iter::repeat_n(' ', indent));
}

/// A value on one line.
pub(super) fn inline(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(b) => b.to_string(),
        Value::Whole(n) => n.to_string(),
        Value::Number(n) if n.is_nan() => ".nan".to_owned(),
        Value::Number(n) if n.is_infinite() => if *n > 0.0 { ".inf" } else { "-.inf" }.to_owned(),
        // Digits enough to give the same number again, and a point, which makes it no whole one.
        Value::Number(n) => match format!("{n:?}") {
            text if text.contains('.') => text,
            text => text.replace('e', ".0e"),
        },
        Value::Text(text) => scalar_text(text),
        Value::List(items) => {
            format!("[{}]", items.iter().map(|i| inline(&i.value)).collect::<Vec<_>>().join(", "))
        }
        Value::Map(entries) => {
            let entry =
                |(key, _, node): &(String, _, Node)| format!("{}: {}", scalar_text(key), inline(&node.value));
            format!("{{{}}}", entries.iter().map(entry).collect::<Vec<_>>().join(", "))
        }
    }
}

/// Text as it is where nothing else could be meant, else in quotes.
fn scalar_text(text: &str) -> String {
    if text.chars().any(char::is_control) {
        return serde_json::to_string(text).unwrap_or_default();
    }
    if is_plain(text) { text.to_owned() } else { format!("'{}'", text.replace('\'', "''")) }
}

fn is_plain(text: &str) -> bool {
    let begins_well = text.starts_with(|c: char| c.is_alphabetic() || matches!(c, '/' | '_' | '\\'));
    let means_something =
        matches!(text.to_ascii_lowercase().as_str(), "null" | "true" | "false" | "yes" | "no" | "on" | "off");
    let is_structural = text.contains([',', '[', ']', '{', '}', '#', '$']) || text.contains(": ");
    begins_well && !means_something && !is_structural && !text.ends_with([' ', ':'])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::aris::yaml;

    #[test]
    fn what_is_written_is_read_as_the_same() {
        let text = "scene:\n  geometry:\n    paths:\n    - data/a.obj\n    - - 1\n      - 2.5\n    - name: x\n      config: {}\n    \
                    empty: []\nspp: 64\nscale: -1\nhalf: 0.5\ntiny: 1.0e-9\non_: 'on'\nnumber: '64'\nnothing: null\nname: ''\n\
                    quote: it's\nlines: \"a\\nb\"\n";
        let node = yaml::parse("a.yaml", text.as_bytes()).unwrap();
        assert_eq!(to_yaml(&node), text);
    }
}
