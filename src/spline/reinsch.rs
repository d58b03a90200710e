//! The penalised least-squares problem of one curve, normalised, after Reinsch: the arithmetic of
//! the CPU and of the kernel.
//!
//! Knots s_0 < … < s_{n−1} with spans h_i, data y_i, inverse weights ω_i (0 pins a point). With the
//! divided second difference (Qᵀu)_j = (u_{j+1} − u_j)/h_j − (u_j − u_{j−1})/h_{j−1} and the
//! tridiagonal matrix R of rows h_{j−1}/6, (h_{j−1} + h_j)/3, h_j/6, a natural (or periodic) cubic
//! spline of values g has second derivatives γ with Rγ = Qᵀg, and energy γᵀRγ. Minimising Σ |y_i −
//! g_i|²/ω_i + λ γᵀRγ gives g = y − λ Ω Q γ and
//!
//! ```text
//! (R + λ Qᵀ Ω Q) γ = Qᵀ y.
//! ```
//!
//! So that no λ from 0 to ∞ overflows, both sides are divided by 1 + λ: with α = 1/(1 + λ), β =
//! λ/(1 + λ) and v = γ/α, (αR + β QᵀΩQ) v = Qᵀy and g = y − βΩQv. The matrix grows ill-conditioned
//! as n⁴ for large λ; one step of iterative refinement through g, which the ill-conditioned part of
//! v hardly enters, restores full accuracy.
//!
//! C. H. Reinsch, Smoothing by spline functions, Numer. Math. 10 (1967) 177–183; P. J. Green, B. W.
//! Silverman, Nonparametric Regression and Generalized Linear Models (1994), section 2.3.

use crate::linalg::banded::Banded;
use crate::linalg::{Lanes, Real, Scalar, operation, run};

/// The λ whose [`scores`](Reinsch::scores) are found at once: two wide registers.
pub(crate) const TRIALS: usize = 8;

/// Steps of iterative refinement at most. One suffices below some 10,000 knots; beyond, where a
/// step leaves a tenth of the error or more, the rest are spent.
const MAX_REFINEMENTS: usize = 6;

/// Refinement stops once it moves no value by more than this many ε of the curve's size. A step
/// that moved so little leaves a hundredth of it: kernels are sent only what their precision
/// resolves to that, and in f64 nearly all is so. Smaller bounds meet the rounding of the values
/// themselves, and ask for steps that mend nothing …
const REFINED_EPSILONS: f64 = 256.0;

/// … and has failed if the last step still moved one by more than this many: 2e-12 in f64, 1e-3 in
/// f32, of which again a hundredth stays. The host then fits again what a kernel failed at.
const FAILED_EPSILONS: f64 = 8192.0;

/// The problem of one curve and its solution. The buffers are kept from curve to curve, so that
/// none is allocated twice.
#[derive(Default)]
pub(crate) struct Reinsch<T: Real> {
    /// Number of knots; a closed curve's first is not repeated.
    pub count: usize,
    /// 2 or 3.
    pub dimension: usize,
    /// Periodic instead of natural ends.
    pub closed: bool,
    /// Length of the span that starts at each knot: `count` of a closed curve, one fewer of an open
    /// one.
    pub spans: Vec<T>,
    /// ω_i: inverse weights; 0 pins.
    pub inverse_weights: Vec<T>,
    /// Knots at which the curve may have a corner, in increasing order: γ is 0 there, and the first
    /// derivative may jump.
    pub corners: Vec<usize>,
    /// y_i, of size about 1.
    pub data: Vec<T>,
    /// y_i − g_i of the last solve: exactly 0 where ω_i = 0.
    pub correction: Vec<T>,
    /// v_i = γ_i/α of the last solve, at all knots.
    pub moments: Vec<T>,
    /// α of the last solve.
    pub alpha: T,
    inverse_spans: Vec<T>,
    rhs: Vec<T>,
    step: Vec<T>,
    fitted: Vec<T>,
    bands: Vec<[T; 5]>,
    /// Whether the bands are all finite.
    representable: bool,
    matrix: Banded<T, 2>,
    /// 1 for every unknown, 0 for those held at 0.
    movable: Vec<T>,
    /// Of a closed curve without corners: the solution for a unit load on the last unknown.
    influence: Vec<T>,
}

