//! Penalties: local energies that keep a quantity of a few edges within a limit.
//!
//! A limit on a quantity q is c ≥ 0 with c = o − βq. The method of multipliers adds the energy
//!
//! ```text
//! ψ = ½ ρ s²,  s = max(0, r + βq)
//! ```
//!
//! with a stiffness ρ > 0. Up to a constant this is (max(0, y − ρc)² − y²)/(2ρ) for the multiplier
//! y of c ≥ 0, where r = y/ρ − o. The next multiplier is ρs. ψ is 0 where c ≥ y/ρ.
//!
//! Every vertex has its own penalties. Only curves with [`Limits`](crate::discrete::Limits) have
//! penalties. The energies that users write have none.
//!
//! Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex
//! programming* (1973).

use super::{Functional, Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::scale;

/// The penalty at a vertex. Stiffness 0 means none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Penalty<S> {
    /// β
    pub slope: S,
    /// r
    pub reach: S,
    /// ρ
    pub stiffness: S,
}

/// The largest number of directions of [`Limits::monotone`](crate::discrete::Limits::monotone).
pub(crate) const MOST_DIRECTIONS: usize = 3;

/// The kind of the first direction's penalties. The kinds before limit |K|, the signed curvature, the
/// torsion, κ′² and the slope.
pub(crate) const FIRST_DIRECTION: usize = 5;

/// The number of kinds of penalties. Tests have one more.
pub(crate) const LIMIT_KINDS: usize = FIRST_DIRECTION + MOST_DIRECTIONS + cfg!(test) as usize;

/// The terms that the limits of a batch add to its energy.
#[derive(Clone, Debug, Default)]
pub(crate) struct LimitTerms {
    /// The quantities that penalties limit.
    pub quantities: Vec<Functional>,
    /// The largest number of region penalties per vertex.
    pub regions: usize,
    /// Whether the length has its own weight for each curve, the last one.
    pub stretch: bool,
    /// Whether the area has a weight for each curve.
    pub area: bool,
}

impl<S: Scalar> Penalty<S> {
    /// No penalty.
    pub const NONE: Self = Penalty { slope: S::ZERO, reach: S::ZERO, stiffness: S::ZERO };

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

    /// ψ and its derivatives, from q and its derivatives.
    #[inline(always)]
    pub fn gradient<const D: usize, const W: usize>(&self, q: &Partials<S, D, W>) -> Partials<S, D, W> {
        let by_q = self.stiffness * self.beyond(q.value) * self.slope;
        let mut gradient = Partials { value: self.value(q.value), tangent: [[S::ZERO; D]; W], length: [S::ZERO; W] };
        for j in 0..W {
            gradient.tangent[j] = scale(by_q, q.tangent[j]);
            gradient.length[j] = by_q * q.length[j];
        }
        gradient
    }

    /// Second derivatives of ψ: [s > 0] ρβ² ∇q∇qᵀ + ρsβ ∇²q.
    #[inline(always)]
    pub fn hessian<const D: usize, const W: usize>(
        &self,
        q: &Partials<S, D, W>,
        second: &SecondPartials<S, D, W>,
    ) -> SecondPartials<S, D, W> {
        let beyond = self.beyond(q.value);
        let by_q = self.stiffness * beyond * self.slope;
        let by_qq = beyond.if_positive(self.stiffness * self.slope * self.slope, S::ZERO);
        let mut hessian = SecondPartials::ZERO;
        for j in 0..W {
            for k in 0..W {
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

/// A quantity q of W edges that [penalties](Penalty) limit.
pub(crate) trait Quantity<const W: usize> {
    /// The index of its kind of penalty.
    fn kind(&self) -> usize;
    /// q and its partial derivatives.
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W>;
    /// Its second partial derivatives, given the first. The default is for q linear in tangents.
    #[inline(always)]
    fn second<S: Scalar, const D: usize>(&self, _: &Window<S, D, W>, _: &Partials<S, D, W>) -> SecondPartials<S, D, W> {
        SecondPartials::ZERO
    }
}

impl<Q: Quantity<W>, const W: usize> Term<W> for Q {
    #[inline(always)]
    fn penalty(&self) -> Option<usize> {
        Some(self.kind())
    }

    #[inline(always)]
    fn quantity<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Option<S> {
        Some(self.first(window).value)
    }

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> S {
        window.penalty.value(self.first(window).value)
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W> {
        window.penalty.gradient(&self.first(window))
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> SecondPartials<S, D, W> {
        let first = self.first(window);
        window.penalty.hessian(&first, &self.second(window, &first))
    }
}
