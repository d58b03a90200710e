//! Curves near their points: for every curve the smallest weight of the attachment that keeps a deviation.
//!
//! ```text
//! guess: λ of the smoothing spline ─► round: every curve at its own weight, all in one batch ─► deviations ─► next weights
//! ```
//!
//! The smaller the weight, the fairer the curve and the larger its deviation. Weights are searched among
//! α = unit · 2^(j/128) for whole j, by secants between a weight that breaks the deviation and one that keeps it, until they
//! are neighbours. Every round starts from the curve of the smallest weight that keeps it so far, the first from the spline;
//! only the last of a curve goes down to the method's own tolerance.

use super::curves::Fitted;
use super::energy::attachment;
use super::fair::{Fair, Pins};
use super::lane::Standing;
use super::problem::Outcome;
use super::setup::{Ready, set_up_pieces};
use crate::Constraints;
use crate::Problem as Unfitted;
use crate::batch::CurveBatch;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::report::CurveReport;
use crate::spline::{Amount, Parametrisation, Smoothing};

/// Weights tried differ by 2^(1/128), 0.54 %, and so do deviations at most where they go as 1/α: every device and precision
/// tries the same numbers.
const STEPS_PER_OCTAVE: f64 = 128.0;

/// Steps to the next weight while nothing brackets the answer: at least a twelfth of an octave, and at most six.
const LEAST_STRIDE: f64 = 11.0;
const MOST_STRIDE: f64 = 6.0 * STEPS_PER_OCTAVE;

/// The smallest weight: all attachments together are this part of the stiffness of a curve of size 1. They move it by no more.
const WEAKEST: f64 = 1e-4;

/// The largest weight makes one attachment 2³⁰ times as stiff as the shortest span.
const OCTAVES_ABOVE: f64 = 30.0;

/// On the way deviations need be known to this part of the one allowed only.
const ROUGHLY: f64 = 1e-3;

/// Neighbouring weights whose deviations are farther apart than this have curves of different minima.
const CLOSE: f64 = 0.98;

/// The method's tolerance moves a deviation by next to nothing; where it breaks the one allowed after all, weights so many
/// steps higher are tried.
const STRIDES: [i32; 4] = [1, 4, 16, 64];

/// Rounds at most. A dozen are common; more than these are those of a deviation that jumps.
const MOST_ROUNDS: u32 = 64;

/// Fits every curve with the smallest weight of the attachment that keeps the deviation; and says what did it.
pub(super) fn fit<const D: usize>(
    fair: &Fair,
    allowed: f64,
    batch: &CurveBatch,
    kept: &[[bool; 2]],
    device: &Device,
) -> Result<Fitted> {
    let pins = if fair.pins == Pins::None { Pins::None } else { Pins::Ends };
    let energy = fair.energy.clone() + attachment();
    let attached = Fair { energy, pins, deviation: None, corners: None, ..fair.clone() };
    let lambdas = smoothing_splines(pins, allowed, batch)?;
    let ready = set_up_pieces::<D>(&attached, batch, kept)?;
    let search = |(i, ready): (usize, Result<Ready<D>, Unfitted>)| {
        ready.map(|ready| Search::new(&attached, allowed, i, ready, lambdas[i]))
    };
    let mut searches: Vec<Result<Search<D>, Unfitted>> = ready.into_iter().enumerate().map(search).collect();
    let mut description = None;
    loop {
        let mut active: Vec<&mut Search<D>> =
            searches.iter_mut().flatten().filter(|search| search.found.is_none()).collect();
        if active.is_empty() && description.is_some() {
            break;
        }
        let trials: Vec<Result<Ready<D>, Unfitted>> = active.iter().map(|search| Ok(search.trial(&attached))).collect();
        let (outcomes, device) = attached.descend(&trials, device)?;
        description.get_or_insert(device);
        for ((search, trial), outcome) in active.iter_mut().zip(trials.into_iter().flatten()).zip(outcomes) {
            search.take(trial, outcome, batch.points(search.curve).as_chunks::<D>().0);
        }
    }
    let (mut curves, mut reports) = (Vec::with_capacity(batch.len()), Vec::with_capacity(batch.len()));
    for (i, search) in searches.into_iter().enumerate() {
        let (report, vertices) = match search {
            Ok(search) => search.report(&attached, batch),
            Err(problem) => (CurveReport::unfitted(problem.status, problem.message), None),
        };
        curves.push(vertices.ok_or_else(|| batch.points(i).to_vec()));
        reports.push(report);
    }
    Ok(Fitted { curves, reports, device: description.unwrap_or_default() })
}

