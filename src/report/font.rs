//! Text: one line of it measured, shortened, wrapped and turned into coverage.
//!
//! The font is Roboto (Apache License 2.0), embedded, so that a sheet looks the same on every machine. It has Latin, Greek,
//! punctuation and mathematical signs; any other character shows as U+FFFD.

use ab_glyph::{Font as _, FontRef, Glyph, GlyphId, PxScale, ScaleFont, point};

static REGULAR: &[u8] = include_bytes!("fonts/Roboto-Regular.ttf");
static MEDIUM: &[u8] = include_bytes!("fonts/Roboto-Medium.ttf");

/// What text that was cut ends in.
const ELLIPSIS: char = '…';

/// What stands for a character that the font doesn't have.
const REPLACEMENT: char = '\u{fffd}';

/// Characters of one text that are looked at: no sheet is wide enough for more.
const LONGEST: usize = 1000;

/// The embedded font could not be read.
#[derive(Debug, thiserror::Error)]
#[error("the embedded font {name} is damaged: {cause}; rebuild the program")]
pub struct FontError {
    name: &'static str,
    cause: ab_glyph::InvalidFont,
}

/// The typefaces of a sheet.
#[derive(Debug)]
pub(crate) struct Fonts {
    regular: FontRef<'static>,
    medium: FontRef<'static>,
}

impl Fonts {
    /// Reads the embedded fonts.
    pub(crate) fn load() -> Result<Self, FontError> {
        let read = |name, data| FontRef::try_from_slice(data).map_err(|cause| FontError { name, cause });
        Ok(Self { regular: read("Roboto-Regular", REGULAR)?, medium: read("Roboto-Medium", MEDIUM)? })
    }

    /// A typeface at a size.
    pub(crate) fn style(&self, weight: Weight, size: f32) -> Style<'_> {
        let font = match weight {
            Weight::Regular => &self.regular,
            Weight::Medium => &self.medium,
        };
        Style { font, size }
    }
}

/// How heavy the strokes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weight {
    /// For labels and sentences.
    Regular,
    /// For titles.
    Medium,
}

/// A typeface at a size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Style<'f> {
    font: &'f FontRef<'static>,
    /// Pixels an em.
    size: f32,
}

