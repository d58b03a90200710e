//! TubeResult bending within a distance of every data point: min ∫|p″|² over the curves with |p(t_i) −
//! y_i| ≤ D, for one curve.
//!
//! The least curve is a cubic spline with knots at the data. It is sought by its values g_k = y_k +
//! D u_k and slopes m_k at the knots. The energy of a span of length h is the sum of the squares of
//! two numbers per coordinate,
//!
//! ```text
//! (m₁ − m₀)/√h,    √(3/h) (m₀ + m₁ − 2 (g₁ − g₀)/h),
//! ```
//!
//! so that all of it is ‖Ax + b‖², x = (u, m): a sum of squares over neighbours. That p″ is
//! continuous comes out by itself. Each data point is a second-order cone, (1, u_k + o) with its
//! offset o from the centre of its knot. This is a convex programme; a primal–dual interior-point
//! method after Mehrotra in the scaling of Nesterov and Todd solves it. Primal and dual points are
//! feasible from the start (the interpolating spline, and the forces that hold it), so the gap Σ
//! sᵀz bounds at every step by how much ½‖Ax + b‖² exceeds the least there is.
//!
//! Every Newton step is a least-squares problem over neighbours, factored by Householder
//! reflections from knot to knot (as a Kalman smoother in square-root form): squaring A would
//! square its condition, which grows as the square of the number of knots between points that are
//! touched. Time and memory are linear in the number of knots.
//!
//! L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010); P. J. Goulart, Y.
//! Chen, Clarabel (2024).

use glam::DVec3;

use super::tube_rows::Rows;
use crate::curve::vector;

/// The gap, relative to the energy, at which a curve is the least one.
pub(super) const GAP: f64 = 1e-8;

/// Half of 1e-8 D²/T³. Curves of less energy are straight: with ∫|p″|² = e D²/T³ a curve is within
/// √e D of a line. Gaps are relative to the energy or to this, whichever is larger, unless rounding
/// explains them.
const HALF_STRAIGHT: f64 = 0.5e-8;

/// Iterations at most; 5 to 30 are usual, and more gain nothing once rounding stops the steps.
const MAX_ITERATIONS: u32 = 100;

/// The share of a step to the boundary of the cones.
const TO_BOUNDARY: f64 = 0.99;

/// Steps shorter than this have stalled.
const STALLED: f64 = 1e-6;

/// A data point: the knot that it holds, and its offset, centre of the knot minus point, in units
/// of its radius: shorter than 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub knot: usize,
    pub offset: DVec3,
    /// D by the radius of the point: 1 where it may be missed by D.
    pub scale: f64,
}

/// The problem of one curve.
pub(super) struct Tube<'a> {
    /// 2 or 3.
    pub dimension: usize,
    /// Periodic instead of natural ends.
    pub closed: bool,
    /// Whether each knot keeps its centre.
    pub held: &'a [bool],
    /// Length of the span that starts at each knot: one fewer than knots of an open curve. Their
    /// sum is 1.
    pub spans: &'a [f64],
    /// Centres of the knots, in units of D.
    pub centres: &'a [f64],
    /// The data points, by knot.
    pub discs: &'a [Disc],
}

/// The solution.
#[derive(Clone, Debug)]
pub(super) struct TubeResult {
    /// u at every knot: the curve minus the centre, in units of D.
    pub moved: Vec<f64>,
    pub iterations: u32,
    /// By how much the energy may exceed the least there is, relative to it.
    pub gap: f64,
    pub converged: bool,
}

/// A vector in the space of a cone.
#[derive(Clone, Copy, Debug, Default)]
struct Cone {
    head: f64,
    tail: DVec3,
}

impl Cone {
    fn dot(&self, other: &Cone) -> f64 {
        self.head * other.head + self.tail.dot(other.tail)
    }

    /// `self + factor · other`.
    fn plus(&self, factor: f64, other: &Cone) -> Cone {
        Cone { head: self.head + factor * other.head, tail: self.tail + factor * other.tail }
    }

    /// head² − |tail|²: positive inside.
    fn inside(&self) -> f64 {
        let length = self.tail.length();
        (self.head - length) * (self.head + length)
    }

    /// The product of the cone's algebra.
    fn product(&self, other: &Cone) -> Cone {
        Cone { head: self.dot(other), tail: self.head * other.tail + other.head * self.tail }
    }

