//! Lengths and curvatures of curves of any type.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::{Curve, Jet, Sampling};
use crate::linalg::{self, Operation};
use crate::motion::{Motion, Vector, searched_curvature};
use crate::surface::Globe;
use crate::{arclength, parallel};

/// [`AnyCurve`], with these methods of [`Curve`].
macro_rules! any_curve {
    ($(fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        /// A curve of any type.
        ///
        /// Code that measures, samples and converts curves takes `&dyn AnyCurve` and is compiled
        /// once. Methods of [`Curve`] pass `&self`, since `Self` may be unsized.
        pub(crate) trait AnyCurve: Sync {
            /// This curve as a trait object.
            fn any(&self) -> &dyn AnyCurve;
            $(fn $name(&self, $($argument: $type),*) -> $result;)*
        }

        impl<C: Curve + ?Sized> AnyCurve for &C {
            fn any(&self) -> &dyn AnyCurve {
                self
            }

            $(#[inline(always)]
            fn $name(&self, $($argument: $type),*) -> $result {
                C::$name(self, $($argument),*)
            })*
        }
    };
}

any_curve! {
    fn dimension() -> usize;
    fn is_closed() -> bool;
    fn is_fitted() -> bool;
    fn globe() -> Option<Globe>;
    fn domain() -> (f64, f64);
    fn spans() -> usize;
    fn locate(t: f64) -> (usize, f64);
    fn pieces(span: usize) -> usize;
    fn motion(span: usize, piece: usize) -> Option<Motion>;
    fn jet(span: usize, u: f64) -> Jet;
    fn pace(span: usize) -> f64;
    fn speed(span: usize, u: f64) -> f64;
    fn span_length(span: usize) -> f64;
    fn fraction_at(span: usize, length: f64, target: f64) -> f64;
    fn least(sampling: Sampling) -> usize;
    fn is_fixed(span: usize) -> bool;
}

/// Spans per task.
const RUN: usize = 4096;

/// Methods of [`Curve`] that measure a type of curves with its motions inlined.
///
/// They are for types that are measured by the thousand. Other types are measured as `dyn
/// AnyCurve`.
macro_rules! inlined_measures {
    () => {
        fn length(&self) -> f64 {
            $crate::curve::measure::length(&self)
        }

        fn span_length(&self, span: usize) -> f64 {
            $crate::curve::measure::span_length(&self, span)
        }

        fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
            $crate::curve::measure::fraction_at(&self, span, length, target)
        }

        fn max_curvature(&self) -> f64 {
            $crate::curve::measure::max_curvature(&self)
        }
    };
}

pub(crate) use inlined_measures;

/// See [`Curve::length`].
pub(crate) fn length<C: AnyCurve + ?Sized>(curve: &C) -> f64 {
    runs(curve, Measure::Length).into_iter().sum()
}

/// See [`Curve::max_curvature`].
pub(crate) fn max_curvature<C: AnyCurve + ?Sized>(curve: &C) -> f64 {
    let known = runs(curve, Measure::CurvatureSeen).into_iter().fold(0.0, f64::max);
    runs(curve, Measure::Curvature { known }).into_iter().fold(known, f64::max)
}

/// See [`Curve::span_length`].
pub(crate) fn span_length<C: AnyCurve + ?Sized>(curve: &C, span: usize) -> f64 {
    let pieces = curve.pieces(span);
    (0..pieces).map(|piece| piece_length(curve, span, piece, pieces)).sum()
}

/// See [`Curve::fraction_at`].
pub(crate) fn fraction_at<C: AnyCurve + ?Sized>(curve: &C, span: usize, length: f64, target: f64) -> f64 {
    let pieces = curve.pieces(span);
    if target >= length || pieces == 0 {
        return if target > 0.0 { 1.0 } else { 0.0 };
    }
    let (mut before, mut piece, mut own) = (0.0, 0, piece_length(curve, span, 0, pieces));
    while piece + 1 < pieces && before + own <= target {
        before += own;
        piece += 1;
        own = piece_length(curve, span, piece, pieces);
    }
    let target = (target - before).clamp(0.0, own);
    if own == 0.0 || target == 0.0 {
        return piece as f64 / pieces as f64;
    }
    let v = match curve.motion(span, piece) {
        Some(motion) => motion.fraction_at(own, target),
        None => fraction_by_speed(curve.any(), [span, piece, pieces], own, target),
    };
    (piece as f64 + v) / pieces as f64
}

/// Arc length of one piece of a span that has `pieces` of them.
#[inline(always)]
fn piece_length<C: AnyCurve + ?Sized>(curve: &C, span: usize, piece: usize, pieces: usize) -> f64 {
    match curve.motion(span, piece) {
        Some(motion) if curve.dimension() == 2 => motion.moving::<DVec2>().length(),
        Some(motion) => motion.length(),
        None => length_by_speed(curve.any(), [span, piece, pieces]),
    }
}

