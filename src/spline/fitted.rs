//! Cubic splines by their values and second derivatives at the knots, seen through the [`Curve`] trait.

use std::borrow::Cow;

use super::knots::Knots;
use crate::batch::CurveBatch;
use crate::curve::{Curve, Jet, Polygon, Sampling, vector};
use crate::report::CurveSet;

/// The curves of a batch.
pub(crate) struct FittedSplines {
    /// Knots and values.
    pub knots: Knots,
    /// Second derivatives at the knots, as the values.
    pub second: Vec<f64>,
    /// The input: names, and the points of curves that were not fitted.
    pub batch: CurveBatch,
}

/// One of them.
struct FittedSpline<'a> {
    splines: &'a FittedSplines,
    curve: usize,
}

impl CurveSet for FittedSplines {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        if self.knots.range(i).is_empty() {
            let (coords, closed) = (self.batch.points(i), self.batch.is_closed(i));
            return Box::new(Polygon { coords, dimension: self.batch.dimension(), closed });
        }
        Box::new(FittedSpline { splines: self, curve: i })
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let d = self.batch.dimension();
        let (mut coords, mut offsets) = (Vec::new(), vec![0]);
        for i in 0..self.batch.len() {
            let curve = self.curve(i);
            for (span, u) in curve.sites(sampling) {
                coords.extend_from_slice(&curve.jet(span, u).point.to_array()[..d]);
            }
            offsets.push(coords.len() / d);
        }
        self.batch.with_points(coords, offsets)
    }
}

impl Curve for FittedSpline<'_> {
    fn dimension(&self) -> usize {
        self.splines.knots.dimension
    }

    fn is_closed(&self) -> bool {
        self.splines.knots.closed[self.curve]
    }

    fn knots(&self) -> Cow<'_, [f64]> {
        self.splines.knots.data_parameters(self.curve)
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let knots = &self.splines.knots;
        let (d, start) = (knots.dimension, knots.offsets[self.curve]);
        // Data points at one parameter span nothing: such a span is its knot.
        let entries = knots.repeats.get(&self.curve);
        let entry = |k: usize| start + entries.map_or(k, |entries| entries[k] as usize);
        let (from, to) = (entry(span), entry(span + 1));
        let at = |column: &[f64], k: usize| vector(&column[k * d..(k + 1) * d]);
        let (a, b) = (at(&knots.values, from), at(&knots.values, to));
        let (m, n) = (at(&self.splines.second, from), at(&self.splines.second, to));
        let h = knots.t[to] - knots.t[from];
        if h == 0.0 {
            return Jet { point: a, second: m, ..Jet::default() };
        }
        let v = 1.0 - u;
        let bend = m * (v * v * v - v) + n * (u * u * u - u);
        Jet {
            point: a * v + b * u + bend * (h * h / 6.0),
            first: (b - a) / h + (m * (1.0 - 3.0 * v * v) + n * (3.0 * u * u - 1.0)) * (h / 6.0),
            second: m * v + n * u,
            third: (n - m) / h,
        }
    }
}
