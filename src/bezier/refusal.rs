//! [`Refusal`]: why a curve is not completed.

use super::MOST_DEGREE;
use crate::status::CurveStatus;

const ENDS: [&str; 2] = ["start", "end"];
const AXES: [&str; 4] = ["x", "y", "z", "w"];

/// Why a curve is not completed. It keeps its control points.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// It has no control point.
    #[error("a Bézier curve has one control point at least: give some, or leave the curve out")]
    Empty,
    /// It has this many control points, more than 31.
    #[error(
        "{count} control points make a curve of degree {degree}; up to {most} is possible: divide the curve, or give the \
         degree of the pieces of a chain", count = .0, degree = .0 - 1, most = MOST_DEGREE
    )]
    Degree(usize),
    /// A known control point has a coordinate that is NaN or infinite: point, axis, value.
    #[error("{axis} is {value}; a known control point needs finite numbers: mend it, or mark it as unknown", axis = AXES[*.1], value = .2)]
    Value(usize, usize, f64),
    /// A given derivative has a coordinate that is NaN or infinite: end, order.
    #[error("the derivative of order {order} at the {end} is not finite: mend it, or leave it out", end = ENDS[*.0], order = .1)]
    Derivative(usize, usize),
    /// The given points and derivatives are redundant or contradictory.
    #[error("its control points and end derivatives say the same twice, or contradict each other: leave some out")]
    Contradiction,
    /// The direction given at an end is 0.
    #[error("the direction at the {} is 0: give one, or leave it out", ENDS[*.0])]
    NoDirection(usize),
    /// The energy falls as the speed at this end goes to 0.
    #[error(
        "with this direction at the {} the energy is the less the slower the curve sets out: turn the direction towards \
         the curve, or give the derivative itself", ENDS[*.0]
    )]
    Still(usize),
    /// The solution overflows.
    #[error("the completed control points overflow: give more, or smaller, numbers")]
    Overflow,
    /// The device was lost or did not answer in time.
    #[error("it was not completed: the device was lost, or did not answer; run again, or use the CPU")]
    Lost,
}

impl Refusal {
    /// The status of a curve that is refused for this reason.
    pub fn status(self) -> CurveStatus {
        match self {
            Refusal::Empty => CurveStatus::Degenerate,
            Refusal::Still(_) => CurveStatus::NoMinimiser,
            Refusal::Lost => CurveStatus::NotConverged,
            _ => CurveStatus::Invalid,
        }
    }

    /// The control point at fault (of `points`), and a sentence about it.
    pub fn sentence(self, points: usize) -> (usize, String) {
        let point = match self {
            Refusal::Degree(_) => MOST_DEGREE + 1,
            Refusal::Value(point, ..) => point,
            Refusal::Derivative(1, _) | Refusal::NoDirection(1) | Refusal::Still(1) => points.saturating_sub(1),
            _ => 0,
        };
        (point, self.to_string())
    }
}
