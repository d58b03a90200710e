//! [`Search`]: a damped Newton descent among the curves whose spans are closed.

use super::functional::Functional;
use super::shape::{Curve, Shape};
use crate::linalg::skyline::Skyline;

/// The largest change of the turn at a vertex, and of the logarithm of a length, per step.
const MOST_TURN: f64 = 0.6;

/// The largest change of an angle per step.
///
/// Closure is nonlinear in the angles: 1 rad more gives a different curve.
const MOST_ANGLE: f64 = 1.0;

/// The initial λ. The metric is the Hessian of a straight curve, so both weigh the same.
const FIRST: f64 = 1.0;

/// The factor of λ after a step that failed.
///
/// Trials do not count as iterations. A λ slightly too large costs more than two that are too
/// small.
const GROWTH: f64 = 2.0;

/// The factor of λ if H + λM is not positive definite on the null space of J.
const STIFFENING: f64 = 3.0;

/// The factor of λ after a step that succeeded.
const DECAY: f64 = 0.05;

/// The least positive λ after a failure.
const LEAST: f64 = 1e-3;

/// λ below this is set to 0.
const NOTHING: f64 = 1e-4;

/// The largest λ.
///
/// If no step succeeds with it, none will.
const MOST: f64 = 1e8;

/// A step is accepted if the energy falls by this fraction of the fall that its slope and length
/// predict.
const ACCEPTED: f64 = 1e-3;

/// λ shrinks if the energy falls by more than this fraction of the prediction, and grows otherwise.
const GOOD: f64 = 0.25;

/// A step with a predicted fall of more than this fraction of the energy is tried at twice the
/// length.
const FAR: f64 = 1e-3;

/// The most doublings of a step.
const MOST_DOUBLINGS: u32 = 3;

/// The weight of the angles themselves, which makes the metric regular, relative to the stiffness
/// of a span.
const LOOSE: f64 = 0.01;

/// The most trials per allowed iteration. The measured average is 1.4.
const TRIALS: u32 = 4;

/// The ending of a descent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::discrete) enum Ending {
    Found,
    /// The length exceeded its bound while the energy fell.
    Unbounded,
    /// The iterations were used up, or no step succeeded.
    Failed,
}

/// The energy of a descent, and its stopping criteria.
pub(super) struct Stage<'a> {
    pub functional: &'a Functional,
    /// The order of the derivative of angles in the metric: 1 for bending, 2 for variation.
    pub order: usize,
    /// The descent ends if a full step predicts a fall of less than this fraction of the energy.
    pub tolerance: f64,
    /// The length beyond which the curve counts as unbounded.
    pub longest: f64,
    pub most_iterations: u32,
}

/// The state of a descent.
pub(super) struct Search<'a> {
    shape: &'a Shape,
    pub curve: Curve,
    pub iterations: u32,
    /// The number of factorised systems.
    pub trials: u32,
    matrix: Skyline,
    gradient: Vec<f64>,
    multipliers: Vec<[f64; 2]>,
}

impl<'a> Search<'a> {
    pub fn new(shape: &'a Shape, curve: Curve) -> Self {
        Search {
            shape,
            curve,
            iterations: 0,
            trials: 0,
            matrix: shape.matrix(),
            gradient: vec![0.0; shape.rows()],
            multipliers: vec![[0.0; 2]; shape.spans.len()],
        }
    }

    /// Descends until a stage ends.
    pub fn descend(&mut self, stage: &Stage<'_>) -> Ending {
        let shape = self.shape;
        if !self.begin(stage) {
            return Ending::Failed;
        }
        let start = stage.functional.value(shape, &self.curve);
        let (mut energy, mut lambda, mut iterations) = (start, FIRST, 0);
        let most_trials = self.trials.saturating_add(TRIALS.saturating_mul(stage.most_iterations));
        while iterations < stage.most_iterations && self.trials < most_trials && lambda <= MOST {
            self.assemble(stage, lambda);
            // At a minimum among closed curves there is one negative pivot per closure equation.
            if self.matrix.factor() != Some(2 * shape.spans.len()) {
                lambda = (STIFFENING * lambda).max(LEAST);
                continue;
            }
            let (p, multipliers) = self.direction();
            let promised: f64 = -p.iter().zip(&self.gradient).map(|(p, g)| p * g).sum::<f64>();
            let alpha = self.most_step(&p).min(1.0);
            let mut next = self.curve.moved(shape, alpha, &p);
            let closed = shape.retract(&self.matrix, &mut next);
            let mut there = if closed { stage.functional.value(shape, &next) } else { f64::INFINITY };
            let promise = alpha * (1.0 - 0.5 * alpha) * promised;
            let is_last = alpha == 1.0 && promised.abs() <= stage.tolerance * energy.abs();
            if !(there.is_finite() && (energy - there >= ACCEPTED * promise && promise > 0.0 || is_last)) {
                lambda = (GROWTH * lambda).max(LEAST);
                continue;
            }
            lambda *= if energy - there > GOOD * promise { DECAY } else { GROWTH };
            lambda = if lambda < NOTHING { 0.0 } else { lambda };
            if promised > FAR * energy {
                self.go_farther(stage, alpha, &p, &mut next, &mut there);
            }
            (self.curve, energy) = (next, there);
            for (own, new) in self.multipliers.iter_mut().zip(multipliers) {
                (0..2).for_each(|c| own[c] += alpha * (new[c] - own[c]));
            }
            self.iterations += 1;
            iterations += 1;
            if is_last {
                return Ending::Found;
            }
            if self.curve.total_length(shape) > stage.longest && energy < start {
                return Ending::Unbounded;
            }
        }
        Ending::Failed
    }

