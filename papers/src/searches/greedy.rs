//! The greedy search of Alon & Bergmann, section 4, steps 1 to 5.
//!
//! Nothing is evaluated twice.

use faircurve::{Error, Result};

use super::{Evolution, Outcome, Record, Request, SegmentCosts, check, evaluate, requests_of};

/// Options of the greedy search.
///
/// Of all moves of one slope by ±Δα it makes the one that lowers the cost most, until none lowers
/// it.
///
/// 1. The slopes start from [`initial_slopes`](super::initial_slopes), or from given ones.
/// 2. S_k is the cost of the one or two segments at dot k.
/// 3. S_k^± is the same with α_k ± Δα.
/// 4. Where S_k − S_k^± is largest and positive, α_k ← α_k ± Δα. Ties go to the first dot, and to −
///    before +.
/// 5. The steps repeat from 2 until nothing decreases.
///
/// The result is a local minimum on the grid α⁽⁰⁾ + Δα·ℤⁿ. No single move improves it, so every
/// slope's derivative is below about Δα/2 times its second derivative.
///
/// Where segments are infinite, a move that leaves fewer of them counts as a decrease, whatever it
/// does to the rest. The paper does not say this. Without it no search could leave a place where
/// two neighbouring segments have no minimiser.
///
/// # Cost
///
/// At first all segments are evaluated. Each one takes one solve, and two more for each of its ends
/// that may move, five in all.
///
/// After a move at dot k only the two segments there have changed. Of their entries the old cost
/// serves as the step back, and the cost just reached as the new one. The new entries are:
///
/// - the next step ahead at k, two solves;
/// - ±Δα at the two neighbours, each with the one segment they share with k, four solves.
///
/// This makes **six solves an iteration**, in one request. Where k ends an open curve there are
/// three. Every neighbour with a fixed slope saves two. Recomputing everything, as the steps read,
/// takes five for each segment ([`Outcome::textbook_solves`]).
///
/// ```
/// use faircurve_papers::searches::{Greedy, Request, SegmentCosts};
///
/// /// Segments that want to leave at 0.5 and to arrive as they leave.
/// struct Wanted;
/// impl SegmentCosts for Wanted {
///     fn dots(&self) -> usize { 4 }
///     fn is_closed(&self) -> bool { false }
///     fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> faircurve::Result<()> {
///         for (cost, Request { slopes: [a, b], .. }) in costs.iter_mut().zip(requests) {
///             *cost = (a - 0.5).powi(2) + (b - a).powi(2);
///         }
///         Ok(())
///     }
/// }
/// let outcome = Greedy::default().search(&mut Wanted, &[0.0; 4], &[false; 4])?;
/// assert!(outcome.settled && outcome.slopes.iter().all(|slope| (slope - 0.5).abs() < 0.05));
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Greedy {
    /// Δα in radians.
    ///
    /// The default is 0.01 (0.6°), which is finer than a picture shows.
    ///
    /// The paper does not give its own value.
    pub step: f64,
    /// The smallest Δα, in radians.
    ///
    /// Where nothing decreases Δα is halved, as long as it stays at least this.
    ///
    /// `None`, the default, never halves it, as in the paper. Halving ends nearer to the minimum. A
    /// coarse `step` at first needs fewer moves.
    pub smallest_step: Option<f64>,
    /// The most moves, so that a search always ends.
    ///
    /// 1,000,000 by default.
    ///
    /// This is far more than any figure of the paper needs.
    pub max_iterations: usize,
}

impl Default for Greedy {
    fn default() -> Self {
        Greedy { step: 0.01, smallest_step: None, max_iterations: 1_000_000 }
    }
}

