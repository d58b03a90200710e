//! The problem of the tangent angles of one curve, and the outcome of a search for them.

use super::evaluation::Evaluation;

/// The kinds of a segment's ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// Both directions are unknowns, or fixed.
    Directed,
    /// The first direction is free: the curve starts straight, without moment.
    FreeStart,
    /// The last direction is free.
    FreeEnd,
    /// Both directions are free: the segment is straight.
    Straight,
}

impl Ends {
    /// The ends for two directions, NaN if free.
    pub fn between(first: f64, last: f64) -> Self {
        match (first.is_nan(), last.is_nan()) {
            (false, false) => Ends::Directed,
            (true, false) => Ends::FreeStart,
            (false, true) => Ends::FreeEnd,
            (true, true) => Ends::Straight,
        }
    }
}

/// A segment of a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// The angles of the reference directions at its ends, from its chord.
    pub angles: [f64; 2],
    /// Its chord length to the power 1 − ν, in units of the curve.
    pub weight: f64,
    /// The index of its universal curve.
    pub curve: u16,
    pub ends: Ends,
}

/// The tangent angles of a curve through n dots: n − 1 segments, or n if it is closed.
#[derive(Clone, Debug)]
pub(crate) struct SlopesProblem {
    pub closed: bool,
    /// ν, the largest of all segments.
    pub exponent: f64,
    pub spans: Vec<Span>,
    /// 1 if a direction is an unknown, 0 if it is fixed or free.
    pub movable: Vec<f64>,
}

/// The state of a curve's search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SlopesStanding {
    Running = 1,
    Converged,
    /// No step reduces the cost.
    Stalled,
    /// No step reduces the cost, because segments in that direction have no minimiser.
    Unattained,
    /// A segment has no minimiser at the start.
    Nowhere,
    /// The iterations ran out.
    Exhausted,
}

impl SlopesProblem {
    pub fn dots(&self) -> usize {
        self.movable.len()
    }

    /// The dot at the end of a segment.
    pub(super) fn after(&self, span: usize) -> usize {
        if span + 1 == self.dots() { 0 } else { span + 1 }
    }

    /// The end angles of a segment.
    pub(super) fn angles(&self, span: usize, turns: &[f64]) -> [f64; 2] {
        let [a, b] = self.spans[span].angles;
        [a + turns[span], b + turns[self.after(span)]]
    }

    /// The total cost of all segments, and its gradient.
    pub(super) fn sum(&self, evaluations: &[Evaluation<f64>]) -> (f64, Vec<f64>) {
        let mut cost = 0.0;
        let mut gradient = vec![0.0; self.dots()];
        for (k, (span, evaluation)) in self.spans.iter().zip(evaluations).enumerate() {
            cost += span.weight * evaluation.cost;
            gradient[k] += span.weight * evaluation.gradient[0];
            gradient[self.after(k)] += span.weight * evaluation.gradient[1];
        }
        (cost, gradient)
    }
}

/// The stages in which a curve's dots become movable.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stages {
    /// The stage of each dot. Empty if all are movable from the start.
    pub of_dots: Vec<usize>,
    /// The index of the last stage.
    pub last: usize,
}

/// The stopping criteria of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Until {
    /// The tolerance of the relative decrement.
    pub tolerance: f64,
    pub iterations: u32,
}

/// The result of a search.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outcome {
    /// The turns from the reference directions.
    pub turns: Vec<f64>,
    /// The cost in the units of the problem.
    pub cost: f64,
    /// √(gᵀH⁻¹g / cost)
    pub decrement: f64,
    /// `Running` only if the device was lost.
    pub standing: SlopesStanding,
    pub iterations: u32,
    pub evaluations: u32,
    /// The first segment without minimiser in the last trial that failed for this reason.
    pub culprit: Option<usize>,
}

impl Outcome {
    /// The outcome of a search that has not begun.
    pub fn unfinished(problem: &SlopesProblem) -> Self {
        Outcome {
            turns: vec![0.0; problem.dots()],
            cost: f64::INFINITY,
            decrement: f64::INFINITY,
            standing: SlopesStanding::Running,
            iterations: 0,
            evaluations: 0,
            culprit: None,
        }
    }
}
