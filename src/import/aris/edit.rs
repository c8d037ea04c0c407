//! Values of the command line put into a composed tree, with the meaning and the strictness of Hydra.

use super::ArisError;
use super::compose::{Keys, merge};
use super::overrides::{Action, Override};
use super::write::inline;
use super::yaml::{Node, Value, nearest};

/// Applies an override that is not of a group.
pub(super) fn apply(tree: &mut Node, o: &Override) -> Result<(), ArisError> {
    if o.key.contains('/') {
        return Err(o.error(
            format!("there is no group {}", o.key),
            "groups are folders of the config root; values have dots: scene.width=400",
        ));
    }
    let keys: Vec<&str> = o.key.split('.').collect();
    match (o.action, &o.value) {
        (Action::Delete, value) => delete(tree, o, &keys, value.as_ref()),
        (_, None) => Ok(()),
        (action, Some(value)) => {
            let may_merge = matches!(value.value, Value::Map(_) | Value::List(_));
            if action == Action::Append
                && !may_merge
                && find(tree, &keys).is_some_and(|n| !matches!(n.value, Value::Null))
            {
                let hint = format!("{0} changes it, and ++{0} either way", &o.line[1..]);
                return Err(o.error(format!("{} is there already", o.key), hint));
            }
            let allowed = if action == Action::Set { Keys::Known } else { Keys::Any };
            set(tree, o, &keys, value.clone(), allowed)
        }
    }
}

/// The node at a path.
pub(super) fn find<'a>(tree: &'a Node, keys: &[&str]) -> Option<&'a Node> {
    keys.iter().try_fold(tree, |node, key| match &node.value {
        Value::Map(entries) => entries.iter().find(|(k, ..)| k == key).map(|(.., node)| node),
        Value::List(items) => items.get(key.parse::<usize>().ok()?),
        _ => None,
    })
}

fn set(node: &mut Node, o: &Override, keys: &[&str], value: Node, allowed: Keys) -> Result<(), ArisError> {
    let [key, rest @ ..] = keys else {
        // A map or a list is merged with what is there: maps key by key.
        return match value.value {
            Value::Map(_) | Value::List(_) => merge(node, value, allowed),
            _ => {
                *node = value;
                Ok(())
            }
        };
    };
    if allowed == Keys::Any && !matches!(node.value, Value::Map(_) | Value::List(_)) {
        node.value = Value::Map(Vec::new());
    }
    let kind = node.value.kind();
    match &mut node.value {
        Value::Map(entries) => {
            if allowed == Keys::Any && !entries.iter().any(|(k, ..)| k == key) {
                let place = o.place();
                entries.push(((*key).to_owned(), place.clone(), Node { place, value: Value::Null }));
            }
            let known: Vec<String> = entries.iter().map(|(k, ..)| k.clone()).collect();
            match entries.iter_mut().find(|(k, ..)| k == key) {
                Some((.., child)) => set(child, o, rest, value, allowed),
                None => {
                    let known: Vec<&str> = known.iter().map(String::as_str).collect();
                    let hint = format!("{}; +{} appends it", nearest(key, &known), o.line);
                    Err(o.error(format!("there is no key {key:?}"), hint))
                }
            }
        }
        Value::List(items) => {
            let length = items.len();
            match key.parse::<usize>().ok().and_then(|i| items.get_mut(i)) {
                Some(child) => set(child, o, rest, value, allowed),
                None => Err(o.error(
                    format!("the list has no entry {key:?}"),
                    format!("it has {length} entries, counted from 0; {}=[…] gives a whole new one", o.key),
                )),
            }
        }
        _ => {
            let hint = format!("+{} makes it a map", o.line);
            Err(o.error(format!("there is no key {key:?} in {kind}"), hint))
        }
    }
}

fn delete(tree: &mut Node, o: &Override, keys: &[&str], value: Option<&Node>) -> Result<(), ArisError> {
    let Some(found) = find(tree, keys).filter(|n| !matches!(n.value, Value::Null)) else {
        return Err(o.error(format!("there is no {}", o.key), "only what is there can go"));
    };
    if let Some(value) = value
        && inline(&value.value) != inline(&found.value)
    {
        let message = format!("{} is {}", o.key, inline(&found.value));
        return Err(o.error(message, format!("~{} deletes it whatever it is", o.key)));
    }
    let [parents @ .., last] = keys else { return Ok(()) };
    match find_mut(tree, parents).map(|n| &mut n.value) {
        Some(Value::Map(entries)) => entries.retain(|(key, ..)| key != last),
        _ => return Err(o.error("entries of lists can't be deleted", "give the whole list anew")),
    }
    Ok(())
}

