//! Fallback of curves of least variation: descents at the vertices first, and by [`tangent_angles`](super::tangent_angles) where those lead
//! nowhere.

use super::energy::Functional;
use super::lane::TerminationStatus;
use super::problem::{Outcome, Problem};
use super::queue::{CurveFit, Goal};
use super::tangent_angles::{Angles, Ending, Found};

/// The most iterations at the vertices before angles are tried, unless the gradient is small by then.
const FIRST: u32 = 6;

/// A gradient that is small after [`FIRST`] iterations.
///
/// Of 400 curves a kind, gentle and rough, those that never converge at their vertices stand at 0.8 and more then,
/// and half of the others below 0.04; of rings of σ 0.3 at 5 and more, and below 2.
const SMALL: f64 = 0.5;

/// The most iterations at the vertices of what has a small gradient, before angles are tried.
///
/// Of gentle curves 99 % converge within 13.
const SECOND: u32 = 16;

/// A curve this many times as long as its points' polygon is tried by angles at once.
///
/// What converges near its spline passes 1.23 rarely.
const ROOM: f64 = 1.5;

/// The most iterations at the vertices from a curve that was found by angles.
const LAST: u32 = 16;

/// A curve that runs away by its angles, and has no minimum at its vertices after so many iterations, has none.
const VERDICT: u32 = 60;

/// Descends a curve at its vertices, or by angles if it may and does not converge.
///
/// What ends at a polygon that folds is [`TerminationStatus::Folded`].
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
    // LAST iterations are left for the vertices.
    let own = most.saturating_sub(tried.iterations).saturating_sub(LAST);
    let (mut outcome, ending) = tried.and_then((own > 0).then(|| angles.descend(problem, own)));
    let left = most.saturating_sub(outcome.iterations);
    if ending == Ending::Unbounded {
        // A minimum at the vertices, if there is one near, is worth more than a way down without end.
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

/// A curve that may be rough.
struct Rough<'a, const D: usize> {
    curve: &'a CurveFit<'a, D>,
    problem: &'a Problem<D>,
    goal: Goal,
}

impl<const D: usize> Rough<'_, D> {
    /// Whether a curve has converged, or leads no further, at a polygon that folds, where variation is blind to its turn.
    fn is_folded(&self, outcome: &Outcome<D>) -> bool {
        let varies =
            |(weight, functional): &(f64, Functional)| *weight > 0.0 && matches!(functional, Functional::Variation(_));
        matches!(outcome.termination, TerminationStatus::Converged | TerminationStatus::Stalled)
            && self.curve.energy(self.goal).terms().iter().any(varies)
            && self.problem.folds(&outcome.displacements)
    }

    /// Descends from where the curve is, in this many iterations at most.
    async fn go_on(&self, outcome: &mut Outcome<D>, most_iterations: u32) {
        let problem = Problem { most_iterations, ..self.problem.rebased(&outcome.displacements) };
        outcome.go_on(self.curve.descend(Box::new(problem), self.goal).await.1);
    }

    /// Goes on from a curve that stalls where its angles led it, with a regularisation for the spans that it has now.
    ///
    /// The regularisation's weight falls with the fifth power of the edges' length: where a span has become ten times as long,
    /// the one set for the start is 10⁵ times too stiff. It is tried first all the same, since with 16 edges a span a
    /// softer one lets polygons fold. What folds already is left.
    async fn resume_with_new_regularisation(&self, outcome: &mut Outcome<D>) {
        // What runs away shows it soon, or is left.
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
    /// This descent and the one by angles after it, from the same start.
    ///
    /// What was not found leaves the curve as it was.
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
