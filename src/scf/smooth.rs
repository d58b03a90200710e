//! [`Smooth`]: the method of smooth connection functions.

use std::collections::BTreeMap;

use super::curves::{Chain, Chains};
use super::dots::{Dots, Exponents};
use super::problem::{SlopesStanding, Until};
use super::shape::{Kept, ShapeSearch, with_shape};
use super::stages::{Found, Starts, search, search_on_cpu, search_on_device};
use super::start::Start;
use super::taut::search_under_tension;
use super::workspace::Workspace;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraint;
use crate::curve::{Input, Sampling};
use crate::device::{Device, Work};
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::{CurveReport, Fit};
use crate::status::CurveStatus;

/// The fewest segments per task.
const TASK_SEGMENTS: usize = 1024;

/// Smooth connection functions: the exact curve of least Σ∫|κ|^ν ds through the data points.
///
/// Between two points the curve is a [`Segment`](super::Segment), determined by the directions at
/// its ends. Newton's method finds these directions; its Hessian is tridiagonal. At the optimum the
/// bending moment ν|κ|^{ν−1} sgn κ is continuous at every point, and so is the curvature if ν is
/// the same on both sides. It is 0 at the free ends of open curves. ν → 1 leads to polygons, and ν
/// → ∞ to circular arcs.
///
/// Given tangents of the batch's [`Constraints`](crate::Constraints) are kept (their lengths are
/// ignored). Given exponents (column `nu`) replace ν on the span that starts at their point.
/// Consecutive repeated points count once. The data must be planar.
///
/// The result is a local minimum near circular arcs through neighbouring points. Not every curve
/// has a minimum: a closed triangle with ν ≤ 2, for example, grows without end unless it is nearly
/// equilateral. With a [`tension`](Self::tension) every curve has one. For ν > 2 its long spans are
/// straight in the middle. Curves that the kernel of a GPU cannot finish are recomputed on the CPU
/// and counted in the report. In f32 these include curves whose span costs exceed its range.
///
/// Accuracy: costs to about 1e-12, points to 1e-13 of the chord, directions to the tolerance.
///
/// ```
/// use faircurve::{CurveBatch, CurveStatus, Device, scf};
///
/// let points = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];
/// let batch = CurveBatch::from_slices(&[&points[..]])?;
/// let fit = scf::Smooth { exponent: 4.0, ..scf::Smooth::default() }.fit(&batch, &Device::cpu())?;
/// assert_eq!(fit.reports()[0].status, CurveStatus::Converged);
/// assert!((fit.reports()[0].energy - 4.763872659).abs() < 1e-8);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// Source: A. Alon and S. Bergmann, *Connecting points by smooth connection functions defines
/// shapes in the smoothest possible way*. The solution by one root per segment and Newton's method
/// on the tangent angles is faircurve's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smooth {
    /// ν > 1; 2 by default. A larger ν spreads the curvature more evenly.
    pub exponent: f64,
    /// τ from 0 to 50, dimensionless; 0 (no tension) by default. 1 keeps curves from loops for
    /// every ν. Larger values are tighter, and 50 is nearly the polygon.
    ///
    /// The fit minimises Σ∫(|κ|^ν + λ) ds with λ = (2(1 − 1/ν)τ/w)^ν in each span. w is the width
    /// that the data leave the curve there, as in [`tautness`](crate::discrete::tautness):
    ///
    /// ```text
    /// w = max(h′ (1 + cos θ)/2, h/10)
    /// ```
    ///
    /// h is the chord of the span, h′ the shortest of it and its neighbours, and θ the larger turn
    /// of the data polygon at its two ends. For large ν the curve consists of nearly straight
    /// pieces and arcs of radius about w/(2τ).
    pub tension: f64,
    /// Whether curves turn only to the side to which their points turn; no by default. Not
    /// supported with a tension.
    ///
    /// A span between two points that turn to one side has curvature of that sign or none, and so
    /// has a span between an end and such a neighbour. At a point between turns to different sides
    /// the curvature has the sign of the turn at the point. Collinear points, with a turn below
    /// 1e-9, are joined by straight segments. If two lines of points meet at an angle, no curve
    /// keeps both.
    ///
    /// A curve that already keeps its shape is not changed. For the others the CPU computes, in f64
    /// on every device, the curve of least Σ∫|κ|^ν ds that keeps it, to about 1e-9 of the energy.
    /// If the constraint is active at an end of a span, the curvature there is 0 up to rounding of
    /// angles, and it jumps at both points of the span. `LimitReport::active` counts these ends.
    ///
    /// Between two ends of one side, small angles to the chord differ by at most a factor of ν/(ν −
    /// 1). If neighbouring turns are too unequal for that, as they always are for ν → ∞, the curve
    /// is `infeasible`.
    pub shape: bool,
    /// The start of the search: circles through neighbouring points by default. If a segment has no
    /// minimiser there, the other starts and exponents nearer to 2 are tried.
    pub start: Start,
    /// The number of searches per curve; 1 by default. The first is from [`start`](Self::start),
    /// the others from random directions near it. The cheapest curve is kept.
    pub starts: u32,
    /// The seed of the random directions; 0 by default. The same seed gives the same curves.
    pub seed: u64,
    /// √(gᵀH⁻¹g/cost), the relative Newton decrement, at which a curve has converged; 1e-10 by
    /// default, and at least 32 ε in f32. The relative error of the cost is then half of its
    /// square.
    pub tolerance: f64,
    /// The most iterations; 200 by default.
    pub max_iterations: u32,
}

