//! Finds the directions of least ∫|κ|^ν ds for which every span turns to its required side, for one
//! curve.
//! No twin: few curves need it.
//!
//! An interior-point method starts from directions that keep all [`rooms`] and applies Newton's
//! method to
//!
//! ```text
//! (E/E₀)^{1/ν} − μ Σ ln(room/(room + turn))
//! ```
//!
//! for decreasing μ, with the energy E₀ at the last decrease of μ and the turns of the polygon. The
//! turns bound the barrier, because segments may have no minimiser far inside. The Hessian of the
//! root is tridiagonal plus a product of gradients, which the Sherman–Morrison formula handles. If
//! there are no feasible directions yet, the Gauss–Newton method minimises the sum of squares of
//! the missing rooms.
//!
//! Source: S. Boyd and L. Vandenberghe, *Convex Optimization*, chapter 11; J. Nocedal and S. J.
//! Wright, *Numerical Optimization*, chapters 10 and 19.

use super::super::evaluation::{Directed, Evaluation, FreeStart};
use super::super::problem::{Ends, Outcome, SlopesProblem, SlopesStanding};
use super::super::universal::Universal;
use super::room::{Room, rooms};
use crate::linalg::Scalar;
use crate::linalg::banded::Banded;
use crate::sides::Asked;

/// The initial and the final μ.
///
/// At the end the root is within μ times the number of rooms of its minimum.
const WEIGHTS: [f64; 2] = [0.1, 1e-10];

/// The factor by which μ decreases.
const FALL: f64 = 0.1;

/// The most Newton steps per weight. Three to six are needed, and about ten at first.
const MOST_STEPS: u32 = 100;

/// Newton's method stops when a step saves less than this fraction of the weight.
const NEAR: f64 = 1e-3;

/// The relative rounding of the root.
const NOISE: f64 = 1e-14;

/// The largest predicted decrease of a failed step that still counts as converged.
const HIDDEN: f64 = 1e-12;

/// A constraint is active if the root rises by more than this when its bound rises by the turn at
/// its point. Otherwise it rises by about the last weight.
const HELD: f64 = 1e-6;

/// Armijo's fraction of the slope.
const DESCENT: f64 = 1e-4;

/// If steps shortened by this factor still lead to segments without minimiser, the descent ends at
/// the edge of their domain.
const EDGE: f64 = 1e-4;

/// The most halvings of a step.
const MOST_SHORTER: usize = 50;

/// The largest turn of a direction per step, in radians.
const MOST_TURN: f64 = 0.5;

/// The fractions of the absolute diagonal that are added if the Hessian is not positive definite.
const DAMPINGS: [f64; 12] = [0.0, 0.01, 0.04, 0.16, 0.64, 2.6, 10.0, 41.0, 164.0, 1e3, 1e4, 1e5];

/// The depths of rooms that are tried, as fractions of the turns at the points. The first one that
/// all rooms reach is used.
const DEPTHS: [f64; 7] = [0.2, 0.1, 0.03, 1e-2, 1e-3, 1e-4, 1e-5];

/// The most steps towards each depth.
const MOST_WAYS: usize = 100;

/// A curve with required sides.
pub(super) struct Sided<'a> {
    pub problem: &'a SlopesProblem,
    pub curves: &'a [Universal],
    pub asked: &'a [Asked],
    /// The turns of the polygon relative to which the rooms of each span are measured.
    pub sizes: &'a [f64],
}

/// The feasible directions of least cost.
pub(super) struct MendResult {
    /// The outcome. Its decrement is the square root of the decrease that a last step would bring,
    /// relative to the ν-norm of the curvature.
    pub outcome: Outcome,
    /// The number of span ends with an active constraint.
    pub held: usize,
}

/// The end of a span whose constraint cannot be satisfied.
pub(super) struct Short {
    pub span: usize,
    pub end: usize,
}

/// Feasible directions, with cost, gradient and rooms.
struct Place {
    turns: Vec<f64>,
    cost: f64,
    gradient: Vec<f64>,
    spans: Vec<Evaluation<f64>>,
    rooms: Vec<[Option<Room>; 2]>,
}

