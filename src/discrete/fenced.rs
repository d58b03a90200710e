//! Curves that keep [`Limits`](super::Limits): rounds of descents between fences.
//!
//! ```text
//! curve without limits ─► descent between fences ─► multipliers ─► descent … ─► the fairest within its limits
//! ```
//!
//! All curves of a batch descend side by side, a round at a time, on the CPU as on a GPU. Curves that keep their limits
//! without them stay as they are.
//!
//! Vertices could change their spacing to keep a limit, since |K| depends on it. A gauge of [`GAUGE`] times the weight
//! does not let them.

use std::collections::BTreeMap;

use super::apart::Partings;
use super::descended::Descended;
use super::disc::Discs;
use super::energy::{Energy, Fencing};
use super::fair::Fair;
use super::fences::{ENOUGH, FIRST, Fences, MARGIN};
use super::kept::{Ending, Kept};
use super::lane::Standing;
use super::limits::CurveLimits;
use super::problem::Outcome;
use super::setup::Ready;
use super::stretch::Stretch;
use super::walls::Walls;
use crate::batch::{CurveBatch, Unfitted};
use crate::device::Device;
use crate::error::Result;
use crate::linalg::scalar::add;

/// The weight of the gauge, in that of curves without limits.
const GAUGE: f64 = 30.0;

/// The most rounds.
const MOST_ROUNDS: u32 = 40;

/// The most iterations of a round but for the last.
const ROUND_ITERATIONS: u32 = 25;

/// A curve without given tangents and regions that is this many times as long as where it started keeps its limits by
/// loops. So does a planar one that crosses itself as it did not there.
///
/// At 0.9 of their largest curvature 99 of 100 rough planar curves are 1.05 times as long at most. Longer ones bulge, the
/// longer the rounder, without a gap between bulges and loops: the number is a choice.
const LOOPS: f64 = 1.5;

/// The first ρ of fences in units of E/m. With the second go curves once more that only loops would keep, or that did not
/// converge.
///
/// Between soft fences a curve passes over the low barrier that is between its own turn and a loop. Of 30 curves that did
/// so, where an interior-point method finds one near, 28 keep their limits with the second.
const FIRSTS: [f64; 2] = [FIRST, 1e3];

/// Where curves come from that are to keep their limits.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Start {
    /// A descent without limits.
    Free,
    /// Curves that keep them, from which soft fences would let them go. The stiffer [`FIRSTS`] is the first.
    WithinLimits,
}

/// The tolerance of the first round, and the largest of all.
const ROUGHLY: f64 = 1e-2;

/// The tolerance of the next round in units of √(E/n) v, for n edges and the violation v.
const OF_VIOLATION: f64 = 0.05;

/// The part of a lifted curve's energy that counts at least. With all of it walls are so stiff at first that curves stay
/// where they were lifted to.
const LIFTED: f64 = 0.01;

/// A curve with limits, between rounds.
struct Fenced<const D: usize> {
    /// Its number among those of [`keep`] or [`keep_within`].
    k: usize,
    limits: CurveLimits<D>,
    fences: Fences,
    stretch: Option<Stretch>,
    /// The discs that it stays in too, with a deviation.
    discs: Option<Discs<D>>,
    ready: Ready<D>,
    /// The energy without limits, NaN where there was no minimum.
    free: f64,
    /// All descents since the curve without limits.
    outcome: Option<Outcome<D>>,
    rounds: u32,
    has_ended: bool,
    tolerance: f64,
}

impl<const D: usize> Fenced<D> {
    /// A curve at its base, which has this energy.
    fn new(
        k: usize,
        mut limits: CurveLimits<D>,
        mut ready: Ready<D>,
        [energy, free]: [f64; 2],
        first: f64,
        fair: &Fair,
    ) -> Self {
        let problem = &mut ready.problem;
        let lifted = limits.walls.as_ref().and_then(|walls| walls.lift(&problem.places, problem.closed));
        let outcome = lifted.map(Outcome::moved);
        let mut energy = energy;
        if let Some(outcome) = &outcome {
            problem.rebase(&outcome.displacements);
            // The energy of a straight curve vanishes.
            energy = energy.max(LIFTED * problem.energy_of_base(&fair.energy));
        }
        let fences = Fences::around(problem, &mut limits, energy, first);
        let stretch = limits.longest.map(|longest| Stretch::new(longest, energy, !free.is_nan()));
        // Ratios are bounded, and a limit could be kept by edges of very unequal lengths.
        if fair.energy.order() == 2 && fair.surface.is_none() {
            problem.gauge_differences();
        }
        problem.gauge *= GAUGE;
        problem.tolerance = ROUGHLY.max(fair.tolerance);
        let tolerance = fair.tolerance;
        Fenced { k, limits, fences, stretch, discs: None, ready, free, outcome, rounds: 0, has_ended: false, tolerance }
    }

