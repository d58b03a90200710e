//! Matrices of exact rationals for Bézier curves of degree up to 30.

// Index loops read as the formulas do.
#![allow(clippy::needless_range_loop)]

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// A matrix of exact rationals, row after row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    entries: Vec<BigRational>,
}

impl Matrix {
    /// The matrix of these entries.
    pub fn from_fn(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> BigRational) -> Self {
        let entries = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))).map(|(i, j)| entry(i, j)).collect();
        Matrix { rows, columns, entries }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The entry of row `i` and column `j`.
    pub fn at(&self, i: usize, j: usize) -> &BigRational {
        &self.entries[i * self.columns + j]
    }

    /// The entry rounded to f64.
    pub fn f64_at(&self, i: usize, j: usize) -> f64 {
        to_f64(self.at(i, j))
    }

    /// All entries rounded to f64, row after row.
    pub fn to_f64(&self) -> Vec<f64> {
        self.entries.iter().map(to_f64).collect()
    }

    /// The matrix product.
    pub fn times(&self, other: &Matrix) -> Matrix {
        assert_eq!(self.columns, other.rows, "factors that do not fit");
        Matrix::from_fn(self.rows, other.columns, |i, j| {
            let terms = (0..self.columns).filter(|&k| !self.at(i, k).is_zero() && !other.at(k, j).is_zero());
            terms.map(|k| self.at(i, k) * other.at(k, j)).sum()
        })
    }

    /// The transposed matrix.
    pub fn transposed(&self) -> Matrix {
        Matrix::from_fn(self.columns, self.rows, |i, j| self.at(j, i).clone())
    }

    /// The same matrix with every fraction reduced.
    pub(super) fn reduced(&self) -> Matrix {
        Matrix::from_fn(self.rows, self.columns, |i, j| self.at(i, j).reduced())
    }

    /// The least multiple of the matrix that has whole entries.
    pub(super) fn whole(&self) -> Matrix {
        let common = common_denominator(&self.entries);
        Matrix::from_fn(self.rows, self.columns, |i, j| self.at(i, j) * &common)
    }

    /// This + weight · other.
    pub(super) fn plus(&self, weight: &BigRational, other: &Matrix) -> Matrix {
        Matrix::from_fn(self.rows, self.columns, |i, j| self.at(i, j) + weight * other.at(i, j))
    }
}

/// p/q
pub(super) fn ratio(p: impl Into<BigInt>, q: impl Into<BigInt>) -> BigRational {
    BigRational::new(p.into(), q.into())
}

/// The nearest f64.
pub(super) fn to_f64(x: &BigRational) -> f64 {
    x.to_f64().expect("every rational is near some f64")
}

/// The binomial coefficient n over k. 0 for k > n.
pub(super) fn binomial(n: usize, k: usize) -> BigInt {
    if k > n { BigInt::zero() } else { num_integer::binomial(BigInt::from(n), BigInt::from(k)) }
}

/// n (n − 1) … (n − k + 1)
pub(super) fn falling(n: usize, k: usize) -> BigInt {
    if k > n { BigInt::zero() } else { (n - k + 1..=n).fold(BigInt::one(), |product, factor| product * factor) }
}

/// The solutions x = particular · g + Σ free vectors of A x = B g for any g.
pub(super) struct Solutions {
    /// One column for each entry of g.
    pub particular: Matrix,
    /// A basis of the null space of A, one vector a column.
    pub free: Matrix,
}

