//! [`Span`]: the shape constraints of one span on the derivatives at its ends.
//!
//! Unknowns are the derivatives v at the knots. A span of length h and chord C bends by
//!
//! ```text
//! ∫|p″|² = 4 (w₀·w₀ + w₀·w₁ + w₁·w₁)/h,   w = v − C/h
//! ```
//!
//! and its Bézier polygon has the legs a = h v₀/3, C − a − b and b = h v₁/3, with which p′ × p″ is
//! a positive multiple of
//!
//! ```text
//! f (1 − u)² + m (1 − u) u + l u²,   f = a × (C − b),   m = a × b,   l = (C − a) × b
//! ```
//!
//! A span of one side has f, l and m + 2√(f l) of that sign, which is necessary and sufficient. One
//! with an inflection has f and l of the signs of its ends. At a natural end the best derivative
//! for that at the other knot is known, (3C/h − v)/2, and C × b alone is left.
//!
//! A straight span has derivatives along its chord. It goes on and not back if p′ · C, a positive
//! multiple of the same form with f = C · a, m = 2 C · (C − a − b) and l = C · b, is positive. Two
//! that meet at an angle end there naturally.
//!
//! Source: M. Sakai, *Inflection points and singularities on planar rational cubic curve segments*,
//! Computer Aided Geometric Design 16 (1999), for polynomials.

use glam::DVec2;

use crate::sides::{Asked, STRAIGHT};

/// A span at size 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub h: f64,
    pub chord: DVec2,
    pub asked: Asked,
    /// The knots at its start and end; `None` at a natural end.
    pub knots: [Option<usize>; 2],
}

/// |v|, which neither overflows nor underflows.
pub(super) fn length(v: DVec2) -> f64 {
    v.x.hypot(v.y)
}

/// (y, −x): the gradient of v × w by v.
fn across(v: DVec2) -> DVec2 {
    DVec2::new(v.y, -v.x)
}

/// The derivatives of one span's energy by the derivatives at its ends.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpanDerivatives {
    pub gradient: [f64; 4],
    pub hessian: [[f64; 4]; 4],
    /// The Hessian without the parts that may have negative eigenvalues.
    pub convex: [[f64; 4]; 4],
}

impl Span {
    /// The derivatives at both ends; at a natural end the best one.
    pub(super) fn ends(&self, v: &[DVec2]) -> [DVec2; 2] {
        let natural = |other: DVec2| 0.5 * (3.0 / self.h * self.chord - other);
        match self.knots.map(|knot| knot.map(|knot| v[knot])) {
            [Some(start), Some(end)] => [start, end],
            [None, Some(end)] => [natural(end), end],
            [Some(start), None] => [start, natural(start)],
            [None, None] => [1.0 / self.h * self.chord; 2],
        }
    }

    fn bending(&self, v: &[DVec2]) -> f64 {
        let [a, b] = self.ends(v).map(|v| v - 1.0 / self.h * self.chord);
        4.0 * (a.dot(a) + a.dot(b) + b.dot(b)) / self.h
    }

    /// p″ at both ends; 0 at a natural one.
    pub(super) fn moments(&self, v: &[DVec2]) -> [DVec2; 2] {
        let [a, b] = self.ends(v);
        let slope = 6.0 / self.h * self.chord;
        let moment = |near: DVec2, far: DVec2| 1.0 / self.h * (slope - (4.0 * near + 2.0 * far));
        let own = [moment(a, b), -moment(b, a)];
        std::array::from_fn(|end| if self.knots[end].is_some() { own[end] } else { DVec2::ZERO })
    }

    /// The unit vector along the chord.
    pub(super) fn direction(&self) -> DVec2 {
        1.0 / length(self.chord) * self.chord
    }

    /// f, m and l of a straight span; m is infinite at a natural end, where it is 2f or 2l.
    fn signs_ahead(&self, [a, b]: [DVec2; 2]) -> [f64; 3] {
        let d = self.direction();
        let middle = 2.0 * d.dot(self.chord - (a + b));
        [d.dot(a), if self.knots.iter().all(Option::is_some) { middle } else { f64::INFINITY }, d.dot(b)]
    }

    /// f, m and l times their required signs; infinite if no sign is required.
    fn signs(&self, v: &[DVec2]) -> [f64; 3] {
        let Asked { ends: [start, end], within, straight } = self.asked;
        let third = self.h / 3.0;
        let [a, b] = self.ends(v).map(|v| third * v);
        if straight {
            return self.signs_ahead([a, b]);
        }
        let sign = |side: f64, number: f64| if side == 0.0 { f64::INFINITY } else { side * number };
        match self.knots {
            [None, _] => [f64::INFINITY, f64::INFINITY, sign(end, self.chord.perp_dot(b))],
            [_, None] => [sign(start, a.perp_dot(self.chord)), f64::INFINITY, f64::INFINITY],
            _ => {
                let (first, last) = (a.perp_dot(self.chord - b), (self.chord - a).perp_dot(b));
                [sign(start, first), sign(within, a.perp_dot(b)), sign(end, last)]
            }
        }
    }