/// |dp/dv| at the fraction `v` of a piece: its span, its number there, and the number of pieces.
fn piece_speed(curve: &dyn AnyCurve, [span, piece, pieces]: [usize; 3], v: f64) -> f64 {
    let pieces = pieces as f64;
    curve.speed(span, (piece as f64 + v) / pieces) / pieces
}

/// Arc length of a piece without a motion.
#[inline(never)]
fn length_by_speed(curve: &dyn AnyCurve, piece: [usize; 3]) -> f64 {
    arclength::span_length(|v| piece_speed(curve, piece, v))
}

/// The fraction of a piece without a motion at which the arc length from its start is `target`.
#[inline(never)]
fn fraction_by_speed(curve: &dyn AnyCurve, piece: [usize; 3], length: f64, target: f64) -> f64 {
    arclength::fraction_at(|v| piece_speed(curve, piece, v), length, target)
}

/// Largest |κ| of a piece without a motion.
#[inline(never)]
fn curvature_by_jets(curve: &dyn AnyCurve, [span, piece, pieces]: [usize; 3]) -> f64 {
    let globe = curve.globe();
    searched_curvature(|v| {
        let jet = curve.jet(span, (piece as f64 + v) / pieces as f64);
        globe.map_or_else(|| jet.curvature(3), |globe| globe.curvature_in_space(jet.point, jet.first, jet.second)).abs()
    })
}

/// A curve whose lengths are measured by its speed, without its motions.
pub(crate) struct BySpeed<'a>(pub &'a dyn Curve);

impl Curve for BySpeed<'_> {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn is_closed(&self) -> bool {
        self.0.is_closed()
    }

    fn knots(&self) -> &[f64] {
        self.0.knots()
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        self.0.jet(span, u)
    }

    fn globe(&self) -> Option<Globe> {
        self.0.globe()
    }

    fn pace(&self, span: usize) -> f64 {
        self.0.pace(span)
    }

    fn pieces(&self, span: usize) -> usize {
        self.0.pieces(span)
    }
}

/// A measurement of a curve.
#[derive(Clone, Copy)]
enum Measure {
    Length,
    /// The largest |κ| at both ends and in the middle of every piece.
    CurvatureSeen,
    /// The largest |κ|, if it exceeds a known one.
    Curvature {
        known: f64,
    },
}

/// Measures the runs of spans on all threads, in order.
fn runs<C: AnyCurve + ?Sized>(curve: &C, measure: Measure) -> Vec<f64> {
    in_runs(curve.spans(), &|spans| {
        linalg::with_wide_registers(Run { curve, measure, spans })
            .unwrap_or_else(|Run { spans, .. }| in_narrow_registers(Run { curve: curve.any(), measure, spans }))
    })
}

fn in_runs(spans: usize, run: &(dyn Fn(Range<usize>) -> f64 + Sync)) -> Vec<f64> {
    let run = |k: usize| run(k * RUN..spans.min((k + 1) * RUN));
    match spans.div_ceil(RUN) {
        1 => vec![run(0)],
        count => parallel::map(count, 1, run),
    }
}

#[inline(never)]
fn in_narrow_registers(run: Run<dyn AnyCurve + '_>) -> f64 {
    run.run()
}

/// A run of spans.
struct Run<'a, C: ?Sized> {
    curve: &'a C,
    measure: Measure,
    spans: Range<usize>,
}

impl<C: AnyCurve + ?Sized> Operation for Run<'_, C> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        if self.curve.dimension() == 2 { self.measured_in::<DVec2>() } else { self.measured_in::<DVec3>() }
    }
}

impl<C: AnyCurve + ?Sized> Run<'_, C> {
    #[inline(always)]
    fn measured_in<V: Vector>(self) -> f64 {
        let Run { curve, measure, spans } = self;
        let mut all = if let Measure::Curvature { known } = measure { known } else { 0.0 };
        for span in spans {
            let pieces = curve.pieces(span);
            for piece in 0..pieces {
                let moving = curve.motion(span, piece).map(|motion| motion.moving::<V>());
                match (measure, moving) {
                    (Measure::Length, Some(moving)) => all += moving.length(),
                    (Measure::Length, None) => all += length_by_speed(curve.any(), [span, piece, pieces]),
                    (Measure::CurvatureSeen, Some(moving)) => all = moving.curvature_seen(all),
                    (Measure::CurvatureSeen, None) => {}
                    (Measure::Curvature { .. }, Some(moving)) => all = moving.max_curvature(all),
                    (Measure::Curvature { .. }, None) => {
                        all = all.max(curvature_by_jets(curve.any(), [span, piece, pieces]));
                    }
                }
            }
        }
        all
    }
}
