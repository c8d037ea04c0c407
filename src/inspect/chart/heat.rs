//! f·cos θ and the density of sampling over all directions, as maps of longitude and latitude.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::inspect::maps::{COLUMNS, Map};
use crate::inspect::measure::View;
use crate::report::chart::{Drawing, FAINT, FINE, Figure, INK, text_style};

const WIDTH: u32 = 880;
/// A map's columns in pixels.
const MAP_WIDTH: i32 = 400;
/// A cell's height in pixels.
const CELL: i32 = 5;
/// Room above and below a map.
const ABOVE: i32 = 30;
const BELOW: i32 = 26;
/// Decades from the darkest to the brightest colour.
const DECADES: f64 = 4.0;

/// Viridis (Smith and van der Walt 2015) at equal steps.
const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// Pairs of maps, one a view that has them.
pub(crate) struct Heat<'a> {
    pub(crate) views: &'a [View],
}

impl Heat<'_> {
    /// Each map with what makes the integral of what is wanted 1.
    fn maps(&self) -> impl Iterator<Item = (&Map, f64)> {
        self.views.iter().filter_map(|view| Some((view.map.as_ref()?, 1.0 / view.estimate.smooth)))
    }
}

impl Figure for Heat<'_> {
    fn size(&self) -> (u32, u32) {
        let height = |map: &Map| ABOVE + BELOW + CELL * map.rows as i32;
        (WIDTH, self.maps().map(|(map, _)| height(map)).sum::<i32>() as u32)
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawing<DB>
    where
        DB::ErrorType: 'static,
    {
        let mut top = 0;
        for (map, scale) in self.maps() {
            let wanted: Vec<f64> = map.wanted.iter().map(|v| v * scale).collect();
            let largest = wanted.iter().chain(&map.density).copied().fold(0.0, f64::max);
            for (i, (name, values)) in
                (0..).zip([("f·cos θ / albedo", &wanted), ("density of sampling", &map.density)])
            {
                let left = (WIDTH as i32 / 4 * (1 + 2 * i) - MAP_WIDTH / 2) * FINE;
                let heading = format!("viewer at {}°: {name}", map.angle);
                let style = text_style(13.0, &INK, HPos::Left, VPos::Center);
                area.draw(&Text::new(heading, (left, (top + ABOVE / 2) * FINE), style))?;
                draw_map(area, map, values, largest, (left, (top + ABOVE) * FINE))?;
            }
            top += ABOVE + BELOW + CELL * map.rows as i32;
        }
        Ok(())
    }
}

fn draw_map<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    map: &Map,
    values: &[f64],
    largest: f64,
    (left, top): (i32, i32),
) -> Drawing<DB> {
    let column = |i: usize| left + MAP_WIDTH * FINE * i as i32 / COLUMNS as i32;
    let row = |j: usize| top + CELL * FINE * j as i32;
    for (at, &value) in values.iter().enumerate() {
        let (i, j) = (at % COLUMNS, at / COLUMNS);
        let t = if value > 0.0 { 1.0 + libm::log10(value / largest) / DECADES } else { 0.0 };
        let cell = [(column(i), row(j)), (column(i + 1) - 1, row(j + 1) - 1)];
        area.draw(&Rectangle::new(cell, viridis(t).filled()))?;
    }
    let label = |h| text_style(11.0, &FAINT, h, VPos::Top);
    let y = row(map.rows) + 4 * FINE;
    for (i, h, text) in [
        (0, HPos::Left, "-180°".to_owned()),
        (
            COLUMNS / 2,
            HPos::Center,
            format!("azimuth about the normal; rows: 0° to {}° from it", 2 * map.rows),
        ),
        (COLUMNS, HPos::Right, "180°".to_owned()),
    ] {
        area.draw(&Text::new(text, (column(i), y), label(h)))?;
    }
    Ok(())
}

/// The colour of t in [0, 1].
fn viridis(t: f64) -> RGBColor {
    let at = t.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let mix = |c: usize| {
        let (a, b) = (f64::from(VIRIDIS[i][c]), f64::from(VIRIDIS[i + 1][c]));
        (a + (b - a) * (at - i as f64)).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}
