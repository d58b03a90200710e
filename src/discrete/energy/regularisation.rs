//! The spacing regularisation, which makes the edges between data points equally long.
//!
//! Energies of curves do not change when vertices slide along the curve, so they do not determine
//! the spacing of vertices. The regularisation does. Every shape can have equal edges, so unlike
//! tension it does not change the shape. Reported energies exclude it.
//!
//! It is ½ Σ q² over the vertices that are not data points. By default
//! q = 2c (Δs′ − Δs)/(Δs′ + Δs), which is invariant to scaling. In surfaces and with limits,
//! q = c (Δs′ − Δs), which is unbounded and has a semidefinite Hessian. For energies of order 3 the
//! regularisation is ½ Σ (q′ − q)² over edges, with q = c (Δs′ − Δs), 0 at data points, plus ½ q²
//! at the ends of open curves: their inner product has one derivative more.
//!
//! The factor c is 1 if all spans are alike. It is larger in spans of shorter edges, as the bending
//! stiffness is.

use super::{Partials, Term, Window};
use crate::linalg::Scalar;

/// The term ½ q² with q = 2c (Δs′ − Δs)/(Δs′ + Δs), 0 at a data point.
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

/// The term ½ c² (Δs′ − Δs)², 0 at a data point: in surfaces, with limits, and at the ends of open
/// curves together with [`SmoothRegularisation`].
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
