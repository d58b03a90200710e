//! The λ of generalised cross-validation.

use super::search::{STEPS_PER_OCTAVE, lambda_at};
use super::{Slot, Smoother, unsolvable};
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// Steps between two trials of the first round: four octaves of λ are one of the width over which the spline
/// averages.
const STRIDE: i32 = 4 * STEPS_PER_OCTAVE;

/// Steps between trials from which on the least of a parabola through three of them is the next, where
/// trials become eight times as dense, down to [`FINEST`].
const SMOOTH: i32 = STEPS_PER_OCTAVE / 2;
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
            let middle = best;
            let [before, after] =
                [middle.1 - stride, middle.1 + stride].map(|step| match step < lowest || step > highest {
                    true => (f64::INFINITY, step),
                    false => (self.score(step), step),
                });
            best = least(least(best, before), after);
            if stride > SMOOTH {
                stride /= 2;
                continue;
            }
            if best.1 == middle.1 {
                let bend = before.0 - 2.0 * middle.0 + after.0;
                let shift = f64::from(stride) * 0.5 * (before.0 - after.0) / bend;
                if bend > 0.0 && bend.is_finite() {
                    let step = middle.1 + shift.round() as i32;
                    best = least(best, (self.score(step), step));
                }
                stride /= 8;
            }
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
