//! The regularisation, which keeps edges between data points equal.
//!
//! It is ½ Σ q² with q = 2c (Δs′ − Δs)/(Δs′ + Δs) at vertices that are no data points, which does not change when
//! the curve is scaled. In surfaces and with limits it is q = c (Δs′ − Δs), which is not bounded and whose Hessian is semidefinite. For energies of order 3 it is ½ Σ (q′ − q)² over edges, with q = c (Δs′ − Δs), and 0 at
//! data points; at the ends of open curves ½ q² is added. That form suits them because their inner product has one
//! derivative more.
//!
//! Energies of curves do not change when vertices slide along the curve, so nothing says where
//! vertices should lie. The regularisation makes edges between data points equal. Every curve can meet it
//! exactly, so unlike tension it does not change the shape. Energies are reported without it.
//!
//! The factor c is 1 where spans are alike. It is larger in spans of shorter edges, as the resistance to bending is.

use super::{Partials, Term, Window};
use crate::linalg::Scalar;

/// The term ½ q² with q = 2c (Δs′ − Δs)/(Δs′ + Δs), which is 0 at a data point.
pub(crate) struct RatioRegularisation;

impl Term<2> for RatioRegularisation {
    const BY_TANGENT: bool = false;

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> S {
        let [s, t] = window.length;
        let q = window.free * (S::of(2.0) * (t - s) / (s + t));
        S::of(0.5) * q * q
    }

    /// ∂q/∂Δs = −4c Δs′/(Δs + Δs′)², ∂q/∂Δs′ = 4c Δs/(Δs + Δs′)²
    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> Partials<S, D, 2> {
        let [s, t] = window.length;
        let inverse = S::ONE / (s + t);
        let q = window.free * (S::of(2.0) * (t - s) * inverse);
        let slope = S::of(4.0) * window.free * q * inverse * inverse;
        Partials { value: S::of(0.5) * q * q, tangent: [[S::ZERO; D]; 2], length: [-(slope * t), slope * s] }
    }

    #[inline(always)]
    fn by_lengths<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> [[S; 2]; 2] {
        let [s, t] = window.length;
        let inverse = S::ONE / (s + t);
        let factor = S::of(4.0) * window.free * inverse * inverse;
        let q = window.free * (S::of(2.0) * (t - s) * inverse);
        let [by_s, by_t] = [-(factor * t), factor * s];
        let bend = factor * q * inverse;
        let mixed = by_s * by_t + bend * (t - s);
        [[by_s * by_s + S::of(2.0) * bend * t, mixed], [mixed, by_t * by_t - S::of(2.0) * bend * s]]
    }
}

/// The term ½ c² (Δs′ − Δs)², which is 0 at a data point: in surfaces, with limits, and at the ends beside [`SmoothRegularisation`].
pub(crate) struct DifferenceRegularisation;

impl Term<2> for DifferenceRegularisation {
    const BY_TANGENT: bool = false;

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> S {
        self.gradient(window).value
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
    fn by_lengths<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> [[S; 2]; 2] {
        let free = window.free * window.free;
        [[free, -free], [-free, free]]
    }
}

/// The term ½ (q′ − q)² over the middle edge, with q = c (Δs′ − Δs) at its ends and 0 at a data
/// point.
pub(crate) struct SmoothRegularisation;

impl Term<3> for SmoothRegularisation {
    const BY_TANGENT: bool = false;

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
    fn by_lengths<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> [[S; 3]; 3] {
        let by_length = [window.free, -(window.free + window.free_after), window.free_after];
        by_length.map(|x| by_length.map(|y| x * y))
    }
}
