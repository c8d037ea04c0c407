//! Overrides as typed to Hydra: `key=value`, `+key=value`, `++key=value`, `~key`.
//!
//! Hydra 1.3, "Basic Override syntax". Left out, with an error: sweeps, functions and packages (`group@package`).

use super::ArisError;
use super::yaml::{Node, Place, Value};

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// `key=value`: the key must be there.
    Set,
    /// `+key=value`: it must not.
    Append,
    /// `++key=value`: either.
    Force,
    /// `~key` or `~key=value`: it goes, if it has the value.
    Delete,
}

/// One override.
#[derive(Clone, Debug)]
pub(super) struct Override {
    pub line: String,
    pub action: Action,
    /// `scene.camera.name`, or a group such as `scene/brdf`.
    pub key: String,
    /// None only for a deletion without a value.
    pub value: Option<Node>,
}

impl Override {
    pub(super) fn place(&self) -> Place {
        Place::of_override(&self.line)
    }

    /// The error that this override can't be followed.
    pub(super) fn error(&self, message: impl Into<String>, hint: impl Into<String>) -> ArisError {
        error(&self.line, message, hint)
    }
}

fn error(line: &str, message: impl Into<String>, hint: impl Into<String>) -> ArisError {
    ArisError::Composition {
        place: Place::of_override(line).to_string(),
        message: message.into(),
        hint: hint.into(),
    }
}

/// Reads one argument.
pub(super) fn parse(line: &str) -> Result<Override, ArisError> {
    let (action, rest) = if let Some(rest) = line.strip_prefix("++") {
        (Action::Force, rest)
    } else if let Some(rest) = line.strip_prefix('+') {
        (Action::Append, rest)
    } else if let Some(rest) = line.strip_prefix('~') {
        (Action::Delete, rest)
    } else {
        (Action::Set, line)
    };
    let (key, text) = match rest.split_once('=') {
        Some((key, text)) => (key, Some(text)),
        None if action == Action::Delete => (rest, None),
        None => return Err(error(line, "it has no `=`", "overrides are key=value, as in spp=50")),
    };
    check_key(line, key)?;
    let value = text.map(|text| Reader { line, rest: text, depth: 0 }.whole()).transpose()?;
    Ok(Override { line: line.to_owned(), action, key: key.to_owned(), value })
}

fn check_key(line: &str, key: &str) -> Result<(), ArisError> {
    if key.contains('@') {
        return Err(error(line, "packages are not read", "leave out @ and what follows"));
    }
    let is_name = |part: &str| {
        !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'$'))
    };
    let separator = if key.contains('/') { '/' } else { '.' };
    if key.split(separator).all(is_name) {
        return Ok(());
    }
    Err(error(line, format!("{key:?} is no key"), "keys are as scene.width, groups as scene/brdf"))
}

/// The deepest nesting of a value.
const MAX_DEPTH: u32 = 32;

/// A value read from the left.
struct Reader<'a> {
    line: &'a str,
    rest: &'a str,
    depth: u32,
}

