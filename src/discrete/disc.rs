//! [`Discs`]: the discs around the data points of one curve, with the multipliers that keep it
//! inside.
//!
//! The constraints are (D² − |f_i − p_i|²)/2 ≥ 0 at every data point p_i. Their penalties are terms
//! of [`Anchor`]. If the curve touches a disc, y D is the force that holds it there.
//!
//! A vertex could slide along its curve without cost, or to shorten a taut span. Tangential anchors
//! prevent this. They lie along the curve's tangents after the first rounds. They are faircurve's.

use super::energy::Anchor;
use super::fair::{Fair, Pins};
use super::multipliers::Multipliers;
use super::problem::Problem;
use super::setup::{LONGEST, PreparedCurve, set_up_on_spline};
use crate::batch::CurveBatch;
use crate::linalg::scalar::{add, dot, scale};

/// The margin by which discs are smaller than the deviation, in units of the deviation.
///
/// Iterates approach the boundary of their discs from outside.
const MARGIN: f64 = 1e-4;

/// The rounding of a vertex at size 1, in f64 and in f32. Margins are at least this large.
const ROUNDING: [f64; 2] = [1e-11, 1e-5];

/// With a larger margin the deviation is close to rounding, and the curve interpolates its points.
const MOST_MARGIN: f64 = 0.1;

/// The violation at which multipliers are settled, in units of D² times the margin.
const FEASIBILITY_TOLERANCE: f64 = 0.8;

/// The initial ρD² in units of w/h^(2m − 1), the stiffness of the adjacent spans.
const INITIAL_PENALTY: f64 = 10.0;

/// The factor by which ρ grows after a round that did not reduce the violation by the factor
/// [`SLOW`].
const PENALTY_GROWTH: f64 = 10.0;

/// See [`PENALTY_GROWTH`].
const SLOW: f64 = 4.0;

/// The stiffness of tangential anchors in units of ρD².
///
/// Of the 594 borders of countries-110m, 2 do not converge at a deviation of 0.2. With 10 instead
/// of 100 these are 17, and with 1000 they are 6.
const TANGENTIAL_STIFFNESS: f64 = 100.0;

/// Tangential anchors are reset after each of this many first rounds.
///
/// With 0, vertices bunch where the curve has turned since, and some 30 of those borders do not
/// converge. If anchors were reset in every round, they and the corners would follow each other.
const LAYING: u32 = 2;

/// The discs of a curve, with their multipliers.
#[derive(Clone)]
pub(super) struct Discs {
    /// See [`MARGIN`].
    pub margin: f64,
    /// The radius of every disc, at size 1.
    radius: f64,
    /// The multiplier of every attached vertex.
    multipliers: Vec<f64>,
    violation: f64,
    rounds: u32,
}

impl Discs {
    /// The discs of curve `i`. Prepares the curve for the first round.
    ///
    /// `allowed` is the deviation that the curve may use without vanishing.
    pub fn around<const D: usize>(
        ready: &mut PreparedCurve<D>,
        held: &Fair,
        allowed: f64,
        in_f32: bool,
        batch: &CurveBatch,
        i: usize,
    ) -> Self {
        let margin = MARGIN.max(ROUNDING[usize::from(in_f32)] * ready.size / allowed);
        if margin > MOST_MARGIN
            && let Some(through) = through_its_points(held, batch, i)
        {
            *ready = through;
        }
        let radius = allowed / ready.size * (1.0 - margin);
        let square = radius * radius;
        let chords: f64 = batch.chords(i).sum();
        let problem = &mut ready.problem;
        // A curve may pass its points on any side.
        let longest = LONGEST * (chords + std::f64::consts::TAU * allowed) / ready.size;
        problem.longest = if problem.longest.is_finite() { longest } else { problem.longest };
        // The width of a span grows by the room within the discs.
        problem.taut.iter_mut().for_each(|taut| *taut /= 1.0 + *taut * square);
        let order = held.energy.order() as i32;
        let beside = spans_beside(&ready.rows, problem);
        for (attached, h) in problem.attached.iter_mut().zip(beside) {
            attached.stiffness = INITIAL_PENALTY * problem.highest * h.powi(1 - 2 * order);
            attached.anchor = Anchor { stiffness: attached.stiffness / square, reach: square, ..Anchor::NONE };
        }
        lay_rails(problem);
        let multipliers = vec![0.0; problem.attached.len()];
        Discs { margin, radius, multipliers, violation: f64::INFINITY, rounds: 0 }
    }

