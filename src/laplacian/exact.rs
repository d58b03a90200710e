//! The exact rule, by cosine transforms along rows and tridiagonal systems along columns.
//! Twin: shaders/laplacian/exact.wgsl.
//!
//! Even reflection at the borders turns E₂ₙp = UEₙp₀ into L p = U L p₀ with the plain five-point
//! Laplacian L. A cosine transform along the rows leaves one system for each frequency θ = πl / 2m,
//! l = 0 … 2m. With λ = 2 − 2 cos θ on the fine grid, the coarse one has 2 − 2 cos 2θ = λ(4 − λ).
//! The system is
//!
//! > (2 + λ) uᵢ − uᵢ₋₁ − uᵢ₊₁ = at even rows (2 + λ(4 − λ)) pᵢ − pᵢ₋₁ − pᵢ₊₁, else 0.
//!
//! Odd rows are eliminated by u = (uᵢ₋₁ + uᵢ₊₁) / (2 + λ). With μ = λ(4 + λ) what is left is u₂ᵢ =
//! (2 + λ) vᵢ, where
//!
//! > v = p − 2λ²w,  (2 + μ) wᵢ − wᵢ₋₁ − wᵢ₊₁ = pᵢ.
//!
//! 2λ²/μ ≤ 1, so all systems are well-conditioned, including the constant (λ = 0, v = p). For
//! slowly varying p, v is much smaller than p at high frequencies. The equation for w, mirrored
//! beyond the borders, gives it without cancellation:
//!
//! > v = ((4 − λ) pᵢ + 2λ (2wᵢ − wᵢ₋₁ − wᵢ₊₁)) / (4 + λ).
//!
//! With W the inverse transform of v, 2m + 1 columns for every coarse row, the fine grid is
//!
//! > p₂ᵢ,ⱼ = 2Wᵢⱼ − (Wᵢ,ⱼ₋₁ + Wᵢ,ⱼ₊₁)/2,  p₂ᵢ₊₁,ⱼ = (Wᵢⱼ + Wᵢ₊₁,ⱼ)/2.

use std::sync::Arc;

use faircurve_dct::{Dct1, Planner, Transformed};

use crate::linalg::{Real, take};
use crate::parallel;

/// Frequencies swept side by side: two cache lines of f64.
const BLOCK: usize = 16;

/// Numbers per task: some tens of microseconds of transforms. Not in the kernel.
const TASK: usize = 1 << 14;

/// Points of a coarse grid from which threads share it. Not in the kernel.
const LARGE: usize = 4 * TASK;

/// One round of the exact rule on grids of one shape: (n + 1) × (m + 1) points, n and m > 0.
pub(super) struct Exact<S> {
    shape: [usize; 2],
    forward: Arc<dyn Dct1<S>>,
    inverse: Arc<dyn Dct1<S>>,
    /// λ of the frequencies 0 … 2m.
    lambda: Vec<S>,
}

impl<S: Real + Transformed> Exact<S> {
    pub fn new(shape: [usize; 2], planner: &mut dyn Planner<S>) -> Self {
        let m = shape[1] - 1;
        Exact {
            shape,
            forward: planner.dct1(m + 1),
            inverse: planner.dct1(2 * m + 1),
            lambda: (0..=2 * m).map(|l| Real::from_f64(lambda(l, m))).collect(),
        }
    }

    /// Subdivides one coordinate: `coarse` has (n + 1) × (m + 1) points, `fine` (2n + 1) × (2m +
    /// 1).
    pub fn subdivide(&self, coarse: &[S], fine: &mut [S]) {
        match coarse.len() >= LARGE {
            true => self.subdivide_together(coarse, fine),
            false => self.subdivide_alone(coarse, fine),
        }
    }

    fn subdivide_alone(&self, coarse: &[S], fine: &mut [S]) {
        let [rows, columns] = self.shape;
        let blocks = self.blocks();
        let mut room = vec![S::ZERO; rows * (columns + blocks * BLOCK) + self.scratch()];
        let mut left = &mut room[..];
        let spectrum = take(&mut left, rows * columns);
        let (v, _) = take(&mut left, rows * blocks * BLOCK).as_chunks_mut::<BLOCK>();
        spectrum.copy_from_slice(coarse);
        self.transform(spectrum, left);
        self.sweeps(0, spectrum, v, left);
        self.transform_back(0, v, fine, left);
        combine(2 * columns - 1, fine, &[]);
    }

