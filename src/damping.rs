//! Damping of Newton's steps: λ in (H + λL) p = −g.
//!
//! λ is 0 while undamped steps succeed. It grows if H + λL is not positive definite, or if the
//! energy falls by much less than the quadratic model predicts. It shrinks to 0 where the model
//! holds.

use crate::linalg::{Real, Scalar};

/// The verdict on a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Take the step.
    Accept,
    /// Try another step.
    Again,
    /// No step succeeds.
    Fail,
}

/// The first λ above 0.
///
/// L is the Hessian of a straight curve, so H and λL are comparable at λ = 1.
const FIRST: f64 = 1e-2;

/// The factor of λ after a step that failed.
const GROWTH: f64 = 4.0;

/// The factor of λ after a step as good as predicted.
const DECAY: f64 = 0.1;

/// A λ below this becomes 0, because H outweighs λL by then.
const LEAST: f64 = 1e-4;

/// The largest λ.
///
/// Steps are gradient steps by then.
const MOST: f64 = 1e8;

/// A step is accepted if the energy falls by at least this fraction of the prediction.
const ACCEPTED: f64 = 1e-3;

/// Below this fraction λ grows after the step.
const POOR: f64 = 0.25;

/// Above this fraction λ shrinks.
const GOOD: f64 = 0.75;

/// Differences of energies below this many units of rounding, relative to the energy, are noise.
pub(crate) const ROUNDING: f64 = 16.0;

/// A trial along p = −(H + λL)⁻¹g.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial<N> {
    /// The smallest pivot of H + λL.
    pub smallest: N,
    /// The slope g·p at the start, and the slope along p at the trial.
    pub slopes: [N; 2],
    /// The energies at the start and at the trial.
    pub energies: [N; 2],
    /// The step length, as a fraction of p.
    pub alpha: N,
}

/// λ of one curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Damping<N> {
    pub lambda: N,
}

impl<N: Real + Scalar> Damping<N> {
    pub fn new() -> Self {
        Damping { lambda: N::of(0.0) }
    }

    /// Judges a trial, and sets the next λ.
    pub fn judge(&mut self, trial: &Trial<N>) -> Verdict {
        let zero = N::of(0.0);
        let [slope, slope_there] = trial.slopes;
        let [energy, energy_there] = trial.energies;
        let sound = trial.smallest > zero && slope < zero && energy_there.is_finite() && slope_there.is_finite();
        if !sound {
            return self.fail();
        }
        // This is −(α g·p + ½ α² pᵀHp) for λ = 0. For λ > 0 the model predicts up to twice as much.
        let promised = -(trial.alpha * slope * (N::of(1.0) - N::of(0.5) * trial.alpha));
        let fallen = energy - energy_there;
        let rounding = N::of(ROUNDING) * <N as Real>::EPSILON * Scalar::abs(energy);
        if promised < rounding {
            // Differences of energies are rounding here. Slopes decide.
            if Scalar::abs(slope_there) <= Scalar::abs(slope) && Scalar::abs(fallen) <= N::of(2.0) * rounding {
                self.lambda = zero;
                return Verdict::Accept;
            }
            return self.fail();
        }
        if fallen < N::of(ACCEPTED) * promised {
            return self.fail();
        }
        if fallen < N::of(POOR) * promised {
            self.grow();
        } else if fallen > N::of(GOOD) * promised {
            let lambda = N::of(DECAY) * self.lambda;
            self.lambda = if lambda < N::of(LEAST) { zero } else { lambda };
        }
        Verdict::Accept
    }

    /// Increases λ without a trial, for an H + λL that is not positive definite.
    ///
    /// Returns whether a larger λ may still help.
    pub fn stiffen(&mut self) -> bool {
        self.grow();
        self.lambda <= N::of(MOST)
    }

    fn fail(&mut self) -> Verdict {
        self.grow();
        if self.lambda > N::of(MOST) { Verdict::Fail } else { Verdict::Again }
    }

    fn grow(&mut self) {
        self.lambda = Scalar::max(N::of(GROWTH) * self.lambda, N::of(FIRST));
    }
}

/// The smaller of two.
pub(crate) fn least<N: PartialOrd>(a: N, b: N) -> N {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sound full step.
    ///
    /// The energy falls by `share` of what the model promises, which is ½ of 1.
    fn trial(share: f64) -> Trial<f64> {
        Trial { smallest: 1.0, slopes: [-1.0, 0.0], energies: [10.0, 10.0 - 0.5 * share], alpha: 1.0 }
    }

    #[test]
    fn good_steps_leave_newtons_method_undamped_and_bring_it_back() {
        let mut damping = Damping { lambda: 0.0 };
        assert_eq!(damping.judge(&trial(1.0)), Verdict::Accept);
        assert_eq!(damping.lambda, 0.0);
        damping.lambda = 1.0;
        for _ in 0..5 {
            assert_eq!(damping.judge(&trial(0.9)), Verdict::Accept);
        }
        assert_eq!(damping.lambda, 0.0);
    }

    #[test]
    fn steps_that_fall_short_are_taken_and_damp_the_next() {
        let mut damping = Damping::<f64>::new();
        assert_eq!(damping.judge(&trial(0.1)), Verdict::Accept);
        assert_eq!(damping.lambda, FIRST);
        assert_eq!(damping.judge(&trial(0.5)), Verdict::Accept);
        assert_eq!(damping.lambda, FIRST);
    }

    #[test]
    fn what_is_indefinite_rises_or_is_no_number_is_damped_until_descent_itself_fails() {
        let indefinite = Trial { smallest: -1.0, ..trial(1.0) };
        let infinite = Trial { energies: [10.0, f64::INFINITY], ..trial(1.0) };
        let nan = Trial { smallest: f64::NAN, ..trial(1.0) };
        for bad in [indefinite, infinite, nan, trial(-1.0)] {
            let mut damping = Damping::<f64>::new();
            let mut trials = 1;
            while damping.judge(&bad) == Verdict::Again {
                trials += 1;
            }
            assert!(damping.lambda > MOST && trials < 20, "{trials} trials");
        }
    }

    #[test]
    fn where_energies_are_rounding_slopes_decide() {
        let promised = 1e-15;
        let near = |slope_there: f64| Trial {
            smallest: 1.0,
            slopes: [-2.0 * promised, slope_there],
            energies: [10.0, 10.0 + 4.0 * f64::EPSILON],
            alpha: 1.0,
        };
        assert_eq!(Damping::<f64>::new().judge(&near(0.1 * promised)), Verdict::Accept);
        assert_eq!(Damping::<f64>::new().judge(&near(5.0 * promised)), Verdict::Again);
    }
}
