//! Finds a nearby minimum for one curve, by [continuation] in ν, the [fallback] for rough curves,
//! and a final descent in f64 after f32.

use super::problem::Outcome;
use super::queue::{CurveFit, Goal};
use super::setup::PreparedCurve;
use super::{continuation, fallback};

/// Descends to a nearby minimum.
///
/// f32 may leave a curve short of its minimum. If the precision is chosen automatically, the CPU
/// finishes such curves in f64, and also curves whose edges are too fine for f32. Newton's method
/// then takes one or two iterations.
pub(super) async fn minimise<const D: usize>(
    curve: &CurveFit<'_, D>,
    mut ready: PreparedCurve<D>,
    goal: Goal,
) -> (PreparedCurve<D>, Outcome<D>) {
    let (tolerance, in_f32) = (ready.problem.tolerance, curve.is_in_f32(goal));
    if in_f32 {
        ready.problem.tolerance = tolerance.max(ready.problem.rounding_in_f32(curve.energy(goal)));
    }
    let mut outcome;
    (ready.problem, outcome) = match goal {
        Goal::Free if curve.stages().next().is_some() => Box::pin(continuation::descend(curve, ready.problem)).await,
        _ => fallback::descend(curve, ready.problem, goal).await,
    };
    if in_f32 && curve.queue.may_finish_on_cpu() {
        if !ready.suits_f32() || outcome.is_short() {
            let mut problem = Box::new(ready.problem.rebased(&outcome.displacements));
            problem.tolerance = tolerance;
            outcome.go_on(curve.descend_on_cpu(problem, goal).await);
        }
    } else if in_f32 && curve.fair.surface.is_some() {
        outcome.rest(ready.problem.tolerance);
    }
    ready.problem.tolerance = tolerance;
    (ready, outcome)
}