/// Solves A x = B g exactly for all g at once.
///
/// A and B stand side by side, and A has `unknowns` columns. `None` if some g has no solution.
pub(super) fn solve(system: &Matrix, unknowns: usize) -> Option<Solutions> {
    let mut rows: Vec<Vec<BigInt>> = (0..system.rows).map(|i| integers(system, i)).collect();
    let (pivots, denominator) = echelon(&mut rows, unknowns);
    if rows[pivots.len()..].iter().flatten().any(|x| !x.is_zero()) {
        return None;
    }
    let row_of = |column: usize| pivots.iter().position(|&pivot| pivot == column);
    // Reducing the fractions would take longer than the elimination.
    let entry = |i: usize, column: usize| {
        let numerator = &rows[row_of(i)?][column];
        let numerator = if denominator.is_negative() { -numerator } else { numerator.clone() };
        Some(BigRational::new_raw(numerator, denominator.abs()))
    };
    let particular = Matrix::from_fn(unknowns, system.columns - unknowns, |i, j| {
        entry(i, unknowns + j).unwrap_or_else(BigRational::zero)
    });
    let free: Vec<usize> = (0..unknowns).filter(|column| !pivots.contains(column)).collect();
    let free = Matrix::from_fn(unknowns, free.len(), |i, j| match entry(i, free[j]) {
        Some(entry) => -entry,
        None => ratio(i32::from(i == free[j]), 1),
    });
    Some(Solutions { particular, free })
}

fn common_denominator(entries: &[BigRational]) -> BigInt {
    let fractions = entries.iter().filter(|x| !x.is_integer());
    fractions.fold(BigInt::one(), |common, x| common.lcm(x.denom()))
}

/// A row times the least number that makes its entries integers.
fn integers(system: &Matrix, i: usize) -> Vec<BigInt> {
    let row = &system.entries[i * system.columns..(i + 1) * system.columns];
    let common = common_denominator(row);
    row.iter().map(|x| x.numer() * (&common / x.denom())).collect()
}

/// Reduced row echelon form without fractions.
///
/// Gauss–Jordan elimination by Bareiss (1968), whose divisions are exact. Returns the column of
/// each row's pivot, and the final value of all pivots.
fn echelon(rows: &mut [Vec<BigInt>], unknowns: usize) -> (Vec<usize>, BigInt) {
    let mut pivots = Vec::new();
    let mut last = BigInt::one();
    for column in 0..unknowns {
        let own = pivots.len();
        // The smallest pivot keeps the numbers short.
        let candidates = (own..rows.len()).filter(|&i| !rows[i][column].is_zero());
        let Some(chosen) = candidates.min_by_key(|&i| rows[i][column].abs()) else { continue };
        rows.swap(own, chosen);
        let pivot_row = std::mem::take(&mut rows[own]);
        let pivot = pivot_row[column].clone();
        for row in rows.iter_mut().filter(|row| !row.is_empty()) {
            let factor = row[column].clone();
            for (x, of_pivot) in row.iter_mut().zip(&pivot_row) {
                let mut next = &*x * &pivot;
                if !factor.is_zero() && !of_pivot.is_zero() {
                    next -= &factor * of_pivot;
                }
                *x = next / &last;
            }
        }
        rows[own] = pivot_row;
        last = pivot;
        pivots.push(column);
    }
    (pivots, last)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(columns: usize, entries: &[i64]) -> Matrix {
        Matrix::from_fn(entries.len() / columns, columns, |i, j| ratio(entries[i * columns + j], 1))
    }

    #[test]
    fn systems_are_solved_exactly() {
        // A Hilbert matrix of 12 rows, which f64 cannot solve to a single digit.
        let n = 12;
        let system = Matrix::from_fn(n, n + 1, |i, j| if j < n { ratio(1, i + j + 1) } else { ratio(1, 1) });
        let solutions = solve(&system, n).unwrap();
        assert_eq!(solutions.free.columns(), 0);
        for i in 0..n {
            let sum: BigRational = (0..n).map(|j| system.at(i, j) * solutions.particular.at(j, 0)).sum();
            assert_eq!(sum, ratio(1, 1));
        }
    }

    #[test]
    fn what_is_free_is_found_and_what_contradicts_itself_refused() {
        // x + y + z = g₀, y = g₁, and their sum.
        let consistent = matrix(5, &[1, 1, 1, 1, 0, 0, 1, 0, 0, 1, 1, 2, 1, 1, 1]);
        let solutions = solve(&consistent, 3).unwrap();
        assert_eq!(solutions.free, matrix(1, &[-1, 0, 1]));
        assert_eq!(solutions.particular, matrix(2, &[1, -1, 0, 1, 0, 0]));
        assert!(solve(&matrix(3, &[1, 1, 1, 1, 1, 2]), 2).is_none());
    }
}
