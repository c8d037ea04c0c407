//! The geometry of a sheet: where each cell and each line of text lies, in pixels.

use super::canvas::Area;
use super::font::{Fonts, Style, Weight};
use super::sheet::{Cell, Sheet, SheetError};

/// Pixels along a side of a sheet, at most: what viewers and PNG readers take without trouble.
pub(crate) const MAX_SIDE: u64 = 32_768;

/// Pixels of a sheet, at most; one in linear light has 12 bytes each.
pub(crate) const MAX_PIXELS: u64 = 1 << 26;

/// Columns of a sheet without rows, at most; more are broken into lines of equal length.
const LONGEST_LINE: usize = 12;

/// The narrowest cell that a sheet is made smaller to by itself.
const NARROWEST: u32 = 24;

/// The size of a cell when there is no picture to tell.
const EMPTY_CELL: [u32; 2] = [240, 180];

/// Distances and sizes of text, from the width of a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Metrics {
    /// Pixels an em of labels.
    pub(crate) label: f32,
    /// Around everything.
    margin: u32,
    /// Between cells.
    gutter: u32,
    /// The frame that a mark draws; it lies in the gutter.
    pub(crate) frame: u32,
}

impl Metrics {
    fn of(cell_width: u32) -> Self {
        let label = (cell_width as f32 / 14.0).clamp(12.0, 32.0).round();
        Self {
            label,
            margin: (1.5 * label).round() as u32,
            gutter: (0.6 * label).round() as u32,
            frame: (label / 6.0).round() as u32,
        }
    }

    /// Values of axes.
    pub(crate) fn labels<'f>(&self, fonts: &'f Fonts) -> Style<'f> {
        fonts.style(Weight::Regular, self.label)
    }

    /// Names of axes, remarks and reasons.
    pub(crate) fn notes<'f>(&self, fonts: &'f Fonts) -> Style<'f> {
        fonts.style(Weight::Regular, (0.85 * self.label).round().max(11.0))
    }

    /// The sheet's title.
    pub(crate) fn titles<'f>(&self, fonts: &'f Fonts) -> Style<'f> {
        fonts.style(Weight::Medium, (1.6 * self.label).round())
    }

    /// The page's title.
    pub(crate) fn page_titles<'f>(&self, fonts: &'f Fonts) -> Style<'f> {
        fonts.style(Weight::Medium, self.label)
    }
}

/// Where everything lies.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// The whole sheet.
    pub(crate) size: [u32; 2],
    /// Distances and sizes of text.
    pub(crate) metrics: Metrics,
    /// The width that pictures are made smaller to.
    pub(crate) picture_width: u32,
    pub(crate) title: Area,
    pub(crate) subtitle: Area,
    pub(crate) page_title: Area,
    /// The name of the columns' axis.
    pub(crate) column_title: Area,
    /// The name of the rows' axis.
    pub(crate) row_title: Area,
    /// One a column.
    pub(crate) column_labels: Vec<Area>,
    /// One a row.
    pub(crate) row_labels: Vec<Area>,
    /// The cells, row by row.
    pub(crate) cells: Vec<Vec<Area>>,
    /// Rows of the remark under a cell; 0 where nothing is to be said.
    pub(crate) caption: u32,
}

impl Layout {
    /// The layout of all pages: they have the same, so that one can be laid over the other.
    pub(crate) fn of(sheet: &Sheet<'_>, fonts: &Fonts) -> Result<Self, SheetError> {
        check(sheet)?;
        let widest = pictures(sheet).map(|p| p.width()).max().unwrap_or(EMPTY_CELL[0]);
        let mut width = sheet.cell_width.unwrap_or(widest).min(widest).max(1);
        loop {
            match Self::with_cells(sheet, fonts, width) {
                // Nobody asked for this width, so a smaller one will do.
                Err(SheetError::TooLarge { .. }) if sheet.cell_width.is_none() && width > NARROWEST => {
                    width = (width - width / 8).max(NARROWEST).min(width - 1);
                }
                done => return done,
            }
        }
    }

