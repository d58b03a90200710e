//! [`Plan`]: the solver of a descent, with the orders of its inner product and regularisation.

use crate::words::words;

/// How the direction of a step follows from the gradient g.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Solver {
    /// Newton's method: −(H + λL)⁻¹g with the Hessian H and the Sobolev inner product L.
    ///
    /// The damping λ ≥ 0 is as small as possible. Interpolating curves with energies of order 1
    /// (length and tension) always use Sobolev gradients.
    #[default]
    Newton,
    /// Sobolev gradients: −αL⁻¹g, with the Barzilai–Borwein step α.
    ///
    /// It needs only first derivatives, but takes 5 to 17 times as many iterations for
    /// interpolating curves.
    Sobolev,
}

words!(Solver, "solver": [
    (Newton, "newton", "Newton's method, damped in the Sobolev metric"),
    (Sobolev, "sobolev", "Steepest descent along Sobolev gradients"),
]);

/// The solver and the orders of a descent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub solver: Solver,
    /// The order of the inner product, 1 to 3.
    pub order: usize,
    /// The kind of regularisation: 0 for none, 1 for differences, 2 for ratios, 3 for second
    /// differences.
    pub regularisation: usize,
}