    /// Whether the multipliers are accurate enough for a descent to the method's tolerance.
    pub fn is_settled(&self) -> bool {
        self.violation <= FEASIBILITY_TOLERANCE * self.margin
    }

    /// Whether the deviation is close to rounding, so that the curve interpolates its points.
    pub fn are_points(&self) -> bool {
        self.margin > MOST_MARGIN
    }

    /// Marks the multipliers as settled.
    pub fn settle(&mut self) {
        self.violation = 0.0;
    }

    /// Restarts the rounds with the same multipliers.
    pub fn begin_again(&mut self) {
        (self.rounds, self.violation) = (0, f64::INFINITY);
    }

    /// Updates the multipliers, and returns the largest violation in units of D².
    fn multiply<const D: usize>(&mut self, problem: &Problem<D>) -> f64 {
        let square = self.radius * self.radius;
        let mut violation = 0.0f64;
        for (attached, multiplier) in problem.attached.iter().zip(&mut self.multipliers) {
            let outside = 0.5 * (dot(attached.target, attached.target) - square);
            violation = violation.max(outside.max(-*multiplier / attached.anchor.stiffness).abs() / square);
            *multiplier = attached.anchor.stiffness * attached.anchor.beyond(attached.target);
        }
        violation
    }
}

impl<const D: usize> Multipliers<D> for Discs {
    fn update(&mut self, problem: &mut Problem<D>) {
        self.rounds += 1;
        let before = self.violation;
        self.violation = self.multiply(problem);
        if !Discs::is_settled(self) && self.violation * SLOW > before {
            for attached in &mut problem.attached {
                attached.anchor.stiffness *= PENALTY_GROWTH;
                attached.stiffness *= PENALTY_GROWTH;
            }
        }
        let square = self.radius * self.radius;
        for (attached, multiplier) in problem.attached.iter_mut().zip(&self.multipliers) {
            attached.anchor.reach = square - 2.0 * multiplier / attached.anchor.stiffness;
        }
        if self.rounds <= LAYING {
            lay_rails(problem);
        }
    }

    fn violation(&self) -> f64 {
        self.violation
    }

    fn is_settled(&self) -> bool {
        Discs::is_settled(self)
    }

    fn energy(&self, problem: &Problem<D>) -> f64 {
        problem.energy_of_holds()
    }
}

/// The spline through the points, with all points pinned.
fn through_its_points<const D: usize>(held: &Fair, batch: &CurveBatch, i: usize) -> Option<PreparedCurve<D>> {
    let pinned = Fair { pins: Pins::All, ..held.clone() };
    set_up_on_spline(&pinned, batch, i, [false; 2]).ok()
}

/// The mean length of the spans adjacent to every attached vertex.
fn spans_beside<const D: usize>(rows: &[u32], problem: &Problem<D>) -> Vec<f64> {
    let lengths: Vec<f64> = problem.base.iter().map(|edge| dot(*edge, *edge).sqrt()).collect();
    let mut beside = vec![(0.0, 0.0); problem.vertices()];
    // Spans between repeated points have no edge.
    for ends in rows.windows(2).filter(|ends| ends[0] < ends[1]) {
        let length: f64 = lengths[ends[0] as usize..ends[1] as usize].iter().sum();
        for &row in ends {
            let (sum, sides) = &mut beside[row as usize % problem.vertices()];
            (*sum, *sides) = (*sum + length, *sides + 1.0);
        }
    }
    let mean = |row: u32| beside[row as usize].0 / beside[row as usize].1;
    problem.attached.iter().map(|attached| mean(attached.row)).collect()
}

/// Sets tangential anchors along the tangents of the current curve.
fn lay_rails<const D: usize>(problem: &mut Problem<D>) {
    let Problem { base, attached, closed, .. } = problem;
    for attached in attached {
        let row = attached.row as usize;
        let before = base[if row > 0 || !*closed { row.saturating_sub(1) } else { base.len() - 1 }];
        let after = base.get(row).copied().unwrap_or(before);
        let [s, t] = [before, after].map(|edge| dot(edge, edge).sqrt());
        let along = add(scale(1.0 / s, before), scale(1.0 / t, after));
        // Edges that turn back on each other have no common tangent.
        let length = dot(along, along).sqrt().max(f64::MIN_POSITIVE);
        attached.anchor.tangent = scale((TANGENTIAL_STIFFNESS * attached.stiffness).sqrt() / length, along);
        attached.anchor.along = -dot(attached.anchor.tangent, attached.target);
    }
}
