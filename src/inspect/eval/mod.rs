//! Rows of a CSV file, each with parameters and two directions, to the same rows with the BRDF's value and sampling density.
//!
//! The columns are those of `disney_brdf.csv`: `base_color_r`, `_g`, `_b`, the scalars of [`Parameter`], `lx`, `ly`, `lz` to the
//! light and `vx`, `vy`, `vz` to the viewer, unit vectors in the frame whose z is the normal and whose x is the tangent. Their
//! order is free, other columns are carried along, and names may be in snake_case or camelCase. Inputs are read as `f32`.

mod header;
mod row;
#[cfg(test)]
mod tests;

use std::fmt;
use std::io::{self, Write};

use csv::ByteRecord;

use self::header::Header;
use crate::disney::{Bsdf, DiffuseModel, Masking, Parameter};
use crate::math::V3;

/// Columns that are written: in the place of the file's own, or behind all others.
const RESULTS: [&str; 4] = ["fr", "fg", "fb", "pdf"];

/// How far a direction's length may be off 1; it is normalised then.
pub const LENGTH_TOLERANCE: f64 = 1e-3;

/// Why a file can't be evaluated at all.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// Nothing to read.
    #[error("{name}: the file is empty; a header with names of columns is expected")]
    Empty {
        /// The file.
        name: String,
    },
    /// The header lacks columns.
    #[error("{name}: the header lacks {}{}", missing.iter().map(Missing::to_string).collect::<Vec<_>>().join(", "), separator_hint(*separator))]
    MissingColumns {
        /// The file.
        name: String,
        /// What it lacks.
        missing: Vec<Missing>,
        /// What seems to stand between columns, if it isn't a comma.
        separator: Option<char>,
    },
    /// Two columns mean the same.
    #[error("{name}: columns {} and {} of the header, `{first}` and `{second}`, mean the same", at[0], at[1])]
    DuplicateColumn {
        /// The file.
        name: String,
        /// The one's name.
        first: String,
        /// The other's.
        second: String,
        /// Their numbers, from 1.
        at: [usize; 2],
    },
    /// The file can't be parsed.
    #[error("{name}: {cause}")]
    Csv {
        /// The file.
        name: String,
        /// The parser's reason.
        cause: csv::Error,
    },
    /// The result can't be written.
    #[error("the rows cannot be written: {0}")]
    Write(#[from] io::Error),
}

fn separator_hint(separator: Option<char>) -> String {
    separator
        .map_or_else(String::new, |c| format!("; its names seem to be separated by {c:?}, not by commas"))
}

