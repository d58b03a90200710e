//! [`Banded`]: symmetric positive definite banded matrices, open and cyclic, factored as L D Lᵀ. Each
//! lane has a matrix.
//!
//! Rows are eliminated from the first down. A cyclic matrix keeps its first B rows, the border, for
//! the end. B further columns hold the entries that couple the border to rows on either side of the
//! ring. So open and cyclic matrices, and lanes of different lengths, take the same steps.

// Loops by number read as the formulas do.
#![allow(clippy::needless_range_loop)]

use super::scalar::{Scalar, Vector, scale, subtract};
use super::wide::operation;

/// A symmetric matrix of half-bandwidth B in every lane, then its factors.
///
/// [`add`](Self::add) takes unwrapped rows: past the last of the n rows of a cyclic matrix, n stands
/// for row 0, n + 1 for row 1, and so on. A cyclic matrix has at least B rows.
#[derive(Clone, Debug)]
pub struct Banded<S, const B: usize> {
    cyclic: bool,
    /// Number of rows of each lane.
    counts: Vec<usize>,
    most: usize,
    /// Diagonal; inverse pivots once factored.
    diagonal: Vec<S>,
    /// `band[i][k]` couples row i with row i − k − 1.
    band: Vec<[S; B]>,
    /// `border[i][b]` couples row i with row b of the border.
    border: Vec<[S; B]>,
    /// The border's own block, then its factors.
    corner: [[S; B]; B],
}

impl<S: Scalar, const B: usize> Default for Banded<S, B> {
    fn default() -> Self {
        Banded::new(false, &[])
    }
}

impl<S: Scalar, const B: usize> Banded<S, B> {
    /// Matrices of `counts` rows, all open or all cyclic, with entries to be filled.
    pub fn new(cyclic: bool, counts: &[usize]) -> Self {
        let mut banded = Banded {
            cyclic,
            counts: Vec::new(),
            most: 0,
            diagonal: Vec::new(),
            band: Vec::new(),
            border: Vec::new(),
            corner: [[S::ZERO; B]; B],
        };
        banded.renew(cyclic, counts);
        banded
    }

    /// Storage for other matrices. [`clear`](Self::clear) makes their entries 0.
    pub fn renew(&mut self, cyclic: bool, counts: &[usize]) {
        debug_assert!(!cyclic || counts.iter().all(|&count| count >= B), "{counts:?} {B}");
        self.cyclic = cyclic;
        self.counts.clear();
        self.counts.extend_from_slice(counts);
        self.most = counts.iter().copied().max().unwrap_or(0);
        let rows = self.most + B;
        self.diagonal.resize(rows, S::ZERO);
        self.band.resize(rows, [S::ZERO; B]);
        self.border.resize(if cyclic { rows } else { 0 }, [S::ZERO; B]);
    }

    /// Number of rows that may be written to, unwrapped ones included.
    pub fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// Makes all entries 0 again.
    pub fn clear(&mut self) {
        self.diagonal.fill(S::ZERO);
        self.band.fill([S::ZERO; B]);
        self.border.fill([S::ZERO; B]);
    }

    /// Adds to the diagonal.
    pub fn add_diagonal(&mut self, row: usize, x: S) {
        self.diagonal[row] += x;
    }

    /// Adds to the entry that couples two different rows, `row` the larger.
    pub fn add_entry(&mut self, row: usize, column: usize, x: S) {
        self.band[row][row - column - 1] += x;
    }

    /// Adds weight · v vᵀ for a vector v whose entries belong to the rows from `row` on.
    #[inline(always)]
    pub fn add<const N: usize>(&mut self, row: usize, weight: S, v: [S; N]) {
        for j in 0..N {
            let weighted = weight * v[j];
            self.diagonal[row + j] += weighted * v[j];
            for k in 0..j {
                self.band[row + j][j - k - 1] += weighted * v[k];
            }
        }
    }

    /// Factors. `movable` is 0 where an unknown is held at 0 or a lane has no row, else 1.
    ///
    /// Returns the smallest pivot of each lane. If it is not positive, the matrix was not positive
    /// definite.
    pub fn factor(&mut self, movable: &[S]) -> S {
        S::run(Factor { matrix: self, movable })
    }

