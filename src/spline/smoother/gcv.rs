//! The λ of generalised cross-validation.

use super::search::{STEPS_PER_OCTAVE, lambda_at};
use super::{Slot, Smoother, unsolvable};
use crate::report::CurveReport;
use crate::spline::reinsch::TRIALS;
use crate::status::CurveStatus;

/// Steps between trials: at first along the whole range, where four octaves of λ are one of the width over which the
/// spline averages, then four to both sides of the best.
const STRIDES: [i32; 5] = [3 * STEPS_PER_OCTAVE, 341, 76, 17, 4];

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
        let octaves = 4.0 * libm::log2(self.problem.count as f64) + BEYOND;
        let (lowest, highest) = (-octaves as i32 * STEPS_PER_OCTAVE, BEYOND as i32 * STEPS_PER_OCTAVE);
        let mut best = (f64::INFINITY, lowest);
        for first in (lowest..=highest).step_by(TRIALS * STRIDES[0] as usize) {
            best = self.best(best, std::array::from_fn(|k| first + k as i32 * STRIDES[0]));
        }
        for stride in &STRIDES[1..] {
            let trials = [-4, -3, -2, -1, 1, 2, 3, 4].map(|k| (best.1 + k * stride).clamp(lowest, highest));
            best = self.best(best, trials);
        }
        let normalised = if best.0.is_finite() { lambda_at(best.1) } else { 0.0 };
        if !self.solve(normalised) {
            return unsolvable(slot, &self.data);
        }
        let deviation = self.deviation(slot).0;
        self.keep(slot, normalised, deviation)
    }

    /// The step of the least score, and that score: of `before` and of trials.
    fn best(&self, before: (f64, i32), trials: [i32; TRIALS]) -> (f64, i32) {
        let mut best = before;
        for (score, step) in self.problem.scores(trials.map(lambda_at)).into_iter().zip(trials) {
            // NaN is not less.
            if score < best.0 {
                best = (score, step);
            }
        }
        best
    }
}
