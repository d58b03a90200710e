//! Discrete energies of a batch on either device, and the units in which the devices may differ.

use faircurve::discrete::{Energy, Evaluate, Evaluation, MOST_EDGES, SpacingRegularisation, Want};
use faircurve::{CurveBatch, Device};
use rand::RngExt;
use rand::rngs::StdRng;

use super::conform::{Outcome, Unit, conform, largest};
use super::{seeded, tolerance};

/// Of vertices that stand for no data point: weights are positive, and in the range of f32.
pub const NO_WEIGHT: f64 = 1e-20;

/// What is asked of the devices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    Value,
    Slope,
    Gradient,
    Hessian,
}

pub const PARTS: [Part; 4] = [Part::Value, Part::Slope, Part::Gradient, Part::Hessian];

/// A batch with a regularisation, attachments and a direction.
#[derive(Clone)]
pub struct Case {
    pub batch: CurveBatch,
    pub regularisation: Option<(Vec<f64>, Vec<bool>)>,
    pub points: Vec<f64>,
    pub weights: Vec<f64>,
    pub direction: Vec<f64>,
}

impl Case {
    pub fn new(batch: CurveBatch, rng: &mut StdRng) -> Self {
        let points: Vec<f64> = batch.coords().iter().map(|x| x * (1.0 + rng.random_range(-0.01..0.01))).collect();
        let direction: Vec<f64> = batch.coords().iter().map(|x| x * rng.random_range(-0.01..0.01)).collect();
        let weights =
            (0..batch.total_points()).map(|v| if v % 3 == 0 { rng.random_range(0.1..1.0) } else { NO_WEIGHT });
        let weights = weights.collect();
        Case { batch, regularisation: None, points, weights, direction }
    }

    /// Every fifth vertex a data point, and a regularisation that weighs about as much as bending does.
    pub fn with_regularisation(mut self) -> Self {
        let (batch, d) = (&self.batch, self.batch.dimension());
        let weight = |i: usize| {
            let edges = batch.points(i).windows(2 * d).step_by(d);
            let total: f64 = edges.map(|w| (0..d).map(|c| (w[c + d] - w[c]).powi(2)).sum::<f64>().sqrt()).sum();
            let mean = total / batch.count(i).max(1) as f64;
            if mean > 0.0 && mean.is_finite() { 1.0 / mean } else { 1.0 }
        };
        let weights = (0..batch.len()).map(weight).collect();
        self.regularisation = Some((weights, (0..batch.total_points()).map(|v| v % 5 == 0).collect()));
        self
    }

    fn run(&self, energy: &Energy, part: Part, device: &Device) -> Vec<Evaluation> {
        let targets =
            CurveBatch::from_ragged(self.batch.dimension(), self.points.clone(), self.batch.offsets().to_vec());
        let closed = (0..self.batch.len()).map(|i| self.batch.is_closed(i)).collect::<Vec<_>>();
        let targets = targets.unwrap().closed_each(closed).unwrap().with_weights(self.weights.clone()).unwrap();
        let want = match part {
            Part::Value => Want::Value,
            Part::Slope => Want::Slope(&self.direction),
            Part::Gradient => Want::Gradient,
            Part::Hessian => Want::Blocks,
        };
        let regularisation =
            self.regularisation.as_ref().map(|(weights, is_data)| SpacingRegularisation { weights, is_data });
        let options = Evaluate { want, targets: Some(&targets), regularisation, ..Evaluate::default() };
        energy.evaluate(&self.batch, options, device).unwrap()
    }

    pub fn outcome(&self, energy: &Energy, part: Part, device: &Device) -> Outcome {
        let mut outcome = self.raw_outcome(energy, part, device);
        // What exceeds the range of f64 is infinite by one order of operations, and not a number by
        // another.
        outcome.values.iter_mut().filter(|x| x.is_infinite()).for_each(|x| *x = f64::NAN);
        outcome
    }

    fn raw_outcome(&self, energy: &Energy, part: Part, device: &Device) -> Outcome {
        let found = self.run(energy, part, device);
        let d = self.batch.dimension();
        let number = |of: fn(&Evaluation) -> f64| Outcome {
            names: self.names(),
            ..Outcome::of_numbers(found.iter().map(of).collect())
        };
        match part {
            Part::Value => number(|found| found.value),
            Part::Slope => number(|found| found.slope),
            Part::Gradient => self.of_vertices(found.into_iter().flat_map(|found| found.gradient).collect(), d),
            Part::Hessian => {
                let blocks = found.into_iter().flat_map(|found| found.hessian).collect();
                self.of_vertices(blocks, (MOST_EDGES + 1) * d * d)
            }
        }
    }