    /// Whether it has the required sides strictly.
    pub(super) fn keeps(&self, v: &[DVec2]) -> bool {
        let [first, middle, last] = self.signs(v);
        let in_line = !self.asked.straight || self.ends(v).iter().all(|v| self.is_along(*v));
        first > 0.0 && last > 0.0 && slack(first, middle, last) > 0.0 && in_line
    }

    /// Whether a derivative is along the chord.
    pub(super) fn is_along(&self, v: DVec2) -> bool {
        v.perp_dot(self.chord).abs() <= STRAIGHT * length(v) * length(self.chord)
    }

    /// Bending over `unit` less `weight` times the logarithms, with derivatives by both ends' v.
    pub(super) fn part(&self, v: &[DVec2], unit: f64, weight: f64) -> SpanDerivatives {
        let mut part = SpanDerivatives::default();
        let w = self.ends(v).map(|v| v - 1.0 / self.h * self.chord);
        let stiffness = match self.knots {
            [Some(_), Some(_)] => [[8.0, 4.0], [4.0, 8.0]],
            [None, _] => [[0.0, 0.0], [0.0, 6.0]],
            [_, None] => [[6.0, 0.0], [0.0, 0.0]],
        };
        for (i, row) in stiffness.iter().enumerate() {
            for (j, s) in row.iter().enumerate() {
                for (c, w) in w[j].to_array().iter().enumerate() {
                    part.gradient[2 * i + c] += s / (self.h * unit) * w;
                    part.convex[2 * i + c][2 * j + c] += s / (self.h * unit);
                }
            }
        }
        part.hessian = part.convex;
        self.add_barriers(v, weight, &mut part);
        part
    }

    /// The gradients of f, m and l, and the factors of v × w in them.
    fn slopes(&self, [v, w]: [DVec2; 2]) -> ([[f64; 4]; 3], [f64; 3]) {
        let Asked { ends: [start, end], within, .. } = self.asked;
        let r = self.h / 3.0;
        let (ahead, twist) = (across(r * self.chord), r * r);
        let [by_v, by_w] = [twist * across(w), -twist * across(v)];
        let open = self.knots.iter().all(Option::is_some);
        let f = if open { join(ahead - by_v, -1.0 * by_w) } else { join(ahead, DVec2::ZERO) };
        let l = if open { join(-1.0 * by_v, -1.0 * ahead - by_w) } else { join(DVec2::ZERO, -1.0 * ahead) };
        let m = join(by_v, by_w);
        let bilinear = if open { [-start * twist, within * twist, -end * twist] } else { [0.0; 3] };
        ([(start, f), (within, m), (end, l)].map(|(side, gradient)| gradient.map(|x| side * x)), bilinear)
    }

    /// The same of a straight span.
    fn slopes_ahead(&self) -> ([[f64; 4]; 3], [f64; 3]) {
        let d = self.h / 3.0 * self.direction();
        // A natural end follows the other.
        let [by_start, by_end] = [d, d].map(|d| -0.5 * d);
        let gradients = match self.knots {
            [None, None] => [[0.0; 4]; 3],
            [None, _] => [join(DVec2::ZERO, by_end), [0.0; 4], join(DVec2::ZERO, d)],
            [_, None] => [join(d, DVec2::ZERO), [0.0; 4], join(by_start, DVec2::ZERO)],
            _ => [join(d, DVec2::ZERO), join(-2.0 * d, -2.0 * d), join(DVec2::ZERO, d)],
        };
        (gradients, [0.0; 3])
    }

    fn add_barriers(&self, v: &[DVec2], weight: f64, part: &mut SpanDerivatives) {
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
            let slack = slack(y[0], y[1], y[2]);
            let root = (y[0] * y[2]).sqrt();
            let by = [(y[2] / y[0]).sqrt(), 1.0, (y[0] / y[2]).sqrt()];
            let curved = [[-0.5 * by[0] / y[0], 0.0, 0.5 / root], [0.0; 3], [0.5 / root, 0.0, -0.5 * by[2] / y[2]]];
            for i in 0..3 {
                first[i] -= weight * by[i] / slack;
                for j in 0..3 {
                    second[i][j] += weight * (by[i] * by[j] / slack - curved[i][j]) / slack;
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
    pub(super) fn value(&self, v: &[DVec2], unit: f64, weight: f64) -> f64 {
        let [first, middle, last] = self.signs(v);
        let logarithms: f64 =
            [first, last, slack(first, middle, last)].iter().filter(|y| y.is_finite()).map(|y| y.ln()).sum();
        self.bending(v) / unit - weight * logarithms
    }
}

fn join(v: DVec2, w: DVec2) -> [f64; 4] {
    [v.x, v.y, w.x, w.y]
}

/// m + 2√(f l); infinite where one is.
fn slack(first: f64, middle: f64, last: f64) -> f64 {
    if middle.is_infinite() || first.is_infinite() || last.is_infinite() {
        return f64::INFINITY;
    }
    middle + 2.0 * (first * last).max(0.0).sqrt()
}
