//! Fits curves without corners: first each curve alone, then those that must not cross.

use std::collections::BTreeMap;

use super::curves::{EvenVertices, Fitted, Vertices};
use super::deviation::{InDiscs, within_discs};
use super::energy::attachment;
use super::fair::{Fair, Pins};
use super::limited::{Start, keep};
use super::limits_result::LimitsResult;
use super::near::Near;
use super::problem::Outcome;
use super::queue::{CurveFit, Desk, Queue, Task};
use super::resident::{self, Attempt};
use super::restarts::{Descended, best};
use super::separation::{Found, SeparatingHalfPlane, SeparatingHalfPlanes, keep_apart};
use super::setup::{PreparedCurve, SplineStarts};
use super::shortest;
use super::tally::Tally;
use crate::batch::{CurveBatch, Unfitted};
use crate::device::Device;
use crate::error::Result;
use crate::precision::Precision;
use crate::report::CurveReport;

/// How pieces belong to curves.
pub(super) struct Pieces<'a> {
    /// Whether each piece keeps its ends regardless of the pins; empty if none does.
    pub kept: &'a [[bool; 2]],
    /// The curve to which each piece belongs.
    pub owners: Vec<usize>,
}

impl Pieces<'_> {
    /// Whether a piece keeps its first and its last point regardless of the pins.
    fn kept_of(&self, i: usize) -> [bool; 2] {
        self.kept.get(i).copied().unwrap_or_default()
    }
}

/// A fitted curve.
struct FittedCurve<const D: usize> {
    found: Found,
    /// Whether the CPU did all or part of the descent.
    on_cpu: bool,
    /// The state from which the curve restarts if it crosses others.
    start: Option<Box<Restart<D>>>,
}

enum Restart<const D: usize> {
    Through(Descended<D>),
    Near(InDiscs<D>),
}

/// Fits curves without corners. `allowed` are the deviations of the curves.
pub(super) fn fit<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    pieces: &Pieces<'_>,
    allowed: Option<Vec<f64>>,
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    if shortest::is_asked_for(fair, batch) {
        return shortest::fit::<D>(fair, batch, pieces.kept, device, tally);
    }
    let Some(asked) = allowed else {
        return fit_through::<D>(fair, batch, pieces, device, tally);
    };
    let pins = if fair.pins == Pins::None { Pins::None } else { Pins::Ends };
    let energy = fair.energy.clone() + attachment();
    let held = Fair { energy, pins, deviation: None, corners: None, ..fair.clone() };
    let near = Near::new::<D>(pins, &asked, batch)?;
    let starts = SplineStarts::new(&held, batch)?;
    let prepare = |i: usize| Ok((starts.prepare(i, pieces.kept_of(i), near.curve(i))?, None));
    fit_all::<D>(&held, batch, pieces, &prepare, &|i| Some([asked[i], near.allowed(i)]), device, tally)
}

/// Fits curves through their points: plain ones on the GPU as far as they end there, then the
/// others.
fn fit_through<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    pieces: &Pieces<'_>,
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    let fit = |batch: &CurveBatch, pieces: &Pieces<'_>, done: &Done<'_, D>, device: &Device, tally: &Tally<'_>| {
        let starts = SplineStarts::new(fair, batch)?;
        let prepare = |i: usize| {
            let ready = starts.prepare(i, pieces.kept_of(i), None)?;
            let outcome = done(i, &ready);
            Ok((ready, outcome))
        };
        fit_all::<D>(fair, batch, pieces, &prepare, &|_| None, device, tally)
    };
    let queue = Queue::new::<D>(fair, batch, &SeparatingHalfPlanes::default(), device)?;
    let resident = queue.gpu().map(|gpu| resident::fit::<D>(fair, batch, gpu, device, tally)).transpose()?.flatten();
    let Some((attempts, even)) = resident else { return fit(batch, pieces, &|_, _| None, device, tally) };
    let (mut found, mut finished_on_cpu) = (BTreeMap::new(), 0);
    let (set_up, on_cpu): (Vec<usize>, Vec<usize>) = (0..batch.len())
        .filter(|&i| !matches!(attempts[i], Attempt::Ended(..)))
        .partition(|&i| matches!(attempts[i], Attempt::ForHost));
    for (curves, device) in [(set_up, device), (on_cpu, &device.on_cpu())] {
        if curves.is_empty() {
            continue;
        }
        let kept: Vec<[bool; 2]> = curves.iter().map(|&i| pieces.kept_of(i)).collect();
        let own = Pieces { kept: &kept, owners: curves.iter().map(|&i| pieces.owners[i]).collect() };
        let done = |k: usize, ready: &PreparedCurve<D>| attempts[curves[k]].outcome(ready, even.of(curves[k]));
        let rest = fit(&batch.select(&curves), &own, &done, device, &tally.of_selected(&curves))?;
        let is_lost = |i: &&usize| matches!(attempts[**i], Attempt::Lost);
        finished_on_cpu += match device.as_gpu() {
            Some(_) => rest.device.finished_on_cpu,
            None => curves.len() - curves.iter().filter(is_lost).count(),
        };
        found.extend(curves.into_iter().zip(rest.reports.into_iter().zip(rest.curves)));
    }
    let all = attempts.into_iter().enumerate().map(|(i, attempt)| match attempt {
        Attempt::Ended(report, is_fitted) => (report, is_fitted.then(Vertices::default)),
        _ => found.remove(&i).expect("every curve ends"),
    });
    let (reports, curves) = all.unzip();
    Ok(Fitted { curves, even, reports, device: queue.report(finished_on_cpu)? })
}

/// The outcome of the first descent of a curve, if that is done.
type Done<'a, const D: usize> = dyn Fn(usize, &PreparedCurve<D>) -> Option<Outcome<D>> + Sync + 'a;

