//! How the light of an equirectangular image is spread over directions: a table of cells to sample directions from.

use std::f32::consts::TAU;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::Vec3;
use rayon::prelude::*;

use super::bounds::angle;
use super::facing::{self, Facing};
use super::grid::Grid;
use crate::color::Rgb;
use crate::math::Real;
use crate::scene::Image;
use crate::scene::environment::Equirectangular;
use crate::scene::texture::{Encoding, Wrap};

/// Cells of equal azimuth and rows of polar angle, between whose corners the interpolated image is simple enough to be
/// integrated exactly. It depends on the image and the mapping alone, not on how the environment is turned or tinted.
///
/// Cells are gathered into regions. How light is spread within one is the same for all; which region is chosen depends on the way that the
/// surface faces, by the light times its mean cosine there. So what lies behind a surface is never chosen, and a bright sun there takes
/// nothing from the sky before it.
#[derive(Debug)]
pub struct EnvironmentTable {
    columns: usize,
    /// Cosines of the polar angle between rows, from 1 down to -1.
    row_cosines: Vec<f32>,
    /// The first column and row of each region, and the end.
    region_columns: Vec<usize>,
    region_rows: Vec<usize>,
    /// Which region: of light as it is seen from all sides.
    from_everywhere: Grid,
    /// Which, for surfaces of each [`super::facing`].
    by_facing: Vec<Grid>,
    /// Which cell of a region, row by row.
    in_region: Vec<Grid>,
    /// ∫ radiance dω by channel, to the accuracy of one row's height.
    total: [f64; 3],
    /// How much of the luminance is left for the table to find.
    share: f64,
}

/// Regions are at most so many.
const REGION_COLUMNS: usize = 64;
const REGION_ROWS: usize = 32;

/// Of light that falls on a surface, this part of its mean is left to BSDF sampling.
const LEFT_TO_BSDF: f64 = 0.5;

/// What else finds the light that a table is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Nothing: the density is in proportion to the light.
    None,
    /// BSDF sampling, with weights that sum to one: the density is in proportion to what the light exceeds its mean by, on surfaces half of its
    /// mean, and 0 elsewhere (Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling").
    Bsdf,
}

/// Less of the luminance than this exceeds the mean by rounding alone: the image is even.
const ROUNDING: f64 = 1e-5;

impl EnvironmentTable {
    /// The table of an image of linear radiance.
    pub fn new(image: &Image, mapping: Equirectangular, partner: Partner) -> Self {
        let (columns, row_count) = match mapping {
            Equirectangular::YUp => (image.width as usize, image.height as usize),
            // Between aligned corners there is one cell less than there are pixels.
            Equirectangular::Aris => ((image.width as usize - 1).max(1), (image.height as usize - 1).max(1)),
        };
        let polar_cosine = |row: usize| Real::cos(std::f64::consts::PI * row as f64 / row_count as f64);
        let cosines: Vec<f64> = (0..=row_count).map(polar_cosine).collect();
        let cell_azimuth = std::f64::consts::TAU / columns as f64;

        let (luminances, sums): (Vec<Vec<f32>>, Vec<[f64; 3]>) = (0..row_count)
            .into_par_iter()
            .map(|row| {
                let cells = cell_means(image, mapping, row, columns);
                let channels: [fn(&Rgb) -> f32; 3] = [|c| c.r, |c| c.g, |c| c.b];
                let sum = channels.map(|channel| {
                    cells.iter().map(|c| f64::from(channel(c).max(0.0))).sum::<f64>()
                        * (cosines[row] - cosines[row + 1])
                        * cell_azimuth
                });
                (cells.iter().map(|c| c.luminance()).collect(), sum)
            })
            .unzip();
        let total = [0, 1, 2].map(|channel| sums.iter().map(|row| row[channel]).sum::<f64>());
        let region_columns = bounds(columns, REGION_COLUMNS);
        let region_rows = bounds(row_count, REGION_ROWS);
        let (regions, in_region) = Regions::of(&luminances, &cosines, &region_rows, &region_columns);
        let left = |part: f64| if partner == Partner::Bsdf { part } else { 0.0 };
        let weights = regions.weights(left(1.0), |_| 1.0);
        let (from_everywhere, sampled) = (Grid::new(&weights, regions.columns), weights.iter().sum::<f64>());
        let share = if sampled > ROUNDING * luminance(total) { sampled / luminance(total) } else { 0.0 };
        let by_facing = (0..facing::COUNT)
            .into_par_iter()
            .map(|cell| {
                let facing = Facing::new(cell);
                let cosine = |r: &Region| f64::from(facing.mean_cosine(r.middle, &r.some, r.radius));
                Grid::new(&regions.weights(left(LEFT_TO_BSDF), cosine), regions.columns)
            })
            .collect();
        Self {
            columns,
            row_cosines: cosines.into_iter().map(|cosine| cosine as f32).collect(),
            region_columns,
            region_rows,
            from_everywhere,
            by_facing,
            in_region,
            total,
            share,
        }
    }