impl<T: Real> Reinsch<T> {
    /// Computes what does not depend on λ, once the public fields are set.
    pub fn prepare(&mut self) {
        let (n, d) = (self.count, self.dimension);
        self.inverse_spans.clear();
        self.inverse_spans.extend(self.spans.iter().map(|&h| T::ONE / h));
        // An open curve has no span after its last knot: an infinite one.
        self.inverse_spans.resize(n, T::ZERO);
        for buffer in [&mut self.correction, &mut self.moments, &mut self.rhs, &mut self.step, &mut self.fitted] {
            buffer.clear();
            buffer.resize(n * d, T::ZERO);
        }
        let unknowns = self.unknowns();
        self.matrix.renew(self.closed, &[unknowns]);
        self.movable.clear();
        self.movable.resize(unknowns, T::ONE);
        let skipped = usize::from(!self.closed);
        for &corner in &self.corners {
            self.movable[corner - skipped] = T::ZERO;
        }
        self.influence.clear();
        self.influence.resize(if self.is_smooth_ring() { n } else { 0 }, T::ZERO);
        second_differences(&self.data, &self.inverse_spans, n, d, self.closed, |at, x| self.rhs[at] = x);
        self.fill_bands();
        self.representable = self.bands.iter().flatten().all(|x| x.is_finite());
    }

    /// Whether the curve is closed, and has no corner.
    fn is_smooth_ring(&self) -> bool {
        self.closed && self.corners.is_empty()
    }

    /// Number of unknown second derivatives: those at the ends of an open curve are 0.
    fn unknowns(&self) -> usize {
        if self.closed { self.count } else { self.count.saturating_sub(2) }
    }

    /// The unknowns' part of an array over all knots.
    fn inner(&self) -> std::ops::Range<usize> {
        let skipped = usize::from(!self.closed);
        skipped * self.dimension..(skipped + self.unknowns()) * self.dimension
    }

    /// Diagonal and band of R, diagonal and two bands of QᵀΩQ, at every unknown; those of a closed
    /// curve with all indices modulo n, to be summed as [`Banded`] does.
    fn fill_bands(&mut self) {
        let (n, skipped) = (self.count, usize::from(!self.closed));
        let wrap = |k: usize| if k >= n { k - n } else { k };
        let (h, ih, w) = (&self.spans, &self.inverse_spans, &self.inverse_weights);
        self.bands.clear();
        for j in 0..self.unknowns() {
            // The knot of this unknown and those around it.
            let here = j + skipped;
            let before = if here == 0 { n - 1 } else { here - 1 };
            let next = wrap(here + 1);
            let centre = -(ih[before] + ih[here]);
            let centre_next = -(ih[here] + ih[next]);
            self.bands.push([
                (h[before] + h[here]) / T::from_f64(3.0),
                h[here] / T::from_f64(6.0),
                w[before] * (ih[before] * ih[before]) + w[here] * (centre * centre) + w[next] * (ih[here] * ih[here]),
                ih[here] * (w[here] * centre + w[next] * centre_next),
                // Of an open curve's last two unknowns this would couple with knots that have no
                // unknown; it is not read.
                w[next] * (ih[here] * ih[next]),
            ]);
        }
    }