/// A column that isn't there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missing {
    /// The column.
    pub column: &'static str,
    /// The most similar name among the columns that mean nothing.
    pub nearest: Option<String>,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}`", self.column)?;
        self.nearest.as_ref().map_or(Ok(()), |near| write!(f, " (is it `{near}`?)"))
    }
}

/// Which of the model's variants evaluates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// The roughness of G.
    pub masking: Masking,
    /// The diffuse term.
    pub diffuse: DiffuseModel,
}

/// How an evaluation went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Rows, those that failed included.
    pub rows: usize,
    /// Rows that could not be evaluated; they are written with empty results.
    pub failures: Vec<Failure>,
    /// Rows whose values were compared with given ones.
    pub compared: usize,
    /// The largest difference to a given value.
    pub worst: Option<Difference>,
}

/// A row that can't be evaluated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The line that it begins on, from 1.
    pub line: u64,
    /// Everything that is wrong with it.
    pub why: String,
}

/// A difference to a given value.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// |ours - given|/|given|; infinite if only the given value is 0.
    pub relative: f64,
    /// The row's line, from 1.
    pub line: u64,
    /// `fr`, `fg` or `fb`.
    pub column: &'static str,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} rows", self.rows)?;
        if !self.failures.is_empty() {
            write!(f, ", {} of them could not be evaluated", self.failures.len())?;
        }
        match &self.worst {
            Some(Difference { relative, line, column }) => write!(
                f,
                "; largest relative difference to the given values of {} rows: {relative:.2e} ({column}, line {line})",
                self.compared
            ),
            None => Ok(()),
        }
    }
}

/// Evaluates the rows of `bytes`, a CSV file called `name` in messages, and writes them to `out` in their order: every cell as it
/// was, `fr`, `fg`, `fb` (the BRDF without the cosine) and `pdf` (of sampling l for the viewer v, per unit solid angle) in the
/// columns of these names, or behind the others. A direction below the horizon gives 0. Numbers are the shortest that are read
/// back as the same `f32`.
///
/// # Errors
/// If the header lacks a column or `out` fails. A bad row is no error; it is in the summary.
pub fn evaluate(bytes: &[u8], name: &str, variant: Variant, out: impl Write) -> Result<Summary, EvalError> {
    let csv_error = |cause| EvalError::Csv { name: name.to_owned(), cause };
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
    let names = reader.byte_headers().map_err(csv_error)?.clone();
    let header = Header::new(&names, name)?;
    let mut writer = csv::Writer::from_writer(out);
    write_record(&mut writer, &header.with_results(&names, &RESULTS.map(str::to_owned)))?;

    let mut lines = Lines::new(bytes);
    let mut summary = Summary::default();
    let mut record = ByteRecord::new();
    while reader.read_byte_record(&mut record).map_err(csv_error)? {
        if record.iter().all(|cell| cell.trim_ascii().is_empty()) {
            continue;
        }
        let line = lines.of(record.position().map_or(0, csv::Position::byte));
        summary.rows += 1;
        let results = match evaluate_row(&header, &record, variant) {
            Ok(values) => {
                summary.compare(&header.given(&record), &values, line);
                values.map(number)
            }
            Err(why) => {
                summary.failures.push(Failure { line, why });
                RESULTS.map(|_| String::new())
            }
        };
        write_record(&mut writer, &header.with_results(&record, &results))?;
    }
    writer.flush()?;
    Ok(summary)
}

/// fr, fg, fb and pdf of a row, or what is wrong with it.
fn evaluate_row(header: &Header, record: &ByteRecord, variant: Variant) -> Result<[f32; 4], String> {
    let row = row::read(header, record)?;
    let bsdf = Bsdf::disney(&row.params, variant.masking, variant.diffuse);
    let (f, pdf) = bsdf.eval_with_pdf(row.v, row.l);
    let values = [f.r, f.g, f.b, pdf];
    if values.iter().all(|v| v.is_finite()) { Ok(values) } else { Err("the value is not finite".to_owned()) }
}

fn write_record<W: Write>(writer: &mut csv::Writer<W>, record: &ByteRecord) -> Result<(), EvalError> {
    writer.write_byte_record(record).map_err(|error| EvalError::Write(error.into()))
}

/// The shortest text that is read back as `value`.
fn number(value: f32) -> String {
    if value == 0.0 || (1e-4..1e9).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

impl Summary {
    /// Holds fr, fg and fb of a row against those that it gave.
    fn compare(&mut self, given: &[Option<f64>; 3], values: &[f32; 4], line: u64) {
        self.compared += usize::from(given.iter().any(Option::is_some));
        for (i, given) in given.iter().enumerate() {
            let Some(given) = given else { continue };
            let off = (f64::from(values[i]) - given).abs();
            let relative = if off == 0.0 { 0.0 } else { off / given.abs() };
            if self.worst.as_ref().is_none_or(|worst| relative > worst.relative) {
                self.worst = Some(Difference { relative, line, column: RESULTS[i] });
            }
        }
    }
}

/// Counts lines up to places of a text, which come in order.
#[derive(Debug)]
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1 }
    }

    /// The line, from 1, of the first character at or behind byte `at` that is no line's end: a record's position may be before
    /// the end of the line above it, and before blank lines.
    fn of(&mut self, at: u64) -> u64 {
        let at = usize::try_from(at).unwrap_or(usize::MAX);
        while let Some(&byte) = self.bytes.get(self.at) {
            if self.at >= at && !matches!(byte, b'\n' | b'\r') {
                break;
            }
            let ends = byte == b'\n' || (byte == b'\r' && self.bytes.get(self.at + 1) != Some(&b'\n'));
            self.line += u64::from(ends);
            self.at += 1;
        }
        self.line
    }
}