/// The λ of the smoothing splines of the same deviation: 0 where there is none.
fn smoothing_splines(pins: Pins, allowed: f64, batch: &CurveBatch) -> Result<Vec<f64>> {
    let free = batch.clone().with_constraints(Constraints::default())?;
    let smoothing = Smoothing {
        amount: Amount::Deviation(allowed),
        pin_ends: pins != Pins::None,
        parametrisation: Parametrisation::ChordLength,
    };
    let (_, reports) = smoothing.fit_splines(&free, &Device::cpu())?;
    Ok(reports.iter().map(|report| report.smoothing.unwrap_or(0.0)).collect())
}

/// A curve that keeps the deviation.
#[derive(Clone, Debug)]
struct Kept<const D: usize> {
    step: i32,
    deviation: f64,
    /// What was descended, and where to.
    trial: Ready<D>,
    outcome: Outcome<D>,
}

/// How far a search has come.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// For the weight.
    Searching,
    /// It has the weight, and needs the curve to the method's tolerance.
    Finishing,
    /// No weight keeps the deviation: through the points, then.
    Pinned,
}

/// The search for the weight of one curve.
struct Search<const D: usize> {
    curve: usize,
    allowed: f64,
    /// At the spline, attachments at weight 1.
    start: Ready<D>,
    /// α of step 0.
    unit: f64,
    steps: [i32; 2],
    step: i32,
    stage: Stage,
    /// The largest weight known to break the deviation, with the deviation; and the smallest known to keep it.
    below: Option<(i32, f64)>,
    above: Option<Kept<D>>,
    /// Whether `below` was reached from a curve that keeps the deviation, and not from the spline, from where the way may
    /// end in another minimum.
    follows: bool,
    /// How often in a row the same side of the bracket moved.
    one_sided: i32,
    /// How many weights were too small for the method's tolerance.
    finishes: usize,
    rounds: u32,
    iterations: u32,
    found: Option<(Ready<D>, Outcome<D>)>,
}

impl<const D: usize> Search<D> {
    fn new(attached: &Fair, allowed: f64, curve: usize, start: Ready<D>, lambda: f64) -> Self {
        let problem = &start.problem;
        let order = attached.energy.order() as i32;
        let is_attached = !problem.attached.is_empty();
        let own = || problem.attached.iter().map(|(_, weight, _)| *weight);
        // Where nothing is attached nothing is searched for, and any unit serves.
        let (heaviest, all) = if is_attached { (own().fold(0.0, f64::max), own().sum::<f64>()) } else { (1.0, 1.0) };
        let spans = spans(&start);
        let shortest = spans.iter().copied().fold(f64::INFINITY, f64::min);
        let unit = problem.highest * shortest.powi(1 - 2 * order) / heaviest;
        let step = |alpha: f64| STEPS_PER_OCTAVE * (alpha / unit).log2();
        let lowest = step(WEAKEST * problem.highest / all).floor();
        let highest = OCTAVES_ABOVE * STEPS_PER_OCTAVE;
        // Data at distance h smoothed over a length l, l^2m = h w/α: alike for a spline and for a curve of order m.
        let h = spans.iter().sum::<f64>() / spans.len() as f64;
        let lambda = lambda / start.size.powi(3);
        let per_weight = start.size * start.size / start.energy_unit;
        let guess = step(problem.highest * h * (lambda * h).powf(-0.5 * f64::from(order)) / per_weight);
        let guess = if guess.is_finite() { guess } else { 0.0 };
        Search {
            steps: [lowest as i32, highest as i32],
            step: guess.round().clamp(lowest, highest) as i32,
            stage: if is_attached { Stage::Searching } else { Stage::Pinned },
            curve,
            allowed,
            start,
            unit,
            below: None,
            above: None,
            follows: false,
            one_sided: 0,
            finishes: 0,
            rounds: 0,
            iterations: 0,
            found: None,
        }
    }

    fn weight(&self) -> f64 {
        self.unit * (f64::from(self.step) / STEPS_PER_OCTAVE).exp2()
    }

