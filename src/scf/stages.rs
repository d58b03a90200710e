//! Searches for the slopes of many curves, and what is tried where the first search fails.

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

/// Where segments have no minimiser for the exponent asked for, these parts of the way to it from 2
/// come first.
const STAGES: [f64; 4] = [0.0, 0.3, 0.6, 0.8];

/// Random starts turn every direction by this much at most, in radians.
const SPREAD: f64 = 0.6;

/// Where the searches of a curve start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Starts {
    pub first: Start,
    /// All but the first are random.
    pub count: u32,
    pub seed: u64,
}

/// What was found of a curve.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// NaN where free; `None` where no start had a minimiser.
    pub directions: Option<Vec<f64>>,
    /// In units of the input.
    pub cost: f64,
    pub decrement: f64,
    pub standing: SlopesStanding,
    /// Of all searches of the curve.
    pub iterations: u32,
    pub evaluations: u32,
    /// The first dot whose segment had no minimiser in the last trial that failed.
    pub culprit: Option<usize>,
    /// Where the spans under tension are; empty without.
    pub known: Vec<Near>,
    /// Whether the CPU found it in place of a kernel.
    pub on_cpu: bool,
}

impl Found {
    /// Keeps the better of two, and counts both.
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

/// One search a curve, from given directions.
pub(crate) type SearchFrom<'a> = dyn FnMut(&[&Dots], &Exponents, Vec<Vec<f64>>) -> Result<Vec<Found>> + 'a;

/// Searches for the slopes of all curves.
///
/// # Errors
/// Those of the searches.
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
    // By exponents on the way from 2, each from where the last one ended.
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
        // One seed a start, not a curve: a curve's bits do not depend on its place in the batch.
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

/// One search per curve on the CPU from given directions, all side by side.
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
/// As [`search_plain_on_gpu`].
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
/// The CPU searches, in f64, the curves that the kernel cannot hold, and again from the start those that do not converge in f32.
///
/// # Errors
/// As [`search_on_gpu`].
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

/// The problems of curves, and the logarithms of what their costs are divided by.
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
    /// What an outcome is of curves with these reference directions and this logarithm of the unit of costs.
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