    /// The part of a cell that a picture of that size takes: its middle.
    pub(crate) fn picture(cell: Area, [width, height]: [u32; 2]) -> Area {
        Area {
            x: cell.x + cell.width.saturating_sub(width) / 2,
            y: cell.y + cell.height.saturating_sub(height) / 2,
            width,
            height,
        }
    }

    fn with_cells(sheet: &Sheet<'_>, fonts: &Fonts, picture_width: u32) -> Result<Self, SheetError> {
        let cell = pictures(sheet)
            .map(|p| p.size_within(picture_width))
            .reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])
            .unwrap_or([picture_width, (picture_width * EMPTY_CELL[1] / EMPTY_CELL[0]).max(1)]);
        let m = Metrics::of(cell[0]);
        let columns = sheet.columns.labels.len();
        let (lines, line) = match &sheet.rows {
            Some(_) => (1, columns),
            None => {
                let lines = columns.div_ceil(LONGEST_LINE);
                (lines, columns.div_ceil(lines))
            }
        };
        let rows = sheet.rows.as_ref().map_or(1, |rows| rows.labels.len());
        let caption = if has_marks(sheet) { m.notes(fonts).line_height() + m.frame } else { 0 };
        check_size(cell, caption, [line, rows.saturating_mul(lines)])?;

        let room = Lines { sheet, fonts, m };
        let head_height = room.column_label_height();
        let row_label = room.row_label_width(cell[0]);
        let left = m.margin + if row_label > 0 { row_label + m.gutter } else { 0 };
        let grid = line as u32 * (cell[0] + m.gutter) - m.gutter;
        let width = (left + grid).max(m.margin + room.title_width()) + m.margin;
        let full = |y: u32, height: u32| Area { x: m.margin, y, width: width - 2 * m.margin, height };

        let mut y = m.margin;
        let mut next = |shown: bool, style: Style<'_>| {
            let height = if shown { style.line_height() } else { 0 };
            let area = full(y, height);
            y += if shown { height + m.gutter / 3 } else { 0 };
            area
        };
        let title = next(!sheet.title.is_empty(), m.titles(fonts));
        let subtitle = next(!sheet.subtitle.is_empty(), m.notes(fonts));
        let page_title = next(sheet.pages.iter().any(|p| !p.title.is_empty()), m.page_titles(fonts));
        if y > m.margin {
            y += m.gutter;
        }
        let note = m.notes(fonts).line_height();
        let column_title = Area { x: left, y, width: grid, height: note };
        if !sheet.columns.title.is_empty() {
            y += note + m.gutter / 4;
        }
        let label_line = m.labels(fonts).line_height();
        // The rows' name stands over their values, on the line of the columns' values.
        let row_title =
            Area { x: m.margin, y: y + label_line.saturating_sub(note), width: row_label, height: note };

        let mut column_labels = Vec::with_capacity(columns);
        let mut row_labels = Vec::with_capacity(rows);
        let mut cells = vec![Vec::with_capacity(columns); rows];
        for start in (0..columns).step_by(line) {
            let here = line.min(columns - start);
            let column = |i: usize| left + i as u32 * (cell[0] + m.gutter);
            // A label may reach into the gutter, but not up to its neighbour.
            let reach = m.gutter / 3;
            column_labels.extend((0..here).map(|i| Area {
                x: column(i) - reach,
                y,
                width: cell[0] + 2 * reach,
                height: head_height,
            }));
            y += head_height;
            for row in &mut cells {
                row.extend((0..here).map(|i| Area { x: column(i), y, width: cell[0], height: cell[1] }));
                let middle = y + (cell[1] / 2).saturating_sub(label_line / 2);
                row_labels.push(Area { x: m.margin, y: middle, width: row_label, height: label_line });
                y += cell[1] + caption + m.gutter;
            }
        }
        let height = y - m.gutter + m.margin;
        let too_large = u64::from(width) > MAX_SIDE
            || u64::from(height) > MAX_SIDE
            || u64::from(width) * u64::from(height) > MAX_PIXELS;
        if too_large {
            return Err(SheetError::TooLarge { width: width.into(), height: height.into() });
        }
        Ok(Self {
            size: [width, height],
            metrics: m,
            picture_width,
            title,
            subtitle,
            page_title,
            column_title,
            row_title,
            column_labels,
            row_labels,
            cells,
            caption,
        })
    }
}

