//! [`Banded`]: symmetric matrices of a few diagonals, as L D Lᵀ.

use std::ops::{Index, IndexMut};

/// A symmetric matrix whose entries lie on the diagonal and at most `band` columns before it.
#[derive(Clone, Debug)]
pub(crate) struct Banded {
    band: usize,
    /// Row after row, the diagonal last.
    entries: Vec<f64>,
}

impl Banded {
    /// A matrix of zeros.
    pub fn new(rows: usize, band: usize) -> Self {
        Banded { band, entries: vec![0.0; rows * (band + 1)] }
    }

    pub fn rows(&self) -> usize {
        self.entries.len() / (self.band + 1)
    }

    /// The largest magnitude on the diagonal.
    pub fn largest(&self) -> f64 {
        (0..self.rows()).map(|row| self[(row, row)].abs()).fold(0.0, f64::max)
    }

    /// self + weight · other, of the same shape.
    pub fn plus(mut self, weight: f64, other: &Banded) -> Self {
        self.entries.iter_mut().zip(&other.entries).for_each(|(x, other)| *x += weight * other);
        self
    }

    /// Replaces the matrix by its factors, without pivoting. Returns the smallest entry of D, or NaN.
    pub fn factor(&mut self) -> f64 {
        let mut smallest = f64::INFINITY;
        for row in 0..self.rows() {
            let first = row.saturating_sub(self.band);
            for column in first..=row {
                let mut entry = self[(row, column)];
                for k in first..column {
                    // Columns before the band of the other row hold nothing.
                    if k + self.band >= column {
                        entry -= self[(row, k)] * self[(column, k)] * self[(k, k)];
                    }
                }
                self[(row, column)] = if column < row { entry / self[(column, column)] } else { entry };
            }
            let pivot = self[(row, row)];
            smallest = if pivot.is_nan() || smallest.is_nan() { f64::NAN } else { smallest.min(pivot) };
        }
        smallest
    }

    /// Solves in place, once the matrix is factored.
    pub fn solve(&self, x: &mut [f64]) {
        for row in 0..x.len() {
            for k in row.saturating_sub(self.band)..row {
                x[row] -= self[(row, k)] * x[k];
            }
        }
        for (row, x) in x.iter_mut().enumerate() {
            *x /= self[(row, row)];
        }
        for row in (0..x.len()).rev() {
            for k in row.saturating_sub(self.band)..row {
                x[k] -= self[(row, k)] * x[row];
            }
        }
    }
}

/// By row and column, column ≤ row ≤ column + band.
impl Index<(usize, usize)> for Banded {
    type Output = f64;

    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        &self.entries[row * (self.band + 1) + self.band + column - row]
    }
}

impl IndexMut<(usize, usize)> for Banded {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        &mut self.entries[row * (self.band + 1) + self.band + column - row]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solution_satisfies_the_system() {
        for (rows, band) in [(1, 0), (2, 3), (9, 2), (30, 5)] {
            let mut matrix = Banded::new(rows, band);
            for row in 0..rows {
                for column in row.saturating_sub(band)..row {
                    matrix[(row, column)] = ((3 * row + column) as f64).sin();
                }
                matrix[(row, row)] = 2.0 * band as f64 + 1.0;
            }
            let wanted: Vec<f64> = (0..rows).map(|row| (row as f64).cos()).collect();
            let at = |i: usize, j: usize| if i.abs_diff(j) > band { 0.0 } else { matrix[(i.max(j), i.min(j))] };
            let mut x: Vec<f64> = (0..rows).map(|i| (0..rows).map(|j| at(i, j) * wanted[j]).sum()).collect();
            let mut factors = matrix.clone();
            assert!(factors.factor() > 0.0);
            factors.solve(&mut x);
            assert!(x.iter().zip(&wanted).all(|(x, wanted)| (x - wanted).abs() < 1e-13), "{rows} {band}: {x:?}");
        }
        let mut indefinite = Banded::new(2, 1);
        (indefinite[(0, 0)], indefinite[(1, 0)], indefinite[(1, 1)]) = (1.0, 2.0, 1.0);
        assert_eq!((indefinite.largest(), indefinite.factor()), (1.0, -3.0));
    }
}
