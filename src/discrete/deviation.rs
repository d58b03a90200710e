//! Curves near their points: for every curve the smallest weight of the attachment that keeps a
//! deviation.
//!
//! ```text
//! smoothing spline (near) ─► trial: the curve at a weight ─► its deviation ─► next weight (search) … ─► the curve to the method's tolerance
//! ```
//!
//! The CPU searches for each curve by itself. A GPU descends the trials of all curves side by side.

use rayon::prelude::*;

use super::curves::{FairCurves, Fitted};
use super::energy::attachment;
use super::fair::{Fair, Pins, Segments};
use super::near::Near;
use super::search::Search;
use super::setup::{Ready, set_up_from};
use super::tally::Tally;
use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::device::{Device, DeviceReport};
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, dot, subtract};
use crate::report::{CurveReport, CurveSet};

/// Fits every curve with the smallest attachment weight that keeps the deviation.
///
/// Returns the curves with the device that fitted them.
pub(super) fn fit<const D: usize>(
    fair: &Fair,
    allowed: f64,
    batch: &CurveBatch,
    kept: &[[bool; 2]],
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    let pins = if fair.pins == Pins::None { Pins::None } else { Pins::Ends };
    let energy = fair.energy.clone() + attachment();
    let attached = Fair { energy, pins, deviation: None, corners: None, ..fair.clone() };
    let near = Near::new::<D>(pins, allowed, batch)?;
    let deviation = Deviation { attached: &attached, allowed, batch, kept, device };
    let sketches = deviation.sketch::<D>(&near)?;
    let (searches, device) = deviation.search::<D>(&near, &sketches, tally)?;
    let (mut curves, mut reports) = (Vec::with_capacity(batch.len()), Vec::with_capacity(batch.len()));
    for (i, search) in searches.into_iter().enumerate() {
        let (report, vertices) = match search {
            Ok(search) => search.report(&attached, batch),
            Err(problem) => (CurveReport::unfitted(problem.status, problem.message), None),
        };
        curves.push(vertices.ok_or_else(|| batch.points(i).to_vec()));
        reports.push(report);
    }
    Ok(Fitted { curves, reports, device })
}

/// Edges a span in the first, coarse search for a weight.
///
/// Such a curve is within some per cent of the curve of many edges. Searching for it is cheap.
const COARSE: usize = 4;

/// The task of a search.
struct Deviation<'a> {
    attached: &'a Fair,
    allowed: f64,
    batch: &'a CurveBatch,
    kept: &'a [[bool; 2]],
    device: &'a Device,
}

/// What the search among coarse edges found about a curve.
enum Hint {
    /// A weight to start from.
    Start {
        weight: f64,
        iterations: u32,
    },
    /// There is no minimum near the points.
    Nowhere {
        iterations: u32,
    },
    Nothing,
}

/// The results of the coarse search: a hint for every curve, and the curve found.
struct Sketches {
    hints: Vec<Hint>,
    curves: FairCurves,
}

impl Deviation<'_> {
    /// Searches among coarse edges, if the curves have finer ones.
    fn sketch<const D: usize>(&self, near: &Near) -> Result<Option<Sketches>> {
        if !matches!(self.attached.segments, Segments::PerSpan(n) if n >= 2 * COARSE) {
            return Ok(None);
        }
        let coarse = Fair { segments: Segments::PerSpan(COARSE), ..self.attached.clone() };
        let ready = set_up_from::<D>(&coarse, self.batch, self.kept, &|i| near.curve(i))?;
        let search = |(i, ready): (usize, Result<Ready<D>, Unfitted>)| {
            ready.ok().map(|ready| Search::new(&coarse, self.allowed, self.batch, i, ready, near.spread(i)).sketching())
        };
        let mut searches: Vec<Option<Search<D>>> = ready.into_iter().enumerate().map(search).collect();
        let rounds = Rounds { attached: &coarse, batch: self.batch, tally: None };
        rounds.run(searches.iter_mut().flatten().collect(), self.device)?;
        let (mut hints, mut curves) = (Vec::new(), Vec::new());
        for (i, search) in searches.into_iter().enumerate() {
            let sketch = search.as_ref().and_then(Search::sketch);
            let iterations = search.as_ref().map_or(0, Search::iterations);
            hints.push(match &sketch {
                Some(sketch) => Hint::Start { weight: sketch.weight, iterations },
                None if search.is_some_and(|search| search.leads_nowhere()) => Hint::Nowhere { iterations },
                None => Hint::Nothing,
            });
            curves.push(sketch.map(|sketch| sketch.vertices).ok_or_else(|| self.batch.points(i).to_vec()));
        }
        Ok(Some(Sketches { hints, curves: FairCurves::new(self.batch, curves, Default::default()) }))
    }

    /// Searches for every curve.
    ///
    /// Returns the device that did the work.
    #[allow(clippy::type_complexity)]
    fn search<const D: usize>(
        &self,
        near: &Near,
        sketches: &Option<Sketches>,
        tally: &Tally<'_>,
    ) -> Result<(Vec<Result<Search<D>, Unfitted>>, DeviceReport)> {
        let hint = |i: usize| sketches.as_ref().map_or(&Hint::Nothing, |sketches| &sketches.hints[i]);
        let start = |i: usize| match (hint(i), sketches) {
            (Hint::Start { .. }, Some(sketches)) => Some(sketches.curves.curve(i)),
            _ => near.curve(i),
        };
        let ready = set_up_from::<D>(self.attached, self.batch, self.kept, &start)?;
        let search = |(i, ready): (usize, Result<Ready<D>, Unfitted>)| {
            let search = Search::new(self.attached, self.allowed, self.batch, i, ready?, near.spread(i));
            Ok(match *hint(i) {
                Hint::Start { weight, iterations } => search.starting_from(weight, iterations),
                Hint::Nowhere { iterations } => search.given_up(iterations),
                Hint::Nothing => search,
            })
        };
        let mut searches: Vec<Result<Search<D>, Unfitted>> = ready.into_iter().enumerate().map(search).collect();
        let is_over = |search: &Result<Search<D>, Unfitted>| search.as_ref().map_or(true, Search::has_ended);
        searches.iter().enumerate().filter(|(_, search)| is_over(search)).for_each(|(i, _)| tally.finished(i));
        let under_way = searches.iter_mut().flatten().filter(|search| !search.has_ended()).collect();
        let rounds = Rounds { attached: self.attached, batch: self.batch, tally: Some(tally) };
        let did = rounds.run(under_way, self.device)?;
        Ok((searches, did))
    }
}

