//! Curves near their points: the fairest curve within a distance of every data point.
//!
//! ```text
//! smoothing spline (near) ─► rounds inside discs (disc) ─► the fairest curve within its discs
//! ```

use super::disc::Discs;
use super::fair::Fair;
use super::lane::TerminationStatus;
use super::limited::keep_within;
use super::multipliers::{Constrained, Schedule};
use super::near::left_as_it_is;
use super::problem::{Outcome, Problem};
use super::queue::{CurveFit, Goal};
use super::self_intersections::{ROUNDS, message};
use super::separation::{Found, SeparatingHalfPlane};
use super::setup::{PreparedCurve, distance};
use super::verdict::deviation;
use crate::deviation::Deviation;
use crate::error::{Error, Result};
use crate::linalg::scalar::Vector;
use crate::status::CurveStatus;

/// The tolerance of the first round. With a larger one the first curve of a border swings out.
const FIRST: f64 = 0.1;

/// The schedule of the rounds.
///
/// Of 594 borders, 592 converge with the largest tolerance 1.0, 591 with 0.3 and 590 with 0.1.
/// Eight rounds of three iterations each are common.
const SCHEDULE: Schedule = Schedule { roughly: 1.0, of_violation: 1.0, rounds: 30, iterations: 100 };

/// A span has swung out if it is longer than this factor times its chord, plus the deviation.
///
/// A half circle is 1.57 times as long as its chord, and two thirds of a circle 2.42 times. Among
/// borders, spans longer than 1.9 times their chord are loops.
const SWUNG_OUT: f64 = 2.0;

/// The result of the rounds within discs.
#[derive(Clone)]
pub(super) struct InDiscs<const D: usize> {
    ready: PreparedCurve<D>,
    outcome: Outcome<D>,
    discs: Discs,
    rounds: u32,
    /// Spans that were drawn tauter because they crossed although their data do not.
    tauter: Vec<usize>,
    /// The requested deviation, and the deviation that the curve may use without vanishing, in
    /// units of the input.
    asked: f64,
    allowed: f64,
}

/// Finds the least energy within the discs.
///
/// If that fails, as for corners about as wide as their discs, vertices of data points keep their
/// places along the curve, at the cost of some energy.
pub(super) async fn within_discs<const D: usize>(
    curve: &CurveFit<'_, D>,
    ready: PreparedCurve<D>,
    deviations: [f64; 2],
    in_f32: bool,
) -> InDiscs<D> {
    let sliding = rounds(curve, ready.clone(), deviations, in_f32, true).await;
    if sliding.is_minimum() {
        return sliding;
    }
    let mut held = rounds(curve, ready, deviations, in_f32, false).await;
    held.outcome.iterations += sliding.outcome.iterations;
    held
}

/// The rounds, in which vertices of data points slide along the curve or not.
async fn rounds<const D: usize>(
    curve: &CurveFit<'_, D>,
    mut ready: PreparedCurve<D>,
    [asked, allowed]: [f64; 2],
    in_f32: bool,
    slides: bool,
) -> InDiscs<D> {
    let CurveFit { fair, batch, i, .. } = *curve;
    let mut discs = Discs::around(&mut ready, fair, allowed, in_f32, slides, batch, i);
    ready.problem.tolerance = FIRST.max(fair.tolerance);
    let mut own = Constrained::new(ready, None);
    let mut tauter = Vec::new();
    // The result before any span was drawn tauter.
    let mut before: Option<(Box<Problem<D>>, Outcome<D>)> = None;
    for times in 0.. {
        own = own.descend(curve, Goal::Free, &mut [&mut discs], &SCHEDULE).await;
        let outcome = own.outcome.as_mut().expect("rounds have descended");
        if !own.may_go_on {
            break;
        }
        if !own.is_done || outcome.termination != TerminationStatus::Converged {
            if let Some((problem, found)) = before.take() {
                let iterations = outcome.iterations;
                (own.ready.problem, *outcome) = (problem, Outcome { iterations, ..found });
                discs.settle();
                tauter.clear();
            }
            break;
        }
        let is_taut = D == 2 && !own.ready.problem.taut.is_empty();
        let spans = if is_taut && times < ROUNDS { own.ready.tangled(outcome) } else { vec![] };
        if spans.is_empty() {
            break;
        }
        let now = (own.ready.problem.clone(), outcome.clone());
        if !own.ready.narrow(&spans) {
            break;
        }
        before.get_or_insert(now);
        tauter.extend(spans);
        discs.begin_again();
        own.ready.problem.tolerance = SCHEDULE.roughly.max(fair.tolerance);
    }
    tauter.sort_unstable();
    tauter.dedup();
    let outcome = own.outcome.expect("rounds have descended");
    InDiscs { ready: own.ready, outcome, discs, rounds: own.rounds, tauter, asked, allowed }
}

