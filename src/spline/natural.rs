//! [`Natural`]: interpolating cubic splines with natural, clamped or periodic ends.
//!
//! Unknowns are the second derivatives M_i at the knots (de Boor, *A Practical Guide to Splines*,
//! chapter IV). With h_i = t_{i+1} − t_i and slopes δ_i = (y_{i+1} − y_i)/h_i, continuity of the
//! first derivative reads
//!
//! ```text
//! μ_i M_{i−1} + 2 M_i + λ_i M_{i+1} = 6 (δ_i − δ_{i−1}) / (h_{i−1} + h_i),
//! μ_i = h_{i−1} / (h_{i−1} + h_i),   λ_i = h_i / (h_{i−1} + h_i)
//! ```
//!
//! one matrix for all coordinates, dominant by a factor of two for any knots. A natural end has M =
//! 0, a clamped start 2 M_0 + M_1 = 6 (δ_0 − v) / h_0 for the given derivative v; the rows of a
//! closed curve are cyclic.

use std::ops::Range;

use super::cubic::CubicSplines;
use super::ends::{Ends, Tangents, end_tangents};
use super::gpu::{EndDerivatives, Samples};
use super::knots::{Coincident, Knots, Parametrisation};
use super::sample::EvenSites;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraint;
use crate::curve::Sampling;
use crate::device::{Device, Work};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::linalg::{Cyclic, Matrix, Part, Real, Scratch, TridiagonalBatch, take, tasks};
use crate::numbers::Numbers;
use crate::parallel;
use crate::precision::Precision;
use crate::ragged;
use crate::report::{CurveReport, CurveSet, Fit};
use crate::status::CurveStatus;

/// Interpolating cubic splines: the curve through the points with the least ∫|p″|² dt for the
/// parameters chosen.
///
/// ```
/// use faircurve::{Curve, CurveBatch, Device, Sampling, spline::Natural};
/// let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 2.0], [3.0, 1.0]][..]])?;
/// let fit = Natural::default().fit(&batch, &Device::cpu())?;
/// assert_eq!(fit.polylines(Sampling::PerSpan(8)).count(0), 17);
/// assert_eq!(fit.curve(0).jet(0, 0.0).second.length(), 0.0);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Natural {
    /// Conditions at the ends; by default clamped where a tangent is given, else natural.
    pub ends: Ends,
    /// Parameters of the points.
    pub parametrisation: Parametrisation,
    /// Whether planar curves turn only to the sides of their polygons; no by default.
    ///
    /// At a point that is the side of the polygon's turn. A span between two turns to one side
    /// turns to that side, and a span at an end to the side of its inner point. A span between
    /// turns to different sides has one inflection. Collinear points, with turns below 1e-9, are
    /// joined by straight spans. If two lines of points meet at an angle, the curve has a corner
    /// there, and its message says so.
    ///
    /// Splines with this property stay as they are. The others become the C¹ cubic spline on the
    /// same knots of least ∫|p″|² dt that keeps the shape, a local minimum. p″ is continuous except
    /// at knots with an active constraint, which
    /// [`LimitReport::active`](crate::LimitReport::active) counts. The curvature jumps there. The
    /// CPU finds these curves, on any device. If the given tangents leave no such curve, the spline
    /// stays as it is, [`Infeasible`](crate::CurveStatus::Infeasible).
    ///
    /// Source of the conditions: T. N. T. Goodman and K. Unsworth, *Shape preserving interpolation
    /// by curvature continuous parametric curves*, Computer Aided Geometric Design 5 (1988), for
    /// sides; the sign of p′ × p″ of a cubic for spans.
    pub shape: bool,
}

/// The solutions of the systems of a batch.
struct Solutions {
    /// Second derivatives at all knots.
    second: Numbers,
    /// Samples, where they were taken in the same submission.
    samples: Option<Numbers>,
    /// Curves whose solution is not finite.
    failed: Vec<usize>,
}

impl Natural {
    /// The work of a batch with this number of points, read and written together, for
    /// [`Device::choose`].
    pub fn work(&self, points: usize) -> Work {
        Work::splines(points)
    }