/// What all rounds of all searches share.
struct Rounds<'a> {
    attached: &'a Fair,
    batch: &'a CurveBatch,
    /// Counts every curve whose search has ended.
    tally: Option<&'a Tally<'a>>,
}

impl Rounds<'_> {
    /// Searches for all curves.
    ///
    /// Returns the device that did the work.
    fn run<const D: usize>(&self, mut searches: Vec<&mut Search<D>>, device: &Device) -> Result<DeviceReport> {
        if device.as_gpu().is_some() {
            return self.all(searches, device);
        }
        // Long curves go first, so that no thread waits for one at the end.
        searches.sort_by_key(|search| std::cmp::Reverse(search.vertices()));
        searches.into_par_iter().with_max_len(1).try_for_each(|search| self.one(search))?;
        device.report(true)
    }

    /// Searches for one curve on this thread of the CPU.
    fn one<const D: usize>(&self, search: &mut Search<D>) -> Result<()> {
        while !search.has_ended() {
            self.round(&mut [search], &Device::cpu())?;
        }
        Ok(())
    }

    /// Searches for all curves side by side.
    ///
    /// Returns the device that did the work.
    fn all<const D: usize>(&self, mut searches: Vec<&mut Search<D>>, device: &Device) -> Result<DeviceReport> {
        let mut first = None;
        loop {
            // All curves of a run have the same cap of iterations. Searching curves therefore go
            // first, then those that only need to be finished.
            let (now, later): (Vec<_>, Vec<_>) = searches.into_iter().partition(|search| search.is_searching());
            let (mut now, later) = if now.is_empty() { (later, now) } else { (now, later) };
            let report = self.round(&mut now, device)?;
            let first = first.get_or_insert(report);
            searches = now.into_iter().chain(later).filter(|search| !search.has_ended()).collect();
            if searches.is_empty() {
                return Ok(first.clone());
            }
        }
    }

    /// One trial of each search.
    ///
    /// Either all of them are searching or none. Returns the device that did the work.
    fn round<const D: usize>(&self, searches: &mut [&mut Search<D>], device: &Device) -> Result<DeviceReport> {
        let most = searches.iter().map(|search| search.most_iterations(self.attached)).max().unwrap_or(0);
        let fair = Fair { max_iterations: most, ..self.attached.clone() };
        let trials: Vec<Result<Ready<D>, Unfitted>> =
            searches.iter().map(|search| Ok(search.trial(&fair, self.batch))).collect();
        let (outcomes, did) = fair.descend(&trials, device, &|_, _| {})?;
        for ((search, trial), outcome) in searches.iter_mut().zip(trials.into_iter().flatten()).zip(outcomes) {
            search.take(trial, outcome, self.batch.points(search.curve()).as_chunks::<D>().0);
            if let Some(tally) = self.tally.filter(|_| search.has_ended()) {
                tally.finished(search.curve());
            }
        }
        Ok(did)
    }
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
pub(super) fn check(fair: &Fair, allowed: f64) -> Result<()> {
    if !(allowed > 0.0 && allowed.is_finite()) {
        return Err(Error::argument(format!(
            "the largest deviation allowed is {allowed}; it must be positive and finite: to go through every point, leave it out"
        )));
    }
    if fair.energy.attachment_weight() > 0.0 {
        return Err(Error::argument(format!(
            "the energy attaches the curve with a weight of its own, but a deviation of {allowed} has one found: leave one of both out"
        )));
    }
    Ok(())
}
