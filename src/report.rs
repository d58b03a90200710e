//! What a fit returns: curves, and one report a curve. [`CurveStatus`] explains the statuses.

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
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CurveReport {
    /// How the fit ended.
    pub status: CurveStatus,
    /// Why, if the status needs a word: the curve, the point, the value and the remedy.
    pub message: Option<String>,
    /// The energy minimised, in the units of the input. For the splines it is ∫|p''|² dt.
    ///
    /// Infinite if it is too large for a number, NaN if nothing was fitted.
    pub energy: f64,
    /// Iterations used. 1 for a direct solve.
    pub iterations: u32,
    /// Size of the energy's gradient at the end, in the metric of the method: for Newton's the decrement. 0 for a direct solve.
    pub gradient_norm: f64,
    /// The λ of smoothing splines. `None` for other methods.
    pub smoothing: Option<f64>,
    /// The part of the energy that further starts of fair curves saved: 0.1 where the best has 90 % of the energy of the
    /// first that converged.
    ///
    /// `None` where there was one start.
    pub gain: Option<f64>,
    /// Where a fair curve is more than twice as long as the polygon of its points: how many times as long. The minimum
    /// is one with loops, which cost less than turns between the points.
    ///
    /// `None` of all others, and where points attach the curve.
    pub loops: Option<f64>,
    /// How the curve keeps its limits. `None` without limits.
    pub limits: Option<LimitReport>,
    /// Largest distance from a data point to the curve's point of the same parameter.
    ///
    /// It is in the units of the input.
    pub max_deviation: f64,
}

impl CurveReport {
    /// The report of a direct solve. Fields that differ are set afterwards.
    pub fn solved(energy: f64) -> Self {
        CurveReport {
            status: CurveStatus::Converged,
            message: None,
            energy,
            iterations: 1,
            gradient_norm: 0.0,
            smoothing: None,
            gain: None,
            loops: None,
            limits: None,
            max_deviation: 0.0,
        }
    }

    /// The report of a curve that was not fitted and comes out as its input polyline.
    pub fn unfitted(status: CurveStatus, message: String) -> Self {
        CurveReport { status, message: Some(message), energy: f64::NAN, iterations: 0, ..CurveReport::solved(0.0) }
    }

    /// The report of a curve that was fitted in pieces.
    ///
    /// It has the worst status with its sentence, the sums of energies and iterations, and the largest
    /// gradient, deviation and weight.
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

/// How a curve keeps its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LimitReport {
    /// The largest violation of a limit, 0 where all are kept.
    ///
    /// Of a largest curvature κ it is |K|/κ − 1. Of a side it is the curvature to the other, in units of 1 over the mean
    /// chord; of a direction the sine by which an edge goes back. Of a corridor or a disc it is half of the relative excess
    /// of the squared distance, of a half-plane the distance in mean chords, and of a longest length the relative excess.
    pub violation: f64,
    /// Vertices at which a limit holds the curve. A longest length holds it as a whole, and counts none.
    pub active: usize,
    /// What the limits cost: 0.1 for a curve of 1.1 times the energy of the one without limits.
    ///
    /// NaN where no minimum was found without limits. Negative where the curve came to another, lower minimum.
    pub cost: f64,
    /// The length of the curve over that of the polygon of its points.
    ///
    /// Where a limit can only be kept by loops, it is large.
    pub stretch: f64,
    /// Curves of the batch that it would cross, and is kept from by half-planes of its own. 0 but for curves that may not
    /// cross; with corners the sum of those of its pieces.
    pub neighbours: usize,
    /// Curves of the batch whose points' polygon crosses or touches its own, from which it is not kept. 0 but for curves that
    /// may not cross.
    pub touching: usize,
}

