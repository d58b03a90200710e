//! The greedy search of Alon & Bergmann, section 4, steps 1 to 5, without evaluating anything twice.

use super::{Evolution, Outcome, Record, Request, SegmentCosts, check, evaluate, requests_of};
use crate::error::{Error, Result};

/// Options of the greedy search: of all moves of one slope by ±Δα the one that lowers the cost most
/// is made, until none lowers it.
///
/// 1. The slopes start from [`initial_slopes`](super::initial_slopes), or whatever is given.
/// 2. S_k, the cost of the one or two segments at dot k.
/// 3. S_k^±, the same with α_k ± Δα.
/// 4. Where S_k − S_k^± is largest, and positive, α_k ← α_k ± Δα. Ties go to the first dot, and to
///    − before +.
/// 5. Again from 2, until nothing decreases.
///
/// What it finds is a local minimum on the grid α⁽⁰⁾ + Δα·ℤⁿ: no single move improves it, so every
/// slope's derivative is below about Δα/2 times its second derivative.
///
/// Where segments are infinite a move that leaves fewer of them counts as a decrease, whatever it
/// does to the rest: the paper does not say, and without it no search could leave a place where two
/// neighbouring segments have no minimiser.
///
/// # Cost
///
/// At first all segments: for each one solve, and two for each of its ends that may move (five in
/// all). After a move at dot k only the two segments there have changed. Of their entries the old
/// cost serves as the step back and the cost just reached as the new one; new are the next step
/// ahead at k (two solves) and ±Δα at the two neighbours, each with the one segment they share with
/// k (four): **six solves an iteration**, in one request; three where k ends an open curve, two
/// fewer for every neighbour whose slope is fixed. Recomputing everything, as the steps read, takes
/// five for each segment ([`Outcome::textbook_solves`]).
///
/// ```
/// use faircurve::papers::searches::{Greedy, Request, SegmentCosts};
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
    /// Δα, radians. The paper does not give its own; 0.01 (0.6°) by default, finer than a picture
    /// shows.
    pub step: f64,
    /// Where nothing decreases Δα is halved, as long as it stays at least this large (radians).
    /// `None`, the default: it is never halved, as in the paper. Halving ends nearer to the
    /// minimum, and a coarse `step` first needs fewer moves.
    pub smallest_step: Option<f64>,
    /// Most moves, so that a search always ends; 1,000,000 by default, far more than any figure of
    /// the paper needs.
    pub max_iterations: usize,
}

impl Default for Greedy {
    fn default() -> Self {
        Greedy { step: 0.01, smallest_step: None, max_iterations: 1_000_000 }
    }
}

impl Greedy {
    /// Searches from the slopes `start` (radians, one a dot); where `fixed`, a slope stays as it
    /// is, bit for bit.
    ///
    /// # Errors
    ///
    /// [`Error::Argument`] where slopes and flags are not as many as dots, a slope is not finite,
    /// or a step is not positive; and those of [`SegmentCosts::costs`].
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

/// The two ways a slope moves, as indices: by −Δα and by +Δα.
const WAYS: [i64; 2] = [-1, 1];

/// Costs of some segments of which some may be infinite: fewer infinite ones first, then the sum of
/// the others.
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

/// All segments' costs, as they are and with either end moved by one step.
struct Table {
    /// α_k = origin_k + steps_k·Δα: a slope that comes back has the same bits, so that costs kept
    /// are costs computed.
    origin: Vec<f64>,
    steps: Vec<i64>,
    step: f64,
    fixed: Vec<bool>,
    closed: bool,
    now: Vec<f64>,
    /// By segment, by end, by way; ∞ where the end's slope is fixed, which is never read.
    moved: Vec<[[f64; 2]; 2]>,
    solves: usize,
    /// Solves an iteration takes if nothing is kept, and so many up to now.
    whole: usize,
    textbook: usize,
    /// What the next call asks for, with the place in `moved` that the answer goes to.
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

    /// The segments at a dot, each with the end that lies there: the one that arrives, and the one
    /// that leaves.
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

    /// Asks for a segment with one end a step away, unless the slope there is fixed.
    fn ask(&mut self, segment: usize, end: usize, way: usize) {
        if !self.fixed[self.dot(segment, end)] {
            let mut slopes = [0, 1].map(|e| self.slope(self.dot(segment, e), 0));
            slopes[end] = self.slope(self.dot(segment, end), WAYS[way]);
            self.requests.push(Request { segment, slopes });
            self.places.push((segment, end, way));
        }
    }

    /// Evaluates what was asked for, in one request.
    fn answer(&mut self, costs: &mut dyn SegmentCosts) -> Result<()> {
        self.found.resize(self.requests.len(), 0.0);
        evaluate(costs, &self.requests, &mut self.found)?;
        self.solves += self.requests.len();
        self.textbook += self.whole;
        // Those beyond the places are of segments as they are.
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

    /// Halves Δα about the slopes as they are.
    fn halve(&mut self) {
        self.origin = self.slopes();
        self.steps.fill(0);
        self.step *= 0.5;
    }

    /// The dot and the way with the largest decrease of cost, if any decreases it.
    fn best_move(&self) -> Option<(usize, usize)> {
        let mut best: Option<(Local, usize, usize)> = None;
        for dot in (0..self.origin.len()).filter(|&dot| !self.fixed[dot]) {
            let now = Local::sum(self.at(dot).map(|(segment, _)| self.now[segment]));
            for way in [0, 1] {
                let then = Local::sum(self.at(dot).map(|(segment, end)| self.moved[segment][end][way]));
                // Compared as sums, not by their difference: rounding cannot then make two slopes
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
