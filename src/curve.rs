//! [`Curve`]: what formats, pictures and comparisons know of a fitted curve, whatever room it came from.

use std::borrow::Cow;

use glam::DVec3;

use crate::arclength;
use crate::bezier::convert;

/// Where a curve is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Sampling {
    /// Every span between data points becomes this many segments of equal parameter length, the data points among
    /// the samples: K points give N(K−1)+1 samples, a closed curve N·K.
    PerSpan(usize),
    /// This many samples a curve, at equal steps of the parameter from its first to its last value (of a closed
    /// curve: up to, without, the first point again).
    Count(usize),
    /// Samples at equal arc length: the largest spacing not above this one (in the units of the input) that divides the length evenly.
    Spacing(f64),
}

/// A point of a curve with its derivatives with respect to the curve's own parameter. 2-D curves have z = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// p(t)
    pub point: DVec3,
    /// p′(t)
    pub first: DVec3,
    /// p″(t)
    pub second: DVec3,
    /// p‴(t)
    pub third: DVec3,
}

impl Jet {
    /// Curvature |p′ × p″| / |p′|³ in 1/length; for a planar curve signed, positive where it turns left. 0 where p′ vanishes.
    pub fn curvature(&self, dimension: usize) -> f64 {
        let speed = self.first.length();
        if speed == 0.0 {
            return 0.0;
        }
        let turn = self.first.cross(self.second);
        let turn = if dimension == 2 { turn.z } else { turn.length() };
        turn / (speed * speed * speed)
    }
}

/// A curve through (or near) data points, made of one smooth piece a span.
pub trait Curve {
    /// 2 or 3.
    fn dimension(&self) -> usize;

    /// Whether the last span leads back to the first point.
    fn is_closed(&self) -> bool;

    /// The parameter of every data point, nondecreasing; a closed curve has one more, where it meets its first point again.
    fn knots(&self) -> Cow<'_, [f64]>;

    /// The curve at the fraction `u` (0 … 1) of span `span`, with its derivatives with respect to the parameter.
    fn jet(&self, span: usize, u: f64) -> Jet;

    /// Whether this is a fitted curve, and not the input polyline of a curve that could not be fitted.
    fn is_fitted(&self) -> bool {
        true
    }

    /// Number of spans.
    fn spans(&self) -> usize {
        self.knots().len().saturating_sub(1)
    }

    /// First and last parameter.
    fn domain(&self) -> (f64, f64) {
        let knots = self.knots();
        (knots[0], knots[knots.len() - 1])
    }

    /// The span that holds the parameter `t`, and the fraction of it; outside the domain its nearest end.
    fn locate(&self, t: f64) -> (usize, f64) {
        let knots = self.knots();
        let last = knots.len().saturating_sub(2);
        let span = knots.partition_point(|&knot| knot <= t).saturating_sub(1).min(last);
        let length = knots.get(span + 1).map_or(0.0, |next| next - knots[span]);
        let u = if length > 0.0 { ((t - knots[span]) / length).clamp(0.0, 1.0) } else { 0.0 };
        (span, u)
    }

    /// The point at parameter `t`.
    fn point(&self, t: f64) -> DVec3 {
        let (span, u) = self.locate(t);
        self.jet(span, u).point
    }

    /// Derivative of the given order (0 … 3) at parameter `t`.
    fn derivative(&self, t: f64, order: usize) -> DVec3 {
        let (span, u) = self.locate(t);
        let jet = self.jet(span, u);
        [jet.point, jet.first, jet.second, jet.third].get(order).copied().unwrap_or(DVec3::ZERO)
    }

    /// Curvature at parameter `t`, in 1/length; planar curves: signed, positive where they turn left.
    fn curvature(&self, t: f64) -> f64 {
        let (span, u) = self.locate(t);
        self.jet(span, u).curvature(self.dimension())
    }

