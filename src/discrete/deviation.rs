//! Curves near their points: the fairest of all within a distance of every one.
//!
//! ```text
//! smoothing spline (near) ─► descent inside walls (disc) ─► multipliers ─► descent … ─► the fairest within its discs
//! ```
//!
//! All curves of a batch descend side by side, a round at a time, on the CPU as on a GPU.

use std::collections::{BTreeMap, BTreeSet};

use super::apart::{self, Found, Partings};
use super::curves::Fitted;
use super::disc::Discs;
use super::energy::attachment;
use super::fair::{Fair, Pieces, Pins};
use super::fenced;
use super::near::Near;
use super::setup::{Ready, set_up_from};
use super::tally::Tally;
use crate::batch::{CurveBatch, Unfitted};
use crate::deviation::Deviation;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, dot, subtract};
use crate::parallel;
use crate::precision::Precision;
use crate::report::CurveReport;
use crate::sort;

/// Fits every curve with the least energy within a distance of its points, `allowed[i]` for curve i.
///
/// Returns the curves with the device that fitted them.
pub(super) fn fit<const D: usize>(
    fair: &Fair,
    allowed: &[f64],
    batch: &CurveBatch,
    pieces: &Pieces<'_>,
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    let pins = if fair.pins == Pins::None { Pins::None } else { Pins::Ends };
    let energy = fair.energy.clone() + attachment();
    let held = Fair { energy, pins, deviation: None, corners: None, ..fair.clone() };
    let near = Near::new::<D>(pins, allowed, batch)?;
    let in_f32 = device.as_gpu().is_some() && device.precision() != Precision::F64;
    let mut found: Vec<Option<Found>> = Vec::with_capacity(batch.len());
    let mut running: Vec<(Discs<D>, Result<Ready<D>, Unfitted>)> = Vec::new();
    for (i, ready) in set_up_from::<D>(&held, batch, pieces.kept, &|i| near.curve(i))?.into_iter().enumerate() {
        match ready {
            Ok(mut ready) => {
                let discs = Discs::around(&mut ready, &held, [allowed[i], near.allowed(i)], in_f32, batch, i);
                running.push((discs, Ok(ready)));
                found.push(None);
            }
            Err(problem) => {
                found.push(Some((CurveReport::unfitted(problem.status, problem.message), None)));
                tally.finished(i);
            }
        }
    }
    let mut first = None;
    let is_limited = !fair.limits.is_empty(batch);
    let mut ended = Vec::new();
    while first.is_none() || !running.is_empty() {
        // All curves of a descent have the same cap of iterations. Those whose discs are not settled go first.
        let is_settling = running.iter().any(|(discs, _)| !discs.is_settled());
        let (now, later) = running.into_iter().partition(|(discs, _)| !is_settling || !discs.is_settled());
        running = later;
        let (discs, mut trials): (Vec<Discs<D>>, Vec<Result<Ready<D>, Unfitted>>) = Vec::into_iter(now).unzip();
        let most = discs.first().map_or(held.max_iterations, |discs| discs.most_iterations(&held));
        let (outcomes, did) = Fair { max_iterations: most, ..held.clone() }.descend(&mut trials, device, &|_, _| {})?;
        first.get_or_insert(did);
        let done: Vec<_> = discs.into_iter().zip(trials.into_iter().flatten()).zip(outcomes).collect();
        let taken = parallel::of(done, |((mut discs, mut ready), outcome)| {
            discs.take(&mut ready, outcome);
            (discs, ready)
        });
        for (discs, ready) in taken {
            let i = discs.curve();
            if discs.has_ended() && is_limited {
                ended.push((discs, ready));
            } else if discs.has_ended() {
                tally.finished(i);
                found[i] = Some(discs.report(ready, &held, batch));
            } else {
                running.push((discs, Ok(ready)));
            }
        }
    }
    // Curves that cross start again from here.
    let before: BTreeMap<usize, (Discs<D>, Ready<D>)> = match fair.limits.no_crossing {
        true => sort::map(ended.iter().map(|own| (own.0.curve(), own.clone()))),
        false => BTreeMap::new(),
    };
    let mut on_cpu = BTreeSet::new();
    let mut within = |ended: Vec<(Discs<D>, Ready<D>)>, partings: &Partings| -> Result<Vec<(usize, Found)>> {
        let kept = fenced::keep_within(fair, &held, batch, ended, partings, device)?;
        let judged = kept.into_iter().map(|(discs, ready, kept)| {
            let i = discs.curve();
            if discs.outcome().on_cpu {
                on_cpu.insert(i);
            }
            let (mut report, vertices) = discs.report(ready, &held, batch);
            kept.iter().for_each(|kept| kept.judge_within(&mut report, batch, i, allowed[i]));
            (i, (report, vertices))
        });
        Ok(judged.collect())
    };
    for (i, own) in within(ended, &Partings::default())? {
        found[i] = Some(own);
        tally.finished(i);
    }
    let mut found: Vec<Found> = found.into_iter().map(|found| found.expect("every curve ends")).collect();
    if fair.limits.no_crossing {
        apart::keep_apart(batch, &pieces.owners, &mut found, |curves, partings| {
            let again = curves.iter().filter_map(|i| before.get(i).cloned()).collect();
            let mut again = within(again, partings)?;
            sort::by(&mut again, |a, b| a.0.cmp(&b.0));
            Ok(again.into_iter().map(|(_, found)| found).collect())
        })?;
    }
    if let Some(first) = first.as_mut().filter(|first| first.is_gpu && is_limited) {
        first.finished_on_cpu = on_cpu.len();
    }
    let (mut curves, mut reports) = (Vec::with_capacity(batch.len()), Vec::with_capacity(batch.len()));
    for (i, (report, vertices)) in found.into_iter().enumerate() {
        curves.push(vertices.ok_or_else(|| batch.points(i).to_vec()));
        reports.push(report);
    }
    Ok(Fitted { curves, reports, device: first.expect("a first round") })
}

/// The largest distance from a data point to its vertex.
pub(super) fn deviation<const D: usize>(vertices: &[Vector<f64, D>], rows: &[u32], points: &[Vector<f64, D>]) -> f64 {
    let distance = |(point, &row): (&Vector<f64, D>, &u32)| {
        let away = subtract(vertices[row as usize % vertices.len()], *point);
        dot(away, away).sqrt()
    };
    points.iter().zip(rows).map(distance).fold(0.0, f64::max)
}

/// Checks that a deviation makes sense.
///
/// # Errors
/// A deviation that is not positive and finite. An energy with an attachment of its own.
pub(super) fn check(fair: &Fair, allowed: Deviation) -> Result<()> {
    allowed.check("to go through every point, leave it out")?;
    if fair.energy.attachment_weight() > 0.0 {
        return Err(Error::argument(format!(
            "a deviation of {allowed} keeps the curve near its points, and so does the attachment in the energy: leave one of both out"
        )));
    }
    Ok(())
}