    /// Solves for one λ ≥ 0, ∞ not included. False where the system is singular in this precision.
    pub fn solve(&mut self, lambda: T) -> bool {
        let (n, d, closed) = (self.count, self.dimension, self.closed);
        // Both forms keep their relative accuracy for any λ.
        let alpha = T::ONE / (T::ONE + lambda);
        let beta = lambda / (T::ONE + lambda);
        self.alpha = alpha;
        if (beta > T::ZERO && !self.representable) || !self.factor(alpha, beta) {
            return false;
        }
        let inner = self.inner();
        self.moments.copy_from_slice(&self.rhs);
        self.solve_factored(true);
        if beta == T::ZERO || inner.is_empty() {
            self.correction.fill(T::ZERO);
            return true;
        }
        let mut moved = T::ZERO;
        second_differences(&self.moments, &self.inverse_spans, n, d, closed, |at, x| {
            self.correction[at] = beta * (self.inverse_weights[at / d] * x);
        });
        for _ in 0..MAX_REFINEMENTS {
            for (at, g) in self.fitted.iter_mut().enumerate() {
                *g = self.data[at] - self.correction[at];
            }
            second_differences(&self.fitted, &self.inverse_spans, n, d, closed, |at, x| self.step[at] = x);
            self.subtract_bending(alpha);
            self.solve_factored(false);
            moved = T::ZERO;
            for at in inner.clone() {
                self.moments[at] = self.moments[at] + self.step[at];
            }
            second_differences(&self.step, &self.inverse_spans, n, d, closed, |at, x| {
                let change = beta * (self.inverse_weights[at / d] * x);
                self.correction[at] += change;
                // NaN counts as the largest change.
                let smaller = change.abs() <= moved;
                moved = if smaller { moved } else { change.abs() };
            });
            if moved <= T::from_f64(REFINED_EPSILONS) * T::EPSILON {
                return true;
            }
        }
        moved <= T::from_f64(FAILED_EPSILONS) * T::EPSILON
    }

    /// Σ w_i |y_i − g_i|²/tr(I − A)² of [`TRIALS`] λ of an open curve without
    /// corners, where A takes data to the values of the curve. Without refinement.
    pub fn scores(&self, lambdas: [T; TRIALS]) -> [T; TRIALS] {
        let lambdas = Lanes(lambdas);
        match self.dimension {
            2 => run(Scores::<T, 2> { problem: self, lambdas }).0,
            _ => run(Scores::<T, 3> { problem: self, lambdas }).0,
        }
    }

    /// One elimination for all λ. On the way back come v, and the entries of the inverse on five diagonals, of
    /// which β tr((αR + βQᵀΩQ)⁻¹ QᵀΩQ) consists (Hutchinson and de Hoog, Numerische Mathematik 47, 1985). β
    /// cancels from the score.
    #[inline(always)]
    fn scores_inlined<const D: usize>(&self, lambdas: Lanes<T, TRIALS>) -> Lanes<T, TRIALS> {
        let same = |x: T| Lanes([x; TRIALS]);
        let (one, zero) = (same(T::ONE), same(T::ZERO));
        let alpha = one / (one + lambdas);
        let beta = lambdas * alpha;
        // L D Lᵀ and L⁻¹Qᵀy: for each unknown 1/d, the entries of L one and two rows below, and the right-hand side.
        let mut rows = Vec::with_capacity(self.bands.len());
        let mut last = ([zero; 4], [zero; D]);
        let mut before = last;
        for (band, right) in self.bands.iter().zip(self.rhs.chunks_exact(D).skip(1)) {
            let ([_, e, f, d], z) = last;
            let ([_, _, f_before, d_before], z_before) = before;
            let pivot = alpha * same(band[0]) + beta * same(band[2]) - d * (e * e) - d_before * (f_before * f_before);
            let inverse = pivot.if_positive(one / pivot, same(T::NAN));
            let below = (alpha * same(band[1]) + beta * same(band[3]) - d * (e * f)) * inverse;
            let beyond = beta * same(band[4]) * inverse;
            let solved = std::array::from_fn(|axis| same(right[axis]) - e * z[axis] - f_before * z_before[axis]);
            (before, last) = (last, ([inverse, below, beyond, pivot], solved));
            rows.push(last);
        }
        // Of the inverse: its entries at the next unknown, the one after, and between them.
        let (mut next, mut after, mut between, mut trace, mut squares) = (zero, zero, zero, zero, zero);
        let (mut v, mut v_next) = ([zero; D], [zero; D]);
        for (knot, (inverse, weight)) in self.inverse_spans.iter().zip(&self.inverse_weights).enumerate().rev() {
            // The unknown at the knot before; at both ends v is 0.
            let mut v_before = [zero; D];
            if let Some(unknown) = knot.checked_sub(2) {
                let ([inverse, e, f, _], z) = rows[unknown];
                let band = &self.bands[unknown];
                v_before = std::array::from_fn(|axis| z[axis] * inverse - e * v[axis] - f * v_next[axis]);
                let two = zero - e * between - f * after;
                let one = zero - e * next - f * between;
                let own = inverse - e * one - f * two;
                let beside = one * same(band[3]) + two * same(band[4]);
                trace += own * same(band[2]) + beside + beside;
                (after, next, between) = (next, own, one);
            }
            let left = if knot == 0 { T::ZERO } else { self.inverse_spans[knot - 1] };
            for axis in 0..D {
                let pull = (v_next[axis] - v[axis]) * same(*inverse) - (v[axis] - v_before[axis]) * same(left);
                squares += same(*weight) * (pull * pull);
            }
            (v_next, v) = (v, v_before);
        }
        squares / (trace * trace)
    }

