//! The runs and their summaries as text.

use super::{Bench, BenchError, Summary};

/// All runs, a row each.
///
/// # Errors
/// If the table can't be written.
pub fn csv(benches: &[Bench]) -> Result<String, BenchError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header = ["scene", "samples", "seed", "seconds", "rays", "error", "error_without_tail", "bias"];
    writer.write_record(header)?;
    for bench in benches {
        for run in &bench.runs {
            let d = run.deviation;
            let numbers = [run.seconds.to_string(), run.rays.to_string()];
            let errors = [d.error, d.without_tail, d.bias].map(|v| v.to_string());
            let row = [bench.name.clone(), run.samples.to_string(), run.seed.to_string()];
            writer.write_record(row.into_iter().chain(numbers).chain(errors))?;
        }
    }
    written(writer)
}

/// What a writer has written.
pub(super) fn written(writer: csv::Writer<Vec<u8>>) -> Result<String, BenchError> {
    let bytes = writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The summaries in columns.
pub fn table(rows: &[(&str, Summary)]) -> String {
    let heads = ["scene", "slope", "work", "s to 0.01", "bias", "tail"];
    let cells: Vec<[String; 6]> = rows
        .iter()
        .map(|(name, s)| {
            let bias = match s.bias.half_width.is_finite() {
                true => format!("{:+.3} ± {:.3}%", 100.0 * s.bias.value, 100.0 * s.bias.half_width),
                false => format!("{:+.3}%", 100.0 * s.bias.value),
            };
            [
                (*name).to_owned(),
                s.slope.map_or("-".into(), |slope| format!("{slope:.2}")),
                digits(s.work),
                digits(s.seconds_to_goal),
                bias,
                format!("{:.0}%", 100.0 * s.tail),
            ]
        })
        .collect();
    columns(heads, &cells, 1)
}

/// Rows in columns below their heads: the first few, of `words`, aligned to the left, the others to the right.
pub(super) fn columns<const N: usize>(heads: [&str; N], rows: &[[String; N]], words: usize) -> String {
    let width = |column: usize| {
        let of_rows = rows.iter().map(|row| row[column].chars().count());
        of_rows.chain([heads[column].len()]).max().unwrap_or(0)
    };
    let widths: [usize; N] = std::array::from_fn(width);
    let line = |row: [&str; N]| {
        let aligned = |(column, (cell, w)): (usize, (&&str, usize))| {
            if column < words { format!("{cell:<w$}") } else { format!("{cell:>w$}") }
        };
        let cells: Vec<String> = row.iter().zip(widths).enumerate().map(aligned).collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    let mut text = line(heads);
    for row in rows {
        text.push_str(&line(row.each_ref().map(String::as_str)));
    }
    text
}

/// A ratio, in digits enough for one that is measured.
pub(super) fn ratio(value: f64) -> String {
    if (0.095..9.995).contains(&value) { format!("{value:.2}") } else { digits(value) }
}

/// Three significant digits.
pub(super) fn digits(value: f64) -> String {
    let decimals = match value.abs() {
        v if v >= 100.0 => 0,
        v if v >= 10.0 => 1,
        v if v >= 1.0 => 2,
        v if v >= 0.1 => 3,
        v if v >= 0.01 => 4,
        _ => 5,
    };
    format!("{value:.decimals$}")
}
