//! Length: φ = Σ Δs.

use super::{Energy, Facts, Partials, Term, Window};
use crate::linalg::Scalar;

/// The length φ(f) = Σ Δs, in units of length.
///
/// Its gradient at a vertex is T − T′. Its order is 1.
///
/// Source: Renka (2006), equation (10).
pub fn length() -> Energy {
    Length.into()
}

/// Δs
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Length;

impl Facts for Length {
    fn degree(&self) -> f64 {
        1.0
    }

    fn stiffness(&self, _: f64) -> f64 {
        1.0
    }

    fn bounds_length(&self) -> bool {
        true
    }
}

impl Term<1> for Length {
    const BY_TANGENT: bool = false;

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> S {
        window.length[0]
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> Partials<S, D, 1> {
        Partials { value: window.length[0], tangent: [[S::ZERO; D]], length: [S::ONE] }
    }
}