    /// Solves for other data with the factors of the last [`solve`](Self::solve), without
    /// refinement.
    pub fn solve_again(&mut self) {
        let (n, d, closed) = (self.count, self.dimension, self.closed);
        second_differences(&self.data, &self.inverse_spans, n, d, closed, |at, x| self.rhs[at] = x);
        self.moments.copy_from_slice(&self.rhs);
        self.solve_factored(true);
        let beta = T::ONE - self.alpha;
        second_differences(&self.moments, &self.inverse_spans, n, d, closed, |at, x| {
            self.correction[at] = beta * (self.inverse_weights[at / d] * x);
        });
    }

    /// Factors αR + βQᵀΩQ, for a closed curve without corners with its last diagonal entry doubled: constants are
    /// in the null space of Q, so that for large λ the matrix itself is singular to rounding.
    fn factor(&mut self, alpha: T, beta: T) -> bool {
        self.matrix.clear();
        for (j, band) in self.bands.iter().enumerate() {
            // Without smoothing the penalty plays no part, even where it overflows.
            let [_, _, two, three, four] = if beta > T::ZERO { *band } else { [T::ZERO; 5] };
            let diagonal = alpha * band[0] + beta * two;
            let is_doubled = self.is_smooth_ring() && j + 1 == self.count;
            self.matrix.add_diagonal(j, if is_doubled { diagonal + diagonal } else { diagonal });
            self.matrix.add_entry(j + 1, j, alpha * band[1] + beta * three);
            self.matrix.add_entry(j + 2, j, beta * four);
        }
        let is_definite = self.matrix.factor(&self.movable) > T::ZERO;
        if let Some(last) = self.influence.len().checked_sub(1) {
            self.influence.fill(T::ZERO);
            self.influence[last] = T::ONE;
            self.matrix.solve(self.influence.as_chunks_mut::<1>().0);
        }
        is_definite
    }

