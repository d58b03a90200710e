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
//! - Of longitudes and latitudes, edges along ±180° and along the poles are the frame of the map. They stay straight, and what
//!   meets them is fitted as an open curve that ends there.
//! - A stroke of several arcs for which a method has no curve is [divided](Topology::divide), and its arcs are
//!   fitted one by one: a bad place spoils the border that it lies on, and no whole coast.
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
pub(crate) mod crossings;
mod divided;
mod edges;
mod faults;
mod frame;
mod levels;
mod map;
mod mend;
mod nesting;
mod sampled;
mod samples;
mod strokes;
mod tight;
mod vertices;

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use crate::batch::CurveBatch;
use crate::error::{Error, Result};
use crate::report::Fit;
use arcs::{Arcs, Stop, Use};
use map::Map;
use strokes::Strokes;
use vertices::Vertices;

pub use divided::Divided;
pub use faults::{Crossing, Faults};
pub use mend::Mended;
pub use sampled::Sampled;

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

/// What the curves of a batch share.
#[derive(Clone)]
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
    /// Curves that cannot be fitted and single points share nothing. They are strokes of their own. An edge has the
    /// vertices of others that lie on it, within [`snap`](Options::snap) or rounding: neighbours share a border on which one
    /// has a vertex more.
    ///
    /// # Errors
    /// - A distance or an angle that is negative or no finite number.
    /// - Longitudes more than a hundred turns from 0.
    /// - A batch with parameters, weights or constraints, which belong to a curve's points and not
    ///   to a border's.
    pub fn new(batch: &CurveBatch, options: &Options) -> Result<Arc<Self>> {
        Self::of(batch, options, false)
    }

    /// The frame of a map of longitudes and latitudes, without anything that curves share: `None` where no curve has a
    /// part of it, and where points have parameters, weights or constraints.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn frame(batch: &CurveBatch) -> Result<Option<Arc<Self>>> {
        let framed = batch.is_geographic() && (0..batch.len()).any(|i| frame::is_in(batch, i));
        if !framed || has_values(batch) { Ok(None) } else { Self::of(batch, &Options::of(batch), true).map(Some) }
    }

    /// What curves share, or with `apart` nothing but the frame.
    fn of(batch: &CurveBatch, options: &Options, apart: bool) -> Result<Arc<Self>> {
        let Options { snap, straight, geographic } = *options;
        for (what, value) in
            [("the distance within which points are one", snap), ("the angle of borders that go on", straight)]
        {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::argument(format!("{what} is {value}; it must be 0 or a positive number")));
            }
        }
        if has_values(batch) {
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
        let is_alone = |i: usize| batch.problem(i).is_some() || apart && !frame::is_in(batch, i);
        let alone: Vec<bool> = (0..batch.len()).map(is_alone).collect();
        let vertices = Vertices::new(batch, snap, geographic, apart, &alone);
        let arcs = Arcs::new(batch, &vertices, geographic, alone, (!apart).then_some(snap));
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
    ///
    /// Parts of a map's frame are among them. They have a [problem](CurveBatch::problem), so that no method fits them.
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
    /// - Samples are taken as by [`sample`](Self::sample).
    /// - The report of a curve that is one whole stroke is the stroke's. Of others energy and
    ///   iterations are the sums of all their strokes, which may go on beyond the curve; status and
    ///   message are those of the worst.
    pub fn join(self: &Arc<Self>, fit: Fit) -> Fit {
        let reports = (0..self.batch.len()).map(|i| map::report(self, &fit, i)).collect();
        let device = fit.device().clone();
        Fit::new(Map { topology: self.clone(), fit, sampled: None }, reports, device)
    }

    /// Whether curve `i` is closed and not alone.
    fn is_ring(&self, i: usize) -> bool {
        self.batch.is_closed(i) && !self.arcs.alone[self.arcs.uses[i][0].arc as usize]
    }
}

/// Whether points have parameters, weights or constraints.
fn has_values(batch: &CurveBatch) -> bool {
    (0..batch.len()).any(|i| batch.parameters(i).is_some() || batch.weights(i).is_some())
        || !batch.constraints().is_empty()
}
