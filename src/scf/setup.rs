//! From the dots of a curve to the [`Problem`] of its slopes: chords, reference directions, weights.

use std::f64::consts::{PI, TAU};

use super::slopes::{Ends, Problem, Span};
use crate::linalg::{Real, Scalar};

/// Where the search for the slopes starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// The tangent of the circle through a dot and its neighbours.
    #[default]
    Circle,
    /// The direction from the dot before to the dot after, as in the paper.
    Neighbours,
    /// Half-way between the directions of the two chords.
    Bisector,
}

/// The chords of a curve.
#[derive(Clone, Debug)]
pub(crate) struct Chords {
    pub lengths: Vec<f64>,
    pub directions: Vec<f64>,
}

impl Chords {
    /// Chords between consecutive points; of a closed curve one more, back to the first.
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
            // Tangent and chord of a circle enclose half the arc: sin δ/d = sin(τ − δ)/e.
            Start::Circle => (d * sine).atan2(e + d * cosine),
            Start::Neighbours => (e * sine).atan2(d + e * cosine),
            Start::Bisector => 0.5 * turn,
        };
        self.directions[before] + part
    }
}

/// An angle, from −π to π.
pub(crate) fn wrap(angle: f64) -> f64 {
    let turns = angle - TAU * (angle / TAU).round();
    if turns > PI { turns - TAU } else { turns }
}

/// What a curve gives beside its dots.
pub(crate) struct Given<'a> {
    pub closed: bool,
    /// Fixed directions; NaN where there is none.
    pub fixed: Option<&'a [f64]>,
    /// ν and number of the universal curve of every span.
    pub curve: &'a dyn Fn(usize) -> (f64, u16),
}

/// The problem of a curve, the logarithm of the factor its costs are divided by, and the reference directions (NaN where free).
pub(crate) fn problem<T: Real + Scalar<Number = T>>(
    chords: &Chords,
    given: &Given,
    start: Start,
) -> (Problem<T>, f64, Vec<f64>) {
    let spans = chords.lengths.len();
    let dots = if given.closed { spans } else { spans + 1 };
    let fixed = |dot: usize| given.fixed.map_or(f64::NAN, |fixed| fixed[dot]);
    let direction = |dot: usize| {
        let free = !given.closed && (dot == 0 || dot == spans);
        match fixed(dot) {
            given if given.is_finite() => given,
            _ if free => f64::NAN,
            _ => chords.start(start, (dot + spans - 1) % spans, dot % spans),
        }
    };
    let directions: Vec<f64> = (0..dots).map(direction).collect();
    let power = |span: usize| (1.0 - (given.curve)(span).0) * chords.lengths[span].ln();
    let scale = (0..spans).map(power).fold(f64::NEG_INFINITY, f64::max);
    let span = |k: usize| {
        let [a, b] = [directions[k], directions[(k + 1) % dots]];
        let ends = match (a.is_nan(), b.is_nan()) {
            (false, false) => Ends::Directed,
            (true, false) => Ends::FreeStart,
            (false, true) => Ends::FreeEnd,
            (true, true) => Ends::Straight,
        };
        let angle = |direction: f64| {
            if direction.is_nan() { T::of(0.0) } else { T::of(wrap(direction - chords.directions[k])) }
        };
        Span { angles: [angle(a), angle(b)], weight: T::of((power(k) - scale).exp()), curve: (given.curve)(k).1, ends }
    };
    let movable = |dot: usize| T::of(if directions[dot].is_nan() || fixed(dot).is_finite() { 0.0 } else { 1.0 });
    let problem = Problem {
        closed: given.closed,
        exponent: (0..spans).map(|span| (given.curve)(span).0).fold(0.0, f64::max),
        spans: (0..spans).map(span).collect(),
        movable: (0..dots).map(movable).collect(),
    };
    (problem, scale, directions)
}