impl Greedy {
    /// Searches from the slopes `start` (radians, one a dot).
    ///
    /// Where `fixed`, a slope stays as it is, bit for bit.
    ///
    /// # Errors
    ///
    /// - [`Error::Argument`] where the numbers of slopes and flags differ from that of dots, a
    ///   slope is not finite, or a step is not positive.
    /// - Those of [`SegmentCosts::costs`].
    pub fn search(&self, costs: &mut dyn SegmentCosts, start: &[f64], fixed: &[bool]) -> Result<Outcome> {
        check(costs.dots(), start, fixed)?;
        for (name, step) in [("step", Some(self.step)), ("smallest step", self.smallest_step)] {
            let step = step.unwrap_or(self.step);
            if !(step > 0.0 && step.is_finite()) {
                let text =
                    format!("the greedy search's {name} is {step}: give a positive angle in radians, such as 0.01");
                return Err(Error::argument(text));
            }
        }
        let mut table = Table::new(costs, start, fixed, self.step);
        table.fill(costs)?;
        let (mut evolution, mut iterations) = (Evolution::new(), 0);
        evolution.record(table.record(iterations), &table.slopes());
        let settled = loop {
            match table.best_move() {
                Some(_) if iterations == self.max_iterations => break false,
                Some((dot, way)) => {
                    table.make_move(costs, dot, way)?;
                    iterations += 1;
                    evolution.record(table.record(iterations), &table.slopes());
                }
                None if self.smallest_step.is_some_and(|least| 0.5 * table.step >= least) => {
                    table.halve();
                    table.fill(costs)?;
                }
                None => break true,
            }
        };
        let (last, textbook) = (table.record(iterations), table.textbook);
        Ok(evolution.finish(table.slopes(), last, settled, textbook))
    }
}

/// The two moves of a slope, by −Δα and by +Δα.
///
/// Their indices are called ways.
const WAYS: [i64; 2] = [-1, 1];

/// The sum of some costs, some of which may be infinite.
///
/// Sums compare by the number of infinite costs first, then by the sum of the others.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Local {
    infinite: i32,
    finite: f64,
}

impl Local {
    fn sum(costs: impl IntoIterator<Item = f64>) -> Self {
        costs.into_iter().fold(Local { infinite: 0, finite: 0.0 }, |sum, cost| match cost == f64::INFINITY {
            true => Local { infinite: sum.infinite + 1, ..sum },
            false => Local { finite: sum.finite + cost, ..sum },
        })
    }
}

/// The costs of all segments, as they are and with either end moved by one step.
struct Table {
    /// Slopes are α_k = origin_k + steps_k·Δα.
    ///
    /// A slope that comes back has the same bits, so kept costs equal computed ones.
    origin: Vec<f64>,
    steps: Vec<i64>,
    step: f64,
    fixed: Vec<bool>,
    closed: bool,
    now: Vec<f64>,
    /// Costs by segment, end and way.
    ///
    /// ∞ where the end's slope is fixed, which is never read.
    moved: Vec<[[f64; 2]; 2]>,
    solves: usize,
    /// The solves that an iteration takes if nothing is kept, and their sum so far.
    whole: usize,
    textbook: usize,
    /// The requests of the next call, with the places in `moved` for the answers.
    requests: Vec<Request>,
    places: Vec<(usize, usize, usize)>,
    found: Vec<f64>,
}

impl Table {
    fn new(costs: &dyn SegmentCosts, start: &[f64], fixed: &[bool], step: f64) -> Self {
        let segments = costs.segments();
        let free_ends = (0..segments).flat_map(|k| [k, (k + 1) % start.len()]).filter(|&dot| !fixed[dot]).count();
        Table {
            origin: start.to_vec(),
            steps: vec![0; start.len()],
            step,
            fixed: fixed.to_vec(),
            closed: costs.is_closed(),
            now: vec![0.0; segments],
            moved: vec![[[f64::INFINITY; 2]; 2]; segments],
            solves: 0,
            whole: segments + 2 * free_ends,
            textbook: 0,
            requests: Vec::new(),
            places: Vec::new(),
            found: Vec::new(),
        }
    }

    fn slope(&self, dot: usize, ahead: i64) -> f64 {
        self.origin[dot] + (self.steps[dot] + ahead) as f64 * self.step
    }

    fn slopes(&self) -> Vec<f64> {
        (0..self.origin.len()).map(|dot| self.slope(dot, 0)).collect()
    }

