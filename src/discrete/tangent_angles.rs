//! Descents of rough planar curves of least variation in the tangent angles of their edges.
//!
//! On rough data Newton's method at the vertices may fail: loops that have to grow and to turn do
//! so in many small steps. Angles allow large ones. The unknowns are the angle of every edge and
//! the logarithm of the edge length of every span, subject to closure: every span leads from its
//! first point to its last. Steps solve
//!
//! ```text
//! (H + λM  Jᵀ) (p)   (−g)
//! (J       0 ) (μ) = (−c)
//! ```
//!
//! with the Hessian H of the Lagrangian (the energy plus the multipliers times the closures c) and
//! the metric M of second differences of angles. After a step the least correction closes the curve
//! again. λ grows if the matrix has the wrong inertia.
//!
//! The first stage minimises bending with length, whose minimum is near the one of the energy. The
//! result is a start for [`Newton`](super::newton)'s method at the vertices, which finds a minimum
//! of the exact energy. The two differ: here the edges of a span are exactly equal, and there the
//! regularisation makes them equal up to O(h²).
//!
//! All of this runs on the host in f64, on every device: few curves need it, and it needs sines.

mod closure;
mod functional;
mod search;
mod shape;
#[cfg(test)]
mod tests;

use functional::Functional;
pub(super) use search::Ending;
use search::{Search, Stage};
use shape::Shape;

use super::energy::Energy;
use super::problem::Problem;
use crate::linalg::scalar::Vector;

/// The tolerance of the stage of bending with length.
const NEAR: f64 = 1e-2;

/// The most iterations of the stage of bending with length.
const NEAR_ITERATIONS: u32 = 25;

/// The tolerance for the energy itself. From there two or three iterations at the vertices suffice.
const NEARER: f64 = 1e-6;

/// A planar curve that can be descended by its angles.
pub(super) struct Angles {
    shape: Shape,
    start: shape::Curve,
    functional: Functional,
}

/// The result of a descent by angles.
pub(super) struct Found<const D: usize> {
    pub ending: Ending,
    /// The displacements of the vertices from the base, valid if a curve was found.
    pub displacements: Vec<Vector<f64, D>>,
    pub iterations: u32,
    pub trials: u32,
}

impl Angles {
    /// A problem in angles.
    ///
    /// `None` unless the curve is planar and interpolates all its data points, without given
    /// tangents and limits, and the energy is a sum of variation, bending of exponent 2, length,
    /// tautness and tension.
    pub fn of<const D: usize>(energy: &Energy, problem: &Problem<D>) -> Option<Angles> {
        // Variation is of order 3.
        if energy.order() < 3 {
            return None;
        }
        let (shape, start) = Shape::of(problem)?;
        let functional = Functional::of(energy, &problem.weights, &problem.taut, &shape)?;
        (functional.variation > 0.0).then_some(Angles { shape, start, functional })
    }

    /// The length of the data polygon.
    pub fn chord(&self) -> f64 {
        self.shape.chord()
    }

    /// Descends in at most this many iterations.
    pub fn descend<const D: usize>(&self, problem: &Problem<D>, most_iterations: u32) -> Found<D> {
        let spans = self.shape.spans.len();
        let chord = self.shape.chord() / spans as f64;
        // Length and bending have equal weight in a span of the mean chord.
        let near = Functional { bending: 1.0, length: vec![1.0 / (chord * chord); spans], ..Functional::default() };
        let mut search = Search::new(&self.shape, self.start.clone());
        let (tolerance, longest) = (NEAR, f64::INFINITY);
        let most = NEAR_ITERATIONS.min(most_iterations);
        search.descend(&Stage { functional: &near, order: 1, tolerance, longest, most_iterations: most });
        let (tolerance, longest) = (NEARER, problem.longest);
        let most = most_iterations - search.iterations;
        let functional = &self.functional;
        let ending = search.descend(&Stage { functional, order: 2, tolerance, longest, most_iterations: most });
        let (iterations, trials) = (search.iterations, search.trials);
        Found { ending, displacements: self.displacements(&search.curve, problem), iterations, trials }
    }

    fn displacements<const D: usize>(&self, curve: &shape::Curve, problem: &Problem<D>) -> Vec<Vector<f64, D>> {
        let mut all = vec![[0.0; D]; problem.vertices()];
        let edges: Vec<[f64; 2]> = curve.edges(&self.shape).collect();
        for span in &self.shape.spans {
            // Data points stay exactly in place, without the rounding of sums.
            for j in span.start..span.end - 1 {
                all[j + 1] = std::array::from_fn(|c| all[j][c] + edges[j][c] - problem.base[j][c]);
            }
        }
        all
    }
}
