//! Fits of curves that are cut at their corners, or whole.

use std::collections::BTreeMap;

use super::{Fair, Pins};
use crate::batch::{CurveBatch, Unfitted};
use crate::device::{Device, DeviceReport};
use crate::discrete::apart::{self, Found};
use crate::discrete::corners::Corners;
use crate::discrete::curves::{FairCurves, Fitted};
use crate::discrete::descended::Descended;
use crate::discrete::fenced::{self, Start};
use crate::discrete::kept::Kept;
use crate::discrete::setup::set_up_pieces;
use crate::discrete::tally::Tally;
use crate::discrete::{deviation, flat};
use crate::error::Result;
use crate::parallel;
use crate::report::CurveReport;

/// Which curves are pieces of others.
pub(in crate::discrete) struct Pieces<'a> {
    /// Which keep their ends whatever the pins say; empty if none do.
    pub kept: &'a [[bool; 2]],
    /// The curve that each is a piece of.
    pub owners: Vec<usize>,
}

impl Fair {
    /// Fits curves whose points have D coordinates, cut at their corners if they have any.
    pub(in crate::discrete) fn fit_in<const D: usize>(
        &self,
        batch: &CurveBatch,
        device: &Device,
    ) -> Result<(FairCurves, Vec<CurveReport>, DeviceReport)> {
        let allowed = self.deviation.map(|deviation| (0..batch.len()).map(|i| deviation.of(batch, i)).collect());
        let fitted = match self.corners {
            Some(angle) => {
                // Where nothing holds a closed curve its points say nothing of corners.
                let is_loose = self.pins != Pins::All && self.surface.is_some() && !self.energy.is_attached();
                let cut = Corners::cut::<D>(batch, angle, &|i| is_loose && batch.is_closed(i));
                let curves = cut.curves();
                let allowed = allowed.map(|own: Vec<f64>| curves.iter().map(|&i| own[i]).collect());
                let tally = Tally::of_pieces(device, curves.clone());
                let pieces = Pieces { kept: &cut.kept, owners: curves };
                cut.join(batch, self.fit_pieces::<D>(&cut.batch, &pieces, allowed, device, &tally)?)
            }
            None => {
                let whole = Pieces { kept: &[], owners: (0..batch.len()).collect() };
                self.fit_pieces::<D>(batch, &whole, allowed, device, &Tally::whole(device))?
            }
        };
        let Fitted { curves, reports, device } = fitted;
        let mut problems = BTreeMap::new();
        for (i, report) in reports.iter().enumerate().filter(|(i, _)| curves[*i].is_err()) {
            let message = report.message.clone().unwrap_or_default();
            problems.insert(i, Unfitted { status: report.status, message });
        }
        let mut curves = FairCurves::new(batch, curves, problems);
        curves.keep_ahead(&self.limits.monotone);
        Ok((curves, reports, device))
    }

    /// Fits curves that have no corners.
    ///
    /// `allowed` says how far each may pass from its points.
    pub(in crate::discrete) fn fit_pieces<const D: usize>(
        &self,
        batch: &CurveBatch,
        pieces: &Pieces<'_>,
        allowed: Option<Vec<f64>>,
        device: &Device,
        tally: &Tally<'_>,
    ) -> Result<Fitted> {
        let planes = flat::planes(self, batch);
        if planes.iter().any(Option::is_some) {
            return flat::fit(self, batch, &planes, pieces, allowed, device, tally);
        }
        if self.asks_for_shortest(batch) {
            return self.fit_shortest::<D>(batch, pieces.kept, device, tally);
        }
        if let Some(allowed) = allowed {
            return deviation::fit::<D>(self, &allowed, batch, pieces, device, tally);
        }
        let ready = set_up_pieces::<D>(self, batch, pieces.kept)?;
        let (able, unable): (Vec<usize>, Vec<usize>) = (0..ready.len()).partition(|&i| ready[i].is_ok());
        unable.into_iter().for_each(|i| tally.finished(i));
        // With limits a curve is finished later.
        let is_limited = !self.limits.is_empty(batch);
        let finished = |k: usize| tally.finished(able[k]);
        let mut found =
            Descended::best(self, batch, pieces.kept, ready, device, if is_limited { &|_| {} } else { &finished })?;
        let keeps_apart = self.limits.no_crossing;
        let all: Vec<usize> = (0..able.len()).collect();
        let mut reported = self.reported(batch, &found, &found.kept, &all, &|k| {
            if is_limited && !keeps_apart {
                finished(k);
            }
        });
        let mut all_found: Vec<Found> = Vec::with_capacity(batch.len());
        let mut fitted = reported.drain(..);
        for ready in &found.ready {
            all_found.push(match ready {
                Ok(_) => fitted.next().expect("what is ready is reported"),
                Err(problem) => (CurveReport::unfitted(problem.status, problem.message.clone()), None),
            });
        }
        if keeps_apart {
            apart::keep_apart(batch, &pieces.owners, &mut all_found, |curves, partings| {
                let again: Vec<usize> = curves.iter().filter_map(|i| able.binary_search(i).ok()).collect();
                again.iter().for_each(|&k| found.outcomes[k] = found.free[k].clone());
                let limited = fenced::keep(self, batch, &mut found, again.clone(), partings, Start::Free, device)?;
                Ok(self.reported(batch, &found, &limited, &again, &|_| {}))
            })?;
            all.into_iter().for_each(finished);
        }
        let (mut curves, mut reports) = (Vec::with_capacity(batch.len()), Vec::with_capacity(batch.len()));
        for (i, (report, vertices)) in all_found.into_iter().enumerate() {
            curves.push(vertices.ok_or_else(|| batch.points(i).to_vec()));
            reports.push(report);
        }
        Ok(Fitted { curves, reports, device: found.device })
    }

    /// The reports and vertices of these curves, by their numbers among those that are ready. `limited` says how they keep
    /// their limits, of all that are ready.
    fn reported<const D: usize>(
        &self,
        batch: &CurveBatch,
        found: &Descended<D>,
        limited: &[Option<Kept>],
        curves: &[usize],
        finished: &(dyn Fn(usize) + Sync),
    ) -> Vec<Found> {
        let able: Vec<usize> = (0..found.ready.len()).filter(|&i| found.ready[i].is_ok()).collect();
        parallel::map(curves.len(), 64, |at| {
            let k = curves[at];
            let i = able[k];
            let ready = found.ready[i].as_ref().expect("what is ready is descended");
            let (mut report, vertices) = self.report(batch, i, ready, &found.outcomes[k]);
            report.gain = found.gains.get(k).copied();
            if let Some((span, message)) = found.message(k) {
                report.message = Some(batch.sentence(i, span, &message));
            }
            if let Some(Some(kept)) = limited.get(k) {
                kept.judge(&mut report, batch, i);
            }
            finished(k);
            (report, vertices)
        })
    }
}
