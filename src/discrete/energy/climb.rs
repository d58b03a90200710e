//! The limit on the slope of a spatial curve.

use super::penalty::Quantity;
use super::{Facts, Partials, Window};
use crate::linalg::Scalar;

/// The quantity |T_z| of an edge: the sine of its angle to the xy-plane. In the plane it is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Climb;

impl Facts for Climb {
    fn degree(&self) -> f64 {
        0.0
    }
}

impl Quantity<1> for Climb {
    #[inline(always)]
    fn kind(&self) -> usize {
        4
    }

    /// |T_z| and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> Partials<S, D, 1> {
        let (mut value, mut up) = (S::ZERO, [S::ZERO; D]);
        if D == 3 {
            let along = window.tangent[0][2];
            up[2] = along.if_positive(S::ONE, -S::ONE);
            value = up[2] * along;
        }
        Partials { value, tangent: [up], length: [S::ZERO] }
    }
}
