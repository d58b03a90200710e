//! The smoothing of one curve: to the normalised problem and back, and the search for the λ that keeps a deviation.

use super::knots::Knots;
use super::reinsch::Reinsch;
use super::smoothing::{Amount, LAMBDA_CAP, Smoothing};
use crate::batch::CurveBatch;
use crate::report::{CurveReport, CurveStatus};

/// λ is closed in on until the next one known to break the deviation is larger by no more than this factor.
const CLOSE: f64 = 1.002;

/// Step of λ while a bracket is sought.
const STRIDE: f64 = 8.0;

/// Steps while a bracket is sought: 70 decades.
const MAX_STRIDES: usize = 80;

/// One curve of a batch and the places of its result.
pub(super) struct Target<'a> {
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

/// What a kernel found: the normalised λ, 1/(1 + λ), and how many solves it took.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    pub lambda: f64,
    pub alpha: f64,
    pub solves: u32,
}

/// So that nobody who adds up the squares in another order finds more than was allowed.
fn keeps(deviation: f64, allowed: f64) -> bool {
    deviation <= allowed * (1.0 - 8.0 * f64::EPSILON)
}

/// What a thread keeps from curve to curve.
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
    solves: u32,
}

impl Smoother {
    /// Fits one curve.
    pub fn fit(&mut self, mut target: Target, options: &Smoothing) -> CurveReport {
        self.load(&target, options.pin_ends);
        match options.amount {
            Amount::Lambda(lambda) => {
                let normalised = lambda / self.weight / self.length / self.length / self.length;
                let solved = if normalised < LAMBDA_CAP { self.solve(normalised) } else { self.solve_line() };
                if !solved {
                    if !self.solve(0.0) {
                        return unsolvable(&mut target, &self.data);
                    }
                    let deviation = self.deviation(&target).0;
                    let report = self.keep(&mut target, 0.0, deviation);
                    return self.too_large(&target, lambda, report);
                }
                let deviation = self.deviation(&target).0;
                CurveReport { smoothing: Some(lambda), ..self.keep(&mut target, normalised, deviation) }
            }
            Amount::Deviation(allowed) => self.search(&mut target, allowed),
        }
    }

    /// Sets up the normalised problem of a curve for the kernel, and gives the amount in its terms: the normalised λ, or
    /// the deviation in units of the size. `None` where the host must fit: the answer is the regression line or the
    /// data themselves, or points were averaged, which the kernel does not know.
    pub fn prepare_for_kernel(&mut self, target: &Target, options: &Smoothing) -> Option<f64> {
        self.load(target, options.pin_ends);
        match options.amount {
            Amount::Lambda(lambda) => {
                let normalised = lambda / self.weight / self.length / self.length / self.length;
                (normalised > 0.0 && normalised < LAMBDA_CAP).then_some(normalised)
            }
            Amount::Deviation(allowed) => {
                let averaged = target.knots.repeats.contains_key(&target.curve);
                let is_line = !averaged && self.solve_line() && keeps(self.deviation(target).0, allowed);
                (!averaged && !is_line).then_some(allowed / self.size)
            }
        }
    }

    /// The normalised problem set up last.
    pub fn problem(&self) -> &Reinsch<f64> {
        &self.problem
    }

    /// Takes over what a kernel solved, as if [`solve`](Self::solve) had; `None` where it is not finite or breaks the
    /// deviation after all.
    pub fn accept(
        &mut self,
        target: &mut Target,
        options: &Smoothing,
        outcome: Outcome,
        moments: impl Iterator<Item = f64>,
        correction: impl Iterator<Item = f64>,
    ) -> Option<CurveReport> {
        self.load(target, options.pin_ends);
        self.problem.alpha = outcome.alpha;
        self.problem.moments.iter_mut().zip(moments).for_each(|(to, from)| *to = from);
        self.problem.correction.iter_mut().zip(correction).for_each(|(to, from)| *to = from);
        if !self.finish_solve() {
            return None;
        }
        self.solves = outcome.solves;
        let deviation = self.deviation(target).0;
        match options.amount {
            Amount::Lambda(lambda) => {
                Some(CurveReport { smoothing: Some(lambda), ..self.keep(target, outcome.lambda, deviation) })
            }
            Amount::Deviation(allowed) => (deviation <= allowed).then(|| self.keep(target, outcome.lambda, deviation)),
        }
    }