    /// What is to be descended next.
    fn trial(&self, attached: &Fair) -> Ready<D> {
        if self.stage == Stage::Pinned {
            let mut ready = self.start.clone();
            ready.problem.pinned = ready.problem.data.clone();
            ready.problem.attached.clear();
            return ready;
        }
        // Of several minima the one that follows from the curve through the points as its attachments weaken: a curve once
        // too far away may be caught behind folds that no weight pulls it out of.
        let mut ready = match &self.above {
            Some(kept) => kept.trial.moved(&kept.outcome.displacements, &self.start),
            None => self.start.clone(),
        };
        let (weight, mut least) = (self.weight(), f64::INFINITY);
        for (_, own, _) in &mut ready.problem.attached {
            *own *= weight;
            least = least.min(*own);
        }
        if self.stage == Stage::Searching {
            // ⟨g, L⁻¹g⟩ bounds α|u − u*|² at every attached vertex, where L is the Hessian.
            let enough = ROUGHLY * self.allowed / self.start.size * least.sqrt();
            ready.problem.tolerance = enough.clamp(attached.tolerance, attached.tolerance.max(ROUGHLY));
        }
        ready
    }

    /// Takes note of what became of a trial, and decides what follows.
    fn take(&mut self, trial: Ready<D>, outcome: Outcome<D>, points: &[Vector<f64, D>]) {
        self.rounds += 1;
        self.iterations += outcome.iterations;
        if outcome.standing == Standing::Running {
            // The device was lost. The spline keeps the deviation, at least.
            self.stage = Stage::Pinned;
            self.found = Some((self.start.clone(), Outcome { displacements: zeros(&self.start), ..outcome }));
            return;
        }
        if self.stage == Stage::Pinned {
            self.found = Some((trial, outcome));
            return;
        }
        let is_curve = !matches!(outcome.standing, Standing::Broken | Standing::Unbounded);
        let moved = trial.moved(&outcome.displacements, &self.start);
        let deviation = Some(moved.deviation(points)).filter(|d| is_curve && d.is_finite()).unwrap_or(f64::INFINITY);
        let keeps = deviation <= self.allowed * (1.0 - 8.0 * f64::EPSILON);
        if self.stage == Stage::Finishing {
            if keeps {
                self.found = Some((trial, outcome));
            } else {
                self.finish_again();
            }
            return;
        }
        self.one_sided = if keeps { self.one_sided.max(0) + 1 } else { self.one_sided.min(0) - 1 };
        if keeps {
            self.above = Some(Kept { step: self.step, deviation, trial, outcome });
        } else {
            self.follows = self.above.is_some();
            self.below = Some((self.step, deviation));
        }
        let falls_short = |above: &Kept<D>| above.deviation < CLOSE * self.allowed;
        if self.next().is_none() && !self.follows && self.above.as_ref().is_some_and(falls_short) {
            (self.below, self.one_sided) = (None, 0);
        }
        match (self.next(), &self.above) {
            (Some(step), _) if self.rounds < MOST_ROUNDS => self.step = step,
            (_, Some(above)) => (self.stage, self.step) = (Stage::Finishing, above.step),
            _ => self.stage = Stage::Pinned,
        }
    }

    /// The next heavier weight; in the end the curve that kept the deviation, such as it is.
    fn finish_again(&mut self) {
        match STRIDES.get(self.finishes) {
            Some(stride) => (self.step, self.finishes) = (self.step + stride, self.finishes + 1),
            None => {
                let Kept { step, trial, mut outcome, .. } = self.above.take().expect("a weight found was tried");
                if outcome.norm > self.start.problem.tolerance {
                    outcome.standing = Standing::Exhausted;
                }
                (self.step, self.found) = (step, Some((trial, outcome)));
            }
        }
    }

    /// The weight to try next, unless the bracket is as narrow as can be.
    fn next(&self) -> Option<i32> {
        let octaves_off = |deviation: f64| (deviation / self.allowed).log2().abs();
        let stride = |deviation: f64| {
            // Deviations go as 1/α where attachments are stiff, more slowly where they are not; and those that
            // had no effect so far are followed by larger ones.
            let first = STEPS_PER_OCTAVE * 1.5 * octaves_off(deviation);
            let patient = LEAST_STRIDE * f64::from(self.one_sided.abs()).exp2();
            first.max(patient).min(MOST_STRIDE) as i32
        };
        let [lowest, highest] = self.steps;
        match (self.below, &self.above) {
            (Some((below, deviation)), Some(above)) => {
                let gap = above.step - below;
                let (high, low) = (deviation.ln(), above.deviation.ln());
                let part = (high - self.allowed.ln()) / (high - low);
                let secant = part.is_finite() && self.one_sided.abs() < 3;
                let part = if secant { part } else { 0.5 };
                (gap > 1).then(|| below + ((part * f64::from(gap)).round() as i32).clamp(1, gap - 1))
            }
            (Some((below, deviation)), None) => (below < highest).then(|| (below + stride(deviation)).min(highest)),
            (None, Some(above)) => (above.step > lowest).then(|| (above.step - stride(above.deviation)).max(lowest)),
            (None, None) => None,
        }
    }

