//! [`Refiner`]: all rounds of a rule on one grid, on the CPU.

use faircurve_dct::Transformed;
use rustc_hash::FxHashMap;

use super::exact::Exact;
use super::stencil::{Axis, Stencils};
use super::{Rule, sparse};
use crate::linalg::Real;
use crate::parallel;

/// A rule prepared for grids of some shapes and for some rounds.
pub(super) struct Refiner<S> {
    rounds: u32,
    plans: Plans<S>,
}

enum Plans<S> {
    Exact(FxHashMap<[usize; 2], Exact<S>>),
    Sparse { least: usize, stencils: FxHashMap<[Axis; 2], Stencils<S>> },
}

/// Rows and columns after some rounds. `None` if they are too large for a number.
pub(super) fn refined(shape: [usize; 2], rounds: u32) -> Option<[usize; 2]> {
    let refine = |points: usize| match points {
        0 => Some(0),
        _ => (points - 1).checked_mul(1usize.checked_shl(rounds)?)?.checked_add(1),
    };
    let [rows, columns] = shape;
    Some([refine(rows)?, refine(columns)?])
}

/// Rows and columns after one round, for shapes that are known to have fitted into memory.
fn next(shape: [usize; 2]) -> [usize; 2] {
    shape.map(|points| 2 * points - 1)
}

/// Whether a grid has one row or column. New points are then midpoints.
pub(super) fn is_line(shape: [usize; 2]) -> bool {
    shape.contains(&1)
}

impl<S: Real + Transformed> Refiner<S> {
    pub fn new(rule: &Rule, shapes: &[[usize; 2]], rounds: u32) -> Self {
        let mut planner = S::planner();
        let mut plans = match rule {
            Rule::Exact => Plans::Exact(FxHashMap::default()),
            Rule::Sparse(rule) => Plans::Sparse { least: rule.least_intervals(), stencils: FxHashMap::default() },
        };
        for &shape in shapes {
            if shape.contains(&0) || is_line(shape) {
                continue;
            }
            for shape in std::iter::successors(Some(shape), |&shape| Some(next(shape))).take(rounds as usize) {
                match (&mut plans, rule) {
                    (Plans::Exact(exact), _) => {
                        exact.entry(shape).or_insert_with(|| Exact::new(shape, planner.as_mut()));
                    }
                    (Plans::Sparse { least, stencils }, Rule::Sparse(rule)) => {
                        let axes = shape.map(|points| Axis::of(points - 1, *least));
                        stencils.entry(axes).or_insert_with(|| Stencils::new(rule, axes));
                    }
                    (Plans::Sparse { .. }, Rule::Exact) => unreachable!("plans are of the rule"),
                }
            }
        }
        Refiner { rounds, plans }
    }

    /// All rounds on one grid that has points. `fine` has the size of the last round's grid.
    pub fn refine(&self, dimension: usize, shape: [usize; 2], values: &[S], fine: &mut [S]) {
        if self.rounds == 0 {
            fine.copy_from_slice(values);
            return;
        }
        let mut shape = shape;
        let mut held: Option<Vec<S>> = None;
        for _ in 1..self.rounds {
            let [rows, columns] = next(shape);
            let mut new = vec![S::ZERO; rows * columns * dimension];
            self.round(dimension, shape, held.as_deref().unwrap_or(values), &mut new);
            held = Some(new);
            shape = [rows, columns];
        }
        self.round(dimension, shape, held.as_deref().unwrap_or(values), fine);
    }

    fn round(&self, dimension: usize, shape: [usize; 2], coarse: &[S], fine: &mut [S]) {
        if is_line(shape) {
            return halve(dimension, coarse, fine);
        }
        match &self.plans {
            Plans::Exact(plans) => {
                each_coordinate(dimension, coarse, fine, |coarse, fine| plans[&shape].subdivide(coarse, fine));
            }
            Plans::Sparse { least, stencils } => {
                let axes = shape.map(|points| Axis::of(points - 1, *least));
                sparse::subdivide(&stencils[&axes], dimension, shape, coarse, fine);
            }
        }
    }
}

/// Inserts midpoints.
fn halve<S: Real>(dimension: usize, coarse: &[S], fine: &mut [S]) {
    let half = S::from_f64(0.5);
    for (k, point) in coarse.chunks_exact(dimension).enumerate() {
        fine[2 * k * dimension..][..dimension].copy_from_slice(point);
    }
    for (k, pair) in coarse.windows(2 * dimension).step_by(dimension).enumerate() {
        for c in 0..dimension {
            // The sum of halves does not overflow.
            fine[(2 * k + 1) * dimension + c] = half * pair[c] + half * pair[dimension + c];
        }
    }
}

/// Applies an operation to each coordinate.
fn each_coordinate<S: Real>(dimension: usize, coarse: &[S], fine: &mut [S], operation: impl Fn(&[S], &mut [S]) + Sync) {
    if dimension == 1 {
        return operation(coarse, fine);
    }
    let planes: Vec<Vec<S>> = parallel::map(dimension, 1, |c| {
        let coarse: Vec<S> = coarse.iter().skip(c).step_by(dimension).copied().collect();
        let mut plane = vec![S::ZERO; fine.len() / dimension];
        operation(&coarse, &mut plane);
        plane
    });
    for (k, point) in fine.chunks_exact_mut(dimension).enumerate() {
        for (x, plane) in point.iter_mut().zip(&planes) {
            *x = plane[k];
        }
    }
}
