//! [`Search`]: the search for the weight of one curve.
//!
//! The smaller the weight, the fairer the curve and the larger its deviation. Weights are α = unit
//! · 2^(j/128) for whole j. The search takes secants between a weight that breaks the deviation and
//! one that keeps it. It ends when these are neighbours, or when the secant says so.
//!
//! The first trial starts from the spline. Every other one starts from the curve of the smallest
//! weight so far that keeps the deviation. Only the last trial descends to the method's own
//! tolerance.

use super::curves::Vertices;
use super::fair::{Fair, Pins};
use super::lane::Standing;
use super::near::{Spread, remedy};
use super::problem::Outcome;
use super::setup::{LONGEST, Ready, distance, set_up_pieces};
use crate::batch::CurveBatch;
use crate::linalg::power_of_two;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::report::CurveReport;

/// Steps of the weight in an octave.
///
/// Weights differ by 2^(1/128), 0.54 %.
///
/// Deviations differ by 0.54 % at most where they go as 1/α. Every device and precision tries the
/// same weights.
const STEPS_PER_OCTAVE: f64 = 128.0;

/// The least and the most steps to the next weight while nothing brackets the answer.
///
/// They are a twelfth of an octave and six octaves.
const LEAST_STRIDE: f64 = 11.0;
const MOST_STRIDE: f64 = 6.0 * STEPS_PER_OCTAVE;

/// The secant of a bracket of up to this many steps, an eighth of an octave, is reliable.
const NARROW: i32 = 16;

/// The smallest weight: all attachments together are this fraction of the stiffness of a curve of
/// size 1.
///
/// They move it by no more.
const WEAKEST: f64 = 1e-4;

/// The largest weight makes one attachment 2³⁰ times as stiff as the shortest span.
const OCTAVES_ABOVE: f64 = 30.0;

/// During the search the deviation is computed to this fraction of the allowed one.
const ROUGHLY: f64 = 1e-3;

/// The most iterations of a trial.
///
/// Nine in ten trials take fewer than ten. A trial that takes more than this is on its way into a
/// loop. Where length or tension bound loops it has a minimum, but no near one.
const TRIAL_ITERATIONS: u32 = 25;

/// A curve on trial that becomes this many times as long as its chord polygon has swung out.
///
/// A span that is this many times as long as its own chord, and longer by the deviation, has swung
/// out too. Half a circle is 1.57 times as long as its chord, and two thirds of a circle 2.42
/// times. Among borders, spans from 1.9 times on are loops.
const SWUNG_OUT: f64 = 2.0;

/// Steps to the next weight after trials that swung out, while no weight is known to keep the
/// deviation.
///
/// After the last there is assumed to be no such weight.
const STIFFENING: [i32; 3] = [192, 384, 768];

/// Steps to the weight of a deviation twice as large as that of the spline: two octaves.
///
/// Rings that are smaller than the deviation grow round at weak weights. They swing out at weights
/// that hold every corner.
const SOFTENING: i32 = 256;

/// Steps to higher weights, where the weight found fails at the method's tolerance.
///
/// Such a weight breaks the deviation by next to nothing. Or it is where its minimum is about to
/// end, and the curve is not yet a minimum for Newton's method.
const STRIDES: [i32; 4] = [1, 4, 16, 64];

/// The most trials.
///
/// Six are common. A search takes more than this where the deviation jumps.
const MOST_ROUNDS: u32 = 32;

/// A curve that keeps the deviation.
#[derive(Clone, Debug)]
struct Kept<const D: usize> {
    step: i32,
    deviation: f64,
    /// The problem that was descended, and its outcome.
    trial: Ready<D>,
    outcome: Outcome<D>,
}

/// The state of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// The weight is searched for.
    Searching,
    /// The weight is found.
    ///
    /// The curve is still needed to the method's tolerance.
    Finishing,
    /// No weight keeps the deviation.
    ///
    /// The curve goes through its points.
    Pinned,
    /// All trials swung out, so there is no minimum near the points.
    Nowhere,
    /// The weight is found, and nothing else was asked for.
    Sketched,
}

/// The result of a search.
struct Found<const D: usize> {
    ready: Ready<D>,
    outcome: Outcome<D>,
    /// The weight of the attachment.
    ///
    /// Infinite where the curve goes through its points.
    weight: f64,
}

