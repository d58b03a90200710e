//! All methods on one list of dots with one exponent, and their rows of the table.

use std::fmt::Write;
use std::time::Instant;

use crate::searches::{self, GaussianAdaptation, Greedy, Outcome, Record, Segments, initial_slopes};
use faircurve::Result;
use faircurve::scf::{Query, Smooth, evaluate_segments};
use faircurve::{CurveBatch, CurveStatus, Device};
use glam::DVec2;
use rayon::prelude::*;

use super::{LOWER, STEEP, Shape};

/// Candidates of Gaussian Adaptation at most.
const MOST_CANDIDATES: usize = 100_000;

/// Segments that candidates of Gaussian Adaptation have together at most, so that they stay on one
/// thread.
const BATCH: usize = 4096;

/// Starts of the Newton method that searches are held against.
const STARTS: u32 = 32;

/// Curves of a greedy search that are kept, but for the first.
const KEPT: usize = 14;

/// Records of a history that reach the file are this much further on than those before, as a factor.
const THINNED: f64 = 1.05;

/// What each method made of some dots.
pub struct Case {
    name: String,
    pub exponent: f64,
    pub greedy: Run,
    pub adaptation: Run,
    pub newton: Run,
    /// From many starts.
    thorough: Run,
    /// The slopes of the greedy search, at even steps from its first move to its last.
    pub moved: Vec<Vec<f64>>,
    /// Where Gaussian Adaptation ended: the largest derivative of the cost in a slope, as a part of
    /// the cost a radian.
    steepness: f64,
}

/// One method's way.
pub struct Run {
    method: &'static str,
    seconds: f64,
    pub outcome: Outcome,
    end: &'static str,
}

impl Run {
    fn timed(method: &'static str, search: impl FnOnce() -> Result<(Outcome, &'static str)>) -> Result<Self> {
        let start = Instant::now();
        let (outcome, end) = search()?;
        Ok(Run { method, seconds: start.elapsed().as_secs_f64(), outcome, end })
    }

    fn newton(method: &'static str, shape: &Shape, options: &Smooth) -> Result<Self> {
        let points: Vec<[f64; 2]> = shape.points.iter().map(|point| point.to_array()).collect();
        let batch = CurveBatch::from_slices(&[&points[..]])?.closed(shape.closed);
        // What is timed is the method as it is used, without a history.
        let start = Instant::now();
        let fit = options.fit(&batch, &Device::cpu())?;
        let seconds = start.elapsed().as_secs_f64();
        let end = match fit.reports()[0].status {
            CurveStatus::Converged => "converged",
            CurveStatus::NoMinimiser => "no minimiser",
            _ => "not converged",
        };
        Ok(Run { method, seconds, outcome: searches::newton(options, &shape.points, shape.closed)?, end })
    }
}

impl Case {
    /// With every exponent, side by side.
    pub fn of(shape: &Shape, exponents: &[f64]) -> Result<Vec<Self>> {
        exponents.par_iter().with_max_len(1).map(|&exponent| Case::run(shape, exponent)).collect()
    }

    fn run(shape: &Shape, exponent: f64) -> Result<Self> {
        let dots = shape.points.len();
        let start = initial_slopes(&shape.points, shape.closed);
        let fixed = vec![false; dots];
        let segments = Segments::new(&shape.points, shape.closed, exponent, &Device::cpu())?;
        let greedy = Run::timed("greedy", || {
            let outcome = Greedy::default().search(&mut segments.clone(), &start, &fixed)?;
            let end = if outcome.settled { "no move lowers it" } else { "moves used up" };
            Ok((outcome, end))
        })?;
        let until = |moves| -> Result<Vec<f64>> {
            let search = Greedy { max_iterations: moves, ..Greedy::default() };
            Ok(search.search(&mut segments.clone(), &start, &fixed)?.slopes)
        };
        let moves = greedy.outcome.iterations;
        let moved = (0..=KEPT).map(|k| until(moves * k / KEPT)).collect::<Result<_>>()?;
        let adaptation = Run::timed("Gaussian Adaptation", || {
            let search = GaussianAdaptation {
                batch: Some(dots.min(BATCH / dots)),
                max_candidates: MOST_CANDIDATES,
                ..GaussianAdaptation::default()
            };
            let outcome = search.search(&mut segments.clone(), &start, &fixed)?;
            let end = if outcome.settled { "settled" } else { "candidates used up" };
            Ok((outcome, end))
        })?;
        let steepness = steepness(shape, exponent, &adaptation.outcome)?;
        let options = Smooth { exponent, ..Smooth::default() };
        let newton = Run::newton("Newton", shape, &options)?;
        let thorough = Run::newton("Newton from 32 starts", shape, &Smooth { starts: STARTS, ..options })?;
        Ok(Case { name: shape.name.clone(), exponent, greedy, adaptation, newton, thorough, moved, steepness })
    }

