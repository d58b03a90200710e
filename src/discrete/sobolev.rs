//! Sobolev gradients z = L⁻¹g: the metric L in place of Newton's H, and the steps along −z.
//!
//! | order | ⟨g, h⟩ |
//! |---|---|
//! | 1 | w Σ Δg·Δh/Δs, the L_f of the paper |
//! | 2 | w Σ N D₂g · N D₂h Δa |
//! | 3 | w Σ D(N D₂g) · D(N D₂h) Δs |
//!
//! N is the projection across the curve at data points, and 1 elsewhere. At a data point neither
//! the energy nor the regularisation resists the component of D₂g along the curve, so a metric with
//! it would treat soft directions as stiff. The stiffness of anchors is added.
//!
//! After a step s that changes the gradient by y, the next step is ⟨s, s⟩/y·s. It follows from
//! known slopes, and needs no further evaluation and no vector. The energy may rise in a step, but
//! stays below a mean of the previous energies.
//!
//! Sources: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006). J. Barzilai and
//! J. M. Borwein, *Two-point step size gradient methods*, IMA Journal of Numerical Analysis 8
//! (1988). H. Zhang and W. W. Hager, *A nonmonotone line search technique and its application to
//! unconstrained optimization*, SIAM Journal on Optimization 14 (2004). N is faircurve's.

// Loops over coordinates by index match the formulas.
#![allow(clippy::needless_range_loop)]

use super::block::{Block, add_scaled, outer, subtract_block};
use super::edges::Edges;
use super::hessian::BlockHessian;
use crate::damping::{ROUNDING, Trial, Verdict, least};
use crate::linalg::scalar::{Vector, add, dot};
use crate::linalg::{Real, Scalar, operation};

impl<S: Scalar, const D: usize> BlockHessian<S, D> {
    /// Assembles L of an order in place of H, at the curve where the edges were placed.
    pub fn assemble_metric(&mut self, order: usize, edges: &Edges<S, D>, weight: S) {
        S::run(Metric { hessian: self, order, edges, weight });
    }

    #[inline(always)]
    fn assemble_metric_inlined(&mut self, order: usize, edges: &Edges<S, D>, weight: S) {
        self.clear();
        match order {
            ..2 => self.add_first(edges, weight),
            2 => self.add_second(edges, weight),
            _ => {
                // A parabola through two data points has no third derivative.
                let has_third = edges.has_three_data_points();
                self.add_third(edges, has_third * weight);
                self.add_second(edges, (S::ONE - has_third) * weight);
            }
        }
        self.close();
    }

    #[inline(always)]
    fn add_first(&mut self, edges: &Edges<S, D>, weight: S) {
        for j in 0..edges.windows::<1>() {
            let weight = weight * edges.starts::<1>(j) * edges.inverse[j];
            self.add_square(j, weight, &[-S::ONE, S::ONE].map(scaled));
        }
    }

    #[inline(always)]
    fn add_second(&mut self, edges: &Edges<S, D>, weight: S) {
        for j in 0..edges.windows::<2>() {
            let measure = S::of(0.5) * (edges.length[j] + edges.length[j + 1]);
            self.add_square(j, weight * edges.starts::<2>(j) * measure, &second(edges, j));
        }
    }

    #[inline(always)]
    fn add_third(&mut self, edges: &Edges<S, D>, weight: S) {
        let zero = [[S::ZERO; D]; D];
        for j in 0..edges.windows::<3>() {
            let ([b0, b1, b2], [a1, a2, a3]) = (second(edges, j), second(edges, j + 1));
            let mut row = [zero, a1, a2, a3];
            for (row, before) in row.iter_mut().zip([b0, b1, b2]) {
                subtract_block(row, &before);
            }
            self.add_square(j, weight * edges.starts::<3>(j) * edges.curvature_distance(j).inverse, &row);
        }
    }

    /// Adds weight · rowᵀ row at the vertices from `start` on.
    #[inline(always)]
    fn add_square<const N: usize>(&mut self, start: usize, weight: S, row: &[Block<S, D>; N]) {
        for j in 0..N {
            for k in j..N {
                for a in 0..D {
                    for b in 0..D {
                        for c in 0..D {
                            self.blocks[start + j][k - j][a][b] += weight * row[j][c][a] * row[k][c][b];
                        }
                    }
                }
            }
        }
    }
}

