//! Fits a curve subject to its [`Limits`](super::Limits).
//!
//! ```text
//! curve without limits ─► rounds with penalties ─► the fairest curve within its limits
//! ```
//!
//! A curve that satisfies its limits without them is left as it is.
//!
//! Since |K| depends on the spacing of the vertices, a curve could satisfy a limit by changing the
//! spacing. A regularisation with [`REGULARISATION`] times its usual weight prevents this.

use super::area::Area;
use super::curve_limits::CurveLimits;
use super::disc::Discs;
use super::lane::TerminationStatus;
use super::limit_multipliers::{INITIAL_PENALTY, LimitMultipliers};
use super::limits_result::{Ending, LimitsResult};
use super::multipliers::{Constrained, Multipliers, Schedule};
use super::problem::Outcome;
use super::queue::{CurveFit, Goal};
use super::region_constraints::RegionConstraints;
use super::separation::SeparatingHalfPlane;
use super::setup::PreparedCurve;
use super::stretch::Stretch;
use crate::linalg::scalar::add;

/// The weight of the regularisation, relative to its weight without limits.
const REGULARISATION: f64 = 30.0;

/// A curve without given tangents and regions satisfies its limits by loops if it is longer than
/// this factor times the curve without limits. So does a planar curve that crosses itself although
/// the curve without limits does not.
///
/// At 0.9 of their largest curvature, 99 of 100 rough planar curves become at most 1.05 times as
/// long. Longer ones bulge, and there is no gap between bulges and loops, so the value is a choice.
const LOOPS: f64 = 1.5;

/// The initial ρ of penalties in units of E/m. The second is used if the first gives loops or does
/// not converge.
///
/// With soft penalties a curve can cross the low barrier between its own turn and a loop. Of 30
/// such curves for which an interior-point method finds a nearby solution, 28 satisfy their limits
/// with the second value.
const FIRSTS: [f64; 2] = [INITIAL_PENALTY, 1e3];

/// The schedule of the rounds. The first round has the largest tolerance.
const SCHEDULE: Schedule = Schedule { roughly: 1e-2, of_violation: 0.05, rounds: 40, iterations: 25 };

/// A lower bound of the energy that scales the penalties of a lifted curve, as a fraction of the
/// lifted curve's energy. With 1 the initial penalties are so stiff that the curve stays where it
/// was lifted to.
const LIFTED: f64 = 0.01;

/// How the start of a curve with limits was found.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Start {
    /// By a descent without limits.
    Free,
    /// As a curve that satisfies the limits. Soft penalties would let it violate them again, so the
    /// stiffer of [`FIRSTS`] is used first.
    WithinLimits,
}

/// The multipliers and rounds of a curve with limits.
struct Limited<const D: usize> {
    penalties: LimitMultipliers<D>,
    stretch: Option<Stretch>,
    area: Option<Area>,
    rounds: Constrained<D>,
}

impl<const D: usize> Limited<D> {
    /// A curve at its base. `energies` are its own energy and the energy without limits, NaN if
    /// there was no minimum.
    fn new(
        curve: &CurveFit<'_, D>,
        limits: CurveLimits<D>,
        mut ready: PreparedCurve<D>,
        [energy, free]: [f64; 2],
        first: f64,
    ) -> Self {
        let problem = &mut ready.problem;
        problem.weights.resize(curve.energy(Goal::Limited).terms().len(), 1.0);
        let lifted = limits.regions.as_ref().and_then(|regions| regions.lift(&problem.places, problem.closed));
        let outcome = lifted.map(Outcome::moved);
        let mut energy = energy;
        if let Some(outcome) = &outcome {
            problem.rebase(&outcome.displacements);
            // The energy of a straight curve is 0.
            energy = energy.max(LIFTED * problem.energy_of_base(curve.energy(Goal::Free)));
        }
        let stretch = limits.longest.map(|longest| Stretch::new(longest, energy, !free.is_nan(), problem));
        let area = limits.enclosed.map(|enclosed| Area::new(enclosed, energy, problem));
        let penalties = LimitMultipliers::around(problem, limits, energy, first);
        // The regularisation of ratios is bounded, so very unequal edges could satisfy a limit.
        if curve.fair.energy.order() == 2 && curve.fair.surface.is_none() {
            problem.regularise_differences();
        }
        problem.regularisation *= REGULARISATION;
        problem.tolerance = SCHEDULE.roughly.max(curve.fair.tolerance);
        Limited { penalties, stretch, area, rounds: Constrained::new(ready, outcome) }
    }

