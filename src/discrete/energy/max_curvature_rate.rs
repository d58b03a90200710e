//! The limit on the rate of change of curvature.

use std::collections::BTreeMap;

use super::curvatures::CurvatureDistance;
use super::penalty::Quantity;
use super::variation::Variation;
use super::wgsl::literal;
use super::{Facts, Partials, SecondPartials, Term, Window};
use crate::linalg::scalar::scale;
use crate::linalg::{Real, Scalar};
use crate::sort;

/// The quantity q = |(I − T Tᵀ)(K′ − K)|/ℓ at an edge between two interior vertices, in 1/length².
///
/// K and K′ are the curvature vectors at the edge's ends, T is its tangent and ℓ the
/// [distance](CurvatureDistance) from K to K′. q² = V/ℓ for the term V of [`Variation`]. In the plane q
/// is |κ′|, and 0 on arcs of circles.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MaxCurvatureRate;

impl Facts for MaxCurvatureRate {
    fn degree(&self) -> f64 {
        0.0
    }

    fn definitions(&self, epsilon: f64, _: usize) -> BTreeMap<&'static str, String> {
        sort::map([("ROUNDING", literal(epsilon))])
    }
}

impl Quantity<3> for MaxCurvatureRate {
    #[inline(always)]
    fn kind(&self) -> usize {
        3
    }

    /// q and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> Partials<S, D, 3> {
        let v = Variation.gradient(window);
        let distance = CurvatureDistance::of(window.length);
        let slopes = distance.slopes();
        // With the operands in this order, NaN propagates.
        let rounding = S::of(<S::Number as Real>::EPSILON.to_f64());
        let value = rounding.max((v.value * distance.inverse).sqrt());
        let half = S::of(0.5) * distance.inverse / value;
        Partials {
            value,
            tangent: v.tangent.map(|by_tangent| scale(half, by_tangent)),
            length: std::array::from_fn(|k| half * (v.length[k] + v.value * slopes[k])),
        }
    }

    #[inline(always)]
    fn second<S: Scalar, const D: usize>(
        &self,
        window: &Window<S, D, 3>,
        first: &Partials<S, D, 3>,
    ) -> SecondPartials<S, D, 3> {
        let (v, h) = (Variation.gradient(window), Variation.hessian(window));
        let distance = CurvatureDistance::of(window.length);
        let slopes = distance.slopes();
        let inverse = S::ONE / first.value;
        let half = S::of(0.5) * distance.inverse * inverse;
        let mut second = SecondPartials::ZERO;
        for j in 0..3 {
            for k in 0..3 {
                for a in 0..D {
                    for b in 0..D {
                        second.tangents[j][k][a][b] =
                            half * h.tangents[j][k][a][b] - inverse * first.tangent[j][a] * first.tangent[k][b];
                    }
                    second.mixed[j][k][a] = half * (h.mixed[j][k][a] + slopes[k] * v.tangent[j][a])
                        - inverse * first.tangent[j][a] * first.length[k];
                }
                let through = slopes[k] * v.length[j] + slopes[j] * v.length[k];
                let by_lengths = h.lengths[j][k] + through + S::of(2.0) * v.value * slopes[j] * slopes[k];
                second.lengths[j][k] = half * by_lengths - inverse * first.length[j] * first.length[k];
            }
        }
        second
    }
}
