//! [`LineSearch`]: the step along a direction, from energies and slopes at trials.

/// A step is taken when the slope is at most this fraction of the slope at its start.
const SLOPE: f64 = 0.5;

/// Energies that differ by less than this fraction count as equal.
const ENERGY_ROUNDING: f64 = 1e-6;

/// The most trials of one step.
const MOST_TRIALS: u32 = 20;

/// A bracket is closed when it is no wider than this many ε of its end.
const CLOSED_BRACKET_EPSILONS: f64 = 8.0;

/// The verdict on a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trial {
    /// The step is taken.
    Taken,
    /// Another step is tried.
    Again,
    /// No step succeeds.
    Failed,
}

/// The search along one direction.
///
/// A step is taken under the approximate Wolfe conditions of Hager and Zhang (SIAM J. Optim. 16,
/// 2005). A trial that is too short is followed by one at the secant of the slopes. A trial that is
/// too long brackets the step, and the bracket shrinks by secants and cuts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineSearch {
    /// The step of the next trial.
    pub alpha: f64,
    energy: f64,
    slope: f64,
    low: f64,
    low_slope: f64,
    /// The upper end of the bracket. Infinite until a step was too long.
    high: f64,
    /// The slope there. NaN if it says nothing.
    high_slope: f64,
    trials: u32,
}

impl LineSearch {
    /// Starts at an energy and a negative slope, with this first step.
    pub fn new(energy: f64, slope: f64, alpha: f64) -> Self {
        let (high, high_slope) = (f64::INFINITY, f64::NAN);
        LineSearch { alpha, energy, slope, low: 0.0, low_slope: slope, high, high_slope, trials: 0 }
    }

    /// Judges the trial at [`alpha`](Self::alpha).
    pub fn judge(&mut self, energy: f64, slope: f64) -> Trial {
        self.trials += 1;
        let is_finite = energy.is_finite() && slope.is_finite();
        let not_above = is_finite && energy <= self.energy + ENERGY_ROUNDING * self.energy.abs();
        if not_above && slope.abs() <= SLOPE * self.slope.abs() {
            return Trial::Taken;
        }
        if not_above && slope < 0.0 {
            self.too_short(slope);
        } else {
            self.high = self.alpha;
            self.high_slope = if not_above { slope } else { f64::NAN };
            self.inside(is_finite);
        }
        let width = self.high - self.low;
        let is_closed = self.high.is_finite() && width <= CLOSED_BRACKET_EPSILONS * f64::EPSILON * self.high;
        if self.trials >= MOST_TRIALS || is_closed { Trial::Failed } else { Trial::Again }
    }

    fn too_short(&mut self, slope: f64) {
        let (before, before_slope, alpha) = (self.low, self.low_slope, self.alpha);
        (self.low, self.low_slope) = (alpha, slope);
        if self.high.is_finite() {
            return self.inside(true);
        }
        let rises = slope > before_slope;
        let secant = if rises { alpha - slope * (alpha - before) / (slope - before_slope) } else { f64::INFINITY };
        self.alpha = secant.clamp(1.5 * alpha, 5.0 * alpha);
    }

    /// Sets the next trial within the bracket.
    fn inside(&mut self, is_finite: bool) {
        let width = self.high - self.low;
        let tenth = 0.1 * width;
        self.alpha = if self.high_slope.is_finite() {
            let secant = self.low - self.low_slope * width / (self.high_slope - self.low_slope);
            secant.max(self.low + tenth).min(self.high - tenth)
        } else {
            self.low + if is_finite { 0.3 * width } else { tenth }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(energy: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64, alpha: f64) -> (Trial, f64, u32) {
        let mut search = LineSearch::new(energy(0.0), slope(0.0), alpha);
        loop {
            let at = search.alpha;
            match search.judge(energy(at), slope(at)) {
                Trial::Again => {}
                verdict => return (verdict, at, search.trials),
            }
        }
    }

    #[test]
    fn a_parabola_takes_twelve_trials_at_most_from_any_first_step() {
        for alpha in [1e-3, 0.3, 1.0, 7.0, 1e4] {
            let (verdict, at, trials) = search(|a| (a - 1.0) * (a - 1.0), |a| 2.0 * (a - 1.0), alpha);
            assert_eq!(verdict, Trial::Taken);
            assert!((at - 1.0).abs() <= 0.5 && trials <= 12, "{at} from {alpha} in {trials} trials");
        }
    }

    #[test]
    fn infinite_energies_shorten_the_step_and_a_rising_direction_fails() {
        let wall = |a: f64| if a < 0.2 { -a } else { f64::INFINITY };
        let (verdict, at, _) = search(wall, |a| if a < 0.2 { -1.0 + 4.5 * a } else { f64::NAN }, 1.0);
        assert!(verdict == Trial::Taken && at < 0.2 && at > 0.1, "{at}");
        assert_eq!(search(|a| a, |_| 1.0, 1.0).0, Trial::Failed);
    }
}