    /// The same, with rows and blocks of frequencies shared between threads.
    fn subdivide_together(&self, coarse: &[S], fine: &mut [S]) {
        let [rows, columns] = self.shape;
        let wide = 2 * columns - 1;
        let room = || vec![S::ZERO; self.scratch()];
        let mut spectrum = coarse.to_vec();
        parallel::parts(&mut spectrum, &tasks(rows, columns, TASK), |_, own| self.transform(own, &mut room()));
        let mut v = vec![S::ZERO; self.blocks() * rows * BLOCK];
        let ends = tasks(self.blocks(), rows * BLOCK, TASK);
        parallel::parts(&mut v, &ends, |k, own| {
            self.sweeps(ends[k] / (rows * BLOCK), &spectrum, own.as_chunks_mut().0, &mut room());
        });
        let v = v.as_chunks().0;
        // The last coarse row has no row between it and a next one.
        let ends: Vec<usize> = tasks(rows, 2 * wide, TASK).into_iter().map(|end| end.min(fine.len())).collect();
        parallel::parts(fine, &ends, |k, own| self.transform_back(ends[k] / (2 * wide), v, own, &mut room()));
        let below: Vec<Vec<S>> =
            ends[1..].iter().map(|&end| fine[end..].iter().take(wide).copied().collect()).collect();
        parallel::parts(fine, &ends, |k, own| combine(wide, own, &below[k]));
    }

    /// Blocks of frequencies of the fine grid.
    fn blocks(&self) -> usize {
        self.lambda.len().div_ceil(BLOCK)
    }

    /// Size of a thread's scratch memory.
    fn scratch(&self) -> usize {
        self.forward.get_scratch_len().max(self.inverse.get_scratch_len()).max(3 * self.shape[0] * BLOCK)
    }

    /// The spectra of rows, in place.
    fn transform(&self, rows: &mut [S], scratch: &mut [S]) {
        for row in rows.chunks_exact_mut(self.shape[1]) {
            self.forward.process_dct1_with_scratch(row, scratch);
        }
    }

    /// v of blocks of frequencies from `first` on: each has [`BLOCK`] of them for every row.
    fn sweeps(&self, first: usize, spectrum: &[S], v: &mut [[S; BLOCK]], scratch: &mut [S]) {
        for (block, v) in v.chunks_exact_mut(self.shape[0]).enumerate() {
            self.sweep((first + block) * BLOCK, spectrum, v, scratch);
        }
    }

    /// W of the coarse rows from `first` on, in the even rows of the fine grid.
    fn transform_back(&self, first: usize, v: &[[S; BLOCK]], fine: &mut [S], scratch: &mut [S]) {
        let [rows, columns] = self.shape;
        let wide = 2 * columns - 1;
        let scale: S = Real::from_f64(2.0 / (columns - 1) as f64);
        for (row, pair) in fine.chunks_mut(2 * wide).enumerate() {
            let w = &mut pair[..wide];
            for (block, w) in w.chunks_mut(BLOCK).enumerate() {
                w.copy_from_slice(&v[block * rows + first + row][..w.len()]);
            }
            self.inverse.process_dct1_with_scratch(w, scratch);
            for x in w {
                *x *= scale;
            }
        }
    }