impl LimitReport {
    /// That of a curve, from the reports of its pieces.
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

/// The part of the energy that was saved in all of these, if it is known of each.
pub(crate) fn gain<'a>(reports: impl IntoIterator<Item = &'a CurveReport>) -> Option<f64> {
    let (mut before, mut after) = (0.0, 0.0);
    for report in reports {
        before += report.energy / (1.0 - report.gain?);
        after += report.energy;
    }
    Some(if before > 0.0 { 1.0 - after / before } else { 0.0 })
}

/// The curves of a method, seen through the [`Curve`] trait. A [`Fit`] holds one.
pub trait CurveSet: Send + Sync {
    /// Curve `i`.
    fn curve(&self, i: usize) -> Box<dyn Curve + '_>;

    /// All curves as polylines, in the batch's order, with the parameter of every point.
    fn polylines(&self, sampling: Sampling) -> CurveBatch;

    /// Where the samples of every curve begin, and the number of all at the end; `None` where only
    /// sampling tells.
    fn sample_offsets(&self, _: Sampling) -> Option<Vec<usize>> {
        None
    }

    /// The points of [`polylines`](Self::polylines) alone, written to memory of the caller's.
    ///
    /// # Panics
    /// If there is not room for exactly so many numbers.
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
    /// Makes a fit, also of a method of your own.
    ///
    /// There are as many reports as `curves` has curves, in the order of the batch. `device` says
    /// what did the work: see [`Device::report_of`](crate::Device::report_of).
    pub fn new(curves: impl CurveSet + 'static, mut reports: Vec<CurveReport>, device: DeviceReport) -> Self {
        // No energy is negative. One that came to ∞ − ∞ was too large for a number.
        let overflown = |report: &&mut CurveReport| report.status.is_usable() && report.energy.is_nan();
        reports.iter_mut().filter(overflown).for_each(|report| report.energy = f64::INFINITY);
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

    /// One report a curve.
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

    /// Some of the curves, in this order: the fit of [`CurveBatch::select`].
    ///
    /// # Panics
    /// If the fit has fewer curves than a number listed.
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

    /// Where the samples of every curve begin, and the number of all at the end: what
    /// [`sample_into`](Self::sample_into) needs room for.
    ///
    /// `None` where only sampling tells: at equal arc lengths, and for methods that do not know.
    pub fn sample_offsets(&self, sampling: Sampling) -> Option<Vec<usize>> {
        self.curves.sample_offsets(sampling)
    }

    /// The points of [`polylines`](Self::polylines) alone, without parameters, written to memory of the
    /// caller's: `dimension` numbers a sample.
    ///
    /// Memory that is used again, or that the system gives in large pages, costs less than new.
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
    /// If there is not room for exactly so many numbers.
    pub fn sample_into(&self, sampling: Sampling, coords: &mut [f64]) {
        self.curves.sample_into(sampling, coords);
    }

    /// Every curve as a chain of cubic Béziers within `tolerance` of it (units of the input).
    ///
    /// The points of each chain are its control points, three a piece and one more. The chain of a
    /// closed curve does not repeat its first point. Names and properties are those of
    /// [`polylines`](Self::polylines).
    ///
    /// A curve that is a single point stays one, without a piece.
    pub fn beziers(&self, tolerance: f64) -> CurveBatch {
        self.beziers_each(|_| tolerance)
    }

    /// Every curve as a chain of cubic Béziers, with a tolerance for each.
    pub fn beziers_each(&self, tolerance: impl Fn(usize) -> f64 + Sync) -> CurveBatch {
        let shape = self.polylines(Sampling::PerSpan(1));
        let chain = |i: usize| {
            let pieces = if shape.count(i) > 1 { self.curve(i).beziers(tolerance(i)) } else { Vec::new() };
            let mut points: Vec<DVec3> = pieces.iter().flat_map(|piece| &piece[..3]).copied().collect();
            match pieces.last() {
                // The last point is the very first one, bit for bit. It is dropped where the chain
                // is marked as closed.
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

/// Some curves of others.
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
