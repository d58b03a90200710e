//! [`Fair`]: the method.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::corners::Corners;
use super::curves::{FairCurves, Fitted, Vertices};
use super::deviation;
use super::energy::{Energy, bending};
use super::lane::Standing;
use super::plan::{Direction, Step};
use super::problem::Outcome;
use super::setup::{LONGEST, Ready, set_up_pieces};
use super::tally::Tally;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraint;
use crate::curve::{Sampling, check_spacing, spans};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::memory;
use crate::report::{CurveReport, Fit};
use crate::status::CurveStatus;
use crate::words::words;

/// A gradient left at so many times the tolerance is rounding, above it the curve's own trouble.
const ROUNDING_REACHES: f64 = 1e3;

/// What has not converged after so many iterations does not with ten times as many, as measured
/// with borders of countries.
const ENOUGH_ITERATIONS: u32 = 200;

/// A curve that has not converged and is this many times as long as its chord polygon is no curve
/// to be shown: a half circle through two points is 1.57 times, and no curve that converged was
/// seen to pass 1.23 on its way.
const ASTRAY: f64 = 2.0;

/// Memory that a vertex takes while all curves are descended, a dimension: 110 bytes were measured
/// in the plane, with its share of the samples.
const VERTEX_BYTES: usize = 56;

/// How spans between data points are divided into edges.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Segments {
    /// So many edges a span.
    PerSpan(usize),
    /// Edges of about this length at most, in units of the input.
    Spacing(f64),
}

impl Segments {
    /// Vertices that a spacing may ask for, of all curves together: they take some 2 GB while they
    /// are fitted.
    pub const MOST_VERTICES: usize = 5_000_000;
}

/// Which data points the curve passes through exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pins {
    /// All.
    #[default]
    All,
    /// The first and the last of open curves; the energy attaches the others.
    Ends,
    /// None; the energy attaches them.
    None,
}

words!(Pins, "choice of points": [
    (All, "all", "Every point stays where it is"),
    (Ends, "ends", "The first and the last point of open curves stay where they are"),
    (None, "none", "Every point may move"),
]);

