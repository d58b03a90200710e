//! Fitted smooth connection functions as [`Curve`]s, parametrised by arc length.

use std::collections::BTreeMap;
use std::sync;

use super::arc::{Arc, Site};
use super::dots::{Dots, Exponents};
use super::problem::Ends;
use super::start::wrap;
use super::tension::{Near, TensionSegment};
use super::universal::Universal;
use crate::batch::Origin;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::{Curve, Input, Jet, Sampling};
use crate::parallel;
use crate::report::CurveSet;
use glam::DVec3;

/// A segment from one data point to the next.
#[derive(Clone, Debug)]
pub(crate) struct Laid {
    pub arc: Piece,
    pub start: [f64; 2],
    pub chord: [f64; 2],
    /// The index of its universal curve.
    pub curve: u32,
}

/// The geometry of a segment.
#[derive(Clone, Debug)]
pub(crate) enum Piece {
    Arc(Arc),
    Taut(Box<TensionSegment>),
}

impl Laid {
    /// The length of the chord.
    fn chord_length(&self) -> f64 {
        match &self.arc {
            Piece::Arc(arc) => arc.chord,
            Piece::Taut(segment) => segment.chord(),
        }
    }

    /// Arc length.
    pub fn length(&self, universal: &[Universal]) -> f64 {
        match &self.arc {
            Piece::Arc(arc) => arc.length(&universal[self.curve as usize]),
            Piece::Taut(segment) => segment.length(),
        }
    }

    /// ∫|κ|^ν ds, under tension plus λ ∫ds.
    pub fn cost(&self, universal: &[Universal]) -> f64 {
        match &self.arc {
            Piece::Arc(arc) => arc.cost(&universal[self.curve as usize]),
            Piece::Taut(segment) => segment.cost(),
        }
    }

    fn max_curvature(&self, universal: &[Universal]) -> f64 {
        match &self.arc {
            Piece::Arc(arc) => arc.max_curvature(&universal[self.curve as usize]),
            Piece::Taut(segment) => segment.max_curvature(),
        }
    }

    /// The jet at the fraction u of its length, in its chord's frame, by arc length.
    pub(super) fn jet(&self, universal: &[Universal], u: f64) -> Jet {
        match &self.arc {
            Piece::Arc(arc) => jet(arc.at(&universal[self.curve as usize], u)),
            Piece::Taut(segment) => {
                jet(segment.place_of(if u < 1.0 { u * segment.length() } else { segment.length() }))
            }
        }
    }
}

/// A fitted curve: its segments, and the arc lengths of its data points.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub segments: Vec<Laid>,
    pub knots: Vec<f64>,
}

impl Chain {
    /// Places the segments between dots with these directions (NaN for free ends), near the known
    /// shapes. `None` if a segment has no minimiser.
    pub fn lay(dots: &Dots, directions: &[f64], exponents: &Exponents, known: &[Near]) -> Option<Self> {
        let n = directions.len();
        let taut = if exponents.tension > 0.0 { dots.tension_spans(directions, exponents) } else { Vec::new() };
        let mut segments = Vec::with_capacity(dots.spans.len());
        let mut knots = Vec::with_capacity(dots.spans.len() + 1);
        knots.push(0.0);
        let mut length = 0.0;
        let mut dot = 0;
        for &start in &dots.spans {
            let Some(point) = start else {
                // Between repeated points.
                let start = dots.points[dot % n];
                segments.push(Laid { arc: Piece::Arc(Arc::straight(0.0)), start, chord: [0.0; 2], curve: 0 });
                knots.push(length);
                continue;
            };
            debug_assert_eq!(point, dot);
            let next = (dot + 1) % n;
            let (number, chord) = (dots.curves[dot], dots.chords.lengths[dot]);
            let curve = &exponents.universal[number as usize];
            let angle = |dot: usize, direction: f64| wrap(direction - dots.chords.directions[dot]);
            let (a, b) = (angle(dot, directions[dot]), angle(dot, directions[next]));
            let arc = if let Some(span) = taut.get(dot) {
                let [a, b] = [a, b].map(|angle| if angle.is_nan() { 0.0 } else { angle });
                let near = known.get(dot).copied().unwrap_or_default();
                Piece::Taut(Box::new(span.segment_near(&exponents.laws[number as usize], [a, b], &near)?.tabulated()))
            } else {
                Piece::Arc(match Ends::between(directions[dot], directions[next]) {
                    Ends::Directed => Arc::cheapest(curve, chord, [a, b])?,
                    Ends::FreeStart => Arc::free(curve, chord, b)?,
                    Ends::FreeEnd => Arc::free(curve, chord, -a)?.reversed(),
                    Ends::Straight => Arc::straight(chord),
                })
            };
            let ([x, y], [u, v]) = (dots.points[dot], dots.points[next]);
            let laid = Laid { arc, start: [x, y], chord: [u - x, v - y], curve: u32::from(number) };
            length += laid.length(&exponents.universal);
            knots.push(length);
            segments.push(laid);
            dot += 1;
        }
        Some(Chain { segments, knots })
    }

    /// Σ∫|κ|^ν ds, under tension Σ∫(|κ|^ν + λ) ds
    pub fn cost(&self, universal: &[Universal]) -> f64 {
        self.segments.iter().map(|laid| laid.cost(universal)).sum()
    }

