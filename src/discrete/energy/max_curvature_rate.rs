//! The limit on the rate of change of curvature.

use super::curvatures::CurvatureDistance;
use super::penalty::Quantity;
use super::variation::Variation;
use super::{Facts, Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{add, scale};

/// The quantity q² = |(I − T Tᵀ)(K′ − K)|²/ℓ² at an edge between two interior vertices, in 1/length⁴.
///
/// K and K′ are the curvature vectors at the edge's ends, T is its tangent and ℓ the
/// [distance](CurvatureDistance) from K to K′. In the plane q is |κ′|, and 0 on arcs of circles. A largest
/// rate R has β = 1/R². The square is smooth where q is 0. It is V/ℓ for the term V of [`Variation`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MaxCurvatureRate;

impl Facts for MaxCurvatureRate {
    fn degree(&self) -> f64 {
        0.0
    }
}

impl Quantity<3> for MaxCurvatureRate {
    #[inline(always)]
    fn kind(&self) -> usize {
        3
    }

    /// q² and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> Partials<S, D, 3> {
        let v = Variation.gradient(window);
        let distance = CurvatureDistance::of(window.length);
        let (inverse, slopes) = (distance.inverse, distance.slopes());
        Partials {
            value: inverse * v.value,
            tangent: v.tangent.map(|by_tangent| scale(inverse, by_tangent)),
            length: std::array::from_fn(|k| inverse * (v.length[k] + v.value * slopes[k])),
        }
    }

    #[inline(always)]
    fn second<S: Scalar, const D: usize>(
        &self,
        window: &Window<S, D, 3>,
        _: &Partials<S, D, 3>,
    ) -> SecondPartials<S, D, 3> {
        let (v, h) = (Variation.gradient(window), Variation.hessian(window));
        let distance = CurvatureDistance::of(window.length);
        let (inverse, slopes) = (distance.inverse, distance.slopes());
        let mut second = SecondPartials::ZERO;
        for j in 0..3 {
            for k in 0..3 {
                second.tangents[j][k] = h.tangents[j][k].map(|row| scale(inverse, row));
                second.mixed[j][k] = scale(inverse, add(h.mixed[j][k], scale(slopes[k], v.tangent[j])));
                let through = slopes[k] * v.length[j] + slopes[j] * v.length[k];
                let twice = S::of(2.0) * v.value * slopes[j] * slopes[k];
                second.lengths[j][k] = inverse * (h.lengths[j][k] + through + twice);
            }
        }
        second
    }
}
