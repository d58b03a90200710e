//! [`Descended`]: curves that have been descended from the best of their starts.
//!
//! A descent ends at the minimum below its start. From other [`starts`](super::starts) it may find other minima.
//! The cheapest that keeps its limits is taken. If a curve crosses itself where its points do not, the fit is repeated.

use super::apart::Partings;
use super::curves::{FairCurves, Vertices};
use super::energy::length;
use super::fair::{Fair, Segments};
use super::fenced::{self, Start};
use super::kept::Kept;
use super::lane::Standing;
use super::limits::Limits;
use super::problem::Outcome;
use super::setup::{Ready, set_up_on, set_up_pieces};
use super::starts::set_up_at;
use super::tally::Tally;
use super::untangle::{Untangled, message, untangle};
use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::curve::Curve;
use crate::device::{Device, DeviceReport};
use crate::error::{Result, thousands};
use crate::parallel;
use crate::report::{CurveReport, CurveSet};
use crate::status::CurveStatus;

/// Starts at most. What a thousand do not find, more will not.
pub(super) const MOST: u32 = 1_000;

/// How a curve is drawn anew that crosses itself where its points do not: whether with twice the edges, from which
/// start, and what is said of it.
///
/// Within an edge no curve can turn, however taut it is. From circles or from the polygon a curve may turn to the other
/// side at a sharp point.
const REMEDIES: [(bool, u32, &str); 4] = [
    (true, 0, "has twice the edges"),
    (false, 1, "turns another way"),
    (false, 2, "turns another way"),
    (true, 2, "turns another way, with twice the edges"),
];

/// A minimum is lower than another if it is so by this part.
///
/// The same one has an energy that differs by some 1e-6, since the gauge is that of the start.
const LOWER: f64 = 1e-4;

/// The fewest edges a span of a curve that a finer one starts from.
const COARSEST: usize = 8;

/// Curves that have not converged: their numbers among those that are ready, and which keep their ends.
struct Left {
    numbers: Vec<usize>,
    batch: CurveBatch,
    kept: Vec<[bool; 2]>,
}

/// Curves that have been descended, with their problems.
pub(super) struct Descended<const D: usize> {
    pub ready: Vec<Result<Ready<D>, Unfitted>>,
    /// Where the curves ended that are ready, in their order.
    pub outcomes: Vec<Outcome<D>>,
    /// The spans of each that were drawn tauter, and what crosses yet.
    pub untangled: Untangled,
    /// What each does otherwise because it crossed itself, in words; mostly none.
    pub remedies: Vec<&'static str>,
    /// The part of the energy that further starts have saved, for each; empty without further starts.
    pub gains: Vec<f64>,
    /// How each keeps its limits; empty without limits.
    pub kept: Vec<Option<Kept>>,
    /// Where each ended without limits; empty where neighbours may cross.
    pub free: Vec<Outcome<D>>,
    pub device: DeviceReport,
}

impl<const D: usize> Descended<D> {
    /// Descends curves, and [untangles](untangle) them.
    fn new(
        fair: &Fair,
        mut ready: Vec<Result<Ready<D>, Unfitted>>,
        device: &Device,
        ended: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        let (mut outcomes, did) = fair.descend(&mut ready, device, &|k, _| ended(k))?;
        let untangled = untangle(fair, &mut ready, &mut outcomes, device)?;
        Ok(Self::at(ready, outcomes, untangled, did))
    }

    /// Curves where they stand.
    fn at(
        ready: Vec<Result<Ready<D>, Unfitted>>,
        outcomes: Vec<Outcome<D>>,
        untangled: Untangled,
        device: DeviceReport,
    ) -> Self {
        let remedies = vec![""; outcomes.len()];
        Descended { ready, outcomes, untangled, remedies, gains: vec![], kept: vec![], free: vec![], device }
    }

