//! The result of a fit: curves, and one report per curve. [`CurveStatus`] explains the statuses.

use std::fmt;
use std::sync::Arc;

use crate::batch::CurveBatch;
use crate::curve::{Curve, Sampling, vector};
use crate::device::DeviceReport;
use crate::parallel;
use crate::ragged;
use crate::status::CurveStatus;
use glam::DVec3;

/// The report of one curve.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CurveReport {
    /// How the fit ended.
    pub status: CurveStatus,
    /// An explanation of the status: the curve, the point, the value and the remedy.
    pub message: Option<String>,
    /// The minimised energy, in the units of the input: ∫|p''|² dt for splines.
    ///
    /// Infinite on overflow, NaN if nothing was fitted.
    pub energy: f64,
    /// Iterations used. 1 for a direct solve.
    pub iterations: u32,
    /// Norm of the energy's gradient at the end, in the metric of the method: the decrement for
    /// Newton's method. 0 for a direct solve.
    pub gradient_norm: f64,
    /// The λ of smoothing splines. `None` for other methods.
    pub smoothing: Option<f64>,
    /// The relative energy saved by restarts of fair curves: 0.1 if the best result has 90 % of the
    /// energy of the first that converged. `None` without restarts.
    pub gain: Option<f64>,
    /// The length of a fair curve over its data polygon's, if above 2: the minimum has loops, which
    /// cost less than turning between the points. `None` otherwise, and for attached curves.
    pub loops: Option<f64>,
    /// How the curve satisfies its limits. `None` without limits.
    pub limits: Option<LimitReport>,
    /// Largest distance from a data point to the curve's point of the same parameter, in the units
    /// of the input.
    pub max_deviation: f64,
}

impl CurveReport {
    /// The report of a direct solve with this energy. Set the fields that differ.
    pub fn solved(energy: f64) -> Self {
        CurveReport { energy, iterations: 1, ..CurveReport::default() }
    }

    /// The report of a curve that was not fitted and is returned as its input polyline.
    pub fn unfitted(status: CurveStatus, message: String) -> Self {
        CurveReport { status, message: Some(message), energy: f64::NAN, ..CurveReport::default() }
    }

    /// The report of a curve that was fitted in pieces.
    ///
    /// It has the worst status and its message, the sums of energies and iterations, and the
    /// largest gradient, deviation and λ.
    pub(crate) fn joined(pieces: Vec<CurveReport>) -> Self {
        let join = |mut joined: CurveReport, next: CurveReport| {
            joined.gain = gain([&joined, &next]);
            joined.loops = [joined.loops, next.loops].into_iter().flatten().reduce(f64::max);
            joined.limits = LimitReport::joined([&joined, &next]);
            let [so_far, severity] = [&joined, &next].map(|report| report.status.severity());
            if severity > so_far || (severity == so_far && joined.message.is_none()) {
                (joined.status, joined.message) = (next.status, next.message);
            }
            joined.energy += next.energy;
            joined.iterations += next.iterations;
            joined.gradient_norm = joined.gradient_norm.max(next.gradient_norm);
            joined.max_deviation = joined.max_deviation.max(next.max_deviation);
            joined.smoothing = joined.smoothing.zip(next.smoothing).map(|(a, b)| a.max(b));
            joined
        };
        pieces.into_iter().reduce(join).unwrap_or_else(|| CurveReport::solved(0.0))
    }
}

/// How a curve satisfies its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LimitReport {
    /// The largest violation of a limit, 0 if all are satisfied.
    ///
    /// For a largest curvature κ it is |K|/κ − 1. For a side it is the curvature to the other side
    /// in units of 1 / mean chord, for a direction the sine by which an edge goes back. For a
    /// corridor or a disc it is half the relative excess of the squared distance, for a half-plane
    /// the distance in mean chords, for a longest length the relative excess.
    pub violation: f64,
    /// Number of vertices with an active limit. A longest length does not count.
    pub active: usize,
    /// The relative increase of the energy over the curve without limits: 0.1 for 1.1 times the
    /// energy.
    ///
    /// NaN if no minimum was found without limits. Negative if the curve reached another, lower
    /// minimum.
    pub cost: f64,
    /// The length of the curve over its data polygon's. Large if only loops satisfy a limit.
    pub stretch: f64,
    /// Number of curves that it would cross and is separated from by half-planes. With corners, the
    /// sum over its pieces. 0 unless curves may not cross.
    pub neighbours: usize,
    /// Number of curves whose data polygon crosses or touches its own, from which it is not
    /// separated. 0 unless curves may not cross.
    pub touching: usize,
}