/// The message for a segment under tension that is not found.
const BEYOND: &str = "from this point to the next the curve under tension is beyond the digits of f64 where the search \
                      leads: the curve is the best one reached; give another tension or another start";

/// The remedy for a segment without minimiser.
const REMEDY: &str =
    "give a tension (`Smooth::tension`), add points where it turns, fix a tangent, or choose an exponent nearer to 1";

/// The most searches per curve. More random starts are unlikely to find what a thousand did not,
/// and ten thousand keep arithmetic in range.
const MOST_STARTS: u32 = 10_000;

/// The largest tension. λ of a span is then up to (1000/h)^ν: beyond it the middle of a span with ν
/// = 2 is straighter than f64 can represent.
const MOST_TENSION: f64 = 50.0;

impl Default for Smooth {
    fn default() -> Self {
        Smooth {
            exponent: 2.0,
            tension: 0.0,
            shape: false,
            start: Start::default(),
            starts: 1,
            seed: 0,
            tolerance: 1e-10,
            max_iterations: 200,
        }
    }
}

impl Smooth {
    /// The work of a batch with this number of points, read and written together, for
    /// [`Device::choose`].
    pub fn work(&self, points: usize) -> Work {
        Work { points, cost: 10.0, on_host: if self.tension > 0.0 { 0.7 } else { 0.5 } }
    }

