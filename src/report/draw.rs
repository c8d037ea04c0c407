//! Sheets as pixels.

use super::canvas::{Align, Area, Canvas, Ink, Pixel};
use super::font::Fonts;
use super::layout::Layout;
use super::picture::Picture;
use super::sheet::{Cell, Level, Mark, Sheet, SheetError};
use crate::output::tone::tone_map;
use crate::raster::{Layer, Raster, Window};
use crate::settings::Display;

/// Behind everything: a dark neutral grey (sRGB 48), which leaves the eye's judgement of colour and contrast alone.
const BACKGROUND: Ink = [0.03; 3];
/// Behind a picture smaller than its cell, and under cells without one.
const WELL: Ink = [0.017; 3];
const STRIPES: Ink = [0.03; 3];
const TITLE: Ink = [0.86; 3];
const LABEL: Ink = [0.62; 3];
const NOTE: Ink = [0.27; 3];
const RED: Ink = [0.62, 0.045, 0.035];
const RED_WELL: Ink = [0.03, 0.012, 0.011];
const AMBER: Ink = [0.75, 0.33, 0.03];

/// A page (from 0) for the eye: columns, rows and 8-bit sRGB codes, R, G, B for each pixel, row by row. The pictures go through
/// `display`; text and frames do not.
///
/// A sheet has at most 32,768 pixels a side and 2²⁶ in all. Where it would have more and [`Sheet::cell_width`] is not given,
/// its cells are made smaller.
///
/// # Errors
/// If there is no such page, the cells are not as many as the headings say, or the sheet would be too large.
pub fn draw_png(sheet: &Sheet<'_>, page: usize, display: &Display) -> Result<(u32, u32, Vec<u8>), SheetError> {
    let (layout, canvas) = draw::<[u8; 3]>(sheet, page, |light| tone_map(light.into(), display))?;
    let [width, height] = layout.size;
    Ok((width, height, canvas.into_pixels().into_flattened()))
}

/// A page (from 0) in linear light, one layer `beauty` with R, G and B: as [`draw_png`]'s, with the pictures' values bit for bit
/// where they are not made smaller. Text and frames are greys and colours up to 1.
///
/// # Errors
/// As [`draw_png`].
pub fn draw_linear(sheet: &Sheet<'_>, page: usize) -> Result<Raster, SheetError> {
    let (layout, canvas) = draw::<[f32; 3]>(sheet, page, |light| light)?;
    let pixels = canvas.into_pixels();
    let plane = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    let [width, height] = layout.size;
    let layer = Layer::new("beauty", Window::sized(width, height))
        .with("R", plane(0))
        .with("G", plane(1))
        .with("B", plane(2));
    Ok(Raster::single(layer))
}

/// Where the picture of a cell lies on its page; none where the cell has no picture or does not exist.
///
/// # Errors
/// As [`draw_png`].
pub fn picture_area(
    sheet: &Sheet<'_>,
    page: usize,
    row: usize,
    column: usize,
) -> Result<Option<Area>, SheetError> {
    let layout = Layout::of(sheet, &Fonts::load()?)?;
    let cell = sheet.pages.get(page).and_then(|p| p.cells.get(row)).and_then(|row| row.get(column));
    Ok(match cell {
        Some(Cell::Picture { picture, .. }) => {
            let size = picture.size_within(layout.picture_width);
            Some(Layout::picture(layout.cells[row][column], size))
        }
        _ => None,
    })
}

fn draw<P: Pixel>(
    sheet: &Sheet<'_>,
    page: usize,
    pixel: impl Fn([f32; 3]) -> P,
) -> Result<(Layout, Canvas<P>), SheetError> {
    let fonts = Fonts::load()?;
    let layout = Layout::of(sheet, &fonts)?;
    let pages = sheet.pages.len();
    let content = sheet.pages.get(page).ok_or(SheetError::NoPage { page, pages })?;
    let mut painter = Painter {
        canvas: Canvas::new(layout.size[0], layout.size[1], BACKGROUND),
        layout: &layout,
        fonts: &fonts,
        pixel,
    };
    painter.headings(sheet, page);
    for (areas, cells) in layout.cells.iter().zip(&content.cells) {
        for (&area, cell) in areas.iter().zip(cells) {
            painter.cell(area, cell);
        }
    }
    let canvas = painter.canvas;
    Ok((layout, canvas))
}

