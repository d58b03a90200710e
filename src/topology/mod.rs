//! Curves that share points, such as the borders of a map.
//!
//! Two polygons with a common border hold its points twice. A [`Topology`] finds what curves share
//! and has it fitted once, so that neighbours share every sample, bit for bit:
//!
//! ```text
//! curves ─► vertices: equal points ─► arcs: chains between junctions ─► strokes: arcs that go straight on ─► fit ─► the curves again
//! ```
//!
//! [`Sampled::mend`] repairs fitted curves that cross. `docs/jobs/maps.md` describes both.
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
mod stop;
mod strokes;
mod tight;
mod vertices;

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use crate::batch::CurveBatch;
use crate::error::{Error, Result};
use crate::report::Fit;
use arcs::{Arcs, Use};
use map::Map;
use stop::Stop;
use strokes::Strokes;
use vertices::Vertices;

pub use divided::Divided;
pub use faults::{Crossing, Faults};
pub use mend::Mended;
pub use sampled::Sampled;

/// A whole turn of longitude.
const TURN: f64 = 360.0;

/// The most turns of a longitude from 0.
const MOST_TURNS: f64 = 100.0;

/// What is shared, and how borders go through junctions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Points within this distance of each other are one, at the position of the first (units of
    /// the curves, 0 or more). By default 0: only equal points are one.
    pub snap: f64,
    /// Arcs whose directions differ by less than this (radians) go on through a junction, the
    /// straightest first. With 0 every arc ends at its junctions. By default π/4.
    pub straight: f64,
    /// Whether x is a longitude in degrees. Points whole turns apart are then one. By default
    /// false.
    pub geographic: bool,
    /// The arcs that are fitted. The others stay as they are, bit for bit, as do arcs of curves that
    /// were not [selected](crate::io::ReadOptions::selected). By default all.
    pub fitted: Fitted,
}

/// Arcs of a map that are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fitted {
    /// All.
    #[default]
    All,
    /// Those that one curve goes along: coasts, and lines.
    Outer,
    /// Those that several curves share.
    Shared,
}

impl Options {
    /// The options for a batch: geographic if its x are longitudes.
    pub fn of(batch: &CurveBatch) -> Self {
        Options { geographic: batch.is_geographic(), ..Options::default() }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options { snap: 0.0, straight: FRAC_PI_4, geographic: false, fitted: Fitted::All }
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
    /// Curves that cannot be fitted and single points share nothing and are separate strokes. An
    /// edge takes over the vertices of other curves that lie on it, within [`snap`](Options::snap)
    /// or rounding.
    ///
    /// # Errors
    /// - A distance or an angle that is negative or not finite.
    /// - Longitudes more than a hundred turns from 0.
    /// - A batch with parameters, weights or constraints, which shared borders cannot have.
    pub fn new(batch: &CurveBatch, options: &Options) -> Result<Arc<Self>> {
        Self::of(batch, options, false)
    }

    #[doc(hidden)]
    /// The topology that separates a map's frame (edges along the antimeridian and the poles) and
    /// shares nothing.
    ///
    /// `None` if no curve touches the frame, or if points have parameters, weights or constraints.
    ///
    /// # Errors
    /// The errors of [`new`](Self::new).
    pub fn frame(batch: &CurveBatch) -> Result<Option<Arc<Self>>> {
        let framed = batch.is_geographic() && (0..batch.len()).any(|i| frame::is_in(batch, i));
        if !framed || has_values(batch) { Ok(None) } else { Self::of(batch, &Options::of(batch), true).map(Some) }
    }

    #[doc(hidden)]
    /// The topology of curves that share nothing, for those that were not selected.
    ///
    /// # Errors
    /// The errors of [`new`](Self::new).
    pub fn apart(batch: &CurveBatch) -> Result<Arc<Self>> {
        Self::of(batch, &Options::of(batch), true)
    }

    /// What curves share, or only the frame if `apart`.
    fn of(batch: &CurveBatch, options: &Options, apart: bool) -> Result<Arc<Self>> {
        let Options { snap, straight, geographic, fitted } = *options;
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
        let is_alone = |i: usize| {
            batch.problem(i).is_some() || apart && !frame::is_in(batch, i) && batch.origin().unselected.is_empty()
        };
        let alone: Vec<bool> = (0..batch.len()).map(is_alone).collect();
        let vertices = Vertices::new(batch, snap, geographic, apart, &alone);
        let mut arcs = Arcs::new(batch, &vertices, geographic, alone, (!apart).then_some(snap));
        arcs.keep(fitted, &batch.origin().unselected);
        let strokes = Strokes::new(batch, &vertices, &arcs, straight);
        Ok(Arc::new(Topology { batch: batch.clone(), geographic, vertices, arcs, strokes }))
    }

    /// The curves whose topology it is.
    pub fn curves(&self) -> &CurveBatch {
        &self.batch
    }

    #[doc(hidden)]
    /// The indices of the arcs along curve `i`, as −1 − index if reversed.
    pub fn numbers(&self, i: usize) -> Vec<i64> {
        let number = |way: &Use| if way.reversed { -1 - i64::from(way.arc) } else { i64::from(way.arc) };
        self.arcs.uses[i].iter().map(number).collect()
    }

    #[doc(hidden)]
    /// The points of every arc, by index. A closed arc repeats its first point.
    pub fn arc_points(&self) -> impl Iterator<Item = Vec<Vec<f64>>> + '_ {
        (0..self.arcs.stops.len()).map(|arc| {
            let stops = &self.arcs.stops[arc];
            let again = stops.first().filter(|_| self.arcs.closed[arc]);
            let point = |stop: &Stop| self.vertices.position(stop.vertex, stop.turn)[..self.batch.dimension()].to_vec();
            stops.iter().chain(again).map(point).collect()
        })
    }

    /// The strokes to fit.
    ///
    /// Parts of a map's frame are strokes with a [problem](CurveBatch::problem), so no method fits
    /// them.
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
    /// - A curve has the parameters 0, 1, 2 … at its points. Repeated points have no span.
    /// - Samples are taken as by [`sample`](Self::sample).
    /// - A curve that is one whole stroke has the stroke's report. Other reports have the sums of
    ///   the energies and iterations of their strokes, which may go on beyond the curve, and the
    ///   status and message of the worst stroke.
    pub fn join(self: &Arc<Self>, fit: Fit) -> Fit {
        let reports = (0..self.batch.len()).map(|i| map::report(self, &fit, i)).collect();
        let device = fit.device().clone();
        Fit::new(Map { topology: self.clone(), fit, sampled: None }, reports, device)
    }

    /// Whether curve `i` is closed and takes part in the topology.
    fn is_ring(&self, i: usize) -> bool {
        self.batch.is_closed(i) && !self.arcs.alone[self.arcs.uses[i][0].arc as usize]
    }
}

/// Whether points have parameters, weights or constraints.
fn has_values(batch: &CurveBatch) -> bool {
    (0..batch.len()).any(|i| batch.parameters(i).is_some() || batch.weights(i).is_some())
        || !batch.constraints().is_empty()
}
