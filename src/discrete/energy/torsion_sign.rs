//! The limit on the sign of torsion: a spatial curve twists to one side only.

// Loops over coordinates by index match the formulas.
#![allow(clippy::needless_range_loop)]

use super::penalty::Quantity;
use super::{Facts, Partials, SecondPartials, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::dot;

/// The quantity t = det(T, T′, T″), the volume of three consecutive tangents.
///
/// It has the sign of the torsion: κ²τh³ for edges of length h. β < 0 makes the curve twist as a
/// right-handed screw, β > 0 as a left-handed one. In the plane the quantity is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TorsionSign;

impl Facts for TorsionSign {
    fn degree(&self) -> f64 {
        0.0
    }
}

/// a × b
#[inline(always)]
fn across<S: Scalar, const D: usize>(a: [S; D], b: [S; D]) -> [S; D] {
    let mut out = [S::ZERO; D];
    if D == 3 {
        for c in 0..D {
            let (d, e) = ((c + 1) % D, (c + 2) % D);
            out[c] = a[d] * b[e] - a[e] * b[d];
        }
    }
    out
}

impl Quantity<3> for TorsionSign {
    #[inline(always)]
    fn kind(&self) -> usize {
        2
    }

    /// t and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> Partials<S, D, 3> {
        let [t, u, v] = window.tangent;
        let by_first = across(u, v);
        Partials { value: dot(t, by_first), tangent: [by_first, across(v, t), across(t, u)], length: [S::ZERO; 3] }
    }

    #[inline(always)]
    fn second<S: Scalar, const D: usize>(
        &self,
        window: &Window<S, D, 3>,
        _: &Partials<S, D, 3>,
    ) -> SecondPartials<S, D, 3> {
        let mut second = SecondPartials::ZERO;
        if D == 3 {
            for j in 0..3 {
                // ∂²t/∂T_j∂T_{j+1} maps x to x × T_{j+2}, and its transpose maps x to T_{j+2} × x.
                let (k, third) = ((j + 1) % 3, window.tangent[(j + 2) % 3]);
                for a in 0..D {
                    let (b, c) = ((a + 1) % D, (a + 2) % D);
                    second.tangents[j][k][a][b] = third[c];
                    second.tangents[j][k][b][a] = -third[c];
                    second.tangents[k][j][b][a] = third[c];
                    second.tangents[k][j][a][b] = -third[c];
                }
            }
        }
        second
    }
}
