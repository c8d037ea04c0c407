//! The directional albedo against the angle of incidence: lobes stacked, or several materials as lines.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::inspect::measure::Curve;
use crate::report::chart::{
    Drawing, FAINT, FINE, Figure, GRID, INK, legend, legend_height, stroke, text_style,
};

const WIDTH: u32 = 880;
const HEIGHT: u32 = 400;

/// A chart over angles of incidence from 0° to 90°.
pub(crate) struct Albedo {
    /// Stacked on each other, each with its own height.
    pub(crate) areas: Vec<(RGBColor, Curve)>,
    /// With a mark at each angle.
    pub(crate) lines: Vec<(RGBColor, Curve)>,
    /// Thin ones.
    pub(crate) channels: Vec<(RGBColor, Curve)>,
    pub(crate) legend: Vec<(String, RGBColor)>,
}

impl Albedo {
    fn top(&self) -> f64 {
        let curves = self.lines.iter().chain(&self.channels);
        1.05 * curves.flat_map(|(_, c)| c.iter().map(|p| p.1)).fold(1.0, f64::max)
    }
}

impl Figure for Albedo {
    fn size(&self) -> (u32, u32) {
        (WIDTH, HEIGHT + legend_height(&self.legend, WIDTH))
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static,
    {
        legend(area, &self.legend, (8 * FINE, 12 * FINE))?;
        let below = area.margin(legend_height(&self.legend, WIDTH) as i32 * FINE, 0, 0, 0);
        let top = self.top();
        let mut chart = ChartBuilder::on(&below)
            .margin(8 * FINE)
            .margin_right(20 * FINE)
            .set_label_area_size(LabelAreaPosition::Left, 52 * FINE)
            .set_label_area_size(LabelAreaPosition::Bottom, 44 * FINE)
            .build_cartesian_2d(0.0..90.0, 0.0..top)?;
        let label = text_style(12.0, &FAINT, HPos::Center, VPos::Center);
        chart
            .configure_mesh()
            .max_light_lines(0)
            .bold_line_style(stroke(GRID, 1.0))
            .axis_style(stroke(FAINT, 1.0))
            .set_all_tick_mark_size(4 * FINE)
            .x_labels(10)
            .y_labels(9)
            .x_label_formatter(&|x| format!("{x:.0}°"))
            .y_label_formatter(&|y| crate::inspect::subject::number(*y))
            .x_desc("angle of incidence")
            .y_desc("albedo")
            .axis_desc_style(text_style(13.0, &INK, HPos::Center, VPos::Center))
            .x_label_style(text_style(12.0, &FAINT, HPos::Center, VPos::Top))
            .y_label_style(label)
            .draw()?;
        for (i, (color, _)) in self.areas.iter().enumerate() {
            chart.draw_series(std::iter::once(Polygon::new(self.band(i), color.mix(0.75))))?;
        }
        if top > 1.1 {
            let one = PathElement::new(vec![(0.0, 1.0), (90.0, 1.0)], stroke(FAINT, 1.5));
            chart.draw_series(std::iter::once(one))?;
        }
        for (color, curve) in &self.channels {
            chart.draw_series(std::iter::once(PathElement::new(curve.clone(), stroke(*color, 1.0))))?;
        }
        for (color, curve) in &self.lines {
            chart.draw_series(std::iter::once(PathElement::new(curve.clone(), stroke(*color, 2.0))))?;
            chart.draw_series(curve.iter().map(|&p| Circle::new(p, 3 * FINE, color.filled())))?;
        }
        Ok(())
    }
}

impl Albedo {
    /// The outline of the `i`th area on top of those before it.
    fn band(&self, i: usize) -> Curve {
        let height = |count: usize, at: usize| self.areas[..count].iter().map(|(_, c)| c[at].1).sum::<f64>();
        let points = self.areas[i].1.iter().enumerate();
        let upper = points.clone().map(|(at, &(x, _))| (x, height(i + 1, at)));
        let lower = points.rev().map(|(at, &(x, _))| (x, height(i, at)));
        upper.chain(lower).collect()
    }
}
