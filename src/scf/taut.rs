//! Curves under tension: the search for their directions.
//!
//! On a GPU the kernel searches, and the host ends the search in f64: it finds every span by itself where the
//! kernel left it, and takes the last step, if there is one to take. What the kernel did not bring to an end is
//! searched again by the CPU, from the start.

use super::curves::Chain;
use super::dots::{Dots, Exponents};
use super::evaluation::Evaluation;
use super::gpu::taut::{TautSearch, search_taut_on_gpu};
use super::slopes::{Outcome, Search, SlopesProblem, SlopesStanding, Until};
use super::smooth::Smooth;
use super::stages::{Found, problems, search};
use super::tension::{Near, TensionSpan};
use crate::device::Device;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::parallel;
use crate::precision::Precision;

impl Smooth {
    /// Finds the slopes of all curves under tension, and lays their segments.
    ///
    /// # Errors
    /// Those of the device.
    pub(super) fn search_under_tension<'a>(
        &self,
        dots: &[&'a Dots],
        exponents: &Exponents,
        device: &Device,
        until: &Until,
        lay: impl Fn((Found, &&'a Dots)) -> (Found, Option<Chain>) + Sync,
    ) -> Result<Vec<(Found, Option<Chain>)>> {
        let end = |found: Found, dots: &&'a Dots| {
            let is_ended = [SlopesStanding::Converged, SlopesStanding::Running].contains(&found.standing);
            let found = if is_ended { found } else { self.search_loosening(dots, exponents, until, found) };
            device.finished(1);
            lay((found, dots))
        };
        if let Some(gpu) = device.as_gpu() {
            let precision = device.kernel_precision(gpu, true)?;
            let found = search(&self.where_to_start(), dots, exponents, &mut |dots, exponents, directions| {
                search_taut_on_device(gpu, precision, dots, exponents, directions, until)
            })?;
            return Ok(parallel::of(found.into_iter().zip(dots), |(found, dots)| end(found, dots)));
        }
        let of_one = |dots: &&'a Dots| {
            let found = search(&self.where_to_start(), &[*dots], exponents, &mut |dots, exponents, directions| {
                let all = dots.iter().zip(directions);
                Ok(all.map(|(dots, directions)| Taut::new(dots, exponents, directions).search(until, true)).collect())
            });
            end(found.map(|mut found| found.remove(0)).expect("searches on the CPU do not fail"), dots)
        };
        Ok(parallel::of(dots.iter(), of_one))
    }

