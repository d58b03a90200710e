//! How the two forms of a matrix are eliminated, row by row, in all lanes at once; see
//! [`lanes`](super::lanes).

// Loops over lanes by number read as the formulas do, and become vector instructions.
#![allow(clippy::needless_range_loop)]

use super::group::{BLOCK, Group};
use super::scalar::Real;

/// What elimination hands from row to row, and the kept row 0 of a cyclic system.
#[derive(Clone, Copy)]
pub(super) struct Carry<T, const L: usize, const C: usize> {
    /// Bands: ga of the row before. Network: the excess passed on by it.
    pub(super) a: [T; L],
    /// Bands: al of the row before. Network: the weight of the edge to row 0.
    pub(super) b: [T; L],
    /// Bands: de of the row before. Network: the right-hand side passed on by it.
    pub(super) d: [[T; L]; C],
    /// Diagonal (bands) or excess (network) of row 0.
    pub(super) kept: [T; L],
    /// Bands: row 0's coefficient of the row before it, x_{n−1}.
    pub(super) corner: [T; L],
    /// Bands: row 0's coefficient of the next row not eliminated yet.
    pub(super) next: [T; L],
    /// Right-hand side of row 0.
    pub(super) kept_d: [[T; L]; C],
    /// 0 as long as every pivot is finite, and NaN from then on.
    pub(super) sound: [T; L],
}

impl<T: Real, const L: usize, const C: usize> Default for Carry<T, L, C> {
    #[inline(always)]
    fn default() -> Self {
        let zero = [T::ZERO; L];
        Carry { a: zero, b: zero, d: [zero; C], kept: zero, corner: zero, next: zero, kept_d: [zero; C], sound: zero }
    }
}

impl<T: Real, const L: usize, const C: usize> Carry<T, L, C> {
    /// Takes back what a row did to lanes whose system has ended.
    #[inline(always)]
    pub(super) fn restore(&mut self, before: &Self, active: &[bool; L]) {
        let keep = |now: &mut [T; L], before: &[T; L]| {
            for j in 0..L {
                now[j] = if active[j] { now[j] } else { before[j] };
            }
        };
        keep(&mut self.a, &before.a);
        keep(&mut self.b, &before.b);
        keep(&mut self.kept, &before.kept);
        keep(&mut self.next, &before.next);
        keep(&mut self.sound, &before.sound);
        for c in 0..C {
            keep(&mut self.d[c], &before.d[c]);
            keep(&mut self.kept_d[c], &before.kept_d[c]);
        }
    }
}

/// How one form of a matrix is read and eliminated.
pub(super) trait Form<T: Real> {
    /// Reads a block of rows. What an open system ignores becomes 0.
    fn load<const L: usize>(&self, group: &Group<L>, row: usize, matrix: &mut [[[T; L]; BLOCK]; 3], cyclic: bool);

    /// Keeps row 0 of a cyclic system.
    fn keep<const L: usize, const C: usize>(
        &self,
        carry: &mut Carry<T, L, C>,
        matrix: &[[[T; L]; BLOCK]; 3],
        rhs: &[[[T; L]; BLOCK]; C],
    );

    /// Eliminates a row: (ga, al, de).
    #[allow(clippy::type_complexity)]
    fn eliminate<const L: usize, const C: usize>(
        &self,
        carry: &mut Carry<T, L, C>,
        row: [&[T; L]; 3],
        rhs: [&[T; L]; C],
        cyclic: bool,
    ) -> ([T; L], [T; L], [[T; L]; C]);

    /// x_0 of a cyclic system, after its other rows have been eliminated.
    fn close<const L: usize, const C: usize>(&self, carry: &mut Carry<T, L, C>) -> [[T; L]; C];
}

/// The three bands: Thomas elimination.
pub(super) struct Bands<'a, T> {
    pub(super) lower: &'a [T],
    pub(super) diagonal: &'a [T],
    pub(super) upper: &'a [T],
}

