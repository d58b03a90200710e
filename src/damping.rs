//! How much Newton's steps are damped: λ of (H + λL) p = −g, one trial a tick, one curve a lane.
//!
//! λ is 0 as long as that serves. It grows where H + λL is not positive definite or the energy
//! falls by less than the quadratic model promises, and shrinks back to 0 where the model holds.

use crate::linalg::{Real, Scalar};

/// What a trial led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The step is taken.
    Accept,
    /// Another trial, with another step.
    Again,
    /// No step can be found along this direction.
    Fail,
}

/// The first λ after 0. L is H of a straight curve: at 1 both weigh alike.
const FIRST: f64 = 1e-2;

/// What λ is multiplied by after a step that failed.
const GROWTH: f64 = 4.0;

/// What λ is multiplied by after a step that was as good as promised.
const DECAY: f64 = 0.1;

/// Below this λ is 0 again: by then H outweighs it.
const LEAST: f64 = 1e-4;

/// From this λ on steps are those of plain descent, and if none of them leads down, nothing does.
const MOST: f64 = 1e8;

/// A step is accepted if the energy falls by this part of what the model promises at least.
const ACCEPTED: f64 = 1e-3;

/// Below this part λ grows, though the step is taken.
const POOR: f64 = 0.25;

/// Above this part λ shrinks.
const GOOD: f64 = 0.75;

/// So many units of rounding of the energy, relative, are more than a sum's own.
const ROUNDING: f64 = 16.0;

/// What a trial along p = −(H + λL)⁻¹g found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial<N> {
    /// Smallest pivot of H + λL.
    pub smallest: N,
    /// g·p, and the slope along p at the trial.
    pub slopes: [N; 2],
    /// Energies before and at the trial.
    pub energies: [N; 2],
    /// The part of p that was taken.
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
        // −(α g·p + ½ α² pᵀHp) for λ = 0; with λ the model promises up to twice as much.
        let promised = -(trial.alpha * slope * (N::of(1.0) - N::of(0.5) * trial.alpha));
        let fallen = energy - energy_there;
        let rounding = N::of(ROUNDING) * <N as Real>::EPSILON * Scalar::abs(energy);
        if promised < rounding {
            // Energies say nothing any more, slopes still do.
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

    /// Damps more, before anything is tried: where H + λL is not positive definite. Whether that
    /// may help still.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A full step that is sound, with the energy falling by `share` of what the model promises: ½
    /// of 1.
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
