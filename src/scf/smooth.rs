//! [`Smooth`]: the method.

use std::collections::BTreeMap;

use super::arc::Arc;
use super::curves::{Chain, Chains, Laid, Piece};
use super::dots::{Dots, Exponents};
use super::shape::Kept;
use super::slopes::{Ends, SlopesStanding, Until};
use super::stages::{Found, Starts, search, search_on_cpu, search_on_device};
use super::start::{Start, wrap};
use super::tension::Near;
use super::workspace::Workspace;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraint;
use crate::curve::{Input, Sampling};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::{CurveReport, Fit};
use crate::status::CurveStatus;

/// Curves a task takes at least, and about as many segments.
const TASK_SEGMENTS: usize = 1024;

/// Smooth connection functions: of all curves through the data points the one of least Σ∫|κ|^ν ds,
/// exactly.
///
/// Between two points the curve is a [`Segment`](super::Segment), given by the directions at its
/// ends; those directions are found by Newton's method, whose Hessian is tridiagonal. At the
/// optimum the bending moment ν|κ|^{ν−1} sgn κ is continuous at every point, and so, where ν is the
/// same on both sides, is the curvature; free ends of open curves have none. ν → 1 leads to
/// polygons, ν → ∞ to circular arcs.
///
/// Tangents of the batch's [`Constraints`](crate::Constraints) are kept wherever they are given
/// (their lengths mean nothing); exponents (column `nu`) replace ν on the span that starts at their
/// point. Points repeated one after the other count once. Planar data only.
///
/// The minimum found is a local one, near circular arcs through neighbouring points; not every
/// curve has one: a closed triangle with ν ≤ 2, for example, grows without end unless it is near
/// equilateral. With a [`tension`](Self::tension) every curve has. Its segments are those of
/// [`TensionSegment::between`](super::TensionSegment::between), straight in the middle where ν > 2
/// and the span is long. On a GPU the kernel follows every span from trial to trial, and the host, in f64,
/// finds each at the start and at the end, and in between where it turns into one of another kind. The fit's report
/// counts the curves that the kernel did not bring to an end: the CPU has searched those from the start, as in f32
/// those of spans so unlike that their costs are beyond its range.
///
/// Accuracy: costs to about 1e-12, points to 1e-13 of the chord, directions at the tolerance asked
/// for.
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
/// shapes in the smoothest possible way*; the solution by one root a segment and Newton's method on
/// the slopes is faircurve's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smooth {
    /// ν > 1; 2 by default. Larger spreads the curvature more evenly.
    pub exponent: f64,
    /// τ ≥ 0, without unit; 0, none, by default. Under a tension what is least is Σ∫(|κ|^ν + λ) ds,
    /// with λ = (2(1 − 1/ν)τ/w)^ν, w the width that the data leave the curve in a span:
    ///
    /// ```text
    /// w = max(h′ (1 + cos θ)/2, h/10)
    /// ```
    ///
    /// h is the span's chord, h′ the shortest of it and the chords beside it, θ the larger turn of the
    /// data's polygon at its two ends; an open curve has no turn at its own ends. It is the width of
    /// [`tautness`](crate::discrete::tautness). Every list of points has such a curve. 1 keeps curves
    /// from loops, for ν = 2 as for 20; larger is tighter, up to 50, which is nearly the polygon. For
    /// large ν the curve is little bent or as bent as w allows: straight pieces, and arcs of radius
    /// some w/(2τ).
    pub tension: f64,
    /// Whether curves turn only to the side to which their points turn; no by default.
    ///
    /// A span between two points that turn to one side has curvature of that sign or none, and so has that between an end and
    /// such a neighbour. At a point between turns to different sides the curvature has the sign of the turn at the point.
    /// Points in a line, of a turn below 1e-9, are joined by straight segments. Where two lines of points meet at an angle no
    /// curve keeps both. A curve that keeps this by itself stays as it is, in every bit; the others
    /// become, on every device by the CPU in f64, the curves of least Σ∫|κ|^ν ds that keep it, to about 1e-9 of the energy.
    /// Where a side holds an end of a span, the curvature there is 0 up to rounding of angles, and curvature jumps at both
    /// points of the span; `LimitReport::active` counts these ends.
    /// Between two ends of one side neither angle to the chord exceeds the other by more than 1/q = ν/(ν − 1) times, if they
    /// are small: neighbouring turns may be too unlike for that, and for ν → ∞ they always are.
    /// Such curves are `infeasible`. Not under a tension.
    pub shape: bool,
    /// Where the search starts: at circles through neighbouring points by default. Where a segment
    /// has no minimiser there, the other starts, and exponents nearer to 2, are tried by
    /// themselves.
    pub start: Start,
    /// Searches a curve, the first from [`start`](Self::start), the others from random directions
    /// near it; the cheapest curve is kept. 1 by default.
    pub starts: u32,
    /// Seed of the random directions; 0 by default. Same seed, same curves.
    pub seed: u64,
    /// √(gᵀH⁻¹g/cost), the relative Newton decrement, at which a curve has converged: its cost is
    /// then good to half its square. Smaller is stricter; 1e-10 by default, in f32 32 ε at least.
    pub tolerance: f64,
    /// Iterations at most; 200 by default.
    pub max_iterations: u32,
}

