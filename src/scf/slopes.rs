//! Newton's method on the slopes of a chunk of curves: Σ cost over all segments, as a function of
//! the directions at the dots.
//!
//! The gradient is the jump of the bending moment at every dot (times ν), the Hessian is
//! tridiagonal, cyclic for closed curves. Unknowns are turns from reference directions, so that
//! small angles keep their digits. Steps are those of cost^{1/ν}, the ν-norm of the curvature,
//! which for large ν is far closer to a quadratic: Newton's own steps on a power ν shrink what is
//! left by (ν − 2)/(ν − 1) only. All curves of a chunk advance together, a trial a tick: first
//! their segments are evaluated side by side in vector lanes, whichever curve they belong to, then
//! every curve judges its trial, and solves for its next step. What a curve does depends on nothing
//! but itself.

use super::evaluation::Evaluation;
use crate::damping::{Damping, Trial, Verdict};
use crate::linalg::banded::Banded;
use crate::linalg::{Real, Scalar};

/// No direction turns by more than this in a step, in radians: further than a third of the way to
/// where segments cease to exist the quadratic model says little.
const MOST_TURN: f64 = 0.5;

/// Steps are longer than Newton's own by (ν − 1) to this power at most. Of a pure power ν the whole
/// way would be ν − 1; of the powers 0.3, ½, 0.7 and 1 tried, with ν = 4 and 20, this one wastes
/// the fewest trials. Not in the kernel: the host gives it.
pub(super) const LONGEST: f64 = 0.3;

/// Where steps damped by so much, some 1e-4 of Newton's, lead to segments without minimiser still,
/// the way down ends at an edge.
const EDGE: f64 = 1e4;

/// What is known of a segment's ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ends {
    /// Both directions are unknowns, or fixed.
    Directed,
    /// The first direction is free: the curve starts straight, without moment.
    FreeStart,
    /// The last is.
    FreeEnd,
    /// Both are: the segment is straight.
    Straight,
}

impl Ends {
    /// Between two directions, NaN where they are free.
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
pub(crate) struct Span<T> {
    /// Angles of the reference directions at its ends from its chord.
    pub angles: [T; 2],
    /// Its chord length to the power 1 − ν, in units of the curve.
    pub weight: T,
    /// Which of the universal curves it is a piece of.
    pub curve: u16,
    pub ends: Ends,
}

/// The slopes of a curve through n dots: n − 1 segments, closed n.
#[derive(Clone, Debug)]
pub(crate) struct SlopesProblem<T> {
    pub closed: bool,
    /// ν, the largest where it differs from segment to segment.
    pub exponent: f64,
    pub spans: Vec<Span<T>>,
    /// 1 where a direction is an unknown, 0 where it is fixed or free.
    pub movable: Vec<T>,
}

/// How a curve's search goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SlopesStanding {
    Running = 1,
    Converged,
    /// No step leads down.
    Stalled,
    /// No step leads down, since segments that lead down have no minimiser.
    Unattained,
    /// Where it started already, a segment has no minimiser.
    Nowhere,
    /// Iterations ran out.
    Exhausted,
}

/// A curve on its way.
pub(crate) struct Search<T: Real + Scalar> {
    pub problem: SlopesProblem<T>,
    /// Turns from the reference directions.
    pub turns: Vec<T>,
    pub cost: T,
    /// √(gᵀH⁻¹g / cost): Newton's decrement, relative, dimensionless.
    pub decrement: T,
    pub standing: SlopesStanding,
    pub iterations: u32,
    pub evaluations: u32,
    /// The first segment that had no minimiser in the last trial that failed.
    pub culprit: Option<usize>,
    gradient: Vec<T>,
    step: Vec<T>,
    pub(super) trial: Vec<T>,
    alpha: T,
    slope: T,
    /// How much longer than Newton's step of the cost that of its root is.
    stretch: T,
    smallest: T,
    damping: Damping<T>,
    matrix: Banded<T, 1>,
    diagonal: Vec<T>,
    coupling: Vec<T>,
    unattained: bool,
    /// What spans cost, with derivatives, where they are judged one by one.
    spans: Option<Vec<Evaluation<T>>>,
}

/// A span's cost that changes by less than this part of itself changes by the mean of its slopes
/// times the turn: the difference of two costs has no digits there.
const CLOSE: f64 = 1e-9;

/// A cost's root that changes by less than this part of itself changes by ν⁻¹ of the cost's change.
const NEARLY: f64 = 1e-4;

/// What became of a search.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outcome {
    /// From the reference directions.
    pub turns: Vec<f64>,
    /// In the units of the problem.
    pub cost: f64,
    /// √(gᵀH⁻¹g / cost)
    pub decrement: f64,
    /// `Running` only where the device was lost.
    pub standing: SlopesStanding,
    pub iterations: u32,
    pub evaluations: u32,
    /// The first segment that had no minimiser in the last trial that failed for it.
    pub culprit: Option<usize>,
}

