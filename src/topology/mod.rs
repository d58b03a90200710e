//! Curves that share points: maps whose neighbours stay neighbours.
//!
//! Two polygons with a common border hold its points twice. Fitted one by one they would tear: each
//! border would get a curve of its own. A [`Topology`] finds what curves share and has it fitted
//! once:
//!
//! ```text
//! curves ─► vertices: equal points ─► arcs: chains between junctions ─► strokes: arcs that go straight on ─► fit ─► the curves again
//! ```
//!
//! - A *junction* is a vertex where curves part, meet or end (as in TopoJSON). Curves are cut there
//!   into *arcs*, and equal arcs are one.
//! - Where an arc goes straight on through a junction, both are one *stroke*: it is fitted as one
//!   curve, whose direction does not break there.
//! - Junctions stay where they are: their points are
//!   [`pinned`](crate::Constraints::pinned).
//! - A ring without a junction is a closed curve as it always was.
//!
//! After the fit the curves are put together again from the strokes' spans. Curves that shared
//! points share every sample, bit for bit.
//!
//! ```
//! use faircurve::{CurveBatch, Device, Sampling, spline::Natural, topology::{Options, Topology}};
//! // Two squares side by side.
//! let left = [[0.0, 0.0], [1.0, 0.0], [1.2, 0.5], [1.0, 1.0], [0.0, 1.0]];
//! let right = [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.2, 0.5]];
//! let map = CurveBatch::from_slices(&[&left[..], &right[..]])?.closed(true);
//! let topology = Topology::new(&map, &Options::default())?;
//! assert_eq!((topology.junctions(), topology.shared_arcs()), (2, 1));
//! let fit = Natural::default().fit(topology.strokes(), &Device::cpu())?;
//! let samples = topology.join(fit).polylines(Sampling::PerSpan(8));
//! let of = |i: usize| samples.points(i).as_chunks::<2>().0;
//! // The common border has two spans of eight segments: 17 samples.
//! assert_eq!(of(0).iter().filter(|point| of(1).contains(point)).count(), 17);
//! # Ok::<(), faircurve::Error>(())
//! ```

mod arcs;
mod crossings;
mod map;
mod mend;
mod nesting;
mod strokes;
mod vertices;

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;

use crate::batch::CurveBatch;
use crate::curve::Sampling;
use crate::error::{Error, Result};
use crate::report::Fit;
use arcs::{Arcs, Stop, Use};
use crossings::{Line, Place};
use map::{Map, Samples};
use mend::Levels;
use nesting::{Misplaced, Nesting};
use strokes::Strokes;
use vertices::Vertices;

/// A whole turn of longitude.
const TURN: f64 = 360.0;

/// Longitudes are so many turns from 0 at most.
const MOST_TURNS: f64 = 100.0;

/// What is shared, and how borders go through junctions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Points within this distance of each other are one (units of the curves, 0 or more). The
    /// first of them gives the position.
    ///
    /// By default 0: points that are exactly equal.
    pub snap: f64,
    /// Arcs whose directions differ by less than this (radians) go on through a junction, the
    /// straightest first. 0 lets every arc end at its junctions.
    ///
    /// By default π/4: a right angle is a corner, and so is half of it.
    pub straight: f64,
    /// Whether x is a longitude in degrees. Points whole turns apart are then one, and both sides
    /// of the antimeridian are.
    ///
    /// By default false.
    pub geographic: bool,
}

impl Options {
    /// Those that suit a batch: longitudes are taken for what they are.
    pub fn of(batch: &CurveBatch) -> Self {
        Options { geographic: batch.is_geographic(), ..Options::default() }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options { snap: 0.0, straight: FRAC_PI_4, geographic: false }
    }
}

/// A place where curves cross, or a curve crosses itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Curves that go there, of all that do: one of each border.
    pub curves: [usize; 2],
    /// A sample next to it.
    pub at: [f64; 2],
}

/// What is wrong with a fitted map.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Where curves cross, one a pair of spans.
    pub crossings: Vec<Crossing>,
    /// So many of them, or others in their place, are in the data: chords cross there.
    pub of_data: usize,
    /// Curves that have come to another side of a ring that they do not meet, such as islands that
    /// a coast moved over. One of those that hang together.
    pub misplaced: Vec<usize>,
}

/// What came of mending.
#[derive(Clone, Debug, Default)]
pub struct Mended {
    /// Crossings before.
    pub before: usize,
    /// Crossings that are left: those of the data, and of curves that could not be fitted.
    pub left: Vec<Crossing>,
    /// Spans that were tightened.
    pub tightened: usize,
    /// Rings that would have lost too much of their area.
    pub kept: usize,
    /// Curves that would have come to lie on the other side of others, such as islands inland.
    pub misplaced: usize,
}

