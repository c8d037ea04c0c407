//! Hydra's composition: `defaults` lists with configs, groups, `_self_` and `override`, and groups chosen on the command line.
//!
//! Hydra 1.3, "The Defaults List". Later entries win over earlier ones, maps are merged key by key, and a file's own content comes
//! where its list says `_self_`, else last. Left out, with an error: packages (`@`) and interpolations in the lists.

use std::collections::BTreeMap;
use std::io::ErrorKind;

use super::ArisError;
use super::overrides::{Action, Override};
use super::yaml::{self, Node, Place, Value, nearest};
use crate::import::{FileError, Files};

/// The deepest chain of files.
const MAX_DEPTH: usize = 16;
/// The most files that one composition reads.
const MAX_FILES: usize = 256;

/// The config file `name` of the folder `top`, with everything that its `defaults` name and with the groups chosen as `choices`
/// say. Configs and groups with a leading slash are found from `top`.
pub(super) fn compose(
    files: &mut Files,
    top: &str,
    name: &str,
    choices: &[&Override],
) -> Result<Node, ArisError> {
    let mut composer = Composer {
        files,
        top,
        choices: BTreeMap::new(),
        appended: Vec::new(),
        deleted: BTreeMap::new(),
        known: BTreeMap::new(),
        pieces: Vec::new(),
        left: MAX_FILES,
    };
    for choice in choices {
        composer.choose(choice)?;
    }
    composer.config(&Wanted { config: name, package: &[], by: None, optional: false, depth: 0 })?;
    composer.check_all_used()?;
    let mut pieces = composer.pieces.into_iter().rev();
    let Some(mut out) = pieces.next() else { return Ok(empty(Place::of_override("none"))) };
    for piece in pieces {
        merge(&mut out, piece, Keys::Any)?;
    }
    Ok(out)
}

fn empty(place: Place) -> Node {
    Node { place, value: Value::Map(Vec::new()) }
}

/// What a group is to be instead of what its list says.
struct Choice {
    options: Vec<String>,
    by: Node,
    used: bool,
}

/// A group that is to go, if it is `option` where that is given.
struct Deletion {
    option: Option<String>,
    place: Place,
    used: bool,
}

struct Composer<'a> {
    files: &'a mut Files,
    top: &'a str,
    choices: BTreeMap<String, Choice>,
    /// Groups that are added to the first file's list.
    appended: Vec<Entry>,
    deleted: BTreeMap<String, Deletion>,
    /// What each group was found to be.
    known: BTreeMap<String, String>,
    /// Contents in their packages, the last to be merged first, as later choices decide about earlier ones.
    pieces: Vec<Node>,
    left: usize,
}

/// A config that something names.
#[derive(Clone, Copy)]
struct Wanted<'a> {
    /// Its path from `top`; the first has its ending.
    config: &'a str,
    /// The keys under which its content stands.
    package: &'a [String],
    /// What names it; nothing names the first.
    by: Option<&'a Node>,
    optional: bool,
    depth: usize,
}

/// An entry of a defaults list.
enum Entry {
    Own,
    Config { name: String, by: Node, optional: bool },
    Group { group: String, options: Vec<String>, by: Node, optional: bool },
    Override { group: String, options: Vec<String>, by: Node },
}