    #[inline(always)]
    fn factor_inlined(&mut self, movable: &[S]) -> S {
        self.hold(movable);
        let first = if self.cyclic { B } else { 0 };
        if self.cyclic {
            self.fold(movable);
        }
        let mut smallest = S::ONE / S::of(1e-30);
        for i in first..self.most {
            let mut pivot = self.diagonal[i];
            // l times its column's pivot, from the leftmost column on.
            let mut u = [S::ZERO; B];
            for k in (0..B).rev() {
                if i <= first + k {
                    continue;
                }
                let j = i - k - 1;
                u[k] = self.band[i][k];
                for m in k + 1..B {
                    u[k] -= u[m] * self.band[j][m - k - 1];
                }
                let l = u[k] * self.diagonal[j];
                pivot -= l * u[k];
                self.band[i][k] = l;
            }
            if self.cyclic {
                for b in 0..B {
                    let mut c = self.border[i][b];
                    for k in 0..B {
                        if i > first + k {
                            c -= self.band[i][k] * self.border[i - k - 1][b];
                        }
                    }
                    // Not divided by the pivot yet: l·d of the border's row.
                    self.border[i][b] = c;
                }
            }
            smallest = -((-smallest).max(-pivot));
            self.diagonal[i] = S::ONE / pivot;
        }
        if self.cyclic {
            smallest = -((-smallest).max(-self.factor_corner()));
        }
        smallest
    }

    /// Decouples rows that are held.
    #[inline(always)]
    fn hold(&mut self, movable: &[S]) {
        let zero = S::ZERO;
        let rows = if self.cyclic { self.most + B } else { self.most };
        for i in 0..rows {
            let own = self.movable(movable, i);
            self.diagonal[i] *= own;
            if !self.cyclic {
                self.diagonal[i] += S::ONE - own;
            }
            for k in 0..B {
                let other = if i > k { self.movable(movable, i - k - 1) } else { zero };
                self.band[i][k] *= own * other;
            }
        }
    }

    /// `movable` of an unwrapped row.
    #[inline(always)]
    fn movable(&self, movable: &[S], row: usize) -> S {
        if !self.cyclic || row < self.counts.iter().copied().min().unwrap_or(0) {
            return movable[row];
        }
        let mut out = S::ZERO;
        for (lane, &count) in self.counts.iter().enumerate() {
            let own = if row < count { row } else { row - count };
            if own < B || row < count {
                out.set_lane(lane, movable[own].lane(lane));
            }
        }
        out
    }

    /// Brings what was written to unwrapped rows, and to the border's rows, to the border.
    fn fold(&mut self, movable: &[S]) {
        self.border.fill([S::ZERO; B]);
        for b in 0..B {
            for a in 0..B {
                self.corner[b][a] = if a < b {
                    self.band[b][b - a - 1]
                } else if a == b {
                    self.diagonal[b]
                } else {
                    S::ZERO
                };
            }
        }
        for i in B..2 * B {
            for k in i - B..B {
                let column = i - k - 1;
                for (lane, &n) in self.counts.iter().enumerate() {
                    // Beyond a lane's last row it is wrapped, below.
                    if i < n {
                        let x = self.band[i][k].lane(lane);
                        self.border[i][column].set_lane(lane, x);
                        self.band[i][k].set_lane(lane, S::ZERO.lane(0));
                    }
                }
            }
        }
        for lane in 0..self.counts.len() {
            let n = self.counts[lane];
            for b in 0..B {
                let x = self.corner[b][b].lane(lane) + self.diagonal[n + b].lane(lane);
                self.corner[b][b].set_lane(lane, x);
                for k in 0..B {
                    let entry = self.band[n + b][k].lane(lane);
                    let other = n + b - k - 1;
                    if other >= n || other < B {
                        let other = if other >= n { other - n } else { other };
                        let (low, high) = (b.min(other), b.max(other));
                        let twice = if b == other { entry } else { S::ZERO.lane(0) };
                        let x = self.corner[high][low].lane(lane) + entry + twice;
                        self.corner[high][low].set_lane(lane, x);
                    } else {
                        let x = self.border[other][b].lane(lane) + entry;
                        self.border[other][b].set_lane(lane, x);
                    }
                }
            }
            // Rows that the lane does not have.
            for i in n..self.most + B {
                self.diagonal[i].set_lane(lane, S::ZERO.lane(0));
                for k in 0..B {
                    self.band[i][k].set_lane(lane, S::ZERO.lane(0));
                    self.border[i][k].set_lane(lane, S::ZERO.lane(0));
                }
            }
        }
        for b in 0..B {
            self.corner[b][b] += S::ONE - movable[b];
        }
        for i in B..self.most {
            self.diagonal[i] += S::ONE - movable[i];
        }
    }