    /// The report of a search that has ended, and the vertices found.
    fn report(self, attached: &Fair, batch: &CurveBatch) -> (CurveReport, Option<super::curves::Vertices>) {
        let is_attached = self.stage != Stage::Pinned;
        let weight = if is_attached { self.weight() } else { f64::INFINITY };
        let (ready, mut outcome) = self.found.expect("a search ends with a curve");
        outcome.iterations = self.iterations;
        for (row, weight, target) in &ready.problem.attached {
            let away = subtract(outcome.displacements[*row as usize], *target);
            outcome.energy -= 0.5 * weight * dot(away, away);
        }
        let (mut report, vertices) = attached.report(batch, self.curve, &ready, &outcome);
        let nothing_to_attach = self.start.problem.attached.is_empty();
        report.smoothing = Some(if nothing_to_attach { 0.0 } else { weight });
        if !is_attached && !nothing_to_attach && report.message.is_none() {
            let most = self.unit * OCTAVES_ABOVE.exp2();
            let what = format!(
                "no weight of the attachment up to {most:.1e} keeps the deviation of {}: the curve goes through its points; \
                 allow more, or ask for more segments",
                self.allowed
            );
            report.message = Some(batch.sentence(self.curve, 0, &what));
        }
        (report, vertices)
    }
}

fn zeros<const D: usize>(ready: &Ready<D>) -> Vec<Vector<f64, D>> {
    vec![[0.0; D]; ready.vertices.len()]
}

/// Lengths of the spans that have any, at size 1.
fn spans<const D: usize>(ready: &Ready<D>) -> Vec<f64> {
    let lengths: Vec<f64> = ready.problem.base.iter().map(|edge| dot(*edge, *edge).sqrt()).collect();
    let span = |pair: &[u32]| lengths[pair[0] as usize..pair[1] as usize].iter().sum();
    ready.rows.windows(2).map(span).filter(|&length| length > 0.0).collect()
}

impl<const D: usize> Ready<D> {
    /// The curve with its vertices where displacements lead, as the base of further ones; weights of attachments as in `start`.
    fn moved(&self, displacements: &[Vector<f64, D>], start: &Self) -> Self {
        let mut moved = self.clone();
        let count = displacements.len();
        for (vertex, u) in moved.vertices.iter_mut().zip(displacements) {
            *vertex = add(*vertex, scale(self.size, *u));
        }
        for (j, edge) in moved.problem.base.iter_mut().enumerate() {
            *edge = add(*edge, subtract(displacements[(j + 1) % count], displacements[j]));
        }
        for ((row, weight, target), (_, own, _)) in moved.problem.attached.iter_mut().zip(&start.problem.attached) {
            *target = subtract(*target, displacements[*row as usize]);
            *weight = *own;
        }
        moved.problem.tolerance = start.problem.tolerance;
        moved
    }

    /// Largest distance from a data point to its vertex, in the units of the input.
    pub(super) fn deviation(&self, points: &[Vector<f64, D>]) -> f64 {
        deviation(&self.vertices, &self.rows, points)
    }
}

/// Largest distance from a data point to its vertex.
pub(super) fn deviation<const D: usize>(vertices: &[Vector<f64, D>], rows: &[u32], points: &[Vector<f64, D>]) -> f64 {
    let distance = |(point, &row): (&Vector<f64, D>, &u32)| {
        let away = subtract(vertices[row as usize % vertices.len()], *point);
        dot(away, away).sqrt()
    };
    points.iter().zip(rows).map(distance).fold(0.0, f64::max)
}

/// Whether a deviation makes sense.
///
/// # Errors
/// One that is not positive and finite; an energy with an attachment of its own.
pub(super) fn check(fair: &Fair, allowed: f64) -> Result<()> {
    if !(allowed > 0.0 && allowed.is_finite()) {
        return Err(Error::argument(format!(
            "the largest deviation allowed is {allowed}; it must be positive and finite: to go through every point, leave it out"
        )));
    }
    if fair.energy.attachment_weight() > 0.0 {
        return Err(Error::argument(format!(
            "the energy attaches the curve with a weight of its own, but a deviation of {allowed} has one found: leave one of both out"
        )));
    }
    Ok(())
}