    /// Solves with the factors, in place: `moments` or `step`.
    ///
    /// For a closed curve without corners the matrix that was factored is A + τeeᵀ. The solution for A is x + κz, z =
    /// (A + τeeᵀ)⁻¹e. Second derivatives of a periodic spline integrate to 0: that is 1ᵀA = α·1ᵀR
    /// and 1ᵀQᵀ = 0, and it determines κ for every α, 0 included.
    fn solve_factored(&mut self, moments: bool) {
        let inner = self.inner();
        let (n, d) = (self.count, self.dimension);
        let x = if moments { &mut self.moments } else { &mut self.step };
        if !self.closed {
            let ends = [0..d, (n - 1) * d..n * d];
            ends.into_iter().for_each(|end| x[end].fill(T::ZERO));
        }
        for &corner in &self.corners {
            x[corner * d..(corner + 1) * d].fill(T::ZERO);
        }
        match d {
            2 => self.matrix.solve(x[inner].as_chunks_mut::<2>().0),
            _ => self.matrix.solve(x[inner].as_chunks_mut::<3>().0),
        }
        if self.influence.is_empty() {
            return;
        }
        let share = |k: usize| self.spans[if k == 0 { n - 1 } else { k - 1 }] + self.spans[k];
        let unit = (0..n).fold(T::ZERO, |sum, k| sum + share(k) * self.influence[k]);
        for axis in 0..d {
            let integral = (0..n).fold(T::ZERO, |sum, k| sum + share(k) * x[k * d + axis]);
            let factor = integral / unit;
            (0..n).for_each(|k| x[k * d + axis] -= factor * self.influence[k]);
        }
    }

    /// `step` −= α R v at the unknowns.
    fn subtract_bending(&mut self, alpha: T) {
        let (n, d) = (self.count, self.dimension);
        let (h, v) = (&self.spans, &self.moments);
        let skipped = usize::from(!self.closed);
        for k in skipped..n - skipped {
            let before = if k == 0 { n - 1 } else { k - 1 };
            let next = if k + 1 == n { 0 } else { k + 1 };
            let (left, right) = (h[before], h[k]);
            for axis in 0..d {
                let at = |k: usize| v[k * d + axis];
                let sum = left * at(before) + T::from_f64(2.0) * (left + right) * at(k) + right * at(next);
                self.step[k * d + axis] -= alpha * (sum / T::from_f64(6.0));
            }
        }
    }

    /// Largest |ω_i (Qγ)_i| of the last solve: the largest correction per λ, for small λ.
    pub fn largest_pull(&self) -> T {
        let (n, d) = (self.count, self.dimension);
        let (mut largest, mut square) = (T::ZERO, T::ZERO);
        second_differences(&self.moments, &self.inverse_spans, n, d, self.closed, |at, x| {
            let pull = self.alpha * (self.inverse_weights[at / d] * x);
            square = if at % d == 0 { pull * pull } else { square + pull * pull };
            if square > largest {
                largest = square;
            }
        });
        T::from_f64(largest.to_f64().sqrt())
    }

    /// γᵀRγ of the last solve, summed over the coordinates: ∫|p″|² of the normalised curve.
    pub fn energy(&self) -> T {
        let (n, d) = (self.count, self.dimension);
        let mut sum = T::ZERO;
        for (k, &h) in self.spans.iter().enumerate() {
            let next = if k + 1 == n { 0 } else { k + 1 };
            for axis in 0..d {
                let (a, b) = (self.alpha * self.moments[k * d + axis], self.alpha * self.moments[next * d + axis]);
                // a² + ab + b² as squares, whose sum may overflow but is never ∞ − ∞; the span
                // times a moment first, since its square alone may be out of range.
                let middle = a + T::from_f64(0.5) * b;
                sum += h * middle * middle + T::from_f64(0.75) * h * b * b;
            }
        }
        sum / T::from_f64(3.0)
    }

    /// Whether more points than both ends of an open curve are pinned. Then no line is its limit.
    pub fn has_inner_pins(&self) -> bool {
        let pinned = |k: usize| self.inverse_weights[k] == T::ZERO;
        let ends = !self.closed && pinned(0) && pinned(self.count - 1);
        let first = usize::from(ends);
        (first..self.count - first).any(pinned)
    }

