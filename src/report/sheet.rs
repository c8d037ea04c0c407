//! What stands where on a contact sheet.

use std::collections::BTreeMap;

use super::font::FontError;
use super::picture::Picture;
use crate::record::{Job, JobRecord, Outcome, Verdict};

/// Cells of a sheet, all pages together, at most.
const MAX_CELLS: usize = 1 << 18;

/// A contact sheet: a grid of pictures under their axes' values, on one page or more.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// The title, such as the sweep's name; may be empty.
    pub title: String,
    /// A line under the title, such as the scene and the samples; may be empty.
    pub subtitle: String,
    /// The columns.
    pub columns: Heading,
    /// The rows. Without them the columns are broken into several lines where they are many.
    pub rows: Option<Heading>,
    /// The pages: at least one.
    pub pages: Vec<Page<'a>>,
    /// The columns of pixels that a picture may have, larger ones being averaged down. The pictures' own size where absent, or
    /// smaller where the sheet would be too large otherwise.
    pub cell_width: Option<u32>,
}

/// An axis of the sheet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// The axis' name; may be empty.
    pub title: String,
    /// Its values, in order.
    pub labels: Vec<String>,
}

/// One page.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// The values of the axes that are neither rows nor columns; empty where there are none.
    pub title: String,
    /// The cells, row by row. Each row has as many as there are columns.
    pub cells: Vec<Vec<Cell<'a>>>,
}

/// One place of the grid.
#[derive(Clone, Debug)]
pub enum Cell<'a> {
    /// A job's picture.
    Picture {
        /// The pixels.
        picture: Picture<'a>,
        /// What is to be said about it.
        mark: Option<Mark>,
    },
    /// A job that failed.
    Failed {
        /// The error, as long as it may be.
        why: String,
    },
    /// No job, or one that has not been done.
    Missing,
}

/// A remark under a picture, with a frame around it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    /// How bad it is.
    pub level: Level,
    /// The remark: a few words.
    pub text: String,
}

/// How bad something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// To be looked at: amber.
    Doubt,
    /// Wrong: red.
    Bad,
}

impl Mark {
    /// What a verdict has to say on a sheet: nothing where it passes.
    pub fn of(verdict: &Verdict) -> Option<Self> {
        let (level, text) = match verdict {
            Verdict::Same | Verdict::Within { .. } | Verdict::NotCompared => return None,
            Verdict::Differs { max_error, .. } => (Level::Bad, format!("differs, max {max_error:.3}")),
            Verdict::Shape { .. } => (Level::Bad, "shape differs".to_owned()),
            Verdict::MissingReference { .. } => (Level::Doubt, "no reference".to_owned()),
            Verdict::Error { .. } => (Level::Bad, "not comparable".to_owned()),
        };
        Some(Self { level, text })
    }
}

impl<'a> Cell<'a> {
    /// The cell of a job: its picture with its verdict's mark, or why it failed, or missing where there is no picture.
    pub fn of(record: &JobRecord, picture: Option<Picture<'a>>) -> Self {
        match (&record.outcome, picture) {
            (Outcome::Failed { error }, _) => Self::Failed { why: error.clone() },
            (Outcome::Done, Some(picture)) => Self::Picture { picture, mark: Mark::of(&record.verdict) },
            (Outcome::Done, None) => Self::Missing,
        }
    }
}