    /// Fits every curve of the batch.
    ///
    /// The statuses are:
    ///
    /// - `converged`: the tolerance was reached.
    /// - `no_minimiser`: segments that lead to lower costs have no minimiser, or the start has
    ///   none. The curve is the best one reached, or the input polyline.
    /// - `not_converged`: the curve is the best one reached.
    /// - `infeasible`: no curve was found that keeps its shape. The curve is fitted without
    ///   [`shape`](Self::shape).
    /// - `degenerate` and `invalid`: the curve cannot be fitted, and the result is its input.
    ///
    /// The energy is Σ∫|κ|^ν ds in units of the input, and under tension Σ∫(|κ|^ν + λ) ds. The
    /// parameter is the arc length.
    ///
    /// # Errors
    /// Points with three coordinates. An invalid exponent, tension, tolerance or number of starts.
    /// A tension together with [`shape`](Self::shape). Columns `known` and `kx ky kz`. On a GPU,
    /// errors of submissions.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        self.check(batch)?;
        let exponents = Exponents::of(self.exponent, batch)?.under(self.tension);
        let dots: Vec<Result<Dots, Unfitted>> = parallel::map(batch.len(), 64, |i| Dots::of(batch, i, &exponents));
        let ready: Vec<&Dots> = dots.iter().flatten().collect();
        device.finished(batch.len() - ready.len());
        let found = self.search(&ready, &exponents, device)?;
        let mut report = device.report(true)?;
        let found: Vec<Kept> = if self.shape {
            let (starts, until) = (self.where_to_start(), self.until());
            ShapeSearch { starts, until, exponents: &exponents, is_gpu: report.is_gpu }.mend_all(&ready, found)
        } else {
            found.into_iter().map(|(found, chain)| (found, chain, None)).collect()
        };
        if report.is_gpu {
            report.finished_on_cpu = found.iter().filter(|(found, ..)| found.on_cpu).count();
        }
        let mut found = found.into_iter();
        let (mut curves, mut reports, mut problems) = (Vec::new(), Vec::new(), BTreeMap::new());
        for (i, dots) in dots.iter().enumerate() {
            let fitted = match dots {
                Ok(dots) => {
                    let (found, chain, shaped) = found.next().expect("what is ready is searched");
                    let fitted = self.report(batch, i, dots, &found, chain);
                    fitted.map(|(report, chain)| (with_shape(report, shaped, batch, i, dots), chain))
                }
                Err(problem) => Err(problem.clone()),
            };
            match fitted {
                Ok((report, chain)) => {
                    reports.push(report);
                    curves.push(Ok(chain));
                }
                Err(problem) => {
                    reports.push(CurveReport::unfitted(problem.status, problem.message.clone()));
                    problems.insert(i, problem);
                    curves.push(Err(Input::of(batch, i)));
                }
            }
        }
        let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect();
        let times = (0..batch.len()).map(|i| batch.given_knots(i)).collect();
        let chains =
            Chains { curves, universal: exponents.universal, closed, times, problems, origin: batch.origin().clone() };
        Ok(Fit::new(chains, reports, report))
    }

    /// Fits every curve and samples it.
    ///
    /// # Errors
    /// The errors of [`fit`](Self::fit) and of [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        sampling.check(batch)?;
        let fit = self.fit(batch, device)?;
        let polylines = fit.polylines(sampling);
        Ok((fit, polylines))
    }

    pub(crate) fn check(&self, batch: &CurveBatch) -> Result<()> {
        let refuse = |why: String| Err(Error::argument(why));
        if batch.dimension() != 2 {
            return refuse(
                "smooth connection functions are planar, and the points have three coordinates: leave z out, or choose `discrete::Fair`".into(),
            );
        }
        if !(self.exponent > 1.0 && self.exponent.is_finite()) {
            return refuse(format!("the exponent is {}; it must be above 1, such as 2", self.exponent));
        }
        if !(0.0..=MOST_TENSION).contains(&self.tension) {
            return refuse(format!(
                "the tension is {}; it must be from 0, which is none, to {MOST_TENSION}, such as 1",
                self.tension
            ));
        }
        if self.shape && self.tension > 0.0 {
            return refuse(format!(
                "smooth connection functions keep the shape of their points without a tension, which is {}: leave one of both out, or \
                 choose `discrete::Fair`",
                self.tension
            ));
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return refuse(format!("the tolerance is {}; it must be a positive number, such as 1e-10", self.tolerance));
        }
        if self.starts == 0 {
            return refuse("0 starts: at least 1 is needed".into());
        }
        if self.starts > MOST_STARTS {
            let starts = self.starts;
            return refuse(format!(
                "{starts} starts: each is a search of its own, and {MOST_STARTS} are possible; give a number such as 20"
            ));
        }
        batch.allows(&[Constraint::Tangents, Constraint::Exponents, Constraint::Pinned], "smooth connection functions")
    }

    /// The starts of searches.
    pub(crate) fn where_to_start(&self) -> Starts {
        Starts { first: self.start, count: self.starts, seed: self.seed }
    }

    fn until(&self) -> Until {
        Until { tolerance: self.tolerance, iterations: self.max_iterations }
    }

    /// Finds the tangent angles of all curves, and places their segments.
    fn search(&self, dots: &[&Dots], exponents: &Exponents, device: &Device) -> Result<Vec<(Found, Option<Chain>)>> {
        let (starts, until) = (self.where_to_start(), self.until());
        let lay = |(found, dots): (Found, &&Dots)| {
            let chain =
                found.directions.as_ref().and_then(|directions| Chain::lay(dots, directions, exponents, &found.known));
            (found, chain)
        };
        if self.tension > 0.0 {
            return search_under_tension(&starts, dots, exponents, device, &until, lay);
        }
        if let Some(gpu) = device.as_gpu() {
            let precision = device.kernel_precision(gpu, true)?;
            let found = search(&starts, dots, exponents, &mut |dots, exponents, directions| {
                search_on_device(gpu, precision, dots, exponents, directions, &until)
            })?;
            // Segments for the directions from f32 are placed and evaluated in f64.
            let priced = |(mut found, chain): (Found, Option<Chain>)| {
                if let Some(chain) = &chain {
                    found.cost = chain.cost(&exponents.universal);
                }
                (found, chain)
            };
            device.finished(dots.len());
            return Ok(parallel::of(found.into_iter().zip(dots), |(found, dots)| priced(lay((found, dots)))));
        }
        let total: usize = dots.iter().map(|dots| dots.chords.lengths.len()).sum();
        let per_curve = (total / dots.len().max(1)).max(1);
        let chunk = (TASK_SEGMENTS / per_curve).max(1);
        let of_chunk = |chunk: &[&Dots]| -> Result<Vec<(Found, Option<Chain>)>> {
            let mut workspace = Workspace::new(exponents.universal.len());
            let found = search(&starts, chunk, exponents, &mut |dots, exponents, directions| {
                Ok(search_on_cpu(dots, exponents, directions, &until, &mut workspace))
            })?;
            device.finished(chunk.len());
            Ok(found.into_iter().zip(chunk).map(lay).collect())
        };
        let chunks: Vec<Vec<_>> = parallel::of(dots.chunks(chunk), of_chunk).into_iter().collect::<Result<_>>()?;
        Ok(chunks.into_iter().flatten().collect())
    }

    fn report(
        &self,
        batch: &CurveBatch,
        i: usize,
        dots: &Dots,
        found: &Found,
        chain: Option<Chain>,
    ) -> Result<(CurveReport, Chain), Unfitted> {
        let (iterations, is_under_tension) = (found.iterations, self.tension > 0.0);
        let culprit = dots.entries[found.culprit.unwrap_or(0)];
        let Some(chain) = chain else {
            let (status, what) = if is_under_tension {
                (CurveStatus::NotConverged, BEYOND.into())
            } else {
                let what = format!(
                    "from this point to the next there is no curve of least ∫|κ|^ν, from any start tried: it would turn too far, and larger \
                     loops are always cheaper; {REMEDY}"
                );
                (CurveStatus::NoMinimiser, what)
            };
            return Err(Unfitted { status, message: batch.sentence(i, culprit, &what) });
        };
        if let Some(end) = chain.knots.iter().position(|knot| !knot.is_finite()) {
            let what = "the curve from this point to the next is too long for the range of numbers: scale the curve";
            return Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, end - 1, what) });
        }
        // There is none where the Hessian has not been positive definite.
        let [how_near, longer, wider] = match found.decrement.is_finite() {
            true => {
                let decrements =
                    format!("with a decrement of {:.1e} where {:.1e} was asked for", found.decrement, self.tolerance);
                [decrements, "allow more".into(), "ask for a larger tolerance".into()]
            }
            false => ["and no minimum is near".into(), REMEDY.into(), REMEDY.into()],
        };
        let (status, point, what) = match found.standing {
            SlopesStanding::Converged => (CurveStatus::Converged, 0, None),
            SlopesStanding::Unattained | SlopesStanding::Nowhere if is_under_tension => {
                (CurveStatus::NotConverged, culprit, Some(BEYOND.into()))
            }
            SlopesStanding::Unattained | SlopesStanding::Nowhere => {
                let what = format!(
                    "after {iterations} iterations cheaper curves have a segment without minimiser, that from this point to the next, which \
                     turns too far: the curve is the best one reached; {REMEDY}"
                );
                (CurveStatus::NoMinimiser, culprit, Some(what))
            }
            SlopesStanding::Stalled => {
                let what = format!(
                    "after {iterations} iterations no step leads further down, {how_near}: the curve is the best one reached; {wider}"
                );
                (CurveStatus::NotConverged, 0, Some(what))
            }
            SlopesStanding::Running => {
                let what = "the device was lost before the curve was fitted: its directions are those it started from";
                (CurveStatus::NotConverged, 0, Some(what.into()))
            }
            SlopesStanding::Exhausted => {
                let what = format!("{iterations} iterations were not enough, {how_near}: {longer}");
                (CurveStatus::NotConverged, 0, Some(what))
            }
        };
        let message = what.map(|what: String| batch.sentence(i, point, &what));
        let gradient_norm = found.decrement;
        let report = CurveReport { status, message, iterations, gradient_norm, ..CurveReport::solved(found.cost) };
        Ok((report, chain))
    }
}
