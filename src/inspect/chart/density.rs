//! The density of sampling beside f·cos θ over its integral: where they are the same, all samples have the same weight.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::inspect::measure::{Curve, View};
use crate::report::chart::{
    Drawing, FAINT, FINE, Figure, GRID, INK, color, legend, legend_height, stroke, text_style,
};

const WIDTH: u32 = 880;
/// Of each of the two rows.
const HEIGHT: u32 = 260;
/// The fewest and the most decades below the largest value that are shown.
const DECADES: [f64; 2] = [3.0, 6.0];
/// Angles nearer the horizon than this many degrees don't decide how many: there both fall to 0.
const EDGE: f64 = 6.0;

/// Panels of log scale, one a view.
pub(crate) struct Density<'a> {
    pub(crate) views: &'a [View],
}

impl Density<'_> {
    fn legend() -> Vec<(String, RGBColor)> {
        vec![
            ("f·cos θ / albedo, in 1/sr".to_owned(), color(0)),
            ("density of sampling, in 1/sr".to_owned(), color(1)),
        ]
    }
}

impl Figure for Density<'_> {
    fn size(&self) -> (u32, u32) {
        (WIDTH, legend_height(&Self::legend(), WIDTH) + HEIGHT * self.views.len().div_ceil(2) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static,
    {
        legend(area, &Self::legend(), (8 * FINE, 12 * FINE))?;
        let below = area.margin(legend_height(&Self::legend(), WIDTH) as i32 * FINE, 0, 0, 0);
        for (panel, view) in below.split_evenly((self.views.len().div_ceil(2), 2)).iter().zip(self.views) {
            draw_panel(panel, view)?;
        }
        Ok(())
    }
}

fn draw_panel<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, view: &View) -> Drawing<DB>
where
    DB::ErrorType: 'static,
{
    let scale = if view.estimate.smooth > 0.0 { 1.0 / view.estimate.smooth } else { 0.0 };
    let wanted: Curve = view.wanted.iter().map(|&(a, v)| (a, v * scale)).collect();
    let largest = wanted.iter().chain(&view.density).map(|p| p.1).fold(0.0, f64::max);
    let title = text_style(14.0, &INK, HPos::Left, VPos::Top);
    let heading = format!("viewer at {}°", view.angle);
    let (left, top) = (56 * FINE, 2 * FINE);
    if largest <= 0.0 {
        let text = format!("{heading}: nothing but delta lobes");
        return area.draw(&Text::new(text, (left, top), title));
    }
    area.draw(&Text::new(heading, (left, top), title))?;
    let high = libm::ceil(libm::log10(largest));
    let inside = wanted.iter().filter(|(a, v)| (a.abs() - 90.0).abs() > EDGE && *v > 0.0);
    let least = inside.map(|p| p.1).fold(largest, f64::min);
    let decades = (high - libm::floor(libm::log10(least))).clamp(DECADES[0], DECADES[1]);
    let low = high - decades;
    let end = view.total.last().map_or(90.0, |p| p.0);
    let mut chart = ChartBuilder::on(area)
        .margin(4 * FINE)
        .margin_top(22 * FINE)
        .margin_right(14 * FINE)
        .set_label_area_size(LabelAreaPosition::Left, 48 * FINE)
        .set_label_area_size(LabelAreaPosition::Bottom, 24 * FINE)
        .build_cartesian_2d(-end..end, low..high)?;
    chart
        .configure_mesh()
        .max_light_lines(0)
        .bold_line_style(stroke(GRID, 1.0))
        .axis_style(stroke(FAINT, 1.0))
        .set_all_tick_mark_size(3 * FINE)
        .x_labels(13)
        .y_labels(decades as usize + 1)
        .x_label_formatter(&|x| format!("{x:.0}°"))
        .y_label_formatter(&|y| power(*y))
        .x_label_style(text_style(11.0, &FAINT, HPos::Center, VPos::Top))
        .y_label_style(text_style(11.0, &FAINT, HPos::Right, VPos::Center))
        .draw()?;
    for (i, curve) in [&wanted, &view.density].into_iter().enumerate() {
        let mut run = Vec::new();
        // What is below the scale, or 0, is a gap.
        for &(angle, value) in curve.iter().chain([&(end, 0.0)]) {
            let height = if value > 0.0 { libm::log10(value) } else { f64::NEG_INFINITY };
            if height >= low {
                run.push((angle, height));
            } else if !run.is_empty() {
                let path = PathElement::new(std::mem::take(&mut run), stroke(color(i), 2.0 - 0.6 * i as f64));
                chart.draw_series(std::iter::once(path))?;
            }
        }
    }
    Ok(())
}

/// 10 to a whole power in few letters.
fn power(exponent: f64) -> String {
    match exponent.round() as i32 {
        e @ 0..=3 => format!("{:.0}", libm::pow(10.0, e.into())),
        e @ -2..=-1 => format!("{:.*}", -e as usize, libm::pow(10.0, e.into())),
        e => format!("1e{e}"),
    }
}