    /// ∫ luminance dω of the image tinted by `scale`, to the accuracy of one row's height.
    pub(super) fn total_luminance(&self, scale: Rgb) -> f64 {
        let [r, g, b] = self.total;
        luminance([r * f64::from(scale.r), g * f64::from(scale.g), b * f64::from(scale.b)])
    }

    /// How much of that is left for [`Self::sample`] to find.
    pub(super) fn share(&self) -> f64 {
        self.share
    }

    /// Azimuth as a fraction of a turn, cosine of the polar angle, and density per unit solid angle, of light that falls on a surface of unit
    /// `normal` ([`direction`]), or on none. `digits` continue those of `u`.
    #[inline]
    pub(super) fn sample(
        &self,
        normal: Option<Vec3>,
        u: [f32; 2],
        digits: [f32; 2],
    ) -> Option<(f32, f32, f32)> {
        let region = self.regions(normal).sample(u, digits)?;
        let in_region = &self.in_region[self.region_index(region.column, region.row)];
        let cell = in_region.sample(region.rest, digits)?;
        let column = self.region_columns[region.column] + cell.column;
        let row = self.region_rows[region.row] + cell.row;
        let pdf = self.per_solid_angle(row, region.probability * cell.probability);
        let (top, bottom) = (self.row_cosines[row], self.row_cosines[row + 1]);
        let azimuth = (column as f32 + cell.rest[0]) / self.columns as f32;
        (pdf > 0.0).then_some((azimuth, top + (bottom - top) * cell.rest[1], pdf))
    }

    /// The density at fractions of a turn and of the polar angle.
    #[inline]
    pub(super) fn pdf(&self, normal: Option<Vec3>, u: f32, v: f32) -> f32 {
        let rows = self.row_cosines.len() - 1;
        let column = ((u * self.columns as f32) as usize).min(self.columns - 1);
        let row = ((v * rows as f32) as usize).min(rows - 1);
        let (region_column, region_row) =
            (part_of(column, self.columns, REGION_COLUMNS), part_of(row, rows, REGION_ROWS));
        let cell = self.in_region[self.region_index(region_column, region_row)]
            .probability(column - self.region_columns[region_column], row - self.region_rows[region_row]);
        let region = self.regions(normal).probability(region_column, region_row);
        self.per_solid_angle(row, region * cell)
    }

    #[inline]
    fn regions(&self, normal: Option<Vec3>) -> &Grid {
        normal.and_then(facing::cell_of).map_or(&self.from_everywhere, |cell| &self.by_facing[cell])
    }

    #[inline]
    fn region_index(&self, column: usize, row: usize) -> usize {
        row * (self.region_columns.len() - 1) + column
    }

    /// The density in a cell of a row, over which it is constant.
    #[inline]
    fn per_solid_angle(&self, row: usize, probability: f32) -> f32 {
        let solid_angle = (self.row_cosines[row] - self.row_cosines[row + 1]) * TAU / self.columns as f32;
        // At the poles of an image of thousands of rows the band is empty in f32.
        if solid_angle > 0.0 { probability / solid_angle } else { 0.0 }
    }
}

/// All regions, row by row.
struct Regions {
    all: Vec<Region>,
    columns: usize,
}

