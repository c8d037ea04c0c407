//! Names of jobs: of values only, never of an index, and each value's text depends on that value alone, so that another
//! step renames nothing.

use std::path::Path;

use super::edit::Target;
use super::model::Axis;
use crate::record::Value;

/// Names longer than this, in bytes, are cut and get a hash: file systems take 255, and an extension and a temporary name's
/// suffix must fit.
const MAX_NAME: usize = 180;
/// Hexadecimal digits of that hash.
const HASH_DIGITS: usize = 12;

/// What stands for a value in names and on the sheet: `0.30`, `0.955_0.637_0.538`, a file's stem.
pub(super) fn label(target: &Target, value: &Value) -> String {
    match (target, value) {
        (Target::Scene | Target::Environment(super::edit::EnvironmentField::Image), Value::Text(file)) => {
            stem(Path::new(file))
        }
        // Most parameters lie in [0, 1], where two decimals line up.
        (Target::Material(_, field), Value::Number(n)) if field.parameter().is_some() => number(*n, 2),
        (_, Value::Number(n)) => number(*n, 0),
        (_, Value::List(items)) => items.iter().map(|v| label(target, v)).collect::<Vec<_>>().join("_"),
        (_, other) => other.to_string(),
    }
}

/// The shortest decimal number that is read back as `n`, with at least so many decimals.
fn number(n: f64, decimals: usize) -> String {
    if n != 0.0 && !(1e-6..1e15).contains(&n.abs()) {
        return format!("{n:e}");
    }
    // -0 is 0.
    let shortest = (n + 0.0).to_string();
    let has = shortest.split_once('.').map_or(0, |(_, d)| d.len());
    if has >= decimals { shortest } else { format!("{:.decimals$}", n + 0.0) }
}

/// A scene's or image's file name without folder, extension and compression.
pub(super) fn stem(file: &Path) -> String {
    let mut name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    for compression in [".gz", ".zst"] {
        if let Some(plain) = name.strip_suffix(compression) {
            name = plain.to_owned();
        }
    }
    match name.rsplit_once('.') {
        Some((stem, _)) if !stem.is_empty() => stem.to_owned(),
        _ => name,
    }
}

/// One key an axis: its name, or the last part of its path, with as many parts before it as it takes to tell axes apart.
pub(super) fn axis_keys(axes: &[Axis]) -> Vec<String> {
    let longest = axes.iter().flat_map(Axis::paths).map(|p| p.value.split('.').count()).max().unwrap_or(1);
    let key = |axis: &Axis, parts: usize| match &axis.name {
        Some(name) => name.value.clone(),
        None => axis.paths().iter().map(|p| last_parts(&p.value, parts)).collect::<Vec<_>>().join("+"),
    };
    let mut used = vec![1; axes.len()];
    let mut keys: Vec<String> = axes.iter().map(|a| key(a, 1)).collect();
    for parts in 2..=longest {
        let ambiguous: Vec<usize> =
            (0..keys.len()).filter(|&i| keys.iter().filter(|k| **k == keys[i]).count() > 1).collect();
        for i in ambiguous {
            used[i] = parts;
            keys[i] = key(&axes[i], parts);
        }
    }
    keys
}

fn last_parts(path: &str, parts: usize) -> &str {
    path.rmatch_indices('.').nth(parts - 1).map_or(path, |(at, _)| &path[at + 1..])
}

/// `key=label`s, joined by commas, as a file's name.
pub(super) fn job_name<'a>(parts: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let joined: Vec<String> = parts.map(|(key, label)| format!("{}={}", safe(key), safe(label))).collect();
    capped(joined.join(","))
}

/// A name alone, as a file's name.
pub(crate) fn plain_name(name: &str) -> String {
    let safe = safe(name);
    // A name such as `..` or `.x` would be special, and a contact sheet has names of its own.
    let lower = safe.to_lowercase();
    let is_sheet = lower == "sheet" || lower.starts_with("sheet-");
    capped(if safe.starts_with('.') || is_sheet { format!("_{safe}") } else { safe })
}

/// Letters, digits and `.`, `_`, `+`, `-` stay; anything else becomes `_`.
fn safe(text: &str) -> String {
    let keep = |c: char| c.is_alphanumeric() || matches!(c, '.' | '_' | '+' | '-');
    text.chars().map(|c| if keep(c) { c } else { '_' }).collect()
}

/// The name, or its beginning and a hash of all of it.
fn capped(name: String) -> String {
    if name.len() <= MAX_NAME {
        return name;
    }
    let hash = blake3::hash(name.as_bytes()).to_hex();
    let keep = MAX_NAME - HASH_DIGITS - 1;
    let end = (0..=keep).rev().find(|i| name.is_char_boundary(*i)).unwrap_or(0);
    format!("{}-{}", &name[..end], &hash[..HASH_DIGITS])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labelled(path: &str, value: Value) -> String {
        label(&Target::parse(path).unwrap(), &value)
    }

    #[test]
    fn a_number_s_text_depends_on_it_alone() {
        let roughness = |n| labelled("material.ball.roughness", Value::Number(n));
        assert_eq!(
            [0.0, 0.3, 1.0, 0.125, 1.0 / 3.0].map(roughness),
            ["0.00", "0.30", "1.00", "0.125", "0.3333333333333333"]
        );
        assert_eq!(labelled("render.spp", Value::Number(64.0)), "64");
        assert_eq!(labelled("environment.rotation", Value::Number(-0.0)), "0");
        assert_eq!(labelled("environment.intensity", Value::Number(1e300)), "1e300");
        assert_eq!(labelled("environment.intensity", Value::Number(1e-9)), "1e-9");
    }

    #[test]
    fn lists_and_files_have_short_texts() {
        let color = Value::List([0.955, 0.637, 0.538].map(Value::Number).to_vec());
        assert_eq!(labelled("material.ball.base_color", color), "0.955_0.637_0.538");
        assert_eq!(labelled("environment.image", Value::Text("../env/Sky 1.v2.hdr".into())), "Sky 1.v2");
        assert_eq!(stem(Path::new("../scenes/statue.glb.gz")), "statue");
        assert_eq!(stem(Path::new(".glb")), ".glb");
        assert_eq!(stem(Path::new("")), "");
    }

    #[test]
    fn names_are_safe_for_files() {
        let name = job_name([("base_color", "Rosé/../gold,=1")].into_iter());
        assert_eq!(name, "base_color=Rosé_.._gold__1");
        assert_eq!(plain_name("../x"), "_.._x");
        assert_eq!(plain_name("two copper spheres"), "two_copper_spheres");
    }

    #[test]
    fn long_names_are_cut_but_stay_apart() {
        let long = |end: &str| plain_name(&format!("{}{end}", "é".repeat(300)));
        assert!(long("a").len() <= MAX_NAME);
        assert_ne!(long("a"), long("b"));
    }
}