    /// Descends in rounds, and returns how they end. The curve also stays in `discs`, if given.
    async fn descend(mut self, curve: &CurveFit<'_, D>, discs: Option<&mut Discs>) -> (Self, Ending) {
        let mut all: Vec<&mut (dyn Multipliers<D> + Send)> = vec![&mut self.penalties];
        if let Some(discs) = discs {
            all.push(discs);
        }
        if let Some(stretch) = &mut self.stretch {
            all.push(stretch);
        }
        if let Some(area) = &mut self.area {
            all.push(area);
        }
        self.rounds = self.rounds.descend(curve, Goal::Limited, &mut all, &SCHEDULE).await;
        let is_given_up = all.iter().any(|own| own.is_given_up());
        let is_settled = all.iter().all(|own| own.is_settled());
        let worst = self.rounds.ready.problem.worst(&self.penalties.limits);
        let ending = match (is_given_up, is_settled && worst.is_none_or(|worst| worst.excess <= 0.0)) {
            (true, _) => Ending::GivenUp,
            (_, true) => Ending::Kept,
            _ => Ending::Unsettled,
        };
        if let (Ending::GivenUp, Some(outcome)) = (ending, &mut self.rounds.outcome) {
            outcome.termination = TerminationStatus::Converged;
        }
        (self, ending)
    }
}

/// Enforces the limits of a curve, and returns the result. `separating` are the half-planes between
/// it and its neighbours.
///
/// `None` if the curve has no limits.
pub(super) async fn keep<const D: usize>(
    curve: &CurveFit<'_, D>,
    free: &PreparedCurve<D>,
    outcome: &mut Outcome<D>,
    separating: &[SeparatingHalfPlane],
    start: Start,
) -> Option<LimitsResult> {
    let CurveFit { fair, batch, i, .. } = *curve;
    let mut firsts = FIRSTS;
    if start == Start::WithinLimits {
        firsts.reverse();
    }
    // The result with the first penalty.
    let mut before: Option<(Outcome<D>, LimitsResult)> = None;
    for first in firsts {
        let mut ready = free.clone();
        let mut limits = CurveLimits::of(&fair.limits, batch, i, separating, &mut ready);
        let has_converged = outcome.termination == TerminationStatus::Converged;
        if has_converged {
            ready.problem.rebase(&outcome.displacements);
        }
        limits.measure(&ready.problem);
        let worst = ready.problem.worst(&limits)?;
        let mut energies = [outcome.energy; 2];
        if has_converged && worst.excess <= 0.0 {
            return Some(LimitsResult::of(fair, batch, &ready, &limits, i, energies, Ending::Kept));
        }
        if !has_converged {
            // It starts from the same base as the curve without limits.
            outcome.displacements.fill([0.0; D]);
            energies = [ready.problem.energy_of_base(&fair.energy), f64::NAN];
        }
        let limited = Limited::new(curve, limits, ready, energies, first);
        let curve = &if before.is_some() { curve.repeated() } else { *curve };
        let (limited, ending) = Box::pin(limited.descend(curve, None)).await;
        let (mut now, is_good) = judged(curve, limited, ending, free, outcome, energies[1]);
        match &mut before {
            None if !is_good => before = Some(now),
            None => {
                *outcome = now.0;
                return Some(now.1);
            }
            Some(first) => {
                let iterations = first.0.iterations + now.0.iterations - outcome.iterations;
                first.0.iterations = iterations;
                now.0.iterations = iterations;
                if is_good {
                    *first = now;
                }
            }
        }
    }
    let (found, kept) = before?;
    *outcome = found;
    Some(kept)
}