    /// Draws curves anew that cross where their points do not, in the ways of [`REMEDIES`], until they do not.
    fn redraw(&mut self, fair: &Fair, batch: &CurveBatch, kept: &[[bool; 2]], device: &Device) -> Result<()> {
        let curves = self.curves();
        let own = |k: usize| self.ready[curves[k]].as_ref().expect("what crosses was ready");
        let mut left: Vec<usize> =
            self.untangled.left.iter().copied().filter(|&k| !own(k).tangled(&self.outcomes[k]).is_empty()).collect();
        for (finer, start, remedy) in REMEDIES {
            let segments = match fair.segments {
                Segments::PerSpan(n) if finer => Segments::PerSpan(2 * n),
                Segments::Spacing(spacing) if finer => Segments::Spacing(0.5 * spacing),
                asked => asked,
            };
            let fair = Fair { segments, ..fair.clone() };
            let ready: Vec<_> = left.iter().map(|&k| set_up_at(&fair, batch, curves[k], kept, start)).collect();
            let (able, unable): (Vec<_>, Vec<_>) = left.into_iter().zip(ready).partition(|(_, ready)| ready.is_ok());
            left = unable.into_iter().map(|(k, _)| k).collect();
            let (able, ready): (Vec<usize>, Vec<_>) = able.into_iter().unzip();
            if able.is_empty() {
                continue;
            }
            let found = Self::new(&fair, ready, device, &|_| {})?;
            let found = found.ready.into_iter().flatten().zip(found.outcomes).zip(found.untangled.tauter);
            for (k, ((ready, mut outcome), tauter)) in able.into_iter().zip(found) {
                outcome.iterations += self.outcomes[k].iterations;
                if outcome.standing == Standing::Converged && ready.tangled(&outcome).is_empty() {
                    self.ready[curves[k]] = Ok(ready);
                    (self.outcomes[k], self.untangled.tauter[k], self.remedies[k]) = (outcome, tauter, remedy);
                } else {
                    self.outcomes[k].iterations = outcome.iterations;
                    left.push(k);
                }
            }
        }
        Ok(())
    }

    /// What is worth a sentence about curve k of those that are ready, with the span that it is about.
    pub fn message(&self, k: usize) -> Option<(usize, String)> {
        let (tauter, remedy) = (&self.untangled.tauter[k], self.remedies[k]);
        match (tauter.first(), remedy) {
            (None, "") => None,
            (None, remedy) => Some((0, format!("it crossed itself where its points do not: now it {remedy}"))),
            (Some(&first), "") => Some((first, message(tauter))),
            (Some(&first), remedy) => Some((first, format!("{}, and {remedy}", message(tauter)))),
        }
    }

    /// Descends what has not converged again, from the curve of half the edges.
    ///
    /// Energies of order 3 have minima that descents from the spline miss, the more so the more edges there are. Each curve
    /// of half the edges starts from that of a quarter, down to [`COARSEST`] edges a span.
    fn refine(&mut self, fair: &Fair, batch: &CurveBatch, kept: &[[bool; 2]], device: &Device) -> Result<()> {
        let left = self.left(batch, kept);
        if left.numbers.is_empty() {
            return Ok(());
        }
        let segments = match fair.segments {
            Segments::PerSpan(n) if n >= 2 * COARSEST => Segments::PerSpan(n / 2),
            _ => return Ok(()),
        };
        let coarse = Fair { segments, starts: 1, ..fair.clone() };
        let ready = set_up_pieces(&coarse, &left.batch, &left.kept)?;
        if ready.iter().all(Result::is_err) {
            return Ok(());
        }
        let found = Self::first(&coarse, &left.batch, &left.kept, ready, device, &|_| {})?;
        let mut outcomes = found.outcomes.iter();
        let vertices = found.ready.iter().map(|ready| {
            let (ready, outcome) = (ready.as_ref().map_err(|_| vec![])?, outcomes.next().expect("one a ready curve"));
            let has_converged = outcome.standing == Standing::Converged;
            if has_converged { Ok(Vertices::of(ready, outcome)) } else { Err(vec![]) }
        });
        let coarse = FairCurves::new(&left.batch, vertices.collect(), Default::default());
        self.go_on_from(fair, left, device, &|at| coarse.vertices(at).map(|_| coarse.curve(at)))
    }

    /// What has not converged, of those that are ready.
    fn left(&self, batch: &CurveBatch, kept: &[[bool; 2]]) -> Left {
        let curves = self.curves();
        let numbers: Vec<usize> = (0..curves.len()).filter(|&k| self.outcomes[k].is_open()).collect();
        let which: Vec<usize> = numbers.iter().map(|&k| curves[k]).collect();
        let kept = which.iter().map(|&i| kept.get(i).copied().unwrap_or_default()).collect();
        Left { batch: batch.select(&which), kept, numbers }
    }

