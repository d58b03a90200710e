//! [`Samples`]: the samples of an arc.

use std::ops::Range;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::levels::Levels;
use super::tight::Tight;
use super::{TURN, Topology, crossings};
use crate::curve::few::keep_area;
use crate::curve::{Curve, Jet, Sampling};
use crate::motion::Motion;
use crate::parallel;
use crate::report::Fit;
use crate::surface::Globe;

/// The samples of an arc, in its direction.
#[derive(Clone)]
pub(super) struct Samples {
    pub points: Vec<DVec3>,
    /// Span + fraction of the span.
    pub t: Vec<f64>,
}

impl Samples {
    /// Rounds the points to this number of decimals, as writers do.
    pub fn round(&mut self, decimals: u8) {
        let by = 10_f64.powi(decimals.into());
        let round = |x: f64| Some((x * by).round() / by + 0.0).filter(|rounded| rounded.is_finite()).unwrap_or(x);
        for point in &mut self.points {
            *point = point.map(round);
        }
    }

    /// Leaves out points where the line repeats a point or reverses, such as at the end of a bay
    /// that rounding has closed.
    ///
    /// Ends are kept, and so are lines that would vanish. Returns the number of removed reversals.
    pub fn leave_out(&mut self, closed: bool) -> usize {
        let at = |k: usize| self.points[k].truncate();
        let n = self.points.len();
        let (mut kept, mut turns, end) = (Vec::with_capacity(n), 0, n + usize::from(closed));
        // A closed line returns to its first point.
        for k in 0..end {
            while let [.., a, b] = kept[..]
                && (at(b) == at(k % n) || crossings::turns_back(at(a), at(b), at(k % n)))
            {
                turns += usize::from(at(b) != at(k % n));
                kept.pop();
            }
            let repeats = kept.last().is_some_and(|&b| at(b) == at(k % n));
            if k < n && (!repeats || k + 1 == end) {
                kept.push(k);
            }
        }
        if kept.len() < if closed { 3 } else { 2 } {
            return 0;
        }
        self.points = kept.iter().map(|&k| self.points[k]).collect();
        self.t = kept.iter().map(|&k| self.t[k]).collect();
        turns
    }
}

/// Calls `each` for the samples along curve `i`, with the span + fraction.
pub(super) fn samples_along(topology: &Topology, arcs: &[Samples], i: usize, mut each: impl FnMut(DVec3, f64)) {
    let uses = &topology.arcs.uses[i];
    let mut before = 0;
    for (k, way) in uses.iter().enumerate() {
        let (arc, closed) = (&arcs[way.arc as usize], topology.arcs.closed[way.arc as usize]);
        let spans = topology.arcs.spans(way.arc as usize);
        let shift = TURN * f64::from(way.turn);
        let mut each = |at: usize, t: f64| {
            let mut point = arc.points[at];
            if way.turn != 0 {
                point.x += shift;
            }
            each(point, before as f64 + t);
        };
        // The next arc begins where this one ends. A closed curve ends where it began.
        let ends = k + 1 == uses.len() && (closed || !topology.batch.is_closed(i));
        let all = arc.t.len();
        let count = if ends { all } else { all - 1 };
        match (way.reversed, closed) {
            (false, _) => {
                for at in 0..count {
                    each(at, arc.t[at]);
                }
            }
            (true, false) => {
                for at in (all - count..all).rev() {
                    each(at, spans as f64 - arc.t[at]);
                }
            }
            (true, true) => {
                each(0, 0.0);
                for at in (1..all).rev() {
                    each(at, spans as f64 - arc.t[at]);
                }
            }
        }
        before += spans;
    }
}

/// The samples of every arc.
pub(super) fn sample(topology: &Topology, fit: &Fit, sampling: Sampling) -> Vec<Samples> {
    let strokes = &topology.strokes;
    let of_strokes = parallel::map(fit.len(), 1, |s| {
        let curve = fit.curve(s);
        let arcs = strokes.arcs[s].iter();
        arcs.map(|&arc| (arc, sample_arc(topology, &*curve, arc as usize, sampling))).collect::<Vec<_>>()
    });
    let mut samples: Vec<Option<Samples>> = (0..strokes.places.len()).map(|_| None).collect();
    for (arc, of_arc) in of_strokes.into_iter().flatten() {
        samples[arc as usize] = Some(of_arc);
    }
    let mut samples: Vec<Samples> =
        samples.into_iter().map(|of_arc| of_arc.expect("every arc lies on a stroke")).collect();
    if sampling.tolerance().is_some() {
        give_area(topology, fit, &mut samples);
    }
    meet(topology, &mut samples, None);
    samples
}

/// Gives rings of two arcs that are their chords the samples of data points instead.
fn give_area(topology: &Topology, fit: &Fit, samples: &mut [Samples]) {
    for (i, uses) in topology.arcs.uses.iter().enumerate() {
        let is_flat = |samples: &[Samples]| uses.iter().all(|way| samples[way.arc as usize].points.len() <= 2);
        if topology.batch.is_closed(i) && uses.len() == 2 && is_flat(samples) {
            for arc in uses.iter().map(|way| way.arc as usize) {
                let curve = fit.curve(topology.strokes.places[arc].stroke as usize);
                samples[arc] = sample_arc(topology, &*curve, arc, Sampling::PerSpan(1));
            }
        }
    }
}