impl LimitReport {
    /// The report of a curve from the reports of its pieces.
    pub(crate) fn joined<'a>(pieces: impl IntoIterator<Item = &'a CurveReport>) -> Option<Self> {
        // The energies with limits and without.
        let (mut energy, mut free) = (0.0, 0.0);
        let mut joined: Option<Self> = None;
        for piece in pieces {
            let own = piece.limits;
            energy += piece.energy;
            free += piece.energy / (1.0 + own.map_or(0.0, |own| own.cost));
            let Some(own) = own else { continue };
            joined = Some(joined.map_or(own, |so_far| LimitReport {
                violation: so_far.violation.max(own.violation),
                active: so_far.active + own.active,
                stretch: so_far.stretch.max(own.stretch),
                neighbours: so_far.neighbours + own.neighbours,
                touching: so_far.touching + own.touching,
                cost: 0.0,
            }));
        }
        let cost = if free == 0.0 { 0.0 } else { energy / free - 1.0 };
        joined.map(|joined| LimitReport { cost, ..joined })
    }
}

/// The relative energy saved over all reports, if each has it.
pub(crate) fn gain<'a>(reports: impl IntoIterator<Item = &'a CurveReport>) -> Option<f64> {
    let (mut before, mut after) = (0.0, 0.0);
    for report in reports {
        before += report.energy / (1.0 - report.gain?);
        after += report.energy;
    }
    Some(if before > 0.0 { 1.0 - after / before } else { 0.0 })
}

/// The curves of a method behind the [`Curve`] trait. A [`Fit`] holds one.
pub trait CurveSet: Send + Sync {
    /// Curve `i`.
    fn curve(&self, i: usize) -> Box<dyn Curve + '_>;

    /// All curves as polylines, in the batch's order, with the parameter of every point.
    fn polylines(&self, sampling: Sampling) -> CurveBatch;

    /// The first sample of every curve, and the total number at the end. `None` if it is not known
    /// before sampling.
    fn sample_offsets(&self, _: Sampling) -> Option<Vec<usize>> {
        None
    }

    /// Writes the points of [`polylines`](Self::polylines) to the caller's memory.
    ///
    /// # Panics
    /// If `coords` has another length.
    fn sample_into(&self, sampling: Sampling, coords: &mut [f64]) {
        coords.copy_from_slice(self.polylines(sampling).coords());
    }
}

/// The result of a fit: a curve and a [`CurveReport`] for every curve of the batch, in its order.
///
/// A clone shares the curves.
#[derive(Clone)]
pub struct Fit {
    curves: Arc<dyn CurveSet>,
    reports: Vec<CurveReport>,
    device: DeviceReport,
}

impl fmt::Debug for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Fit").field("reports", &self.reports).field("device", &self.device).finish_non_exhaustive()
    }
}

impl Fit {
    /// Makes a fit, also for methods outside this crate.
    ///
    /// `reports` has one report per curve, in the order of the batch. For `device` see
    /// [`Device::report_of`](crate::Device::report_of).
    pub fn new(curves: impl CurveSet + 'static, mut reports: Vec<CurveReport>, device: DeviceReport) -> Self {
        // The energy of a fitted curve is NaN if it overflowed to ∞ − ∞.
        for report in &mut reports {
            if report.status.is_usable() && report.energy.is_nan() {
                report.energy = f64::INFINITY;
            }
        }
        Fit { curves: Arc::new(curves), reports, device }
    }

    /// Number of curves.
    pub fn len(&self) -> usize {
        self.reports.len()
    }

    /// Whether there is no curve at all.
    pub fn is_empty(&self) -> bool {
        self.reports.is_empty()
    }

