//! Restarts: the best minimum of one curve from several [`starts`](super::starts).
//!
//! A descent ends at the minimum below its start. From other starts it may find other minima. The cheapest that keeps its
//! limits is taken. If a curve crosses itself where its points do not, the fit is repeated.

use super::curves::{FairCurves, Vertices};
use super::fair::{Fair, Segments};
use super::lane::TerminationStatus;
use super::limited::{Start, keep};
use super::limits_result::LimitsResult;
use super::minimise::minimise;
use super::problem::Outcome;
use super::queue::{CurveFit, Goal};
use super::self_intersections::{Untangled, message, untangle};
use super::setup::{PreparedCurve, set_up_on};
use super::shortest;
use super::starts::set_up_at;
use crate::report::CurveSet;

/// Starts at most. What a thousand do not find, more will not.
pub(super) const MOST: u32 = 1_000;

/// The remedies of a curve that crosses itself where its points do not: whether it has twice the edges, its start, and what
/// is said of it.
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
/// The same one has an energy that differs by some 1e-6, since the regularisation is the start's.
const LOWER: f64 = 1e-4;

/// The fewest edges a span of a curve that a finer one starts from.
const COARSEST: usize = 8;

/// A curve that has been descended, with its problem.
pub(super) struct Descended<const D: usize> {
    pub ready: PreparedCurve<D>,
    pub outcome: Outcome<D>,
    untangled: Untangled,
    /// What it does otherwise because it crossed itself, in words; mostly nothing.
    remedy: &'static str,
    /// The part of the energy that further starts have saved, if there are any.
    pub gain: Option<f64>,
    /// How it keeps its limits, if it has any.
    pub kept: Option<LimitsResult>,
    /// The curve without limits, if neighbours may not cross.
    pub free: Option<Outcome<D>>,
}

/// Descends a curve from the spline and from `fair.starts` − 1 other starts, each within its limits.
pub(super) async fn best<const D: usize>(curve: &CurveFit<'_, D>, ready: PreparedCurve<D>) -> Descended<D> {
    let mut best = Descended::first(curve, ready).await;
    best.keep_limits(curve, Start::Free).await;
    best.start_from_shortest(curve).await;
    if curve.fair.starts > 1 {
        best.gain = Some(0.0);
    }
    for start in 1..curve.fair.starts {
        if let Ok(ready) = set_up_at(curve.fair, curve.batch, curve.i, curve.kept, start) {
            let mut other = Box::pin(Descended::new(curve, ready)).await;
            other.keep_limits(curve, Start::Free).await;
            best.take_better(other);
        }
    }
    best
}

impl<const D: usize> Descended<D> {
    /// Descends a curve, and [untangles](untangle) it.
    async fn new(curve: &CurveFit<'_, D>, ready: PreparedCurve<D>) -> Self {
        let (mut ready, mut outcome) = minimise(curve, ready, Goal::Free).await;
        let untangled = untangle(curve, &mut ready, &mut outcome).await;
        Descended { ready, outcome, untangled, remedy: "", gain: None, kept: None, free: None }
    }

    /// Descends a curve from the spline.
    async fn first(curve: &CurveFit<'_, D>, ready: PreparedCurve<D>) -> Self {
        let mut first = Self::new(curve, ready).await;
        if first.untangled.may_cross && first.crosses() {
            Box::pin(first.redraw(curve)).await;
        }
        if curve.fair.energy.order() > 2 && curve.fair.surface.is_none() && first.outcome.is_open() {
            Box::pin(first.refine(curve)).await;
        }
        first
    }

    fn crosses(&self) -> bool {
        !self.ready.tangled(&self.outcome).is_empty()
    }

    fn has_converged(&self) -> bool {
        self.outcome.termination == TerminationStatus::Converged
    }

    /// Takes another descent of the curve. Iterations add up.
    fn replace(&mut self, other: Self) {
        let iterations = self.outcome.iterations + other.outcome.iterations;
        *self = Descended { outcome: Outcome { iterations, ..other.outcome }, gain: self.gain, ..other };
    }

    /// Draws the curve in the ways of [`REMEDIES`], until it does not cross itself.
    async fn redraw(&mut self, curve: &CurveFit<'_, D>) {
        for (finer, start, remedy) in REMEDIES {
            let segments = match curve.fair.segments {
                Segments::PerSpan(n) if finer => Segments::PerSpan(2 * n),
                Segments::Spacing(spacing) if finer => Segments::Spacing(0.5 * spacing),
                asked => asked,
            };
            let fair = Fair { segments, ..curve.fair.clone() };
            let Ok(ready) = set_up_at(&fair, curve.batch, curve.i, curve.kept, start) else { continue };
            let found = Self::new(curve, ready).await;
            if found.has_converged() && !found.crosses() {
                self.replace(Descended { remedy, ..found });
                return;
            }
            self.outcome.iterations += found.outcome.iterations;
        }
    }

