//! Attachment to data, ½ Σ w |f − p|², and [`Anchor`], everything that holds a vertex near its data
//! point.

use super::{Energy, Facts, Functional};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, add, dot, number, scale};

/// The attachment ½ Σ w |f − p|² over the data points p, in units of length².
///
/// f is the vertex that belongs to p. The weight w is 1 if the batch has no weights. Use it for
/// noisy data: data points are then approximated, not interpolated.
///
/// Unlike the other energies, it depends on vertices, not on edges. Its gradient is w (f − p), its
/// Hessian w.
pub fn attachment() -> Energy {
    Energy::of(Functional::Attachment)
}

/// The functional of [`attachment`]. It depends on no edge, so it has no term.
pub(super) struct Attachment;

impl Facts for Attachment {
    fn degree(&self) -> f64 {
        2.0
    }
}

/// The energy that holds a vertex f near its data point p: a spring, the penalty of a disc, and a
/// tangential anchor.
///
/// ```text
/// ½ w d² + ½ ρ s² + ½ (τ·(f − p) − a)²,  s = max(0, (d² − r)/2),  d = |f − p|
/// ```
///
/// ρ is 0 without a disc. With a disc of radius D, this is up to a constant the augmented
/// Lagrangian of (d² − D²)/2 ≤ 0 with multiplier y, where r = D² − 2y/ρ. The next multiplier is
/// ρ s. The tangential anchor keeps the vertex from sliding along τ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Anchor<S, const D: usize> {
    /// w
    pub spring: S,
    /// ρ
    pub stiffness: S,
    /// r. It may be negative.
    pub reach: S,
    /// τ
    pub tangent: Vector<S, D>,
    /// a
    pub along: S,
}

impl<S: Scalar, const D: usize> Anchor<S, D> {
    /// The anchor of a free vertex.
    pub const NONE: Self =
        Anchor { spring: S::ZERO, stiffness: S::ZERO, reach: S::ZERO, tangent: [S::ZERO; D], along: S::ZERO };

    /// Sets the anchor of one lane.
    pub fn set_lane(&mut self, lane: usize, anchor: &Anchor<f64, D>) {
        self.spring.set_lane(lane, number::<S>(anchor.spring));
        self.stiffness.set_lane(lane, number::<S>(anchor.stiffness));
        self.reach.set_lane(lane, number::<S>(anchor.reach));
        (0..D).for_each(|c| self.tangent[c].set_lane(lane, number::<S>(anchor.tangent[c])));
        self.along.set_lane(lane, number::<S>(anchor.along));
    }

    /// s for the offset f − p.
    #[inline(always)]
    pub fn beyond(&self, offset: Vector<S, D>) -> S {
        (S::of(0.5) * (dot(offset, offset) - self.reach)).max(S::ZERO)
    }

    /// The energy for the offset f − p.
    #[inline(always)]
    pub fn value(&self, offset: Vector<S, D>) -> S {
        let (beyond, along) = (self.beyond(offset), dot(self.tangent, offset) - self.along);
        S::of(0.5) * (self.spring * dot(offset, offset) + self.stiffness * beyond * beyond + along * along)
    }

    /// The gradient for the offset f − p.
    #[inline(always)]
    pub fn gradient(&self, offset: Vector<S, D>) -> Vector<S, D> {
        let pull = self.spring + self.stiffness * self.beyond(offset);
        add(scale(pull, offset), scale(dot(self.tangent, offset) - self.along, self.tangent))
    }

    /// The Hessian for the offset o = f − p: (w + ρs) I + τ τᵀ, plus ρ o oᵀ outside the disc.
    #[inline(always)]
    pub fn hessian(&self, offset: Vector<S, D>) -> [Vector<S, D>; D] {
        let beyond = self.beyond(offset);
        let stiffness = beyond.if_positive(self.stiffness, S::ZERO);
        let mut hessian = [[S::ZERO; D]; D];
        for a in 0..D {
            for b in 0..D {
                hessian[a][b] = stiffness * offset[a] * offset[b] + self.tangent[a] * self.tangent[b];
            }
            hessian[a][a] += self.spring + self.stiffness * beyond;
        }
        hessian
    }
}