/// The search for the weight of one curve.
pub(super) struct Search<const D: usize> {
    curve: usize,
    allowed: f64,
    /// The curve at the spline, with attachments at weight 1.
    start: Ready<D>,
    /// α of step 0.
    unit: f64,
    steps: [i32; 2],
    step: i32,
    stage: Stage,
    /// The largest weight known to break the deviation, with that deviation.
    ///
    /// The next field is the smallest weight known to keep it.
    below: Option<(i32, f64)>,
    above: Option<Kept<D>>,
    /// How many times in a row the same side of the bracket moved: above if positive, below if
    /// negative.
    one_sided: i32,
    /// The number of weights that swung out while none was known to keep the deviation.
    swung_out: usize,
    /// The number of weights that failed at the method's tolerance.
    finishes: usize,
    rounds: u32,
    iterations: u32,
    found: Option<Found<D>>,
    /// Whether only the weight is asked for.
    is_sketch: bool,
}

/// The weight and the curve found among coarse edges.
pub(super) struct Sketch {
    pub weight: f64,
    pub vertices: Vertices,
}

impl<const D: usize> Search<D> {
    /// A search that starts from a curve.
    ///
    /// `spread` is what its smoothing spline suggests.
    pub fn new(
        attached: &Fair,
        allowed: f64,
        batch: &CurveBatch,
        curve: usize,
        mut start: Ready<D>,
        spread: Spread,
    ) -> Self {
        // Curves may leave their points on all sides. Energies that bound the length end such
        // excursions far away.
        let chords: f64 = batch.chords(curve).sum();
        start.problem.longest = LONGEST * (chords + std::f64::consts::TAU * allowed) / start.size;
        let problem = &start.problem;
        let order = attached.energy.order() as i32;
        let is_attached = !problem.attached.is_empty();
        let own = || problem.attached.iter().map(|(_, weight, _)| *weight);
        // Where nothing is attached nothing is searched for, and any unit will do.
        let (heaviest, all) = if is_attached { (own().fold(0.0, f64::max), own().sum::<f64>()) } else { (1.0, 1.0) };
        let spans = spans(&start);
        let shortest = spans.iter().copied().fold(f64::INFINITY, f64::min);
        // The unit is a power of two. Weights are then the same wherever a search starts, and on
        // every device.
        let unit = power_of_two(&[problem.highest * shortest.powi(1 - 2 * order) / heaviest]);
        let step = |alpha: f64| STEPS_PER_OCTAVE * (alpha / unit).log2();
        let highest = (OCTAVES_ABOVE * STEPS_PER_OCTAVE) as i32;
        // The cast turns NaN into 0.
        let lowest = (step(WEAKEST * problem.highest / all).floor() as i32).min(highest);
        // Data at distance h are smoothed over a length l with l^2m = h w/α. This holds for a
        // spline and for a curve of order m.
        let h = spans.iter().sum::<f64>() / spans.len() as f64;
        let lambda = spread.lambda / start.size.powi(3);
        let per_weight = start.size * start.size / start.energy_unit;
        let guess = step(problem.highest * h * (lambda * h).powf(-0.5 * f64::from(order)) / per_weight);
        let guess = if guess.is_finite() { guess.round() as i32 - SOFTENING * spread.halvings } else { 0 };
        Search {
            steps: [lowest, highest],
            step: guess.clamp(lowest, highest),
            stage: if is_attached { Stage::Searching } else { Stage::Pinned },
            curve,
            allowed,
            start,
            unit,
            below: None,
            above: None,
            one_sided: 0,
            swung_out: 0,
            finishes: 0,
            rounds: 0,
            iterations: 0,
            found: None,
            is_sketch: false,
        }
    }

    /// Turns this into a search for the weight alone.
    pub fn sketching(mut self) -> Self {
        self.is_sketch = true;
        self
    }

    /// The sketch, if a weight was found that keeps the deviation.
    pub fn sketch(&self) -> Option<Sketch> {
        let kept = self.above.as_ref()?;
        let moved = kept.trial.moved(&kept.outcome.displacements, &self.start);
        let coords = moved.vertices.into_iter().flatten().collect();
        Some(Sketch {
            weight: self.weight_of(kept.step),
            vertices: Vertices { coords, rows: moved.rows, corners: vec![] },
        })
    }

