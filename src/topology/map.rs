//! [`Map`]: the curves of a batch, joined from the spans of fitted strokes.

use std::borrow::Cow;
use std::sync::Arc;

use glam::DVec3;

use super::arcs::Use;
use super::samples::{Part, Samples, sample, samples_along};
use super::{TURN, Topology};
use crate::batch::CurveBatch;
use crate::curve::measure::BySpeed;
use crate::curve::{Curve, Jet, Sampling};
use crate::motion::Motion;
use crate::parallel;
use crate::report::{CurveReport, CurveSet, Fit, LimitReport, gain};
use crate::surface::Globe;

/// Curves from fitted strokes.
pub(super) struct Map {
    pub topology: Arc<Topology>,
    pub fit: Fit,
    /// The samples of the arcs, if they were taken.
    pub sampled: Option<(Sampling, Vec<Samples>)>,
}

impl CurveSet for Map {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        Box::new(Joined::new(&self.topology, &self.fit, i))
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let Map { topology, fit, sampled } = self;
        let batch = &topology.batch;
        let arcs = match sampled {
            Some((of, samples)) if *of == sampling => Cow::Borrowed(&samples[..]),
            _ => Cow::Owned(sample(topology, fit, sampling)),
        };
        let d = batch.dimension();
        let curves = parallel::map(batch.len(), 16, |i| {
            let count = topology.arcs.uses[i].iter().map(|way| arcs[way.arc as usize].t.len()).sum::<usize>();
            let (mut coords, mut parameters) = (Vec::with_capacity(count * d), Vec::with_capacity(count));
            samples_along(topology, &arcs, i, |point, t| {
                coords.extend_from_slice(&point.as_ref()[..d]);
                parameters.push(t);
            });
            (coords, parameters)
        });
        let ends =
            |i: usize| topology.arcs.uses[i].iter().map(|way| topology.arcs.spans(way.arc as usize)).sum::<usize>();
        CurveBatch::samples_of(batch, d, curves, |i, last| ends(i) as f64 - last)
    }
}

/// A curve joined from the spans of strokes, on the parameters 0, 1, 2 ….
struct Joined<'a> {
    dimension: usize,
    closed: bool,
    /// The curves of its strokes.
    strokes: Vec<Box<dyn Curve + 'a>>,
    ways: Vec<Way>,
    /// The first span of every way, and the number of spans.
    offsets: Vec<usize>,
    knots: Vec<f64>,
}

/// Consecutive spans of a stroke.
struct Way {
    /// The index of the stroke in the curve.
    stroke: usize,
    first: usize,
    spans: usize,
    /// Whether the curve runs against the stroke.
    reversed: bool,
    /// The difference in longitude from the stroke to the curve.
    shift: f64,
    arc: usize,
    /// Whether the curve runs against the arc.
    against_arc: bool,
    /// Whether it is the whole stroke.
    whole: bool,
    /// Whether it is a part of the map's frame.
    frame: bool,
    /// Whether it was not fitted.
    stays: bool,
}

impl<'a> Joined<'a> {
    fn new(topology: &Topology, fit: &'a Fit, i: usize) -> Self {
        let mut numbers: Vec<u32> = Vec::new();
        let (mut ways, mut offsets) = (Vec::new(), vec![0]);
        for &Use { arc, reversed, turn } in &topology.arcs.uses[i] {
            let place = topology.strokes.places[arc as usize];
            let stroke = numbers.iter().position(|&number| number == place.stroke).unwrap_or_else(|| {
                numbers.push(place.stroke);
                numbers.len() - 1
            });
            let spans = topology.arcs.spans(arc as usize);
            ways.push(Way {
                stroke,
                first: place.first as usize,
                spans,
                reversed: reversed != place.reversed,
                shift: TURN * f64::from(turn - place.turn),
                arc: arc as usize,
                against_arc: reversed,
                whole: spans == topology.strokes.batch.spans(place.stroke as usize)
                    && topology.arcs.closed[arc as usize] == topology.strokes.batch.is_closed(place.stroke as usize),
                frame: topology.arcs.frame[arc as usize],
                stays: topology.arcs.stays(arc as usize),
            });
            offsets.push(offsets[offsets.len() - 1] + spans);
        }
        let strokes = numbers.into_iter().map(|number| fit.curve(number as usize)).collect();
        let knots = (0..=offsets[offsets.len() - 1]).map(|k| k as f64).collect();
        Joined {
            dimension: topology.batch.dimension(),
            closed: topology.batch.is_closed(i),
            strokes,
            ways,
            offsets,
            knots,
        }
    }