impl Regions {
    /// Those of cells of such luminances, in rows between such cosines, that begin at such rows and columns; and the choice of a cell in each.
    fn of(luminances: &[Vec<f32>], cosines: &[f64], rows: &[usize], columns: &[usize]) -> (Self, Vec<Grid>) {
        let count = luminances[0].len() as f64;
        let (width, height) = (columns.len() - 1, rows.len() - 1);
        let region = |at: usize| {
            let rows = rows[at / width]..rows[at / width + 1];
            let columns = columns[at % width]..columns[at % width + 1];
            let cell = |row: usize| (cosines[row] - cosines[row + 1]) * std::f64::consts::TAU / count;
            let power_in = |row: usize| {
                luminances[row][columns.clone()].iter().map(move |l| f64::from(l.max(0.0)) * cell(row))
            };
            let cells: Vec<f64> = rows.clone().flat_map(power_in).collect();
            let power = cells.iter().sum();
            let turns = [columns.start, columns.end].map(|column| (column as f64 / count) as f32);
            let ends = [rows.start, rows.end].map(|row| cosines[row] as f32);
            let solid_angle = rows.map(cell).sum::<f64>() * columns.len() as f64;
            (Region::new(power, solid_angle, turns, ends), Grid::new(&cells, columns.len()))
        };
        let (all, cells) = (0..width * height).into_par_iter().map(region).unzip();
        (Self { all, columns: width }, cells)
    }

    /// What each has of the luminance that exceeds `left` times the mean, where all counts by a cosine.
    fn weights(&self, left: f64, cosine: impl Fn(&Region) -> f64) -> Vec<f64> {
        let cosines: Vec<f64> = self.all.iter().map(cosine).collect();
        let sum = |of: fn(&Region) -> f64| -> f64 {
            self.all.iter().zip(&cosines).map(|(region, cosine)| of(region) * cosine).sum()
        };
        let left = left * sum(|region| region.power) / sum(|region| region.solid_angle);
        let excess = |region: &Region| (region.power - left * region.solid_angle).max(0.0);
        self.all.iter().zip(&cosines).map(|(region, cosine)| excess(region) * cosine).collect()
    }
}

/// What a region is chosen by.
struct Region {
    /// ∫ luminance dω.
    power: f64,
    solid_angle: f64,
    middle: Vec3,
    /// The middles of its quarters.
    some: [Vec3; 4],
    /// How far it reaches from the middle, in radians.
    radius: f32,
}

impl Region {
    fn new(power: f64, solid_angle: f64, turns: [f32; 2], cosines: [f32; 2]) -> Self {
        let between = |[a, b]: [f32; 2], t: f32| a * (1.0 - t) + b * t;
        let at = |s: f32, t: f32| direction(between(turns, s), between(cosines, t));
        let ends = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let middle = at(0.5, 0.5);
        Self {
            power,
            solid_angle,
            middle,
            some: ends.map(|(s, t)| at(0.25 + 0.5 * s, 0.25 + 0.5 * t)),
            radius: ends.map(|(s, t)| angle(middle, at(s, t))).into_iter().fold(0.0, f32::max),
        }
    }
}

/// The direction at a fraction of a turn and a cosine of the polar angle, where the pole is z.
fn direction(turn: f32, cosine: f32) -> Vec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    Vec3::new(sine * Real::cos(TAU * turn), sine * Real::sin(TAU * turn), cosine)
}

/// Where as many parts of `count` things begin as there may be, and the end.
fn bounds(count: usize, most: usize) -> Vec<usize> {
    let parts = count.min(most);
    (0..=parts).map(|part| (part * count).div_ceil(parts)).collect()
}

/// The part that thing `index` is in.
#[inline]
fn part_of(index: usize, count: usize, most: usize) -> usize {
    index * count.min(most) / count
}

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    Rgb::new(r, g, b).luminance()
}

