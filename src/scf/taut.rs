//! Searches for the tangent angles of curves under tension.
//!
//! On a GPU the kernel searches, and the host completes the search in f64. It finds every span
//! independently where the kernel ended, and takes the last step if one is left. Curves that the
//! kernel did not complete are searched again by the CPU, from the start.

use super::curves::Chain;
use super::dots::{Dots, Exponents};
use super::evaluation::Evaluation;
use super::family::{Family, SlopesSearch};
use super::gpu::search::search_on_gpu;
use super::problem::{Outcome, SlopesStanding, Stages, Until};
use super::slopes::Search;
use super::stages::{Found, Starts, search};
use super::start::Start;
use super::tension::Near;
use crate::device::Device;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::parallel;
use crate::precision::Precision;

/// Finds the tangent angles of all curves under tension, and places their segments.
///
/// # Errors
/// Errors of the device.
pub(super) fn search_under_tension<'a>(
    starts: &Starts,
    dots: &[&'a Dots],
    exponents: &Exponents,
    device: &Device,
    until: &Until,
    lay: impl Fn((Found, &&'a Dots)) -> (Found, Option<Chain>) + Sync,
) -> Result<Vec<(Found, Option<Chain>)>> {
    let end = |found: Found, dots: &&'a Dots| {
        let is_ended = [SlopesStanding::Converged, SlopesStanding::Running].contains(&found.standing);
        let found = if is_ended { found } else { search_loosening(starts.first, dots, exponents, until, found) };
        device.finished(1);
        lay((found, dots))
    };
    if let Some(gpu) = device.as_gpu() {
        let precision = device.kernel_precision(gpu, true)?;
        let found = search(starts, dots, exponents, &mut |dots, exponents, directions| {
            search_taut_on_device(gpu, precision, dots, exponents, directions, until)
        })?;
        return Ok(parallel::of(found.into_iter().zip(dots), |(found, dots)| end(found, dots)));
    }
    let on_cpu = |dots: &&'a Dots| {
        let found = search(starts, &[*dots], exponents, &mut |dots, exponents, directions| {
            let curves = dots.iter().zip(directions);
            Ok(curves.map(|(dots, directions)| Taut::new(dots, exponents, directions).search(until)).collect())
        });
        end(found.map(|mut found| found.remove(0)).expect("searches on the CPU do not fail"), dots)
    };
    Ok(parallel::of(dots.iter(), on_cpu))
}

/// Searches with larger tensions first, each from the result of the last.
fn search_loosening(start: Start, dots: &Dots, exponents: &Exponents, until: &Until, found: Found) -> Found {
    let mut directions = dots.directions(start);
    let mut best = found;
    for times in LOOSENING {
        let again = Taut::new(dots, &exponents.tightened(times), directions.clone()).search(until);
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

/// The multiples of the tension with which a failed search continues.
const LOOSENING: [f64; 5] = [4.0, 2.0, 1.4, 1.1, 1.0];

/// The largest decrement in f64 at the end of a kernel's search, for kernels in f64 and in f32.
///
/// If it is larger, the kernel has failed, or it followed segments other than those that these
/// directions have.
const NEAR: f64 = 1e-6;
const NEAR_NARROW: f64 = 1e-2;

/// Costs of a span that differ by more than this fraction belong to two different curves.
const AGREEMENT: f64 = 1e-10;

/// One search per curve on a GPU from given directions.
///
/// # Errors
/// The errors of [`search_on_gpu`].
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
    let searches: Vec<&SlopesSearch> = curves.iter().map(|curve| &curve.search).collect();
    let family = Family::UnderTension(&exponents.laws);
    let (outcomes, answers) = search_on_gpu(gpu, precision, family, &searches, until)?;
    let mut trials = 0;
    for (curve, outcome) in curves.iter().zip(&outcomes) {
        trials += outcome.as_ref().map_or(0, |outcome| outcome.evaluations as usize * curve.search.spans.len());
    }
    if trials > 0 {
        gpu.note(format!("{trials} trials of spans under tension, {answers} of them found by the host"));
    }
    Ok(parallel::of(curves.iter().zip(outcomes), |(curve, outcome)| {
        let ended = outcome.and_then(|outcome| curve.ended(outcome, precision, until));
        ended.unwrap_or_else(|| Found { on_cpu: true, ..curve.search(until) })
    }))
}

/// A curve under tension, and the start of its search.
struct Taut<'a> {
    exponents: &'a Exponents,
    directions: Vec<f64>,
    search: SlopesSearch,
    /// The logarithm of the unit of its costs.
    scale: f64,
}

