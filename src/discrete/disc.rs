//! [`Discs`]: the discs around the data points of one curve, and the multipliers that keep it inside.
//!
//! Wanted is the least energy with (|f_i − p_i|² − D²)/2 ≤ 0 at every data point p_i. The method of
//! multipliers descends the energy and the walls of [`Hold`] for multipliers y, takes ρs of each wall as
//! the next, and repeats. Where a curve touches its disc, y D is the force that holds it there.
//! Everywhere else y is 0.
//!
//! A vertex could slide along its curve for nothing, or to make a taut span short. Rails across the curve
//! keep it from that. They lie along the tangents where the curve stands after the first rounds.
//!
//! Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex programming*
//! (1973). The rails are faircurve's.

use super::curves::Vertices;
use super::deviation::deviation;
use super::energy::Hold;
use super::fair::{Fair, Pins};
use super::lane::Standing;
use super::problem::{Outcome, Problem};
use super::setup::{LONGEST, Ready, distance, set_up_pieces};
use super::untangle::{ROUNDS, message};
use crate::batch::CurveBatch;
use crate::linalg::scalar::{Vector, add, dot, scale};
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// The discs are smaller than the deviation by this much at least, in its units.
///
/// Curves come to the edges of their discs from outside.
const MARGIN: f64 = 1e-4;

/// The rounding of a vertex in f64 and in f32, at size 1. Margins are no smaller.
const ROUNDING: [f64; 2] = [1e-11, 1e-5];

/// With a larger margin the deviation is next to rounding, and the curve goes through its points.
const MOST_MARGIN: f64 = 0.1;

/// The violation of a curve that is done, in units of D² and of its margin.
const ENOUGH: f64 = 0.8;

/// ρD² in units of w/h^(2m − 1), the stiffness of the spans beside the point.
const FIRM: f64 = 10.0;

/// The factor of ρ after a round that did not divide the violation by [`SLOW`].
const FIRMER: f64 = 10.0;

/// See [`FIRMER`].
const SLOW: f64 = 4.0;

/// The stiffness of rails in units of ρD².
///
/// Of the 594 borders of countries-110m 2 do not converge at a deviation of 0.2. With 10 these are 17, and
/// with 1000 they are 6.
const RAILS: f64 = 100.0;

/// Rails are laid anew after each of so many rounds.
///
/// With 0, vertices come together where the curve has turned since, and some 30 of those borders do not converge.
/// Laid anew in every round, rails follow corners that follow the rails.
const LAYING: u32 = 2;

/// The most rounds. Eight are common.
const MOST_ROUNDS: u32 = 30;

/// The most iterations of a round but for the last. Three are common.
const ROUND_ITERATIONS: u32 = 100;

/// The tolerance of the first round. With more a border's first curve swings out.
const FIRST: f64 = 0.1;

/// The largest tolerance of later rounds. 592 of 594 borders converge with 1.0, 591 with 0.3, 590 with 0.1.
const ROUGHLY: f64 = 1.0;

/// The tolerance of the next round in units of √(E/n) v, for n vertices and the violation v.
const OF_VIOLATION: f64 = 1.0;

/// A span that is this many times as long as its own chord, and longer by the deviation, has swung out.
///
/// Half a circle is 1.57 times as long as its chord, and two thirds of a circle 2.42 times. Among borders, spans from
/// 1.9 times on are loops.
const SWUNG_OUT: f64 = 2.0;

/// The discs of a curve.
#[derive(Clone)]
pub(super) struct Discs<const D: usize> {
    /// The number of the curve.
    curve: usize,
    /// The deviation asked for, and that which the curve may use, in units of the input.
    asked: f64,
    allowed: f64,
    /// See [`MARGIN`].
    margin: f64,
    /// The radius of every disc, at size 1.
    radius: f64,
    /// The multiplier of every attached vertex.
    multipliers: Vec<f64>,
    /// The method's tolerance.
    tolerance: f64,
    violation: f64,
    rounds: u32,
    /// All descents so far.
    outcome: Option<Outcome<D>>,
    has_ended: bool,
    /// Spans that crossed where the points do not, and were drawn tauter.
    tauter: Vec<usize>,
    /// The curve before spans were drawn tauter, how often they were, and all descents until then.
    before: Option<Box<(Problem<D>, u32, Outcome<D>)>>,
}

