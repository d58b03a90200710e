//! The systems for the first derivatives at the knots.

use super::{EndCondition, Knotted};
use crate::parallel;
use crate::ragged;

/// A tridiagonal system per curve, with right-hand sides. Curves without a spline have no rows.
pub(super) struct System {
    pub offsets: Vec<usize>,
    pub lower: Vec<f64>,
    pub diagonal: Vec<f64>,
    pub upper: Vec<f64>,
    pub rhs: Vec<f64>,
}

impl System {
    pub fn new(given: &Knotted, ends: &[EndCondition; 2], has_spline: impl Fn(usize) -> bool) -> Self {
        let (d, periodic) = (given.columns, given.periodic);
        let rows = |i: usize| match has_spline(i) {
            // The last knot of a periodic spline is its first again.
            true => given.offsets[i + 1] - given.offsets[i] - usize::from(periodic),
            false => 0,
        };
        let offsets = ragged::offsets((0..given.len()).map(rows));
        let size = offsets[given.len()];
        // Three coefficients and `d` right-hand sides a row, so that curves are assembled in
        // parallel.
        let width = 3 + d;
        let mut table = vec![0.0; size * width];
        let table_ends: Vec<usize> = offsets.iter().map(|offset| offset * width).collect();
        parallel::parts(&mut table, &table_ends, |i, table| {
            if table.is_empty() {
                return;
            }
            let curve = Curve::new(given, i);
            for (k, row) in table.chunks_exact_mut(width).enumerate() {
                let (bands, rhs) = row.split_at_mut(3);
                let row = if periodic { curve.periodic(k, rhs) } else { curve.open(i, k, ends, rhs) };
                bands.copy_from_slice(&row);
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

    /// The row for equal second derivatives on both sides of a knot, of spans `a` and `b`: lower,
    /// diagonal and upper entry, with the right-hand sides in `rhs`.
    fn continuous(&self, a: usize, b: usize, rhs: &mut [f64]) -> [f64; 3] {
        let (before, after) = (self.h(a), self.h(b));
        for (column, to) in rhs.iter_mut().enumerate() {
            *to = 3.0 * (after * self.slope(a, column) + before * self.slope(b, column));
        }
        [after, 2.0 * (before + after), before]
    }

    fn periodic(&self, k: usize, rhs: &mut [f64]) -> [f64; 3] {
        let spans = self.x.len() - 1;
        match spans {
            // One span between equal values: a constant.
            1 => [0.0, 1.0, 0.0],
            // Two: both neighbours are the other knot, and the slopes are equal.
            2 => {
                let (a, b) = (1.0 / self.h(0), 1.0 / self.h(1));
                for (column, to) in rhs.iter_mut().enumerate() {
                    *to = (self.slope(0, column) * a + self.slope(1, column) * b) / (a + b);
                }
                [0.0, 1.0, 0.0]
            }
            _ => self.continuous((k + spans - 1) % spans, k, rhs),
        }
    }

    fn open(&self, i: usize, k: usize, ends: &[EndCondition; 2], rhs: &mut [f64]) -> [f64; 3] {
        let last = self.x.len() - 1;
        if k > 0 && k < last {
            return self.continuous(k - 1, k, rhs);
        }
        let at_end = k > 0;
        let condition = ends[usize::from(at_end)];
        // A parabola through three points.
        let is_parabola = last == 2 && ends.iter().all(|end| *end == EndCondition::NotAKnot);
        // The span at this end, and the next one.
        let span = if at_end { last - 1 } else { 0 };
        let (h, next) = (self.h(span), if at_end { last.saturating_sub(2) } else { 1 });
        let (diagonal, beside) = match condition {
            EndCondition::First(_) => (1.0, 0.0),
            EndCondition::Second(_) => (2.0 * h, h),
            EndCondition::NotAKnot if last == 1 => (1.0, 0.0),
            EndCondition::NotAKnot if is_parabola => (1.0, 1.0),
            EndCondition::NotAKnot => (self.h(next), h + self.h(next)),
        };
        for (column, to) in rhs.iter_mut().enumerate() {
            let slope = self.slope(span, column);
            *to = match condition {
                EndCondition::First(values) => values[i * self.d + column],
                EndCondition::Second(values) => {
                    let sign = if at_end { 0.5 } else { -0.5 };
                    sign * values[i * self.d + column] * h * h + 3.0 * slope * h
                }
                EndCondition::NotAKnot if last == 1 => slope,
                EndCondition::NotAKnot if is_parabola => 2.0 * slope,
                EndCondition::NotAKnot => {
                    ((h + 2.0 * beside) * self.h(next) * slope + h * h * self.slope(next, column)) / beside
                }
            };
        }
        if at_end { [beside, diagonal, 0.0] } else { [0.0, diagonal, beside] }
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