    /// x with `self` ∘ x = other.
    fn divide(&self, other: &Cone) -> Cone {
        let head = (self.head * other.head - self.tail.dot(other.tail)) / self.inside();
        Cone { head, tail: (other.tail - head * self.tail) / self.head }
    }

    /// The longest step, 1 at most, that stays inside.
    fn step(&self, way: &Cone) -> f64 {
        let (a, half, c) = (way.inside(), self.head * way.head - self.tail.dot(way.tail), self.inside());
        // a α² + 2 half α + c, which is positive at 0; the head may not change its sign either.
        let discriminant = half * half - a * c;
        let mut longest: f64 = if way.head < 0.0 { (-self.head / way.head).min(1.0) } else { 1.0 };
        if discriminant >= 0.0 {
            let q = -(half + half.signum() * discriminant.sqrt());
            for root in [q / a, c / q] {
                if root > 0.0 {
                    longest = longest.min(root);
                }
            }
        }
        longest
    }
}

/// The scaling of a cone that makes primal and dual point one: W z = W⁻¹ s.
#[derive(Clone, Copy, Debug, Default)]
struct Scaling {
    size: f64,
    point: Cone,
}

impl Scaling {
    fn new(s: &Cone, z: &Cone) -> Self {
        let (of_s, of_z) = (s.inside().sqrt(), z.inside().sqrt());
        let gamma = (0.5 * (1.0 + s.dot(z) / (of_s * of_z))).sqrt();
        let tail = (s.tail / of_s - z.tail / of_z) / (2.0 * gamma);
        // On the hyperboloid head² − |tail|² = 1 whatever rounding did.
        let point = Cone { head: (1.0 + tail.dot(tail)).sqrt(), tail };
        Scaling { size: (of_s / of_z).sqrt(), point }
    }

    /// W x, or with `sign` −1 and the size's inverse W⁻¹ x.
    fn times(&self, x: &Cone, size: f64, sign: f64) -> Cone {
        let across = sign * self.point.tail.dot(x.tail);
        let factor = sign * (x.head + across / (1.0 + self.point.head));
        Cone { head: size * (self.point.head * x.head + across), tail: size * (x.tail + factor * self.point.tail) }
    }

    fn apply(&self, x: &Cone) -> Cone {
        self.times(x, self.size, 1.0)
    }

    fn invert(&self, x: &Cone) -> Cone {
        self.times(x, 1.0 / self.size, -1.0)
    }

    /// W⁻¹ for vectors without a head, by a scale: d + 1 rows of d numbers. Those beyond are not read.
    fn rows(&self, scale: f64) -> [[f64; 3]; 4] {
        let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|tail| self.invert(&Cone { head: 0.0, tail: tail * scale }));
        std::array::from_fn(|r| columns.map(|column| if r == 0 { column.head } else { column.tail[r - 1] }))
    }
}

/// Vectors in the spaces of all unknowns: values and slopes, cones, and forces.
#[derive(Default)]
struct Point {
    x: Vec<f64>,
    s: Vec<Cone>,
    z: Vec<Cone>,
}

impl Point {
    /// The longest step, 1 at most, that keeps the point in its cones.
    fn longest(&self, way: &Point) -> f64 {
        let mut longest: f64 = 1.0;
        for k in 0..self.s.len() {
            longest = longest.min(self.s[k].step(&way.s[k])).min(self.z[k].step(&way.z[k]));
        }
        longest
    }
}