    /// Starts this search from a weight that is about right, which took `iterations` to find.
    pub fn starting_from(mut self, weight: f64, iterations: u32) -> Self {
        let step = STEPS_PER_OCTAVE * (weight / self.unit).log2();
        (self.step, self.iterations) = ((step.round() as i32).clamp(self.steps[0], self.steps[1]), iterations);
        self
    }

    /// The iterations so far.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Whether no trial reached a minimum.
    pub fn leads_nowhere(&self) -> bool {
        self.stage == Stage::Nowhere
    }

    /// Ends this search, because a sketch has shown that no trial reaches a minimum.
    pub fn given_up(mut self, iterations: u32) -> Self {
        (self.stage, self.iterations) = (Stage::Nowhere, iterations);
        self
    }

    /// The number of the curve.
    pub fn curve(&self) -> usize {
        self.curve
    }

    /// The number of its vertices.
    pub fn vertices(&self) -> usize {
        self.start.vertices.len()
    }

    /// Whether it needs no more trials.
    pub fn has_ended(&self) -> bool {
        self.found.is_some() || matches!(self.stage, Stage::Nowhere | Stage::Sketched)
    }

    /// Whether it is still searching for the weight.
    pub fn is_searching(&self) -> bool {
        self.stage == Stage::Searching
    }

    /// The most iterations of the next trial.
    pub fn most_iterations(&self, fair: &Fair) -> u32 {
        if self.is_searching() { fair.max_iterations.min(TRIAL_ITERATIONS) } else { fair.max_iterations }
    }

    fn weight(&self) -> f64 {
        self.weight_of(self.step)
    }

    /// The weight of a step, equally exact for every unit.
    fn weight_of(&self, step: i32) -> f64 {
        let octave = STEPS_PER_OCTAVE as i32;
        let within = (f64::from(step.rem_euclid(octave)) / STEPS_PER_OCTAVE).exp2();
        self.unit * 2_f64.powi(step.div_euclid(octave)) * within
    }

    /// The problem to descend next.
    pub fn trial(&self, fair: &Fair, batch: &CurveBatch) -> Ready<D> {
        if self.stage == Stage::Pinned {
            return self.through_its_points(fair, batch).unwrap_or_else(|| self.start.clone());
        }
        // There may be several minima. This one follows from curves that keep the deviation while
        // their attachments weaken. A curve that was once too far away may be caught behind folds,
        // and no weight pulls it out.
        let mut ready = match &self.above {
            Some(kept) => kept.trial.moved(&kept.outcome.displacements, &self.start),
            None => self.start.clone(),
        };
        let (weight, mut least) = (self.weight(), f64::INFINITY);
        for (_, own, _) in &mut ready.problem.attached {
            *own *= weight;
            least = least.min(*own);
        }
        ready.problem.longest = self.start.problem.longest;
        if self.stage == Stage::Searching {
            // ⟨g, L⁻¹g⟩ bounds α|u − u*|² at every attached vertex, where L is the Hessian.
            let enough = ROUGHLY * self.allowed / self.start.size * least.sqrt();
            ready.problem.tolerance = enough.min(ROUGHLY).max(fair.tolerance);
            ready.problem.longest = SWUNG_OUT / LONGEST * self.start.problem.longest;
        }
        ready
    }

    /// The spline through the points, with all of them pinned.
    fn through_its_points(&self, fair: &Fair, batch: &CurveBatch) -> Option<Ready<D>> {
        let pinned = Fair { pins: Pins::All, ..fair.clone() };
        set_up_pieces::<D>(&pinned, &batch.select(&[self.curve]), &[]).ok()?.pop()?.ok()
    }

