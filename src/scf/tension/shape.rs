//! [`Shape`]: a solution, given by its pull and the course of its tangent.

use super::quadrature::Pull;

/// A solution in the frame in which a + b ≤ 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub pull: Pull,
    /// The angle of the pull. Above the tension, the angle of the tangent at an inflection, beyond
    /// both end angles.
    pub axis: f64,
    /// The law's arguments at the lower and the higher end angle, to full relative precision.
    pub ends: [f64; 2],
    pub course: Course,
    /// The length of the straight piece.
    pub flat: f64,
}

/// The course of the tangent's angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Course {
    /// From one end angle to the other.
    Direct,
    /// To this angle, where there may be a straight piece, and on or back to the other end angle.
    Through(f64),
    /// Beyond both end angles: to the axis at the greater one, and to this angle at the lesser one.
    Around(f64),
}
