//! [`Section`]: the area between a curve and a chord, which a pressure keeps.

use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::spline::reinsch::Reinsch;

/// The error of an area, as a part of it or of [`NARROW`] D times the length, if that is more.
const AREA: f64 = 2e-4;
const NARROW: f64 = 0.5;

/// The fewest knots inside a section that can move its area.
const FEWEST: usize = 2;

/// The part of the pressure's Newton step that is taken: at first, at least, and its factor when the
/// error of the area changes its sign.
const PRESSURE: f64 = 0.6;
const LEAST_PRESSURE: f64 = 0.005;
const DAMPED: f64 = 0.7;

/// A part of a planar curve between two pinned knots, with the chord between them, or the whole of a
/// closed one without pinned knots.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Its first knot and its last, which may be beyond the end of a closed curve.
    from: usize,
    to: usize,
    /// The area of the polygon, and by how much the curve's may differ.
    wanted: f64,
    allowed: f64,
    pressure: f64,
    step: f64,
    error: f64,
}

impl Section {
    /// The sections of a curve with these pinned knots. Its values are the polygon's, and its moments
    /// are 0.
    pub fn all(problem: &Reinsch<f64>, polygon: &[f64], pinned: &[usize]) -> Vec<Self> {
        let n = problem.count;
        let mut ends: Vec<[usize; 2]> = pinned.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        match (problem.closed, pinned) {
            (true, []) => ends.push([0, n]),
            (true, [first, .., last]) => ends.push([*last, first + n]),
            (true, [only]) => ends.push([*only, only + n]),
            (false, _) => {}
        }
        let section = |[from, to]: [usize; 2]| {
            let mut own = Section { from, to, wanted: 0.0, allowed: 0.0, pressure: 0.0, step: PRESSURE, error: 0.0 };
            own.wanted = own.area_of_polygon(polygon);
            let length: f64 = (from..to).map(|k| problem.spans[k % n]).sum();
            own.allowed = AREA * own.wanted.abs().max(NARROW * length);
            own
        };
        ends.into_iter().filter(|[from, to]| to - from > FEWEST).map(section).collect()
    }

    /// Forgets the pressure.
    pub fn restart(&mut self) {
        (self.pressure, self.step, self.error) = (0.0, PRESSURE, 0.0);
    }

    /// Adjusts the pressure by the last error, and writes the move of each value by it.
    pub fn push(&mut self, problem: &Reinsch<f64>, values: &[f64], push: &mut [f64]) {
        let (points, n) = (values.as_chunks::<2>().0, problem.count);
        let normal = |k: usize| {
            let along = subtract(points[(k + 1) % n], points[(k + n - 1) % n]);
            [0.5 * along[1], -0.5 * along[0]]
        };
        // The change of the area by the pressure, if knots moved by themselves.
        let own = |k: usize| dot(normal(k % n), normal(k % n)) * problem.inverse_weights[k % n];
        let change: f64 = (self.from..self.to).map(own).sum();
        self.pressure += if change > 0.0 { self.step * self.error / change } else { 0.0 };
        for k in (self.from..self.to).map(|k| k % n) {
            let moved = scale(self.pressure * problem.inverse_weights[k], normal(k));
            push[2 * k..2 * k + 2].copy_from_slice(&moved);
        }
    }

    /// Measures the curve. Returns whether it has the area.
    pub fn measure(&mut self, problem: &Reinsch<f64>, values: &[f64]) -> bool {
        let before = self.error;
        self.error = self.wanted - self.area(problem, values);
        if self.error * before < 0.0 {
            self.step = (DAMPED * self.step).max(LEAST_PRESSURE);
        }
        self.error.abs() <= self.allowed
    }

    /// By how much the area differed at the last measurement, as a part of it, if that is too much.
    pub fn excess(&self) -> Option<f64> {
        (self.error.abs() > self.allowed).then(|| self.error.abs() / self.wanted.abs())
    }

    /// Scales a closed curve about the middle of its knots to the area. Only its last measurement
    /// may have missed it.
    pub fn scale(&self, values: &mut [f64]) {
        let points = values.as_chunks_mut::<2>().0;
        let middle = points.iter().fold([0.0; 2], |sum, point| add(sum, *point));
        let middle = scale(1.0 / points.len() as f64, middle);
        let factor = (self.wanted / (self.wanted - self.error)).sqrt();
        if factor.is_finite() {
            points.iter_mut().for_each(|point| *point = add(middle, scale(factor, subtract(*point, middle))));
        }
    }

    fn area_of_polygon(&self, values: &[f64]) -> f64 {
        let points = values.as_chunks::<2>().0;
        let from = |k: usize| subtract(points[k % points.len()], points[self.from]);
        0.5 * (self.from..self.to).map(|k| cross(from(k), from(k + 1))).sum::<f64>()
    }

    /// The area of the polygon through the knots, and of each span, from q − p = d with the second
    /// derivatives m and n, h⁴ (m × n)/720 − h² (m + n) × d/24.
    fn area(&self, problem: &Reinsch<f64>, values: &[f64]) -> f64 {
        let (points, moments) = (values.as_chunks::<2>().0, problem.moments.as_chunks::<2>().0);
        let n = problem.count;
        let beyond = |k: usize| {
            let (k, next, h) = (k % n, (k + 1) % n, problem.spans[k % n]);
            let [m, o] = [k, next].map(|k| scale(problem.alpha * h * h, moments[k]));
            cross(m, o) / 720.0 - cross(add(m, o), subtract(points[next], points[k])) / 24.0
        };
        self.area_of_polygon(values) + (self.from..self.to).map(beyond).sum::<f64>()
    }
}

/// The mean width 2 A/ℓ of a closed planar polygon.
pub(super) fn mean_width(points: &[Vector<f64, 2>]) -> f64 {
    let n = points.len();
    let from = |k: usize| subtract(points[k % n], points[0]);
    let edge = |k: usize| subtract(from(k + 1), from(k));
    let length: f64 = (0..n).map(|k| dot(edge(k), edge(k)).sqrt()).sum();
    (0..n).map(|k| cross(from(k), from(k + 1))).sum::<f64>().abs() / length
}

fn cross(a: Vector<f64, 2>, b: Vector<f64, 2>) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