    pub fn names(&self) -> Vec<String> {
        let closed = |i| if self.batch.is_closed(i) { "closed" } else { "open" };
        (0..self.batch.len())
            .map(|i| format!("{}, {} vertices, {}", self.batch.name(i), self.batch.count(i), closed(i)))
            .collect()
    }

    fn of_vertices(&self, values: Vec<f64>, a_vertex: usize) -> Outcome {
        let offsets: Vec<usize> = self.batch.offsets().iter().map(|k| k * a_vertex).collect();
        let status = Outcome::of_numbers(vec![0.0; self.batch.len()]).status;
        Outcome { values, offsets, status, names: self.names(), along: vec![] }
    }

    /// The case with every edge, direction and offset changed by up to `relative` of its length.
    fn perturbed(&self, relative: f64, rng: &mut StdRng) -> Self {
        let d = self.batch.dimension();
        let mut coords = self.batch.coords().to_vec();
        for i in 0..self.batch.len() {
            let (points, count) = (self.batch.points(i), self.batch.count(i));
            let spans = self.batch.spans(i);
            let edge = |j: usize, c: usize| points[(j + 1) % count * d + c] - points[j * d + c];
            let length = |j: usize| (0..d).map(|c| edge(j, c).powi(2)).sum::<f64>().sqrt();
            let mut change: Vec<Vec<f64>> = (0..spans)
                .map(|j| (0..d).map(|_| relative * length(j) * rng.random_range(-1.0..1.0)).collect())
                .collect();
            if self.batch.is_closed(i) {
                // What is left over at the closing is spread over all edges, in proportion.
                let total: f64 = (0..spans).map(length).sum();
                for c in 0..d {
                    let sum: f64 = change.iter().map(|x| x[c]).sum();
                    (0..spans).for_each(|j| change[j][c] -= sum * length(j) / total);
                }
            }
            let mut sum = vec![0.0; d];
            for v in 1..count {
                for c in 0..d {
                    sum[c] += change[v - 1][c];
                    coords[(self.batch.offsets()[i] + v) * d + c] += sum[c];
                }
            }
        }
        let batch = CurveBatch::from_ragged(d, coords.clone(), self.batch.offsets().to_vec()).unwrap();
        let closed = (0..batch.len()).map(|i| self.batch.is_closed(i)).collect();
        let mut factor = |x: &f64| x * (1.0 + relative * rng.random_range(-1.0..1.0));
        // Offsets from data points are what the device rounds.
        let moved = self.batch.coords().iter().zip(&self.points).zip(&coords);
        let points = moved.map(|((x, p), moved)| moved - factor(&(x - p))).collect();
        let direction = self.direction.iter().map(&mut factor).collect();
        Case { batch: batch.closed_each(closed).unwrap(), points, direction, ..self.clone() }
    }

    /// A rounding of every edge, in units of ε: what it changes of a curve's numbers, and the
    /// largest of them.
    pub fn units(&self, energy: &Energy, part: Part) -> Vec<f64> {
        let relative = 1e-6;
        let here = self.outcome(energy, part, &Device::cpu());
        let mut units: Vec<f64> = (0..here.len()).map(|i| largest(here.curve(i))).collect();
        let mut rng = seeded(999);
        for _ in 0..16 {
            let there = self.perturbed(relative, &mut rng).outcome(energy, part, &Device::cpu());
            for (i, unit) in units.iter_mut().enumerate() {
                let changes = here.curve(i).iter().zip(there.curve(i)).map(|(x, y)| (x - y).abs() / relative);
                *unit = unit.max(changes.filter(|x| x.is_finite()).fold(0.0, f64::max));
            }
        }
        if part == Part::Slope {
            // The CPU sums g·p, and g is the difference of what both edges give: good to roundings
            // of the largest.
            let found = self.run(energy, Part::Gradient, &Device::cpu());
            let d = self.batch.dimension();
            for (i, unit) in units.iter_mut().enumerate() {
                let range = self.batch.offsets()[i] * d..self.batch.offsets()[i + 1] * d;
                *unit = unit.max(largest(&found[i].gradient) * largest(&self.direction[range]));
            }
        }
        units
    }

    pub fn conforms(&self, what: &str, energy: &Energy, parts: &[Part], device: &Device) {
        for &part in parts {
            let units = self.units(energy, part);
            let what = format!("{what}, {energy}, {}-D, {part:?}", self.batch.dimension());
            let operation = |device: &Device| self.outcome(energy, part, device);
            conform(&what, device, tolerance::DISCRETE, Unit::Each(&units), operation);
        }
    }
}
