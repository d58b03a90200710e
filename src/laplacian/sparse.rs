//! Sparse rules applied: every new point is the weighted sum of the old ones in its window.
//! Twin: shaders/laplacian/sparse.wgsl.

use super::stencil::{Stencils, window};
use crate::linalg::{Real, with_wide_registers};
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
    let task = |(number, fine): (usize, &mut [S])| {
        let band = Band { stencils, dimension, shape, coarse, first: number * rows, fine };
        if let Err(band) = with_wide_registers(band) {
            band.compute();
        }
    };
    if fine.len() <= rows * wide {
        task((0, fine));
    } else {
        parallel::of(fine.chunks_mut(rows * wide).enumerate(), task);
    }
}

/// Some new rows.
struct Band<'a, S> {
    stencils: &'a Stencils<S>,
    dimension: usize,
    shape: [usize; 2],
    coarse: &'a [S],
    /// The first of the new rows.
    first: usize,
    fine: &'a mut [S],
}

impl<S: Real> pulp::WithSimd for Band<'_, S> {
    type Output = ();

    #[inline(always)]
    fn with_simd<Registers: pulp::Simd>(self, _: Registers) {
        self.compute();
    }
}

impl<S: Real> Band<'_, S> {
    #[inline(always)]
    fn compute(self) {
        match (self.stencils.radius(), self.dimension) {
            (1, 1) => self.rows::<1, 1>(),
            (2, 1) => self.rows::<2, 1>(),
            (3, 1) => self.rows::<3, 1>(),
            (4, 1) => self.rows::<4, 1>(),
            (5, 1) => self.rows::<5, 1>(),
            (1, _) => self.rows::<1, 0>(),
            (2, _) => self.rows::<2, 0>(),
            (3, _) => self.rows::<3, 0>(),
            (4, _) => self.rows::<4, 0>(),
            (5, _) => self.rows::<5, 0>(),
            (radius, _) => unreachable!("there is no rule of radius {radius}"),
        }
    }

    /// All rows, with radius R and D values a point. D = 0 stands for any number.
    #[inline(always)]
    fn rows<const R: usize, const D: usize>(self) {
        let dimension = if D == 0 { self.dimension } else { D };
        let [n, m] = [self.shape[0] - 1, self.shape[1] - 1];
        let [rows, columns] = self.stencils.axes;
        let width = (m + 1) * dimension;
        // Between the borders windows are whole, and lines alternate.
        let between = match columns {
            super::stencil::Axis::Long(border) => border.next_multiple_of(2)..(2 * m + 1 - border) & !1,
            super::stencil::Axis::Short(_) => 0..0,
        };
        for (k, fine) in self.fine.chunks_exact_mut((2 * m + 1) * dimension).enumerate() {
            let row = self.first + k;
            let (top, high) = window(row, R, n);
            let line = rows.line(row, n);
            let above = &self.coarse[top * width..(top + high) * width];
            for column in (0..between.start).chain(between.end..2 * m + 1) {
                let (left, wide) = window(column, R, m);
                let weights = self.stencils.weights_of([line, columns.line(column, m)]);
                for c in 0..dimension {
                    let mut sum = S::ZERO;
                    for (weights, old) in weights.chunks_exact(wide).zip(above.chunks_exact(width)) {
                        for (u, weight) in weights.iter().enumerate() {
                            sum += *weight * old[(left + u) * dimension + c];
                        }
                    }
                    fine[column * dimension + c] = sum;
                }
            }
            if between.is_empty() {
                continue;
            }
            let weights = [0, 1].map(|odd| self.stencils.weights_of([line, columns.line(between.start + odd, m)]));
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

/// Even and odd points in turn.
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
