//! [`Span`]: what one span of a spline asks of the derivatives at its ends.
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
//! A straight span has derivatives along its chord. It goes on and not back if p′ · C, a positive multiple of the same form
//! with f = C · a, m = 2 C · (C − a − b) and l = C · b, is positive. Two that meet at an angle end there naturally.
//!
//! Source: M. Sakai, *Inflection points and singularities on planar rational cubic curve segments*, Computer Aided Geometric
//! Design 16 (1999), for polynomials.

use crate::sides::{Asked, STRAIGHT};

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

pub(super) fn cross([a, b]: Vector, [c, d]: Vector) -> f64 {
    a * d - b * c
}

pub(super) fn dot([a, b]: Vector, [c, d]: Vector) -> f64 {
    a * c + b * d
}

pub(super) fn minus([a, b]: Vector, [c, d]: Vector) -> Vector {
    [a - c, b - d]
}

pub(super) fn plus([a, b]: Vector, [c, d]: Vector) -> Vector {
    [a + c, b + d]
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
pub(super) struct Part {
    pub gradient: [f64; 4],
    pub hessian: [[f64; 4]; 4],
    /// The same without what may have negative eigenvalues.
    pub convex: [[f64; 4]; 4],
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

    /// The unit vector along the chord.
    pub(super) fn direction(&self) -> Vector {
        times(1.0 / length(self.chord), self.chord)
    }

    /// f, m and l of a straight span; m is infinite at a natural end, where it is 2f or 2l.
    fn room_ahead(&self, [a, b]: [Vector; 2]) -> [f64; 3] {
        let d = self.direction();
        let middle = 2.0 * dot(d, minus(self.chord, plus(a, b)));
        [dot(d, a), if self.knots.iter().all(Option::is_some) { middle } else { f64::INFINITY }, dot(d, b)]
    }

    /// f, m and l of the sign that is asked for; infinite where nothing is.
    fn signs(&self, v: &[Vector]) -> [f64; 3] {
        let Asked { ends: [start, end], within, straight } = self.asked;
        let third = self.h / 3.0;
        let [a, b] = self.ends(v).map(|v| times(third, v));
        if straight {
            return self.room_ahead([a, b]);
        }
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
    pub(super) fn keeps(&self, v: &[Vector]) -> bool {
        let [first, middle, last] = self.signs(v);
        let in_line = !self.asked.straight || self.ends(v).iter().all(|v| self.is_along(*v));
        first > 0.0 && last > 0.0 && room(first, middle, last) > 0.0 && in_line
    }

    /// Whether a derivative is along the chord.
    pub(super) fn is_along(&self, v: Vector) -> bool {
        cross(v, self.chord).abs() <= STRAIGHT * length(v) * length(self.chord)
    }

    /// Bending over `unit` less `weight` times the logarithms, with derivatives by both ends' v.
    pub(super) fn part(&self, v: &[Vector], unit: f64, weight: f64) -> Part {
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

    /// The gradients of f, m and l, and the factors of v × w in them.
    fn slopes(&self, [v, w]: [Vector; 2]) -> ([[f64; 4]; 3], [f64; 3]) {
        let Asked { ends: [start, end], within, .. } = self.asked;
        let r = self.h / 3.0;
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
        ([(start, f), (within, m), (end, l)].map(|(side, gradient)| gradient.map(|x| side * x)), bilinear)
    }

    /// The same of a straight span.
    fn slopes_ahead(&self) -> ([[f64; 4]; 3], [f64; 3]) {
        let d = times(self.h / 3.0, self.direction());
        // A natural end follows the other.
        let [by_start, by_end] = [d, d].map(|d| times(-0.5, d));
        let gradients = match self.knots {
            [None, None] => [[0.0; 4]; 3],
            [None, _] => [join([0.0; 2], by_end), [0.0; 4], join([0.0; 2], d)],
            [_, None] => [join(d, [0.0; 2]), [0.0; 4], join(by_start, [0.0; 2])],
            _ => [join(d, [0.0; 2]), join(times(-2.0, d), times(-2.0, d)), join([0.0; 2], d)],
        };
        (gradients, [0.0; 3])
    }

    fn add_logarithms(&self, v: &[Vector], weight: f64, part: &mut Part) {
        let y = self.signs(v);
        let [v, w] = self.ends(v);
        let (gradients, bilinear) = if self.asked.straight { self.slopes_ahead() } else { self.slopes([v, w]) };
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

    /// Bending less the logarithms.
    pub(super) fn value(&self, v: &[Vector], unit: f64, weight: f64) -> f64 {
        let [first, middle, last] = self.signs(v);
        let logarithms: f64 =
            [first, last, room(first, middle, last)].iter().filter(|y| y.is_finite()).map(|y| y.ln()).sum();
        self.bending(v) / unit - weight * logarithms
    }
}

fn join([a, b]: Vector, [c, d]: Vector) -> [f64; 4] {
    [a, b, c, d]
}

/// m + 2√(f l); infinite where one is.
fn room(first: f64, middle: f64, last: f64) -> f64 {
    if middle.is_infinite() || first.is_infinite() || last.is_infinite() {
        return f64::INFINITY;
    }
    middle + 2.0 * (first * last).max(0.0).sqrt()
}
