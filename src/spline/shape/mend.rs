//! [`mend`]: the C¹ cubic spline of least bending that turns to the sides asked for.
//!
//! Unknowns are the derivatives at the knots, and `span` has the conditions.
//!
//! Bending by itself may be least at a corner, where v is 0: a derivative that turned back would turn to the other side.
//! So v keeps a component d·v ≥ c along the direction d that it begins with, wherever a side is asked for.
//!
//! From derivatives that keep the shape (`start`) an interior point method goes: Newton
//! on the bending less μ times the logarithms of these numbers, for ever smaller μ. Where no side holds a knot,
//! p″ is continuous there, since that is what least bending is.
//!
//! Source: S. Boyd and L. Vandenberghe, *Convex Optimization*, chapter 11.

use super::span::{Part, Span, Vector, dot, plus, times};
use crate::linalg::skyline::Skyline;

/// The weight of the logarithms at first, and at last, relative to the bending of the C² spline.
///
/// Bending is then least to so many times this part as there are conditions, and a side that holds a span leaves it about
/// this much curvature, which rounding does not hide.
const WEIGHTS: [f64; 2] = [1.0, 1e-10];

/// The weight falls by this factor.
const FALL: f64 = 0.1;

/// Newton's steps a weight. Three to six are needed, and some ten at first.
const MOST_STEPS: u32 = 60;

/// Newton's steps end when they save less than this part of the weight.
const NEAR: f64 = 1e-3;

/// Halvings of a step.
const MOST_SHORTER: usize = 60;

/// Parts of the convex Hessian that are added where the whole one has negative eigenvalues.
const DAMPINGS: [f64; 12] = [0.0, 0.01, 0.04, 0.16, 0.64, 2.6, 10.0, 41.0, 164.0, 1e3, 1e4, 1e5];

/// What a derivative keeps so that the curve has no corner: direction · v ≥ least.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    pub direction: Vector,
    pub least: f64,
}

/// How the derivative at a knot may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Freedom {
    /// Not at all: it is given, or there is none.
    Fixed,
    /// In its length, along a unit vector.
    Along(Vector),
    Free,
}

/// Where a search begins.
pub(super) struct Begin {
    /// The derivatives at the knots.
    pub v: Vec<Vector>,
    pub freedom: Vec<Freedom>,
    pub ahead: Vec<Option<Ahead>>,
}

impl Ahead {
    fn room(&self, v: Vector) -> f64 {
        dot(self.direction, v) - self.least
    }
}

/// The derivatives found.
pub(super) struct Mended {
    pub derivatives: Vec<Vector>,
    pub iterations: u32,
    /// What a last step would save, relative to the bending: its root.
    pub decrement: f64,
    pub converged: bool,
}

/// The derivatives of least bending that keep the sides of all spans.
///
/// `unit` is the bending without sides. `None` where the derivatives to begin with do not keep them.
pub(super) fn mend(spans: &[Span], begin: Begin, unit: f64) -> Option<Mended> {
    let Begin { mut v, freedom, ahead } = begin;
    let mut newton = Newton::new(spans, &freedom, ahead);
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
            return Some(Mended { derivatives: v, iterations, decrement, converged });
        }
        weight = (FALL * weight).max(WEIGHTS[1]);
    }
}

/// Newton's steps, by blocks of two coordinates a knot.
struct Newton<'a> {
    spans: &'a [Span],
    ahead: Vec<Option<Ahead>>,
    /// The unknowns of every knot, with the vectors that they are the lengths along.
    unknowns: Vec<Vec<(usize, Vector)>>,
    matrix: Skyline,
    gradient: Vec<f64>,
    step: Vec<f64>,
    value: f64,
}

