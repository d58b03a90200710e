//! [`Faults`]: crossings of fitted curves, and curves on the wrong side of others.

use rustc_hash::FxHashSet;

use super::Topology;
use super::crossings::{self, Line, Place};
use super::nesting::Nesting;
use super::sampled::Sampled;
use super::samples::Samples;

/// A place where curves cross, or a curve crosses itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// A curve of each border that crosses there.
    pub curves: [usize; 2],
    /// The sample next to the crossing.
    pub at: [f64; 2],
}

/// Faults of a fitted map.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Crossings of curves, one per pair of spans.
    pub crossings: Vec<Crossing>,
    /// Number of crossings in the data: of chords.
    pub of_data: usize,
    /// Curves on the wrong side of a ring, such as islands that a coast moved over: one of each
    /// connected group.
    pub misplaced: Vec<usize>,
}

impl Sampled {
    /// Finds crossings of the samples in x and y, and curves on the wrong side of others.
    ///
    /// Each pair of spans whose samples have a point in common counts once, except neighbours along
    /// a curve and curves that meet at a junction. Curves that cannot be fitted and the frame of a
    /// map are left out. Curves on different sides of the antimeridian do not meet.
    pub fn faults(&self) -> Faults {
        let (topology, samples) = (&self.topology, &self.samples);
        let data = topology.data();
        let crossings = |samples: &[Samples]| topology.named(samples, topology.places(samples, |_| true));
        let misplaced = || {
            let nesting = Nesting::new(topology, &data);
            nesting.curves(&nesting.misplaced(samples))
        };
        let (fitted, (of_data, misplaced)) =
            rayon::join(|| crossings(samples), || (crossings(&data).len(), misplaced()));
        Faults { crossings: fitted, of_data, misplaced }
    }
}

impl Topology {
    /// The data points as samples of the arcs.
    pub(super) fn data(&self) -> Vec<Samples> {
        let of_arc = |arc: usize| {
            let stops = self.arcs.stops[arc].iter();
            let points = stops.map(|stop| self.vertices.position(stop.vertex, stop.turn).into()).collect();
            Samples { points, t: (0..self.arcs.stops[arc].len()).map(|k| k as f64).collect() }
        };
        (0..self.arcs.stops.len()).map(of_arc).collect()
    }

    /// Pairs of crossing segments, one of them of an arc that is `new`.
    pub(super) fn places(&self, samples: &[Samples], new: impl Fn(u32) -> bool) -> Vec<[Place; 2]> {
        let line = |arc: usize| match self.arcs.alone[arc] || self.arcs.frame[arc] {
            true => Line { points: &[], closed: false },
            false => Line { points: &samples[arc].points, closed: self.arcs.closed[arc] },
        };
        let lines: Vec<Line> = (0..samples.len()).map(line).collect();
        crossings::crossings(&lines, new)
    }

    /// One crossing per pair of spans.
    pub(super) fn named(&self, samples: &[Samples], mut places: Vec<[Place; 2]>) -> Vec<Crossing> {
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
