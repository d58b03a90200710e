//! [`Completed`]: completed chains, their elevation and reduction.

use super::MOST_DEGREE;
use super::curves::Chains;
use super::linear::{elevate, reduce};
use crate::batch::{CurveBatch, Unfitted};
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::report::{CurveReport, Fit};
use crate::status::CurveStatus;

/// Chains of Béziers, one per curve of the batch, with a report each.
///
/// A curve that could not be completed keeps its control points.
#[derive(Clone, Debug)]
pub struct Completed {
    pub(super) chains: Chains,
    pub(super) reports: Vec<CurveReport>,
    pub(super) device: DeviceReport,
}

impl Completed {
    /// Control points, with the names, order and closedness of the input.
    ///
    /// Pieces share their joints. A closed chain does not repeat its first point.
    pub fn control_points(&self) -> &CurveBatch {
        &self.chains.control
    }

    /// One report per curve, with the energy of its control points in the units of the input.
    pub fn reports(&self) -> &[CurveReport] {
        &self.reports
    }

    /// The degree of the pieces of curve `i`, or `None` for a curve that could not be completed.
    pub fn degree(&self, i: usize) -> Option<usize> {
        self.chains.degrees[i]
    }

    /// Which device did the work, and in which precision.
    pub fn device(&self) -> &DeviceReport {
        &self.device
    }

    /// The curves behind the trait [`Curve`](crate::Curve).
    pub fn into_fit(self) -> Fit {
        Fit::new(self.chains, self.reports, self.device)
    }

    /// Raises the degree of all pieces by `by` ([`elevate()`]).
    ///
    /// Curves that would pass [`MOST_DEGREE`] keep their degree and become `invalid`.
    ///
    /// # Errors
    /// On a GPU the errors of submissions.
    pub fn elevate(mut self, by: usize, device: &Device) -> Result<Completed> {
        self.refuse(|degree| {
            (degree.saturating_add(by) > MOST_DEGREE).then(|| {
                format!("degree {degree} cannot be elevated by {by}: degrees up to {MOST_DEGREE} are possible")
            })
        });
        let raised = elevate(&self.chains.separate().polygons(), by, device)?;
        self.chains.join(&raised);
        Ok(self)
    }

    /// Approximates all pieces by pieces of a degree lower by `by` ([`reduce()`]).
    ///
    /// Pieces keep their ends. Joints of a chain lose their smoothness. The reports' deviations
    /// bound the change. A curve whose pieces have degree `by` or less keeps them and becomes
    /// `invalid`.
    ///
    /// # Errors
    /// On a GPU the errors of submissions.
    pub fn reduce(mut self, by: usize, device: &Device) -> Result<Completed> {
        self.refuse(|degree| {
            (degree <= by).then(|| format!("degree {degree} cannot be reduced by {by}: degree 1 at least must remain"))
        });
        let (reduced, bounds) = reduce(&self.chains.separate().polygons(), by, device)?;
        let mut bounds = bounds.into_iter();
        for i in 0..self.reports.len() {
            let own = bounds.by_ref().take(self.chains.pieces(i));
            self.reports[i].max_deviation += own.fold(0.0, f64::max);
        }
        self.chains.join(&reduced);
        Ok(self)
    }

    /// Marks curves as invalid if `sentence` finds fault with their degree.
    fn refuse(&mut self, sentence: impl Fn(usize) -> Option<String>) {
        for i in 0..self.reports.len() {
            if let Some(what) = self.chains.degrees[i].and_then(&sentence) {
                let message = self.chains.control.sentence(i, 0, &what);
                self.chains.control.refuse_as(i, CurveStatus::Invalid, message.clone());
                self.reports[i] = CurveReport::unfitted(CurveStatus::Invalid, message);
                self.chains.degrees[i] = None;
            }
        }
    }
}

/// The result of a method, assembled curve by curve.
pub(super) struct Assembly<'a> {
    batch: &'a CurveBatch,
    coords: Vec<f64>,
    offsets: Vec<usize>,
    degrees: Vec<Option<usize>>,
    knots: Vec<Vec<f64>>,
    reports: Vec<CurveReport>,
}

impl<'a> Assembly<'a> {
    pub fn new(batch: &'a CurveBatch) -> Self {
        Assembly {
            batch,
            coords: Vec::with_capacity(batch.coords().len()),
            offsets: vec![0],
            degrees: Vec::with_capacity(batch.len()),
            knots: Vec::with_capacity(batch.len()),
            reports: Vec::with_capacity(batch.len()),
        }
    }

    /// Appends a completed curve. Empty `knots` stand for 0, 1, 2 ….
    pub fn push(&mut self, coords: &[f64], degree: usize, knots: Vec<f64>, report: CurveReport) {
        self.push_any(coords, Some(degree), knots, report);
    }

    /// Appends the next curve of the batch unchanged.
    pub fn push_unfitted(&mut self, Unfitted { status, message }: Unfitted) {
        let points = self.batch.points(self.reports.len());
        self.push_any(points, None, Vec::new(), CurveReport::unfitted(status, message));
    }

    fn push_any(&mut self, coords: &[f64], degree: Option<usize>, knots: Vec<f64>, report: CurveReport) {
        self.coords.extend_from_slice(coords);
        self.offsets.push(self.coords.len() / self.batch.dimension());
        self.degrees.push(degree);
        self.knots.push(knots);
        self.reports.push(report);
    }

    pub fn finish(self, device: DeviceReport) -> Completed {
        let Assembly { batch, coords, offsets, degrees, knots, reports } = self;
        let mut control = batch.with_points(coords, offsets);
        for (i, report) in reports.iter().enumerate().filter(|(i, _)| degrees[*i].is_none()) {
            control.refuse_as(i, report.status, report.message.clone().unwrap_or_default());
        }
        Completed { chains: Chains { control, degrees, knots }, reports, device }
    }
}
