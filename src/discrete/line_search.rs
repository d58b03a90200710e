//! The line search: the step along a direction, with one trial a tick and one curve a lane.
//!
//! It decides from the energy and its slope at the trial. A step is accepted under the approximate
//! Wolfe conditions of Hager and Zhang (SIAM J. Optim. 16, 2005). The energy must not have risen
//! beyond its rounding, and the slope must have fallen to [`SLOPE`] of that at the start. Near a
//! minimum differences of energies drown in rounding long before slopes do.
//!
//! A trial that is too short is followed by one at the secant of the slopes. A trial that is too
//! long brackets the step, and the bracket shrinks by secants and cuts.

use crate::damping::Verdict;
use crate::linalg::{Real, Scalar};

/// A step is accepted when the slope is at most this fraction of the slope at its start.
///
/// Between 0.3 and 0.8 the number of evaluations hardly changes.
const SLOPE: f64 = 0.5;

/// Energies that differ by less than this fraction count as equal.
///
/// It is above the rounding of a sum in f32, about eight units.
const ENERGY_ROUNDING: f64 = 1e-6;

/// No edge changes by more than this fraction of its length in a step.
///
/// It is less than 1, so that no edge turns over or vanishes.
pub(super) const MOST_OF_AN_EDGE: f64 = 0.5;

/// The most trials of one step.
///
/// Each trial shrinks a bracket to 0.9 at most, mostly by far more.
const MOST_TRIALS: u32 = 20;

/// A bracket is closed when it is no wider than this many ε of its end.
const CLOSED_BRACKET_EPSILONS: f64 = 8.0;

/// The search along one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineSearch<N> {
    /// The step of the next trial.
    pub alpha: N,
    energy: N,
    slope: N,
    most: N,
    low: N,
    low_slope: N,
    /// The upper end of the bracket.
    ///
    /// Infinite until a step was too long.
    high: N,
    /// The slope there.
    ///
    /// NaN where it says nothing.
    high_slope: N,
    trials: u32,
}

impl<N: Real + Scalar> LineSearch<N> {
    /// Starts at an energy and a negative slope.
    ///
    /// `alpha` is the first step, and `most` bounds all steps.
    pub fn start(energy: N, slope: N, alpha: N, most: N) -> Self {
        let infinite = N::of(f64::INFINITY);
        LineSearch {
            alpha: least(alpha, most),
            energy,
            slope,
            most,
            low: N::of(0.0),
            low_slope: slope,
            high: infinite,
            high_slope: <N as Real>::NAN,
            trials: 0,
        }
    }

    /// The slope at the start.
    pub fn slope(&self) -> N {
        self.slope
    }

    /// Judges the trial at [`alpha`](Self::alpha).
    pub fn judge(&mut self, energy: N, slope: N) -> Verdict {
        self.trials += 1;
        let finite = energy.is_finite() && slope.is_finite();
        let rounding = N::of(ENERGY_ROUNDING) * Scalar::abs(self.energy);
        let not_above = finite && energy <= self.energy + rounding;
        let flat = Scalar::abs(slope) <= N::of(SLOPE) * Scalar::abs(self.slope);
        let falls = slope < N::of(0.0);
        if not_above && (flat || (falls && self.alpha >= self.most)) {
            return Verdict::Accept;
        }
        if not_above && falls {
            self.too_short(slope);
        } else {
            self.high = self.alpha;
            self.high_slope = if not_above { slope } else { <N as Real>::NAN };
            self.inside(finite);
        }
        let width = self.high - self.low;
        let closed =
            self.high.is_finite() && width <= N::of(CLOSED_BRACKET_EPSILONS) * <N as Real>::EPSILON * self.high;
        if self.trials >= MOST_TRIALS || closed { Verdict::Fail } else { Verdict::Again }
    }

    fn too_short(&mut self, slope: N) {
        let (before, before_slope) = (self.low, self.low_slope);
        self.low = self.alpha;
        self.low_slope = slope;
        if self.high.is_finite() {
            self.inside(true);
            return;
        }
        let alpha = self.alpha;
        let secant = if slope > before_slope {
            alpha - slope * (alpha - before) / (slope - before_slope)
        } else {
            N::of(f64::INFINITY)
        };
        self.alpha = least(self.most, clamp(secant, N::of(1.5) * alpha, N::of(5.0) * alpha));
    }

    /// Sets the next trial within the bracket.
    fn inside(&mut self, finite: bool) {
        let width = self.high - self.low;
        let tenth = N::of(0.1) * width;
        self.alpha = if self.high_slope.is_finite() {
            let secant = self.low - self.low_slope * width / (self.high_slope - self.low_slope);
            clamp(secant, self.low + tenth, self.high - tenth)
        } else {
            self.low + if finite { N::of(0.3) * width } else { tenth }
        };
    }
}

fn least<N: PartialOrd>(a: N, b: N) -> N {
    if a < b { a } else { b }
}

fn clamp<N: PartialOrd>(x: N, low: N, high: N) -> N {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(energy: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64, alpha: f64) -> (Verdict, f64, u32) {
        let mut search = LineSearch::start(energy(0.0), slope(0.0), alpha, 1e9);
        loop {
            let at = search.alpha;
            match search.judge(energy(at), slope(at)) {
                Verdict::Again => {}
                verdict => return (verdict, at, search.trials),
            }
        }
    }

    #[test]
    fn a_parabola_is_accepted_within_twelve_trials_from_any_first_step() {
        for alpha in [1e-3, 0.3, 1.0, 7.0, 1e4] {
            let (verdict, at, trials) = search(|a| (a - 1.0) * (a - 1.0), |a| 2.0 * (a - 1.0), alpha);
            assert_eq!(verdict, Verdict::Accept);
            assert!((at - 1.0).abs() <= 0.5, "{at} from {alpha}");
            assert!(trials <= 12, "{trials} trials from {alpha}");
        }
    }

    #[test]
    fn a_wall_of_infinite_energy_is_stepped_back_from() {
        let wall = |a: f64| if a < 0.2 { -a } else { f64::INFINITY };
        let (verdict, at, _) = search(wall, |a| if a < 0.2 { -1.0 + 4.5 * a } else { f64::NAN }, 1.0);
        assert_eq!(verdict, Verdict::Accept);
        assert!(at < 0.2 && at > 0.1, "{at}");
    }

    #[test]
    fn a_direction_that_rises_fails() {
        assert_eq!(search(|a| a, |_| 1.0, 1.0).0, Verdict::Fail);
    }
}
