//! Reading typed values out of the spanned TOML tree, noting errors and going on.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

use crate::manifest::edit::{MAX_WHOLE, check_value};
use crate::manifest::error::{Diagnostic, ManifestError};
use crate::manifest::model::{Located, Setting};
use crate::manifest::nearest::nearest;
use crate::record::Value;

/// A value of the tree.
pub(super) type Node<'i> = Spanned<DeValue<'i>>;

/// What was wrong so far.
#[derive(Debug, Default)]
pub(super) struct Reader {
    pub(super) errors: Vec<Diagnostic>,
}

/// A table whose keys are all known.
#[derive(Clone, Debug)]
pub(super) struct Table<'a, 'i> {
    table: &'a DeTable<'i>,
    /// As messages call it.
    pub(super) name: &'static str,
    /// Its header, or all of it.
    pub(super) span: Range<usize>,
    keys: &'static [&'static str],
    /// What its unknown keys were probably meant to be.
    meant: Vec<&'static str>,
}

impl<'a, 'i> Table<'a, 'i> {
    /// The value of a key.
    pub(super) fn get(&self, key: &str) -> Option<&'a Node<'i>> {
        debug_assert!(self.keys.contains(&key), "{} does not list `{key}`", self.name);
        self.table.get(key)
    }

    /// Where a key itself stands.
    pub(super) fn key_span(&self, key: &str) -> Option<Range<usize>> {
        self.table.get_key_value(key).map(|(k, _)| k.span())
    }
}

impl Reader {
    pub(super) fn note(&mut self, error: impl Into<ManifestError>, span: Range<usize>) {
        self.errors.push(Diagnostic::new(error, span));
    }

    pub(super) fn expected(&mut self, key: &str, expected: impl Into<Box<str>>, span: Range<usize>) {
        self.note(ManifestError::Expected { key: key.into(), expected: expected.into() }, span);
    }