    /// Eliminates the rows from the border's block, and factors what is left; the smallest pivot.
    fn factor_corner(&mut self) -> S {
        for i in B..self.most {
            for b in 0..B {
                let l = self.border[i][b] * self.diagonal[i];
                for a in 0..=b {
                    self.corner[b][a] -= l * self.border[i][a];
                }
                // From here on the border's row of L.
            }
            for b in 0..B {
                self.border[i][b] *= self.diagonal[i];
            }
        }
        let mut smallest = S::ONE / S::of(1e-30);
        let mut pivots = [S::ONE; B];
        for b in 0..B {
            for a in 0..b {
                for m in 0..a {
                    let x = self.corner[b][m] * pivots[m] * self.corner[a][m];
                    self.corner[b][a] -= x;
                }
                self.corner[b][a] *= S::ONE / pivots[a];
            }
            let mut pivot = self.corner[b][b];
            for a in 0..b {
                pivot -= self.corner[b][a] * self.corner[b][a] * pivots[a];
            }
            smallest = -((-smallest).max(-pivot));
            pivots[b] = pivot;
            self.corner[b][b] = S::ONE / pivot;
        }
        smallest
    }

    /// Solves in place, D right-hand sides.
    pub fn solve<const D: usize>(&self, x: &mut [Vector<S, D>]) {
        S::run(Solve { matrix: self, x });
    }

    #[inline(always)]
    fn solve_inlined<const D: usize>(&self, x: &mut [Vector<S, D>]) {
        let first = if self.cyclic { B } else { 0 };
        let mut kept = [[S::ZERO; D]; B];
        if self.cyclic {
            kept.copy_from_slice(&x[..B]);
        }
        for i in first..self.most {
            let mut here = x[i];
            for k in 0..B {
                if i > first + k {
                    here = subtract(here, scale(self.band[i][k], x[i - k - 1]));
                }
            }
            x[i] = here;
            if self.cyclic {
                for b in 0..B {
                    kept[b] = subtract(kept[b], scale(self.border[i][b], here));
                }
            }
        }
        if self.cyclic {
            self.solve_corner(&mut kept);
            x[..B].copy_from_slice(&kept);
        }
        for i in (first..self.most).rev() {
            let mut here = scale(self.diagonal[i], x[i]);
            for k in 0..B {
                let after = i + k + 1;
                if after < self.most {
                    here = subtract(here, scale(self.band[after][k], x[after]));
                }
            }
            if self.cyclic {
                for b in 0..B {
                    here = subtract(here, scale(self.border[i][b], kept[b]));
                }
            }
            x[i] = here;
        }
    }

    fn solve_corner<const D: usize>(&self, x: &mut [Vector<S, D>; B]) {
        for b in 0..B {
            for a in 0..b {
                x[b] = subtract(x[b], scale(self.corner[b][a], x[a]));
            }
        }
        for b in (0..B).rev() {
            x[b] = scale(self.corner[b][b], x[b]);
            for a in b + 1..B {
                x[b] = subtract(x[b], scale(self.corner[a][b], x[a]));
            }
        }
    }
}

operation! {
    /// [`Banded::factor`]
    Factor<'a, S: Scalar; B> { matrix: &'a mut Banded<S, B>, movable: &'a [S] } -> S { matrix.factor_inlined(movable) }
}

