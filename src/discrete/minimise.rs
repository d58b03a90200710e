//! Finds a nearby minimum for one curve, by [continuation] in ν, the [fallback] for rough curves,
//! and a final descent in f64 after f32.

use super::problem::Outcome;
use super::queue::{CurveFit, Goal};
use super::setup::PreparedCurve;
use super::{continuation, fallback};

/// The largest gradient norm with which a curve in f32 counts as converged.
///
/// Of 2,000 rough random walks none needs more than 2e-4. A border of uneven spans that rounds at
/// 3e-2 was called converged with an energy 0.2 % too high.
pub(super) const COARSEST_IN_F32: f64 = 1e-3;

/// Descends to a nearby minimum.
///
/// f32 may leave a curve short of its minimum. If the precision is chosen automatically, the CPU
/// finishes such curves in f64, and also curves whose edges are too fine for f32. Newton's method
/// then takes one or two iterations. Curves that f32 cannot resolve are the CPU's from the start.
pub(super) async fn minimise<const D: usize>(
    curve: &CurveFit<'_, D>,
    mut ready: PreparedCurve<D>,
    goal: Goal,
) -> (PreparedCurve<D>, Outcome<D>) {
    let tolerance = ready.problem.tolerance;
    let rounding = if curve.is_in_f32(goal) { ready.problem.rounding_in_f32(curve.energy(goal)) } else { 0.0 };
    let on_cpu = curve.repeated();
    let is_resolved = rounding <= COARSEST_IN_F32 || !curve.queue.may_finish_on_cpu();
    let curve = if is_resolved { curve } else { &on_cpu };
    let in_f32 = curve.is_in_f32(goal);
    if in_f32 {
        ready.problem.tolerance = tolerance.max(rounding.min(COARSEST_IN_F32));
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
