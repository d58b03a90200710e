//! A curve that keeps its [`Limits`](super::Limits).
//!
//! ```text
//! curve without limits ─► rounds between penalties ─► the fairest within its limits
//! ```
//!
//! A curve that keeps its limits without them stays as it is.
//!
//! Vertices could change their spacing to keep a limit, since |K| depends on it. A regularisation of [`REGULARISATION`] times the weight
//! does not let them.

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

/// The weight of the regularisation, in units of its weight without limits.
const REGULARISATION: f64 = 30.0;

/// A curve without given tangents and regions that is this many times as long as where it started keeps its limits by
/// loops. So does a planar one that crosses itself as it did not there.
///
/// At 0.9 of their largest curvature 99 of 100 rough planar curves are 1.05 times as long at most. Longer ones bulge, the
/// longer the rounder, without a gap between bulges and loops: the number is a choice.
const LOOPS: f64 = 1.5;

/// The first ρ of penalties in units of E/m. With the second go curves once more that only loops would keep, or that did not
/// converge.
///
/// Between soft penalties a curve passes over the low barrier that is between its own turn and a loop. Of 30 curves that did
/// so, where an interior-point method finds one near, 28 keep their limits with the second.
const FIRSTS: [f64; 2] = [INITIAL_PENALTY, 1e3];

/// The rounds between penalties. The first has the largest tolerance.
const SCHEDULE: Schedule = Schedule { roughly: 1e-2, of_violation: 0.05, rounds: 40, iterations: 25 };

/// The part of a lifted curve's energy that counts at least. With all of it penalties are so stiff at first that curves stay
/// where they were lifted to.
const LIFTED: f64 = 0.01;

/// Where curves come from that are to keep their limits.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Start {
    /// A descent without limits.
    Free,
    /// Curves that keep them, from which soft penalties would let them go. The stiffer [`FIRSTS`] is the first.
    WithinLimits,
}

/// The multipliers of a curve with limits.
struct Limited<const D: usize> {
    penalties: LimitMultipliers<D>,
    stretch: Option<Stretch>,
    area: Option<Area>,
    rounds: Constrained<D>,
}

impl<const D: usize> Limited<D> {
    /// A curve at its base. `energies` are its own and that without limits, NaN where there was no minimum.
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
            // The energy of a straight curve vanishes.
            energy = energy.max(LIFTED * problem.energy_of_base(curve.energy(Goal::Free)));
        }
        let stretch = limits.longest.map(|longest| Stretch::new(longest, energy, !free.is_nan(), problem));
        let area = limits.enclosed.map(|enclosed| Area::new(enclosed, energy, problem));
        let penalties = LimitMultipliers::around(problem, limits, energy, first);
        // Ratios are bounded, and a limit could be kept by edges of very unequal lengths.
        if curve.fair.energy.order() == 2 && curve.fair.surface.is_none() {
            problem.regularise_differences();
        }
        problem.regularisation *= REGULARISATION;
        problem.tolerance = SCHEDULE.roughly.max(curve.fair.tolerance);
        Limited { penalties, stretch, area, rounds: Constrained::new(ready, outcome) }
    }

    /// Descends in rounds, and says how these end. The curve stays in discs too, if it has any.
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

/// Goes on until a curve keeps its limits, and says how it does. `separating` are between it and its neighbours.
///
/// `None` stands for a curve that has no limits.
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
    // What came of the first go.
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
            // It starts from where the curve without limits did.
            outcome.displacements.fill([0.0; D]);
            energies = [ready.problem.energy_of_base(&fair.energy), f64::NAN];
        }
        let limited = Limited::new(curve, limits, ready, energies, first);
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

/// What came of a curve whose rounds ended, after it descended without limits, and whether that is the last word.
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
    // A way around a region may be as long as it likes.
    let has_no_regions = limits.regions.as_ref().is_none_or(RegionConstraints::has_sides_alone);
    let is_longer = has_no_regions && kept.report.stretch > LOOPS * without.report.stretch;
    let is_good = ending != Ending::Unsettled && outcome.termination == TerminationStatus::Converged;
    let mut within = free.clone();
    within.go_on(outcome);
    // One that keeps to its side of neighbours must not go back across them.
    let has_sides = limits.regions.as_ref().is_some_and(RegionConstraints::has_sides);
    let crosses = D == 2 && !has_sides && !start.tangled(&within).is_empty() && start.tangled(free).is_empty();
    if (is_longer || crosses) && !ready.problem.has_tangents {
        return ((Outcome { iterations: within.iterations, ..free.clone() }, without), false);
    }
    ((within, kept), is_good)
}

/// [`keep`] for a curve within a deviation, which stays in its discs as it comes to keep its limits.
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
    let (limited, ending) = limited.descend(curve, Some(discs)).await;
    let Limited { penalties, rounds: Constrained { ready, outcome: found, .. }, .. } = limited;
    let found = found.expect("rounds have descended");
    let kept = LimitsResult::of(fair, batch, &ready, &penalties.limits, i, [found.energy, free], ending);
    outcome.go_on(found);
    (ready, Some(kept))
}
