//! `[[axis]]`: what it reaches, its values and their labels.

use toml::de::DeValue;

use super::keys;
use super::reader::{Node, Reader, Table};
use crate::manifest::edit::{EditError, Half, Target, check_value};
use crate::manifest::error::{Diagnostic, ManifestError};
use crate::manifest::model::{Axis, Distribution, Interval, Located, Point, Random, Reach, Sequence, Steps};
use crate::manifest::names::label;
use crate::manifest::steps::{self, Senseless};
use crate::record::Value;

/// The name of the table in messages.
const AXIS: &str = "[[axis]]";
/// Any number.
const ANY: std::ops::RangeInclusive<f64> = f64::MIN..=f64::MAX;

/// How many jobs the axes so far come to, so that no axis computes more values than there may be jobs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    /// The product of the axes' lengths.
    pub(super) jobs: u64,
    /// The limit.
    pub(super) max_jobs: u64,
    /// It has been told that the limit is passed: later axes compute nothing.
    pub(super) is_spent: bool,
}

/// One axis, if all of it is sound.
pub(super) fn axis(reader: &mut Reader, node: &Node<'_>, budget: &mut Budget) -> Option<Axis> {
    let before = reader.errors.len();
    let table = reader.table("axis", node, AXIS, keys::AXIS)?;
    let reach = reach(reader, &table);
    let name = table.get("name").and_then(|n| reader.text("name", n));
    let labels = table.get("labels").and_then(|n| reader.texts("labels", n));
    let steps = steps(reader, &table);
    let (reach, (steps, span)) = (reach?, steps?);
    let points = match &steps {
        Steps::Values(values) => listed_points(reader, &reach, values),
        computed => {
            let values = numbers(reader, computed, &span, budget)?;
            let Reach::Path(path) = &reach else {
                let error =
                    ManifestError::Steps { why: "a `zip` needs `values`: a list with one value a path each" };
                reader.note(error, span);
                return None;
            };
            computed_points(reader, path, &values, &span)
        }
    };
    let points = points.and_then(|p| labelled(reader, p, labels.as_deref(), &reach))?;
    let axis = Axis { reach, steps, name, labels, points, span: table.span };
    budget.jobs = budget.jobs.saturating_mul(axis.points.len() as u64);
    (reader.errors.len() == before).then_some(axis)
}

/// `path` or `zip`, with every path known.
fn reach(reader: &mut Reader, table: &Table<'_, '_>) -> Option<Reach> {
    let reach = match (table.get("path"), table.get("zip")) {
        (Some(_), Some(zip)) => {
            reader.note(ManifestError::Both { table: AXIS, first: "path", second: "zip" }, zip.span());
            return None;
        }
        (None, None) => {
            reader.missing(table, &["path", "zip"], "`path`, or `zip` with several paths");
            return None;
        }
        (Some(path), None) => Reach::Path(reader.text("path", path)?),
        (None, Some(zip)) => Reach::Zip(reader.texts("zip", zip)?),
    };
    let paths = match &reach {
        Reach::Path(path) => std::slice::from_ref(path),
        Reach::Zip(paths) => paths.as_slice(),
    };
    let mut sound = true;
    for path in paths {
        let target = Target::parse(&path.value).and_then(|target| match target {
            Target::Scene if paths.len() > 1 => Err(EditError::SceneItself),
            target => Ok(target),
        });
        if let Err(error) = target {
            reader.note(error, path.span.clone());
            sound = false;
        }
    }
    sound.then_some(reach)
}