    /// The stroke's curve, the span there, and the way of a span.
    fn place(&self, span: usize) -> (&(dyn Curve + 'a), usize, &Way) {
        let way = self.offsets.partition_point(|&offset| offset <= span).clamp(1, self.ways.len()) - 1;
        let (own, way) = (span - self.offsets[way], &self.ways[way]);
        let along = if way.reversed { way.spans - 1 - own.min(way.spans - 1) } else { own };
        (&*self.strokes[way.stroke], way.first + along, way)
    }
}

impl Curve for Joined<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let (curve, along, way) = self.place(span);
        let Jet { mut point, first, second, third } = curve.jet(along, if way.reversed { 1.0 - u } else { u });
        if way.shift != 0.0 {
            point.x += way.shift;
        }
        // Derivatives with respect to the span's fraction, in the curve's direction.
        let pace = if way.reversed { -curve.pace(along) } else { curve.pace(along) };
        Jet { point, first: first * pace, second: second * (pace * pace), third: third * (pace * pace * pace) }
    }

    fn globe(&self) -> Option<Globe> {
        self.strokes.iter().find_map(|curve| curve.globe())
    }

    fn speed(&self, span: usize, u: f64) -> f64 {
        let (curve, along, way) = self.place(span);
        match self.globe() {
            // What was not fitted lies on no globe.
            Some(globe) if way.stays => {
                let Jet { point, first, .. } = self.jet(span, u);
                globe.motion(point, first).length()
            }
            _ => curve.speed(along, if way.reversed { 1.0 - u } else { u }),
        }
    }

    fn length(&self) -> f64 {
        (0..self.spans()).map(|span| self.span_length(span)).sum()
    }

    fn span_length(&self, span: usize) -> f64 {
        let (curve, along, way) = self.place(span);
        if way.stays { BySpeed(self).span_length(span) } else { curve.span_length(along) }
    }

    fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
        let (curve, along, way) = self.place(span);
        match way.reversed {
            false => curve.fraction_at(along, length, target),
            true => 1.0 - curve.fraction_at(along, length, length - target),
        }
    }

    fn is_fitted(&self) -> bool {
        self.ways.iter().all(|way| way.stays || self.strokes[way.stroke].is_fitted())
    }

    fn pieces(&self, span: usize) -> usize {
        let (curve, along, _) = self.place(span);
        curve.pieces(along)
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        let (curve, along, way) = self.place(span);
        match way.reversed {
            false => curve.motion(along, piece),
            true => curve.motion(along, curve.pieces(along) - 1 - piece).map(|motion| motion.reversed()),
        }
    }

    fn max_curvature(&self) -> f64 {
        match &self.strokes[..] {
            // The stroke may have a closed form.
            [curve] if curve.spans() == self.spans() => curve.max_curvature(),
            _ if self.is_fitted() => self.ways.iter().map(|way| self.part(way).max_curvature()).fold(0.0, f64::max),
            _ => 0.0,
        }
    }

    fn beziers(&self, tolerance: f64) -> Vec<[DVec3; 4]> {
        self.chain(|curve| curve.beziers(tolerance))
    }

    fn fewest_beziers(&self, tolerance: f64, extremes: bool) -> Vec<[DVec3; 4]> {
        self.chain(|curve| curve.fewest_beziers(tolerance, extremes))
    }

    fn sites(&self, sampling: Sampling) -> Vec<(usize, f64)> {
        let mut all = Vec::new();
        for (way, &first) in self.ways.iter().zip(&self.offsets) {
            let curve = &*self.strokes[way.stroke];
            // The next way begins where this one ends.
            let ends = !way.whole || !curve.is_closed();
            let mut sites =
                if way.whole && !(way.frame && ends) { curve.sites(sampling) } else { self.part(way).sites(sampling) };
            if way.reversed {
                let round = way.whole && curve.is_closed();
                let turned = |(span, u): (usize, f64)| match (span, u) {
                    (0, 0.0) if round => (0, 0.0),
                    (0, 0.0) => (way.spans - 1, 1.0),
                    (span, 0.0) => (way.spans - span, 0.0),
                    (span, u) => (way.spans - 1 - span, 1.0 - u),
                };
                sites.reverse();
                sites.rotate_right(usize::from(round));
                sites = sites.into_iter().map(turned).collect();
            }
            if ends && (self.closed || first + way.spans < self.spans()) {
                sites.pop();
            }
            all.extend(sites.into_iter().map(|(span, u)| (first + span, u)));
        }
        all
    }
}

