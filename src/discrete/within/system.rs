//! Assembly of Newton's systems for curves in surfaces, in the coordinates u of the tangent planes.
//!
//! A step moves vertex i by B_i u_i, and changes edge j by e = B_{j+1} u_{j+1} − B_j u_j. Tangents
//! and normals enter only through these numbers:
//!
//! ```text
//! a = B_jᵀ T_j,  t = B_{j+1}ᵀ T_j,  C = B_jᵀ B_{j+1}      of edge j
//! S = B_iᵀ W B_i,  w = B_iᵀ W n                          of vertex i, for W = ∇²F/|∇F|
//! ```

// Loops over coordinates by index match the formulas, and keep the code vectorised.
#![allow(clippy::needless_range_loop)]

use super::super::block::{Block, times};
use super::super::energy::Penalty;
use super::super::energy::in_surface::{InSurface, Parts};
use super::super::stretches::Stretch;
use super::super::tangent_planes::{Basis, TangentSystem, add_own, add_pair, between, onto};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, dot, subtract};

/// An edge in the coordinates of its ends.
#[derive(Clone, Copy)]
pub(super) struct Link<S> {
    /// a and t: its length changes by t·u′ − a·u.
    along: [Vector<S, 2>; 2],
    /// C
    turn: Block<S, 2>,
}

impl<S: Scalar> Link<S> {
    #[inline(always)]
    pub fn new<const D: usize>(tangent: Vector<S, D>, bases: [&Basis<S, D>; 2]) -> Self {
        Link { along: [onto(bases[0], tangent), onto(bases[1], tangent)], turn: between(bases) }
    }
}

/// The second derivatives of the surface at a vertex, in its coordinates.
#[derive(Clone, Copy)]
pub(super) struct Saddle<S> {
    /// S
    pub shape: Block<S, 2>,
    /// w
    pub across: Vector<S, 2>,
}

/// Bᵀ M B for a symmetric M.
#[inline(always)]
pub(super) fn in_plane<S: Scalar, const D: usize>(basis: &Basis<S, D>, matrix: &Block<S, D>) -> Block<S, 2> {
    let [first, second] = [times(matrix, basis[0]), times(matrix, basis[1])];
    let beside = dot(basis[0], second);
    [[dot(basis[0], first), beside], [beside, dot(basis[1], second)]]
}

