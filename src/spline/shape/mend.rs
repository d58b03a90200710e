//! [`mend`]: the C¹ cubic spline of least bending that turns to the sides asked for.
//!
//! Unknowns are the derivatives v at the knots. A span of length h and chord C bends by
//!
//! ```text
//! ∫|p″|² = 4 (w₀·w₀ + w₀·w₁ + w₁·w₁)/h,   w = v − C/h
//! ```
//!
//! and its Bézier polygon has the legs a = h v₀/3, C − a − b and b = h v₁/3, with which p′ × p″ is a positive multiple of
//!
//! ```text
//! f (1 − u)² + m (1 − u) u + l u²,   f = a × (C − b),   m = a × b,   l = (C − a) × b
//! ```
//!
//! A span of one side has f, l and m + 2√(f l) of that sign, which is necessary and sufficient. One with an inflection has
//! f and l of the signs of its ends. At a natural end the best derivative for that at the other knot is known, (3C/h −
//! v)/2, and C × b alone is left.
//!
//! Bending by itself may be least at a corner, where v is 0: a derivative that turned back would turn to the other side.
//! So v keeps a component d·v ≥ c along the direction d that it begins with, wherever a side is asked for.
//!
//! From derivatives that keep the shape (`start`) an interior point method goes: Newton
//! on the bending less μ times the logarithms of these numbers, for ever smaller μ. Where no side holds a knot,
//! p″ is continuous there, since that is what least bending is.
//!
//! Source: S. Boyd and L. Vandenberghe, *Convex Optimization*, chapter 11, for the method; the conditions are those of
//! M. Sakai, *Inflection points and singularities on planar rational cubic curve segments*, Computer Aided Geometric Design 16
//! (1999), for polynomials.

use crate::linalg::skyline::Skyline;
use crate::sides::Asked;

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

pub(super) type Vector = [f64; 2];

/// A span at size 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub h: f64,
    pub chord: Vector,
    pub asked: Asked,
    /// The knots at its start and end; `None` at a natural end.
    pub knots: [Option<usize>; 2],
}

/// What a derivative keeps so that the curve has no corner: direction · v ≥ least.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    pub direction: Vector,
    pub least: f64,
}

/// Where a search begins.
pub(super) struct Begin {
    /// The derivatives at the knots.
    pub v: Vec<Vector>,
    /// Whether they are given, or there are none.
    pub fixed: Vec<bool>,
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

pub(super) fn cross([a, b]: Vector, [c, d]: Vector) -> f64 {
    a * d - b * c
}

pub(super) fn dot([a, b]: Vector, [c, d]: Vector) -> f64 {
    a * c + b * d
}

pub(super) fn minus([a, b]: Vector, [c, d]: Vector) -> Vector {
    [a - c, b - d]
}

pub(super) fn times(s: f64, [a, b]: Vector) -> Vector {
    [s * a, s * b]
}

pub(super) fn length([a, b]: Vector) -> f64 {
    a.hypot(b)
}

/// (y, −x): the gradient of v × w by v.
fn across([x, y]: Vector) -> Vector {
    [y, -x]
}

/// What one span has to do with the derivatives at its two ends.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    gradient: [f64; 4],
    hessian: [[f64; 4]; 4],
    /// The same without what may have negative eigenvalues.
    convex: [[f64; 4]; 4],
}

impl Span {
    /// The derivatives at both ends; at a natural end the best one.
    pub(super) fn ends(&self, v: &[Vector]) -> [Vector; 2] {
        let natural = |other: Vector| times(0.5, minus(times(3.0 / self.h, self.chord), other));
        match self.knots.map(|knot| knot.map(|knot| v[knot])) {
            [Some(start), Some(end)] => [start, end],
            [None, Some(end)] => [natural(end), end],
            [Some(start), None] => [start, natural(start)],
            [None, None] => [times(1.0 / self.h, self.chord); 2],
        }
    }

    fn bending(&self, v: &[Vector]) -> f64 {
        let [a, b] = self.ends(v).map(|v| minus(v, times(1.0 / self.h, self.chord)));
        4.0 * (dot(a, a) + dot(a, b) + dot(b, b)) / self.h
    }

    /// f, m and l of the sign that is asked for; infinite where nothing is.
    fn signs(&self, v: &[Vector]) -> [f64; 3] {
        let Asked { ends: [start, end], within } = self.asked;
        let third = self.h / 3.0;
        let [a, b] = self.ends(v).map(|v| times(third, v));
        let sign = |side: f64, number: f64| if side == 0.0 { f64::INFINITY } else { side * number };
        match self.knots {
            [None, _] => [f64::INFINITY, f64::INFINITY, sign(end, cross(self.chord, b))],
            [_, None] => [sign(start, cross(a, self.chord)), f64::INFINITY, f64::INFINITY],
            _ => {
                let (first, last) = (cross(a, minus(self.chord, b)), cross(minus(self.chord, a), b));
                [sign(start, first), sign(within, cross(a, b)), sign(end, last)]
            }
        }
    }

