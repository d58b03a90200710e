//! Tension: ψ = ½ m Σ Δs².

use super::{Energy, Facts, Partials, Term, Window};
use crate::linalg::Scalar;

/// The tension ψ(f) = ½ m Σ Δs² for m edges, in units of length².
///
/// It is half the squared length if all edges are equal. It is quadratic, discourages loops and
/// spaces vertices evenly. Its order is 1.
///
/// Source: Renka (2006), equation (11), with the constant 1/Δt = m that the paper drops.
pub fn tension() -> Energy {
    Tension.into()
}

/// ½ m Δs²
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tension;

impl Facts for Tension {
    fn degree(&self) -> f64 {
        2.0
    }

    fn stiffness(&self, length: f64) -> f64 {
        length
    }

    fn bounds_length(&self) -> bool {
        true
    }
}

impl Term<1> for Tension {
    const BY_TANGENT: bool = false;

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> S {
        S::of(0.5) * window.segments * window.length[0] * window.length[0]
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> Partials<S, D, 1> {
        let by_length = window.segments * window.length[0];
        Partials { value: S::of(0.5) * by_length * window.length[0], tangent: [[S::ZERO; D]], length: [by_length] }
    }

    #[inline(always)]
    fn by_lengths<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> [[S; 1]; 1] {
        [[window.segments]]
    }
}
