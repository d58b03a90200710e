//! [`Area`]: the multiplier that keeps the area enclosed by one planar curve.
//!
//! The method of multipliers finds the least energy among curves with the data polygon's area. The
//! next multiplier of the [term](super::enclosed) is y + ρ(A − A*).

use super::enclosed::{Enclosed, Enclosing, area_of};
use super::multipliers::Multipliers;
use super::problem::Problem;

/// The relative tolerance of the area.
pub(super) const TOLERANCE: f64 = 1e-6;

/// The initial and the largest ρ, in units of E/A*².
const INITIAL_PENALTY: f64 = 10.0;
const MOST_PENALTY: f64 = 1e5;

/// The factor by which ρ grows after a round that leaves more than [`LEFT`] of the violation.
const PENALTY_GROWTH: f64 = 10.0;
const LEFT: f64 = 0.1;

impl<const D: usize> Problem<D> {
    /// The area that the base encloses.
    pub(super) fn enclosed(&self) -> f64 {
        area_of(&self.base)
    }
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
    /// The constraint on a curve with this energy at its start.
    pub fn new<const D: usize>(wanted: Enclosed, energy: f64, problem: &mut Problem<D>) -> Self {
        let unit = energy / (wanted.unit * wanted.unit);
        problem.enclosing = Enclosing { area: wanted.area, multiplier: 0.0, stiffness: INITIAL_PENALTY * unit };
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
            enclosing.stiffness = (PENALTY_GROWTH * enclosing.stiffness).min(MOST_PENALTY * self.unit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::energy::{Functional, bending, length};
    use super::super::plan::{Plan, Solver};
    use super::super::problem::start;
    use super::*;
    use crate::linalg::scalar::{dot, scale, subtract};

    /// Unequal edges on a wavy circle, or on an arc of it.
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
            regularisation: 0.1,
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
        let plan = Plan { solver: Solver::Newton, order: 2, regularisation: 2 };
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
            for (row, g) in g.iter().enumerate().take(problem.vertices()) {
                for k in 0..2 {
                    let second = (8.0 * (c.1[row][k] - b.1[row][k]) - (d.1[row][k] - a.1[row][k])) / (12.0 * h);
                    assert!((second + g[k]).abs() < 1e-7, "closed {closed}, vertex {row}: {second} {g:?}");
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
