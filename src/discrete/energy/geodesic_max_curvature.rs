//! The limit on the geodesic curvature of curves in surfaces.

use std::collections::BTreeMap;

use super::Facts;
use super::in_surface::{First, InSurface, Parts, Second};
use super::penalty::Penalty;
use super::wgsl::literal;
use crate::linalg::{Real, Scalar};
use crate::sort;

/// The quantity |m|/Δa, the geodesic curvature. It uses the [penalties](super::penalty) of |K|,
/// which it replaces in surfaces.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GeodesicMaxCurvature;

impl Facts for GeodesicMaxCurvature {
    fn degree(&self) -> f64 {
        0.0
    }

    fn definitions(&self, epsilon: f64, _: usize) -> BTreeMap<&'static str, String> {
        sort::map([("ROUNDING", literal(epsilon))])
    }
}

impl GeodesicMaxCurvature {
    /// |m| and |m|/Δa, with |m| at least the rounding of tangents, so that it can be a divisor.
    #[inline(always)]
    fn curvature<S: Scalar>(parts: &Parts<S>) -> (S, S) {
        let rounding = S::of(<S::Number as Real>::EPSILON.to_f64());
        // With the operands in this order, NaN propagates.
        let turn = rounding.max(parts.square.sqrt());
        (turn, turn / parts.measure)
    }
}

impl InSurface for GeodesicMaxCurvature {
    #[inline(always)]
    fn value_of<S: Scalar>(&self, parts: &Parts<S>, penalty: &Penalty<S>) -> S {
        penalty.value(Self::curvature(parts).1)
    }

    #[inline(always)]
    fn first_of<S: Scalar>(&self, parts: &Parts<S>, penalty: &Penalty<S>) -> First<S> {
        let (turn, curvature) = Self::curvature(parts);
        let by_curvature = penalty.stiffness * penalty.beyond(curvature) * penalty.slope;
        First {
            value: penalty.value(curvature),
            across: by_curvature / (turn * parts.measure),
            by_length: S::of(-0.5) * by_curvature * curvature / parts.measure,
        }
    }

    #[inline(always)]
    fn second_of<S: Scalar>(&self, parts: &Parts<S>, penalty: &Penalty<S>) -> Second<S> {
        let (turn, curvature) = Self::curvature(parts);
        let beyond = penalty.beyond(curvature);
        let by_curvature = penalty.stiffness * beyond * penalty.slope;
        let twice = beyond.if_positive(penalty.stiffness * penalty.slope * penalty.slope, S::ZERO);
        let inverse = S::ONE / parts.measure;
        // q = √s/a: 2 q_s = 1/(|m| a), 4 q_ss = −1/(|m|³ a), q_a = −q/a, q_sa = −q_s/a, q_aa = 2
        // q/a².
        let across = inverse / turn;
        let by_measure = -curvature * inverse;
        Second {
            across: by_curvature * across,
            along: twice * across * across - by_curvature * across / (turn * turn),
            mixed: S::of(0.5) * across * (twice * by_measure - by_curvature * inverse),
            by_lengths: S::of(0.25) * (twice * by_measure * by_measure)
                + S::of(0.5) * by_curvature * curvature * inverse * inverse,
        }
    }
}
