//! The search for the λ that keeps a deviation, and a closed curve a curve.

use std::f64::consts::TAU;

use super::{Slot, Smoother, keeps, unsolvable};
use crate::report::CurveReport;
use crate::spline::smoothing::LAMBDA_CAP;

/// Normalised λ are searched among 2^(j/512) for whole j: neighbours differ by 0.14 %. Every device
/// and precision tries the same numbers, so that all find the same λ.
pub(super) const STEPS_PER_OCTAVE: i32 = 512;

/// A bracket is sought from one multiple of this many steps to the next: by factors of 8.
const STRIDE: i32 = 3 * STEPS_PER_OCTAVE;

/// The first step: where no bit of the data is moved.
const FIRST_STEP: i32 = -1020 * STEPS_PER_OCTAVE;

/// The last step: below [`LAMBDA_CAP`].
const LAST_STEP: i32 = 66 * STEPS_PER_OCTAVE;

/// The λ of a step.
pub(super) fn lambda_at(step: i32) -> f64 {
    let mantissa = f64::from(step.rem_euclid(STEPS_PER_OCTAVE)) / f64::from(STEPS_PER_OCTAVE);
    libm::exp2(mantissa) * 2_f64.powi(step.div_euclid(STEPS_PER_OCTAVE))
}

/// The numbers 2^(j/512) of one octave, for the kernel.
pub(in crate::spline) fn octave() -> impl Iterator<Item = f64> {
    (0..STEPS_PER_OCTAVE).map(lambda_at)
}

/// The condition that the last λ above the result broke.
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
    pub(super) fn search(&mut self, slot: &mut Slot, allowed: f64) -> CurveReport {
        if !self.problem.closed && self.solve_line() {
            let deviation = self.deviation(slot).0;
            if keeps(deviation, allowed) {
                return self.keep(slot, LAMBDA_CAP, deviation);
            }
        }
        if !self.solve(0.0) {
            return unsolvable(slot, &self.data);
        }
        let found = self.deviation(slot);
        let mut best = self.keep(slot, 0.0, found.0);
        if !keeps(found.0, allowed) {
            return Self::apart(slot, found, allowed, best);
        }
        let mut broken = Broken::Deviation;
        let (mut step, mut below, mut above) = (self.first_stride(allowed), FIRST_STEP - 1, LAST_STEP + 1);
        while above - below > 1 {
            match self.attempt(slot, step, allowed) {
                Ok(report) => (best, below) = (report, step),
                Err(what) => (broken, above) = (what, step),
            }
            step = match (below >= FIRST_STEP, above <= LAST_STEP) {
                (true, true) => below + (above - below) / 2,
                (true, false) => (below + STRIDE).min(LAST_STEP),
                _ => (above - STRIDE).max(FIRST_STEP),
            };
        }
        let report = CurveReport { iterations: self.solves, ..best };
        match broken {
            Broken::Arithmetic(_) if self.problem.has_inner_pins() => report,
            Broken::Arithmetic(normalised) => self.too_large(slot, self.in_units(normalised), report),
            Broken::Share => self.stopped(slot, &format!("the deviation of {allowed}"), report),
            Broken::Deviation => report,
        }
    }

    /// Solves for the λ of a step; keeps the curve if it is good, and else says why it is not.
    fn attempt(&mut self, slot: &mut Slot, step: i32, allowed: f64) -> Result<CurveReport, Broken> {
        let normalised = lambda_at(step);
        if !self.solve(normalised) {
            return Err(Broken::Arithmetic(normalised));
        }
        let deviation = self.deviation(slot).0;
        if !keeps(deviation, allowed) {
            return Err(Broken::Deviation);
        }
        if !self.stands() {
            return Err(Broken::Share);
        }
        Ok(self.keep(slot, normalised, deviation))
    }

    /// The multiple of [`STRIDE`] that the search begins with.
    fn first_stride(&self, allowed: f64) -> i32 {
        // While λ is small the points move by λ|ΩQγ|: a start close to the goal for noisy data.
        let mut start = allowed / (self.size * self.problem.largest_pull());
        if self.problem.closed {
            // There the first Fourier mode of a closed curve, and with it the curve, is halved.
            start = start.min(self.problem.inverse_weights.iter().map(|x| 1.0 / x).sum::<f64>() / TAU.powi(4));
        }
        let [first, last] = [FIRST_STEP, LAST_STEP].map(|step| f64::from(step / STEPS_PER_OCTAVE));
        let octaves = libm::log2(start).clamp(first, last);
        let stride = (octaves * f64::from(STEPS_PER_OCTAVE) / f64::from(STRIDE)).floor() as i32;
        (stride * STRIDE).clamp(FIRST_STEP, LAST_STEP)
    }
}
