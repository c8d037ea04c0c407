//! A choice among the cells of a grid.

use super::Distribution;

/// Chooses a row and then a column by given weights.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    rows: Distribution,
    in_row: Vec<Distribution>,
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
        let in_row = weights.chunks(columns).map(Distribution::new).collect();
        Self { rows: Distribution::new(&sums), in_row }
    }

    /// The first number chooses the column, the second the row. `digits` continue theirs, which rarely chosen cells leave few of.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], digits: [f32; 2]) -> Option<Cell> {
        let (row, p_row, rest_v) = self.rows.sample_with_rest(u[1])?;
        let (column, p_column, rest_u) = self.in_row[row].sample_with_rest(u[0])?;
        let continued = |rest: f32, digits: f32, probability: f32| {
            (rest + digits * (Distribution::STEP / probability)).min(1.0 - f32::EPSILON / 2.0)
        };
        let rest = [continued(rest_u, digits[0], p_column), continued(rest_v, digits[1], p_row)];
        Some(Cell { column, row, probability: p_row * p_column, rest })
    }

    /// The probability of a cell.
    #[inline]
    pub(super) fn probability(&self, column: usize, row: usize) -> f32 {
        self.rows.probability(row) * self.in_row[row].probability(column)
    }
}