    /// Descends curves again from other ones, where there are some, and keeps what converges.
    fn go_on_from<'c>(
        &mut self,
        fair: &Fair,
        left: Left,
        device: &Device,
        start: &dyn Fn(usize) -> Option<Box<dyn Curve + 'c>>,
    ) -> Result<()> {
        let curves = self.curves();
        let (mut able, mut ready) = (Vec::new(), Vec::new());
        for (at, &k) in left.numbers.iter().enumerate() {
            let Some(start) = start(at) else { continue };
            if let Ok(again) = set_up_on(fair, &left.batch, at, left.kept[at], &*start) {
                able.push(k);
                ready.push(Ok(again));
            }
        }
        if able.is_empty() {
            return Ok(());
        }
        let found = Self::new(fair, ready, device, &|_| {})?;
        let found = found.ready.into_iter().zip(found.outcomes).zip(found.untangled.tauter);
        for (k, ((ready, mut outcome), tauter)) in able.into_iter().zip(found) {
            outcome.iterations += self.outcomes[k].iterations;
            if outcome.standing == Standing::Converged {
                self.ready[curves[k]] = ready;
                (self.outcomes[k], self.untangled.tauter[k]) = (outcome, tauter);
            }
        }
        Ok(())
    }

    /// Descends curves from the spline.
    fn first(
        fair: &Fair,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        ready: Vec<Result<Ready<D>, Unfitted>>,
        device: &Device,
        ended: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        let mut first = Self::new(fair, ready, device, ended)?;
        first.redraw(fair, batch, kept, device)?;
        if fair.energy.order() > 2 && fair.surface.is_none() {
            first.refine(fair, batch, kept, device)?;
        }
        Ok(first)
    }

    /// Descends curves from the spline and from `fair.starts` − 1 other starts, each within its limits.
    ///
    /// `ended` is called for every curve that is ready, by its number among those, when it has descended without limits
    /// from its last start.
    pub fn best(
        fair: &Fair,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        ready: Vec<Result<Ready<D>, Unfitted>>,
        device: &Device,
        ended: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        let curves: Vec<usize> = (0..ready.len()).filter(|&i| ready[i].is_ok()).collect();
        let number = |i: usize| curves.binary_search(&i).expect("it is ready");
        let at_last = |start: u32, k: usize| {
            if start + 1 == fair.starts {
                ended(k);
            }
        };
        let mut best = Self::first(fair, batch, kept, ready, device, &|k| at_last(0, k))?;
        best.keep_limits(fair, batch, Start::Free, device)?;
        best.start_from_shortest(fair, batch, kept, device)?;
        if fair.starts > 1 {
            best.gains = vec![0.0; curves.len()];
        }
        for start in 1..fair.starts {
            let ready = parallel::map(batch.len(), 16, |i| match &best.ready[i] {
                Ok(_) => set_up_at::<D>(fair, batch, i, kept, start),
                Err(problem) => Err(problem.clone()),
            });
            let (able, unable): (Vec<usize>, Vec<usize>) = curves.iter().partition(|&&i| ready[i].is_ok());
            unable.into_iter().for_each(|i| at_last(start, number(i)));
            let mut other = Self::new(fair, ready, device, &|k| at_last(start, number(able[k])))?;
            other.keep_limits(fair, batch, Start::Free, device)?;
            best.take_better(other);
        }
        Ok(best)
    }

    /// The curves that are ready.
    fn curves(&self) -> Vec<usize> {
        (0..self.ready.len()).filter(|&i| self.ready[i].is_ok()).collect()
    }

    /// Goes on until every curve keeps its limits, if it has any.
    fn keep_limits(&mut self, fair: &Fair, batch: &CurveBatch, start: Start, device: &Device) -> Result<()> {
        if fair.limits.no_crossing {
            self.free = self.outcomes.clone();
        }
        if !fair.limits.asks_nothing_alone(batch) {
            let all = (0..self.outcomes.len()).collect();
            self.kept = fenced::keep(fair, batch, self, all, &Partings::default(), start, device)?;
        }
        Ok(())
    }

    /// Whether curve k of those that are ready has a minimum that keeps its limits.
    fn is_good(&self, k: usize) -> bool {
        let kept = self.kept.get(k).and_then(Option::as_ref);
        self.outcomes[k].standing == Standing::Converged && kept.is_none_or(Kept::is_kept)
    }

    /// Starts what does not keep its limits again, from the shortest curve of bounded curvature.
    ///
    /// It keeps a largest curvature wherever the points are, and perhaps the other limits.
    fn start_from_shortest(
        &mut self,
        fair: &Fair,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        device: &Device,
    ) -> Result<()> {
        let curves = self.curves();
        let is_left = |&k: &usize| fair.limits.bounds_curvature(batch, curves[k]) && !self.is_good(k);
        let left: Vec<usize> = (0..curves.len()).filter(is_left).map(|k| curves[k]).collect();
        if left.is_empty() || D != 2 || fair.surface.is_some() {
            return Ok(());
        }
        let limits = Limits { curvature: fair.limits.curvature, ..Limits::default() };
        let shortest = Fair { energy: length(), limits, ..fair.clone() };
        let kept_of = |i: usize| kept.get(i).copied().unwrap_or_default();
        let some = batch.select(&left);
        let some_kept: Vec<[bool; 2]> = left.iter().map(|&i| kept_of(i)).collect();
        let found = shortest.fit_shortest::<D>(&some, &some_kept, device, &Tally::none())?;
        let found = FairCurves::new(&some, found.curves, Default::default());
        let ready = parallel::map(batch.len(), 16, |i| {
            let at = left.binary_search(&i).ok().filter(|&at| found.vertices(at).is_some());
            match at {
                Some(at) => set_up_on(fair, batch, i, kept_of(i), &*found.curve(at)),
                None => Err(Unfitted { status: CurveStatus::Invalid, message: String::new() }),
            }
        });
        // Without limits a descent would leave them.
        let stays = |ready: &Ready<D>| Outcome::moved(vec![[0.0; D]; ready.vertices.len()]);
        let outcomes: Vec<Outcome<D>> = ready.iter().flatten().map(stays).collect();
        let untangled = Untangled { tauter: vec![vec![]; outcomes.len()], left: vec![] };
        let mut other = Self::at(ready, outcomes, untangled, self.device.clone());
        other.keep_limits(fair, batch, Start::WithinLimits, device)?;
        let on_cpu = other.device.finished_on_cpu > 0;
        self.take_better(other);
        if on_cpu {
            self.device.finished_on_cpu = self.outcomes.iter().filter(|outcome| outcome.on_cpu).count();
        }
        Ok(())
    }

    /// Replaces what another descent of some of these curves has found better: what keeps its limits where it did not,
    /// or is cheaper.
    fn take_better(&mut self, other: Self) {
        let curves = self.curves();
        let good: Vec<bool> = (0..other.outcomes.len()).map(|k| other.is_good(k)).collect();
        let others = other.ready.into_iter().enumerate().filter_map(|(i, ready)| Some((i, ready.ok()?)));
        let (mut kept, mut free) = (other.kept.into_iter(), other.free.into_iter());
        let outcomes = other.outcomes.into_iter().zip(other.untangled.tauter).zip(good);
        for ((i, ready), ((outcome, tauter), is_good)) in others.zip(outcomes) {
            let k = curves.binary_search(&i).expect("only what was ready has other starts");
            let (mut kept, free) = (kept.next().flatten(), free.next());
            let was_good = self.is_good(k);
            let own = self.ready[i].as_mut().expect("it was ready");
            let iterations = self.outcomes[k].iterations + outcome.iterations;
            let [before, after] = [self.outcomes[k].energy * own.energy_unit, outcome.energy * ready.energy_unit];
            let is_better = match [was_good, is_good] {
                [true, true] => {
                    after < (1.0 - LOWER) * before
                        && (D > 2 || ready.tangled(&outcome).len() <= own.tangled(&self.outcomes[k]).len())
                }
                [first, second] => second && !first,
            };
            if is_better {
                if let Some(gain) = self.gains.get_mut(k) {
                    *gain = if was_good { 1.0 - after / before * (1.0 - *gain) } else { 0.0 };
                }
                if let (Some(Some(first)), Some(kept)) = (self.kept.get(k), &mut kept)
                    && kept.report.cost.is_nan()
                {
                    kept.report.cost = after / before * (1.0 + first.report.cost) - 1.0;
                }
                *own = ready;
                (self.outcomes[k], self.untangled.tauter[k], self.remedies[k]) = (outcome, tauter, "");
                self.kept.get_mut(k).into_iter().for_each(|own| *own = kept.take());
                self.free.get_mut(k).into_iter().zip(free).for_each(|(own, free)| *own = free);
            }
            self.outcomes[k].iterations = iterations;
        }
    }
}

impl Fair {
    /// Sentences about usable curves, for people who fit many: how many have loops, and how many were found cheaper from
    /// further starts, and by how much. The reports are those of a fit with these options.
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
