//! The gauge: ½ Σ q² with q = c (Δs′ − Δs) at vertices that are no data points, or ½ Σ (q′ − q)²
//! over edges.
//!
//! The second form suits energies of order 3, whose inner product has one derivative more; q is 0
//! at data points.
//!
//! Energies of curves do not change when vertices slide along the curve, so nothing says where they
//! should lie. The gauge does: edges between data points become equal. Every curve can meet it
//! exactly, so that it takes nothing from the shape, as tension does; energies are reported without
//! it. What a difference counts by, c, is 1 where spans are alike; in spans of shorter edges it is
//! more, as resistance to bending is.

use super::{Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;

/// ½ c² (Δs′ − Δs)², 0 at a data point.
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
            length: [-(window.free * difference), window.free * difference],
        }
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> SecondPartials<S, D, 2> {
        let free = window.free * window.free;
        SecondPartials { lengths: [[free, -free], [-free, free]], ..SecondPartials::ZERO }
    }
}

/// ½ (q′ − q)² with q = Δs′ − Δs at both ends of the middle edge, 0 at a data point.
pub(crate) struct SmoothGauge;

impl Term<3> for SmoothGauge {
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> S {
        self.gradient(window).value
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> Partials<S, D, 3> {
        let (before, after) = (window.free, window.free_after);
        let [s0, s1, s2] = window.length;
        let difference = after * (s2 - s1) - before * (s1 - s0);
        Partials {
            value: S::of(0.5) * difference * difference,
            tangent: [[S::ZERO; D]; 3],
            length: [before * difference, -((after + before) * difference), after * difference],
        }
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> SecondPartials<S, D, 3> {
        let by_length = [window.free, -(window.free + window.free_after), window.free_after];
        let lengths = by_length.map(|x| by_length.map(|y| x * y));
        SecondPartials { lengths, ..SecondPartials::ZERO }
    }
}
