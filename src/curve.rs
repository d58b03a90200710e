//! [`Curve`]: what formats, pictures and comparisons know of a fitted curve, whatever its method.

pub(crate) mod convert;
mod even;
pub(crate) mod measure;
mod sampling;
mod unfitted;

use crate::motion::Motion;
use crate::surface::Globe;
use glam::DVec3;
use measure::AnyCurve;
pub use sampling::Sampling;
pub(crate) use sampling::{check_spacing, excess, rounded_up, sample_bytes, spans};
pub(crate) use unfitted::{Input, Polygon};

/// A point of a curve with its derivatives with respect to the curve's own parameter.
///
/// 2-D curves have z = 0.
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
    /// Curvature |p′ × p″| / |p′|³ in 1/length.
    ///
    /// For a planar curve it is signed: positive where the curve turns left. It is 0 where p′
    /// vanishes.
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

/// A curve through (or near) data points, with a span from each to the next.
///
/// What is the same for a whole curve is computed once, when the curve is made. Only methods that
/// visit all spans cost more for a curve of many spans.
pub trait Curve: Sync {
    /// 2 or 3.
    fn dimension(&self) -> usize;

    /// Whether the last span leads back to the first point.
    fn is_closed(&self) -> bool;

    /// The parameter of every data point, nondecreasing.
    ///
    /// A closed curve has one more: the parameter at which it meets its first point again.
    fn knots(&self) -> &[f64];

    /// The curve at the fraction `u` (0 … 1) of span `span`, with its derivatives with respect to
    /// the parameter.
    fn jet(&self, span: usize, u: f64) -> Jet;

    /// Whether this is a fitted curve.
    ///
    /// A curve that could not be fitted is its input polyline.
    fn is_fitted(&self) -> bool {
        true
    }

    /// The globe that the curve lies in, if its points are longitudes and latitudes that were fitted on one.
    fn globe(&self) -> Option<Globe> {
        None
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

    /// The span that holds the parameter `t`, and the fraction of that span.
    ///
    /// Outside the domain it is the nearest end of the domain.
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

    /// Curvature at parameter `t`, in 1/length.
    ///
    /// The curvature of a planar curve is signed: positive where the curve turns left.
    fn curvature(&self, t: f64) -> f64 {
        let (span, u) = self.locate(t);
        self.jet(span, u).curvature(self.dimension())
    }

    /// Number of smooth pieces of a span, all of the same parameter length.
    ///
    /// It is 1, except for curves with knots of their own between data points. It is 0 where the
    /// span is a point.
    fn pieces(&self, _span: usize) -> usize {
        1
    }

    /// How the curve moves along a piece of a span, if its velocity is quadratic there.
    ///
    /// Lengths and curvatures are then known from it.
    fn motion(&self, _span: usize, _piece: usize) -> Option<Motion> {
        None
    }

    /// The parameter length of a span.
    ///
    /// It is the factor from derivatives by the parameter to derivatives by the fraction u of the
    /// span.
    #[inline(always)]
    fn pace(&self, span: usize) -> f64 {
        let knots = self.knots();
        knots[span + 1] - knots[span]
    }

    /// |dp/du| at the fraction `u` of a span. On a [globe](Self::globe) it is that on the ground, with the rise of
    /// heights.
    #[inline(always)]
    fn speed(&self, span: usize, u: f64) -> f64 {
        let Jet { point, first, .. } = self.jet(span, u);
        self.globe().map_or(first, |globe| globe.motion(point, first)).length() * self.pace(span)
    }

    /// Arc length, to a relative error of 1e-9 or better, near cusps too (see
    /// [`arclength`](crate::arclength)).
    fn length(&self) -> f64 {
        measure::length::<dyn AnyCurve>(&self)
    }

    /// Arc length of a span, as exact as [`length`](Self::length).
    fn span_length(&self, span: usize) -> f64 {
        measure::span_length::<dyn AnyCurve>(&self, span)
    }

    /// The fraction of a span at which the arc length from its start is `target`.
    ///
    /// `length` is the length of the whole span. The result is good to 1e-9 of that length.
    fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
        measure::fraction_at::<dyn AnyCurve>(&self, span, length, target)
    }

    /// Largest |curvature|, in 1/length. Infinite where the curve has a cusp. On a [globe](Self::globe) it is the
    /// curvature in space of the way on the ground: that of a great circle is 1/R.
    ///
    /// The accuracy depends on the curve:
    ///
    /// - Cubic splines, fair curves and Béziers of degree 3 or less: the true maximum, to a
    ///   relative error of 1e-9. It comes from the roots of the polynomial of its stationary places
    ///   ([`Motion::max_curvature`]). Next to a cusp, where the speed falls to a part r of its
    ///   largest, the relative error is 1e-15/r.
    /// - Smooth connection functions: from their closed form, to rounding.
    /// - Béziers of higher degree: maxima seen at 128 places a piece are followed to 1e-9. A peak
    ///   narrower than that may be missed.
    fn max_curvature(&self) -> f64 {
        measure::max_curvature::<dyn AnyCurve>(&self)
    }

    /// The least number of samples of the whole curve or of a span: see [`Sampling`].
    fn least(&self, sampling: Sampling) -> usize {
        sampling::least(&self, sampling)
    }

    /// Spans and fractions of the samples, in order along the curve.
    ///
    /// A curve that was not fitted gives its data points: see [`Sampling`].
    fn sites(&self, sampling: Sampling) -> Vec<(usize, f64)> {
        sampling::sites(&self, sampling)
    }

    /// The curve as a chain of cubic Béziers, in few pieces.
    ///
    /// Each piece leads from one point of the curve to another and has the curve's tangents there
    /// (G¹). A span has one piece or more. A cubic spline has one piece a span, which is exact.
    /// Spans between repeated points have none. A curve that was not fitted is its polyline, one
    /// piece an edge.
    ///
    /// No point of the chain is farther than `tolerance` (units of the input) from the curve, and
    /// no point of the curve is farther than that from the chain, rounding aside. The least
    /// tolerance is [`LEAST_TOLERANCE`](crate::bezier::LEAST_TOLERANCE) of the largest coordinate.
    /// A smaller one is raised to it.
    ///
    /// Each piece starts at the point, bit for bit, where the piece before it ends. The last piece
    /// of a closed curve ends where the first one starts.
    fn beziers(&self, tolerance: f64) -> Vec<[DVec3; 4]> {
        convert::beziers(&self, tolerance)
    }
}

/// Two or three coordinates as a vector, z = 0 for two.
pub(crate) fn vector(coords: &[f64]) -> DVec3 {
    DVec3::new(coords[0], coords[1], coords.get(2).copied().unwrap_or(0.0))
}
