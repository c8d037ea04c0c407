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
const NOTE: Ink = [0.33; 3];
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
pub fn draw_png(
    sheet: &Sheet<'_>,
    page: usize,
    display: &Display,
) -> Result<(u32, u32, Vec<u8>), SheetError> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sheet::{Heading, Page};
    use crate::settings::ToneCurve;

    fn layer(width: u32, height: u32, seed: u32) -> Layer {
        let plane =
            |c: u32| (0..width * height).map(|i| ((i * 37 + c * 11 + seed) % 101) as f32 / 40.0).collect();
        Layer::new("beauty", Window::sized(width, height))
            .with("R", plane(0))
            .with("G", plane(1))
            .with("B", plane(2))
    }

    fn shown(layer: &Layer) -> Cell<'_> {
        Cell::Picture { picture: Picture::of(layer).unwrap(), mark: None }
    }

    fn labels(count: usize) -> Vec<String> {
        (0..count).map(|i| format!("{:.2}", i as f32 / 10.0)).collect()
    }

    fn sheet<'a>(rows: Option<usize>, cells: Vec<Vec<Cell<'a>>>) -> Sheet<'a> {
        Sheet {
            title: "roughness".into(),
            subtitle: "64 spp".into(),
            columns: Heading { title: "material.ball.roughness".into(), labels: labels(cells[0].len()) },
            rows: rows.map(|n| Heading { title: "metal".into(), labels: labels(n) }),
            pages: vec![Page { title: String::new(), cells }],
            cell_width: None,
        }
    }

    fn area(sheet: &Sheet<'_>, row: usize, column: usize) -> Area {
        picture_area(sheet, 0, row, column).unwrap().unwrap()
    }

    /// How many pixels of an area are not the background.
    fn drawn(raster: &Raster, area: Area) -> usize {
        let layer = raster.picture();
        let red = &layer.channel("R").unwrap().values;
        (area.y..area.y + area.height)
            .flat_map(|y| (area.x..area.x + area.width).map(move |x| (x, y)))
            .filter(|&(x, y)| red[layer.window.index_of(x as i32, y as i32).unwrap()] != BACKGROUND[0])
            .count()
    }

    #[test]
    fn pictures_keep_their_bits_in_linear_light() {
        let mut first = layer(40, 30, 1);
        first.channels[0].values[7] = f32::NAN;
        first.channels[1].values[8] = -3.5;
        first.channels[2].values[9] = 1e30;
        let second = layer(40, 30, 2);
        let sheet =
            sheet(Some(2), vec![vec![shown(&first), Cell::Missing], vec![Cell::Missing, shown(&second)]]);
        let raster = draw_linear(&sheet, 0).unwrap();
        for (layer, row, column) in [(&first, 0, 0), (&second, 1, 1)] {
            let place = area(&sheet, row, column);
            assert_eq!((place.width, place.height), (40, 30));
            for (c, name) in ["R", "G", "B"].iter().enumerate() {
                let values = &raster.picture().channel(name).unwrap().values;
                for (i, value) in layer.channels[c].values.iter().enumerate() {
                    let (x, y) = (place.x as usize + i % 40, place.y as usize + i / 40);
                    let there = values[y * raster.display.width as usize + x];
                    assert_eq!(there.to_bits(), value.to_bits(), "{name} {i}");
                }
            }
        }
        assert_eq!(picture_area(&sheet, 0, 0, 1).unwrap(), None);
        assert_eq!(picture_area(&sheet, 0, 5, 5).unwrap(), None);
    }

    #[test]
    fn the_png_shows_the_same_pictures_through_the_curve() {
        let picture = layer(40, 30, 5);
        let sheet = sheet(None, vec![vec![shown(&picture)]]);
        for tone in [ToneCurve::Srgb, ToneCurve::Neutral, ToneCurve::Agx] {
            let display = Display { tone, exposure: -0.5 };
            let (width, height, codes) = draw_png(&sheet, 0, &display).unwrap();
            assert_eq!(codes.len(), 3 * (width * height) as usize);
            let place = area(&sheet, 0, 0);
            for (dx, dy) in [(0, 0), (39, 0), (0, 29), (39, 29), (20, 11)] {
                let at = 3 * ((place.y + dy) * width + place.x + dx) as usize;
                let light = Picture::of(&picture).unwrap().pixel(dx, dy);
                assert_eq!(codes[at..at + 3], tone_map(light.into(), &display));
            }
            // The background is no part of the picture: exposure and curve leave it alone.
            assert_eq!(codes[..3], [48; 3]);
        }
    }

    #[test]
    fn titles_and_labels_have_ink_and_margins_have_none() {
        let picture = layer(120, 90, 0);
        let sheet = sheet(Some(1), vec![vec![shown(&picture), shown(&picture)]]);
        let layout = Layout::of(&sheet, &Fonts::load().unwrap()).unwrap();
        let raster = draw_linear(&sheet, 0).unwrap();
        let texts = [layout.title, layout.subtitle, layout.column_title, layout.row_title];
        for text in texts.iter().chain(&layout.column_labels).chain(&layout.row_labels) {
            assert!(drawn(&raster, *text) > 15, "{text:?}");
        }
        let [width, height] = layout.size;
        let margin = layout.title.x;
        for edge in [
            Area { x: 0, y: 0, width, height: margin },
            Area { x: 0, y: height - margin, width, height: margin },
            Area { x: 0, y: 0, width: margin, height },
            Area { x: width - margin, y: 0, width: margin, height },
        ] {
            assert_eq!(drawn(&raster, edge), 0, "{edge:?}");
        }
    }

    #[test]
    fn failed_missing_and_marked_cells_look_different() {
        let picture = layer(120, 90, 0);
        let bad = Mark { level: Level::Bad, text: "differs".into() };
        let marked = Cell::Picture { picture: Picture::of(&picture).unwrap(), mark: Some(bad) };
        let failed = Cell::Failed { why: "cannot read wood.png: no such file or folder ".repeat(40) };
        let sheet = sheet(None, vec![vec![marked, failed, Cell::Missing]]);
        let layout = Layout::of(&sheet, &Fonts::load().unwrap()).unwrap();
        let (width, _, codes) = draw_png(&sheet, 0, &Display::default()).unwrap();
        let at = |x: u32, y: u32| -> [u8; 3] {
            let i = 3 * (y * width + x) as usize;
            [codes[i], codes[i + 1], codes[i + 2]]
        };
        let red = <[u8; 3]>::of(RED);
        let cells = &layout.cells[0];
        let count = |area: Area, hit: &dyn Fn([u8; 3]) -> bool| {
            let columns = area.x..area.x + area.width;
            columns
                .flat_map(|x| (area.y..area.y + area.height).map(move |y| (x, y)))
                .filter(|&(x, y)| hit(at(x, y)))
                .count()
        };
        // The frame is outside the picture, the remark under it.
        assert_eq!(at(cells[0].x - 1, cells[0].y + 40), red);
        assert_ne!(at(cells[0].x, cells[0].y + 40), red);
        let below = Area { y: cells[0].y + 90 + layout.metrics.frame, height: layout.caption, ..cells[0] };
        assert!(count(below, &|p| p[0] > p[1] + 40) > 40);
        assert!(count(cells[1], &|p| p == red) > 40);
        assert!(count(cells[1], &|p| p[0] > 150 && p[1] > 150) > 40, "the reason is written");
        assert!(count(cells[2], &|p| p == <[u8; 3]>::of(STRIPES)) > 200, "hatched");
        assert_eq!(count(cells[2], &|p| p == red), 0);
    }

    #[test]
    fn many_columns_are_broken_into_lines_and_eleven_are_not() {
        let picture = layer(24, 18, 0);
        let row = |n: usize| sheet(None, vec![(0..n).map(|_| shown(&picture)).collect()]);
        let eleven = row(11);
        assert_eq!(area(&eleven, 0, 10).y, area(&eleven, 0, 0).y);
        let many = row(26);
        assert_eq!(area(&many, 0, 8).y, area(&many, 0, 0).y);
        assert!(area(&many, 0, 9).y > area(&many, 0, 8).y);
        assert_eq!(area(&many, 0, 25).x, area(&many, 0, 7).x);
        assert!(draw_png(&many, 0, &Display::default()).is_ok());
    }

    #[test]
    fn a_given_width_makes_pictures_smaller_and_odd_sizes_are_centred() {
        let (wide, tall) = (layer(64, 32, 0), layer(20, 60, 0));
        let mut sheet = sheet(None, vec![vec![shown(&wide), shown(&tall)]]);
        sheet.cell_width = Some(32);
        let (wide, tall) = (area(&sheet, 0, 0), area(&sheet, 0, 1));
        assert_eq!((wide.width, wide.height), (32, 16));
        assert_eq!((tall.width, tall.height), (20, 60));
        assert_eq!(wide.y, tall.y + (60 - 16) / 2);
    }

    #[test]
    fn a_sheet_too_large_is_made_smaller_or_refused_but_never_drawn() {
        let picture = layer(2000, 10, 0);
        let cells = || vec![(0..30).map(|_| shown(&picture)).collect::<Vec<_>>(); 2];
        let mut sheet = sheet(Some(2), cells());
        let layout = Layout::of(&sheet, &Fonts::load().unwrap()).unwrap();
        assert!(layout.picture_width < 2000 && layout.size[0] <= 32_768 && layout.size[0] > 25_000);
        sheet.cell_width = Some(1999);
        assert!(matches!(draw_png(&sheet, 0, &Display::default()), Err(SheetError::TooLarge { .. })));
        let endless = self::sheet(None, vec![vec![Cell::Missing; 200_000]]);
        assert!(matches!(draw_linear(&endless, 0), Err(SheetError::TooLarge { .. })));
        sheet.cell_width = Some(0);
        assert!(draw_png(&sheet, 0, &Display::default()).is_ok());
    }

    #[test]
    fn cells_and_headings_must_agree_and_pages_exist() {
        let mut wrong = sheet(Some(1), vec![vec![Cell::Missing, Cell::Missing]]);
        assert!(matches!(draw_linear(&wrong, 3), Err(SheetError::NoPage { page: 3, pages: 1 })));
        wrong.columns.labels.pop();
        assert!(matches!(draw_linear(&wrong, 0), Err(SheetError::Ragged { found: 2, expected: 1, .. })));
        wrong.columns.labels.clear();
        assert!(matches!(draw_linear(&wrong, 0), Err(SheetError::Empty)));
    }

    #[test]
    fn hostile_labels_and_tiny_cells_are_drawn_without_harm() {
        let dot = layer(1, 1, 0);
        let mut sheet =
            sheet(Some(1), vec![vec![shown(&dot), Cell::Missing, Cell::Failed { why: "x".repeat(10_000) }]]);
        sheet.title = "\u{202e}\u{0}語\n".repeat(5_000);
        sheet.columns.labels[0] = "long ".repeat(5_000);
        sheet.rows.as_mut().unwrap().labels[0] = String::new();
        let (_, _, once) = draw_png(&sheet, 0, &Display::default()).unwrap();
        let (_, _, again) = draw_png(&sheet, 0, &Display::default()).unwrap();
        assert!(once == again);
    }
}
