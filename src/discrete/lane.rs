//! [`Lane`]: the state of one curve's descent, and how it ends.

use super::plan::Solver;
use super::sobolev::Stride;
use crate::damping::{Damping, Trial, Verdict, least};
use crate::linalg::{Real, Scalar};

/// How the descent of a curve has ended, if it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TerminationStatus {
    Running = 1,
    /// The norm of the gradient is at most the tolerance.
    Converged,
    /// No direction decreases the energy any more, because of rounding or for another reason.
    Stalled,
    /// The largest number of iterations was reached.
    Exhausted,
    /// The length exceeded its bound while the energy fell.
    Unbounded,
    /// The energy or the gradient is not finite.
    Broken,
    /// The descent ended at a polygon that turns by more than 90° at a vertex, which is no minimum
    /// among curves.
    ///
    /// A lane never sets this status itself.
    Folded,
}

/// The largest number of steps without progress before rounding is assumed to dominate.
///
/// Progress means that the norm falls to [`PROGRESS`] of its best, or that the energy falls by
/// [`FALL_EPSILONS`].
const PATIENCE: u32 = 16;

/// The same for Sobolev gradients, whose steps may increase the energy.
const SOBOLEV_PATIENCE: u32 = 100;

/// See [`PATIENCE`].
const PROGRESS: f64 = 0.7;

/// A decrease of the energy by this many ε exceeds the rounding of its sum.
const FALL_EPSILONS: f64 = 64.0;

/// The largest tolerance at which a damped decrement may not end a descent. Rounds and stages have
/// larger tolerances.
///
/// With this rule 592 of 594 borders converge within a deviation, without it 586.
const ROUGH: f64 = 1e-6;

/// Newton's method converges quadratically if the square of the decrement falls by this factor.
const CONTRACTION: f64 = 1e-2;

/// When the descent of a curve ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// The tolerance on the norm of the gradient.
    pub tolerance: f64,
    /// The length beyond which a curve counts as unbounded.
    ///
    /// It is infinite if the energy bounds the length.
    pub longest: f64,
    /// The largest number of accepted steps.
    pub most_iterations: u32,
}

/// How a solver chooses its steps.
#[derive(Clone, Copy, Debug)]
pub(super) enum Steps<N> {
    Newton(Damping<N>),
    Sobolev(Stride<N>),
}

/// The state of one curve's descent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lane<N> {
    pub termination: TerminationStatus,
    pub energy: N,
    /// The square of the gradient's norm.
    pub norm2: N,
    pub length: N,
    pub iterations: u32,
    pub evaluations: u32,
    /// See [`Bounds`].
    pub tolerance: N,
    pub longest: N,
    pub most_iterations: u32,
    pub(super) start_energy: N,
    pub(super) steps: Steps<N>,
    pub(super) best: N,
    /// The energy at the last progress, less its rounding.
    pub(super) energy_then: N,
    pub(super) since_best: u32,
    /// Whether the previous step was a full, undamped step of Newton's method.
    pub(super) is_full: bool,
}

impl<N: Real + Scalar> Lane<N> {
    /// A curve that has not been evaluated yet.
    pub(super) fn new(solver: Solver, bounds: &Bounds) -> Self {
        let (zero, infinite) = (N::of(0.0), N::of(f64::INFINITY));
        Lane {
            termination: TerminationStatus::Running,
            energy: zero,
            norm2: infinite,
            length: zero,
            iterations: 0,
            evaluations: 0,
            tolerance: N::of(bounds.tolerance),
            longest: N::of(bounds.longest),
            most_iterations: bounds.most_iterations,
            start_energy: zero,
            steps: match solver {
                Solver::Newton => Steps::Newton(Damping::new()),
                Solver::Sobolev => Steps::Sobolev(Stride::new(zero)),
            },
            best: infinite,
            energy_then: infinite,
            since_best: 0,
            is_full: false,
        }
    }

    /// Starts at the current curve, with its energy and length. Returns whether it can descend.
    pub(super) fn begin(&mut self, energy: N, length: N) -> bool {
        self.evaluations = 1;
        (self.energy, self.start_energy, self.length) = (energy, energy, length);
        if let Steps::Sobolev(stride) = &mut self.steps {
            *stride = Stride::new(energy);
        }
        if !energy.is_finite() {
            self.termination = TerminationStatus::Broken;
        }
        energy.is_finite()
    }

    /// λ of the next direction.
    pub(super) fn lambda(&self) -> N {
        match self.steps {
            Steps::Newton(damping) => damping.lambda,
            Steps::Sobolev(_) => N::of(0.0),
        }
    }

    /// The step length along p, at most `most`.
    pub(super) fn alpha(&self, most: N) -> N {
        match self.steps {
            Steps::Newton(_) => least(most, N::of(1.0)),
            Steps::Sobolev(stride) => least(most, stride.alpha),
        }
    }