    /// Whether all along it has the sides asked for, with room to spare.
    fn keeps(&self, v: &[Vector]) -> bool {
        let [first, middle, last] = self.signs(v);
        first > 0.0 && last > 0.0 && room(first, middle, last) > 0.0
    }

    /// Bending over `unit` less `weight` times the logarithms, with derivatives by both ends' v.
    fn part(&self, v: &[Vector], unit: f64, weight: f64) -> Part {
        let mut part = Part::default();
        let w = self.ends(v).map(|v| minus(v, times(1.0 / self.h, self.chord)));
        let stiffness = match self.knots {
            [Some(_), Some(_)] => [[8.0, 4.0], [4.0, 8.0]],
            [None, _] => [[0.0, 0.0], [0.0, 6.0]],
            [_, None] => [[6.0, 0.0], [0.0, 0.0]],
        };
        for (i, row) in stiffness.iter().enumerate() {
            for (j, s) in row.iter().enumerate() {
                for (c, w) in w[j].iter().enumerate() {
                    part.gradient[2 * i + c] += s / (self.h * unit) * w;
                    part.convex[2 * i + c][2 * j + c] += s / (self.h * unit);
                }
            }
        }
        part.hessian = part.convex;
        self.add_logarithms(v, weight, &mut part);
        part
    }

    fn add_logarithms(&self, v: &[Vector], weight: f64, part: &mut Part) {
        let y = self.signs(v);
        let r = self.h / 3.0;
        let Asked { ends: [start, end], within } = self.asked;
        let [v, w] = self.ends(v);
        // The gradients of f, m and l, and the factors of v × w in them.
        let join = |a: Vector, b: Vector| [a[0], a[1], b[0], b[1]];
        let (ahead, twist) = (across(times(r, self.chord)), r * r);
        let [by_v, by_w] = [times(twist, across(w)), times(-twist, across(v))];
        let open = self.knots.iter().all(Option::is_some);
        let f = if open { join(minus(ahead, by_v), times(-1.0, by_w)) } else { join(ahead, [0.0; 2]) };
        let l = if open {
            join(times(-1.0, by_v), minus(times(-1.0, ahead), by_w))
        } else {
            join([0.0; 2], times(-1.0, ahead))
        };
        let m = join(by_v, by_w);
        let bilinear = if open { [-start * twist, within * twist, -end * twist] } else { [0.0; 3] };
        let gradients = [(start, f), (within, m), (end, l)].map(|(side, gradient)| gradient.map(|x| side * x));
        // −ln f − ln l − ln(m + 2√(f l)), by f, m and l.
        let (mut first, mut second) = ([0.0; 3], [[0.0; 3]; 3]);
        for k in [0, 2] {
            if y[k].is_finite() {
                first[k] -= weight / y[k];
                second[k][k] += weight / (y[k] * y[k]);
            }
        }
        if y.iter().all(|y| y.is_finite()) {
            let room = room(y[0], y[1], y[2]);
            let root = (y[0] * y[2]).sqrt();
            let by = [(y[2] / y[0]).sqrt(), 1.0, (y[0] / y[2]).sqrt()];
            let curved = [[-0.5 * by[0] / y[0], 0.0, 0.5 / root], [0.0; 3], [0.5 / root, 0.0, -0.5 * by[2] / y[2]]];
            for i in 0..3 {
                first[i] -= weight * by[i] / room;
                for j in 0..3 {
                    second[i][j] += weight * (by[i] * by[j] / room - curved[i][j]) / room;
                }
            }
        }
        for i in 0..4 {
            for k in (0..3).filter(|&k| first[k] != 0.0) {
                part.gradient[i] += first[k] * gradients[k][i];
            }
            for j in 0..4 {
                let mut sum = 0.0;
                for k in 0..3 {
                    for n in 0..3 {
                        if second[k][n] != 0.0 {
                            sum += gradients[k][i] * second[k][n] * gradients[n][j];
                        }
                    }
                }
                part.convex[i][j] += sum;
                part.hessian[i][j] += sum;
            }
        }
        let skew: f64 = (0..3).filter(|&k| first[k] != 0.0).map(|k| first[k] * bilinear[k]).sum();
        for (i, j, sign) in [(0, 3, 1.0), (1, 2, -1.0), (3, 0, 1.0), (2, 1, -1.0)] {
            part.hessian[i][j] += sign * skew;
        }
    }
}

