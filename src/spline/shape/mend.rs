//! [`mend`]: the C¹ cubic spline of least bending that turns to the required sides.
//!
//! Unknowns are the derivatives at the knots, and `span` has the conditions.
//!
//! The least bending may have a corner, where v is 0. So v keeps a component d·v ≥ c along its
//! first direction d, wherever a side is required.
//!
//! An interior-point method begins at feasible derivatives (`start`): Newton steps for the bending
//! less μ times the logarithms of all constrained numbers, for a falling sequence of μ. p″ is
//! continuous at knots without an active constraint.
//!
//! Source: S. Boyd and L. Vandenberghe, *Convex Optimization*, chapter 11.

use glam::DVec2;

use super::span::{Span, SpanDerivatives};
use crate::linalg::skyline::Skyline;

/// The first and the last weight of the logarithms, relative to the bending of the C² spline.
///
/// The bending exceeds the least by the last weight times the number of conditions. An active
/// constraint leaves about as much curvature, more than rounding.
const WEIGHTS: [f64; 2] = [1.0, 1e-10];

/// The weight falls by this factor.
const FALL: f64 = 0.1;

/// The most Newton steps per weight. Three to six are needed, and some ten at first.
const MOST_STEPS: u32 = 60;

/// Newton steps end once they save less than this share of the weight.
const NEAR: f64 = 1e-3;

/// The most halvings of a step.
const MOST_SHORTER: usize = 60;

/// Multiples of the convex Hessian that are added until the sum is positive definite.
const DAMPINGS: [f64; 12] = [0.0, 0.01, 0.04, 0.16, 0.64, 2.6, 10.0, 41.0, 164.0, 1e3, 1e4, 1e5];

/// A bound on a derivative that keeps the curve from a corner: direction · v ≥ least.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowerBound {
    pub direction: DVec2,
    pub least: f64,
}

/// How the derivative at a knot may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Freedom {
    /// Not at all: it is given, or missing.
    Fixed,
    /// In its length, along a unit vector.
    Along(DVec2),
    Free,
}

/// The first point of the search.
pub(super) struct StartPoint {
    /// The derivatives at the knots.
    pub v: Vec<DVec2>,
    pub freedom: Vec<Freedom>,
    pub bounds: Vec<Option<LowerBound>>,
}

impl LowerBound {
    fn slack(&self, v: DVec2) -> f64 {
        self.direction.dot(v) - self.least
    }
}

/// The derivatives found.
pub(super) struct MendResult {
    pub derivatives: Vec<DVec2>,
    pub iterations: u32,
    /// The root of the saving of one more step, relative to the bending.
    pub decrement: f64,
    pub converged: bool,
}

/// The derivatives of least bending that keep the sides of all spans.
///
/// `unit` is the bending without sides. `None` where the derivatives to begin with do not keep
/// them.
pub(super) fn mend(spans: &[Span], begin: StartPoint, unit: f64) -> Option<MendResult> {
    let StartPoint { mut v, freedom, bounds } = begin;
    let mut newton = Newton::new(spans, &freedom, bounds);
    if !newton.keeps(&v) {
        return None;
    }
    let (mut iterations, mut weight) = (0, WEIGHTS[0]);
    let mut decrement = 0.0f64;
    loop {
        let mut converged = false;
        for _ in 0..MOST_STEPS {
            let Some(saving) = newton.aim(&v, unit, weight) else { break };
            decrement = saving.sqrt();
            converged = saving <= NEAR * weight;
            if converged || !newton.step(&mut v, unit, weight) {
                break;
            }
            iterations += 1;
        }
        if weight <= WEIGHTS[1] {
            return Some(MendResult { derivatives: v, iterations, decrement, converged });
        }
        weight = (FALL * weight).max(WEIGHTS[1]);
    }
}

/// Newton steps, by blocks of two coordinates per knot.
struct Newton<'a> {
    spans: &'a [Span],
    bounds: Vec<Option<LowerBound>>,
    /// The unknowns of every knot, with the vectors that they are the lengths along.
    unknowns: Vec<Vec<(usize, DVec2)>>,
    matrix: Skyline,
    gradient: Vec<f64>,
    step: Vec<f64>,
    value: f64,
}

impl<'a> Newton<'a> {
    fn new(spans: &'a [Span], freedom: &[Freedom], bounds: Vec<Option<LowerBound>>) -> Self {
        let mut first = Vec::new();
        let mut unknowns = Vec::with_capacity(freedom.len());
        for freedom in freedom {
            let own = first.len();
            unknowns.push(match *freedom {
                Freedom::Fixed => vec![],
                Freedom::Along(direction) => vec![(own, direction)],
                Freedom::Free => vec![(own, DVec2::X), (own + 1, DVec2::Y)],
            });
            first.resize(own + unknowns[unknowns.len() - 1].len(), own);
        }
        for span in spans {
            let ends = span.knots.map(|knot| knot.map_or(&[][..], |knot| &unknowns[knot]));
            let [Some((a, _)), Some((b, _))] = ends.map(<[_]>::first) else { continue };
            for (row, _) in ends.concat() {
                first[row] = first[row].min(*a.min(b));
            }
        }
        let (gradient, step) = (vec![0.0; first.len()], vec![0.0; first.len()]);
        Newton { spans, bounds, unknowns, matrix: Skyline::new(first), gradient, step, value: 0.0 }
    }

