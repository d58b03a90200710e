//! [`Curve`]: what formats, pictures and comparisons know of a fitted curve, whatever room it came from.

pub(crate) mod convert;
mod even;
mod sampling;
mod unfitted;

use std::ops::Range;

use crate::arclength;
use crate::motion::{Motion, Vector, searched_curvature};
use crate::parallel;
use glam::{DVec2, DVec3};
pub use sampling::Sampling;
pub(crate) use sampling::{check_spacing, spans};
pub(crate) use unfitted::{Input, Polygon};

/// A point of a curve with its derivatives with respect to the curve's own parameter. 2-D curves
/// have z = 0.
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
    /// Curvature |p′ × p″| / |p′|³ in 1/length; for a planar curve signed, positive where it turns
    /// left. 0 where p′ vanishes.
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
/// What is the same for a whole curve is computed when the curve is made: nothing here costs more
/// for a curve of many spans, but what visits all of them.
pub trait Curve: Sync {
    /// 2 or 3.
    fn dimension(&self) -> usize;

    /// Whether the last span leads back to the first point.
    fn is_closed(&self) -> bool;

    /// The parameter of every data point, nondecreasing; a closed curve has one more, where it
    /// meets its first point again.
    fn knots(&self) -> &[f64];

    /// The curve at the fraction `u` (0 … 1) of span `span`, with its derivatives with respect to
    /// the parameter.
    fn jet(&self, span: usize, u: f64) -> Jet;

    /// Whether this is a fitted curve, and not the input polyline of a curve that could not be
    /// fitted.
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

    /// The span that holds the parameter `t`, and the fraction of it; outside the domain its
    /// nearest end.
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

    /// Curvature at parameter `t`, in 1/length; planar curves: signed, positive where they turn
    /// left.
    fn curvature(&self, t: f64) -> f64 {
        let (span, u) = self.locate(t);
        self.jet(span, u).curvature(self.dimension())
    }

    /// Number of smooth pieces of a span, alike in their parameter length: 1, but for curves with
    /// knots of their own between data points. None where the span is a point.
    fn pieces(&self, _span: usize) -> usize {
        1
    }

    /// How the curve moves along a piece of a span, where its velocity is quadratic there: then
    /// lengths and curvatures are known from it.
    fn motion(&self, _span: usize, _piece: usize) -> Option<Motion> {
        None
    }

    /// What derivatives by the parameter are multiplied by on a span to be those by its fraction u:
    /// its parameter length.
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

    /// Arc length, to 1e-9 of itself or better, near cusps too (see [`arclength`]).
    fn length(&self) -> f64 {
        runs(self, Measure::Length).into_iter().sum()
    }

    /// Arc length of a span, as exact.
    #[inline(always)]
    fn span_length(&self, span: usize) -> f64 {
        let pieces = self.pieces(span);
        (0..pieces).map(|piece| piece_length(self, span, piece, pieces)).sum()
    }

    /// The fraction of a span of length `length` before which `target` of it has been covered, to
    /// 1e-9 of the length.
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

    /// Largest |curvature|, in 1/length; infinite where the curve has a cusp.
    ///
    /// Cubic splines, fair curves and Béziers of degree 3 or less: the true maximum, to 1e-9 of
    /// itself, from the roots of the polynomial of its stationary places
    /// ([`Motion::max_curvature`]); next to a cusp, where the speed falls to a part r of its
    /// largest, to 1e-15/r. Smooth connection functions: from their closed form, to rounding.
    /// Béziers of higher degree: tops that are seen at 128 places a piece are followed to 1e-9; a
    /// peak narrower than that may be missed.
    fn max_curvature(&self) -> f64 {
        let known = runs(self, Measure::CurvatureSeen).into_iter().fold(0.0, f64::max);
        runs(self, Measure::Curvature { known }).into_iter().fold(known, f64::max)
    }

    /// Samples that a curve has at least, of the whole or a span: see [`Sampling`].
    fn least(&self, sampling: Sampling) -> usize {
        // With four or more a span there is nothing to ask.
        if !self.is_closed() || matches!(sampling, Sampling::PerSpan(4..)) {
            return 0;
        }
        let ends_differ = |span: &usize| self.jet(*span, 0.0).point != self.jet(*span, 1.0).point;
        let long = (0..self.spans()).filter(ends_differ).take(4).count();
        let all: usize = if (1..3).contains(&long) { 4 } else { 3 };
        match sampling {
            Sampling::PerSpan(_) => all.div_ceil(long.max(1)),
            // Spans between equal points may have parameters of their own: then the middles of the
            // others are needed.
            Sampling::Count(_) if all > 3 => 2 * self.spans(),
            _ => all,
        }
    }

    /// Spans and fractions of the samples, in order along the curve. A curve that was not fitted
    /// gives its data points, whatever is asked.
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
            Sampling::Spacing(spacing) => even::even_sites(self, spacing),
        }
    }

    /// The curve as a chain of cubic Béziers, in few pieces: each from one point of the curve to
    /// another, with its tangents there (G¹), one or more a span. No point of the chain is farther
    /// than `tolerance` (units of the input) from the curve, and no point of the curve from the
    /// chain, rounding aside; a tolerance below [`LEAST_TOLERANCE`](crate::bezier::LEAST_TOLERANCE)
    /// of the largest coordinate is taken to be that. One piece a span, exact, for cubic splines;
    /// none for spans between repeated points. A curve that was not fitted is its polyline, a piece
    /// an edge.
    ///
    /// Each piece starts at the point, bit for bit, where the one before it ends; that of a closed
    /// curve ends where it starts.
    fn beziers(&self, tolerance: f64) -> Vec<[DVec3; 4]> {
        convert::beziers(self, tolerance)
    }
}

/// Arc length of a piece of a span of so many.
#[inline(always)]
fn piece_length<C: Curve + ?Sized>(curve: &C, span: usize, piece: usize, pieces: usize) -> f64 {
    if curve.dimension() == 2 {
        length_in::<DVec2, C>(curve, span, piece, pieces)
    } else {
        length_in::<DVec3, C>(curve, span, piece, pieces)
    }
}

/// The same in the plane or in space.
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
    /// The largest |κ|, where it is above one that is known.
    Curvature {
        known: f64,
    },
}

/// A measure of every run of spans, by all threads, in the order of the curve.
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