/// The mean of the interpolated image over each cell of a row, by azimuth and polar angle. It is 0 only where the whole cell is black.
fn cell_means(image: &Image, mapping: Equirectangular, row: usize, columns: usize) -> Vec<Rgb> {
    // Interpolation is linear between pixel centres, where cells of aligned corners end, and others have their middle: there the
    // trapezoids on both sides reach halfway to the neighbours' values.
    let (before, here, after) = match mapping {
        Equirectangular::YUp => (0.125, 0.75, 0.125),
        Equirectangular::Aris => (0.0, 0.5, 0.5),
    };
    let line = |dy: i64| {
        let y = Wrap::Clamp.pixel(row as i64 + dy, image.height);
        (0..image.width).map(move |x| image.texel(x, y, Encoding::Linear).color)
    };
    let blended: Vec<Rgb> = line(-1)
        .zip(line(0))
        .zip(line(1))
        .map(|((above, at), below)| above * before + at * here + below * after)
        .collect();
    let wrap = if mapping == Equirectangular::YUp { Wrap::Repeat } else { Wrap::Clamp };
    let at = |x: i64| blended[wrap.pixel(x, image.width) as usize];
    (0..columns as i64).map(|x| at(x - 1) * before + at(x) * here + at(x + 1) * after).collect()
}

/// Tables that jobs share which have the same environment, made when first asked for.
#[derive(Debug, Default)]
pub struct EnvironmentTables {
    /// The latest last.
    kept: Mutex<Vec<Kept>>,
}

#[derive(Debug)]
struct Kept {
    image: Arc<Image>,
    mapping: Equirectangular,
    partner: Partner,
    table: Arc<EnvironmentTable>,
}

/// So many tables are kept: each is about as large as its image.
const MOST_KEPT: usize = 4;

impl EnvironmentTables {
    /// The image of the same pixels that a table is known of, if there is one, else `image` itself.
    pub fn known(&self, image: &Arc<Image>) -> Arc<Image> {
        let kept = self.lock();
        let found = kept.iter().find(|k| Arc::ptr_eq(&k.image, image) || k.image == *image);
        Arc::clone(found.map_or(image, |k| &k.image))
    }

    /// The table of an image, be it the same one or one of the same pixels.
    pub fn get(
        &self,
        image: &Arc<Image>,
        mapping: Equirectangular,
        partner: Partner,
    ) -> Arc<EnvironmentTable> {
        let wanted = |k: &Kept| {
            (k.mapping, k.partner) == (mapping, partner)
                && (Arc::ptr_eq(&k.image, image) || k.image == *image)
        };
        let take = || {
            let mut kept = self.lock();
            kept.iter().position(wanted).map(|place| kept.remove(place))
        };
        // Made without the lock: rayon's threads may come here again while they wait for parts of it.
        let entry = take().unwrap_or_else(|| {
            let table = Arc::new(EnvironmentTable::new(image, mapping, partner));
            Kept { image: Arc::clone(image), mapping, partner, table }
        });
        let table = Arc::clone(&entry.table);
        let mut kept = self.lock();
        if kept.len() >= MOST_KEPT {
            kept.remove(0);
        }
        kept.push(entry);
        table
    }

    /// A thread that panicked elsewhere has left whole entries.
    fn lock(&self) -> MutexGuard<'_, Vec<Kept>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::scene::texture::Pixels;

    fn image(value: impl Fn(u32, u32) -> f32) -> Arc<Image> {
        let (width, height) = (16, 8);
        let pixels =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
        Arc::new(Image { name: "test".into(), width, height, channels: 1, pixels: Pixels::F32(pixels) })
    }

    fn random(i: u32, salt: u64) -> f32 {
        unit_f32(combine(u64::from(i), salt) as u32)
    }

    /// Fractions of a turn and of the polar angle, even by solid angle.
    fn anywhere(i: u32) -> (f32, f32) {
        let cos = 1.0 - 2.0 * random(i, 2);
        (random(i, 1), Real::acos(cos) / std::f32::consts::PI)
    }

