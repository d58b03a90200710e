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

use super::descended::Descended;
use super::fair::Fair;
use super::fences::{Fences, Worst};
use super::lane::Standing;
use super::problem::{Outcome, Problem};
use super::setup::{Ready, distance};
use crate::batch::CurveBatch;
use crate::device::Device;
use crate::error::Result;
use crate::linalg::scalar::dot;
use crate::report::{CurveReport, LimitReport};
use crate::status::CurveStatus;

/// The weight of the gauge, in that of curves without limits.
const GAUGE: f64 = 30.0;

/// The most rounds. Ten are common.
const MOST_ROUNDS: u32 = 40;

/// The most iterations of a round but for the last.
const ROUND_ITERATIONS: u32 = 25;

/// The largest tolerance of a round.
const ROUGHLY: f64 = 1e-2;

/// The tolerance of the next round in units of √(E/m) v, for m edges and the violation v.
const OF_VIOLATION: f64 = 0.05;

/// A curve with limits, between rounds.
pub(super) struct Fenced<const D: usize> {
    /// Its number among those that are ready.
    k: usize,
    slopes: [Vec<f64>; 2],
    fences: Fences,
    problem: Problem<D>,
    /// All descents since the curve without limits.
    outcome: Option<Outcome<D>>,
    rounds: u32,
    has_ended: bool,
    tolerance: f64,
}

impl<const D: usize> Fenced<D> {
    fn new(k: usize, slopes: [Vec<f64>; 2], mut problem: Problem<D>, energy: f64, fair: &Fair) -> Self {
        let fences = Fences::around(&mut problem, slopes.clone(), energy);
        problem.gauge *= GAUGE;
        problem.tolerance = ROUGHLY.max(fair.tolerance);
        let (outcome, tolerance) = (None, fair.tolerance);
        Fenced { k, slopes, fences, problem, outcome, rounds: 0, has_ended: false, tolerance }
    }

    /// Records a round, and makes the curve ready for the next one.
    fn take(&mut self, outcome: Outcome<D>) {
        self.rounds += 1;
        let problem = &mut self.problem;
        let (standing, was_exact) = (outcome.standing, problem.tolerance <= self.tolerance);
        problem.rebase(&outcome.displacements);
        let energy = outcome.energy - problem.energy_of_fences();
        let outcome = Outcome { energy, ..outcome };
        match &mut self.outcome {
            Some(own) => own.go_on(outcome),
            None => self.outcome = Some(outcome),
        }
        if !matches!(standing, Standing::Converged | Standing::Exhausted | Standing::Stalled) {
            self.has_ended = true;
            return;
        }
        self.fences.press(problem);
        let is_done = self.fences.is_settled() && was_exact;
        self.has_ended = is_done || self.fences.is_given_up() || self.rounds == MOST_ROUNDS;
        let of_violation =
            OF_VIOLATION * (energy / problem.base.len() as f64).sqrt() * self.fences.violation().min(1.0);
        let tolerance = if self.fences.is_settled() { 0.0 } else { of_violation.min(ROUGHLY) };
        problem.tolerance = tolerance.max(self.tolerance);
    }
}

