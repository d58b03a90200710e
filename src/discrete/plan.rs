//! [`Plan`]: the instructions of a descent.

use crate::words::words;

/// How the direction follows from the gradient.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Direction {
    /// −(H + λL)⁻¹g with the Hessian H, the Sobolev inner product L and the step 1.
    ///
    /// λ ≥ 0 damps as far as necessary.
    #[default]
    Newton,
    /// −z
    Steepest,
    /// −z + βp with β = max(0, ⟨g⁺, z⁺ − z⟩/⟨g, z⟩), after Polak and Ribière.
    PolakRibiere,
    /// −z + βp with β = max(0, min(Hestenes–Stiefel, Dai–Yuan)).
    ///
    /// It takes a tenth fewer evaluations, and steps may be less exact.
    Hybrid,
}

words!(Direction, "direction": [
    (Newton, "newton", "Newton's method, damped in the Sobolev metric"),
    (Hybrid, "cg", "Conjugate gradients in the Sobolev metric"),
    (Steepest, "descent", "Steepest descent in the Sobolev metric"),
    (PolakRibiere, "polak-ribiere", "Conjugate gradients after Polak and Ribière"),
]);

/// The length of each step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Step {
    /// Always this long.
    Constant(f64),
    /// As long as a line search finds.
    #[default]
    Search,
}

/// The instructions of a descent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub direction: Direction,
    pub step: Step,
    /// The order of the inner product.
    ///
    /// 0 for ordinary gradients.
    pub order: usize,
    /// The kind of the gauge: 0 for none, 1 of differences, 2 of ratios, 3 of second differences.
    pub gauge: usize,
}
