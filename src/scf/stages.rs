//! Searches for the slopes of many curves, and what is tried where the first search fails.

use rand::rngs::ChaCha12Rng;
use rand::{RngExt, SeedableRng};

use super::dots::{Dots, Exponents};
use super::gpu::search_on_gpu;
use super::slopes::{Outcome, Search, SlopesProblem, SlopesStanding, Until};
use super::start::Start;
use super::tension::Near;
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
    let all: Vec<usize> = (0..dots.len()).collect();
    let from = |which: &[usize], start: Start| which.iter().map(|&i| dots[i].directions(start)).collect::<Vec<_>>();
    let mut found = run(&all, exponents, from(&all, starts.first))?;
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
        let again = run(&all, exponents, all.iter().map(random).collect())?;
        merge(&mut found, &all, again);
    }
    Ok(found)
}

fn merge(found: &mut [Found], which: &[usize], again: Vec<Found>) {
    for (&i, again) in which.iter().zip(again) {
        found[i] = found[i].clone().or(again);
    }
}

/// One search a curve on the CPU, from given directions, all side by side.
pub(crate) fn search_on_cpu(
    dots: &[&Dots],
    exponents: &Exponents,
    directions: Vec<Vec<f64>>,
    until: &Until,
    workspace: &mut Workspace<f64>,
) -> Vec<Found> {
    let (problems, scales) = problems(dots, exponents, &directions);
    let mut searches: Vec<Search<f64>> =
        problems.into_iter().map(|(problem, turns)| Search::new(problem, turns)).collect();
    workspace.run(&exponents.universal, &mut searches, until);
    let outcomes = searches.into_iter().map(Outcome::from);
    outcomes.zip(scales).zip(directions).map(|((outcome, scale), from)| Found::of(outcome, scale, from)).collect()
}

/// One search a curve on a GPU, from given directions.
///
/// # Errors
/// As [`search_on_gpu`].
pub(crate) fn search_on_device(
    gpu: &Gpu,
    precision: Precision,
    dots: &[&Dots],
    exponents: &Exponents,
    directions: Vec<Vec<f64>>,
    until: &Until,
) -> Result<Vec<Found>> {
    let (problems, scales) = problems(dots, exponents, &directions);
    let outcomes = search_on_gpu(gpu, precision, &exponents.universal, problems, until)?.into_iter();
    Ok(outcomes.zip(scales).zip(directions).map(|((outcome, scale), from)| Found::of(outcome, scale, from)).collect())
}

/// Problems with no turns yet, and the logarithms of what their costs are divided by.
#[allow(clippy::type_complexity)]
pub(super) fn problems(
    dots: &[&Dots],
    exponents: &Exponents,
    directions: &[Vec<f64>],
) -> (Vec<(SlopesProblem<f64>, Vec<f64>)>, Vec<f64>) {
    let one = |(dots, directions): (&&Dots, &Vec<f64>)| {
        let (problem, scale) = dots.problem(directions, exponents);
        ((problem, vec![0.0; directions.len()]), scale)
    };
    dots.iter().zip(directions).map(one).unzip()
}

impl Found {
    pub(super) fn of(outcome: Outcome, scale: f64, mut directions: Vec<f64>) -> Self {
        directions.iter_mut().zip(&outcome.turns).for_each(|(direction, turn)| *direction += turn);
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