    /// Fits every curve of the batch.
    ///
    /// The second derivatives solve their system to a few units of rounding. Two-point curves are
    /// straight. A curve that cannot be fitted comes out as its input polyline, with a status and a
    /// sentence in its report.
    ///
    /// # Errors
    /// [`Parametrisation::Given`] without parameters; constraints no spline of this kind can meet
    /// (columns `nu` and `known`).
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        let (splines, reports) = self.fit_splines(batch, device)?;
        Ok(Fit::new(splines, reports, device.report(true)?))
    }

    /// Fits every curve and samples it, on a GPU in one submission.
    ///
    /// # Errors
    /// As [`fit`](Self::fit) and [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        sampling.check(batch)?;
        let (splines, reports, samples) = self.fit_both(batch, Some(sampling), device)?;
        let polylines = match (samples, device.as_gpu()) {
            (Some(samples), _) => splines.polylines_with(sampling, Some(samples)),
            (None, Some(gpu)) => splines.sample_on_gpu(gpu, device.kernel_precision(gpu, true)?, sampling)?,
            (None, None) => splines.polylines(sampling),
        };
        Ok((Fit::new(splines, reports, device.report(true)?), polylines))
    }

    /// As [`fit`](Self::fit), with the splines themselves.
    ///
    /// # Errors
    /// As [`fit`](Self::fit).
    pub fn fit_splines(&self, batch: &CurveBatch, device: &Device) -> Result<(CubicSplines, Vec<CurveReport>)> {
        let (splines, reports, _) = self.fit_both(batch, None, device)?;
        Ok((splines, reports))
    }

    /// Splines, reports, and samples where they were taken in the same submission.
    fn fit_both(
        &self,
        batch: &CurveBatch,
        sampling: Option<Sampling>,
        device: &Device,
    ) -> Result<(CubicSplines, Vec<CurveReport>, Option<Numbers>)> {
        let constraints = batch.constraints();
        batch.allows(&[Constraint::Tangents, Constraint::Curvatures, Constraint::Pinned], "natural splines")?;
        self.check_shape(batch)?;
        let mut knots = Knots::new(batch, self.parametrisation, Coincident::Refuse)?;
        if constraints.tangents.is_some() || constraints.curvatures.is_some() || self.ends == Ends::Clamped {
            for i in 0..batch.len() {
                if !knots.unfitted.contains_key(&i)
                    && let Err(message) = self.tangents(batch, &knots, i)
                {
                    knots.unfitted.insert(i, Unfitted { status: CurveStatus::Invalid, message });
                }
            }
        }
        let Solutions { mut second, samples, failed } = match device.as_gpu() {
            None => {
                let mut second = Numbers::room(knots.values.len());
                let failed = self.solve(batch, &knots, &mut second);
                Solutions { second, samples: None, failed }
            }
            Some(gpu) => {
                let precision = device.kernel_precision(gpu, true)?;
                self.solve_on_gpu(gpu, precision, batch, &mut knots, sampling)?
            }
        };
        let energies = parallel::map(batch.len(), 1024, |i| CubicSplines::energy(&knots, &second, i));
        let beyond = energies.iter().enumerate().filter(|(_, energy)| energy.is_none()).map(|(i, _)| i);
        for i in failed.into_iter().chain(beyond) {
            let what = "its spline leaves the range of the numbers: the spans are too short or too uneven, or the \
                        coordinates too large; scale the curve, or remove points that almost coincide";
            let message = batch.sentence(i, 0, what);
            second[knots.offsets[i] * knots.dimension..knots.offsets[i + 1] * knots.dimension].fill(0.0);
            knots.unfitted.entry(i).or_insert(Unfitted { status: CurveStatus::Invalid, message });
        }
        let mut splines = CubicSplines::new(batch, knots, second);
        let unfitted = |i: usize| splines.knots().report_unfitted(i);
        let report = |(i, energy)| unfitted(i).unwrap_or_else(|| CurveReport::solved(energy));
        let mut reports: Vec<_> = energies.into_iter().map(Option::unwrap_or_default).enumerate().map(report).collect();
        if self.shape {
            self.keep_shapes(batch, &mut splines, &mut reports);
        }
        device.finished(batch.len());
        Ok((splines, reports, samples))
    }

    /// The systems solved by the GPU, and sampled where that can be done at once.
    fn solve_on_gpu(
        &self,
        gpu: &Gpu,
        precision: Precision,
        batch: &CurveBatch,
        knots: &mut Knots,
        sampling: Option<Sampling>,
    ) -> Result<Solutions> {
        let ends = ClampedEnds { options: self, batch, knots };
        let sites = match sampling {
            Some(Sampling::Count(n)) => Some(EvenSites::new(knots, n)),
            _ => None,
        };
        let wanted = match (sampling, &sites) {
            (_, Some(sites)) => Samples::Evenly(sites),
            (Some(Sampling::PerSpan(n)), _) => Samples::PerSpan(n),
            // Where equal arc lengths lie is known only after the fit.
            _ => Samples::None,
        };
        let fitted = super::gpu::fit(gpu, precision, knots, &ends, &wanted)?;
        let mut second = fitted.second;
        let samples = (!matches!(wanted, Samples::None)).then_some(fitted.samples);
        if let Some(lost) = fitted.lost {
            for i in lost.finished..batch.len() {
                knots.leave_unfitted(batch, i, &lost.why);
            }
        }
        if fitted.overflowed.is_empty() {
            return Ok(Solutions { second, samples, failed: Vec::new() });
        }
        // Rare: numbers beyond the range of f32. The CPU fits these curves, and takes the samples
        // that are NaN here.
        let mut on_cpu = vec![0.0; second.len()];
        let failed = self.solve(batch, knots, &mut on_cpu);
        for i in fitted.overflowed {
            let range = knots.offsets[i] * knots.dimension..knots.offsets[i + 1] * knots.dimension;
            second[range.clone()].copy_from_slice(&on_cpu[range]);
        }
        Ok(Solutions { second, samples, failed })
    }

    /// The tangents at the ends of curve `i`, or why it is refused.
    fn tangents<'a>(&self, batch: &'a CurveBatch, knots: &Knots, i: usize) -> Result<Tangents<'a>, String> {
        let (n, d) = (batch.count(i), batch.dimension());
        if let Some(curvatures) = &batch.constraints().curvatures {
            let first = batch.offsets()[i];
            if let Some(k) = (0..n).find(|k| !curvatures[(first + k) * d].is_nan()) {
                return Err(batch.sentence(i, k, "a cubic spline cannot meet a curvature vector: leave it out"));
            }
        }
        end_tangents(self.ends, batch, knots, i)
    }

    /// The tangents at the ends of curve `i`, none where it is not fitted.
    pub(super) fn tangents_of<'a>(&self, batch: &'a CurveBatch, knots: &Knots, i: usize) -> Tangents<'a> {
        match batch.constraints().tangents.is_some() && !knots.unfitted.contains_key(&i) {
            true => self.tangents(batch, knots, i).unwrap_or_default(),
            false => [None, None],
        }
    }

    /// Second derivatives of all curves; returns those whose solution is not finite.
    fn solve(&self, batch: &CurveBatch, knots: &Knots, second: &mut [f64]) -> Vec<usize> {
        let (mut rest, mut work) = (second, Vec::new());
        for curves in tasks(&knots.offsets) {
            let entries = knots.offsets[curves.end] - knots.offsets[curves.start];
            work.push((curves, take(&mut rest, entries * knots.dimension)));
        }
        let ends = |i: usize| self.tangents_of(batch, knots, i);
        let failed = parallel::of(work, |(curves, second)| match knots.dimension {
            2 => solve_run::<2>(knots, curves, &ends, second),
            _ => solve_run::<3>(knots, curves, &ends, second),
        });
        failed.concat()
    }
}

