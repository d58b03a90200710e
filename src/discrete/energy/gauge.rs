//! The gauge: ½ Σ (Δs′ − Δs)² over vertices that are no data points.
//!
//! Energies of curves do not change when vertices slide along the curve, so nothing says where they should lie. The gauge
//! does: edges between data points become equal. Every curve can meet it exactly, so that it takes nothing from the
//! shape, as tension does; energies are reported without it.

use super::{Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;

/// ½ (Δs′ − Δs)², 0 at a data point.
pub(crate) struct Gauge;

impl Term<2> for Gauge {
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> S {
        let difference = window.free * (window.length[1] - window.length[0]);
        S::of(0.5) * difference * difference
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> Partials<S, D, 2> {
        let difference = window.free * (window.length[1] - window.length[0]);
        Partials {
            value: S::of(0.5) * difference * difference,
            tangent: [[S::ZERO; D]; 2],
            length: [-difference, difference],
        }
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> SecondPartials<S, D, 2> {
        let free = window.free;
        SecondPartials { lengths: [[free, -free], [-free, free]], ..SecondPartials::ZERO }
    }
}
