//! [`Area`]: the area of one planar curve, kept by the method of multipliers.
//!
//! Wanted is the least energy of the area A*, that of the polygon of the points. An open curve is
//! closed by the chord between its ends. The term of the constraint is y(A − A*) + ½ ρ(A − A*)², and
//! the next multiplier is y + ρ(A − A*).
//!
//! For edges e with the first vertex at 0, the area is A = ½ Σ x_j × e_j with x_j = Σ_{i<j} e_i. Its
//! derivative by e_j is ½ J(X − 2x_j − e_j), where X = Σ e_i and J(x, y) = (y, −x). Its second
//! derivative by the vertices j (rows) and j + 1 is ½ (0 1; −1 0). The term ρ ∇A∇Aᵀ of the Hessian is
//! dense, and enters Newton's step by the formula of Sherman and Morrison.

use super::descent::Descent;
use super::edges::Edges;
use super::multipliers::Multipliers;
use super::newton::Newton;
use super::problem::Problem;
use crate::linalg::scalar::{Vector, dot, scale, subtract};
use crate::linalg::{Scalar, operation};

/// The area is kept to this part of itself.
pub(super) const TOLERANCE: f64 = 1e-6;

/// An area counts as at least this part of the disc with the perimeter of the points' polygon.
const LEAST: f64 = 1e-2;

/// ρ of the first round, and the largest, in units of E/A*².
const FIRST: f64 = 10.0;
const MOST: f64 = 1e5;

/// The factor of ρ after a round that left more than this part of the violation.
const FIRMER: f64 = 10.0;
const LEFT: f64 = 0.1;

/// The area that a curve is to enclose, at size 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enclosed {
    pub area: f64,
    /// What its tolerance is relative to.
    unit: f64,
}

impl Enclosed {
    /// The area of a polygon of size 1. The last point is joined to the first.
    pub fn by<const D: usize>(points: &[Vector<f64, D>]) -> Self {
        let edge = |j: usize| -> Vector<f64, D> {
            let (from, to) = (points[j], points[(j + 1) % points.len()]);
            std::array::from_fn(|c| to[c] - from[c])
        };
        let edges: Vec<Vector<f64, D>> = (0..points.len()).map(edge).collect();
        let around: f64 = edges.iter().map(|e| e[0].hypot(e[1])).sum();
        let area = area_of(&edges);
        Enclosed { area, unit: area.abs().max(LEAST * around * around / (4.0 * std::f64::consts::PI)) }
    }

    /// The excess of an area, in units of the tolerance's.
    pub fn excess(&self, area: f64) -> f64 {
        (area - self.area) / self.unit
    }
}

/// ½ Σ x_j × e_j
fn area_of<const D: usize>(edges: &[Vector<f64, D>]) -> f64 {
    let (mut x, mut y, mut twice) = (0.0, 0.0, 0.0);
    for e in edges {
        twice += x * e[1] - y * e[0];
        (x, y) = (x + e[0], y + e[1]);
    }
    0.5 * twice
}

impl<const D: usize> Problem<D> {
    /// The area that the base encloses.
    pub(super) fn enclosed(&self) -> f64 {
        area_of(&self.base)
    }
}

/// y(A − A*) + ½ ρ(A − A*)²
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Enclosing<S> {
    /// A*
    pub area: S,
    /// y
    pub multiplier: S,
    /// ρ, 0 without the constraint.
    pub stiffness: S,
}

/// The multiplier of the area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    wanted: Enclosed,
    /// E/A*²
    unit: f64,
    violation: f64,
}

impl Area {
    /// The constraint on a curve of this energy.
    pub fn new<const D: usize>(wanted: Enclosed, energy: f64, problem: &mut Problem<D>) -> Self {
        let unit = energy / (wanted.unit * wanted.unit);
        problem.enclosing = Enclosing { area: wanted.area, multiplier: 0.0, stiffness: FIRST * unit };
        Area { wanted, unit, violation: f64::INFINITY }
    }
}

impl<const D: usize> Multipliers<D> for Area {
    fn violation(&self) -> f64 {
        self.violation
    }

    fn is_settled(&self) -> bool {
        self.violation <= 0.5 * TOLERANCE
    }

