//! [`Skyline`]: symmetric matrices, definite or not, factored as L D Lᵀ within their skyline.
//!
//! A row is stored from its first entry to the diagonal, and so is its factor. The cost of a band with
//! a few long rows is the cost of its entries. Rows are not exchanged: a pivot of 0 is reported, and the
//! caller adds to the diagonal.

/// A symmetric matrix, then its factors.
#[derive(Clone, Debug)]
pub(crate) struct Skyline {
    /// The first column of every row.
    first: Vec<usize>,
    /// Where every row begins in `entries`, and where the last ends.
    starts: Vec<usize>,
    /// The lower half, row after row.
    ///
    /// L once factored.
    entries: Vec<f64>,
    /// Inverse pivots.
    inverse: Vec<f64>,
}

impl Skyline {
    /// A matrix of zeros whose row i has entries from column `first[i]` ≤ i on.
    pub fn new(first: Vec<usize>) -> Self {
        let mut starts = Vec::with_capacity(first.len() + 1);
        let mut end = 0;
        for (row, &column) in first.iter().enumerate() {
            starts.push(end);
            end += row + 1 - column;
        }
        starts.push(end);
        Skyline { inverse: vec![0.0; first.len()], first, starts, entries: vec![0.0; end] }
    }

    /// Makes all entries 0 again.
    pub fn clear(&mut self) {
        self.entries.fill(0.0);
    }

    /// Adds to an entry and to the one opposite.
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, x: f64) {
        let (row, column) = (row.max(column), row.min(column));
        self.entries[self.starts[row] + column - self.first[row]] += x;
    }

    /// The number of rows.
    #[cfg(test)]
    pub fn rows(&self) -> usize {
        self.first.len()
    }

    /// An entry of a matrix that is not factored yet.
    #[cfg(test)]
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        let (row, column) = (row.max(column), row.min(column));
        if column < self.first[row] { 0.0 } else { self.entries[self.starts[row] + column - self.first[row]] }
    }

    /// Factors. Returns the number of negative pivots, which equals the number of negative eigenvalues.
    ///
    /// `None` where a pivot is 0 or no number.
    pub fn factor(&mut self) -> Option<usize> {
        let mut negative = 0;
        for i in 0..self.first.len() {
            let from = self.first[i];
            let (done, rest) = self.entries.split_at_mut(self.starts[i]);
            let row = &mut rest[..=i - from];
            // l times the pivot of its column first.
            for j in from..i {
                let (other, start) = (self.first[j], self.starts[j]);
                let common = from.max(other);
                let l = &done[start + common - other..start + j - other];
                let sum: f64 = row[common - from..j - from].iter().zip(l).map(|(u, l)| u * l).sum();
                row[j - from] -= sum;
            }
            let (row, pivot) = row.split_at_mut(i - from);
            for (entry, inverse) in row.iter_mut().zip(&self.inverse[from..i]) {
                let u = *entry;
                *entry *= inverse;
                pivot[0] -= u * *entry;
            }
            if pivot[0] == 0.0 || !pivot[0].is_finite() {
                return None;
            }
            negative += usize::from(pivot[0] < 0.0);
            self.inverse[i] = 1.0 / pivot[0];
        }
        Some(negative)
    }

    /// Solves in place with the factors.
    pub fn solve(&self, x: &mut [f64]) {
        for i in 0..x.len() {
            let (from, start) = (self.first[i], self.starts[i]);
            let l = &self.entries[start..start + i - from];
            let sum: f64 = l.iter().zip(&x[from..i]).map(|(l, x)| l * x).sum();
            x[i] -= sum;
        }
        x.iter_mut().zip(&self.inverse).for_each(|(x, inverse)| *x *= inverse);
        for i in (0..x.len()).rev() {
            let (from, start) = (self.first[i], self.starts[i]);
            let (before, here) = x.split_at_mut(i);
            let l = &self.entries[start..start + i - from];
            before[from..].iter_mut().zip(l).for_each(|(x, l)| *x -= l * here[0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// A matrix with a ragged skyline and entries of either sign, and the same in full.
    fn random(n: usize, seed: u64) -> (Skyline, DMatrix<f64>, StdRng) {
        let mut rng = StdRng::seed_from_u64(seed);
        let first: Vec<usize> = (0..n).map(|i| if i % 5 == 4 { i / 3 } else { i.saturating_sub(2) }).collect();
        let (mut skyline, mut dense) = (Skyline::new(first.clone()), DMatrix::zeros(n, n));
        for i in 0..n {
            for j in first[i]..=i {
                let x: f64 = rng.random_range(-1.0..1.0);
                skyline.add(j, i, x);
                dense[(i, j)] = x;
                dense[(j, i)] = x;
            }
            // Pivots of both signs, none of them near 0.
            let own = if i % 3 == 1 { -8.0 } else { 8.0 };
            skyline.add(i, i, own);
            dense[(i, i)] += own;
        }
        (skyline, dense, rng)
    }

    #[test]
    fn solutions_satisfy_their_equations_and_negative_pivots_count_negative_eigenvalues() {
        for n in [1, 2, 7, 40] {
            let (mut skyline, dense, mut rng) = random(n, n as u64);
            let negative = dense.clone().symmetric_eigenvalues().iter().filter(|x| **x < 0.0).count();
            assert_eq!(skyline.factor(), Some(negative), "{n} rows");
            let rhs: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
            let mut x = rhs.clone();
            skyline.solve(&mut x);
            let residual = (&dense * DVector::from_vec(x) - DVector::from_vec(rhs)).amax();
            // n ε a row, times the growth of pivots that are not exchanged.
            assert!(residual < 100.0 * n as f64 * f64::EPSILON, "{n} rows: residual {residual:e}");
        }
    }

    #[test]
    fn a_pivot_of_zero_or_no_number_is_reported() {
        for x in [0.0, f64::NAN, f64::INFINITY] {
            let mut skyline = Skyline::new(vec![0, 0]);
            skyline.add(0, 0, x);
            skyline.add(1, 0, 1.0);
            skyline.add(1, 1, 1.0);
            assert_eq!(skyline.factor(), None, "{x}");
        }
    }
}