impl Reader<'_> {
    /// The whole text as one value; nothing is an empty text.
    fn whole(mut self) -> Result<Node, ArisError> {
        self.skip_spaces();
        if self.rest.is_empty() {
            return Ok(self.node(Value::Text(String::new())));
        }
        let value = self.element()?;
        self.skip_spaces();
        match self.rest.chars().next() {
            None => Ok(value),
            Some(',') => Err(self.error(
                "it is a sweep of several values",
                "a list is written key=[a,b], and text with commas in quotes",
            )),
            Some(c) => Err(self.unexpected(c)),
        }
    }

    fn element(&mut self) -> Result<Node, ArisError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.error("its value is nested too deeply", "at most 32 levels are read"));
        }
        let value = match self.rest.chars().next() {
            Some('[') => self.list()?,
            Some('{') => self.map()?,
            Some(quote @ ('"' | '\'')) => self.quoted(quote)?,
            _ => {
                let (text, is_literal) = self.unquoted(true)?;
                if is_literal { typed(text) } else { Value::Text(text) }
            }
        };
        self.depth -= 1;
        Ok(self.node(value))
    }

    fn list(&mut self) -> Result<Value, ArisError> {
        let mut items = Vec::new();
        self.skip(1);
        if !self.takes(']') {
            loop {
                items.push(self.element()?);
                if self.takes(']') {
                    break;
                }
                self.expect(',', "] at the end of the list")?;
            }
        }
        Ok(Value::List(items))
    }

    fn map(&mut self) -> Result<Value, ArisError> {
        let mut entries: Vec<(String, Place, Node)> = Vec::new();
        self.skip(1);
        if !self.takes('}') {
            loop {
                let (key, _) = self.unquoted(false)?;
                self.expect(':', "a colon after the key")?;
                let value = self.element()?;
                entries.retain(|(name, ..)| *name != key);
                entries.push((key, Place::of_override(self.line), value));
                if self.takes('}') {
                    break;
                }
                self.expect(',', "} at the end of the map")?;
            }
        }
        Ok(Value::Map(entries))
    }

    /// Text up to the same quote. Backslashes stand for themselves, but before a quote two are one, and one makes it text.
    fn quoted(&mut self, quote: char) -> Result<Value, ArisError> {
        let mut text = String::new();
        let mut backslashes = 0;
        let inside = &self.rest[1..];
        for (i, c) in inside.char_indices() {
            if c == '\\' {
                backslashes += 1;
                continue;
            }
            let kept = if c == quote { backslashes / 2 } else { backslashes };
            text.extend(std::iter::repeat_n('\\', kept));
            if c == quote && backslashes % 2 == 0 {
                self.rest = &inside[i + 1..];
                return Ok(Value::Text(text));
            }
            backslashes = 0;
            text.push(c);
        }
        Err(self.error("its quotes are not closed", "a shell takes quotes away: 'key=\"some text\"'"))
    }

    /// Text without quotes, without the spaces around it; and whether it is as it was written, without an escape. A colon ends a key.
    fn unquoted(&mut self, colon_is_text: bool) -> Result<(String, bool), ArisError> {
        let mut text = String::new();
        let mut is_literal = true;
        // The length up to the last character that counts: spaces that were escaped do.
        let mut kept = 0;
        while let Some(c) = self.rest.chars().next() {
            let mut taken = c.len_utf8();
            match c {
                '\\' => {
                    let escaped = self.rest[1..].chars().next().filter(|e| "\\()[]{}:=, \t".contains(*e));
                    is_literal &= escaped.is_none();
                    text.push(escaped.unwrap_or('\\'));
                    taken += escaped.map_or(0, char::len_utf8);
                    kept = text.len();
                }
                '$' if self.rest.starts_with("${") => {
                    let end = self.rest.find('}').ok_or_else(|| {
                        self.error("an interpolation is not closed", "as in ${scene.width}")
                    })?;
                    taken = end + 1;
                    text.push_str(&self.rest[..taken]);
                    kept = text.len();
                }
                ':' if !colon_is_text => break,
                ' ' | '\t' if text.is_empty() => {}
                ' ' | '\t' => text.push(c),
                _ if c.is_ascii_alphanumeric() || "_/-+.$%*@?|:".contains(c) => {
                    text.push(c);
                    kept = text.len();
                }
                '(' => {
                    return Err(self.error("functions are not read", "parentheses in text stand in quotes"));
                }
                _ => break,
            }
            self.skip(taken);
        }
        text.truncate(kept);
        if text.is_empty() {
            return Err(match self.rest.chars().next() {
                Some(c) => self.unexpected(c),
                None => self.error("its value ends too early", "quotes and brackets come in pairs"),
            });
        }
        Ok((text, is_literal))
    }

    fn node(&self, value: Value) -> Node {
        Node { place: Place::of_override(self.line), value }
    }

    fn skip(&mut self, bytes: usize) {
        self.rest = &self.rest[bytes..];
    }

    fn skip_spaces(&mut self) {
        self.rest = self.rest.trim_start_matches([' ', '\t']);
    }

    /// Takes a sign with the spaces around it, if it is the next.
    fn takes(&mut self, sign: char) -> bool {
        self.skip_spaces();
        let found = self.rest.strip_prefix(sign);
        if let Some(rest) = found {
            self.rest = rest;
            self.skip_spaces();
        }
        found.is_some()
    }

    fn expect(&mut self, sign: char, what: &str) -> Result<(), ArisError> {
        if self.takes(sign) {
            return Ok(());
        }
        let found = self.rest.chars().next().map_or("nothing more".to_owned(), |c| format!("{c:?}"));
        Err(self
            .error(format!("{what} is expected, but there is {found}"), "quotes and brackets come in pairs"))
    }

    fn unexpected(&self, c: char) -> ArisError {
        self.error(
            format!("{c:?} can't stand there"),
            "text with other signs stands in quotes, which a shell takes away: 'key=\"a#b\"'",
        )
    }

    fn error(&self, message: impl Into<String>, hint: impl Into<String>) -> ArisError {
        error(self.line, message, hint)
    }
}

