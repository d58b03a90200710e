//! Least bending within a distance of every data point: min ∫|p″|² over the curves with |p(t_i) −
//! y_i| ≤ D, for one curve.
//!
//! The least curve is a cubic spline with knots at the data. It is sought by its values g_k = y_k +
//! D u_k and slopes m_k at the knots: over a span of length h the energy is that of the two numbers
//! a coordinate
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

use super::tube_rows::Rows;

/// The gap, relative to the energy, at which a curve is the least one.
pub(super) const GAP: f64 = 1e-8;

/// An energy below this many D²/T³ is that of a straight line: a curve with ∫|p″|² = e D²/T³ is
/// within √e D of one. Gaps are measured in the energy or in this, whichever is larger; or they are
/// those that rounding makes.
const STRAIGHT: f64 = 1e-8;

/// Iterations at most; 5 to 30 are usual, and more gain nothing once rounding stops the steps.
const MAX_ITERATIONS: u32 = 100;

/// Share of the way to the boundary of the cones that is taken.
const TO_BOUNDARY: f64 = 0.99;

/// Steps shorter than this have stalled.
const STALLED: f64 = 1e-6;

/// A data point: the knot that it holds, and its offset, centre of the knot minus point, in units
/// of D: shorter than 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub knot: usize,
    pub offset: [f64; 3],
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

/// What was found.
#[derive(Clone, Debug)]
pub(super) struct Least {
    /// u at every knot: the curve minus the centre, in units of D.
    pub moved: Vec<f64>,
    pub iterations: u32,
    /// By how much the energy may exceed the least there is, relative to it.
    pub gap: f64,
    pub converged: bool,
}

/// A vector in the space of a cone: one number and a vector.
#[derive(Clone, Copy, Debug, Default)]
struct Cone {
    head: f64,
    tail: [f64; 3],
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Cone {
    fn dot(&self, other: &Cone) -> f64 {
        self.head * other.head + dot(&self.tail, &other.tail)
    }

    /// `self + factor · other`.
    fn plus(&self, factor: f64, other: &Cone) -> Cone {
        let mut sum = *self;
        sum.head += factor * other.head;
        sum.tail.iter_mut().zip(&other.tail).for_each(|(x, y)| *x += factor * y);
        sum
    }

    /// head² − |tail|²: positive inside.
    fn inside(&self) -> f64 {
        let length = dot(&self.tail, &self.tail).sqrt();
        (self.head - length) * (self.head + length)
    }

    /// The product of the cone's algebra.
    fn product(&self, other: &Cone) -> Cone {
        let tail = std::array::from_fn(|c| self.head * other.tail[c] + other.head * self.tail[c]);
        Cone { head: self.dot(other), tail }
    }

    /// x with `self` ∘ x = other.
    fn divide(&self, other: &Cone) -> Cone {
        let head = (self.head * other.head - dot(&self.tail, &other.tail)) / self.inside();
        Cone { head, tail: std::array::from_fn(|c| (other.tail[c] - head * self.tail[c]) / self.head) }
    }

    /// The longest step, 1 at most, that stays inside.
    fn step(&self, way: &Cone) -> f64 {
        let (a, half, c) = (way.inside(), self.head * way.head - dot(&self.tail, &way.tail), self.inside());
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
        let tail = std::array::from_fn(|c| (s.tail[c] / of_s - z.tail[c] / of_z) / (2.0 * gamma));
        // On the hyperboloid head² − |tail|² = 1 whatever rounding did.
        let point = Cone { head: (1.0 + dot(&tail, &tail)).sqrt(), tail };
        Scaling { size: (of_s / of_z).sqrt(), point }
    }

    /// W x, or with `sign` −1 and the size's inverse W⁻¹ x.
    fn times(&self, x: &Cone, size: f64, sign: f64) -> Cone {
        let across = sign * dot(&self.point.tail, &x.tail);
        let factor = sign * (x.head + across / (1.0 + self.point.head));
        Cone {
            head: size * (self.point.head * x.head + across),
            tail: std::array::from_fn(|c| size * (x.tail[c] + factor * self.point.tail[c])),
        }
    }

    fn apply(&self, x: &Cone) -> Cone {
        self.times(x, self.size, 1.0)
    }

    fn invert(&self, x: &Cone) -> Cone {
        self.times(x, 1.0 / self.size, -1.0)
    }
}

impl Tube<'_> {
    /// The least curve. Centres must be within the discs.
    pub fn least(&self) -> Least {
        let d = self.dimension;
        let mut rows = Rows::new(d, self.closed, self.held, self.spans, self.centres);
        let knots = rows.knots();
        // The interpolating spline, and the forces that hold it: shared among the points of each
        // knot.
        let mut x = rows.interpolate();
        let mut energies = rows.residual(&x);
        let force = rows.transposed(&energies);
        let mut points = vec![0.0; knots];
        self.discs.iter().for_each(|disc| points[disc.knot] += 1.0);
        let mut s: Vec<Cone> = self.discs.iter().map(|disc| Cone { head: 1.0, tail: disc.offset }).collect();
        let forces = |disc: &Disc| {
            let at = |c: usize| if c < d { force[2 * d * disc.knot + c] / points[disc.knot] } else { 0.0 };
            std::array::from_fn::<f64, 3, _>(at)
        };
        let strength = |disc: &Disc| dot(&forces(disc), &forces(disc)).sqrt();
        let mean = self.discs.iter().map(strength).sum::<f64>() / self.discs.len().max(1) as f64;
        let straight = STRAIGHT * 0.5;
        let rounding = rows.rounding();
        let dual = |disc: &Disc| Cone { head: strength(disc) + mean.max(straight), tail: forces(disc) };
        let mut z: Vec<Cone> = self.discs.iter().map(dual).collect();
        let mut scalings = vec![Scaling::default(); s.len()];
        let mut scaled = vec![Cone::default(); s.len()];
        let mut least = Least { moved: Vec::new(), iterations: 0, gap: f64::INFINITY, converged: false };
        loop {
            let energy = 0.5 * energies.iter().map(|e| e * e).sum::<f64>();
            let gap: f64 = s.iter().zip(&z).map(|(s, z)| s.dot(z)).sum();
            least.gap = gap / energy.max(straight);
            least.converged = gap <= (GAP * energy.max(straight)).max(rounding);
            if least.converged || least.iterations == MAX_ITERATIONS || !gap.is_finite() {
                break;
            }
            least.iterations += 1;
            for (k, (s, z)) in s.iter().zip(&z).enumerate() {
                scalings[k] = Scaling::new(s, z);
                scaled[k] = scalings[k].apply(z);
            }
            rows.factor(self.discs.iter().zip(&scalings).map(|(disc, scaling)| (disc.knot, scaling.rows())));
            // Where complementarity alone would lead; then, with what that leaves and towards the
            // centre.
            let mu = gap / s.len() as f64;
            let affine = self.direction(&rows, &energies, &scalings, &scaled, scaled.clone());
            let reach = longest(&s, &z, &affine);
            let sigma = (1.0 - reach).powi(3);
            let targets = (0..s.len()).map(|k| {
                let (ds, dz) = (scalings[k].invert(&affine.s[k]), scalings[k].apply(&affine.z[k]));
                let mut target = scaled[k].product(&scaled[k]).plus(1.0, &ds.product(&dz));
                target.head -= sigma * mu;
                scaled[k].divide(&target)
            });
            let targets = targets.collect();
            let way = self.direction(&rows, &energies, &scalings, &scaled, targets);
            let step = (TO_BOUNDARY * longest(&s, &z, &way)).min(1.0);
            if step.is_nan() || step < STALLED {
                break;
            }
            x.iter_mut().zip(&way.x).for_each(|(x, dx)| *x += step * dx);
            for (k, disc) in self.discs.iter().enumerate() {
                // From u itself, so that rounding does not pile up.
                for c in 0..d {
                    s[k].tail[c] = disc.offset[c] + x[2 * d * disc.knot + c];
                }
                z[k] = z[k].plus(step, &way.z[k]);
            }
            energies = rows.residual(&x);
        }
        least.moved = x.chunks_exact(2 * d).flat_map(|state| state[..d].iter().copied()).collect();
        least
    }