    /// Descends again what has not converged, from the curve of half the edges.
    ///
    /// Energies of order 3 have minima that descents from the spline miss, the more so the more edges there are. Each curve
    /// of half the edges starts from one of a quarter, down to [`COARSEST`] edges a span.
    async fn refine(&mut self, curve: &CurveFit<'_, D>) {
        let segments = match curve.fair.segments {
            Segments::PerSpan(n) if n >= 2 * COARSEST => Segments::PerSpan(n / 2),
            _ => return,
        };
        let fair = Fair { segments, ..curve.fair.clone() };
        let coarse = CurveFit { fair: &fair, ..*curve };
        let Ok(ready) = set_up_at(&fair, curve.batch, curve.i, curve.kept, 0) else { return };
        let found = Box::pin(Self::first(&coarse, ready)).await;
        if !found.has_converged() {
            return;
        }
        let vertices = Vertices::of(&found.ready, found.ready.vertices_of(&found.outcome));
        let start = FairCurves::new(&curve.batch.select(&[curve.i]), vec![Some(vertices)], Default::default());
        let ready = set_up_on(curve.fair, curve.batch, curve.i, curve.kept, &*start.curve(0));
        if let Ok(ready) = ready {
            let found = Self::new(curve, ready).await;
            if found.has_converged() {
                self.replace(Descended { remedy: self.remedy, ..found });
            }
        }
    }

    /// Goes on until the curve keeps its limits, if it has any.
    async fn keep_limits(&mut self, curve: &CurveFit<'_, D>, start: Start) {
        self.free = curve.fair.limits.no_crossing.then(|| self.outcome.clone());
        if !curve.fair.limits.asks_nothing_alone(curve.batch) {
            self.kept = Box::pin(keep(curve, &self.ready, &mut self.outcome, &[], start)).await;
        }
    }

    /// Whether the curve has a minimum that keeps its limits.
    fn is_good(&self) -> bool {
        self.has_converged() && self.kept.as_ref().is_none_or(LimitsResult::is_kept)
    }

    /// Starts what does not keep its limits again, from the shortest curve of bounded curvature.
    ///
    /// It keeps a largest curvature wherever the points are, and perhaps the other limits.
    async fn start_from_shortest(&mut self, curve: &CurveFit<'_, D>) {
        let CurveFit { fair, batch, i, kept, .. } = *curve;
        if !fair.limits.bounds_curvature(batch, i) || self.is_good() || D != 2 || fair.surface.is_some() {
            return;
        }
        let Some(start) = shortest::start::<D>(fair, batch, i, kept) else { return };
        let ready = set_up_on(fair, batch, i, kept, &*start.curve(0));
        let Ok(ready) = ready else { return };
        // Without limits a descent would leave them.
        let outcome = Outcome::moved(vec![[0.0; D]; ready.vertices.len()]);
        let untangled = Untangled::default();
        let mut other = Descended { ready, outcome, untangled, remedy: "", gain: None, kept: None, free: None };
        other.keep_limits(curve, Start::WithinLimits).await;
        self.take_better(other);
    }

    /// Takes what another descent has found if it is better: it keeps its limits where this one does not, or is cheaper.
    fn take_better(&mut self, mut other: Self) {
        let [before, after] = [&*self, &other].map(|own| own.outcome.energy * own.ready.energy_unit);
        let is_better = match [self.is_good(), other.is_good()] {
            [true, true] => {
                let crossings = |own: &Self| own.ready.tangled(&own.outcome).len();
                after < (1.0 - LOWER) * before && (D > 2 || crossings(&other) <= crossings(self))
            }
            [first, second] => second && !first,
        };
        if !is_better {
            self.outcome.iterations += other.outcome.iterations;
            return;
        }
        let was_good = self.is_good();
        self.gain = self.gain.map(|gain| if was_good { 1.0 - after / before * (1.0 - gain) } else { 0.0 });
        if let (Some(first), Some(kept)) = (&self.kept, &mut other.kept)
            && kept.report.cost.is_nan()
        {
            kept.report.cost = after / before * (1.0 + first.report.cost) - 1.0;
        }
        self.replace(other);
    }

    /// What is worth a sentence about the curve, with the span that it is about.
    pub fn message(&self) -> Option<(usize, String)> {
        let (tauter, remedy) = (&self.untangled.tauter, self.remedy);
        match (tauter.first(), remedy) {
            (None, "") => None,
            (None, remedy) => Some((0, format!("it crossed itself where its points do not: now it {remedy}"))),
            (Some(&first), "") => Some((first, message(tauter))),
            (Some(&first), remedy) => Some((first, format!("{}, and {remedy}", message(tauter)))),
        }
    }
}
