//! [`Curve`]: a fitted curve, whatever its method.

pub(crate) mod convert;
mod even;
pub(crate) mod few;
pub(crate) mod fewest;
pub(crate) mod handles;
pub(crate) mod measure;
mod samples;
mod sampling;
mod unfitted;

use crate::motion::Motion;
use crate::surface::Globe;
use glam::DVec3;
use measure::AnyCurve;
pub(crate) use samples::samples_at;
pub use sampling::Sampling;
pub(crate) use sampling::{check_spacing, excess, rounded_up, sample_bytes, spans};
pub(crate) use unfitted::{Input, Polygon};

/// A point of a curve with its derivatives with respect to the parameter.
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
    /// Signed for a planar curve: positive where the curve turns left. 0 where p′ vanishes.
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

/// The piece at the fraction `u` of a span, and the fraction of the piece. The span has pieces of the
/// same parameter length from the first knot to the second. `None` if it has none.
pub(crate) fn piece_at([from, to]: [u32; 2], u: f64) -> Option<(usize, f64)> {
    let (from, pieces) = (from as usize, (to - from) as usize);
    let place = u * pieces as f64;
    let piece = (place.floor().max(0.0) as usize).min(pieces.checked_sub(1)?);
    Some((from + piece, place - piece as f64))
}

/// A curve through or near data points, with a span from each point to the next.
pub trait Curve: Sync {
    /// 2 or 3.
    fn dimension(&self) -> usize;

    /// Whether the last span leads back to the first point.
    fn is_closed(&self) -> bool;

    /// The parameter of every data point, nondecreasing.
    ///
    /// A closed curve has one more, where it returns to its first point.
    fn knots(&self) -> &[f64];

    /// The jet at the fraction `u` (0 … 1) of a span.
    fn jet(&self, span: usize, u: f64) -> Jet;

    /// Whether this is a fitted curve, and not the input polyline of a curve that could not be
    /// fitted.
    fn is_fitted(&self) -> bool {
        true
    }

    /// The globe of a curve of longitudes and latitudes that was fitted on one.
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

    /// The span of the parameter `t`, and the fraction there. `t` is clamped to the domain.
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

    #[doc(hidden)]
    /// Number of smooth pieces of a span, all of the same parameter length.
    ///
    /// 1, except for curves with additional knots between data points. 0 if the span is a point.
    fn pieces(&self, _span: usize) -> usize {
        1
    }

    #[doc(hidden)]
    /// The motion along a piece of a span with a quadratic velocity, for lengths and curvatures.
    fn motion(&self, _span: usize, _piece: usize) -> Option<Motion> {
        None
    }

    #[doc(hidden)]
    /// The parameter length of a span: the factor from derivatives by the parameter to derivatives
    /// by the fraction u.
    #[inline(always)]
    fn pace(&self, span: usize) -> f64 {
        let knots = self.knots();
        knots[span + 1] - knots[span]
    }

    /// |dp/du| at the fraction `u` of a span, measured on the ground with heights if there is a
    /// [globe](Self::globe).
    #[inline(always)]
    fn speed(&self, span: usize, u: f64) -> f64 {
        let Jet { point, first, .. } = self.jet(span, u);
        self.globe().map_or(first, |globe| globe.motion(point, first)).length() * self.pace(span)
    }

    /// Arc length, to a relative error of 1e-9 or better, near cusps too.
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

    /// Largest |curvature|, in 1/length. Infinite at a cusp. On a [globe](Self::globe) it is the
    /// curvature in space: 1/R for a great circle.
    ///
    /// The accuracy depends on the curve:
    ///
    /// - Cubic splines, fair curves and Béziers of degree 3 or less: the true maximum, to a
    ///   relative error of 1e-9, from the roots of a polynomial. Near a cusp, where the speed falls
    ///   to a fraction r of its maximum, the relative error is 1e-15/r.
    /// - Smooth connection functions: from their closed form, to rounding.
    /// - Béziers of higher degree: maxima among 128 points per piece, refined to 1e-9. Narrower
    ///   peaks may be missed.
    fn max_curvature(&self) -> f64 {
        measure::max_curvature::<dyn AnyCurve>(&self)
    }

    #[doc(hidden)]
    /// The least number of samples of the whole curve or of a span: see [`Sampling`].
    fn least(&self, sampling: Sampling) -> usize {
        samples::least(&self, sampling)
    }

    #[doc(hidden)]
    /// Whether [`Sampling::Tolerance`] has a sample at the start of a span, on the curve.
    fn is_fixed(&self, span: usize) -> bool {
        few::is_corner(&self, span)
    }

    /// Spans and fractions of the samples, in order along the curve: see [`Sampling`].
    fn sites(&self, sampling: Sampling) -> Vec<(usize, f64)> {
        samples::sites(&self, sampling)
    }

    /// The curve as a chain of cubic Béziers, in few pieces.
    ///
    /// Each piece has its end points on the curve, with the curve's tangents (G¹). A span has one
    /// piece or more, a span between repeated points none. Cubic splines have one exact piece per
    /// span, unfitted curves one per edge of their polyline.
    ///
    /// The distance between chain and curve is at most `tolerance` (units of the input), from any
    /// point of either. The least tolerance is [`LEAST_TOLERANCE`](crate::bezier::LEAST_TOLERANCE)
    /// of the largest coordinate.
    ///
    /// Consecutive pieces share their end point, bit for bit.
    fn beziers(&self, tolerance: f64) -> Vec<[DVec3; 4]> {
        convert::beziers(&self, tolerance)
    }

    /// The curve as a chain of as few cubic Béziers as the tolerance allows.
    ///
    /// As [`beziers`](Self::beziers), but a piece may cover many spans. It ends where the direction
    /// turns by more than one degree, and with `extremes` where x or y is extreme, as fonts ask.
    fn fewest_beziers(&self, tolerance: f64, extremes: bool) -> Vec<[DVec3; 4]> {
        fewest::fewest(&self, tolerance, extremes)
    }
}

/// Two or three coordinates as a vector, z = 0 for two.
pub(crate) fn vector(coords: &[f64]) -> DVec3 {
    DVec3::new(coords[0], coords[1], coords.get(2).copied().unwrap_or(0.0))
}