    /// Doubles a step as long as the energy keeps falling.
    ///
    /// This needs no further system. Loops that grow or move across a data point need many steps of
    /// this kind.
    fn go_farther(&self, stage: &Stage<'_>, alpha: f64, p: &[f64], next: &mut Curve, there: &mut f64) {
        let mut alpha = alpha;
        for _ in 0..MOST_DOUBLINGS {
            alpha *= 2.0;
            let mut farther = self.curve.moved(self.shape, alpha, p);
            if !self.shape.retract(&self.matrix, &mut farther) {
                return;
            }
            let energy = stage.functional.value(self.shape, &farther);
            if energy.is_nan() || energy >= *there {
                return;
            }
            (*next, *there) = (farther, energy);
        }
    }

    /// Closes the curve, and computes the multipliers that minimise the remaining gradient.
    fn begin(&mut self, stage: &Stage<'_>) -> bool {
        self.multipliers.fill([0.0; 2]);
        self.matrix.clear();
        self.gradient.fill(0.0);
        stage.functional.add(self.shape, &self.curve, &mut self.gradient, &mut self.matrix);
        // The Hessian is not wanted here.
        self.matrix.clear();
        self.add_metric(stage.order, 1.0);
        self.shape.add_closures(&self.curve, &self.multipliers, &mut self.matrix);
        self.trials += 1;
        if self.matrix.factor().is_none() {
            return false;
        }
        self.multipliers = self.direction().1;
        self.shape.retract(&self.matrix, &mut self.curve)
    }

    /// Assembles the gradient, and H + λM bordered by the closures' derivatives.
    fn assemble(&mut self, stage: &Stage<'_>, lambda: f64) {
        self.matrix.clear();
        self.gradient.fill(0.0);
        stage.functional.add(self.shape, &self.curve, &mut self.gradient, &mut self.matrix);
        self.shape.add_closures(&self.curve, &self.multipliers, &mut self.matrix);
        self.add_metric(stage.order, lambda);
        self.trials += 1;
    }

    /// Adds λM: twice the Hessian of Σ (D θ)² of an order at a straight curve, and small weights of
    /// the lengths and angles themselves.
    pub(super) fn add_metric(&mut self, order: usize, lambda: f64) {
        let shape = self.shape;
        let lengths: Vec<f64> = (0..shape.edges()).map(|j| self.curve.length(shape, j)).collect();
        for j in 0..shape.windows(order + 1) {
            let edges = [0, 1, 2].map(|k| (j + k) % shape.edges());
            let s = edges.map(|edge| lengths[edge]);
            let (a, b) = (2.0 / (s[0] + s[1]), 2.0 / (s[1] + s[2]));
            let (weight, v) = if order == 1 { (a, [-1.0, 1.0, 0.0]) } else { (1.0 / s[1], [a, -a - b, b]) };
            for i in 0..=order {
                for k in 0..=i {
                    let times = if edges[i] == edges[k] && i != k { 2.0 } else { 1.0 };
                    let x = 2.0 * lambda * weight * times * v[i] * v[k];
                    self.matrix.add(shape.row(edges[i]), shape.row(edges[k]), x);
                }
            }
        }
        for edges in &shape.spans {
            let s = lengths[edges.start];
            let span = edges.len() as f64 * s;
            let stiffness = 2.0 * lambda / span.powi(2 * order as i32 - 1);
            self.matrix.add(shape.row_of_length(edges.start), shape.row_of_length(edges.start), stiffness);
            let loose = LOOSE * stiffness * s / span;
            edges.clone().for_each(|j| self.matrix.add(shape.row(j), shape.row(j), loose));
        }
    }

    #[cfg(test)]
    pub fn matrix_mut(&mut self) -> &mut Skyline {
        &mut self.matrix
    }

    /// The step and the multipliers from the factorised system.
    fn direction(&self) -> (Vec<f64>, Vec<[f64; 2]>) {
        let mut p: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        for (k, gap) in self.shape.gaps(&self.curve).enumerate() {
            let [row, other] = self.shape.rows_of_closure(k);
            (p[row], p[other]) = (-gap[0], -gap[1]);
        }
        self.matrix.solve(&mut p);
        let of = |k: usize| self.shape.rows_of_closure(k).map(|row| p[row]);
        let multipliers = (0..self.shape.spans.len()).map(of).collect();
        (p, multipliers)
    }

    /// The largest step along p that respects the bounds of all changes.
    fn most_step(&self, p: &[f64]) -> f64 {
        let shape = self.shape;
        let mut largest: f64 = 0.0;
        for j in 0..shape.edges() {
            let by_angle = p[shape.row(j)];
            let next = if j + 1 < shape.edges() {
                p[shape.row(j + 1)]
            } else if shape.closed {
                p[shape.row(0)]
            } else {
                by_angle
            };
            largest = largest.max(by_angle.abs() / MOST_ANGLE).max((next - by_angle).abs() / MOST_TURN);
        }
        for edges in &shape.spans {
            largest = largest.max(p[shape.row_of_length(edges.start)].abs() / MOST_TURN);
        }
        if largest > 0.0 { 1.0 / largest } else { 1.0 }
    }
}
