//! The way of one curve to a minimum near: through the [continuation] in ν, with the [fallback](rough) of rough curves, and
//! from f32 to f64.

use super::problem::Outcome;
use super::queue::{CurveFit, Goal};
use super::setup::PreparedCurve;
use super::{continuation, fallback};

/// Descends to a minimum near.
///
/// f32 may leave a curve short of its minimum. Where the precision is left to the program, the CPU finishes such curves in f64,
/// and also curves whose edges are too fine for f32. Newton's method takes an iteration or two.
pub(super) async fn minimise<const D: usize>(
    curve: &CurveFit<'_, D>,
    mut ready: PreparedCurve<D>,
    goal: Goal,
) -> (PreparedCurve<D>, Outcome<D>) {
    let (tolerance, in_f32) = (ready.problem.tolerance, curve.queue.is_in_f32(goal));
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