/// The result of a curve after its rounds, and whether it is final. `free` is its descent without
/// limits.
fn judged<const D: usize>(
    curve: &CurveFit<'_, D>,
    limited: Limited<D>,
    ending: Ending,
    start: &PreparedCurve<D>,
    free: &Outcome<D>,
    energy: f64,
) -> ((Outcome<D>, LimitsResult), bool) {
    let CurveFit { fair, batch, i, .. } = *curve;
    let Limited { penalties: LimitMultipliers { limits, .. }, rounds: Constrained { ready, outcome, .. }, .. } =
        limited;
    let outcome = outcome.expect("rounds have descended");
    let kept = LimitsResult::of(fair, batch, &ready, &limits, i, [outcome.energy, energy], ending);
    let mut without = start.clone();
    if limits.regions.is_some() {
        without.place();
    }
    without.problem.rebase(&free.displacements);
    let without = LimitsResult::of(fair, batch, &without, &limits, i, [energy; 2], Ending::Loops);
    // A path around a region or an obstacle may have any length.
    let has_no_regions = limits.regions.as_ref().is_none_or(RegionConstraints::has_sides_alone);
    let is_longer =
        has_no_regions && fair.limits.obstacles.is_empty() && kept.report.stretch > LOOPS * without.report.stretch;
    let is_good = ending != Ending::Unsettled && outcome.termination == TerminationStatus::Converged;
    let mut within = free.clone();
    within.go_on(outcome);
    // A curve that stays on its side of its neighbours must not be sent back across them.
    let has_sides = limits.regions.as_ref().is_some_and(RegionConstraints::has_sides);
    let crosses = D == 2 && !has_sides && !start.tangled(&within).is_empty() && start.tangled(free).is_empty();
    if (is_longer || crosses) && !ready.problem.has_tangents {
        return ((Outcome { iterations: within.iterations, ..free.clone() }, without), false);
    }
    ((within, kept), is_good)
}

/// [`keep`] for a curve within a deviation, which also stays in its discs.
pub(super) async fn keep_within<const D: usize>(
    curve: &CurveFit<'_, D>,
    discs: &mut Discs,
    mut ready: PreparedCurve<D>,
    outcome: &mut Outcome<D>,
    separating: &[SeparatingHalfPlane],
) -> (PreparedCurve<D>, Option<LimitsResult>) {
    let CurveFit { fair, batch, i, .. } = *curve;
    let mut limits = CurveLimits::of(&fair.limits, batch, i, separating, &mut ready);
    for (place, u) in ready.problem.places.iter_mut().zip(&outcome.displacements) {
        *place = add(*place, *u);
    }
    limits.measure(&ready.problem);
    let Some(worst) = ready.problem.worst(&limits) else { return (ready, None) };
    let has_converged = outcome.termination == TerminationStatus::Converged && discs.is_settled();
    if has_converged && worst.excess <= 0.0 {
        let kept = LimitsResult::of(fair, batch, &ready, &limits, i, [outcome.energy; 2], Ending::Kept);
        return (ready, Some(kept));
    }
    let free = if has_converged { outcome.energy } else { f64::NAN };
    let energy = if has_converged { free } else { ready.problem.energy_of_base(&fair.energy) };
    let limited = Limited::new(curve, limits, ready, [energy, free], INITIAL_PENALTY);
    // Limits move the curve, so that other places are nearest to its points.
    discs.begin_again();
    let (limited, ending) = limited.descend(curve, Some(discs)).await;
    let Limited { penalties, rounds: Constrained { ready, outcome: found, .. }, .. } = limited;
    let found = found.expect("rounds have descended");
    let kept = LimitsResult::of(fair, batch, &ready, &penalties.limits, i, [found.energy, free], ending);
    outcome.go_on(found);
    (ready, Some(kept))
}
