//! Ratios as bars, from 1 to the left where the variant is better, and to the right where it is worse.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{Ablation, Row};
use crate::bench::BenchError;
use crate::bench::table;
use crate::report::chart::{
    self, Drawing, FAINT, FINE, Figure, GRID, INK, Picture, color, legend, legend_height, stroke, text_style,
};

const WIDTH: u32 = 880;
/// Where names end and bars may begin.
const NAMES: i32 = 130;
const MARGIN: i32 = 48;
const HEADING: i32 = 34;
const BAR: i32 = 7;
const ROW: i32 = 3 * BAR + 8;
const AXIS: i32 = 30;

/// A bar chart of all scenes, as SVG and as pixels.
///
/// # Errors
/// If it can't be drawn.
pub fn ablation_chart(ablations: &[Ablation]) -> Result<(String, Picture), BenchError> {
    let chart = Bars { ablations };
    Ok((chart::standalone_svg(&chart, "what each technique is worth")?, chart::picture(&chart)?))
}

struct Bars<'a> {
    ablations: &'a [Ablation],
}

impl Figure for Bars<'_> {
    fn size(&self) -> (u32, u32) {
        let height = self.ablations.iter().map(panel_height).sum::<i32>() as u32;
        (WIDTH, height + legend_height(&entries(), WIDTH))
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static,
    {
        legend(area, &entries(), (8 * FINE, 12 * FINE))?;
        let scale = Scale::over(self.ablations);
        let mut top = legend_height(&entries(), WIDTH) as i32;
        for ablation in self.ablations {
            panel(area, ablation, &scale, top)?;
            top += panel_height(ablation);
        }
        Ok(())
    }
}

fn entries() -> Vec<(String, RGBColor)> {
    let names = ["error", "time", "work, each over the whole renderer's"];
    names.into_iter().enumerate().map(|(i, name)| (name.to_owned(), color(i))).collect()
}

fn ratios(row: &Row) -> [f64; 3] {
    [row.error, row.time, row.work()]
}

fn panel_height(ablation: &Ablation) -> i32 {
    HEADING + ROW * ablation.rows.len() as i32 + AXIS
}

/// From ratios to columns, logarithmic.
struct Scale {
    /// The exponents of 2 at both ends.
    ends: (f64, f64),
}

impl Scale {
    fn over(ablations: &[Ablation]) -> Self {
        let ratios = || ablations.iter().flat_map(|ablation| &ablation.rows).flat_map(ratios);
        let exponents = ratios().map(libm::log2).filter(|exponent| exponent.is_finite());
        let (low, high) = exponents.fold((-1.0, 1.0), |(l, h): (f64, f64), e| (l.min(e), h.max(e)));
        Self { ends: (low.floor(), high.ceil()) }
    }

    /// In drawing units.
    fn column(&self, ratio: f64) -> i32 {
        let (low, high) = self.ends;
        let part = ((libm::log2(ratio) - low) / (high - low)).clamp(0.0, 1.0);
        let (left, right) = (NAMES * FINE, (WIDTH as i32 - MARGIN) * FINE);
        left + (part * f64::from(right - left)).round() as i32
    }

    /// Powers of 2, so few that their labels have room.
    fn ticks(&self) -> impl Iterator<Item = i32> + use<> {
        let (low, high) = (self.ends.0 as i32, self.ends.1 as i32);
        let step = (high - low + 11) / 12;
        (low..=high).filter(move |exponent| exponent % step == 0)
    }
}

fn panel<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    ablation: &Ablation,
    scale: &Scale,
    top: i32,
) -> Drawing<DB>
where
    DB::ErrorType: 'static,
{
    let title = text_style(14.0, &INK, HPos::Left, VPos::Center);
    area.draw(&Text::new(ablation.name.clone(), (8 * FINE, (top + HEADING / 2) * FINE), title))?;
    let (first, last) = (top + HEADING, top + HEADING + ROW * ablation.rows.len() as i32);
    for exponent in scale.ticks() {
        let ratio = libm::exp2(f64::from(exponent));
        let at = scale.column(ratio);
        let line = stroke(if exponent == 0 { FAINT } else { GRID }, 1.0);
        area.draw(&PathElement::new(vec![(at, first * FINE), (at, last * FINE)], line))?;
        let label = if exponent < 0 { format!("1/{}", 1.0 / ratio) } else { ratio.to_string() };
        let style = text_style(12.0, &FAINT, HPos::Center, VPos::Top);
        area.draw(&Text::new(label, (at, (last + 4) * FINE), style))?;
    }
    for (i, row) in ablation.rows.iter().enumerate() {
        bars(area, row, scale, first + ROW * i as i32 + 4)?;
    }
    Ok(())
}

/// A row's name, bars and work.
fn bars<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, row: &Row, scale: &Scale, top: i32) -> Drawing<DB>
where
    DB::ErrorType: 'static,
{
    let middle = (2 * top + 3 * BAR) * FINE / 2;
    let name = text_style(12.0, &INK, HPos::Right, VPos::Center);
    area.draw(&Text::new(row.name.clone(), ((NAMES - 8) * FINE, middle), name))?;
    let one = scale.column(1.0);
    let mut right = one;
    for (i, ratio) in ratios(row).into_iter().enumerate() {
        let (end, y) = (scale.column(ratio), (top + BAR * i as i32) * FINE);
        right = right.max(end);
        area.draw(&Rectangle::new([(one.min(end), y), (one.max(end), y + BAR * FINE)], color(i).filled()))?;
    }
    let work = text_style(12.0, &FAINT, HPos::Left, VPos::Center);
    area.draw(&Text::new(table::ratio(row.work()), (right + 5 * FINE, middle), work))
}