/// A curve that is ready, and the outcome of its first descent, if that is done.
type Prepared<const D: usize> = (PreparedCurve<D>, Option<Outcome<D>>);

/// Fits prepared curves. `allowed` returns the requested deviation, and the deviation that the
/// curve may use.
fn fit_all<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    pieces: &Pieces<'_>,
    prepare: &(dyn Fn(usize) -> std::result::Result<Prepared<D>, Unfitted> + Sync),
    allowed: &(dyn Fn(usize) -> Option<[f64; 2]> + Sync),
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    let keeps_apart = fair.limits.keeps_apart();
    let in_f32 = device.as_gpu().is_some() && device.precision() != Precision::F64;
    let desks = Desk::of(batch.len());
    let queue = Queue::new::<D>(fair, batch, &SeparatingHalfPlanes::default(), device)?;
    let size = |i: usize| fair.segments.edges(batch, i);
    let strategy = |i: usize| -> Task<'_, FittedCurve<D>> {
        let curve =
            CurveFit { fair, batch, i, kept: pieces.kept_of(i), queue: &queue, desk: &desks[i], is_repeated: false };
        Box::pin(async move {
            let fitted = match prepare(i) {
                Ok(prepared) => fit_one(curve, prepared, allowed(i), in_f32).await,
                Err(problem) => {
                    let found = (CurveReport::unfitted(problem.status, problem.message), None);
                    FittedCurve { found, on_cpu: false, start: None }
                }
            };
            if fitted.start.is_none() {
                tally.finished(i);
            }
            fitted
        })
    };
    let n = batch.len();
    let (mut curves, mut reports) = (Vec::with_capacity(n), Vec::with_capacity(n));
    let (mut on_cpu, mut starts) = (Vec::with_capacity(n), Vec::new());
    for own in queue.run(&desks, size, strategy)? {
        let (report, vertices) = own.found;
        curves.push(vertices);
        reports.push(report);
        on_cpu.push(own.on_cpu);
        starts.extend(keeps_apart.then_some(own.start));
    }
    if keeps_apart {
        keep_apart(batch, &fair.limits, &pieces.owners, &mut curves, &mut reports, |curves, separating| {
            let queue = Queue::new::<D>(fair, batch, separating, device)?;
            let again: Vec<(usize, &Restart<D>)> =
                curves.iter().filter_map(|&i| Some((i, &**starts[i].as_ref()?))).collect();
            let desks = Desk::of(again.len());
            let strategy = |k: usize| -> Task<'_, (usize, Found, bool)> {
                let (i, start) = again[k];
                let curve = CurveFit {
                    fair,
                    batch,
                    i,
                    kept: pieces.kept_of(i),
                    queue: &queue,
                    desk: &desks[k],
                    is_repeated: false,
                };
                Box::pin(fit_again(curve, start, separating.of(i)))
            };
            let mut all = Vec::new();
            for (i, found, own) in queue.run(&desks, |k| size(again[k].0), strategy)? {
                on_cpu[i] = own;
                all.push(found);
            }
            Ok(all)
        })?;
        (0..batch.len()).filter(|&i| starts[i].is_some()).for_each(|i| tally.finished(i));
    }
    let device = queue.report(on_cpu.into_iter().filter(|on_cpu| *on_cpu).count())?;
    Ok(Fitted { curves, even: EvenVertices::default(), reports, device })
}

/// Fits a curve independently of all others.
async fn fit_one<const D: usize>(
    curve: CurveFit<'_, D>,
    (ready, outcome): Prepared<D>,
    allowed: Option<[f64; 2]>,
    in_f32: bool,
) -> FittedCurve<D> {
    let keeps_apart = curve.fair.limits.keeps_apart();
    let Some(allowed) = allowed else {
        let own = best(&curve, ready, outcome).await;
        let found = reported(&curve, &own, &own.outcome, own.kept.as_ref());
        let on_cpu = own.outcome.on_cpu;
        return FittedCurve { found, on_cpu, start: keeps_apart.then(|| Box::new(Restart::Through(own))) };
    };
    let near = Box::pin(within_discs(&curve, ready, allowed, in_f32)).await;
    let start = keeps_apart.then(|| Box::new(Restart::Near(near.clone())));
    let (found, on_cpu) = Box::pin(near.kept(&curve, &[])).await;
    FittedCurve { found, on_cpu, start }
}

/// Fits a curve again within half-planes between it and its neighbours.
async fn fit_again<const D: usize>(
    curve: CurveFit<'_, D>,
    start: &Restart<D>,
    separating: &[SeparatingHalfPlane],
) -> (usize, Found, bool) {
    match start {
        Restart::Through(own) => {
            let mut outcome = own.free.clone().expect("a curve that may not cross others");
            let kept = keep(&curve, &own.ready, &mut outcome, separating, Start::Free).await;
            (curve.i, reported(&curve, own, &outcome, kept.as_ref()), outcome.on_cpu)
        }
        Restart::Near(own) => {
            let (found, on_cpu) = own.clone().kept(&curve, separating).await;
            (curve.i, found, on_cpu)
        }
    }
}

/// The report and the vertices of a curve for an outcome.
fn reported<const D: usize>(
    curve: &CurveFit<'_, D>,
    own: &Descended<D>,
    outcome: &Outcome<D>,
    kept: Option<&LimitsResult>,
) -> Found {
    let CurveFit { fair, batch, i, .. } = *curve;
    let (mut report, vertices) = fair.report(batch, i, &own.ready, outcome);
    report.gain = own.gain;
    if let Some((span, message)) = own.message() {
        report.message = Some(batch.sentence(i, span, &message));
    }
    if let Some(kept) = kept {
        kept.judge(&mut report, batch, i);
    }
    (report, vertices)
}