    /// Whether all multipliers are known well enough for a descent to the method's tolerance.
    fn is_settled(&self) -> bool {
        self.fences.is_settled()
            && self.stretch.is_none_or(|stretch| stretch.violation() <= ENOUGH * MARGIN)
            && self.discs.as_ref().is_none_or(Discs::is_settled)
    }

    /// Whether rounds do not lead nearer to the limits any more.
    fn is_given_up(&self) -> bool {
        self.fences.is_given_up() || self.stretch.is_some_and(|stretch| stretch.is_given_up())
    }

    /// Records a round, and makes the curve ready for the next one.
    fn take(&mut self, outcome: Outcome<D>) {
        self.rounds += 1;
        let problem = &mut self.ready.problem;
        let exact = self.tolerance.max(self.fences.rounding(problem));
        let (standing, was_exact) = (outcome.standing, problem.tolerance <= exact);
        problem.rebase(&outcome.displacements);
        let of_discs = if self.discs.is_some() { problem.energy_of_holds() } else { 0.0 };
        let of_length = self.stretch.map_or(0.0, |stretch| stretch.weight() * problem.length());
        let energy = outcome.energy - problem.energy_of_fences() - of_discs - of_length;
        let outcome = Outcome { energy, ..outcome };
        match &mut self.outcome {
            Some(own) => own.go_on(outcome),
            None => self.outcome = Some(outcome),
        }
        if !matches!(standing, Standing::Converged | Standing::Exhausted | Standing::Stalled) {
            self.has_ended = true;
            return;
        }
        self.fences.press(problem, &mut self.limits);
        let mut violation = self.fences.violation();
        if let Some(stretch) = &mut self.stretch {
            stretch.press(problem);
            violation = violation.max(stretch.violation());
        }
        if let Some(discs) = &mut self.discs {
            discs.press(problem);
            violation = violation.max(discs.violation());
        }
        let is_settled = self.is_settled();
        self.has_ended = is_settled && was_exact || self.is_given_up() || self.rounds == MOST_ROUNDS;
        let problem = &mut self.ready.problem;
        let of_violation = OF_VIOLATION * (energy / problem.base.len() as f64).sqrt() * violation.min(1.0);
        let exact = self.tolerance.max(self.fences.rounding(problem));
        problem.tolerance = if is_settled { 0.0 } else { of_violation.min(ROUGHLY) }.max(exact);
    }

    /// How the rounds ended, with all their descents.
    fn ended(&mut self) -> (Outcome<D>, Ending) {
        let mut outcome = self.outcome.take().expect("it has ended");
        let keeps = self.ready.problem.worst(&self.limits).is_none_or(|worst| worst.excess <= 0.0);
        let ending = match (self.is_given_up(), self.is_settled() && keeps) {
            (true, _) => Ending::GivenUp,
            (_, true) => Ending::Kept,
            _ => Ending::Unsettled,
        };
        if ending == Ending::GivenUp {
            outcome.standing = Standing::Converged;
        }
        (outcome, ending)
    }
}

/// The rounds of all curves of a batch.
struct Running<'a> {
    fair: &'a Fair,
    batch: &'a CurveBatch,
    device: &'a Device,
}

