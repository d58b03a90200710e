//! [`Smoother`]: normalises one curve, solves its problem and scales the solution back.

use nalgebra::{Matrix3, Vector3};

use self::search::lambda_at;
use super::knots::Knots;
use super::reinsch::Reinsch;
use super::smoothing::{LAMBDA_CAP, Smoothing, SmoothingTarget};
use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::deviation::Deviation;
use crate::report::CurveReport;
use crate::status::CurveStatus;

mod gcv;
mod least;
mod search;

pub(super) use search::octave;

/// One curve of a batch and the places of its result.
pub(super) struct Slot<'a> {
    /// The data points, as given.
    pub batch: &'a CurveBatch,
    /// The knots without their values.
    pub knots: &'a Knots,
    /// Which curve.
    pub curve: usize,
    /// In: the data at the knots. Out: the curve at the knots.
    pub values: &'a mut [f64],
    /// Out: p″ at the knots.
    pub second: &'a mut [f64],
}

/// The result of a kernel: the step whose λ keeps the deviation, and the number of solves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    pub step: i32,
    pub solves: u32,
}

/// So that nobody who adds up the squares in another order finds more than was allowed.
fn keeps(deviation: f64, allowed: f64) -> bool {
    deviation <= allowed * (1.0 - 8.0 * f64::EPSILON)
}

/// Buffers that a thread reuses for all its curves.
#[derive(Default)]
pub(super) struct Smoother {
    problem: Reinsch<f64>,
    /// The data at the knots; pinned ends as given, without averaging.
    data: Vec<f64>,
    /// The curve of the last solve at the knots.
    candidate: Vec<f64>,
    /// Half the size of the bounding box.
    size: f64,
    /// Length of the parameter interval.
    length: f64,
    /// ωT³ up to overflow: λ = λ′·ω·T·T·T.
    weight: f64,
    /// The least share of its size that a closed curve keeps.
    least_share: f64,
    solves: u32,
}

impl Smoother {
    /// Fits one curve.
    pub fn fit(&mut self, mut slot: Slot, options: &Smoothing) -> CurveReport {
        self.load(&slot, options);
        let (batch, curve) = (slot.batch, slot.curve);
        let within = |deviation: Deviation| deviation.of(batch, curve);
        match options.target {
            SmoothingTarget::Lambda(lambda) => self.solve_asked(&mut slot, lambda),
            SmoothingTarget::Deviation(allowed) => self.search(&mut slot, within(allowed)),
            SmoothingTarget::Tube(allowed) => self.least(&mut slot, within(allowed)),
            SmoothingTarget::CrossValidation => self.cross_validated(&mut slot),
        }
    }

    /// The curve of a given λ. A closed curve that would collapse gets the largest λ without
    /// collapse.
    fn solve_asked(&mut self, slot: &mut Slot, lambda: f64) -> CurveReport {
        let normalised = self.normalised(lambda);
        let solved = if normalised < LAMBDA_CAP { self.solve(normalised) } else { self.solve_line() };
        if !solved && self.problem.has_inner_pins() {
            return self.search(slot, f64::INFINITY);
        }
        if !solved {
            if !self.solve(0.0) {
                return unsolvable(slot, &self.data);
            }
            let deviation = self.deviation(slot).0;
            let report = self.keep(slot, 0.0, deviation);
            return self.too_large(slot, lambda, report);
        }
        if !self.stands() {
            let report = self.search(slot, f64::INFINITY);
            return self.stopped(slot, &format!("λ = {lambda}"), report);
        }
        let deviation = self.deviation(slot).0;
        CurveReport { smoothing: Some(lambda), ..self.keep(slot, normalised, deviation) }
    }

