//! Searches for the tangent angles of many curves, and the fallbacks if the first search fails.

use rand::rngs::ChaCha12Rng;
use rand::{RngExt, SeedableRng};

use super::dots::{Dots, Exponents};
use super::family::{Family, SlopesSearch};
use super::gpu::search::search_on_gpu;
use super::problem::{Outcome, SlopesProblem, SlopesStanding, Until};
use super::start::Start;
use super::tension::Near;
use super::universal::Universal;
use super::workspace::Workspace;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::precision::Precision;

/// If segments have no minimiser for the requested exponent, exponents at these fractions of the
/// way from 2 come first.
const STAGES: [f64; 4] = [0.0, 0.3, 0.6, 0.8];

/// The largest turn of a direction in random starts, in radians.
const SPREAD: f64 = 0.6;

/// The starts of a curve's searches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Starts {
    pub first: Start,
    /// The number of starts. All but the first are random.
    pub count: u32,
    pub seed: u64,
}

/// The result for a curve.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// The directions, NaN at free ends. `None` if no start had a minimiser.
    pub directions: Option<Vec<f64>>,
    /// The cost in units of the input.
    pub cost: f64,
    pub decrement: f64,
    pub standing: SlopesStanding,
    /// The iterations of all searches of the curve.
    pub iterations: u32,
    pub evaluations: u32,
    /// The first dot whose segment had no minimiser in the last failed trial.
    pub culprit: Option<usize>,
    /// The shapes of the spans under tension; empty without tension.
    pub known: Vec<Near>,
    /// Whether the CPU found it instead of a kernel.
    pub on_cpu: bool,
}

impl Found {
    /// Keeps the better of two results, and adds up their counts.
    pub(super) fn or(self, other: Found) -> Found {
        let (iterations, evaluations) = (self.iterations + other.iterations, self.evaluations + other.evaluations);
        let converged = |found: &Found| found.standing == SlopesStanding::Converged;
        let better = match (converged(&self), converged(&other)) {
            (true, false) => false,
            (false, true) => true,
            _ => other.directions.is_some() && (self.directions.is_none() || other.cost < self.cost),
        };
        Found { iterations, evaluations, ..if better { other } else { self } }
    }
}

/// One search per curve from given directions.
pub(crate) type SearchFrom<'a> = dyn FnMut(&[&Dots], &Exponents, Vec<Vec<f64>>) -> Result<Vec<Found>> + 'a;

/// Searches for the tangent angles of all curves.
///
/// # Errors
/// The errors of the searches.
pub(crate) fn search(
    starts: &Starts,
    dots: &[&Dots],
    exponents: &Exponents,
    search_from: &mut SearchFrom,
) -> Result<Vec<Found>> {
    let mut run = |which: &[usize], exponents: &Exponents, directions: Vec<Vec<f64>>| {
        let given: Vec<&Dots> = which.iter().map(|&i| dots[i]).collect();
        search_from(&given, exponents, directions)
    };
    let every: Vec<usize> = (0..dots.len()).collect();
    let from = |which: &[usize], start: Start| which.iter().map(|&i| dots[i].directions(start)).collect::<Vec<_>>();
    let mut found = run(&every, exponents, from(&every, starts.first))?;
    let failed = |found: &[Found]| {
        let failed = |&i: &usize| {
            found[i].standing != SlopesStanding::Converged && found[i].standing != SlopesStanding::Exhausted
        };
        (0..found.len()).filter(failed).collect::<Vec<_>>()
    };
    for start in [Start::Circle, Start::Neighbours, Start::Bisector] {
        let which = failed(&found);
        if start == starts.first || which.is_empty() {
            continue;
        }
        let again = run(&which, exponents, from(&which, start))?;
        merge(&mut found, &which, again);
    }
    // By exponents between 2 and the requested ones, each from the result of the last.
    let which = failed(&found);
    if !which.is_empty() && exponents.are_far_from_two() {
        let mut directions = from(&which, starts.first);
        for part in STAGES.into_iter().chain([1.0]) {
            let last = part == 1.0;
            let stage = if last { exponents.clone() } else { exponents.towards(part) };
            let again = run(&which, &stage, directions.clone())?;
            for (directions, found) in directions.iter_mut().zip(&again) {
                if let Some(reached) = &found.directions {
                    directions.clone_from(reached);
                }
            }
            if last {
                merge(&mut found, &which, again);
            }
        }
    }
    for number in 1..starts.count {
        // The seed depends on the start, not on the curve, so a curve's bits do not depend on its
        // place in the batch.
        let random = |i: &usize| {
            let mut random = ChaCha12Rng::seed_from_u64(starts.seed.wrapping_add(u64::from(number)));
            let turn = |direction: f64| direction + random.random_range(-SPREAD..=SPREAD);
            let mut directions: Vec<f64> = dots[*i].directions(starts.first).into_iter().map(turn).collect();
            for (direction, fixed) in directions.iter_mut().zip(&dots[*i].fixed).filter(|(_, fixed)| fixed.is_finite())
            {
                *direction = *fixed;
            }
            directions
        };
        let again = run(&every, exponents, every.iter().map(random).collect())?;
        merge(&mut found, &every, again);
    }
    Ok(found)
}

