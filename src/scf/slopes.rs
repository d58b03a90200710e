//! [`Search`]: Newton's method on the tangent angles of a curve. It minimises the sum of the costs
//! of all segments as a function of the directions at the dots.
//!
//! The gradient is the jump of the bending moment at every dot (times ν), and the Hessian is
//! tridiagonal, cyclic for closed curves. Unknowns are turns from reference directions, so that
//! small angles keep their digits. Steps minimise cost^{1/ν}, the ν-norm of the curvature, which
//! for large ν is much closer to a quadratic: Newton steps on a power ν reduce the error only by
//! the factor (ν − 2)/(ν − 1). A search only uses the evaluations of its segments, so plain
//! segments and segments under tension share it.

use super::evaluation::Evaluation;
use super::problem::{Outcome, SlopesProblem, Stages};
pub(crate) use super::problem::{SlopesStanding, Until};
use crate::damping::{Damping, Trial, Verdict};
use crate::linalg::Scalar;
use crate::linalg::banded::Banded;

/// The largest turn of a direction per step, in radians. Beyond a third of the distance to where
/// segments cease to exist the quadratic model is poor.
const MOST_TURN: f64 = 0.5;

/// Steps exceed Newton's by at most the factor (ν − 1) to this power.
///
/// For a pure power ν the full factor is ν − 1. Of the powers 0.3, ½, 0.7 and 1, tried with ν = 4
/// and 20, this one wastes the fewest trials.
/// Not in the kernel: the host gives it.
pub(super) const LONGEST: f64 = 0.3;

/// If steps with this damping, about 1e-4 of Newton's, still lead to segments without minimiser,
/// the descent ends at the edge of their domain.
const EDGE: f64 = 1e4;

/// A search for the tangent angles of one curve.
pub(crate) struct Search {
    pub problem: SlopesProblem,
    /// Turns from the reference directions.
    pub turns: Vec<f64>,
    pub cost: f64,
    /// √(gᵀH⁻¹g / cost), the relative Newton decrement.
    pub decrement: f64,
    pub standing: SlopesStanding,
    pub iterations: u32,
    pub evaluations: u32,
    /// The first segment without minimiser in the last trial that failed.
    pub culprit: Option<usize>,
    pub(super) trial: Vec<f64>,
    /// Whether the trial is the start of the search or of a stage.
    is_fresh: bool,
    stages: Stages,
    stage: usize,
    /// 1 if a direction is an unknown in this stage, else 0.
    movable: Vec<f64>,
    gradient: Vec<f64>,
    step: Vec<f64>,
    alpha: f64,
    slope: f64,
    /// The ratio of a Newton step on the root of the cost to one on the cost.
    stretch: f64,
    smallest: f64,
    damping: Damping<f64>,
    matrix: Banded<f64, 1>,
    diagonal: Vec<f64>,
    coupling: Vec<f64>,
    unattained: bool,
    /// The evaluations of all spans at `turns`, if spans are judged one by one.
    spans: Option<Vec<Evaluation<f64>>>,
}

/// If a span's cost changes by less than this fraction, the change is the mean of its two gradients
/// times the turn, because the difference of the costs has no digits left.
const CLOSE: f64 = 1e-9;

/// If the cost changes by less than this fraction, its root changes by ν⁻¹ of that.
const NEARLY: f64 = 1e-4;

/// The decrement at which a stage ends.
/// Not in the kernel: the host gives it.
pub(super) const ROUGHLY: f64 = 1e-3;

impl From<Search> for Outcome {
    fn from(search: Search) -> Self {
        let Search { turns, cost, decrement, standing, iterations, evaluations, culprit, .. } = search;
        Outcome { turns, cost, decrement, standing, iterations, evaluations, culprit }
    }
}

/// The cost at a trial.
struct Received {
    cost: f64,
    gradient: Vec<f64>,
    /// Whether all segments have a minimiser.
    exists: bool,
}

impl Search {
    /// Starts at the reference directions.
    pub fn new(problem: SlopesProblem) -> Self {
        let n = problem.dots();
        let zero = vec![0.0; n];
        Search {
            matrix: Banded::new(problem.closed, &[n]),
            movable: problem.movable.clone(),
            coupling: vec![0.0; problem.spans.len()],
            problem,
            trial: zero.clone(),
            turns: zero.clone(),
            cost: f64::INFINITY,
            decrement: f64::INFINITY,
            standing: SlopesStanding::Running,
            iterations: 0,
            evaluations: 0,
            culprit: None,
            is_fresh: true,
            stages: Stages::default(),
            stage: 0,
            gradient: zero.clone(),
            step: zero.clone(),
            alpha: 1.0,
            slope: 0.0,
            stretch: 1.0,
            smallest: 1.0,
            damping: Damping::new(),
            diagonal: zero,
            unattained: false,
            spans: None,
        }
    }