    /// Sets up the normalised problem of a curve.
    fn load(&mut self, target: &Target, pin_ends: bool) {
        let (d, i) = (target.knots.dimension, target.curve);
        let (t, weights) = (target.knots.t(i), target.knots.weights.as_ref().expect("averaged knots have weights"));
        let closed = target.knots.closed[i];
        let count = t.len() - usize::from(closed);
        let weights = &weights[target.knots.range(i)][..count];
        self.solves = 0;
        self.data.clear();
        self.data.extend_from_slice(&target.values[..count * d]);
        let pin = pin_ends && !closed;
        if pin {
            let points = target.batch.points(i);
            self.data[..d].copy_from_slice(&points[..d]);
            self.data[(count - 1) * d..].copy_from_slice(&points[points.len() - d..]);
        }
        let problem = &mut self.problem;
        (problem.count, problem.dimension, problem.closed) = (count, d, closed);
        self.length = t[t.len() - 1] - t[0];
        problem.spans.clear();
        problem.spans.extend(t.windows(2).map(|pair| (pair[1] - pair[0]) / self.length));
        self.weight = weights.iter().copied().fold(0.0, f64::max);
        problem.inverse_weights.clear();
        problem.inverse_weights.extend(weights.iter().map(|w| self.weight / w));
        if pin {
            (problem.inverse_weights[0], problem.inverse_weights[count - 1]) = (0.0, 0.0);
        }
        problem.data.clear();
        problem.data.resize(count * d, 0.0);
        // Halves, so that nothing overflows.
        let (mut centre, mut size) = ([0.0; 3], 0.0_f64);
        for (axis, centre) in centre.iter_mut().enumerate().take(d) {
            let column = || self.data[axis..].iter().step_by(d);
            let low = column().copied().fold(f64::INFINITY, f64::min);
            let high = column().copied().fold(f64::NEG_INFINITY, f64::max);
            *centre = 0.5 * low + 0.5 * high;
            size = size.max(0.5 * high - 0.5 * low);
        }
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

    /// Solves for λ → ∞.
    fn solve_line(&mut self) -> bool {
        self.problem.solve_line();
        self.finish_solve()
    }

    /// The curve in the units of the data. As a correction of the data, so that a correction of 0 leaves their bits alone.
    fn finish_solve(&mut self) -> bool {
        self.solves += 1;
        let mut finite = self.problem.moments.iter().all(|v| v.is_finite());
        for (at, value) in self.candidate.iter_mut().enumerate() {
            *value = self.data[at] - self.size * self.problem.correction[at];
            finite &= value.is_finite();
        }
        finite
    }

    /// Largest distance from a data point to the curve's point of its parameter, and which point that is.
    fn deviation(&self, target: &Target) -> (f64, usize) {
        let d = target.knots.dimension;
        let points = target.batch.points(target.curve);
        let entries = target.knots.repeats.get(&target.curve);
        let count = self.problem.count;
        let (mut worst, mut at) = (0.0, 0);
        for (k, point) in points.chunks_exact(d).enumerate() {
            // A closed curve's last entry is its first knot again.
            let entry = entries.map_or(k, |entries| entries[k] as usize % count);
            let knot = &self.candidate[entry * d..(entry + 1) * d];
            let square: f64 = point.iter().zip(knot).map(|(a, b)| ((a - b) / self.size).powi(2)).sum();
            if square > worst {
                (worst, at) = (square, k);
            }
        }
        (worst.sqrt() * self.size, at)
    }

    /// Writes the last solve to its place.
    fn keep(&mut self, target: &mut Target, normalised: f64, deviation: f64) -> CurveReport {
        let d = self.problem.dimension;
        let inner = self.candidate.len();
        target.values[..inner].copy_from_slice(&self.candidate);
        let scale = self.problem.alpha * self.size / self.length / self.length;
        for (second, v) in target.second.iter_mut().zip(&self.problem.moments) {
            *second = scale * v;
        }
        if self.problem.closed {
            target.values.copy_within(..d, inner);
            target.second.copy_within(..d, inner);
        }
        let scale = self.size / self.length;
        CurveReport {
            iterations: self.solves,
            smoothing: Some(self.in_units(normalised)),
            max_deviation: deviation,
            ..CurveReport::solved(self.problem.energy() * scale * scale / self.length)
        }
    }

    /// The largest λ that keeps the deviation allowed.
    fn search(&mut self, target: &mut Target, allowed: f64) -> CurveReport {
        let keeps = |deviation: f64| keeps(deviation, allowed);
        if self.solve_line() {
            let deviation = self.deviation(target).0;
            if keeps(deviation) {
                return self.keep(target, LAMBDA_CAP, deviation);
            }
        }
        if !self.solve(0.0) {
            return unsolvable(target, &self.data);
        }
        let (deviation, point) = self.deviation(target);
        let mut best = self.keep(target, 0.0, deviation);
        if !keeps(deviation) {
            let what = format!(
                "it lies {deviation} from the curve even without smoothing, since other points have the same parameter; \
                 the deviation allowed is {allowed}: give these points parameters of their own, or allow more"
            );
            let message = Some(target.batch.sentence(target.curve, point, &what));
            return CurveReport { status: CurveStatus::NotConverged, message, ..best };
        }
        // The λ of the last attempt above the result, where it failed for rounding.
        let mut unsolved = None;
        let mut reach = |smoother: &mut Self, normalised: f64| {
            let solved = smoother.solve(normalised);
            let deviation = if solved { smoother.deviation(target).0 } else { f64::INFINITY };
            let kept = keeps(deviation);
            if kept {
                best = smoother.keep(target, normalised, deviation);
            }
            // Clamped, so that 0 and ∞ leave the search its arithmetic.
            let excess = (deviation / allowed).ln().clamp(-20.0, 20.0);
            if !kept {
                unsolved = (!solved).then_some(normalised);
            }
            (kept, if kept { excess.min(0.0) } else { excess.max(f64::MIN_POSITIVE) })
        };
        // While λ is small the points move by λ|ΩQγ|: a start close to the goal for noisy data.
        let start = allowed / (self.size * self.problem.largest_pull());
        let mut lambda = start.clamp(f64::MIN_POSITIVE, LAMBDA_CAP);
        let (mut below, mut above) = (None, None);
        for _ in 0..MAX_STRIDES {
            let (kept, excess) = reach(self, lambda);
            let end = Some((lambda.ln(), excess));
            if kept {
                below = end;
                if above.is_some() || lambda == LAMBDA_CAP {
                    break;
                }
                lambda = (lambda * STRIDE).min(LAMBDA_CAP);
            } else {
                above = end;
                if below.is_some() || lambda == f64::MIN_POSITIVE {
                    break;
                }
                lambda = (lambda / STRIDE).max(f64::MIN_POSITIVE);
            }
        }
        if let (Some(below), Some(above)) = (below, above) {
            close_in(below, above, CLOSE.ln(), |x| reach(self, x.exp()));
        }
        let report = CurveReport { iterations: self.solves, ..best };
        match unsolved {
            None => report,
            Some(normalised) => self.too_large(target, self.in_units(normalised), report),
        }
    }

    /// λ in the units of the data.
    fn in_units(&self, normalised: f64) -> f64 {
        (normalised * self.weight * self.length * self.length * self.length).min(f64::MAX)
    }

    /// The report of a curve whose λ was, or would have been, more than the arithmetic bears.
    fn too_large(&self, target: &Target, lambda: f64, report: CurveReport) -> CurveReport {
        let what = format!(
            "λ = {lambda} is too large for {} knots as unevenly spaced or weighted as these, in 64 bits; \
             the curve has λ = {}: use a smaller λ or deviation, or fewer points",
            self.problem.count,
            report.smoothing.unwrap_or(0.0)
        );
        let message = Some(target.batch.sentence(target.curve, 0, &what));
        CurveReport { status: CurveStatus::NotConverged, message, ..report }
    }
}

/// The report of a curve that overflows even without smoothing; its data come out, joined by segments.
fn unsolvable(target: &mut Target, data: &[f64]) -> CurveReport {
    target.values[..data.len()].copy_from_slice(data);
    target.second.fill(0.0);
    let t = target.knots.t(target.curve);
    let least = t.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let what = format!(
        "the smallest step of its parameter, {least}, is too small beside the length of all, {}: \
         merge these points, or choose another parametrisation",
        t[t.len() - 1] - t[0]
    );
    CurveReport::unfitted(CurveStatus::Invalid, target.batch.sentence(target.curve, 0, &what))
}

/// Narrows the bracket of a root until its ends are no more than `width` apart: the ITP method, which is never slower than
/// bisection by more than one step and usually as fast as the secant method. Ends are (x, f(x)); f is not above 0
/// at `below` and positive at `above`; `f` says as well whether x counts as below.
///
/// I. F. D. Oliveira, R. H. C. Takahashi, An enhancement of the bisection method average performance preserving minmax
/// optimality, ACM Trans. Math. Softw. 47 (2020) 5, with κ₁ = 0.2/(b − a), κ₂ = 2, n₀ = 1.
fn close_in(mut below: (f64, f64), mut above: (f64, f64), width: f64, mut f: impl FnMut(f64) -> (bool, f64)) {
    let first = above.0 - below.0;
    let mut reach = 0.5 * width * 2_f64.powf((first / width).log2().ceil() + 1.0);
    while above.0 - below.0 > width {
        let gap = above.0 - below.0;
        let middle = 0.5 * (below.0 + above.0);
        let secant = (above.1 * below.0 - below.1 * above.0) / (above.1 - below.1);
        let towards = (middle - secant).signum();
        let nudge = 0.2 / first * gap * gap;
        let nudged = if nudge <= (middle - secant).abs() { secant + towards * nudge } else { middle };
        let radius = reach - 0.5 * gap;
        let x = if (nudged - middle).abs() <= radius { nudged } else { middle - towards * radius };
        let (kept, value) = f(x);
        *(if kept { &mut below } else { &mut above }) = (x, value);
        reach *= 0.5;
    }
}
