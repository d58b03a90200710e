//! Continuation in the exponent ν of bending. Exponents far from 2 are approached in stages, and
//! each stage starts from the result of the one before.
//!
//! For large ν the sharpest bend holds nearly all of the energy, and the Hessian contains almost no
//! information about the others.

use super::energy::{Energy, nearer};
use super::fallback;
use super::problem::{Outcome, Problem};
use super::queue::{CurveFit, Goal};

/// The tolerance of the gradient norm in all stages but the last, which only need a good start for
/// the next.
const STAGE_TOLERANCE: f64 = 1e-2;

/// The most iterations of every stage but the last.
const STAGE_ITERATIONS: u32 = 40;

/// Descends through the stages to the energy itself.
pub(super) async fn descend<const D: usize>(
    curve: &CurveFit<'_, D>,
    problem: Box<Problem<D>>,
) -> (Box<Problem<D>>, Outcome<D>) {
    let mut own = problem.clone();
    let mut outcome = Outcome::moved(vec![[0.0; D]; problem.vertices()]);
    for (bound, goal) in curve.stages() {
        let staged = own.within(curve.energy(Goal::Free), bound);
        let (_, mut stage) = curve.descend(Box::new(staged), goal).await;
        if !stage.leads_on() {
            stage.displacements.fill([0.0; D]);
        }
        own.rebase(&stage.displacements);
        outcome.go_on(stage);
    }
    outcome.go_on(fallback::descend(curve, own, Goal::Free).await.1);
    (problem, outcome)
}

impl<const D: usize> Problem<D> {
    /// The problem of [`Energy::within`] for this bound of the exponents.
    ///
    /// Weights are scaled so that the energy density at the mean curvature does not change.
    fn within(&self, energy: &Energy, bound: f64) -> Problem<D> {
        let mut problem = self.clone();
        problem.tolerance = problem.tolerance.max(STAGE_TOLERANCE);
        problem.most_iterations = problem.most_iterations.min(STAGE_ITERATIONS);
        let mut highest = (0.0, 0.0);
        for (weight, (_, functional)) in problem.weights.iter_mut().zip(energy.terms()) {
            if let Some(exponent) = functional.exponent() {
                let nu = nearer(exponent, bound);
                let share = *weight * self.curvature.powf(exponent - 2.0);
                highest.0 += share * exponent * (exponent - 1.0);
                highest.1 += share * nu * (nu - 1.0);
                *weight *= self.curvature.powf(exponent - nu);
            }
        }
        if energy.order() == 2 && highest.0 > 0.0 {
            problem.highest *= highest.1 / highest.0;
            problem.regularisation *= highest.1 / highest.0;
        }
        problem
    }
}