    #[test]
    fn densities_integrate_to_one_with_and_without_a_partner() {
        let sky = image(|x, y| if (x, y) == (5, 2) { 50.0 } else { (x % 3) as f32 + y as f32 });
        for mapping in [Equirectangular::YUp, Equirectangular::Aris] {
            for partner in [Partner::None, Partner::Bsdf] {
                let table = EnvironmentTable::new(&sky, mapping, partner);
                let n = 400_000;
                let sum: f64 = (0..n).map(anywhere).map(|(u, v)| f64::from(table.pdf(None, u, v))).sum();
                let integral = sum * 4.0 * std::f64::consts::PI / f64::from(n);
                assert!((integral - 1.0).abs() < 0.02, "{mapping:?} {partner:?}: {integral}");
            }
        }
    }

    #[test]
    fn a_partner_finds_what_is_below_the_mean() {
        // Rows of 1 above and 3 below: the mean is 2, and each row of cells is even but for the four next to the middle.
        let halves = image(|_, y| if y < 4 { 1.0 } else { 3.0 });
        let table = EnvironmentTable::new(&halves, Equirectangular::YUp, Partner::Bsdf);
        assert_eq!(table.pdf(None, 0.3, 0.1), 0.0);
        assert!(table.pdf(None, 0.3, 0.9) > 0.0);
        // Of 3 - 2 on half of the sphere; of 2.75 - 2 in the row next to the middle, where both are blended.
        let blended = Real::cos(3.0 * std::f64::consts::PI / 8.0);
        let share = ((1.0 - blended) + 0.75 * blended) / 4.0;
        assert!((table.share() - share).abs() < 1e-6, "{} {share}", table.share());
        let alone = EnvironmentTable::new(&halves, Equirectangular::YUp, Partner::None);
        assert!(alone.pdf(None, 0.3, 0.1) > 0.0 && (alone.share() - 1.0).abs() < 1e-6);
        let even = EnvironmentTable::new(&image(|_, _| 0.7), Equirectangular::YUp, Partner::Bsdf);
        assert_eq!(even.share(), 0.0);
    }

    /// A sun below, and a dim sky: a floor is lit by the sky, and a ceiling by the sun.
    #[test]
    fn what_lies_behind_a_surface_is_not_sampled_for_it() {
        let sky = image(|x, y| if (x, y) == (5, 6) { 5000.0 } else { 1.0 });
        let table = EnvironmentTable::new(&sky, Equirectangular::YUp, Partner::Bsdf);
        let sun = (5.5 / 16.0, 6.5 / 8.0);
        assert!(table.pdf(None, sun.0, sun.1) > 1.0);
        assert_eq!(table.pdf(None, 0.3, 0.2), 0.0, "below the mean");
        let chosen = |normal: Vec3| {
            let sample = |i| table.sample(Some(normal), [random(i, 3), random(i, 4)], [0.5; 2]);
            (0..1000)
                .map(|i| sample(i).expect("a direction").1)
                .fold((1.0f32, -1.0f32), |(low, high), cosine| (low.min(cosine), high.max(cosine)))
        };
        assert_eq!(table.pdf(Some(Vec3::Z), sun.0, sun.1), 0.0);
        assert!(table.pdf(Some(Vec3::Z), 0.3, 0.2) > 0.1);
        assert!(chosen(Vec3::Z).0 > -0.4 && chosen(Vec3::Z).1 > 0.9, "{:?}", chosen(Vec3::Z));
        assert!(table.pdf(Some(-Vec3::Z), sun.0, sun.1) > 1.0);
        assert!(chosen(-Vec3::Z).1 < -0.3, "{:?}", chosen(-Vec3::Z));
    }

    #[test]
    fn equal_images_share_a_table_until_others_take_its_place() {
        let tables = EnvironmentTables::default();
        let get = |value: f32| tables.get(&image(|_, _| value), Equirectangular::YUp, Partner::None);
        let first = get(1.0);
        assert!(Arc::ptr_eq(&first, &get(1.0)));
        assert!(!Arc::ptr_eq(&first, &tables.get(&image(|_, _| 1.0), Equirectangular::YUp, Partner::Bsdf)));
        for value in 2..=MOST_KEPT as u32 + 1 {
            get(value as f32);
        }
        assert!(!Arc::ptr_eq(&first, &get(1.0)));
    }
}