/// The one key that gives the values, and where it stands.
fn steps(reader: &mut Reader, table: &Table<'_, '_>) -> Option<(Steps, std::ops::Range<usize>)> {
    let given: Vec<&'static str> = keys::STEPS.iter().copied().filter(|k| table.get(k).is_some()).collect();
    let (&key, node) = match given.as_slice() {
        [key] => (key, table.get(key)?),
        [first, second, ..] => {
            let span = table.key_span(second).unwrap_or(table.span.clone());
            reader.note(ManifestError::Both { table: AXIS, first, second }, span);
            return None;
        }
        [] => {
            reader.missing(table, keys::STEPS, "one of `values`, `range`, `log_range`, `random`, `sobol`");
            return None;
        }
    };
    let steps = match key {
        "values" => {
            let items = reader.items(key, "a list of values, at least one", node)?;
            let values: Vec<_> = items.iter().map(|item| reader.value(key, item)).collect();
            Steps::Values(values.into_iter().collect::<Option<_>>()?)
        }
        "range" | "log_range" => {
            let name = if key == "range" { "`range`" } else { "`log_range`" };
            let t = reader.table(key, node, name, keys::INTERVAL)?;
            let steps = needed(reader, &t, "steps", "`steps`", |r, t| r.whole(t, "steps", 0..=u64::MAX));
            let (from, to) = ends(reader, &t);
            let interval = Interval { from: from?, to: to?, steps: steps? };
            if key == "range" { Steps::Range(interval) } else { Steps::LogRange(interval) }
        }
        "sobol" => {
            let t = reader.table(key, node, "`sobol`", keys::SEQUENCE)?;
            let count = needed(reader, &t, "count", "`count`", |r, t| r.whole(t, "count", 1..=u64::MAX));
            let (from, to) = ends(reader, &t);
            Steps::Sobol(Sequence { count: count?, from: from?, to: to? })
        }
        _ => {
            let t = reader.table(key, node, "`random`", keys::RANDOM)?;
            Steps::Random(random(reader, &t)?)
        }
    };
    Some((steps, node.span()))
}

fn random(reader: &mut Reader, t: &Table<'_, '_>) -> Option<Random> {
    let seed = needed(reader, t, "seed", "`seed`", |r, t| r.whole(t, "seed", 0..=u64::MAX));
    let count = needed(reader, t, "count", "`count`", |r, t| r.whole(t, "count", 1..=u64::MAX));
    let distribution = match t.get("distribution") {
        None => Some(Distribution::default()),
        Some(node) => match node.get_ref().as_str() {
            Some("uniform") => Some(Distribution::Uniform),
            Some("log-uniform") => Some(Distribution::LogUniform),
            Some("normal") => Some(Distribution::Normal),
            _ => {
                reader.expected(
                    "distribution",
                    "one of \"uniform\", \"log-uniform\", \"normal\"",
                    node.span(),
                );
                None
            }
        },
    };
    let before = reader.errors.len();
    let [from, to, mean, sd] = ["from", "to", "mean", "sd"].map(|key| reader.number(t, key, ANY));
    if reader.errors.len() > before {
        return None;
    }
    Some(Random { seed: seed?, count: count?, distribution: distribution?, from, to, mean, sd })
}

/// What `read` reads, or an error if the key is not there.
fn needed<T>(
    reader: &mut Reader,
    table: &Table<'_, '_>,
    key: &str,
    what: &'static str,
    read: impl Fn(&mut Reader, &Table<'_, '_>) -> Option<T>,
) -> Option<T> {
    if table.get(key).is_none() {
        reader.missing(table, &[key], what);
        return None;
    }
    read(reader, table)
}

fn ends(reader: &mut Reader, t: &Table<'_, '_>) -> (Option<f64>, Option<f64>) {
    let from = needed(reader, t, "from", "`from`", |r, t| r.number(t, "from", ANY));
    let to = needed(reader, t, "to", "`to`", |r, t| r.number(t, "to", ANY));
    (from, to)
}