impl Tube<'_> {
    /// The least curve. Centres must be within the discs.
    pub fn least(&self) -> TubeResult {
        let d = self.dimension;
        let mut rows = Rows::new(d, self.closed, self.held, self.spans, self.centres);
        let rounding = rows.rounding();
        let mut point = self.start(&mut rows);
        let mut energies = rows.residual(&point.x);
        let mut scalings = vec![Scaling::default(); self.discs.len()];
        let mut scaled = vec![Cone::default(); self.discs.len()];
        let mut least = TubeResult { moved: Vec::new(), iterations: 0, gap: f64::INFINITY, converged: false };
        loop {
            let energy = 0.5 * energies.iter().map(|e| e * e).sum::<f64>();
            let gap: f64 = point.s.iter().zip(&point.z).map(|(s, z)| s.dot(z)).sum();
            least.gap = gap / energy.max(HALF_STRAIGHT);
            least.converged = gap <= (GAP * energy.max(HALF_STRAIGHT)).max(rounding);
            if least.converged || least.iterations == MAX_ITERATIONS || !gap.is_finite() {
                break;
            }
            least.iterations += 1;
            for k in 0..self.discs.len() {
                scalings[k] = Scaling::new(&point.s[k], &point.z[k]);
                scaled[k] = scalings[k].apply(&point.z[k]);
            }
            rows.factor(self.discs.iter().zip(&scalings).map(|(disc, scaling)| (disc.knot, scaling.rows(disc.scale))));
            // Predictor and corrector.
            let mu = gap / point.s.len() as f64;
            let affine = self.direction(&rows, &energies, &scalings, &scaled, scaled.clone());
            let sigma = (1.0 - point.longest(&affine)).powi(3);
            let mut targets = Vec::with_capacity(scaled.len());
            for (k, scaled) in scaled.iter().enumerate() {
                let (ds, dz) = (scalings[k].invert(&affine.s[k]), scalings[k].apply(&affine.z[k]));
                let mut target = scaled.product(scaled).plus(1.0, &ds.product(&dz));
                target.head -= sigma * mu;
                targets.push(scaled.divide(&target));
            }
            let way = self.direction(&rows, &energies, &scalings, &scaled, targets);
            let step = (TO_BOUNDARY * point.longest(&way)).min(1.0);
            if step.is_nan() || step < STALLED {
                break;
            }
            for (x, dx) in point.x.iter_mut().zip(&way.x) {
                *x += step * dx;
            }
            for (k, disc) in self.discs.iter().enumerate() {
                // From u itself, so that rounding does not pile up.
                point.s[k].tail = disc.offset + self.moved(&point.x, disc);
                point.z[k] = point.z[k].plus(step, &way.z[k]);
            }
            energies = rows.residual(&point.x);
        }
        least.moved = point.x.chunks_exact(2 * d).flat_map(|state| &state[..d]).copied().collect();
        least
    }

    /// The interpolating spline, and the forces that hold it, shared among the points of each knot.
    fn start(&self, rows: &mut Rows) -> Point {
        let x = rows.interpolate();
        let force = rows.transposed(&rows.residual(&x));
        let mut points = vec![0.0; rows.knots()];
        for disc in self.discs {
            points[disc.knot] += 1.0;
        }
        let forces: Vec<DVec3> =
            self.discs.iter().map(|disc| self.moved(&force, disc) / (points[disc.knot] * disc.scale.powi(2))).collect();
        let mean = forces.iter().map(|force| force.length()).sum::<f64>() / self.discs.len().max(1) as f64;
        let dual = |force: &DVec3| Cone { head: force.length() + mean.max(HALF_STRAIGHT), tail: *force };
        let s = self.discs.iter().map(|disc| Cone { head: 1.0, tail: disc.offset }).collect();
        Point { x, s, z: forces.iter().map(dual).collect() }
    }

    /// The Newton step for λ ∘ (W dz + W⁻¹ ds) = −λ ∘ target.
    fn direction(
        &self,
        rows: &Rows,
        energies: &[f64],
        scalings: &[Scaling],
        scaled: &[Cone],
        target: Vec<Cone>,
    ) -> Point {
        let d = self.dimension;
        let mut rhs: Vec<f64> = rows.transposed(energies).iter().map(|x| -x).collect();
        for (k, disc) in self.discs.iter().enumerate() {
            let pull = scalings[k].invert(&target[k].plus(-1.0, &scaled[k]));
            for c in 0..d {
                rhs[2 * d * disc.knot + c] -= disc.scale * pull.tail[c];
            }
        }
        let x = rows.solve(&rhs, |x, out| {
            for (k, disc) in self.discs.iter().enumerate() {
                let moved = Cone { head: 0.0, tail: self.moved(x, disc) };
                let twice = scalings[k].invert(&scalings[k].invert(&moved));
                for c in 0..d {
                    out[2 * d * disc.knot + c] += disc.scale * twice.tail[c];
                }
            }
        });
        let mut way = Point { x, ..Point::default() };
        for (k, disc) in self.discs.iter().enumerate() {
            let s = Cone { head: 0.0, tail: self.moved(&way.x, disc) };
            let sum = target[k].plus(1.0, &scalings[k].invert(&s));
            way.s.push(s);
            way.z.push(Cone::default().plus(-1.0, &scalings[k].invert(&sum)));
        }
        way
    }

    /// The part of a state that a disc sees: the move of its knot, in units of its radius.
    fn moved(&self, x: &[f64], disc: &Disc) -> DVec3 {
        vector(&x[2 * self.dimension * disc.knot..][..self.dimension]) * disc.scale
    }
}
