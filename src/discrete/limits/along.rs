//! Limits on quantities along a curve: β at every vertex, from the spans between data points.

use super::Limits;
use crate::linalg::scalar::{Vector, dot, subtract};
use crate::sides::{self, STRAIGHT, agreed};

/// A span with at least one edge, from vertex `rows[0]` to vertex `rows[1]`.
pub(in crate::discrete) struct Span {
    /// The index of the data point at its start, and of the one at its end.
    pub point: usize,
    pub next: usize,
    pub rows: [usize; 2],
}

/// The spans of a curve that have edges.
///
/// `rows` are the vertex indices of the data points. On a closed curve the number of vertices
/// follows, for the first point again.
pub(in crate::discrete) fn spans(rows: &[u32], points: usize) -> Vec<Span> {
    let closed = rows.len() > points;
    let span = |k: usize| Span { point: k, next: (k + 1) % points, rows: [rows[k] as usize, rows[k + 1] as usize] };
    let mut spans: Vec<Span> = (0..rows.len() - 1).map(span).filter(|span| span.rows[0] < span.rows[1]).collect();
    // Coincident points share a vertex. The one at which a span starts represents them.
    for k in 1..spans.len() {
        spans[k - 1].next = spans[k].point;
    }
    if let (true, Some(first)) = (closed, spans.first().map(|span| span.point))
        && let Some(last) = spans.last_mut()
    {
        last.next = first;
    }
    spans
}

impl Limits {
    /// The spans of a planar curve that must be straight: between collinear points if the shape is
    /// preserved, and between two points that are level in a direction of
    /// [`monotone`](Self::monotone).
    pub(in crate::discrete) fn straight<const D: usize>(&self, points: &[Vector<f64, D>], rows: &[u32]) -> Vec<Span> {
        let shape = self.shape;
        if D != 2 || !shape && self.monotone.is_empty() {
            return vec![];
        }
        let spans = spans(rows, points.len());
        let planar = |k: usize| [points[k][0], points[k][1]];
        let mut distinct: Vec<[f64; 2]> = spans.iter().map(|span| planar(span.point)).collect();
        let closed = rows.len() > points.len();
        distinct.extend(spans.last().filter(|_| !closed).map(|span| planar(span.next)));
        let asked = sides::of_spans(&distinct, closed);
        let is_straight = |(k, span): (usize, Span)| {
            let chord = subtract(points[span.next], points[span.point]);
            let is_level = self.monotone.iter().any(|direction| sign_along(chord, *direction) == 0.0);
            (shape && asked[k].straight || is_level).then_some(span)
        };
        spans.into_iter().enumerate().filter_map(is_straight).collect()
    }
}

impl Limits {
    /// The first pinned point at which the data polygon turns back along as many directions of
    /// [`monotone`](Self::monotone) as there are coordinates. In the plane a level span counts as
    /// turning back, because it is straight.
    pub(super) fn turning_back<const D: usize>(
        &self,
        points: &[Vector<f64, D>],
        rows: &[u32],
        pinned: &[(usize, Vector<f64, D>)],
    ) -> Option<usize> {
        if self.monotone.is_empty() {
            return None;
        }
        let spans = spans(rows, points.len());
        let polygon = Polygon { spans: &spans, points, closed: rows.len() > points.len(), vertices: 0, size: 1.0 };
        for (k, span) in spans.iter().enumerate() {
            let Some(before) = polygon.before(k) else { continue };
            let chords = [polygon.chord(&spans[before]), polygon.chord(span)];
            let turns = |direction: &&[f64; 3]| {
                let product: f64 = chords.iter().map(|chord| sign_along(*chord, **direction)).product();
                product < 0.0 || D == 2 && product == 0.0
            };
            let is_pinned = pinned.iter().any(|(point, _)| *point == span.point);
            if is_pinned && self.monotone.iter().filter(turns).count() == D {
                return Some(span.point);
            }
        }
        None
    }
}

/// The data polygon of a curve, as spans.
pub(in crate::discrete) struct Polygon<'a, const D: usize> {
    pub spans: &'a [Span],
    pub points: &'a [Vector<f64, D>],
    pub closed: bool,
    /// The number of vertices.
    pub vertices: usize,
    /// The size of the curve, in units of the input.
    pub size: f64,
}