impl Composer<'_> {
    /// Takes in an override of a group.
    fn choose(&mut self, o: &Override) -> Result<(), ArisError> {
        let by = o.value.clone().unwrap_or(Node { place: o.place(), value: Value::Null });
        let options = match &by.value {
            Value::Text(text) if !text.is_empty() => vec![text.clone()],
            Value::List(_) => options_of(&by)?,
            Value::Null if o.action == Action::Delete => Vec::new(),
            _ => {
                let hint = self.options_hint(&o.key, "");
                return Err(o.error(format!("{} is a group, and takes the name of an option", o.key), hint));
            }
        };
        match o.action {
            Action::Set => {
                self.choices.insert(o.key.clone(), Choice { options, by, used: false });
            }
            Action::Append => {
                self.appended.push(Entry::Group { group: o.key.clone(), options, by, optional: false });
            }
            Action::Delete => {
                let option = options.into_iter().next();
                self.deleted.insert(o.key.clone(), Deletion { option, place: by.place, used: false });
            }
            Action::Force => {
                return Err(o.error("groups are not forced", format!("{0}=… or +{0}=… are read", o.key)));
            }
        }
        Ok(())
    }

    /// Reads a config and all that its list names.
    fn config(&mut self, wanted: &Wanted<'_>) -> Result<(), ArisError> {
        let place = wanted.by.map_or_else(|| wanted.config.to_owned(), |node| node.place.to_string());
        if wanted.depth > MAX_DEPTH || self.left == 0 {
            return Err(ArisError::Composition {
                place,
                message: format!("defaults go deeper than {MAX_DEPTH} files or name more than {MAX_FILES}"),
                hint: "does a file name itself?".to_owned(),
            });
        }
        self.left -= 1;
        let ending = if wanted.by.is_some() { ".yaml" } else { "" };
        let file = self.below_top(wanted.config) + ending;
        let bytes = match self.files.read(&file) {
            Ok(bytes) => bytes,
            Err(FileError::Read { cause, .. })
                if cause.kind() == ErrorKind::NotFound && is_dispensable(wanted) =>
            {
                return Ok(());
            }
            Err(cause) => return Err(self.missing(wanted, place, cause)),
        };
        let mut node = yaml::parse(&file, &bytes)?;
        if let Some(line) = header_of(&bytes) {
            let place = format!("{file}:{line}:1");
            let hint = "leave out the # @package line: content stands under its group's name";
            return Err(unsupported(place, "packages are not read", hint));
        }
        if matches!(node.value, Value::Null) {
            node.value = Value::Map(Vec::new());
        }
        let mut list = Vec::new();
        if let Value::Map(entries) = &mut node.value
            && let Some(at) = entries.iter().position(|(key, ..)| key == "defaults")
        {
            let (_, _, defaults) = entries.remove(at);
            list = defaults.list("defaults")?.iter().map(entry_of).collect::<Result<Vec<_>, _>>()?;
            check_own(&defaults, &list)?;
        }
        if !list.iter().any(|e| matches!(e, Entry::Own)) {
            list.push(Entry::Own);
        }
        if wanted.by.is_none() {
            list.append(&mut self.appended);
        }
        self.entries(wanted, list, node)
    }

    /// Follows a defaults list from its end, `own` being the content of its file.
    fn entries(&mut self, wanted: &Wanted<'_>, list: Vec<Entry>, own: Node) -> Result<(), ArisError> {
        let folder = wanted.config.rsplit_once('/').map_or("", |(folder, _)| folder);
        for entry in &list {
            if let Entry::Override { group, options, by } = entry {
                let choice = || Choice { options: options.clone(), by: by.clone(), used: false };
                self.choices.entry(resolved(folder, group)).or_insert_with(choice);
            }
        }
        let mut own = Some(own);
        for entry in list.iter().rev() {
            match entry {
                Entry::Override { .. } => {}
                Entry::Own => self.pieces.extend(own.take().map(|own| packed(own, wanted.package))),
                Entry::Config { name, by, optional } => {
                    let config = resolved(folder, name);
                    let package =
                        joined(wanted.package, name.rsplit_once('/').map_or("", |(folder, _)| folder));
                    let depth = wanted.depth + 1;
                    self.config(&Wanted {
                        config: &config,
                        package: &package,
                        by: Some(by),
                        optional: *optional,
                        depth,
                    })?;
                }
                Entry::Group { group, options, by, optional } => {
                    let key = resolved(folder, group);
                    // Hydra's own settings are about how it runs, not about what is computed.
                    if key == "hydra" || key.starts_with("hydra/") {
                        continue;
                    }
                    let (options, by) = match self.choices.get_mut(&key) {
                        None => (options.clone(), by.clone()),
                        Some(choice) => {
                            choice.used = true;
                            (choice.options.clone(), choice.by.clone())
                        }
                    };
                    if self.is_deleted(&key, &options) {
                        continue;
                    }
                    self.note_choice(&key, &options, &by)?;
                    let package = joined(wanted.package, group);
                    for option in options.iter().rev() {
                        if option == "???" {
                            let message = format!("{key} must be chosen");
                            return Err(unsupported(by.place, &message, &self.options_hint(&key, "")));
                        }
                        let config = format!("{key}/{option}");
                        let depth = wanted.depth + 1;
                        self.config(&Wanted {
                            config: &config,
                            package: &package,
                            by: Some(&by),
                            optional: *optional,
                            depth,
                        })?;
                    }
                }
            }
        }
        Ok(())
    }

    /// A group stands once in all lists.
    fn note_choice(&mut self, key: &str, options: &[String], by: &Node) -> Result<(), ArisError> {
        let now = options.join(",");
        match self.known.insert(key.to_owned(), now.clone()) {
            None => Ok(()),
            Some(before) => Err(unsupported(
                by.place.clone(),
                &format!("{key} is {before} already"),
                &format!("change that one: {key}={now}, or `override {key}: {now}` in a defaults list"),
            )),
        }
    }

    fn is_deleted(&mut self, key: &str, options: &[String]) -> bool {
        let Some(deletion) = self.deleted.get_mut(key) else { return false };
        let applies = deletion.option.as_ref().is_none_or(|option| options == std::slice::from_ref(option));
        deletion.used |= applies;
        applies
    }

    /// Overrides of groups that no list names would do nothing.
    fn check_all_used(&self) -> Result<(), ArisError> {
        let known: Vec<&str> = self.known.keys().map(String::as_str).collect();
        let hint = |key: &str| match nearest(key, &known) {
            near if near.starts_with("did") => near,
            _ => format!("the groups there are: {}", known.join(", ")),
        };
        let mut unused = self.choices.iter().filter(|(key, c)| !c.used && !key.starts_with("hydra/"));
        if let Some((key, choice)) = unused.next() {
            let message = format!("no defaults list has the group {key}");
            let hint = format!("{}; to append it, write +{key}={}", hint(key), choice.options.join(","));
            return Err(unsupported(choice.by.place.clone(), &message, &hint));
        }
        if let Some((key, deletion)) = self.deleted.iter().find(|(_, d)| !d.used) {
            let what = deletion.option.as_ref().map_or(key.clone(), |option| format!("{key}={option}"));
            let message = format!("no defaults list has {what}");
            return Err(unsupported(deletion.place.clone(), &message, &hint(key)));
        }
        Ok(())
    }

    fn below_top(&self, path: &str) -> String {
        if self.top.is_empty() { path.to_owned() } else { format!("{}/{path}", self.top) }
    }

    /// The error that a config can't be read, with what else there is in its folder.
    fn missing(&self, wanted: &Wanted<'_>, place: String, cause: FileError) -> ArisError {
        let (folder, name) = wanted.config.rsplit_once('/').unwrap_or(("", wanted.config));
        let is_absent =
            matches!(&cause, FileError::Read { cause, .. } if cause.kind() == ErrorKind::NotFound);
        let hint = match wanted.by {
            Some(_) if is_absent => format!("; hint: {}", self.options_hint(folder, name)),
            _ => String::new(),
        };
        let is_listed = wanted.by.is_some_and(|by| by.place.line > 0);
        let key = if is_listed { "defaults".to_owned() } else { String::new() };
        ArisError::File { place, key, cause, hint }
    }

    /// The options of a group, or the one that `name` was meant to be.
    fn options_hint(&self, group: &str, name: &str) -> String {
        let names = self.files.names_in(&self.below_top(group));
        let options: Vec<&str> = names.iter().filter_map(|n| n.strip_suffix(".yaml")).collect();
        nearest(name, &options)
    }
}

