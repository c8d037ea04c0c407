//! YAML as a tree whose nodes know file, line and column, and typed access to it.

use std::fmt;
use std::sync::Arc;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::Spanned;

use super::ArisError;

/// The largest file, in bytes. Scenes are a few kilobytes; numbers live in meshes and images.
pub(super) const MAX_BYTES: usize = 1 << 20;

/// A value with its place.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) place: Place,
    pub(crate) value: Value,
}

/// Where something stands.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) file: Arc<str>,
    /// From 1; 0 for what stands in no file, but as `file` says.
    pub(crate) line: u64,
    pub(crate) column: u64,
}

impl Place {
    /// The place of an override of the command line.
    pub(super) fn of_override(line: &str) -> Self {
        Self { file: format!("the override `{line}`").into(), line: 0, column: 0 }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.file),
            line => write!(f, "{}:{line}:{}", self.file, self.column),
        }
    }
}

/// What a node holds.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Null,
    Bool(bool),
    /// A number without point or exponent.
    Whole(i64),
    Number(f64),
    Text(String),
    List(Vec<Node>),
    /// In the order of the file.
    Map(Vec<(String, Place, Node)>),
}

/// Reads one document.
pub(crate) fn parse(file: &str, bytes: &[u8]) -> Result<Node, ArisError> {
    if bytes.len() > MAX_BYTES {
        return Err(ArisError::TooLarge { file: file.to_owned(), size: bytes.len(), max: MAX_BYTES });
    }
    let error =
        |line, column, message: String| ArisError::Yaml { file: file.to_owned(), line, column, message };
    let text = std::str::from_utf8(bytes).map_err(|cause| error(1, 1, format!("not UTF-8: {cause}")))?;
    let options = serde_saphyr::options! {
        budget: serde_saphyr::budget! { max_depth: 32, max_documents: 1, max_nodes: 100_000, max_aliases: 1_000 },
        with_snippet: false,
    };
    let raw: Spanned<Raw> = serde_saphyr::from_str_with_options(text, options).map_err(|cause| {
        let (line, column) = cause.location().map_or((1, 1), |at| (at.line(), at.column()));
        let message = cause.without_snippet().to_string();
        // The place stands in front already.
        let place = format!(" at line {line}, column {column}");
        error(line, column, message.strip_suffix(&place).unwrap_or(&message).to_owned())
    })?;
    Ok(located(raw, &Arc::from(file)))
}

/// A value as the deserialiser gives it: the locations are not yet the file's.
#[derive(Debug)]
enum Raw {
    Null,
    Bool(bool),
    Whole(i64),
    Number(f64),
    Text(String),
    List(Vec<Spanned<Raw>>),
    Map(Vec<(Spanned<String>, Spanned<Raw>)>),
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RawVisitor)
    }
}

struct RawVisitor;

impl<'de> Visitor<'de> for RawVisitor {
    type Value = Raw;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_unit<E>(self) -> Result<Raw, E> {
        Ok(Raw::Null)
    }

