//! The curvature vectors at both ends of an edge, and the chain rule from them to tangents and
//! lengths.

use super::{SecondPartials, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};

/// A D × D matrix, row by row.
pub(super) type Matrix<S, const D: usize> = [Vector<S, D>; D];

/// The matrix with these entries.
#[inline(always)]
pub(super) fn matrix<S, const D: usize>(entry: impl Fn(usize, usize) -> S) -> Matrix<S, D> {
    std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
}

/// The distance ℓ = w₋Δs₋ + wΔs + w₊Δs₊ along three edges between two curvature vectors.
///
/// It is the length Δs of the middle edge. If one of the edges is
/// [short](crate::discrete::constrain), the curvature of two edges counts halfway between their
/// midpoints, and ℓ = (Δs₋ + 2Δs + Δs₊)/4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurvatureDistance<S> {
    /// w₋, w, w₊
    share: [S; 3],
    /// 1/ℓ
    pub inverse: S,
}

impl<S: Scalar> CurvatureDistance<S> {
    #[inline(always)]
    pub fn of([s0, s1, s2]: [S; 3]) -> Self {
        let least = -((-s0).max(-s1).max(-s2));
        let is_long = least - S::of(SHORT_EDGE) * (s0 + s1 + s2);
        let choose = |long: f64, short: f64| is_long.if_positive(S::of(long), S::of(short));
        let share = [choose(0.0, 0.25), choose(1.0, 0.5), choose(0.0, 0.25)];
        CurvatureDistance {
            share,
            inverse: S::ONE / is_long.if_positive(s1, S::of(0.25) * (s0 + S::of(2.0) * s1 + s2)),
        }
    }

    /// The derivatives of ln(1/ℓ) with respect to the lengths.
    #[inline(always)]
    pub fn slopes(&self) -> [S; 3] {
        self.share.map(|share| -(share * self.inverse))
    }
}

/// An edge is short if it is below this fraction of the total length of itself and its neighbours.
pub(crate) const SHORT_EDGE: f64 = 1e-4;

/// The curvature vectors K = r (T − T₋) and K′ = r′ (T₊ − T) at the ends of the middle edge.
///
/// The factors are r = 2/(Δs₋ + Δs) and r′ = 2/(Δs + Δs₊).
#[derive(Clone, Copy, Debug)]
pub(super) struct Curvatures<S, const D: usize> {
    /// r and r′
    pub rate: [S; 2],
    /// K and K′
    pub vector: [Vector<S, D>; 2],
    pub distance: CurvatureDistance<S>,
}

impl<S: Scalar, const D: usize> Curvatures<S, D> {
    #[inline(always)]
    pub fn of(window: &Window<S, D, 3>) -> Self {
        let ([t0, t1, t2], [s0, s1, s2]) = (window.tangent, window.length);
        let two = S::of(2.0);
        let rate = [two / (s0 + s1), two / (s1 + s2)];
        let distance = CurvatureDistance::of(window.length);
        Curvatures { rate, distance, vector: [scale(rate[0], subtract(t1, t0)), scale(rate[1], subtract(t2, t1))] }
    }
}

/// The derivatives of a term V = f(K, K′, T)/ℓ.
pub(super) struct ByCurvatures<S, const D: usize> {
    pub value: S,
    /// First derivatives with respect to K, K′ and T.
    pub first: [Vector<S, D>; 3],
    /// Second derivatives with respect to pairs of K, K′ and T.
    ///
    /// Only entries `[y][z]` with y ≤ z are read.
    pub second: [[Matrix<S, D>; 3]; 3],
}

impl<S: Scalar, const D: usize> ByCurvatures<S, D> {
    /// The second partial derivatives with respect to tangents and lengths.
    ///
    /// With K = r d and d = T − T₋:
    ///
    /// - ∂K = r ∂d − ½ r K ∂(Δs₋ + Δs)
    /// - ∂²K = −r² ∂d ∂(Δs₋ + Δs) + ½ r² K (∂(Δs₋ + Δs))²
    #[inline(always)]
    pub fn to_edges(&self, curvatures: &Curvatures<S, D>) -> SecondPartials<S, D, 3> {
        let half = S::of(0.5);
        let ([r0, r2], [k0, k2]) = (curvatures.rate, curvatures.vector);
        // The factor of each tangent in the differentials of K, K′ and T.
        let by_tangent = [[-r0, r0, S::ZERO], [S::ZERO, -r2, r2], [S::ZERO, S::ONE, S::ZERO]];
        // The derivatives of K and K′ with respect to the lengths of their two edges.
        let by_length = [scale(-half * r0, k0), scale(-half * r2, k2)];
        let entry = |y: usize, z: usize, a: usize, b: usize| {
            if y <= z { self.second[y][z][a][b] } else { self.second[z][y][b][a] }
        };
        let times = |y: usize, z: usize, x: Vector<S, D>| -> Vector<S, D> {
            std::array::from_fn(|a| dot(std::array::from_fn(|b| entry(y, z, a, b)), x))
        };
        // Second derivatives with respect to K, K′ or T and a length, through K, K′ and ℓ.
        let slopes = curvatures.distance.slopes();
        let by_lengths: [[Vector<S, D>; 3]; 3] = std::array::from_fn(|y| {
            let (before, after) = (times(y, 0, by_length[0]), times(y, 1, by_length[1]));
            let through = [before, add(before, after), after];
            std::array::from_fn(|k| add(through[k], scale(slopes[k], self.first[y])))
        });
        let mut second = SecondPartials::<S, D, 3>::ZERO;
        for j in 0..3 {
            for k in 0..3 {
                for (y, z) in (0..3).flat_map(|y| (0..3).map(move |z| (y, z))) {
                    if touches(y, j) && touches(z, k) {
                        let factor = by_tangent[y][j] * by_tangent[z][k];
                        for a in 0..D {
                            for b in 0..D {
                                second.tangents[j][k][a][b] += factor * entry(y, z, a, b);
                            }
                        }
                    }
                }
                for y in 0..3 {
                    if touches(y, j) {
                        second.mixed[j][k] = add(second.mixed[j][k], scale(by_tangent[y][j], by_lengths[y][k]));
                    }
                }
                for end in 0..2 {
                    let r = curvatures.rate[end];
                    if touches(end, j) && touches(end, k) {
                        let factor = -half * r * by_tangent[end][j];
                        second.mixed[j][k] = add(second.mixed[j][k], scale(factor, self.first[end]));
                        second.lengths[j][k] += half * r * r * dot(curvatures.vector[end], self.first[end]);
                    }
                    if touches(end, j) {
                        second.lengths[j][k] += dot(by_length[end], by_lengths[end][k]);
                    }
                }
                // ∂V/∂Δs of edge j holds V times the slope of ln(1/ℓ). This differentiates it by Δs
                // of edge k.
                for (end, by_length) in by_length.into_iter().enumerate() {
                    if touches(end, k) {
                        second.lengths[j][k] += slopes[j] * dot(by_length, self.first[end]);
                    }
                }
                second.lengths[j][k] += S::of(2.0) * self.value * slopes[j] * slopes[k];
            }
        }
        second
    }
}

/// Whether K (y = 0), K′ (1) or T (2) depends on this edge of the three.
const fn touches(y: usize, edge: usize) -> bool {
    match y {
        0 => edge < 2,
        1 => edge > 0,
        _ => edge == 1,
    }
}
