//! Descents at the vertices first, and by [`angles`](super::angles) where those lead nowhere.

use std::collections::BTreeMap;

use super::angles::{Angles, Ending, Found};
use super::energy::Functional;
use super::lane::Standing;
use super::plan::{Direction, Plan, Step};
use super::problem::{Ended, Outcome, Problem};
use super::stages::Descender;
use crate::error::Result;
use crate::parallel;

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

impl Descender<'_> {
    /// Descends every curve at its vertices, and those by angles that may be and do not converge.
    ///
    /// What ends at a polygon that folds is [`Standing::Folded`].
    pub(super) fn descend_rough<const D: usize>(
        &self,
        problems: &[Problem<D>],
        ended: Ended<'_, D>,
    ) -> Result<Vec<Outcome<D>>> {
        let mut outcomes = self.descend_either_way(problems, ended)?;
        for (problem, outcome) in problems.iter().zip(&mut outcomes) {
            if self.is_folded(problem, outcome) {
                outcome.standing = Standing::Folded;
            }
        }
        Ok(outcomes)
    }

    /// Whether a curve has converged, or leads no further, at a polygon that folds, where variation is blind to its turn.
    fn is_folded<const D: usize>(&self, problem: &Problem<D>, outcome: &Outcome<D>) -> bool {
        let varies =
            |(weight, functional): &(f64, Functional)| *weight > 0.0 && matches!(functional, Functional::Variation(_));
        matches!(outcome.standing, Standing::Converged | Standing::Stalled)
            && self.energy.terms().iter().any(varies)
            && problem.folds(&outcome.displacements)
    }

    fn descend_either_way<const D: usize>(
        &self,
        problems: &[Problem<D>],
        ended: Ended<'_, D>,
    ) -> Result<Vec<Outcome<D>>> {
        let searches = self.plan.direction == Direction::Newton && self.plan.step == Step::Search;
        let of = |problem| if searches { Angles::of(self.energy, problem) } else { None };
        let angles: Vec<Option<Angles>> = problems.iter().map(of).collect();
        let (rough, plain): (Vec<usize>, Vec<usize>) = (0..problems.len()).partition(|&i| angles[i].is_some());
        if rough.is_empty() {
            return self.descend(problems, ended);
        }
        let most = self.plan.most_iterations;
        let mut outcomes: BTreeMap<usize, Outcome<D>> = BTreeMap::new();
        let own = plain.iter().map(|&i| problems[i].clone()).collect();
        outcomes.extend(self.descend_some(&plain, own, most, ended)?);
        let try_of = |&i: &usize| {
            let room = angles[i].as_ref().map_or(f64::INFINITY, |angles| ROOM * angles.chord());
            Problem { longest: problems[i].longest.min(room), ..problems[i].clone() }
        };
        let own = rough.iter().map(try_of).collect();
        let is_open = |i: usize, outcome: &Outcome<D>| outcome.is_open() || self.is_folded(&problems[i], outcome);
        outcomes.extend(self.descend_some(&rough, own, FIRST.min(most), &|i, outcome| {
            if !is_open(i, outcome) {
                ended(i, outcome);
            }
        })?);
        let is_near = |outcome: &Outcome<D>| outcome.standing == Standing::Exhausted && outcome.norm < SMALL;
        let near: Vec<usize> = rough.iter().copied().filter(|i| is_near(&outcomes[i])).collect();
        self.go_on(&near, SECOND.min(most).saturating_sub(FIRST), problems, &mut outcomes)?;
        near.iter().filter(|i| !is_open(**i, &outcomes[i])).for_each(|i| ended(*i, &outcomes[i]));
        let open: Vec<usize> = rough.into_iter().filter(|&i| is_open(i, &outcomes[&i])).collect();
        let open: Vec<(usize, Outcome<D>)> = open.iter().filter_map(|i| outcomes.remove_entry(i)).collect();
        let by_angles = |(i, tried): (usize, Outcome<D>)| {
            // LAST iterations are left for the vertices.
            let own = most.saturating_sub(tried.iterations).saturating_sub(LAST);
            let found = angles[i].as_ref().filter(|_| own > 0).map(|angles| angles.descend(&problems[i], own));
            (i, tried.and_then(found))
        };
        let mut found = Vec::new();
        // Where to go on, by the number of iterations that may be taken.
        let (mut further, mut unsure) = (BTreeMap::<u32, Vec<usize>>::new(), BTreeMap::<u32, Vec<usize>>::new());
        for (i, (outcome, ending)) in parallel::of(open, by_angles) {
            let left = most.saturating_sub(outcome.iterations);
            match ending {
                Ending::Found => {
                    found.push(i);
                    further.entry(LAST).or_default().push(i);
                }
                Ending::Failed => further.entry(left).or_default().push(i),
                Ending::Unbounded => {
                    unsure.entry(left.min(VERDICT.saturating_sub(outcome.iterations))).or_default().push(i);
                }
            }
            outcomes.insert(i, outcome);
        }
        // What LAST iterations do not finish has the others too.
        let goes_on = |outcome: &Outcome<D>| outcome.standing == Standing::Exhausted && outcome.iterations < most;
        for (own, which) in further {
            let mut again = BTreeMap::<u32, Vec<usize>>::new();
            self.go_on(&which, own, problems, &mut outcomes)?;
            for i in which {
                match &outcomes[&i] {
                    outcome if goes_on(outcome) => again.entry(most - outcome.iterations).or_default().push(i),
                    outcome => ended(i, outcome),
                }
            }
            for (own, which) in again {
                self.go_on(&which, own, problems, &mut outcomes)?;
                which.iter().for_each(|i| ended(*i, &outcomes[i]));
            }
        }
        self.go_on_regauged(&found, problems, &mut outcomes)?;
        // A minimum at the vertices, if there is one near, is worth more than a way down without end.
        for (own, which) in unsure {
            self.go_on(&which, own, problems, &mut outcomes)?;
            for i in which {
                if let Some(outcome) = outcomes.get_mut(&i).filter(|outcome| outcome.is_open()) {
                    outcome.standing = Standing::Unbounded;
                }
                ended(i, &outcomes[&i]);
            }
        }
        Ok(outcomes.into_values().collect())
    }

    /// Goes on with curves that stall where their angles led them, with a gauge for the spans that they have now.
    ///
    /// The gauge's weight falls with the fifth power of the edges' length: where a span has become ten times as long,
    /// the one set for the start is 10⁵ times too stiff. It is tried first all the same, since with 16 edges a span a
    /// softer one lets polygons fold. What folds already is left.
    fn go_on_regauged<const D: usize>(
        &self,
        found: &[usize],
        problems: &[Problem<D>],
        outcomes: &mut BTreeMap<usize, Outcome<D>>,
    ) -> Result<()> {
        // What runs away shows it soon, or is left.
        let most = |i: usize| if problems[i].longest.is_finite() { VERDICT } else { u32::MAX };
        let mut stalled = BTreeMap::<u32, Vec<usize>>::new();
        let stalls =
            |i: &usize| outcomes[i].standing == Standing::Stalled && !self.is_folded(&problems[*i], &outcomes[i]);
        for i in found.iter().filter(|i| stalls(i)) {
            let left = self.plan.most_iterations.min(most(*i)).saturating_sub(outcomes[i].iterations);
            if left > 0 {
                stalled.entry(left).or_default().push(*i);
            }
        }
        for (own, which) in stalled {
            let mut problems = rebased(&which, problems, outcomes);
            problems.iter_mut().for_each(|problem| problem.regauge());
            self.go_on_with(&which, problems, own, outcomes)?;
        }
        Ok(())
    }

    /// Descends curves from where they are in so many iterations at most.
    fn go_on<const D: usize>(
        &self,
        which: &[usize],
        most_iterations: u32,
        problems: &[Problem<D>],
        outcomes: &mut BTreeMap<usize, Outcome<D>>,
    ) -> Result<()> {
        self.go_on_with(which, rebased(which, problems, outcomes), most_iterations, outcomes)
    }

    fn go_on_with<const D: usize>(
        &self,
        which: &[usize],
        problems: Vec<Problem<D>>,
        most_iterations: u32,
        outcomes: &mut BTreeMap<usize, Outcome<D>>,
    ) -> Result<()> {
        for (i, after) in self.descend_some(which, problems, most_iterations, &|_, _| {})? {
            if let Some(outcome) = outcomes.get_mut(&i) {
                outcome.go_on(after);
            }
        }
        Ok(())
    }

    /// Descends curves in so many iterations at most, and returns them by their numbers.
    fn descend_some<const D: usize>(
        &self,
        which: &[usize],
        problems: Vec<Problem<D>>,
        most_iterations: u32,
        ended: Ended<'_, D>,
    ) -> Result<Vec<(usize, Outcome<D>)>> {
        if which.is_empty() {
            return Ok(Vec::new());
        }
        let own = Descender { plan: Plan { most_iterations, ..self.plan }, ..*self };
        let outcomes = own.descend(&problems, &|k, outcome| ended(which[k], outcome))?;
        Ok(which.iter().copied().zip(outcomes).collect())
    }
}