/// Discrete fair curves: of all curves through (or attached to) the data points the one of least
/// energy, as a polygon of many vertices.
///
/// Starts from the natural, or periodic, spline through the points and goes down by Newton's
/// method, damped in the Sobolev metric that suits the energy (see [`Energy`] and [`Direction`]),
/// with a gauge that keeps edges between data points equal and takes nothing from the shape. Gentle
/// curves of least bending take about 3 iterations, rough ones 10, however many vertices they have.
/// Exponents of bending beyond 5, and below 1.5, are approached in stages.
///
/// The minimum found is a local one, the one down from the spline. Gentle data have no other near;
/// rough data do: of 60 rough curves in bending and 0.1 of length, random starts found an energy
/// lower by more than 1 % for 19, and by more than 10 % for 14.
///
/// Tangents and curvature vectors of the batch's [`Constraints`](crate::Constraints) are met: a
/// tangent τ by f_{i+1} − f_{i−1} ∥ τ, a curvature vector k ⊥ τ exactly, by (T′ − T)/Δa = k.
///
/// Accuracy: the polygon's energy is that of the smooth curve of least energy to O(h²), h the
/// length of an edge. On a GPU curves agree with those of the CPU to 1e-9 of their size in f64, and
/// 1e-5 in f32 (1e-6 up to 64 edges). Where the precision is left to the program, what f32 cannot
/// finish is finished by the CPU.
///
/// ```
/// use faircurve::discrete::{Fair, bending, length};
/// use faircurve::{CurveBatch, CurveStatus, Device};
///
/// let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]];
/// let batch = CurveBatch::from_slices(&[&points[..]])?;
/// let fair = Fair { energy: bending(2.0) + 0.1 * length(), ..Fair::default() };
/// let fit = fair.fit(&batch, &Device::cpu())?;
/// assert_eq!(fit.reports()[0].status, CurveStatus::Converged);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006); gauge, metric at
/// pins and curvature constraints are faircurve's.
#[derive(Clone, Debug)]
pub struct Fair {
    /// What is minimised; bending ∫κ² ds by default. Weights are in units of the input.
    pub energy: Energy,
    /// 16 edges a span by default. Finer is closer to the smooth curve, by h².
    pub segments: Segments,
    /// All points are passed through, unless the energy holds an [`attachment`](super::attachment).
    pub pins: Pins,
    /// Near the points instead: the largest distance D > 0 between a data point and its vertex, in
    /// units of the input. Every curve is attached to its points with the smallest weight α that
    /// keeps it, as [`attachment`](super::attachment) would with that weight: smaller is closer.
    /// Ends of open curves are pinned, unless pins are [`Pins::None`]. `None`, the default,
    /// searches for nothing.
    ///
    /// Weights tried are 0.54 % apart, between one so weak that the curve is as fair as its ends
    /// let it be, and one so strong that it goes through its points but for rounding; the report
    /// says the one found ([`smoothing`](CurveReport::smoothing)). Where none is strong enough the
    /// curve goes through its points, converged, with a message. The way leads from the smoothing
    /// spline that keeps the deviation (from one that keeps less where it might vanish; from the
    /// natural spline where tangents are given) along curves that keep it; where minima end,
    /// deviations jump, and the curve before the jump is taken. Rough curves may have no minimum
    /// near, at any weight: without length in the energy they swing out into loops. Those are
    /// `not_converged`, and the curve is the spline. Curves of 8 segments a span and more are
    /// searched for at 4 first. The energy reported has no attachment in it, iterations are those
    /// of all weights tried.
    pub deviation: Option<f64>,
    /// Corners are kept: curves are cut at data points where the polygon of the data turns by more
    /// than this angle, in radians from 0 to π, unless they have a tangent of their own. The pieces
    /// are fitted as open curves, free to leave a corner in any direction, with the corner pinned;
    /// in the report stand the worst status with its message, sums of energies and iterations, and
    /// the largest of the rest. Curvatures leave out what the curve turns at a corner, where each
    /// side has its own. `None`, the default, cuts nothing.
    pub corners: Option<f64>,
    /// How curves go down: by Newton's method unless asked for otherwise. Energies of order 1 are
    /// descended along their Sobolev gradients, which lead to the minimum in a few steps.
    pub direction: Direction,
    /// How far each step goes.
    pub step: Step,
    /// √⟨g, L⁻¹g⟩ at which a curve has converged: the size of the gradient in the Sobolev metric,
    /// with the curve scaled to size 1 and the energy to weight 1 of its highest order (of |κ|^ν to
    /// κ̄^(2 − ν), κ̄ the mean curvature of the start). Smaller is stricter; 1e-8 by default. In
    /// f32 at least 1.1 ε √E/h, which rounding leaves.
    pub tolerance: f64,
    /// Iterations at most; 500 by default.
    pub max_iterations: u32,
}

impl Default for Fair {
    fn default() -> Self {
        Fair {
            energy: bending(2.0),
            segments: Segments::PerSpan(16),
            pins: Pins::default(),
            deviation: None,
            corners: None,
            direction: Direction::default(),
            step: Step::default(),
            tolerance: 1e-8,
            max_iterations: 500,
        }
    }
}

