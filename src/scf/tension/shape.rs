//! [`Shape`]: a solution, by its pull and its turning.

use super::quadrature::Pull;

/// The solution in the frame where a + b ≤ 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub pull: Pull,
    /// Angle of the pull, or, above the tension, of the tangent at an inflection, beyond both ends'
    /// angles.
    pub axis: f64,
    /// The law's arguments at the lower and the higher end's angle, to their own precision.
    pub ends: [f64; 2],
    pub course: Course,
    /// Length of the straight piece.
    pub flat: f64,
}

/// The angles between which the tangent turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Course {
    /// From one end's angle to the other's.
    Direct,
    /// To an angle, where there may be a straight piece, and on or back to the other end's.
    Through(f64),
    /// Beyond both ends' angles, to the axis at the greater and to this angle at the lesser.
    Around(f64),
}