/// Text as what it is: null, a truth value, a number, or text.
fn typed(text: String) -> Value {
    match text.to_ascii_lowercase().as_str() {
        "null" => return Value::Null,
        "true" => return Value::Bool(true),
        "false" => return Value::Bool(false),
        _ => {}
    }
    match number(&text) {
        Some(value) => value,
        None => Value::Text(text),
    }
}

/// A number of Hydra's grammar: no leading zeros, underscores between digits, and inf and nan.
fn number(text: &str) -> Option<Value> {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    if matches!(unsigned.to_ascii_lowercase().as_str(), "inf" | "nan") {
        return text.parse().ok().map(Value::Number);
    }
    let digits = |part: &str| {
        let grouped = !part.starts_with('_') && !part.ends_with('_') && !part.contains("__");
        !part.is_empty() && grouped && part.bytes().all(|b| b.is_ascii_digit() || b == b'_')
    };
    let whole = |part: &str| digits(part) && (part == "0" || !part.starts_with('0'));
    let plain = text.replace('_', "");
    if whole(unsigned) {
        return Some(
            plain
                .parse()
                .map_or_else(|_| Value::Number(plain.parse().unwrap_or(f64::INFINITY)), Value::Whole),
        );
    }
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent.strip_prefix(['+', '-']).unwrap_or(exponent))),
        None => (unsigned, None),
    };
    let mantissa_is_sound = match mantissa.split_once('.') {
        Some(("", fraction)) => digits(fraction),
        Some((before, "")) => whole(before),
        Some((before, fraction)) => whole(before) && digits(fraction),
        None => whole(mantissa),
    };
    let is_number = mantissa_is_sound && exponent.is_none_or(digits);
    is_number.then(|| plain.parse().ok().map(Value::Number)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Value {
        parse(&format!("k={text}")).unwrap_or_else(|e| panic!("{text}: {e}")).value.unwrap().value
    }

    fn shown(text: &str) -> String {
        crate::import::aris::write::inline(&value(text))
    }

    /// Hydra 1.3.8 gives the same.
    #[test]
    fn values_are_those_of_hydra() {
        for (text, expected) in [
            ("50", "50"),
            ("-1", "-1"),
            ("1_0", "10"),
            ("0.5", "0.5"),
            ("1.", "1.0"),
            ("+.5e-3", "0.0005"),
            ("1e5", "100000.0"),
            ("1_000.5", "1000.5"),
            ("007", "'007'"),
            ("0x10", "'0x10'"),
            ("- 1", "'- 1'"),
            ("nUll", "null"),
            ("True", "true"),
            ("", "''"),
            (" 5", "5"),
            ("a b ", "a b"),
            ("' q'", "' q'"),
            ("a:b", "a:b"),
            ("a\\,b", "'a,b'"),
            ("a\\b", "a\\b"),
            ("\\", "\\"),
            ("\"a\\\"b\"", "a\"b"),
            ("'5'", "'5'"),
            ("path/to.exr", "path/to.exr"),
            ("x${spp}y", "'x${spp}y'"),
            ("[]", "[]"),
            ("{}", "{}"),
            ("[ 1 , [2.0,a b], 'c,d' ]", "[1, [2.0, a b], 'c,d']"),
            ("{a:1,b:[x y,2],c:${spp}}", "{a: 1, b: [x y, 2], c: '${spp}'}"),
        ] {
            assert_eq!(shown(text), expected, "{text}");
        }
    }

    #[test]
    fn actions_stand_before_the_key() {
        for (line, action, key) in [
            ("spp=1", Action::Set, "spp"),
            ("+a.b=1", Action::Append, "a.b"),
            ("++a.b=1", Action::Force, "a.b"),
            ("~scene/brdf", Action::Delete, "scene/brdf"),
        ] {
            let o = parse(line).unwrap();
            assert_eq!((o.action, o.key.as_str(), o.value.is_none()), (action, key, line == "~scene/brdf"));
        }
    }

    #[test]
    fn what_is_no_override_is_told() {
        for line in [
            "spp",
            "=1",
            "a..b=1",
            "a b=1",
            "a@b=1",
            "a=1,2",
            "a=choice(1,2)",
            "a=[1",
            "a=[1,]",
            "a={a}",
            "a='x",
            "a='x'y",
            "a=b=c",
            "a=b#c",
            "a=é",
            "a=${b",
            "a=]",
        ] {
            let told = parse(line).unwrap_err().to_string();
            assert!(
                told.starts_with(&format!("the override `{line}`: ")) && told.contains("; hint: "),
                "{told}"
            );
        }
        let deep = format!("a={}", "[".repeat(100_000));
        assert!(parse(&deep).unwrap_err().to_string().contains("nested too deeply"));
    }
}