    /// The dot at the start (0) or the end (1) of a segment.
    fn dot(&self, segment: usize, end: usize) -> usize {
        (segment + end) % self.origin.len()
    }

    /// The segments at a dot, each with the end that lies there.
    ///
    /// The first one arrives at the dot, and the second one leaves it.
    fn at(&self, dot: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let segments = self.now.len();
        let arrives = match dot {
            0 if self.closed && segments > 0 => Some((segments - 1, 1)),
            0 => None,
            _ => Some((dot - 1, 1)),
        };
        let leaves = (dot < segments).then_some((dot, 0));
        arrives.into_iter().chain(leaves)
    }

    fn record(&self, iterations: usize) -> Record {
        Record { iterations, segment_solves: self.solves, cost: self.now.iter().sum() }
    }

    /// Requests a segment with one end moved a step, unless the slope there is fixed.
    fn ask(&mut self, segment: usize, end: usize, way: usize) {
        if !self.fixed[self.dot(segment, end)] {
            let mut slopes = [0, 1].map(|e| self.slope(self.dot(segment, e), 0));
            slopes[end] = self.slope(self.dot(segment, end), WAYS[way]);
            self.requests.push(Request { segment, slopes });
            self.places.push((segment, end, way));
        }
    }

    /// Evaluates the requested segments in one call.
    fn answer(&mut self, costs: &mut dyn SegmentCosts) -> Result<()> {
        self.found.resize(self.requests.len(), 0.0);
        evaluate(costs, &self.requests, &mut self.found)?;
        self.solves += self.requests.len();
        self.textbook += self.whole;
        // The requests beyond the places are of segments as they are.
        let (moved, now) = self.found.split_at(self.places.len());
        for (&(segment, end, way), &cost) in self.places.iter().zip(moved) {
            self.moved[segment][end][way] = cost;
        }
        for (request, &cost) in self.requests[self.places.len()..].iter().zip(now) {
            self.now[request.segment] = cost;
        }
        self.requests.clear();
        self.places.clear();
        Ok(())
    }

    /// Evaluates everything.
    fn fill(&mut self, costs: &mut dyn SegmentCosts) -> Result<()> {
        for segment in 0..self.now.len() {
            for (end, way) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                self.ask(segment, end, way);
            }
        }
        self.requests.extend(requests_of(&self.slopes(), self.now.len()));
        self.answer(costs)
    }

    /// Halves Δα around the current slopes.
    fn halve(&mut self) {
        self.origin = self.slopes();
        self.steps.fill(0);
        self.step *= 0.5;
    }

    /// The dot and the way with the largest decrease of cost, if there is a decrease.
    fn best_move(&self) -> Option<(usize, usize)> {
        let mut best: Option<(Local, usize, usize)> = None;
        for dot in (0..self.origin.len()).filter(|&dot| !self.fixed[dot]) {
            let now = Local::sum(self.at(dot).map(|(segment, _)| self.now[segment]));
            for way in [0, 1] {
                let then = Local::sum(self.at(dot).map(|(segment, end)| self.moved[segment][end][way]));
                // Sums are compared, not their difference. Rounding then cannot make two slopes
                // chase each other.
                if then < now {
                    let gain = Local { infinite: now.infinite - then.infinite, finite: now.finite - then.finite };
                    if best.is_none_or(|(most, ..)| gain > most) {
                        best = Some((gain, dot, way));
                    }
                }
            }
        }
        best.map(|(_, dot, way)| (dot, way))
    }

    /// Moves a dot's slope and brings the table up to date.
    fn make_move(&mut self, costs: &mut dyn SegmentCosts, dot: usize, way: usize) -> Result<()> {
        self.steps[dot] += WAYS[way];
        for (segment, end) in self.at(dot) {
            let ends = &mut self.moved[segment][end];
            ends[1 - way] = std::mem::replace(&mut self.now[segment], ends[way]);
            self.ask(segment, end, way);
            self.ask(segment, 1 - end, 0);
            self.ask(segment, 1 - end, 1);
        }
        self.answer(costs)
    }
}

#[cfg(test)]
mod tests;