/// A symmetric tridiagonal matrix, cyclic for closed curves, and a gradient.
struct Assembly {
    gradient: Vec<f64>,
    diagonal: Vec<f64>,
    coupling: Vec<f64>,
    /// The diagonal of which damping adds a fraction.
    scale: Vec<f64>,
}

impl Sided<'_> {
    /// The rooms of all spans; `None` if a span turns by π or more.
    fn rooms(&self, turns: &[f64]) -> Option<Vec<[Option<Room>; 2]>> {
        let of_span = |k: usize| {
            let span = &self.problem.spans[k];
            rooms(&self.curves[span.curve as usize], span.ends, &self.asked[k], self.problem.angles(k, turns))
        };
        (0..self.problem.spans.len()).map(of_span).collect()
    }

    fn evaluate(&self, k: usize, turns: &[f64]) -> Evaluation<f64> {
        let span = &self.problem.spans[k];
        let (curve, [a, b]) = (&self.curves[span.curve as usize], self.problem.angles(k, turns));
        match span.ends {
            Ends::Directed => f64::run(Directed(curve, [a, b])),
            Ends::FreeStart => f64::run(FreeStart(curve, b)),
            Ends::FreeEnd => f64::run(FreeStart(curve, -a)).reversed(),
            Ends::Straight => Evaluation::straight(),
        }
    }

    /// Evaluates directions.
    ///
    /// # Errors
    /// `None` if they are infeasible, or the first span without minimiser.
    fn place(&self, turns: Vec<f64>) -> Result<Place, Option<usize>> {
        let rooms = self.rooms(&turns).ok_or(None)?;
        if rooms.iter().flatten().flatten().any(|room| room.value.is_nan() || room.value <= 0.0) {
            return Err(None);
        }
        let spans: Vec<_> = (0..rooms.len()).map(|k| self.evaluate(k, &turns)).collect();
        let (cost, gradient) = self.problem.sum(&spans);
        let missing = spans.iter().position(|found| found.exists <= 0.0 || !found.cost.is_finite());
        match missing {
            None if cost > 0.0 && cost.is_finite() => Ok(Place { turns, cost, gradient, spans, rooms }),
            missing => Err(missing),
        }
    }

    fn assembly(&self) -> Assembly {
        let zero = vec![0.0; self.problem.movable.len()];
        let coupling = vec![0.0; self.problem.spans.len()];
        Assembly { gradient: zero.clone(), diagonal: zero.clone(), coupling, scale: zero }
    }

    /// Adds a span's derivatives. `size` is the diagonal of the part that is a sum of squares.
    fn add(&self, to: &mut Assembly, k: usize, gradient: [f64; 2], hessian: [f64; 3], size: [f64; 2]) {
        let after = self.problem.after(k);
        to.gradient[k] += gradient[0];
        to.gradient[after] += gradient[1];
        to.diagonal[k] += hessian[0];
        to.coupling[k] += hessian[1];
        to.diagonal[after] += hessian[2];
        to.scale[k] += size[0];
        to.scale[after] += size[1];
    }

    /// Solves for the right-hand sides; `None` if the matrix is not positive definite.
    fn solved<const D: usize>(
        &self,
        matrix: &Assembly,
        damping: f64,
        mut sides: Vec<[f64; D]>,
    ) -> Option<Vec<[f64; D]>> {
        let mut banded = Banded::<f64, 1>::new(self.problem.closed, &[sides.len()]);
        for (k, (&d, &scale)) in matrix.diagonal.iter().zip(&matrix.scale).enumerate() {
            banded.add_diagonal(k, if scale == 0.0 { 1.0 } else { d + damping * scale });
        }
        for (k, &c) in matrix.coupling.iter().enumerate() {
            banded.add_entry(k + 1, k, c);
        }
        if banded.factor(&self.problem.movable) <= 0.0 {
            return None;
        }
        banded.solve(&mut sides);
        sides.iter().flatten().all(|x| x.is_finite()).then_some(sides)
    }

    /// (E/E₀)^{1/ν} − μ Σ ln(room/(room + turn))
    fn merit(&self, place: &Place, free: f64, weight: f64) -> f64 {
        let of_span = |(rooms, size): (&[Option<Room>; 2], &f64)| {
            rooms.iter().flatten().map(|room| (room.value / (room.value + size)).ln()).sum::<f64>()
        };
        let logarithms: f64 = place.rooms.iter().zip(self.sizes).map(of_span).sum();
        (place.cost / free).powf(1.0 / self.problem.exponent) - weight * logarithms
    }

    /// Newton's step, its slope, and whether it is undamped.
    fn step(&self, place: &Place, free: f64, weight: f64) -> Option<(Vec<f64>, f64, bool)> {
        let share = 1.0 / self.problem.exponent;
        let root = (place.cost / free).powf(share);
        let part = share * root / place.cost;
        let mut system = self.assembly();
        for (k, (span, found)) in self.problem.spans.iter().zip(&place.spans).enumerate() {
            let part = part * span.weight;
            let hessian = found.hessian.map(|x| part * x);
            self.add(&mut system, k, found.gradient.map(|x| part * x), hessian, [hessian[0].abs(), hessian[2].abs()]);
            for room in place.rooms[k].iter().flatten() {
                let [near, far] = [1.0 / room.value, 1.0 / (room.value + self.sizes[k])];
                let (slope, square) = (weight * (far - near), weight * (near * near - far * far));
                let ([a, b], bend) = (room.gradient, room.hessian.map(|x| slope * x));
                let hessian = [square * a * a + bend[0], square * a * b + bend[1], square * b * b + bend[2]];
                self.add(&mut system, k, [slope * a, slope * b], hessian, [square * a * a, square * b * b]);
            }
        }
        let held = |k: usize, x: f64| self.problem.movable[k] * x;
        let along = (root * share * (1.0 - share)).sqrt() / place.cost;
        let sides: Vec<[f64; 2]> = (0..system.gradient.len())
            .map(|k| [held(k, -system.gradient[k]), held(k, along * place.gradient[k])])
            .collect();
        for damping in DAMPINGS {
            let Some(solved) = self.solved(&system, damping, sides.clone()) else { continue };
            let dot =
                |which: usize| sides.iter().zip(&solved).map(|(side, solved)| side[1] * solved[which]).sum::<f64>();
            // Beyond this the root is no longer convex along the gradient of the energy.
            let left = 1.0 - dot(1);
            let more = if left > 0.1 { dot(0) / left } else { 0.0 };
            let step: Vec<f64> = solved.iter().map(|[newton, along]| newton + more * along).collect();
            let slope = -sides.iter().zip(&step).map(|(side, step)| side[0] * step).sum::<f64>();
            if slope <= 0.0 {
                return Some((step, slope, damping == 0.0));
            }
        }
        None
    }

    /// Minimises the energy from feasible directions.
    pub fn least(&self, start: Vec<f64>, most_iterations: u32) -> Option<MendResult> {
        let mut place = self.place(start).ok()?;
        let mut culprit = None;
        let (mut iterations, mut evaluations) = (0, 1);
        let mut decrement = f64::INFINITY;
        let mut standing = SlopesStanding::Running;
        let mut weight = WEIGHTS[0];
        while standing == SlopesStanding::Running {
            let free = place.cost;
            // Whether the last step predicts no further decrease.
            let mut is_reached = false;
            for _ in 0..MOST_STEPS {
                let Some((step, slope, undamped)) = self.step(&place, free, weight) else { break };
                decrement = (-slope).sqrt();
                is_reached = undamped && -slope <= NEAR * weight;
                if is_reached {
                    break;
                }
                if iterations >= most_iterations {
                    standing = SlopesStanding::Exhausted;
                    break;
                }
                let most = step.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                let mut part = if most > MOST_TURN { MOST_TURN / most } else { 1.0 };
                let before = self.merit(&place, free, weight);
                let (mut further, mut missing) = (None, None);
                for _ in 0..MOST_SHORTER {
                    let trial = place.turns.iter().zip(&step).map(|(turn, step)| turn + part * step).collect();
                    evaluations += 1;
                    let leads_down =
                        |place: &Place| self.merit(place, free, weight) <= before + DESCENT * part * slope + NOISE;
                    match self.place(trial) {
                        Ok(trial) if leads_down(&trial) => {
                            further = Some(trial);
                            break;
                        }
                        Ok(_) => missing = None,
                        Err(span) => missing = span,
                    }
                    part *= 0.5;
                }
                if missing.is_some() && part < EDGE {
                    (standing, culprit) = (SlopesStanding::Unattained, missing);
                    break;
                }
                let Some(further) = further else {
                    is_reached = undamped && -slope <= HIDDEN;
                    break;
                };
                place = further;
                iterations += 1;
            }
            if standing == SlopesStanding::Running && weight <= WEIGHTS[1] {
                standing = if is_reached { SlopesStanding::Converged } else { SlopesStanding::Stalled };
            }
            weight = (FALL * weight).max(WEIGHTS[1]);
        }
        // The root increases with the bound at the rate μ/room.
        let is_held = |(rooms, size): (&[Option<Room>; 2], &f64)| {
            rooms.iter().flatten().filter(|room| WEIGHTS[1] * size > HELD * room.value).count()
        };
        let held = place.rooms.iter().zip(self.sizes).map(is_held).sum();
        let Place { turns, cost, .. } = place;
        let outcome = Outcome { turns, cost, decrement, standing, iterations, evaluations, culprit };
        Some(MendResult { outcome, held })
    }

    /// Finds feasible directions near the reference directions.
    ///
    /// # Errors
    /// The end of a span with the largest violation.
    pub fn inside(&self) -> Result<Vec<f64>, Short> {
        let mut turns = vec![0.0; self.problem.movable.len()];
        for depth in DEPTHS {
            turns = self.deeper(turns, depth);
            let inside = |rooms: &Vec<[Option<Room>; 2]>| {
                let deep = |(rooms, size): (&[Option<Room>; 2], &f64)| {
                    rooms.iter().flatten().all(|room| room.value > 0.5 * depth * size)
                };
                rooms.iter().zip(self.sizes).all(deep)
            };
            if self.rooms(&turns).is_some_and(|rooms| inside(&rooms)) && self.place(turns.clone()).is_ok() {
                return Ok(turns);
            }
        }
        let mut worst = (f64::INFINITY, Short { span: 0, end: 0 });
        for (span, rooms) in self.rooms(&turns).into_iter().flatten().enumerate() {
            for (end, room) in rooms.iter().enumerate() {
                let part = room.map_or(f64::INFINITY, |room| room.value / self.sizes[span]);
                if part < worst.0 {
                    worst = (part, Short { span, end });
                }
            }
        }
        Err(worst.1)
    }

    /// Σ (depth − room/size)² over the rooms below `depth`, and its Gauss–Newton matrix.
    fn lack(&self, turns: &[f64], depth: f64) -> Option<(f64, Assembly)> {
        let mut system = self.assembly();
        let mut sum = 0.0;
        for (k, (rooms, size)) in self.rooms(turns)?.iter().zip(self.sizes).enumerate() {
            for room in rooms.iter().flatten() {
                let lack = depth - room.value / size;
                if lack > 0.0 {
                    sum += lack * lack;
                    let [a, b] = room.gradient.map(|x| x / size);
                    self.add(&mut system, k, [-lack * a, -lack * b], [a * a, a * b, b * b], [a * a, b * b]);
                }
            }
        }
        Some((sum, system))
    }

    /// Turns the directions until all rooms reach this depth, or no step helps.
    fn deeper(&self, mut turns: Vec<f64>, depth: f64) -> Vec<f64> {
        let Some((mut sum, mut system)) = self.lack(&turns, depth) else { return turns };
        let mut damping = 1e-3;
        for _ in 0..MOST_WAYS {
            if sum == 0.0 || damping > 1e6 {
                break;
            }
            let sides = (0..turns.len()).map(|k| [-self.problem.movable[k] * system.gradient[k]]).collect();
            let step = self.solved(&system, damping, sides);
            let trial = step.map(|step| {
                let most = step.iter().fold(0.0f64, |most, [x]| most.max(x.abs()));
                let part = if most > MOST_TURN { MOST_TURN / most } else { 1.0 };
                turns.iter().zip(&step).map(|(turn, [step])| turn + part * step).collect::<Vec<f64>>()
            });
            match trial.and_then(|trial| self.lack(&trial, depth).map(|lack| (trial, lack))) {
                Some((trial, lack)) if lack.0 < sum => {
                    (turns, (sum, system)) = (trial, lack);
                    damping = (0.1 * damping).max(1e-9);
                }
                _ => damping *= 10.0,
            }
        }
        turns
    }
}