impl Running<'_> {
    /// What came of a curve whose rounds ended, after it descended without limits, and whether that is the last word.
    fn ended<const D: usize>(
        &self,
        fenced: &mut Fenced<D>,
        free: &Outcome<D>,
        start: std::result::Result<&Ready<D>, &Unfitted>,
        i: usize,
    ) -> ((Outcome<D>, Kept), bool) {
        let start = start.expect("it was ready");
        let (outcome, ending) = fenced.ended();
        let own =
            Kept::of(self.fair, self.batch, &fenced.ready, &fenced.limits, i, [outcome.energy, fenced.free], ending);
        let mut without = start.clone();
        if fenced.limits.walls.is_some() {
            without.place();
        }
        without.problem.ways = fenced.ready.problem.ways;
        without.problem.rebase(&free.displacements);
        let without = Kept::of(self.fair, self.batch, &without, &fenced.limits, i, [fenced.free; 2], Ending::Loops);
        // A way around a region may be as long as it likes.
        let has_no_regions = fenced.limits.walls.as_ref().is_none_or(Walls::has_sides_alone);
        let is_longer = has_no_regions && own.report.stretch > LOOPS * without.report.stretch;
        let is_good = ending != Ending::Unsettled && outcome.standing == Standing::Converged;
        let mut within = free.clone();
        within.go_on(outcome);
        // One that keeps to its side of neighbours must not go back across them.
        let has_sides = fenced.limits.walls.as_ref().is_some_and(Walls::has_sides);
        let crosses = D == 2 && !has_sides && !start.tangled(&within).is_empty() && start.tangled(free).is_empty();
        if (is_longer || crosses) && !fenced.ready.problem.has_tangents {
            return ((Outcome { iterations: within.iterations, ..free.clone() }, without), false);
        }
        ((within, own), is_good)
    }

    /// Runs rounds until every curve has ended. `energy` is that without fences.
    ///
    /// Returns whether the CPU did any.
    fn run<const D: usize>(
        &self,
        energy: &Energy,
        mut running: Vec<Fenced<D>>,
        mut ended: impl FnMut(Fenced<D>),
    ) -> Result<bool> {
        let mut on_cpu = false;
        let fencing = self.fair.limits.fencing(running.iter().map(|fenced| &fenced.limits));
        let fencing = Fencing { in_surface: self.fair.surface.is_some(), ..fencing };
        let energy = energy.fenced(fencing);
        for fenced in &mut running {
            fenced.ready.problem.weights.resize(energy.terms().len(), 1.0);
        }
        while !running.is_empty() {
            // All curves of a descent have the same cap of iterations. Those whose limits are not settled go first.
            let is_settling = running.iter().any(|fenced| !fenced.is_settled());
            let (mut now, later): (Vec<_>, Vec<_>) =
                running.into_iter().partition(|fenced| !is_settling || !fenced.is_settled());
            running = later;
            let most =
                if is_settling { self.fair.max_iterations.min(ROUND_ITERATIONS) } else { self.fair.max_iterations };
            let fair = Fair { max_iterations: most, energy: energy.clone(), ..self.fair.clone() };
            // They are lent, and not copied.
            let lent = |fenced: &mut Fenced<D>| {
                let mut problem = std::mem::take(&mut fenced.ready.problem);
                if fencing.stretch
                    && let Some(weight) = problem.weights.last_mut()
                {
                    *weight = fenced.stretch.map_or(0.0, |stretch| stretch.weight());
                }
                Ok(Ready { problem, vertices: vec![], given: vec![], rows: fenced.ready.rows.clone(), ..fenced.ready })
            };
            let mut trials: Vec<Result<Ready<D>, Unfitted>> = now.iter_mut().map(lent).collect();
            let (outcomes, did) = fair.descend(&mut trials, self.device, &|_, _| {})?;
            on_cpu |= !did.is_gpu;
            for ((mut fenced, trial), outcome) in now.into_iter().zip(trials.into_iter().flatten()).zip(outcomes) {
                fenced.ready.problem = trial.problem;
                fenced.take(outcome);
                if fenced.has_ended { ended(fenced) } else { running.push(fenced) }
            }
        }
        Ok(on_cpu)
    }
}