    /// The limit λ → ∞: the weighted regression line, through the ends that are pinned; of a closed
    /// curve the weighted mean. Sets `correction`, and `moments` to 0.
    pub fn solve_line(&mut self) {
        let (n, d) = (self.count, self.dimension);
        self.moments.fill(T::ZERO);
        self.alpha = T::ZERO;
        // Only both ends are pinned here, and a pinned point outweighs all others.
        let pinned = self.inverse_weights[0] == T::ZERO;
        for axis in 0..d {
            let y = |k: usize| self.data[k * d + axis];
            let (centre, level, slope) = if pinned {
                let length = self.spans.iter().fold(T::ZERO, |sum, &h| sum + h);
                (T::ZERO, y(0), (y(n - 1) - y(0)) / length)
            } else {
                self.regression(axis)
            };
            let mut s = T::ZERO;
            for k in 0..n {
                let pinned_end = pinned && (k == 0 || k + 1 == n);
                self.correction[k * d + axis] =
                    if pinned_end { T::ZERO } else { y(k) - (level + slope * (s - centre)) };
                if k + 1 < n {
                    s += self.spans[k];
                }
            }
        }
    }

    /// Weighted mean of the parameters, weighted mean of a coordinate, and slope (0 for closed
    /// curves).
    fn regression(&self, axis: usize) -> (T, T, T) {
        let (n, d) = (self.count, self.dimension);
        let weight = |k: usize| T::ONE / self.inverse_weights[k];
        let y = |k: usize| self.data[k * d + axis];
        let parameter = |s: &mut T, k: usize| {
            let here = *s;
            *s = if k + 1 < n { here + self.spans[k] } else { here };
            here
        };
        let (mut weights, mut centre, mut level, mut s) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO);
        for k in 0..n {
            let here = parameter(&mut s, k);
            weights += weight(k);
            centre += weight(k) * here;
            level += weight(k) * y(k);
        }
        (centre, level) = (centre / weights, level / weights);
        if self.closed {
            return (centre, level, T::ZERO);
        }
        let (mut square, mut product, mut s) = (T::ZERO, T::ZERO, T::ZERO);
        for k in 0..n {
            let here = parameter(&mut s, k) - centre;
            square += weight(k) * here * here;
            product += weight(k) * here * (y(k) - level);
        }
        (centre, level, product / square)
    }
}

operation! {
    Scores<'a, T: Real; D> { problem: &'a Reinsch<T>, lambdas: Lanes<T, TRIALS> } -> Lanes<T, TRIALS> {
        problem.scores_inlined::<D>(lambdas)
    }
}