impl<const D: usize> Discs<D> {
    /// The discs of curve `i`, which is made ready for the first round.
    ///
    /// `asked` is the deviation, and `allowed` what the curve may use of it without vanishing.
    pub fn around(
        ready: &mut Ready<D>,
        held: &Fair,
        [asked, allowed]: [f64; 2],
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
        // Curves may leave their points on all sides.
        let longest = LONGEST * (chords + std::f64::consts::TAU * allowed) / ready.size;
        problem.longest = if problem.longest.is_finite() { longest } else { problem.longest };
        // A curve has room between its points, and in its discs.
        problem.taut.iter_mut().for_each(|taut| *taut /= 1.0 + *taut * square);
        problem.tolerance = FIRST.max(held.tolerance);
        let order = held.energy.order() as i32;
        let beside = spans_beside(&ready.rows, problem);
        for (attached, h) in problem.attached.iter_mut().zip(beside) {
            attached.stiffness = FIRM * problem.highest * h.powi(1 - 2 * order);
            attached.hold = Hold { wall: attached.stiffness / square, reach: square, ..Hold::NONE };
        }
        lay_rails(problem);
        Discs {
            curve: i,
            asked,
            allowed,
            margin,
            radius,
            multipliers: vec![0.0; problem.attached.len()],
            tolerance: held.tolerance,
            violation: f64::INFINITY,
            rounds: 0,
            outcome: None,
            has_ended: false,
            tauter: vec![],
            before: None,
        }
    }

    /// The number of the curve.
    pub fn curve(&self) -> usize {
        self.curve
    }

    /// Whether it needs no more rounds.
    pub fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// The most iterations of the next round.
    pub fn most_iterations(&self, held: &Fair) -> u32 {
        if self.is_settled() { held.max_iterations } else { held.max_iterations.min(ROUND_ITERATIONS) }
    }

    /// Whether the multipliers are known well enough for a descent to the method's tolerance.
    pub fn is_settled(&self) -> bool {
        self.violation <= ENOUGH * self.margin
    }

    /// Records a round, and makes the curve ready for the next one.
    pub fn take(&mut self, ready: &mut Ready<D>, outcome: Outcome<D>) {
        self.rounds += 1;
        let problem = &mut ready.problem;
        let (standing, was_exact) = (outcome.standing, problem.tolerance <= self.tolerance);
        problem.rebase(&outcome.displacements);
        let energy = outcome.energy - problem.energy_of_holds();
        let outcome = Outcome { energy, ..outcome };
        match &mut self.outcome {
            Some(own) => own.go_on(outcome),
            None => self.outcome = Some(outcome),
        }
        if !matches!(standing, Standing::Converged | Standing::Exhausted | Standing::Stalled) {
            self.has_ended = true;
            return;
        }
        self.press(problem);
        if self.rounds <= LAYING {
            lay_rails(problem);
        }
        let is_done = self.is_settled() && was_exact;
        self.has_ended = is_done || self.rounds == MOST_ROUNDS;
        if self.has_ended {
            self.untangle(ready, is_done && standing == Standing::Converged);
            return;
        }
        let by_violation = OF_VIOLATION * (energy / ready.vertices.len() as f64).sqrt() * self.violation.min(1.0);
        problem.tolerance = if self.is_settled() { 0.0 } else { by_violation.min(ROUGHLY) }.max(self.tolerance);
    }

    /// Takes the next multipliers, where the curve stands at its base.
    pub fn press(&mut self, problem: &mut Problem<D>) {
        let before = self.violation;
        self.violation = self.multiply(problem);
        if !self.is_settled() && self.violation * SLOW > before {
            problem.attached.iter_mut().for_each(|attached| {
                attached.hold.wall *= FIRMER;
                attached.stiffness *= FIRMER;
            });
        }
        let square = self.radius * self.radius;
        for (attached, multiplier) in problem.attached.iter_mut().zip(&self.multipliers) {
            attached.hold.reach = square - 2.0 * multiplier / attached.hold.wall;
        }
    }

    /// The largest violation of a disc, or of its multiplier, in units of D².
    pub fn violation(&self) -> f64 {
        self.violation
    }

    /// All descents so far.
    pub fn outcome(&self) -> &Outcome<D> {
        self.outcome.as_ref().expect("a curve that has ended has descended")
    }

    /// Appends descents that went on from where the curve stood.
    pub fn go_on(&mut self, outcome: Outcome<D>) {
        self.outcome.as_mut().expect("a curve that has ended has descended").go_on(outcome);
    }

    /// Goes on with narrower spans where the curve found crosses itself and its points do not, as
    /// [`untangle`](super::untangle) does, or back to the curve before that if it did not converge since.
    fn untangle(&mut self, ready: &mut Ready<D>, has_converged: bool) {
        let Some(outcome) = &mut self.outcome else { return };
        if !has_converged {
            if let Some(before) = self.before.take() {
                let iterations = outcome.iterations;
                let (problem, _, mut found) = *before;
                found.iterations = iterations;
                (ready.problem, *outcome, self.violation) = (problem, found, 0.0);
                self.tauter.clear();
            }
            return;
        }
        let times = self.before.as_ref().map_or(0, |before| before.1);
        if D != 2 || ready.problem.taut.is_empty() || times as usize == ROUNDS {
            return;
        }
        let spans = ready.tangled(outcome);
        if spans.is_empty() {
            return;
        }
        let before = (ready.problem.clone(), times + 1, outcome.clone());
        if ready.narrow(&spans) {
            self.before.get_or_insert(Box::new(before)).1 = times + 1;
            self.tauter.extend(spans);
            (self.has_ended, self.rounds, self.violation) = (false, 0, f64::INFINITY);
            ready.problem.tolerance = ROUGHLY.max(self.tolerance);
        }
    }