/// Why a sheet cannot be arranged or drawn.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// Nothing to show.
    #[error("a sheet needs at least one job")]
    Empty,
    /// The plan names an axis that no job has.
    #[error("[sheet] {side} = {axis:?}: the sweep has no such axis; it has {}", listed(known))]
    UnknownAxis {
        /// `columns` or `rows`.
        side: &'static str,
        /// The name given.
        axis: String,
        /// The axes there are.
        known: Vec<String>,
    },
    /// Rows and columns are the same axis.
    #[error("[sheet] columns and rows are both {axis:?}; name two axes, or leave one out")]
    SameAxis {
        /// The axis.
        axis: String,
    },
    /// A job has no place on an axis that another job has.
    #[error("job {job:?} has no value on the axis {axis:?}, which other jobs of the sheet have")]
    NoCoordinate {
        /// The job.
        job: String,
        /// The axis.
        axis: String,
    },
    /// A job has a place on an axis that the first job doesn't have.
    #[error("job {job:?} has a value on the axis {axis:?}, which other jobs of the sheet do not have")]
    OtherAxis {
        /// The job.
        job: String,
        /// The axis.
        axis: String,
    },
    /// Two jobs have the same value on every axis.
    #[error("jobs {first:?} and {second:?} have the same place on the sheet")]
    SamePlace {
        /// One.
        first: String,
        /// The other.
        second: String,
    },
    /// The grid is too large to be looked at.
    #[error("the sheet would have {cells} cells; at most {MAX_CELLS} are drawn")]
    TooManyCells {
        /// Cells of all pages.
        cells: usize,
    },
    /// The picture would be too large.
    #[error(
        "the sheet would have {width} × {height} pixels, the limit being {} a side and {} in all; \
             give [sheet] a smaller cell_width",
        super::layout::MAX_SIDE,
        super::layout::MAX_PIXELS
    )]
    TooLarge {
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// A page's cells are not as many as its headings say.
    #[error("page {page} of the sheet has {found} cells where its headings ask for {expected}")]
    Ragged {
        /// The page, from 0.
        page: usize,
        /// Cells in a row, or rows.
        found: usize,
        /// As many as there should be.
        expected: usize,
    },
    /// There is no such page.
    #[error("the sheet has no page {page}; it has {pages}")]
    NoPage {
        /// The page asked for, from 0.
        page: usize,
        /// How many there are.
        pages: usize,
    },
    /// A layer cannot be shown.
    #[error("layer {layer:?} cannot be shown: {why}")]
    NotAPicture {
        /// Its name.
        layer: String,
        /// What is missing.
        why: &'static str,
    },
    /// The labels cannot be written.
    #[error(transparent)]
    Font(#[from] FontError),
}

fn listed(axes: &[String]) -> String {
    if axes.is_empty() { "none".to_owned() } else { axes.join(", ") }
}

/// A job with its cell.
#[derive(Clone, Debug)]
pub struct Entry<'a> {
    /// The job, for its coordinates.
    pub job: &'a Job,
    /// What is shown in its place.
    pub cell: Cell<'a>,
}

/// What a manifest says about the sheet.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// The title.
    pub title: String,
    /// The line under it.
    pub subtitle: String,
    /// The axis of the columns; the last of those left where absent.
    pub columns: Option<String>,
    /// The axis of the rows; the last of those left where absent.
    pub rows: Option<String>,
    /// As [`Sheet::cell_width`].
    pub cell_width: Option<u32>,
}

