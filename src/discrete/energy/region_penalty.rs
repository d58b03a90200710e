//! Region penalties, which keep single vertices within a region.

use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, add, dot, number, scale, subtract};

/// The penalty of a region constraint on a vertex with the displacement u.
///
/// ```text
/// ψ = ½ ρ s²,  s = max(0, r + q),  q = φ (v·o) + ½ b |o − t v|²
/// o = u − p,  t = min(max(v·o, 0), ℓ)
/// ```
///
/// |o − t v| is the distance from the segment of length ℓ that begins at p along the unit vector v.
/// For ℓ = 0 this is a disc. With b = 0 the region is a half-space. As in a
/// [penalty](super::Penalty), a limit q ≤ c₀ with multiplier y has r = y/ρ − c₀, and the next
/// multiplier is ρs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RegionPenalty<S, const D: usize> {
    /// p
    pub foot: Vector<S, D>,
    /// v
    pub axis: Vector<S, D>,
    /// ℓ
    pub span: S,
    /// φ
    pub plane: S,
    /// b. Negative for a region to stay out of.
    pub bend: S,
    /// r
    pub reach: S,
    /// ρ
    pub stiffness: S,
}

impl<S: Scalar, const D: usize> RegionPenalty<S, D> {
    /// No penalty.
    pub const NONE: Self = RegionPenalty {
        foot: [S::ZERO; D],
        axis: [S::ZERO; D],
        span: S::ZERO,
        plane: S::ZERO,
        bend: S::ZERO,
        reach: S::ZERO,
        stiffness: S::ZERO,
    };

    /// Sets the penalty of one lane.
    pub fn set_lane(&mut self, lane: usize, penalty: &RegionPenalty<f64, D>) {
        for c in 0..D {
            self.foot[c].set_lane(lane, number::<S>(penalty.foot[c]));
            self.axis[c].set_lane(lane, number::<S>(penalty.axis[c]));
        }
        self.span.set_lane(lane, number::<S>(penalty.span));
        self.plane.set_lane(lane, number::<S>(penalty.plane));
        self.bend.set_lane(lane, number::<S>(penalty.bend));
        self.reach.set_lane(lane, number::<S>(penalty.reach));
        self.stiffness.set_lane(lane, number::<S>(penalty.stiffness));
    }

    /// q and its gradient, at u.
    #[inline(always)]
    pub fn quantity(&self, u: Vector<S, D>) -> (S, Vector<S, D>) {
        let o = subtract(u, self.foot);
        let along = dot(self.axis, o);
        let away = subtract(o, scale(self.nearest(along), self.axis));
        let q = self.plane * along + S::of(0.5) * self.bend * dot(away, away);
        (q, add(scale(self.plane, self.axis), scale(self.bend, away)))
    }

    /// t
    #[inline(always)]
    fn nearest(&self, along: S) -> S {
        -(-along.max(S::ZERO)).max(-self.span)
    }

    /// s
    #[inline(always)]
    pub fn beyond(&self, q: S) -> S {
        (self.reach + q).max(S::ZERO)
    }

    /// ψ at u.
    #[inline(always)]
    pub fn value(&self, u: Vector<S, D>) -> S {
        let beyond = self.beyond(self.quantity(u).0);
        S::of(0.5) * self.stiffness * beyond * beyond
    }

    /// The gradient of ψ at u.
    #[inline(always)]
    pub fn gradient(&self, u: Vector<S, D>) -> Vector<S, D> {
        let (q, by_place) = self.quantity(u);
        scale(self.stiffness * self.beyond(q), by_place)
    }

    /// The Hessian of ψ at u: [s > 0] ρ ∇q∇qᵀ + ρ s b (I − [0 < v·o < ℓ] v vᵀ).
    #[inline(always)]
    pub fn hessian(&self, u: Vector<S, D>) -> [Vector<S, D>; D] {
        let (q, by_place) = self.quantity(u);
        let beyond = self.beyond(q);
        let first = beyond.if_positive(self.stiffness, S::ZERO);
        let second = self.stiffness * beyond * self.bend;
        let along = dot(self.axis, subtract(u, self.foot));
        let within = along.if_positive((self.span - along).if_positive(second, S::ZERO), S::ZERO);
        let mut hessian = [[S::ZERO; D]; D];
        for a in 0..D {
            for b in 0..D {
                hessian[a][b] = first * by_place[a] * by_place[b] - within * self.axis[a] * self.axis[b];
            }
            hessian[a][a] += second;
        }
        hessian
    }
}