    /// The bounds that keep derivatives from 0, with their knots.
    fn slacks<'b>(&'b self, v: &'b [DVec2]) -> impl Iterator<Item = (usize, DVec2, f64)> + 'b {
        let all = self.bounds.iter().zip(v).enumerate().filter(|(knot, _)| !self.unknowns[*knot].is_empty());
        all.filter_map(|(knot, (bound, v))| bound.map(|bound| (knot, bound.direction, bound.slack(*v))))
    }

    fn keeps(&self, v: &[DVec2]) -> bool {
        self.spans.iter().all(|span| span.keeps(v)) && self.slacks(v).all(|(.., slack)| slack > 0.0)
    }

    /// Bending less the logarithms.
    fn value(&self, v: &[DVec2], unit: f64, weight: f64) -> f64 {
        let spans: f64 = self.spans.iter().map(|span| span.value(v, unit, weight)).sum();
        spans - weight * self.slacks(v).map(|(.., slack)| slack.ln()).sum::<f64>()
    }

    /// Computes the next step and returns its saving. `None` if there is none.
    fn aim(&mut self, v: &[DVec2], unit: f64, weight: f64) -> Option<f64> {
        let parts: Vec<SpanDerivatives> = self.spans.iter().map(|span| span.part(v, unit, weight)).collect();
        let slacks: Vec<_> = self.slacks(v).collect();
        self.value = self.value(v, unit, weight);
        self.gradient.fill(0.0);
        for &(knot, direction, slack) in &slacks {
            for &(row, axis) in &self.unknowns[knot] {
                self.gradient[row] -= weight * direction.dot(axis) / slack;
            }
        }
        for (span, part) in self.spans.iter().zip(&parts) {
            for (place, row, factor) in self.rows(span) {
                self.gradient[row] += factor * part.gradient[place];
            }
        }
        for damping in DAMPINGS {
            self.matrix.clear();
            for &(knot, direction, slack) in &slacks {
                let curved = weight / (slack * slack);
                for &(row, axis) in &self.unknowns[knot] {
                    for &(column, other) in self.unknowns[knot].iter().filter(|(column, _)| *column <= row) {
                        let product = direction.dot(axis) * direction.dot(other);
                        self.matrix.add(row, column, (1.0 + damping) * curved * product);
                    }
                }
            }
            for (span, part) in self.spans.iter().zip(&parts) {
                let rows = self.rows(span);
                for &(i, row, factor) in &rows {
                    for &(j, column, other) in rows.iter().filter(|(_, column, _)| *column <= row) {
                        let entry = part.hessian[i][j] + damping * part.convex[i][j];
                        self.matrix.add(row, column, factor * other * entry);
                    }
                }
            }
            if self.matrix.factor() == Some(0) {
                self.step.iter_mut().zip(&self.gradient).for_each(|(step, g)| *step = -g);
                self.matrix.solve(&mut self.step);
                let saving = -self.step.iter().zip(&self.gradient).map(|(step, g)| step * g).sum::<f64>();
                return (saving >= 0.0).then_some(saving);
            }
        }
        None
    }

    /// The entries of a span's part that its unknowns change, with their rows and factors.
    fn rows(&self, span: &Span) -> Vec<(usize, usize, f64)> {
        let mut rows = Vec::with_capacity(4);
        for (end, knot) in span.knots.iter().enumerate() {
            for &(row, axis) in knot.iter().flat_map(|&knot| &self.unknowns[knot]) {
                let places = axis.to_array().into_iter().enumerate().filter(|(_, factor)| *factor != 0.0);
                rows.extend(places.map(|(c, factor)| (2 * end + c, row, factor)));
            }
        }
        rows
    }

    /// Takes the longest feasible part of the step by which the energy falls. False if there is
    /// none.
    fn step(&self, v: &mut [DVec2], unit: f64, weight: f64) -> bool {
        let slope: f64 = self.step.iter().zip(&self.gradient).map(|(step, g)| step * g).sum();
        let from = v.to_vec();
        let mut along = 1.0;
        for _ in 0..MOST_SHORTER {
            for ((v, from), unknowns) in v.iter_mut().zip(&from).zip(&self.unknowns) {
                *v = *from;
                for &(row, axis) in unknowns {
                    *v += along * self.step[row] * axis;
                }
            }
            if self.keeps(v) {
                let value = self.value(v, unit, weight);
                if value <= self.value + 1e-4 * along * slope {
                    return true;
                }
            }
            along *= 0.5;
        }
        v.copy_from_slice(&from);
        false
    }
}
