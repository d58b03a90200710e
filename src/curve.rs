//! [`Curve`]: what formats, pictures and comparisons know of a fitted curve, whatever its method.

pub(crate) mod convert;
mod even;
mod sampling;
mod unfitted;

use std::ops::Range;

use crate::arclength;
use crate::motion::{Motion, Vector, searched_curvature};
use crate::parallel;
use crate::surface::Globe;
use glam::{DVec2, DVec3};
pub use sampling::Sampling;
pub(crate) use sampling::{check_spacing, spans};
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

/// Spans that one thread measures at once.
const RUN: usize = 4096;

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

    /// |dp/du| at the fraction `u` of a span.
    #[inline(always)]
    fn speed(&self, span: usize, u: f64) -> f64 {
        self.jet(span, u).first.length() * self.pace(span)
    }

    /// Arc length, to a relative error of 1e-9 or better, near cusps too (see [`arclength`]).
    fn length(&self) -> f64 {
        runs(self, Measure::Length).into_iter().sum()
    }

    /// Arc length of a span, as exact as [`length`](Self::length).
    #[inline(always)]
    fn span_length(&self, span: usize) -> f64 {
        let pieces = self.pieces(span);
        (0..pieces).map(|piece| piece_length(self, span, piece, pieces)).sum()
    }

    /// The fraction of a span at which the arc length from its start is `target`.
    ///
    /// `length` is the length of the whole span. The result is good to 1e-9 of that length.
    fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
        let pieces = self.pieces(span);
        if target >= length || pieces == 0 {
            return if target > 0.0 { 1.0 } else { 0.0 };
        }
        let (mut before, mut piece, mut own) = (0.0, 0, piece_length(self, span, 0, pieces));
        while piece + 1 < pieces && before + own <= target {
            before += own;
            piece += 1;
            own = piece_length(self, span, piece, pieces);
        }
        let target = (target - before).clamp(0.0, own);
        if own == 0.0 || target == 0.0 {
            return piece as f64 / pieces as f64;
        }
        let v = match self.motion(span, piece) {
            Some(motion) => arclength::fraction_at(|v| motion.speed(v), own, target),
            None => arclength::fraction_at(
                |v| self.speed(span, (piece as f64 + v) / pieces as f64) / pieces as f64,
                own,
                target,
            ),
        };
        (piece as f64 + v) / pieces as f64
    }

    /// Largest |curvature|, in 1/length. Infinite where the curve has a cusp.
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
        let known = runs(self, Measure::CurvatureSeen).into_iter().fold(0.0, f64::max);
        runs(self, Measure::Curvature { known }).into_iter().fold(known, f64::max)
    }

    /// The least number of samples of the whole curve or of a span: see [`Sampling`].
    fn least(&self, sampling: Sampling) -> usize {
        // With four or more samples a span there is nothing to check.
        if !self.is_closed() || matches!(sampling, Sampling::PerSpan(4..)) {
            return 0;
        }
        let ends_differ = |span: &usize| self.jet(*span, 0.0).point != self.jet(*span, 1.0).point;
        let long = (0..self.spans()).filter(ends_differ).take(4).count();
        let all: usize = if (1..3).contains(&long) { 4 } else { 3 };
        match sampling {
            Sampling::PerSpan(_) => all.div_ceil(long.max(1)),
            // Spans between equal points may have parameters of their own. Then the middles of the
            // other spans are needed.
            Sampling::Count(_) if all > 3 => 2 * self.spans(),
            _ => all,
        }
    }

    /// Spans and fractions of the samples, in order along the curve.
    ///
    /// A curve that was not fitted gives its data points, whatever `sampling` asks.
    fn sites(&self, sampling: Sampling) -> Vec<(usize, f64)> {
        let spans = self.spans();
        let end = (!self.is_closed() && spans > 0).then(|| (spans - 1, 1.0));
        let sampling = if self.is_fitted() { sampling } else { Sampling::PerSpan(1) };
        match sampling {
            Sampling::PerSpan(n) => {
                let n = n.max(self.least(sampling));
                (0..spans).flat_map(|span| (0..n).map(move |k| (span, k as f64 / n as f64))).chain(end).collect()
            }
            Sampling::Count(n) => {
                let (from, to) = self.domain();
                let n = n.max(self.least(sampling));
                let steps = if self.is_closed() { n } else { n.saturating_sub(1) }.max(1) as f64;
                (0..n).map(|k| self.locate(from + (to - from) * (k as f64 / steps))).collect()
            }
            Sampling::Points(n) => even::sites(self, n.max(self.least(sampling))),
            Sampling::Spacing(spacing) => even::even_sites(self, spacing),
        }
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
        convert::beziers(self, tolerance)
    }
}