impl<const D: usize> InDiscs<D> {
    /// Enforces the limits of the curve, if it has any. Returns its report and vertices, and
    /// whether the CPU descended.
    ///
    /// `separating` are the half-planes between neighbours.
    pub async fn kept(mut self, curve: &CurveFit<'_, D>, separating: &[SeparatingHalfPlane]) -> (Found, bool) {
        if curve.fair.limits.is_empty(curve.batch) {
            let on_cpu = self.outcome.on_cpu;
            return (self.report(curve), on_cpu);
        }
        let kept;
        (self.ready, kept) = keep_within(curve, &mut self.discs, self.ready, &mut self.outcome, separating).await;
        let (asked, on_cpu) = (self.asked, self.outcome.on_cpu);
        let (mut report, vertices) = self.report(curve);
        if let Some(kept) = kept {
            kept.judge_within(&mut report, curve.batch, curve.i, asked);
        }
        ((report, vertices), on_cpu)
    }

    /// Whether the rounds have found a minimum without loops.
    fn is_minimum(&self) -> bool {
        let vertices = self.ready.vertices_of(&self.outcome);
        self.outcome.termination == TerminationStatus::Converged
            && self.discs.is_settled()
            && !has_swung_out(&vertices, &self.ready.rows, self.allowed)
    }

    /// The report of the curve, and its vertices.
    fn report(mut self, curve: &CurveFit<'_, D>) -> Found {
        let CurveFit { fair, batch, i, .. } = *curve;
        let (asked, allowed) = (self.asked, self.allowed);
        let vertices = self.ready.vertices_of(&self.outcome);
        let found = deviation(&vertices, &self.ready.rows, batch.points(i).as_chunks::<D>().0);
        let keeps = found <= asked && self.outcome.termination != TerminationStatus::Unbounded;
        if !keeps || has_swung_out(&vertices, &self.ready.rows, allowed) {
            return left_as_it_is(self.ready, fair, batch, i, asked, self.outcome.iterations);
        }
        self.ready.problem.tolerance = fair.tolerance;
        let (mut report, vertices) = fair.report(batch, i, &self.ready, &self.outcome);
        if report.status != CurveStatus::Converged {
            return (report, vertices);
        }
        let said = if !self.discs.is_settled() {
            report.status = CurveStatus::NotConverged;
            let (rounds, remedy) = (self.rounds, fair.remedy());
            Some((
                0,
                format!(
                    "it keeps the deviation of {asked}, but {rounds} rounds did not tell how near to each point the fairest curve is: {remedy}"
                ),
            ))
        } else if let Some(&first) = self.tauter.first() {
            Some((first, message(&self.tauter)))
        } else if self.discs.are_points() {
            Some((0, format!("a deviation of {asked} is next to rounding here: the curve goes through its points")))
        } else if allowed < asked {
            Some((
                0,
                format!(
                    "the curve is so small that it could vanish within {asked} of its points: it stays within {allowed:.3e}"
                ),
            ))
        } else {
            None
        };
        if let Some((point, what)) = said {
            report.message = Some(batch.sentence(i, point, &what));
        }
        (report, vertices)
    }
}

/// Whether any span between data points has become a loop.
fn has_swung_out<const D: usize>(vertices: &[Vector<f64, D>], rows: &[u32], allowed: f64) -> bool {
    let at = |row: u32| vertices[row as usize % vertices.len()];
    let length = |from: u32, to: u32| (from..to).map(|row| distance(at(row), at(row + 1))).sum::<f64>();
    rows.windows(2).any(|ends| length(ends[0], ends[1]) > SWUNG_OUT * distance(at(ends[0]), at(ends[1])) + allowed)
}

/// Checks that a deviation is valid.
///
/// # Errors
/// A deviation that is not positive and finite. An energy that already contains an attachment.
pub(super) fn check(fair: &Fair, allowed: Deviation) -> Result<()> {
    allowed.check("to go through every point, leave it out")?;
    if fair.energy.attachment_weight() > 0.0 {
        return Err(Error::argument(format!(
            "a deviation of {allowed} keeps the curve near its points, and so does the attachment in the energy: leave one of both out"
        )));
    }
    Ok(())
}
