//! [`Plan`]: what a descent is to do.

use crate::words::words;

/// How the direction follows from Sobolev gradients.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Direction {
    /// −(H + λL)⁻¹g with the Hessian H and the Sobolev inner product L, damped by λ ≥ 0 as far as
    /// it takes. The step is 1.
    #[default]
    Newton,
    /// −z
    Steepest,
    /// −z + βp with β = max(0, ⟨g⁺, z⁺ − z⟩/⟨g, z⟩), after Polak and Ribière.
    PolakRibiere,
    /// β = max(0, min(Hestenes–Stiefel, Dai–Yuan)): a tenth fewer evaluations, and steps need be
    /// less exact.
    Hybrid,
}

words!(Direction, "direction": [
    (Newton, "newton", "Newton's method, damped in the Sobolev metric"),
    (Hybrid, "cg", "Conjugate gradients in the Sobolev metric"),
    (Steepest, "descent", "Steepest descent in the Sobolev metric"),
    (PolakRibiere, "polak-ribiere", "Conjugate gradients after Polak and Ribière"),
]);

/// How far each step goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Step {
    /// Always so far.
    Constant(f64),
    /// As far as a line search says.
    #[default]
    Search,
}

/// What a descent is to do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub direction: Direction,
    pub step: Step,
    /// Order of the inner product; 0 for ordinary gradients.
    pub order: usize,
    /// Order of the gauge.
    pub gauge: usize,
    /// Accepted steps at most.
    pub most_iterations: u32,
}