impl<'a> Taut<'a> {
    fn new(dots: &Dots, exponents: &'a Exponents, directions: Vec<f64>) -> Self {
        let spans = dots.tension_spans(&directions, exponents);
        let (problem, scale) = dots.problem(&directions, exponents);
        Taut { exponents, directions, search: SlopesSearch::under_tension(problem, spans, &exponents.laws), scale }
    }

    /// The result of a search on the CPU.
    ///
    /// Spans are followed from trial to trial, which is ten times as fast as finding each
    /// independently. If the followed spans turn out to be others, the search is repeated with
    /// independent ones.
    fn search(&self, until: &Until) -> Found {
        let (search, mut known) = self.run(until, true);
        if !self.differs(&search.turns, &mut known) {
            return self.found(search, known, [0, 0]);
        }
        let counted = [search.iterations, search.evaluations];
        let (search, known) = self.run(until, false);
        self.found(search, known, counted)
    }

    /// A search from the start. Spans are followed from trial to trial if `follow`, and otherwise
    /// found independently.
    fn run(&self, until: &Until, follow: bool) -> (Search, Vec<Near>) {
        let mut known = self.search.known.clone();
        let mut search = Search::new(self.search.problem.clone()).by_span(self.search.stages.clone());
        while search.standing == SlopesStanding::Running {
            if !follow {
                known.fill(Near::default());
            }
            search.receive(&self.at(&search.trial, &mut known), until);
        }
        (search, known)
    }

    /// The spans at these turns, following the known shapes.
    fn at(&self, turns: &[f64], known: &mut [Near]) -> Vec<Evaluation<f64>> {
        self.search.evaluate(&self.exponents.laws, turns, known)
    }

    /// Whether the followed spans differ from those that these directions have independently.
    fn differs(&self, turns: &[f64], known: &mut [Near]) -> bool {
        let followed = self.at(turns, known);
        let alone = self.at(turns, &mut vec![Near::default(); known.len()]);
        followed
            .iter()
            .zip(&alone)
            .any(|(followed, alone)| alone.exists > 0.0 && (followed.cost - alone.cost).abs() > AGREEMENT * alone.cost)
    }

    /// The result of a search. It also counts the given iterations and evaluations.
    fn found(&self, search: Search, known: Vec<Near>, [iterations, evaluations]: [u32; 2]) -> Found {
        let mut outcome = Outcome::from(search);
        outcome.iterations += iterations;
        outcome.evaluations += evaluations;
        Found { known, ..Found::of(outcome, self.scale, self.directions.clone()) }
    }

    /// Completes, in f64, a search that a kernel brought near its end. `None` if it did not, or if
    /// its spans are not those that the directions have independently.
    fn ended(&self, outcome: Outcome, precision: Precision, until: &Until) -> Option<Found> {
        match outcome.standing {
            // The device was lost.
            SlopesStanding::Running => return Some(Found::of(outcome, self.scale, self.directions.clone())),
            SlopesStanding::Nowhere | SlopesStanding::Exhausted => return None,
            _ => {}
        }
        let until = Until { iterations: until.iterations.saturating_sub(outcome.iterations), ..*until };
        let mut known = vec![Near::default(); self.search.spans.len()];
        let mut search = Search::new(self.search.problem.clone()).turned(outcome.turns).by_span(Stages::default());
        search.receive(&self.at(&search.trial, &mut known), &until);
        let least = if precision == Precision::F64 { NEAR } else { NEAR_NARROW };
        if search.decrement.is_nan() || search.decrement > least.max(2.0 * until.tolerance) {
            return None;
        }
        while search.standing == SlopesStanding::Running {
            search.receive(&self.at(&search.trial, &mut known), &until);
        }
        let is_moved = search.iterations > 0;
        if search.standing != SlopesStanding::Converged || (is_moved && self.differs(&search.turns, &mut known)) {
            return None;
        }
        Some(self.found(search, known, [outcome.iterations, outcome.evaluations]))
    }
}