impl Joined<'_> {
    /// The Béziers of all arcs. Every arc is converted in its own direction, so that curves that share
    /// it get the same Béziers.
    fn chain(&self, beziers: impl Fn(&dyn Curve) -> Vec<[DVec3; 4]>) -> Vec<[DVec3; 4]> {
        let mut all = Vec::new();
        for way in &self.ways {
            let mut pieces = if way.whole { beziers(&*self.strokes[way.stroke]) } else { beziers(&self.part(way)) };
            if way.reversed {
                pieces.reverse();
                for piece in &mut pieces {
                    piece.reverse();
                }
            }
            if way.shift != 0.0 {
                for point in pieces.iter_mut().flatten() {
                    point.x += way.shift;
                }
            }
            all.extend(pieces);
        }
        all
    }

    fn part(&self, way: &Way) -> Part<'_> {
        Part { curve: &*self.strokes[way.stroke], spans: way.first..way.first + way.spans, frame: way.frame }
    }
}

/// The report of curve `i` from its strokes' reports.
pub(super) fn report(topology: &Topology, fit: &Fit, i: usize) -> CurveReport {
    let (arcs, strokes) = (&topology.arcs, &topology.strokes);
    let fitted = arcs.uses[i].iter().filter(|way| !arcs.stays(way.arc as usize));
    let mut numbers: Vec<usize> = fitted.map(|way| strokes.places[way.arc as usize].stroke as usize).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.is_empty() {
        // Nothing of it was fitted.
        return CurveReport { iterations: 0, ..CurveReport::solved(0.0) };
    }
    let reports = || numbers.iter().map(|&number| &fit.reports()[number]);
    if let ([number], [only]) = (&numbers[..], &arcs.uses[i][..])
        && arcs.spans(only.arc as usize) == strokes.batch.spans(*number)
    {
        return fit.reports()[*number].clone();
    }
    let worst = reports().find(|report| !report.status.is_usable());
    let worst = worst.or_else(|| reports().find(|report| report.message.is_some())).or_else(|| reports().next());
    let worst = worst.expect("a curve has a stroke");
    let mut smoothing = reports().map(|report| report.smoothing);
    let first = smoothing.next().flatten();
    CurveReport {
        status: worst.status,
        message: worst.message.clone(),
        energy: reports().map(|report| report.energy).sum(),
        iterations: reports().map(|report| report.iterations).sum(),
        gradient_norm: reports().map(|report| report.gradient_norm).fold(0.0, f64::max),
        smoothing: first.filter(|_| smoothing.all(|other| other == first)),
        gain: gain(reports()),
        loops: reports().filter_map(|report| report.loops).reduce(f64::max),
        limits: LimitReport::joined(reports()),
        max_deviation: deviation(topology, fit, i),
    }
}

/// The largest distance from a data point of curve `i` to the curve's point of the same parameter.
fn deviation(topology: &Topology, fit: &Fit, i: usize) -> f64 {
    let joined = Joined::new(topology, fit, i);
    let mut largest = 0.0_f64;
    for (way, &first) in joined.ways.iter().zip(&joined.offsets) {
        for (k, stop) in topology.arcs.stops[way.arc].iter().enumerate().filter(|_| way.spans > 0) {
            let own = if way.against_arc { way.spans - k } else { k };
            let (span, u) = if own == way.spans { (first + own - 1, 1.0) } else { (first + own, 0.0) };
            let [x, y, z] = topology.vertices.position(stop.vertex, 0);
            let point = joined.jet(span, u).point;
            let turns = ((point.x - x) / TURN).round();
            let x = if topology.geographic { x + TURN * turns } else { x };
            largest = largest.max((point - DVec3::new(x, y, z)).length());
        }
    }
    largest
}