/// The room that lines of text need.
struct Lines<'s, 'a> {
    sheet: &'s Sheet<'a>,
    fonts: &'s Fonts,
    m: Metrics,
}

impl Lines<'_, '_> {
    /// Rows over the first cell for the columns' values.
    fn column_label_height(&self) -> u32 {
        let labels = self.sheet.columns.labels.iter().any(|l| !l.is_empty());
        let row_title = self.sheet.rows.as_ref().is_some_and(|r| !r.title.is_empty());
        if labels || row_title { self.m.labels(self.fonts).line_height() + self.m.gutter / 3 } else { 0 }
    }

    /// The width of the rows' values: that of the longest, but no wider than a cell or 14 em.
    fn row_label_width(&self, cell: u32) -> u32 {
        let Some(rows) = &self.sheet.rows else { return 0 };
        let most = (cell as f32).max(14.0 * self.m.label);
        let labels = rows.labels.iter().map(|label| self.m.labels(self.fonts).width(label));
        let title = self.m.notes(self.fonts).width(&rows.title);
        labels.fold(title, f32::max).min(most).ceil() as u32
    }

    /// The width that the title asks for: its own, up to 40 em.
    fn title_width(&self) -> u32 {
        let title = self.m.titles(self.fonts).width(&self.sheet.title);
        let subtitle = self.m.notes(self.fonts).width(&self.sheet.subtitle);
        title.max(subtitle).min(40.0 * self.m.label).ceil() as u32
    }
}

fn pictures<'s, 'a>(sheet: &'s Sheet<'a>) -> impl Iterator<Item = &'s super::Picture<'a>> {
    sheet.pages.iter().flat_map(|p| p.cells.iter().flatten()).filter_map(|cell| match cell {
        Cell::Picture { picture, .. } => Some(picture),
        Cell::Failed { .. } | Cell::Missing => None,
    })
}

fn has_marks(sheet: &Sheet<'_>) -> bool {
    let marked = |cell: &Cell<'_>| matches!(cell, Cell::Picture { mark: Some(_), .. });
    sheet.pages.iter().flat_map(|p| p.cells.iter().flatten()).any(marked)
}

/// Whether the cells are as many as the headings say.
fn check(sheet: &Sheet<'_>) -> Result<(), SheetError> {
    let columns = sheet.columns.labels.len();
    let rows = sheet.rows.as_ref().map_or(1, |rows| rows.labels.len());
    if sheet.pages.is_empty() || columns == 0 || rows == 0 {
        return Err(SheetError::Empty);
    }
    for (page, content) in sheet.pages.iter().enumerate() {
        let ragged = |found, expected| Err(SheetError::Ragged { page, found, expected });
        if content.cells.len() != rows {
            return ragged(content.cells.len(), rows);
        }
        if let Some(row) = content.cells.iter().find(|row| row.len() != columns) {
            return ragged(row.len(), columns);
        }
    }
    Ok(())
}

/// Whether the cells alone are within the limits; what follows may then count in 32 bits.
fn check_size(cell: [u32; 2], caption: u32, [columns, rows]: [usize; 2]) -> Result<(), SheetError> {
    let width = u64::from(cell[0]).saturating_mul(columns as u64);
    let height = (u64::from(cell[1]) + u64::from(caption)).saturating_mul(rows as u64);
    // Neither may one side be out of bounds, nor the gutters of very many small cells.
    let bounded =
        width <= MAX_SIDE && height <= MAX_SIDE && columns as u64 <= MAX_SIDE && rows as u64 <= MAX_SIDE;
    if bounded { Ok(()) } else { Err(SheetError::TooLarge { width, height }) }
}