    /// Arc length, to 1e-9 relative or better (see [`arclength`]).
    fn length(&self) -> f64 {
        (0..self.spans()).map(|span| arclength::span_length(&|u| self.speed(span, u))).sum()
    }

    /// |dp/du| at the fraction `u` of a span.
    fn speed(&self, span: usize, u: f64) -> f64 {
        let knots = self.knots();
        self.jet(span, u).first.length() * (knots[span + 1] - knots[span])
    }

    /// Largest |curvature| among `per_span` + 1 evenly spaced parameters of every span.
    fn max_curvature(&self, per_span: usize) -> f64 {
        let dimension = self.dimension();
        let at = |span, k: usize| self.jet(span, k as f64 / per_span as f64).curvature(dimension).abs();
        (0..self.spans())
            .flat_map(|span| (0..=per_span).map(move |k| (span, k)))
            .map(|(s, k)| at(s, k))
            .fold(0.0, f64::max)
    }

    /// Spans and fractions of the samples, in order along the curve. A curve that was not fitted gives its data points, whatever is asked.
    fn sites(&self, sampling: Sampling) -> Vec<(usize, f64)> {
        let spans = self.spans();
        let end = (!self.is_closed() && spans > 0).then(|| (spans - 1, 1.0));
        let sampling = if self.is_fitted() { sampling } else { Sampling::PerSpan(1) };
        match sampling {
            Sampling::PerSpan(n) => {
                (0..spans).flat_map(|span| (0..n).map(move |k| (span, k as f64 / n as f64))).chain(end).collect()
            }
            Sampling::Count(n) => {
                let (from, to) = self.domain();
                let steps = if self.is_closed() { n } else { n.saturating_sub(1) }.max(1) as f64;
                (0..n).map(|k| self.locate(from + (to - from) * (k as f64 / steps))).collect()
            }
            Sampling::Spacing(spacing) => arclength::even_sites(self, spacing),
        }
    }

    /// The curve as a chain of cubic Béziers, in few pieces: each from one point of the curve to another, with its tangents there (G¹), one or more
    /// a span. No point of the chain is farther than `tolerance` (units of the input) from the curve, and no point of the curve from the
    /// chain, rounding aside. One piece a span, exact, for cubic splines; none for spans between repeated points. A curve that was not fitted
    /// is its polyline, a piece an edge.
    ///
    /// Each piece starts at the point, bit for bit, where the one before it ends; that of a closed curve ends where it starts.
    fn beziers(&self, tolerance: f64) -> Vec<[DVec3; 4]> {
        convert::beziers(self, tolerance)
    }
}

/// The input polyline of a curve that could not be fitted, on the parameters 0, 1, 2 ….
pub(crate) struct Polygon<'a> {
    /// Flat coordinates.
    pub coords: &'a [f64],
    /// 2 or 3.
    pub dimension: usize,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}

impl Polygon<'_> {
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

    fn knots(&self) -> Cow<'_, [f64]> {
        let count = self.coords.len() / self.dimension + usize::from(self.closed);
        Cow::Owned((0..count).map(|k| k as f64).collect())
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let (a, b) = (self.vertex(span), self.vertex(span + 1));
        // Both ends as they are, even where the other is no number.
        let point = match u {
            0.0 => a,
            1.0 => b,
            _ => a + (b - a) * u,
        };
        Jet { point, first: b - a, ..Jet::default() }
    }

    fn is_fitted(&self) -> bool {
        false
    }

    /// The vertices; also of the single point that has no span.
    fn sites(&self, _: Sampling) -> Vec<(usize, f64)> {
        (0..self.coords.len() / self.dimension).map(|k| (k, 0.0)).collect()
    }
}

/// Two or three coordinates as a vector, z = 0 for two.
pub(crate) fn vector(coords: &[f64]) -> DVec3 {
    DVec3::new(coords[0], coords[1], coords.get(2).copied().unwrap_or(0.0))
}