impl<'a> Newton<'a> {
    fn new(spans: &'a [Span], freedom: &[Freedom], ahead: Vec<Option<Ahead>>) -> Self {
        let mut first = Vec::new();
        let mut unknowns = Vec::with_capacity(freedom.len());
        for freedom in freedom {
            let own = first.len();
            unknowns.push(match *freedom {
                Freedom::Fixed => vec![],
                Freedom::Along(direction) => vec![(own, direction)],
                Freedom::Free => vec![(own, [1.0, 0.0]), (own + 1, [0.0, 1.0])],
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
        Newton { spans, ahead, unknowns, matrix: Skyline::new(first), gradient, step, value: 0.0 }
    }

    /// What keeps derivatives from 0, with their knots.
    fn rooms<'b>(&'b self, v: &'b [Vector]) -> impl Iterator<Item = (usize, Vector, f64)> + 'b {
        let all = self.ahead.iter().zip(v).enumerate().filter(|(knot, _)| !self.unknowns[*knot].is_empty());
        all.filter_map(|(knot, (ahead, v))| ahead.map(|ahead| (knot, ahead.direction, ahead.room(*v))))
    }

    fn keeps(&self, v: &[Vector]) -> bool {
        self.spans.iter().all(|span| span.keeps(v)) && self.rooms(v).all(|(.., room)| room > 0.0)
    }

    /// Bending less the logarithms.
    fn value(&self, v: &[Vector], unit: f64, weight: f64) -> f64 {
        let spans: f64 = self.spans.iter().map(|span| span.value(v, unit, weight)).sum();
        spans - weight * self.rooms(v).map(|(.., room)| room.ln()).sum::<f64>()
    }

    /// The next step, and what it would save; `None` where there is none.
    fn aim(&mut self, v: &[Vector], unit: f64, weight: f64) -> Option<f64> {
        let parts: Vec<Part> = self.spans.iter().map(|span| span.part(v, unit, weight)).collect();
        let rooms: Vec<_> = self.rooms(v).collect();
        self.value = self.value(v, unit, weight);
        self.gradient.fill(0.0);
        for &(knot, direction, room) in &rooms {
            for &(row, axis) in &self.unknowns[knot] {
                self.gradient[row] -= weight * dot(direction, axis) / room;
            }
        }
        for (span, part) in self.spans.iter().zip(&parts) {
            for (place, row, factor) in self.rows(span) {
                self.gradient[row] += factor * part.gradient[place];
            }
        }
        // Where the energy is not convex, more of its convex part is added until the step leads down.
        for damping in DAMPINGS {
            self.matrix.clear();
            for &(knot, direction, room) in &rooms {
                let curved = weight / (room * room);
                for &(row, axis) in &self.unknowns[knot] {
                    for &(column, other) in self.unknowns[knot].iter().filter(|(column, _)| *column <= row) {
                        let product = dot(direction, axis) * dot(direction, other);
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

    /// The places in a span's part that its unknowns change, with their rows and by how much.
    fn rows(&self, span: &Span) -> Vec<(usize, usize, f64)> {
        let mut rows = Vec::with_capacity(4);
        for (end, knot) in span.knots.iter().enumerate() {
            for &(row, axis) in knot.iter().flat_map(|&knot| &self.unknowns[knot]) {
                let places = axis.into_iter().enumerate().filter(|(_, factor)| *factor != 0.0);
                rows.extend(places.map(|(c, factor)| (2 * end + c, row, factor)));
            }
        }
        rows
    }

    /// Goes along the step as far as all sides are kept and the energy falls; whether it does.
    fn step(&self, v: &mut [Vector], unit: f64, weight: f64) -> bool {
        let slope: f64 = self.step.iter().zip(&self.gradient).map(|(step, g)| step * g).sum();
        let from = v.to_vec();
        let mut along = 1.0;
        for _ in 0..MOST_SHORTER {
            for ((v, from), unknowns) in v.iter_mut().zip(&from).zip(&self.unknowns) {
                *v = *from;
                for &(row, axis) in unknowns {
                    *v = plus(*v, times(along * self.step[row], axis));
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