    /// Records the outcome of a trial, and decides what follows.
    pub fn take(&mut self, trial: Ready<D>, outcome: Outcome<D>, points: &[Vector<f64, D>]) {
        self.rounds += 1;
        self.iterations += outcome.iterations;
        if outcome.standing == Standing::Running {
            // The device was lost. The spline at least keeps the deviation.
            let outcome = Outcome { displacements: zeros(&self.start), ..outcome };
            self.found = Some(Found { ready: self.start.clone(), outcome, weight: 0.0 });
            return;
        }
        let moved = trial.moved(&outcome.displacements, &self.start);
        if self.stage == Stage::Pinned {
            let is_attached = !self.start.problem.attached.is_empty();
            if is_attached && moved.has_swung_out(self.allowed) {
                self.stage = Stage::Nowhere;
            } else {
                let weight = if is_attached { f64::INFINITY } else { 0.0 };
                self.found = Some(Found { ready: trial, outcome, weight });
            }
            return;
        }
        let done = outcome.standing == Standing::Converged && !moved.has_swung_out(self.allowed);
        let deviation = Some(moved.deviation(points)).filter(|d| done && d.is_finite()).unwrap_or(f64::INFINITY);
        let keeps = deviation <= self.allowed * (1.0 - 8.0 * f64::EPSILON);
        if self.stage == Stage::Finishing {
            if keeps {
                self.found = Some(Found { ready: trial, outcome, weight: self.weight() });
            } else {
                self.finish_again();
            }
            return;
        }
        self.one_sided = if keeps { self.one_sided.max(0) + 1 } else { self.one_sided.min(0) - 1 };
        if keeps {
            self.above = Some(Kept { step: self.step, deviation, trial, outcome });
        } else {
            self.below = Some((self.step, deviation));
        }
        if self.above.is_none() && deviation.is_infinite() {
            match STIFFENING.get(self.swung_out) {
                Some(stride) => (self.step, self.swung_out) = (self.step + stride, self.swung_out + 1),
                None => self.stage = Stage::Nowhere,
            }
            return;
        }
        match (self.next(), &self.above) {
            (Some(step), _) if self.rounds < MOST_ROUNDS => self.step = step,
            _ if self.is_sketch => self.stage = Stage::Sketched,
            (_, Some(above)) => (self.stage, self.step) = (Stage::Finishing, above.step),
            _ => self.stage = Stage::Pinned,
        }
    }

    /// Goes on to the next heavier weight.
    ///
    /// After the last it takes the curve that kept the deviation, converged or not.
    fn finish_again(&mut self) {
        match STRIDES.get(self.finishes) {
            Some(stride) => (self.step, self.finishes) = (self.step + stride, self.finishes + 1),
            None => {
                let Kept { step, trial, mut outcome, .. } = self.above.take().expect("a weight found was tried");
                if outcome.norm > self.start.problem.tolerance {
                    outcome.standing = Standing::Exhausted;
                }
                self.step = step;
                self.found = Some(Found { ready: trial, outcome, weight: self.weight() });
            }
        }
    }

    /// The weight to try next.
    ///
    /// `None` if the bracket is as narrow as possible.
    fn next(&self) -> Option<i32> {
        let octaves_off = |deviation: f64| (deviation / self.allowed).log2().abs();
        let stride = |deviation: f64| {
            // Deviations go as 1/α where attachments are stiff, and more slowly where they are not.
            // Steps that had no effect so far are followed by larger ones.
            let first = STEPS_PER_OCTAVE * 1.5 * octaves_off(deviation);
            let patient = LEAST_STRIDE * f64::from(self.one_sided.abs()).exp2();
            first.max(patient).min(MOST_STRIDE) as i32
        };
        let [lowest, highest] = self.steps;
        match (self.below, &self.above) {
            (Some((below, deviation)), Some(above)) => {
                let gap = above.step - below;
                let (high, low) = (deviation.ln(), above.deviation.ln());
                let part = (high - self.allowed.ln()) / (high - low);
                let secant = part.is_finite() && self.one_sided.abs() < 3;
                // The secant says that one step further down breaks the deviation. It is trusted in
                // narrow brackets.
                let is_last = secant && gap <= NARROW && (1.0 - part) * f64::from(gap) < 1.0;
                let part = if secant { part } else { 0.5 };
                // Minima end next to weights that swing out. A narrower bracket would find nothing
                // better.
                let is_last = is_last || deviation.is_infinite() && gap <= NARROW;
                (gap > 1 && !is_last).then(|| below + ((part * f64::from(gap)).round() as i32).clamp(1, gap - 1))
            }
            (Some((below, deviation)), None) => (below < highest).then(|| (below + stride(deviation)).min(highest)),
            (None, Some(above)) => (above.step > lowest).then(|| (above.step - stride(above.deviation)).max(lowest)),
            (None, None) => None,
        }
    }