/// Puts every job in its place: columns and rows as the plan says, the other axes as pages, in the order of their values. A
/// place without a job is missing. Jobs without axes stand side by side under their names.
///
/// # Errors
/// If there are no jobs, the plan names an axis they don't have, or two jobs have the same place.
pub fn arrange<'a>(entries: Vec<Entry<'a>>, plan: &Plan) -> Result<Sheet<'a>, SheetError> {
    let first = entries.first().ok_or(SheetError::Empty)?;
    let axes: Vec<String> = first.job.coordinates.iter().map(|c| c.axis.clone()).collect();
    let Sides { columns, rows } = Sides::choose(&axes, plan)?;
    let others: Vec<usize> = (0..axes.len()).filter(|&a| Some(a) != columns && Some(a) != rows).collect();

    let mut placed: BTreeMap<Place, (&str, Cell<'a>)> = BTreeMap::new();
    let mut labels: Vec<BTreeMap<usize, String>> = vec![BTreeMap::new(); axes.len()];
    let mut names = BTreeMap::new();
    let mut page_titles: BTreeMap<Vec<usize>, String> = BTreeMap::new();
    for (number, Entry { job, cell }) in entries.into_iter().enumerate() {
        let spots = spots(job, &axes)?;
        for (known, (index, label)) in labels.iter_mut().zip(&spots) {
            known.entry(*index).or_insert_with(|| (*label).to_owned());
        }
        let page: Vec<usize> = others.iter().map(|&a| spots[a].0).collect();
        page_titles.entry(page.clone()).or_insert_with(|| {
            let values: Vec<String> =
                others.iter().map(|&a| format!("{} = {}", axes[a], spots[a].1)).collect();
            values.join(",  ")
        });
        // Jobs without axes stand side by side, each under its name.
        let column = match columns {
            Some(axis) => spots[axis].0,
            None if axes.is_empty() => number,
            None => 0,
        };
        if axes.is_empty() {
            names.insert(number, job.name.clone());
        }
        let place = Place { page, row: rows.map_or(0, |a| spots[a].0), column };
        if let Some((other, _)) = placed.get(&place) {
            return Err(SheetError::SamePlace { first: (*other).to_owned(), second: job.name.clone() });
        }
        placed.insert(place, (&job.name, cell));
    }

    let heading = |axis: usize| (axes[axis].clone(), labels[axis].clone());
    let (column_title, column_labels) = match columns {
        Some(axis) => heading(axis),
        None if axes.is_empty() => (String::new(), names),
        None => (String::new(), BTreeMap::from([(0, String::new())])),
    };
    let row_heading = rows.map(heading);
    let row_indices: Vec<usize> =
        row_heading.as_ref().map_or(vec![0], |(_, labels)| labels.keys().copied().collect());
    let column_indices: Vec<usize> = column_labels.keys().copied().collect();
    let cells = column_indices.len().saturating_mul(row_indices.len()).saturating_mul(page_titles.len());
    if cells > MAX_CELLS {
        return Err(SheetError::TooManyCells { cells });
    }
    let mut take = |page: &[usize], row: usize, column: usize| {
        let place = Place { page: page.to_vec(), row, column };
        placed.remove(&place).map_or(Cell::Missing, |(_, cell)| cell)
    };
    let pages = page_titles
        .iter()
        .map(|(page, title)| Page {
            title: title.clone(),
            cells: row_indices
                .iter()
                .map(|&row| column_indices.iter().map(|&column| take(page, row, column)).collect())
                .collect(),
        })
        .collect();
    Ok(Sheet {
        title: plan.title.clone(),
        subtitle: plan.subtitle.clone(),
        columns: Heading { title: column_title, labels: column_labels.into_values().collect() },
        rows: row_heading.map(|(title, labels)| Heading { title, labels: labels.into_values().collect() }),
        pages,
        cell_width: plan.cell_width,
    })
}

/// A cell's place by the indices of its values.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    page: Vec<usize>,
    row: usize,
    column: usize,
}

/// Which axis lies where, by their numbers.
struct Sides {
    columns: Option<usize>,
    rows: Option<usize>,
}

impl Sides {
    fn choose(axes: &[String], plan: &Plan) -> Result<Self, SheetError> {
        let find = |side, name: &Option<String>| match name {
            None => Ok(None),
            Some(name) => axes
                .iter()
                .position(|axis| axis == name)
                .or_else(|| axes.iter().position(|axis| is_part(axis, name)))
                .map(Some)
                .ok_or_else(|| SheetError::UnknownAxis { side, axis: name.clone(), known: axes.to_vec() }),
        };
        let (columns, rows) = (find("columns", &plan.columns)?, find("rows", &plan.rows)?);
        if let (Some(c), Some(r)) = (columns, rows)
            && c == r
        {
            return Err(SheetError::SameAxis { axis: axes[c].clone() });
        }
        let last_but = |taken: Option<usize>| (0..axes.len()).rev().find(|&a| Some(a) != taken);
        let columns = columns.or_else(|| last_but(rows));
        // Where the only axis is the rows' there are no columns but one.
        let rows = rows.or_else(|| columns.and_then(|c| last_but(Some(c))));
        Ok(Self { columns, rows })
    }
}

/// Whether `name` is one of the paths of a zipped axis, as in `material.a.roughness + material.b.roughness`.
fn is_part(axis: &str, name: &str) -> bool {
    axis.split(" + ").any(|part| part == name)
}

