//! Sparse rules applied: every new point is the weighted sum of the old ones in its window.
//! Twin: shaders/laplacian/sparse.wgsl.

use std::ops::Range;

use super::stencil::{Axis, Stencils, window};
use crate::linalg::{Operation, Real, with_wide_registers};
use crate::parallel;

/// Numbers computed side by side: two AVX2 registers of f64 for even and two for odd points.
const LANES: usize = 8;

/// The fewest new values that a parallel task computes.
const VALUES_PER_TASK: usize = 1 << 15;

/// One round on one grid of (n + 1) × (m + 1) points, n and m > 0. `fine` has (2n + 1) × (2m + 1).
pub(super) fn subdivide<S: Real>(
    stencils: &Stencils<S>,
    dimension: usize,
    shape: [usize; 2],
    coarse: &[S],
    fine: &mut [S],
) {
    let wide = (2 * shape[1] - 1) * dimension;
    let rows = VALUES_PER_TASK.div_ceil(wide);
    let round = Round { stencils, dimension, shape, coarse };
    let task = |(number, fine): (usize, &mut [S])| Band { round, first: number * rows, fine }.compute();
    if fine.len() <= rows * wide {
        task((0, fine));
    } else {
        parallel::of(fine.chunks_mut(rows * wide).enumerate(), task);
    }
}

/// What all new points come from.
#[derive(Clone, Copy)]
struct Round<'a, S> {
    stencils: &'a Stencils<S>,
    dimension: usize,
    shape: [usize; 2],
    coarse: &'a [S],
}

impl<S: Real> Round<'_, S> {
    /// Computes columns of a new row one by one. Their windows may be cut by borders.
    #[inline(never)]
    fn each(&self, row: usize, columns: Range<usize>, fine: &mut [S]) {
        let &Round { stencils, dimension, shape: [rows, width], coarse } = self;
        let (n, m, radius) = (rows - 1, width - 1, stencils.radius());
        let (top, high) = window(row, radius, n);
        let above = &coarse[top * width * dimension..(top + high) * width * dimension];
        for column in columns {
            let (left, wide) = window(column, radius, m);
            let weights = stencils.weights_of([stencils.axes[0].line(row, n), stencils.axes[1].line(column, m)]);
            for c in 0..dimension {
                let mut sum = S::ZERO;
                for (weights, old) in weights.chunks_exact(wide).zip(above.chunks_exact(width * dimension)) {
                    for (u, weight) in weights.iter().enumerate() {
                        sum += *weight * old[(left + u) * dimension + c];
                    }
                }
                fine[column * dimension + c] = sum;
            }
        }
    }
}

/// Some new rows.
struct Band<'a, S> {
    round: Round<'a, S>,
    /// The first of the new rows.
    first: usize,
    fine: &'a mut [S],
}

impl<S: Real> Band<'_, S> {
    fn compute(self) {
        match (self.round.stencils.radius(), self.round.dimension) {
            (1, 1) => self.side_by_side::<1, 1>(),
            (2, 1) => self.side_by_side::<2, 1>(),
            (3, 1) => self.side_by_side::<3, 1>(),
            (4, 1) => self.side_by_side::<4, 1>(),
            (5, 1) => self.side_by_side::<5, 1>(),
            (1, _) => self.side_by_side::<1, 0>(),
            (2, _) => self.side_by_side::<2, 0>(),
            (3, _) => self.side_by_side::<3, 0>(),
            (4, _) => self.side_by_side::<4, 0>(),
            (5, _) => self.side_by_side::<5, 0>(),
            (radius, _) => unreachable!("there is no rule of radius {radius}"),
        }
    }

    fn side_by_side<const R: usize, const D: usize>(self) {
        if let Err(Rows(Band { round, first, fine })) = with_wide_registers(Rows::<S, R, D>(self)) {
            let columns = 2 * round.shape[1] - 1;
            for (k, fine) in fine.chunks_exact_mut(columns * round.dimension).enumerate() {
                round.each(first + k, 0..columns, fine);
            }
        }
    }
}