/// A canvas and what is needed to draw on it.
struct Painter<'s, P, F> {
    canvas: Canvas<P>,
    layout: &'s Layout,
    fonts: &'s Fonts,
    pixel: F,
}

impl<P: Pixel, F: Fn([f32; 3]) -> P> Painter<'_, P, F> {
    fn headings(&mut self, sheet: &Sheet<'_>, page: usize) {
        let (layout, m, fonts) = (self.layout, self.layout.metrics, self.fonts);
        self.canvas.text(&sheet.title, layout.title, Align::Left, m.titles(fonts), TITLE);
        self.canvas.text(&sheet.subtitle, layout.subtitle, Align::Left, m.notes(fonts), NOTE);
        let title = &sheet.pages[page].title;
        self.canvas.text(title, layout.page_title, Align::Left, m.page_titles(fonts), LABEL);
        self.canvas.text(&sheet.columns.title, layout.column_title, Align::Centre, m.notes(fonts), NOTE);
        for (label, &area) in sheet.columns.labels.iter().zip(&layout.column_labels) {
            self.canvas.text(label, area, Align::Centre, m.labels(fonts), LABEL);
        }
        if let Some(rows) = &sheet.rows {
            self.canvas.text(&rows.title, layout.row_title, Align::Right, m.notes(fonts), NOTE);
            for (label, &area) in rows.labels.iter().zip(&layout.row_labels) {
                self.canvas.text(label, area, Align::Right, m.labels(fonts), LABEL);
            }
        }
    }

    fn cell(&mut self, area: Area, cell: &Cell<'_>) {
        match cell {
            Cell::Picture { picture, mark } => {
                self.picture(area, picture);
                if let Some(mark) = mark {
                    self.mark(area, mark);
                }
            }
            Cell::Failed { why } => self.failed(area, why),
            Cell::Missing => self.missing(area),
        }
    }

    fn picture(&mut self, area: Area, picture: &Picture<'_>) {
        self.canvas.fill(area, WELL);
        let shown = picture.shrunk(self.layout.picture_width);
        let place = Layout::picture(area, [shown.width(), shown.height()]);
        let pixel = &self.pixel;
        self.canvas.each(place, |x, y, p| *p = pixel(shown.pixel(x - place.x, y - place.y)));
    }

    fn mark(&mut self, area: Area, mark: &Mark) {
        let m = self.layout.metrics;
        let ink = match mark.level {
            Level::Bad => RED,
            Level::Doubt => AMBER,
        };
        // The frame lies in the gutter: the picture keeps every pixel.
        self.canvas.frame(area, m.frame, ink);
        let below = Area { y: area.y + area.height + m.frame, height: self.layout.caption, ..area };
        self.canvas.text(&mark.text, below, Align::Centre, m.notes(self.fonts), ink);
    }

    fn failed(&mut self, area: Area, why: &str) {
        let m = self.layout.metrics;
        self.canvas.fill(area, RED_WELL);
        self.canvas.frame(area, m.frame.div_ceil(2), RED);
        let style = m.notes(self.fonts);
        let (line, pad) = (style.line_height(), m.label as u32 / 2);
        let inner = area.shrunk(pad);
        let side = (area.height / 5).min(area.width / 3).min(48);
        let room = inner.height.saturating_sub(side + pad) / line;
        let lines = style.wrapped(why, inner.width as f32, room.min(6) as usize);
        let block = side + if lines.is_empty() { 0 } else { pad + lines.len() as u32 * line };
        let mut y = area.y + area.height.saturating_sub(block) / 2;
        let cross = Area { x: area.x + (area.width - side) / 2, y, width: side, height: side };
        self.canvas.cross(cross, (side as f32 / 7.0).max(2.0), RED);
        y += side + pad;
        for text in &lines {
            let place = Area { y, height: line, ..inner };
            self.canvas.text(text, place, Align::Centre, style, LABEL);
            y += line;
        }
    }

    fn missing(&mut self, area: Area) {
        let m = self.layout.metrics;
        self.canvas.fill(area, WELL);
        self.canvas.hatch(area, (m.label * 0.75) as u32, STRIPES);
        let style = m.notes(self.fonts);
        let (height, width) = (style.line_height(), style.width("missing").ceil() as u32 + m.label as u32);
        if width <= area.width && height <= area.height {
            let plate = Layout::picture(area, [width, height]);
            self.canvas.fill(plate, WELL);
            self.canvas.text("missing", plate, Align::Centre, style, NOTE);
        }
    }
}