/// A vertex between two edges, with the geometry that an energy of its bend needs.
pub(super) struct Bend<'a, S, const D: usize> {
    pub links: [&'a Link<S>; 2],
    pub bases: [&'a Basis<S, D>; 3],
    pub tangents: [Vector<S, D>; 2],
    pub inverses: [S; 2],
    pub normal: Vector<S, D>,
    pub saddle: Saddle<S>,
    /// Bᵀ ∇³F[m] B/|∇F|
    pub third: Block<S, 2>,
}

/// The lower triangle of a system of three consecutive vertices.
struct Three<S> {
    own: [Block<S, 2>; 3],
    /// The pairs of vertices 0 and 1, 0 and 2, 1 and 2.
    pairs: [Block<S, 2>; 3],
}

/// The two vertices of each of `pairs`.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

impl<S: Scalar> Three<S> {
    const ZERO: Self = Three { own: [[[S::ZERO; 2]; 2]; 3], pairs: [[[S::ZERO; 2]; 2]; 3] };

    /// Adds xᵀ y + yᵀ x, for rows x and y of these vertices.
    #[inline(always)]
    fn add_both<const N: usize>(&mut self, vertices: [usize; N], x: &[Vector<S, 2>; N], y: &[Vector<S, 2>; N]) {
        for i in 0..N {
            let own = &mut self.own[vertices[i]];
            for a in 0..2 {
                for b in 0..=a {
                    own[a][b] += x[i][a] * y[i][b] + y[i][a] * x[i][b];
                }
            }
            for k in i + 1..N {
                let pair = &mut self.pairs[vertices[i] + vertices[k] - 1];
                for a in 0..2 {
                    for b in 0..2 {
                        pair[a][b] += x[i][a] * y[k][b] + y[i][a] * x[k][b];
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn add_to(&self, system: &mut TangentSystem<S>, first: usize) {
        for i in 0..3 {
            add_own(system, first + i, &self.own[i]);
        }
        for pair in 0..3 {
            let (i, k) = PAIRS[pair];
            add_pair(system, first + i, first + k, &self.pairs[pair]);
        }
    }
}

/// Adds the second derivatives of energies of lengths at an edge: f_jj λ² + f_j (|e|² − λ²)/Δs for
/// λ = T·e.
#[inline(always)]
pub(super) fn add_edge<S: Scalar>(system: &mut TangentSystem<S>, first: usize, link: &Link<S>, stretch: &Stretch<S>) {
    let [a, t] = link.along;
    let across = stretch.across;
    let along = stretch.along[0] - across;
    let (mut own, mut next, mut pair) = ([[S::ZERO; 2]; 2], [[S::ZERO; 2]; 2], [[S::ZERO; 2]; 2]);
    for i in 0..2 {
        for k in 0..2 {
            let unit = if i == k { across } else { S::ZERO };
            own[i][k] = unit + along * a[i] * a[k];
            next[i][k] = unit + along * t[i] * t[k];
            pair[i][k] = -(across * link.turn[i][k] + along * a[i] * t[k]);
        }
    }
    add_own(system, first, &own);
    add_own(system, first + 1, &next);
    add_pair(system, first, first + 1, &pair);
}

/// Adds the second derivatives of energies of lengths by two edges: 2 f_jk λ_j λ_k.
#[inline(always)]
pub(super) fn add_edges<S: Scalar>(system: &mut TangentSystem<S>, first: usize, links: [&Link<S>; 2], by_both: S) {
    let ([a, t], [b, s]) = (links[0].along, links[1].along);
    let (mut own, mut pairs) = ([[S::ZERO; 2]; 2], [[[S::ZERO; 2]; 2]; 3]);
    for i in 0..2 {
        for k in 0..2 {
            own[i][k] = -by_both * (t[i] * b[k] + b[i] * t[k]);
            pairs[0][i][k] = by_both * a[i] * b[k];
            pairs[1][i][k] = -by_both * a[i] * s[k];
            pairs[2][i][k] = by_both * t[i] * s[k];
        }
    }
    add_own(system, first + 1, &own);
    for pair in 0..3 {
        let (i, k) = PAIRS[pair];
        add_pair(system, first + i, first + k, &pairs[pair]);
    }
}

impl<S: Scalar, const D: usize> Bend<'_, S, D> {
    /// Adds the second derivatives of an energy f(s, Δa) of s = |m|², for m = d − q n, d = T′ − T
    /// and q = n·d.
    ///
    /// With μ = Bᵀ m and k = S μ they are
    ///
    /// ```text
    /// ½ d²s = |η|² − 2 κ ν − q ∇³F[m](u, u)/|∇F| + m·d²d,  ½ ds = μ·η
    /// η = Bᵀ dd − q S u,  κ = k·u,  ν = n·dd + ½ κ − q w·u
    /// m·d²T = −(2 λ (m·e − (m·T) λ) + (m·T)(|e|² − λ²))/Δs²,  λ = T·e
    /// ```
    ///
    /// where u belongs to the vertex itself.
    #[inline(always)]
    pub fn add_to(
        &self,
        system: &mut TangentSystem<S>,
        first: usize,
        weight: S,
        energy: &impl InSurface,
        measure: S,
        penalty: &Penalty<S>,
    ) {
        let mu = subtract(self.links[1].along[0], self.links[0].along[1]);
        let parts = Parts { square: dot(mu, mu), measure };
        let (by, twice) = (energy.first_of(&parts, penalty), energy.second_of(&parts, penalty));
        let across = weight * twice.across;
        let mut three = Three::ZERO;
        let slope = self.add_turn(&mut three, mu, across, weight * twice.along);
        let of_lengths = [weight * by.by_length, weight * twice.mixed, S::of(0.5) * weight * twice.by_lengths];
        self.add_lengths(&mut three, mu, across, of_lengths, &slope);
        three.add_to(system, first);
    }

    /// Adds across (|η|² − 2 κ ν − q ∇³F[m]/|∇F|) + along (μ·η)², and returns μ·η.
    #[inline(always)]
    fn add_turn(&self, three: &mut Three<S>, mu: Vector<S, 2>, across: S, along: S) -> [Vector<S, 2>; 3] {
        let ([a, t], [t_after, a_after]) = (self.links[0].along, self.links[1].along);
        let (before, after) = (&self.links[0].turn, &self.links[1].turn);
        let [r, r_after] = self.inverses;
        let (shape, w, n) = (&self.saddle.shape, self.saddle.across, self.normal);
        let [n_t, n_t_after] = [dot(n, self.tangents[0]), dot(n, self.tangents[1])];
        let q = n_t_after - n_t;
        let mut eta = [[[S::ZERO; 2]; 2]; 3];
        for i in 0..2 {
            for k in 0..2 {
                let unit = if i == k { r + r_after } else { S::ZERO };
                eta[0][i][k] = r * (before[k][i] - t[i] * a[k]);
                eta[1][i][k] = r * t[i] * t[k] + r_after * t_after[i] * t_after[k] - unit - q * shape[i][k];
                eta[2][i][k] = r_after * (after[i][k] - t_after[i] * a_after[k]);
            }
        }
        // ηᵀ (across I + along μ μᵀ) η
        let (mut weighted, mut slope) = (eta, [[S::ZERO; 2]; 3]);
        for v in 0..3 {
            for k in 0..2 {
                slope[v][k] = mu[0] * eta[v][0][k] + mu[1] * eta[v][1][k];
                for i in 0..2 {
                    weighted[v][i][k] = across * eta[v][i][k] + along * mu[i] * slope[v][k];
                }
            }
        }
        for v in 0..3 {
            for i in 0..2 {
                for k in 0..=i {
                    three.own[v][i][k] = eta[v][0][i] * weighted[v][0][k] + eta[v][1][i] * weighted[v][1][k];
                }
            }
        }
        for pair in 0..3 {
            let (v, other) = PAIRS[pair];
            for i in 0..2 {
                for k in 0..2 {
                    three.pairs[pair][i][k] =
                        eta[v][0][i] * weighted[other][0][k] + eta[v][1][i] * weighted[other][1][k];
                }
            }
        }
        // κ depends on the middle vertex alone, and n has no component in its plane.
        let (n_before, n_after) = (onto(self.bases[0], n), onto(self.bases[2], n));
        let mut nu = [[S::ZERO; 2]; 3];
        let mut kappa = mu;
        for i in 0..2 {
            let bent = dot(shape[i], mu);
            kappa[i] = across * bent;
            nu[0][i] = r * (n_before[i] - n_t * a[i]);
            nu[1][i] = r * n_t * t[i] + r_after * n_t_after * t_after[i] + S::of(0.5) * bent - q * w[i];
            nu[2][i] = r_after * (n_after[i] - n_t_after * a_after[i]);
        }
        for i in 0..2 {
            for k in 0..2 {
                three.pairs[0][i][k] -= nu[0][i] * kappa[k];
                three.pairs[2][i][k] -= kappa[i] * nu[2][k];
            }
            for k in 0..=i {
                three.own[1][i][k] -= kappa[i] * nu[1][k] + nu[1][i] * kappa[k] + across * q * self.third[i][k];
            }
        }
        slope
    }

    /// Adds across m·d²d + ∂f/∂Δs Σ d²Δs + 2 mixed (μ·η) Σ λ + by_lengths (Σ λ)².
    ///
    /// `of_lengths` are ∂f/∂Δs, `mixed` and half of `by_lengths`.
    #[inline(always)]
    fn add_lengths(
        &self,
        three: &mut Three<S>,
        mu: Vector<S, 2>,
        across: S,
        [by_length, mixed, by_lengths]: [S; 3],
        slope: &[Vector<S, 2>; 3],
    ) {
        let mut sum = [[S::ZERO; 2]; 3];
        for e in 0..2 {
            let ([a, t], turn, r) = (self.links[e].along, &self.links[e].turn, self.inverses[e]);
            // T has the sign −1, and T′ the sign 1.
            let bent = if e == 0 { r * r * across } else { -(r * r * across) };
            let along = bent * dot(mu, if e == 0 { t } else { a });
            let even = r * by_length + along;
            let less = S::of(0.5) * even + along;
            // λ, and its factor bent m·e − less λ.
            let (mut lambda, mut by_lambda) = ([a, t], [a, t]);
            for i in 0..2 {
                // m lies in the plane of the middle vertex.
                let [from, to] = match e {
                    0 => [turn[i][0] * mu[0] + turn[i][1] * mu[1], mu[i]],
                    _ => [mu[i], turn[0][i] * mu[0] + turn[1][i] * mu[1]],
                };
                lambda[0][i] = -a[i];
                by_lambda[0][i] = less * a[i] - bent * from;
                by_lambda[1][i] = bent * to - less * t[i];
                sum[e][i] -= a[i];
                sum[e + 1][i] += t[i];
            }
            three.add_both([e, e + 1], &lambda, &by_lambda);
            for i in 0..2 {
                three.own[e][i][i] += even;
                three.own[e + 1][i][i] += even;
                for k in 0..2 {
                    three.pairs[2 * e][i][k] -= even * turn[i][k];
                }
            }
        }
        let mut by_sum = sum;
        for v in 0..3 {
            for i in 0..2 {
                by_sum[v][i] = mixed * slope[v][i] + by_lengths * sum[v][i];
            }
        }
        three.add_both([0, 1, 2], &sum, &by_sum);
    }
}