/// The tangents of a batch as the kernels take them.
struct ClampedEnds<'a> {
    options: &'a Natural,
    batch: &'a CurveBatch,
    knots: &'a Knots,
}

impl EndDerivatives for ClampedEnds<'_> {
    fn end_derivative(&self, i: usize, end: usize) -> Option<&[f64]> {
        self.batch.constraints().tangents.as_ref()?;
        self.options.tangents(self.batch, self.knots, i).ok()?[end]
    }
}

/// Solves the systems of curves that follow each other, and returns those without a finite
/// solution.
fn solve_run<'a, const D: usize>(
    knots: &Knots,
    curves: Range<usize>,
    ends: &impl Fn(usize) -> Tangents<'a>,
    second: &mut [f64],
) -> Vec<usize> {
    let entries = |i: usize| knots.range(i).len();
    // The repeated entry of a closed curve is no unknown.
    let unknowns = |i: usize| entries(i) - usize::from(knots.closed[i] && entries(i) > 0);
    let offsets = ragged::offsets(curves.clone().map(unknowns));
    let rows = offsets[curves.len()];
    let (mut lower, mut diagonal, mut upper) = (vec![0.0; rows], vec![0.0; rows], vec![0.0; rows]);
    let mut rhs = vec![0.0; rows * D];
    for (k, i) in curves.clone().enumerate() {
        let own = offsets[k]..offsets[k + 1];
        if own.is_empty() {
            continue;
        }
        let (t, values) = (knots.t(i), knots.values(i).as_chunks::<D>().0);
        let bands = [&mut lower[own.clone()], &mut diagonal[own.clone()], &mut upper[own.clone()]];
        let rhs = rhs[own.start * D..own.end * D].as_chunks_mut::<D>().0;
        assemble(t, values, knots.closed[i], ends(i), bands, rhs);
    }
    let matrix = Matrix::Bands { lower: &lower, diagonal: &diagonal, upper: &upper };
    let cyclic = Cyclic::Each(&knots.closed[curves.clone()]);
    let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic };
    let part = Part { systems: &systems, range: 0..curves.len(), rhs: &rhs, columns: D };
    let (mut status, mut scratch) = (vec![CurveStatus::Converged; curves.len()], Scratch::default());
    if rows * D == second.len() {
        f64::solve_part(&part, second, &mut status, &mut scratch);
    } else {
        let mut x = vec![0.0; rows * D];
        f64::solve_part(&part, &mut x, &mut status, &mut scratch);
        let mut rest = second;
        for (k, i) in curves.clone().enumerate() {
            let (x, out) = (&x[offsets[k] * D..offsets[k + 1] * D], take(&mut rest, entries(i) * D));
            out[..x.len()].copy_from_slice(x);
            out.copy_within(0..out.len() - x.len(), x.len());
        }
    }
    curves.zip(status).filter(|(_, status)| !status.is_usable()).map(|(i, _)| i).collect()
}