impl<T: Real> Form<T> for Bands<'_, T> {
    #[inline(always)]
    fn load<const L: usize>(&self, group: &Group<L>, row: usize, matrix: &mut [[[T; L]; BLOCK]; 3], cyclic: bool) {
        group.gather(self.lower, 1, 0, row, 0, &mut matrix[0]);
        group.gather(self.diagonal, 1, 0, row, 0, &mut matrix[1]);
        group.gather(self.upper, 1, 0, row, 0, &mut matrix[2]);
        if !cyclic {
            if row == 0 {
                matrix[0][0] = [T::ZERO; L];
            }
            if row + BLOCK >= group.shortest {
                for j in 0..L {
                    let last = group.rows[j].wrapping_sub(row + 1);
                    if last < BLOCK {
                        matrix[2][last][j] = T::ZERO;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn keep<const L: usize, const C: usize>(
        &self,
        carry: &mut Carry<T, L, C>,
        matrix: &[[[T; L]; BLOCK]; 3],
        rhs: &[[[T; L]; BLOCK]; C],
    ) {
        carry.corner = matrix[0][0];
        carry.kept = matrix[1][0];
        carry.next = matrix[2][0];
        for c in 0..C {
            carry.kept_d[c] = rhs[c][0];
        }
        // x_0 = 0 + 0·x_1 + 1·x_0
        carry.b = [T::ONE; L];
    }

    #[inline(always)]
    fn eliminate<const L: usize, const C: usize>(
        &self,
        carry: &mut Carry<T, L, C>,
        [lower, diagonal, upper]: [&[T; L]; 3],
        rhs: [&[T; L]; C],
        cyclic: bool,
    ) -> ([T; L], [T; L], [[T; L]; C]) {
        let (mut ga, mut al, mut de, mut r) = ([T::ZERO; L], [T::ZERO; L], [[T::ZERO; L]; C], [T::ZERO; L]);
        for j in 0..L {
            let pivot = diagonal[j] + lower[j] * carry.a[j];
            carry.sound[j] += pivot * T::ZERO;
            r[j] = T::ONE / pivot;
            ga[j] = -(upper[j] * r[j]);
        }
        for c in 0..C {
            for j in 0..L {
                de[c][j] = (rhs[c][j] - lower[j] * carry.d[c][j]) * r[j];
            }
        }
        if cyclic {
            for j in 0..L {
                let coupling = -(lower[j] * carry.b[j]) * r[j];
                al[j] = if coupling.abs() < T::SMALLEST_NORMAL { T::ZERO } else { coupling };
                carry.kept[j] += carry.next[j] * al[j];
            }
            for c in 0..C {
                for j in 0..L {
                    carry.kept_d[c][j] -= carry.next[j] * de[c][j];
                }
            }
            for j in 0..L {
                let next = carry.next[j] * ga[j];
                carry.next[j] = if next.abs() < T::SMALLEST_NORMAL { T::ZERO } else { next };
            }
        }
        carry.a = ga;
        carry.b = al;
        carry.d = de;
        (ga, al, de)
    }

    #[inline(always)]
    fn close<const L: usize, const C: usize>(&self, carry: &mut Carry<T, L, C>) -> [[T; L]; C] {
        let mut first = [[T::ZERO; L]; C];
        for j in 0..L {
            let pivot = carry.kept[j] + carry.next[j] + carry.corner[j] * (carry.a[j] + carry.b[j]);
            carry.sound[j] += pivot * T::ZERO;
            for c in 0..C {
                first[c][j] = (carry.kept_d[c][j] - carry.corner[j] * carry.d[c][j]) / pivot;
            }
        }
        first
    }
}

/// Excess and weights: star-mesh elimination of a resistor network, without any subtraction.
pub(super) struct Network<'a, T> {
    pub(super) excess: &'a [T],
    pub(super) weights: &'a [T],
}

impl<T: Real> Form<T> for Network<'_, T> {
    /// Per row its excess and the weight of the edge to the next row; the third array carries row
    /// 0's own weight.
    #[inline(always)]
    fn load<const L: usize>(&self, group: &Group<L>, row: usize, matrix: &mut [[[T; L]; BLOCK]; 3], cyclic: bool) {
        group.gather(self.excess, 1, 0, row, 0, &mut matrix[0]);
        // Shifted by one row: the slice from 1 on, of which a system's last row has no entry.
        group.gather(self.weights.get(1..).unwrap_or(&[]), 1, 0, row, 1, &mut matrix[1]);
        if row + BLOCK >= group.shortest {
            for j in 0..L {
                let last = group.rows[j].wrapping_sub(row + 1);
                if last < BLOCK {
                    matrix[1][last][j] = if cyclic { self.weights[group.start[j]] } else { T::ZERO };
                }
            }
        }
    }

    #[inline(always)]
    fn keep<const L: usize, const C: usize>(
        &self,
        carry: &mut Carry<T, L, C>,
        matrix: &[[[T; L]; BLOCK]; 3],
        rhs: &[[[T; L]; BLOCK]; C],
    ) {
        carry.kept = matrix[0][0];
        carry.b = matrix[1][0];
        for c in 0..C {
            carry.kept_d[c] = rhs[c][0];
        }
    }

    #[inline(always)]
    fn eliminate<const L: usize, const C: usize>(
        &self,
        carry: &mut Carry<T, L, C>,
        [excess, next, _]: [&[T; L]; 3],
        rhs: [&[T; L]; C],
        cyclic: bool,
    ) -> ([T; L], [T; L], [[T; L]; C]) {
        let (mut ga, mut al, mut de, mut r) = ([T::ZERO; L], [T::ZERO; L], [[T::ZERO; L]; C], [T::ZERO; L]);
        for j in 0..L {
            let e = excess[j] + carry.a[j];
            let pivot = if cyclic { e + carry.b[j] + next[j] } else { e + next[j] };
            carry.sound[j] += pivot * T::ZERO;
            r[j] = T::ONE / pivot;
            ga[j] = next[j] * r[j];
            carry.a[j] = ga[j] * e;
            if cyclic {
                al[j] = carry.b[j] * r[j];
                carry.kept[j] += al[j] * e;
                let coupling = carry.b[j] * ga[j];
                carry.b[j] = if coupling.abs() < T::SMALLEST_NORMAL { T::ZERO } else { coupling };
            }
        }
        for c in 0..C {
            for j in 0..L {
                let d = rhs[c][j] + carry.d[c][j];
                de[c][j] = d * r[j];
                carry.d[c][j] = ga[j] * d;
                if cyclic {
                    carry.kept_d[c][j] += al[j] * d;
                }
            }
        }
        (ga, al, de)
    }

    #[inline(always)]
    fn close<const L: usize, const C: usize>(&self, carry: &mut Carry<T, L, C>) -> [[T; L]; C] {
        let mut first = [[T::ZERO; L]; C];
        for j in 0..L {
            let pivot = carry.kept[j] + carry.a[j];
            carry.sound[j] += pivot * T::ZERO;
            for c in 0..C {
                first[c][j] = (carry.kept_d[c][j] + carry.d[c][j]) / pivot;
            }
        }
        first
    }
}
