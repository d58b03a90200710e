//! Curves under tension: the search for their directions, on the CPU.

use super::curves::Chain;
use super::dots::{Dots, Exponents};
use super::evaluation::Evaluation;
use super::slopes::{Outcome, Search, SlopesStanding, Until};
use super::smooth::Smooth;
use super::stages::{Found, problems, search};
use super::tension::Near;
use crate::device::Device;
use crate::parallel;

impl Smooth {
    /// Finds the slopes of all curves under tension, and lays their segments.
    pub(super) fn search_under_tension<'a>(
        &self,
        dots: &[&'a Dots],
        exponents: &Exponents,
        device: &Device,
        until: &Until,
        lay: impl Fn((Found, &&'a Dots)) -> (Found, Option<Chain>) + Sync,
    ) -> Vec<(Found, Option<Chain>)> {
        let of_one = |dots: &&'a Dots| {
            let found = search(&self.where_to_start(), &[*dots], exponents, &mut |dots, exponents, directions| {
                let all = dots.iter().zip(directions);
                Ok(all.map(|(dots, directions)| search_taut(dots, exponents, directions, until, true)).collect())
            });
            let found = found.map(|mut found| found.remove(0)).expect("searches on the CPU do not fail");
            let found = if found.standing == SlopesStanding::Converged {
                found
            } else {
                self.search_loosening(dots, exponents, until, found)
            };
            device.finished(1);
            lay((found, dots))
        };
        parallel::of(dots.iter(), of_one)
    }

    /// From larger tensions, each from where the last one ended.
    fn search_loosening(&self, dots: &Dots, exponents: &Exponents, until: &Until, found: Found) -> Found {
        let mut directions = dots.directions(self.start);
        let mut best = found;
        for times in LOOSENING {
            let again = search_taut(dots, &exponents.tightened(times), directions.clone(), until, true);
            if let Some(reached) = &again.directions {
                directions.clone_from(reached);
            }
            if times == 1.0 {
                best = best.or(again);
            } else {
                best.iterations += again.iterations;
                best.evaluations += again.evaluations;
            }
        }
        best
    }
}

/// Where a search fails, it goes on from tensions so many times as large.
const LOOSENING: [f64; 5] = [4.0, 2.0, 1.4, 1.1, 1.0];

/// Spans that cost less than this part of the dearest wait for those: beside them they weigh
/// nothing, and their directions would wander.
const LEVEL: f64 = 1e-4;

/// Levels of cost that are searched one after the other; all that is cheaper is one more.
const LEVELS: usize = 20;

/// The decrement at which a level gives way to the next.
const ROUGHLY: f64 = 1e-3;

/// Costs of a span that differ by more than this part are those of two curves.
const AGREEMENT: f64 = 1e-10;

/// One search of a curve, from given directions.
///
/// With ν = 20 a short span costs 10¹⁹ times as much as one ten times as long: the dots are let
/// loose from the dearest spans down.
///
/// Spans are followed from trial to trial (`follow`), which is ten times as quick as to look for each anew.
fn search_taut(dots: &Dots, exponents: &Exponents, directions: Vec<f64>, until: &Until, follow: bool) -> Found {
    let spans = dots.tension_spans(&directions, exponents);
    let (mut problems, scales) = problems(&[dots], exponents, std::slice::from_ref(&directions));
    let (problem, mut turns) = problems.remove(0);
    let at = |turns: &[f64], known: &mut [Near]| -> Vec<Evaluation<f64>> {
        let evaluate = |(k, known): (usize, &mut Near)| {
            let law = &exponents.laws[problem.spans[k].curve as usize];
            let [a, b] = problem.spans[k].angles;
            if !follow {
                *known = Near::default();
            }
            spans[k].evaluate(law, [a + turns[k], b + turns[problem.after(k)]], known)
        };
        known.iter_mut().enumerate().map(evaluate).collect()
    };
    let mut known = vec![Near::default(); spans.len()];
    // How dear a span is at its start; one that does not exist there is let loose at once.
    let costs: Vec<f64> = at(&turns, &mut known)
        .iter()
        .zip(&problem.spans)
        .map(|(found, span)| if found.exists > 0.0 { span.weight * found.cost } else { f64::INFINITY })
        .collect();
    let dearest = costs.iter().copied().filter(|cost| cost.is_finite()).fold(0.0, f64::max);
    let level =
        |cost: f64| if cost >= dearest { 0 } else { ((cost / dearest).ln() / LEVEL.ln()).min(LEVELS as f64) as usize };
    let mut levels = vec![LEVELS; turns.len()];
    for (k, &cost) in costs.iter().enumerate() {
        for dot in [k, problem.after(k)] {
            levels[dot] = levels[dot].min(level(cost));
        }
    }
    let mut stages: Vec<usize> = levels.clone();
    stages.sort_unstable();
    stages.dedup();
    let (mut iterations, mut evaluations) = (0, 1);
    for (number, &stage) in stages.iter().enumerate() {
        let last = number + 1 == stages.len();
        let mut problem = problem.clone();
        for (movable, &level) in problem.movable.iter_mut().zip(&levels) {
            *movable = if level <= stage { *movable } else { 0.0 };
        }
        let own = Until {
            tolerance: if last { until.tolerance } else { until.tolerance.max(ROUGHLY) },
            iterations: until.iterations.saturating_sub(iterations),
        };
        let mut search = Search::new(problem, turns.clone()).by_span();
        while search.standing == SlopesStanding::Running {
            let found = at(&search.trial, &mut known);
            search.receive(&found, &own);
        }
        iterations += search.iterations;
        evaluations += search.evaluations;
        turns.clone_from(&search.turns);
        if last {
            // What was followed from trial to trial must be what these directions have by themselves.
            let (followed, alone) = (at(&turns, &mut known), at(&turns, &mut vec![Near::default(); spans.len()]));
            let differ = |(one, other): (&Evaluation<f64>, &Evaluation<f64>)| {
                other.exists > 0.0 && (one.cost - other.cost).abs() > AGREEMENT * other.cost
            };
            if follow && followed.iter().zip(&alone).any(differ) {
                let again = search_taut(dots, exponents, directions, until, false);
                let (iterations, evaluations) = (again.iterations + iterations, again.evaluations + evaluations);
                return Found { iterations, evaluations, ..again };
            }
            let outcome = Outcome { iterations, evaluations, ..Outcome::from(search) };
            return Found { known, ..Found::of(outcome, scales[0], directions) };
        }
    }
    unreachable!("a curve has a dot, and so a last stage")
}
