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
mod strokes;
mod vertices;

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use glam::DVec2;
use rustc_hash::FxHashSet;

use crate::batch::CurveBatch;
use crate::curve::Sampling;
use crate::error::{Error, Result};
use crate::report::Fit;
use arcs::Arcs;
use crossings::{Line, Place};
use map::{Map, Samples};
use mend::Levels;
use strokes::Strokes;
use vertices::Vertices;

/// A whole turn of longitude.
const TURN: f64 = 360.0;

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
    /// - Samples are taken between junctions: [`Sampling::Spacing`](crate::Sampling::Spacing) divides every arc evenly, and
    ///   [`Sampling::Count`](crate::Sampling::Count) is a count for every arc. A ring of one arc is sampled as ever.
    /// - The report of a curve that is one whole stroke is the stroke's. Of others energy and
    ///   iterations are the sums of all their strokes, which may go on beyond the curve; status and
    ///   message are those of the worst.
    pub fn join(self: &Arc<Self>, fit: Fit) -> Fit {
        let reports = (0..self.batch.len()).map(|i| map::report(self, &fit, i)).collect();
        let device = fit.device().clone();
        Fit::new(Map { topology: self.clone(), fit }, reports, device)
    }

    /// Where the samples of fitted [`strokes`](Self::strokes) cross, seen along x and y.
    ///
    /// Each pair of spans whose samples have a point in common counts, but for neighbours along a
    /// curve and curves that meet at a junction. What curves share is looked at once. Curves that share
    /// nothing because they cannot be fitted are left out. Longitudes are compared as they are: two
    /// curves on both sides of the antimeridian do not meet.
    pub fn crossings(&self, fit: &Fit, sampling: Sampling) -> Vec<Crossing> {
        let samples = map::sample(self, fit, sampling);
        let places = self.places(&samples, |_| true);
        self.named(&samples, places)
    }

    /// Where the chords between the data points cross, counted likewise.
    pub fn crossings_of_data(&self) -> usize {
        let of_arc = |arc: usize| {
            let stops = self.arcs.stops[arc].iter();
            let points = stops.map(|stop| self.vertices.position(stop.vertex, stop.turn).into()).collect();
            Samples { points, t: (0..self.arcs.stops[arc].len()).map(|k| k as f64).collect() }
        };
        let samples: Vec<Samples> = (0..self.arcs.stops.len()).map(of_arc).collect();
        let places = self.places(&samples, |_| true);
        self.named(&samples, places).len()
    }

    /// Tightens fitted [`strokes`](Self::strokes) where their samples cross, and where a ring has
    /// less than `keep_area` of its area.
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
        let mut mended =
            Mended { before: self.named(&samples, crossing.clone()).len(), kept: shrunken.len(), ..Mended::default() };
        loop {
            let mut changed: Vec<u32> = Vec::new();
            for &(arc, segment) in crossing.iter().flatten() {
                changed.extend(self.tighten(&mut levels, &samples[arc as usize], arc as usize, segment as usize));
            }
            for way in shrunken.iter().flat_map(|&i| &self.arcs.uses[i]) {
                let (place, spans) = (self.strokes.places[way.arc as usize], self.arcs.spans(way.arc as usize));
                let first = place.first as usize;
                changed.extend(levels.bring_back(place.stroke, first..first + spans).then_some(place.stroke));
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
        }
        mended.tightened = levels.tightened();
        mended.left = self.named(&samples, crossing);
        (levels.finish(), mended)
    }

    /// Tightens the spans of a segment of an arc's samples; the stroke, if that changed anything.
    fn tighten(&self, levels: &mut Levels, samples: &Samples, arc: usize, segment: usize) -> Option<u32> {
        let (place, spans) = (self.strokes.places[arc], self.arcs.spans(arc));
        let from = samples.t[segment];
        let to = samples.t.get(segment + 1).copied().unwrap_or(spans as f64);
        let mut changed = false;
        for span in from.floor() as usize..(to.ceil() as usize).min(spans) {
            let along = if place.reversed { spans - 1 - span } else { span };
            changed |= levels.tighten(place.stroke, place.first as usize + along);
        }
        changed.then_some(place.stroke)
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