    /// Whether the curve has a minimum, as far as Newton's method can say.
    pub fn has_minimum(&self) -> bool {
        self.thorough.outcome.settled
    }

    /// The cost of the slopes that the searches start from.
    pub fn first_cost(&self) -> f64 {
        self.greedy.outcome.history[0].cost
    }

    fn runs(&self) -> [&Run; 4] {
        [&self.greedy, &self.adaptation, &self.newton, &self.thorough]
    }

    /// Writes rows and histories. Returns whether no search ended lower than Newton's method or,
    /// where that found no minimum, at one.
    pub fn write(&self, table: &mut String, csv: &mut String) -> bool {
        let Case { name, exponent, .. } = self;
        let costs = self.runs().map(|run| run.outcome.cost);
        let least = costs.into_iter().fold(f64::INFINITY, f64::min);
        for (k, Run { method, seconds, outcome, end }) in self.runs().into_iter().enumerate() {
            let Outcome { iterations, segment_solves: solves, cost, .. } = outcome;
            let (dots, nu) = if k == 0 { (&name[..], exponent.to_string()) } else { ("", String::new()) };
            let value = |value: String| if cost.is_finite() { value } else { "none".into() };
            let (shown, above) = (value(format!("{cost:.9e}")), value(format!("{:.1e}", cost / least - 1.0)));
            let _ = write!(table, "{dots:<12}{nu:>3}  {method:<26}{iterations:>10}{solves:>12}{seconds:>10.4}");
            let _ = writeln!(table, "{shown:>16}{above:>16}   {end}");
            for record in thinned(&outcome.history) {
                let Record { iterations, segment_solves, cost } = record;
                let cost = if cost.is_finite() { cost.to_string() } else { String::new() };
                let _ = writeln!(csv, "{name},{exponent},{method},{iterations},{segment_solves},{cost}");
            }
        }
        if !self.has_minimum() {
            let _ = writeln!(
                table,
                "{:17}no minimum was found: where Gaussian Adaptation ends the cost still falls by {:.1e} of itself a\n\
                 {:17}radian, towards slopes with which a segment has no minimiser",
                "", self.steepness, ""
            );
            return self.steepness > STEEP;
        }
        let newton = self.thorough.outcome.cost;
        let mut agrees = true;
        for run in [&self.greedy, &self.adaptation] {
            let cost = run.outcome.cost;
            if cost < newton * (1.0 - LOWER) {
                agrees = false;
                let slopes: Vec<String> = run.outcome.slopes.iter().map(|slope| format!("{slope:.4}")).collect();
                let below = 1.0 - cost / newton;
                let _ = writeln!(
                    table,
                    "                 {} is {below:.1e} lower than Newton from {STARTS} starts; its slopes: {}",
                    run.method,
                    slopes.join(" ")
                );
            }
        }
        agrees
    }
}

/// The largest derivative of the cost in a slope, as a part of the cost.
fn steepness(shape: &Shape, exponent: f64, outcome: &Outcome) -> Result<f64> {
    let laid: Vec<_> = (0..shape.segments()).map(|k| shape.segment(k, &outcome.slopes)).collect();
    let query = |&(_, chord, angles): &([usize; 2], DVec2, [f64; 2])| Query { chord: chord.length(), angles, exponent };
    let costs = evaluate_segments(&laid.iter().map(query).collect::<Vec<_>>(), &Device::cpu())?;
    let mut gradient = vec![0.0; shape.points.len()];
    for ((dots, ..), cost) in laid.iter().zip(costs) {
        let Some(cost) = cost else { return Ok(f64::INFINITY) };
        dots.iter().zip(cost.gradient).for_each(|(&dot, slope)| gradient[dot] += slope);
    }
    Ok(gradient.into_iter().fold(0.0, |most, slope| f64::max(most, slope.abs())) / outcome.cost)
}

/// The first records, and further on fewer and fewer; the last.
fn thinned(history: &[Record]) -> Vec<&Record> {
    let (mut kept, mut next) = (Vec::new(), 0.0);
    for (k, record) in history.iter().enumerate() {
        if record.iterations as f64 >= next || k + 1 == history.len() {
            kept.push(record);
            next = THINNED * record.iterations as f64;
        }
    }
    kept
}
