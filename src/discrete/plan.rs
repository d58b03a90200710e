//! [`Plan`]: the instructions of a descent.

use crate::words::words;

/// How the direction of a step follows from the gradient g.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Solver {
    /// −(H + λL)⁻¹g with the Hessian H and the Sobolev inner product L.
    ///
    /// λ ≥ 0 damps as far as necessary. Energies of order 1, length and tension, of curves through
    /// their points have Sobolev gradients all the same.
    #[default]
    Newton,
    /// −αL⁻¹g, where L⁻¹g is the Sobolev gradient and α the step of Barzilai and Borwein.
    ///
    /// It needs first derivatives alone, and 5 to 17 times as many iterations through pinned points.
    Sobolev,
}

words!(Solver, "solver": [
    (Newton, "newton", "Newton's method, damped in the Sobolev metric"),
    (Sobolev, "sobolev", "Steepest descent along Sobolev gradients"),
]);

/// The instructions of a descent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub solver: Solver,
    /// The order of the inner product, 1 to 3.
    pub order: usize,
    /// The kind of the regularisation: 0 for none, 1 of differences, 2 of ratios, 3 of second differences.
    pub regularisation: usize,
}
