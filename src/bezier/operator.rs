//! [`Operator`]: a small matrix that a group of curves shares. Twin: shaders/bezier/operator.wgsl.

use super::exact::Matrix;
use crate::linalg::Real;

/// Rows computed side by side: an AVX2 register of f64.
pub(super) const BLOCK: usize = 4;

/// A matrix applied to the points of a curve, each coordinate alike.
#[derive(Clone, Debug)]
pub(super) struct Operator<T> {
    rows: usize,
    columns: usize,
    /// Rows in blocks of [`BLOCK`], padded with zeros. A block is stored column by column.
    blocks: Vec<[T; BLOCK]>,
}

impl<T: Real> Operator<T> {
    /// The matrix of these entries.
    pub fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let of = |i: usize, j: usize| if i < rows { T::from_f64(entry(i, j)) } else { T::ZERO };
        let blocks = (0..rows.div_ceil(BLOCK))
            .flat_map(|block| (0..columns).map(move |j| (block, j)))
            .map(|(block, j)| std::array::from_fn(|k| of(block * BLOCK + k, j)))
            .collect();
        Operator { rows, columns, blocks }
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows in blocks of [`BLOCK`], padded with zeros. A block is stored column by column.
    pub fn blocks(&self) -> &[[T; BLOCK]] {
        &self.blocks
    }

    /// An entry.
    pub fn at(&self, i: usize, j: usize) -> T {
        self.blocks[i / BLOCK * self.columns + j][i % BLOCK]
    }

    /// Passes the sum of entries times points to `put`, row by row.
    ///
    /// Sums run from the first column to the last, so a curve's bits do not depend on other curves.
    #[inline(always)]
    pub fn apply<const D: usize>(&self, points: &[[T; D]], mut put: impl FnMut(usize, [T; D])) {
        debug_assert_eq!(points.len(), self.columns);
        for block in 0..self.rows.div_ceil(BLOCK) {
            let columns = &self.blocks[block * self.columns..][..self.columns];
            let mut sums = [[T::ZERO; BLOCK]; D];
            for (entries, point) in columns.iter().zip(points) {
                for c in 0..D {
                    for k in 0..BLOCK {
                        sums[c][k] += entries[k] * point[c];
                    }
                }
            }
            for row in block * BLOCK..self.rows.min((block + 1) * BLOCK) {
                put(row, std::array::from_fn(|c| sums[c][row % BLOCK]));
            }
        }
    }
}

impl Operator<f64> {
    /// An exact matrix, rounded.
    pub fn from_exact(matrix: &Matrix) -> Self {
        Self::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix.f64_at(i, j))
    }

    /// A matrix from its rows, which may be short.
    pub fn from_rows(columns: usize, rows: impl Iterator<Item = Vec<f64>>) -> Self {
        let rows: Vec<Vec<f64>> = rows.collect();
        Self::from_fn(rows.len(), columns, |i, j| rows[i].get(j).copied().unwrap_or(0.0))
    }
}
