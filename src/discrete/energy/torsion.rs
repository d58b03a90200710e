//! Torsion: Σ det(T, K̄, C)²/(|K̄|² + ε²) Δs.

use super::curvatures::{ByCurvatures, Curvatures, Matrix, matrix};
use super::{Energy, Facts, Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};

/// ε of [`torsion`] times the curve's size: a curvature of 10⁻³ over the size.
/// Not in the kernel: the host passes ε for each curve.
pub const TORSION_CURVATURE: f64 = 1e-3;

/// The torsion energy ∫κ²τ² ds as Σ det(T, K̄, C)²/(|K̄|² + ε²) Δs, in units of 1/length³.
///
/// The sum is over every edge between two interior vertices, with tangent T and length Δs. K and K′
/// are the curvature vectors at the ends of the edge, and C = (K′ − K)/Δs. K̄ is the mean of K and
/// K′ without its component along T. Its order is 3. It is 0 in 2-D.
///
/// The curvature ε is [`TORSION_CURVATURE`] over the curve's size. It keeps the energy finite at
/// inflections, where curvature vanishes and torsion is undefined.
pub fn torsion() -> Energy {
    Torsion.into()
}

/// δ²/(n ℓ), with δ = T·(K × K′) = ℓ det(T, K̄, C), n = |K̄|² + ε², and the
/// [distance](super::curvatures::CurvatureDistance) ℓ from K to K′.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Torsion;

impl Facts for Torsion {
    fn degree(&self) -> f64 {
        -3.0
    }
}

/// The parts of the term and its derivatives.
struct Parts<S, const D: usize> {
    /// K × K′
    cross: Vector<S, D>,
    /// δ
    delta: S,
    /// The mean of K and K′, its component along T, and K̄.
    mean: Vector<S, D>,
    along: S,
    bar: Vector<S, D>,
    /// 1/n and 1/ℓ
    by_n: S,
    by_s: S,
}

impl<S: Scalar, const D: usize> Parts<S, D> {
    #[inline(always)]
    fn of(window: &Window<S, D, 3>, curvatures: &Curvatures<S, D>) -> Self {
        let ([k0, k2], t) = (curvatures.vector, window.tangent[1]);
        let cross = cross(k0, k2);
        let mean = scale(S::of(0.5), add(k0, k2));
        let along = dot(mean, t);
        let bar = subtract(mean, scale(along, t));
        let by_n = S::ONE / (dot(bar, bar) + window.torsion_curvature * window.torsion_curvature);
        Parts { cross, delta: dot(t, cross), mean, along, bar, by_n, by_s: curvatures.distance.inverse }
    }

    #[inline(always)]
    fn value(&self) -> S {
        self.delta * self.delta * self.by_n * self.by_s
    }

    /// The derivatives of δ with respect to K, K′ and T.
    #[inline(always)]
    fn delta_first(&self, [k0, k2]: [Vector<S, D>; 2], t: Vector<S, D>) -> [Vector<S, D>; 3] {
        [cross(k2, t), cross(t, k0), self.cross]
    }

    /// The derivatives of n with respect to K, K′ and T. For unit tangents
    /// n = |mean|² − (mean·T)² + ε².
    #[inline(always)]
    fn n_first(&self) -> [Vector<S, D>; 3] {
        [self.bar, self.bar, scale(-S::of(2.0) * self.along, self.mean)]
    }

    /// The derivatives of the term with respect to K, K′ and T: 2 δ/(n ℓ) ∂δ − V/n ∂n.
    #[inline(always)]
    fn first(&self, delta: &[Vector<S, D>; 3], n: &[Vector<S, D>; 3]) -> [Vector<S, D>; 3] {
        let (by_delta, by_n) = (S::of(2.0) * self.delta * self.by_n * self.by_s, self.value() * self.by_n);
        std::array::from_fn(|y| subtract(scale(by_delta, delta[y]), scale(by_n, n[y])))
    }
}

