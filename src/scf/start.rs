//! [`Start`]: the directions from which the search for the tangent angles starts.

use std::f64::consts::{PI, TAU};

/// The directions from which the search for the tangent angles starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Start {
    /// The tangent of the circle through a dot and its neighbours.
    #[default]
    Circle,
    /// The direction from the previous dot to the next, as in the paper.
    Neighbours,
    /// Halfway between the directions of the two chords.
    Bisector,
}

/// The chords of a curve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chords {
    pub lengths: Vec<f64>,
    pub directions: Vec<f64>,
}

impl Chords {
    /// The chords between consecutive points. A closed curve has one more, back to the first.
    pub fn of(points: &[[f64; 2]], closed: bool) -> Self {
        let n = points.len();
        let chords = (0..if closed { n } else { n - 1 }).map(|k| {
            let ([x, y], [u, v]) = (points[k], points[(k + 1) % n]);
            [u - x, v - y]
        });
        let (lengths, directions) = chords.map(|[x, y]| (x.hypot(y), y.atan2(x))).unzip();
        Chords { lengths, directions }
    }

    /// The direction in which a search starts at a dot, from the chords before and after it.
    pub fn start(&self, start: Start, before: usize, after: usize) -> f64 {
        let turn = wrap(self.directions[after] - self.directions[before]);
        let (d, e) = (self.lengths[before], self.lengths[after]);
        let (sine, cosine) = turn.sin_cos();
        let part = match start {
            // A circle's tangent and chord enclose half of the arc's angle: sin δ/d = sin(τ − δ)/e.
            Start::Circle => (d * sine).atan2(e + d * cosine),
            Start::Neighbours => (e * sine).atan2(d + e * cosine),
            Start::Bisector => 0.5 * turn,
        };
        self.directions[before] + part
    }
}

/// The equivalent angle from −π to π.
pub(crate) fn wrap(angle: f64) -> f64 {
    let turns = angle - TAU * (angle / TAU).round();
    if turns > PI { turns - TAU } else { turns }
}