    /// Starts at other turns.
    pub fn turned(self, turns: Vec<f64>) -> Self {
        Search { trial: turns.clone(), turns, ..self }
    }

    /// Judges steps by the changes of single spans, and convergence by single dots. Their costs may
    /// differ by many orders of magnitude: for large ν the cost of a short span drowns those of its
    /// neighbours. Dots become movable in stages.
    pub fn by_span(self, stages: Stages) -> Self {
        let mut search = Search { spans: Some(Vec::new()), stages, ..self };
        search.release();
        search
    }

    /// Makes the dots of this stage movable.
    fn release(&mut self) {
        for (dot, &stage) in self.stages.of_dots.iter().enumerate() {
            self.movable[dot] = if stage <= self.stage { self.problem.movable[dot] } else { 0.0 };
        }
    }

    /// Begins the next stage, if there is one, from the current curve.
    fn loosen(&mut self) {
        if self.stage == self.stages.last {
            return;
        }
        self.stage += 1;
        self.release();
        self.trial.clone_from(&self.turns);
        self.is_fresh = true;
        self.standing = SlopesStanding::Running;
        (self.cost, self.decrement) = (f64::INFINITY, f64::INFINITY);
        (self.culprit, self.unattained) = (None, false);
        self.damping = Damping::new();
    }

    /// The change of the cost for a trial, summed over spans.
    fn change(&self, before: &[Evaluation<f64>], evaluations: &[Evaluation<f64>]) -> f64 {
        let problem = &self.problem;
        let mut sum = 0.0;
        for (k, (old, new)) in before.iter().zip(evaluations).enumerate() {
            let change = new.cost - old.cost;
            let change = if change.abs() > CLOSE * old.cost {
                change
            } else {
                let [first, last] = [k, problem.after(k)].map(|dot| self.trial[dot] - self.turns[dot]);
                0.5 * ((old.gradient[0] + new.gradient[0]) * first + (old.gradient[1] + new.gradient[1]) * last)
            };
            sum += problem.spans[k].weight * change;
        }
        sum
    }

    /// √(g H⁻¹g/cost), the largest value of any dot with its adjacent spans.
    fn decrement_by_dot(&self, spans: &[Evaluation<f64>]) -> f64 {
        let mut around = vec![0.0; self.turns.len()];
        for (k, (span, evaluation)) in self.problem.spans.iter().zip(spans).enumerate() {
            around[k] += span.weight * evaluation.cost;
            around[self.problem.after(k)] += span.weight * evaluation.cost;
        }
        let mut most = 0.0f64;
        for (dot, &cost) in around.iter().enumerate() {
            most = Scalar::max(most, (self.gradient[dot] * self.step[dot]).abs() / cost);
        }
        most.sqrt()
    }

    /// Takes the evaluations of all segments at the trial.
    pub(super) fn receive(&mut self, evaluations: &[Evaluation<f64>], until: &Until) {
        self.evaluations += 1;
        let missing = evaluations.iter().position(|evaluation| evaluation.exists <= 0.0);
        let (mut cost, mut gradient) = self.problem.sum(evaluations);
        for (g, &movable) in gradient.iter_mut().zip(&self.movable) {
            *g *= movable;
        }
        if missing.is_some() {
            cost = f64::INFINITY;
            self.culprit = missing;
        }
        let received = Received { cost, gradient, exists: missing.is_none() };
        match self.judge(&received, evaluations) {
            Verdict::Accept => self.accept(received, evaluations, until),
            Verdict::Again => self.aim(),
            Verdict::Fail => {}
        }
        if self.standing != SlopesStanding::Running {
            self.loosen();
        }
    }

    /// Decides whether to accept the trial.
    fn judge(&mut self, received: &Received, evaluations: &[Evaluation<f64>]) -> Verdict {
        let cost = received.cost;
        if self.is_fresh {
            if cost.is_finite() {
                return Verdict::Accept;
            }
            self.standing = SlopesStanding::Nowhere;
            return Verdict::Fail;
        }
        // In terms of the root of the cost, to which the Newton step belongs, relative to the
        // current curve.
        let share = 1.0 / self.problem.exponent;
        let root = (cost / self.cost).powf(1.0 / self.problem.exponent);
        let there = dot(&received.gradient, &self.step) * root / cost;
        let energies = match &self.spans {
            None => [1.0, root],
            Some(before) => {
                let part = self.change(before, evaluations) / self.cost;
                // If the root is too close to 1 for its digits, it is taken to first order.
                [0.0, if part.abs() < NEARLY { share * part } else { root - 1.0 }]
            }
        };
        let trial = Trial {
            smallest: self.smallest,
            slopes: [share * self.stretch * self.slope / self.cost, share * self.stretch * there],
            energies,
            alpha: self.alpha,
        };
        let verdict = self.damping.judge(&trial);
        if verdict == Verdict::Accept {
            self.iterations += 1;
            return verdict;
        }
        self.unattained |= !received.exists;
        let at_the_edge = !received.exists && self.damping.lambda > EDGE;
        if verdict == Verdict::Again && !at_the_edge {
            return verdict;
        }
        self.standing = if self.unattained { SlopesStanding::Unattained } else { SlopesStanding::Stalled };
        Verdict::Fail
    }