    /// The Newton step for λ ∘ (W dz + W⁻¹ ds) = −λ ∘ target.
    fn direction(
        &self,
        rows: &Rows,
        energies: &[f64],
        scalings: &[Scaling],
        scaled: &[Cone],
        target: Vec<Cone>,
    ) -> Way {
        let d = self.dimension;
        let mut rhs = rows.transposed(energies);
        rhs.iter_mut().for_each(|x| *x = -*x);
        for (k, disc) in self.discs.iter().enumerate() {
            let pull = scalings[k].invert(&target[k].plus(-1.0, &scaled[k]));
            (0..d).for_each(|c| rhs[2 * d * disc.knot + c] -= pull.tail[c]);
        }
        let x = rows.solve(&rhs, |x, out| {
            for (k, disc) in self.discs.iter().enumerate() {
                let twice = scalings[k].invert(&scalings[k].invert(&self.at(x, disc)));
                (0..d).for_each(|c| out[2 * d * disc.knot + c] += twice.tail[c]);
            }
        });
        let s: Vec<Cone> = self.discs.iter().map(|disc| self.at(&x, disc)).collect();
        let dual = |k: usize| {
            let sum = target[k].plus(1.0, &scalings[k].invert(&s[k]));
            Cone::default().plus(-1.0, &scalings[k].invert(&sum))
        };
        let z = (0..s.len()).map(dual).collect();
        Way { x, s, z }
    }

    /// The part of a state that a disc sees.
    fn at(&self, x: &[f64], disc: &Disc) -> Cone {
        let d = self.dimension;
        Cone { head: 0.0, tail: std::array::from_fn(|c| if c < d { x[2 * d * disc.knot + c] } else { 0.0 }) }
    }
}

/// A direction in all unknowns.
struct Way {
    x: Vec<f64>,
    s: Vec<Cone>,
    z: Vec<Cone>,
}

/// The longest step, 1 at most, that keeps all points in their cones.
fn longest(s: &[Cone], z: &[Cone], way: &Way) -> f64 {
    let of = |points: &[Cone], ways: &[Cone]| points.iter().zip(ways).map(|(x, way)| x.step(way)).fold(1.0, f64::min);
    of(s, &way.s).min(of(z, &way.z))
}

impl Scaling {
    /// W⁻¹ for vectors without a head: d + 1 rows of d numbers, of which those beyond are not read.
    fn rows(&self) -> [[f64; 3]; 4] {
        let columns: [Cone; 3] = std::array::from_fn(|c| {
            let mut unit = Cone::default();
            unit.tail[c] = 1.0;
            self.invert(&unit)
        });
        std::array::from_fn(|r| columns.map(|column| if r == 0 { column.head } else { column.tail[r - 1] }))
    }
}