fn merge(found: &mut [Found], which: &[usize], again: Vec<Found>) {
    for (&i, again) in which.iter().zip(again) {
        found[i] = found[i].clone().or(again);
    }
}

/// One search per curve on the CPU from given directions, side by side.
pub(crate) fn search_on_cpu(
    dots: &[&Dots],
    exponents: &Exponents,
    directions: Vec<Vec<f64>>,
    until: &Until,
    workspace: &mut Workspace,
) -> Vec<Found> {
    let (problems, scales) = problems(dots, exponents, &directions);
    all_found(workspace.search(&exponents.universal, problems, until), &scales, directions)
}

/// One search per curve on a GPU from given directions.
///
/// # Errors
/// The errors of [`search_plain_on_gpu`].
pub(crate) fn search_on_device(
    gpu: &Gpu,
    precision: Precision,
    dots: &[&Dots],
    exponents: &Exponents,
    directions: Vec<Vec<f64>>,
    until: &Until,
) -> Result<Vec<Found>> {
    let (problems, scales) = problems(dots, exponents, &directions);
    let outcomes = search_plain_on_gpu(gpu, precision, &exponents.universal, problems, until)?;
    Ok(all_found(outcomes, &scales, directions))
}

/// Searches for the tangent angles of curves of plain segments on a GPU.
///
/// The CPU searches, in f64, the curves that the kernel cannot hold. It also repeats, from the
/// start, those that do not converge in f32.
///
/// # Errors
/// The errors of [`search_on_gpu`].
pub(super) fn search_plain_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    curves: &[Universal],
    problems: Vec<SlopesProblem>,
    until: &Until,
) -> Result<Vec<Outcome>> {
    let searches: Vec<SlopesSearch> = problems.into_iter().map(SlopesSearch::plain).collect();
    let given: Vec<&SlopesSearch> = searches.iter().collect();
    let (mut outcomes, _) = search_on_gpu(gpu, precision, Family::Plain(curves), &given, until)?;
    let mut left = Vec::new();
    for (outcome, search) in outcomes.iter_mut().zip(&searches) {
        let is_ended = |outcome: &Outcome| {
            precision == Precision::F64
                || [SlopesStanding::Converged, SlopesStanding::Running].contains(&outcome.standing)
        };
        if !outcome.as_ref().is_some_and(is_ended) {
            *outcome = None;
            left.push(search.problem.clone());
        }
    }
    let mut on_cpu = Workspace::new(curves.len()).search(curves, left, until).into_iter();
    Ok(outcomes.into_iter().map(|outcome| outcome.or_else(|| on_cpu.next()).expect("one per curve left")).collect())
}

/// The problems of curves, and the logarithms of the units of their costs.
pub(super) fn problems(
    dots: &[&Dots],
    exponents: &Exponents,
    directions: &[Vec<f64>],
) -> (Vec<SlopesProblem>, Vec<f64>) {
    dots.iter().zip(directions).map(|(dots, directions)| dots.problem(directions, exponents)).unzip()
}

fn all_found(outcomes: Vec<Outcome>, scales: &[f64], directions: Vec<Vec<f64>>) -> Vec<Found> {
    let mut found = Vec::with_capacity(outcomes.len());
    for (k, (outcome, directions)) in outcomes.into_iter().zip(directions).enumerate() {
        found.push(Found::of(outcome, scales[k], directions));
    }
    found
}

impl Found {
    /// The result for an outcome, its reference directions and the logarithm of its unit of costs.
    pub(super) fn of(outcome: Outcome, scale: f64, mut directions: Vec<f64>) -> Self {
        for (direction, turn) in directions.iter_mut().zip(&outcome.turns) {
            *direction += turn;
        }
        Found {
            directions: (outcome.standing != SlopesStanding::Nowhere).then_some(directions),
            cost: outcome.cost * scale.exp(),
            decrement: outcome.decrement,
            standing: outcome.standing,
            iterations: outcome.iterations,
            evaluations: outcome.evaluations,
            culprit: outcome.culprit,
            known: Vec::new(),
            on_cpu: false,
        }
    }
}