impl Style<'_> {
    /// Pixels from one baseline to the next.
    pub(crate) fn line_height(&self) -> u32 {
        (self.size * 1.25).ceil() as u32
    }

    /// Pixels from the top of a line to its baseline, such that capitals stand in the line's middle.
    pub(crate) fn baseline(&self) -> f32 {
        // Roboto's capitals are 1456/2048 em high.
        ((self.line_height() as f32 + 0.711 * self.size) / 2.0).round()
    }

    /// The width of `text` in pixels, kerning included.
    pub(crate) fn width(&self, text: &str) -> f32 {
        self.place(text).1
    }

    /// `text`, or as much of its start as fits into `room` pixels with an ellipsis behind; empty where not even that fits.
    pub(crate) fn shortened(&self, text: &str, room: f32) -> String {
        let clean: String = text.chars().take(LONGEST).collect();
        if clean.len() == text.len() && self.width(&clean) <= room {
            return clean;
        }
        let ends: Vec<usize> = clean.char_indices().map(|(i, _)| i).collect();
        let cut = |count: usize| {
            let start = clean[..ends.get(count).copied().unwrap_or(clean.len())].trim_end();
            format!("{start}{ELLIPSIS}")
        };
        // The width grows with the number of characters (up to a little kerning), so the longest that fits is found by halving.
        let fitting = (0..=ends.len()).collect::<Vec<_>>().partition_point(|&n| self.width(&cut(n)) <= room);
        match fitting {
            0 => String::new(),
            n => cut(n - 1),
        }
    }

    /// `text` over at most `lines` lines of `room` pixels, broken at spaces, and inside words that are too long; the last
    /// line is shortened where more would follow.
    pub(crate) fn wrapped(&self, text: &str, room: f32, lines: usize) -> Vec<String> {
        let mut done: Vec<String> = Vec::new();
        let mut rest: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
        while !rest.is_empty() && done.len() < lines {
            if done.len() + 1 == lines {
                done.push(self.shortened(&rest, room));
                break;
            }
            let end = self.line_end(&rest, room);
            if end == 0 {
                break;
            }
            done.push(rest[..end].trim_end().to_owned());
            rest = rest[end..].trim_start().to_owned();
        }
        done.retain(|line| !line.is_empty());
        done
    }

    /// Where a line of `room` pixels ends, as a byte index: behind the last word that fits, or inside a word longer than a line;
    /// 0 where not one character fits.
    fn line_end(&self, text: &str, room: f32) -> usize {
        let mut at_space = None;
        for (i, c) in text.char_indices().take(LONGEST) {
            if c.is_whitespace() {
                at_space = Some(i);
                continue;
            }
            if self.width(&text[..i + c.len_utf8()]) > room {
                return at_space.unwrap_or(i);
            }
        }
        text.char_indices().nth(LONGEST).map_or(text.len(), |(i, _)| i)
    }

    /// Calls `ink(x, y, coverage)` for each pixel that the text touches, its line's left end at `x` and its baseline at `y`.
    /// Coverage is the share of the pixel, in (0, 1].
    pub(crate) fn draw(&self, text: &str, x: f32, y: f32, mut ink: impl FnMut(i64, i64, f32)) {
        for (id, advance) in self.place(text).0 {
            // A quarter of a pixel keeps the spacing even; whole baselines keep horizontal strokes sharp.
            let position = point(((x + advance) * 4.0).round() / 4.0, y.round());
            let Some(outline) = self.font.outline_glyph(Glyph { id, scale: self.scale(), position }) else {
                continue;
            };
            let corner = outline.px_bounds().min;
            let (left, top) = (corner.x as i64, corner.y as i64);
            outline.draw(|dx, dy, coverage| {
                let coverage = coverage.clamp(0.0, 1.0);
                if coverage > 0.0 {
                    ink(left + i64::from(dx), top + i64::from(dy), coverage);
                }
            });
        }
    }

    /// Each glyph with the place of its origin, and the width of all.
    fn place(&self, text: &str) -> (Vec<(GlyphId, f32)>, f32) {
        let scaled = self.font.as_scaled(self.scale());
        let mut glyphs: Vec<(GlyphId, f32)> = Vec::new();
        let mut pen = 0.0;
        for c in text.chars().take(LONGEST + 1) {
            let id = self.glyph(c);
            if let Some(&(before, _)) = glyphs.last() {
                pen += scaled.kern(before, id);
            }
            glyphs.push((id, pen));
            pen += scaled.h_advance(id);
        }
        (glyphs, pen)
    }

    fn glyph(&self, c: char) -> GlyphId {
        let c = if c.is_whitespace() || c.is_control() { ' ' } else { c };
        match self.font.glyph_id(c) {
            GlyphId(0) => self.font.glyph_id(REPLACEMENT),
            id => id,
        }
    }

    /// ab_glyph's scale is the height from descent to ascent, not the em.
    fn scale(&self) -> PxScale {
        let em = self.font.units_per_em().unwrap_or(2048.0);
        PxScale::from(self.size * self.font.height_unscaled() / em)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fonts() -> Fonts {
        Fonts::load().unwrap()
    }

    #[test]
    fn letters_have_ink_and_the_baseline_holds_them() {
        let fonts = fonts();
        let style = fonts.style(Weight::Regular, 20.0);
        let mut rows = Vec::new();
        style.draw("H", 0.0, 30.0, |_, y, _| rows.push(y));
        // An H of 20 px stands on the line and is 14.2 px high.
        assert_eq!(rows.iter().max(), Some(&29));
        assert_eq!(rows.iter().min(), Some(&15));
        let mut marks = 0;
        style.draw("α → 0.30 °", 0.0, 30.0, |_, _, c| {
            assert!(c > 0.0 && c <= 1.0);
            marks += 1;
        });
        assert!(marks > 100);
    }

    #[test]
    fn pairs_are_kerned() {
        let fonts = fonts();
        let style = fonts.style(Weight::Regular, 100.0);
        assert!(style.width("AV") < style.width("A") + style.width("V") - 2.0);
        assert!((style.width("HH") - 2.0 * style.width("H")).abs() < 1e-3);
    }

    #[test]
    fn unknown_characters_and_controls_do_not_vanish_or_break_lines() {
        let fonts = fonts();
        let style = fonts.style(Weight::Regular, 16.0);
        assert_eq!(style.width("語"), style.width("\u{fffd}"));
        assert!(style.width("語") > 1.0);
        assert_eq!(style.width("a\nb"), style.width("a b"));
    }

    #[test]
    fn what_is_too_long_ends_in_an_ellipsis_and_fits() {
        let fonts = fonts();
        let style = fonts.style(Weight::Medium, 14.0);
        assert_eq!(style.shortened("0.30", 100.0), "0.30");
        let text = "material.ball.base_color".repeat(300);
        for room in [5.0, 20.0, 60.0, 150.0] {
            let short = style.shortened(&text, room);
            assert!(style.width(&short) <= room);
            assert!(short.is_empty() || short.ends_with(ELLIPSIS));
        }
        assert!(style.shortened(&text, 60.0).starts_with("mater"));
        assert_eq!(style.shortened("wide", 1.0), "");
    }

    #[test]
    fn wrapping_breaks_at_spaces_and_inside_long_words() {
        let fonts = fonts();
        let style = fonts.style(Weight::Regular, 14.0);
        let lines = style.wrapped("cannot read textures/wood.png: no such file", 140.0, 9);
        assert_eq!(lines.join(" "), "cannot read textures/wood.png: no such file");
        assert!(lines.len() > 1 && lines.iter().all(|l| style.width(l) <= 140.0));
        let long = style.wrapped(&"x".repeat(60), 100.0, 3);
        assert_eq!(long.len(), 3);
        assert!(long[2].ends_with(ELLIPSIS) && !long[1].ends_with(ELLIPSIS));
        assert!(style.wrapped("text", 1.0, 3).is_empty());
        assert!(style.wrapped("  ", 100.0, 3).is_empty());
    }
}
