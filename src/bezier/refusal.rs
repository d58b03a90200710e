//! [`Refusal`]: why a curve is not completed, in words.

use super::MOST_DEGREE;
use crate::status::CurveStatus;

/// Why a curve is not completed. Its control points stay as they were.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// It has no control point.
    Empty,
    /// It has this many control points, more than 31.
    Degree(usize),
    /// A known control point has a coordinate that is NaN or infinite: point, axis, value.
    Value(usize, usize, f64),
    /// A given derivative has a coordinate that is NaN or infinite: end, order.
    Derivative(usize, usize),
    /// Points and derivatives given say the same twice, or contradict each other.
    Contradiction,
    /// The direction given at an end is 0.
    NoDirection(usize),
    /// The energy is least where the curve stands still at this end, without a direction.
    Still(usize),
    /// Numbers of the solution overflow.
    Overflow,
    /// The device was lost, or did not answer, before it was completed.
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

    /// The control point to blame (of `points`), and what is wrong with it.
    pub fn sentence(self, points: usize) -> (usize, String) {
        let last = points.saturating_sub(1);
        let at = |end: usize| if end == 0 { (0, "start") } else { (last, "end") };
        match self {
            Refusal::Empty => {
                (0, "a Bézier curve has one control point at least: give some, or leave the curve out".into())
            }
            Refusal::Degree(points) => {
                let what = format!(
                    "{points} control points make a curve of degree {}; up to {MOST_DEGREE} is possible: divide the curve, or \
                     give the degree of the pieces of a chain",
                    points - 1
                );
                (MOST_DEGREE + 1, what)
            }
            Refusal::Value(point, axis, value) => {
                let axis = ["x", "y", "z", "w"][axis];
                (
                    point,
                    format!(
                        "{axis} is {value}; a known control point needs finite numbers: mend it, or mark it as unknown"
                    ),
                )
            }
            Refusal::Derivative(end, order) => {
                let (point, end) = at(end);
                (point, format!("the derivative of order {order} at the {end} is not finite: mend it, or leave it out"))
            }
            Refusal::Contradiction => (
                0,
                "its control points and end derivatives say the same twice, or contradict each other: leave some out"
                    .into(),
            ),
            Refusal::NoDirection(end) => {
                let (point, end) = at(end);
                (point, format!("the direction at the {end} is 0: give one, or leave it out"))
            }
            Refusal::Still(end) => {
                let (point, end) = at(end);
                let what = format!(
                    "with this direction at the {end} the energy is the less the slower the curve sets out: turn the direction \
                     towards the curve, or give the derivative itself"
                );
                (point, what)
            }
            Refusal::Overflow => (0, "the completed control points overflow: give more, or smaller, numbers".into()),
            Refusal::Lost => {
                (0, "it was not completed: the device was lost, or did not answer; run again, or use the CPU".into())
            }
        }
    }
}