    fn energy(&self, problem: &Problem<D>) -> f64 {
        let Enclosing { area, multiplier, stiffness } = problem.enclosing;
        let excess = problem.enclosed() - area;
        multiplier * excess + 0.5 * stiffness * excess * excess
    }

    fn update(&mut self, problem: &mut Problem<D>) {
        let before = self.violation;
        let area = problem.enclosed();
        self.violation = self.wanted.excess(area).abs();
        let enclosing = &mut problem.enclosing;
        enclosing.multiplier += enclosing.stiffness * (area - enclosing.area);
        if self.violation > LEFT * before && !Multipliers::<D>::is_settled(self) {
            enclosing.stiffness = (FIRMER * enclosing.stiffness).min(MOST * self.unit);
        }
    }
}

impl<S: Scalar, const D: usize> Descent<'_, S, D> {
    /// Adds the constraint's term to the derivatives by edges, and returns its value.
    pub(super) fn enclose(&mut self) -> S {
        S::run(Enclose { edges: &mut self.edges, enclosing: self.enclosing })
    }

    /// Adds what the area's second derivatives have in bands, at the curves where the edges are placed.
    pub(super) fn enclose_newton(&mut self, newton: &mut Newton<S, D>) {
        let Enclosing { area, multiplier, stiffness } = self.enclosing;
        let half = S::of(0.5) * (multiplier + stiffness * (self.edges.enclosed().0 - area));
        let mut block = [[S::ZERO; D]; D];
        (block[0][1], block[1][0]) = (half, -half);
        for j in 0..self.edges.windows::<1>() {
            newton.couple(j, block.map(|row| scale(self.edges.starts::<1>(j), row)));
        }
    }

    /// Turns p = −M⁻¹g into −(M + ρ ∇A∇Aᵀ)⁻¹g, and returns g·p.
    pub(super) fn enclose_direction(&mut self, newton: &mut Newton<S, D>) -> S {
        self.edges.clear();
        self.edges.add_area(S::ONE);
        self.edges.gradient(&self.movable, &mut self.trial);
        self.x.copy_from_slice(&self.trial);
        newton.solve(&mut self.x);
        let (mut along, mut square) = (S::ZERO, S::ZERO);
        for row in 0..self.p.len() {
            along += dot(self.trial[row], self.p[row]);
            square += dot(self.trial[row], self.x[row]);
        }
        let stiffness = self.enclosing.stiffness;
        let share = stiffness * along / (S::ONE + stiffness * square);
        let mut slope = S::ZERO;
        for row in 0..self.p.len() {
            self.p[row] = subtract(self.p[row], scale(share, self.x[row]));
            slope += dot(self.g[row], self.p[row]);
        }
        slope
    }
}

operation! {
    /// [`Descent::enclose`]
    Enclose<'e, S: Scalar; D> { edges: &'e mut Edges<S, D>, enclosing: Enclosing<S> } -> S { edges.enclose(enclosing) }
}

impl<S: Scalar, const D: usize> Edges<S, D> {
    #[inline(always)]
    fn enclose(&mut self, Enclosing { area, multiplier, stiffness }: Enclosing<S>) -> S {
        let excess = self.enclosed().0 - area;
        self.add_area(multiplier + stiffness * excess);
        multiplier * excess + S::of(0.5) * stiffness * excess * excess
    }

    /// The first two components of an edge, 0 where a lane has none.
    #[inline(always)]
    fn planar(&self, j: usize) -> [S; 2] {
        let length = self.starts::<1>(j) * self.length[j];
        [length * self.tangent[j][0], length * self.tangent[j][1]]
    }

    /// A and Σ e.
    #[inline(always)]
    fn enclosed(&self) -> (S, [S; 2]) {
        let (mut at, mut twice) = ([S::ZERO; 2], S::ZERO);
        for j in 0..self.windows::<1>() {
            let e = self.planar(j);
            twice += at[0] * e[1] - at[1] * e[0];
            at = [at[0] + e[0], at[1] + e[1]];
        }
        (S::of(0.5) * twice, at)
    }

