//! A toy energy, Σ |T′ − T|² Δs Δs′, for tests only.
//!
//! It follows the recipe in CONTRIBUTING.md.

use super::{Energy, Facts, Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{dot, scale, subtract};

/// The toy energy Σ |T′ − T|² Δs Δs′, in units of length².
///
/// Its order is 2.
pub fn toy() -> Energy {
    Toy.into()
}

/// |T′ − T|² Δs Δs′
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Toy;

impl Facts for Toy {
    fn degree(&self) -> f64 {
        2.0
    }
}

impl Term<2> for Toy {
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> S {
        let d = subtract(window.tangent[1], window.tangent[0]);
        dot(d, d) * window.length[0] * window.length[1]
    }

    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> Partials<S, D, 2> {
        let d = subtract(window.tangent[1], window.tangent[0]);
        let ([s0, s1], q) = (window.length, dot(d, d));
        let by_tangent = scale(S::of(2.0) * s0 * s1, d);
        Partials { value: q * s0 * s1, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [q * s1, q * s0] }
    }

    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> SecondPartials<S, D, 2> {
        let d = subtract(window.tangent[1], window.tangent[0]);
        let ([s0, s1], two) = (window.length, S::of(2.0));
        let mut second = SecondPartials::ZERO;
        for (j, k, sign) in [(0, 0, S::ONE), (0, 1, -S::ONE), (1, 0, -S::ONE), (1, 1, S::ONE)] {
            (0..D).for_each(|c| second.tangents[j][k][c][c] = sign * two * s0 * s1);
        }
        for (k, other) in [s1, s0].into_iter().enumerate() {
            second.mixed[1][k] = scale(two * other, d);
            second.mixed[0][k] = scale(-two * other, d);
            second.lengths[k][1 - k] = dot(d, d);
        }
        second
    }
}