    /// Takes the next multipliers, and returns the largest violation, in units of D².
    ///
    /// A multiplier of a curve inside of its disc violates too: it must be 0.
    fn multiply(&mut self, problem: &Problem<D>) -> f64 {
        let square = self.radius * self.radius;
        let mut violation = 0.0f64;
        for (attached, multiplier) in problem.attached.iter().zip(&mut self.multipliers) {
            let outside = 0.5 * (dot(attached.target, attached.target) - square);
            violation = violation.max(outside.max(-*multiplier / attached.hold.wall).abs() / square);
            *multiplier = attached.hold.wall * attached.hold.beyond(attached.target);
        }
        violation
    }

    /// The report of a curve that has ended, and its vertices.
    pub fn report(self, mut ready: Ready<D>, held: &Fair, batch: &CurveBatch) -> (CurveReport, Option<Vertices>) {
        let (i, is_settled) = (self.curve, self.is_settled());
        let outcome = self.outcome.expect("a curve that has ended has descended");
        let vertices = ready.vertices_of(&outcome);
        let found = deviation(&vertices, &ready.rows, batch.points(i).as_chunks::<D>().0);
        let keeps = found <= self.asked && outcome.standing != Standing::Unbounded;
        if !keeps || has_swung_out(&vertices, &ready.rows, self.allowed) {
            return ready.left_as_it_is(held, batch, i, self.asked, outcome.iterations);
        }
        ready.problem.tolerance = self.tolerance;
        let (mut report, vertices) = held.report(batch, i, &ready, &outcome);
        if report.status == CurveStatus::Converged {
            let (asked, allowed) = (self.asked, self.allowed);
            if !is_settled {
                report.status = CurveStatus::NotConverged;
                let what = format!(
                    "it keeps the deviation of {asked}, but {} rounds did not tell how near to each point the fairest curve is: {}",
                    self.rounds,
                    held.remedy()
                );
                report.message = Some(batch.sentence(i, 0, &what));
            } else if !self.tauter.is_empty() {
                let mut spans = self.tauter;
                spans.sort_unstable();
                spans.dedup();
                report.message = Some(batch.sentence(i, spans[0], &message(&spans)));
            } else if self.margin > MOST_MARGIN {
                let what =
                    format!("a deviation of {asked} is next to rounding here: the curve goes through its points");
                report.message = Some(batch.sentence(i, 0, &what));
            } else if allowed < asked {
                let what = format!(
                    "the curve is so small that it could vanish within {asked} of its points: it stays within {allowed:.3e}"
                );
                report.message = Some(batch.sentence(i, 0, &what));
            }
        }
        (report, vertices)
    }
}

/// The spline through the points, with all of them pinned.
fn through_its_points<const D: usize>(held: &Fair, batch: &CurveBatch, i: usize) -> Option<Ready<D>> {
    let pinned = Fair { pins: Pins::All, ..held.clone() };
    set_up_pieces::<D>(&pinned, &batch.select(&[i]), &[]).ok()?.pop()?.ok()
}

/// The mean length of the spans beside every attached vertex.
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

/// Lays rails along the tangents of the curve where it stands.
fn lay_rails<const D: usize>(problem: &mut Problem<D>) {
    let Problem { base, attached, closed, .. } = problem;
    for attached in attached {
        let row = attached.row as usize;
        let before = base[if row > 0 || !*closed { row.saturating_sub(1) } else { base.len() - 1 }];
        let after = base.get(row).copied().unwrap_or(before);
        let [s, t] = [before, after].map(|edge| dot(edge, edge).sqrt());
        let along = add(scale(1.0 / s, before), scale(1.0 / t, after));
        // Edges that turn back have no tangent in common.
        let length = dot(along, along).sqrt().max(f64::MIN_POSITIVE);
        attached.hold.rail = scale((RAILS * attached.stiffness).sqrt() / length, along);
        attached.hold.place = -dot(attached.hold.rail, attached.target);
    }
}

/// Whether a span between data points has become a loop.
fn has_swung_out<const D: usize>(vertices: &[Vector<f64, D>], rows: &[u32], allowed: f64) -> bool {
    let at = |row: u32| vertices[row as usize % vertices.len()];
    let length = |from: u32, to: u32| (from..to).map(|row| distance(at(row), at(row + 1))).sum::<f64>();
    rows.windows(2).any(|ends| length(ends[0], ends[1]) > SWUNG_OUT * distance(at(ends[0]), at(ends[1])) + allowed)
}
