//! The search for the λ that keeps a deviation, and a closed curve a curve.

use std::f64::consts::TAU;

use super::{Smoother, Target, keeps, unsolvable};
use crate::report::CurveReport;
use crate::spline::smoothing::LAMBDA_CAP;

/// Normalised λ are searched among 2^(j/512) for whole j: neighbours differ by 0.14 %. Every device
/// and precision tries the same numbers, so that all find the same λ.
const STEPS_PER_OCTAVE: i32 = 512;

/// A bracket is sought from one multiple of this many steps to the next: by factors of 8.
const STRIDE: i32 = 3 * STEPS_PER_OCTAVE;

/// The first step: where no bit of the data is moved.
const FIRST_STEP: i32 = -1020 * STEPS_PER_OCTAVE;

/// The last step: below [`LAMBDA_CAP`].
const LAST_STEP: i32 = 66 * STEPS_PER_OCTAVE;

/// The λ of a step.
pub(super) fn lambda_at(step: i32) -> f64 {
    let mantissa = f64::from(step.rem_euclid(STEPS_PER_OCTAVE)) / f64::from(STEPS_PER_OCTAVE);
    mantissa.exp2() * 2_f64.powi(step.div_euclid(STEPS_PER_OCTAVE))
}

/// The numbers 2^(j/512) of one octave, for the kernel.
pub(in crate::spline) fn octave() -> impl Iterator<Item = f64> {
    (0..STEPS_PER_OCTAVE).map(lambda_at)
}

/// What the last attempt above the result broke.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Broken {
    Deviation,
    /// A closed curve had collapsed, though within the deviation.
    Share,
    /// Rounding got the better of this normalised λ.
    Arithmetic(f64),
}

impl Smoother {
    /// The largest λ that keeps the deviation allowed, ∞ included, and leaves a closed curve its
    /// share of its size.
    pub(super) fn search(&mut self, target: &mut Target, allowed: f64) -> CurveReport {
        let keeps = |deviation: f64| keeps(deviation, allowed);
        let closed = self.problem.closed;
        if !closed && self.solve_line() {
            let deviation = self.deviation(target).0;
            if keeps(deviation) {
                return self.keep(target, LAMBDA_CAP, deviation);
            }
        }
        if !self.solve(0.0) {
            return unsolvable(target, &self.data);
        }
        let found = self.deviation(target);
        let mut best = self.keep(target, 0.0, found.0);
        if !keeps(found.0) {
            return self.apart(target, found, allowed, best);
        }
        let mut broken = Broken::Deviation;
        let mut reaches = |smoother: &mut Self, step: i32| {
            let normalised = lambda_at(step);
            let solved = smoother.solve(normalised);
            let deviation = if solved { smoother.deviation(target).0 } else { f64::INFINITY };
            if solved && keeps(deviation) && smoother.stands() {
                best = smoother.keep(target, normalised, deviation);
                return true;
            }
            broken = match (solved, keeps(deviation)) {
                (false, _) => Broken::Arithmetic(normalised),
                (true, true) => Broken::Share,
                (true, false) => Broken::Deviation,
            };
            false
        };
        // While λ is small the points move by λ|ΩQγ|: a start close to the goal for noisy data.
        let mut start = allowed / (self.size * self.problem.largest_pull());
        if closed {
            // There the first Fourier mode of a closed curve, and with it the curve, is halved.
            start = start.min(self.problem.inverse_weights.iter().map(|x| 1.0 / x).sum::<f64>() / TAU.powi(4));
        }
        let octaves =
            start.log2().clamp(f64::from(FIRST_STEP / STEPS_PER_OCTAVE), f64::from(LAST_STEP / STEPS_PER_OCTAVE));
        let mut step = (octaves * f64::from(STEPS_PER_OCTAVE) / f64::from(STRIDE)).floor() as i32 * STRIDE;
        let (mut below, mut above) = (None, None);
        loop {
            step = step.clamp(FIRST_STEP, LAST_STEP);
            if reaches(self, step) {
                below = Some(step);
                if above.is_some() || step == LAST_STEP {
                    break;
                }
                step += STRIDE;
            } else {
                above = Some(step);
                if below.is_some() || step == FIRST_STEP {
                    break;
                }
                step -= STRIDE;
            }
        }
        if let (Some(mut below), Some(mut above)) = (below, above) {
            while above - below > 1 {
                let middle = below + (above - below) / 2;
                *(if reaches(self, middle) { &mut below } else { &mut above }) = middle;
            }
        }
        let report = CurveReport { iterations: self.solves, ..best };
        match broken {
            Broken::Arithmetic(_) if self.problem.has_inner_pins() => report,
            Broken::Arithmetic(normalised) => self.too_large(target, self.in_units(normalised), report),
            Broken::Share => self.stopped(target, &format!("the deviation of {allowed}"), report),
            Broken::Deviation => report,
        }
    }
}