/// Of a segment under tension that is not found.
const BEYOND: &str = "from this point to the next the curve under tension is beyond the digits of f64 where the search \
                      leads: the curve is the best one reached; give another tension or another start";

/// Searches a curve: what a thousand random starts do not find, no more of them will, and ten
/// thousand are a bound that arithmetic keeps.
const MOST_STARTS: u32 = 10_000;

/// λ of a span is then up to (1000/h)^ν: beyond it the middle of a span with ν = 2 is straighter
/// than f64 tells.
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
    /// Fits every curve of the batch.
    ///
    /// Statuses: `converged`; `no_minimiser` where segments that lead to lower costs have none, or
    /// the start has none (the curve is the best one reached, or the input polyline);
    /// `not_converged`; `infeasible` where no curve is found that keeps its shape, which comes out as without
    /// [`shape`](Self::shape); `degenerate` and `invalid`, whose curves come out as they came in. The
    /// energy is Σ∫|κ|^ν ds in units of the input, under tension Σ∫(|κ|^ν + λ) ds, the parameter the arc
    /// length.
    ///
    /// # Errors
    /// Points with three coordinates; an exponent, a tension, a tolerance or a number of starts that makes no
    /// sense; a tension for curves that keep their shape; columns `known` and `kx ky kz`; on a GPU what becomes of submissions.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        self.check(batch)?;
        let exponents = Exponents::of(self.exponent, batch)?.under(self.tension);
        let dots: Vec<Result<Dots, Unfitted>> = parallel::map(batch.len(), 64, |i| Dots::of(batch, i, &exponents));
        let ready: Vec<&Dots> = dots.iter().flatten().collect();
        device.finished(batch.len() - ready.len());
        let found = self.search(&ready, &exponents, device)?;
        let mut report = device.report(true)?;
        let found: Vec<Kept> = if self.shape {
            self.keep_shapes(&ready, &exponents, found, report.is_gpu)
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
                    fitted.map(|(report, chain)| (report.shaped(shaped, batch, i, dots), chain))
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
    /// As [`fit`](Self::fit); those of [`Sampling::check`].
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

    /// Where searches start.
    pub(crate) fn where_to_start(&self) -> Starts {
        Starts { first: self.start, count: self.starts, seed: self.seed }
    }

    /// Finds the slopes of all curves, and lays their segments.
    fn search(&self, dots: &[&Dots], exponents: &Exponents, device: &Device) -> Result<Vec<(Found, Option<Chain>)>> {
        let until = Until { tolerance: self.tolerance, iterations: self.max_iterations };
        let lay = |(found, dots): (Found, &&Dots)| {
            let chain = found.directions.as_ref().and_then(|directions| dots.lay(directions, exponents, &found.known));
            (found, chain)
        };
        if self.tension > 0.0 {
            return self.search_under_tension(dots, exponents, device, &until, lay);
        }
        if let Some(gpu) = device.as_gpu() {
            let precision = device.kernel_precision(gpu, true)?;
            let found = search(&self.where_to_start(), dots, exponents, &mut |dots, exponents, directions| {
                search_on_device(gpu, precision, dots, exponents, directions, &until)
            })?;
            // What f32 found of directions is laid, and costs, in f64.
            let priced = |(mut found, chain): (Found, Option<Chain>)| {
                if let Some(chain) = &chain {
                    found.cost = chain.cost(exponents);
                }
                (found, chain)
            };
            device.finished(dots.len());
            return Ok(parallel::of(found.into_iter().zip(dots), |own| priced(lay(own))));
        }
        let total: usize = dots.iter().map(|dots| dots.chords.lengths.len()).sum();
        let per_curve = (total / dots.len().max(1)).max(1);
        let chunk = (TASK_SEGMENTS / per_curve).max(1);
        let of_chunk = |chunk: &[&Dots]| -> Result<Vec<(Found, Option<Chain>)>> {
            let mut workspace = Workspace::new(exponents.universal.len());
            let found = search(&self.where_to_start(), chunk, exponents, &mut |dots, exponents, directions| {
                Ok(search_on_cpu(dots, exponents, directions, &until, &mut workspace))
            })?;
            device.finished(chunk.len());
            Ok(found.into_iter().zip(chunk).map(lay).collect())
        };
        let all: Vec<Vec<_>> = parallel::of(dots.chunks(chunk), of_chunk).into_iter().collect::<Result<_>>()?;
        Ok(all.into_iter().flatten().collect())
    }

    fn report(
        &self,
        batch: &CurveBatch,
        i: usize,
        dots: &Dots,
        found: &Found,
        chain: Option<Chain>,
    ) -> Result<(CurveReport, Chain), Unfitted> {
        let iterations = found.iterations;
        let say = |k: usize, what: String| batch.sentence(i, k, &what);
        const REMEDY: &str = "give a tension (`Smooth::tension`), add points where it turns, fix a tangent, or choose an exponent nearer to 1";
        let Some(chain) = chain else {
            if self.tension > 0.0 {
                let k = dots.entries[found.culprit.unwrap_or(0)];
                return Err(Unfitted { status: CurveStatus::NotConverged, message: say(k, BEYOND.into()) });
            }
            let k = dots.entries[found.culprit.unwrap_or(0)];
            let what = format!(
                "from this point to the next there is no curve of least ∫|κ|^ν, from any start tried: it would turn too far, and larger loops are \
                 always cheaper; {REMEDY}"
            );
            return Err(Unfitted { status: CurveStatus::NoMinimiser, message: say(k, what) });
        };
        let (status, message) = match found.standing {
            SlopesStanding::Converged => (CurveStatus::Converged, None),
            SlopesStanding::Unattained | SlopesStanding::Nowhere if self.tension > 0.0 => {
                (CurveStatus::NotConverged, Some(say(dots.entries[found.culprit.unwrap_or(0)], BEYOND.into())))
            }
            SlopesStanding::Unattained | SlopesStanding::Nowhere => (
                CurveStatus::NoMinimiser,
                Some(say(
                    dots.entries[found.culprit.unwrap_or(0)],
                    format!(
                        "after {iterations} iterations cheaper curves have a segment without minimiser, that from this point to the next, which \
                         turns too far: the curve is the best one reached; {REMEDY}"
                    ),
                )),
            ),
            SlopesStanding::Stalled => (
                CurveStatus::NotConverged,
                Some(say(
                    0,
                    format!(
                        "after {iterations} iterations no step leads further down, with a decrement of {:.1e} where {:.1e} was asked for: the curve is \
                         the best one reached; ask for a larger tolerance",
                        found.decrement, self.tolerance
                    ),
                )),
            ),
            SlopesStanding::Running => (
                CurveStatus::NotConverged,
                Some(say(
                    0,
                    "the device was lost before the curve was fitted: its directions are those it started from".into(),
                )),
            ),
            SlopesStanding::Exhausted => (
                CurveStatus::NotConverged,
                Some(say(
                    0,
                    format!(
                        "{iterations} iterations were not enough, with a decrement of {:.1e} where {:.1e} was asked for: allow more",
                        found.decrement, self.tolerance
                    ),
                )),
            ),
        };
        let report = CurveReport {
            status,
            message,
            energy: found.cost,
            iterations,
            gradient_norm: found.decrement,
            smoothing: None,
            gain: None,
            loops: None,
            limits: None,
            max_deviation: 0.0,
        };
        Ok((report, chain))
    }
}

