//! Status, message and report of a curve after its descent.

use super::curves::Vertices;
use super::fair::Fair;
use super::lane::TerminationStatus;
use super::problem::Outcome;
use super::setup::{LONGEST, PreparedCurve, distance};
use crate::batch::CurveBatch;
use crate::linalg::scalar::Vector;
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// A stalled gradient within this factor of the tolerance is attributed to rounding.
///
/// Above it the curve itself is the cause.
const ROUNDING_REACHES: f64 = 1e3;

/// A curve that has not converged after this many iterations does not converge with ten times as
/// many.
///
/// This was measured with borders of countries.
const ENOUGH_ITERATIONS: u32 = 200;

/// A curve longer than this factor times its data polygon has loops. If it has not converged
/// either, the result is the input.
///
/// A half circle through two points is 1.57 times as long as its chord. No curve that converged was
/// seen to exceed 1.23 on its way.
const ASTRAY: f64 = 2.0;

/// The end of a descent and its curve, for its report.
pub(super) struct Ending {
    pub termination: TerminationStatus,
    pub iterations: u32,
    /// In units of the input, without the regularisation.
    pub energy: f64,
    pub norm: f64,
    /// The tolerance of `norm`.
    pub tolerance: f64,
    /// The ratio of the curve's length to its data polygon's.
    pub times: f64,
    pub deviation: f64,
    pub is_attached: bool,
}

impl Fair {
    /// The report of a curve, and its vertices unless the result is its input.
    pub(super) fn report<const D: usize>(
        &self,
        batch: &CurveBatch,
        i: usize,
        ready: &PreparedCurve<D>,
        outcome: &Outcome<D>,
    ) -> (CurveReport, Option<Vertices>) {
        let vertices = ready.vertices_of(outcome);
        let (points, closed) = (batch.points(i).as_chunks::<D>().0, ready.problem.closed);
        let ending = Ending {
            termination: outcome.termination,
            iterations: outcome.iterations,
            energy: outcome.energy * ready.energy_unit,
            norm: outcome.norm,
            tolerance: ready.problem.tolerance,
            times: length(&vertices, closed) / length(points, closed),
            deviation: deviation(&vertices, &ready.rows, points),
            is_attached: !ready.problem.attached.is_empty(),
        };
        let (report, is_fitted) = self.report_of(batch, i, &ending);
        (report, is_fitted.then(|| Vertices::of(ready, vertices)))
    }

    /// The report of a curve, and whether the result is the curve or its input.
    pub(super) fn report_of(&self, batch: &CurveBatch, i: usize, ending: &Ending) -> (CurveReport, bool) {
        let (status, what) = self.ended(ending);
        let Ending { iterations, times, .. } = *ending;
        let as_it_was = |status: CurveStatus, what: &str| {
            let report = CurveReport::unfitted(status, batch.sentence(i, 0, what));
            (CurveReport { iterations, ..report }, false)
        };
        let what = what.as_deref();
        if matches!(status, CurveStatus::Unbounded | CurveStatus::Invalid) {
            return as_it_was(status, what.unwrap_or_default());
        }
        // Attached curves stay near their points, and small rings may grow round.
        let loops = (times > ASTRAY && !ending.is_attached).then_some(times);
        if status == CurveStatus::NotConverged && loops.is_some() {
            let astray = format!(
                "after {iterations} iterations it has not converged, and is {times:.1} times as long as its points' polygon: it is on its way into \
                 loops, and stays as it is; {}",
                self.remedy()
            );
            let is_folded = ending.termination == TerminationStatus::Folded;
            return as_it_was(status, what.filter(|_| is_folded).unwrap_or(&astray));
        }
        let looping = loops.map(|times| {
            format!(
                "it is {times:.1} times as long as its points' polygon: loops cost less than turns between its points"
            )
        });
        let report = CurveReport {
            status,
            message: what.or(looping.as_deref()).map(|what| batch.sentence(i, 0, what)),
            energy: ending.energy,
            iterations,
            gradient_norm: ending.norm,
            loops,
            max_deviation: ending.deviation,
            ..CurveReport::default()
        };
        (report, true)
    }

    /// The status of a curve and its message, from the end of its descent.
    fn ended(&self, ending: &Ending) -> (CurveStatus, Option<String>) {
        let Ending { norm, iterations, tolerance, .. } = *ending;
        let (status, what) = match ending.termination {
            TerminationStatus::Converged => return (CurveStatus::Converged, None),
            TerminationStatus::Unbounded => (
                CurveStatus::Unbounded,
                format!(
                    "its length passed {LONGEST} times that of its points' polygon after {iterations} iterations while its energy fell: \
                     this energy has no minimum here, and the curve stays as it is; add tautness to it, such as tautness=1"
                ),
            ),
            TerminationStatus::Broken => (
                CurveStatus::Invalid,
                "its energy is no number: neighbouring points are too close for its size, or it turns back on itself; \
                 remove points that almost coincide"
                    .into(),
            ),
            TerminationStatus::Stalled => {
                let remedy = if norm <= ROUNDING_REACHES * tolerance {
                    format!("ask for a larger tolerance, such as {:.0e}", 10.0 * norm)
                } else {
                    self.remedy().into()
                };
                let what = format!(
                    "after {iterations} iterations no step leads further down, with a gradient of {norm:.1e} where {tolerance:.1e} was asked for: \
                     the curve is the best one reached; {remedy}"
                );
                (CurveStatus::NotConverged, what)
            }
            TerminationStatus::Folded => (
                CurveStatus::NotConverged,
                format!(
                    "after {iterations} iterations its polygon folds: it turns by more than 90° at a vertex, where variation measures no \
                     curvature any more; ask for more segments a span"
                ),
            ),
            TerminationStatus::Running => (
                CurveStatus::NotConverged,
                "the device was lost before the curve was fitted: it is the spline it would have started from".into(),
            ),
            TerminationStatus::Exhausted => {
                let remedy = if iterations < ENOUGH_ITERATIONS { "allow more" } else { self.remedy() };
                let what = format!(
                    "{iterations} iterations were not enough, with a gradient of {norm:.1e} where {tolerance:.1e} was asked for: {remedy}"
                );
                (CurveStatus::NotConverged, what)
            }
        };
        (status, Some(what))
    }

    /// The remedy for a curve that does not converge.
    pub(super) fn remedy(&self) -> &'static str {
        if self.energy.bounds_length() {
            "ask for more segments a span, or weigh length, tension and tautness less"
        } else {
            "add tautness to the energy, such as tautness=1"
        }
    }
}

/// The largest distance from a data point to its vertex.
pub(super) fn deviation<const D: usize>(vertices: &[Vector<f64, D>], rows: &[u32], points: &[Vector<f64, D>]) -> f64 {
    let away = |(point, &row): (&Vector<f64, D>, &u32)| distance(vertices[row as usize % vertices.len()], *point);
    points.iter().zip(rows).map(away).fold(0.0, f64::max)
}

/// The length of a polygon.
fn length<const D: usize>(points: &[Vector<f64, D>], closed: bool) -> f64 {
    let edges = if closed { points.len() } else { points.len() - 1 };
    let edge = |k: usize| distance(points[k], points[(k + 1) % points.len()]);
    (0..edges).map(edge).sum()
}
