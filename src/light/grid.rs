//! A choice among the cells of a grid.

use super::Distribution;
use super::distribution::{between, cumulative};

/// Chooses a row and then a column by given weights.
///
/// What a choice reads lies close together: tables of thousands of grids do not fit in the nearest caches, and their waiting took a sixth of the
/// time of a picture under the sky.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    columns: usize,
    rows: usize,
    /// Cumulative probabilities of the rows, and then of each row's columns, from 0 to 1; all 0 in a row without weight. Empty if no weight
    /// is positive.
    cumulative: Vec<f32>,
}

/// What a [`Grid`] chose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) column: usize,
    pub(super) row: usize,
    pub(super) probability: f32,
    /// Where in it, in [0, 1)².
    pub(super) rest: [f32; 2],
}

impl Grid {
    /// Of the cells' weights, none below 0, in rows of so many columns.
    pub(super) fn new(weights: &[f64], columns: usize) -> Self {
        let sums: Vec<f64> = weights.chunks(columns).map(|row| row.iter().sum()).collect();
        let mut all = cumulative(&sums).unwrap_or_default();
        if !all.is_empty() {
            for row in weights.chunks(columns) {
                all.extend(cumulative(row).unwrap_or_else(|| vec![0.0; columns + 1]));
            }
        }
        Self { columns, rows: sums.len(), cumulative: all }
    }

    /// The first number chooses the column, the second the row. `digits` continue theirs, which rarely chosen cells leave few of.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], digits: [f32; 2]) -> Option<Cell> {
        let (row, p_row, rest_v) = chosen(self.cumulative.get(..=self.rows)?, u[1]);
        let (column, p_column, rest_u) = chosen(self.in_row(row)?, u[0]);
        let continued = |rest: f32, digits: f32, probability: f32| {
            (rest + digits * (Distribution::STEP / probability)).min(1.0 - f32::EPSILON / 2.0)
        };
        let rest = [continued(rest_u, digits[0], p_column), continued(rest_v, digits[1], p_row)];
        Some(Cell { column, row, probability: p_row * p_column, rest })
    }

    /// The probability of a cell.
    #[inline]
    pub(super) fn probability(&self, column: usize, row: usize) -> f32 {
        let of = |cumulative: &[f32], index: usize| cumulative[index + 1] - cumulative[index];
        self.in_row(row).map_or(0.0, |in_row| of(&self.cumulative, row) * of(in_row, column))
    }

    #[inline]
    fn in_row(&self, row: usize) -> Option<&[f32]> {
        let begin = self.rows + 1 + row * (self.columns + 1);
        self.cumulative.get(begin..=begin + self.columns)
    }
}

/// So many numbers are counted sooner than searched.
const FEW: usize = 80;

/// The thing that `u` in [0, 1) falls on, its probability, and where between its ends `u` lies.
#[inline]
fn chosen(cumulative: &[f32], u: f32) -> (usize, f32, f32) {
    // The last number at or below u begins it; impossible things end where they begin.
    let begins = &cumulative[..cumulative.len() - 1];
    let below = if begins.len() <= FEW {
        begins.iter().map(|&c| u32::from(c <= u)).sum::<u32>() as usize
    } else {
        begins.partition_point(|&c| c <= u)
    };
    let index = below - 1;
    let (probability, rest) = between(cumulative[index], cumulative[index + 1], u);
    (index, probability, rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that are counted and rows that are searched; one without weight is never chosen.
    #[test]
    fn cells_come_as_often_as_they_weigh() {
        for columns in [3, FEW, FEW + 1, 300] {
            let weight = |i: usize| if i / columns == 1 { 0.0 } else { (i * i % 7) as f64 };
            let weights: Vec<f64> = (0..4 * columns).map(weight).collect();
            let (grid, total) = (Grid::new(&weights, columns), weights.iter().sum::<f64>());
            for (i, weight) in weights.iter().enumerate() {
                let probability = f64::from(grid.probability(i % columns, i / columns));
                assert!((probability - weight / total).abs() < 1e-6, "{columns}, {i}: {probability}");
            }
            for (row, in_row) in (0..4).filter_map(|row| Some((row, grid.in_row(row)?))) {
                for i in (0..997).filter(|_| row != 1) {
                    let u = i as f32 / 997.0;
                    let expected = in_row.iter().position(|&c| c > u).expect("the end") - 1;
                    assert_eq!(chosen(in_row, u).0, expected, "{columns}, {row}: {u}");
                }
            }
        }
    }

    #[test]
    fn without_weight_there_is_nothing_to_choose() {
        let grid = Grid::new(&[0.0; 6], 3);
        assert!(grid.sample([0.5; 2], [0.5; 2]).is_none());
        assert!(grid.probability(1, 1) <= 0.0);
    }
}
