//! Fences: the local energies that keep a curvature within a limit.
//!
//! A limit on a quantity q of a curve is c ≥ 0 with c = o − βq. The method of multipliers adds the energy
//!
//! ```text
//! ψ = ½ ρ s²,  s = max(0, r + βq)
//! ```
//!
//! for a stiffness ρ > 0. This is (max(0, y − ρc)² − y²)/(2ρ) for the multiplier y of c ≥ 0, where r = y/ρ − o, but for a
//! constant. The next multiplier is ρs. Where a limit is kept with room, ψ is 0.
//!
//! Fences stand at vertices, and differ from one to the next. No energy of a user holds them: curves with
//! [`Limits`](crate::discrete::Limits) do.
//!
//! Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex programming* (1973).

use super::{Partials, SecondPartials};
use crate::linalg::Scalar;
use crate::linalg::scalar::scale;

/// The fence at a vertex. Without stiffness there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fence<S> {
    /// β
    pub slope: S,
    /// r
    pub reach: S,
    /// ρ
    pub stiffness: S,
}

impl<S: Scalar> Fence<S> {
    /// No fence.
    pub const NONE: Self = Fence { slope: S::ZERO, reach: S::ZERO, stiffness: S::ZERO };

    /// s
    #[inline(always)]
    pub fn beyond(&self, q: S) -> S {
        (self.reach + self.slope * q).max(S::ZERO)
    }

    /// ψ
    #[inline(always)]
    pub fn value(&self, q: S) -> S {
        let beyond = self.beyond(q);
        S::of(0.5) * self.stiffness * beyond * beyond
    }

    /// ψ and its derivatives, from q and its own.
    #[inline(always)]
    pub fn gradient<const D: usize>(&self, q: &Partials<S, D, 2>) -> Partials<S, D, 2> {
        let by_q = self.stiffness * self.beyond(q.value) * self.slope;
        Partials {
            value: self.value(q.value),
            tangent: [scale(by_q, q.tangent[0]), scale(by_q, q.tangent[1])],
            length: [by_q * q.length[0], by_q * q.length[1]],
        }
    }

    /// Second derivatives of ψ: [s > 0] ρβ² ∇q∇qᵀ + ρsβ ∇²q.
    #[inline(always)]
    pub fn hessian<const D: usize>(
        &self,
        q: &Partials<S, D, 2>,
        second: &SecondPartials<S, D, 2>,
    ) -> SecondPartials<S, D, 2> {
        let beyond = self.beyond(q.value);
        let by_q = self.stiffness * beyond * self.slope;
        let by_qq = beyond.if_positive(self.stiffness * self.slope * self.slope, S::ZERO);
        let mut hessian = SecondPartials::ZERO;
        for j in 0..2 {
            for k in 0..2 {
                for a in 0..D {
                    for b in 0..D {
                        hessian.tangents[j][k][a][b] =
                            by_qq * q.tangent[j][a] * q.tangent[k][b] + by_q * second.tangents[j][k][a][b];
                    }
                    hessian.mixed[j][k][a] = by_qq * q.tangent[j][a] * q.length[k] + by_q * second.mixed[j][k][a];
                }
                hessian.lengths[j][k] = by_qq * q.length[j] * q.length[k] + by_q * second.lengths[j][k];
            }
        }
        hessian
    }
}
