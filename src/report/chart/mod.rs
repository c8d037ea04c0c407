//! Charts, each drawn once for the page (SVG) and for a PNG.
//!
//! A [`Figure`] draws on whole-numbered coordinates that are [`FINE`] times finer than the pixels it is meant for. The SVG scales
//! them down by its view box, the PNG by averaging, which smooths edges.

mod paper;

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use paper::Paper;

use super::font::{FontError, Fonts};

/// An 8-bit sRGB picture, three bytes a pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// R, G, B row by row.
    pub rgb: Vec<u8>,
}

/// Drawing units a pixel.
pub(crate) const FINE: i32 = 4;

/// Text and axes. The page's style gives these colours others on a dark ground.
pub(crate) const INK: RGBColor = RGBColor(0x1f, 0x1f, 0x1f);
/// Labels and lines that matter less.
pub(crate) const FAINT: RGBColor = RGBColor(0x6b, 0x6b, 0x6b);
/// Grid lines.
pub(crate) const GRID: RGBColor = RGBColor(0xd4, 0xd4, 0xd4);

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008), yellow left out for its paleness.
const PALETTE: [RGBColor; 8] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x8c, 0x56, 0x4b),
    RGBColor(0x7f, 0x7f, 0x7f),
];

/// The colour of the `i`th thing among equals.
pub(crate) fn color(i: usize) -> RGBColor {
    PALETTE[i % PALETTE.len()]
}

/// A chart could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("a chart could not be drawn: {0}")]
pub struct ChartError(Box<dyn Error + Send + Sync>);

impl From<FontError> for ChartError {
    fn from(error: FontError) -> Self {
        Self(error.into())
    }
}

/// How drawing on a backend fails.
pub(crate) type Drawing<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// Something that can be drawn.
pub(crate) trait Figure {
    /// Columns and rows in pixels.
    fn size(&self) -> (u32, u32);

    /// Draws it in units [`FINE`] times finer.
    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static;
}

/// The figure as an SVG file on white; `title` is for those who don't see it.
pub(crate) fn standalone_svg(figure: &impl Figure, title: &str) -> Result<String, ChartError> {
    let (width, height) = figure.size();
    let element = svg(figure, title)?;
    let start = element.find('>').map_or(0, |at| at + 1);
    let head = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" {}",
        &element["<svg ".len()..start]
    );
    let ground = "\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>";
    Ok(format!("{head}{ground}{}", &element[start..]))
}

/// The figure as an SVG element without background, for a page that says how wide it is; `title` is for those who don't see it.
pub(crate) fn svg(figure: &impl Figure, title: &str) -> Result<String, ChartError> {
    let (width, height) = fine(figure.size());
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        figure.draw(&area).and_then(|()| area.present()).map_err(|error| ChartError(error.into()))?;
    }
    // Inside HTML an SVG needs no name space, and the page decides about its size.
    let start = text.find("viewBox").unwrap_or(0);
    let body = text[start..].replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    let body = body.replacen(">\n", &format!("><title>{title}</title>\n"), 1);
    Ok(format!("<svg role=\"img\" {body}"))
}

/// The figure as a picture on white.
pub(crate) fn picture(figure: &impl Figure) -> Result<Picture, ChartError> {
    let fonts = Fonts::load()?;
    let (width, height) = fine(figure.size());
    let mut paper = Paper::new(width, height, &fonts);
    {
        let area = (&mut paper).into_drawing_area();
        figure.draw(&area).and_then(|()| area.present()).map_err(|error| ChartError(error.into()))?;
    }
    Ok(paper.into_picture(FINE as u32))
}

/// Pictures below each other, as wide as the widest, on white.
pub(crate) fn stacked(pictures: &[Picture]) -> Picture {
    let width = pictures.iter().map(|p| p.width).max().unwrap_or(0);
    let mut rgb = Vec::new();
    for picture in pictures {
        for row in picture.rgb.chunks(3 * picture.width as usize) {
            rgb.extend_from_slice(row);
            rgb.resize(rgb.len() + 3 * (width - picture.width) as usize, 255);
        }
    }
    Picture { width, height: pictures.iter().map(|p| p.height).sum(), rgb }
}