    /// Curve `i`.
    pub fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        self.curves.curve(i)
    }

    /// One report per curve.
    pub fn reports(&self) -> &[CurveReport] {
        &self.reports
    }

    /// Which device did the work, and in which precision.
    pub fn device(&self) -> &DeviceReport {
        &self.device
    }

    /// Number of curves whose status is usable.
    pub fn usable(&self) -> usize {
        self.reports.iter().filter(|report| report.status.is_usable()).count()
    }

    /// The listed curves in this order, as by [`CurveBatch::select`].
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn select(&self, curves: &[usize]) -> Fit {
        let reports = curves.iter().map(|&i| self.reports[i].clone()).collect();
        let curves = Selected { whole: self.curves.clone(), curves: curves.to_vec() };
        Fit::new(curves, reports, self.device.clone())
    }

    /// Every curve as a polyline, with the parameter of every point.
    ///
    /// Names, properties and closedness are those of the input.
    pub fn polylines(&self, sampling: Sampling) -> CurveBatch {
        self.curves.polylines(sampling)
    }

    /// The first sample of every curve, and the total number at the end.
    ///
    /// `None` if it is not known before sampling: at equal arc lengths, and for some methods.
    pub fn sample_offsets(&self, sampling: Sampling) -> Option<Vec<usize>> {
        self.curves.sample_offsets(sampling)
    }

    /// Writes the points of [`polylines`](Self::polylines) to the caller's memory, `dimension`
    /// numbers per sample. Reused memory saves its allocation.
    ///
    /// ```
    /// use faircurve::{CurveBatch, Device, Sampling, spline::Natural};
    /// let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 2.0], [3.0, 1.0]][..]])?;
    /// let fit = Natural::default().fit(&batch, &Device::cpu())?;
    /// let sampling = Sampling::Count(80);
    /// let offsets = fit.sample_offsets(sampling).expect("a number of samples is known before");
    /// let mut coords = vec![0.0; offsets[batch.len()] * batch.dimension()];
    /// fit.sample_into(sampling, &mut coords);
    /// assert_eq!(coords, fit.polylines(sampling).coords());
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    ///
    /// # Panics
    /// If `coords` has another length.
    pub fn sample_into(&self, sampling: Sampling, coords: &mut [f64]) {
        self.curves.sample_into(sampling, coords);
    }

    /// Every curve as a chain of cubic Béziers within `tolerance` of it (units of the input).
    ///
    /// The points of each chain are its control points, three per piece and one more. The chain of
    /// a closed curve does not repeat its first point. Names and properties are kept. A single
    /// point has no piece.
    pub fn beziers(&self, tolerance: f64) -> CurveBatch {
        self.beziers_each(|_| tolerance)
    }

    /// Every curve as a chain of cubic Béziers, with a tolerance for each.
    pub fn beziers_each(&self, tolerance: impl Fn(usize) -> f64 + Sync) -> CurveBatch {
        self.chains(|i| self.curve(i).beziers(tolerance(i)))
    }

    /// Every curve as a chain of as few cubic Béziers as a tolerance for each allows:
    /// [`Curve::fewest_beziers`].
    pub fn fewest_beziers_each(&self, tolerance: impl Fn(usize) -> f64 + Sync, extremes: bool) -> CurveBatch {
        self.chains(|i| self.curve(i).fewest_beziers(tolerance(i), extremes))
    }

    /// Chains of these Béziers.
    fn chains(&self, beziers: impl Fn(usize) -> Vec<[DVec3; 4]> + Sync) -> CurveBatch {
        let shape = self.polylines(Sampling::PerSpan(1));
        let chain = |i: usize| {
            let pieces = if shape.count(i) > 1 { beziers(i) } else { Vec::new() };
            let mut points: Vec<DVec3> = pieces.iter().flat_map(|piece| &piece[..3]).copied().collect();
            match pieces.last() {
                // The last point equals the first, and `closed_each` drops it.
                Some(_) if shape.is_closed(i) => points.push(points[0]),
                Some(piece) => points.push(piece[3]),
                None => points.extend(shape.points(i).chunks_exact(shape.dimension()).map(vector).take(1)),
            }
            points
        };
        let chains: Vec<Vec<DVec3>> = parallel::map(self.len(), 1, chain);
        let offsets = ragged::offsets(chains.iter().map(Vec::len));
        let coords = chains.iter().flatten().flat_map(|p| p.to_array().into_iter().take(shape.dimension())).collect();
        let closed = (0..self.len()).map(|i| shape.is_closed(i)).collect();
        CurveBatch::from_ragged(shape.dimension(), coords, offsets)
            .and_then(|batch| batch.closed_each(closed))
            .expect("offsets and flags were counted above")
            .with_origin(shape.origin().clone())
            .with_problems_of(&shape)
    }

    /// Curves and reports, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Box<dyn Curve + '_>, &CurveReport)> {
        self.reports.iter().enumerate().map(|(i, report)| (self.curve(i), report))
    }
}

/// Some curves of a set.
struct Selected {
    whole: Arc<dyn CurveSet>,
    curves: Vec<usize>,
}

impl CurveSet for Selected {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        self.whole.curve(self.curves[i])
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        self.whole.polylines(sampling).select(&self.curves)
    }
}

impl<'a> IntoIterator for &'a Fit {
    type Item = (Box<dyn Curve + 'a>, &'a CurveReport);
    type IntoIter = Box<dyn ExactSizeIterator<Item = Self::Item> + 'a>;

    fn into_iter(self) -> Self::IntoIter {
        Box::new(self.iter())
    }
}
