//! The λ of generalised cross-validation.

use super::search::{STEPS_PER_OCTAVE, lambda_at};
use super::{Slot, Smoother, unsolvable};
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// Octaves of the normalised λ between two trials of the first round, of which the best is refined until
/// trials are 1/128 of an octave apart.
const STRIDE: i32 = 2 * STEPS_PER_OCTAVE;
const FINEST: i32 = STEPS_PER_OCTAVE / 128;

/// Octaves of trials above the λ at which a whole curve bends little, and below the one at which
/// neighbouring points do.
const BEYOND: f64 = 12.0;

impl Smoother {
    /// The curve of the λ with the least score Σ w_i |y_i − p(t_i)|² / tr(I − A)², where A takes data to
    /// the curve's values: n times the generalised cross-validation of Craven and Wahba, Numerische
    /// Mathematik 31 (1979).
    pub(super) fn cross_validated(&mut self, slot: &mut Slot) -> CurveReport {
        if self.problem.closed {
            slot.second.fill(0.0);
            let what = "its λ cannot be chosen by its data: cross-validation is for open curves; give a λ";
            return CurveReport::unfitted(CurveStatus::Invalid, slot.batch.sentence(slot.curve, 0, what));
        }
        if !self.solve(0.0) {
            return unsolvable(slot, &self.data);
        }
        let octaves = 4.0 * (self.problem.count as f64).log2() + BEYOND;
        let (lowest, highest) = (-octaves as i32 * STEPS_PER_OCTAVE, BEYOND as i32 * STEPS_PER_OCTAVE);
        let trials = (0..=(highest - lowest) / STRIDE).map(|k| lowest + k * STRIDE);
        let mut best = (f64::INFINITY, lowest);
        for step in trials {
            best = least(best, (self.score(step), step));
        }
        let mut stride = STRIDE / 2;
        while stride >= FINEST {
            let middle = best.1;
            for step in [middle - stride, middle + stride] {
                best = least(best, (self.score(step), step));
            }
            stride /= 2;
        }
        let normalised = if best.0.is_finite() { lambda_at(best.1) } else { 0.0 };
        if !self.solve(normalised) {
            return unsolvable(slot, &self.data);
        }
        let deviation = self.deviation(slot).0;
        self.keep(slot, normalised, deviation)
    }

    /// The score of a step's λ.
    fn score(&mut self, step: i32) -> f64 {
        if !self.solve(lambda_at(step)) {
            return f64::INFINITY;
        }
        let (problem, mut squares) = (&self.problem, 0.0);
        for (moved, inverse) in problem.correction.chunks_exact(problem.dimension).zip(&problem.inverse_weights) {
            if *inverse > 0.0 {
                squares += moved.iter().map(|x| x * x).sum::<f64>() / inverse;
            }
        }
        let score = squares / problem.residual_freedom().powi(2);
        if score.is_nan() { f64::INFINITY } else { score }
    }
}

/// The trial of the lower score, or the one before.
fn least(before: (f64, i32), trial: (f64, i32)) -> (f64, i32) {
    if trial.0 < before.0 { trial } else { before }
}