    /// Ends the lane before a trial along p, if it is done. Returns whether there is a trial.
    ///
    /// `slope` is g·p, `smallest` the smallest pivot of the system, and `alpha` the step length
    /// along p. The norm of the gradient is √((1 + λ)|g·p|). For Newton's method it is at most
    /// √(1 + λ) times less than √(gᵀH⁻¹g) where H ≥ L, and for Sobolev gradients it is √⟨z, z⟩. A
    /// lane converges when the norm is small, or when Newton's steps contract so fast that it will
    /// be small after this one. The lane then takes this step too, if it can.
    pub(super) fn aim(&mut self, smallest: N, slope: N, alpha: N) -> bool {
        if self.termination != TerminationStatus::Running {
            return false;
        }
        let lambda = self.lambda();
        let is_undamped = matches!(self.steps, Steps::Newton(_)) && lambda == N::of(0.0);
        let square = (N::of(1.0) + lambda) * -slope;
        let least = self.tolerance * self.tolerance;
        // Rounding may make a slope positive at a minimum.
        let is_sound = smallest > N::of(0.0) && square.is_finite() && square >= -least;
        let is_full = is_sound && is_undamped && alpha == N::of(1.0);
        // Quadratic convergence squares the contraction of the error in every step.
        let contraction = square / self.norm2;
        let next = contraction * contraction * square;
        let contracts =
            is_full && self.is_full && contraction <= N::of(CONTRACTION) && next <= N::of(CONTRACTION) * least;
        if is_sound {
            self.norm2 = if contracts { next } else { Scalar::max(square, N::of(0.0)) };
        }
        self.is_full = is_full;
        self.termination = if is_sound && square <= least || contracts {
            TerminationStatus::Converged
        } else if self.length > self.longest && self.energy < self.start_energy {
            TerminationStatus::Unbounded
        } else if self.iterations >= self.most_iterations {
            TerminationStatus::Exhausted
        } else {
            TerminationStatus::Running
        };
        matches!(self.termination, TerminationStatus::Running | TerminationStatus::Converged)
    }

    /// Judges a trial along p.
    ///
    /// Where H is less than L, a damped norm is too small. It ends a lane only if no step leads on,
    /// or in [rough](ROUGH) rounds. Contraction ends no lane whose step fails.
    pub(super) fn judge(&mut self, trial: &Trial<N>) -> Verdict {
        let least = self.tolerance * self.tolerance;
        let verdict = match &mut self.steps {
            Steps::Sobolev(stride) => stride.judge(trial),
            Steps::Newton(damping) => {
                let is_damped = damping.lambda > N::of(0.0);
                let verdict = damping.judge(trial);
                let leads_on = is_damped && self.since_best == 0 && self.tolerance <= N::of(ROUGH);
                let contracted = !is_damped && -trial.slopes[0] > least;
                let goes_on = verdict == Verdict::Accept && leads_on || verdict == Verdict::Again && contracted;
                if goes_on && self.termination == TerminationStatus::Converged {
                    self.termination = TerminationStatus::Running;
                }
                verdict
            }
        };
        if verdict == Verdict::Fail && self.termination == TerminationStatus::Running {
            self.termination = TerminationStatus::Stalled;
        }
        verdict
    }

    /// Ends the lane after a step, if it makes no more progress or the gradient is not finite.
    pub(super) fn took(&mut self, is_finite: bool) {
        if !is_finite {
            self.termination = TerminationStatus::Broken;
        } else if self.termination == TerminationStatus::Running && self.falls_short() {
            self.termination = TerminationStatus::Stalled;
        }
    }

    /// Counts steps without progress. Returns whether there were too many in a row.
    fn falls_short(&mut self) -> bool {
        let norm = self.norm2.sqrt();
        if norm < N::of(PROGRESS) * self.best || self.energy < self.energy_then {
            let rounding = N::of(FALL_EPSILONS) * <N as Real>::EPSILON * Scalar::abs(self.energy);
            (self.best, self.energy_then, self.since_best) = (least(norm, self.best), self.energy - rounding, 0);
        } else {
            self.since_best += 1;
        }
        let patience = if matches!(self.steps, Steps::Newton(_)) { PATIENCE } else { SOBOLEV_PATIENCE };
        self.since_best > patience
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    /// A trial along a direction of this slope, whose energy falls as predicted or rises.
    fn trial(slope: f64, falls: bool) -> Trial<f64> {
        let fall = if falls { -0.5 * slope } else { slope };
        Trial { smallest: 1.0, slopes: [slope, 0.0], energies: [0.0, -fall], alpha: 1.0 }
    }

    /// A running lane with this tolerance, after a full, undamped step with this decrement.
    fn lane(tolerance: f64, decrement: f64) -> Lane<f64> {
        let mut lane = Lane::new(Solver::Newton, &Bounds { tolerance, longest: f64::INFINITY, most_iterations: 100 });
        assert!(lane.aim(1.0, -decrement * decrement, 1.0));
        lane
    }

    #[test]
    fn quadratic_contraction_ends_a_lane_whose_step_succeeds() {
        for (decrement, falls, wanted) in [
            (1e-5, true, TerminationStatus::Converged),
            (1e-5, false, TerminationStatus::Running),
            // Linear convergence, and too large an error after the step.
            (1e-3, true, TerminationStatus::Running),
            (1e-9, false, TerminationStatus::Converged),
        ] {
            let mut lane = lane(1e-8, 2e-3);
            assert!(lane.aim(1.0, -decrement * decrement, 1.0));
            lane.judge(&trial(-decrement * decrement, falls));
            assert_eq!(lane.termination, wanted, "{decrement:e} {falls}");
        }
    }

    #[test]
    fn a_damped_decrement_ends_no_lane_that_a_step_leads_on() {
        for (tolerance, falls, wanted) in [
            (1e-8, true, TerminationStatus::Running),
            (1e-8, false, TerminationStatus::Converged),
            (1e-2, true, TerminationStatus::Converged),
        ] {
            let mut lane = lane(tolerance, 1.0);
            lane.steps = Steps::Newton(Damping { lambda: 1e-2 });
            let slope = -0.25 * tolerance * tolerance;
            assert!(lane.aim(1.0, slope, 1.0));
            lane.judge(&trial(slope, falls));
            assert_eq!(lane.termination, wanted, "{tolerance:e} {falls}");
        }
    }
}