/// Configs that may be absent: those that say so, and schemas, which are part of the program that they are checked by.
fn is_dispensable(wanted: &Wanted<'_>) -> bool {
    let is_schema =
        wanted.by.is_some_and(|by| matches!(&by.value, Value::Text(name) if name.ends_with("schema")));
    wanted.optional || is_schema
}

/// The line of a `# @package` header other than `_group_`, which is what is done anyway.
fn header_of(bytes: &[u8]) -> Option<usize> {
    let text = std::str::from_utf8(bytes).ok()?;
    let comments = text.lines().take_while(|line| line.starts_with('#') || line.trim().is_empty());
    let mut headers = comments.enumerate().filter_map(|(i, line)| {
        let package = line.trim_start_matches(['#', ' ']).strip_prefix("@package")?.trim();
        (package != "_group_").then_some(i + 1)
    });
    headers.next()
}

fn entry_of(node: &Node) -> Result<Entry, ArisError> {
    match &node.value {
        Value::Text(name) if name == "_self_" => Ok(Entry::Own),
        Value::Text(name) => {
            let (name, optional) = match name.strip_prefix("optional ") {
                Some(name) => (name, true),
                None => (name.as_str(), false),
            };
            Ok(Entry::Config { name: path_of(node, name)?, by: node.clone(), optional })
        }
        Value::Map(groups) => {
            let [(group, _, option)] = groups.as_slice() else {
                return Err(node.mismatch("defaults", "the name of a file, or one group: option"));
            };
            let options = options_of(option)?;
            if let Some(group) = group.strip_prefix("override ") {
                return Ok(Entry::Override { group: path_of(node, group)?, options, by: option.clone() });
            }
            let (group, optional) = match group.strip_prefix("optional ") {
                Some(group) => (group, true),
                None => (group.as_str(), false),
            };
            Ok(Entry::Group { group: path_of(node, group)?, options, by: option.clone(), optional })
        }
        _ => Err(node.mismatch("defaults", "the name of a file, or group: option")),
    }
}