/// (u_{j+1} − u_j)/h_j − (u_j − u_{j−1})/h_{j−1} at every knot, handed to `put` with its flat
/// index. A span that an open curve does not have counts as infinitely long, which makes the
/// operator its own transpose, Q and Qᵀ at once.
fn second_differences<T: Real>(
    u: &[T],
    inverse_spans: &[T],
    count: usize,
    dimension: usize,
    closed: bool,
    mut put: impl FnMut(usize, T),
) {
    for k in 0..count {
        let before = if k == 0 { count - 1 } else { k - 1 };
        let next = if k + 1 == count { 0 } else { k + 1 };
        let left = if k == 0 && !closed { T::ZERO } else { inverse_spans[before] };
        let right = inverse_spans[k];
        for axis in 0..dimension {
            let at = |k: usize| u[k * dimension + axis];
            put(k * dimension + axis, (at(next) - at(k)) * right - (at(k) - at(before)) * left);
        }
    }
}
#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Uneven spans, inverse weights over four decades.
    fn random_problem<T: Real>(n: usize, closed: bool, seed: u64) -> Reinsch<T> {
        let mut random = StdRng::seed_from_u64(seed);
        let spans: Vec<f64> = (0..n - usize::from(!closed)).map(|_| random.random_range(0.05..2.0)).collect();
        let length: f64 = spans.iter().sum();
        let mut problem = Reinsch {
            count: n,
            dimension: 2,
            closed,
            spans: spans.iter().map(|h| T::from_f64(h / length)).collect(),
            inverse_weights: (0..n).map(|_| T::from_f64(10_f64.powf(random.random_range(0.0..4.0)))).collect(),
            data: (0..2 * n).map(|_| T::from_f64(random.random_range(-1.0..1.0))).collect(),
            ..Reinsch::default()
        };
        problem.prepare();
        problem
    }

    fn worst<T: Real, U: Real>(a: &[T], b: &[U]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a.to_f64() - b.to_f64()).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn the_limit_of_large_lambda_is_the_line() {
        for closed in [false, true] {
            for seed in 0..50 {
                for n in [3, 5, 27, 200] {
                    let mut problem = random_problem::<f64>(n, closed, seed);
                    problem.solve_line();
                    let line = problem.correction.clone();
                    for power in [4, 8, 12, 14, 16, 19, 100] {
                        let lambda = 10_f64.powi(power);
                        assert!(problem.solve(lambda), "{n} points, closed {closed}, λ 1e{power}, seed {seed}");
                        let error = worst(&problem.correction, &line);
                        // The smallest eigenvalue of the penalty is at least (3π/2)⁴/n, inverse
                        // weights being 1 and more.
                        assert!(error < n as f64 / lambda + 1e-12, "{n}, closed {closed}, λ 1e{power}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn long_curves_keep_their_accuracy_at_large_lambda() {
        // 3,000 knots: the matrix alone is ill-conditioned to 1e13.
        for closed in [false, true] {
            let mut problem = random_problem::<f64>(3000, closed, 1);
            problem.solve_line();
            let line = problem.correction.clone();
            assert!(problem.solve(1e15));
            let error = worst(&problem.correction, &line);
            assert!(error < 1e-11, "closed {closed}: {error}");
        }
    }

    #[test]
    fn closed_curves_shrink_mode_by_mode_towards_the_ellipse_of_the_first() {
        // Modes 1, 2 and 3 of size 1 around (5, −2), the first an ellipse.
        let n = 120;
        let angle = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        let mode = |m: usize, k: usize| (m as f64 * angle(k)).sin_cos();
        let point = |k: usize| {
            let [(s1, c1), (s2, c2), (s3, c3)] = [1, 2, 3].map(|m| mode(m, k));
            [5.0 + c1 + c2 + c3, -2.0 + 0.5 * s1 + s2 + s3]
        };
        let mut problem = Reinsch::<f64> {
            count: n,
            dimension: 2,
            closed: true,
            spans: vec![1.0 / n as f64; n],
            inverse_weights: vec![1.0; n],
            data: (0..n).flat_map(point).collect(),
            ..Reinsch::default()
        };
        problem.prepare();
        for lambda in [1e-3, 1.0, 1e3] {
            assert!(problem.solve(lambda));
            for m in 1..=3 {
                let x = |k: usize| problem.data[2 * k] - problem.correction[2 * k];
                let size = (0..n).map(|k| x(k) * mode(m, k).1).sum::<f64>() * 2.0 / n as f64;
                let factor = 1.0 / (1.0 + lambda * (std::f64::consts::TAU * m as f64).powi(4) / n as f64);
                // The spline through samples bends as the mode itself to O((m/n)⁴); beside a mean
                // of 5, rounding.
                assert!((size - factor).abs() < 1e-3 * factor + 1e-11, "λ {lambda}, mode {m}: {size}, not {factor}");
            }
        }
    }

    #[test]
    fn single_precision_follows_double_precision() {
        for closed in [false, true] {
            for n in [2, 3, 4, 10, 60] {
                let (mut wide, mut narrow) = (random_problem::<f64>(n, closed, 1), random_problem::<f32>(n, closed, 1));
                // Up to condition numbers of some 1e5, where the values of f32 still mean
                // something.
                for lambda in [0.0, 1e-9, 1e-7, 1e-5].map(|x| x * 1e4 / (n as f64).powi(2)) {
                    assert!(wide.solve(lambda) && narrow.solve(lambda as f32), "{n} points, λ {lambda}");
                    let error = worst(&wide.correction, &narrow.correction);
                    assert!(error < 2e-6, "{n} points, closed {closed}, λ {lambda}: {error}");
                }
            }
        }
    }
}