    /// Sets up the normalised problem of a curve for the kernel, and gives the amount in its terms:
    /// the normalised λ, or the deviation in units of the size. `None` where the host must fit: the
    /// answer is the regression line or the data themselves, the kernel's precision (its ε) does
    /// not resolve the system, or points were averaged, which the kernel does not know.
    pub fn prepare_for_kernel(&mut self, slot: &Slot, options: &Smoothing, epsilon: f64) -> Option<f64> {
        self.load(slot, options);
        match options.target {
            SmoothingTarget::Lambda(lambda) => {
                let normalised = self.normalised(lambda);
                let proper = normalised > 0.0 && normalised < LAMBDA_CAP && self.is_resolved(normalised, epsilon);
                proper.then_some(normalised)
            }
            SmoothingTarget::Deviation(allowed) => {
                let allowed = allowed.of(slot.batch, slot.curve);
                let averaged = slot.knots.repeats.contains_key(&slot.curve);
                let is_line = !averaged && self.solve_line() && keeps(self.deviation(slot).0, allowed);
                (!averaged && !is_line).then_some(allowed / self.size)
            }
            SmoothingTarget::Tube(_) | SmoothingTarget::CrossValidation => None,
        }
    }

    /// The normalised problem set up last.
    pub fn problem(&self) -> &Reinsch<f64> {
        &self.problem
    }

    /// Whether a precision resolves the system for a normalised λ: its condition number, bounded by
    /// the largest row sum over the smallest eigenvalue of αR, may lose all but a hundredth of the
    /// digits, which refinement brings back.
    fn is_resolved(&self, normalised: f64, epsilon: f64) -> bool {
        let problem = &self.problem;
        let shortest = problem.spans.iter().copied().fold(f64::INFINITY, f64::min);
        let heaviest = problem.inverse_weights.iter().copied().fold(0.0, f64::max);
        // Rows of R sum to at most 1, those of Q to 4/h in magnitude; the eigenvalues of R are at
        // least h/6.
        let condition = (1.0 + normalised * heaviest * (4.0 / shortest) * (4.0 / shortest)) / (shortest / 6.0);
        condition * epsilon <= 0.01
    }

    /// Takes over a kernel's solution. `None` if it is not finite, breaks the deviation, has
    /// collapsed, or is beyond the kernel's precision (its ε).
    pub fn accept(
        &mut self,
        slot: &mut Slot,
        options: &Smoothing,
        outcome: Outcome,
        epsilon: f64,
        moments: impl Iterator<Item = f64>,
        correction: impl Iterator<Item = f64>,
    ) -> Option<CurveReport> {
        self.load(slot, options);
        let (normalised, allowed) = match options.target {
            SmoothingTarget::Lambda(lambda) => (self.normalised(lambda), f64::INFINITY),
            SmoothingTarget::Deviation(allowed) => (lambda_at(outcome.step), allowed.of(slot.batch, slot.curve)),
            SmoothingTarget::Tube(_) | SmoothingTarget::CrossValidation => return None,
        };
        if !self.is_resolved(normalised, epsilon) {
            return None;
        }
        self.problem.alpha = 1.0 / (1.0 + normalised);
        for (to, from) in self.problem.moments.iter_mut().zip(moments) {
            *to = from;
        }
        for (to, from) in self.problem.correction.iter_mut().zip(correction) {
            *to = from;
        }
        if !self.finish_solve() || !self.stands() {
            return None;
        }
        self.solves = outcome.solves;
        let deviation = self.deviation(slot).0;
        let mut report = (deviation <= allowed).then(|| self.keep(slot, normalised, deviation))?;
        if let SmoothingTarget::Lambda(lambda) = options.target {
            report.smoothing = Some(lambda);
        }
        Some(report)
    }