    /// Adds the derivatives of the area with a weight.
    #[inline(always)]
    fn add_area(&mut self, weight: S) {
        let (two, half) = (S::of(2.0), S::of(0.5) * weight);
        let (mut at, all) = ([S::ZERO; 2], self.enclosed().1);
        for j in 0..self.windows::<1>() {
            let e = self.planar(j);
            let [x, y] = [0, 1].map(|c| half * (all[c] - two * at[c] - e[c]));
            let mut by_edge = [S::ZERO; D];
            (by_edge[0], by_edge[1]) = (y, -x);
            self.add_by_edge(j, by_edge);
            at = [at[0] + e[0], at[1] + e[1]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::energy::{Functional, bending, length};
    use super::super::plan::{Plan, Solver};
    use super::super::problem::start;
    use super::*;

    /// Unequal edges on a wavy circle, or on a part of it.
    fn problem(closed: bool) -> Problem<2> {
        let at = |k: usize| {
            let (turn, r) = (0.6 * k as f64 + 0.1 * (k * k % 5) as f64, 0.4 + 0.05 * (k * k % 7) as f64);
            [r * turn.cos(), r * turn.sin()]
        };
        let vertices: Vec<[f64; 2]> = (0..9).map(at).collect();
        let mut base: Vec<[f64; 2]> = vertices.windows(2).map(|pair| subtract(pair[1], pair[0])).collect();
        base.extend(closed.then(|| subtract(vertices[0], vertices[8])));
        Problem {
            closed,
            base,
            data: vec![0],
            pinned: if closed { vec![0] } else { vec![0, 8] },
            weights: vec![1.0, 0.3],
            enclosing: Enclosing { area: 0.2, multiplier: -0.7, stiffness: 3.0 },
            gauge: 0.1,
            free: vec![1.0; 9],
            highest: 2.0,
            longest: f64::INFINITY,
            ..Problem::default()
        }
    }

    #[test]
    fn derivatives_of_the_area_are_differences() {
        let energy = bending(2.0) + length();
        let functionals: Vec<&Functional> = energy.terms().iter().map(|(_, functional)| functional).collect();
        let plan = Plan { solver: Solver::Newton, order: 2, gauge: 2 };
        for closed in [false, true] {
            let problem = problem(closed);
            let mut descent = start::<f64, 2>(&plan, &functionals, &[&problem]);
            let mut kept = None;
            let newton = descent.newton(&mut kept);
            descent.begin();
            descent.newton_direction(newton);
            let (p, g) = (descent.p.clone(), descent.g.clone());
            let mut at = |epsilon: f64| {
                for (x, p) in descent.x.iter_mut().zip(&p) {
                    *x = scale(epsilon, *p);
                }
                let energy = descent.evaluate().0;
                (energy, descent.trial.clone())
            };
            let h = 1e-4;
            let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|steps| at(steps * h));
            let slope: f64 = g.iter().zip(&p).map(|(g, p)| dot(*g, *p)).sum();
            let found = (8.0 * (c.0 - b.0) - (d.0 - a.0)) / (12.0 * h);
            assert!((found - slope).abs() < 1e-8 * slope.abs(), "closed {closed}: {found} {slope}");
            // p = −H⁻¹g, so the gradient changes by −g along p.
            for row in 0..problem.vertices() {
                for k in 0..2 {
                    let second = (8.0 * (c.1[row][k] - b.1[row][k]) - (d.1[row][k] - a.1[row][k])) / (12.0 * h);
                    assert!((second + g[row][k]).abs() < 1e-7, "closed {closed}, vertex {row}: {second} {:?}", g[row]);
                }
            }
        }
    }

    #[test]
    fn areas_have_signs_and_open_polygons_are_closed_by_chords() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        assert_eq!(Enclosed::by(&square).area, 4.0);
        assert_eq!(Enclosed::by(&square[..3]).area, 2.0);
        let backwards: Vec<[f64; 2]> = square.iter().rev().copied().collect();
        assert_eq!(Enclosed::by(&backwards).area, -4.0);
        let zigzag = [[0.0, 0.0], [1.0, 1.0], [2.0, -1.0], [3.0, 0.0]];
        let enclosed = Enclosed::by(&zigzag);
        assert!(enclosed.area == 0.0 && enclosed.excess(1e-3) < 0.1, "{enclosed:?}");
    }
}
