//! [`Faults`]: where fitted curves cross, and what they put on another side of others.

use rustc_hash::FxHashSet;

use super::Topology;
use super::crossings::{self, Line, Place};
use super::nesting::Nesting;
use super::sampled::Sampled;
use super::samples::Samples;

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

impl Sampled {
    /// Where the samples cross, seen along x and y, and what they put on another side of others.
    ///
    /// Each pair of spans whose samples have a point in common counts, but for neighbours along a
    /// curve and curves that meet at a junction. What curves share is looked at once. Curves that
    /// share nothing because they cannot be fitted are left out, and so is the frame of a map. Longitudes are compared as they
    /// are: two curves on both sides of the antimeridian do not meet.
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

    /// Pairs of segments of arcs that cross, one of them of an arc that is `new`.
    pub(super) fn places(&self, samples: &[Samples], new: impl Fn(u32) -> bool) -> Vec<[Place; 2]> {
        let line = |arc: usize| match self.arcs.alone[arc] || self.arcs.frame[arc] {
            true => Line { points: &[], closed: false },
            false => Line { points: &samples[arc].points, closed: self.arcs.closed[arc] },
        };
        let lines: Vec<Line> = (0..samples.len()).map(line).collect();
        crossings::crossings(&lines, new)
    }

    /// One crossing a pair of spans.
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
