//! The limit on the sign of curvature: a planar curve turns to one side only.

use super::penalty::Quantity;
use super::{Facts, Partials, SecondPartials, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::scale;

/// The quantity κ = (T × T′)/Δa, with Δa = (Δs + Δs′)/2. It is positive where the curve turns left.
///
/// β < 0 makes the curve turn left, β > 0 right. In space the quantity is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CurvatureSign;

impl Facts for CurvatureSign {
    fn degree(&self) -> f64 {
        0.0
    }
}

impl Quantity<2> for CurvatureSign {
    #[inline(always)]
    fn kind(&self) -> usize {
        1
    }

    /// κ and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> Partials<S, D, 2> {
        let (mut value, mut tangent) = (S::ZERO, [[S::ZERO; D]; 2]);
        let r = S::of(2.0) / (window.length[0] + window.length[1]);
        if D == 2 {
            let [t, u] = window.tangent;
            value = r * (t[0] * u[1] - t[1] * u[0]);
            (tangent[0][0], tangent[0][1]) = (r * u[1], -(r * u[0]));
            (tangent[1][0], tangent[1][1]) = (-(r * t[1]), r * t[0]);
        }
        let by_length = S::of(-0.5) * r * value;
        Partials { value, tangent, length: [by_length, by_length] }
    }

    #[inline(always)]
    fn second<S: Scalar, const D: usize>(
        &self,
        window: &Window<S, D, 2>,
        first: &Partials<S, D, 2>,
    ) -> SecondPartials<S, D, 2> {
        let r = S::of(2.0) / (window.length[0] + window.length[1]);
        let mut second = SecondPartials::ZERO;
        if D == 2 {
            (second.tangents[0][1][0][1], second.tangents[0][1][1][0]) = (r, -r);
            (second.tangents[1][0][1][0], second.tangents[1][0][0][1]) = (r, -r);
        }
        for j in 0..2 {
            for k in 0..2 {
                second.mixed[j][k] = scale(S::of(-0.5) * r, first.tangent[j]);
                second.lengths[j][k] = S::of(0.5) * r * r * first.value;
            }
        }
        second
    }
}