/// A job's index and label on each axis.
fn spots<'j>(job: &'j Job, axes: &[String]) -> Result<Vec<(usize, &'j str)>, SheetError> {
    let no_coordinate =
        |axis: &str| SheetError::NoCoordinate { job: job.name.clone(), axis: axis.to_owned() };
    let spot =
        |axis: &String| job.coordinates.iter().find(|c| c.axis == *axis).map(|c| (c.index, c.label.as_str()));
    if let Some(other) = job.coordinates.iter().find(|c| !axes.contains(&c.axis)) {
        return Err(SheetError::OtherAxis { job: job.name.clone(), axis: other.axis.clone() });
    }
    axes.iter().map(|axis| spot(axis).ok_or_else(|| no_coordinate(axis))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::samples::{job, record};

    const ROUGH: &str = "material.ball.roughness";
    const COLOR: &str = "material.ball.base_color";
    const SEED: &str = "render.seed";

    /// Each cell as the text of its failure, which is the job's name; `-` where it is missing.
    fn names(page: &Page<'_>) -> Vec<Vec<String>> {
        let name = |cell: &Cell<'_>| match cell {
            Cell::Failed { why } => why.clone(),
            _ => "-".to_owned(),
        };
        page.cells.iter().map(|row| row.iter().map(name).collect()).collect()
    }

    fn entries(jobs: &[Job]) -> Vec<Entry<'static>> {
        let leaked = jobs.to_vec().leak();
        leaked.iter().map(|job| Entry { job, cell: Cell::Failed { why: job.name.clone() } }).collect()
    }

    #[test]
    fn one_axis_makes_one_row_in_the_order_of_its_values() {
        let jobs =
            [job("b", &[(ROUGH, 1, "0.5")]), job("c", &[(ROUGH, 7, "1.0")]), job("a", &[(ROUGH, 0, "0.0")])];
        let sheet = arrange(entries(&jobs), &Plan::default()).unwrap();
        assert_eq!(
            sheet.columns,
            Heading { title: ROUGH.into(), labels: vec!["0.0".into(), "0.5".into(), "1.0".into()] }
        );
        assert_eq!(sheet.rows, None);
        assert_eq!(names(&sheet.pages[0]), [["a", "b", "c"]]);
    }

    #[test]
    fn two_axes_make_a_grid_and_excluded_places_are_missing() {
        let jobs = [
            job("r0", &[(ROUGH, 0, "0.0"), (COLOR, 0, "copper")]),
            job("r1", &[(ROUGH, 1, "1.0"), (COLOR, 0, "copper")]),
            job("s1", &[(ROUGH, 1, "1.0"), (COLOR, 1, "steel")]),
        ];
        let plan = Plan { columns: Some(ROUGH.into()), ..Plan::default() };
        let sheet = arrange(entries(&jobs), &plan).unwrap();
        assert_eq!(sheet.rows.as_ref().unwrap().labels, ["copper", "steel"]);
        assert_eq!(names(&sheet.pages[0]), [["r0", "r1"], ["-", "s1"]]);
        let turned = arrange(entries(&jobs), &Plan { rows: Some(ROUGH.into()), ..Plan::default() }).unwrap();
        assert_eq!(names(&turned.pages[0]), [["r0", "-"], ["r1", "s1"]]);
    }

    #[test]
    fn further_axes_are_pages_named_by_their_values() {
        let mut jobs = Vec::new();
        for (s, r, c) in (0..3).flat_map(|s| (0..2).flat_map(move |r| (0..2).map(move |c| (s, r, c)))) {
            let seed = s.to_string();
            jobs.push(job(&format!("{s}{r}{c}"), &[(SEED, s, &seed), (ROUGH, r, "r"), (COLOR, c, "c")]));
        }
        let plan = Plan { columns: Some(ROUGH.into()), ..Plan::default() };
        let sheet = arrange(entries(&jobs), &plan).unwrap();
        let titles: Vec<_> = sheet.pages.iter().map(|p| p.title.as_str()).collect();
        assert_eq!(titles, ["render.seed = 0", "render.seed = 1", "render.seed = 2"]);
        assert_eq!(names(&sheet.pages[2]), [["200", "210"], ["201", "211"]]);
    }

    #[test]
    fn a_zipped_axis_is_found_by_any_of_its_paths() {
        let jobs = [job("a", &[("material.a.roughness + material.b.roughness", 0, "x"), (SEED, 0, "0")])];
        let plan = Plan { rows: Some("material.b.roughness".into()), ..Plan::default() };
        assert_eq!(arrange(entries(&jobs), &plan).unwrap().columns.title, SEED);
    }

    #[test]
    fn jobs_without_axes_and_a_lone_axis_of_rows_have_their_places() {
        let sheet = arrange(entries(&[job("x", &[]), job("y", &[])]), &Plan::default()).unwrap();
        assert_eq!(sheet.columns.labels, ["x", "y"]);
        assert_eq!(names(&sheet.pages[0]), [["x", "y"]]);
        let jobs = [job("a", &[(ROUGH, 0, "0")]), job("b", &[(ROUGH, 1, "1")])];
        let upright = arrange(entries(&jobs), &Plan { rows: Some(ROUGH.into()), ..Plan::default() }).unwrap();
        assert_eq!(names(&upright.pages[0]), [["a"], ["b"]]);
    }

    #[test]
    fn what_cannot_be_arranged_is_an_error_that_says_why() {
        assert!(matches!(arrange(Vec::new(), &Plan::default()), Err(SheetError::Empty)));
        let two = [job("a", &[(ROUGH, 0, "0")]), job("b", &[(ROUGH, 0, "0")])];
        let same = arrange(entries(&two), &Plan::default()).unwrap_err();
        assert_eq!(same.to_string(), "jobs \"a\" and \"b\" have the same place on the sheet");
        let unknown = Plan { columns: Some("roughnes".into()), ..Plan::default() };
        let error = arrange(entries(&two[..1]), &unknown).unwrap_err().to_string();
        assert!(error.contains("roughnes") && error.ends_with(ROUGH), "{error}");
        let both = Plan { columns: Some(ROUGH.into()), rows: Some(ROUGH.into()), ..Plan::default() };
        assert!(matches!(arrange(entries(&two[..1]), &both), Err(SheetError::SameAxis { .. })));
        let torn = [job("a", &[(ROUGH, 0, "0")]), job("b", &[])];
        assert!(matches!(arrange(entries(&torn), &Plan::default()), Err(SheetError::NoCoordinate { .. })));
        let torn = [job("b", &[]), job("a", &[(ROUGH, 0, "0")])];
        assert!(matches!(arrange(entries(&torn), &Plan::default()), Err(SheetError::OtherAxis { .. })));
    }

    #[test]
    fn a_sparse_diagonal_does_not_fill_the_memory() {
        let far = usize::MAX;
        let jobs = [
            job("a", &[(ROUGH, 0, "0"), (COLOR, 0, "0")]),
            job("b", &[(ROUGH, far, "1"), (COLOR, far, "1")]),
        ];
        assert_eq!(
            names(&arrange(entries(&jobs), &Plan::default()).unwrap().pages[0]),
            [["a", "-"], ["-", "b"]]
        );
        let diagonal: Vec<Job> =
            (0..600).map(|i| job(&i.to_string(), &[(ROUGH, i, ""), (COLOR, i, "")])).collect();
        assert!(matches!(
            arrange(entries(&diagonal), &Plan::default()),
            Err(SheetError::TooManyCells { cells: 360_000 })
        ));
    }

    #[test]
    fn records_become_cells_with_the_mark_of_their_verdict() {
        let failed = record("a", Outcome::Failed { error: "no".into() }, Verdict::NotCompared);
        assert!(matches!(Cell::of(&failed, None), Cell::Failed { why } if why == "no"));
        assert!(matches!(Cell::of(&record("a", Outcome::Done, Verdict::Same), None), Cell::Missing));
        let differs = Verdict::Differs { max_error: 0.5, mean_error: 0.1, why: String::new() };
        assert_eq!(Mark::of(&differs), Some(Mark { level: Level::Bad, text: "differs, max 0.500".into() }));
        assert_eq!(Mark::of(&Verdict::MissingReference { path: String::new() }).unwrap().level, Level::Doubt);
        assert_eq!(Mark::of(&Verdict::Within { max_error: 0.1, mean_error: 0.1 }), None);
    }
}