    /// Sets up the normalised problem of a curve.
    fn load(&mut self, slot: &Slot, options: &Smoothing) {
        let (d, i) = (slot.knots.dimension, slot.curve);
        let (t, weights) = (slot.knots.t(i), slot.knots.weights.as_ref().expect("averaged knots have weights"));
        let closed = slot.knots.closed[i];
        let count = t.len() - usize::from(closed);
        let weights = &weights[slot.knots.range(i)][..count];
        (self.solves, self.least_share) = (0, options.least_share());
        self.data.clear();
        self.data.extend_from_slice(&slot.values[..count * d]);
        let last = slot.batch.count(i) - 1;
        let is_end = |k: usize| options.pin_ends && !closed && (k == 0 || k == last);
        let mut pinned = Vec::new();
        for k in (0..=last).filter(|&k| is_end(k) || slot.batch.is_pinned(i, k)) {
            let entry = slot.knots.entry(i, k) % count;
            self.data[entry * d..(entry + 1) * d].copy_from_slice(&slot.batch.points(i)[k * d..(k + 1) * d]);
            pinned.push(entry);
        }
        let problem = &mut self.problem;
        (problem.count, problem.dimension, problem.closed) = (count, d, closed);
        self.length = t[t.len() - 1] - t[0];
        problem.spans.clear();
        problem.spans.extend(t.windows(2).map(|pair| (pair[1] - pair[0]) / self.length));
        self.weight = weights.iter().copied().fold(0.0, f64::max);
        problem.inverse_weights.clear();
        problem.inverse_weights.extend(weights.iter().map(|w| self.weight / w));
        for entry in pinned {
            problem.inverse_weights[entry] = 0.0;
        }
        problem.data.clear();
        problem.data.resize(count * d, 0.0);
        let bounds = Bounds::<3>::of_flat(&self.data, d);
        let (centre, size) = (bounds.middle(), bounds.half_size());
        self.size = if size > 0.0 { size } else { 1.0 };
        for (at, y) in self.data.iter().enumerate() {
            problem.data[at] = (y - centre[at % d]) / self.size;
        }
        problem.prepare();
        self.candidate.clear();
        self.candidate.resize(count * d, 0.0);
    }

    /// Solves for a normalised λ; false where rounding got the better of it.
    fn solve(&mut self, normalised: f64) -> bool {
        let solved = self.problem.solve(normalised);
        self.finish_solve() && solved
    }

    /// Solves for λ → ∞, where that is a line or a point: without pins between.
    fn solve_line(&mut self) -> bool {
        if self.problem.has_inner_pins() {
            return false;
        }
        self.problem.solve_line();
        self.finish_solve()
    }

    /// The curve in the units of the data. As a correction of the data, so that a correction of 0
    /// leaves their bits alone.
    fn finish_solve(&mut self) -> bool {
        self.solves += 1;
        let mut finite = self.problem.moments.iter().all(|v| v.is_finite());
        for (at, value) in self.candidate.iter_mut().enumerate() {
            *value = self.data[at] - self.size * self.problem.correction[at];
            finite &= value.is_finite();
        }
        finite
    }

    /// Largest distance from a data point to the curve's point of its parameter, by its radius, and
    /// which point that is.
    fn deviation(&self, slot: &Slot) -> (f64, usize) {
        let d = slot.knots.dimension;
        let points = slot.batch.points(slot.curve);
        let entries = slot.knots.repeats.get(&slot.curve);
        let count = self.problem.count;
        let (mut worst, mut at) = (0.0, 0);
        for (k, point) in points.chunks_exact(d).enumerate() {
            // A closed curve's last entry is its first knot again.
            let entry = entries.map_or(k, |entries| entries[k] as usize % count);
            let knot = &self.candidate[entry * d..(entry + 1) * d];
            let unit = self.size * slot.radius(k);
            let square: f64 = point.iter().zip(knot).map(|(a, b)| ((a - b) / unit).powi(2)).sum();
            if square > worst {
                (worst, at) = (square, k);
            }
        }
        (worst.sqrt() * self.size, at)
    }

    /// Whether the last solve is still a curve: all but closed ones are, whose points keep the
    /// least share of their spread in every direction.
    fn stands(&self) -> bool {
        let problem = &self.problem;
        if !problem.closed {
            return true;
        }
        let (data, correction) = (&problem.data, &problem.correction);
        let lost = self.spread(|at| data[at] - correction[at]) - self.spread(|at| data[at]) * self.least_share.powi(2);
        // No less than nothing in any direction, but for the rounding of directions that the data
        // do not have.
        lost.symmetric_eigenvalues().min() >= -64.0 * f64::EPSILON * self.spread(|at| data[at]).trace()
    }

    /// Σ w (x − x̄)(x − x̄)ᵀ of numbers at the knots, x̄ their weighted mean.
    fn spread(&self, value: impl Fn(usize) -> f64) -> Matrix3<f64> {
        let d = self.problem.dimension;
        // Pinned points count as the heaviest of the others.
        let weight = |&inverse: &f64| if inverse > 0.0 { 1.0 / inverse } else { 1.0 };
        let weights = || self.problem.inverse_weights.iter().map(weight).enumerate();
        let point = |k: usize| Vector3::from_fn(|c, _| if c < d { value(k * d + c) } else { 0.0 });
        let total: f64 = weights().map(|(_, w)| w).sum();
        let mean = weights().fold(Vector3::zeros(), |sum, (k, w)| sum + point(k) * w) / total;
        weights().fold(Matrix3::zeros(), |sum, (k, w)| sum + (point(k) - mean) * (point(k) - mean).transpose() * w)
    }