/// The computed numbers, of which there must not be more than jobs.
fn numbers(
    reader: &mut Reader,
    given: &Steps,
    span: &std::ops::Range<usize>,
    budget: &mut Budget,
) -> Option<Vec<f64>> {
    let count = match given {
        Steps::Values(values) => values.len() as u64,
        Steps::Range(i) | Steps::LogRange(i) => i.steps,
        Steps::Random(r) => r.count,
        Steps::Sobol(s) => s.count,
    };
    if budget.is_spent {
        return None;
    }
    let jobs = budget.jobs.saturating_mul(count);
    if jobs > budget.max_jobs {
        budget.is_spent = true;
        reader.note(ManifestError::TooManyJobs { jobs, limit: budget.max_jobs }, span.clone());
        return None;
    }
    let computed = match *given {
        Steps::Values(_) => Ok(Vec::new()),
        Steps::Range(interval) => steps::range(interval),
        Steps::LogRange(interval) => steps::log_range(interval),
        Steps::Random(random) => steps::random(random),
        Steps::Sobol(sequence) => steps::sobol(sequence),
    };
    computed.map_err(|Senseless(why)| reader.note(ManifestError::Steps { why }, span.clone())).ok()
}

/// Points of values as written, each checked.
fn listed_points(reader: &mut Reader, reach: &Reach, values: &[Located<Value>]) -> Option<Vec<Point>> {
    let before = reader.errors.len();
    let mut points = Vec::with_capacity(values.len());
    for value in values {
        let row = match reach {
            Reach::Path(_) => vec![value.value.clone()],
            Reach::Zip(paths) => match &value.value {
                Value::List(row) if row.len() == paths.len() => row.clone(),
                Value::List(row) => {
                    let error = ManifestError::ZipWidth { values: row.len(), paths: paths.len() };
                    reader.note(error, value.span.clone());
                    continue;
                }
                _ => {
                    reader.expected(
                        "values",
                        "a list of lists with one value a path each",
                        value.span.clone(),
                    );
                    continue;
                }
            },
        };
        let paths = match reach {
            Reach::Path(path) => std::slice::from_ref(path),
            Reach::Zip(paths) => paths.as_slice(),
        };
        for (path, v) in paths.iter().zip(&row) {
            reader.check(path, &Located::new(v.clone(), value.span.clone()));
        }
        points.push(Point { values: row, label: String::new(), span: value.span.clone() });
    }
    (reader.errors.len() == before).then_some(points)
}

/// Points of computed numbers; the first that the path does not take is told.
fn computed_points(
    reader: &mut Reader,
    path: &Located<String>,
    numbers: &[f64],
    span: &std::ops::Range<usize>,
) -> Option<Vec<Point>> {
    for n in numbers {
        if let Err(error) = check_value(&path.value, &Value::Number(*n)) {
            let at = if error.half() == Half::Path { &path.span } else { span };
            reader.note(error, at.clone());
            return None;
        }
    }
    let point = |n: &f64| Point { values: vec![Value::Number(*n)], label: String::new(), span: span.clone() };
    Some(numbers.iter().map(point).collect())
}

/// The points with the labels given, or with those of their values.
fn labelled(
    reader: &mut Reader,
    mut points: Vec<Point>,
    labels: Option<&[Located<String>]>,
    reach: &Reach,
) -> Option<Vec<Point>> {
    if let Some(labels) = labels {
        if labels.len() != points.len() {
            let span =
                labels.first().zip(labels.last()).map(|(a, b)| a.span.start..b.span.end).unwrap_or(0..0);
            let error = ManifestError::LabelCount { labels: labels.len(), values: points.len() };
            reader.errors.push(Diagnostic::new(error, span));
            return None;
        }
        for (point, label) in points.iter_mut().zip(labels) {
            point.label = label.value.clone();
        }
        return Some(points);
    }
    let paths = match reach {
        Reach::Path(path) => std::slice::from_ref(path),
        Reach::Zip(paths) => paths.as_slice(),
    };
    let targets: Vec<Target> = paths.iter().filter_map(|p| Target::parse(&p.value).ok()).collect();
    for point in &mut points {
        let parts: Vec<String> = targets.iter().zip(&point.values).map(|(t, v)| label(t, v)).collect();
        point.label = parts.join(" + ");
    }
    Some(points)
}

/// Whether a node is an array of tables or an array at all.
pub(super) fn nodes<'a, 'i>(node: &'a Node<'i>) -> Option<&'a [Node<'i>]> {
    match node.get_ref() {
        DeValue::Array(items) => Some(items),
        _ => None,
    }
}
