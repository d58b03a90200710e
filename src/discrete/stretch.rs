//! [`Stretch`]: a bound of the length of one curve, enforced by a weight of length.
//!
//! The goal is the least energy with a length of at most L. For a weight w the curve minimises the
//! energy plus w times the length, and its length falls as w grows. The multiplier is the w at
//! which the length is L. The secant method finds it from the last two lengths over ln w.

use super::limit_multipliers::{FEASIBILITY_TOLERANCE, MARGIN};
use super::multipliers::Multipliers;
use super::problem::Problem;

/// The first weight, in units of E/L, per relative excess of the length.
const FIRST: f64 = 1.0;

/// The largest factor of the weight in a round.
const MOST_FACTOR: f64 = 8.0;

/// The weight in units of E/L above which the curve is given up.
const MOST: f64 = 1e8;

/// The weight in units of E/L below which it is set to 0.
const LEAST: f64 = 1e-9;

/// The limit of the length of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// L at size 1, reduced by the margin.
    most: f64,
    /// w
    weight: f64,
    /// E/L
    unit: f64,
    /// w and length/L − 1 of the previous round.
    before: Option<[f64; 2]>,
    violation: f64,
}

impl Stretch {
    /// The limit of a curve with this energy. `is_least` says whether the curve is a minimum
    /// without the limit.
    pub fn new<const D: usize>(longest: f64, energy: f64, is_least: bool, problem: &mut Problem<D>) -> Self {
        let unit = energy / longest;
        let weight = if is_least { 0.0 } else { unit };
        weigh(problem, weight);
        Stretch { most: longest * (1.0 - MARGIN), weight, unit, before: None, violation: f64::INFINITY }
    }
}

/// Sets the weight of the length, the last term of the energy.
fn weigh<const D: usize>(problem: &mut Problem<D>, weight: f64) {
    *problem.weights.last_mut().expect("the term of the length") = weight;
}

impl<const D: usize> Multipliers<D> for Stretch {
    /// The relative excess of the length, or its relative shortfall if the weight is not 0.
    fn violation(&self) -> f64 {
        self.violation
    }

    fn is_settled(&self) -> bool {
        self.violation <= FEASIBILITY_TOLERANCE * MARGIN
    }

    /// Whether no weight makes the curve short enough.
    fn is_given_up(&self) -> bool {
        self.weight > MOST * self.unit
    }

    fn energy(&self, problem: &Problem<D>) -> f64 {
        self.weight * problem.length()
    }

    fn update(&mut self, problem: &mut Problem<D>) {
        let excess = problem.length() / self.most - 1.0;
        self.violation = if self.weight > 0.0 { excess.abs() } else { excess.max(0.0) };
        let now = [self.weight, excess];
        let next = match self.before {
            _ if self.weight == 0.0 => FIRST * self.unit * excess.max(0.0),
            Some([weight, before]) if weight > 0.0 && before != excess => {
                let slope = (excess - before) / (self.weight / weight).ln();
                // A length that grows with the weight gives no information.
                let step = if slope < 0.0 { -excess / slope } else { excess.signum() * MOST_FACTOR.ln() };
                self.weight * step.exp().clamp(1.0 / MOST_FACTOR, MOST_FACTOR)
            }
            _ => self.weight * if excess > 0.0 { 2.0 } else { 0.5 },
        };
        self.before = Some(now);
        self.weight = if next < LEAST * self.unit { 0.0 } else { next };
        weigh(problem, self.weight);
    }
}