impl From<Search<f64>> for Outcome {
    fn from(search: Search<f64>) -> Self {
        let Search { turns, cost, decrement, standing, iterations, evaluations, culprit, .. } = search;
        Outcome { turns, cost, decrement, standing, iterations, evaluations, culprit }
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Until {
    /// Of the relative decrement.
    pub tolerance: f64,
    pub iterations: u32,
}

impl<T: Real + Scalar<Number = T>> SlopesProblem<T> {
    fn dots(&self) -> usize {
        self.movable.len()
    }

    /// The dot a segment leads to.
    pub(super) fn after(&self, span: usize) -> usize {
        if span + 1 == self.dots() { 0 } else { span + 1 }
    }
}

impl<T: Real + Scalar<Number = T>> Search<T> {
    /// Starts at the reference directions, turned.
    pub fn new(problem: SlopesProblem<T>, turns: Vec<T>) -> Self {
        let n = problem.dots();
        let zero = vec![T::of(0.0); n];
        let spans = problem.spans.len();
        Search {
            matrix: Banded::new(problem.closed, &[n]),
            problem,
            trial: turns.clone(),
            turns,
            cost: T::of(f64::INFINITY),
            decrement: T::of(f64::INFINITY),
            standing: SlopesStanding::Running,
            iterations: 0,
            evaluations: 0,
            culprit: None,
            gradient: zero.clone(),
            step: zero.clone(),
            alpha: T::of(1.0),
            slope: T::of(0.0),
            stretch: T::of(1.0),
            smallest: T::of(1.0),
            damping: Damping::new(),
            diagonal: zero,
            coupling: vec![T::of(0.0); spans],
            unattained: false,
            spans: None,
        }
    }

    /// Judges steps by the changes of single spans, and convergence by single dots, of costs of any
    /// sizes beside each other: with large ν the cost of a short span drowns that of its neighbours.
    pub fn by_span(self) -> Self {
        Search { spans: Some(Vec::new()), ..self }
    }

    /// By how much the cost changes towards a trial, summed over spans.
    fn change(&self, before: &[Evaluation<T>], evaluations: &[Evaluation<T>]) -> T {
        let problem = &self.problem;
        let half = T::of(0.5);
        let mut sum = T::of(0.0);
        for (k, (then, now)) in before.iter().zip(evaluations).enumerate() {
            let change = now.cost - then.cost;
            let change = if Scalar::abs(change) > T::of(CLOSE) * then.cost {
                change
            } else {
                let [first, last] = [k, problem.after(k)].map(|dot| self.trial[dot] - self.turns[dot]);
                half * ((then.gradient[0] + now.gradient[0]) * first + (then.gradient[1] + now.gradient[1]) * last)
            };
            sum += problem.spans[k].weight * change;
        }
        sum
    }

    /// √(g H⁻¹g/cost), the largest of single dots with the spans that meet there.
    fn decrement_by_dot(&self, spans: &[Evaluation<T>]) -> T {
        let mut around = vec![T::of(0.0); self.turns.len()];
        for (k, (span, found)) in self.problem.spans.iter().zip(spans).enumerate() {
            around[k] += span.weight * found.cost;
            around[self.problem.after(k)] += span.weight * found.cost;
        }
        let of_dot = |((&g, &step), &cost): ((&T, &T), &T)| Scalar::abs(g * step) / cost;
        let all = self.gradient.iter().zip(&self.step).zip(&around).map(of_dot);
        Scalar::sqrt(all.fold(T::of(0.0), |most, own| Scalar::max(most, own)))
    }

    /// Takes what the segments cost at the trial.
    pub(super) fn receive(&mut self, evaluations: &[Evaluation<T>], until: &Until) {
        self.evaluations += 1;
        let zero = T::of(0.0);
        let problem = &self.problem;
        let missing = evaluations.iter().position(|evaluation| evaluation.exists <= zero);
        let exists = missing.is_none();
        let mut cost = zero;
        let mut gradient = vec![zero; problem.dots()];
        for (k, (span, evaluation)) in problem.spans.iter().zip(evaluations).enumerate() {
            cost += span.weight * evaluation.cost;
            gradient[k] += span.weight * evaluation.gradient[0];
            gradient[problem.after(k)] += span.weight * evaluation.gradient[1];
        }
        for (g, &movable) in gradient.iter_mut().zip(&problem.movable) {
            *g *= movable;
        }
        if !exists {
            cost = T::of(f64::INFINITY);
            self.culprit = missing;
        }
        if self.evaluations == 1 {
            if !Real::is_finite(cost) {
                self.standing = SlopesStanding::Nowhere;
                return;
            }
        } else {
            // As the root of the cost, which the step is Newton's of, relative to where it stands.
            let (one, share) = (T::of(1.0), T::of(1.0 / problem.exponent));
            let root = (cost / self.cost).powf(1.0 / problem.exponent);
            let there = dot(&gradient, &self.step) * root / cost;
            let energies = match &self.spans {
                None => [one, root],
                Some(before) => {
                    let part = self.change(before, evaluations) / self.cost;
                    // The root to first order, where it is too near to 1 for its digits.
                    [zero, if Scalar::abs(part) < T::of(NEARLY) { share * part } else { root - one }]
                }
            };
            let trial = Trial {
                smallest: self.smallest,
                slopes: [share * self.stretch * self.slope / self.cost, share * self.stretch * there],
                energies,
                alpha: self.alpha,
            };
            match self.damping.judge(&trial) {
                Verdict::Accept => self.iterations += 1,
                verdict => {
                    self.unattained |= !exists;
                    let at_the_edge = !exists && self.damping.lambda > T::of(EDGE);
                    if verdict == Verdict::Fail || at_the_edge {
                        self.standing =
                            if self.unattained { SlopesStanding::Unattained } else { SlopesStanding::Stalled };
                        return;
                    }
                    return self.aim();
                }
            }
        }
        self.unattained = false;
        if let Some(spans) = &mut self.spans {
            spans.clear();
            spans.extend_from_slice(evaluations);
        }
        self.cost = cost;
        self.gradient = gradient;
        std::mem::swap(&mut self.turns, &mut self.trial);
        self.diagonal.fill(zero);
        for (k, (span, evaluation)) in self.problem.spans.iter().zip(evaluations).enumerate() {
            let after = self.problem.after(k);
            self.diagonal[k] += span.weight * evaluation.hessian[0];
            self.coupling[k] = span.weight * evaluation.hessian[1];
            self.diagonal[after] += span.weight * evaluation.hessian[2];
        }
        self.aim();
        let square = -self.slope;
        let undamped = self.damping.lambda == zero && self.smallest > zero;
        if undamped && square <= zero && self.gradient.iter().all(|&g| g == zero) {
            // A minimum; a saddle, where symmetric points may start, has a Hessian that is not
            // positive definite.
            self.decrement = zero;
            self.standing = SlopesStanding::Converged;
        } else if undamped {
            self.decrement = match &self.spans {
                None => Scalar::sqrt(Scalar::max(square, zero) / self.cost),
                Some(spans) => self.decrement_by_dot(spans),
            };
            if self.decrement <= T::of(until.tolerance) {
                self.standing = SlopesStanding::Converged;
            }
        }
        if self.standing == SlopesStanding::Running && self.iterations >= until.iterations {
            self.standing = SlopesStanding::Exhausted;
        }
    }

    /// Factors H + λ diag|H|; whether it is positive definite.
    fn factor(&mut self) -> bool {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let lambda = self.damping.lambda;
        self.matrix.clear();
        for (k, &d) in self.diagonal.iter().enumerate() {
            // A dot between straight segments has no stiffness at all, and no moment.
            let d = if d == zero { one } else { d + lambda * Scalar::abs(d) };
            self.matrix.add_diagonal(k, d);
        }
        for (k, &c) in self.coupling.iter().enumerate() {
            // Rows of a cyclic matrix count on: the last segment leads to row n, which is row 0.
            self.matrix.add_entry(k + 1, k, c);
        }
        self.smallest = self.matrix.factor(&self.problem.movable);
        self.smallest > zero
    }

    /// The next step, −(H + λ diag|H|)⁻¹ g, and the trial it leads to.
    fn aim(&mut self) {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        while !self.factor() && self.damping.stiffen() {}
        let mut p: Vec<[T; 1]> = self.gradient.iter().map(|&g| [-g]).collect();
        self.matrix.solve(&mut p);
        let mut most = zero;
        for (step, [p]) in self.step.iter_mut().zip(p) {
            *step = p;
            most = Scalar::max(most, Scalar::abs(p));
        }
        self.slope = dot(&self.gradient, &self.step);
        // Newton's step of cost^{1/ν} is longer than that of the cost by 1/(1 − (1 − 1/ν)
        // gᵀH⁻¹g/cost).
        let exponent = self.problem.exponent;
        let left = one + T::of(1.0 - 1.0 / exponent) * self.slope / self.cost;
        let least = T::of((exponent - 1.0).max(1.0).powf(-LONGEST));
        self.stretch = one / Scalar::max(left, least);
        let most = self.stretch * most;
        let cap = T::of(MOST_TURN);
        self.alpha = if most > cap { cap / most } else { one };
        let along = self.alpha * self.stretch;
        for ((trial, &turn), &step) in self.trial.iter_mut().zip(&self.turns).zip(&self.step) {
            *trial = turn + along * step;
        }
    }
}

fn dot<T: Real + Scalar>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::of(0.0), |sum, (&a, &b)| sum + a * b)
}
