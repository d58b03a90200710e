//! [`Stretch`]: the longest length of one curve, kept by a weight of its length.
//!
//! Wanted is the least energy of length L at most. With the weight w the curve descends the energy and w times the length.
//! Its length falls as w grows. The multiplier of the limit is the w at which it is L. It is sought by secants through
//! the last two, of the length over ln w.

use super::limit_multipliers::{FEASIBILITY_TOLERANCE, MARGIN};
use super::multipliers::Multipliers;
use super::problem::Problem;

/// The first weight, in units of E/L for each part by which the curve is too long.
const FIRST: f64 = 1.0;

/// The factor of the weight in a round, at most.
const MOST_FACTOR: f64 = 8.0;

/// A larger weight does not make a curve shorter, in units of E/L.
const MOST: f64 = 1e8;

/// A smaller weight is none, in units of E/L.
const LEAST: f64 = 1e-9;

/// The limit of the length of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// L at size 1, less the margin.
    most: f64,
    /// w
    weight: f64,
    /// E/L
    unit: f64,
    /// w and length/L − 1 of the round before.
    before: Option<[f64; 2]>,
    violation: f64,
}

impl Stretch {
    /// The limit of a curve of this energy, which goes on from a least one or not.
    pub fn new<const D: usize>(longest: f64, energy: f64, is_least: bool, problem: &mut Problem<D>) -> Self {
        let unit = energy / longest;
        let weight = if is_least { 0.0 } else { unit };
        weigh(problem, weight);
        Stretch { most: longest * (1.0 - MARGIN), weight, unit, before: None, violation: f64::INFINITY }
    }
}

/// Weighs the length, the last term of the energy.
fn weigh<const D: usize>(problem: &mut Problem<D>, weight: f64) {
    *problem.weights.last_mut().expect("the term of the length") = weight;
}

impl<const D: usize> Multipliers<D> for Stretch {
    /// The part of the length by which the limit is missed, or by which the curve is held back without need.
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
                // Lengths that grow with the weight say nothing.
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
