//! A picture to draw on: rectangles, lines, text and other pictures, in linear light or in 8-bit codes.

use super::font::Style;
use crate::color::{linear_from_srgb, srgb_from_linear};

/// A linear grey or colour of Rec. 709 primaries, display-referred: 1 is the display's white.
pub(crate) type Ink = [f32; 3];

/// A pixel of a canvas.
pub(crate) trait Pixel: Copy {
    /// The pixel of a linear colour.
    fn of(ink: Ink) -> Self;
    /// This pixel where `coverage` of it lies under `ink`; mixed in linear light.
    fn under(self, ink: Ink, coverage: f32) -> Self;
}

impl Pixel for [f32; 3] {
    fn of(ink: Ink) -> Self {
        ink
    }

    fn under(self, ink: Ink, coverage: f32) -> Self {
        let mix = |below: f32, above: f32| below * (1.0 - coverage) + above * coverage;
        [mix(self[0], ink[0]), mix(self[1], ink[1]), mix(self[2], ink[2])]
    }
}

impl Pixel for [u8; 3] {
    fn of(ink: Ink) -> Self {
        ink.map(|v| (255.0 * srgb_from_linear(v.clamp(0.0, 1.0))).round() as u8)
    }

    fn under(self, ink: Ink, coverage: f32) -> Self {
        Self::of(self.map(|code| linear_from_srgb(f32::from(code) / 255.0)).under(ink, coverage))
    }
}

/// A rectangle of a canvas in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Area {
    /// The leftmost column.
    pub x: u32,
    /// The topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Area {
    /// The area with `by` pixels more on each side; it stops at the canvas' edges.
    pub(crate) fn grown(self, by: u32) -> Self {
        let (x, y) = (self.x.saturating_sub(by), self.y.saturating_sub(by));
        Self { x, y, width: self.width + (self.x - x) + by, height: self.height + (self.y - y) + by }
    }

    /// The area with `by` pixels less on each side.
    pub(crate) fn shrunk(self, by: u32) -> Self {
        Self {
            x: self.x + by,
            y: self.y + by,
            width: self.width.saturating_sub(2 * by),
            height: self.height.saturating_sub(2 * by),
        }
    }
}

/// Where a line of text stands in the room it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    /// At the left end.
    Left,
    /// In the middle.
    Centre,
    /// At the right end.
    Right,
}

/// Rows of pixels. Whatever lies outside is not drawn.
#[derive(Clone, Debug)]
pub(crate) struct Canvas<P> {
    width: u32,
    height: u32,
    pixels: Vec<P>,
}

impl<P: Pixel> Canvas<P> {
    /// A canvas of one colour.
    pub(crate) fn new(width: u32, height: u32, ink: Ink) -> Self {
        Self { width, height, pixels: vec![P::of(ink); width as usize * height as usize] }
    }

    /// The pixels, row by row.
    pub(crate) fn into_pixels(self) -> Vec<P> {
        self.pixels
    }

    /// Fills `area`.
    pub(crate) fn fill(&mut self, area: Area, ink: Ink) {
        let pixel = P::of(ink);
        self.each(area, |_, _, p| *p = pixel);
    }

    /// Draws a frame of `thickness` pixels around `area`, outside it.
    pub(crate) fn frame(&mut self, area: Area, thickness: u32, ink: Ink) {
        let outer = area.grown(thickness);
        let pixel = P::of(ink);
        let inside = |x: u32, y: u32| {
            x >= area.x && y >= area.y && x - area.x < area.width && y - area.y < area.height
        };
        self.each(outer, |x, y, p| {
            if !inside(x, y) {
                *p = pixel;
            }
        });
    }

    /// Draws diagonal stripes into `area`, `period` pixels apart.
    pub(crate) fn hatch(&mut self, area: Area, period: u32, ink: Ink) {
        let period = period.max(2);
        self.each(area, |x, y, p| {
            // Across a stripe's edges the coverage rises and falls over one pixel.
            let across = (u64::from(x) + u64::from(y)) % u64::from(period);
            let coverage = match across {
                0 => 0.5,
                1 => 1.0,
                2 => 0.5,
                _ => 0.0,
            };
            *p = p.under(ink, coverage);
        });
    }

    /// Draws the diagonals of `area`, `thickness` pixels thick, with round ends.
    pub(crate) fn cross(&mut self, area: Area, thickness: f32, ink: Ink) {
        let half = [area.width as f32 / 2.0, area.height as f32 / 2.0];
        let length = (half[0] * half[0] + half[1] * half[1]).sqrt();
        if length == 0.0 {
            return;
        }
        let direction = [half[0] / length, half[1] / length];
        let reach = (length - thickness / 2.0).max(0.0);
        self.each(area, |x, y, p| {
            let at = [(x - area.x) as f32 + 0.5 - half[0], (y - area.y) as f32 + 0.5 - half[1]];
            // Mirrored into one quarter, both diagonals are the same segment.
            let distance = distance_to_segment(at.map(f32::abs), direction, reach);
            let coverage = (thickness / 2.0 + 0.5 - distance).clamp(0.0, 1.0);
            *p = p.under(ink, coverage);
        });
    }

    /// Writes one line of text into `area`, shortened where it is too long, its line at the area's top.
    pub(crate) fn text(&mut self, text: &str, area: Area, align: Align, style: Style<'_>, ink: Ink) {
        let room = area.width as f32;
        let shown = style.shortened(text, room);
        let spare = room - style.width(&shown);
        let x = match align {
            Align::Left => 0.0,
            Align::Centre => spare / 2.0,
            Align::Right => spare,
        };
        let (width, height) = (i64::from(self.width), i64::from(self.height));
        style.draw(&shown, area.x as f32 + x, area.y as f32 + style.baseline(), |x, y, coverage| {
            if x >= 0 && y >= 0 && x < width && y < height {
                let p = &mut self.pixels[(y * width + x) as usize];
                *p = p.under(ink, coverage);
            }
        });
    }

    /// Calls `paint(x, y, pixel)` for each pixel of `area` that is on the canvas.
    pub(crate) fn each(&mut self, area: Area, mut paint: impl FnMut(u32, u32, &mut P)) {
        let right = area.x.saturating_add(area.width).min(self.width);
        let bottom = area.y.saturating_add(area.height).min(self.height);
        for y in area.y..bottom {
            for x in area.x..right {
                paint(x, y, &mut self.pixels[y as usize * self.width as usize + x as usize]);
            }
        }
    }
}

/// The distance of `point` from the segment that leads from the origin along `direction`, of length `reach`.
fn distance_to_segment(point: [f32; 2], direction: [f32; 2], reach: f32) -> f32 {
    let along = (point[0] * direction[0] + point[1] * direction[1]).clamp(0.0, reach);
    let off = [point[0] - along * direction[0], point[1] - along * direction[1]];
    (off[0] * off[0] + off[1] * off[1]).sqrt()
}