/// The samples of an arc from the curve of its stroke.
fn sample_arc(topology: &Topology, curve: &dyn Curve, arc: usize, sampling: Sampling) -> Samples {
    let (place, spans) = (topology.strokes.places[arc], topology.arcs.spans(arc));
    let first = place.first as usize;
    let whole = spans == curve.spans() && topology.arcs.closed[arc] == curve.is_closed();
    let frame = topology.arcs.frame[arc] && !topology.arcs.closed[arc];
    let part = Part { curve, spans: first..first + spans, frame };
    let own: &dyn Curve = if whole && !frame { curve } else { &part };
    let sites = own.sites(sampling);
    let at = |&(span, u): &(usize, f64)| {
        let point = curve.jet(if whole { span } else { first + span }, u).point;
        if place.turn == 0 { point } else { DVec3 { x: point.x - TURN * f64::from(place.turn), ..point } }
    };
    let mut points: Vec<DVec3> = sites.iter().map(at).collect();
    if let Some(tolerance) = sampling.tolerance()
        && curve.dimension() == 2
        && own.is_fitted()
    {
        keep_area(&own, &sites, &mut points, tolerance);
    }
    let mut t: Vec<f64> = sites.iter().map(|&(span, u)| span as f64 + u).collect();
    if place.reversed {
        points.reverse();
        t.reverse();
        for t in &mut t {
            *t = spans as f64 - *t;
        }
    }
    Samples { points, t }
}

/// Samples the arcs of changed strokes again, at their levels and rounded to `decimals`.
pub(super) fn sample_again(
    topology: &Topology,
    levels: &Levels,
    changed: &[u32],
    (sampling, decimals): (Sampling, Option<u8>),
    samples: &mut [Samples],
) {
    let again = parallel::map(changed.len(), 1, |k| {
        let stroke = changed[k];
        let cubics = levels.cubics(stroke);
        let curve = Tight { curve: levels.fit().curve(stroke as usize), cubics: &cubics };
        let arcs = topology.strokes.arcs[stroke as usize].iter();
        arcs.map(|&arc| (arc, sample_arc(topology, &curve, arc as usize, sampling))).collect::<Vec<_>>()
    });
    for (arc, of_arc) in again.into_iter().flatten() {
        samples[arc as usize] = of_arc;
    }
    meet(topology, samples, decimals);
    if decimals.is_some() {
        for &arc in changed.iter().flat_map(|&stroke| &topology.strokes.arcs[stroke as usize]) {
            samples[arc as usize].leave_out(topology.arcs.closed[arc as usize]);
        }
    }
}

/// Gives arcs that meet the same point there, bit for bit: the junction's, or else the first arc's.
/// Then rounds all.
pub(super) fn meet(topology: &Topology, samples: &mut [Samples], decimals: Option<u8>) {
    let mut places: FxHashMap<u32, DVec3> = FxHashMap::default();
    for (arc, stops) in topology.arcs.stops.iter().enumerate() {
        if topology.arcs.closed[arc] || topology.arcs.alone[arc] {
            continue;
        }
        let points = &mut samples[arc].points;
        for (stop, at) in [(stops[0], 0), (stops[stops.len() - 1], points.len() - 1)] {
            let moved = |point: DVec3, turn: i32| match turn {
                0 => point,
                _ => DVec3 { x: point.x + TURN * f64::from(turn), ..point },
            };
            let place =
                places.entry(stop.vertex).or_insert_with(|| match topology.strokes.pinned.contains(&stop.vertex) {
                    true => DVec3::from_array(topology.vertices.position(stop.vertex, 0)),
                    false => moved(points[at], -stop.turn),
                });
            points[at] = moved(*place, stop.turn);
        }
    }
    if let Some(decimals) = decimals {
        round(topology, samples, decimals);
    }
}

/// Rounds the samples of all arcs that were fitted.
pub(super) fn round(topology: &Topology, samples: &mut [Samples], decimals: u8) {
    for (of_arc, _) in samples.iter_mut().zip(&topology.arcs.kept).filter(|(_, kept)| !**kept) {
        of_arc.round(decimals);
    }
}

/// Consecutive spans of a curve as an open curve.
pub(super) struct Part<'a> {
    pub curve: &'a dyn Curve,
    pub spans: Range<usize>,
    /// Whether it is a part of the map's frame, which is sampled like a fitted curve.
    pub frame: bool,
}

impl Curve for Part<'_> {
    fn dimension(&self) -> usize {
        self.curve.dimension()
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn knots(&self) -> &[f64] {
        &self.curve.knots()[self.spans.start..=self.spans.end]
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        self.curve.jet(self.spans.start + span, u)
    }

    fn is_fitted(&self) -> bool {
        self.frame || self.curve.is_fitted()
    }

    fn globe(&self) -> Option<Globe> {
        self.curve.globe()
    }

    fn speed(&self, span: usize, u: f64) -> f64 {
        self.curve.speed(self.spans.start + span, u)
    }

    fn span_length(&self, span: usize) -> f64 {
        self.curve.span_length(self.spans.start + span)
    }

    fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
        self.curve.fraction_at(self.spans.start + span, length, target)
    }

    fn pieces(&self, span: usize) -> usize {
        self.curve.pieces(self.spans.start + span)
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        self.curve.motion(self.spans.start + span, piece)
    }

    fn pace(&self, span: usize) -> f64 {
        self.curve.pace(self.spans.start + span)
    }

    fn is_fixed(&self, span: usize) -> bool {
        span == 0 || self.curve.is_fixed(self.spans.start + span)
    }

    /// 2 for two spans or more, so that a ring of two arcs has an area.
    fn least(&self, sampling: Sampling) -> usize {
        match sampling {
            Sampling::PerSpan(_) | Sampling::Tolerance(_) | Sampling::AsMany(_) => 1,
            _ => self.spans.len().min(2),
        }
    }
}