    /// A single arc in the frame of its chord.
    pub fn one(arc: Arc, curve: &Universal) -> Self {
        let laid = Laid { arc: Piece::Arc(arc), start: [0.0; 2], chord: [arc.chord, 0.0], curve: 0 };
        Chain { segments: vec![laid], knots: vec![0.0, arc.length(curve)] }
    }
}

/// The curves of a batch: the segments of each, or its input if it is unfitted.
pub(crate) struct Chains {
    pub curves: Vec<Result<Chain, Input>>,
    pub universal: Vec<Universal>,
    pub closed: Vec<bool>,
    /// The given parameters of the data points, which replace arc lengths in samples.
    pub times: Vec<Option<Vec<f64>>>,
    pub problems: BTreeMap<usize, Unfitted>,
    pub origin: sync::Arc<Origin>,
}

/// The jet by arc length at a site with dκ/ds there.
fn jet((site, slope): (Site, f64)) -> Jet {
    let (sine, cosine) = site.angle.sin_cos();
    let (tangent, normal) = (DVec3::new(cosine, sine, 0.0), DVec3::new(-sine, cosine, 0.0));
    let [x, y] = site.point;
    Jet {
        point: DVec3::new(x, y, 0.0),
        first: tangent,
        second: site.curvature * normal,
        third: slope * normal - site.curvature * site.curvature * tangent,
    }
}

/// A chain with the universal curves of its arcs.
pub(super) struct ChainCurve<'a> {
    pub chain: &'a Chain,
    pub universal: &'a [Universal],
    pub closed: bool,
}

impl Curve for ChainCurve<'_> {
    fn dimension(&self) -> usize {
        2
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> &[f64] {
        &self.chain.knots
    }

    fn spans(&self) -> usize {
        self.chain.segments.len()
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let laid = &self.chain.segments[span];
        let Laid { start, chord, .. } = *laid;
        let length = laid.chord_length();
        let start = DVec3::new(start[0], start[1], 0.0);
        if length == 0.0 {
            return Jet { point: start, ..Jet::default() };
        }
        let [cosine, sine] = chord.map(|x| x / length);
        let turn = |v: DVec3| DVec3::new(cosine * v.x - sine * v.y, sine * v.x + cosine * v.y, 0.0);
        let jet = laid.jet(self.universal, u);
        let point = if u == 1.0 { start + DVec3::new(chord[0], chord[1], 0.0) } else { start + turn(jet.point) };
        Jet { point, first: turn(jet.first), second: turn(jet.second), third: turn(jet.third) }
    }

    fn length(&self) -> f64 {
        self.chain.knots[self.chain.knots.len() - 1]
    }

    fn span_length(&self, span: usize) -> f64 {
        self.pace(span)
    }

    fn speed(&self, span: usize, _: f64) -> f64 {
        self.pace(span)
    }

    fn fraction_at(&self, _: usize, length: f64, target: f64) -> f64 {
        if target > 0.0 { (target / length).min(1.0) } else { 0.0 }
    }

    /// Along an arc |κ| is largest at the place furthest from its inflections, and falls on both
    /// sides.
    fn max_curvature(&self) -> f64 {
        let of_segment = |laid: &Laid| match laid.chord_length() {
            0.0 => 0.0,
            _ => laid.max_curvature(self.universal),
        };
        self.chain.segments.iter().map(of_segment).fold(0.0, f64::max)
    }
}

impl Chains {
    fn chain(&self, i: usize) -> Option<ChainCurve<'_>> {
        let chain = self.curves[i].as_ref().ok()?;
        Some(ChainCurve { chain, universal: &self.universal, closed: self.closed[i] })
    }

    /// Coordinates and parameters of the samples of curve `i`.
    fn sample(&self, i: usize, sampling: Sampling) -> (Vec<f64>, Vec<f64>) {
        let Some(curve) = self.chain(i) else {
            return self.curves[i]
                .as_ref()
                .err()
                .map(|input| input.sample(2, self.closed[i], sampling))
                .unwrap_or_default();
        };
        let knots = self.times[i].as_ref().unwrap_or(&curve.chain.knots);
        let site = |(span, u): (usize, f64)| {
            let point = curve.jet(span, u).point;
            ([point.x, point.y], knots[span] + u * (knots[span + 1] - knots[span]))
        };
        let (coords, t): (Vec<[f64; 2]>, Vec<f64>) = curve.sites(sampling).into_iter().map(site).unzip();
        (coords.into_flattened(), t)
    }
}

impl CurveSet for Chains {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match (self.chain(i), &self.curves[i]) {
            (Some(curve), _) => Box::new(curve),
            (None, Err(input)) => Box::new(input.polygon(2, self.closed[i])),
            (None, Ok(_)) => unreachable!("a curve with segments is a chain"),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let samples: Vec<(Vec<f64>, Vec<f64>)> = parallel::map(self.curves.len(), 16, |i| self.sample(i, sampling));
        let closing = |i: usize, last: f64| match &self.curves[i] {
            Ok(chain) => self.times[i].as_ref().unwrap_or(&chain.knots).last().expect("one knot a point") - last,
            Err(input) => input.closing_after(last),
        };
        let (closed, problems) = (self.closed.clone(), self.problems.clone());
        CurveBatch::from_samples(2, samples, closing, closed, problems, self.origin.clone())
    }
}
