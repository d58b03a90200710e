//! Curves that could not be fitted: what they came in as, and its polyline as a [`Curve`].

use std::borrow::Cow;

use glam::DVec3;

use super::{Curve, Jet, Sampling, vector};
use crate::batch::CurveBatch;
use crate::motion::Motion;

/// The input polyline of a curve that could not be fitted, on the parameters given, else 0, 1, 2 ….
pub(crate) struct Polygon<'a> {
    /// Flat coordinates.
    pub coords: &'a [f64],
    /// 2 or 3.
    pub dimension: usize,
    /// Whether the last point is joined to the first.
    pub closed: bool,
    /// The parameter of every point; of a closed curve one more.
    pub knots: Cow<'a, [f64]>,
}

impl<'a> Polygon<'a> {
    /// On the parameters 0, 1, 2 ….
    pub fn new(coords: &'a [f64], dimension: usize, closed: bool) -> Self {
        let count = coords.len() / dimension;
        let ends = if count > 0 { count + usize::from(closed) } else { 0 };
        Polygon { coords, dimension, closed, knots: (0..ends).map(|k| k as f64).collect() }
    }

    fn vertex(&self, k: usize) -> DVec3 {
        let count = self.coords.len() / self.dimension;
        vector(&self.coords[(k % count) * self.dimension..][..self.dimension])
    }
}

impl Curve for Polygon<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let (a, b) = (self.vertex(span), self.vertex(span + 1));
        // Both ends as they are, even where the other is no number.
        let point = match u {
            0.0 => a,
            1.0 => b,
            _ => a + (b - a) * u,
        };
        Jet { point, first: (b - a) / self.pace(span), ..Jet::default() }
    }

    /// Parameters of what could not be fitted may be anything: where they do not increase,
    /// derivatives are those by the fraction.
    fn pace(&self, span: usize) -> f64 {
        let length = self.knots[span + 1] - self.knots[span];
        if length > 0.0 && length.is_finite() { length } else { 1.0 }
    }

    fn motion(&self, span: usize, _: usize) -> Option<Motion> {
        Some(Motion::of_cubic(self.vertex(span + 1) - self.vertex(span), DVec3::ZERO, DVec3::ZERO))
    }

    /// No side is curved; that it turns from one to the next is in none of them.
    fn max_curvature(&self) -> f64 {
        0.0
    }

    fn is_fitted(&self) -> bool {
        false
    }

    /// The vertices; also of the single point that has no span.
    fn sites(&self, _: Sampling) -> Vec<(usize, f64)> {
        (0..self.coords.len() / self.dimension).map(|k| (k, 0.0)).collect()
    }
}

/// What a curve came in as, which it comes out as where it could not be fitted: its points, and its
/// parameters, bit for bit.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub coords: Vec<f64>,
    /// The parameters given, else 0, 1, 2 ….
    pub t: Vec<f64>,
    /// The parameter length of the span that closes the curve; NaN where it is open, or none was
    /// given to given parameters.
    pub closing: f64,
}

impl Input {
    pub fn of(batch: &CurveBatch, i: usize) -> Self {
        let (t, closing) = match batch.parameters(i) {
            Some(given) => (given.to_vec(), batch.closing_span(i).unwrap_or(f64::NAN)),
            None => ((0..batch.count(i)).map(|k| k as f64).collect(), 1.0),
        };
        let closing = if batch.is_closed(i) { closing } else { f64::NAN };
        Input { coords: batch.points(i).to_vec(), t, closing }
    }

    pub fn polygon(&self, dimension: usize, closed: bool) -> Polygon<'_> {
        let mut knots = Cow::Borrowed(&self.t[..]);
        if let Some(last) = self.t.last().filter(|_| closed) {
            let closing = if self.closing.is_nan() { 0.0 } else { self.closing };
            knots.to_mut().push(last + closing);
        }
        Polygon { coords: &self.coords, dimension, closed, knots }
    }
}