/// Fits curves again that break their limits, so that they keep them, and says how each does that is ready.
///
/// `found` are the curves without limits, of which these are fitted, by their numbers among those that are ready; `partings`
/// are between neighbours. `None` stands for a curve that has no limits, or is not fitted.
pub(super) fn keep<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    found: &mut Descended<D>,
    mut left: Vec<usize>,
    partings: &Partings,
    start: Start,
    device: &Device,
) -> Result<Vec<Option<Kept>>> {
    let all = Running { fair, batch, device };
    let numbers: Vec<usize> = (0..found.ready.len()).filter(|&i| found.ready[i].is_ok()).collect();
    let mut kept: Vec<Option<Kept>> = (0..numbers.len()).map(|_| None).collect();
    // What came of the first go of curves that go once more.
    let mut before: BTreeMap<usize, (Outcome<D>, Kept)> = BTreeMap::new();
    let mut on_cpu = false;
    let mut firsts = FIRSTS;
    if start == Start::WithinLimits {
        firsts.reverse();
    }
    for first in firsts {
        let mut running: Vec<Fenced<D>> = Vec::new();
        for k in std::mem::take(&mut left) {
            let (i, outcome) = (numbers[k], &mut found.outcomes[k]);
            let mut own = found.ready[i].clone().expect("these are ready");
            let mut limits = fair.limits.of(batch, i, partings.of(i), &mut own);
            let has_converged = outcome.standing == Standing::Converged;
            if has_converged {
                own.problem.rebase(&outcome.displacements);
            }
            limits.measure(&own.problem);
            let Some(worst) = own.problem.worst(&limits) else { continue };
            let mut energies = [outcome.energy; 2];
            if has_converged && worst.excess <= 0.0 {
                kept[k] = Some(Kept::of(fair, batch, &own, &limits, i, energies, Ending::Kept));
                continue;
            }
            if !has_converged {
                // It starts from where the curve without limits did.
                outcome.displacements.fill([0.0; D]);
                energies = [own.problem.energy_of_base(&fair.energy), f64::NAN];
            }
            running.push(Fenced::new(k, limits, own, energies, first, fair));
        }
        on_cpu |= all.run(&fair.energy, running, |mut fenced| {
            let (k, i) = (fenced.k, numbers[fenced.k]);
            let (mut now, is_good) = all.ended(&mut fenced, &found.outcomes[k], found.ready[i].as_ref(), i);
            match before.remove(&k) {
                None if !is_good => {
                    before.insert(k, now);
                    left.push(k);
                    return;
                }
                None => {}
                Some(mut first) => {
                    let iterations = first.0.iterations + now.0.iterations - found.outcomes[k].iterations;
                    first.0.iterations = iterations;
                    now.0.iterations = iterations;
                    now = if is_good { now } else { first };
                }
            }
            let (outcome, own) = now;
            (found.outcomes[k], kept[k]) = (outcome, Some(own));
        })?;
    }
    if found.device.is_gpu && on_cpu {
        found.device.finished_on_cpu = found.outcomes.iter().filter(|outcome| outcome.on_cpu).count();
    }
    Ok(kept)
}

/// [`keep`] for curves within a deviation, which stay in their discs as they come to keep their limits.
///
/// `held` has the energy with which they descend.
pub(super) fn keep_within<const D: usize>(
    fair: &Fair,
    held: &Fair,
    batch: &CurveBatch,
    found: Vec<(Discs<D>, Ready<D>)>,
    partings: &Partings,
    device: &Device,
) -> Result<Vec<(Discs<D>, Ready<D>, Option<Kept>)>> {
    let all = Running { fair, batch, device };
    let (mut done, mut running) = (Vec::with_capacity(found.len()), Vec::new());
    for (k, (discs, mut ready)) in found.into_iter().enumerate() {
        let (i, outcome) = (discs.curve(), discs.outcome());
        let mut limits = fair.limits.of(batch, i, partings.of(i), &mut ready);
        for (place, u) in ready.problem.places.iter_mut().zip(&outcome.displacements) {
            *place = add(*place, *u);
        }
        limits.measure(&ready.problem);
        let has_converged = outcome.standing == Standing::Converged && discs.is_settled();
        let free = if has_converged { outcome.energy } else { f64::NAN };
        match ready.problem.worst(&limits) {
            Some(worst) if !has_converged || worst.excess > 0.0 => {
                let energy = if has_converged { free } else { ready.problem.energy_of_base(&held.energy) };
                running
                    .push(Fenced { discs: Some(discs), ..Fenced::new(k, limits, ready, [energy, free], FIRST, fair) });
            }
            worst => {
                let kept = worst.map(|_| Kept::of(fair, batch, &ready, &limits, i, [outcome.energy; 2], Ending::Kept));
                done.push((discs, ready, kept));
            }
        }
    }
    all.run(&held.energy, running, |mut fenced| {
        let (outcome, ending) = fenced.ended();
        let mut discs = fenced.discs.take().expect("these stay in discs");
        let energies = [outcome.energy, fenced.free];
        let kept = Kept::of(fair, batch, &fenced.ready, &fenced.limits, discs.curve(), energies, ending);
        discs.go_on(outcome);
        done.push((discs, fenced.ready, Some(kept)));
    })?;
    Ok(done)
}