operation! {
    /// [`BlockHessian::assemble_metric`]
    Metric<'a, S: Scalar; D> { hessian: &'a mut BlockHessian<S, D>, order: usize, edges: &'a Edges<S, D>, weight: S }
        -> () { hessian.assemble_metric_inlined(order, edges, weight) }
}

/// x I
#[inline(always)]
pub(super) fn scaled<S: Scalar, const D: usize>(x: S) -> Block<S, D> {
    let mut block = [[S::ZERO; D]; D];
    for c in 0..D {
        block[c][c] = x;
    }
    block
}

/// N D₂ at the vertex between the edges j and j + 1, with respect to the vertices j, j + 1 and
/// j + 2.
#[inline(always)]
fn second<S: Scalar, const D: usize>(edges: &Edges<S, D>, j: usize) -> [Block<S, D>; 3] {
    let (r0, r1) = (edges.inverse[j], edges.inverse[j + 1]);
    let share = S::of(2.0) / (edges.length[j] + edges.length[j + 1]);
    let tangent = halfway(edges.tangent[j], edges.tangent[j + 1]);
    // 1 at a data point.
    let along = edges.free(j).if_positive(S::ZERO, S::ONE);
    [share * r0, -(share * (r0 + r1)), share * r1].map(|x| {
        let mut block = scaled(x);
        add_scaled(&mut block, -S::ONE, &outer(along * x, tangent, tangent));
        block
    })
}

/// The unit vector halfway between two. The second one if they are opposite.
#[inline(always)]
fn halfway<S: Scalar, const D: usize>(before: Vector<S, D>, after: Vector<S, D>) -> Vector<S, D> {
    let sum = add(before, after);
    let square = dot(sum, sum);
    let is_turn = S::of(1e-12) - square;
    let inverse = S::ONE / is_turn.if_positive(S::ONE, square).sqrt();
    std::array::from_fn(|c| is_turn.if_positive(after[c], sum[c] * inverse))
}

/// The weight of the previous mean in the mean of energies.
const MEMORY: f64 = 0.85;

/// A step is accepted if the energy falls below the mean by this fraction of the decrease that the
/// slope predicts.
const SUFFICIENT: f64 = 1e-4;

/// The factor of a step where the energy is concave, and the divisor after a failed step.
const LONGER: f64 = 4.0;

/// The longest step.
const LONGEST: f64 = 1e4;

/// A descent fails if its step falls below this.
const SHORTEST: f64 = 1e-8;

/// The step lengths of one curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stride<N> {
    /// The length of the next step.
    pub alpha: N,
    /// A mean of the energies so far.
    mean: N,
}

impl<N: Real + Scalar> Stride<N> {
    /// Starts with step 1, which is Newton's at a straight curve: there L is H.
    pub fn new(energy: N) -> Self {
        Stride { alpha: N::of(1.0), mean: energy }
    }

    /// Judges a trial along −z, and sets the next step.
    pub fn judge(&mut self, trial: &Trial<N>) -> Verdict {
        let [slope, slope_there] = trial.slopes;
        let [energy, energy_there] = trial.energies;
        let is_sound = trial.smallest > N::of(0.0) && slope < N::of(0.0);
        let promised = -(trial.alpha * slope);
        let rounding = N::of(ROUNDING) * <N as Real>::EPSILON * Scalar::abs(energy);
        let falls = energy_there <= self.mean - N::of(SUFFICIENT) * promised + rounding;
        if !(is_sound && energy_there.is_finite() && slope_there.is_finite() && falls) {
            self.alpha = trial.alpha / N::of(LONGER);
            return if self.alpha < N::of(SHORTEST) { Verdict::Fail } else { Verdict::Again };
        }
        // ⟨s, s⟩/y·s
        let length = slope / (slope - slope_there);
        let factor = if length > N::of(0.0) { length } else { N::of(LONGER) };
        self.alpha = least(trial.alpha * factor, N::of(LONGEST));
        self.mean = N::of(MEMORY) * self.mean + N::of(1.0 - MEMORY) * energy_there;
        Verdict::Accept
    }
}
