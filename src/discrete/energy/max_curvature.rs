//! The limit on the curvature.

use std::collections::BTreeMap;

use super::penalty::Quantity;
use super::wgsl::literal;
use super::{Facts, Partials, SecondPartials, Window};
use crate::linalg::scalar::{dot, scale, subtract};
use crate::linalg::{Real, Scalar};
use crate::sort;

/// The quantity |K| = |T′ − T|/Δa, with Δa = (Δs + Δs′)/2.
///
/// A largest curvature κ has β = 1/κ. A regular polygon inscribed in a circle of radius R has
/// |K| = 1/R.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MaxCurvature;

impl Facts for MaxCurvature {
    fn degree(&self) -> f64 {
        0.0
    }

    fn definitions(&self, epsilon: f64, _: usize) -> BTreeMap<&'static str, String> {
        sort::map([("ROUNDING", literal(epsilon))])
    }
}

/// |T′ − T|, at least the rounding of tangents, so that it can be a divisor.
#[inline(always)]
fn turn<S: Scalar, const D: usize>(window: &Window<S, D, 2>) -> S {
    let d = subtract(window.tangent[1], window.tangent[0]);
    let rounding = S::of(<S::Number as Real>::EPSILON.to_f64());
    // With the operands in this order, NaN propagates.
    rounding.max(dot(d, d).sqrt())
}

impl Quantity<2> for MaxCurvature {
    #[inline(always)]
    fn kind(&self) -> usize {
        0
    }

    /// |K| and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> Partials<S, D, 2> {
        let a = S::of(0.5) * (window.length[0] + window.length[1]);
        let turn = turn(window);
        let value = turn / a;
        let by_tangent = scale(S::ONE / (turn * a), subtract(window.tangent[1], window.tangent[0]));
        let by_length = S::of(-0.5) * value / a;
        Partials { value, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [by_length, by_length] }
    }

    #[inline(always)]
    fn second<S: Scalar, const D: usize>(
        &self,
        window: &Window<S, D, 2>,
        first: &Partials<S, D, 2>,
    ) -> SecondPartials<S, D, 2> {
        let a = S::of(0.5) * (window.length[0] + window.length[1]);
        let across = S::ONE / (turn(window) * a);
        let by_lengths = S::of(0.5) * first.value / (a * a);
        let mut second = SecondPartials::ZERO;
        for j in 0..2 {
            for k in 0..2 {
                let sign = if j == k { S::ONE } else { -S::ONE };
                // (I − e eᵀ)/(|d| a) with e = d/|d|, where ∂q/∂T′ = e/a.
                for c in 0..D {
                    second.tangents[j][k][c] = scale(-(sign * across * a * a * first.tangent[1][c]), first.tangent[1]);
                    second.tangents[j][k][c][c] += sign * across;
                }
                second.mixed[j][k] = scale(S::of(-0.5) / a, first.tangent[j]);
                second.lengths[j][k] = by_lengths;
            }
        }
        second
    }
}