    /// `table`, with an error for every key that it should not have.
    pub(super) fn known<'a, 'i>(
        &mut self,
        table: &'a DeTable<'i>,
        span: Range<usize>,
        name: &'static str,
        keys: &'static [&'static str],
    ) -> Table<'a, 'i> {
        let mut meant = Vec::new();
        for (key, _) in table.iter().filter(|(key, _)| !keys.contains(&key.get_ref().as_ref())) {
            let text: &str = key.get_ref();
            let belongs =
                super::keys::HOMES.iter().find(|(home, keys)| *home != name && keys.contains(&text));
            let near = if belongs.is_some() { None } else { nearest(text, keys.iter().copied()) };
            meant.extend(near);
            let error = ManifestError::UnknownKey {
                key: text.into(),
                table: name,
                nearest: near,
                belongs: belongs.map(|(home, _)| *home),
                known: keys,
            };
            self.note(error, key.span());
        }
        Table { table, name, span, keys, meant }
    }

    /// A value that must be a table with these keys.
    pub(super) fn table<'a, 'i>(
        &mut self,
        key: &str,
        node: &'a Node<'i>,
        name: &'static str,
        keys: &'static [&'static str],
    ) -> Option<Table<'a, 'i>> {
        match node.get_ref() {
            DeValue::Table(table) => Some(self.known(table, node.span(), name, keys)),
            _ => {
                self.expected(key, "a table", node.span());
                None
            }
        }
    }

    /// Text that is not empty.
    pub(super) fn text(&mut self, key: &str, node: &Node<'_>) -> Option<Located<String>> {
        match node.get_ref() {
            DeValue::String(text) if !text.is_empty() => Some(Located::new(text.to_string(), node.span())),
            _ => {
                self.expected(key, "text", node.span());
                None
            }
        }
    }

    /// An array, item by item.
    pub(super) fn items<'a, 'i>(
        &mut self,
        key: &str,
        expected: &'static str,
        node: &'a Node<'i>,
    ) -> Option<&'a [Node<'i>]> {
        match node.get_ref() {
            DeValue::Array(items) if !items.is_empty() => Some(items),
            _ => {
                self.expected(key, expected, node.span());
                None
            }
        }
    }

    /// A list of texts.
    pub(super) fn texts(&mut self, key: &str, node: &Node<'_>) -> Option<Vec<Located<String>>> {
        let items = self.items(key, "a list of texts", node)?;
        items.iter().map(|item| self.text(key, item)).collect()
    }

    /// `true` or `false` of the table.
    pub(super) fn flag(&mut self, table: &Table<'_, '_>, key: &str) -> Option<bool> {
        let node = table.get(key)?;
        match node.get_ref() {
            DeValue::Boolean(flag) => Some(*flag),
            _ => {
                self.expected(key, "true or false", node.span());
                None
            }
        }
    }

    /// A number of the table in `range`.
    pub(super) fn number(
        &mut self,
        table: &Table<'_, '_>,
        key: &str,
        range: RangeInclusive<f64>,
    ) -> Option<f64> {
        let node = table.get(key)?;
        match plain_number(node) {
            Some(n) if range.contains(&n) => Some(n),
            _ => {
                let (low, high) = (*range.start(), *range.end());
                let expected = match (low > f64::MIN, high < f64::MAX) {
                    (true, true) => format!("a number in [{low}, {high}]"),
                    (true, false) => format!("a number of at least {low}"),
                    _ => "a number".to_owned(),
                };
                self.expected(key, expected, node.span());
                None
            }
        }
    }

    /// A whole number of the table in `range`.
    pub(super) fn whole(
        &mut self,
        table: &Table<'_, '_>,
        key: &str,
        range: RangeInclusive<u64>,
    ) -> Option<u64> {
        let node = table.get(key)?;
        let number = match node.get_ref() {
            DeValue::Integer(integer) => whole_number(integer).and_then(|n| u64::try_from(n).ok()),
            _ => None,
        };
        match number {
            Some(n) if range.contains(&n) => Some(n),
            _ => {
                let expected = format!("a whole number in [{}, {}]", range.start(), range.end());
                self.expected(key, expected, node.span());
                None
            }
        }
    }

    /// Notes that `table` lacks `what`, one of `keys`; unless one of them is there and only misspelt.
    pub(super) fn missing(&mut self, table: &Table<'_, '_>, keys: &[&str], what: &'static str) {
        if table.meant.iter().any(|meant| keys.contains(meant)) {
            return;
        }
        self.note(ManifestError::Missing { table: table.name, what }, table.span.clone());
    }

    /// Any value that an override can have.
    pub(super) fn value(&mut self, key: &str, node: &Node<'_>) -> Option<Located<Value>> {
        let before = self.errors.len();
        let value = self.plain_value(key, node);
        (self.errors.len() == before).then_some(Located::new(value?, node.span()))
    }

    fn plain_value(&mut self, key: &str, node: &Node<'_>) -> Option<Value> {
        match node.get_ref() {
            DeValue::Boolean(b) => Some(Value::Bool(*b)),
            DeValue::String(text) => Some(Value::Text(text.to_string())),
            DeValue::Array(items) => {
                Some(Value::List(items.iter().filter_map(|item| self.plain_value(key, item)).collect()))
            }
            DeValue::Integer(_) | DeValue::Float(_) => match plain_number(node) {
                Some(n) => Some(Value::Number(n)),
                None => {
                    self.expected(key, "a finite number, whole ones up to 2^53", node.span());
                    None
                }
            },
            DeValue::Datetime(_) | DeValue::Table(_) => {
                self.expected(key, "true or false, a number, text or a list", node.span());
                None
            }
        }
    }

    /// All settings of a table whose keys, joined by dots after `prefix`, are paths; in the order of the file.
    pub(super) fn settings(&mut self, prefix: &str, key: &str, node: &Node<'_>) -> Vec<Setting> {
        let mut settings = Vec::new();
        match node.get_ref() {
            DeValue::Table(table) => self.collect(prefix, table, &mut settings),
            _ => self.expected(key, "a table of paths", node.span()),
        }
        settings.sort_by_key(|s| s.path.span.start);
        settings
    }

    // The TOML parser has limited the depth.
    fn collect(&mut self, prefix: &str, table: &DeTable<'_>, settings: &mut Vec<Setting>) {
        for (key, node) in table {
            let dot = if prefix.is_empty() { "" } else { "." };
            let path = format!("{prefix}{dot}{}", key.get_ref());
            if let DeValue::Table(inner) = node.get_ref() {
                self.collect(&path, inner, settings);
            } else if let Some(value) = self.value(&path, node) {
                settings.push(Setting { path: Located::new(path, key.span()), value });
            }
        }
    }

    /// Notes whatever is wrong with a setting in any scene.
    pub(super) fn check(&mut self, path: &Located<String>, value: &Located<Value>) {
        if let Err(error) = check_value(&path.value, &value.value) {
            let span = match error.half() {
                crate::manifest::edit::Half::Path => &path.span,
                crate::manifest::edit::Half::Value => &value.span,
            };
            self.note(error, span.clone());
        }
    }
}

/// A finite number, exactly as written up to rounding.
fn plain_number(node: &Node<'_>) -> Option<f64> {
    match node.get_ref() {
        DeValue::Integer(integer) => {
            whole_number(integer).filter(|n| n.unsigned_abs() <= MAX_WHOLE).map(|n| n as f64)
        }
        DeValue::Float(float) => float.as_str().parse().ok().filter(|n: &f64| n.is_finite()),
        _ => None,
    }
}

fn whole_number(integer: &DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}