impl Chain {
    /// Σ∫|κ|^ν ds, under tension Σ∫(|κ|^ν + λ) ds
    fn cost(&self, exponents: &Exponents) -> f64 {
        self.segments.iter().map(|laid| laid.cost(&exponents.universal)).sum()
    }
}

impl Dots {
    /// The segments between dots of the given directions (NaN where free), near those known; `None` where one has no
    /// minimiser.
    pub(super) fn lay(&self, directions: &[f64], exponents: &Exponents, known: &[Near]) -> Option<Chain> {
        let n = directions.len();
        let taut = if exponents.tension > 0.0 { self.tension_spans(directions, exponents) } else { Vec::new() };
        let mut segments = Vec::with_capacity(self.spans.len());
        let mut knots = Vec::with_capacity(self.spans.len() + 1);
        knots.push(0.0);
        let mut length = 0.0;
        let mut dot = 0;
        for &start in &self.spans {
            let Some(point) = start else {
                // Between repeated points.
                let start = self.points[dot % n];
                segments.push(Laid { arc: Piece::Arc(Arc::straight(0.0)), start, chord: [0.0; 2], curve: 0 });
                knots.push(length);
                continue;
            };
            debug_assert_eq!(point, dot);
            let next = (dot + 1) % n;
            let (number, chord) = (self.curves[dot], self.chords.lengths[dot]);
            let curve = &exponents.universal[number as usize];
            let angle = |dot: usize, direction: f64| wrap(direction - self.chords.directions[dot]);
            let (a, b) = (angle(dot, directions[dot]), angle(dot, directions[next]));
            let arc = if let Some(span) = taut.get(dot) {
                let [a, b] = [a, b].map(|angle| if angle.is_nan() { 0.0 } else { angle });
                let near = known.get(dot).copied().unwrap_or_default();
                Piece::Taut(Box::new(span.segment_near(&exponents.laws[number as usize], [a, b], &near)?.tabulated()))
            } else {
                Piece::Arc(match Ends::between(directions[dot], directions[next]) {
                    Ends::Directed => Arc::cheapest(curve, chord, [a, b])?,
                    Ends::FreeStart => Arc::free(curve, chord, b)?,
                    Ends::FreeEnd => Arc::free(curve, chord, -a)?.reversed(),
                    Ends::Straight => Arc::straight(chord),
                })
            };
            let ([x, y], [u, v]) = (self.points[dot], self.points[next]);
            let laid = Laid { arc, start: [x, y], chord: [u - x, v - y], curve: u32::from(number) };
            length += laid.length(&exponents.universal);
            knots.push(length);
            segments.push(laid);
            dot += 1;
        }
        Some(Chain { segments, knots })
    }
}