fn find_mut<'a>(tree: &'a mut Node, keys: &[&str]) -> Option<&'a mut Node> {
    keys.iter().try_fold(tree, |node, key| match &mut node.value {
        Value::Map(entries) => entries.iter_mut().find(|(k, ..)| k == key).map(|(.., node)| node),
        Value::List(items) => items.get_mut(key.parse::<usize>().ok()?),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::aris::{overrides, write, yaml};

    const TREE: &str = "spp: 64\nx: {y: {z: 1}, l: [1, 2, {q: 3}], n: null}\n";

    fn edited(line: &str) -> Result<String, ArisError> {
        let mut tree = yaml::parse("a.yaml", TREE.as_bytes()).unwrap();
        apply(&mut tree, &overrides::parse(line).unwrap())?;
        Ok(write::inline(&tree.value))
    }

    /// Hydra 1.3.8 gives the same.
    #[test]
    fn values_are_set_appended_and_deleted_as_hydra_does() {
        for (line, expected) in [
            ("x.y.z=2", "{spp: 64, x: {y: {z: 2}, l: [1, 2, {q: 3}], n: null}}"),
            ("+x.y.w=2", "{spp: 64, x: {y: {z: 1, w: 2}, l: [1, 2, {q: 3}], n: null}}"),
            ("++x.y.z=2", "{spp: 64, x: {y: {z: 2}, l: [1, 2, {q: 3}], n: null}}"),
            ("~x.y.z", "{spp: 64, x: {y: {}, l: [1, 2, {q: 3}], n: null}}"),
            ("~x.y.z=1", "{spp: 64, x: {y: {}, l: [1, 2, {q: 3}], n: null}}"),
            ("x.l.0=5", "{spp: 64, x: {y: {z: 1}, l: [5, 2, {q: 3}], n: null}}"),
            ("x.l.2.q=5", "{spp: 64, x: {y: {z: 1}, l: [1, 2, {q: 5}], n: null}}"),
            ("+x.l.2.r=5", "{spp: 64, x: {y: {z: 1}, l: [1, 2, {q: 3, r: 5}], n: null}}"),
            ("+x.l.0.q=3", "{spp: 64, x: {y: {z: 1}, l: [{q: 3}, 2, {q: 3}], n: null}}"),
            ("x.y={z:3}", "{spp: 64, x: {y: {z: 3}, l: [1, 2, {q: 3}], n: null}}"),
            ("+x.y={w:3}", "{spp: 64, x: {y: {z: 1, w: 3}, l: [1, 2, {q: 3}], n: null}}"),
            ("x.y={}", "{spp: 64, x: {y: {z: 1}, l: [1, 2, {q: 3}], n: null}}"),
            ("x.y=5", "{spp: 64, x: {y: 5, l: [1, 2, {q: 3}], n: null}}"),
            ("+x.l=[9]", "{spp: 64, x: {y: {z: 1}, l: [9], n: null}}"),
            ("+spp.q=5", "{spp: {q: 5}, x: {y: {z: 1}, l: [1, 2, {q: 3}], n: null}}"),
            ("+a.b.c=1", "{spp: 64, x: {y: {z: 1}, l: [1, 2, {q: 3}], n: null}, a: {b: {c: 1}}}"),
            ("+x.n=3", "{spp: 64, x: {y: {z: 1}, l: [1, 2, {q: 3}], n: 3}}"),
        ] {
            assert_eq!(edited(line).unwrap_or_else(|e| panic!("{line}: {e}")), expected, "{line}");
        }
    }

    #[test]
    fn what_is_not_there_is_not_set_and_what_is_there_not_appended() {
        for (line, expected) in [
            ("x.y.w=2", "there is no key \"w\"; hint: did you mean \"z\"?; +x.y.w=2 appends it"),
            ("+x.y.z=2", "x.y.z is there already; hint: x.y.z=2 changes it, and ++x.y.z=2 either way"),
            ("~x.y.z=2", "x.y.z is 1; hint: ~x.y.z deletes it whatever it is"),
            ("~x.n", "there is no x.n"),
            ("~x.l.0", "entries of lists can't be deleted"),
            ("x.l.7=5", "the list has no entry \"7\"; hint: it has 3 entries"),
            ("x.l.2.r=5", "there is no key \"r\""),
            ("x.y={w:3}", "there is no key \"w\""),
            ("spp.q=5", "there is no key \"q\" in a number"),
            ("x.l={a:1}", "a map can't be put on top of a list; hint: the other one is at a.yaml:2:"),
            ("++x.y=[1]", "a list can't be put on top of a map"),
            ("a/b=1", "there is no group a/b"),
        ] {
            let told = edited(line).unwrap_err().to_string();
            assert!(told.starts_with(&format!("the override `{line}`: {expected}")), "{told}");
        }
    }
}