    /// From larger tensions, each from where the last one ended.
    fn search_loosening(&self, dots: &Dots, exponents: &Exponents, until: &Until, found: Found) -> Found {
        let mut directions = dots.directions(self.start);
        let mut best = found;
        for times in LOOSENING {
            let again = Taut::new(dots, &exponents.tightened(times), directions.clone()).search(until, true);
            if let Some(reached) = &again.directions {
                directions.clone_from(reached);
            }
            if times == 1.0 {
                best = best.or(Found { on_cpu: true, ..again });
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
pub(super) const ROUGHLY: f64 = 1e-3;

/// The largest decrement that a curve may have in f64 where a kernel in f64, or in f32, has left it, be it that no step led
/// further down: where it is larger, the kernel is lost, or what it followed are other spans than these directions
/// have by themselves.
const NEAR: f64 = 1e-6;
const NEAR_NARROW: f64 = 1e-2;

/// Costs of a span that differ by more than this part are those of two curves.
const AGREEMENT: f64 = 1e-10;

/// One search a curve on a GPU, from given directions.
///
/// # Errors
/// As [`search_taut_on_gpu`].
fn search_taut_on_device(
    gpu: &Gpu,
    precision: Precision,
    dots: &[&Dots],
    exponents: &Exponents,
    directions: Vec<Vec<f64>>,
    until: &Until,
) -> Result<Vec<Found>> {
    let given: Vec<(&&Dots, Vec<f64>)> = dots.iter().zip(directions).collect();
    let curves: Vec<Taut> = parallel::of(given, |(dots, directions)| Taut::new(dots, exponents, directions));
    let starts = parallel::of(&curves, |curve| {
        let start = curve.start();
        start.is_for_kernel(&exponents.laws, precision).then_some(start)
    });
    let is_for_kernel: Vec<bool> = starts.iter().map(Option::is_some).collect();
    let searches: Vec<TautSearch> = starts.into_iter().flatten().collect();
    let (left, _) = search_taut_on_gpu(gpu, precision, &exponents.laws, &searches, until)?;
    let mut left = left.into_iter();
    let left: Vec<Option<Outcome>> = is_for_kernel.iter().map(|&is| is.then(|| left.next()).flatten()).collect();
    Ok(parallel::of(curves.iter().zip(left), |(curve, left)| {
        let ended = left.and_then(|left| curve.ended(left, precision, until));
        ended.unwrap_or_else(|| Found { on_cpu: true, ..curve.search(until, true) })
    }))
}

/// A curve under tension, and where its search starts.
struct Taut<'a> {
    exponents: &'a Exponents,
    directions: Vec<f64>,
    spans: Vec<TensionSpan>,
    problem: SlopesProblem<f64>,
    /// The logarithm of what its costs are divided by.
    scale: f64,
}

impl<'a> Taut<'a> {
    fn new(dots: &Dots, exponents: &'a Exponents, directions: Vec<f64>) -> Self {
        let spans = dots.tension_spans(&directions, exponents);
        let (mut problems, scales) = problems(&[dots], exponents, std::slice::from_ref(&directions));
        let (problem, _) = problems.remove(0);
        Taut { exponents, directions, spans, problem, scale: scales[0] }
    }

    /// The spans at some turns, followed from what is known of them, or looked for anew.
    fn at(&self, turns: &[f64], known: &mut [Near], follow: bool) -> Vec<Evaluation<f64>> {
        let evaluate = |(k, known): (usize, &mut Near)| {
            let span = &self.problem.spans[k];
            let [a, b] = span.angles;
            if !follow {
                *known = Near::default();
            }
            let law = &self.exponents.laws[usize::from(span.curve)];
            self.spans[k].evaluate(law, [a + turns[k], b + turns[self.problem.after(k)]], known)
        };
        known.iter_mut().enumerate().map(evaluate).collect()
    }

    /// The stage in which each dot is let loose, of what the spans are at the start, and how many there are.
    ///
    /// With ν = 20 a short span costs 10¹⁹ times as much as one ten times as long: the dots are let
    /// loose from the dearest spans down.
    fn stages(&self, found: &[Evaluation<f64>]) -> (Vec<usize>, usize) {
        // How dear a span is at its start; one that does not exist there is let loose at once.
        let cost = |(found, weight): (&Evaluation<f64>, f64)| {
            if found.exists > 0.0 { weight * found.cost } else { f64::INFINITY }
        };
        let costs: Vec<f64> = found.iter().zip(self.problem.spans.iter().map(|span| span.weight)).map(cost).collect();
        let dearest = costs.iter().copied().filter(|cost| cost.is_finite()).fold(0.0, f64::max);
        let level = |cost: f64| {
            if cost >= dearest { 0 } else { ((cost / dearest).ln() / LEVEL.ln()).min(LEVELS as f64) as usize }
        };
        let mut levels = vec![LEVELS; self.directions.len()];
        for (k, &cost) in costs.iter().enumerate() {
            for dot in [k, self.problem.after(k)] {
                levels[dot] = levels[dot].min(level(cost));
            }
        }
        let mut stages: Vec<usize> = levels.clone();
        stages.sort_unstable();
        stages.dedup();
        (levels.iter().map(|level| stages.partition_point(|own| own < level)).collect(), stages.len())
    }

    /// What the kernel is to search.
    fn start(&self) -> TautSearch {
        let mut known = vec![Near::default(); self.spans.len()];
        let found = self.at(&vec![0.0; self.directions.len()], &mut known, true);
        let (stages, count) = self.stages(&found);
        TautSearch { problem: self.problem.clone(), spans: self.spans.clone(), known, found, stages, count }
    }

    /// One search on the CPU.
    ///
    /// Spans are followed from trial to trial (`follow`), which is ten times as quick as to look for each anew.
    fn search(&self, until: &Until, follow: bool) -> Found {
        let mut known = vec![Near::default(); self.spans.len()];
        let mut turns = vec![0.0; self.directions.len()];
        let found = self.at(&turns, &mut known, follow);
        let (stages, count) = self.stages(&found);
        let (mut iterations, mut evaluations) = (0, 1);
        for stage in 0..count {
            let last = stage + 1 == count;
            let mut problem = self.problem.clone();
            for (movable, &own) in problem.movable.iter_mut().zip(&stages) {
                *movable = if own <= stage { *movable } else { 0.0 };
            }
            let own = Until {
                tolerance: if last { until.tolerance } else { until.tolerance.max(ROUGHLY) },
                iterations: until.iterations.saturating_sub(iterations),
            };
            let mut search = Search::new(problem, turns.clone()).by_span();
            while search.standing == SlopesStanding::Running {
                let found = self.at(&search.trial, &mut known, follow);
                search.receive(&found, &own);
            }
            iterations += search.iterations;
            evaluations += search.evaluations;
            turns.clone_from(&search.turns);
            if last {
                if follow && self.differs(&turns, &mut known) {
                    let again = self.search(until, false);
                    let (iterations, evaluations) = (again.iterations + iterations, again.evaluations + evaluations);
                    return Found { iterations, evaluations, ..again };
                }
                let outcome = Outcome { iterations, evaluations, ..Outcome::from(search) };
                return Found { known, ..Found::of(outcome, self.scale, self.directions.clone()) };
            }
        }
        unreachable!("a curve has a dot, and so a last stage")
    }

    /// Whether what was followed from trial to trial is not what these directions have by themselves.
    fn differs(&self, turns: &[f64], known: &mut [Near]) -> bool {
        let (followed, alone) =
            (self.at(turns, known, true), self.at(turns, &mut vec![Near::default(); known.len()], true));
        let differ = |(one, other): (&Evaluation<f64>, &Evaluation<f64>)| {
            other.exists > 0.0 && (one.cost - other.cost).abs() > AGREEMENT * other.cost
        };
        followed.iter().zip(&alone).any(differ)
    }

    /// The end, in f64, of a search that a kernel has led near it, if it has, on spans that its directions have by
    /// themselves.
    fn ended(&self, left: Outcome, precision: Precision, until: &Until) -> Option<Found> {
        if left.standing == SlopesStanding::Running {
            // The device was lost.
            return Some(Found::of(left, self.scale, self.directions.clone()));
        }
        if [SlopesStanding::Nowhere, SlopesStanding::Exhausted].contains(&left.standing) {
            return None;
        }
        let own = Until { iterations: until.iterations.saturating_sub(left.iterations), ..*until };
        let mut known = vec![Near::default(); self.spans.len()];
        let mut search = Search::new(self.problem.clone(), left.turns.clone()).by_span();
        let found = self.at(&search.trial, &mut known, true);
        search.receive(&found, &own);
        let least = if precision == Precision::F64 { NEAR } else { NEAR_NARROW };
        if search.decrement.is_nan() || search.decrement > least.max(2.0 * until.tolerance) {
            return None;
        }
        while search.standing == SlopesStanding::Running {
            let found = self.at(&search.trial, &mut known, true);
            search.receive(&found, &own);
        }
        let is_moved = search.iterations > 0;
        if search.standing != SlopesStanding::Converged || (is_moved && self.differs(&search.turns.clone(), &mut known))
        {
            return None;
        }
        let (iterations, evaluations) = (left.iterations + search.iterations, left.evaluations + search.evaluations);
        let outcome = Outcome { iterations, evaluations, ..Outcome::from(search) };
        Some(Found { known, ..Found::of(outcome, self.scale, self.directions.clone()) })
    }
}