/// The rows of one curve.
#[inline]
fn assemble<const D: usize>(
    t: &[f64],
    values: &[[f64; D]],
    closed: bool,
    ends: Tangents,
    [lower, diagonal, upper]: [&mut [f64]; 3],
    rhs: &mut [[f64; D]],
) {
    let last = t.len() - 1;
    let slope = |k: usize| -> (f64, [f64; D]) {
        let h = t[k + 1] - t[k];
        (h, std::array::from_fn(|c| (values[k + 1][c] - values[k][c]) / h))
    };
    diagonal.fill(2.0);
    let (mut before, mut slope_before) = slope(if closed { last - 1 } else { 0 });
    if !closed {
        // Row 0 and the last are natural, 1·M = 0, without a tangent.
        let (after, slope_after) = slope(last - 1);
        let row = |h: f64, sign: f64, slope: &[f64; D], tangent: Option<&[f64]>| match tangent {
            None => (1.0, 0.0, [0.0; D]),
            Some(v) => (2.0, 1.0, std::array::from_fn(|c| sign * 6.0 * (slope[c] - v[c]) / h)),
        };
        (diagonal[0], upper[0], rhs[0]) = row(before, 1.0, &slope_before, ends[0]);
        (diagonal[last], lower[last], rhs[last]) = row(after, -1.0, &slope_after, ends[1]);
    }
    for k in usize::from(!closed)..last {
        let (h, slope) = slope(k);
        let sum = 1.0 / (before + h);
        lower[k] = before * sum;
        upper[k] = h * sum;
        rhs[k] = std::array::from_fn(|c| 6.0 * (slope[c] - slope_before[c]) * sum);
        (before, slope_before) = (h, slope);
    }
}