/// Arc length of one piece of a span that has `pieces` of them.
#[inline(always)]
fn piece_length<C: Curve + ?Sized>(curve: &C, span: usize, piece: usize, pieces: usize) -> f64 {
    if curve.dimension() == 2 {
        length_in::<DVec2, C>(curve, span, piece, pieces)
    } else {
        length_in::<DVec3, C>(curve, span, piece, pieces)
    }
}

/// Arc length of a piece, in the plane or in space.
#[inline(always)]
fn length_in<V: Vector, C: Curve + ?Sized>(curve: &C, span: usize, piece: usize, pieces: usize) -> f64 {
    match curve.motion(span, piece) {
        Some(motion) => motion.moving::<V>().length(),
        None => {
            let pieces = pieces as f64;
            arclength::span_length(|v| curve.speed(span, (piece as f64 + v) / pieces) / pieces)
        }
    }
}

/// What is measured of a curve, run by run.
#[derive(Clone, Copy)]
enum Measure {
    Length,
    /// The largest |κ| at both ends and in the middle of every piece.
    CurvatureSeen,
    /// The largest |κ|, if it is above a known one.
    Curvature {
        known: f64,
    },
}

/// Measures every run of spans on all threads. Results are in the order of the curve.
fn runs<C: Curve + ?Sized>(curve: &C, measure: Measure) -> Vec<f64> {
    let spans = curve.spans();
    let run = |k: usize| {
        let spans = k * RUN..spans.min((k + 1) * RUN);
        pulp::Arch::new().dispatch(Run { curve, measure, spans })
    };
    match spans.div_ceil(RUN) {
        1 => vec![run(0)],
        count => parallel::map(count, 1, run),
    }
}

/// A run of spans, compiled once for every instruction set.
struct Run<'a, C: ?Sized> {
    curve: &'a C,
    measure: Measure,
    spans: Range<usize>,
}

impl<C: Curve + ?Sized> pulp::WithSimd for Run<'_, C> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        if self.curve.dimension() == 2 { self.measured::<DVec2>() } else { self.measured::<DVec3>() }
    }
}

impl<C: Curve + ?Sized> Run<'_, C> {
    #[inline(always)]
    fn measured<V: Vector>(self) -> f64 {
        let Run { curve, measure, spans } = self;
        let mut all = if let Measure::Curvature { known } = measure { known } else { 0.0 };
        for span in spans {
            let pieces = curve.pieces(span);
            for piece in 0..pieces {
                if let Measure::Length = measure {
                    all += length_in::<V, C>(curve, span, piece, pieces);
                    continue;
                }
                let moving = curve.motion(span, piece).map(|motion| motion.moving::<V>());
                match (measure, moving) {
                    (Measure::CurvatureSeen, Some(moving)) => all = moving.curvature_seen(all),
                    (Measure::Curvature { .. }, Some(moving)) => all = moving.max_curvature(all),
                    (Measure::Curvature { .. }, None) => {
                        let at = |v: f64| curve.jet(span, (piece as f64 + v) / pieces as f64).curvature(3).abs();
                        all = all.max(searched_curvature(at));
                    }
                    (Measure::CurvatureSeen, None) | (Measure::Length, _) => {}
                }
            }
        }
        all
    }
}

/// Two or three coordinates as a vector, z = 0 for two.
pub(crate) fn vector(coords: &[f64]) -> DVec3 {
    DVec3::new(coords[0], coords[1], coords.get(2).copied().unwrap_or(0.0))
}