    /// Writes the last solve to its place.
    fn keep(&mut self, slot: &mut Slot, normalised: f64, deviation: f64) -> CurveReport {
        let d = self.problem.dimension;
        let inner = self.candidate.len();
        slot.values[..inner].copy_from_slice(&self.candidate);
        let scale = self.problem.alpha * self.size / self.length / self.length;
        for (second, v) in slot.second.iter_mut().zip(&self.problem.moments) {
            *second = scale * v;
        }
        if self.problem.closed {
            slot.values.copy_within(..d, inner);
            slot.second.copy_within(..d, inner);
        }
        let scale = self.size / self.length;
        CurveReport {
            iterations: self.solves,
            smoothing: Some(self.in_units(normalised)),
            max_deviation: deviation,
            ..CurveReport::solved(self.problem.energy() * scale * scale / self.length)
        }
    }

    /// λ in the units of the data.
    fn in_units(&self, normalised: f64) -> f64 {
        (normalised * self.weight * self.length * self.length * self.length).min(f64::MAX)
    }

    /// λ of the normalised problem.
    fn normalised(&self, lambda: f64) -> f64 {
        lambda / self.weight / self.length / self.length / self.length
    }

    /// The report of a closed curve whose smoothing stopped before collapse.
    fn stopped(&self, slot: &Slot, asked: &str, report: CurveReport) -> CurveReport {
        let what = format!(
            "{asked} would shrink it to less than {} of its size: it is smoothed no further than that, with \
             λ = {}; to see more of it, smooth less",
            self.least_share,
            report.smoothing.unwrap_or(0.0)
        );
        CurveReport { message: Some(slot.batch.sentence(slot.curve, 0, &what)), ..report }
    }

    /// The report of a curve whose points at one parameter lie too far apart for any curve.
    fn apart(slot: &Slot, (deviation, point): (f64, usize), allowed: f64, report: CurveReport) -> CurveReport {
        let what = format!(
            "it lies {deviation} from the curve even without smoothing, since other points have the same parameter; \
             the deviation allowed is {allowed}: give these points parameters of their own, or allow more"
        );
        slot.not_converged(point, &what, report)
    }

    /// The report of a curve whose λ was, or would have been, more than the arithmetic bears.
    fn too_large(&self, slot: &Slot, lambda: f64, report: CurveReport) -> CurveReport {
        let what = format!(
            "λ = {lambda} is too large for {} knots as unevenly spaced or weighted as these, in 64 bits; \
             the curve has λ = {}: use a smaller λ or deviation, or fewer points",
            self.problem.count,
            report.smoothing.unwrap_or(0.0)
        );
        slot.not_converged(0, &what, report)
    }
}

impl Slot<'_> {
    /// The radius of a data point, in units of the distance asked for.
    fn radius(&self, k: usize) -> f64 {
        self.knots.radii.as_ref().map_or(1.0, |radii| radii[self.batch.offsets()[self.curve] + k])
    }

    /// The report of a curve that misses its target.
    fn not_converged(&self, point: usize, what: &str, report: CurveReport) -> CurveReport {
        let message = Some(self.batch.sentence(self.curve, point, what));
        CurveReport { status: CurveStatus::NotConverged, message, ..report }
    }
}

/// The report of a curve that overflows even without smoothing; its data come out, joined by
/// segments.
fn unsolvable(slot: &mut Slot, data: &[f64]) -> CurveReport {
    slot.values[..data.len()].copy_from_slice(data);
    slot.second.fill(0.0);
    let t = slot.knots.t(slot.curve);
    let least = t.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let what = format!(
        "the smallest step of its parameter, {least}, is too small beside the length of all, {}: \
         merge these points, or choose another parametrisation",
        t[t.len() - 1] - t[0]
    );
    CurveReport::unfitted(CurveStatus::Invalid, slot.batch.sentence(slot.curve, 0, &what))
}