impl<const D: usize> Polygon<'_, D> {
    pub fn chord(&self, span: &Span) -> Vector<f64, D> {
        subtract(self.points[span.next], self.points[span.point])
    }

    /// The mean chord, at size 1.
    pub fn mean_chord(&self) -> f64 {
        let lengths = self.spans.iter().map(|span| length(self.chord(span)));
        lengths.sum::<f64>() / self.spans.len().max(1) as f64 / self.size
    }

    /// The span before span k, if any.
    pub fn before(&self, k: usize) -> Option<usize> {
        match k {
            0 if self.closed => Some(self.spans.len() - 1),
            k => k.checked_sub(1),
        }
    }

    /// The span after span k, if any.
    pub fn after(&self, k: usize) -> Option<usize> {
        match k + 1 {
            k if k < self.spans.len() => Some(k),
            _ => self.closed.then_some(0),
        }
    }

    /// 1/κ at every vertex between two edges, from the largest curvatures κ of the spans. At a data
    /// point the smaller κ of both spans applies.
    pub(super) fn by_bounds(&self, bounds: &[f64]) -> Vec<f64> {
        let slope = |k: usize| 1.0 / (bounds[k] * self.size);
        let mut slopes = vec![0.0; self.vertices];
        for (k, span) in self.spans.iter().enumerate() {
            slopes[span.rows[0] + 1..span.rows[1]].fill(slope(k));
            if let Some(before) = self.before(k) {
                slopes[span.rows[0]] = slope(before).max(slope(k));
            }
        }
        slopes
    }

    /// −σℓ at every vertex, where σ is the required turning direction, 1 to the left and −1 to the
    /// right, and ℓ the mean chord.
    pub(super) fn sides(&self) -> Vec<f64> {
        let turn = |before: usize, after: usize| {
            let [a, b] = [before, after].map(|k| self.chord(&self.spans[k]));
            let sine = (a[0] * b[1] - a[1] * b[0]) / (length(a) * length(b));
            if sine.abs() < STRAIGHT { 0.0 } else { sine.signum() }
        };
        let start = |k: usize| self.before(k).map(|before| turn(before, k));
        let end = |k: usize| self.after(k).map(|after| turn(k, after));
        let scale = self.mean_chord();
        let mut slopes = vec![0.0; self.vertices];
        for (k, span) in self.spans.iter().enumerate() {
            let within = agreed([start(k), end(k)]);
            slopes[span.rows[0] + 1..span.rows[1]].fill(-scale * within);
            slopes[span.rows[0]] = -scale * start(k).unwrap_or(0.0);
        }
        slopes
    }

    /// β at the end of every edge, from the chord of its span.
    pub(super) fn of_edges(&self, slope: impl Fn(Vector<f64, D>) -> f64) -> Vec<f64> {
        let mut slopes = vec![0.0; self.vertices];
        for span in self.spans {
            let own = slope(self.chord(span));
            for row in span.rows[0] + 1..=span.rows[1] {
                slopes[row % self.vertices] = own;
            }
        }
        slopes
    }

    /// β at the start of every edge between two others.
    pub(super) fn between_edges(&self, slope: f64) -> Vec<f64> {
        let mut slopes = vec![slope; self.vertices];
        if !self.closed {
            slopes[0] = 0.0;
            slopes[self.vertices.saturating_sub(2)..].fill(0.0);
        }
        slopes
    }

    /// −σ(ℓ/h)³ at the start of the middle one of three edges, where σ is the required sign of the
    /// torsion, 1 for a right-handed screw, ℓ the mean chord, and h the chord of the span over its
    /// number of edges.
    pub(super) fn twists(&self) -> Vec<f64> {
        // From the chord of a span and its two neighbours. A span at the end of a curve has no
        // sign.
        let own = |k: usize| {
            let [before, after] = [self.before(k)?, self.after(k)?];
            let [a, b, c] = [before, k, after].map(|k| self.chord(&self.spans[k]));
            let volume = a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]);
            let sine = volume / (length(a) * length(b) * length(c));
            Some(if sine.abs() < STRAIGHT { 0.0 } else { sine.signum() })
        };
        let sides: Vec<f64> = (0..self.spans.len())
            .map(|k| own(k).or_else(|| own(k + 1)).or_else(|| own(k.checked_sub(1)?)).unwrap_or(0.0))
            .collect();
        let scale = self.mean_chord();
        let mut slopes = vec![0.0; self.vertices];
        for (k, span) in self.spans.iter().enumerate() {
            let edge = length(self.chord(span)) / self.size / (span.rows[1] - span.rows[0]) as f64;
            let side = sides[k];
            let [from, to] = span.rows;
            for (row, slope) in (from..to).zip(&mut slopes[from..to]) {
                let beside = [(row == from).then(|| self.before(k)), (row + 1 == to).then(|| self.after(k))];
                // Three edges around a data point reach into both spans.
                let agree = beside.into_iter().flatten().all(|other| other.is_some_and(|k| sides[k] == side));
                *slope = if agree { -side * (scale / edge).powi(3) } else { 0.0 };
            }
        }
        slopes
    }
}

/// 1 for a chord along a direction, −1 for one against it, 0 for one perpendicular to it.
pub(super) fn sign_along<const D: usize>(chord: Vector<f64, D>, direction: [f64; 3]) -> f64 {
    let along: f64 = chord.iter().zip(direction).map(|(x, n)| x * n).sum();
    if along.abs() < STRAIGHT * length(chord) * dot(direction, direction).sqrt() { 0.0 } else { along.signum() }
}

fn length<const D: usize>(v: Vector<f64, D>) -> f64 {
    dot(v, v).sqrt()
}
