//! Restarts: the best minimum of one curve from several [`starts`](super::starts).
//!
//! A descent ends at a minimum near its start, and other starts may lead to other minima. The
//! cheapest one that satisfies the limits is used. If a curve crosses itself where its data polygon
//! does not, the fit is repeated in other ways.

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

/// The largest number of starts. More are unlikely to find what a thousand did not.
pub(super) const MOST: u32 = 1_000;

/// The remedies for a curve that crosses itself where its data polygon does not: whether the number
/// of edges doubles, the start, and the words for the message.
///
/// However taut a curve is, it cannot turn within an edge. From the start with circles or with the
/// polygon, it may turn to the other side at a sharp point.
const REMEDIES: [(bool, u32, &str); 4] = [
    (true, 0, "has twice the edges"),
    (false, 1, "turns another way"),
    (false, 2, "turns another way"),
    (true, 2, "turns another way, with twice the edges"),
];

/// A minimum counts as lower than another if its energy is lower by this fraction.
///
/// Energies of the same minimum differ by about 1e-6, because the regularisation depends on the
/// start.
const LOWER: f64 = 1e-4;

/// The fewest edges per span of a coarse curve that a finer one starts from.
const COARSEST: usize = 8;

/// The result of descents of one curve, with its problem.
pub(super) struct Descended<const D: usize> {
    pub ready: PreparedCurve<D>,
    pub outcome: Outcome<D>,
    untangled: Untangled,
    /// What was changed because the curve crossed itself, for the message; mostly empty.
    remedy: &'static str,
    /// The fraction of the energy that restarts saved, if there were any.
    pub gain: Option<f64>,
    /// How well it satisfies its limits, if it has any.
    pub kept: Option<LimitsResult>,
    /// The curve without limits, if curves of the batch must not cross.
    pub free: Option<Outcome<D>>,
}

/// Descends a curve from the spline and from `fair.starts` − 1 other starts, each subject to its
/// limits. `outcome` is the result of the first descent, if that is done.
pub(super) async fn best<const D: usize>(
    curve: &CurveFit<'_, D>,
    ready: PreparedCurve<D>,
    outcome: Option<Outcome<D>>,
) -> Descended<D> {
    let mut best = Descended::first(curve, ready, outcome).await;
    best.keep_limits(curve, Start::Free).await;
    best.start_from_shortest(&curve.repeated()).await;
    if curve.fair.starts > 1 {
        best.gain = Some(0.0);
    }
    for start in 1..curve.fair.starts {
        if let Ok(ready) = set_up_at(curve.fair, curve.batch, curve.i, curve.kept, start) {
            let mut other = Box::pin(Descended::new(curve, ready, None)).await;
            other.keep_limits(curve, Start::Free).await;
            best.take_better(other);
        }
    }
    best
}

impl<const D: usize> Descended<D> {
    /// Descends a curve, unless that is done, and [removes self-intersections](untangle).
    async fn new(curve: &CurveFit<'_, D>, ready: PreparedCurve<D>, outcome: Option<Outcome<D>>) -> Self {
        let (mut ready, mut outcome) = match outcome {
            Some(outcome) => (ready, outcome),
            None => minimise(curve, ready, Goal::Free).await,
        };
        let untangled = untangle(&curve.repeated(), &mut ready, &mut outcome).await;
        Descended { ready, outcome, untangled, remedy: "", gain: None, kept: None, free: None }
    }

    /// Descends a curve from the spline.
    async fn first(curve: &CurveFit<'_, D>, ready: PreparedCurve<D>, outcome: Option<Outcome<D>>) -> Self {
        let mut first = Self::new(curve, ready, outcome).await;
        if first.untangled.may_cross && first.crosses() {
            Box::pin(first.redraw(&curve.repeated())).await;
        }
        if curve.fair.energy.order() > 2 && curve.fair.surface.is_none() && first.outcome.is_open() {
            Box::pin(first.refine(&curve.repeated())).await;
        }
        first
    }

    fn crosses(&self) -> bool {
        !self.ready.tangled(&self.outcome).is_empty()
    }

    fn has_converged(&self) -> bool {
        self.outcome.termination == TerminationStatus::Converged
    }

