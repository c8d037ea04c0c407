//! A drawing backend of pixels: round lines, and text in the project's own font.

use std::convert::Infallible;

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, FontStyle};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};

use super::Picture;
use crate::report::font::{Fonts, Style, Weight};

/// 8-bit sRGB pixels, white at first. Colours mix as codes.
pub(super) struct Paper<'a> {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
    fonts: &'a Fonts,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl<'a> Paper<'a> {
    pub(super) fn new(width: u32, height: u32, fonts: &'a Fonts) -> Self {
        Self { width, height, rgb: vec![255; 3 * width as usize * height as usize], fonts }
    }

    /// The pixels, each the mean of `factor`² of them.
    pub(super) fn into_picture(self, factor: u32) -> Picture {
        let (width, height) = (self.width / factor, self.height / factor);
        let mut rgb = Vec::with_capacity(3 * width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                for c in 0..3 {
                    let mut sum = 0;
                    for row in y * factor..(y + 1) * factor {
                        let start = row as usize * self.width as usize + (x * factor) as usize;
                        sum += (start..start + factor as usize)
                            .map(|i| u32::from(self.rgb[3 * i + c]))
                            .sum::<u32>();
                    }
                    let count = factor * factor;
                    rgb.push(((sum + count / 2) / count) as u8);
                }
            }
        }
        Picture { width, height, rgb }
    }

    /// Puts a picture's upper left corner at (x, y).
    pub(super) fn paste(&mut self, picture: &Picture, x: u32, y: u32) {
        let shown = picture.width.min(self.width.saturating_sub(x)) as usize;
        for (row, pixels) in (y..self.height).zip(picture.rgb.chunks_exact(3 * picture.width as usize)) {
            let at = 3 * (row as usize * self.width as usize + x as usize);
            self.rgb[at..at + 3 * shown].copy_from_slice(&pixels[..3 * shown]);
        }
    }

    /// Writes a name above something `width` pixels wide.
    pub(super) fn caption(&mut self, text: &str, x: u32, y: u32, width: u32) {
        let fonts = self.fonts;
        let style = fonts.style(Weight::Medium, 14.0);
        let shown = style.shortened(text, width as f32);
        let baseline = y as f32 + style.baseline();
        style.draw(&shown, x as f32, baseline, |px, py, coverage| {
            self.mix(px, py, super::INK.rgb(), f64::from(coverage));
        });
    }

    fn mix(&mut self, x: i64, y: i64, (r, g, b): (u8, u8, u8), alpha: f64) {
        if x < 0 || y < 0 || x >= i64::from(self.width) || y >= i64::from(self.height) {
            return;
        }
        let at = 3 * (y as usize * self.width as usize + x as usize);
        for (pixel, code) in self.rgb[at..at + 3].iter_mut().zip([r, g, b]) {
            *pixel = (f64::from(*pixel) + (f64::from(code) - f64::from(*pixel)) * alpha).round() as u8;
        }
    }

    /// The pixels nearer than half of `width` to a segment. Lines are opaque, so that what overlaps is not darker.
    fn segment(&mut self, from: BackendCoord, to: BackendCoord, color: BackendColor, width: u32) {
        let radius = f64::from(width.max(1)) / 2.0;
        let (a, b) = ((f64::from(from.0), f64::from(from.1)), (f64::from(to.0), f64::from(to.1)));
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length2 = dx * dx + dy * dy;
        let range = |low: f64, high: f64, end: u32| {
            (low - radius).floor().max(0.0) as u32..=((high + radius).ceil().max(0.0) as u32).min(end - 1)
        };
        for y in range(a.1.min(b.1), a.1.max(b.1), self.height) {
            for x in range(a.0.min(b.0), a.0.max(b.0), self.width) {
                let (px, py) = (f64::from(x) - a.0, f64::from(y) - a.1);
                let along = if length2 > 0.0 { ((px * dx + py * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
                let (ex, ey) = (px - along * dx, py - along * dy);
                if ex * ex + ey * ey <= radius * radius {
                    self.mix(x.into(), y.into(), color.rgb, 1.0);
                }
            }
        }
    }

    fn style(&self, style: &impl BackendTextStyle) -> Style<'a> {
        let weight = match style.style() {
            FontStyle::Bold => Weight::Medium,
            _ => Weight::Regular,
        };
        // As plotters' SVG, whose em is this.
        self.fonts.style(weight, (style.size() / 1.24) as f32)
    }
}

impl DrawingBackend for &mut Paper<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        self.mix(x.into(), y.into(), color.rgb, color.alpha);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        // Polygons are filled with such lines, and may be translucent.
        if style.stroke_width() == 1 {
            return plotters_backend::rasterizer::draw_line(self, from, to, style);
        }
        self.segment(from, to, style.color(), style.stroke_width());
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        for ends in points.windows(2) {
            self.segment(ends[0], ends[1], style.color(), style.stroke_width());
        }
        Ok(())
    }

    /// Places text as the SVG backend does: `dy` is 0.76 em, 0.5 ex or -0.5 ex.
    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> Drawn {
        let face = self.style(style);
        let em = style.size() / 1.24;
        let width = f64::from(face.width(text));
        let left = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -width / 2.0,
            HPos::Right => -width,
        };
        let baseline = match style.anchor().v_pos {
            VPos::Top => 0.76 * em,
            VPos::Center => 0.26 * em,
            VPos::Bottom => -0.26 * em,
        };
        let (color, turn) = (style.color(), style.transform());
        face.draw(text, left as f32, baseline as f32, |dx, dy, coverage| {
            let (dx, dy) = turn.transform(dx as i32, dy as i32);
            self.mix(i64::from(x + dx), i64::from(y + dy), color.rgb, color.alpha * f64::from(coverage));
        });
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        Ok((self.style(style).width(text).ceil() as u32, (style.size() / 1.24) as u32))
    }
}