impl Fair {
    /// Fits every curve of the batch.
    ///
    /// Statuses: `converged`; `not_converged` (the curve is the best one reached, or its input
    /// where that is more than twice as long as the points' polygon); `unbounded` where, without
    /// length and tension in the energy, the curve grows past five times its chord polygon while
    /// its energy falls: bending alone often has no minimum; `degenerate` and `invalid`. Curves of
    /// the last three come out as their input. The energy reported is the weighted sum asked for,
    /// in units of the input, without the gauge.
    ///
    /// Curves are counted at the device's [counter](Device::with_counter) as they are finished,
    /// those cut at [`corners`](Self::corners) with their last piece.
    ///
    /// # Errors
    /// Weights that are negative or not finite, no energy at all, an exponent below 1, a tolerance,
    /// a number of segments or pins that make no sense; a spacing that makes more than
    /// [`Segments::MOST_VERTICES`]; columns `nu` and `known`; on a GPU what becomes of submissions.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        self.check(batch)?;
        match batch.dimension() {
            2 => self.fit_in::<2>(batch, device),
            _ => self.fit_in::<3>(batch, device),
        }
    }

    /// Fits every curve and samples it. Where the sampling is [`Sampling::PerSpan`] of as many as
    /// there are [`segments`](Self::segments) a span, the samples are the vertices.
    ///
    /// # Errors
    /// As [`fit`](Self::fit); those of [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        sampling.check(batch)?;
        let fit = self.fit(batch, device)?;
        let polylines = fit.polylines(sampling);
        Ok((fit, polylines))
    }

    fn check(&self, batch: &CurveBatch) -> Result<()> {
        let refuse = |why: String| Err(Error::argument(why));
        self.energy.check()?;
        if self.energy.order() == 0 {
            return refuse(
                "the energy has no fairness in it: give bending, variation, length or tension a positive weight".into(),
            );
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return refuse(format!("the tolerance is {}; it must be a positive number, such as 1e-8", self.tolerance));
        }
        match self.segments {
            Segments::PerSpan(0) => return refuse("0 segments a span: at least 1 is needed, such as 16".into()),
            Segments::PerSpan(n) => {
                let (vertices, bytes) = (n as f64 * spans(batch), VERTEX_BYTES * batch.dimension());
                memory::check(vertices, bytes, &format!("{n} segments a span"), "ask for fewer")?;
            }
            Segments::Spacing(spacing) => check_spacing(batch, spacing, "vertices", Segments::MOST_VERTICES)?,
        }
        if let Some(allowed) = self.deviation {
            deviation::check(self, allowed)?;
        }
        if let Some(angle) = self.corners.filter(|angle| !(0.0..=PI).contains(angle)) {
            return refuse(format!(
                "the angle of corners is {angle}; angles from 0 to π are possible, such as 1.05 (60°)"
            ));
        }
        let attached = self.energy.attachment_weight() > 0.0 || self.deviation.is_some();
        if self.pins != Pins::All && !attached {
            return refuse(
                "points that are not pinned need an attachment, or the curve would not know of them: add attachment \
                 to the energy, or pin all points"
                    .into(),
            );
        }
        if self.pins == Pins::All && attached && self.deviation.is_none() {
            return refuse(
                "the energy attaches the curve to points that are all pinned: pin the ends only, or none, or leave \
                 the attachment out"
                    .into(),
            );
        }
        batch.allows(&[Constraint::Tangents, Constraint::Curvatures], "fair curves")
    }

    fn fit_in<const D: usize>(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        let fitted = match self.corners {
            Some(angle) => {
                let cut = Corners::cut::<D>(batch, angle);
                let tally = Tally::of_pieces(device, cut.curves());
                cut.join(batch, self.fit_pieces::<D>(&cut.batch, &cut.kept, device, &tally)?)
            }
            None => self.fit_pieces::<D>(batch, &[], device, &Tally::whole(device))?,
        };
        let Fitted { curves, reports, device } = fitted;
        let mut problems = BTreeMap::new();
        for (i, report) in reports.iter().enumerate().filter(|(i, _)| curves[*i].is_err()) {
            let message = report.message.clone().unwrap_or_default();
            problems.insert(i, Unfitted { status: report.status, message });
        }
        let curves = FairCurves::new(batch, curves, problems);
        Ok(Fit::new(curves, reports, device))
    }

    /// Fits curves that have no corners; `kept` says which keep their ends whatever the pins say.
    fn fit_pieces<const D: usize>(
        &self,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        device: &Device,
        tally: &Tally<'_>,
    ) -> Result<Fitted> {
        if let Some(allowed) = self.deviation {
            return deviation::fit::<D>(self, allowed, batch, kept, device, tally);
        }
        let ready = set_up_pieces::<D>(self, batch, kept)?;
        let (able, unable): (Vec<usize>, Vec<usize>) = (0..ready.len()).partition(|&i| ready[i].is_ok());
        unable.into_iter().for_each(|i| tally.finished(i));
        let (outcomes, device) = self.descend(&ready, device, &|k, _| tally.finished(able[k]))?;
        let mut outcomes = outcomes.into_iter();
        let (mut curves, mut reports) = (Vec::with_capacity(batch.len()), Vec::with_capacity(batch.len()));
        for (i, ready) in ready.iter().enumerate() {
            let (report, vertices) = match ready {
                Ok(ready) => self.report(batch, i, ready, &outcomes.next().expect("what is ready is descended")),
                Err(problem) => (CurveReport::unfitted(problem.status, problem.message.clone()), None),
            };
            curves.push(vertices.ok_or_else(|| batch.points(i).to_vec()));
            reports.push(report);
        }
        Ok(Fitted { curves, reports, device })
    }

    /// The report of a curve, and its vertices unless its energy was no number.
    pub(super) fn report<const D: usize>(
        &self,
        batch: &CurveBatch,
        i: usize,
        ready: &Ready<D>,
        outcome: &Outcome<D>,
    ) -> (CurveReport, Option<Vertices>) {
        let say = |what: String| Some(batch.sentence(i, 0, &what));
        let (norm, iterations) = (outcome.norm, outcome.iterations);
        let (status, message) = match outcome.standing {
            Standing::Converged => (CurveStatus::Converged, None),
            Standing::Unbounded => {
                let what = format!(
                    "its length passed {LONGEST} times that of its points' polygon after {iterations} iterations while its energy fell: \
                     this energy has no minimum here, and the curve stays as it is; add length to it, such as length={:.1e}",
                    self.enough_length(ready)
                );
                let report = CurveReport::unfitted(CurveStatus::Unbounded, batch.sentence(i, 0, &what));
                return (CurveReport { iterations, ..report }, None);
            }
            Standing::Broken => {
                let what = "its energy is no number: neighbouring points are too close for its size, or it turns back on \
                            itself; remove points that almost coincide";
                let report = CurveReport::unfitted(CurveStatus::Invalid, batch.sentence(i, 0, what));
                return (report, None);
            }
            Standing::Stalled => (
                CurveStatus::NotConverged,
                say(format!(
                    "after {iterations} iterations no step leads further down, with a gradient of {norm:.1e} where {:.1e} was asked for: \
                     the curve is the best one reached; {}",
                    ready.problem.tolerance,
                    if norm <= ROUNDING_REACHES * ready.problem.tolerance {
                        format!("ask for a larger tolerance, such as {:.0e}", 10.0 * norm)
                    } else {
                        self.remedy(ready)
                    }
                )),
            ),
            Standing::Running => (
                CurveStatus::NotConverged,
                say("the device was lost before the curve was fitted: it is the spline it would have started from"
                    .into()),
            ),
            Standing::Exhausted => (
                CurveStatus::NotConverged,
                say(format!(
                    "{iterations} iterations were not enough, with a gradient of {norm:.1e} where {:.1e} was asked for: {}",
                    ready.problem.tolerance,
                    if iterations < ENOUGH_ITERATIONS { "allow more".into() } else { self.remedy(ready) }
                )),
            ),
        };
        let place = |(vertex, u): (&Vector<f64, D>, &Vector<f64, D>)| add(*vertex, scale(ready.size, *u));
        let vertices: Vec<Vector<f64, D>> = ready.vertices.iter().zip(&outcome.displacements).map(place).collect();
        let points = batch.points(i).as_chunks::<D>().0;
        let times = length(&vertices, ready.problem.closed) / length(points, ready.problem.closed);
        // What is attached keeps to its points, and small rings may grow round.
        let astray = times > ASTRAY && ready.problem.attached.is_empty();
        if status == CurveStatus::NotConverged && astray {
            let what = format!(
                "after {iterations} iterations it has not converged, and is {times:.1} times as long as its points' polygon: it is on its way into \
                 loops, and stays as it is; {}",
                self.remedy(ready)
            );
            let report = CurveReport::unfitted(status, batch.sentence(i, 0, &what));
            return (CurveReport { iterations, ..report }, None);
        }
        let report = CurveReport {
            status,
            message,
            energy: outcome.energy * ready.energy_unit,
            iterations,
            gradient_norm: norm,
            smoothing: None,
            max_deviation: deviation::deviation(&vertices, &ready.rows, points),
        };
        let coords = vertices.into_iter().flatten().collect();
        (report, Some(Vertices { coords, rows: ready.rows.clone(), corners: vec![] }))
    }

    /// What helps a curve that does not converge.
    pub(super) fn remedy<const D: usize>(&self, ready: &Ready<D>) -> String {
        if self.energy.bounds_length() {
            "ask for more segments a span, or weigh length and tension less".into()
        } else {
            format!("add length to the energy, such as length={:.1e}", self.enough_length(ready))
        }
    }

    /// A weight of length that holds a curve of this size: at size 1 that of the highest order.
    fn enough_length<const D: usize>(&self, ready: &Ready<D>) -> f64 {
        ready.energy_unit / ready.size * 10.0
    }
}

/// Length of a polygon.
fn length<const D: usize>(points: &[Vector<f64, D>], closed: bool) -> f64 {
    let edges = if closed { points.len() } else { points.len() - 1 };
    let edge = |k: usize| {
        let away = subtract(points[(k + 1) % points.len()], points[k]);
        dot(away, away).sqrt()
    };
    (0..edges).map(edge).sum()
}
