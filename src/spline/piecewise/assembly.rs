//! The systems for the first derivatives at the knots.

use super::{Boundary, Condition, Knotted};
use crate::parallel;
use crate::ragged;

/// Tridiagonal systems, one a curve, and their right-hand sides. Curves without a spline have none.
pub(super) struct System {
    pub offsets: Vec<usize>,
    pub lower: Vec<f64>,
    pub diagonal: Vec<f64>,
    pub upper: Vec<f64>,
    pub rhs: Vec<f64>,
}

/// A row of a system.
struct Row<'r> {
    lower: f64,
    diagonal: f64,
    upper: f64,
    rhs: &'r mut [f64],
}

impl System {
    pub fn new(given: &Knotted, boundary: &Boundary, has_spline: impl Fn(usize) -> bool) -> Self {
        let d = given.columns;
        let periodic = matches!(boundary, Boundary::Periodic);
        let rows = |i: usize| match has_spline(i) {
            // The last knot of a periodic spline is its first again.
            true => given.offsets[i + 1] - given.offsets[i] - usize::from(periodic),
            false => 0,
        };
        let offsets = ragged::offsets((0..given.len()).map(rows));
        let size = offsets[given.len()];
        // Three coefficients and `d` right-hand sides a row, so that curves are assembled in parallel.
        let width = 3 + d;
        let mut table = vec![0.0; size * width];
        let ends: Vec<usize> = offsets.iter().map(|offset| offset * width).collect();
        parallel::parts(&mut table, &ends, |i, table| {
            if table.is_empty() {
                return;
            }
            let curve = Curve::new(given, i);
            for (k, row) in table.chunks_exact_mut(width).enumerate() {
                let (bands, rhs) = row.split_at_mut(3);
                let row = Row { lower: 0.0, diagonal: 0.0, upper: 0.0, rhs };
                let row = match boundary {
                    Boundary::Periodic => curve.periodic(k, row),
                    Boundary::Ends(ends) => curve.open(i, k, ends, row),
                };
                (bands[0], bands[1], bands[2]) = (row.lower, row.diagonal, row.upper);
            }
        });
        let band = |m: usize| table.chunks_exact(width).map(|row| row[m]).collect::<Vec<f64>>();
        let rhs = table.chunks_exact(width).flat_map(|row| &row[3..]).copied().collect();
        System { offsets, lower: band(0), diagonal: band(1), upper: band(2), rhs }
    }
}

/// The knots and values of a curve.
struct Curve<'a> {
    x: &'a [f64],
    y: &'a [f64],
    d: usize,
}

impl<'a> Curve<'a> {
    fn new(given: &Knotted<'a>, i: usize) -> Self {
        let (rows, d) = (given.offsets[i]..given.offsets[i + 1], given.columns);
        Curve { x: &given.x[rows.clone()], y: &given.y[rows.start * d..rows.end * d], d }
    }

    /// The length of a span.
    fn h(&self, k: usize) -> f64 {
        self.x[k + 1] - self.x[k]
    }

    /// The slope of a chord.
    fn slope(&self, k: usize, column: usize) -> f64 {
        (self.y[(k + 1) * self.d + column] - self.y[k * self.d + column]) / self.h(k)
    }

    /// The second derivative is the same on both sides of a knot: of spans `a` and `b`.
    fn continuous<'r>(&self, a: usize, b: usize, row: Row<'r>) -> Row<'r> {
        let (before, after) = (self.h(a), self.h(b));
        for (column, to) in row.rhs.iter_mut().enumerate() {
            *to = 3.0 * (after * self.slope(a, column) + before * self.slope(b, column));
        }
        Row { lower: after, diagonal: 2.0 * (before + after), upper: before, ..row }
    }

    fn periodic<'r>(&self, k: usize, row: Row<'r>) -> Row<'r> {
        let spans = self.x.len() - 1;
        match spans {
            // One span between equal values: a constant.
            1 => Row { diagonal: 1.0, ..row },
            // Two: both neighbours are the other knot, and the slopes are equal.
            2 => {
                let (a, b) = (1.0 / self.h(0), 1.0 / self.h(1));
                for (column, to) in row.rhs.iter_mut().enumerate() {
                    *to = (self.slope(0, column) * a + self.slope(1, column) * b) / (a + b);
                }
                Row { diagonal: 1.0, ..row }
            }
            _ => self.continuous((k + spans - 1) % spans, k, row),
        }
    }

    fn open<'r>(&self, i: usize, k: usize, ends: &[Condition; 2], row: Row<'r>) -> Row<'r> {
        let last = self.x.len() - 1;
        if k > 0 && k < last {
            return self.continuous(k - 1, k, row);
        }
        let at_end = k > 0;
        let condition = &ends[usize::from(at_end)];
        let Row { rhs, .. } = row;
        // The span at this end, and the next one.
        let span = if at_end { last - 1 } else { 0 };
        let h = self.h(span);
        let value = |values: &[f64], column: usize| values[i * self.d + column];
        let (diagonal, beside) = match condition {
            Condition::First(values) => {
                rhs.iter_mut().enumerate().for_each(|(column, to)| *to = value(values, column));
                (1.0, 0.0)
            }
            Condition::Second(values) => {
                let sign = if at_end { 0.5 } else { -0.5 };
                for (column, to) in rhs.iter_mut().enumerate() {
                    *to = sign * value(values, column) * h * h + 3.0 * self.slope(span, column) * h;
                }
                (2.0 * h, h)
            }
            Condition::NotAKnot if last == 1 => {
                rhs.iter_mut().enumerate().for_each(|(column, to)| *to = self.slope(span, column));
                (1.0, 0.0)
            }
            // A parabola through three points.
            Condition::NotAKnot if last == 2 && ends.iter().all(|end| *end == Condition::NotAKnot) => {
                rhs.iter_mut().enumerate().for_each(|(column, to)| *to = 2.0 * self.slope(span, column));
                (1.0, 1.0)
            }
            Condition::NotAKnot => {
                let next = if at_end { last - 2 } else { 1 };
                let both = h + self.h(next);
                for (column, to) in rhs.iter_mut().enumerate() {
                    let (own, other) = (self.slope(span, column), self.slope(next, column));
                    *to = ((h + 2.0 * both) * self.h(next) * own + h * h * other) / both;
                }
                (self.h(next), both)
            }
        };
        let (lower, upper) = if at_end { (beside, 0.0) } else { (0.0, beside) };
        Row { lower, diagonal, upper, rhs }
    }
}

/// The coefficients of a curve from its slopes.
pub(super) fn coefficients(given: &Knotted, i: usize, slopes: &[f64], c: &mut [f64]) {
    let curve = Curve::new(given, i);
    let d = curve.d;
    let rows = slopes.len() / d;
    for (k, c) in c.chunks_exact_mut(4 * d).enumerate() {
        let h = curve.h(k);
        for column in 0..d {
            let [from, to] = [k % rows, (k + 1) % rows].map(|row| slopes[row * d + column]);
            let slope = curve.slope(k, column);
            let t = (from + to - 2.0 * slope) / h;
            c[column] = t / h;
            c[d + column] = (slope - from) / h - t;
            c[2 * d + column] = from;
            c[3 * d + column] = curve.y[k * d + column];
        }
    }
}