    /// The report of a search that has ended, and the vertices found.
    pub fn report(self, attached: &Fair, batch: &CurveBatch) -> (CurveReport, Option<Vertices>) {
        let found =
            self.found.filter(|found| found.weight.is_finite() || found.outcome.standing == Standing::Converged);
        let Some(Found { mut ready, mut outcome, weight }) = found else {
            return self.start.left_as_it_is(attached, batch, self.curve, self.allowed, self.iterations);
        };
        let through = weight.is_infinite();
        let minimum_ends = self.stage == Stage::Finishing && outcome.standing != Standing::Converged;
        outcome.iterations = self.iterations;
        for (row, weight, target) in &ready.problem.attached {
            let away = subtract(outcome.displacements[*row as usize], *target);
            outcome.energy -= 0.5 * weight * dot(away, away);
        }
        // The report compares with the tolerance asked for. During the search a larger one was
        // enough.
        ready.problem.tolerance = self.start.problem.tolerance;
        let (mut report, vertices) = attached.report(batch, self.curve, &ready, &outcome);
        report.smoothing = Some(weight);
        if minimum_ends {
            let what = format!(
                "its minimum ends near the weight that keeps the deviation of {}: the curve keeps it, with a gradient of {:.1e} where {:.1e} was \
                 asked for; {}",
                self.allowed,
                outcome.norm,
                attached.tolerance,
                remedy(&attached.energy)
            );
            report.message = Some(batch.sentence(self.curve, 0, &what));
        }
        if through && report.message.is_none() {
            let most = self.unit * OCTAVES_ABOVE.exp2();
            let what = format!(
                "no weight of the attachment up to {most:.1e} keeps the deviation of {}: the curve goes through its points; \
                 allow more, or ask for more segments",
                self.allowed
            );
            report.message = Some(batch.sentence(self.curve, 0, &what));
        }
        (report, vertices)
    }
}

fn zeros<const D: usize>(ready: &Ready<D>) -> Vec<Vector<f64, D>> {
    vec![[0.0; D]; ready.vertices.len()]
}

/// The lengths of the spans that are not empty, at size 1.
fn spans<const D: usize>(ready: &Ready<D>) -> Vec<f64> {
    let lengths: Vec<f64> = ready.problem.base.iter().map(|edge| dot(*edge, *edge).sqrt()).collect();
    let span = |pair: &[u32]| lengths[pair[0] as usize..pair[1] as usize].iter().sum();
    ready.rows.windows(2).map(span).filter(|&length| length > 0.0).collect()
}

impl<const D: usize> Ready<D> {
    /// The curve with its vertices displaced, as the base of further displacements.
    ///
    /// Attachments have the weights of `start`.
    fn moved(&self, displacements: &[Vector<f64, D>], start: &Self) -> Self {
        let mut moved = self.clone();
        let count = displacements.len();
        for (vertex, u) in moved.vertices.iter_mut().zip(displacements) {
            *vertex = add(*vertex, scale(self.size, *u));
        }
        for (j, edge) in moved.problem.base.iter_mut().enumerate() {
            *edge = add(*edge, subtract(displacements[(j + 1) % count], displacements[j]));
        }
        for ((row, weight, target), (_, own, _)) in moved.problem.attached.iter_mut().zip(&start.problem.attached) {
            *target = subtract(*target, displacements[*row as usize]);
            *weight = *own;
        }
        moved.problem.tolerance = start.problem.tolerance;
        moved
    }

    /// Whether a span between data points has become a loop.
    fn has_swung_out(&self, allowed: f64) -> bool {
        let at = |row: u32| self.vertices[row as usize % self.vertices.len()];
        let away = |from: u32, to: u32| distance(at(from), at(to));
        let length = |from: u32, to: u32| (from..to).map(|row| away(row, row + 1)).sum::<f64>();
        self.rows.windows(2).any(|ends| length(ends[0], ends[1]) > SWUNG_OUT * away(ends[0], ends[1]) + allowed)
    }

    /// The largest distance from a data point to its vertex, in units of the input.
    pub fn deviation(&self, points: &[Vector<f64, D>]) -> f64 {
        super::deviation::deviation(&self.vertices, &self.rows, points)
    }
}
