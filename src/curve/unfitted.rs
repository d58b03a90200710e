//! Curves that could not be fitted: their input, and its polyline as a [`Curve`].

use std::borrow::Cow;

use glam::DVec3;

use super::{Curve, Jet, Sampling, vector};
use crate::batch::CurveBatch;
use crate::motion::Motion;

/// The input polyline of a curve that could not be fitted, on its parameters or 0, 1, 2 ….
pub(crate) struct Polygon<'a> {
    /// Flat coordinates.
    pub coords: &'a [f64],
    /// 2 or 3.
    pub dimension: usize,
    /// Whether the last point is joined to the first.
    pub closed: bool,
    /// The parameter of every point. A closed curve has one more.
    pub knots: Cow<'a, [f64]>,
}

impl<'a> Polygon<'a> {
    /// The polyline on the parameters 0, 1, 2 ….
    pub fn new(coords: &'a [f64], dimension: usize, closed: bool) -> Self {
        let count = coords.len() / dimension;
        let ends = if count > 0 { count + usize::from(closed) } else { 0 };
        Polygon { coords, dimension, closed, knots: (0..ends).map(|k| k as f64).collect() }
    }

    /// A vertex, NaN if there are none.
    fn vertex(&self, k: usize) -> DVec3 {
        let count = self.coords.len() / self.dimension;
        if count == 0 {
            return DVec3::NAN;
        }
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
        // No span starts at the last vertex.
        if span + 1 >= self.knots.len() {
            let point = if u.is_nan() { DVec3::NAN } else { self.vertex(span) };
            return Jet { point, ..Jet::default() };
        }
        let (a, b) = (self.vertex(span), self.vertex(span + 1));
        // Ends keep their bits, even if the other end is NaN.
        let point = match u {
            0.0 => a,
            1.0 => b,
            _ => a + (b - a) * u,
        };
        Jet { point, first: (b - a) / self.pace(span), ..Jet::default() }
    }

    /// The parameter length of a span, or 1 if the parameters are invalid.
    fn pace(&self, span: usize) -> f64 {
        let length = self.knots[span + 1] - self.knots[span];
        if length > 0.0 && length.is_finite() { length } else { 1.0 }
    }

    fn motion(&self, span: usize, _: usize) -> Option<Motion> {
        Some(Motion::of_cubic(self.vertex(span + 1) - self.vertex(span), DVec3::ZERO, DVec3::ZERO))
    }

    /// 0: turns between edges do not count.
    fn max_curvature(&self) -> f64 {
        0.0
    }

    fn is_fitted(&self) -> bool {
        false
    }

    /// The vertices, or a number of points at equal lengths: a single point is repeated, and a
    /// polyline without a finite length gives NaN.
    fn sites(&self, sampling: Sampling) -> Vec<(usize, f64)> {
        match sampling {
            Sampling::Points(n) if self.length().is_finite() && !self.coords.is_empty() => super::even::sites(&self, n),
            Sampling::Points(n) => vec![(0, f64::NAN); n],
            _ => (0..self.coords.len() / self.dimension).map(|k| (k, 0.0)).collect(),
        }
    }
}

/// The input of a curve that could not be fitted, bit for bit.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub coords: Vec<f64>,
    /// The given parameters, or 0, 1, 2 ….
    pub t: Vec<f64>,
    /// The parameter length of the closing span. NaN if the curve is open, or if parameters are
    /// given without it.
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

    /// Coordinates and parameters of samples: the input, unless `sampling` is [`Sampling::Points`].
    pub fn sample(&self, dimension: usize, closed: bool, sampling: Sampling) -> (Vec<f64>, Vec<f64>) {
        if !matches!(sampling, Sampling::Points(_)) {
            return (self.coords.clone(), self.t.clone());
        }
        let polygon = self.polygon(dimension, closed);
        let sites = polygon.sites(sampling);
        let point = |&(span, u): &(usize, f64)| polygon.jet(span, u).point.to_array().into_iter().take(dimension);
        let t = |&(span, u): &(usize, f64)| match (polygon.knots.get(span), polygon.knots.get(span + 1)) {
            (Some(from), Some(to)) if u != 0.0 => from + u * (to - from),
            (Some(from), _) => *from,
            _ => f64::NAN,
        };
        (sites.iter().flat_map(point).collect(), sites.iter().map(t).collect())
    }

    /// The parameter length from the last sample of a closed curve, at this parameter, to its
    /// first.
    pub fn closing_after(&self, last: f64) -> f64 {
        match self.t.last() {
            Some(&end) if end != last => end + self.closing - last,
            _ => self.closing,
        }
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