/// What the curves of a batch share.
pub struct Topology {
    batch: CurveBatch,
    geographic: bool,
    vertices: Vertices,
    arcs: Arcs,
    strokes: Strokes,
}

impl Topology {
    /// Finds what curves share.
    ///
    /// Curves that cannot be fitted, single points and rings of fewer than three different points
    /// share nothing. They are strokes of their own.
    ///
    /// # Errors
    /// - A distance or an angle that is negative or no finite number.
    /// - Longitudes more than a hundred turns from 0.
    /// - A batch with parameters, weights or constraints, which belong to a curve's points and not
    ///   to a border's.
    pub fn new(batch: &CurveBatch, options: &Options) -> Result<Arc<Self>> {
        let Options { snap, straight, geographic } = *options;
        for (what, value) in
            [("the distance within which points are one", snap), ("the angle of borders that go on", straight)]
        {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::argument(format!("{what} is {value}; it must be 0 or a positive number")));
            }
        }
        let all = 0..batch.len();
        if all.clone().any(|i| batch.parameters(i).is_some() || batch.weights(i).is_some())
            || !batch.constraints().is_empty()
        {
            return Err(Error::argument(
                "the points have parameters, weights or constraints (such as columns t, weight, tx ty): borders that curves share \
                 know of none; leave these columns out, or the topology",
            ));
        }
        let longitudes = || batch.coords().iter().step_by(batch.dimension()).filter(|x| x.is_finite());
        if let Some(x) = longitudes().find(|x| geographic && x.abs() > MOST_TURNS * TURN) {
            return Err(Error::argument(format!(
                "x is {x:e}, which is no longitude in degrees: take it for a length, by `topology::Options::geographic`"
            )));
        }
        let alone: Vec<bool> = all.map(|i| batch.problem(i).is_some()).collect();
        let vertices = Vertices::new(batch, snap, geographic, &alone);
        let arcs = Arcs::new(batch, &vertices, alone);
        let strokes = Strokes::new(batch, &vertices, &arcs, straight);
        Ok(Arc::new(Topology { batch: batch.clone(), geographic, vertices, arcs, strokes }))
    }

    /// The curves whose topology it is.
    pub fn curves(&self) -> &CurveBatch {
        &self.batch
    }

    /// Numbers of the arcs that curve `i` goes along, those that it goes against as −1 − number.
    pub fn numbers(&self, i: usize) -> Vec<i64> {
        let number = |way: &Use| if way.reversed { -1 - i64::from(way.arc) } else { i64::from(way.arc) };
        self.arcs.uses[i].iter().map(number).collect()
    }

    /// The points of every arc, in the order of their numbers. A closed arc repeats its first.
    pub fn arc_points(&self) -> impl Iterator<Item = Vec<Vec<f64>>> + '_ {
        (0..self.arcs.stops.len()).map(|arc| {
            let stops = &self.arcs.stops[arc];
            let again = stops.first().filter(|_| self.arcs.closed[arc]);
            let point = |stop: &Stop| self.vertices.position(stop.vertex, stop.turn)[..self.batch.dimension()].to_vec();
            stops.iter().chain(again).map(point).collect()
        })
    }

    /// What is to be fitted: every stroke once.
    pub fn strokes(&self) -> &CurveBatch {
        &self.strokes.batch
    }

    /// Number of vertices where three or more arcs meet, or where arcs meet at an angle.
    pub fn junctions(&self) -> usize {
        self.strokes.pinned.len()
    }

    /// Number of arcs that curves go along more than once.
    pub fn shared_arcs(&self) -> usize {
        self.arcs.visits.iter().filter(|&&visits| visits > 1).count()
    }

    /// The curves of the batch from a fit of the [`strokes`](Self::strokes).
    ///
    /// - A curve has the spans between its points, whose parameters are 0, 1, 2 …. Repeated points
    ///   have no span.
    /// - Samples are taken between junctions: [`Sampling::Spacing`] divides every arc evenly, and
    ///   [`Sampling::Count`] is a count for every arc. A ring of one arc is sampled as ever.
    /// - The report of a curve that is one whole stroke is the stroke's. Of others energy and
    ///   iterations are the sums of all their strokes, which may go on beyond the curve; status and
    ///   message are those of the worst.
    pub fn join(self: &Arc<Self>, fit: Fit) -> Fit {
        let reports = (0..self.batch.len()).map(|i| map::report(self, &fit, i)).collect();
        let device = fit.device().clone();
        Fit::new(Map { topology: self.clone(), fit }, reports, device)
    }

    /// Where the samples of fitted [`strokes`](Self::strokes) cross, seen along x and y, and what
    /// they put on another side of others.
    ///
    /// Each pair of spans whose samples have a point in common counts, but for neighbours along a
    /// curve and curves that meet at a junction. What curves share is looked at once. Curves that
    /// share nothing because they cannot be fitted are left out. Longitudes are compared as they
    /// are: two curves on both sides of the antimeridian do not meet.
    pub fn faults(&self, fit: &Fit, sampling: Sampling) -> Faults {
        let (samples, data) = (map::sample(self, fit, sampling), self.data());
        let crossings = |samples: &[Samples]| self.named(samples, self.places(samples, |_| true));
        let nesting = Nesting::new(self, &data);
        let curve = |misplaced: Misplaced| {
            let arc = nesting.arcs(misplaced.part).next()?;
            Some(self.arcs.stops[arc][0].curve as usize)
        };
        let mut misplaced: Vec<usize> = nesting.misplaced(&samples).into_iter().filter_map(curve).collect();
        misplaced.dedup();
        Faults { crossings: crossings(&samples), of_data: crossings(&data).len(), misplaced }
    }

    /// The data points as samples of the arcs.
    fn data(&self) -> Vec<Samples> {
        let of_arc = |arc: usize| {
            let stops = self.arcs.stops[arc].iter();
            let points = stops.map(|stop| self.vertices.position(stop.vertex, stop.turn).into()).collect();
            Samples { points, t: (0..self.arcs.stops[arc].len()).map(|k| k as f64).collect() }
        };
        (0..self.arcs.stops.len()).map(of_arc).collect()
    }

    /// Tightens fitted [`strokes`](Self::strokes) where their samples cross, where a ring has less
    /// than `keep_area` of its area, and where a curve has come to another side of a ring.
    ///
    /// Spans that cross become cubics with the same directions at their ends and shorter handles,
    /// and points that the fit moved go back towards the data, step by step, until nothing crosses.
    /// In the last step a span is its chord. So nothing is left that the data have not.
    pub fn mend(&self, fit: Fit, sampling: Sampling, keep_area: f64) -> (Fit, Mended) {
        let mut levels = Levels::new(self, &fit);
        let mut samples = map::sample(self, &fit, sampling);
        let mut crossing = self.places(&samples, |_| true);
        let rings: Vec<usize> = (0..self.batch.len()).filter(|&i| self.is_ring(i)).collect();
        let mut shrunken: Vec<usize> =
            rings.iter().copied().filter(|&i| self.is_shrunken(i, &samples, keep_area)).collect();
        let nesting = Nesting::new(self, &self.data());
        let mut misplaced = nesting.misplaced(&samples);
        let mut mended = Mended {
            misplaced: misplaced.len(),
            before: self.named(&samples, crossing.clone()).len(),
            kept: shrunken.len(),
            ..Mended::default()
        };
        loop {
            // Once each, however many of their segments cross.
            let crossed = crossing.iter().flatten().flat_map(|&place| self.spans_of(&samples, place));
            let crossed: BTreeSet<(u32, usize)> = crossed.collect();
            let tightened = crossed.into_iter().filter(|&(stroke, span)| levels.tighten(stroke, span));
            let mut changed: Vec<u32> = tightened.map(|(stroke, _)| stroke).collect();
            for way in shrunken.iter().flat_map(|&i| &self.arcs.uses[i]) {
                let (place, spans) = (self.strokes.places[way.arc as usize], self.arcs.spans(way.arc as usize));
                let first = place.first as usize;
                changed.extend(levels.bring_back(place.stroke, first..first + spans).then_some(place.stroke));
            }
            for misplaced in &misplaced {
                changed.extend(self.part_from_ring(&mut levels, &samples, &nesting, misplaced));
            }
            if changed.is_empty() {
                break;
            }
            changed.sort_unstable();
            changed.dedup();
            map::sample_again(self, &levels, &changed, sampling, &mut samples);
            let is_new = |arc: u32| changed.binary_search(&self.strokes.places[arc as usize].stroke).is_ok();
            crossing.retain(|[a, b]| !is_new(a.0) && !is_new(b.0));
            crossing.extend(self.places(&samples, is_new));
            shrunken.retain(|&i| self.is_shrunken(i, &samples, keep_area));
            misplaced = nesting.misplaced(&samples);
        }
        mended.tightened = levels.tightened();
        mended.left = self.named(&samples, crossing);
        (levels.finish(), mended)
    }

    /// Brings a part back, and the spans next to it of a ring that it has come into or out of. The
    /// strokes where that changed anything.
    fn part_from_ring(
        &self,
        levels: &mut Levels,
        samples: &[Samples],
        nesting: &Nesting,
        misplaced: &Misplaced,
    ) -> Vec<u32> {
        let boxed = |points: &mut dyn Iterator<Item = DVec2>| {
            points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
        };
        let data = |arc: usize, k: usize| {
            let stops = &self.arcs.stops[arc];
            let stop = stops[k % stops.len()];
            DVec3::from_array(self.vertices.position(stop.vertex, stop.turn)).truncate()
        };
        let (mut changed, mut part) = (Vec::new(), (DVec2::INFINITY, DVec2::NEG_INFINITY));
        for arc in nesting.arcs(misplaced.part) {
            let (place, spans) = (self.strokes.places[arc], self.arcs.spans(arc));
            let given = (0..=spans).map(|k| data(arc, k));
            let (low, high) = boxed(&mut given.chain(samples[arc].points.iter().map(|point| point.truncate())));
            part = (part.0.min(low), part.1.max(high));
            let range = place.first as usize..place.first as usize + spans;
            changed.extend(levels.bring_back(place.stroke, range).then_some(place.stroke));
        }
        for way in &self.arcs.uses[misplaced.ring as usize] {
            let arc = way.arc as usize;
            let (place, spans) = (self.strokes.places[arc], self.arcs.spans(arc));
            let mut sample = 0;
            for span in 0..spans {
                let from = sample;
                while sample < samples[arc].t.len() && samples[arc].t[sample] < (span + 1) as f64 {
                    sample += 1;
                }
                let fitted = samples[arc].points[from..sample].iter().map(|point| point.truncate());
                let (low, high) = boxed(&mut fitted.chain([data(arc, span), data(arc, span + 1)]));
                if low.cmple(part.1).all() && part.0.cmple(high).all() {
                    let along = place.first as usize + if place.reversed { spans - 1 - span } else { span };
                    changed.extend(levels.bring_back(place.stroke, along..along + 1).then_some(place.stroke));
                }
            }
        }
        changed
    }

    /// The spans of strokes that hold a segment of an arc's samples.
    fn spans_of(&self, samples: &[Samples], (arc, segment): Place) -> impl Iterator<Item = (u32, usize)> + use<> {
        let (place, spans) = (self.strokes.places[arc as usize], self.arcs.spans(arc as usize));
        let t = &samples[arc as usize].t;
        let (from, to) = (t[segment as usize], t.get(segment as usize + 1).copied().unwrap_or(spans as f64));
        let along = move |span: usize| if place.reversed { spans - 1 - span } else { span };
        (from.floor() as usize..(to.ceil() as usize).min(spans))
            .map(move |span| (place.stroke, place.first as usize + along(span)))
    }

    /// Whether curve `i` is closed and not alone.
    fn is_ring(&self, i: usize) -> bool {
        self.batch.is_closed(i) && !self.arcs.alone[self.arcs.uses[i][0].arc as usize]
    }

    /// Whether a ring's samples have less than a part of the area of its points, or turn the other
    /// way round.
    fn is_shrunken(&self, i: usize, samples: &[Samples], keep_area: f64) -> bool {
        let points = self.batch.points(i).chunks_exact(self.batch.dimension());
        let data = area(points.map(|point| DVec2::from_slice(&point[..2])));
        let now = area(map::along(self, samples, i).map(|point| point.truncate()));
        now * data.signum() < keep_area * data.abs()
    }

    /// Pairs of segments of arcs that cross, one of them of an arc that is `new`.
    fn places(&self, samples: &[Samples], new: impl Fn(u32) -> bool) -> Vec<[Place; 2]> {
        let line = |arc: usize| match self.arcs.alone[arc] {
            true => Line { points: &[], closed: false },
            false => Line { points: &samples[arc].points, closed: self.arcs.closed[arc] },
        };
        let lines: Vec<Line> = (0..samples.len()).map(line).collect();
        crossings::crossings(&lines, new)
    }

    /// One crossing a pair of spans.
    fn named(&self, samples: &[Samples], mut places: Vec<[Place; 2]>) -> Vec<Crossing> {
        let span = |(arc, segment): Place| (arc, samples[arc as usize].t[segment as usize] as usize);
        let mut seen = FxHashSet::default();
        places.retain(|pair| seen.insert(pair.map(span)));
        places.into_iter().map(|places| self.crossing(samples, places)).collect()
    }

    fn crossing(&self, samples: &[Samples], places: [Place; 2]) -> Crossing {
        let at = samples[places[0].0 as usize].points[places[0].1 as usize];
        let curves = places.map(|(arc, _)| self.arcs.stops[arc as usize][0].curve as usize);
        Crossing { curves, at: [at.x, at.y] }
    }
}

/// The area that a polygon encloses, positive if it goes round to the left.
fn area(points: impl Iterator<Item = DVec2>) -> f64 {
    let mut points = points.peekable();
    let Some(&first) = points.peek() else { return 0.0 };
    let (mut twice, mut last) = (0.0, DVec2::ZERO);
    for point in points {
        twice += last.perp_dot(point - first);
        last = point - first;
    }
    0.5 * twice
}