/// How a curve keeps its limits.
pub(super) struct Kept {
    report: LimitReport,
    /// The limit that it keeps the least, and its point.
    worst: Worst,
    point: usize,
    /// The largest curvature at the vertex of the worst limit, and the curvature there, in units of the input.
    bound: f64,
    curvature: f64,
    ending: Ending,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Ending {
    Kept,
    /// Rounds lead no nearer to the limits.
    GivenUp,
    /// The rounds were used up, or a round did not end.
    Unsettled,
}

/// Fits curves again that break their limits, so that they keep them, and says how each does that is ready.
///
/// `found` are the curves without limits. `None` stands for a curve that has none.
pub(super) fn keep<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    found: &mut Descended<D>,
    device: &Device,
) -> Result<Vec<Option<Kept>>> {
    let numbers: Vec<usize> = (0..found.ready.len()).filter(|&i| found.ready[i].is_ok()).collect();
    let ready = |i: usize| found.ready[i].as_ref().expect("these are ready");
    let mut kept: Vec<Option<Kept>> = Vec::with_capacity(numbers.len());
    let mut running: Vec<Fenced<D>> = Vec::new();
    let mut free: Vec<f64> = Vec::new();
    for (k, &i) in numbers.iter().enumerate() {
        let (ready, outcome) = (ready(i), &mut found.outcomes[k]);
        let slopes = fair.limits.slopes::<D>(batch, i, &ready.rows, ready.vertices.len(), ready.size);
        let has_converged = outcome.standing == Standing::Converged;
        free.push(if has_converged { outcome.energy } else { f64::NAN });
        let mut problem = ready.problem.clone();
        if has_converged {
            problem.rebase(&outcome.displacements);
        }
        let Some(worst) = problem.worst(&slopes) else {
            kept.push(None);
            continue;
        };
        if has_converged && worst.excess <= 0.0 {
            kept.push(Some(Kept::of(&problem, ready, &slopes, batch, i, [outcome.energy; 2], Ending::Kept)));
            continue;
        }
        let energy = if has_converged { outcome.energy } else { problem.energy_of_base(&fair.energy) };
        if !has_converged {
            // It starts from where the curve without limits did.
            outcome.displacements.fill([0.0; D]);
        }
        kept.push(None);
        running.push(Fenced::new(k, slopes, problem, energy, fair));
    }
    let kinds = [0, 1].map(|kind| running.iter().any(|fenced| !fenced.slopes[kind].is_empty()));
    let energy = fair.energy.fenced(kinds);
    for fenced in &mut running {
        fenced.problem.weights.resize(energy.terms().len(), 1.0);
    }
    while !running.is_empty() {
        // All curves of a descent have the same cap of iterations. Those whose limits are not settled go first.
        let is_settling = running.iter().any(|fenced| !fenced.fences.is_settled());
        let (now, later): (Vec<_>, Vec<_>) =
            running.into_iter().partition(|fenced| !is_settling || !fenced.fences.is_settled());
        running = later;
        let most = if is_settling { fair.max_iterations.min(ROUND_ITERATIONS) } else { fair.max_iterations };
        let of = Fair { max_iterations: most, energy: energy.clone(), ..fair.clone() };
        let mut trials: Vec<_> = now
            .iter()
            .map(|fenced| {
                let ready = found.ready[numbers[fenced.k]].as_ref().expect("these are ready");
                Ok(Ready { problem: fenced.problem.clone(), vertices: vec![], rows: ready.rows.clone(), ..*ready })
            })
            .collect();
        let (outcomes, _) = of.descend(&mut trials, device, &|_, _| {})?;
        for (mut fenced, outcome) in now.into_iter().zip(outcomes) {
            fenced.take(outcome);
            if !fenced.has_ended {
                running.push(fenced);
                continue;
            }
            let (k, i) = (fenced.k, numbers[fenced.k]);
            let ready = found.ready[i].as_ref().expect("these are ready");
            let mut outcome = fenced.outcome.take().expect("it has ended");
            let ending = match (fenced.fences.is_given_up(), fenced.fences.is_settled()) {
                (true, _) => Ending::GivenUp,
                (_, true) => Ending::Kept,
                _ => Ending::Unsettled,
            };
            if ending == Ending::GivenUp {
                outcome.standing = Standing::Converged;
            }
            let energies = [outcome.energy, free[k]];
            kept[k] = Some(Kept::of(&fenced.problem, ready, &fenced.slopes, batch, i, energies, ending));
            found.outcomes[k].go_on(outcome);
        }
    }
    Ok(kept)
}

impl Kept {
    /// How a curve at its base keeps its limits. `energies` are its own and that without limits.
    fn of<const D: usize>(
        problem: &Problem<D>,
        ready: &Ready<D>,
        slopes: &[Vec<f64>; 2],
        batch: &CurveBatch,
        i: usize,
        [energy, free]: [f64; 2],
        ending: Ending,
    ) -> Self {
        let worst = problem.worst(slopes).expect("it has limits");
        let points = batch.points(i).as_chunks::<D>().0;
        let spans = if problem.closed { points.len() } else { points.len() - 1 };
        let chords: f64 = (0..spans).map(|k| distance(points[k], points[(k + 1) % points.len()])).sum();
        let length: f64 = problem.base.iter().map(|edge| dot(*edge, *edge).sqrt()).sum::<f64>() * ready.size;
        let report = LimitReport {
            violation: worst.excess.max(0.0),
            active: problem.held(),
            cost: energy / free - 1.0,
            stretch: length / chords,
        };
        let point = ready.rows[..points.len()].partition_point(|&row| row as usize <= worst.row).saturating_sub(1);
        let bound = 1.0 / (slopes[worst.kind][worst.row] * ready.size);
        Kept { report, worst, point, bound, curvature: worst.curvature / ready.size, ending }
    }

    /// Writes into the report of the curve how it keeps its limits.
    pub fn judge(&self, report: &mut CurveReport, batch: &CurveBatch, i: usize) {
        report.limits = Some(self.report);
        if report.status != CurveStatus::Converged || self.ending == Ending::Kept {
            return;
        }
        let Kept { bound, curvature, .. } = *self;
        let broken = match self.worst.kind {
            0 => format!("its curvature is {curvature:.6} from here to the next point, where {bound} is the largest"),
            _ => format!(
                "it turns to the other side than its points from here to the next point, with a curvature of {:.3e}",
                curvature.abs()
            ),
        };
        let what = match (self.ending, self.worst.kind) {
            (Ending::GivenUp, 0) => format!(
                "no curve near keeps its limits: {broken}; allow a curvature of {:.6}, or a deviation from the points",
                curvature * (1.0 + 1e-6)
            ),
            (Ending::GivenUp, _) => {
                format!("no curve near keeps its limits: {broken}; allow it to, or allow a deviation from the points")
            }
            _ => format!("the rounds did not end at a curve that keeps its limits: {broken}"),
        };
        report.status = match self.ending {
            Ending::GivenUp => CurveStatus::Infeasible,
            _ => CurveStatus::NotConverged,
        };
        report.message = Some(batch.sentence(i, self.point, &what));
    }
}
