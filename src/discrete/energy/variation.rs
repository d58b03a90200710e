//! Variation of curvature: Σ |(I − T Tᵀ)(K′ − K)|²/ℓ.

use super::curvatures::{ByCurvatures, CurvatureDistance, Curvatures, Matrix, matrix};
use super::{Energy, Facts, Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{dot, scale, subtract};

/// The variation of curvature ∫κ′² + κ²τ² ds as Σ |(I − T Tᵀ)(K′ − K)|²/Δs, in units of 1/length³.
///
/// The sum is over every edge between two interior vertices. K and K′ are the curvature vectors at
/// the edge's ends, and T is its tangent. Next to a prescribed tangent, Δs is replaced by the
/// distance from K to K′. The energy is 0 on polygons inscribed in a circle with equal edges. Its
/// order is 3.
///
/// Without the projection a term κ⁴ would remain, and circles would not be optimal.
///
/// Source: Renka, CAGD 21 (2004).
pub fn variation() -> Energy {
    Variation.into()
}

/// |(I − T Tᵀ)(K′ − K)|²/ℓ, with the [distance](super::curvatures::CurvatureDistance) ℓ from K to
/// K′.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Variation;

impl Facts for Variation {
    fn degree(&self) -> f64 {
        -3.0
    }
}

impl Term<3> for Variation {
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> S {
        self.gradient(window).value
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> Partials<S, D, 3> {
        let [t0, t1, t2] = window.tangent;
        let [s0, s1, s2] = window.length;
        let two = S::of(2.0);
        let (r0, r2) = (two / (s0 + s1), two / (s1 + s2));
        let (k0, k2) = (scale(r0, subtract(t1, t0)), scale(r2, subtract(t2, t1)));
        let c = subtract(k2, k0);
        let along = dot(c, t1);
        let across = subtract(c, scale(along, t1));
        let distance = CurvatureDistance::of(window.length);
        let r1 = distance.inverse;
        let value = dot(across, across) * r1;
        // The derivative with respect to c, and the explicit one with respect to the middle
        // tangent.
        let by_c = scale(two * r1, across);
        let by_t1 = scale(-two * r1 * along, c);
        let slopes = distance.slopes();
        let by_a0 = S::of(0.5) * r0 * dot(by_c, k0);
        let by_a2 = -(S::of(0.5) * r2 * dot(by_c, k2));
        Partials {
            value,
            tangent: [scale(r0, by_c), subtract(by_t1, scale(r0 + r2, by_c)), scale(r2, by_c)],
            length: std::array::from_fn(|k| [by_a0, by_a0 + by_a2, by_a2][k] + value * slopes[k]),
        }
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> SecondPartials<S, D, 3> {
        let curvatures = Curvatures::of(window);
        let t = window.tangent[1];
        let c = subtract(curvatures.vector[1], curvatures.vector[0]);
        let along = dot(c, t);
        let across = subtract(c, scale(along, t));
        let r = curvatures.distance.inverse;
        let factor = S::of(2.0) * r;
        let by_c = scale(factor, across);
        // The derivatives of |c|² − (c·T)², which is |(I − T Tᵀ) c|² for unit tangents.
        let by_cc = matrix(|a, b| factor * (if a == b { S::ONE } else { S::ZERO } - t[a] * t[b]));
        let by_ct = matrix(|a, b| -factor * (t[a] * c[b] + if a == b { along } else { S::ZERO }));
        let by_tt = matrix(|a, b| -factor * c[a] * c[b]);
        let negative = |m: Matrix<S, D>| matrix(|a, b| -m[a][b]);
        let zero = [[S::ZERO; D]; D];
        ByCurvatures {
            value: r * dot(across, across),
            first: [scale(-S::ONE, by_c), by_c, scale(-factor * along, c)],
            second: [[by_cc, negative(by_cc), negative(by_ct)], [zero, by_cc, by_ct], [zero, zero, by_tt]],
        }
        .to_edges(&curvatures)
    }
}
