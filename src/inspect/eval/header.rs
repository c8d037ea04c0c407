//! Which column of a file means what.

use csv::{ByteRecord, StringRecord};

use super::{EvalError, Missing, Parameter, RESULTS};
use crate::manifest::nearest::nearest;

/// The channels of the base colour.
pub(super) const BASE_COLOR: [&str; 3] = ["base_color_r", "base_color_g", "base_color_b"];
/// The direction to the light.
pub(super) const LIGHT: [&str; 3] = ["lx", "ly", "lz"];
/// The direction to the viewer.
pub(super) const VIEWER: [&str; 3] = ["vx", "vy", "vz"];

/// The scalars of Burley 2012, which every file has; others are at their defaults where a file doesn't have them.
const REQUIRED: [Parameter; 10] = [
    Parameter::Subsurface,
    Parameter::Metallic,
    Parameter::Specular,
    Parameter::SpecularTint,
    Parameter::Roughness,
    Parameter::Anisotropic,
    Parameter::Sheen,
    Parameter::SheenTint,
    Parameter::Clearcoat,
    Parameter::ClearcoatGloss,
];

/// Whether every file must have the parameter.
pub(super) fn is_required(parameter: Parameter) -> bool {
    REQUIRED.contains(&parameter)
}

/// A column of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Column {
    /// Its number, from 0.
    pub(super) index: usize,
    /// Its name as the file has it.
    pub(super) name: String,
}

/// Where what stands.
#[derive(Clone, Debug)]
pub(super) struct Header {
    /// The number of columns.
    pub(super) width: usize,
    pub(super) base_color: [Column; 3],
    /// In the order of [`Parameter::ALL`].
    pub(super) scalars: Vec<(Parameter, Option<Column>)>,
    pub(super) light: [Column; 3],
    pub(super) viewer: [Column; 3],
    /// In the order of [`RESULTS`].
    results: [Option<Column>; 4],
}

impl Header {
    /// Finds the columns of a file's header.
    ///
    /// # Errors
    /// If one that is needed is missing, or there twice.
    pub(super) fn new(names: &ByteRecord, file: &str) -> Result<Self, EvalError> {
        if names.iter().all(|n| n.trim_ascii().is_empty()) {
            return Err(EvalError::Empty { name: file.to_owned() });
        }
        let names = StringRecord::from_byte_record_lossy(names.clone());
        let names: Vec<&str> = names.iter().map(str::trim).collect();
        let mut search = Search { names: &names, file, known: vec![false; names.len()], missing: Vec::new() };
        let base_color = search.three(BASE_COLOR)?;
        let mut scalars = Vec::new();
        for parameter in Parameter::ALL {
            let column = search.find(parameter.name())?;
            if column.is_none() && is_required(parameter) {
                search.missing.push(parameter.name());
            }
            scalars.push((parameter, column));
        }
        let (light, viewer) = (search.three(LIGHT)?, search.three(VIEWER)?);
        let mut results = [const { None }; 4];
        for (column, name) in results.iter_mut().zip(RESULTS) {
            *column = search.find(name)?;
        }
        match (base_color, light, viewer) {
            (Some(base_color), Some(light), Some(viewer)) if search.missing.is_empty() => {
                Ok(Self { width: names.len(), base_color, scalars, light, viewer, results })
            }
            _ => Err(search.failed()),
        }
    }

    /// The record, filled up or cut to the header's columns, with `results` in their places.
    pub(super) fn with_results(&self, record: &ByteRecord, results: &[String; 4]) -> ByteRecord {
        let mut cells: Vec<&[u8]> = (0..self.width).map(|i| record.get(i).unwrap_or_default()).collect();
        // A header keeps its own spelling, a row has no name to keep.
        let is_header = results.iter().zip(RESULTS).all(|(r, name)| r == name);
        for (column, result) in self.results.iter().zip(results) {
            match column {
                Some(column) if is_header => debug_assert!(column.index < cells.len()),
                Some(column) => cells[column.index] = result.as_bytes(),
                None => cells.push(result.as_bytes()),
            }
        }
        cells.into_iter().collect()
    }

    /// The values fr, fg and fb that a row gives itself, as far as they are numbers.
    pub(super) fn given(&self, record: &ByteRecord) -> [Option<f64>; 3] {
        std::array::from_fn(|i| {
            let cell = record.get(self.results[i].as_ref()?.index)?;
            let value: f64 = std::str::from_utf8(cell).ok()?.trim().parse().ok()?;
            value.is_finite().then_some(value)
        })
    }
}

/// Looking for columns by name.
struct Search<'a> {
    names: &'a [&'a str],
    file: &'a str,
    /// Columns that were found.
    known: Vec<bool>,
    missing: Vec<&'static str>,
}

impl Search<'_> {
    /// The column called `name`, if there is one.
    fn find(&mut self, name: &str) -> Result<Option<Column>, EvalError> {
        let wanted = plain(name);
        let mut found = (0..self.names.len()).filter(|&i| plain(self.names[i]) == wanted);
        let Some(index) = found.next() else { return Ok(None) };
        if let Some(other) = found.next() {
            return Err(EvalError::DuplicateColumn {
                name: self.file.to_owned(),
                first: self.names[index].to_owned(),
                second: self.names[other].to_owned(),
                at: [index + 1, other + 1],
            });
        }
        self.known[index] = true;
        Ok(Some(Column { index, name: self.names[index].to_owned() }))
    }

    /// Three columns, all of them needed.
    fn three(&mut self, names: [&'static str; 3]) -> Result<Option<[Column; 3]>, EvalError> {
        let [x, y, z] = names.map(|name| self.find(name));
        let found = [x?, y?, z?];
        self.missing.extend(names.iter().zip(&found).filter(|(_, f)| f.is_none()).map(|(name, _)| *name));
        Ok(match found {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        })
    }

    /// What is missing, each with the most similar column that nothing is read from.
    fn failed(&self) -> EvalError {
        let unknown = || (0..self.names.len()).filter(|&i| !self.known[i]).map(|i| self.names[i]);
        let missing = self.missing.iter().map(|&column| {
            // Names of two letters are alike at once.
            let nearest = if column.len() > 2 { nearest(column, unknown()) } else { None };
            Missing { column, nearest: nearest.map(str::to_owned) }
        });
        let separator = match self.names {
            [one] => [';', '\t', '|'].into_iter().find(|&c| one.contains(c)),
            _ => None,
        };
        EvalError::MissingColumns { name: self.file.to_owned(), missing: missing.collect(), separator }
    }
}

/// A name without what tells `specular_tint` from `specularTint`.
fn plain(name: &str) -> String {
    name.chars().filter(|c| !matches!(c, '_' | '-' | ' ')).flat_map(char::to_lowercase).collect()
}