impl Term<3> for Torsion {
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> S {
        Parts::of(window, &Curvatures::of(window)).value()
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> Partials<S, D, 3> {
        let curvatures = Curvatures::of(window);
        let ([r0, r2], [k0, k2]) = (curvatures.rate, curvatures.vector);
        let parts = Parts::of(window, &curvatures);
        let delta = parts.delta_first(curvatures.vector, window.tangent[1]);
        let [by_k0, by_k2, by_t] = parts.first(&delta, &parts.n_first());
        let value = parts.value();
        let (half, slopes) = (S::of(0.5), curvatures.distance.slopes());
        let by_a0 = -(half * r0 * dot(by_k0, k0));
        let by_a2 = -(half * r2 * dot(by_k2, k2));
        Partials {
            value,
            tangent: [scale(-r0, by_k0), add(by_t, subtract(scale(r0, by_k0), scale(r2, by_k2))), scale(r2, by_k2)],
            length: std::array::from_fn(|k| [by_a0, by_a0 + by_a2, by_a2][k] + value * slopes[k]),
        }
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 3>) -> SecondPartials<S, D, 3> {
        if D < 3 {
            return SecondPartials::ZERO;
        }
        let curvatures = Curvatures::of(window);
        let ([k0, k2], t) = (curvatures.vector, window.tangent[1]);
        let parts = Parts::of(window, &curvatures);
        let (delta, n) = (parts.delta_first(curvatures.vector, t), parts.n_first());
        let value = parts.value();
        let (two, half, zero) = (S::of(2.0), S::of(0.5), [[S::ZERO; D]; D]);
        let unit = |a: usize, b: usize| if a == b { S::ONE } else { S::ZERO };
        let by_kk = matrix(|a, b| half * (unit(a, b) - t[a] * t[b]));
        let by_kt = matrix(|a, b| -(unit(a, b) * parts.along + t[a] * parts.mean[b]));
        let by_tt = matrix(|a, b| -two * parts.mean[a] * parts.mean[b]);
        let n_second = [[by_kk, by_kk, by_kt], [zero, by_kk, by_kt], [zero, zero, by_tt]];
        let delta_second = [[zero, skew(t), skew(scale(-S::ONE, k2))], [zero, zero, skew(k0)], [zero; 3]];
        // ∂²V = 2/(n ℓ) (∂δ ∂δ + δ ∂²δ) − 2 δ/(n² ℓ) (∂δ ∂n + ∂n ∂δ) + 2 V/n² ∂n ∂n − V/n ∂²n
        let squares = two * parts.by_n * parts.by_s;
        let by_delta = squares * parts.delta;
        let mixed = by_delta * parts.by_n;
        let by_n = value * parts.by_n;
        let n_squares = two * by_n * parts.by_n;
        let second = std::array::from_fn(|y| {
            std::array::from_fn(|z| {
                matrix(|a, b| {
                    squares * delta[y][a] * delta[z][b] + by_delta * delta_second[y][z][a][b]
                        - mixed * (delta[y][a] * n[z][b] + n[y][a] * delta[z][b])
                        + n_squares * n[y][a] * n[z][b]
                        - by_n * n_second[y][z][a][b]
                })
            })
        });
        ByCurvatures { value, first: parts.first(&delta, &n), second }.to_edges(&curvatures)
    }
}

/// a × b in 3-D.
///
/// It is 0 in 2-D, where only the third component would not vanish.
#[inline(always)]
fn cross<S: Scalar, const D: usize>(a: Vector<S, D>, b: Vector<S, D>) -> Vector<S, D> {
    if D < 3 {
        return [S::ZERO; D];
    }
    std::array::from_fn(|c| {
        let (d, e) = ((c + 1) % 3, (c + 2) % 3);
        a[d] * b[e] - a[e] * b[d]
    })
}

/// The matrix E with xᵀ E y = v·(x × y).
#[inline(always)]
fn skew<S: Scalar, const D: usize>(v: Vector<S, D>) -> Matrix<S, D> {
    matrix(|a, b| match (b + 3 - a) % 3 {
        1 => v[3 - a - b],
        2 => -v[3 - a - b],
        _ => S::ZERO,
    })
}
