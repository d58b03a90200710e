//! Fallback for curves of least variation: a descent at the vertices, and if it fails, one by
//! [`tangent_angles`](super::tangent_angles).

use super::energy::Functional;
use super::lane::TerminationStatus;
use super::problem::{Outcome, Problem};
use super::queue::{CurveFit, Goal};
use super::tangent_angles::{Angles, Ending, Found};

/// The most iterations at the vertices before angles are tried. If the gradient is small by then,
/// [`SECOND`] applies.
const FIRST: u32 = 6;

/// A gradient below this counts as small after [`FIRST`] iterations.
///
/// In samples of 400 gentle and of 400 rough curves, the gradient is then at least 0.8 for curves
/// that never converge at their vertices, and below 0.04 for half of the others. For rings with σ
/// 0.3 it is at least 5, and below 2.
const SMALL: f64 = 0.5;

/// The most iterations at the vertices before angles are tried, if the gradient is small.
///
/// 99 % of gentle curves converge within 13.
const SECOND: u32 = 16;

/// A curve longer than this factor times its data polygon is tried by angles at once.
///
/// Curves that converge near their spline rarely exceed 1.23.
const ROOM: f64 = 1.5;

/// The most iterations at the vertices for a curve found by angles.
const LAST: u32 = 16;

/// A curve that is unbounded in the descent by angles is unbounded if it does not converge at its
/// vertices within this many iterations.
const VERDICT: u32 = 60;

/// Descends a curve at its vertices. If this does not converge, descends by angles where possible.
///
/// A result whose polygon folds is [`TerminationStatus::Folded`].
pub(super) async fn descend<const D: usize>(
    curve: &CurveFit<'_, D>,
    problem: Box<Problem<D>>,
    goal: Goal,
) -> (Box<Problem<D>>, Outcome<D>) {
    let angles = if curve.is_newton() { Angles::of(curve.energy(goal), &problem) } else { None };
    let (problem, mut outcome) = match angles {
        None => curve.descend(problem, goal).await,
        Some(angles) => {
            let outcome = Box::pin(descend_either_way(&Rough { curve, problem: &problem, goal }, angles)).await;
            (problem, outcome)
        }
    };
    if (Rough { curve, problem: &problem, goal }).is_folded(&outcome) {
        outcome.termination = TerminationStatus::Folded;
    }
    (problem, outcome)
}

async fn descend_either_way<const D: usize>(rough: &Rough<'_, D>, angles: Angles) -> Outcome<D> {
    let (problem, most) = (rough.problem, rough.problem.most_iterations);
    let longest = problem.longest.min(ROOM * angles.chord());
    let first = Problem { longest, most_iterations: FIRST.min(most), ..problem.clone() };
    let (_, mut tried) = rough.curve.descend(Box::new(first), rough.goal).await;
    if tried.termination == TerminationStatus::Exhausted && tried.norm < SMALL {
        rough.go_on(&mut tried, SECOND.min(most).saturating_sub(FIRST)).await;
    }
    if !tried.is_open() && !rough.is_folded(&tried) {
        return tried;
    }
    // Reserves LAST iterations for the vertices.
    let own = most.saturating_sub(tried.iterations).saturating_sub(LAST);
    let (mut outcome, ending) = tried.and_then((own > 0).then(|| angles.descend(problem, own)));
    let left = most.saturating_sub(outcome.iterations);
    if ending == Ending::Unbounded {
        // A nearby minimum at the vertices is better than a descent without end.
        let most = left.min(VERDICT.saturating_sub(outcome.iterations));
        rough.go_on(&mut outcome, most).await;
        if outcome.is_open() {
            outcome.termination = TerminationStatus::Unbounded;
        }
        return outcome;
    }
    rough.go_on(&mut outcome, if ending == Ending::Found { LAST } else { left }).await;
    if outcome.termination == TerminationStatus::Exhausted && outcome.iterations < most {
        let left = most - outcome.iterations;
        rough.go_on(&mut outcome, left).await;
    }
    if ending == Ending::Found && outcome.termination == TerminationStatus::Stalled && !rough.is_folded(&outcome) {
        rough.resume_with_new_regularisation(&mut outcome).await;
    }
    outcome
}

/// A curve that may need the fallback.
struct Rough<'a, const D: usize> {
    curve: &'a CurveFit<'a, D>,
    problem: &'a Problem<D>,
    goal: Goal,
}

impl<const D: usize> Rough<'_, D> {
    /// Whether a curve has converged or stalled at a polygon that folds, where variation does not
    /// measure the turn.
    fn is_folded(&self, outcome: &Outcome<D>) -> bool {
        let varies =
            |(weight, functional): &(f64, Functional)| *weight > 0.0 && matches!(functional, Functional::Variation(_));
        matches!(outcome.termination, TerminationStatus::Converged | TerminationStatus::Stalled)
            && self.curve.energy(self.goal).terms().iter().any(varies)
            && self.problem.folds(&outcome.displacements)
    }

    /// Continues the descent from the current curve, with at most this many iterations.
    async fn go_on(&self, outcome: &mut Outcome<D>, most_iterations: u32) {
        let problem = Problem { most_iterations, ..self.problem.rebased(&outcome.displacements) };
        outcome.go_on(self.curve.descend(Box::new(problem), self.goal).await.1);
    }

    /// Continues the descent of a curve that stalled after the descent by angles, with the
    /// regularisation reset for its current spans.
    ///
    /// The regularisation's weight falls with the fifth power of the edge length. If a span has
    /// become ten times as long, the weight set at the start is 10⁵ times too stiff. That weight is
    /// still tried first, because with 16 edges per span a softer one lets polygons fold. Curves
    /// that already fold are left.
    async fn resume_with_new_regularisation(&self, outcome: &mut Outcome<D>) {
        // Unbounded curves show it soon.
        let most = if self.problem.longest.is_finite() { VERDICT } else { u32::MAX };
        let most_iterations = self.problem.most_iterations.min(most).saturating_sub(outcome.iterations);
        if most_iterations > 0 {
            let mut problem = Problem { most_iterations, ..self.problem.rebased(&outcome.displacements) };
            problem.reset_regularisation();
            outcome.go_on(self.curve.descend(Box::new(problem), self.goal).await.1);
        }
    }
}

impl<const D: usize> Outcome<D> {
    /// This descent followed by the descent by angles from the same start.
    ///
    /// If angles found no curve, the displacements do not change.
    fn and_then(self, found: Option<Found<D>>) -> (Outcome<D>, Ending) {
        let Some(found) = found else { return (self, Ending::Failed) };
        let (iterations, evaluations) = (self.iterations + found.iterations, self.evaluations + found.trials);
        let termination =
            if found.ending == Ending::Unbounded { TerminationStatus::Unbounded } else { self.termination };
        let displacements = if found.ending == Ending::Found { found.displacements } else { self.displacements };
        (Outcome { displacements, termination, iterations, evaluations, on_cpu: true, ..self }, found.ending)
    }
}

#[cfg(test)]
mod tests;
