//! The method of multipliers: the least energy of one curve subject to constraints.
//!
//! ```text
//! descent with the constraints' terms ─► next multipliers ─► descent … ─► the least energy within the constraints
//! ```
//!
//! For multipliers y the curve descends its energy with a term for each constraint c ≥ 0. The next multipliers follow from where
//! it ends. Where the curve goes along a constraint, y is the force that keeps it there. Everywhere else y is 0.
//!
//! Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex programming* (1973).

use super::minimise::minimise;
use super::problem::{Outcome, Problem};
use super::queue::{CurveFit, Goal};
use super::setup::PreparedCurve;

/// The multipliers of constraints of one kind.
pub(super) trait Multipliers<const D: usize> {
    /// Takes the next multipliers, where the curve stands at its base.
    fn update(&mut self, problem: &mut Problem<D>);

    /// The largest violation of a constraint, or of its multiplier, in units of the constraint.
    ///
    /// A multiplier violates too where the curve keeps the constraint with room: it must be 0.
    fn violation(&self) -> f64;

    /// Whether the multipliers are known well enough for a descent to the method's tolerance.
    fn is_settled(&self) -> bool;

    /// Whether rounds do not lead nearer to the constraints any more.
    fn is_given_up(&self) -> bool {
        false
    }

    /// The energy of the constraints' terms at the base.
    fn energy(&self, problem: &Problem<D>) -> f64;

    /// The norm of the gradient that rounding of the terms may leave.
    fn rounding(&self, _problem: &Problem<D>) -> f64 {
        0.0
    }
}

/// The tolerances of rounds, and how many there may be.
pub(super) struct Schedule {
    /// The largest tolerance, but for the first round.
    pub roughly: f64,
    /// The tolerance of the next round in units of √(E/n) v, for n edges and the violation v.
    pub of_violation: f64,
    /// The most rounds.
    pub rounds: u32,
    /// The most iterations of a round but for the last.
    pub iterations: u32,
}

/// A curve between rounds.
pub(super) struct Constrained<const D: usize> {
    pub ready: PreparedCurve<D>,
    /// All descents.
    pub outcome: Option<Outcome<D>>,
    pub rounds: u32,
    /// Whether the last round ended where a next one could begin.
    pub may_go_on: bool,
    /// Whether the last round was to the method's tolerance, with multipliers that are known.
    pub is_done: bool,
}

impl<const D: usize> Constrained<D> {
    /// A curve at its base, which the descents so far have led to.
    pub fn new(ready: PreparedCurve<D>, outcome: Option<Outcome<D>>) -> Self {
        Constrained { ready, outcome, rounds: 0, may_go_on: true, is_done: false }
    }

    /// Descends in rounds, from the problem's tolerance to the method's.
    pub async fn descend(
        mut self,
        curve: &CurveFit<'_, D>,
        goal: Goal,
        all: &mut [&mut (dyn Multipliers<D> + Send)],
        schedule: &Schedule,
    ) -> Self {
        let (tolerance, most_iterations) = (curve.fair.tolerance, curve.fair.max_iterations);
        (self.rounds, self.may_go_on, self.is_done) = (0, true, false);
        while self.rounds < schedule.rounds && !self.is_done && !all.iter().any(|own| own.is_given_up()) {
            let is_settled = all.iter().all(|own| own.is_settled());
            let most = if is_settled { most_iterations } else { most_iterations.min(schedule.iterations) };
            self.ready.problem.most_iterations = most;
            let outcome;
            (self.ready, outcome) = minimise(curve, self.ready, goal).await;
            self.rounds += 1;
            self.may_go_on = outcome.leads_on();
            let was_exact = self.ready.problem.tolerance <= self.exact(tolerance, all);
            self.take(outcome, all);
            if !self.may_go_on {
                break;
            }
            for own in all.iter_mut() {
                own.update(&mut self.ready.problem);
            }
            let is_settled = all.iter().all(|own| own.is_settled());
            self.is_done = is_settled && was_exact;
            let violation = all.iter().map(|own| own.violation()).fold(0.0, f64::max).min(1.0);
            let energy = self.outcome.as_ref().map_or(f64::NAN, |outcome| outcome.energy);
            let root = (energy / self.ready.problem.base.len() as f64).sqrt();
            let of_violation = (schedule.of_violation * root * violation).min(schedule.roughly);
            let wanted = if is_settled { 0.0 } else { of_violation };
            self.ready.problem.tolerance = wanted.max(self.exact(tolerance, all));
        }
        self
    }

    /// The tolerance of the last round.
    fn exact(&self, tolerance: f64, all: &[&mut (dyn Multipliers<D> + Send)]) -> f64 {
        all.iter().map(|own| own.rounding(&self.ready.problem)).fold(tolerance, f64::max)
    }

    /// Appends a round, whose energy is without the constraints' terms.
    fn take(&mut self, outcome: Outcome<D>, all: &[&mut (dyn Multipliers<D> + Send)]) {
        let problem = &mut self.ready.problem;
        problem.rebase(&outcome.displacements);
        let energy = all.iter().fold(outcome.energy, |energy, own| energy - own.energy(problem));
        let outcome = Outcome { energy, ..outcome };
        match &mut self.outcome {
            Some(own) => own.go_on(outcome),
            None => self.outcome = Some(outcome),
        }
    }
}
