//! Torsion: Σ det(T, K̄, C)²/(|K̄|² + ε²) Δs.

use super::{Energy, Functional, Partials, SecondPartials, Term, Window};
use crate::linalg::Scalar;

/// ε of [`torsion`]: a curvature of 10⁻³ over the curve's size.
pub const TORSION_CURVATURE: f64 = 1e-3;

pub fn torsion() -> Energy {
    Energy::of(Functional::Torsion)
}

pub(crate) struct Torsion;

impl Term<3> for Torsion {
    fn value<S: Scalar, const D: usize>(&self, _: &Window<S, D, 3>) -> S {
        todo!()
    }

    fn gradient<S: Scalar, const D: usize>(&self, _: &Window<S, D, 3>) -> Partials<S, D, 3> {
        todo!()
    }

    fn hessian<S: Scalar, const D: usize>(&self, _: &Window<S, D, 3>) -> SecondPartials<S, D, 3> {
        todo!()
    }
}
