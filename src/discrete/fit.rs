//! [`Fair::fit`]: curves are moved onto their surface, cut at corners, projected into their planes,
//! fitted and joined.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use super::check::check;
use super::corners::Corners;
use super::curves::{FairCurves, Fitted};
use super::deviation;
use super::fair::{Fair, Pins};
use super::flat;
use super::pieces::{self, Pieces};
use super::tally::Tally;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::Sampling;
use crate::deviation::Deviation;
use crate::device::{Device, DeviceReport, Work};
use crate::error::{Error, Result, thousands};
use crate::ground::{SurfaceMethod, check_samples, fit_in_surface, heights, judge_known, lifted};
use crate::report::{CurveReport, CurveSet, Fit};
use crate::spline::{Natural, Parametrisation};
use crate::surface::{Globe, Surface};

impl Fair {
    /// The work of a batch with this number of points, read and written together, for
    /// [`Device::choose`].
    ///
    /// A deviation and limits take rounds of few curves, for which an adapter takes as long as for
    /// all: on an H200 3.6 times as long as its host's 16 threads.
    pub fn work(&self, points: usize) -> Work {
        let is_plain = self.pins == Pins::All && self.starts == 1 && self.surface.is_none();
        // Columns that bound places are of few batches.
        let has_limits = CurveBatch::from_ragged(2, vec![], vec![0]).is_ok_and(|none| !self.limits.is_empty(&none));
        let on_host = match () {
            () if self.deviation.is_some() || has_limits => 1.0,
            () if is_plain && self.energy.order() == 2 => 0.2,
            () => 0.5,
        };
        Work { points, cost: 50.0, on_host }
    }

    /// Fits every curve of the batch.
    ///
    /// The statuses are:
    ///
    /// - `converged`: the tolerance was reached.
    /// - `not_converged`: the curve is the best one reached. If that is more than twice as long as
    ///   the data polygon, the result is the input.
    /// - `infeasible`: no curve was found nearby that satisfies the [`limits`](Self::limits).
    /// - `unbounded`: the energy contains neither length nor tension, and the curve grew past five
    ///   times its data polygon while its energy fell. Bending alone often has no minimum.
    /// - `degenerate` and `invalid`: the curve cannot be fitted.
    ///
    /// If a curve is `unbounded`, `degenerate` or `invalid`, the result is its input. The reported
    /// energy is the requested weighted sum in units of the input, without the regularisation.
    ///
    /// The device's [counter](Device::with_counter) counts finished curves. A curve that was cut at
    /// [`corners`](Self::corners) counts with its last piece.
    ///
    /// # Errors
    /// - Weights that are negative or not finite, an empty energy, or an exponent below 1.
    /// - An invalid tolerance, number of segments or choice of pins.
    /// - A spacing that makes more than
    ///   [`Segments::MOST_VERTICES`](super::Segments::MOST_VERTICES).
    /// - Columns `nu` and `known`.
    /// - On a GPU, errors of submissions.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        let lifted = self.surface.as_ref().and_then(|surface| lifted(batch, &**surface));
        let batch = lifted.as_ref().unwrap_or(batch);
        check(self, batch)?;
        match (&self.surface, batch.dimension()) {
            (Some(surface), _) => fit_in_surface(self, surface, self.off_surface, batch, device),
            (None, _) => fit_apart(self, batch, &|_| self.deviation, device),
        }
    }

    /// Fits every curve with a [`deviation`](Self::deviation) per curve. Not in surfaces.
    ///
    /// # Errors
    /// As [`fit`](Self::fit), for any of the deviations. Another number of deviations than curves. A surface.
    pub fn fit_each(&self, batch: &CurveBatch, deviations: &[Deviation], device: &Device) -> Result<Fit> {
        if self.surface.is_some() {
            return Err(Error::argument("in a surface all curves have one deviation: give one for all"));
        }
        if deviations.len() != batch.len() {
            let (given, curves) = (deviations.len(), batch.len());
            return Err(Error::argument(format!(
                "{given} deviations are given for {curves} curves: give one per curve"
            )));
        }
        for deviation in deviations {
            deviation::check(self, *deviation)?;
        }
        let near = Fair { deviation: deviations.first().copied().or(self.deviation), ..self.clone() };
        check(&near, batch)?;
        fit_apart(&near, batch, &|i| Some(deviations[i]), device)
    }

    /// Fits every curve and samples it.
    ///
    /// With [`Sampling::PerSpan`] and as many samples per span as [`segments`](Self::segments), the
    /// samples are the vertices.
    ///
    /// # Errors
    /// The errors of [`fit`](Self::fit) and of [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        check_samples(sampling, batch, self.surface.as_deref(), 0)?;
        let fit = self.fit(batch, device)?;
        let polylines = fit.polylines(sampling);
        Ok((fit, polylines))
    }

    /// Summary sentences for fits of many curves: how many usable curves have loops, how many
    /// restarts found a lower energy, and by how much. `reports` must come from a fit with these
    /// options.
    pub fn notes(&self, reports: &[CurveReport]) -> Vec<String> {
        let mut notes = Vec::new();
        let looping: Vec<f64> =
            reports.iter().filter(|report| report.status.is_usable()).filter_map(|report| report.loops).collect();
        if let Some(most) = looping.iter().copied().reduce(f64::max) {
            notes.push(format!(
                "{} of {} curves have loops, and are up to {most:.1} times as long as their points' polygon: {}",
                thousands(looping.len()),
                thousands(reports.len()),
                if self.energy.bounds_length() { "weigh length, tension or tautness more" } else { self.remedy() }
            ));
        }
        let tried = reports.iter().filter(|report| report.gain.is_some()).count();
        let gains = reports.iter().filter(|report| report.status.is_usable()).filter_map(|report| report.gain);
        let mut gains: Vec<f64> = gains.filter(|gain| *gain > 0.0).collect();
        gains.sort_unstable_by(f64::total_cmp);
        if tried == 0 {
            return notes;
        }
        let found = match gains.last() {
            None => format!("none of {} curves found a cheaper minimum", thousands(tried)),
            Some(most) => format!(
                "{} of {} curves found a cheaper minimum, by {:.2} % at the median and {:.2} % at most",
                thousands(gains.len()),
                thousands(tried),
                100.0 * gains[gains.len() / 2],
                100.0 * most
            ),
        };
        notes.push(format!("{} starts: {found}", self.starts));
        notes
    }
}