/// m + 2√(f l); infinite where one is.
fn room(first: f64, middle: f64, last: f64) -> f64 {
    if middle.is_infinite() || first.is_infinite() || last.is_infinite() {
        return f64::INFINITY;
    }
    middle + 2.0 * (first * last).max(0.0).sqrt()
}

/// The derivatives of least bending that keep the sides of all spans.
///
/// `unit` is the bending without sides. `None` where the derivatives to begin with do not keep them.
pub(super) fn mend(spans: &[Span], begin: Begin, unit: f64) -> Option<Mended> {
    let Begin { mut v, fixed, ahead } = begin;
    let mut newton = Newton::new(spans, &fixed, ahead);
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
    /// The first unknown of every knot.
    unknowns: Vec<Option<usize>>,
    matrix: Skyline,
    gradient: Vec<f64>,
    step: Vec<f64>,
    value: f64,
}

impl<'a> Newton<'a> {
    fn new(spans: &'a [Span], fixed: &[bool], ahead: Vec<Option<Ahead>>) -> Self {
        let mut count = 0;
        let mut unknown = |fixed: &bool| {
            let own = (!fixed).then_some(count);
            count += if *fixed { 0 } else { 2 };
            own
        };
        let unknowns: Vec<Option<usize>> = fixed.iter().map(&mut unknown).collect();
        let mut first: Vec<usize> = (0..count).map(|row| row - row % 2).collect();
        for span in spans {
            let [Some(a), Some(b)] = span.knots.map(|knot| knot.and_then(|knot| unknowns[knot])) else { continue };
            first[a.max(b)..][..2].iter_mut().for_each(|first| *first = a.min(b).min(*first));
        }
        let (gradient, step) = (vec![0.0; count], vec![0.0; count]);
        Newton { spans, ahead, unknowns, matrix: Skyline::new(first), gradient, step, value: 0.0 }
    }

    /// What keeps derivatives from 0, with their first unknowns.
    fn rooms<'b>(&'b self, v: &'b [Vector]) -> impl Iterator<Item = (usize, Vector, f64)> + 'b {
        let all = self.ahead.iter().zip(&self.unknowns).zip(v);
        all.filter_map(|((ahead, unknown), v)| Some(((*unknown)?, ahead.as_ref()?, v)))
            .map(|(row, ahead, v)| (row, ahead.direction, ahead.room(*v)))
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
        for &(row, direction, room) in &rooms {
            (0..2).for_each(|c| self.gradient[row + c] -= weight * direction[c] / room);
        }
        for (span, part) in self.spans.iter().zip(&parts) {
            for (end, row) in self.rows(span) {
                self.gradient[row] += part.gradient[end];
            }
        }
        // Where the energy is not convex, more of its convex part is added until the step leads down.
        for damping in DAMPINGS {
            self.matrix.clear();
            for &(row, [x, y], room) in &rooms {
                let curved = weight / (room * room);
                for (i, j, product) in [(0, 0, x * x), (1, 0, x * y), (1, 1, y * y)] {
                    self.matrix.add(row + i, row + j, (1.0 + damping) * curved * product);
                }
            }
            for (span, part) in self.spans.iter().zip(&parts) {
                let rows = self.rows(span);
                for &(i, row) in &rows {
                    for &(j, column) in rows.iter().filter(|(_, column)| *column <= row) {
                        self.matrix.add(row, column, part.hessian[i][j] + damping * part.convex[i][j]);
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

    /// The places of a span's unknowns in its part, and their rows.
    fn rows(&self, span: &Span) -> Vec<(usize, usize)> {
        let of_end = |(end, knot): (usize, &Option<usize>)| Some((end, self.unknowns[(*knot)?]?));
        let ends = span.knots.iter().enumerate().filter_map(of_end);
        ends.flat_map(|(end, row)| [(2 * end, row), (2 * end + 1, row + 1)]).collect()
    }

    /// Goes along the step as far as all sides are kept and the energy falls; whether it does.
    fn step(&self, v: &mut [Vector], unit: f64, weight: f64) -> bool {
        let slope: f64 = self.step.iter().zip(&self.gradient).map(|(step, g)| step * g).sum();
        let from = v.to_vec();
        let mut along = 1.0;
        for _ in 0..MOST_SHORTER {
            for ((v, from), unknown) in v.iter_mut().zip(&from).zip(&self.unknowns) {
                if let Some(row) = *unknown {
                    *v = [from[0] + along * self.step[row], from[1] + along * self.step[row + 1]];
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

impl Span {
    /// Bending less the logarithms.
    fn value(&self, v: &[Vector], unit: f64, weight: f64) -> f64 {
        let [first, middle, last] = self.signs(v);
        let logarithms: f64 =
            [first, last, room(first, middle, last)].iter().filter(|y| y.is_finite()).map(|y| y.ln()).sum();
        self.bending(v) / unit - weight * logarithms
    }
}