/// The options that a group is given; none for null, a place for an override.
fn options_of(node: &Node) -> Result<Vec<String>, ArisError> {
    match &node.value {
        Value::Null => Ok(Vec::new()),
        Value::Text(name) if name == "???" => Ok(vec![name.clone()]),
        Value::Text(name) => Ok(vec![path_of(node, name)?]),
        Value::List(items) => {
            items.iter().map(|item| path_of(item, item.text("defaults")?)).collect::<Result<_, _>>()
        }
        _ => Err(node.mismatch("defaults", "the name of an option")),
    }
}

/// The name of a config or group, without the file's ending.
fn path_of(node: &Node, name: &str) -> Result<String, ArisError> {
    if name.contains(['@', ' ', '$']) {
        let message = format!("{name:?} is more of Hydra than is read");
        let hint = "files and groups are, without packages and interpolations";
        return Err(unsupported(node.place.clone(), &message, hint));
    }
    Ok(name.strip_suffix(".yaml").unwrap_or(name).to_owned())
}

fn check_own(defaults: &Node, list: &[Entry]) -> Result<(), ArisError> {
    if list.iter().filter(|e| matches!(e, Entry::Own)).count() > 1 {
        let place = defaults.place.clone();
        return Err(unsupported(place, "_self_ stands in the list twice", "keep one of them"));
    }
    Ok(())
}

fn unsupported(place: impl ToString, message: &str, hint: &str) -> ArisError {
    ArisError::Composition { place: place.to_string(), message: message.to_owned(), hint: hint.to_owned() }
}

/// A path from the folder of the file that names it, or from the top.
fn resolved(folder: &str, name: &str) -> String {
    match name.strip_prefix('/') {
        Some(name) => name.to_owned(),
        None if folder.is_empty() => name.to_owned(),
        None => format!("{folder}/{name}"),
    }
}

fn joined(package: &[String], group: &str) -> Vec<String> {
    let parts = group.split('/').filter(|part| !part.is_empty()).map(str::to_owned);
    package.iter().cloned().chain(parts).collect()
}

/// The content under the keys of its package.
fn packed(node: Node, package: &[String]) -> Node {
    package.iter().rev().fold(node, |node, key| {
        let place = node.place.clone();
        Node { place: place.clone(), value: Value::Map(vec![(key.clone(), place, node)]) }
    })
}

/// Which keys a map may get.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keys {
    Any,
    /// Those it has.
    Known,
}

/// Puts `over` on top of `base`: maps key by key, everything else as a whole.
pub(super) fn merge(base: &mut Node, over: Node, keys: Keys) -> Result<(), ArisError> {
    match (&mut base.value, over.value) {
        (Value::Map(entries), Value::Map(overs)) => {
            for (key, place, node) in overs {
                match entries.iter_mut().find(|(k, ..)| *k == key) {
                    Some((_, at, existing)) => {
                        *at = place;
                        merge(existing, node, keys)?;
                    }
                    None if keys == Keys::Any => entries.push((key, place, node)),
                    None => {
                        let known: Vec<&str> = entries.iter().map(|(k, ..)| k.as_str()).collect();
                        let hint = format!("{}; + in front appends a key", nearest(&key, &known));
                        return Err(unsupported(place, &format!("there is no key {key:?}"), &hint));
                    }
                }
            }
            Ok(())
        }
        (Value::Map(_), Value::List(_)) => Err(unmergeable(&base.place, &over.place, "a list", "a map")),
        (Value::List(_), Value::Map(_)) => Err(unmergeable(&base.place, &over.place, "a map", "a list")),
        (value, over_value) => {
            *value = over_value;
            base.place = over.place;
            Ok(())
        }
    }
}

fn unmergeable(base: &Place, over: &Place, new: &str, old: &str) -> ArisError {
    let message = format!("{new} can't be put on top of {old}");
    unsupported(over.clone(), &message, &format!("the other one is at {base}"))
}