    /// Accepts the trial.
    fn accept(&mut self, received: Received, evaluations: &[Evaluation<f64>], until: &Until) {
        (self.is_fresh, self.unattained) = (false, false);
        if let Some(spans) = &mut self.spans {
            spans.clear();
            spans.extend_from_slice(evaluations);
        }
        (self.cost, self.gradient) = (received.cost, received.gradient);
        std::mem::swap(&mut self.turns, &mut self.trial);
        self.diagonal.fill(0.0);
        for (k, (span, evaluation)) in self.problem.spans.iter().zip(evaluations).enumerate() {
            let after = self.problem.after(k);
            self.diagonal[k] += span.weight * evaluation.hessian[0];
            self.coupling[k] = span.weight * evaluation.hessian[1];
            self.diagonal[after] += span.weight * evaluation.hessian[2];
        }
        self.aim();
        let square = -self.slope;
        let undamped = self.damping.lambda == 0.0 && self.smallest > 0.0;
        if undamped && square <= 0.0 && self.gradient.iter().all(|&g| g == 0.0) {
            // A minimum. A saddle, at which symmetric points may start, has a Hessian that is not
            // positive definite.
            self.decrement = 0.0;
            self.standing = SlopesStanding::Converged;
        } else if undamped {
            self.decrement = match &self.spans {
                None => (Scalar::max(square, 0.0) / self.cost).sqrt(),
                Some(spans) => self.decrement_by_dot(spans),
            };
            let is_last = self.stage == self.stages.last;
            let tolerance = if is_last { until.tolerance } else { until.tolerance.max(ROUGHLY) };
            if self.decrement <= tolerance {
                self.standing = SlopesStanding::Converged;
            }
        }
        if self.standing == SlopesStanding::Running && self.iterations >= until.iterations {
            self.standing = SlopesStanding::Exhausted;
        }
    }

    /// Factorises H + λ diag|H|. Returns whether it is positive definite.
    fn factor(&mut self) -> bool {
        let lambda = self.damping.lambda;
        self.matrix.clear();
        for (k, &d) in self.diagonal.iter().enumerate() {
            // A dot between straight segments has neither stiffness nor moment.
            let d = if d == 0.0 { 1.0 } else { d + lambda * d.abs() };
            self.matrix.add_diagonal(k, d);
        }
        for (k, &c) in self.coupling.iter().enumerate() {
            // Rows of a cyclic matrix continue: the last segment leads to row n, which is row 0.
            self.matrix.add_entry(k + 1, k, c);
        }
        self.smallest = self.matrix.factor(&self.movable);
        self.smallest > 0.0
    }

    /// Computes the next step, −(H + λ diag|H|)⁻¹ g, and its trial.
    fn aim(&mut self) {
        while !self.factor() && self.damping.stiffen() {}
        let mut p: Vec<[f64; 1]> = self.gradient.iter().map(|&g| [-g]).collect();
        self.matrix.solve(&mut p);
        let mut most = 0.0f64;
        for (step, [p]) in self.step.iter_mut().zip(p) {
            *step = p;
            most = Scalar::max(most, p.abs());
        }
        self.slope = dot(&self.gradient, &self.step);
        // Newton's step on cost^{1/ν} is longer than that on the cost by the factor 1/(1 − (1 −
        // 1/ν) gᵀH⁻¹g/cost).
        let exponent = self.problem.exponent;
        let left = 1.0 + (1.0 - 1.0 / exponent) * self.slope / self.cost;
        let least = (exponent - 1.0).max(1.0).powf(-LONGEST);
        self.stretch = 1.0 / Scalar::max(left, least);
        let most = self.stretch * most;
        self.alpha = if most > MOST_TURN { MOST_TURN / most } else { 1.0 };
        let along = self.alpha * self.stretch;
        for (k, &step) in self.step.iter().enumerate() {
            self.trial[k] = self.turns[k] + along * step;
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (&a, &b)| sum + a * b)
}
