//! [`Smoothing::fit`]: batches, on the CPU or a GPU.

use std::mem::discriminant;
use std::sync::Arc;

use super::cubic::CubicSplines;
use super::knots::{Coincident, Knots};
use super::smoother::{Slot, Smoother};
use super::smoothing::{OfCurve, Smoothing, SmoothingTarget};
use super::smoothing_gpu::fit_on_gpu;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::Sampling;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::{take, tasks};
use crate::numbers::Numbers;
use crate::parallel;
use crate::report::{CurveReport, CurveSet, Fit};
use crate::status::CurveStatus;

impl Smoothing {
    /// Fits every curve of a batch.
    ///
    /// Reports: energy ∫|p″|² dt, λ, largest deviation from a data point, number of solves. A curve
    /// that cannot be fitted (see [`CurveBatch::problem`]; fewer than two different parameters)
    /// keeps its points and says why.
    ///
    /// # Errors
    /// λ that is negative, infinite or NaN; a deviation that is not positive and finite;
    /// [`Parametrisation::Given`](super::Parametrisation::Given) without parameters; constraints other than pinned points.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        let device = &self.worker(device);
        let (splines, reports) = self.fit_splines(batch, device)?;
        Ok(Fit::new(splines, reports, device.report(false)?))
    }

    /// Fits every curve and samples it on the same device.
    ///
    /// # Errors
    /// As [`fit`](Self::fit) and [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        sampling.check(batch)?;
        let device = &self.worker(device);
        let (splines, reports) = self.fit_splines(batch, device)?;
        let polylines = match device.as_gpu() {
            Some(gpu) => splines.sample_on_gpu(gpu, device.kernel_precision(gpu, false)?, sampling)?,
            None => splines.polylines(sampling),
        };
        Ok((Fit::new(splines, reports, device.report(false)?), polylines))
    }

    /// Fits every curve with a target per curve, all of the kind of [`target`](Self::target): λ or distances.
    ///
    /// # Errors
    /// As [`fit`](Self::fit), for any of the targets. Another number of targets than curves, or another kind.
    pub fn fit_each(&self, batch: &CurveBatch, targets: &[SmoothingTarget], device: &Device) -> Result<Fit> {
        if targets.len() != batch.len() {
            let (given, curves) = (targets.len(), batch.len());
            return Err(Error::argument(format!("{given} targets are given for {curves} curves: give one per curve")));
        }
        for target in targets {
            if discriminant(target) != discriminant(&self.target) {
                return Err(Error::argument(
                    "targets of several kinds are given: give each kind in a fit of its curves",
                ));
            }
            Smoothing { target: *target, ..*self }.check(batch)?;
        }
        let device = &self.worker(device);
        let (splines, reports) = self.fit_by(batch, device, &|i| Smoothing { target: targets[i], ..*self })?;
        Ok(Fit::new(splines, reports, device.report(false)?))
    }

    /// As [`fit`](Self::fit), with the splines themselves.
    ///
    /// # Errors
    /// As [`fit`](Self::fit).
    pub fn fit_splines(&self, batch: &CurveBatch, device: &Device) -> Result<(CubicSplines, Vec<CurveReport>)> {
        self.fit_by(batch, device, &|_| *self)
    }

    /// [`fit_splines`](Self::fit_splines) on the CPU, with a radius for every data point in units of the
    /// distance asked for. Reported deviations are in these units, too.
    pub(crate) fn fit_with_radii(
        &self,
        batch: &CurveBatch,
        radii: Vec<f64>,
    ) -> Result<(CubicSplines, Vec<CurveReport>)> {
        self.check(batch)?;
        let mut knots = Knots::new(batch, self.parametrisation, Coincident::Average)?;
        knots.radii = Some(radii);
        let (second, reports) = fit_on_cpu(&|_| *self, batch, &mut knots, &Device::cpu());
        Ok((CubicSplines::new(batch, knots, second), reports))
    }

    /// [`fit_splines`](Self::fit_splines) with options per curve, which differ from these only in
    /// the number of their target.
    pub(crate) fn fit_by(
        &self,
        batch: &CurveBatch,
        device: &Device,
        own: OfCurve<'_>,
    ) -> Result<(CubicSplines, Vec<CurveReport>)> {
        self.check(batch)?;
        let mut knots = Knots::new(batch, self.parametrisation, Coincident::Average)?;
        let (second, mut reports) = match self.worker(device).as_gpu() {
            // The system is worse conditioned the larger λ: f64 where the adapter has it.
            Some(gpu) => {
                let precision = device.kernel_precision(gpu, false)?;
                let fitted = fit_on_gpu(own, gpu, precision, batch, &mut knots)?;
                device.finished(batch.len());
                fitted
            }
            None => fit_on_cpu(own, batch, &mut knots, device),
        };
        // Curves without a solution come out as their input.
        for (i, report) in reports.iter_mut().enumerate() {
            let is_refused = matches!(report.status, CurveStatus::Invalid | CurveStatus::Degenerate);
            let is_fitted = !is_refused && !knots.unfitted.contains_key(&i);
            if is_fitted && CubicSplines::energy(&knots, &second, i).is_none() {
                let what =
                    "its spline leaves the range of the numbers: scale the curve, or choose another parametrisation";
                *report = CurveReport::unfitted(CurveStatus::Invalid, batch.sentence(i, 0, what));
            }
            if matches!(report.status, CurveStatus::Invalid | CurveStatus::Degenerate) {
                let message = report.message.clone().unwrap_or_default();
                knots.unfitted.entry(i).or_insert(Unfitted { status: report.status, message });
            }
        }
        Ok((CubicSplines::new(batch, knots, second), reports))
    }

    /// The device that does the work: tubes and cross-validation have no kernel.
    fn worker(&self, device: &Device) -> Device {
        match self.target {
            SmoothingTarget::Tube(_) | SmoothingTarget::CrossValidation => device.on_cpu(),
            SmoothingTarget::Lambda(_) | SmoothingTarget::Deviation(_) => device.clone(),
        }
    }
}

/// [`Smoothing::fit`] on all threads of the CPU. Replaces the values of the knots by the curves',
/// and returns second derivatives at the knots and the reports.
fn fit_on_cpu(own: OfCurve<'_>, batch: &CurveBatch, knots: &mut Knots, device: &Device) -> (Numbers, Vec<CurveReport>) {
    let d = knots.dimension;
    let mut values = Arc::unwrap_or_clone(std::mem::take(&mut knots.values));
    let knots_only = &*knots;
    let mut second = Numbers::room(values.len());
    let mut reports = vec![CurveReport::default(); batch.len()];
    let mut work = Vec::new();
    let (mut values_rest, mut second_rest, mut reports_rest) = (&mut values[..], &mut second[..], &mut reports[..]);
    for curves in tasks(&knots.offsets) {
        let length = (knots.offsets[curves.end] - knots.offsets[curves.start]) * d;
        let reports = take(&mut reports_rest, curves.len());
        work.push((curves, take(&mut values_rest, length), take(&mut second_rest, length), reports));
    }
    parallel::of(work, |(curves, mut values, mut second, reports)| {
        let mut smoother = Smoother::default();
        for (curve, report) in curves.zip(reports) {
            let length = knots_only.range(curve).len() * d;
            let (values, second) = (take(&mut values, length), take(&mut second, length));
            *report = knots_only
                .report_unfitted(curve)
                .unwrap_or_else(|| smoother.fit(Slot { batch, knots: knots_only, curve, values, second }, &own(curve)));
            device.finished(1);
        }
    });
    knots.values = Arc::new(values);
    (second, reports)
}
