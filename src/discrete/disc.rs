//! [`Discs`]: the discs around the data points of one curve, with the multipliers that keep it
//! inside.
//!
//! The constraints are (D² − |f_i − p_i|²)/2 ≥ 0 at every data point p_i. Their penalties are terms
//! of [`Anchor`]. If the curve touches a disc, y D is the force that holds it there.
//!
//! A vertex could slide along its curve without cost, or to shorten a taut span. Tangential anchors
//! prevent this. They lie along the curve's tangents after the first rounds, and lead each vertex to the
//! place where the curve is nearest to the data point: (f − p)·T = 0. There they exert no force, and the
//! curve is the fairest within D of the points, at whatever vertex. They are faircurve's.

use super::energy::Anchor;
use super::fair::{Fair, Pins};
use super::multipliers::Multipliers;
use super::problem::Problem;
use super::setup::{LONGEST, PreparedCurve, set_up_on_spline};
use crate::batch::CurveBatch;
use crate::linalg::scalar::{Vector, add, dot, scale};

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

/// Tangential anchors are reset after each of this many first rounds, where vertices keep their places and
/// where they slide.
///
/// With 0, vertices bunch where the curve has turned since, and some 30 of those borders do not
/// converge. If anchors of held vertices were reset in every round, they and the corners would follow each
/// other.
const LAYING: [u32; 2] = [2, 10];

/// The length below which the ends of a span do not slide towards each other, as a fraction of the span's
/// length at the start.
///
/// Discs that overlap may have their nearest vertices in the other order. Without a least length, 50 of
/// those borders do not converge.
const LEAST_LENGTH: f64 = 0.5;

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
    /// The least length of each span, if its ends slide along the curve.
    least: Option<Vec<f64>>,
    /// The vertex indices at the ends of each span.
    rows: Vec<u32>,
    /// The spans before and after every attached vertex.
    beside: Vec<[Option<usize>; 2]>,
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
        slides: bool,
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
        let lengths = span_lengths(&ready.rows, problem);
        for (attached, spans) in problem.attached.iter_mut().zip(&beside) {
            let spans = spans.iter().flatten();
            let h = spans.clone().map(|&span| lengths[span]).sum::<f64>() / spans.count() as f64;
            attached.stiffness = INITIAL_PENALTY * problem.highest * h.powi(1 - 2 * order);
            attached.anchor = Anchor { stiffness: attached.stiffness / square, reach: square, ..Anchor::NONE };
        }
        let multipliers = vec![0.0; problem.attached.len()];
        let least = slides.then(|| lengths.iter().map(|length| LEAST_LENGTH * length).collect());
        let (violation, rows) = (f64::INFINITY, ready.rows.clone());
        let discs = Discs { margin, radius, multipliers, violation, rounds: 0, least, rows, beside };
        discs.lay_rails(problem);
        discs
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

    /// Sets tangential anchors along the tangents of the current curve, each towards the vertex at which
    /// the curve is nearest to the data point. Spans keep their least lengths.
    fn lay_rails<const D: usize>(&self, problem: &mut Problem<D>) {
        let lengths = span_lengths(&self.rows, problem);
        let room = |span: usize| self.least.as_ref().map_or(0.0, |least| 0.5 * (lengths[span] - least[span]).max(0.0));
        let Problem { base, attached, closed, .. } = problem;
        for (attached, spans) in attached.iter_mut().zip(&self.beside) {
            let row = attached.row as usize;
            let before = base[if row > 0 || !*closed { row.saturating_sub(1) } else { base.len() - 1 }];
            let after = base.get(row).copied().unwrap_or(before);
            let [s, t] = [before, after].map(|edge| dot(edge, edge).sqrt());
            let along = add(scale(1.0 / s, before), scale(1.0 / t, after));
            // Edges that turn back on each other have no common tangent.
            let length = dot(along, along).sqrt().max(f64::MIN_POSITIVE);
            let tangent = scale(1.0 / length, along);
            let way = dot(tangent, attached.target);
            let shift = match *spans {
                [Some(before), Some(after)] => way.clamp(-room(before), room(after)),
                _ => 0.0,
            };
            let stiffness = (TANGENTIAL_STIFFNESS * attached.stiffness).sqrt();
            attached.anchor.tangent = scale(stiffness, tangent);
            attached.anchor.along = stiffness * (shift - way);
        }
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
        if self.rounds <= LAYING[usize::from(self.least.is_some())] {
            self.lay_rails(problem);
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

/// The length of every span at the base.
fn span_lengths<const D: usize>(rows: &[u32], problem: &Problem<D>) -> Vec<f64> {
    let length = |edge: &Vector<f64, D>| dot(*edge, *edge).sqrt();
    let span = |ends: &[u32]| problem.base[ends[0] as usize..ends[1] as usize].iter().map(length).sum();
    rows.windows(2).map(span).collect()
}

/// The spans before and after every attached vertex, as far as there are any.
fn spans_beside<const D: usize>(rows: &[u32], problem: &Problem<D>) -> Vec<[Option<usize>; 2]> {
    let mut beside = vec![[None; 2]; problem.vertices()];
    // Spans between repeated points have no edge.
    for (span, ends) in rows.windows(2).enumerate().filter(|(_, ends)| ends[0] < ends[1]) {
        beside[ends[1] as usize % problem.vertices()][0] = Some(span);
        beside[ends[0] as usize][1] = Some(span);
    }
    problem.attached.iter().map(|attached| beside[attached.row as usize]).collect()
}