/// Pictures of one height in a row with white space between, or in two rows if there are many, each under its name.
pub(crate) fn row(pictures: &[(&str, &Picture)]) -> Result<Picture, ChartError> {
    const SPACE: u32 = 12;
    const HEADING: u32 = 26;
    let count = pictures.len().max(1) as u32;
    let columns = if count <= 4 { count } else { count.div_ceil(2) };
    let cell = pictures.iter().map(|(_, p)| p.width).max().unwrap_or(0) + SPACE;
    let line = pictures.iter().map(|(_, p)| p.height).max().unwrap_or(0) + HEADING + SPACE;
    let fonts = Fonts::load()?;
    let mut sheet = Paper::new(columns * cell + SPACE, count.div_ceil(columns) * line + SPACE, &fonts);
    for (i, (name, picture)) in (0u32..).zip(pictures) {
        let (x, y) = (SPACE + i % columns * cell, SPACE + i / columns * line);
        sheet.caption(name, x, y, picture.width);
        sheet.paste(picture, x, y + HEADING);
    }
    Ok(sheet.into_picture(1))
}

fn fine((width, height): (u32, u32)) -> (u32, u32) {
    (width * FINE as u32, height * FINE as u32)
}

/// Text `size` pixels high.
pub(crate) fn text_style<'a>(size: f64, color: &RGBColor, horizontal: HPos, vertical: VPos) -> TextStyle<'a> {
    // plotters' size is 1.24 em.
    let font = FontDesc::new(FontFamily::Name("Roboto"), 1.24 * size * f64::from(FINE), FontStyle::Normal);
    font.color(color).pos(Pos::new(horizontal, vertical))
}

/// A line `pixels` wide.
pub(crate) fn stroke(color: RGBColor, pixels: f64) -> ShapeStyle {
    ShapeStyle {
        color: color.to_rgba(),
        filled: false,
        stroke_width: (pixels * f64::from(FINE)).round() as u32,
    }
}

/// A dashed line between two points.
pub(crate) fn dashes<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    from: (f64, f64),
    to: (f64, f64),
    style: ShapeStyle,
) -> Drawing<DB> {
    const DASH: f64 = 4.0 * FINE as f64;
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = (dx * dx + dy * dy).sqrt();
    let point = |at: f64| {
        let t = (at / length).min(1.0);
        ((from.0 + t * dx).round() as i32, (from.1 + t * dy).round() as i32)
    };
    let mut at = 0.0;
    while at < length {
        area.draw(&PathElement::new(vec![point(at), point(at + DASH)], style))?;
        at += 1.8 * DASH;
    }
    Ok(())
}

/// A legend in one line from `x` on, as units: squares of colour with words behind.
pub(crate) fn legend<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    entries: &[(String, RGBColor)],
    (x, y): (i32, i32),
) -> Drawing<DB> {
    let style = text_style(13.0, &INK, HPos::Left, VPos::Center);
    let (mut at, mut line) = (x, y);
    let right = area.dim_in_pixel().0 as i32;
    for (name, color) in entries {
        let width = area.estimate_text_size(name, &style)?.0 as i32 + 34 * FINE;
        if at + width > right && at > x {
            at = x;
            line += LEGEND_LINE * FINE;
        }
        let square = [(at, line - 5 * FINE), (at + 10 * FINE, line + 5 * FINE)];
        area.draw(&Rectangle::new(square, color.filled()))?;
        area.draw(&Text::new(name.clone(), (at + 15 * FINE, line), style.clone()))?;
        at += width;
    }
    Ok(())
}

/// Pixels from one line of a legend to the next.
const LEGEND_LINE: i32 = 20;

/// Pixels that a legend needs at the top of a figure `width` pixels wide; a guess at the width of letters.
pub(crate) fn legend_height(entries: &[(String, RGBColor)], width: u32) -> u32 {
    let mut lines = 1;
    let mut at = 0;
    for (name, _) in entries {
        let needed = 34 + 7 * name.chars().count() as u32;
        if at + needed > width && at > 0 {
            (lines, at) = (lines + 1, 0);
        }
        at += needed;
    }
    LEGEND_LINE as u32 * lines + 4
}
