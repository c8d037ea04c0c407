//! Error against time, both logarithmic.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::summary::levels;
use super::{Bench, BenchError};
use crate::report::chart::{
    self, Drawing, FAINT, FINE, Figure, GRID, INK, Picture, color, legend, legend_height, stroke, text_style,
};

const WIDTH: u32 = 880;
const HEIGHT: u32 = 520;

/// The points of a scene: seconds and error, fewest samples first.
pub type Curve = Vec<(f64, f64)>;

/// A chart of all scenes, as SVG and as pixels.
///
/// # Errors
/// If it can't be drawn.
pub fn plot(benches: &[Bench]) -> Result<(String, Picture), BenchError> {
    let curve = |bench: &Bench| levels(bench).iter().map(|l| (l.seconds, l.error.max(1e-12))).collect();
    let curves = benches.iter().map(|bench| (bench.name.clone(), curve(bench))).collect();
    let chart = TimeToError { curves };
    Ok((chart::standalone_svg(&chart, "error against seconds")?, chart::picture(&chart)?))
}

struct TimeToError {
    curves: Vec<(String, Curve)>,
}

impl TimeToError {
    /// The range of a coordinate, with some space around.
    fn range(&self, of: fn(&(f64, f64)) -> f64) -> std::ops::Range<f64> {
        let values = || self.curves.iter().flat_map(|(_, c)| c).map(of);
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
        if low < high || low.is_normal() { low / 1.6..high * 1.6 } else { 0.01..1.0 }
    }
}

impl Figure for TimeToError {
    fn size(&self) -> (u32, u32) {
        (WIDTH, HEIGHT + legend_height(&self.legend(), WIDTH))
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static,
    {
        legend(area, &self.legend(), (8 * FINE, 12 * FINE))?;
        let below = area.margin(legend_height(&self.legend(), WIDTH) as i32 * FINE, 0, 0, 0);
        let (seconds, errors) = (self.range(|p| p.0), self.range(|p| p.1));
        let mut chart = ChartBuilder::on(&below)
            .margin(8 * FINE)
            .margin_right(20 * FINE)
            .set_label_area_size(LabelAreaPosition::Left, 64 * FINE)
            .set_label_area_size(LabelAreaPosition::Bottom, 44 * FINE)
            .build_cartesian_2d(seconds.clone().log_scale(), errors.clone().log_scale())?;
        chart
            .configure_mesh()
            .bold_line_style(stroke(GRID, 1.0))
            .light_line_style(stroke(GRID, 0.5))
            .axis_style(stroke(FAINT, 1.0))
            .set_all_tick_mark_size(4 * FINE)
            .x_labels(6)
            .y_labels(6)
            // As f32, since a tick's rounding is none of the reader's business.
            .x_label_formatter(&|x| (*x as f32).to_string())
            .y_label_formatter(&|y| (*y as f32).to_string())
            .x_desc("seconds")
            .y_desc("error: mean of (x - ref)²/(ref² + 0.01)")
            .axis_desc_style(text_style(13.0, &INK, HPos::Center, VPos::Center))
            .x_label_style(text_style(12.0, &FAINT, HPos::Center, VPos::Top))
            .y_label_style(text_style(12.0, &FAINT, HPos::Center, VPos::Center))
            .draw()?;
        // The line of error 0.01, to which times are given.
        if errors.contains(&0.01) {
            let goal = vec![(seconds.start, 0.01), (seconds.end, 0.01)];
            chart.draw_series(std::iter::once(PathElement::new(goal, stroke(FAINT, 1.5))))?;
        }
        for (i, (_, curve)) in self.curves.iter().enumerate() {
            chart.draw_series(std::iter::once(PathElement::new(curve.clone(), stroke(color(i), 2.0))))?;
            chart.draw_series(curve.iter().map(|&p| Circle::new(p, 3 * FINE, color(i).filled())))?;
        }
        Ok(())
    }
}

impl TimeToError {
    fn legend(&self) -> Vec<(String, RGBColor)> {
        self.curves.iter().enumerate().map(|(i, (name, _))| (name.clone(), color(i))).collect()
    }
}