impl SurfaceMethod for Fair {
    type Curves = FairCurves;

    fn fit_in_space(
        &self,
        surface: &Arc<dyn Surface>,
        batch: &CurveBatch,
        given: &CurveBatch,
        device: &Device,
    ) -> Result<(FairCurves, Vec<CurveReport>, DeviceReport)> {
        let within = Fair { surface: Some(surface.clone()), ..self.clone() };
        let (mut curves, mut reports, device) = fit_in::<3>(&within, batch, &|_| self.deviation, device)?;
        judge_known(&**surface, given, &|i| curves.vertices(i), &mut reports);
        curves.lie_in(given, surface);
        Ok((curves, reports, device))
    }

    /// Tangents are given by their components to the east and to the north.
    fn tangent_in_space(globe: Globe, [longitude, latitude]: [f64; 2], [eastward, northward]: [f64; 2]) -> DVec3 {
        let [east, north] = globe.compass(longitude, latitude);
        eastward * east + northward * north
    }

    /// Natural splines over the arc length along the ground.
    fn fit_heights(&self, batch: &CurveBatch, curves: &FairCurves) -> Result<Fit> {
        let (mut t, mut closing) = (Vec::with_capacity(batch.total_points()), Vec::with_capacity(batch.len()));
        for i in 0..batch.len() {
            let curve = curves.curve(i);
            let mut along = 0.0;
            for k in 0..batch.count(i) {
                t.push(along);
                along += if k < curve.spans() { curve.span_length(k) } else { 0.0 };
            }
            closing.push(along - t.last().copied().unwrap_or(0.0));
        }
        let natural = Natural { parametrisation: Parametrisation::Given, ..Natural::default() };
        natural.fit(&heights(batch, t, closing)?, &Device::cpu())
    }
}

/// Fits curves in the plane or in space.
fn fit_apart(
    fair: &Fair,
    batch: &CurveBatch,
    deviation: &dyn Fn(usize) -> Option<Deviation>,
    device: &Device,
) -> Result<Fit> {
    let fit = if batch.dimension() == 2 { fit_in::<2> } else { fit_in::<3> };
    fit(fair, batch, deviation, device).map(|(curves, reports, did)| Fit::new(curves, reports, did))
}

/// Fits curves with D coordinates per point, cut at their corners if there are any.
fn fit_in<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    deviation: &dyn Fn(usize) -> Option<Deviation>,
    device: &Device,
) -> Result<(FairCurves, Vec<CurveReport>, DeviceReport)> {
    let allowed = (0..batch.len()).map(|i| Some(deviation(i)?.of(batch, i))).collect::<Option<_>>();
    let allowed = allowed.filter(|_| fair.deviation.is_some());
    let fitted = match fair.corners {
        Some(angle) => {
            // The points of a closed curve that is neither pinned nor attached do not define
            // corners.
            let is_loose = fair.pins != Pins::All && fair.surface.is_some() && !fair.energy.is_attached();
            let cut = Corners::cut::<D>(batch, angle, &|i| is_loose && batch.is_closed(i));
            let curves = cut.curves();
            let allowed = allowed.map(|own: Vec<f64>| curves.iter().map(|&i| own[i]).collect());
            let tally = Tally::of_pieces(device, curves.clone());
            let pieces = Pieces { kept: &cut.kept, owners: curves };
            cut.join(batch, fit_pieces::<D>(fair, &cut.batch, &pieces, allowed, device, &tally)?)
        }
        None => {
            let whole = Pieces { kept: &[], owners: (0..batch.len()).collect() };
            fit_pieces::<D>(fair, batch, &whole, allowed, device, &Tally::whole(device))?
        }
    };
    let Fitted { curves, even, reports, device } = fitted;
    let mut problems = BTreeMap::new();
    for (i, report) in reports.iter().enumerate().filter(|(i, _)| curves[*i].is_none()) {
        let message = report.message.clone().unwrap_or_default();
        problems.insert(i, Unfitted { status: report.status, message });
    }
    let mut curves = FairCurves::new(batch, curves, even, problems);
    curves.keep_ahead(&fair.limits.monotone);
    Ok((curves, reports, device))
}

/// Fits curves without corners. Planar ones are fitted in their planes.
fn fit_pieces<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    pieces: &Pieces<'_>,
    allowed: Option<Vec<f64>>,
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    let planes = flat::planes(fair, batch);
    if planes.iter().all(Option::is_none) {
        return pieces::fit::<D>(fair, batch, pieces, allowed, device, tally);
    }
    flat::fit(
        batch,
        &planes,
        tally,
        |planar, tally| pieces::fit::<2>(fair, planar, pieces, allowed.clone(), device, tally),
        |spatial, tally| pieces::fit::<3>(fair, spatial, pieces, allowed.clone(), device, tally),
    )
}
