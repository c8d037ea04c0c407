//! One row's cells to parameters and directions.

use std::fmt::Display;

use csv::ByteRecord;

use super::header::{Column, Header, is_required};
use super::{LENGTH_TOLERANCE, V3};
use crate::color::Rgb;
use crate::disney::{BASE_COLOR, Params, check_base_color};

/// A length so near 1 that a direction is left as it is: rounding a unit vector to `f32` leaves this much.
const ROUNDING: f64 = 1e-6;
/// Characters of a cell that a message shows.
const SHOWN: usize = 40;

/// What a row holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) params: Params,
    /// To the light.
    pub(super) l: V3<f32>,
    /// To the viewer.
    pub(super) v: V3<f32>,
}

/// Reads a row.
///
/// # Errors
/// Everything that is wrong with it, as one text.
pub(super) fn read(header: &Header, record: &ByteRecord) -> Result<Row, String> {
    let behind = record.iter().skip(header.width).any(|cell| !cell.trim_ascii().is_empty());
    if record.len() < header.width || behind {
        return Err(format!("the row has {} cells, the header {}", record.len(), header.width));
    }
    let mut problems = Vec::new();
    let mut params = Params::<f32>::default();
    let mut color = [0.0; 3];
    for (channel, column) in color.iter_mut().zip(&header.base_color) {
        let check = |value| check_base_color(Rgb::grey(value)).map(|grey| grey.r);
        keep(&mut problems, column, BASE_COLOR, number(record, column).map(check), |value| *channel = value);
    }
    params.base_color = color.into();
    for (parameter, column) in &header.scalars {
        let Some(column) = column else { continue };
        if !is_required(*parameter) && text(record, column).is_empty() {
            continue;
        }
        let checked = number(record, column).map(|value| parameter.check(value));
        keep(&mut problems, column, parameter.name(), checked, |value| *params.get_mut(*parameter) = value);
    }
    let l = direction(&mut problems, record, "l", &header.light);
    let v = direction(&mut problems, record, "v", &header.viewer);
    match (l, v) {
        (Some(l), Some(v)) if problems.is_empty() => Ok(Row { params, l, v }),
        _ => Err(problems.join("; ")),
    }
}

/// Gives a checked value to `set`, or tells what is wrong with it; `name` is how the check's message calls it.
fn keep<E: Display>(
    problems: &mut Vec<String>,
    column: &Column,
    name: &str,
    value: Result<Result<f32, E>, String>,
    set: impl FnOnce(f32),
) {
    match value {
        Ok(Ok(value)) => set(value),
        Ok(Err(error)) => {
            let error = error.to_string();
            let what = error.strip_prefix(name).map_or_else(|| format!(": {error}"), str::to_owned);
            problems.push(format!("column {}{what}", column.name));
        }
        Err(problem) => problems.push(problem),
    }
}

/// Reads a direction and gives it unit length.
fn direction(
    problems: &mut Vec<String>,
    record: &ByteRecord,
    name: &str,
    columns: &[Column; 3],
) -> Option<V3<f32>> {
    let mut values = [0.0f32; 3];
    let before = problems.len();
    for (value, column) in values.iter_mut().zip(columns) {
        match number(record, column) {
            Ok(number) if number.is_finite() => *value = number,
            Ok(number) => problems.push(format!("column {} is {number}, but must be finite", column.name)),
            Err(problem) => problems.push(problem),
        }
    }
    if problems.len() > before {
        return None;
    }
    let single = V3::new(values[0], values[1], values[2]);
    let exact: V3<f64> = single.cast();
    let length = exact.length();
    if (length - 1.0).abs() <= ROUNDING {
        return Some(single);
    }
    if (length - 1.0).abs() <= LENGTH_TOLERANCE {
        return Some((exact * (1.0 / length)).cast());
    }
    let [x, y, z] = columns.each_ref().map(|c| c.name.as_str());
    let length = if (1e-4..1e6).contains(&length) { format!("{length:.6}") } else { format!("{length:.3e}") };
    problems.push(format!(
        "the direction {name} ({x}, {y}, {z}) has the length {length}, but must be a unit vector to within {LENGTH_TOLERANCE}"
    ));
    None
}

/// The number in a cell. NaN and infinities are numbers; what a column takes decides about them.
fn number(record: &ByteRecord, column: &Column) -> Result<f32, String> {
    let text = text(record, column);
    text.parse().map_err(|_| {
        if text.is_empty() {
            return format!("column {} is empty, but must be a number", column.name);
        }
        let shown: String = text.chars().take(SHOWN).collect();
        format!("column {} is {shown:?}, but must be a number", column.name)
    })
}

/// A cell's text without spaces around it; what isn't UTF-8 shows as U+FFFD.
fn text(record: &ByteRecord, column: &Column) -> String {
    String::from_utf8_lossy(record.get(column.index).unwrap_or_default()).trim().to_owned()
}
