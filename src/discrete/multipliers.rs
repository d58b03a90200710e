//! The method of multipliers: minimises the energy of one curve subject to constraints.
//!
//! ```text
//! descent with the constraints' terms ─► next multipliers ─► descent … ─► the constrained minimum
//! ```
//!
//! Each descent minimises the energy plus a term for every constraint c ≥ 0 with its multiplier y.
//! The result determines the next multipliers. At an active constraint y is the force that keeps
//! the curve there. Otherwise y is 0.
//!
//! Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex
//! programming* (1973).

use super::minimise::minimise;
use super::problem::{Outcome, Problem};
use super::queue::{CurveFit, Goal};
use super::setup::PreparedCurve;

/// The multipliers of one kind of constraint.
pub(super) trait Multipliers<const D: usize> {
    /// Updates the multipliers for the curve at its base.
    fn update(&mut self, problem: &mut Problem<D>);

    /// The largest violation of a constraint or of its complementarity condition, in units of the
    /// constraint.
    ///
    /// The multiplier of an inactive constraint must be 0.
    fn violation(&self) -> f64;

    /// Whether the multipliers are accurate enough for a descent to the method's tolerance.
    fn is_settled(&self) -> bool;

    /// Whether further rounds will not reduce the violation.
    fn is_given_up(&self) -> bool {
        false
    }

    /// The energy of the constraints' terms at the base.
    fn energy(&self, problem: &Problem<D>) -> f64;

    /// The gradient norm that rounding of the terms may leave.
    fn rounding(&self, _problem: &Problem<D>) -> f64 {
        0.0
    }
}

/// The tolerances and numbers of rounds.
pub(super) struct Schedule {
    /// The largest tolerance after the first round.
    pub roughly: f64,
    /// The tolerance of the next round in units of √(E/n) v, for n edges and the violation v.
    pub of_violation: f64,
    /// The most rounds.
    pub rounds: u32,
    /// The most iterations of a round, except the last.
    pub iterations: u32,
}

/// The state of a curve between rounds.
pub(super) struct Constrained<const D: usize> {
    pub ready: PreparedCurve<D>,
    /// The sum of all descents.
    pub outcome: Option<Outcome<D>>,
    pub rounds: u32,
    /// Whether the last round ended in a state from which another can start.
    pub may_go_on: bool,
    /// Whether the last round reached the method's tolerance with settled multipliers.
    pub is_done: bool,
}

impl<const D: usize> Constrained<D> {
    /// A curve at its base. `outcome` are the descents that led there.
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

    /// Appends a round. Its energy is stored without the constraints' terms.
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