/// The problems of curves from where they are.
fn rebased<const D: usize>(
    which: &[usize],
    problems: &[Problem<D>],
    outcomes: &BTreeMap<usize, Outcome<D>>,
) -> Vec<Problem<D>> {
    let rebased = |i: &usize| {
        let mut problem = problems[*i].clone();
        problem.rebase(&outcomes[i].displacements);
        problem
    };
    which.iter().map(rebased).collect()
}

impl<const D: usize> Outcome<D> {
    /// Whether the descent may go on by other means.
    pub(super) fn is_open(&self) -> bool {
        matches!(self.standing, Standing::Exhausted | Standing::Stalled | Standing::Unbounded)
    }

    /// This descent and the one by angles after it, from the same start.
    ///
    /// What was not found leaves the curve as it was.
    fn and_then(self, found: Option<Found<D>>) -> (Outcome<D>, Ending) {
        let Some(found) = found else { return (self, Ending::Failed) };
        let (iterations, evaluations) = (self.iterations + found.iterations, self.evaluations + found.trials);
        let standing = if found.ending == Ending::Unbounded { Standing::Unbounded } else { self.standing };
        let displacements = if found.ending == Ending::Found { found.displacements } else { self.displacements };
        (Outcome { displacements, standing, iterations, evaluations, on_cpu: true, ..self }, found.ending)
    }
}

#[cfg(test)]
mod tests;
