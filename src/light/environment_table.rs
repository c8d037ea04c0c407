//! How the light of an equirectangular image is spread over directions: a table of cells to sample directions from.

use std::f32::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::Distribution;
use crate::color::Rgb;
use crate::math::Real;
use crate::scene::Image;
use crate::scene::environment::Equirectangular;
use crate::scene::texture::{Encoding, Wrap};

/// Cells of equal azimuth and rows of polar angle, between whose corners the interpolated image is simple enough to be
/// integrated exactly. It depends on the image and the mapping alone, not on how the environment is turned or tinted.
#[derive(Debug)]
pub struct EnvironmentTable {
    columns: usize,
    /// Cosines of the polar angle between rows, from 1 down to -1.
    row_cosines: Vec<f32>,
    rows: Distribution,
    in_row: Vec<Distribution>,
    /// ∫ radiance dω by channel, to the accuracy of one row's height.
    total: [f64; 3],
    /// How much of the luminance is left for the table to find.
    share: f64,
}

/// What else finds the light that a table is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Nothing: the density is in proportion to the light.
    None,
    /// BSDF sampling, with weights that sum to one: the density is in proportion to what the light exceeds its mean by, and 0 elsewhere
    /// (Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling").
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
        let band = |row: usize| polar_cosine(row) - polar_cosine(row + 1);
        let cell_azimuth = std::f64::consts::TAU / columns as f64;

        let (luminances, sums): (Vec<Vec<f32>>, Vec<[f64; 3]>) = (0..row_count)
            .into_par_iter()
            .map(|row| {
                let cells = cell_means(image, mapping, row, columns);
                let channels: [fn(&Rgb) -> f32; 3] = [|c| c.r, |c| c.g, |c| c.b];
                let sum = channels.map(|channel| {
                    cells.iter().map(|c| f64::from(channel(c).max(0.0))).sum::<f64>()
                        * band(row)
                        * cell_azimuth
                });
                (cells.iter().map(|c| c.luminance()).collect(), sum)
            })
            .unzip();
        let total = [0, 1, 2].map(|channel| sums.iter().map(|row| row[channel]).sum::<f64>());
        let expected = match partner {
            Partner::None => 0.0,
            Partner::Bsdf => luminance(total) / (4.0 * std::f64::consts::PI),
        };
        let (in_row, weights): (Vec<Distribution>, Vec<f64>) = luminances
            .into_par_iter()
            .enumerate()
            .map(|(row, cells)| {
                let weights: Vec<f64> = cells.iter().map(|&c| (f64::from(c) - expected).max(0.0)).collect();
                (Distribution::new(&weights), weights.iter().sum::<f64>() * band(row) * cell_azimuth)
            })
            .unzip();
        let sampled = weights.iter().sum::<f64>();
        let share = if sampled > ROUNDING * luminance(total) { sampled / luminance(total) } else { 0.0 };
        let row_cosines = (0..=row_count).map(|row| polar_cosine(row) as f32).collect();
        Self { columns, row_cosines, rows: Distribution::new(&weights), in_row, total, share }
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

    /// Azimuth as a fraction of a turn, cosine of the polar angle, and density per unit solid angle.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<(f32, f32, f32)> {
        let (row, _, in_row) = self.rows.sample_with_rest(u[1])?;
        let (column, _, in_column) = self.in_row[row].sample_with_rest(u[0])?;
        let (top, bottom) = (self.row_cosines[row], self.row_cosines[row + 1]);
        let pdf = self.cell_pdf(column, row);
        let azimuth = (column as f32 + in_column) / self.columns as f32;
        (pdf > 0.0).then_some((azimuth, top + (bottom - top) * in_row, pdf))
    }

    /// The density at fractions of a turn and of the polar angle.
    #[inline]
    pub(super) fn pdf(&self, u: f32, v: f32) -> f32 {
        let column = ((u * self.columns as f32) as usize).min(self.columns - 1);
        let row = ((v * self.in_row.len() as f32) as usize).min(self.in_row.len() - 1);
        self.cell_pdf(column, row)
    }

    /// Constant over a cell, per unit solid angle.
    #[inline]
    fn cell_pdf(&self, column: usize, row: usize) -> f32 {
        let solid_angle = (self.row_cosines[row] - self.row_cosines[row + 1]) * TAU / self.columns as f32;
        // At the poles of an image of thousands of rows the band is empty in f32.
        if solid_angle > 0.0 {
            self.rows.probability(row) * self.in_row[row].probability(column) / solid_angle
        } else {
            0.0
        }
    }
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

/// So many tables are kept: each is as large as its image.
const MOST_KEPT: usize = 4;

impl EnvironmentTables {
    /// The image of the same pixels that a table is known of, if there is one, else `image` itself.
    pub fn known(&self, image: &Arc<Image>) -> Arc<Image> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
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
        // A thread that panicked elsewhere has left whole entries.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = match kept.iter().position(wanted) {
            Some(found) => kept.remove(found),
            None => {
                let table = Arc::new(EnvironmentTable::new(image, mapping, partner));
                Kept { image: Arc::clone(image), mapping, partner, table }
            }
        };
        if kept.len() >= MOST_KEPT {
            kept.remove(0);
        }
        let table = Arc::clone(&entry.table);
        kept.push(entry);
        table
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
                let sum: f64 = (0..n).map(anywhere).map(|(u, v)| f64::from(table.pdf(u, v))).sum();
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
        assert_eq!(table.pdf(0.3, 0.1), 0.0);
        assert!(table.pdf(0.3, 0.9) > 0.0);
        // Of 3 - 2 on half of the sphere; of 2.75 - 2 in the row next to the middle, where both are blended.
        let blended = Real::cos(3.0 * std::f64::consts::PI / 8.0);
        let share = ((1.0 - blended) + 0.75 * blended) / 4.0;
        assert!((table.share() - share).abs() < 1e-6, "{} {share}", table.share());
        let alone = EnvironmentTable::new(&halves, Equirectangular::YUp, Partner::None);
        assert!(alone.pdf(0.3, 0.1) > 0.0 && (alone.share() - 1.0).abs() < 1e-6);
        let even = EnvironmentTable::new(&image(|_, _| 0.7), Equirectangular::YUp, Partner::Bsdf);
        assert_eq!(even.share(), 0.0);
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
