//! Polar slices: f·cos θ in the plane of incidence, one panel an angle of incidence.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::inspect::measure::Curve;
use crate::report::chart::{
    Drawing, FAINT, FINE, Figure, GRID, INK, dashes, legend, legend_height, stroke, text_style,
};

/// Width of the figure in pixels: two panels.
const WIDTH: u32 = 880;
/// Radius of a panel's disk.
const RADIUS: i32 = 180;
/// Room above the disk, for title and labels.
const ABOVE: i32 = 46;
/// Room below it.
const BELOW: i32 = 34;
/// Below this value (in 1/sr) the radius grows linearly, above it with the logarithm.
const LINEAR: f64 = 0.01;

/// Slices from several angles with one scale.
pub(crate) struct Polar<'a> {
    pub(crate) panels: Vec<PolarPanel<'a>>,
    pub(crate) legend: Vec<(String, RGBColor)>,
}

/// The slice from one angle.
pub(crate) struct PolarPanel<'a> {
    /// The angle of incidence in degrees.
    pub(crate) angle: f64,
    /// In 1/sr against degrees.
    pub(crate) curves: Vec<(RGBColor, &'a Curve)>,
    /// Delta lobes: their angle in degrees, and the fraction of light.
    pub(crate) spikes: Vec<(RGBColor, f64, f64)>,
}

impl Polar<'_> {
    /// The value at the rim: a power of ten.
    fn rim(&self) -> f64 {
        let values = self.panels.iter().flat_map(|p| &p.curves).flat_map(|(_, c)| c.iter().map(|p| p.1));
        let largest = values.fold(0.0, f64::max);
        let mut rim = 1.0;
        while rim < largest {
            rim *= 10.0;
        }
        rim
    }

    fn reaches_below(&self) -> bool {
        let below = |angle: f64| angle.abs() > 90.0;
        self.panels.iter().any(|panel| {
            panel.spikes.iter().any(|s| below(s.1))
                || panel.curves.iter().any(|(_, c)| c.iter().any(|&(a, v)| below(a) && v > 1e-4))
        })
    }

    fn panel_height(&self) -> i32 {
        ABOVE + BELOW + if self.reaches_below() { 2 * RADIUS } else { RADIUS }
    }
}

impl Figure for Polar<'_> {
    fn size(&self) -> (u32, u32) {
        let rows = self.panels.len().div_ceil(2) as u32;
        (WIDTH, legend_height(&self.legend, WIDTH) + rows * self.panel_height() as u32)
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static,
    {
        legend(area, &self.legend, (8 * FINE, 12 * FINE))?;
        let top = legend_height(&self.legend, WIDTH) as i32;
        for (i, panel) in (0..).zip(&self.panels) {
            let x = WIDTH as i32 / 4 * (1 + 2 * (i % 2));
            let y = top + i / 2 * self.panel_height() + ABOVE + RADIUS;
            self.draw_panel(area, panel, (x * FINE, y * FINE))?;
        }
        Ok(())
    }
}

impl Polar<'_> {
    fn draw_panel<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
        panel: &PolarPanel<'_>,
        (x, y): (i32, i32),
    ) -> Drawing<DB> {
        let (rim, full) = (self.rim(), self.reaches_below());
        let radius = |value: f64| {
            let scale = libm::log1p(rim / LINEAR);
            f64::from(RADIUS * FINE) * (libm::log1p(value.max(0.0) / LINEAR) / scale).min(1.0)
        };
        let at = |angle: f64, radius: f64| {
            let radians = angle.to_radians();
            (f64::from(x) + radius * libm::sin(radians), f64::from(y) - radius * libm::cos(radians))
        };
        let whole = |(x, y): (f64, f64)| (x.round() as i32, y.round() as i32);
        let end: i32 = if full { 180 } else { 90 };

        // Rings at powers of ten, with their values along the horizon.
        let mut ring = 0.1;
        while ring <= 1.001 * rim {
            let arc = (-end..=end).step_by(3).map(|a| whole(at(f64::from(a), radius(ring))));
            area.draw(&PathElement::new(arc.collect::<Vec<_>>(), stroke(GRID, 1.0)))?;
            let label = text_style(11.0, &FAINT, HPos::Center, VPos::Top);
            let (lx, ly) = whole(at(90.0, radius(ring)));
            area.draw(&Text::new(decade(ring), (lx, ly + 5 * FINE), label))?;
            ring *= 10.0;
        }
        for angle in (-end..=end).step_by(30).filter(|a| a.abs() < 180 || full) {
            let spoke = vec![(x, y), whole(at(angle.into(), f64::from(RADIUS * FINE)))];
            let style = if angle.abs() == 90 { stroke(FAINT, 1.0) } else { stroke(GRID, 1.0) };
            area.draw(&PathElement::new(spoke, style))?;
            if angle.abs() < 90 {
                let label = text_style(11.0, &FAINT, HPos::Center, VPos::Center);
                let place = whole(at(angle.into(), f64::from((RADIUS + 10) * FINE)));
                area.draw(&Text::new(format!("{angle}°"), place, label))?;
            }
        }

        // Where the viewer is.
        let viewer = at(-panel.angle, f64::from((RADIUS - 12) * FINE));
        dashes(area, (x.into(), y.into()), viewer, stroke(INK, 1.2))?;
        area.draw(&Circle::new(whole(viewer), 4 * FINE, INK.filled()))?;
        let title = format!("viewer at {}°", panel.angle);
        let style = text_style(14.0, &INK, HPos::Left, VPos::Top);
        area.draw(&Text::new(title, (x - RADIUS * FINE, y - (RADIUS + ABOVE - 8) * FINE), style))?;

        for (color, curve) in &panel.curves {
            let mut points: Vec<(i32, i32)> = Vec::new();
            for &(angle, value) in curve.iter().filter(|(a, _)| full || a.abs() <= 90.0) {
                let point = whole(at(angle, radius(value)));
                if points.last() != Some(&point) {
                    points.push(point);
                }
            }
            if points.len() > 2 {
                area.draw(&Polygon::new(points.clone(), color.mix(0.10)))?;
                area.draw(&PathElement::new(points, stroke(*color, 2.0)))?;
            }
        }
        // The longest first, so that shorter ones at the same angle stay visible.
        let mut spikes = panel.spikes.clone();
        spikes.sort_by(|a, b| b.2.total_cmp(&a.2));
        for (color, angle, weight) in spikes {
            let length = f64::from((RADIUS - 16) * FINE) * weight.clamp(0.0, 1.0).sqrt();
            let tip = whole(at(angle, length));
            area.draw(&PathElement::new(vec![(x, y), tip], stroke(color, 3.5)))?;
            area.draw(&Circle::new(tip, 5 * FINE, color.filled()))?;
            let label = text_style(12.0, &INK, HPos::Left, VPos::Center);
            area.draw(&Text::new(format!("{weight:.3}"), (tip.0 + 9 * FINE, tip.1), label))?;
        }
        Ok(())
    }
}

/// A power of ten in few letters.
fn decade(value: f64) -> String {
    if value < 0.99 {
        return format!("{value:.1}");
    }
    if value < 9999.0 { format!("{value:.0}") } else { format!("1e{:.0}", libm::log10(value)) }
}