    /// Replaces the result by another one. Iterations add up.
    fn replace(&mut self, other: Self) {
        let iterations = self.outcome.iterations + other.outcome.iterations;
        *self = Descended { outcome: Outcome { iterations, ..other.outcome }, gain: self.gain, ..other };
    }

    /// Fits the curve in the ways of [`REMEDIES`] until it does not cross itself.
    async fn redraw(&mut self, curve: &CurveFit<'_, D>) {
        for (finer, start, remedy) in REMEDIES {
            let segments = match curve.fair.segments {
                Segments::PerSpan(n) if finer => Segments::PerSpan(2 * n),
                Segments::Spacing(spacing) if finer => Segments::Spacing(0.5 * spacing),
                asked => asked,
            };
            let fair = Fair { segments, ..curve.fair.clone() };
            let Ok(ready) = set_up_at(&fair, curve.batch, curve.i, curve.kept, start) else { continue };
            let found = Self::new(curve, ready, None).await;
            if found.has_converged() && !found.crosses() {
                self.replace(Descended { remedy, ..found });
                return;
            }
            self.outcome.iterations += found.outcome.iterations;
        }
    }

    /// Repeats a fit that did not converge, starting from a curve with half the edges.
    ///
    /// Energies of order 3 have minima that descents from the spline miss, the more so the more
    /// edges there are. Each curve of half the edges starts from one of a quarter, down to
    /// [`COARSEST`] edges per span.
    async fn refine(&mut self, curve: &CurveFit<'_, D>) {
        let segments = match curve.fair.segments {
            Segments::PerSpan(n) if n >= 2 * COARSEST => Segments::PerSpan(n / 2),
            _ => return,
        };
        let fair = Fair { segments, ..curve.fair.clone() };
        let coarse = CurveFit { fair: &fair, ..*curve };
        let Ok(ready) = set_up_at(&fair, curve.batch, curve.i, curve.kept, 0) else { return };
        let found = Box::pin(Self::first(&coarse, ready, None)).await;
        if !found.has_converged() {
            return;
        }
        let vertices = Vertices::of(&found.ready, found.ready.vertices_of(&found.outcome));
        let start = FairCurves::new(
            &curve.batch.select(&[curve.i]),
            vec![Some(vertices)],
            Default::default(),
            Default::default(),
        );
        let ready = set_up_on(curve.fair, curve.batch, curve.i, curve.kept, &*start.curve(0));
        if let Ok(ready) = ready {
            let found = Self::new(curve, ready, None).await;
            if found.has_converged() {
                self.replace(Descended { remedy: self.remedy, ..found });
            }
        }
    }

    /// Enforces the limits of the curve, if it has any.
    async fn keep_limits(&mut self, curve: &CurveFit<'_, D>, start: Start) {
        self.free = curve.fair.limits.keeps_apart().then(|| self.outcome.clone());
        if !curve.fair.limits.asks_nothing_alone(curve.batch) {
            self.kept = Box::pin(keep(curve, &self.ready, &mut self.outcome, &[], start)).await;
        }
    }

    /// Whether the curve converged and satisfies its limits.
    fn is_good(&self) -> bool {
        self.has_converged() && self.kept.as_ref().is_none_or(LimitsResult::is_kept)
    }

    /// Restarts a curve that does not satisfy its limits from the shortest curve of bounded
    /// curvature.
    ///
    /// That start satisfies a largest curvature for any data, and possibly the other limits.
    async fn start_from_shortest(&mut self, curve: &CurveFit<'_, D>) {
        let CurveFit { fair, batch, i, kept, .. } = *curve;
        if !fair.limits.bounds_curvature(batch, i) || self.is_good() || D != 2 || fair.surface.is_some() {
            return;
        }
        let Some(start) = shortest::start::<D>(fair, batch, i, kept) else { return };
        let ready = set_up_on(fair, batch, i, kept, &*start.curve(0));
        let Ok(ready) = ready else { return };
        // A descent without limits would leave them.
        let outcome = Outcome::moved(vec![[0.0; D]; ready.vertices.len()]);
        let untangled = Untangled::default();
        let mut other = Descended { ready, outcome, untangled, remedy: "", gain: None, kept: None, free: None };
        other.keep_limits(curve, Start::WithinLimits).await;
        self.take_better(other);
    }

    /// Takes another result if it is better: it satisfies the limits and this one does not, or it
    /// is cheaper.
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

    /// The message about the curve, with the span that it concerns.
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