    fn visit_none<E>(self) -> Result<Raw, E> {
        Ok(Raw::Null)
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Raw, D::Error> {
        deserializer.deserialize_any(self)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Raw, E> {
        Ok(Raw::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Raw, E> {
        Ok(Raw::Whole(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Raw, E> {
        Ok(i64::try_from(value).map_or(Raw::Number(value as f64), Raw::Whole))
    }

    fn visit_i128<E>(self, value: i128) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_u128<E>(self, value: u128) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Raw, E> {
        Ok(Raw::Number(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Raw, E> {
        Ok(Raw::Text(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Raw, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Raw::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Raw, A::Error> {
        let mut map = Vec::new();
        while let Some(entry) = entries.next_entry()? {
            map.push(entry);
        }
        Ok(Raw::Map(map))
    }
}

fn located(raw: Spanned<Raw>, file: &Arc<str>) -> Node {
    let place =
        |at: &serde_saphyr::Location| Place { file: file.clone(), line: at.line(), column: at.column() };
    let at = place(&raw.referenced);
    let value = match raw.value {
        Raw::Null => Value::Null,
        Raw::Bool(value) => Value::Bool(value),
        Raw::Whole(value) => Value::Whole(value),
        Raw::Number(value) => Value::Number(value),
        Raw::Text(text) => Value::Text(text),
        Raw::List(items) => Value::List(items.into_iter().map(|item| located(item, file)).collect()),
        Raw::Map(entries) => {
            let entry = |(key, value): (Spanned<String>, _)| {
                (key.value, place(&key.referenced), located(value, file))
            };
            Value::Map(entries.into_iter().map(entry).collect())
        }
    };
    Node { place: at, value }
}

impl Value {
    /// Its number, if it is one.
    fn number(&self) -> Option<f64> {
        match *self {
            Self::Whole(value) => Some(value as f64),
            Self::Number(value) => Some(value),
            _ => None,
        }
    }

    /// What it is, for messages.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Null => "nothing",
            Self::Bool(_) => "true or false",
            Self::Whole(_) | Self::Number(_) => "a number",
            Self::Text(_) => "text",
            Self::List(_) => "a list",
            Self::Map(_) => "a map",
        }
    }
}

impl Node {
    /// The error that this node, the value of `key`, is not what was expected.
    pub(super) fn mismatch(&self, key: &str, expected: impl Into<String>) -> ArisError {
        ArisError::Type {
            place: self.place.to_string(),
            key: key.to_owned(),
            expected: expected.into(),
            found: self.value.kind(),
        }
    }

    /// The error that this node, the value of `key`, is out of range.
    pub(super) fn out_of_range(&self, key: &str, value: f64, expected: impl Into<String>) -> ArisError {
        ArisError::Range {
            place: self.place.to_string(),
            key: key.to_owned(),
            value,
            expected: expected.into(),
        }
    }

    pub(super) fn text(&self, key: &str) -> Result<&str, ArisError> {
        match &self.value {
            Value::Text(text) => Ok(text),
            _ => Err(self.mismatch(key, "text")),
        }
    }

    /// A finite number that fits `f32`.
    pub(super) fn number(&self, key: &str) -> Result<f32, ArisError> {
        match self.value.number() {
            Some(value) if (value as f32).is_finite() => Ok(value as f32),
            Some(value) => Err(self.out_of_range(key, value, "finite")),
            None => Err(self.mismatch(key, "a number")),
        }
    }

    /// A whole number in [low, high].
    pub(super) fn whole(&self, key: &str, low: u32, high: u32) -> Result<u32, ArisError> {
        match self.value.number() {
            Some(value) if value.fract() == 0.0 && (f64::from(low)..=f64::from(high)).contains(&value) => {
                Ok(value as u32)
            }
            Some(value) => Err(self.out_of_range(key, value, format!("a whole number in [{low}, {high}]"))),
            None => Err(self.mismatch(key, "a whole number")),
        }
    }

    /// `true` or `false`.
    pub(super) fn flag(&self, key: &str) -> Result<bool, ArisError> {
        match self.value {
            Value::Bool(flag) => Ok(flag),
            _ => Err(self.mismatch(key, "true or false")),
        }
    }

    pub(super) fn list(&self, key: &str) -> Result<&[Node], ArisError> {
        match &self.value {
            Value::List(items) => Ok(items),
            _ => Err(self.mismatch(key, "a list")),
        }
    }

    /// A list of exactly `N` numbers.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<[f32; N], ArisError> {
        let expected = || format!("a list of {N} numbers");
        let items = self.list(key).map_err(|_| self.mismatch(key, expected()))?;
        let values: Vec<f32> = items.iter().map(|item| item.number(key)).collect::<Result<_, _>>()?;
        values.try_into().map_err(|_| self.mismatch(key, expected()))
    }
}

/// A map whose keys are asked for one by one; [`Table::finish`] refuses those that nobody asked for.
pub(super) struct Table<'a> {
    entries: &'a [(String, Place, Node)],
    place: &'a Place,
    within: String,
    known: Vec<&'static str>,
}

impl<'a> Table<'a> {
    /// The map `node`, called `within` in messages. Nothing counts as an empty map.
    pub(super) fn new(node: &'a Node, within: impl Into<String>) -> Result<Self, ArisError> {
        let within = within.into();
        let entries = match &node.value {
            Value::Map(entries) => entries.as_slice(),
            Value::Null => &[],
            _ => return Err(node.mismatch(&within, "a map")),
        };
        Ok(Self { entries, place: &node.place, within, known: Vec::new() })
    }

    /// An empty map at `place`.
    pub(super) fn empty(place: &'a Place, within: impl Into<String>) -> Self {
        Self { entries: &[], place, within: within.into(), known: Vec::new() }
    }

    /// The value of `key`, unless it is absent or empty.
    pub(super) fn get(&mut self, key: &'static str) -> Option<&'a Node> {
        self.known.push(key);
        let found = self.entries.iter().find(|(name, ..)| name == key).map(|(.., node)| node);
        found.filter(|node| !matches!(node.value, Value::Null))
    }

    /// The value of `key`, which must be there.
    pub(super) fn require(&mut self, key: &'static str) -> Result<&'a Node, ArisError> {
        if let Some(node) = self.get(key) {
            return Ok(node);
        }
        // A misspelt key explains more than a missing one.
        let strange = self.entries.iter().filter(|(name, ..)| !self.known.contains(&name.as_str()));
        if let Some((name, place, _)) = strange.into_iter().find(|(name, ..)| is_near(name, key)) {
            return Err(ArisError::UnknownKey {
                place: place.to_string(),
                within: self.within.clone(),
                key: name.clone(),
                hint: format!("did you mean {key:?}?"),
            });
        }
        Err(ArisError::Missing { place: self.place.to_string(), within: self.within.clone(), key })
    }

    /// `key` must be absent or empty, for the reason given.
    pub(super) fn refuse(&mut self, key: &'static str, reason: &'static str) -> Result<(), ArisError> {
        match self.get(key) {
            None => Ok(()),
            Some(node) => Err(ArisError::Unsupported {
                place: node.place.to_string(),
                what: format!("{}: {key}", self.within),
                hint: reason.to_owned(),
            }),
        }
    }

    /// Refuses keys that were not asked for.
    pub(super) fn finish(self) -> Result<(), ArisError> {
        let Some((key, place, _)) = self.entries.iter().find(|(key, ..)| !self.known.contains(&key.as_str()))
        else {
            return Ok(());
        };
        Err(ArisError::UnknownKey {
            place: place.to_string(),
            within: self.within,
            key: key.clone(),
            hint: nearest(key, &self.known),
        })
    }
}

/// What was meant, in words: the nearest of the known names if one is near, else all of them.
pub(super) fn nearest(name: &str, known: &[&str]) -> String {
    match known.iter().min_by_key(|k| distance(name, k)).filter(|k| is_near(name, k)) {
        Some(k) => format!("did you mean {k:?}?"),
        None => format!("known are {}", known.join(", ")),
    }
}

/// Whether `name` may be a misspelt `known`.
fn is_near(name: &str, known: &str) -> bool {
    distance(name, known) <= 1 + known.len() / 4
}

/// The number of typing mistakes between two names; case and underscores are none.
fn distance(name: &str, known: &str) -> usize {
    // Longer names than any key are far from all; comparing them costs their length.
    let plain = |s: &str| s.chars().take(64).filter(|c| *c != '_').collect::<String>().to_lowercase();
    strsim::damerau_levenshtein(&plain(name), &plain(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_know_their_place_and_integers_are_numbers() {
        let node = parse("a.yaml", b"a: 1\nb:\n  - [2.5, -3e-2]\n  - null\n  - yes it is\nc:\n").unwrap();
        let Value::Map(entries) = &node.value else { panic!("{node:?}") };
        assert_eq!(entries[0].2.number("a").unwrap(), 1.0);
        assert_eq!(entries[1].1.to_string(), "a.yaml:2:1");
        let items = entries[1].2.list("b").unwrap();
        assert_eq!(items[0].place.to_string(), "a.yaml:3:5");
        assert_eq!(items[0].numbers::<2>("b").unwrap(), [2.5, -0.03]);
        assert!(matches!(items[1].value, Value::Null));
        assert_eq!(items[2].text("b").unwrap(), "yes it is");
        assert!(matches!(entries[2].2.value, Value::Null));
    }

    #[test]
    fn what_is_not_yaml_is_an_error_with_line_and_column() {
        for text in ["a: [1, 2\n", "a: 1\na: 2\n", "a: &x [*x]\n", "a: 1\n---\nb: 2\n"] {
            let error = parse("a.yaml", text.as_bytes()).unwrap_err();
            assert!(matches!(error, ArisError::Yaml { .. }), "{text:?} {error}");
            assert!(error.to_string().starts_with("a.yaml:"), "{error}");
        }
        assert!(matches!(parse("a.yaml", &[b'#'; MAX_BYTES + 1]), Err(ArisError::TooLarge { .. })));
    }

    #[test]
    fn alias_bombs_end_in_an_error() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for i in 1..9 {
            let refs = vec![format!("*a{}", i - 1); 10].join(", ");
            text.push_str(&format!("a{i}: &a{i} [{refs}]\n"));
        }
        assert!(matches!(parse("a.yaml", text.as_bytes()), Err(ArisError::Yaml { .. })));
        let deep = format!("a: {}", "[".repeat(2000));
        assert!(matches!(parse("a.yaml", deep.as_bytes()), Err(ArisError::Yaml { .. })));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        for text in [".nan", ".inf", "1e99"] {
            // Some are refused by the parser, some only where a number is wanted.
            let number = parse("a.yaml", text.as_bytes()).and_then(|node| node.number("x"));
            assert!(number.is_err(), "{text}");
        }
    }
}
