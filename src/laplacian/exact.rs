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
//! 2λ²/μ ≤ 1, so nothing is ill-conditioned, not even the constant (λ = 0, v = p). The mean is kept
//! by itself. If p varies slowly, v is far less than p at high frequencies, and a difference would
//! leave few digits of it. The equation for w, mirrored beyond the borders, gives v without one:
//!
//! > v = ((4 − λ) pᵢ + 2λ (2wᵢ − wᵢ₋₁ − wᵢ₊₁)) / (4 + λ).
//!
//! With W the inverse transform of v, 2m + 1 columns for every coarse row, the fine grid is
//!
//! > p₂ᵢ,ⱼ = 2Wᵢⱼ − (Wᵢ,ⱼ₋₁ + Wᵢ,ⱼ₊₁)/2,  p₂ᵢ₊₁,ⱼ = (Wᵢⱼ + Wᵢ₊₁,ⱼ)/2.

use std::sync::Arc;

use faircurve_dct::{Dct1, Planner, Transformed};

use crate::linalg::{Real, take};

/// Frequencies swept side by side: two cache lines of f64.
const BLOCK: usize = 16;

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
        let [rows, columns] = self.shape;
        let wide = 2 * columns - 1;
        let own = self.forward.get_scratch_len().max(self.inverse.get_scratch_len()).max(3 * rows * BLOCK);
        let mut room = vec![<S as Real>::ZERO; rows * (columns + wide) + own];
        let mut left = &mut room[..];
        let spectrum = take(&mut left, rows * columns);
        let w = take(&mut left, rows * wide);

        spectrum.copy_from_slice(coarse);
        for row in spectrum.chunks_exact_mut(columns) {
            self.forward.process_dct1_with_scratch(row, left);
        }
        for first in (0..wide).step_by(BLOCK) {
            self.sweep(first, spectrum, w, left);
        }
        let scale: S = Real::from_f64(2.0 / (columns - 1) as f64);
        for row in w.chunks_exact_mut(wide) {
            self.inverse.process_dct1_with_scratch(row, left);
            row.iter_mut().for_each(|x| *x = *x * scale);
        }
        combine(wide, w, fine);
    }

    /// v of the frequencies from `first` on.
    fn sweep(&self, first: usize, spectrum: &[S], v: &mut [S], scratch: &mut [S]) {
        let [rows, columns] = self.shape;
        let (wide, last) = (2 * columns - 1, rows - 1);
        let count = BLOCK.min(wide - first);
        let (pivots, rest) = scratch.split_at_mut(rows * BLOCK);
        let (y, p) = rest.split_at_mut(rows * BLOCK);
        let (pivots, _) = pivots.as_chunks_mut::<BLOCK>();
        let (y, _) = y.as_chunks_mut::<BLOCK>();
        let (p, _) = p[..rows * BLOCK].as_chunks_mut::<BLOCK>();
        let mut lambda = [S::ONE; BLOCK];
        lambda[..count].copy_from_slice(&self.lambda[first..first + count]);
        let [half, two, four]: [S; 3] = [0.5, 2.0, 4.0].map(Real::from_f64);
        let diagonal = lambda.map(|lambda| two + lambda * (four + lambda));
        for (row, p) in p.iter_mut().enumerate() {
            *p = [<S as Real>::ZERO; BLOCK];
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
                v[row * wide + first + k] = if is_mean { p[row][k] } else { of_p[k] * p[row][k] + of_bend[k] * bend };
            }
        }
    }
}

/// λ of frequency l = 0 … 2m: 2 − 2 cos(πl / 2m), without cancellation.
pub(super) fn lambda(l: usize, m: usize) -> f64 {
    let sine = (std::f64::consts::PI * l as f64 / (4 * m) as f64).sin();
    4.0 * sine * sine
}

/// The fine grid, computed from W.
fn combine<S: Real>(wide: usize, w: &[S], fine: &mut [S]) {
    let half = S::from_f64(0.5);
    let two = S::from_f64(2.0);
    let mut fine_rows = fine.chunks_exact_mut(wide);
    let mut coarse_rows = w.chunks_exact(wide).peekable();
    while let (Some(w), Some(even)) = (coarse_rows.next(), fine_rows.next()) {
        // Beyond the border stands the mirror image.
        even[0] = two * w[0] - w[1];
        for j in 1..wide - 1 {
            even[j] = two * w[j] - half * (w[j - 1] + w[j + 1]);
        }
        even[wide - 1] = two * w[wide - 1] - w[wide - 2];
        if let (Some(next), Some(odd)) = (coarse_rows.peek(), fine_rows.next()) {
            for (x, (above, below)) in odd.iter_mut().zip(w.iter().zip(*next)) {
                *x = half * (*above + *below);
            }
        }
    }
}