operation! {
    /// [`Banded::solve`]
    Solve<'a, S: Scalar; B, D> { matrix: &'a Banded<S, B>, x: &'a mut [Vector<S, D>] } -> () { matrix.solve_inlined(x) }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::super::scalar::Lanes;
    use super::*;

    /// A sum of squares of random stencils, as `Banded` takes them, and the same as a dense matrix
    /// a lane.
    #[allow(clippy::type_complexity)]
    fn random<const B: usize>(
        cyclic: bool,
        counts: &[usize],
        seed: u64,
    ) -> (Banded<Lanes<f64, 4>, B>, Vec<Lanes<f64, 4>>, Vec<Vec<Vec<f64>>>) {
        let mut rng = StdRng::seed_from_u64(seed);
        let mut banded = Banded::new(cyclic, counts);
        let most = counts.iter().copied().max().unwrap();
        let mut dense: Vec<Vec<Vec<f64>>> = counts.iter().map(|&n| vec![vec![0.0; n]; n]).collect();
        let mut movable = vec![Lanes([0.0; 4]); most];
        for (lane, &n) in counts.iter().enumerate() {
            (0..n).for_each(|i| movable[i].0[lane] = if i % 5 == 2 { 0.0 } else { 1.0 });
        }
        for row in 0..most {
            let mut weight = Lanes([0.0; 4]);
            let mut v = vec![Lanes([0.0; 4]); B + 1];
            for (lane, &n) in counts.iter().enumerate() {
                let starts = if cyclic { row < n } else { row + B < n };
                if !starts {
                    continue;
                }
                weight.0[lane] = rng.random_range(0.1..10.0);
                v.iter_mut().for_each(|x| x.0[lane] = rng.random_range(-1.0..1.0));
                for (a, b) in (0..=B).flat_map(|a| (0..=B).map(move |b| (a, b))) {
                    dense[lane][(row + a) % n][(row + b) % n] += weight.0[lane] * v[a].0[lane] * v[b].0[lane];
                }
            }
            if cyclic || row + B < most {
                match B {
                    1 => banded.add(row, weight, [v[0], v[1]]),
                    2 => banded.add(row, weight, [v[0], v[1], v[2]]),
                    _ => banded.add(row, weight, [v[0], v[1], v[2], v[3]]),
                }
            }
            let mut own = Lanes([0.0; 4]);
            counts.iter().enumerate().filter(|(_, n)| row < **n).for_each(|(lane, _)| own.0[lane] = 0.5);
            banded.add_diagonal(row, own);
        }
        for (lane, &n) in counts.iter().enumerate() {
            for i in 0..n {
                dense[lane][i][i] += 0.5;
                let held = movable[i].0[lane] == 0.0;
                for j in 0..n {
                    if held || movable[j].0[lane] == 0.0 {
                        dense[lane][i][j] = if i == j { 1.0 } else { 0.0 };
                    }
                }
            }
        }
        (banded, movable, dense)
    }

    fn check<const B: usize>(cyclic: bool, counts: [usize; 4], seed: u64) {
        let (mut banded, movable, dense) = random::<B>(cyclic, &counts, seed);
        let smallest = banded.factor(&movable);
        assert!(smallest.0.iter().all(|&pivot| pivot > 0.0), "{smallest:?}");
        let most = *counts.iter().max().unwrap();
        let mut rng = StdRng::seed_from_u64(seed + 1);
        let rhs: Vec<[Lanes<f64, 4>; 2]> =
            (0..most).map(|_| [0, 1].map(|_| Lanes([0; 4].map(|_| rng.random_range(-1.0..1.0))))).collect();
        let mut x = rhs.clone();
        banded.solve(&mut x);
        for (lane, &n) in counts.iter().enumerate() {
            for (i, c) in (0..n).flat_map(|i| [(i, 0), (i, 1)]) {
                let product: f64 = (0..n).map(|j| dense[lane][i][j] * x[j][c].0[lane]).sum();
                let residual = (product - rhs[i][c].0[lane]).abs();
                assert!(residual < 1e-11, "B {B}, cyclic {cyclic}, lane {lane}, row {i} of {n}: residual {residual:e}");
            }
        }
    }

    #[test]
    fn solutions_satisfy_their_equations_open_and_cyclic_in_lanes_of_different_lengths() {
        for (seed, counts) in [[6, 6, 6, 6], [6, 7, 19, 40], [64, 8, 33, 9], [3, 4, 5, 3]].into_iter().enumerate() {
            let seed = 10 * seed as u64;
            for cyclic in [false, true] {
                check::<1>(cyclic, counts, seed);
                check::<2>(cyclic, counts, seed);
                check::<3>(cyclic, counts, seed);
            }
        }
        check::<2>(false, [1, 2, 3, 4], 7);
        check::<2>(true, [2, 3, 2, 5], 8);
        check::<3>(false, [1, 2, 3, 4], 7);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_a_pivot_that_says_so() {
        let mut banded = Banded::<f64, 1>::new(false, &[3]);
        banded.add(0, 1.0, [1.0, -1.0]);
        banded.add(1, 1.0, [1.0, -1.0]);
        banded.add_diagonal(2, -2.0);
        assert!(banded.factor(&[1.0; 3]) <= 0.0);
    }
}