    /// v of the frequencies from `first` on, for every row.
    fn sweep(&self, first: usize, spectrum: &[S], v: &mut [[S; BLOCK]], scratch: &mut [S]) {
        let [rows, columns] = self.shape;
        let (wide, last) = (2 * columns - 1, rows - 1);
        let count = BLOCK.min(wide - first);
        let (scratch, _) = scratch[..3 * rows * BLOCK].as_chunks_mut::<BLOCK>();
        let (pivots, rest) = scratch.split_at_mut(rows);
        let (y, p) = rest.split_at_mut(rows);
        let mut lambda = [S::ONE; BLOCK];
        lambda[..count].copy_from_slice(&self.lambda[first..first + count]);
        let [half, two, four]: [S; 3] = [0.5, 2.0, 4.0].map(Real::from_f64);
        let diagonal = lambda.map(|lambda| two + lambda * (four + lambda));
        for (row, p) in p.iter_mut().enumerate() {
            *p = [S::ZERO; BLOCK];
            for (k, p) in p[..count].iter_mut().enumerate() {
                // Zeros between points repeat the spectrum, mirrored.
                let l = first + k;
                *p = spectrum[row * columns + l.min(wide - 1 - l)];
            }
        }
        // The first and the last equation are halved, which makes the system symmetric.
        for k in 0..BLOCK {
            pivots[0][k] = S::ONE / (half * diagonal[k]);
            y[0][k] = half * p[0][k] * pivots[0][k];
        }
        for row in 1..rows {
            let weight = if row == last { half } else { S::ONE };
            for k in 0..BLOCK {
                pivots[row][k] = S::ONE / (weight * diagonal[k] - pivots[row - 1][k]);
                y[row][k] = (weight * p[row][k] + y[row - 1][k]) * pivots[row][k];
            }
        }
        for row in (0..last).rev() {
            for k in 0..BLOCK {
                y[row][k] += pivots[row][k] * y[row + 1][k];
            }
        }
        let of_p = lambda.map(|lambda| (four - lambda) / (four + lambda));
        let of_bend = lambda.map(|lambda| two * lambda / (four + lambda));
        for row in 0..rows {
            let (above, below) = (row.abs_diff(1), if row == last { last - 1 } else { row + 1 });
            for k in 0..count {
                let bend = (y[row][k] - y[above][k]) + (y[row][k] - y[below][k]);
                // λ = 0 is the mean of each row. Its system is singular.
                let is_mean = first + k == 0;
                v[row][k] = if is_mean { p[row][k] } else { of_p[k] * p[row][k] + of_bend[k] * bend };
            }
        }
    }
}

/// Where tasks of whole rows end, each of about `task` numbers.
fn tasks(rows: usize, width: usize, task: usize) -> Vec<usize> {
    let together = (task / width).max(1);
    (0..=rows.div_ceil(together)).map(|k| (k * together).min(rows) * width).collect()
}

/// λ of frequency l = 0 … 2m: 2 − 2 cos(πl / 2m), without cancellation.
pub(super) fn lambda(l: usize, m: usize) -> f64 {
    let sine = (std::f64::consts::PI * l as f64 / (4 * m) as f64).sin();
    4.0 * sine * sine
}

/// Computes rows of the fine grid from W in the even rows. `below` is the next row of W, if there
/// is one.
fn combine<S: Real>(wide: usize, fine: &mut [S], below: &[S]) {
    let half = S::from_f64(0.5);
    let two = S::from_f64(2.0);
    let mut rest = fine;
    while !rest.is_empty() {
        let (even, after) = rest.split_at_mut(wide);
        let (odd, after) = after.split_at_mut(wide.min(after.len()));
        let next = if after.is_empty() { below } else { &after[..wide] };
        for (x, (above, below)) in odd.iter_mut().zip(even.iter().zip(next)) {
            *x = half * (*above + *below);
        }
        // Beyond the border stands the mirror image.
        let (mut before, beside) = (even[1], even[wide - 2]);
        for j in 0..wide - 1 {
            let own = even[j];
            let w = if j == 0 { two * own - before } else { two * own - half * (before + even[j + 1]) };
            even[j] = w;
            before = own;
        }
        even[wide - 1] = two * even[wide - 1] - beside;
        rest = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_together_find_the_bits_that_one_finds() {
        // Odd and even numbers, fewer and more than a block, and more rows than a task has.
        for shape in [[2, 2], [3, 9], [70, 33], [9, 1500], [1500, 9], [301, 257]] {
            let [rows, columns] = shape;
            let exact = Exact::<f64>::new(shape, f64::planner().as_mut());
            let coarse: Vec<f64> = (0..rows * columns).map(|k| (k as f64 * 0.7).sin() + (k % 7) as f64).collect();
            let new = || vec![0.0; (2 * rows - 1) * (2 * columns - 1)];
            let (mut alone, mut together) = (new(), new());
            exact.subdivide_alone(&coarse, &mut alone);
            exact.subdivide_together(&coarse, &mut together);
            assert_eq!(alone, together, "{rows} × {columns}");
        }
    }
}