/// New rows with radius R and D values per point (any number for D = 0), between borders side by
/// side.
struct Rows<'a, S, const R: usize, const D: usize>(Band<'a, S>);

impl<S: Real, const R: usize, const D: usize> Operation for Rows<'_, S, R, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Band { round, first, fine } = self.0;
        let dimension = if D == 0 { round.dimension } else { D };
        let [n, m] = [round.shape[0] - 1, round.shape[1] - 1];
        let [rows, columns] = round.stencils.axes;
        let width = (m + 1) * dimension;
        // Between the borders windows are whole, and lines alternate.
        let between = match columns {
            Axis::Long(border) => border.next_multiple_of(2)..(2 * m + 1 - border) & !1,
            Axis::Short(_) => 0..0,
        };
        for (k, fine) in fine.chunks_exact_mut((2 * m + 1) * dimension).enumerate() {
            let row = first + k;
            round.each(row, 0..between.start, fine);
            round.each(row, between.end..2 * m + 1, fine);
            if between.is_empty() {
                continue;
            }
            let (top, high) = window(row, R, n);
            let line = rows.line(row, n);
            let above = &round.coarse[top * width..(top + high) * width];
            let weights = [0, 1].map(|odd| round.stencils.weights_of([line, columns.line(between.start + odd, m)]));
            let first = [0, 1].map(|odd| window(between.start + odd, R, m).0 * dimension);
            let fine = &mut fine[between.start * dimension..between.end * dimension];
            let count = between.len() / 2 * dimension;
            let mut at = 0;
            while at + LANES <= count {
                let even = sums::<S, R, 0, LANES>(weights[0], above, width, first[0] + at, dimension);
                let odd = sums::<S, R, 1, LANES>(weights[1], above, width, first[1] + at, dimension);
                put::<S, D>(fine, at, dimension, even, odd);
                at += LANES;
            }
            for at in at..count {
                let even = sums::<S, R, 0, 1>(weights[0], above, width, first[0] + at, dimension);
                let odd = sums::<S, R, 1, 1>(weights[1], above, width, first[1] + at, dimension);
                put_each(fine, at, dimension, even, odd);
            }
        }
    }
}

/// Points of the window of an even (`ODD` = 0) or odd row or column, away from borders.
const fn reach(radius: usize, odd: usize) -> usize {
    if radius % 2 == odd { radius + 1 } else { radius }
}

/// L sums side by side, row after row of the window, in the order of the borders and the kernel.
#[inline(always)]
fn sums<S: Real, const R: usize, const ODD: usize, const L: usize>(
    weights: &[S],
    old: &[S],
    width: usize,
    first: usize,
    dimension: usize,
) -> [S; L] {
    let wide = reach(R, ODD);
    let mut sums = [S::ZERO; L];
    for (weights, old) in weights.chunks_exact(wide).zip(old.chunks_exact(width)) {
        for u in 0..wide {
            let old = &old[first + u * dimension..][..L];
            for k in 0..L {
                sums[k] += weights[u] * old[k];
            }
        }
    }
    sums
}

/// Interleaves even and odd points.
#[inline(always)]
fn put<S: Real, const D: usize>(fine: &mut [S], at: usize, dimension: usize, even: [S; LANES], odd: [S; LANES]) {
    if D == 1 {
        let fine = &mut fine[2 * at..][..2 * LANES];
        for k in 0..LANES {
            fine[2 * k] = even[k];
            fine[2 * k + 1] = odd[k];
        }
    } else {
        put_each(fine, at, dimension, even, odd);
    }
}

#[inline(always)]
fn put_each<S: Real, const L: usize>(fine: &mut [S], at: usize, dimension: usize, even: [S; L], odd: [S; L]) {
    for k in 0..L {
        let (point, c) = ((at + k) / dimension, (at + k) % dimension);
        fine[2 * point * dimension + c] = even[k];
        fine[(2 * point + 1) * dimension + c] = odd[k];
    }
}
